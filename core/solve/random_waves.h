#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// A sum of six smooth waves with random directions, wavelengths of a quarter of the diagonal or more, phases and amplitudes. It
/// displaces the starts of a search for lower minima.
class RandomWaves {
 public:
  struct Size {
    double share;   // of the diagonal: each coordinate of a wave's amplitude is at most half of it
    double radius;  // of the diagonal: of the Gaussian around a free vertex; 0: everywhere
  };

  /// What is random depends on `number` and on which vertices are held. `rest` in scaled units, with at least one vertex.
  RandomWaves(int number, const Points& rest, double diagonal, const Size& size,
              const std::vector<char>& is_held);

  /// The displacement of what is at `rest` in the rest shape.
  Eigen::RowVector3d at(const Eigen::RowVector3d& rest) const;

 private:
  struct Wave {
    Eigen::Vector3d frequency;
    double phase;
    Eigen::RowVector3d amplitude;
  };

  Eigen::RowVector3d centre_;
  double radius_;
  std::array<Wave, 6> waves_;
};

}  // namespace lpdeform
