// The frames that a viewer shows of a first move.
//
//   first_frames FAMILY VERTICES P[,P...] POSE THREADS SECONDS [PICTURES]      a line of JSON for each p
//
// A session at rest gets the handles of a pose (families.h) at once, and they then stand. A frame is taken after every 33 ms
// of solving; the first is the Laplacian deformation. "stand" is the longest time in which frames do not change, and "jump"
// the largest way of a vertex from one frame to the next, in shares of the diagonal, after the first change.
// "bend" is the change since rest of the angle between the normals of two faces with a common edge, in degrees: the 99th
// percentile of all edges, and the largest; the worst of all frames but the first and the last, and those of the last.
// PICTURES-P.png shows, from left to right, the frames at kShown seconds and the last one.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/render/render.h"
#include "tests/bench/scale/families.h"

namespace {

using namespace lpdeform;
using Clock = std::chrono::steady_clock;

constexpr double kFrame = 0.033;                          // seconds
constexpr std::array kShown = {0.0, 0.1, 0.3, 1.0, 3.0};  // seconds
constexpr int kWidth = 400, kHeight = 320;                // of a picture, pixels

using FacePairs = std::vector<std::pair<std::int32_t, std::int32_t>>;

FacePairs adjacent_faces(const Faces& faces) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> first;
  FacePairs result;
  for (std::int32_t face = 0; face < faces.rows(); ++face) {
    for (int c = 0; c < 3; ++c) {
      const auto edge = std::minmax(faces(face, c), faces(face, (c + 1) % 3));
      const auto [found, is_new] = first.emplace(edge, face);
      if (!is_new) result.emplace_back(found->second, face);
    }
  }
  return result;
}

/// The angle between the normals of each pair, in degrees.
std::vector<double> angles(const Points& x, const Faces& faces, const FacePairs& pairs) {
  const auto normal = [&](std::int32_t face) -> Eigen::RowVector3d {
    const Eigen::RowVector3d u = x.row(faces(face, 1)) - x.row(faces(face, 0)),
                             v = x.row(faces(face, 2)) - x.row(faces(face, 0));
    return u.cross(v);
  };
  std::vector<double> result;
  for (const auto& [a, b] : pairs) {
    const Eigen::RowVector3d n = normal(a), m = normal(b);
    result.push_back(std::atan2(n.cross(m).norm(), n.dot(m)) * 180 / std::numbers::pi);
  }
  return result;
}

struct Bend {
  double most = 0, usual = 0;
};

Bend bend(const std::vector<double>& rest, std::vector<double> now) {
  for (std::size_t k = 0; k < now.size(); ++k) now[k] = std::abs(now[k] - rest[k]);
  const auto at = now.begin() + static_cast<std::ptrdiff_t>(now.size() * 99 / 100);
  std::nth_element(now.begin(), at, now.end());
  return {*std::max_element(at, now.end()), *at};
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Image side_by_side(const TriangleMesh& mesh, const std::vector<Points>& frames) {
  PictureStyle style;
  style.width = kWidth;
  style.height = kHeight;
  style.frame.resize(2 * mesh.vertices.rows(), 3);
  style.frame << mesh.vertices, frames.back();
  const auto count = static_cast<int>(frames.size());
  Image all(count * kWidth, kHeight);
  for (int k = 0; k < count; ++k) {
    const Image one = render(mesh.faces, frames[static_cast<std::size_t>(k)], style);
    for (int y = 0; y < kHeight; ++y)
      std::copy_n(one.bytes.begin() + 3 * y * kWidth, 3 * kWidth,
                  all.bytes.begin() + 3 * (y * count + k) * kWidth);
  }
  return all;
}

void show(const TriangleMesh& mesh, const HandleSet& handles, double p, int threads, double limit,
          const std::string& pictures) {
  const auto shape = RestShape::create(mesh).value();
  const FacePairs pairs = adjacent_faces(mesh.faces);
  const std::vector<double> rest = angles(mesh.vertices, mesh.faces, pairs);
  const auto deformer = Deformer::create(shape, {.threads = threads}).value();
  (void)deformer->set_material(Material::uniform(p));
  (void)deformer->set_handles(handles);
  (void)deformer->start({.effort = 0});
  Points shown = deformer->positions();
  double solving = 0, due = 0, jump = 0, stand = 0, changed_at = 0;
  Bend worst, last;
  int changes = 0;
  bool has_more = true;
  std::vector<Points> frames;
  while (has_more && solving < limit) {
    const Clock::time_point start = Clock::now();
    has_more = deformer->step();
    const bool is_due = solving + seconds_since(start) >= due || !has_more;
    if (is_due) deformer->catch_up();
    solving += seconds_since(start);
    if (!is_due) continue;
    due = solving + kFrame;
    if (frames.size() < kShown.size() && solving >= kShown[frames.size()])
      frames.push_back(deformer->positions());
    const double way = (deformer->positions() - shown).rowwise().norm().maxCoeff() / shape->diagonal();
    if (way == 0) continue;
    ++changes;
    if (changes > 1) {
      jump = std::max(jump, way);
      worst = {std::max(worst.most, last.most), std::max(worst.usual, last.usual)};
    }
    stand = std::max(stand, solving - changed_at);
    changed_at = solving;
    shown = deformer->positions();
    last = bend(rest, angles(shown, mesh.faces, pairs));
  }
  std::printf("{\"p\": %g, \"changes\": %d, \"stand\": %.3g, \"jump\": %.4g, ", p, changes, stand, jump);
  std::printf("\"worst_bend\": [%.3g, %.3g], \"last_bend\": [%.3g, %.3g]}\n", worst.usual, worst.most,
              last.usual, last.most);
  std::fflush(stdout);
  if (pictures.empty()) return;
  frames.push_back(deformer->positions());
  std::ofstream(absl::StrCat(pictures, "-", p, ".png"), std::ios::binary)
      << png_bytes(side_by_side(mesh, frames));
}

}  // namespace

int main(int count, char** arguments) {
  double vertices = 0, seconds = 0;
  int pose = 0, threads = 0;
  std::vector<double> exponents;
  bool is_good = (count == 7 || count == 8) && absl::SimpleAtod(arguments[2], &vertices) &&
                 absl::SimpleAtoi(arguments[4], &pose) && absl::SimpleAtoi(arguments[5], &threads) &&
                 absl::SimpleAtod(arguments[6], &seconds);
  if (is_good) {
    for (const auto p : absl::StrSplit(arguments[3], ','))
      is_good = absl::SimpleAtod(p, &exponents.emplace_back()) && is_good;
  }
  if (!is_good) {
    std::fprintf(stderr, "first_frames FAMILY VERTICES P[,P...] POSE THREADS SECONDS [PICTURES]\n");
    return 2;
  }
  const TriangleMesh mesh = family_of(arguments[1], vertices);
  const HandleSet handles = family_pose(mesh, static_cast<unsigned>(pose));
  for (const double p : exponents) show(mesh, handles, p, threads, seconds, count == 8 ? arguments[7] : "");
}
