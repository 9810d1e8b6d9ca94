#include "client/cpp/snapshot.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/packer.h"
#include "client/cpp/upload.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

absl::Status incomplete(std::uint64_t has, std::uint64_t should) {
  return make_fault({Reason::kSnapshotIncomplete, "snapshot", absl::StrCat(should, " bytes")},
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

absl::StatusOr<Lease> restore_session(Rpc& rpc, std::string_view file, const std::string& request_id,
                                      const std::stop_token& stop) {
  v1::RestoreSessionRequest request;
  request.set_request_id(request_id);
  Uploads uploads(rpc, stop, request_id);
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  absl::Status packed = packer.pack(std::string(file), *request.mutable_snapshot());
  if (!packed.ok()) return packed;
  const auto restored = rpc.call(request, stop);
  if (!is_undecided(restored.status())) uploads.discard();
  if (!restored.ok()) return restored.status();
  return lease_of(restored->session(), restored->writer_token());
}

Copy copy_of(std::string file, std::int64_t vertices) {
  const auto kept = std::make_shared<const std::string>(std::move(file));
  return {.make = [kept, vertices](Rpc& rpc, const std::string& request_id,
                                   const std::stop_token& stop) -> absl::StatusOr<Lease> {
            auto lease = restore_session(rpc, *kept, request_id, stop);
            if (!lease.ok()) return lease.status();
            const absl::Status checked = check_vertex_count(lease->mesh.vertices, vertices);
            if (!checked.ok()) return checked;
            return lease;
          },
          .is_bare = false};
}

}  // namespace lpdeform::client
