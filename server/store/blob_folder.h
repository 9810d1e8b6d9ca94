#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform {

/// Makes a folder that only its user may read, and the folders above it if they do not exist. An existing
/// folder stays as it is. UNAVAILABLE STORE_FAILING, RESOURCE_EXHAUSTED STORE_FULL.
absl::Status make_private_folder(const std::string& path);

/// Blobs as files of a folder, each named by its key. A file under its final name is complete and on the
/// disk. Thread-safe, except for remove() of a blob that is being written.
class BlobFolder {
 public:
  /// Makes the folder if it does not exist, and removes what an interrupted write left. UNAVAILABLE
  /// STORE_FAILING, RESOURCE_EXHAUSTED STORE_FULL.
  static absl::StatusOr<BlobFolder> open(const std::string& path);

  /// Does nothing if the blob exists. UNAVAILABLE STORE_FAILING, RESOURCE_EXHAUSTED STORE_FULL: nothing is
  /// stored.
  absl::Status write(const std::string& key, std::string_view bytes) const;

  /// NOT_FOUND SESSION_DAMAGED if the blob is missing or its contents have changed; UNAVAILABLE
  /// STORE_FAILING.
  absl::StatusOr<std::string> read(const std::string& key) const;

  void remove(const std::string& key) const;

  absl::StatusOr<std::set<std::string>> keys() const;
  /// Total size of all blobs.
  absl::StatusOr<std::uint64_t> bytes() const;

 private:
  explicit BlobFolder(std::string path) : path_(std::move(path)) {}
  std::string file_of(const std::string& key) const { return path_ + "/" + key; }

  std::string path_;
};

}  // namespace lpdeform
