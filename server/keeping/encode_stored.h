#pragma once

#include <cstdint>
#include <vector>

#include "core/energy/material.h"
#include "core/problem/handles.h"
#include "lpdeform/v1/service.pb.h"
#include "server/session/session.h"

namespace lpdeform {

// Values of a session as messages of the contract, exact to the last bit: Decoder makes the same values of
// them. Buffers are inline, of any size.

/// Everything that CreateSession needs for the session's mesh, without settings and handles.
void encode_mesh(const SessionInfo& session, v1::CreateSessionRequest& out);
void encode_positions(const Points& positions, v1::Positions& out);
v1::Field encode_whole_field(const Field& field);
v1::RegionOfInterest encode_region(const std::vector<std::int32_t>& vertices);
/// Without the handle's motion.
void encode_group(const Handle& handle, v1::Handle& out);
void encode_motion(const HandleMotion& motion, v1::Motion& out);
void encode_change(const HandleChange& change, v1::HandleUpdate& out);

}  // namespace lpdeform
