#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/packer.h"
#include "client/cpp/types.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

// Conversions of our plain types to messages. They fail only if an upload of the packer fails.

absl::Status to_wire(const Mesh& mesh, Packer& packer, v1::Mesh& out);
/// Does nothing if the weld is empty.
absl::Status to_wire(const Weld& weld, Packer& packer, v1::CreateSessionRequest& out);
absl::Status to_wire(const Settings& settings, Packer& packer, v1::SettingsUpdate& out);
absl::Status to_wire(const Update& update, std::uint64_t seq, Packer& packer, v1::Update& out);
v1::WeightKind to_wire(WeightKind weights);
v1::Encoding to_wire(Encoding encoding);
v1::FreeComponents to_wire(FreeComponents free_components);

// Conversions of messages to our plain types.

MeshReport from_wire(const v1::MeshReport& report);
StopReason from_wire(v1::StopReason reason);
/// Changes of handles that the server made, with inline buffers. INTERNAL if a buffer has the wrong length.
absl::StatusOr<Update> from_wire(const google::protobuf::RepeatedPtrField<v1::HandleUpdate>& changes);
/// "quasi_newton"; empty for none.
std::string method_name(v1::Method method);
IterationRecord from_wire(const v1::IterationRecord& record);
/// Converts everything except positions, distortion and trace, which are in messages of their own.
void from_wire(const v1::SolveSummary& summary, SolveResult& out);
/// The error that a stream reports. Keeps reason, element and limit.
absl::Status from_wire(const v1::Fault& fault);
Notice from_wire(const v1::Notice& notice);

}  // namespace lpdeform::client
