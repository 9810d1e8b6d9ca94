#include "core/problem/hold.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/match.h"
#include "core/base/reasons.h"
#include "core/problem/handle_name.h"

namespace lpdeform {
namespace {

absl::Status check_weight(std::string_view name, double weight) {
  if (weight >= 0 && weight <= kHighestSoftWeight) return absl::OkStatus();
  return make_fault({Reason::kHandleWeightOutOfRange, handle_element(name),
                     absl::StrCat("0 <= weight <= ", kHighestSoftWeight)},
                    absl::StrCat("the weight of ", handle_element(name), " is ", exact(weight),
                                 "; it must be from 0 to ", kHighestSoftWeight));
}

absl::Status check_direction(std::string_view name, const Eigen::Vector3d& direction) {
  if (direction.allFinite() && direction.stableNorm() > 0) return absl::OkStatus();
  return make_fault({Reason::kHandleLockDirection, handle_element(name), "finite, length > 0"},
                    absl::StrCat("the axis or normal of ", handle_element(name),
                                 " is not finite, or of length 0, and has no direction"));
}

}  // namespace

bool takes_points(const Hold& hold) {
  return match(
      hold, [](const Exactly&) { return true; }, [](const Soft&) { return true; },
      [](const Orientation&) { return false; }, [](const AxisLock&) { return false; },
      [](const PlaneLock&) { return false; });
}

bool takes_positions(const Hold& hold) {
  return match(
      hold, [](const Exactly&) { return true; }, [](const Soft&) { return true; },
      [](const Orientation&) { return false; }, [](const AxisLock&) { return true; },
      [](const PlaneLock&) { return true; });
}

Hold hold_on_fewer(const Hold& hold, std::size_t count, std::size_t fewer) {
  return match(
      hold, [](const Exactly& same) -> Hold { return same; },
      [&](const Soft& soft) -> Hold {
        const double grown = soft.weight * static_cast<double>(count) / static_cast<double>(fewer);
        return Soft{std::min(grown, kHighestSoftWeight)};
      },
      [](const Orientation& same) -> Hold { return same; }, [](const AxisLock& same) -> Hold { return same; },
      [](const PlaneLock& same) -> Hold { return same; });
}

absl::Status check_hold(std::string_view name, const Hold& hold) {
  return match(
      hold, [](const Exactly&) { return absl::OkStatus(); },
      [&](const Soft& soft) { return check_weight(name, soft.weight); },
      [&](const Orientation& orientation) { return check_weight(name, orientation.weight); },
      [&](const AxisLock& lock) { return check_direction(name, lock.axis); },
      [&](const PlaneLock& lock) { return check_direction(name, lock.normal); });
}

}  // namespace lpdeform
