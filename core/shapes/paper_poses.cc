#include "core/shapes/paper_poses.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/base/check.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

constexpr double kHalfCell = 0.5, kFar = std::numeric_limits<double>::infinity();

int cells(double count, double size) {
  LPDEFORM_CHECK(size >= kSmallestPoseSize);
  return std::max(1, static_cast<int>(std::lround(count * size)));
}

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

void hold(PaperPose& pose, const char* name, std::vector<std::int32_t> vertices,
          HandleMotion motion = Fixed{}) {
  LPDEFORM_CHECK(pose.handles.set(name, {std::move(vertices), std::move(motion)}).ok());
}

RigidMotion translation(const Eigen::Vector3d& by) {
  return {.translation = by};
}

}  // namespace

std::vector<std::int32_t> vertices_between(const Points& rest, int axis, double low, double high) {
  std::vector<std::int32_t> result;
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    if (rest(i, axis) >= low && rest(i, axis) <= high) result.push_back(static_cast<std::int32_t>(i));
  }
  return result;
}

PaperPose paper_sheet(double size) {
  const int length = cells(60, size);
  PaperPose pose{"sheet",
                 box_surface(cells(2, size), cells(30, size), length),
                 {},
                 "one edge stays, the other is folded over"};
  const double width = std::max(1.0, size) + kHalfCell;
  hold(pose, "fixed", vertices_between(pose.mesh.vertices, 2, -kFar, width));
  hold(pose, "edge", vertices_between(pose.mesh.vertices, 2, length - width, kFar),
       translation({0.33 * length, 0, -0.42 * length}));
  return pose;
}

PaperPose paper_bar(double size) {
  const int side = cells(4, size), length = cells(21, size);
  PaperPose pose{
      "bar", box_surface(side, side, length), {}, "both ends stay, the middle is twisted 90 degrees"};
  const Points& rest = pose.mesh.vertices;
  const double middle = length / 2.0, half_width = std::max(1.0, size) - 0.25;
  hold(pose, "end_a", vertices_between(rest, 2, -kFar, kHalfCell));
  hold(pose, "end_b", vertices_between(rest, 2, length - kHalfCell, kFar));
  hold(pose, "middle", vertices_between(rest, 2, middle - half_width, middle + half_width),
       RigidMotion{.angle_radians = radians(90), .center = {side / 2.0, side / 2.0, middle}});
  return pose;
}

PaperPose paper_block(double size) {
  PaperPose pose{
      "block", pierced_block(std::max(24, cells(34, size))), {}, "one end stays, the other is pulled"};
  constexpr double kHeld = 0.95 * PiercedBlock::kHalfLength;
  hold(pose, "fixed", vertices_between(pose.mesh.vertices, 2, -kFar, -kHeld));
  hold(pose, "end", vertices_between(pose.mesh.vertices, 2, kHeld, kFar),
       translation({0, 0, PiercedBlock::kHalfLength}));
  return pose;
}

PaperPose paper_creature(double size) {
  PaperPose pose{"creature",
                 creature(std::max(24, cells(60, size))),
                 {},
                 "the feet stay, the head is lifted and turned"};
  const Points& rest = pose.mesh.vertices;
  hold(pose, "feet", vertices_between(rest, 2, -kFar, 0.06));
  std::vector<std::int32_t> head = vertices_between(rest, 2, 0.64, kFar);
  std::erase_if(head, [&](std::int32_t i) { return rest(i, 0) <= 0.46; });
  hold(pose, "head", std::move(head),
       RigidMotion{.axis = {0, 0, 1},
                   .angle_radians = radians(60),
                   .center = {0.44, 0, 0.76},
                   .translation = {-0.02, 0, 0.12}});
  return pose;
}

PaperPose paper_arm(double size) {
  PaperPose pose{
      "arm", rocker_arm(std::max(32, cells(63, size))), {}, "the tail's end stays, the head is pulled"};
  hold(pose, "fixed", vertices_between(pose.mesh.vertices, 0, -kFar, -0.6));
  hold(pose, "end", vertices_between(pose.mesh.vertices, 0, 0.94, kFar), translation({0.4, 0, 0}));
  return pose;
}

}  // namespace lpdeform
