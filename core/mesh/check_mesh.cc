#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "core/mesh/coincident.h"
#include "core/mesh/half_edges.h"
#include "core/mesh/report.h"
#include "core/mesh/topology.h"

namespace lpdeform {
namespace {

template <typename... Index>
void count(DefectCount& defect, Index... index) {
  ++defect.count;
  if (defect.count <= DefectCount::kFirstShown)
    (defect.first.push_back(static_cast<std::int32_t>(index)), ...);
}

/// What later checks may assume about each face.
enum class FaceState : std::uint8_t {
  kSound,           // three different vertices in range
  kRepeatedVertex,  // in range, but degenerate: skipped by the checks of edges and fans
  kOutOfRange,      // skipped by all later checks
};

FaceState state_of(const Faces& faces, Eigen::Index f, Eigen::Index vertices) {
  const std::int32_t a = faces(f, 0), b = faces(f, 1), c = faces(f, 2);
  if (std::min({a, b, c}) < 0 || std::max({a, b, c}) >= vertices) return FaceState::kOutOfRange;
  return a == b || b == c || c == a ? FaceState::kRepeatedVertex : FaceState::kSound;
}

/// The first index of the face that is out of range; there must be one.
std::int32_t wrong_index(const TriangleMesh& mesh, Eigen::Index f) {
  int corner = 0;
  while (mesh.faces(f, corner) >= 0 && mesh.faces(f, corner) < mesh.vertices.rows()) ++corner;
  return mesh.faces(f, corner);
}

std::vector<FaceState> check_indices(const TriangleMesh& mesh, MeshReport& report) {
  std::vector<FaceState> states(mesh.faces.rows());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    states[f] = state_of(mesh.faces, f, mesh.vertices.rows());
    if (states[f] != FaceState::kOutOfRange) continue;
    if (report.index_out_of_range.count == 0) report.wrong_index = wrong_index(mesh, f);
    count(report.index_out_of_range, f);
  }
  return states;
}

void check_vertices(const TriangleMesh& mesh, MeshReport& report) {
  const Eigen::Index vertices = mesh.vertices.rows();
  std::vector<bool> is_referenced(vertices, false);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::int32_t v = mesh.faces(f, corner);
      if (v >= 0 && v < vertices) is_referenced[v] = true;
    }
  }
  for (Eigen::Index v = 0; v < vertices; ++v) {
    if (!mesh.vertices.row(v).allFinite()) count(report.not_finite, v);
    if (!is_referenced[v]) count(report.unreferenced_vertices, v);
  }
}

void check_areas(const TriangleMesh& mesh, const std::vector<FaceState>& states, MeshReport& report) {
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (states[f] == FaceState::kOutOfRange) continue;
    const Eigen::RowVector3d a = mesh.vertices.row(mesh.faces(f, 0)), b = mesh.vertices.row(mesh.faces(f, 1)),
                             c = mesh.vertices.row(mesh.faces(f, 2));
    const bool is_finite = a.allFinite() && b.allFinite() && c.allFinite();
    if (states[f] == FaceState::kRepeatedVertex || (is_finite && is_zero_area(a, b, c))) {
      count(report.zero_area_faces, f);
    }
  }
}

void check_duplicates(const TriangleMesh& mesh, const std::vector<FaceState>& states, MeshReport& report) {
  struct Key {
    std::array<std::int32_t, 3> vertices;
    std::int32_t face;
  };
  std::vector<std::int32_t> start(mesh.vertices.rows() + 1, 0);
  const auto for_faces = [&](const auto& visit) {
    for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
      if (states[f] == FaceState::kOutOfRange) continue;
      Key key{{mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)}, static_cast<std::int32_t>(f)};
      std::sort(key.vertices.begin(), key.vertices.end());
      visit(key);
    }
  };
  for_faces([&](const Key& key) { ++start[key.vertices[0] + 1]; });
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Key> keys(start.back());
  std::vector<std::int32_t> next(start.begin(), start.end() - 1);
  for_faces([&](const Key& key) { keys[next[key.vertices[0]]++] = key; });
  std::vector<std::int32_t> duplicates;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto begin = keys.begin() + start[v], end = keys.begin() + start[v + 1];
    std::sort(begin, end, [](const Key& a, const Key& b) {
      return a.vertices != b.vertices ? a.vertices < b.vertices : a.face < b.face;
    });
    for (auto key = begin; key != end; ++key) {
      if (key != begin && key->vertices == (key - 1)->vertices) duplicates.push_back(key->face);
    }
  }
  std::sort(duplicates.begin(), duplicates.end());
  for (const std::int32_t face : duplicates) count(report.duplicate_faces, face);
}

