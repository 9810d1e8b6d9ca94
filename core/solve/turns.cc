#include "core/solve/turns.h"

#include <array>

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 2048;  // vertices
/// Added to the matrix of the least squares, as a share of its trace: edges that lie nearly along a line tell nothing about a turn
/// around it.
constexpr double kDamping = 1e-6;
/// Of half the angle. Where edges turn round, their means tend to zero, and the axis is lost in rounding.
constexpr double kMostTangent = 1;

/// x with S x = b, S symmetric and positive definite with the entries s: xx, xy, xz, yy, yz, zz.
Eigen::Vector3d solved(const std::array<double, 6>& s, const Eigen::Vector3d& b) {
  const double xx = s[3] * s[5] - s[4] * s[4], xy = s[2] * s[4] - s[1] * s[5], xz = s[1] * s[4] - s[2] * s[3];
  const double yy = s[0] * s[5] - s[2] * s[2], yz = s[1] * s[2] - s[0] * s[4], zz = s[0] * s[3] - s[1] * s[1];
  const double over = 1 / (s[0] * xx + s[1] * xy + s[2] * xz);
  return {over * (xx * b[0] + xy * b[1] + xz * b[2]), over * (xy * b[0] + yy * b[1] + yz * b[2]),
          over * (xz * b[0] + yz * b[1] + zz * b[2])};
}

/// v_i; see turns_between(). By numbers: with expressions of Eigen, all turns took 2.3 times as long.
Eigen::Vector3d turning(const RestShape& shape, const Points& before, const Points& now, Eigen::Index i) {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // sum of w m m^T
  double bx = 0, by = 0, bz = 0;                          // sum of w m x d
  const double* const own_before = before.data() + 3 * i;
  const double* const own_now = now.data() + 3 * i;
  for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
    const std::ptrdiff_t j = 3 * static_cast<std::ptrdiff_t>(shape.neighbours()[k]);
    const double* const other_before = before.data() + j;
    const double* const other_now = now.data() + j;
    const double w = shape.weights()[k];
    const double ex = own_before[0] - other_before[0], ey = own_before[1] - other_before[1],
                 ez = own_before[2] - other_before[2];
    const double fx = own_now[0] - other_now[0], fy = own_now[1] - other_now[1],
                 fz = own_now[2] - other_now[2];
    const double mx = ex + fx, my = ey + fy, mz = ez + fz, dx = fx - ex, dy = fy - ey, dz = fz - ez;
    const double wx = w * mx, wy = w * my, wz = w * mz;
    xx += wx * mx, xy += wx * my, xz += wx * mz, yy += wy * my, yz += wy * mz, zz += wz * mz;
    bx += wy * dz - wz * dy, by += wz * dx - wx * dz, bz += wx * dy - wy * dx;
  }
  // m above is twice the mean edge.
  const double trace = xx + yy + zz;
  if (!(trace > 0)) return Eigen::Vector3d::Zero();
  const double over = 1 / trace, one = 1 + kDamping;
  return solved({one - over * xx, -over * xy, -over * xz, one - over * yy, -over * yz, one - over * zz},
                2 * over * Eigen::Vector3d(bx, by, bz));
}

/// The rotation whose axis is that of t, with |t| = tan(angle / 2), for rows.
Turn rotation(const Eigen::Vector3d& t) {
  const double x = t[0], y = t[1], z = t[2], a = 2 / (1 + t.squaredNorm());
  Eigen::Matrix3d result;
  result << 1 - a * (y * y + z * z), a * (x * y + z), a * (x * z - y),  //
      a * (x * y - z), 1 - a * (x * x + z * z), a * (y * z + x),        //
      a * (x * z + y), a * (y * z - x), 1 - a * (x * x + y * y);
  return result.cast<float>();
}

}  // namespace

std::vector<Turn> turns_between(const RestShape& shape, const Points& before, const Points& now, double share,
                                const Workers& workers) {
  std::vector<Turn> turns(static_cast<std::size_t>(now.rows()));
  workers.for_chunks(turns.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d half = 0.5 * turning(shape, before, now, static_cast<Eigen::Index>(i));
      const bool is_known = half.squaredNorm() <= kMostTangent * kMostTangent;
      turns[i] = is_known ? rotation(share * half) : Turn(Turn::Identity());
    }
  });
  return turns;
}

}  // namespace lpdeform
