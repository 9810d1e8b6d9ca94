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

/// Which blobs of a folder must stay: those of stored sessions, which a database knows, and those of sessions
/// that are being made. A blob that may be removed is called loose. Not thread-safe.
class KeptBlobs {
 public:
  explicit KeptBlobs(const BlobFolder& folder) : folder_(folder) {}

  /// Treats all blobs of the folder as loose to begin with. STORE_FAILING.
  absl::Status begin();

  /// A session that is being made uses this blob, until finish().
  void pin(const std::string& key, const std::string& session) { pinned_[key].insert(session); }
  /// The session is complete, or was given up.
  void finish(const std::string& session);

  /// A session that used this blob was removed: the blob is loose.
  void release(const std::string& key) { loose_.insert(key); }
  /// The same for the blobs of a session that was given up while it was being made.
  void release_all_of(const std::string& session);
  void take(const std::string& key) { loose_.erase(key); }

  /// Removes the loose blobs that no session uses. `is_used`: the answer of the database. If it does not know
  /// (nullopt), the blob stays loose until the next call.
  void drop_unused(const std::function<std::optional<bool>(const std::string&)>& is_used);

  /// Total size of all blobs. It is cached; note_written() clears the cache.
  absl::StatusOr<std::uint64_t> bytes();
  void note_written() { bytes_.reset(); }

 private:
  const BlobFolder& folder_;
  /// Sessions that are being made, by the keys of their blobs.
  std::map<std::string, std::set<std::string>> pinned_;
  std::set<std::string> loose_;
  std::optional<std::uint64_t> bytes_;
};

}  // namespace lpdeform
