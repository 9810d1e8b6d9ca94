#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/linalg/cholesky.h"
#include "core/linalg/supernodes.h"

namespace lpdeform {
namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;
using Factor = Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<std::int32_t>>;

/// Where the entries of a matrix stand when its columns are in a new order.
struct Reordering {
  Reordering(const LowerMatrix& pattern, std::vector<std::int32_t> order)
      : new_to_old(std::move(order)), matrix(pattern.size(), pattern.size()), places(pattern.rows.size()) {
    const std::int32_t n = pattern.size();
    std::vector<std::int32_t> old_to_new(n);
    for (std::int32_t i = 0; i < n; ++i) old_to_new[new_to_old[i]] = i;
    std::vector<Eigen::Triplet<double, std::int32_t>> entries;
    entries.reserve(pattern.rows.size());
    const auto for_entries = [&](const auto& body) {
      for (std::int32_t j = 0; j < n; ++j) {
        for (std::int32_t e = pattern.columns[j]; e < pattern.columns[j + 1]; ++e) {
          const std::int32_t a = old_to_new[j], b = old_to_new[pattern.rows[e]];
          body(e, std::max(a, b), std::min(a, b));
        }
      }
    };
    for_entries(
        [&](std::int32_t, std::int32_t row, std::int32_t column) { entries.emplace_back(row, column, 1.0); });
    matrix.setFromTriplets(entries.begin(), entries.end());
    for_entries([&](std::int32_t e, std::int32_t row, std::int32_t column) {
      places[e] = &matrix.coeffRef(row, column) - matrix.valuePtr();
    });
  }

  std::vector<std::int32_t> new_to_old;
  Sparse matrix;                       // in the new order, lower triangle
  std::vector<std::ptrdiff_t> places;  // of each entry of the given matrix
};

}  // namespace

struct SparseCholesky::Impl {
  Impl(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old) : order(pattern, new_to_old) {
    factor.analyzePattern(order.matrix);
  }

  template <typename Columns>
  void solve(const Columns& b, Columns& x) const {
    const auto n = static_cast<Eigen::Index>(order.new_to_old.size());
    Eigen::Matrix<double, Eigen::Dynamic, Columns::ColsAtCompileTime> moved(n, b.cols());
    for (Eigen::Index i = 0; i < n; ++i) moved.row(i) = b.row(order.new_to_old[i]);
    moved = factor.solve(moved).eval();
    x.resize(n, b.cols());
    for (Eigen::Index i = 0; i < n; ++i) x.row(order.new_to_old[i]) = moved.row(i);
  }

  Reordering order;
  Factor factor;
  std::size_t nonzeros = 0;
};

SparseCholesky::SparseCholesky(const LowerMatrix& pattern)
    : SparseCholesky(pattern, eliminate(pattern).new_to_old) {}
SparseCholesky::SparseCholesky(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old)
    : impl_(std::make_unique<Impl>(pattern, new_to_old)) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::factor(const LowerMatrix& matrix) {
  const bool is_finite =
      std::all_of(matrix.values.begin(), matrix.values.end(), [](double v) { return std::isfinite(v); });
  if (!is_finite) return false;
  double* const values = impl_->order.matrix.valuePtr();
  for (std::size_t e = 0; e < matrix.values.size(); ++e) values[impl_->order.places[e]] = matrix.values[e];
  impl_->factor.factorize(impl_->order.matrix);
  if (impl_->factor.info() != Eigen::Success) return false;
  impl_->nonzeros = impl_->factor.matrixL().nestedExpression().nonZeros();
  return (impl_->factor.vectorD().array() > 0).all();
}

void SparseCholesky::solve(const Points& b, Points& x) const {
  impl_->solve(b, x);
}

void SparseCholesky::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const {
  impl_->solve(b, x);
}

void SparseCholesky::copy_to(SingleFactor& out) const {
  const Factor& factor = impl_->factor;
  const auto& l = factor.matrixL().nestedExpression();  // without its diagonal of ones
  const Eigen::VectorXd d = factor.vectorD();
  out.begin(impl_->order.new_to_old.data(), static_cast<std::size_t>(l.cols()),
            static_cast<std::size_t>(l.nonZeros() + l.cols()));
  for (Eigen::Index j = 0; j < l.cols(); ++j) {
    const std::int32_t begin = l.outerIndexPtr()[j], end = l.outerIndexPtr()[j + 1];
    const double root = std::sqrt(d[j]);
    out.add_supernode(1, l.innerIndexPtr() + begin, static_cast<std::size_t>(end - begin),
                      [&](std::size_t r, std::size_t) {
                        return r == 0 ? root : root * l.valuePtr()[begin + static_cast<std::int32_t>(r) - 1];
                      });
  }
  out.finish();
}

std::size_t SparseCholesky::memory_bytes() const {
  return impl_->nonzeros * (sizeof(double) + sizeof(std::int32_t)) +
         impl_->order.places.size() * (sizeof(double) + sizeof(std::int32_t) + sizeof(std::ptrdiff_t)) +
         impl_->factor.cols() * (sizeof(double) + 5 * sizeof(std::int32_t));
}

const char* cholesky_backend() {
  static const std::string name = "Eigen " + std::to_string(EIGEN_WORLD_VERSION) + "." +
                                  std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                  std::to_string(EIGEN_MINOR_VERSION);
  return name.c_str();
}

}  // namespace lpdeform
