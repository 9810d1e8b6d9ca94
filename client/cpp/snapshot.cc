#include "client/cpp/snapshot.h"

#include "absl/strings/str_cat.h"
#include "client/cpp/lease.h"
#include "client/cpp/packer.h"
#include "client/cpp/upload.h"

namespace lpdeform::client {
namespace {

absl::Status incomplete(std::uint64_t has, std::uint64_t should) {
  return make_fault(absl::StatusCode::kDataLoss,
                    {"SNAPSHOT_INCOMPLETE", "snapshot", absl::StrCat(should, " bytes")},
                    absl::StrCat("The server sent ", has, " of the snapshot's ", should, " bytes."));
}

}  // namespace

absl::StatusOr<std::string> take_snapshot(Rpc& rpc, const std::string& session, const std::stop_token& stop) {
  v1::SnapshotSessionRequest request;
  request.set_session(session);
  std::string file;
  std::uint64_t size = 0;
  const auto take = [&](const v1::SnapshotSessionResponse& part) {
    size = part.size_bytes();
    if (part.offset() != file.size()) return incomplete(file.size(), size);
    file += part.data();
    return absl::OkStatus();
  };
  if (absl::Status status = rpc.snapshot(request, stop, take); !status.ok()) return status;
  if (file.empty() || file.size() != size) return incomplete(file.size(), size);
  return file;
}

absl::StatusOr<std::string> restore_snapshot(Rpc& rpc, std::string_view file, const std::stop_token& stop) {
  v1::RestoreSessionRequest request;
  request.set_request_id(new_request_id());
  Uploads uploads(rpc, stop, request.request_id());
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  absl::Status packed = packer.pack(std::string(file), *request.mutable_snapshot());
  if (!packed.ok()) return packed;
  const auto restored = rpc.call(request, stop);
  if (!is_undecided(restored.status())) uploads.discard();
  if (!restored.ok()) return restored.status();
  return restored->session().name();
}

}  // namespace lpdeform::client
