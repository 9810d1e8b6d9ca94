#include "core/constraints/metric.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "absl/strings/str_format.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr int kPasses = 12;
constexpr double kRefined = 1e-12;  // refinement ends when the correction's share of the result is <= this
constexpr std::size_t kBytesPerEntry = 20;  // per matrix entry: what the factor has besides its values
constexpr double kSlowest = 0.3;            // the largest ratio of a correction to the previous one

LowerMatrix lower_pattern(const RestShape& shape) {
  LowerMatrix matrix;
  const std::int32_t n = shape.vertex_count();
  matrix.columns.reserve(n + 1);
  matrix.rows.reserve(n + shape.neighbours().size() / 2);
  matrix.columns.push_back(0);
  for (std::int32_t i = 0; i < n; ++i) {
    matrix.rows.push_back(i);
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      if (shape.neighbours()[k] > i) matrix.rows.push_back(shape.neighbours()[k]);
    }
    matrix.columns.push_back(static_cast<std::int32_t>(matrix.rows.size()));
  }
  return matrix;
}

}  // namespace

absl::StatusOr<Metric> Metric::create(std::shared_ptr<const RestShape> shape, const Admission& admit) {
  LowerMatrix matrix = lower_pattern(*shape);
  const auto supernodes = analyse_supernodes(matrix);
  if (!supernodes.ok()) return supernodes.status();
  const double operations = operation_count(*supernodes), most = most_operations(shape->vertex_count());
  if (operations > most) {
    return make_fault({Reason::kFactorTooLarge, "mesh", absl::StrFormat("multiplications <= %.3g", most)},
                      absl::StrFormat("Factoring this mesh's matrix would take %.3g multiplications; the "
                                      "limit for %d vertices is %.3g. Use a mesh with "
                                      "fewer vertices, or one whose faces form a surface.",
                                      operations, shape->vertex_count(), most));
  }
  if (admit) {
    absl::Status status =
        admit(entry_count(*supernodes) * sizeof(float) + kBytesPerEntry * matrix.rows.size());
    if (!status.ok()) return status;
  }
  matrix = {};  // its memory is free for the factor
  return Metric(std::move(shape), *supernodes);
}

Metric::Metric(std::shared_ptr<const RestShape> shape, const SupernodePattern& supernodes)
    : shape_(std::move(shape)), single_(supernodes) {}

bool Metric::factor(const std::vector<double>& cell_weights, const std::vector<char>& is_held,
                    const std::vector<MatrixEntry>& entries, const Workers& workers, Precision precision) {
  const double largest = *std::max_element(cell_weights.begin(), cell_weights.end());
  if (!(largest > 0) || !std::isfinite(largest)) return is_good_ = false;
  std::vector<double> clipped(cell_weights.size());
  std::transform(cell_weights.begin(), cell_weights.end(), clipped.begin(),
                 [&](double weight) { return std::max(weight / largest, kLowestShare); });
  std::vector<MatrixEntry> scaled = entries;
  for (MatrixEntry& entry : scaled) entry.value /= largest;
  scale_ = largest;
  const bool is_same = is_good_ && is_held == is_held_ && clipped == cell_weights_ && scaled == entries_;
  if (is_same && precision == precision_) return true;  // a new factorisation would give the same
  if (!is_same) {
    cell_weights_ = std::move(clipped);
    is_held_ = is_held;
    entries_ = std::move(scaled);
    index_entries();
    matrix_.values.clear();
  }
  precision_ = precision;
  is_single_current_ = is_double_current_ = false;
  ++version_;
  if (precision == Precision::kSingle && single_.factor(Rows(*this), workers, most_raised_)) {
    double_.reset();  // takes several times the memory
    copy_ = {};
    matrix_ = {};
    return is_good_ = is_single_current_ = true;
  }
  return is_good_ = factor_double();
}

void Metric::release() {
  single_.free_values();
  double_.reset();
  copy_ = {};
  matrix_ = {};
  is_good_ = is_single_current_ = is_double_current_ = false;
}

bool Metric::factor_double() const {
  need_matrix();
  if (!double_) double_.emplace(matrix_, single_.result().new_to_old());
  copy_.clear();
  return is_double_current_ = double_->factor(matrix_);
}

/// Sorts entries_ by row, for Rows.
void Metric::index_entries() {
  by_row_.clear();
  for (const MatrixEntry& entry : entries_) {
    by_row_.push_back(entry);
    if (entry.row != entry.column) by_row_.push_back({entry.column, entry.row, entry.value});
  }
  std::stable_sort(by_row_.begin(), by_row_.end(),
                   [](const MatrixEntry& a, const MatrixEntry& b) { return a.row < b.row; });
}

void Metric::Rows::append_row(std::int32_t i, std::vector<Entry>& to) const {
  const Metric& metric = metric_;
  const RestShape& shape = *metric.shape_;
  if (metric.is_held_[i]) return void(to.push_back({i, 1}));
  const std::size_t own = to.size();
  const std::int32_t begin = shape.offsets()[i], end = shape.offsets()[i + 1];
  to.resize(own + 1 + static_cast<std::size_t>(end - begin));
  Entry* entry = to.data() + own;
  double diagonal = 0;
  for (std::int32_t k = begin; k < end; ++k) {
    const std::int32_t j = shape.neighbours()[k];
    const double weight = metric.edge_weight(i, k);
    diagonal += weight;
    *++entry = {j, metric.is_held_[j] ? 0.0 : -weight};
  }
  to[own] = {i, diagonal};
  if (metric.by_row_.empty()) return;
  auto added = std::lower_bound(metric.by_row_.begin(), metric.by_row_.end(), i,
                                [](const MatrixEntry& entry, std::int32_t row) { return entry.row < row; });
  for (; added != metric.by_row_.end() && added->row == i; ++added) {
    if (metric.is_held_[added->column]) continue;
    const auto is_there = [&](const Entry& entry) { return entry.column == added->column; };
    const auto found = std::find_if(to.begin() + static_cast<std::ptrdiff_t>(own), to.end(), is_there);
    if (found != to.end())
      found->value += added->value;
    else
      to[own].value += std::abs(added->value);
  }
}

