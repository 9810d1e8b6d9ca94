#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/cli/render/scene.h"
#include "core/base/workers.h"

namespace lpdeform {

/// How much of the sky each pixel's surface sees, as far as the picture shows it. It is judged by the points
/// that nearby pixels show, within a small share of the picture's height.
class Openness {
 public:
  /// A pixel is side x side samples of the scene; the middle one represents it. `scene` must outlive this
  /// object.
  Openness(const Scene& scene, int side, const Workers& workers);

  /// The value of a pixel: 1 in the open and on the background, down to 0 in holes and folds.
  double at(int x, int y) const;

 private:
  struct Point {
    float x, y, z;
  };
  struct Offset {
    int right, down;
  };
  static constexpr int kNeighbours = 40, kTurns = 64;
  using Offsets = std::array<Offset, kNeighbours>;

  static Offsets turned_spiral(double angle, double radius);
  void find_points(std::size_t begin, std::size_t end);

  const Scene& scene_;
  int side_, width_, height_;
  float reach2_;
  std::vector<Point> points_;  // one per pixel; NaN on the background
  std::array<Offsets, kTurns> offsets_;
};

}  // namespace lpdeform
