#include "core/mesh/report.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

struct DefectEntry {
  std::string_view name;
  DefectCount MeshReport::*count;
};

/// In the order of Defect.
constexpr std::array<DefectEntry, 12> kDefects{{
    {"not_finite", &MeshReport::not_finite},
    {"index_out_of_range", &MeshReport::index_out_of_range},
    {"unreferenced_vertices", &MeshReport::unreferenced_vertices},
    {"duplicate_faces", &MeshReport::duplicate_faces},
    {"zero_area_faces", &MeshReport::zero_area_faces},
    {"non_manifold_edges", &MeshReport::non_manifold_edges},
    {"non_manifold_vertices", &MeshReport::non_manifold_vertices},
    {"inconsistent_orientation", &MeshReport::inconsistent_orientation},
    {"split_border_vertices", &MeshReport::split_border_vertices},
    {"clamped_edges", &MeshReport::clamped_edges},
    {"floored_vertices", &MeshReport::floored_vertices},
    {"flipped_edges", &MeshReport::flipped_edges},
}};

const DefectEntry& entry(Defect defect) {
  const auto index = static_cast<std::size_t>(defect);
  LPDEFORM_CHECK(index < kDefects.size());
  return kDefects[index];
}

absl::Status empty_mesh(const MeshReport& report) {
  return make_fault({Reason::kMeshEmpty, "", "vertices >= 3, faces >= 1"},
                    absl::StrCat("The mesh has ", report.vertices, " vertices and ", report.faces,
                                 " faces; it needs at least 3 vertices and 1 face."));
}

}  // namespace

std::string_view defect_name(Defect defect) {
  return entry(defect).name;
}

const std::vector<Defect>& all_defects() {
  static const std::vector<Defect> all = [] {
    std::vector<Defect> defects;
    for (std::size_t index = 0; index < kDefects.size(); ++index)
      defects.push_back(static_cast<Defect>(index));
    return defects;
  }();
  return all;
}

const DefectCount& MeshReport::of(Defect defect) const {
  return this->*entry(defect).count;
}
DefectCount& MeshReport::of(Defect defect) {
  return this->*entry(defect).count;
}

absl::Status deformable(const MeshReport& report) {
  if (report.vertices == 0 || report.faces == 0) return empty_mesh(report);
  if (report.index_out_of_range.count > 0) {
    const std::int32_t face = report.index_out_of_range.first.front();
    return make_fault(
        {Reason::kMeshIndexOutOfRange, absl::StrCat("face ", face),
         absl::StrCat("0 <= index < ", report.vertices)},
        absl::StrCat("Face ", face, " has the vertex index ", report.wrong_index, ", outside 0 to ",
                     report.vertices - 1, " (", report.index_out_of_range.count, " such faces)."));
  }
  if (report.not_finite.count > 0) {
    const std::int32_t vertex = report.not_finite.first.front();
    return make_fault({Reason::kMeshNotFinite, absl::StrCat("vertex ", vertex), "finite coordinates"},
                      absl::StrCat("Vertex ", vertex, " has a NaN or infinite coordinate (",
                                   report.not_finite.count, " such vertices); all must be finite."));
  }
  if (report.zero_area_faces.count == report.faces) {
    return make_fault(
        {Reason::kMeshNoArea, "face 0", "height > 1e-12 of the longest edge on at least one face"},
        absl::StrCat("All ", report.faces,
                     " faces have zero area to rounding: the height of each is less than ",
                     "1e-12 of its longest edge. At least one must have more."));
  }
  return absl::OkStatus();
}

}  // namespace lpdeform
