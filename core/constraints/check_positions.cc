#include "core/constraints/check_positions.h"

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/problem/handle_name.h"

namespace lpdeform {
namespace {

/// The first row that is not finite, or too far away; the number of rows if there is none.
Eigen::Index first_too_far(const RestShape& shape, const Points& positions) {
  const double farthest = kFarthestTarget * shape.diagonal();
  Eigen::Index k = 0;
  while (k < positions.rows() && (positions.row(k) - shape.centre()).stableNorm() <= farthest) ++k;
  return k;
}

}  // namespace

absl::Status check_targets(const RestShape& shape, std::string_view name, const Handle& handle,
                           const Points& targets, const std::vector<std::int32_t>* first_copy) {
  const Eigen::Index row = first_too_far(shape, targets);
  if (row == targets.rows()) return absl::OkStatus();
  const auto k = static_cast<std::size_t>(row);
  const std::string place =
      !handle.points.empty()
          ? absl::StrCat("Point ", k)
          : absl::StrCat("Vertex ", first_copy ? (*first_copy)[handle.vertices[k]] : handle.vertices[k]);
  return make_fault({Reason::kHandleTargetTooFar, handle_element(name),
                     absl::StrCat("distance <= ", kFarthestTarget * shape.diagonal())},
                    absl::StrCat(place, " of ", handle_element(name), " would be ",
                                 (targets.row(row) - shape.centre()).stableNorm(),
                                 " from the mesh's centre, over ", kFarthestTarget, " of its diagonals."));
}

absl::Status check_positions(const RestShape& shape, const Points& positions) {
  if (positions.rows() != shape.vertex_count())
    return wrong_position_count(positions.rows(), shape.vertex_count());
  const Eigen::Index row = first_too_far(shape, positions);
  return row == positions.rows() ? absl::OkStatus() : position_too_far(row);
}

absl::Status wrong_position_count(std::int64_t positions, std::int64_t vertices) {
  return make_fault({Reason::kPositionsSize, "positions", absl::StrCat(vertices, " positions")},
                    absl::StrCat("There are ", positions, " positions for ", vertices, " vertices."));
}

absl::Status position_too_far(std::int64_t vertex) {
  return make_fault({Reason::kPositionsNotFinite, absl::StrCat("vertex ", vertex),
                     absl::StrCat(kFarthestTarget, " diagonals of the mesh")},
                    absl::StrCat("The position of vertex ", vertex, " is not finite, or is over ",
                                 kFarthestTarget, " diagonals of the mesh away."));
}

}  // namespace lpdeform
