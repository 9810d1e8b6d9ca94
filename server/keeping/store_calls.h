#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <set>

#include "absl/status/status.h"

namespace lpdeform {

/// Calls of a store that are under way, each with the moment after which the store counts as hanging. A disk
/// that does not answer never returns from a call, so nothing else would show it. Thread-safe.
class StoreCalls {
 public:
  using Clock = std::chrono::steady_clock;
  /// For a call without bytes. A call with bytes has a millisecond more for each kBytesPerMillisecond.
  static constexpr std::chrono::milliseconds kPatience{2000};
  static constexpr std::size_t kBytesPerMillisecond = 1024;

  /// A call of this many bytes is under way while this object lives.
  class UnderWay {
   public:
    UnderWay(StoreCalls& calls, Clock::time_point now, std::size_t bytes = 0);
    ~UnderWay();
    UnderWay(const UnderWay&) = delete;
    UnderWay& operator=(const UnderWay&) = delete;

   private:
    StoreCalls& calls_;
    std::multiset<Clock::time_point>::iterator place_;
  };

  bool is_any_late(Clock::time_point now) const;

 private:
  mutable std::mutex mutex_;
  std::multiset<Clock::time_point> ends_;
};

/// Callers who wait for a store. They can be answered even if the store does not answer. Each is answered
/// once. Thread-safe.
class WaitingCallers {
 public:
  using Id = std::uint64_t;
  using Refuse = std::function<void(const absl::Status&)>;

  Id add(Refuse refuse);
  /// Returns whether the caller had no answer yet. After that refuse_all() does not answer it.
  bool take(Id id);
  /// Answers all callers who wait now.
  void refuse_all(const absl::Status& why);

 private:
  std::mutex mutex_;
  std::map<Id, Refuse> waiting_;
  Id next_ = 0;
};

}  // namespace lpdeform
