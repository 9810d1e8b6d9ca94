#include "server/keeping/store_calls.h"

#include <utility>

namespace lpdeform {

StoreCalls::UnderWay::UnderWay(StoreCalls& calls, Clock::time_point now, std::size_t bytes) : calls_(calls) {
  const std::scoped_lock lock(calls_.mutex_);
  place_ = calls_.ends_.insert(now + kPatience + std::chrono::milliseconds(bytes / kBytesPerMillisecond));
}

StoreCalls::UnderWay::~UnderWay() {
  const std::scoped_lock lock(calls_.mutex_);
  calls_.ends_.erase(place_);
}

bool StoreCalls::is_any_late(Clock::time_point now) const {
  const std::scoped_lock lock(mutex_);
  return !ends_.empty() && *ends_.begin() < now;
}

WaitingCallers::Id WaitingCallers::add(Refuse refuse) {
  const std::scoped_lock lock(mutex_);
  waiting_[next_] = std::move(refuse);
  return next_++;
}

bool WaitingCallers::take(Id id) {
  const std::scoped_lock lock(mutex_);
  return waiting_.erase(id) != 0;
}

void WaitingCallers::refuse_all(const absl::Status& why) {
  std::map<Id, Refuse> all;
  {
    const std::scoped_lock lock(mutex_);
    all.swap(waiting_);
  }
  for (const auto& [id, refuse] : all) refuse(why);
}

}  // namespace lpdeform
