#include "core/mesh/weld.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/mesh/coincident.h"

namespace lpdeform {
namespace {

constexpr double kFarthestCopy = 1e-6, kLargestTolerance = 1e-3;  // of the diagonal

/// Makes a Weld from the lowest copy of each vertex.
Weld from_lowest(const Points& positions, const std::vector<std::int32_t>& lowest) {
  Weld weld;
  weld.same_place = kSamePlace * diagonal_of(positions);
  weld.to_welded.resize(lowest.size());
  for (std::size_t v = 0; v < lowest.size(); ++v) {
    const auto vertex = static_cast<std::int32_t>(v);
    if (lowest[v] == vertex) weld.first_copy.push_back(vertex);
    weld.to_welded[v] = lowest[v] == vertex ? weld.welded_count() - 1 : weld.to_welded[lowest[v]];
  }
  return weld;
}

absl::Status check_groups(std::int64_t vertices, std::span<const std::uint32_t> groups) {
  if (static_cast<std::int64_t>(groups.size()) != vertices) {
    return make_fault({Reason::kWeldSize, "weld", absl::StrCat(vertices, " numbers")},
                      absl::StrCat("The weld has ", groups.size(), " numbers for ", vertices, " vertices."));
  }
  const auto wrong = std::find_if(groups.begin(), groups.end(), [&](auto g) { return g >= vertices; });
  if (wrong == groups.end()) return absl::OkStatus();
  const auto vertex = wrong - groups.begin();
  return make_fault(
      {Reason::kWeldOutOfRange, absl::StrCat("vertex ", vertex), absl::StrCat("number < ", vertices)},
      absl::StrCat("Vertex ", vertex, " is welded under number ", *wrong, "; the mesh has ", vertices,
                   " vertices."));
}

/// Skips copies that are not finite: check_mesh reports them.
absl::Status check_distances(const Points& positions, const std::vector<std::int32_t>& lowest) {
  if (lowest.empty()) return absl::OkStatus();
  const double diagonal = (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).norm();
  for (std::size_t v = 0; v < lowest.size(); ++v) {
    const double distance = (positions.row(static_cast<Eigen::Index>(v)) - positions.row(lowest[v])).norm();
    if (!(distance > kFarthestCopy * diagonal)) continue;
    return make_fault({Reason::kWeldTooFar, absl::StrCat("vertex ", v),
                       absl::StrCat("distance <= ", kFarthestCopy * diagonal)},
                      absl::StrCat("Vertex ", v, " is ", distance, " away from vertex ", lowest[v],
                                   ", of which it is to be a copy; at most ", kFarthestCopy,
                                   " of the diagonal is allowed."));
  }
  return absl::OkStatus();
}

bool is_of_a_face(Defect defect) {
  return defect == Defect::kIndexOutOfRange || defect == Defect::kDuplicateFace ||
         defect == Defect::kZeroAreaFace;
}

}  // namespace

Weld no_weld(std::int32_t vertex_count) {
  Weld weld;
  weld.to_welded.resize(vertex_count);
  std::iota(weld.to_welded.begin(), weld.to_welded.end(), 0);
  weld.first_copy = weld.to_welded;
  return weld;
}

absl::StatusOr<Weld> weld_by_position(const Points& positions, double tolerance) {
  if (!(tolerance >= 0 && tolerance <= kLargestTolerance)) {
    return make_fault(
        {Reason::kWeldTolerance, "weld tolerance", absl::StrCat("0 <= tolerance <= ", kLargestTolerance)},
        absl::StrCat("The weld's tolerance is ", tolerance, " of the diagonal; it must be 0 to ",
                     kLargestTolerance, "."));
  }
  std::vector<std::int32_t> all(positions.rows());
  std::iota(all.begin(), all.end(), 0);
  const double share = tolerance == 0 ? kSamePlace : tolerance;
  const Coincident found = coincident(positions, all, share);
  if (found.is_complete) return from_lowest(positions, found.lowest);
  return make_fault({Reason::kWeldTooDense, "weld tolerance", absl::StrCat("tolerance < ", share)},
                    absl::StrCat("Too many different vertices lie within ", share,
                                 " of the diagonal of each other to be welded by position."));
}

absl::StatusOr<Weld> weld_by_groups(const Points& positions, std::span<const std::uint32_t> groups) {
  if (absl::Status status = check_groups(positions.rows(), groups); !status.ok()) return status;
  std::vector<std::int32_t> first(groups.size(), -1), lowest(groups.size());
  for (std::size_t v = 0; v < groups.size(); ++v) {
    if (first[groups[v]] < 0) first[groups[v]] = static_cast<std::int32_t>(v);
    lowest[v] = first[groups[v]];
  }
  if (absl::Status status = check_distances(positions, lowest); !status.ok()) return status;
  return from_lowest(positions, lowest);
}

TriangleMesh welded(const TriangleMesh& split, const Weld& weld) {
  TriangleMesh mesh{Points(weld.welded_count(), 3), split.faces};
  for (std::int32_t w = 0; w < weld.welded_count(); ++w)
    mesh.vertices.row(w) = split.vertices.row(weld.first_copy[w]);
  for (std::int32_t& index : mesh.faces.reshaped()) {
    const bool is_in_range = index >= 0 && index < weld.split_count();
    if (is_in_range) index = weld.to_welded[index];
  }
  return mesh;
}

Points scattered(const Points& welded, const Weld& weld) {
  Points split(weld.split_count(), 3);
  for (std::int32_t v = 0; v < weld.split_count(); ++v) split.row(v) = welded.row(weld.to_welded[v]);
  return split;
}

Field scattered(const Field& welded, const Weld& weld) {
  Field split(weld.split_count());
  for (std::int32_t v = 0; v < weld.split_count(); ++v) split[v] = welded[weld.to_welded[v]];
  return split;
}

MeshReport scattered(MeshReport welded, const Weld& weld) {
  welded.vertices = weld.split_count();
  for (const Defect defect : all_defects()) {
    if (is_of_a_face(defect)) continue;
    for (std::int32_t& vertex : welded.of(defect).first) vertex = weld.first_copy[vertex];
  }
  return welded;
}

}  // namespace lpdeform
