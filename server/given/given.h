#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/analysis/shape_features.h"
#include "core/base/geometry.h"
#include "core/energy/material.h"
#include "core/mesh/weld.h"
#include "server/session/frame_stream.h"
#include "server/session/update.h"

namespace lpdeform {

/// How many vertices, targets or region vertices one update may still give: together no more than the mesh has.
class GivenRoom {
 public:
  explicit GivenRoom(std::uint32_t vertex_count) : vertex_count_(vertex_count), left_(vertex_count) {}

  /// INVALID_ARGUMENT HANDLE_TOO_MANY_VERTICES, which calls them `what`.
  absl::Status take(std::uint64_t count, std::string_view what);

 private:
  const std::uint32_t vertex_count_;
  std::uint64_t left_;
};

/// INVALID_ARGUMENT HANDLE_POINT_COUNT if the points in `faces` faces have not three coordinates each.
absl::Status check_point_count(std::size_t coordinates, std::size_t faces);

/// INVALID_ARGUMENT NORMALS_SIZE.
absl::Status check_normal_count(std::uint64_t count, std::uint32_t vertex_count);
/// INVALID_ARGUMENT NORMALS_NOT_FINITE.
absl::Status check_normals(const Points& normals);

/// INVALID_ARGUMENT: EFFORT_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE.
absl::StatusOr<int> given_effort(std::uint32_t effort);
absl::StatusOr<int> given_iterations(std::uint32_t iterations);

/// INVALID_ARGUMENT: CREDIT_OUT_OF_RANGE, FRAME_RATE_OUT_OF_RANGE.
absl::Status check_stream_options(const StreamOptions& options);

/// A field of one value, or one for each vertex: INVALID_ARGUMENT FIELD_SIZE.
absl::Status check_field_size(std::string_view what, std::size_t values, std::uint32_t vertex_count);

/// p or stiffness from the geometry, in the client's vertices. `weld`: null if nothing is welded. INVALID_ARGUMENT
/// STRENGTH_OUT_OF_RANGE.
absl::StatusOr<Field> automatic_field(const ShapeFeatures& features, const Weld* weld, double strength,
                                      Field Material::*part);

/// A resizing as callers give it.
struct GivenResize {
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  std::optional<Eigen::Vector3d> origin = {};                            // the middle of the bounding box
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> axes = {};  // the first and the second; x and y
};

/// Adds the handle "resize", and p and stiffness unless they are set, to the update, in the client's vertices.
/// INVALID_ARGUMENT: RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE, RESIZE_AXES.
absl::Status add_resize(const ShapeFeatures& features, const Weld* weld, const GivenResize& resize,
                        Update& out);

}  // namespace lpdeform
