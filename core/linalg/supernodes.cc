#include "core/linalg/supernodes.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

/// The neighbours of each column, without the diagonal.
struct Graph {
  std::vector<std::int32_t> begins, neighbours;

  std::int32_t size() const { return static_cast<std::int32_t>(begins.size()) - 1; }
};

/// The graph of the matrix with its columns in a new order. Neighbours ascend.
Graph graph_of(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old) {
  const std::int32_t n = pattern.size();
  std::vector<std::int32_t> old_to_new(n);
  for (std::int32_t i = 0; i < n; ++i) old_to_new[new_to_old[i]] = i;
  Graph graph;
  graph.begins.assign(n + 1, 0);
  const auto for_edges = [&](const auto& body) {
    for (std::int32_t j = 0; j < n; ++j) {
      for (std::int32_t e = pattern.columns[j] + 1; e < pattern.columns[j + 1]; ++e)
        body(old_to_new[j], old_to_new[pattern.rows[e]]);
    }
  };
  for_edges([&](std::int32_t a, std::int32_t b) { ++graph.begins[a + 1], ++graph.begins[b + 1]; });
  std::partial_sum(graph.begins.begin(), graph.begins.end(), graph.begins.begin());
  graph.neighbours.resize(graph.begins.back());
  std::vector<std::int32_t> next(graph.begins.begin(), graph.begins.end() - 1);
  for_edges([&](std::int32_t a, std::int32_t b) {
    graph.neighbours[next[a]++] = b;
    graph.neighbours[next[b]++] = a;
  });
  for (std::int32_t j = 0; j < n; ++j)
    std::sort(graph.neighbours.begin() + graph.begins[j], graph.neighbours.begin() + graph.begins[j + 1]);
  return graph;
}

std::vector<std::int32_t> minimum_degree_order(const LowerMatrix& pattern) {
  using Sparse = Eigen::SparseMatrix<float, Eigen::ColMajor, std::int32_t>;
  const std::vector<float> ones(pattern.rows.size(), 1.0f);
  const Eigen::Map<const Sparse> lower(pattern.size(), pattern.size(),
                                       static_cast<Eigen::Index>(pattern.rows.size()), pattern.columns.data(),
                                       pattern.rows.data(), ones.data());
  Eigen::AMDOrdering<std::int32_t>::PermutationType order;
  Eigen::AMDOrdering<std::int32_t>()(Sparse(lower).selfadjointView<Eigen::Lower>(), order);
  return {order.indices().data(), order.indices().data() + order.indices().size()};
}

/// Liu's algorithm: the parent of a column is the first later column that its elimination changes.
std::vector<std::int32_t> parents_of(const Graph& graph) {
  std::vector<std::int32_t> parents(graph.size(), -1), ancestors(graph.size(), -1);
  for (std::int32_t j = 0; j < graph.size(); ++j) {
    for (std::int32_t e = graph.begins[j]; e < graph.begins[j + 1] && graph.neighbours[e] < j; ++e) {
      for (std::int32_t i = graph.neighbours[e]; i != -1 && i != j;) {
        const std::int32_t above = std::exchange(ancestors[i], j);
        if (above == -1) parents[i] = j;
        i = above;
      }
    }
  }
  return parents;
}

/// An order in which each column's descendants stand directly before it.
std::vector<std::int32_t> postorder(const std::vector<std::int32_t>& parents) {
  const auto n = static_cast<std::int32_t>(parents.size());
  std::vector<std::int32_t> first_child(n + 1, -1), sibling(n, -1), order, open;
  for (std::int32_t j = n - 1; j >= 0; --j) {
    std::int32_t& child = first_child[parents[j] == -1 ? n : parents[j]];
    sibling[j] = std::exchange(child, j);
  }
  order.reserve(n);
  for (std::int32_t root = first_child[n]; root != -1; root = sibling[root]) {
    open.push_back(root);
    while (!open.empty()) {
      const std::int32_t child = std::exchange(first_child[open.back()], -1);
      if (child != -1) {
        open.push_back(child);
        continue;
      }
      const std::int32_t done = open.back();
      order.push_back(done);
      open.pop_back();
      if (parents[done] != -1 && sibling[done] != -1) open.push_back(sibling[done]);
    }
  }
  return order;
}

/// Each row of the factor is a subtree; its entries are counted from the subtree's leaves and where their paths meet.
std::vector<std::int32_t> column_counts(const Graph& graph, const std::vector<std::int32_t>& parents) {
  const std::int32_t n = graph.size();
  std::vector<std::int32_t> first(n), latest(n, -1), leaf(n, -1), above(n), counts(n, 1);
  std::iota(first.begin(), first.end(), 0);
  std::iota(above.begin(), above.end(), 0);
  for (std::int32_t j = 0; j < n; ++j) {
    if (parents[j] == -1) continue;
    if (first[parents[j]] == parents[j]) counts[parents[j]] = 0;  // not a leaf
    first[parents[j]] = std::min(first[parents[j]], first[j]);
  }
  const auto top = [&](std::int32_t j) {
    while (above[j] != j) j = above[j] = above[above[j]];
    return j;
  };
  for (std::int32_t j = 0; j < n; ++j) {
    if (parents[j] != -1) --counts[parents[j]];
    for (std::int32_t e = graph.begins[j + 1] - 1; e >= graph.begins[j] && graph.neighbours[e] > j; --e) {
      const std::int32_t row = graph.neighbours[e];
      if (first[j] <= latest[row]) continue;
      latest[row] = first[j];
      ++counts[j];
      const std::int32_t before = std::exchange(leaf[row], j);
      if (before != -1) --counts[top(before)];
    }
    if (parents[j] != -1) above[j] = parents[j];
  }
  for (std::int32_t j = 0; j < n; ++j) {
    if (parents[j] != -1) counts[parents[j]] += counts[j];
  }
  return counts;
}

