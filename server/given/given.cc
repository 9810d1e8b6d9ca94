#include "server/given/given.h"

#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/analysis/automatic_material.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/resize/resize.h"

namespace lpdeform {
namespace {

constexpr std::uint32_t kMostIterations = std::numeric_limits<int>::max();

/// Converts a field found on the welded shape to the client's vertices.
Field for_client(Field found, const Weld* weld) {
  return weld == nullptr || found.size() == 1 ? std::move(found) : scattered(found, *weld);
}

}  // namespace

absl::Status GivenRoom::take(std::uint64_t count, std::string_view what) {
  if (count <= left_) {
    left_ -= count;
    return absl::OkStatus();
  }
  return make_fault(
      {Reason::kHandleTooManyVertices, std::string(what), absl::StrCat(vertex_count_, " in all")},
      absl::StrCat("The update has more ", std::string(what), " than the mesh's ", vertex_count_,
                   " vertices."));
}

absl::Status check_point_count(std::size_t coordinates, std::size_t faces) {
  if (coordinates == 3 * faces) return absl::OkStatus();
  return make_fault({Reason::kHandlePointCount, "barycentric", absl::StrCat(3 * faces, " numbers")},
                    absl::StrCat("There are ", coordinates, " barycentric coordinates for ", faces,
                                 " points; each takes three."));
}

absl::Status check_normal_count(std::uint64_t count, std::uint32_t vertex_count) {
  if (count == vertex_count) return absl::OkStatus();
  return make_fault({Reason::kNormalsSize, "normals", absl::StrCat(vertex_count, " normals")},
                    absl::StrCat("There are ", count, " normals for ", vertex_count, " vertices."));
}

absl::Status check_normals(const Points& normals) {
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    if (normals.row(v).allFinite()) continue;
    return make_fault({Reason::kNormalsNotFinite, absl::StrCat("vertex ", v), "finite numbers"},
                      absl::StrCat("The normal of vertex ", v, " has a NaN or infinite number."));
  }
  return absl::OkStatus();
}

absl::StatusOr<int> given_effort(std::uint32_t effort) {
  if (effort <= SolveSettings::kHighestEffort) return static_cast<int>(effort);
  return make_fault(
      {Reason::kEffortOutOfRange, "effort", absl::StrCat("0 <= effort <= ", SolveSettings::kHighestEffort)},
      absl::StrCat("effort is ", effort, "."));
}

absl::StatusOr<int> given_iterations(std::uint32_t iterations) {
  if (iterations <= kMostIterations) return static_cast<int>(iterations);
  return make_fault(
      {Reason::kIterationsOutOfRange, "max_iterations",
       absl::StrCat("0 <= max_iterations <= ", kMostIterations)},
      absl::StrCat("The number of iterations is ", iterations, ", over ", kMostIterations, "."));
}

absl::Status check_stream_options(const StreamOptions& options) {
  if (options.credit > StreamOptions::kMostCredit) {
    return make_fault(
        {Reason::kCreditOutOfRange, "credit", absl::StrCat("credit <= ", StreamOptions::kMostCredit)},
        absl::StrCat("A credit of ", options.credit, " is over ", StreamOptions::kMostCredit, "."));
  }
  if (!(options.max_frames_per_second >= 0) || std::isinf(options.max_frames_per_second)) {
    return make_fault(
        {Reason::kFrameRateOutOfRange, "max_frames_per_second", "finite and >= 0"},
        absl::StrCat("The frame rate is ", options.max_frames_per_second, ", not finite and >= 0."));
  }
  return absl::OkStatus();
}

absl::Status check_field_size(std::string_view what, std::size_t values, std::uint32_t vertex_count) {
  if (values == 1 || values == vertex_count) return absl::OkStatus();
  return wrong_field_size(what, static_cast<std::int64_t>(values), vertex_count);
}

absl::StatusOr<Field> automatic_field(const ShapeFeatures& features, const Weld* weld, double strength,
                                      Field Material::*part) {
  if (absl::Status status = check_strength(strength); !status.ok()) return status;
  const auto material = automatic_material(features.joint(), strength);
  if (!material.ok()) return material.status();
  return for_client(*material.*part, weld);
}

absl::Status add_resize(const ShapeFeatures& features, const Weld* weld, const GivenResize& resize,
                        Update& out) {
  Scaling scaling;
  scaling.scale = resize.scale;
  scaling.origin = resize.origin.value_or(box_middle(features.shape()));
  if (resize.axes) {
    const auto axes = axes_of(resize.axes->first, resize.axes->second);
    if (!axes.ok()) return axes.status();
    scaling.axes = *axes;
  }
  auto inputs = resize_inputs(features, scaling);
  if (!inputs.ok()) return inputs.status();
  if (weld != nullptr) {
    for (std::int32_t& vertex : inputs->handle.vertices)
      vertex = weld->first_copy[vertex];  // holds all copies
  }
  out.handles.push_back({"resize", std::move(inputs->handle)});
  if (!out.settings.p) out.settings.p = for_client(std::move(inputs->material.p), weld);
  if (!out.settings.stiffness)
    out.settings.stiffness = for_client(std::move(inputs->material.stiffness), weld);
  return absl::OkStatus();
}

}  // namespace lpdeform
