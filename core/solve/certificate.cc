#include "core/solve/certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/solve/convex_rows.h"

namespace lpdeform {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLongestSeconds = 1e6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// t of the maximum in f*(y) = max_t y t - k t^p, for p > 1: |y| = k p t^{p - 1}.
double conjugate_point(double y, double k, double p) {
  return std::pow(y / (k * p), 1 / (p - 1));
}

/// argmin over t >= 0 of k t^p + (rho / 2) (t - v)^2.
double shrink(double v, double k, double p, double rho) {
  if (p == 1) return std::max(0.0, v - k / rho);
  if (p == 2) return v / (1 + 2 * k / rho);
  // g(t) = t + a t^{p - 1} - v rises; Newton from the side on which it cannot overshoot.
  const double a = k * p / rho;
  double t = p > 2 ? v : std::min(0.5 * v, std::pow(0.5 * v / a, 1 / (p - 1)));
  for (int step = 0; step < 50 && t > 0; ++step) {
    const double power = a * std::pow(t, p - 1);
    const double next = t - (t + power - v) / (1 + (p - 1) * power / t);
    const bool is_done = std::abs(next - t) <= 1e-14 * v;
    t = std::clamp(next, 0.0, v);
    if (is_done) break;
  }
  return t;
}

/// The dual side of one convex step.
class DualBound {
 public:
  DualBound(const ConvexRows& step, const EdgeVectors& z) : step_(step), z_(z) {}

  /// max over theta >= 0 of D(theta y), for y with A^T y = 0.
  double scaled_bound(const EdgeVectors& y) {
    norms_.resize(step_.count());
    double longest_theta = 2;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      norms_[i] = step_.norm(y, i);
      if (p(i) == 1 && norms_[i] > 0) longest_theta = std::min(longest_theta, k(i) / norms_[i]);
    }
    inner_ = y.cwiseProduct(z_).sum();
    double low = 0, high = longest_theta;
    for (int step = 0; step < 60; ++step) {
      const double theta = step == 0 ? high : 0.5 * (low + high);
      if (slope(theta) >= 0)
        low = theta;
      else
        high = theta;
      if (low == high) break;
    }
    return value(low);
  }

  double p(std::int32_t i) const { return step_.exponent(i); }
  double k(std::int32_t i) const { return step_.coefficient(i); }

 private:
  double slope(double theta) const {
    double sum = inner_;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      if (p(i) > 1 && norms_[i] > 0) sum -= norms_[i] * conjugate_point(theta * norms_[i], k(i), p(i));
    }
    return sum;
  }
  double value(double theta) const {
    double sum = theta * inner_;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      if (p(i) == 1 || norms_[i] == 0) continue;
      const double t = conjugate_point(theta * norms_[i], k(i), p(i));
      sum -= (p(i) - 1) * k(i) * std::pow(t, p(i));
    }
    return std::isfinite(sum) ? sum : -kInfinity;
  }

  const ConvexRows& step_;
  const EdgeVectors& z_;
  std::vector<double> norms_;
  double inner_ = 0;
};

/// Solves (A^T C A) u = A^T y, C the weights that the metric is factored with: the metric is 2 A^T C A.
Points least_squares(const Problem& problem, const ConvexRows& step, const EdgeVectors& y) {
  Points u;
  step.apply_transposed(y, u);
  problem.solve(u, u);
  return 2 * u;
}

/// y - C A (A^T C A)^-1 A^T y.
EdgeVectors project(const Problem& problem, const ConvexRows& step, const EdgeVectors& y) {
  EdgeVectors image;
  step.apply(least_squares(problem, step, y), image);
  for (std::int32_t i = 0; i < step.count(); ++i) step.rows(image, i) *= step.weight(i);
  return y - image;
}

/// The terms' gradients, y_i = k_i p_i |z_i|^{p_i - 2} z_i, smoothed near 0 where p_i < 2.
EdgeVectors term_gradients(const ConvexRows& step, const EdgeVectors& z, double eps) {
  EdgeVectors y = z;
  for (std::int32_t i = 0; i < step.count(); ++i) {
    const double p = step.exponent(i), size = step.norm(z, i);
    const double smoothed = p < 2 ? std::hypot(size, eps) : size;
    const double factor = smoothed > 0 ? step.coefficient(i) * p * std::pow(smoothed, p - 2) : 0;
    step.rows(y, i) *= factor;
  }
  return y;
}