/// Whether a block of so many columns may have this share of explicit zeros.
bool is_worth_its_zeros(std::int32_t columns, double share) {
  struct Step {
    std::int32_t columns;
    double share;
  };
  constexpr std::array<Step, 3> kSteps{{{4, 1}, {16, 0.8}, {48, 0.1}}};
  for (const Step& step : kSteps) {
    if (columns <= step.columns) return share <= step.share;
  }
  return share <= 0.05;
}

/// Supernodes without explicit zeros: columns with the pattern of their parent.
std::vector<std::int32_t> strict_groups(const EliminationTree& tree) {
  const auto n = static_cast<std::int32_t>(tree.parents.size());
  std::vector<std::int32_t> first_columns;
  for (std::int32_t j = 0; j < n; ++j) {
    const bool goes_on = j > 0 && tree.parents[j - 1] == j && tree.counts[j - 1] == tree.counts[j] + 1;
    if (!goes_on) first_columns.push_back(j);
  }
  first_columns.push_back(n);
  return first_columns;
}

/// The rows below each supernode, from those of the matrix: row i is in every supernode on the way from its entries up
/// the tree to its own column.
void add_rows(const Graph& graph, const EliminationTree& tree, SupernodePattern& to) {
  const std::int32_t n = graph.size();
  const std::size_t count = to.first_columns.size() - 1;
  std::vector<std::int32_t> node_of(n), seen(count, -1);
  for (std::size_t k = 0; k < count; ++k)
    std::fill(node_of.begin() + to.first_columns[k], node_of.begin() + to.first_columns[k + 1],
              static_cast<std::int32_t>(k));
  std::vector<std::size_t> next(to.first_rows.begin(), to.first_rows.end() - 1);
  for (std::int32_t i = 0; i < n; ++i) {
    seen[node_of[i]] = i;
    for (std::int32_t e = graph.begins[i]; e < graph.begins[i + 1] && graph.neighbours[e] < i; ++e) {
      for (std::int32_t node = node_of[graph.neighbours[e]]; seen[node] != i;) {
        seen[node] = i;
        to.rows[next[node]++] = i;
        node = node_of[tree.parents[to.first_columns[node + 1] - 1]];
      }
    }
  }
}

}  // namespace

EliminationTree eliminate(const LowerMatrix& pattern) {
  const std::vector<std::int32_t> order = minimum_degree_order(pattern);
  const std::vector<std::int32_t> later = postorder(parents_of(graph_of(pattern, order)));
  EliminationTree tree;
  tree.new_to_old.reserve(order.size());
  for (const std::int32_t j : later) tree.new_to_old.push_back(order[j]);
  const Graph graph = graph_of(pattern, tree.new_to_old);
  tree.parents = parents_of(graph);
  tree.counts = column_counts(graph, tree.parents);
  return tree;
}

std::vector<std::int32_t> group_columns(const EliminationTree& tree) {
  const std::vector<std::int32_t> strict = strict_groups(tree);
  std::vector<std::int32_t> starts;  // descending
  const auto n = static_cast<std::int32_t>(tree.parents.size());
  std::int32_t end = n;  // of the supernode that begins at the present start
  double zeros = 0;
  for (std::size_t k = strict.size() - 1; k-- > 0;) {
    const std::int32_t first = strict[k], last = strict[k + 1] - 1;
    const std::int32_t parent = tree.parents[last];
    if (!starts.empty() && parent != -1 && parent < end) {
      const std::int32_t start = starts.back(), columns = end - first;
      const double rows = tree.counts[end - 1] - 1;
      const double added =
          static_cast<double>(start - first) * (end - start + rows - (tree.counts[last] - 1));
      const double entries = columns * (columns + 1.0) / 2 + columns * rows;
      if (added == 0 || is_worth_its_zeros(columns, (zeros + added) / entries)) {
        starts.back() = first;
        zeros += added;
        continue;
      }
    }
    starts.push_back(first);
    end = strict[k + 1];
    zeros = 0;
  }
  std::reverse(starts.begin(), starts.end());
  starts.push_back(n);
  return starts;
}

absl::StatusOr<SupernodePattern> analyse_supernodes(const LowerMatrix& pattern, std::size_t most) {
  const EliminationTree tree = eliminate(pattern);
  SupernodePattern result;
  result.new_to_old = tree.new_to_old;
  result.first_columns = group_columns(tree);
  result.first_rows.assign(1, 0);
  for (std::size_t k = 1; k < result.first_columns.size(); ++k)
    result.first_rows.push_back(result.first_rows.back() + tree.counts[result.first_columns[k] - 1] - 1);
  if (entry_count(result) > most) {
    return make_fault(
        {Reason::kFactorTooLarge, "mesh", absl::StrCat("entries <= ", most)},
        absl::StrCat("The factorisation of this mesh would have more than ", most,
                     " entries. Use a mesh with fewer vertices, or one whose faces form a surface."));
  }
  result.rows.resize(result.first_rows.back());
  add_rows(graph_of(pattern, result.new_to_old), tree, result);
  return result;
}

}  // namespace lpdeform
