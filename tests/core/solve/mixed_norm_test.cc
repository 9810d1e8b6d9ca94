// Solves with large p, and with p that varies much over the surface: which minimum is found, what counts as converged, and what
// is zero.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// One end of a grid that is `length` long stays, the other is bent by `degrees` and moved.
HandleSet bent(const TriangleMesh& mesh, double length, double degrees, const Eigen::Vector3d& translation) {
  HandleSet handles;
  (void)handles.set("near", {slice(mesh, 1, 0, 0), Fixed{}});
  (void)handles.set("far", {slice(mesh, 1, length, length),
                            turn(Eigen::Vector3d::UnitX(), degrees, {0, length, 0}, translation)});
  return handles;
}

HandleSet right_angle(const TriangleMesh& mesh) {
  return bent(mesh, 20, 90, {0, -8, 5});
}

/// p = 1 where y > 15, `p` elsewhere.
Material half_rigid(const TriangleMesh& mesh, double p) {
  Material material = Material::uniform(p);
  material.p = Field::Constant(mesh.vertices.rows(), p);
  for (const std::int32_t i : slice(mesh, 1, 15.5, 30)) material.p[i] = 1;
  return material;
}

/// The energy of the cells whose p is not 1, and the largest E_i of those whose p is.
struct Halves {
  double soft_energy = 0, rigid_cell = 0;
};

Halves halves(const Deformer& solver, const Material& material, double length) {
  const Field energies = solver.cell_energies();
  Halves result;
  for (Eigen::Index i = 0; i < energies.size(); ++i) {
    if (material.p[i] == 1) result.rigid_cell = std::max(result.rigid_cell, energies[i]);
    if (material.p[i] != 1)
      result.soft_energy += length * length * std::pow(energies[i] / length, material.p[i]);
  }
  return result;
}

class HalfRigid : public testing::TestWithParam<double> {};

// The cells of p = 1 end with no distortion; what is left is the others', and small beside the smoothing that those began with.
TEST_P(HalfRigid, IsConvergedInTheTrueEnergy) {
  const double p = GetParam();
  const TriangleMesh mesh = grid(8, 30, 0.05);
  const auto shape = rest_shape(mesh);
  const Material material = half_rigid(mesh, p);
  const auto solver = deformer(shape, bent(mesh, 30, 12, {0, -0.3, 1}), material);
  const SolveSummary summary = solver->solve({.keep_trace = true}).value();
  const Halves first = halves(*solver, material, shape->mean_edge_length());
  const SolveSummary further = solver->solve({.initial = InitialGuess::kCurrent}).value();
  const Halves then = halves(*solver, material, shape->mean_edge_length());

  // To go on gains at most 1 % of the others' E^(1/p): so far is what the solver calls its end. Measured: below 0.1 % on Debian 12,
  // 0.33 % on Debian 13; it differs between processors and versions of the libraries.
  EXPECT_GT(then.soft_energy, std::pow(0.99, p) * first.soft_energy);
  // What rounding leaves of the cells of p = 1 is up to a tenth of the energy at p = 6, and most of it from p = 10 on. It differs
  // between widths of vectors and between processors, so only p = 4 can be judged by the sum. The solver's last smoothing, 1e-13
  // of the diagonal, hides what is below.
  EXPECT_EQ(summary.stop_reason, p < 10 ? StopReason::kConverged : StopReason::kStalled);
  if (p < 6) {
    EXPECT_GT(further.energy, std::pow(0.99, p) * summary.energy);
  } else {
    EXPECT_LT(first.rigid_cell, (p < 10 ? 1e-11 : 1e-13) * shape->diagonal());
  }
}
INSTANTIATE_TEST_SUITE_P(P, HalfRigid, testing::Values(4.0, 6.0, 10.0, 16.0));

// From rest, large p alone leads a bent grid into a fold; by way of a smaller p it does not.
TEST(LargeP, EndsAsLowFromRestAsFromASmallerP) {
  const TriangleMesh mesh = grid(12, 20, 0.05);
  const HandleSet handles = right_angle(mesh);
  const auto shape = rest_shape(mesh);
  const auto on_the_way = deformer(shape, handles, Material::uniform(6));
  (void)on_the_way->solve({});
  for (const double p : {16.0, 24.0, 32.0, 64.0}) {
    const double energy = deformer(shape, handles, Material::uniform(p))->solve({}).value().energy;
    ASSERT_TRUE(on_the_way->set_material(Material::uniform(p)).ok());
    const double other = on_the_way->solve({.initial = InitialGuess::kCurrent}).value().energy;
    EXPECT_LT(std::pow(energy / other, 1 / p), 1.001) << p;
  }
}

// Rounding of one cell of p = 1 is more than all that the others' distortions come to.
TEST(MixedNorm, IsNotZeroWhileCellsOfLargePAreDistorted) {
  const TriangleMesh mesh = grid(12, 20, 0.05);
  const HandleSet handles = right_angle(mesh);
  const auto shape = rest_shape(mesh);
  const auto sixteen = deformer(shape, handles, Material::uniform(16));
  (void)sixteen->solve({});
  Material material = Material::uniform(20);
  material.p = Field::Constant(mesh.vertices.rows(), 20);
  material.p[mesh.vertices.rows() / 2] = 1;
  const auto mixed = deformer(shape, handles, material);
  ASSERT_TRUE(mixed->set_positions(sixteen->positions()).ok());
  const SolveSummary summary = mixed->solve({.initial = InitialGuess::kCurrent, .certify = true}).value();
  EXPECT_GT(summary.iterations, 10);
  EXPECT_NE(summary.optimality_gap, 0.0);
  EXPECT_NE(summary.stop_reason,
            StopReason::kConverged);  // the cell of p = 1 is at rounding, the others are not through
}

}  // namespace
}  // namespace lpdeform
