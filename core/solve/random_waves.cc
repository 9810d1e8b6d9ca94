#include "core/solve/random_waves.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace lpdeform {
namespace {

constexpr double kMostWaves = 2;   // along the diagonal, for each axis
constexpr int kMostDraws = 10000;  // of a free vertex; after that, the next one by number

}  // namespace

RandomWaves::RandomWaves(int number, const Points& rest, double diagonal, const Size& size,
                         const std::vector<char>& is_held)
    : radius_(size.radius * diagonal) {
  std::mt19937_64 bits(static_cast<std::uint64_t>(number) + 101);
  const auto uniform = [&bits] { return static_cast<double>(bits() >> 11) * 0x1p-53; };
  const auto centred = [&uniform]() -> Eigen::Vector3d {
    const double x = uniform() - 0.5, y = uniform() - 0.5, z = uniform() - 0.5;
    return {x, y, z};
  };
  const auto any_vertex = [&] {
    return static_cast<Eigen::Index>(uniform() * static_cast<double>(rest.rows()));
  };
  Eigen::Index centre = any_vertex();
  for (int k = 0; k < kMostDraws && is_held[centre]; ++k) centre = any_vertex();
  for (Eigen::Index k = 0; k < rest.rows() && is_held[centre]; ++k) centre = (centre + 1) % rest.rows();
  centre_ = rest.row(centre);
  for (Wave& wave : waves_) {
    wave.frequency = 4 * std::numbers::pi * kMostWaves / diagonal * centred();
    wave.phase = 2 * std::numbers::pi * uniform();
    wave.amplitude = size.share * diagonal * centred().transpose();
  }
}

Eigen::RowVector3d RandomWaves::at(const Eigen::RowVector3d& rest) const {
  const double share = radius_ > 0 ? std::exp(-(rest - centre_).squaredNorm() / (2 * radius_ * radius_)) : 1;
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (const Wave& wave : waves_) sum += std::cos(rest.dot(wave.frequency) + wave.phase) * wave.amplitude;
  return share * sum;
}

}  // namespace lpdeform
