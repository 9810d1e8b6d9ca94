#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/linalg/cholesky.h"
#include "core/linalg/single_factor.h"
#include "core/linalg/supernode_kernel.h"

namespace lpdeform {

/// Multithreaded Cholesky factorisation in single precision of symmetric positive definite matrices with the same
/// pattern: about seven digits, a quarter of the time and half the memory of the double factorisation. Use it for
/// metrics (preconditioners), not for final results. Left-looking over supernodes. Threads work on different subtrees
/// of the elimination tree and, above these, on different rows of a supernode. The same bits on any number of threads.
class SingleCholesky {
 public:
  /// `supernodes` is the result of analyse_supernodes() for the matrices' pattern.
  explicit SingleCholesky(const SupernodePattern& supernodes);

  /// False if a pivot is not above 1e-6 of its diagonal entry, because no correct digit of the pivot would be left.
  /// Then result() must not be used. Up to `most_raised` such pivots, if they are not below -1e-6 of it, are raised to 1e-6 of it instead: the
  /// factor is then that of a matrix with as many larger diagonal entries.
  [[nodiscard]] bool factor(const SymmetricRows& matrix, const Workers& workers, int most_raised = 0);

  const SingleFactor& result() const { return factor_; }
  /// Frees the values of the factor until the next factor().
  void free_values() { factor_.free_values(); }
  std::size_t freed_bytes() const { return factor_.freed_bytes(); }

  std::size_t memory_bytes() const;

 private:
  /// An update of a later supernode by the rows of an eliminated one, `from`, starting at row `begin`; the first
  /// `count` of these rows are columns of the later supernode.
  struct Update {
    std::int32_t from, begin, count;
  };
  /// The workspace of one thread, kept between calls.
  struct Scratch {
    std::vector<std::int32_t> place;  // position of each row of the matrix in the current block
    std::vector<SymmetricRows::Entry> row;
    std::vector<float> packed, lowest;
    SolvingTriangle triangle;
  };
  static Scratch& scratch_of_thread();
  void find_updates();
  void load(std::size_t node, const SymmetricRows& matrix, Scratch& own);
  void update_rows(std::size_t node, std::size_t begin, std::size_t end,
                   const std::vector<std::int32_t>& place);
  bool eliminate(std::size_t node, const SymmetricRows& matrix, const Workers& workers,
                 std::atomic<int>& raisable, Scratch& own);

  SingleFactor factor_;
  std::vector<std::int32_t> old_to_new_;
  std::vector<Update> updates_;
  std::vector<std::size_t> first_update_;  // of each supernode; the last entry is the end
  std::vector<double> update_work_;        // of each supernode: multiplications
  Scratch trunk_;  // not shared with scratch_of_thread(): a waiting thread may start on another factorisation
};

}  // namespace lpdeform
