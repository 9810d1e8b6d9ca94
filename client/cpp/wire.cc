#include "client/cpp/wire.h"

#include <span>
#include <string>
#include <utility>
#include <variant>

#include "client/cpp/mesh_notices.h"
#include "client/cpp/status_details.h"
#include "client/cpp/wire_holds.h"
#include "client/cpp/wire_vectors.h"
#include "core/base/fault.h"
#include "core/base/match.h"

namespace lpdeform::client {
namespace {

v1::Method to_wire(Method method) {
  switch (method) {
    case Method::kAuto:
      return v1::METHOD_UNSPECIFIED;
    case Method::kQuasiNewton:
      return v1::METHOD_QUASI_NEWTON;
    case Method::kLineSearch:
      return v1::METHOD_LINE_SEARCH;
    case Method::kLocalGlobal:
      return v1::METHOD_LOCAL_GLOBAL;
    case Method::kConic:
      return v1::METHOD_CONIC;
    case Method::kMultiresolution:
      return v1::METHOD_MULTIRESOLUTION;
  }
  return v1::METHOD_UNSPECIFIED;
}

v1::InitialGuess to_wire(InitialGuess guess) {
  switch (guess) {
    case InitialGuess::kCurrent:
      return v1::INITIAL_GUESS_UNSPECIFIED;
    case InitialGuess::kLaplacian:
      return v1::INITIAL_GUESS_LAPLACIAN;
    case InitialGuess::kRest:
      return v1::INITIAL_GUESS_REST;
  }
  return v1::INITIAL_GUESS_UNSPECIFIED;
}

void to_wire(const SolverSettings& settings, v1::SolverSettings& out) {
  out.set_method(to_wire(settings.method));
  out.set_tolerance(settings.tolerance);
  out.set_max_iterations(settings.max_iterations);
  out.set_time_limit_seconds(settings.time_limit_seconds);
  out.set_initial(to_wire(settings.initial));
  if (!settings.search) return;
  if (settings.search->effort) out.mutable_search()->set_effort(*settings.search->effort);
  out.mutable_search()->set_show(settings.search->show);
  out.mutable_search()->set_least_share(settings.search->least_share);
}

absl::Status to_wire(const FieldValue& value, Packer& packer, v1::Field& out) {
  if (const double* const uniform = std::get_if<double>(&value)) {
    out.set_uniform(*uniform);
    return absl::OkStatus();
  }
  if (const Automatic* const automatic = std::get_if<Automatic>(&value)) {
    out.mutable_automatic()->set_strength(automatic->strength);
    return absl::OkStatus();
  }
  out.mutable_per_vertex()->set_scalar(v1::SCALAR_FLOAT64);
  return packer.pack(bytes_of(std::get<std::vector<double>>(value)),
                     *out.mutable_per_vertex()->mutable_values());
}

absl::Status to_wire(const Motion& motion, Packer& packer, v1::Motion& out) {
  const Match put_motion{[&](const Fixed&) {
                           out.mutable_fixed();
                           return absl::OkStatus();
                         },
                         [&](const RigidMotion& rigid) {
                           v1::RigidMotion& message = *out.mutable_rigid();
                           put(rigid.axis, message.mutable_axis());
                           message.set_angle_radians(rigid.angle_radians);
                           put(rigid.center, message.mutable_center());
                           put(rigid.translation, message.mutable_translation());
                           return absl::OkStatus();
                         },
                         [&](const TargetPositions& targets) {
                           out.mutable_targets()->set_scalar(v1::SCALAR_FLOAT64);
                           return packer.pack(bytes_of(targets.positions),
                                              *out.mutable_targets()->mutable_positions());
                         }};
  return std::visit(put_motion, motion);
}

absl::Status to_wire(const std::vector<SurfacePoint>& points, Packer& packer, v1::SurfacePoints& out) {
  std::vector<std::uint32_t> faces;
  std::vector<double> barycentric;
  for (const SurfacePoint& point : points) {
    faces.push_back(point.face);
    barycentric.insert(barycentric.end(), point.barycentric.begin(), point.barycentric.end());
  }
  out.set_scalar(v1::SCALAR_FLOAT64);
  absl::Status packed = packer.pack(bytes_of(faces), *out.mutable_faces());
  packed.Update(packer.pack(bytes_of(barycentric), *out.mutable_barycentric()));
  return packed;
}

absl::Status to_wire(const Handle& handle, Packer& packer, v1::Handle& out) {
  absl::Status packed;
  if (!handle.vertices.empty() || handle.points.empty()) {
    packed.Update(packer.pack(bytes_of(handle.vertices), *out.mutable_vertices()));
  }
  if (!handle.points.empty()) packed.Update(to_wire(handle.points, packer, *out.mutable_points()));
  packed.Update(to_wire(handle.motion, packer, *out.mutable_motion()));
  to_wire(handle.hold, out);
  out.set_footprint_radius(handle.footprint);
  return packed;
}

absl::Status to_wire(const Update::Change& change, Packer& packer, v1::HandleUpdate& out) {
  const Match put_change{[&](const Handle& handle) { return to_wire(handle, packer, *out.mutable_set()); },
                         [&](const Motion& motion) { return to_wire(motion, packer, *out.mutable_move()); },
                         [&](const Update::Removal&) {
                           out.mutable_remove();
                           return absl::OkStatus();
                         }};
  return std::visit(put_change, change);
}

void to_wire(const Resize& resize, v1::Resize& out) {
  put(resize.scale, out.mutable_scale());
  if (resize.origin) put(*resize.origin, out.mutable_origin());
  if (!resize.axes) return;
  put((*resize.axes)[0], out.mutable_x_axis());
  put((*resize.axes)[1], out.mutable_y_axis());
}

}  // namespace

absl::Status to_wire(const Mesh& mesh, Packer& packer, v1::Mesh& out) {
  out.set_vertex_count(static_cast<std::uint32_t>(mesh.vertex_count()));
  out.set_face_count(static_cast<std::uint32_t>(mesh.face_count()));
  out.set_scalar(v1::SCALAR_FLOAT64);
  return packer.pack(bytes_of(mesh.vertices) + bytes_of(mesh.faces), *out.mutable_data());
}

absl::Status to_wire(const Weld& weld, Packer& packer, v1::CreateSessionRequest& out) {
  if (weld.by_position) out.mutable_weld()->mutable_position()->set_tolerance(weld.tolerance);
  if (weld.by_position || weld.groups.empty()) return absl::OkStatus();
  return packer.pack(bytes_of(weld.groups), *out.mutable_weld()->mutable_groups());
}

absl::Status to_wire(const Settings& settings, Packer& packer, v1::SettingsUpdate& out) {
  absl::Status packed;
  if (settings.p) packed.Update(to_wire(*settings.p, packer, *out.mutable_p()));
  if (settings.stiffness) packed.Update(to_wire(*settings.stiffness, packer, *out.mutable_stiffness()));
  if (settings.length_unit) out.mutable_length_unit()->set_length(*settings.length_unit);
  if (settings.solver) to_wire(*settings.solver, *out.mutable_solver());
  if (settings.region) {
    v1::RegionOfInterest& region = *out.mutable_region();
    const auto& vertices = settings.region->vertices;
    if (!vertices.empty()) packed.Update(packer.pack(bytes_of(vertices), *region.mutable_vertices()));
  }
  return packed;
}

absl::Status to_wire(const Update& update, std::uint64_t seq, Packer& packer, v1::Update& out) {
  out.set_input_seq(seq);
  out.set_begins_step(update.begins_step);
  for (const auto& [name, change] : update.handles) {
    v1::HandleUpdate& message = *out.add_handles();
    message.set_name(name);
    absl::Status packed = to_wire(change, packer, message);
    if (!packed.ok()) return packed;
  }
  if (update.resize) to_wire(*update.resize, *out.mutable_resize());
  const Settings& settings = update.settings;
  const bool has_field = settings.p || settings.stiffness || settings.length_unit;
  if (!has_field && !settings.solver && !settings.region) return absl::OkStatus();
  return to_wire(settings, packer, *out.mutable_settings());
}

v1::WeightKind to_wire(WeightKind weights) {
  switch (weights) {
    case WeightKind::kCotangent:
      return v1::WEIGHT_KIND_COTANGENT;
    case WeightKind::kUniform:
      return v1::WEIGHT_KIND_UNIFORM;
    case WeightKind::kIntrinsicDelaunay:
      return v1::WEIGHT_KIND_INTRINSIC_DELAUNAY;
  }
  return v1::WEIGHT_KIND_UNSPECIFIED;
}

v1::Encoding to_wire(Encoding encoding) {
  switch (encoding) {
    case Encoding::kRaw:
      return v1::ENCODING_RAW;
    case Encoding::kQuantized:
      return v1::ENCODING_QUANTIZED;
    case Encoding::kCompressed:
      return v1::ENCODING_COMPRESSED;
  }
  return v1::ENCODING_UNSPECIFIED;
}

v1::FreeComponents to_wire(FreeComponents free_components) {
  switch (free_components) {
    case FreeComponents::kError:
      return v1::FREE_COMPONENTS_ERROR;
    case FreeComponents::kStay:
      return v1::FREE_COMPONENTS_STAY;
    case FreeComponents::kFollow:
      return v1::FREE_COMPONENTS_FOLLOW;
  }
  return v1::FREE_COMPONENTS_UNSPECIFIED;
}

MeshReport from_wire(const v1::MeshReport& report) {
  MeshReport out{.vertices = report.vertices(),
                 .faces = report.faces(),
                 .edges = report.edges(),
                 .components = report.components(),
                 .boundary_loops = report.boundary_loops(),
                 .defects = {},
                 .welded_vertices = report.welded_vertices()};
  for (const v1::Defect& defect : report.defects()) {
    out.defects.push_back({defect.kind(), defect.count(), {defect.first().begin(), defect.first().end()}});
  }
  out.notices = mesh_notices(out.defects);
  return out;
}

StopReason from_wire(v1::StopReason reason) {
  switch (reason) {
    case v1::STOP_REASON_CONVERGED:
      return StopReason::kConverged;
    case v1::STOP_REASON_ITERATION_LIMIT:
      return StopReason::kIterationLimit;
    case v1::STOP_REASON_TIME_LIMIT:
      return StopReason::kTimeLimit;
    case v1::STOP_REASON_CANCELLED:
      return StopReason::kCancelled;
    case v1::STOP_REASON_STALLED:
      return StopReason::kStalled;
    case v1::STOP_REASON_NUMERICAL_BREAKDOWN:
      return StopReason::kNumericalBreakdown;
    default:
      return StopReason::kRunning;
  }
}

std::string method_name(v1::Method method) {
  switch (method) {
    case v1::METHOD_QUASI_NEWTON:
      return "quasi_newton";
    case v1::METHOD_LINE_SEARCH:
      return "line_search";
    case v1::METHOD_LOCAL_GLOBAL:
      return "local_global";
    case v1::METHOD_CONIC:
      return "conic";
    case v1::METHOD_MULTIRESOLUTION:
      return "multiresolution";
    default:
      return "";
  }
}

IterationRecord from_wire(const v1::IterationRecord& record) {
  return {record.iteration(), record.seconds(), record.energy(), record.objective(), record.stage()};
}

void from_wire(const v1::SolveSummary& summary, SolveResult& out) {
  out.method = method_name(summary.method());
  out.stop_reason = from_wire(summary.stop_reason());
  out.iterations = summary.iterations();
  out.initial_energy = summary.initial_energy();
  out.energy = summary.energy();
  out.soft_energy = summary.soft_energy();
  if (summary.has_certificate()) out.optimality_gap = summary.certificate().relative_gap();
  out.setup_seconds = summary.setup_seconds();
  out.solve_seconds = summary.solve_seconds();
  out.threads = summary.threads();
  out.input_seq = summary.input_seq();
  out.minima.assign(summary.minima().begin(), summary.minima().end());
  out.further_starts = summary.further_starts();
  out.search_iterations = summary.search_iterations();
  out.effort = summary.effort();
}

absl::Status from_wire(const v1::Fault& fault) {
  absl::Status status = carry_fault(static_cast<absl::StatusCode>(fault.code()),
                                    {fault.reason(), fault.element(), fault.limit()}, fault.text());
  return with_retry_after(std::move(status), std::chrono::milliseconds(fault.retry_after_ms()));
}

Notice from_wire(const v1::Notice& notice) {
  switch (notice.reason()) {
    case v1::NOTICE_REASON_OVERLOADED:
      return {.reason = Notice::Reason::kOverloaded, .text = notice.text()};
    case v1::NOTICE_REASON_RECOVERED:
      return {.reason = Notice::Reason::kRecovered, .text = notice.text()};
    case v1::NOTICE_REASON_BETTER_SHAPE:
      return {Notice::Reason::kBetterShape, notice.text(), notice.input_seq(), notice.energy(),
              notice.saved_share()};
    default:
      return {.reason = Notice::Reason::kOther, .text = notice.text()};
  }
}

std::string stop_reason_name(StopReason reason) {
  switch (reason) {
    case StopReason::kRunning:
      return "running";
    case StopReason::kConverged:
      return "converged";
    case StopReason::kIterationLimit:
      return "iteration_limit";
    case StopReason::kTimeLimit:
      return "time_limit";
    case StopReason::kCancelled:
      return "cancelled";
    case StopReason::kStalled:
      return "stalled";
    case StopReason::kNumericalBreakdown:
      return "numerical_breakdown";
  }
  return "unknown";
}

}  // namespace lpdeform::client
