#include "client/c/changes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "client/c/structs.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
namespace {

using namespace client;

template <typename T>
std::vector<T> copied(const T* from, std::size_t count) {
  return count == 0 ? std::vector<T>() : std::vector<T>(from, from + count);
}

Vector vector_of(const double (&from)[3]) {
  return {from[0], from[1], from[2]};
}

absl::StatusOr<Motion> read_rigid(const lpdeform_motion& motion, const Space& space) {
  const double* const q = motion.rotation;
  RigidMotion out;
  out.center = space.point_to_server(vector_of(motion.center));
  out.translation = space.point_to_server(vector_of(motion.translation));
  if (!std::all_of(q, q + 4, [](double number) { return std::isfinite(number); })) {
    return make_fault({Reason::kRotationNotFinite, "rotation", ""},
                      "A number of the rotation is not finite.");
  }
  const double sine = std::hypot(q[0], q[1], q[2]);
  if (sine == 0) return out;
  out.axis = space.rotation_axis_to_server({q[0] / sine, q[1] / sine, q[2] / sine});
  out.angle_radians = 2 * std::atan2(sine, q[3]);
  return out;
}

absl::StatusOr<Motion> read_positions(const lpdeform_motion& motion, const Space& space) {
  if (motion.positions == nullptr && motion.position_count > 0) return argument_missing("motion.positions");
  TargetPositions out;
  out.positions.reserve(std::size_t{3} * motion.position_count);
  for (std::size_t i = 0; i < motion.position_count; ++i) {
    const double* const from = motion.positions + 3 * i;
    const Vector at = space.point_to_server({from[0], from[1], from[2]});
    out.positions.insert(out.positions.end(), at.begin(), at.end());
  }
  return out;
}

static_assert(std::variant_size_v<Hold> == LPDEFORM_PLANE_LOCK + 1, "lpdeform.h has every kind of hold");

absl::StatusOr<Hold> read_hold(const lpdeform_handle& handle, const Space& space) {
  if (absl::Status known = check_enum("hold", handle.hold, std::variant_size_v<Hold> - 1); !known.ok()) {
    return known;
  }
  const Vector direction = space.direction_to_server(vector_of(handle.direction));
  switch (static_cast<lpdeform_hold_values>(handle.hold)) {
    case LPDEFORM_EXACTLY:
      return Exactly{};
    case LPDEFORM_SOFT:
      return handle.weight == 0 ? Soft{} : Soft{handle.weight};
    case LPDEFORM_ORIENTATION:
      return handle.weight == 0 ? Orientation{} : Orientation{handle.weight};
    case LPDEFORM_AXIS_LOCK:
      return AxisLock{direction};
    case LPDEFORM_PLANE_LOCK:
      return PlaneLock{direction};
  }
  return Exactly{};  // not reached
}

/// If Space turns triangles, their second and third corners are exchanged.
SurfacePoint read_point(const lpdeform_point& point, const Space& space) {
  SurfacePoint out{point.face, vector_of(point.barycentric)};
  if (space.turns_triangles()) std::swap(out.barycentric[1], out.barycentric[2]);
  return out;
}

std::optional<FieldValue> read_field(double uniform, const double* per_vertex, std::uint32_t count,
                                     double automatic) {
  if (per_vertex != nullptr) return copied(per_vertex, count);
  if (automatic != 0) return Automatic{automatic};
  if (uniform != 0) return uniform;
  return std::nullopt;
}

absl::StatusOr<std::optional<MinimaSearch>> read_search(const lpdeform_settings& settings) {
  if (settings.set_search == 0) return std::nullopt;
  if (settings.search_effort < -1) {
    return make_fault({Reason::kEffortOutOfRange, "search_effort", "-1 <= search_effort <= 1000"},
                      "The effort of the search for lower minima is negative.");
  }
  MinimaSearch out{.show = settings.search_shows != 0, .least_share = settings.search_least_share};
  if (settings.search_effort != 0) out.effort = std::max(settings.search_effort, 0);
  return out;
}

/// False if the update already has a change of this handle.
bool add(Update& update, const char* name, Update::Change change) {
  return update.handles.emplace(name, std::move(change)).second;
}

absl::Status changed_twice(const char* name) {
  return make_fault({Reason::kHandleChangedTwice, absl::StrCat("handle \"", name, "\""), ""},
                    absl::StrCat("The update changes handle \"", name, "\" twice."));
}

absl::Status read_sets(const lpdeform_update& update, const Space& space, Update& out) {
  const auto* next = reinterpret_cast<const unsigned char*>(update.sets);
  for (std::uint32_t k = 0; k < update.set_count; ++k) {
    const auto* const given = reinterpret_cast<const lpdeform_handle*>(next);
    const auto handle = read_struct(given, "handle");
    if (!handle.ok()) return handle.status();
    next += handle->struct_size;  // the caller's struct, which may be larger than ours
    auto read = read_handle(*handle, space);
    if (!read.ok()) return read.status();
    if (!add(out, handle->name, *std::move(read))) return changed_twice(handle->name);
  }
  return absl::OkStatus();
}

absl::Status read_moves(const lpdeform_update& update, const Space& space, Update& out) {
  for (std::uint32_t k = 0; k < update.move_count; ++k) {
    const lpdeform_move& move = update.moves[k];
    if (move.name == nullptr) return argument_missing("move.name");
    auto motion = read_motion(move.motion, space);
    if (!motion.ok()) return motion.status();
    if (!add(out, move.name, *std::move(motion))) return changed_twice(move.name);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Motion> read_motion(const lpdeform_motion& motion, const Space& space) {
  switch (motion.kind) {
    case LPDEFORM_FIXED:
      return Fixed{};
    case LPDEFORM_RIGID:
      return read_rigid(motion, space);
    case LPDEFORM_POSITIONS:
      return read_positions(motion, space);
    default:
      return check_enum("motion.kind", motion.kind, LPDEFORM_POSITIONS);
  }
}

absl::StatusOr<Handle> read_handle(const lpdeform_handle& handle, const Space& space) {
  if (handle.name == nullptr) return argument_missing("handle.name");
  if (handle.vertices == nullptr && handle.vertex_count > 0) return argument_missing("handle.vertices");
  if (handle.points == nullptr && handle.point_count > 0) return argument_missing("handle.points");
  auto motion = read_motion(handle.motion, space);
  if (!motion.ok()) return motion.status();
  auto hold = read_hold(handle, space);
  if (!hold.ok()) return hold.status();
  Handle out;
  out.vertices = copied(handle.vertices, handle.vertex_count);
  for (std::uint32_t k = 0; k < handle.point_count; ++k) {
    const absl::Status reserved = check_reserved(absl::StrCat("points[", k, "]"), handle.points[k].reserved);
    if (!reserved.ok()) return reserved;
    out.points.push_back(read_point(handle.points[k], space));
  }
  out.motion = *std::move(motion);
  out.hold = *hold;
  out.footprint = space.length_to_server(handle.footprint);
  return out;
}

absl::StatusOr<Settings> read_settings(const lpdeform_settings& settings, const Space& space) {
  const absl::Status reserved =
      check_reserved("settings", settings.reserved | settings.reserved_too | settings.reserved_search);
  if (!reserved.ok()) return reserved;
  Settings out;
  out.p = read_field(settings.p, settings.p_per_vertex, settings.p_count, settings.p_automatic);
  out.stiffness = read_field(settings.stiffness, settings.stiffness_per_vertex, settings.stiffness_count,
                             settings.stiffness_automatic);
  if (settings.length_unit != 0) {
    out.length_unit = settings.length_unit < 0 ? 0 : space.length_to_server(settings.length_unit);
  }
  if (settings.set_solver != 0) {
    if (settings.method < LPDEFORM_METHOD_AUTO || settings.method > LPDEFORM_METHOD_MULTIRESOLUTION) {
      return check_enum("method", settings.method, LPDEFORM_METHOD_MULTIRESOLUTION);
    }
    const absl::StatusOr<std::optional<MinimaSearch>> search = read_search(settings);
    if (!search.ok()) return search.status();
    out.solver = SolverSettings{.method = static_cast<Method>(settings.method),
                                .tolerance = settings.tolerance,
                                .max_iterations = settings.max_iterations,
                                .time_limit_seconds = settings.time_limit_seconds,
                                .search = *search};
  }
  if (settings.set_region != 0) {
    if (settings.region == nullptr && settings.region_count > 0) return argument_missing("settings.region");
    out.region = RegionOfInterest{copied(settings.region, settings.region_count)};
  }
  return out;
}

/// The engine's first axis stays the first axis, converted to its direction in the server's coordinates.
absl::StatusOr<Update> read_resizing(const lpdeform_resizing& resizing, const Space& space) {
  Resize resize;
  for (int k = 0; k < 3; ++k) resize.scale[k] = resizing.scale[k] == 0 ? 1 : resizing.scale[k];
  const bool has_axes = resizing.set_axes != 0;
  resize.axes = {space.direction_to_server(has_axes ? vector_of(resizing.x_axis) : Vector{1, 0, 0}),
                 space.direction_to_server(has_axes ? vector_of(resizing.y_axis) : Vector{0, 1, 0})};
  if (resizing.set_origin != 0) resize.origin = space.point_to_server(vector_of(resizing.origin));
  const absl::Status reserved = check_reserved("resizing", resizing.reserved);
  if (!reserved.ok()) return reserved;
  Update out;
  out.resize = resize;
  return out;
}

absl::StatusOr<Update> read_update(const lpdeform_update& update, const Space& space) {
  if (update.sets == nullptr && update.set_count > 0) return argument_missing("update.sets");
  if (update.moves == nullptr && update.move_count > 0) return argument_missing("update.moves");
  if (update.removals == nullptr && update.removal_count > 0) return argument_missing("update.removals");
  Update out;
  absl::Status read = read_sets(update, space, out);
  if (read.ok()) read = read_moves(update, space, out);
  read.Update(check_reserved("update", update.reserved));
  if (!read.ok()) return read;
  out.begins_step = update.begins_step != 0;
  for (std::uint32_t k = 0; k < update.removal_count; ++k) {
    const char* const name = update.removals[k];
    if (name == nullptr) return argument_missing("update.removals[k]");
    if (!add(out, name, Update::Removal{})) return changed_twice(name);
  }
  if (update.settings == nullptr) return out;
  const auto given = read_struct(update.settings, "settings");
  if (!given.ok()) return given.status();
  auto settings = read_settings(*given, space);
  if (!settings.ok()) return settings.status();
  out.settings = *std::move(settings);
  return out;
}

}  // namespace lpdeform::engine
