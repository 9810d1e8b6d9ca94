#include "client/cli/reproduce/least_absolute.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace lpdeform::reproduce {
namespace {

using Eigen::ArrayXd, Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kSmallestSmoothing = 1e-12;  // share of the largest |b_i|
constexpr int kMostNewtonSteps = 100;

MatrixXd image_basis(const MatrixXd& a) {
  const Eigen::ColPivHouseholderQR<MatrixXd> factors(a);
  return factors.householderQ() * MatrixXd::Identity(a.rows(), factors.rank());
}

ArrayXd smoothed_lengths(const VectorXd& u, double eps) {
  return (u.array().square() + eps * eps).sqrt();
}

/// One Newton step with backtracking on z, with u = q z + b. Returns false if it gains nothing any more.
bool newton_step(const MatrixXd& q, double eps, VectorXd& u) {
  const ArrayXd lengths = smoothed_lengths(u, eps);
  const VectorXd slope = q.transpose() * (u.array() / lengths).matrix();
  const VectorXd bend = (eps * eps / lengths.cube()).matrix();
  const VectorXd step = -(q.transpose() * bend.asDiagonal() * q).ldlt().solve(slope);
  const double expected = slope.dot(step), value = lengths.sum();
  if (!(expected < -1e-15 * value)) return false;
  const VectorXd direction = q * step;
  for (double t = 1; t > 1e-10; t /= 2) {
    const VectorXd trial = u + t * direction;
    if (smoothed_lengths(trial, eps).sum() > value + 1e-4 * t * expected) continue;
    u = trial;
    return true;
  }
  return false;
}

double dual_value(const MatrixXd& q, const VectorXd& b, const VectorXd& u, double eps) {
  VectorXd y = (u.array() / smoothed_lengths(u, eps)).matrix();
  y -= q * (q.transpose() * y);
  return y.dot(b) / std::max(1.0, y.cwiseAbs().maxCoeff());
}

}  // namespace

LeastAbsolute least_absolute(const MatrixXd& a, const VectorXd& b) {
  const MatrixXd q = image_basis(a);
  LeastAbsolute result{b - q * (q.transpose() * b), q.cols(), 0};
  const double scale = b.cwiseAbs().maxCoeff();
  if (!(scale > 0)) return result;
  for (double eps = scale; eps >= kSmallestSmoothing * scale; eps /= 4) {
    int steps = 0;
    while (++steps <= kMostNewtonSteps && newton_step(q, eps, result.u)) {
    }
    result.lower_bound = std::max(result.lower_bound, dual_value(q, b, result.u, eps));
  }
  return result;
}

Eigen::Index non_zeros(const VectorXd& u) {
  return (u.array().abs() > 1e-6 * u.cwiseAbs().maxCoeff()).count();
}

}  // namespace lpdeform::reproduce
