#pragma once

#include "server/runtime/timers.h"

namespace lpdeform {

/// When a stream may begin its next frame, so that it begins at most `frames_per_second` on average.
///
/// A bucket holds two tokens. One comes back per period, 1 / frames_per_second, and each frame takes one. A
/// frame that answers a new input is begun while one token is there; a frame that refines an answer is begun
/// only while both are. Refining frames therefore never delay an answer: they are at least one period after
/// the frame before them, and two after an answer that came early.
///
/// In any time t at most t / period + 2 frames begin; with a fixed distance it would be t / period + 1.
///
/// For one thread at a time.
class FramePace {
 public:
  enum class Kind { kAnswer, kRefinement };

  /// 0: without limit. A period is at most an hour.
  explicit FramePace(double frames_per_second);

  /// From when on a frame of this kind may begin. TimePoint::min() without limit.
  Timers::TimePoint next_at(Kind kind) const;

  /// A frame begins now, at or after next_at() of its kind.
  void begin(Timers::TimePoint now);

 private:
  const Timers::Duration period_;
  Timers::TimePoint full_at_;  // both tokens are there from then on
};

}  // namespace lpdeform
