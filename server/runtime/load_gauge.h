#pragma once

#include <chrono>

namespace lpdeform {

/// Tells overload from how long work waits, by a running mean of the last waits. Overload begins when the
/// mean passes kBegins. It ends when the mean falls below kEnds, or when nothing has waited for kForgets. It
/// lasts for kShortest at least, so that it does not flicker. Not thread-safe.
class LoadGauge {
 public:
  using Clock = std::chrono::steady_clock;
  using TimePoint = Clock::time_point;

  void waited(Clock::duration wait, TimePoint now) {
    if (now - last_ > kForgets) mean_seconds_ = 0;
    last_ = now;
    mean_seconds_ += (std::chrono::duration<double>(wait).count() - mean_seconds_) / kWaits;
    judge(now);
  }

  bool is_overloaded(TimePoint now) {
    if (now - last_ > kForgets) mean_seconds_ = 0;
    judge(now);
    return is_overloaded_;
  }

  static constexpr double kWaits = 16;  // about this many waits make the mean
  static constexpr std::chrono::milliseconds kBegins{100}, kEnds{25};
  static constexpr std::chrono::seconds kForgets{2}, kShortest{2};

 private:
  void judge(TimePoint now) {
    const std::chrono::duration<double> mean(mean_seconds_);
    if (!is_overloaded_ && mean > kBegins) {
      is_overloaded_ = true;
      since_ = now;
    } else if (is_overloaded_ && mean < kEnds && now - since_ >= kShortest) {
      is_overloaded_ = false;
    }
  }

  double mean_seconds_ = 0;
  TimePoint last_{};
  bool is_overloaded_ = false;
  TimePoint since_{};
};

}  // namespace lpdeform
