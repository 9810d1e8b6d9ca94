#include "core/mesh/coarsen.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/corner_table.h"

namespace lpdeform {
namespace {

constexpr double kGrowth = 1.2;       // factor from round to round of the longest edge to collapse
constexpr int kMostNeighbours = 14;   // of the two ends of a collapsed edge together
constexpr double kLargestTurn = 0.5;  // the cosine

/// One round; `left` counts vertices.
void collapse_up_to(CornerTable& table, double longest, std::int32_t vertices, const std::vector<char>& stays,
                    std::int32_t& left, std::vector<std::int32_t>& went_into) {
  for (std::int32_t edge = 0; edge < table.edge_count(); ++edge) {
    if (left <= vertices) return;
    if (table.is_gone(edge) || table.squared_length(edge) > longest * longest) continue;
    for (const CornerTable::Way& way : table.ways(edge)) {
      if (!stays.empty() && stays[way.from] != 0) continue;
      if (!table.may_collapse(way, kMostNeighbours, kLargestTurn)) continue;
      went_into[way.from] = way.to;
      table.collapse(way);
      --left;
      break;
    }
  }
}

std::vector<std::int32_t> collapse(CornerTable& table, std::int32_t all, std::int32_t vertices,
                                   const std::vector<char>& stays) {
  std::vector<std::int32_t> went_into(all);
  std::iota(went_into.begin(), went_into.end(), 0);
  std::vector<double> lengths(table.edge_count());
  for (std::int32_t edge = 0; edge < table.edge_count(); ++edge)
    lengths[edge] = std::sqrt(table.squared_length(edge));
  if (lengths.empty()) return went_into;
  std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 8),
                   lengths.end());
  double longest = lengths[lengths.size() / 8];
  std::int32_t left = all;
  for (int idle = 0; left > vertices && idle < 8; longest *= kGrowth) {
    const std::int32_t before = left;
    collapse_up_to(table, longest, vertices, stays, left, went_into);
    idle = before - left > left / 100 ? 0 : idle + 1;
  }
  return went_into;
}

}  // namespace

std::size_t CoarseMesh::memory_bytes() const {
  return static_cast<std::size_t>(mesh.vertices.size()) * sizeof(double) +
         (static_cast<std::size_t>(mesh.faces.size()) + fine_vertex.capacity() + coarse_vertex.capacity()) *
             sizeof(std::int32_t);
}

CoarseMesh coarsen(const TriangleMesh& mesh, std::int32_t vertices, const std::vector<char>& stays) {
  CornerTable table(mesh);
  std::vector<std::int32_t> went_into =
      collapse(table, static_cast<std::int32_t>(mesh.vertices.rows()), vertices, stays);
  for (std::int32_t& into : went_into) {
    while (into != went_into[into]) into = went_into[into];
  }

  CoarseMesh result;
  std::vector<std::int32_t> place(went_into.size(), -1);
  for (std::size_t v = 0; v < went_into.size(); ++v) {
    if (went_into[v] != static_cast<std::int32_t>(v)) continue;
    place[v] = static_cast<std::int32_t>(result.fine_vertex.size());
    result.fine_vertex.push_back(static_cast<std::int32_t>(v));
  }
  result.coarse_vertex.resize(went_into.size());
  for (std::size_t v = 0; v < went_into.size(); ++v) result.coarse_vertex[v] = place[went_into[v]];
  result.mesh.vertices.resize(static_cast<Eigen::Index>(result.fine_vertex.size()), 3);
  for (std::size_t c = 0; c < result.fine_vertex.size(); ++c) {
    result.mesh.vertices.row(static_cast<Eigen::Index>(c)) = mesh.vertices.row(result.fine_vertex[c]);
  }
  result.mesh.faces = table.faces().unaryExpr([&](std::int32_t v) { return place[v]; });
  return result;
}

}  // namespace lpdeform
