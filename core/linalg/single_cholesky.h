#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/linalg/cholesky.h"
#include "core/linalg/single_factor.h"
#include "core/linalg/supernode_kernel.h"

namespace lpdeform {

/// Cholesky factorisation in single precision of symmetric positive definite matrices of one pattern, by
/// several threads: about seven digits, a quarter of the double factorisation's time and half its memory. For
/// metrics, not for answers. Left-looking over supernodes; what different subtrees of the elimination tree
/// compute is independent, and above them the rows of a supernode are. The same bits on any number of threads.
class SingleCholesky {
 public:
  /// `pattern` and what analyse_supernodes() found for it.
  SingleCholesky(const LowerMatrix& pattern, const SupernodePattern& supernodes);

  /// False where a pivot is not above 1e-6 of its diagonal entry: nothing of the pivot's value would be left.
  /// result() must not be used then.
  [[nodiscard]] bool factor(const LowerMatrix& matrix, const Workers& workers);

  const SingleFactor& result() const { return factor_; }

  std::size_t memory_bytes() const;

 private:
  /// Rows `begin` on of an eliminated supernode change a later one: `count` of them are its columns.
  struct Update {
    std::int32_t from, begin, count;
  };
  /// An entry of the matrix and its place in the factor.
  struct Entry {
    std::int32_t source;
    std::uint32_t target;  // counted from the supernode's first value
  };
  /// What one thread needs, kept from call to call.
  struct Scratch {
    std::vector<std::int32_t> place;  // of a row of the matrix in the present block
    std::vector<float> packed, lowest;
    SolvingTriangle triangle;
  };
  static Scratch& scratch_of_thread();
  void find_updates();
  void find_entries(const LowerMatrix& pattern);
  void load(std::size_t node, const LowerMatrix& matrix, Scratch& own);
  void update_rows(std::size_t node, std::size_t begin, std::size_t end,
                   const std::vector<std::int32_t>& place);
  bool eliminate(std::size_t node, const LowerMatrix& matrix, const Workers& workers, Scratch& own);

  SingleFactor factor_;
  std::vector<std::int32_t> old_to_new_;
  std::vector<Update> updates_;
  std::vector<std::size_t> first_update_;  // of each supernode, and the end
  std::vector<double> update_work_;        // of each supernode: multiplications
  std::vector<Entry> entries_;
  std::vector<std::size_t> first_entry_;
  Scratch trunk_;  // not a thread's: one that waits for others may take up another factorisation
};

}  // namespace lpdeform
