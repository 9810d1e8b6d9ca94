#include "core/methods/conic_step.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/methods/two_ring.h"

namespace lpdeform {
namespace {

constexpr double kStepShare = 0.99;  // the share of the way to the boundary of the cones

/// u^2 - |v|^2, without cancellation where it is small.
double squared_distance(double head, double tail_norm) {
  return (head - tail_norm) * (head + tail_norm);
}

}  // namespace

ConicStep::ConicStep(const Problem& problem, std::vector<Eigen::Matrix3d> rotations, const Points& x)
    : problem_(problem), rotations_(std::move(rotations)), x_(x) {
  const std::int32_t n = shape().vertex_count();
  const auto& is_held = problem_.constraints.is_held;
  free_.assign(n, -1);
  std::int32_t free_count = 0;
  for (std::int32_t i = 0; i < n; ++i) {
    if (!is_held[i]) free_[i] = free_count++;
  }
  residuals(shape(), x_, rotations_, s_.tail);
  double largest = 0;
  for (std::int32_t i = 0; i < n; ++i) {
    const double size = cell_norm(shape(), s_.tail, i);
    bool is_free = free_[i] >= 0;
    for (std::int32_t k = shape().offsets()[i]; k < shape().offsets()[i + 1]; ++k) {
      is_free = is_free || free_[shape().neighbours()[k]] >= 0;
    }
    if (is_free)
      cells_.push_back(i), largest = std::max(largest, size);
    else
      constant_ += problem_.norm.coefficient(i) * size;
  }
  largest = std::max(largest, 1e-12);
  s_.head.assign(n, 0.0);
  w_.head.assign(n, 0.0);
  for (const std::int32_t i : cells_) {
    s_.head[i] = cell_norm(shape(), s_.tail, i) + largest;
    w_.head[i] = problem_.norm.coefficient(i);
  }
  w_.tail = EdgeVectors::Zero(s_.tail.rows(), 3);
  lambda_ = w_;
  v_ = w_.tail;
  scaling_.resize(n);
  lower_bound_ = constant_;
  update_bounds();
  if (free_count == 0) return;
  matrix_ = two_ring_pattern(shape(), free_);
  factor_.emplace(matrix_);
}

double ConicStep::relative_gap() const {
  return primal_ > problem_.zero_objective ? std::max(0.0, (primal_ - lower_bound_) / primal_) : 0;
}

void ConicStep::update_bounds() {
  primal_ = constant_;
  double bound = constant_, scale = 1;
  for (const std::int32_t i : cells_) {
    primal_ += w_.head[i] * cell_norm(shape(), s_.tail, i);
    bound -= rows(w_.tail, i).cwiseProduct(rows(s_.tail, i)).sum();
    scale = std::max(scale, cell_norm(shape(), w_.tail, i) / w_.head[i]);
  }
  lower_bound_ = std::max(lower_bound_, constant_ + (bound - constant_) / scale);
}

/// Computes w bar and eta, the scaling of each cone, and lambda.
void ConicStep::scale_cones() {
  for (const std::int32_t i : cells_) {
    const auto z = rows(s_.tail, i), w = rows(w_.tail, i);
    const double s_size = std::sqrt(squared_distance(s_.head[i], z.norm()));
    const double w_size = std::sqrt(squared_distance(w_.head[i], w.norm()));
    const double inner = (s_.head[i] * w_.head[i] + z.cwiseProduct(w).sum()) / (s_size * w_size);
    const double gamma = std::sqrt(0.5 * (1 + inner));
    rows(v_, i) = (z / s_size - w / w_size) / (2 * gamma);
    // Computed this way, u^2 = 1 + |v|^2 holds exactly.
    scaling_[i].u = std::sqrt(1 + rows(v_, i).squaredNorm());
    scaling_[i].eta = std::sqrt(s_size / w_size);
    const auto v = rows(v_, i);
    const double along = v.cwiseProduct(w).sum();
    lambda_.head[i] = scaling_[i].eta * (scaling_[i].u * w_.head[i] + along);
    rows(lambda_.tail, i) = scaling_[i].eta * (w + (w_.head[i] + along / (1 + scaling_[i].u)) * v);
  }
}

/// Assembles sum_i eta_i^-2 A_i^T (I - kappa_i v_i v_i^T) A_i, kappa = 2 / (2 u^2 - 1): the system with T_i eliminated.
void ConicStep::assemble() {
  std::fill(matrix_.values.begin(), matrix_.values.end(), 0.0);
  std::vector<std::int32_t> members;
  std::vector<Eigen::Vector3d> spikes;
  const auto add = [&](std::int32_t a, std::int32_t b, const Eigen::Matrix3d& block) {
    if (a >= 0 && b >= 0)
      a >= b ? add_block(matrix_, a, b, block) : add_block(matrix_, b, a, block.transpose());
  };
  for (const std::int32_t i : cells_) {
    const double share = 1 / (scaling_[i].eta * scaling_[i].eta);
    const double kappa = 2 / (2 * scaling_[i].u * scaling_[i].u - 1);
    members.assign(1, free_[i]);
    spikes.assign(1, Eigen::Vector3d::Zero());
    for (std::int32_t k = shape().offsets()[i]; k < shape().offsets()[i + 1]; ++k) {
      const double weight = shape().weights()[k];
      const std::int32_t other = free_[shape().neighbours()[k]];
      const Eigen::Matrix3d block = share * weight * Eigen::Matrix3d::Identity();
      add(free_[i], free_[i], block);
      add(other, other, block);
      add(free_[i], other, -block);
      const Eigen::Vector3d spike = std::sqrt(weight) * v_.row(k).transpose();
      spikes[0] += spike;
      members.push_back(other);
      spikes.push_back(-spike);
    }
    for (std::size_t a = 0; a < members.size(); ++a) {
      for (std::size_t b = 0; b <= a; ++b)
        add(members[a], members[b], -share * kappa * spikes[a] * spikes[b].transpose());
    }
  }
}

/// Multiplies by the matrix of assemble() without assembling it.
Points ConicStep::apply_schur(const Points& dx) const {
  EdgeVectors dz;
  apply_edges(shape(), dx, dz);
  EdgeVectors result = EdgeVectors::Zero(dz.rows(), 3);
  for (const std::int32_t i : cells_) {
    const double share = 1 / (scaling_[i].eta * scaling_[i].eta);
    const double kappa = 2 / (2 * scaling_[i].u * scaling_[i].u - 1);
    const auto v = rows(v_, i);
    rows(result, i) = share * (rows(dz, i) - kappa * v.cwiseProduct(rows(dz, i)).sum() * v);
  }
  Points out;
  apply_edges_transposed(shape(), result, problem_.constraints.is_held, out);
  return out;
}

ConicStep::Cones ConicStep::complementarity() const {
  Cones result{std::vector<double>(s_.head.size(), 0.0), lambda_.tail};
  for (const std::int32_t i : cells_) {
    result.head[i] = lambda_.head[i] * lambda_.head[i] + rows(lambda_.tail, i).squaredNorm();
    rows(result.tail, i) *= 2 * lambda_.head[i];
  }
  return result;
}

/// target += (W^-1 ds) o (W dw) - centre e.
void ConicStep::correct(const Cones& ds, const Cones& dw, double centre, Cones& target) const {
  for (const std::int32_t i : cells_) {
    const auto [eta, u] = scaling_[i];
    const auto v = rows(v_, i), dz = rows(ds.tail, i), dy = rows(dw.tail, i);
    const double s_along = v.cwiseProduct(dz).sum(), w_along = v.cwiseProduct(dy).sum();
    const double a_head = (u * ds.head[i] - s_along) / eta, b_head = eta * (u * dw.head[i] + w_along);
    const EdgeVectors a_tail = (dz + (s_along / (1 + u) - ds.head[i]) * v) / eta;
    const EdgeVectors b_tail = eta * (dy + (dw.head[i] + w_along / (1 + u)) * v);
    target.head[i] += a_head * b_head + a_tail.cwiseProduct(b_tail).sum() - centre;
    rows(target.tail, i) += a_head * b_tail + b_head * a_tail;
  }
}

/// The Newton direction of W dw + W^-1 ds = -lambda \ target with ds = (dT, A dx), dw = (0, dw), A^T (w + dw) = 0.
bool ConicStep::direction(const Cones& target, Points& dx, Cones& ds, Cones& dw) {
  Cones g{std::vector<double>(s_.head.size(), 0.0),
          EdgeVectors::Zero(v_.rows(), 3)};  // W^-1 (lambda \ target)
  EdgeVectors right = w_.tail;
  for (const std::int32_t i : cells_) {
    const auto [eta, u] = scaling_[i];
    const auto v = rows(std::as_const(v_), i), lambda = rows(std::as_const(lambda_.tail), i),
               d = rows(target.tail, i);
    const double size = squared_distance(lambda_.head[i], lambda.norm());
    const double q_head = (lambda_.head[i] * target.head[i] - lambda.cwiseProduct(d).sum()) / size;
    const EdgeVectors q_tail = (d - q_head * lambda) / lambda_.head[i];
    const double along = v.cwiseProduct(q_tail).sum();
    g.head[i] = (u * q_head - along) / eta;
    rows(g.tail, i) = (q_tail + (along / (1 + u) - q_head) * v) / eta;
    // P = W^-2: P00 = (2 u^2 - 1) / eta^2, P01 = -2 u v / eta^2.
    rows(right, i) += -rows(g.tail, i) - (2 * u / (2 * u * u - 1)) * g.head[i] * v;
  }
  Points b;
  apply_edges_transposed(shape(), right, problem_.constraints.is_held, b);
  dx = Points::Zero(x_.rows(), 3);
  Eigen::VectorXd flat(matrix_.size());
  for (int round = 0; round < 3; ++round) {  // the solve and two refinements
    const Points rest = round == 0 ? b : Points(b - apply_schur(dx));
    for (std::int32_t i = 0; i < shape().vertex_count(); ++i) {
      if (free_[i] >= 0) flat.segment<3>(3 * free_[i]) = rest.row(i).transpose();
    }
    factor_->solve(flat, flat);
    for (std::int32_t i = 0; i < shape().vertex_count(); ++i) {
      if (free_[i] >= 0) dx.row(i) += flat.segment<3>(3 * free_[i]).transpose();
    }
  }
  if (!dx.allFinite()) return false;
  ds.head.assign(s_.head.size(), 0.0);
  dw.head.assign(s_.head.size(), 0.0);
  apply_edges(shape(), dx, ds.tail);
  dw.tail = EdgeVectors::Zero(v_.rows(), 3);
  for (const std::int32_t i : cells_) {
    const auto [eta, u] = scaling_[i];
    const auto v = rows(v_, i);
    const double share = 1 / (eta * eta), along = v.cwiseProduct(rows(ds.tail, i)).sum();
    const double p00 = share * (2 * u * u - 1);
    ds.head[i] = (-g.head[i] + 2 * share * u * along) / p00;
    rows(dw.tail, i) =
        -rows(g.tail, i) + 2 * share * u * ds.head[i] * v - share * (rows(ds.tail, i) + 2 * along * v);
  }
  return true;
}

/// The largest step, at most 1, for which point + step * direction is still in the cones.
double ConicStep::step_length(const Cones& point, const Cones& direction) const {
  double step = 1 / kStepShare;
  for (const std::int32_t i : cells_) {
    const auto p = rows(point.tail, i), d = rows(direction.tail, i);
    // head + t dhead = |tail + t dtail|: a t^2 + 2 b t + c = 0.
    const double a = squared_distance(direction.head[i], d.norm());
    const double b = point.head[i] * direction.head[i] - p.cwiseProduct(d).sum();
    const double c = squared_distance(point.head[i], p.norm());
    if (direction.head[i] < 0) step = std::min(step, -point.head[i] / direction.head[i]);
    const double root = b * b - a * c;
    if (root < 0) continue;
    // The smallest positive root, by the formula without cancellation.
    const double denominator = b < 0 ? -b + std::sqrt(root) : -b - std::sqrt(root);
    if (b < 0)
      step = std::min(step, c / denominator);
    else if (a < 0)
      step = std::min(step, denominator / a);
  }
  return std::max(0.0, kStepShare * step);
}

bool ConicStep::iterate() {
  if (!factor_) return false;
  scale_cones();
  assemble();
  if (!factor_->factor(matrix_)) return false;
  Cones target = complementarity(), ds, dw;
  Points dx;
  if (!direction(target, dx, ds, dw)) return false;
  const double affine = std::min({1.0, step_length(s_, ds) / kStepShare, step_length(w_, dw) / kStepShare});

  double mu = 0;
  for (const std::int32_t i : cells_)
    mu += lambda_.head[i] * lambda_.head[i] + rows(lambda_.tail, i).squaredNorm();
  mu /= static_cast<double>(cells_.size());
  const double sigma = std::pow(1 - affine, 3);
  correct(ds, dw, sigma * mu, target);
  if (!direction(target, dx, ds, dw)) return false;

  const double primal_step = std::min(1.0, step_length(s_, ds)),
               dual_step = std::min(1.0, step_length(w_, dw));
  const double step = std::min(primal_step, dual_step);
  if (!(step > 1e-10)) return false;
  x_ += step * dx;
  residuals(shape(), x_, rotations_, s_.tail);
  for (const std::int32_t i : cells_) {
    s_.head[i] = std::max(s_.head[i] + step * ds.head[i], cell_norm(shape(), s_.tail, i) * (1 + 1e-15));
  }
  w_.tail += step * dw.tail;
  update_bounds();
  return std::isfinite(primal_);
}

}  // namespace lpdeform