double mean_energy(const Problem& problem) {
  double sum = 0;
  for (const double e2 : problem.objective.cells().squared_energies()) sum += std::sqrt(e2);
  return sum / static_cast<double>(problem.shape().vertex_count());
}

/// A penalty that treats the 90th percentile of the cells alike in primal and dual: k p E^{p - 2} there.
double penalty(const Problem& problem, const DualBound& dual) {
  const auto& e2 = problem.objective.cells().squared_energies();
  std::vector<std::pair<double, std::int32_t>> cells;
  for (std::size_t i = 0; i < e2.size(); ++i) cells.emplace_back(e2[i], static_cast<std::int32_t>(i));
  const auto percentile =
      cells.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(cells.size()));
  std::nth_element(cells.begin(), percentile, cells.end());
  const double energy = std::sqrt(std::max(percentile->first, 1e-20));
  const std::int32_t i = percentile->second;
  return dual.k(i) * dual.p(i) * std::pow(energy, dual.p(i) - 2);
}

/// ADMM on min sum f_i(z_i), z = A x - b, from the present residuals r and multipliers y, with the metric
/// factored for equal cell weights. Returns the best bound seen.
double polish(const Problem& problem, const ConvexRows& rows, DualBound& dual, EdgeVectors r, EdgeVectors y,
              double best, double enough, const CertificateSettings& settings, Clock::time_point end) {
  const double rho = penalty(problem, dual);
  EdgeVectors image;
  for (int step = 0; step < settings.max_steps && best < enough; ++step) {
    if (problem.stop.stop_requested() || Clock::now() >= end) break;
    const EdgeVectors v = r + y / rho;
    EdgeVectors z = v;
    for (std::int32_t i = 0; i < rows.count(); ++i) {
      const double size = rows.norm(v, i);
      const double factor = size > 0 ? shrink(size, dual.k(i), dual.p(i), rho) / size : 0;
      rows.rows(z, i) *= factor;
    }
    y = rho * (v - z);
    // x minimises |r - z + y / rho|; what remains of that vector, times rho, has A^T (.) = 0: a dual point.
    rows.apply(least_squares(problem, rows, r - z + y / rho), image);
    r -= image;
    if (step % 5 == 4) best = std::max(best, dual.scaled_bound(rho * (r - z) + y));
  }
  return best;
}

/// The best bound from the terms' gradients, smoothed by several shares of the mean cell energy; `y` gets the
/// gradient that gave it.
double gradient_bound(const Problem& problem, ConvexRows& rows, DualBound& dual, const EdgeVectors& z,
                      EdgeVectors& y) {
  double best = -kInfinity;
  const double mean = mean_energy(problem);
  for (const double share : {0.0, 1e-4, 1e-3, 1e-2, 1e-1}) {
    if (share > 0 && problem.norm.lowest_p() >= 2) break;
    const double eps = share * mean;
    problem.objective.reweigh(problem.norm.smoothed(eps * eps));
    if (!rows.factor()) continue;
    EdgeVectors gradient = term_gradients(rows, z, eps);
    const double bound = dual.scaled_bound(project(problem, rows, gradient));
    if (bound > best) best = bound, y = std::move(gradient);
  }
  return best;
}

}  // namespace

double relative_gap(const Problem& problem, const Points& x, const CertificateSettings& settings) {
  const double primal = problem.objective.sum(problem.norm);
  if (primal <= problem.zero_objective) return 0;
  if (!std::isfinite(primal) || problem.constraints.linear.has_tied_locks()) return 1;
  const Clock::time_point end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(std::min(settings.max_seconds, kLongestSeconds)));

  EdgeVectors z, y;
  ConvexRows rows(problem);
  rows.residuals(x, z);
  DualBound dual(rows, z);
  const double enough = (1 - settings.good_enough) * primal;
  double best = gradient_bound(problem, rows, dual, z, y);
  if (best < enough && y.size() > 0 && rows.factor_equal()) {
    best = polish(problem, rows, dual, z, std::move(y), best, enough, settings, end);
  }
  return best > -kInfinity ? std::clamp((primal - best) / primal, 0.0, 1.0) : 1;
}

}  // namespace lpdeform
