#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "server/runtime/timers.h"

namespace lpdeform {

/// Quotas of one caller besides sessions (Registry) and memory (Budget): streams at a time, and upload bytes
/// per second. They do not apply to the caller "", which stands for all anonymous callers. Thread-safe. Held
/// by a shared pointer.
class CallerLimits : public std::enable_shared_from_this<CallerLimits> {
 public:
  /// 0 means without limit.
  struct Limits {
    std::size_t streams = 0;
    double upload_bytes_per_second = 0;
  };

  CallerLimits(std::shared_ptr<Timers> timers, Limits limits);

  /// A place for a stream, given back when it is destroyed; null if streams are not counted.
  /// RESOURCE_EXHAUSTED CALLER_STREAMS_FULL.
  using Place = std::shared_ptr<void>;
  absl::StatusOr<Place> enter_stream(const std::string& caller);

  /// Takes this many bytes, at most kBurstBytes, from the caller's token bucket. The bucket refills at the
  /// rate and holds one second's bytes, but at least kBurstBytes. RESOURCE_EXHAUSTED UPLOAD_RATE, with the
  /// time when the bucket will have enough.
  absl::Status take_upload_bytes(const std::string& caller, std::size_t bytes);

  static constexpr double kBurstBytes = 4 << 20;
  /// When there are this many buckets, those that may be full again are forgotten.
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
