#include "client/cpp/upload.h"

#include <algorithm>
#include <random>

#include "absl/strings/str_cat.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

constexpr std::uint32_t kMostPartBytes = 1u << 20;

}  // namespace

absl::StatusOr<std::string> upload(Rpc& rpc, std::string_view bytes, const std::string& request_id,
                                   const std::stop_token& stop) {
  v1::CreateUploadRequest create;
  create.set_request_id(request_id);
  create.set_size_bytes(bytes.size());
  create.set_crc32c(crc32c(bytes));
  const auto created = rpc.call(create, stop);
  if (!created.ok()) return created.status();

  const std::size_t part_bytes = std::clamp<std::uint32_t>(created->max_part_bytes(), 1, kMostPartBytes);
  v1::UploadPartRequest part;
  part.set_upload(created->upload());
  bool finished = false;
  for (std::size_t offset = 0; offset < bytes.size(); offset += part_bytes) {
    part.set_offset(offset);
    part.set_data(std::string(bytes.substr(offset, part_bytes)));
    const auto sent = rpc.call(part, stop);
    if (!sent.ok()) return sent.status();
    finished = sent->finished();
  }
  if (finished) return created->upload();
  return make_fault(absl::StatusCode::kDataLoss, {"UPLOAD_INCOMPLETE", created->upload(), ""},
                    "The server misses parts of an upload that were all sent.");
}

std::string new_request_id() {
  std::random_device random;
  return absl::StrCat(absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8),
                      absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8));
}

}  // namespace lpdeform::client
