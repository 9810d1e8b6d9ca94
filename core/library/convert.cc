#include "core/library/convert.h"

#include <Eigen/Core>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/match.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/problem/handle_name.h"

namespace lpdeform::core {
namespace {

constexpr std::uint32_t kMost = std::numeric_limits<std::int32_t>::max();

Eigen::Vector3d vector_of(const std::array<double, 3>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

Points mapped(const std::vector<double>& numbers) {
  return Eigen::Map<const Points>(numbers.data(), static_cast<Eigen::Index>(numbers.size() / 3), 3);
}

absl::Status wrong_size(const char* element, std::size_t count) {
  return make_fault(
      {Reason::kMeshSize, element, "3 numbers each"},
      absl::StrCat("The mesh has ", count, " numbers for its ", element, "; that is not a multiple of 3."));
}

lpdeform::Hold converted(const Hold& hold) {
  return match(
      hold, [](const Exactly&) -> lpdeform::Hold { return lpdeform::Exactly{}; },
      [](const Soft& soft) -> lpdeform::Hold { return lpdeform::Soft{soft.weight}; },
      [](const Orientation& held) -> lpdeform::Hold { return lpdeform::Orientation{held.weight}; },
      [](const AxisLock& lock) -> lpdeform::Hold { return lpdeform::AxisLock{vector_of(lock.axis)}; },
      [](const PlaneLock& lock) -> lpdeform::Hold { return lpdeform::PlaneLock{vector_of(lock.normal)}; });
}

lpdeform::Method converted(Method method) {
  switch (method) {
    case Method::kAuto:
      return lpdeform::Method::kAuto;
    case Method::kQuasiNewton:
      return lpdeform::Method::kQuasiNewton;
    case Method::kMultiresolution:
      return lpdeform::Method::kMultiresolution;
    case Method::kLineSearch:
      return lpdeform::Method::kLineSearch;
    case Method::kLocalGlobal:
      return lpdeform::Method::kLocalGlobal;
    case Method::kConic:
      return lpdeform::Method::kConic;
  }
  return lpdeform::Method::kAuto;
}

lpdeform::InitialGuess converted(InitialGuess guess) {
  switch (guess) {
    case InitialGuess::kCurrent:
      return lpdeform::InitialGuess::kCurrent;
    case InitialGuess::kLaplacian:
      return lpdeform::InitialGuess::kLaplacian;
    case InitialGuess::kRest:
      return lpdeform::InitialGuess::kRest;
  }
  return lpdeform::InitialGuess::kCurrent;
}

}  // namespace

absl::StatusOr<TriangleMesh> converted(const Mesh& mesh) {
  if (mesh.vertices.size() % 3 != 0) return wrong_size("vertices", mesh.vertices.size());
  if (mesh.faces.size() % 3 != 0) return wrong_size("faces", mesh.faces.size());
  const std::size_t vertices = mesh.vertices.size() / 3;
  TriangleMesh result{mapped(mesh.vertices), Faces(static_cast<Eigen::Index>(mesh.faces.size() / 3), 3)};
  for (std::size_t k = 0; k < mesh.faces.size(); ++k) {
    if (mesh.faces[k] >= vertices || mesh.faces[k] > kMost) {
      return make_fault(
          {Reason::kMeshIndexOutOfRange, absl::StrCat("face ", k / 3), absl::StrCat("vertices < ", vertices)},
          absl::StrCat("face ", k / 3, " uses vertex ", mesh.faces[k], "; the mesh has ", vertices,
                       " vertices"));
    }
    result.faces.data()[k] = static_cast<std::int32_t>(mesh.faces[k]);
  }
  return result;
}

absl::StatusOr<HandleMotion> converted(std::string_view name, const Motion& motion) {
  if (const auto* const rigid = std::get_if<RigidMotion>(&motion)) {
    return lpdeform::RigidMotion{vector_of(rigid->axis), rigid->angle_radians, vector_of(rigid->center),
                                 vector_of(rigid->translation)};
  }
  const auto* const targets = std::get_if<TargetPositions>(&motion);
  if (targets == nullptr) return lpdeform::Fixed{};
  if (targets->positions.size() % 3 != 0) {
    return make_fault({Reason::kHandleTargetCount, handle_element(name), "3 numbers each"},
                      absl::StrCat(handle_element(name), " has ", targets->positions.size(),
                                   " numbers for its target positions; that is not a multiple of 3"));
  }
  return lpdeform::TargetPositions{mapped(targets->positions)};
}

absl::StatusOr<lpdeform::Handle> converted(std::string_view name, const Handle& handle,
                                           const TriangleMesh& mesh) {
  lpdeform::Handle result;
  result.vertices.reserve(handle.vertices.size());
  for (const std::uint32_t vertex : handle.vertices) {
    if (vertex >= static_cast<std::uint32_t>(mesh.vertices.rows()))
      return handle_vertex_out_of_range(name, vertex, mesh.vertices.rows());
    result.vertices.push_back(static_cast<std::int32_t>(vertex));
  }
  for (const SurfacePoint& point : handle.points) {
    if (point.face >= static_cast<std::uint32_t>(mesh.faces.rows()))
      return handle_face_out_of_range(name, point.face, mesh.faces.rows());
    result.points.push_back({static_cast<std::int32_t>(point.face), vector_of(point.barycentric)});
  }
  auto motion = converted(name, handle.motion);
  if (!motion.ok()) return motion.status();
  result.motion = *std::move(motion);
  result.hold = converted(handle.hold);
  result.footprint = handle.footprint;
  return result;
}

absl::StatusOr<Points> points_of(const std::vector<double>& numbers, std::int32_t vertex_count) {
  if (numbers.size() != 3 * static_cast<std::size_t>(vertex_count))
    return wrong_position_count(static_cast<std::int64_t>(numbers.size() / 3), vertex_count);
  return mapped(numbers);
}

Field converted(const FieldValue& value) {
  if (const auto* const one = std::get_if<double>(&value)) return Field::Constant(1, *one);
  const auto& all = std::get<std::vector<double>>(value);
  return Eigen::Map<const Field>(all.data(), static_cast<Eigen::Index>(all.size()));
}

SolveSettings converted(const SolveOptions& options) {
  SolveSettings settings;
  settings.method = converted(options.method);
  settings.initial = converted(options.initial);
  settings.tolerance = options.tolerance;
  settings.max_iterations = options.max_iterations;
  settings.time_limit_seconds = options.time_limit_seconds;
  settings.effort = options.effort;
  settings.certify = options.certify;
  return settings;
}

Error error_of(const absl::Status& status) {
  Fault fault = fault_of(status);
  return {std::move(fault.reason), std::move(fault.element), std::move(fault.limit),
          std::string(status.message())};
}

Result<void> result_of(const absl::Status& status) {
  if (status.ok()) return {};
  return error_of(status);
}

Mesh given_back(const TriangleMesh& mesh) {
  return {numbers_of(mesh.vertices), {mesh.faces.data(), mesh.faces.data() + mesh.faces.size()}};
}

}  // namespace lpdeform::core
