#include "core/constraints/linear_constraints.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using SparseFactor = Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>>;

/// A row of unit length counts as dependent on the rows before it if its squared distance from their span is below
/// this.
constexpr double kDependent = 1e-8;
constexpr double kShift = 1e-14;  // keeps the factorisation going past a dependent row

absl::Status dependent(const std::string& owner, const std::string& other) {
  const std::string with = other.empty()    ? "vertices that other handles hold"
                           : other == owner ? "other points or locks of its own"
                                            : absl::StrCat("handle \"", other, "\"");
  return make_fault({Reason::kHandleConstraintsDependent, absl::StrCat("handle \"", owner, "\""),
                     "independent points and locks"},
                    absl::StrCat("a point or lock of handle \"", owner, "\" follows from ", with,
                                 ", or contradicts it; hold one of the two"));
}

absl::Status too_many(const std::vector<LinearRow>& rows) {
  std::map<std::string, std::size_t> counts;
  for (const LinearRow& row : rows) ++counts[row.owner];
  const auto by_count = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto& [owner, most] = *std::max_element(counts.begin(), counts.end(), by_count);
  return make_fault(
      {Reason::kTooManyLocks, absl::StrCat("handle \"", owner, "\""),
       absl::StrCat("equations <= ", LinearConstraints::kMostRows)},
      absl::StrCat("points inside faces and locks make ", rows.size(),
                   " equations, 3 a point, 2 a vertex locked to an axis, 1 a vertex "
                   "locked to a plane; handle \"",
                   owner, "\" makes the most, ", most, "; there may be ", LinearConstraints::kMostRows));
}

}  // namespace

struct LinearConstraints::Factors {
  Sparse c;                           // m x 3n, free vertices only
  SparseFactor gram;                  // C C^T
  std::uint64_t metric_version = 0;   // the version that `schur` was made for; 0: none yet
  Eigen::LLT<Eigen::MatrixXd> schur;  // C M^-1 C^T * scale
};

absl::StatusOr<LinearConstraints> LinearConstraints::create(std::vector<LinearRow> rows,
                                                            const std::vector<char>& is_held) {
  LinearConstraints result;
  if (rows.empty()) return result;
  if (rows.size() > kMostRows) return too_many(rows);
  result.rows_ = std::move(rows);
  result.is_held_ = is_held;
  if (absl::Status status = result.factor(); !status.ok()) return status;
  return result;
}

/// Computes C and C C^T. A row that depends on the rows before it has a pivot of 0.
absl::Status LinearConstraints::factor() {
  factors_ = std::make_shared<Factors>();
  const auto m = static_cast<Eigen::Index>(rows_.size());
  const auto n = static_cast<Eigen::Index>(is_held_.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(m);
  for (Eigen::Index r = 0; r < m; ++r) {
    const PointForm& point = rows_[r].point;
    for (std::int32_t j = 0; j < point.count; ++j) {
      if (is_held_[point.vertices[j]]) continue;
      lengths[r] += point.coefficients[j] * point.coefficients[j];
      for (int axis = 0; axis < 3; ++axis) {
        entries.emplace_back(r, 3 * point.vertices[j] + axis,
                             point.coefficients[j] * rows_[r].direction[axis]);
      }
    }
    if (lengths[r] < kDependent) return dependent(rows_[r].owner, "");
  }
  factors_->c.resize(m, 3 * n);
  factors_->c.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd inverse_lengths = lengths.cwiseSqrt().cwiseInverse();
  Sparse unit = inverse_lengths.asDiagonal() * factors_->c;
  Sparse gram = unit * unit.transpose();
  for (Eigen::Index r = 0; r < m; ++r) gram.coeffRef(r, r) += kShift;
  SparseFactor pivots(gram);
  for (Eigen::Index r = 0; r < m; ++r) {
    if (pivots.info() == Eigen::Success && pivots.vectorD()[r] > kDependent) continue;
    std::string other = rows_[r].owner;
    for (Eigen::Index q = 0; q < r; ++q) {
      if (gram.coeff(r, q) != 0 && rows_[q].owner != rows_[r].owner) other = rows_[q].owner;
    }
    return dependent(rows_[r].owner, other);
  }
  factors_->gram.compute(Sparse(factors_->c * factors_->c.transpose()));
  return absl::OkStatus();
}

Eigen::VectorXd LinearConstraints::image(const Points& v) const {
  return factors_->c * Eigen::Map<const Eigen::VectorXd>(v.data(), v.size());
}

Points LinearConstraints::transposed(const Eigen::VectorXd& multipliers) const {
  Points result(static_cast<Eigen::Index>(is_held_.size()), 3);
  Eigen::Map<Eigen::VectorXd>(result.data(), result.size()) = factors_->c.transpose() * multipliers;
  return result;
}

void LinearConstraints::restrict(Points& v) const {
  if (!empty()) v -= transposed(factors_->gram.solve(image(v)));
}

void LinearConstraints::satisfy(Points& x) const {
  if (empty()) return;
  for (int round = 0; round < 2; ++round) {  // the second removes the rounding error of the first
    x += transposed(factors_->gram.solve(residual(x)));
  }
}

/// t - C x for all of x, including held vertices.
Eigen::VectorXd LinearConstraints::residual(const Points& x) const {
  Eigen::VectorXd result(rows_.size());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    result[r] = rows_[r].target - rows_[r].point.at(x).dot(rows_[r].direction.transpose());
  }
  return result;
}

