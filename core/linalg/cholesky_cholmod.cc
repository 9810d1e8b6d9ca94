#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/base/check.h"
#include "core/linalg/cholesky.h"

namespace lpdeform {
namespace {

/// Dense kernels in the supernodal factorisation must not start threads of their own: the same bits on any
/// machine load, and sessions do not compete. Only OpenBLAS has such threads among Debian's BLAS packages.
void pin_blas_to_one_thread() {
  static std::once_flag once;
  std::call_once(once, [] {
    using SetThreads = void (*)(int);
    if (auto* set = reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))) set(1);
  });
}

/// A cholmod view of our arrays; nothing is copied or owned.
cholmod_sparse view_of(const LowerMatrix& matrix) {
  cholmod_sparse view{};
  view.nrow = view.ncol = matrix.size();
  view.nzmax = matrix.rows.size();
  view.p = const_cast<std::int32_t*>(matrix.columns.data());
  view.i = const_cast<std::int32_t*>(matrix.rows.data());
  view.x = const_cast<double*>(matrix.values.data());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = matrix.values.empty() ? CHOLMOD_PATTERN : CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

/// An L D L^T factor, which CHOLMOD also makes of an indefinite matrix, holds D where L has its ones. L L^T
/// is checked by CHOLMOD.
bool has_positive_diagonal(const cholmod_factor& factor) {
  if (factor.is_ll || factor.is_super) return true;
  const auto* columns = static_cast<const std::int32_t*>(factor.p);
  const auto* values = static_cast<const double*>(factor.x);
  return std::all_of(columns, columns + factor.n, [&](std::int32_t begin) { return values[begin] > 0; });
}

}  // namespace

struct SparseCholesky::Impl {
  Impl() {
    pin_blas_to_one_thread();
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.nmethods = 1;  // one ordering: METIS tries cost more than they save below a million vertices
    common.method[0].ordering = CHOLMOD_AMD;
    common.postorder = 1;
    common.supernodal_switch = 40;
  }
  ~Impl() {
    cholmod_free_dense(&x, &common);
    cholmod_free_dense(&y, &common);
    cholmod_free_dense(&e, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }

  /// `columns` right-hand sides, column-major.
  void solve(const double* b, double* result, int columns) {
    const std::size_t n = factor->n;
    cholmod_dense view{};
    view.nrow = view.d = n;
    view.ncol = columns;
    view.nzmax = n * columns;
    view.x = const_cast<double*>(b);
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    const int ok = cholmod_solve2(CHOLMOD_A, factor, &view, nullptr, &x, nullptr, &y, &e, &common);
    LPDEFORM_CHECK(ok);
    std::copy_n(static_cast<const double*>(x->x), n * columns, result);
  }

  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;  // workspace of solve, kept between calls
  Eigen::MatrixXd columns;                                 // three right-hand sides, column-major
};

SparseCholesky::SparseCholesky(const LowerMatrix& pattern) : impl_(std::make_unique<Impl>()) {
  cholmod_sparse view = view_of(pattern);
  view.xtype = CHOLMOD_PATTERN;
  impl_->factor = cholmod_analyze(&view, &impl_->common);
  LPDEFORM_CHECK(impl_->factor != nullptr);
}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::factor(const LowerMatrix& matrix) {
  const bool is_finite =
      std::all_of(matrix.values.begin(), matrix.values.end(), [](double v) { return std::isfinite(v); });
  if (!is_finite) return false;
  cholmod_sparse view = view_of(matrix);
  const int ok = cholmod_factorize(&view, impl_->factor, &impl_->common);
  return ok && impl_->common.status == CHOLMOD_OK && impl_->factor->minor == impl_->factor->n &&
         has_positive_diagonal(*impl_->factor);
}

void SparseCholesky::solve(const Points& b, Points& x) const {
  impl_->columns = b;
  x.resize(b.rows(), 3);
  impl_->solve(impl_->columns.data(), impl_->columns.data(), 3);
  x = impl_->columns;
}

void SparseCholesky::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const {
  x.resize(b.size());
  impl_->solve(b.data(), x.data(), 1);
}

std::size_t SparseCholesky::memory_bytes() const {
  return impl_->common.memory_inuse + impl_->columns.size() * sizeof(double);
}

#define LPDEFORM_TEXT(x) #x
#define LPDEFORM_VERSION_TEXT(a, b, c) LPDEFORM_TEXT(a) "." LPDEFORM_TEXT(b) "." LPDEFORM_TEXT(c)
const char* cholesky_backend() {
  return "CHOLMOD " LPDEFORM_VERSION_TEXT(CHOLMOD_MAIN_VERSION, CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION);
}

}  // namespace lpdeform
