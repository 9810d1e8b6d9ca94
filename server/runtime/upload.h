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

/// How much of an upload is there.
struct UploadProgress {
  std::uint64_t received_bytes = 0;
  bool is_finished = false;
};

/// Bytes that come in parts, in any order. Thread-safe.
class Upload {
 public:
  /// `memory`: empty, of the owner's; it grows with what comes (UploadBytes).
  Upload(std::string name, std::uint64_t size_bytes, std::uint32_t crc32c, Reservation memory,
         std::string owner = "");

  const std::string& name() const { return name_; }
  /// The subject of the caller that made it.
  const std::string& owner() const { return owner_; }
  std::uint64_t size() const { return bytes_.size(); }
  std::uint32_t crc32c() const { return crc32c_; }
  /// Whether nothing of it is there: nothing has come, or it had a wrong checksum. Waits for nobody.
  bool is_empty() const { return is_empty_; }

  /// The last missing part finishes it; later ones are ignored. Errors: INVALID_ARGUMENT UPLOAD_PART_SIZE
  /// (empty, or over 1 MiB), UPLOAD_PART_OUT_OF_RANGE, UPLOAD_SCATTERED (it would begin one run too many); RESOURCE_EXHAUSTED
  /// MEMORY_FULL, CALLER_MEMORY_FULL: the upload stays as it is, and the part may be sent again; DATA_LOSS
  /// UPLOAD_CHECKSUM (all of it has to be sent again; its memory is given back until then).
  absl::StatusOr<UploadProgress> add(std::uint64_t offset, std::string_view data);

  /// The whole, for as long as the upload lives. FAILED_PRECONDITION UPLOAD_UNFINISHED.
  absl::StatusOr<std::string_view> bytes() const;

  static constexpr std::uint32_t kMostPartBytes = 1u << 20;
  /// Of bytes that are there, with gaps between them: an upload cut into at most twice as many parts may come in any order.
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

/// All uploads of a server. They go when nobody has touched them for a while. One that was announced takes no memory before its
/// bytes come, and its place only as long as nobody else needs it. Thread-safe. Held by a shared pointer.
class Uploads : public std::enable_shared_from_this<Uploads> {
 public:
  static constexpr std::size_t kMostUploads = 4096;  // small ones cost more than their bytes
  /// For so long the place of an upload is its own though nothing has come: a client sends the first part at once. Where all places
  /// are taken, an older one without a byte makes room.
  static constexpr std::chrono::seconds kEmptyPatience{10};

  struct Limits {
    std::uint64_t most_bytes_each;
    Timers::Duration idle;
    std::size_t most_uploads = kMostUploads;
    std::size_t most_uploads_each =
        0;  // of one owner; 0: without limit. Not for the owner "", who is everybody.
  };

  Uploads(std::shared_ptr<Budget> budget, std::shared_ptr<Timers> timers, Limits limits);

  /// Where all places are taken, the upload goes that nobody has touched for longest, of those that have nothing and are older than
  /// kEmptyPatience. Errors: INVALID_ARGUMENT UPLOAD_SIZE, REQUEST_ID, REQUEST_ID_REUSED; RESOURCE_EXHAUSTED UPLOADS_FULL (there is
  /// none such; it says when there may be), CALLER_UPLOADS_FULL; MEMORY_FULL, CALLER_MEMORY_FULL where there is no room for all of it now: that there is promises nothing.
  absl::StatusOr<std::shared_ptr<Upload>> create(const std::string& request_id, std::uint64_t size_bytes,
                                                 std::uint32_t crc32c, const std::string& owner = "");

  /// NOT_FOUND UPLOAD_UNKNOWN, also where it is somebody else's.
  absl::StatusOr<std::shared_ptr<Upload>> find(const std::string& name, const std::string& owner = "");

  /// Forgets the upload; whoever has it keeps it. Nothing where there is none, or it is somebody else's.
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
  std::map<std::string, std::size_t> owned_;                              // how many each owner has
  Timers::TimePoint no_place_before_{};                                   // no empty one is old enough before
  bool is_watching_ = false;                                              // an alarm is set, one for all
};

inline constexpr std::size_t kLeastRequestId = 8, kMostRequestId = 64;  // bytes

/// INVALID_ARGUMENT REQUEST_ID where it is neither empty nor so long.
absl::Status check_request_id(const std::string& request_id);

/// INVALID_ARGUMENT REQUEST_ID_REUSED.
absl::Status request_id_reused();

}  // namespace lpdeform
