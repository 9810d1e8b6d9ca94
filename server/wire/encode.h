#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "lpdeform/v1/service.pb.h"
#include "server/session/frame_stream.h"
#include "server/session/session.h"
#include "server/session/solve_job.h"
#include "server/wire/outgoing.h"

namespace lpdeform {

// Converts values of core and session to messages of the contract.

/// `idle`: how long a session lives without use.
void encode(const SessionInfo& info, Timers::Duration idle, Timers::TimePoint now, v1::Session& out);

v1::WeightKind encode_weights(WeightKind weights);
v1::FreeComponents encode_free_components(FreeComponents free_components);
/// For settings as Decoder makes them: max_iterations is not 0.
void encode_solver(const SolveSettings& settings, v1::SolverSettings& out);

/// An error inside a stream.
void encode(const FaultNote& fault, v1::Fault& out);

void encode(const SolveResult& result, v1::SolveSummary& out);

void encode(const UpdateResult& result, v1::UpdateResult& out);

/// A note of a stream: an event, or the result of an update.
void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::DeformResponse>& out);
/// The same for a stream that takes no updates.
void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::StreamFramesResponse>& out);
/// The same for one of several sessions on a stream; the caller sets its number.
void encode(const Note& note, const FrameStream& stream, std::uint32_t vertex_count,
            Outgoing<v1::StreamSessionsResponse>& out);

/// A piece of a solve's result.
void encode(const FramePiece& piece, Outgoing<v1::SolveResponse>& out);

/// The records [begin, end) of a trace.
void encode_trace(const std::vector<IterationRecord>& trace, std::size_t begin, std::size_t end,
                  v1::SolveTrace& out);

}  // namespace lpdeform
