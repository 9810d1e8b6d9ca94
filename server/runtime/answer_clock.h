#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

namespace lpdeform {

/// Measures how long updates wait for the first frame that answers them. Every update counts. An update that
/// a newer one superseded waits for the frame that answers both. Not thread-safe.
class AnswerClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// An update was taken. An update that came late is answered by frames for newer ones and does not count.
  void took(std::uint64_t input_seq, TimePoint now) {
    const bool is_late = !waiting_.empty() && input_seq <= waiting_.back().input_seq;
    if (!is_late && waiting_.size() < kMostWaiting) waiting_.push_back({input_seq, now});
  }

  /// The solver has taken over this update and all before it. Calls `on_waited` with the seconds that each of them waited
  /// for that.
  void begun(std::uint64_t input_seq, TimePoint now, const std::function<void(double)>& on_waited) {
    for (Waiting& one : waiting_) {
      if (one.input_seq > input_seq) return;
      if (!std::exchange(one.is_begun, true))
        on_waited(std::chrono::duration<double>(now - one.since).count());
    }
  }

  /// A frame answers this update and all before it. Calls `on_waited` with the seconds that each of them
  /// waited.
  void answered(std::uint64_t input_seq, TimePoint now, const std::function<void(double)>& on_waited) {
    while (!waiting_.empty() && waiting_.front().input_seq <= input_seq) {
      on_waited(std::chrono::duration<double>(now - waiting_.front().since).count());
      waiting_.pop_front();
    }
  }

  /// Forgets all waiting updates.
  void forget() { waiting_.clear(); }

  /// While this many updates wait, later ones are not counted.
  static constexpr std::size_t kMostWaiting = 1024;

 private:
  struct Waiting {
    std::uint64_t input_seq;
    TimePoint since;
    bool is_begun = false;
  };
  std::deque<Waiting> waiting_;
};

}  // namespace lpdeform
