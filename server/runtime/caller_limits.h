#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "server/runtime/timers.h"

namespace lpdeform {

/// What one caller may take beside sessions (Registry) and memory (Budget): streams at a time, and bytes of uploads a
/// second. Not for the caller "", who is everybody. Thread-safe. Held by a shared pointer.
class CallerLimits : public std::enable_shared_from_this<CallerLimits> {
 public:
  /// 0 is without limit.
  struct Limits {
    std::size_t streams = 0;
    double upload_bytes_per_second = 0;
  };

  CallerLimits(std::shared_ptr<Timers> timers, Limits limits);

  /// A place for a stream, given back when it goes; null where none are counted. RESOURCE_EXHAUSTED CALLER_STREAMS_FULL.
  using Place = std::shared_ptr<void>;
  absl::StatusOr<Place> enter_stream(const std::string& caller);

  /// So many bytes are about to be taken, at most kBurstBytes. RESOURCE_EXHAUSTED UPLOAD_RATE, with when there will be room
  /// for them: a bucket of one second's bytes, kBurstBytes at least, is refilled at the rate.
  absl::Status take_upload_bytes(const std::string& caller, std::size_t bytes);

  static constexpr double kBurstBytes = 4 << 20;
  /// Callers whose bucket may have run full are forgotten when there are so many.
  static constexpr std::size_t kMostBuckets = 1024;

 private:
  struct Bucket {
    double bytes;
    Timers::TimePoint filled_at;
  };
  double capacity() const;
  Bucket refilled(const Bucket& bucket, Timers::TimePoint now) const;
  void leave_stream(const std::string& caller);

  const std::shared_ptr<Timers> timers_;
  const Limits limits_;
  std::mutex mutex_;
  std::map<std::string, std::size_t> streams_;
  std::map<std::string, Bucket> buckets_;
};

}  // namespace lpdeform