bool runs_upwards(const Faces& faces, HalfEdge half_edge) {
  return faces(half_edge.id / 3, (half_edge.id % 3 + 1) % 3) == half_edge.high;
}

/// The corners of the half-edge at the lower and at the higher vertex of its edge.
std::array<std::int32_t, 2> end_corners(const Faces& faces, HalfEdge half_edge) {
  const std::int32_t from = half_edge.id, to = next_corner(half_edge.id);
  return runs_upwards(faces, half_edge) ? std::array{from, to} : std::array{to, from};
}

/// Counts bad edges. Also unites, at each vertex, the corners of faces that share an edge there, so that each fan is
/// one set.
DisjointSets check_edges(const TriangleMesh& mesh, const EdgeTable& table, std::vector<bool>& is_not_manifold,
                         MeshReport& report) {
  DisjointSets fans(3 * mesh.faces.rows());
  table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides) {
    if (sides.size() > 2) {
      count(report.non_manifold_edges, low, high);
      is_not_manifold[low] = is_not_manifold[high] = true;
    }
    if (sides.size() == 2 && runs_upwards(mesh.faces, sides[0]) == runs_upwards(mesh.faces, sides[1])) {
      count(report.inconsistent_orientation, low, high);
    }
    const auto first = end_corners(mesh.faces, sides[0]);
    for (const HalfEdge& side : sides.subspan(1)) {
      const auto other = end_corners(mesh.faces, side);
      fans.unite(first[0], other[0]);
      fans.unite(first[1], other[1]);
    }
  });
  return fans;
}

void check_fans(const TriangleMesh& mesh, const std::vector<FaceState>& states, DisjointSets& fans,
                std::vector<bool>& is_not_manifold, MeshReport& report) {
  std::vector<std::int32_t> fan_of(mesh.vertices.rows(), -1);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (states[f] != FaceState::kSound) continue;
    for (int corner = 0; corner < 3; ++corner) {
      const std::int32_t v = mesh.faces(f, corner);
      const std::int32_t fan = fans.find(static_cast<std::int32_t>(3 * f + corner));
      if (fan_of[v] >= 0 && fan_of[v] != fan) is_not_manifold[v] = true;
      fan_of[v] = fan;
    }
  }
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (is_not_manifold[v]) count(report.non_manifold_vertices, v);
  }
}

/// A boundary edge joins the fans at its two ends. Each connected set of fans is one loop.
std::int64_t count_boundary_loops(const TriangleMesh& mesh, const EdgeTable& table, DisjointSets& fans) {
  std::vector<std::int32_t> boundary;
  table.for_edges([&](std::int32_t, std::int32_t, std::span<const HalfEdge> sides) {
    if (sides.size() != 1) return;
    const auto [low, high] = end_corners(mesh.faces, sides[0]);
    fans.unite(low, high);
    boundary.push_back(low);
  });
  for (std::int32_t& corner : boundary) corner = fans.find(corner);
  std::sort(boundary.begin(), boundary.end());
  return std::unique(boundary.begin(), boundary.end()) - boundary.begin();
}

