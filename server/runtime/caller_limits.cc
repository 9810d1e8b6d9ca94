#include "server/runtime/caller_limits.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/refusals.h"

namespace lpdeform {

CallerLimits::CallerLimits(std::shared_ptr<Timers> timers, Limits limits)
    : timers_(std::move(timers)), limits_(limits) {}

absl::StatusOr<CallerLimits::Place> CallerLimits::enter_stream(const std::string& caller) {
  if (limits_.streams == 0 || caller.empty()) return nullptr;
  const std::scoped_lock lock(mutex_);
  std::size_t& streams = streams_[caller];
  if (streams >= limits_.streams) {
    return make_fault({Reason::kCallerStreamsFull, "streams", absl::StrCat("streams <= ", limits_.streams)},
                      absl::StrCat("The caller has all of the ", limits_.streams,
                                   " streams that one caller may have; end one first."));
  }
  ++streams;
  return Place(nullptr, [weak = weak_from_this(), caller](void*) {
    if (const auto self = weak.lock()) self->leave_stream(caller);
  });
}

void CallerLimits::leave_stream(const std::string& caller) {
  const std::scoped_lock lock(mutex_);
  const auto streams = streams_.find(caller);
  if (--streams->second == 0) streams_.erase(streams);
}

double CallerLimits::capacity() const {
  return std::max(kBurstBytes, limits_.upload_bytes_per_second);
}

CallerLimits::Bucket CallerLimits::refilled(const Bucket& bucket, Timers::TimePoint now) const {
  const std::chrono::duration<double> passed = now - bucket.filled_at;
  return {std::min(capacity(), bucket.bytes + passed.count() * limits_.upload_bytes_per_second), now};
}

absl::Status CallerLimits::take_upload_bytes(const std::string& caller, std::size_t bytes) {
  if (limits_.upload_bytes_per_second <= 0 || caller.empty()) return absl::OkStatus();
  const Timers::TimePoint now = timers_->now();
  const std::scoped_lock lock(mutex_);
  if (buckets_.size() >= kMostBuckets) {
    std::erase_if(buckets_, [&](const auto& one) { return refilled(one.second, now).bytes >= capacity(); });
  }
  Bucket& bucket = buckets_.try_emplace(caller, Bucket{capacity(), now}).first->second;
  bucket = refilled(bucket, now);
  const auto wanted = static_cast<double>(bytes);
  if (wanted <= bucket.bytes) {
    bucket.bytes -= wanted;
    return absl::OkStatus();
  }
  const std::chrono::duration<double> wait((wanted - bucket.bytes) / limits_.upload_bytes_per_second);
  const auto rate = static_cast<std::size_t>(limits_.upload_bytes_per_second);
  return retry_after(
      make_fault({Reason::kUploadRate, "data", absl::StrCat("bytes a second <= ", rate)},
                 absl::StrCat("The caller may upload ", rate, " bytes a second; send this part of ", bytes,
                              " bytes again after the time given.")),
      wait);
}

}  // namespace lpdeform
