#include "server/wire/holds.h"

#include "core/base/match.h"
#include "server/wire/vectors.h"

namespace lpdeform {

Hold decode_hold(const v1::Handle& message) {
  switch (message.hold_case()) {
    case v1::Handle::kSoft:
      return message.soft().has_weight() ? Soft{message.soft().weight()} : Soft{};
    case v1::Handle::kOrientation:
      return message.orientation().has_weight() ? Orientation{message.orientation().weight()} : Orientation{};
    case v1::Handle::kAxisLock:
      return AxisLock{decode_vector(message.axis_lock().axis())};
    case v1::Handle::kPlaneLock:
      return PlaneLock{decode_vector(message.plane_lock().normal())};
    case v1::Handle::HOLD_NOT_SET:
      break;
  }
  return Exactly{};
}

void encode_hold(const Hold& hold, v1::Handle& out) {
  match(
      hold, [](const Exactly&) {}, [&](const Soft& soft) { out.mutable_soft()->set_weight(soft.weight); },
      [&](const Orientation& orientation) { out.mutable_orientation()->set_weight(orientation.weight); },
      [&](const AxisLock& lock) { encode_vector(lock.axis, *out.mutable_axis_lock()->mutable_axis()); },
      [&](const PlaneLock& lock) {
        encode_vector(lock.normal, *out.mutable_plane_lock()->mutable_normal());
      });
}

v1::HandleKind kind_of(const Hold& hold) {
  return match(
      hold, [](const Exactly&) { return v1::HANDLE_KIND_EXACT; },
      [](const Soft&) { return v1::HANDLE_KIND_SOFT; },
      [](const Orientation&) { return v1::HANDLE_KIND_ORIENTATION; },
      [](const AxisLock&) { return v1::HANDLE_KIND_AXIS_LOCK; },
      [](const PlaneLock&) { return v1::HANDLE_KIND_PLANE_LOCK; });
}

}  // namespace lpdeform
