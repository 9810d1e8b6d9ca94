#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "server/runtime/budget.h"
#include "server/runtime/timers.h"
#include "server/runtime/upload_bytes.h"

namespace lpdeform {

/// How much of an upload has arrived.
struct UploadProgress {
  std::uint64_t received_bytes = 0;
  bool is_finished = false;
};

/// Bytes that come in parts, in any order. Thread-safe.
class Upload {
 public:
  /// `memory`: empty and charged to the owner; it grows as bytes arrive (UploadBytes).
  Upload(std::string name, std::uint64_t size_bytes, std::uint32_t crc32c, Reservation memory,
         std::string owner = "");

  const std::string& name() const { return name_; }
  /// The subject of the caller that made it.
  const std::string& owner() const { return owner_; }
  std::uint64_t size() const { return bytes_.size(); }
  std::uint32_t crc32c() const { return crc32c_; }
  /// Whether the upload holds no bytes: none have arrived, or their checksum was wrong. Does not wait.
  bool is_empty() const { return is_empty_; }

  /// Adds a part. The last missing part finishes the upload; later ones are ignored. Errors: INVALID_ARGUMENT
  /// UPLOAD_PART_SIZE (empty, or over 1 MiB), UPLOAD_PART_OUT_OF_RANGE, UPLOAD_SCATTERED (the part would
  /// begin one run too many); RESOURCE_EXHAUSTED MEMORY_FULL, CALLER_MEMORY_FULL: the upload stays as it is,
  /// and the part may be sent again; DATA_LOSS UPLOAD_CHECKSUM (all parts have to be sent again; the memory
  /// is given back until then).
  absl::StatusOr<UploadProgress> add(std::uint64_t offset, std::string_view data);

  /// All bytes, valid for as long as the upload lives. FAILED_PRECONDITION UPLOAD_UNFINISHED.
  absl::StatusOr<std::string_view> bytes() const;

  static constexpr std::uint32_t kMostPartBytes = 1u << 20;
  /// Limit of the runs of bytes that are there, with gaps between them. The parts of an upload may come in
  /// any order if there are at most twice as many.
  static constexpr std::size_t kMostRuns = 1024;

 private:
  absl::Status check_part(std::uint64_t offset, std::string_view data) const;
  absl::Status put(std::uint64_t offset, std::string_view data);
  absl::StatusOr<UploadProgress> finish();

  const std::string name_;
  const std::uint32_t crc32c_;
  const std::string owner_;
  mutable std::mutex mutex_;
  Reservation memory_;
  UploadBytes bytes_;
  bool is_finished_ = false;
  std::atomic<bool> is_empty_ = true;
};

/// All uploads of a server. An upload expires when it has not been used for some time. An announced upload
/// takes no memory before its bytes come, and keeps its place only as long as no other upload needs it.
/// Thread-safe. Held by a shared pointer.
class Uploads : public std::enable_shared_from_this<Uploads> {
 public:
  static constexpr std::size_t kMostUploads = 4096;  // because a small upload costs more than its bytes
  /// For this long an upload without bytes keeps its place: a client sends the first part at once. If all
  /// places are taken, an older upload without bytes is evicted.
  static constexpr std::chrono::seconds kEmptyPatience{10};

  struct Limits {
    std::uint64_t most_bytes_each;
    Timers::Duration idle;
    std::size_t most_uploads = kMostUploads;
    /// Per owner; 0: without limit. Does not apply to the owner "", which stands for all anonymous callers.
    std::size_t most_uploads_each = 0;
  };

  Uploads(std::shared_ptr<Budget> budget, std::shared_ptr<Timers> timers, Limits limits);

  /// If all places are taken, evicts the least recently used upload that has no bytes and is older than
  /// kEmptyPatience. Errors: INVALID_ARGUMENT UPLOAD_SIZE, REQUEST_ID, REQUEST_ID_REUSED; RESOURCE_EXHAUSTED
  /// UPLOADS_FULL (no upload can be evicted; the error says when one may be), CALLER_UPLOADS_FULL;
  /// MEMORY_FULL, CALLER_MEMORY_FULL if there is no room for all bytes now. Room now does not promise room
  /// later.
  absl::StatusOr<std::shared_ptr<Upload>> create(const std::string& request_id, std::uint64_t size_bytes,
                                                 std::uint32_t crc32c, const std::string& owner = "");

  /// NOT_FOUND UPLOAD_UNKNOWN, also if the upload belongs to another owner.
  absl::StatusOr<std::shared_ptr<Upload>> find(const std::string& name, const std::string& owner = "");

  /// Forgets the upload; holders of a pointer keep it. Does nothing if there is no such upload or it belongs
  /// to another owner.
  void remove(const std::string& name, const std::string& owner = "");

  std::size_t size() const;

 private:
  struct Entry {
    std::shared_ptr<Upload> upload;
    std::string request_id;
    Timers::TimePoint created, last_used;
  };
  absl::Status check_share(const std::string& owner) const;
  absl::Status make_place();
  void forget(std::map<std::string, Entry>::iterator entry);
  void watch(Timers::TimePoint when);
  void expire();

  const std::shared_ptr<Budget> budget_;
  const std::shared_ptr<Timers> timers_;
  const Limits limits_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> uploads_;                                  // by name
  std::map<std::pair<std::string, std::string>, std::string> requested_;  // names, by owner and request_id
  std::map<std::string, std::size_t> owned_;                              // number of uploads per owner
  Timers::TimePoint no_place_before_{};  // before this, no empty upload is old enough to evict
  bool is_watching_ = false;             // whether an alarm is set
};

inline constexpr std::size_t kLeastRequestId = 8, kMostRequestId = 64;  // bytes

/// INVALID_ARGUMENT REQUEST_ID unless the text is empty or has a length in this range.
absl::Status check_request_id(const std::string& request_id);

/// INVALID_ARGUMENT REQUEST_ID_REUSED.
absl::Status request_id_reused();

}  // namespace lpdeform
