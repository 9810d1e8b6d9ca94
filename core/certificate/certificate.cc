#include "core/certificate/certificate.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/certificate/convex_rows.h"

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
  // g(t) = t + a t^{p - 1} - v increases in t. Newton's method starts on the side from which it cannot overshoot.
  const double a = k * p / rho;
  double t = p > 2 ? v : std::min(0.5 * v, std::pow(0.5 * v / a, 1 / (p - 1)));
  if (p < 2) t = std::max(t, v - a * std::pow(v, p - 1));  // t^{p - 1} <= v^{p - 1}
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
    conjugates_.assign(step_.count(), 0);
    near_one_.clear();
    double longest_theta = 2;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      const double norm = step_.norm(y, i);
      if (norm == 0) continue;
      if (p(i) >= kNearOne)
        conjugates_[i] = norm * conjugate_point(norm, k(i), p(i));
      else if (p(i) > 1)
        near_one_.push_back({norm, norm / (k(i) * p(i)), 1 / (p(i) - 1)});
      else
        longest_theta = std::min(longest_theta, k(i) / norm);
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
  /// Powers of 1 / (p_i - 1) of theta and of |y_i| / (k_i p_i) would overflow one by one; of their product they do not where it matters.
  struct NearOne {
    double norm;      // |y_i|
    double ratio;     // |y_i| / (k_i p_i)
    double exponent;  // 1 / (p_i - 1)
  };
  static constexpr double kNearOne = 1.05;

  // f_i*(theta y_i) = (1 - 1/p_i) theta^{p_i / (p_i - 1)} |y_i| t_i, where t_i is the conjugate point of |y_i|.
  double slope(double theta) const {
    double sum = inner_, power = 0, of_p = 0;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      if (conjugates_[i] == 0) continue;
      if (p(i) != of_p) of_p = p(i), power = std::pow(theta, 1 / (of_p - 1));
      sum -= power * conjugates_[i];
    }
    for (const NearOne& term : near_one_) sum -= term.norm * std::pow(theta * term.ratio, term.exponent);
    return sum;
  }
  double value(double theta) const {
    double sum = theta * inner_;
    for (std::int32_t i = 0; i < step_.count(); ++i) {
      if (conjugates_[i] == 0) continue;
      sum -= (1 - 1 / p(i)) * std::pow(theta, p(i) / (p(i) - 1)) * conjugates_[i];
    }
    for (const NearOne& term : near_one_)
      sum -= theta * term.norm * std::pow(theta * term.ratio, term.exponent) / (term.exponent + 1);
    return std::isfinite(sum) ? sum : -kInfinity;
  }

  const ConvexRows& step_;
  const EdgeVectors& z_;
  std::vector<double> conjugates_;  // |y_i| t_i; 0 where p_i is below kNearOne
  std::vector<NearOne> near_one_;   // of 1 < p_i < kNearOne
  double inner_ = 0;
};

/// Solves (A^T C A) u = A^T y, where C holds the weights that the metric is factored with. The metric is 2 A^T C A.
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
  return sum / static_cast<double>(problem.shape().cell_count());
}

/// The 90th percentile of the cells' energies.
double high_energy(const Problem& problem) {
  const auto& e2 = problem.objective.cells().squared_energies();
  std::vector<double> cells;
  for (std::size_t i = 0; i < e2.size(); ++i) {
    if (problem.shape().components()[i] >= 0) cells.push_back(e2[i]);
  }
  const auto percentile =
      cells.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(cells.size()));
  std::nth_element(cells.begin(), percentile, cells.end());
  return std::sqrt(std::max(*percentile, 1e-20));
}

}  // namespace