void LinearConstraints::satisfy_within(const Metric& metric, Points& x, const Workers& workers) const {
  if (empty()) return;
  prepare_schur(metric, workers);
  Points move = transposed(metric.scale() * factors_->schur.solve(residual(x)));
  metric.solve(move, move, workers);
  if (move.allFinite()) x += move;
  satisfy(x);
}

Points LinearConstraints::forces_against(const Metric& metric, const Points& v,
                                         const Workers& workers) const {
  prepare_schur(metric, workers);
  return transposed(metric.scale() * factors_->schur.solve(image(v)));
}

/// Computes C M^-1 C^T from the columns of M^-1 for the distinct points, three at a time.
void LinearConstraints::prepare_schur(const Metric& metric, const Workers& workers) const {
  if (factors_->metric_version == metric.version()) return;
  std::vector<PointForm> points;
  std::vector<std::size_t> point_of(rows_.size());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (points.empty() || points.back() != rows_[r].point) points.push_back(rows_[r].point);
    point_of[r] = points.size() - 1;
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd inverse(count, count);
  for (Eigen::Index first = 0; first < count; first += 3) {
    const Eigen::Index width = std::min<Eigen::Index>(3, count - first);
    Points columns = Points::Zero(static_cast<Eigen::Index>(is_held_.size()), 3);
    for (Eigen::Index k = 0; k < width; ++k) {
      const PointForm& point = points[first + k];
      for (std::int32_t j = 0; j < point.count; ++j) {
        if (!is_held_[point.vertices[j]]) columns(point.vertices[j], k) += point.coefficients[j];
      }
    }
    metric.solve(columns, columns, workers);
    for (Eigen::Index q = 0; q < count; ++q) {
      inverse.row(q).segment(first, width) = points[q].at(columns).head(width);
    }
  }
  const auto m = static_cast<Eigen::Index>(rows_.size());
  Eigen::MatrixXd schur(m, m);
  for (Eigen::Index r = 0; r < m; ++r) {
    for (Eigen::Index q = 0; q < m; ++q) {
      schur(r, q) =
          metric.scale() * rows_[r].direction.dot(rows_[q].direction) * inverse(point_of[r], point_of[q]);
    }
  }
  factors_->schur.compute(schur);
  factors_->metric_version = metric.version();
}

void LinearConstraints::add_ties(double stiffness, std::vector<MatrixEntry>& entries) const {
  for (std::size_t r = 0; r < rows_.size();) {
    std::size_t next = r + 1;
    while (next < rows_.size() && next < r + 3 && rows_[next].point == rows_[r].point) ++next;
    if (has_tied_locks_ || next == r + 3) add_square(rows_[r].point, stiffness, entries);
    r = next;
  }
}

std::size_t LinearConstraints::memory_bytes() const {
  const std::size_t m = rows_.size();
  return m * sizeof(LinearRow) + m * m * sizeof(double) + is_held_.capacity();
}

bool LinearConstraints::reuse(const LinearConstraints& before) {
  if (rows_.size() != before.rows_.size() || is_held_ != before.is_held_) return false;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (rows_[r].point != before.rows_[r].point) return false;
    if (rows_[r].direction != before.rows_[r].direction) return false;
  }
  factors_ = before.factors_;
  return true;
}

}  // namespace lpdeform
