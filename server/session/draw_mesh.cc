#include "server/session/draw_mesh.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/problem/welded_inputs.h"

namespace lpdeform {

DrawMesh::DrawMesh(std::shared_ptr<const RestShape> shape)
    : DrawMesh(std::move(shape), nullptr, Faces(0, 3), Points(0, 3)) {}

DrawMesh::DrawMesh(std::shared_ptr<const RestShape> shape, std::shared_ptr<const Weld> weld, Faces faces,
                   Points rest_normals)
    : shape_(std::move(shape)),
      weld_(std::move(weld)),
      faces_(weld_ ? std::move(faces) : Faces(0, 3)),
      rest_normals_(std::move(rest_normals)) {
  LPDEFORM_CHECK(!weld_ || weld_->welded_count() == shape_->vertex_count());
}

std::uint32_t DrawMesh::vertex_count() const {
  return static_cast<std::uint32_t>(weld_ ? weld_->split_count() : shape_->vertex_count());
}

MeshReport DrawMesh::report() const {
  return weld_ ? scattered(shape_->report(), *weld_) : shape_->report();
}

absl::StatusOr<Points> DrawMesh::solver_positions(Points positions) const {
  if (!weld_) return positions;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    if (!positions.row(v).allFinite()) return position_too_far(v);
  }
  return welded(positions, *weld_, "positions");
}

absl::Status DrawMesh::for_client(const absl::Status& status) const {
  const Fault fault = fault_of(status);
  int component = 0;
  if (!weld_ || fault.reason != Reason::kComponentWithoutHandle ||
      !absl::SimpleAtoi(absl::StripPrefix(fault.element, "component "), &component)) {
    return status;
  }
  const auto& components = shape_->components();
  const auto first = std::find(components.begin(), components.end(), component) - components.begin();
  return carry_fault(
      status.code(), fault,
      absl::StrCat("component ", component, " of the mesh (the first of its vertices is vertex ",
                   weld_->first_copy[static_cast<std::size_t>(first)], ") has no handle"));
}

Points DrawMesh::normals(const Points& positions) const {
  std::call_once(once_, [this] {
    const Weld weld = weld_ ? *weld_ : no_weld(shape_->vertex_count());
    carried_ = std::make_unique<const CarriedNormals>(
        weld_ ? faces_ : shape_->faces(), this->positions(shape_->positions()), weld, rest_normals_);
  });
  return carried_->at(positions);
}

std::size_t DrawMesh::memory_bytes() const {
  const std::size_t weld_numbers = weld_ ? weld_->to_welded.size() + weld_->first_copy.size() : 0;
  return sizeof(*this) + (weld_numbers + faces_.size()) * sizeof(std::int32_t) +
         rest_normals_.size() * sizeof(double);
}

}  // namespace lpdeform
