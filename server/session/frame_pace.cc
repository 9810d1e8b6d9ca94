#include "server/session/frame_pace.h"

#include <algorithm>

namespace lpdeform {
namespace {

constexpr double kLongestPeriod = 3600;

Timers::Duration period_of(double frames_per_second) {
  if (frames_per_second <= 0) return Timers::Duration(0);
  const std::chrono::duration<double> period(std::min(1 / frames_per_second, kLongestPeriod));
  return std::chrono::duration_cast<Timers::Duration>(period);
}

}  // namespace

FramePace::FramePace(double frames_per_second)
    : period_(period_of(frames_per_second)), full_at_(Timers::TimePoint::min() + period_) {}

Timers::TimePoint FramePace::next_at(Kind kind) const {
  if (period_ == Timers::Duration(0)) return Timers::TimePoint::min();
  return kind == Kind::kAnswer ? full_at_ - period_ : full_at_;
}

void FramePace::begin(Timers::TimePoint now) {
  full_at_ = std::max(now, full_at_) + period_;
}

}  // namespace lpdeform
