#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/geometry.h"
#include "core/base/workers.h"
#include "core/linalg/solve_kernel.h"

namespace lpdeform {

/// A Cholesky factor L of a permuted matrix, P A P^T = L L^T, in single precision. It takes half the memory of a double
/// factor and solves three right-hand sides at once with vector instructions. Accurate to about seven digits: use it
/// for metrics (preconditioners), not for final results. Columns with the same pattern are grouped as supernodes.
///
/// Several threads solve with large factors: different subtrees of the elimination tree are independent below their
/// common ancestors. Small subtrees come first, then what larger ones have above these, and so on: see Stage. Each
/// branch accumulates its contributions to later ancestors in memory of its own, and these contributions are added up
/// in a fixed order, which gives the same bits on any number of threads.
class SingleFactor {
 public:
  // A backend fills it by begin(), add_supernode() in ascending order, and finish().

  /// Starts a factor of a matrix of this size, with about `value_count` entries.
  void begin(const std::int32_t* new_to_old, std::size_t size, std::size_t value_count);

  /// Adds the next `columns` columns; their pattern is a full triangle and, below it, `rows`. `value(r, c)` is the
  /// entry in row r and column c. r counts the rows of the triangle first, then `rows`.
  template <typename Value>
  void add_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count,
                     const Value& value) {
    float* to = new_supernode(columns, rows, row_count);
    for (std::size_t r = 0; r < columns + row_count; ++r) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c, ++to) {
        *to = r < c ? 0.0f : static_cast<float>(r == c ? 1 / value(r, c) : value(r, c));
      }
    }
  }

  void finish();

  /// Frees the values; the pattern stays.
  void free_values() { std::vector<float>().swap(values_); }
  /// What they take if they have been freed; else 0.
  std::size_t freed_bytes() const { return values_.empty() ? value_count() * sizeof(float) : 0; }

  bool empty() const { return new_to_old_.empty(); }
  /// Makes the factor empty; keeps the memory.
  void clear() { new_to_old_.clear(); }

  /// x = factor * A^-1 b. x may be b. One caller at a time.
  void solve(const Points& b, Points& x, const Workers& workers, double factor = 1) const;
  void solve(const Points& b, SinglePoints& x, const Workers& workers, double factor = 1) const;

  const std::vector<std::int32_t>& new_to_old() const { return new_to_old_; }

  std::size_t memory_bytes() const;

 private:
  friend class SingleCholesky;                          // computes the values in place
  using Range = std::pair<std::int32_t, std::int32_t>;  // of supernodes: first and last
  /// Supernodes that one thread solves, ascending: parts of subtrees that no other branch of its stage has a part of.
  struct Branch {
    std::vector<Range> nodes;
    std::vector<std::int32_t>
        owed;  // rows of ancestors in no branch or in one of a later stage, to which it adds
  };
  /// Branches that are independent of each other once the earlier stages are done.
  using Stage = std::vector<Branch>;
  double largest_entry(const Points& b, const Workers& workers) const;
  template <typename Result>
  void solve_to(const Points& b, Result& x, const Workers& workers, double factor) const;
  std::vector<std::int32_t> node_of_columns() const;
  std::vector<std::int32_t> parents() const;
  void cut_stages();
  std::size_t send_elsewhere(Branch& branch, std::size_t begin);
  void solve_forward(std::int32_t first, std::int32_t last) const;
  void solve_backward(std::int32_t first, std::int32_t last) const;
  float* new_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count);
  std::size_t value_count() const;
  void need_values();

  std::vector<std::int32_t> new_to_old_;
  std::vector<Supernode> supernodes_;
  std::vector<std::int32_t> rows_;
  /// Per supernode: the triangle's rows at full width, then the rows below it, all row-major; diagonal entries are
  /// inverted.
  std::vector<float> values_;
  std::int32_t next_column_ = 0;
  std::vector<Stage> stages_;               // none for a small factor
  std::vector<Range> trunk_;                // the supernodes that are not in the first stage
  std::vector<Range> top_;                  // those that are in no stage
  std::vector<std::int32_t> forward_rows_;  // rows_, but what a branch owes is its places in work_
  mutable std::vector<double> chunk_maxima_;
  mutable std::vector<SolveRow> work_;  // one for each column, then one for each row owed by each branch
};

}  // namespace lpdeform
