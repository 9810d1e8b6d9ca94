#include "client/cli/generated_shape.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
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

constexpr int kMostVertices = 5'000'000;
constexpr double kHalfCell = 0.5;

/// Most tries at a shape of a given number of vertices, and the relative difference at which there are no more.
constexpr int kTries = 2;
constexpr double kCloseEnough = 0.05;

int cells(double count) {
  return static_cast<int>(std::lround(count));
}

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
GeneratedShape paper_shape(double detail) {
  PaperPose pose = make(detail);
  GeneratedShape shape{std::move(pose.mesh), {}, std::move(pose.note)};
  for (const auto& [name, handle] : pose.handles.handles()) {
    std::vector<std::uint32_t> vertices(handle.vertices.begin(), handle.vertices.end());
    shape.handles.push_back({name, {std::move(vertices), to_client(handle.motion)}});
  }
  return shape;
}

GeneratedShape block(double detail) {
  const int length = cells(28 * detail);
  GeneratedShape shape{block_with_holes(length, cells(12 * detail), cells(8 * detail)),
                       {},
                       "one end stays, the other is pulled"};
  hold(shape, "fixed", [](const Point& p) { return p.x() < kHalfCell; });
  hold(
      shape, "end", [=](const Point& p) { return p.x() > length - kHalfCell; },
      client::RigidMotion{.translation = {length / 2.0, 0, 0}});
  return shape;
}

GeneratedShape bumpy_grid(double detail) {
  const int side = cells(40 * detail);
  const double middle = side / 2.0;
  GeneratedShape shape{grid(side, side, 2 * detail), {}, "the rim stays, the middle is lifted"};
  hold(shape, "rim", [=](const Point& p) {
    const double from_middle = std::max(std::abs(p.x() - middle), std::abs(p.y() - middle));
    return from_middle > middle - kHalfCell;
  });
  hold(
      shape, "middle",
      [=](const Point& p) { return std::hypot(p.x() - middle, p.y() - middle) < side / 10.0; },
      client::RigidMotion{.translation = {0, 0, 0.4 * side}});
  return shape;
}

GeneratedShape ball(double detail) {
  GeneratedShape shape{sphere(3 + cells(detail)), {}, "the bottom stays, the top is pulled up and turned"};
  hold(shape, "bottom", [](const Point& p) { return p.z() < -0.9; });
  hold(
      shape, "top", [](const Point& p) { return p.z() > 0.9; },
      client::RigidMotion{.angle_radians = radians(60), .translation = {0, 0, 0.8}});
  return shape;
}

GeneratedShape animal(double detail) {
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

GeneratedShape neck(double detail) {
  const int side = 2 * cells(4 * detail), length = cells(42 * detail);
  const double middle = length / 2.0;
  GeneratedShape shape{necked_bar(side, length, 2 * cells(2 * detail), cells(6 * detail)),
                       {},
                       "one end stays, the other is bent by 60 degrees"};
  hold(shape, "bottom", [](const Point& p) { return p.z() < kHalfCell; });
  hold(
      shape, "top", [=](const Point& p) { return p.z() > length - kHalfCell; },
      client::RigidMotion{
          .axis = {1, 0, 0}, .angle_radians = radians(60), .center = {side / 2.0, side / 2.0, middle}});
  return shape;
}

/// Holds the lowest twentieth of a shape, and turns and moves the highest.
template <TriangleMesh (*make)(int resolution), int kResolution>
GeneratedShape bent_over(double detail) {
  GeneratedShape shape{make(cells(kResolution * detail)), {}, "the foot stays, the top is bent over"};
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
  GeneratedShape (*make)(double detail);
  int most_detail;
};

constexpr Entry kShapes[] = {{"bar", paper_shape<paper_bar>, 32},
                             {"sheet", paper_shape<paper_sheet>, 16},
                             {"block", block, 16},
                             {"pierced_block", paper_shape<paper_block>, 6},
                             {"grid", bumpy_grid, 32},
                             {"sphere", ball, 6},
                             {"creature", animal, 6},
                             {"arm", paper_shape<paper_arm>, 6},
                             {"neck", neck, 16},
                             {"scan", bent_over<scan, 48>, 16},
                             {"tree", bent_over<tube_tree, 80>, 16}};

absl::StatusOr<const Entry*> entry_of(std::string_view name) {
  const auto found = std::ranges::find(kShapes, name, &Entry::name);
  if (found != std::end(kShapes)) return found;
  return make_fault({Reason::kShapeUnknown, std::string(name), ""},
                    absl::StrCat("There is no shape \"", std::string(name), "\"; there are ",
                                 absl::StrJoin(generated_shape_names(), ", "), "."));
}

/// The detail at which a shape has about `ratio` times the vertices that it has at `from`.
double detail_for(const Entry& entry, double from, double ratio) {
  return entry.make == ball ? from + std::round(std::log2(ratio) / 2) : from * std::sqrt(ratio);
}

}  // namespace

absl::StatusOr<GeneratedShape> generate_shape(std::string_view name, int detail) {
  const absl::StatusOr<const Entry*> entry = entry_of(name);
  if (!entry.ok()) return entry.status();
  const int most = (*entry)->most_detail;
  if (detail >= 1 && detail <= most) return (*entry)->make(detail);
  return make_fault(
      {Reason::kShapeDetail, "", absl::StrCat("1 <= detail <= ", most)},
      absl::StrCat("Detail ", detail, " is not in 1 to ", most, " of the ", (*entry)->name, "."));
}

absl::StatusOr<GeneratedShape> generate_shape_of(std::string_view name, int vertices) {
  const absl::StatusOr<const Entry*> entry = entry_of(name);
  if (!entry.ok()) return entry.status();
  GeneratedShape closest = (*entry)->make(1);
  const auto least = closest.mesh.vertices.rows();
  if (vertices < least || vertices > kMostVertices)
    return make_fault({Reason::kShapeDetail, "", absl::StrCat(least, " <= vertices <= ", kMostVertices)},
                      absl::StrCat("The ", (*entry)->name, " has ", least, " to ", kMostVertices,
                                   " vertices, not ", vertices, "."));
  const auto times_too_many = [&](const GeneratedShape& shape) {
    return static_cast<double>(shape.mesh.vertices.rows()) / vertices;
  };
  const auto miss = [&](const GeneratedShape& shape) { return std::abs(std::log(times_too_many(shape))); };
  double detail = 1, ratio = times_too_many(closest);
  for (int number = 0; number < kTries && miss(closest) > kCloseEnough; ++number) {
    const double next = std::max(1.0, detail_for(**entry, detail, 1 / ratio));
    if (next == detail) break;
    detail = next;
    GeneratedShape shape = (*entry)->make(detail);
    ratio = times_too_many(shape);
    if (miss(shape) < miss(closest)) closest = std::move(shape);
  }
  return closest;
}

std::vector<std::string> generated_shape_names() {
  std::vector<std::string> names;
  for (const Entry& entry : kShapes) names.emplace_back(entry.name);
  return names;
}

}  // namespace lpdeform::cli
