#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/check.h"
#include "core/shapes/distance_fields.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

constexpr int kHoles = 7;
constexpr double kHoleRadius = 0.045, kNoise = 0.2;  // the noise in edge lengths

std::vector<Capsule> bust_parts() {
  return {
      {{0, 0, -0.62}, {0, 0.02, -0.50}, 0.34, 0.26},      // base
      {{0, 0.02, -0.45}, {0, 0.04, 0.10}, 0.15, 0.14},    // neck
      {{0, 0.06, 0.28}, {0, -0.02, 0.45}, 0.27, 0.25},    // skull
      {{0, -0.20, 0.33}, {0, -0.34, 0.24}, 0.05, 0.045},  // nose
      {{0, -0.12, 0.12}, {0, -0.20, 0.10}, 0.11, 0.08},   // chin
      {{0.24, 0.07, 0.30}, {0.32, 0.11, 0.38}, 0.05, 0.045},
      {{-0.24, 0.07, 0.30}, {-0.32, 0.11, 0.38}, 0.05, 0.045},
  };
}

/// Waves in four octaves, at most about 1 in sum.
double roughness(const Point& point) {
  static constexpr std::array<std::array<double, 4>, 4> kWaves{
      {{9, 5, -7, 0.4}, {-13, 17, 11, 0.3}, {29, -23, 31, 0.2}, {-53, 61, 47, 0.1}}};
  double sum = 0;
  for (const auto& wave : kWaves) {
    const double a = wave[0] * point[0] + wave[1] * point[1] + wave[2] * point[2];
    const double b = wave[1] * point[0] - wave[2] * point[1] + wave[0] * point[2];
    sum += wave[3] * std::sin(a) * std::cos(0.7 * b);
  }
  return sum;
}

/// A number from -1 to 1 that depends on the vertex only.
double noise_of(Eigen::Index vertex) {
  auto bits = static_cast<std::uint64_t>(vertex) + 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return static_cast<double>((bits ^ (bits >> 31)) >> 11) * 0x1p-52 - 1;
}

/// The mesh without the faces near some of its points, and without vertices that are then in no face.
TriangleMesh with_holes(const TriangleMesh& mesh) {
  const Eigen::Index n = mesh.vertices.rows();
  const auto is_cut = [&](const Point& at) {
    for (int hole = 0; hole < kHoles; ++hole) {
      const Point centre = mesh.vertices.row(n * (2 * hole + 1) / (2 * kHoles));
      if ((at - centre).norm() < kHoleRadius) return true;
    }
    return false;
  };
  std::vector<std::int32_t> number(static_cast<std::size_t>(n), -1);
  std::int32_t count = 0;
  Faces faces(mesh.faces.rows(), 3);
  Eigen::Index kept = 0;
  for (Eigen::Index face = 0; face < mesh.faces.rows(); ++face) {
    const auto row = mesh.faces.row(face);
    if (is_cut((mesh.vertices.row(row[0]) + mesh.vertices.row(row[1]) + mesh.vertices.row(row[2])) / 3))
      continue;
    for (int c = 0; c < 3; ++c) {
      if (number[row[c]] < 0) number[row[c]] = count++;
      faces(kept, c) = number[row[c]];
    }
    ++kept;
  }
  TriangleMesh result{Points(count, 3), faces.topRows(kept)};
  for (Eigen::Index v = 0; v < n; ++v) {
    if (number[v] >= 0) result.vertices.row(number[v]) = mesh.vertices.row(v);
  }
  return result;
}

}  // namespace

TriangleMesh scan(int resolution) {
  LPDEFORM_CHECK(resolution >= 24);
  const ImplicitField field = [parts = bust_parts()](const Point& point) {
    std::vector<double> distances;
    for (const Capsule& part : parts) distances.push_back(distance_to(part, point));
    return blended_union(distances, 0.03) + 0.012 * roughness(point);
  };
  const Point low(-0.55, -0.5, -1.05), high(0.55, 0.5, 0.85);
  TriangleMesh mesh = with_holes(field_surface(field, low, high, resolution));
  const double noise = kNoise * (high - low).maxCoeff() / resolution;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Point at = mesh.vertices.row(v);
    for (int axis = 0; axis < 3; ++axis) mesh.vertices(v, axis) = at[axis] + noise * noise_of(3 * v + axis);
  }
  return mesh;
}

}  // namespace lpdeform
