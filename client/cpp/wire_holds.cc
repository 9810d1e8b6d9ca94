#include "client/cpp/wire_holds.h"

#include "client/cpp/wire_vectors.h"
#include "core/base/match.h"

namespace lpdeform::client {

void to_wire(const Hold& hold, v1::Handle& out) {
  match(
      hold, [](const Exactly&) {}, [&](const Soft& soft) { out.mutable_soft()->set_weight(soft.weight); },
      [&](const Orientation& orientation) { out.mutable_orientation()->set_weight(orientation.weight); },
      [&](const AxisLock& lock) { put(lock.axis, out.mutable_axis_lock()->mutable_axis()); },
      [&](const PlaneLock& lock) { put(lock.normal, out.mutable_plane_lock()->mutable_normal()); });
}

Hold hold_from_wire(const v1::Handle& message) {
  switch (message.hold_case()) {
    case v1::Handle::kSoft:
      return Soft{message.soft().weight()};
    case v1::Handle::kOrientation:
      return Orientation{message.orientation().weight()};
    case v1::Handle::kAxisLock:
      return AxisLock{numbers_of(message.axis_lock().axis())};
    case v1::Handle::kPlaneLock:
      return PlaneLock{numbers_of(message.plane_lock().normal())};
    case v1::Handle::HOLD_NOT_SET:
      break;
  }
  return Exactly{};
}

}  // namespace lpdeform::client
