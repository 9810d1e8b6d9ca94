#include "client/cli/generated_shape.h"

#include <functional>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/files/core_motion.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/shapes/paper_poses.h"
#include "core/shapes/shapes.h"

namespace lpdeform::cli {
namespace {

using Point = Eigen::RowVector3d;

constexpr int kMostDetail = 32;
constexpr double kHalfCell = 0.5;

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

/// Adds a handle of the vertices for which `is_held` is true.
void hold(GeneratedShape& shape, const char* name, const std::function<bool(const Point&)>& is_held,
          client::Motion motion = client::Fixed{}) {
  NamedHandle handle{name, {{}, std::move(motion)}};
  for (Eigen::Index vertex = 0; vertex < shape.mesh.vertices.rows(); ++vertex) {
    if (!is_held(shape.mesh.vertices.row(vertex))) continue;
    handle.handle.vertices.push_back(static_cast<std::uint32_t>(vertex));
  }
  shape.handles.push_back(std::move(handle));
}

/// Makes one of the paper's poses with a function of core/shapes/paper_poses.h.
template <PaperPose (*make)(double size)>
GeneratedShape paper_shape(int detail) {
  PaperPose pose = make(detail);
  GeneratedShape shape{std::move(pose.mesh), {}, std::move(pose.note)};
  for (const auto& [name, handle] : pose.handles.handles()) {
    std::vector<std::uint32_t> vertices(handle.vertices.begin(), handle.vertices.end());
    shape.handles.push_back({name, {std::move(vertices), to_client(handle.motion)}});
  }
  return shape;
}

GeneratedShape block(int detail) {
  const double length = 28.0 * detail;
  GeneratedShape shape{
      block_with_holes(28 * detail, 12 * detail, 8 * detail), {}, "one end stays, the other is pulled"};
  hold(shape, "fixed", [](const Point& p) { return p.x() < kHalfCell; });
  hold(
      shape, "end", [=](const Point& p) { return p.x() > length - kHalfCell; },
      client::RigidMotion{.translation = {length / 2, 0, 0}});
  return shape;
}

GeneratedShape bumpy_grid(int detail) {
  const double side = 40.0 * detail, middle = side / 2;
  GeneratedShape shape{
      grid(40 * detail, 40 * detail, 2.0 * detail), {}, "the rim stays, the middle is lifted"};
  hold(shape, "rim", [=](const Point& p) {
    const double from_middle = std::max(std::abs(p.x() - middle), std::abs(p.y() - middle));
    return from_middle > middle - kHalfCell;
  });
  hold(
      shape, "middle", [=](const Point& p) { return std::hypot(p.x() - middle, p.y() - middle) < side / 10; },
      client::RigidMotion{.translation = {0, 0, 0.4 * side}});
  return shape;
}

GeneratedShape ball(int detail) {
  GeneratedShape shape{sphere(3 + detail), {}, "the bottom stays, the top is pulled up and turned"};
  hold(shape, "bottom", [](const Point& p) { return p.z() < -0.9; });
  hold(
      shape, "top", [](const Point& p) { return p.z() > 0.9; },
      client::RigidMotion{.angle_radians = radians(60), .translation = {0, 0, 0.8}});
  return shape;
}

GeneratedShape animal(int detail) {
  GeneratedShape shape = paper_shape<paper_creature>(detail);
  shape.note += ", the tail is raised";
  hold(
      shape, "tail", [](const Point& p) { return p.x() < -0.8; },
      client::RigidMotion{.axis = {0, 1, 0},
                          .angle_radians = radians(50),
                          .center = {-0.86, 0, 0.46},
                          .translation = {0.22, 0, 0.35}});
  return shape;
}

GeneratedShape neck(int detail) {
  const double length = 42.0 * detail, middle = length / 2, side = 8.0 * detail;
  GeneratedShape shape{necked_bar(8 * detail, 42 * detail, 4 * detail, 6 * detail),
                       {},
                       "one end stays, the other is bent by 60 degrees"};
  hold(shape, "bottom", [](const Point& p) { return p.z() < kHalfCell; });
  hold(
      shape, "top", [=](const Point& p) { return p.z() > length - kHalfCell; },
      client::RigidMotion{
          .axis = {1, 0, 0}, .angle_radians = radians(60), .center = {side / 2, side / 2, middle}});
  return shape;
}

/// Holds the lowest twentieth of a shape, and turns and moves the highest.
template <TriangleMesh (*make)(int resolution), int kResolution>
GeneratedShape bent_over(int detail) {
  GeneratedShape shape{make(kResolution * detail), {}, "the foot stays, the top is bent over"};
  const Point low = shape.mesh.vertices.colwise().minCoeff(), high = shape.mesh.vertices.colwise().maxCoeff();
  const double height = high.z() - low.z();
  hold(shape, "foot", [=](const Point& p) { return p.z() < low.z() + 0.05 * height; });
  hold(
      shape, "top", [=](const Point& p) { return p.z() > high.z() - 0.05 * height; },
      client::RigidMotion{
          .axis = {1, 0, 0}, .angle_radians = radians(50), .center = {0, 0, (low.z() + high.z()) / 2}});
  return shape;
}

struct Entry {
  const char* name;
  GeneratedShape (*make)(int detail);
  int most_detail;
};

constexpr Entry kShapes[] = {{"bar", paper_shape<paper_bar>, kMostDetail},
                             {"sheet", paper_shape<paper_sheet>, kMostDetail / 2},
                             {"block", block, kMostDetail / 2},
                             {"pierced_block", paper_shape<paper_block>, 6},
                             {"grid", bumpy_grid, kMostDetail},
                             {"sphere", ball, 6},
                             {"creature", animal, 6},
                             {"arm", paper_shape<paper_arm>, 6},
                             {"neck", neck, kMostDetail / 2},
                             {"scan", bent_over<scan, 48>, kMostDetail / 2},
                             {"tree", bent_over<tube_tree, 80>, kMostDetail / 2}};

}  // namespace

absl::StatusOr<GeneratedShape> generate_shape(std::string_view name, int detail) {
  for (const Entry& entry : kShapes) {
    if (name != entry.name) continue;
    if (detail >= 1 && detail <= entry.most_detail) return entry.make(detail);
    const std::string limit = absl::StrCat("1 <= detail <= ", entry.most_detail);
    return make_fault(
        {Reason::kShapeDetail, "", limit},
        absl::StrCat("Detail ", detail, " is not in 1 to ", entry.most_detail, " of the ", entry.name, "."));
  }
  return make_fault({Reason::kShapeUnknown, std::string(name), ""},
                    absl::StrCat("There is no shape \"", std::string(name), "\"; there are ",
                                 absl::StrJoin(generated_shape_names(), ", "), "."));
}

std::vector<std::string> generated_shape_names() {
  std::vector<std::string> names;
  for (const Entry& entry : kShapes) names.emplace_back(entry.name);
  return names;
}

}  // namespace lpdeform::cli
