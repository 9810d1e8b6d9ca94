#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/blob_folder.h"

namespace lpdeform {

/// Which blobs of a folder are to stay: those that sessions have, which a database knows, and those of sessions that are being made.
/// Not thread-safe.
class KeptBlobs {
 public:
  explicit KeptBlobs(const BlobFolder& folder) : folder_(folder) {}

  /// Begins with all that the folder has as loose. STORE_FAILING.
  absl::Status begin();

  /// A session that is being made has it, until finish().
  void pin(const std::string& key, const std::string& session) { pinned_[key].insert(session); }
  /// The session is made, or given up.
  void finish(const std::string& session);

  /// A session that goes had it.
  void let_go(const std::string& key) { loose_.insert(key); }
  /// The same of those that it had while it was being made.
  void let_go_of(const std::string& session);
  void take(const std::string& key) { loose_.erase(key); }

  /// Removes those that were let go and that no session has. `is_used`: what the database says; nothing where it does not know, and
  /// they are asked for again the next time.
  void drop_unused(const std::function<std::optional<bool>(const std::string&)>& is_used);

  /// Of all blobs, as they were when this was asked for the last time or note_written() said more.
  absl::StatusOr<std::uint64_t> bytes();
  void note_written() { bytes_.reset(); }

 private:
  const BlobFolder& folder_;
  std::map<std::string, std::set<std::string>> pinned_;  // sessions that are being made, by the blobs' keys
  std::set<std::string> loose_;
  std::optional<std::uint64_t> bytes_;
};

}  // namespace lpdeform
