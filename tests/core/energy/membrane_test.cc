#include "core/energy/membrane.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "core/energy/cell_pass.h"
#include "tests/core/every_instruction_set.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

LpNorm two(std::int32_t n) {
  return {Material::uniform(2), n, 1, 1};
}

/// A flat plate rolled up about the y axis, in scaled units.
Points rolled(const RestShape& shape, double radius) {
  Points x = shape.scaled_positions();
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double angle = x(i, 0) / radius;
    x.row(i) << radius * std::sin(angle), x(i, 1), radius * (1 - std::cos(angle));
  }
  return x;
}

/// As Membrane takes them: x, y, z and a filler for each vertex.
std::vector<double> with_fillers(const Points& x) {
  std::vector<double> rows;
  for (Eigen::Index i = 0; i < x.rows(); ++i) rows.insert(rows.end(), {x(i, 0), x(i, 1), x(i, 2), 0});
  return rows;
}

double sum_of_shares(const Membrane& membrane, std::int32_t n) {
  double sum = 0;
  for (std::int32_t i = 0; i < n; ++i) sum += membrane.share(i);
  return sum;
}

class MembraneKernel : public EveryInstructionSet {};

TEST_P(MembraneKernel, FindsWhatTheBestRotationOfEachFaceLeaves) {
  const auto shape = rest_shape(grid(5, 7, 1));
  ASSERT_NE(static_cast<std::size_t>(shape->faces().rows()) % MembraneFaces::kLanes, 0U);
  const Points& rest = shape->scaled_positions();
  const Points x = shaken(rest, 0.3);
  Membrane membrane(shape, Workers(1));
  membrane.evaluate(with_fillers(x).data(), Workers(1));
  double expected = 0;
  for (Eigen::Index t = 0; t < shape->faces().rows(); ++t) {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double squares = 0;
    for (int c = 0; c < 3; ++c) {
      const int a = shape->faces()(t, c), b = shape->faces()(t, (c + 1) % 3),
                o = shape->faces()(t, (c + 2) % 3);
      const Eigen::Vector3d r = rest.row(b) - rest.row(a), d = x.row(b) - x.row(a);
      const Eigen::Vector3d u = rest.row(a) - rest.row(o), v = rest.row(b) - rest.row(o);
      const double cotangent = u.dot(v) / u.cross(v).norm();
      covariance += cotangent * d * r.transpose();
      squares += cotangent * (r.squaredNorm() + d.squaredNorm());
    }
    // The singular values; the third is 0, since a face lies in a plane, so that a reflection is no better than a rotation.
    const Eigen::Matrix3d square = covariance.transpose() * covariance;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square, Eigen::EigenvaluesOnly);
    expected += squares - 2 * solver.eigenvalues().tail<2>().cwiseSqrt().sum();
  }
  EXPECT_NEAR(sum_of_shares(membrane, shape->vertex_count()), expected, 1e-10 * expected);
}

TEST_P(MembraneKernel, HasTheGradientOfItsEnergy) {
  const auto shape = rest_shape(grid(5, 7, 1));
  const Points x = shaken(shape->scaled_positions(), 0.3);
  Membrane membrane(shape, Workers(1));
  const auto energy = [&](const Points& at) {
    membrane.evaluate(with_fillers(at).data(), Workers(1));
    return sum_of_shares(membrane, shape->vertex_count());
  };
  const std::size_t before = membrane.memory_bytes();
  energy(x);
  Points gradient = Points::Zero(x.rows(), 3);
  membrane.add_gradient(std::vector<double>(static_cast<std::size_t>(x.rows()), 1.0), Workers(1), gradient);
  EXPECT_EQ(membrane.memory_bytes(), before);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      Points there = x, here = x;
      there(i, axis) += 1e-5;
      here(i, axis) -= 1e-5;
      EXPECT_NEAR(gradient(i, axis), (energy(there) - energy(here)) / 2e-5, 1e-5) << i << ", " << axis;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, MembraneKernel, testing::ValuesIn(instruction_sets()), by_its_name);

TEST(Membrane, ResistsStretchingAsCellsDo) {
  const auto shape = rest_shape(box_surface(1, 12, 12));
  Points x = shape->scaled_positions();
  x.col(1) *= 1.3;
  Membrane membrane(shape, Workers(1));
  membrane.evaluate(with_fillers(x).data(), Workers(1));
  CellPass cells(shape, Workers(1));
  const double expected = cells.evaluate(x, two(shape->vertex_count()));
  EXPECT_NEAR(sum_of_shares(membrane, shape->vertex_count()) / expected, 1,
              0.1);  // cells at edges turn a little
}

TEST(Membrane, DoesNotResistBending) {
  const auto shape = rest_shape(grid(20, 20));
  const Points x = rolled(*shape, 20);
  Membrane membrane(shape, Workers(1));
  membrane.evaluate(with_fillers(x).data(), Workers(1));
  CellPass cells(shape, Workers(1));
  const double cell = cells.evaluate(x, two(shape->vertex_count()));
  EXPECT_LT(sum_of_shares(membrane, shape->vertex_count()), 0.01 * cell);  // chords are shorter than arcs
}

