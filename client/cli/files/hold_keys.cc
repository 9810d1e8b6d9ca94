#include "client/cli/files/hold_keys.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"

namespace lpdeform::cli {
namespace {

constexpr double kHighestWeight = 1e6;
constexpr double kBarycentricSlack = 1e-6;

double weight(const json& value, const std::string& owner, const char* key) {
  const double result = number(value, key_of(owner, key));
  if (!(result >= 0 && result <= kHighestWeight)) {
    refuse(Reason::kHandleWeightOutOfRange, owner,
           absl::StrCat(key_of(owner, key), " is ", result, "; it must be from 0 to 1e6."),
           "0 <= weight <= 1e6");
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

client::SurfacePoint point_of(const json& object, const std::string& owner, const std::string& place) {
  check_keys(object, place, {"face", "barycentric"});
  const json& face = required(object, place, "face");
  if (!face.is_number_unsigned() || face.get<std::uint64_t>() > std::numeric_limits<std::int32_t>::max()) {
    refuse_value(key_of(place, "face"), "a whole number from 0", face);
  }
  const auto barycentric = vector3(required(object, place, "barycentric"), key_of(place, "barycentric"));
  double sum = 0;
  bool is_inside = true;
  for (const double coordinate : barycentric)
    sum += coordinate, is_inside &= coordinate >= -kBarycentricSlack;
  if (!is_inside || !(std::abs(sum - 1) <= kBarycentricSlack)) {
    refuse(
        Reason::kHandleBarycentric, owner,
        absl::StrCat(key_of(place, "barycentric"), " must be three numbers from 0 on that add up to 1, not ",
                     shown(object["barycentric"]), "."),
        "each >= 0, sum = 1");
  }
  return {face.get<std::uint32_t>(), barycentric};
}

}  // namespace

std::vector<client::SurfacePoint> points_of(const json& object, const std::string& owner) {
  if (object.contains("vertices")) {
    refuse(Reason::kHandlePointsAndVertices, owner,
           absl::StrCat(owner, " has \"vertices\" and \"points\"; it takes one of the two."));
  }
  const json& list = object["points"];
  const std::string place = key_of(owner, "points");
  if (!list.is_array()) refuse_value(place, "a list of points", list);
  if (list.empty()) refuse(Reason::kHandleEmpty, owner, absl::StrCat(owner, " has no points."));
  std::vector<client::SurfacePoint> points;
  for (std::size_t k = 0; k < list.size(); ++k) {
    points.push_back(point_of(list[k], owner, absl::StrCat("point ", k, " of ", owner)));
  }
  return points;
}

void read_hold(const json& object, const std::string& owner, client::Handle& handle) {
  int holds = 0;
  for (const char* const key : {"soft", "orientation", "axis_lock", "plane_lock"}) {
    if (object.contains(key)) ++holds;
  }
  if (holds > 1) {
    refuse(Reason::kHandleHoldTwice, owner,
           absl::StrCat(owner,
                        " has more than one of \"soft\", \"orientation\", \"axis_lock\" and "
                        "\"plane_lock\"; it takes one at most."));
  }
  if (object.contains("soft")) handle.hold = client::Soft{weight(object["soft"], owner, "soft")};
  if (object.contains("orientation"))
    handle.hold = client::Orientation{weight(object["orientation"], owner, "orientation")};
  if (object.contains("axis_lock"))
    handle.hold = client::AxisLock{direction(object["axis_lock"], owner, "axis_lock")};
  if (object.contains("plane_lock"))
    handle.hold = client::PlaneLock{direction(object["plane_lock"], owner, "plane_lock")};
  if (!object.contains("footprint")) return;
  handle.footprint = number(object["footprint"], key_of(owner, "footprint"));
  if (handle.footprint >= 0) return;
  refuse(Reason::kHandleFootprintOutOfRange, owner,
         absl::StrCat(key_of(owner, "footprint"), " is ", handle.footprint, "; it must be 0 or a length."));
}

void write_hold(const client::Handle& handle, nlohmann::ordered_json& object) {
  for (const client::SurfacePoint& point : handle.points) {
    object["points"].push_back({{"face", point.face}, {"barycentric", point.barycentric}});
  }
  if (const auto* const soft = std::get_if<client::Soft>(&handle.hold)) object["soft"] = soft->weight;
  if (const auto* const turned = std::get_if<client::Orientation>(&handle.hold))
    object["orientation"] = turned->weight;
  if (const auto* const lock = std::get_if<client::AxisLock>(&handle.hold)) object["axis_lock"] = lock->axis;
  if (const auto* const lock = std::get_if<client::PlaneLock>(&handle.hold))
    object["plane_lock"] = lock->normal;
  if (handle.footprint > 0) object["footprint"] = handle.footprint;
}

}  // namespace lpdeform::cli
