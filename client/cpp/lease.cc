#include "client/cpp/lease.h"

#include <memory>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cpp/upload.h"
#include "client/cpp/wire.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

Lease lease_of(const v1::Session& session, const std::string& writer_token) {
  return {session.name(), writer_token, session.epoch(), session.input_seq(), from_wire(session.mesh()),
          session.route()};
}

Copy copy_of(Mesh mesh, OpenOptions options) {
  const auto kept = std::make_shared<const Mesh>(std::move(mesh));
  return {.make = [kept, options = std::move(options)](Rpc& rpc, const std::string& request_id,
                                                       const std::stop_token& stop) {
    return create_session(rpc, *kept, options, request_id, stop);
  }};
}

absl::StatusOr<Lease> create_session(Rpc& rpc, const Mesh& mesh, const OpenOptions& options,
                                     const std::string& request_id, const std::stop_token& stop) {
  v1::CreateSessionRequest request;
  request.set_request_id(request_id);
  request.set_weights(to_wire(options.weights));
  request.set_free_components(to_wire(options.free_components));
  Uploads uploads(rpc, stop, request_id);  // a retry must be the same request to the last bit
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  absl::Status packed = to_wire(mesh, packer, *request.mutable_mesh());
  if (!mesh.normals.empty()) {
    request.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
    packed.Update(packer.pack(bytes_of(mesh.normals), *request.mutable_normals()->mutable_data()));
  }
  packed.Update(to_wire(options.weld, packer, request));
  packed.Update(to_wire(options.settings, packer, *request.mutable_settings()));
  if (!packed.ok()) return packed;

  auto created = rpc.call(request, stop);
  if (!is_undecided(created.status())) uploads.discard();
  if (!created.ok()) return created.status();
  const v1::Session& session = created->session();
  const absl::Status checked =
      check_vertex_count(session.mesh().vertices(), static_cast<std::int64_t>(mesh.vertex_count()));
  if (!checked.ok()) return checked;
  return lease_of(session, created->writer_token());
}

std::string route_of(const absl::Status& status) {
  const Fault fault = fault_of(status);
  absl::string_view route(fault.limit);
  return fault.reason == Reason::kSessionElsewhere && absl::ConsumePrefix(&route, "lpdeform-session: ")
             ? std::string(route)
             : "";
}

absl::StatusOr<Lease> join_session(Rpc& rpc, const std::string& session, Role role,
                                   const std::stop_token& stop) {
  v1::GetSessionRequest get;
  get.set_session(session);
  const auto found = rpc.call(get, stop);
  if (!found.ok()) return found.status();
  Lease lease = lease_of(found->session(), "");
  if (role == Role::kReader) return lease;

  v1::AcquireWriterRequest acquire;
  acquire.set_session(session);
  const auto acquired = rpc.call(acquire, stop);
  if (!acquired.ok()) return acquired.status();
  lease.writer_token = acquired->writer_token();
  lease.epoch = acquired->epoch();
  lease.input_seq = acquired->input_seq();
  return lease;
}

absl::Status check_vertex_count(std::int64_t count, std::int64_t wanted) {
  if (count == wanted) return absl::OkStatus();
  return make_fault(
      {Reason::kFrameVertices, "", absl::StrCat("vertices = ", wanted)},
      absl::StrCat("The server speaks of ", count, " vertices of a mesh that has ", wanted, "."));
}

bool is_session_lost(const absl::Status& status) {
  return absl::IsNotFound(status) && absl::StartsWith(fault_of(status).reason, "SESSION_");
}

bool is_undecided(const absl::Status& status) {
  const bool may_have_room = absl::IsResourceExhausted(status) && retry_after(status).count() > 0;
  return absl::IsUnavailable(status) || absl::IsCancelled(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsUnknown(status) || may_have_room || is_session_lost(status) ||
         fault_of(status).reason == Reason::kUploadUnknown;
}

bool is_taken_all_the_same(const absl::Status& status) {
  return absl::IsFailedPrecondition(status) || absl::IsAborted(status);
}

}  // namespace lpdeform::client