/// The stages of a certificate: gradients smoothed by several shares of the mean cell energy, then ADMM on
/// min sum f_i(z_i), z = A x - b, from the residuals at x and the best of the gradients.
class Certificate::Search {
 public:
  Search(Problem problem, const Points& x, const CertificateSettings& settings)
      : problem_(std::move(problem)),
        settings_(settings),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                std::min(settings.max_seconds, kLongestSeconds)))),
        primal_(problem_.objective.sum(problem_.norm)),
        is_zero_(problem_.is_zero(primal_)),
        rows_(problem_),
        dual_(rows_, z_) {
    is_over_ = is_zero_ || !std::isfinite(primal_) || problem_.constraints.linear.has_tied_locks();
    if (is_over_) return;
    rows_.residuals(x, z_);
    mean_energy_ = mean_energy(problem_);
  }

  bool step() {
    if (is_over_ || problem_.stop.stop_requested()) return false;
    if (share_ > 0 && Clock::now() >= end_) return false;
    if (share_ < kShares.size() && (share_ == 0 || problem_.norm.lowest_p() < 2)) {
      bound_by_gradient(kShares[share_++] * mean_energy_);
      return !is_over_;
    }
    if (!is_polishing_ && !begin_polishing()) return false;
    if (polished_ == settings_.max_steps) return false;
    polish();
    return !is_over_;
  }

  double relative_gap() const {
    if (is_zero_) return 0;
    return best_ > -kInfinity ? std::clamp((primal_ - best_) / primal_, 0.0, 1.0) : 1;
  }

 private:
  static constexpr std::array<double, 5> kShares = {0.0, 1e-4, 1e-3, 1e-2, 1e-1};
  static constexpr int kBetweenBounds = 5;

  bool take(double bound) {
    const bool is_better = bound > best_;
    if (is_better) best_ = bound;
    is_over_ = best_ >= (1 - settings_.good_enough) * primal_;
    return is_better;
  }

  void bound_by_gradient(double eps) {
    problem_.objective.reweigh(problem_.norm.smoothed(eps * eps));
    if (!rows_.factor()) return;
    EdgeVectors gradient = term_gradients(rows_, z_, eps);
    if (take(dual_.scaled_bound(project(problem_, rows_, gradient)))) y_ = std::move(gradient);
  }

  /// False if there is nothing to start from.
  bool begin_polishing() {
    // Each cell has a penalty of its own, which balances its primal and dual progress at this energy, however stiff the
    // cell is. A single penalty for all cells would leave either the multipliers of stiff cells or the residuals of
    // soft ones at their initial values.
    const double energy = high_energy(problem_);
    rho_.resize(rows_.count());
    for (std::int32_t i = 0; i < rows_.count(); ++i)
      rho_[i] = dual_.k(i) * dual_.p(i) * std::pow(energy, dual_.p(i) - 2);
    is_polishing_ = y_.size() > 0 && rows_.factor(rho_);
    r_ = z_;
    return is_polishing_;
  }

  /// One step of ADMM. Its current residuals are r_ and its multipliers y_.
  void polish() {
    EdgeVectors dual = y_;  // rho (r - z) + y
    for (std::int32_t i = 0; i < rows_.count(); ++i) {
      auto y = rows_.rows(y_, i);
      const EdgeVectors v = rows_.rows(r_, i) + y / rho_[i];
      const double size = v.norm();
      const double factor = size > 0 ? shrink(size, dual_.k(i), dual_.p(i), rho_[i]) / size : 0;
      y = rho_[i] * (1 - factor) * v;
      rows_.rows(dual, i) = rho_[i] * (rows_.rows(r_, i) - factor * v) + y;
    }
    // x minimises sum_i rho_i |r_i - z_i + y_i / rho_i|^2. The remainder of rho (r - z) + y then satisfies A^T (.) = 0,
    // so it is a dual feasible point.
    rows_.apply(least_squares(problem_, rows_, dual), image_);
    r_ -= image_;
    if (++polished_ % kBetweenBounds != 0) return;
    for (std::int32_t i = 0; i < rows_.count(); ++i) rows_.rows(dual, i) -= rho_[i] * rows_.rows(image_, i);
    take(dual_.scaled_bound(dual));
  }

  const Problem problem_;
  const CertificateSettings settings_;
  const Clock::time_point end_;
  const double primal_;
  const bool is_zero_;
  EdgeVectors z_;  // the residuals at x
  ConvexRows rows_;
  DualBound dual_;
  double best_ = -kInfinity;
  bool is_over_ = false;
  std::size_t share_ = 0;  // the next index into kShares
  double mean_energy_ = 0;
  bool is_polishing_ = false;
  int polished_ = 0;
  std::vector<double> rho_;  // one per cell and soft term
  EdgeVectors y_, r_, image_;
};

Certificate::Certificate(Problem problem, const Points& x, const CertificateSettings& settings)
    : search_(std::make_unique<Search>(std::move(problem), x, settings)) {}

Certificate::~Certificate() = default;

bool Certificate::step() {
  return search_->step();
}

double Certificate::relative_gap() const {
  return search_->relative_gap();
}

double relative_gap(const Problem& problem, const Points& x, const CertificateSettings& settings) {
  Certificate certificate(problem, x, settings);
  while (certificate.step()) {
  }
  return certificate.relative_gap();
}

}  // namespace lpdeform