/// Makes the matrix if there is none. It is freed after a factorisation in single precision. Refinement and a factor in double
/// precision need it.
void Metric::need_matrix() const {
  if (!matrix_.values.empty()) return;
  if (matrix_.columns.empty()) matrix_ = lower_pattern(*shape_);
  matrix_.values.reserve(matrix_.rows.size());
  const Rows rows(*this);
  std::vector<SymmetricRows::Entry> row;
  for (std::int32_t i = 0; i < matrix_.size(); ++i) {
    row.clear();
    rows.append_row(i, row);
    std::int32_t entry = matrix_.columns[i];
    matrix_.values.resize(static_cast<std::size_t>(matrix_.columns[i + 1]), 0.0);
    matrix_.values[entry] = row.front().value;
    for (const SymmetricRows::Entry& one : row) {
      if (one.column > i) matrix_.values[++entry] = one.value;
    }
  }
}

void Metric::adopt(const std::vector<double>& cell_weights) {
  const double present = std::accumulate(cell_weights_.begin(), cell_weights_.end(), 0.0);
  const double wanted = std::accumulate(cell_weights.begin(), cell_weights.end(), 0.0);
  if (wanted > 0 && std::isfinite(wanted)) scale_ = wanted / present;
}

void Metric::extend(const std::vector<char>& is_held, Points& u, const Workers& workers,
                    Points forces) const {
  Points b = std::move(forces);
  if (b.size() == 0) b.setZero(u.rows(), 3);
  for (std::int32_t j = 0; j < shape_->vertex_count(); ++j) {
    if (!is_held[j]) continue;
    b.row(j) = u.row(j);
    for (std::int32_t k = shape_->offsets()[j]; k < shape_->offsets()[j + 1]; ++k) {
      const std::int32_t i = shape_->neighbours()[k];
      if (!is_held[i]) b.row(i) += edge_weight(j, k) * u.row(j);
    }
  }
  solve_single(b, u, workers);
  for (std::int32_t i = 0; i < shape_->vertex_count(); ++i) {
    if (is_held[i]) u.row(i) = b.row(i);
  }
}

/// x = matrix_^-1 b, x not b, by refinement from single precision. False if that does not converge.
bool Metric::refine(const Points& b, Points& x, const Workers& workers) const {
  need_matrix();
  solve_single(b, x, workers);
  Points rest, correction;
  double before = x.norm();
  const double enough = kRefined * before;
  for (int pass = 0; pass < kPasses; ++pass) {
    rest = b;
    subtract_product(x, rest);
    solve_single(rest, correction, workers);
    const double size = correction.norm();
    if (!(size < kSlowest * before || size <= enough)) return false;
    x += correction;
    if (size <= enough) return true;
    before = size;
  }
  return false;
}

void Metric::solve_scaled(const Points& b, Points& x, const Workers& workers) const {
  if (!is_double_current_ && refine(b, x, workers)) return;
  if (!is_double_current_ && !factor_double()) {
    x.setConstant(b.rows(), 3, std::numeric_limits<double>::quiet_NaN());
    return;
  }
  ++back_substitutions_;
  double_->solve(b, x);
}

/// b -= matrix_ x.
void Metric::subtract_product(const Points& x, Points& b) const {
  for (std::int32_t j = 0; j < matrix_.size(); ++j) {
    for (std::int32_t entry = matrix_.columns[j]; entry < matrix_.columns[j + 1]; ++entry) {
      const std::int32_t i = matrix_.rows[entry];
      b.row(i) -= matrix_.values[entry] * x.row(j);
      if (i != j) b.row(j) -= matrix_.values[entry] * x.row(i);
    }
  }
}

const SingleFactor& Metric::single() const {
  if (is_single_current_) return single_.result();
  LPDEFORM_CHECK(double_);  // not after release()
  if (copy_.empty()) double_->copy_to(copy_);
  return copy_;
}

void Metric::solve(const Points& b, Points& x, const Workers& workers) const {
  if (&b == &x) return solve(Points(b), x, workers);
  solve_scaled(b, x, workers);
  x /= scale_;
}

void Metric::precondition(const Points& b, Points& x, const Workers& workers) const {
  solve_single(b, x, workers, 1 / scale_);
}

void Metric::precondition(const Points& b, SinglePoints& x, const Workers& workers) const {
  solve_single(b, x, workers, 1 / scale_);
}

std::size_t Metric::memory_bytes() const {
  return single_.memory_bytes() + (double_ ? double_->memory_bytes() : 0) + copy_.memory_bytes() +
         cell_weights_.capacity() * sizeof(double) + is_held_.capacity() +
         (entries_.capacity() + by_row_.capacity()) * sizeof(MatrixEntry) +
         matrix_.columns.capacity() * sizeof(std::int32_t) + matrix_.rows.capacity() * sizeof(std::int32_t) +
         matrix_.values.capacity() * sizeof(double);
}

}  // namespace lpdeform
