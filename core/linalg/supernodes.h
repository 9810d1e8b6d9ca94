#pragma once

#include <cstdint>
#include <vector>

#include "core/linalg/cholesky.h"

namespace lpdeform {

/// The columns of a factor, grouped: column j depends on parents[j], and column j has counts[j] entries with its
/// diagonal. Indices are in the new order, in which every column's descendants stand directly before it.
struct EliminationTree {
  std::vector<std::int32_t> new_to_old;
  std::vector<std::int32_t> parents;  // -1: a root
  std::vector<std::int32_t> counts;
};

/// A fill-reducing order by approximate minimum degree, its elimination tree (Liu 1990) and the sizes of the factor's
/// columns (Gilbert, Ng and Peyton 1994). Almost linear in the entries of the matrix.
EliminationTree eliminate(const LowerMatrix& pattern);

/// The columns of the tree in supernodes. A supernode takes in its last child where that adds few explicit zeros, since
/// wide blocks are faster (relaxed supernodes, Ashcraft and Grimes 1989).
std::vector<std::int32_t> group_columns(const EliminationTree& tree);

}  // namespace lpdeform