/// Finds vertices of boundary edges that coincide with other such vertices. Closed surfaces have none, even where they
/// touch themselves or each other. Open parts that touch at their borders count, even if that is by chance: positions do
/// not tell them from a seam.
void check_borders(const TriangleMesh& mesh, const EdgeTable& table, MeshReport& report) {
  std::vector<bool> is_at_border(mesh.vertices.rows());
  table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides) {
    if (sides.size() == 1) is_at_border[low] = is_at_border[high] = true;
  });
  std::vector<std::int32_t> border;
  for (std::size_t v = 0; v < is_at_border.size(); ++v) {
    if (is_at_border[v]) border.push_back(static_cast<std::int32_t>(v));
  }
  if (border.empty()) return;
  const std::vector<std::int32_t> lowest = coincident(mesh.vertices, border, kSamePlace).lowest;
  std::vector<bool> is_shared(mesh.vertices.rows());
  for (const std::int32_t v : border) {
    if (lowest[v] != v) is_shared[lowest[v]] = is_shared[v] = true;
  }
  for (const std::int32_t v : border) {
    if (is_shared[v]) count(report.split_border_vertices, v);
  }
}

DisjointSets united_by_edges(const TriangleMesh& mesh, const std::vector<FaceState>& states) {
  DisjointSets sets(mesh.vertices.rows());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (states[f] == FaceState::kOutOfRange) continue;
    sets.unite(mesh.faces(f, 0), mesh.faces(f, 1));
    sets.unite(mesh.faces(f, 0), mesh.faces(f, 2));
  }
  return sets;
}

std::vector<std::int32_t> number_components(const TriangleMesh& mesh, const std::vector<FaceState>& states) {
  DisjointSets sets = united_by_edges(mesh, states);
  constexpr std::int32_t kUnreferenced = -1, kUnnumbered = -2;
  std::vector<std::int32_t> component(mesh.vertices.rows(), kUnreferenced);
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (states[f] == FaceState::kOutOfRange) continue;
    for (int corner = 0; corner < 3; ++corner) component[mesh.faces(f, corner)] = kUnnumbered;
  }
  std::int32_t next = 0;
  for (std::size_t v = 0; v < component.size(); ++v) {
    if (component[v] == kUnreferenced) continue;
    const std::int32_t lowest = sets.find(static_cast<std::int32_t>(v));
    component[v] = lowest == static_cast<std::int32_t>(v) ? next++ : component[lowest];
  }
  return component;
}

}  // namespace

MeshReport check_mesh(const TriangleMesh& mesh) {
  MeshReport report;
  report.vertices = mesh.vertices.rows();
  report.faces = mesh.faces.rows();
  const std::vector<FaceState> states = check_indices(mesh, report);
  check_vertices(mesh, report);
  check_areas(mesh, states, report);
  check_duplicates(mesh, states, report);

  const EdgeTable all(report.vertices, mesh.faces,
                      [&](Eigen::Index f) { return states[f] != FaceState::kOutOfRange; });
  all.for_edges([&](std::int32_t, std::int32_t, std::span<const HalfEdge>) { ++report.edges; });

  const bool are_sound =
      std::all_of(states.begin(), states.end(), [](FaceState state) { return state == FaceState::kSound; });
  std::optional<EdgeTable> without_others;
  if (!are_sound) {
    without_others.emplace(report.vertices, mesh.faces,
                           [&](Eigen::Index f) { return states[f] == FaceState::kSound; });
  }
  const EdgeTable& sound = are_sound ? all : *without_others;
  std::vector<bool> is_not_manifold(report.vertices, false);
  DisjointSets fans = check_edges(mesh, sound, is_not_manifold, report);
  check_fans(mesh, states, fans, is_not_manifold, report);
  report.boundary_loops = count_boundary_loops(mesh, sound, fans);
  check_borders(mesh, sound, report);

  for (const std::int32_t component : number_components(mesh, states)) {
    report.components = std::max<std::int64_t>(report.components, component + 1);
  }
  return report;
}

std::vector<std::int32_t> connected_components(const TriangleMesh& mesh) {
  MeshReport ignored;
  return number_components(mesh, check_indices(mesh, ignored));
}

}  // namespace lpdeform
