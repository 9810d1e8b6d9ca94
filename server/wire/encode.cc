#include "server/wire/encode.h"

#include <chrono>
#include <limits>
#include <string>
#include <utility>
#include <variant>

#include "absl/strings/str_format.h"
#include "core/base/fault.h"
#include "core/base/match.h"
#include "server/runtime/refusals.h"
#include "server/wire/holds.h"
#include "server/wire/vectors.h"

namespace lpdeform {
namespace {

v1::StopReason encode_stop(StopReason reason) {
  switch (reason) {
    case StopReason::kRunning:
      return v1::STOP_REASON_UNSPECIFIED;
    case StopReason::kConverged:
      return v1::STOP_REASON_CONVERGED;
    case StopReason::kIterationLimit:
      return v1::STOP_REASON_ITERATION_LIMIT;
    case StopReason::kTimeLimit:
      return v1::STOP_REASON_TIME_LIMIT;
    case StopReason::kCancelled:
      return v1::STOP_REASON_CANCELLED;
    case StopReason::kStalled:
      return v1::STOP_REASON_STALLED;
    case StopReason::kNumericalBreakdown:
      return v1::STOP_REASON_NUMERICAL_BREAKDOWN;
  }
  return v1::STOP_REASON_UNSPECIFIED;
}

v1::Method encode_method(Method method) {
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

v1::InitialGuess encode_initial(InitialGuess guess) {
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

v1::GoAwayReason encode_reason(EndReason reason) {
  switch (reason) {
    case EndReason::kSessionDeleted:
      return v1::GO_AWAY_REASON_SESSION_DELETED;
    case EndReason::kSessionExpired:
      return v1::GO_AWAY_REASON_SESSION_EXPIRED;
    case EndReason::kDraining:
    case EndReason::kElsewhere:
      return v1::GO_AWAY_REASON_DRAINING;
    case EndReason::kWriterReplaced:
      return v1::GO_AWAY_REASON_WRITER_REPLACED;
    case EndReason::kProtocolError:
      return v1::GO_AWAY_REASON_PROTOCOL_ERROR;
    case EndReason::kTokenExpired:
      return v1::GO_AWAY_REASON_TOKEN_EXPIRED;
  }
  return v1::GO_AWAY_REASON_UNSPECIFIED;
}

void encode_field(const Field& field, v1::Field& out) {
  if (field.size() == 1) {
    out.set_uniform(field[0]);
  } else {
    out.mutable_per_vertex();
  }
}

void encode_report(const MeshReport& report, v1::MeshReport& out) {
  out.set_vertices(static_cast<std::uint32_t>(report.vertices));
  out.set_faces(static_cast<std::uint32_t>(report.faces));
  out.set_edges(static_cast<std::uint32_t>(report.edges));
  out.set_components(static_cast<std::uint32_t>(report.components));
  out.set_boundary_loops(static_cast<std::uint32_t>(report.boundary_loops));
  for (const Defect defect : all_defects()) {
    const DefectCount& count = report.of(defect);
    v1::Defect& message = *out.add_defects();
    message.set_kind(std::string(defect_name(defect)));
    message.set_count(static_cast<std::uint32_t>(count.count));
    message.mutable_first()->Add(count.first.begin(), count.first.end());
  }
}

void encode_settings(const Inputs& inputs, v1::SettingsUpdate& out) {
  encode_field(inputs.given_material->p, *out.mutable_p());
  encode_field(inputs.given_material->stiffness, *out.mutable_stiffness());
  out.mutable_length_unit()->set_length(inputs.given_material->length_unit);
  encode_solver(inputs.solver, *out.mutable_solver());
}

v1::Scalar encode_scalar(Format format) {
  return format == Format::kFloat64 ? v1::SCALAR_FLOAT64 : v1::SCALAR_FLOAT32;
}

v1::Encoding encode_encoding(Format format) {
  if (format == Format::kCompressed) return v1::ENCODING_COMPRESSED;
  return format == Format::kQuantized ? v1::ENCODING_QUANTIZED : v1::ENCODING_RAW;
}

void encode_quantization(const Quantization& quantization, v1::Quantization& out) {
  encode_vector(quantization.origin, *out.mutable_origin());
  encode_vector(quantization.extent, *out.mutable_extent());
  out.set_distortion_extent(quantization.distortion_extent);
}

void encode_header(const FramePiece& piece, v1::FrameHeader& out) {
  const Frame& frame = *piece.frame;
  out.set_frame_seq(frame.frame_seq);
  out.set_input_seq(frame.input_seq);
  out.set_epoch(frame.epoch);
  out.set_skipped_inputs(piece.skipped_inputs);
  out.set_iteration(frame.iteration);
  out.set_energy(frame.energy);
  out.set_soft_energy(frame.soft_energy);
  out.set_is_final(frame.is_final);
  out.set_stop_reason(encode_stop(frame.stop_reason));
  out.set_vertex_count(frame.surface->vertex_count());
  out.set_scalar(encode_scalar(piece.format));
  out.set_encoding(encode_encoding(piece.format));
  if (piece.format >= Format::kQuantized) {
    encode_quantization(frame.surface->quantization(), *out.mutable_quantization());
  }
  out.set_solve_seconds(frame.solve_seconds);
  out.set_method(encode_method(frame.method));
  if (frame.optimality_gap && piece.with_certificate) {
    out.mutable_certificate()->set_relative_gap(*frame.optimality_gap);
  }
}

/// Everything but the numbers: see Outgoing.
void encode_piece(const FramePiece& piece, v1::FramePart& out) {
  if (piece.first == 0) encode_header(piece, *out.mutable_header());
  out.set_frame_seq(piece.frame->frame_seq);
  out.set_first_vertex(piece.first);
  out.set_vertex_count(piece.count);
  out.set_last(piece.is_last);
}

void encode_notice(const LoadNote& load, v1::Notice& out) {
  out.set_reason(load.is_overloaded ? v1::NOTICE_REASON_OVERLOADED : v1::NOTICE_REASON_RECOVERED);
  out.set_text(load.is_overloaded
                   ? "The server is overloaded: frames come less often, and refined ones later."
                   : "The server is no longer overloaded.");
}

void encode_notice(const BetterNote& better, v1::Notice& out) {
  out.set_reason(v1::NOTICE_REASON_BETTER_SHAPE);
  out.set_input_seq(better.input_seq);
  out.set_energy(better.energy);
  out.set_saved_share(better.saved_share);
  out.set_text(absl::StrFormat("A shape with %.3g %% less energy is known.", 100 * better.saved_share));
}

void encode_event(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
                  v1::StreamEvent& out) {
  const Match put{[&](const OpenedNote& opened) {
                    v1::StreamOpened& message = *out.mutable_opened();
                    message.set_stream_id(stream.id());
                    message.set_epoch(opened.epoch);
                    message.set_input_seq(opened.input_seq);
                    message.set_heartbeat_interval_ms(static_cast<std::uint32_t>(
                        std::chrono::ceil<std::chrono::milliseconds>(stream.heartbeat()).count()));
                    message.set_vertex_count(vertex_count);
                    const StreamOptions& options = stream.options();
                    v1::FrameOptions& granted = *message.mutable_options();
                    granted.set_credit(options.credit);
                    granted.set_scalar(encode_scalar(options.format));
                    granted.set_encoding(encode_encoding(options.format));
                    granted.set_lowest_encoding(encode_encoding(options.lowest_format));
                    granted.set_without_distortion(!options.with_distortion);
                    granted.set_with_normals(options.with_normals);
                    granted.set_certify(options.with_certificate);
                    granted.set_max_frames_per_second(options.max_frames_per_second);
                  },
                  [&](const FramePiece& piece) { encode_piece(piece, *out.mutable_frame()); },
                  [&](const UpdateResult&) {},  // not an event: see encode() of a DeformResponse
                  [&](const FaultNote& fault) { encode(fault, *out.mutable_fault()); },
                  [&](const LoadNote& load) { encode_notice(load, *out.mutable_notice()); },
                  [&](const BetterNote& better) { encode_notice(better, *out.mutable_notice()); },
                  [&](const HeartbeatNote&) { out.mutable_heartbeat(); },
                  [&](const EndNote& end) {
                    out.mutable_go_away()->set_reason(encode_reason(end.reason));
                    out.mutable_go_away()->set_text(end.text);
                    if (goes_on(end.reason)) out.mutable_go_away()->set_reconnect_after_ms(1000);
                  }};
  std::visit(put, note);
}

template <typename Message>
void encode_to(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
               Outgoing<Message>& out) {
  encode_event(note, stream, vertex_count, *out.message.mutable_event());
  if (const auto* const piece = std::get_if<FramePiece>(&note)) out.piece = *piece;
}

}  // namespace

v1::FreeComponents encode_free_components(FreeComponents free_components) {
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

v1::WeightKind encode_weights(WeightKind weights) {
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

void encode_solver(const SolveSettings& settings, v1::SolverSettings& out) {
  out.set_method(encode_method(settings.method));
  out.set_tolerance(settings.tolerance);
  out.set_max_iterations(static_cast<std::uint32_t>(settings.max_iterations));
  const bool has_limit = settings.time_limit_seconds < std::numeric_limits<double>::infinity();
  out.set_time_limit_seconds(has_limit ? settings.time_limit_seconds : 0);
  out.set_initial(encode_initial(settings.initial));
  if (!settings.effort && settings.standing == StandingSearch{}) return;
  if (settings.effort) out.mutable_search()->set_effort(static_cast<std::uint32_t>(*settings.effort));
  out.mutable_search()->set_show(settings.standing.shows);
  out.mutable_search()->set_least_share(settings.standing.least_share);
}

void encode(const SessionInfo& info, Timers::Duration idle, Timers::TimePoint now, v1::Session& out) {
  using std::chrono::duration_cast;
  using std::chrono::milliseconds;
  out.set_name(info.name);
  out.set_route(info.route);
  out.set_epoch(info.epoch);
  encode_report(info.mesh->report(), *out.mutable_mesh());
  out.mutable_mesh()->set_welded_vertices(info.mesh->copy_count());
  out.set_input_seq(info.inputs.input_seq);
  encode_settings(info.inputs, *out.mutable_settings());
  for (const auto& [name, handle] : info.inputs.given_handles->handles()) {
    v1::HandleInfo& message = *out.add_handles();
    message.set_name(name);
    message.set_vertex_count(static_cast<std::uint32_t>(handle.vertices.size()));
    message.set_point_count(static_cast<std::uint32_t>(handle.points.size()));
    message.set_kind(kind_of(handle.hold));
  }
  if (const auto* const region = info.inputs.handles->region()) {
    out.set_region_vertex_count(static_cast<std::uint32_t>(region->size()));
  }
  out.set_created_unix_ms(info.created_unix_ms);
  const auto unix_now = std::chrono::system_clock::now().time_since_epoch();
  out.set_expires_unix_ms(duration_cast<milliseconds>(unix_now + (info.last_used - now) + idle).count());
  out.set_memory_bytes(info.memory_bytes);
  out.set_undo_steps(static_cast<std::uint32_t>(info.undo_steps));
  out.set_redo_steps(static_cast<std::uint32_t>(info.redo_steps));
  out.set_weights(encode_weights(info.shape->weight_kind()));
  out.set_free_components(encode_free_components(info.free_components));
}

void encode(const FaultNote& fault, v1::Fault& out) {
  const Fault details = fault_of(fault.status);
  out.set_code(static_cast<int>(fault.status.code()));
  out.set_reason(details.reason);
  out.set_text(std::string(fault.status.message()));
  out.set_element(details.element);
  out.set_limit(details.limit);
  out.set_input_seq(fault.input_seq);
  out.set_retry_after_ms(retry_after_ms(fault.status));
}

void encode(const SolveResult& result, v1::SolveSummary& out) {
  const SolveSummary& summary = result.summary;
  out.set_method(encode_method(summary.method));
  out.set_stop_reason(encode_stop(summary.stop_reason));
  out.set_iterations(static_cast<std::uint32_t>(summary.iterations));
  out.set_initial_energy(summary.initial_energy);
  out.set_energy(summary.energy);
  out.set_soft_energy(summary.soft_energy);
  if (summary.optimality_gap) out.mutable_certificate()->set_relative_gap(*summary.optimality_gap);
  out.set_setup_seconds(summary.setup_seconds);
  out.set_solve_seconds(summary.solve_seconds);
  out.set_threads(static_cast<std::uint32_t>(summary.threads));
  out.mutable_minima()->Assign(summary.minima.begin(), summary.minima.end());
  out.set_further_starts(static_cast<std::uint32_t>(summary.further_starts));
  out.set_search_iterations(static_cast<std::uint32_t>(summary.search_iterations));
  out.set_effort(static_cast<std::uint32_t>(summary.effort));
  out.set_input_seq(result.frame->input_seq);
}

void encode(const UpdateResult& result, v1::UpdateResult& out) {
  out.set_input_seq(result.input_seq);
  out.set_stale_parts(result.stale_parts);
  out.set_kept(result.is_kept);
}

void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::DeformResponse>& out) {
  if (const auto* const result = std::get_if<UpdateResult>(&note))
    return encode(*result, *out.message.mutable_result());
  encode_to(note, stream, vertex_count, out);
}

void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::StreamFramesResponse>& out) {
  encode_to(note, stream, vertex_count, out);
}

void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::StreamSessionsResponse>& out) {
  encode_to(note, stream, vertex_count, out);
}

void encode(const FramePiece& piece, Outgoing<v1::SolveResponse>& out) {
  encode_piece(piece, *out.message.mutable_frame());
  out.piece = piece;
}

void encode_trace(const std::vector<IterationRecord>& trace, std::size_t begin, std::size_t end,
                  v1::SolveTrace& out) {
  for (std::size_t k = begin; k < end; ++k) {
    v1::IterationRecord& message = *out.add_records();
    message.set_iteration(static_cast<std::uint32_t>(trace[k].iteration));
    message.set_seconds(trace[k].seconds);
    message.set_energy(trace[k].energy);
    message.set_objective(trace[k].objective);
    message.set_stage(static_cast<std::uint32_t>(trace[k].stage));
  }
}

}  // namespace lpdeform
