#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/linalg/cholesky.h"

namespace lpdeform {
namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t>;
using Factor = Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<std::int32_t>>;

Eigen::Map<const Sparse> view_of(const LowerMatrix& matrix, const double* values) {
  return {matrix.size(),         matrix.size(),      static_cast<Eigen::Index>(matrix.rows.size()),
          matrix.columns.data(), matrix.rows.data(), values};
}

}  // namespace

absl::StatusOr<std::optional<SupernodePattern>> analyse_supernodes(const LowerMatrix&, std::size_t) {
  return std::nullopt;
}

struct SparseCholesky::Impl {
  Factor factor;
  std::size_t nonzeros = 0;
};

SparseCholesky::SparseCholesky(const LowerMatrix& pattern) : impl_(std::make_unique<Impl>()) {
  const std::vector<double> ones(pattern.rows.size(), 1.0);
  impl_->factor.analyzePattern(view_of(pattern, ones.data()));
}
SparseCholesky::SparseCholesky(const LowerMatrix& pattern, const std::vector<std::int32_t>&)
    : SparseCholesky(pattern) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::factor(const LowerMatrix& matrix) {
  const bool is_finite =
      std::all_of(matrix.values.begin(), matrix.values.end(), [](double v) { return std::isfinite(v); });
  if (!is_finite) return false;
  impl_->factor.factorize(view_of(matrix, matrix.values.data()));
  if (impl_->factor.info() != Eigen::Success) return false;
  impl_->nonzeros = impl_->factor.matrixL().nestedExpression().nonZeros();
  return (impl_->factor.vectorD().array() > 0).all();
}

void SparseCholesky::solve(const Points& b, Points& x) const {
  x = impl_->factor.solve(b).eval();
}

void SparseCholesky::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const {
  x = impl_->factor.solve(b).eval();
}

void SparseCholesky::copy_to(SingleFactor& out) const {
  const Factor& factor = impl_->factor;
  const auto& l = factor.matrixL().nestedExpression();  // without its diagonal of ones
  const Eigen::VectorXd d = factor.vectorD();
  out.begin(factor.permutationPinv().indices().data(), static_cast<std::size_t>(l.cols()),
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
         impl_->factor.cols() * (sizeof(double) + 4 * sizeof(std::int32_t));
}

const char* cholesky_backend() {
  static const std::string name = "Eigen " + std::to_string(EIGEN_WORLD_VERSION) + "." +
                                  std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                  std::to_string(EIGEN_MINOR_VERSION);
  return name.c_str();
}

}  // namespace lpdeform