TEST(Membrane, GivesTheSameBitsOnAnyNumberOfThreads) {
  const auto shape = rest_shape(creature(60));
  const Points x = shaken(shape->scaled_positions(), 0.2);
  std::vector<double> energies;
  std::vector<Points> gradients(2);
  for (const int threads : {1, 3}) {
    CellPass cells(shape, Workers(threads));
    cells.set_bending(0.2);
    energies.push_back(cells.evaluate(x, two(shape->vertex_count())));
    cells.gradient(gradients[energies.size() - 1]);
  }
  EXPECT_EQ(energies[0], energies[1]);
  EXPECT_EQ(gradients[0], gradients[1]);
}

/// Shares of 1 for cells of one half of the shape, and other ones for the rest.
Field graded_shares(const RestShape& shape) {
  Field shares = Field::Ones(shape.vertex_count());
  for (Eigen::Index i = 0; i < shares.size(); ++i) {
    if (shape.scaled_positions()(i, 2) > 0) shares[i] = i % 2 == 0 ? 0.2 : 0.5;
  }
  return shares;
}

TEST(Bending, OfEachCellIsThatOfItsOwnShare) {
  const auto shape = rest_shape(creature(30));
  const Points x = shaken(shape->scaled_positions(), 0.2);
  const Field shares = graded_shares(*shape);
  CellPass mixed(shape, Workers(1));
  mixed.set_bending(shares);
  mixed.evaluate(x, two(shape->vertex_count()));
  for (const double share : {0.2, 0.5, 1.0}) {
    CellPass even(shape, Workers(1));
    even.set_bending(share);
    even.evaluate(x, two(shape->vertex_count()));
    int count = 0;
    for (Eigen::Index i = 0; i < shares.size(); ++i) {
      if (shares[i] != share) continue;
      ++count;
      EXPECT_EQ(mixed.squared_energies()[i], even.squared_energies()[i]) << i;
    }
    EXPECT_GT(count, 20);
  }
  EXPECT_LT(mixed.memory_bytes(), [&] {
    CellPass even(shape, Workers(1));
    even.set_bending(0.2);
    return even.memory_bytes();
  }());
}

class EasedGradient : public testing::TestWithParam<double> {};

void expect_gradient(const std::shared_ptr<const RestShape>& shape, double p, const Field& shares) {
  const LpNorm norm(Material::uniform(p), shape->vertex_count(), 1, 1);
  CellPass cells(shape, Workers(1));
  cells.set_bending(shares);
  const Points x = shaken(shape->scaled_positions(), 0.3);
  cells.evaluate(x, norm);
  Points gradient;
  cells.gradient(gradient);
  const double step = 1e-5, size = gradient.cwiseAbs().maxCoeff();  // as in cell_pass_test.cc
  for (Eigen::Index i = 0; i < x.rows(); i += 3) {
    for (int c = 0; c < 3; ++c) {
      Points forward = x, backward = x;
      forward(i, c) += step, backward(i, c) -= step;
      const double difference = (cells.evaluate(forward, norm) - cells.evaluate(backward, norm)) / (2 * step);
      EXPECT_NEAR(gradient(i, c), difference, 1e-7 * size) << "vertex " << i << " coordinate " << c;
    }
  }
}

TEST_P(EasedGradient, AgreesWithCentralDifferences) {
  const auto shape = rest_shape(box_surface(2, 2, 3));
  expect_gradient(shape, GetParam(), Field::Constant(1, 0.2));
}

TEST_P(EasedGradient, AgreesWithCentralDifferencesWhereCellsHaveTheirOwnShares) {
  const auto shape = rest_shape(box_surface(2, 2, 3));
  expect_gradient(shape, GetParam(), graded_shares(*shape));
}

INSTANTIATE_TEST_SUITE_P(OfEveryP, EasedGradient, testing::Values(1, 1.5, 2, 6));

/// The same plate, rolled up alike, with edges of two lengths.
TEST(Bending, OfACoarseCellIsThatOfFineOnesByItsShare) {
  const auto fine = rest_shape(grid(40, 40)), coarse = rest_shape(grid(20, 20));
  CellPass fine_cells(fine, Workers(1)), coarse_cells(coarse, Workers(1));
  coarse_cells.set_bending(0.25);
  const double of_fine = fine_cells.evaluate(rolled(*fine, 40), two(fine->vertex_count()));
  const double of_coarse = 4 * coarse_cells.evaluate(rolled(*coarse, 20), two(coarse->vertex_count()));
  EXPECT_NEAR(of_coarse / of_fine, 1, 0.1);  // the cells of the boundary are wider
}

TEST(Bending, IsWholeAgainAfterAShareOfOne) {
  const auto shape = rest_shape(box_surface(2, 2, 3));
  const Points x = shaken(shape->scaled_positions(), 0.3);
  CellPass cells(shape, Workers(1));
  const double before = cells.evaluate(x, two(shape->vertex_count()));
  cells.set_bending(0.2);
  EXPECT_LT(cells.evaluate(x, two(shape->vertex_count())), before);
  cells.set_bending(1);
  EXPECT_EQ(cells.evaluate(x, two(shape->vertex_count())), before);
}

}  // namespace
}  // namespace lpdeform
