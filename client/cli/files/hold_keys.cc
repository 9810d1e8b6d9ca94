#include "client/cli/files/hold_keys.h"

#include <variant>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/match.h"
#include "core/problem/hold.h"

namespace lpdeform::cli {
namespace {

double weight(const json& value, const std::string& owner, const char* key) {
  const double result = number(value, key_of(owner, key));
  if (!(result >= 0 && result <= kHighestSoftWeight)) {
    refuse(
        Reason::kHandleWeightOutOfRange, owner,
        absl::StrCat(key_of(owner, key), " is ", result, "; it must be from 0 to ", kHighestSoftWeight, "."),
        absl::StrCat("0 <= weight <= ", kHighestSoftWeight));
  }
  return result;
}

std::array<double, 3> direction(const json& value, const std::string& owner, const char* key) {
  const std::array<double, 3> result = vector3(value, key_of(owner, key));
  if (result == std::array<double, 3>{0, 0, 0}) {
    refuse(Reason::kHandleLockDirection, owner,
           absl::StrCat(key_of(owner, key), " is [0, 0, 0] and has no direction."));
  }
  return result;
}

/// A kind of hold in a handle file: its key, and its value both ways. There is one for each kind of client::Hold
/// but Exactly, or hold_keys() does not compile.
template <typename Kind>
struct InFile;

template <>
struct InFile<client::Soft> {
  static constexpr const char* key = "soft";
  static client::Soft read(const json& value, const std::string& owner) {
    return {weight(value, owner, key)};
  }
  static double write(const client::Soft& hold) { return hold.weight; }
};

template <>
struct InFile<client::Orientation> {
  static constexpr const char* key = "orientation";
  static client::Orientation read(const json& value, const std::string& owner) {
    return {weight(value, owner, key)};
  }
  static double write(const client::Orientation& hold) { return hold.weight; }
};

template <>
struct InFile<client::AxisLock> {
  static constexpr const char* key = "axis_lock";
  static client::AxisLock read(const json& value, const std::string& owner) {
    return {direction(value, owner, key)};
  }
  static std::array<double, 3> write(const client::AxisLock& hold) { return hold.axis; }
};

template <>
struct InFile<client::PlaneLock> {
  static constexpr const char* key = "plane_lock";
  static client::PlaneLock read(const json& value, const std::string& owner) {
    return {direction(value, owner, key)};
  }
  static std::array<double, 3> write(const client::PlaneLock& hold) { return hold.normal; }
};

template <typename Action, typename... Kinds>
void for_each_key(const std::variant<client::Exactly, Kinds...>* /* which kinds there are */,
                  const Action& action) {
  (action(InFile<Kinds>()), ...);
}

/// Calls `action` with the InFile of each kind, in the order of client::Hold.
template <typename Action>
void for_each_key(const Action& action) {
  for_each_key(static_cast<const client::Hold*>(nullptr), action);
}

/// "a", "b" and "c", with their quotation marks.
std::string listed(std::vector<const char*> keys) {
  const std::string last = keys.back();
  keys.pop_back();
  return absl::StrCat("\"", absl::StrJoin(keys, "\", \""), "\" and \"", last, "\"");
}

}  // namespace

std::vector<const char*> hold_keys() {
  std::vector<const char*> keys;
  for_each_key([&](auto kind) { keys.push_back(decltype(kind)::key); });
  return keys;
}

void read_hold(const json& object, const std::string& owner, client::Handle& handle) {
  int holds = 0;
  for (const char* const key : hold_keys()) {
    if (object.contains(key)) ++holds;
  }
  if (holds > 1) {
    refuse(Reason::kHandleHoldTwice, owner,
           absl::StrCat(owner, " has more than one of ", listed(hold_keys()), "; it takes one at most."));
  }
  for_each_key([&](auto kind) {
    if (object.contains(kind.key)) handle.hold = kind.read(object[kind.key], owner);
  });
  if (!object.contains("footprint")) return;
  handle.footprint = number(object["footprint"], key_of(owner, "footprint"));
  if (handle.footprint >= 0) return;
  refuse(Reason::kHandleFootprintOutOfRange, owner,
         absl::StrCat(key_of(owner, "footprint"), " is ", handle.footprint, "; it must be 0 or a length."));
}

void write_hold(const client::Handle& handle, nlohmann::ordered_json& object) {
  match(
      handle.hold, [](const client::Exactly&) {},
      [&]<typename Kind>(const Kind& hold) { object[InFile<Kind>::key] = InFile<Kind>::write(hold); });
  if (handle.footprint > 0) object["footprint"] = handle.footprint;
}

}  // namespace lpdeform::cli
