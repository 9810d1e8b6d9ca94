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

/// Calls of a store that are under way, each with the moment after which the store counts as one that hangs. A disk that does not answer
/// never returns a call, so nothing else would show it. Thread-safe.
class StoreCalls {
 public:
  using Clock = std::chrono::steady_clock;
  /// Of a call that carries no bytes; one that does has a millisecond more for each kBytesPerMillisecond.
  static constexpr std::chrono::milliseconds kPatience{2000};
  static constexpr std::size_t kBytesPerMillisecond = 1024;

  /// While it lives, a call is under way that carries so many bytes.
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

/// Callers who wait for a store, so that they can be answered where it does not. Each is answered once. Thread-safe.
class WaitingCallers {
 public:
  using Id = std::uint64_t;
  using Refuse = std::function<void(const absl::Status&)>;

  Id add(Refuse refuse);
  /// Whether the caller had no answer yet; from now on refuse_all() gives it none.
  bool take(Id id);
  /// Answers all who wait now.
  void refuse_all(const absl::Status& why);

 private:
  std::mutex mutex_;
  std::map<Id, Refuse> waiting_;
  Id next_ = 0;
};

}  // namespace lpdeform
