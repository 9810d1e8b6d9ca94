#include "server/store/kept_blobs.h"

namespace lpdeform {

absl::Status KeptBlobs::begin() {
  auto keys = folder_.keys();
  if (!keys.ok()) return keys.status();
  loose_ = *std::move(keys);
  return absl::OkStatus();
}

void KeptBlobs::finish(const std::string& session) {
  for (auto& [key, sessions] : pinned_) sessions.erase(session);
  std::erase_if(pinned_, [](const auto& pin) { return pin.second.empty(); });
}

void KeptBlobs::release_all_of(const std::string& session) {
  for (const auto& [key, sessions] : pinned_) {
    if (sessions.contains(session)) loose_.insert(key);
  }
}

void KeptBlobs::drop_unused(const std::function<std::optional<bool>(const std::string&)>& is_used) {
  for (auto key = loose_.begin(); key != loose_.end();) {
    const std::optional<bool> used = is_used(*key);
    if (!used || pinned_.contains(*key)) {
      ++key;
      continue;
    }
    if (!*used) {
      folder_.remove(*key);
      bytes_.reset();
    }
    key = loose_.erase(key);
  }
}

absl::StatusOr<std::uint64_t> KeptBlobs::bytes() {
  if (bytes_) return *bytes_;
  const auto bytes = folder_.bytes();
  if (bytes.ok()) bytes_ = *bytes;
  return bytes;
}

}  // namespace lpdeform
