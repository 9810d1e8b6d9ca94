#include "client/cpp/upload.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/recovery.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

constexpr std::uint32_t kMostPartBytes = 1u << 20;

/// Sleeps for `pause`; ends early if `stop` is requested.
void sleep_for(std::chrono::milliseconds pause, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait_for(lock, stop, pause, [] { return false; });
}

}  // namespace

Uploads::Uploads(Rpc& rpc, std::stop_token stop, std::string id)
    : rpc_(&rpc), stop_(std::move(stop)), id_(std::move(id)) {}

absl::StatusOr<std::string> Uploads::add(std::string_view bytes) {
  v1::CreateUploadRequest create;
  create.set_request_id(absl::StrCat(id_, "-", ++count_));
  create.set_size_bytes(bytes.size());
  create.set_crc32c(crc32c(bytes));
  const auto created = rpc_->call(create, stop_);
  if (!created.ok()) return created.status();
  names_.push_back(created->upload());

  const std::size_t part_bytes = std::clamp<std::uint32_t>(created->max_part_bytes(), 1, kMostPartBytes);
  v1::UploadPartRequest part;
  part.set_upload(created->upload());
  bool finished = false;
  for (std::size_t offset = 0; offset < bytes.size(); offset += part_bytes) {
    part.set_offset(offset);
    part.set_data(std::string(bytes.substr(offset, part_bytes)));
    const auto sent = send(part);
    if (!sent.ok()) return sent.status();
    finished = sent->finished();
  }
  if (finished) return created->upload();
  return make_fault({Reason::kUploadIncomplete, created->upload(), ""},
                    "The server reports missing parts although all were sent.");
}

/// If the server has no room for a part yet, retries after the pause that it asks for, within the call timeout; the
/// upload has not changed. Without a pause in the error, there is no retry.
absl::StatusOr<v1::UploadPartResponse> Uploads::send(const v1::UploadPartRequest& part) {
  const auto end = std::chrono::steady_clock::now() + rpc_->call_timeout();
  Backoff backoff;
  for (;;) {
    auto sent = rpc_->call(part, stop_);
    const auto asked = retry_after(sent.status());
    if (!absl::IsResourceExhausted(sent.status()) || asked.count() == 0) return sent;
    const auto pause = backoff.next(asked);
    if (std::chrono::steady_clock::now() + pause > end) return sent;
    sleep_for(pause, stop_);
    if (stop_.stop_requested()) return absl::CancelledError("The upload was stopped.");
  }
}

void Uploads::discard() {
  for (std::string& name : std::exchange(names_, {})) {
    v1::DeleteUploadRequest request;
    request.set_upload(std::move(name));
    rpc_->call(request, stop_).status().IgnoreError();
  }
}

std::string new_request_id() {
  std::random_device random;
  return absl::StrCat(absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8),
                      absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8));
}

}  // namespace lpdeform::client
