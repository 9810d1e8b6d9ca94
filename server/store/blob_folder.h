#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform {

/// Makes a folder that only its user may look into, and the folders above it where there are none; leaves one that is there as it is.
/// UNAVAILABLE STORE_FAILING, RESOURCE_EXHAUSTED STORE_FULL.
absl::Status make_private_folder(const std::string& path);

/// Blobs as files of a folder, each named by its key: a file that has its name is whole and on the disk. Thread-safe,
/// but for remove() of a blob that is being written.
class BlobFolder {
 public:
  /// Makes the folder where there is none, and clears away what an interrupted write left. UNAVAILABLE STORE_FAILING,
  /// RESOURCE_EXHAUSTED STORE_FULL.
  static absl::StatusOr<BlobFolder> open(const std::string& path);

  /// Nothing where it is there already. UNAVAILABLE STORE_FAILING, RESOURCE_EXHAUSTED STORE_FULL: nothing is kept.
  absl::Status write(const std::string& key, std::string_view bytes) const;

  /// NOT_FOUND SESSION_DAMAGED where it is not there or is not what it was; UNAVAILABLE STORE_FAILING.
  absl::StatusOr<std::string> read(const std::string& key) const;

  void remove(const std::string& key) const;

  absl::StatusOr<std::set<std::string>> keys() const;
  /// Of all blobs.
  absl::StatusOr<std::uint64_t> bytes() const;

 private:
  explicit BlobFolder(std::string path) : path_(std::move(path)) {}
  std::string file_of(const std::string& key) const { return path_ + "/" + key; }

  std::string path_;
};

}  // namespace lpdeform
