#include "client/cli/files/point_keys.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {
namespace {

constexpr double kBarycentricSlack = 1e-6;

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

void write_points(const std::vector<client::SurfacePoint>& points, nlohmann::ordered_json& object) {
  for (const client::SurfacePoint& point : points) {
    object["points"].push_back({{"face", point.face}, {"barycentric", point.barycentric}});
  }
}

}  // namespace lpdeform::cli
