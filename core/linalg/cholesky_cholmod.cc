#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/linalg/cholesky.h"

namespace lpdeform {
namespace {

// From this many floating-point operations per entry of the factor on, dense kernels are faster than single columns:
// meshes of about 40,000 vertices.
constexpr double kSupernodalSwitch = 110;

/// Keeps the dense kernels of the supernodal factorisation from starting threads of their own. This gives the same bits
/// at any machine load, and sessions do not compete for cores. Among Debian's BLAS packages, only OpenBLAS has such
/// threads.
void pin_blas_to_one_thread() {
  static std::once_flag once;
  std::call_once(once, [] {
    using SetThreads = void (*)(int);
    if (auto* set = reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))) set(1);
  });
}

/// CHOLMOD's own loops ask OpenMP for four threads, however many threads we use. While an object of this class exists,
/// they run on the calling thread alone, which is nearly as fast.
class WithoutOpenMp {
 public:
  WithoutOpenMp() {
    if (set() == nullptr || get() == nullptr) return;
    levels_ = get()();
    set()(0);
  }
  ~WithoutOpenMp() {
    if (levels_ >= 0) set()(levels_);
  }
  WithoutOpenMp(const WithoutOpenMp&) = delete;
  WithoutOpenMp& operator=(const WithoutOpenMp&) = delete;

 private:
  using Set = void (*)(int);
  using Get = int (*)();
  static Set set() {
    static const auto function = reinterpret_cast<Set>(dlsym(RTLD_DEFAULT, "omp_set_max_active_levels"));
    return function;
  }
  static Get get() {
    static const auto function = reinterpret_cast<Get>(dlsym(RTLD_DEFAULT, "omp_get_max_active_levels"));
    return function;
  }

  int levels_ = -1;
};

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

/// CHOLMOD also makes an L D L^T factor of an indefinite matrix. Such a factor holds D in place of the unit diagonal of
/// L. CHOLMOD itself checks L L^T factors.
bool has_positive_diagonal(const cholmod_factor& factor) {
  if (factor.is_ll || factor.is_super) return true;
  const auto* columns = static_cast<const std::int32_t*>(factor.p);
  const auto* values = static_cast<const double*>(factor.x);
  return std::all_of(columns, columns + factor.n, [&](std::int32_t begin) { return values[begin] > 0; });
}

/// Copies a supernodal factor. CHOLMOD stores supernodes as column-major blocks that begin with their triangle.
void copy_supernodal(const cholmod_factor& factor, SingleFactor& out) {
  const auto* const first_columns = static_cast<const std::int32_t*>(factor.super);
  const auto* const first_rows = static_cast<const std::int32_t*>(factor.pi);
  const auto* const first_values = static_cast<const std::int32_t*>(factor.px);
  const auto* const rows = static_cast<const std::int32_t*>(factor.s);
  const auto* const values = static_cast<const double*>(factor.x);
  out.begin(static_cast<const std::int32_t*>(factor.Perm), factor.n, factor.xsize);
  for (std::size_t k = 0; k < factor.nsuper; ++k) {
    const std::int32_t columns = first_columns[k + 1] - first_columns[k];
    const auto height = static_cast<std::size_t>(first_rows[k + 1] - first_rows[k]);
    const double* const block = values + first_values[k];
    out.add_supernode(columns, rows + first_rows[k] + columns, height - static_cast<std::size_t>(columns),
                      [&](std::size_t r, std::size_t c) { return block[c * height + r]; });
  }
}

/// Copies a simplicial factor, L D L^T or L L^T. Each column begins with its diagonal entry, rows ascending. Adjacent
/// columns with the same pattern become one supernode.
void copy_simplicial(const cholmod_factor& factor, SingleFactor& out) {
  const auto* const begins = static_cast<const std::int32_t*>(factor.p);
  const auto* const counts = static_cast<const std::int32_t*>(factor.nz);
  const auto* const rows = static_cast<const std::int32_t*>(factor.i);
  const auto* const values = static_cast<const double*>(factor.x);
  out.begin(static_cast<const std::int32_t*>(factor.Perm), factor.n, factor.nzmax);
  for (std::size_t first = 0, last = 0; first < factor.n; first = last + 1) {
    last = first;
    const auto is_same_pattern = [&](std::size_t j) {
      return counts[j] == counts[j + 1] + 1 && rows[begins[j] + 1] == static_cast<std::int32_t>(j + 1);
    };
    while (last + 1 < factor.n && is_same_pattern(last)) ++last;
    out.add_supernode(static_cast<std::int32_t>(last - first + 1), rows + begins[last] + 1,
                      static_cast<std::size_t>(counts[last] - 1), [&](std::size_t r, std::size_t c) {
                        const double* const column = values + begins[first + c];
                        if (factor.is_ll) return column[r - c];
                        const double root = std::sqrt(column[0]);
                        return r == c ? root : root * column[r - c];
                      });
  }
}

/// CHOLMOD's settings and workspace, and one factor.
struct Cholmod {
  Cholmod() {
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.nmethods = 1;  // one ordering: below a million vertices, trying METIS costs more than it saves
    common.method[0].ordering = CHOLMOD_AMD;
    common.postorder = 1;
    common.supernodal_switch = kSupernodalSwitch;
  }
  ~Cholmod() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  /// Analyses in the given order or, if null, one that CHOLMOD finds. False if the factor is too large to be counted or
  /// stored.
  [[nodiscard]] bool analyse(const LowerMatrix& pattern, const std::int32_t* new_to_old) {
    cholmod_sparse view = view_of(pattern);
    view.xtype = CHOLMOD_PATTERN;
    if (new_to_old == nullptr) {
      factor = cholmod_analyze(&view, &common);
    } else {
      common.method[0].ordering = CHOLMOD_GIVEN;
      factor = cholmod_analyze_p(&view, const_cast<std::int32_t*>(new_to_old), nullptr, 0, &common);
    }
    return factor != nullptr;
  }

  cholmod_common common;
  cholmod_factor* factor = nullptr;
};

}  // namespace

absl::StatusOr<SupernodePattern> analyse_supernodes(const LowerMatrix& pattern, std::size_t most) {
  Cholmod cholmod;
  cholmod.common.supernodal = CHOLMOD_SUPERNODAL;
  const bool is_counted = cholmod.analyse(pattern, nullptr);
  if (!is_counted || cholmod.factor->xsize > most) {
    return make_fault(
        {Reason::kFactorTooLarge, "mesh", absl::StrCat("entries <= ", most)},
        absl::StrCat("The factorisation of this mesh would have more than ", most,
                     " entries. Use a mesh with fewer vertices, or one whose faces form a surface."));
  }
  const cholmod_factor& factor = *cholmod.factor;
  const auto* const order = static_cast<const std::int32_t*>(factor.Perm);
  const auto* const first_columns = static_cast<const std::int32_t*>(factor.super);
  const auto* const first_rows = static_cast<const std::int32_t*>(factor.pi);
  const auto* const rows = static_cast<const std::int32_t*>(factor.s);
  SupernodePattern result;
  result.new_to_old.assign(order, order + factor.n);
  result.first_columns.assign(first_columns, first_columns + factor.nsuper + 1);
  result.first_rows.reserve(factor.nsuper + 1);
  result.rows.reserve(factor.ssize);
  for (std::size_t k = 0; k < factor.nsuper; ++k) {
    result.first_rows.push_back(result.rows.size());
    const std::int32_t columns = first_columns[k + 1] - first_columns[k];
    result.rows.insert(result.rows.end(), rows + first_rows[k] + columns, rows + first_rows[k + 1]);
  }
  result.first_rows.push_back(result.rows.size());
  return result;
}

struct SparseCholesky::Impl : Cholmod {
  Impl() { pin_blas_to_one_thread(); }
  ~Impl() {
    cholmod_free_dense(&x, &common);
    cholmod_free_dense(&y, &common);
    cholmod_free_dense(&e, &common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

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

  cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;  // workspace of solve, kept between calls
  Eigen::MatrixXd columns;                                 // three right-hand sides, column-major
};

SparseCholesky::SparseCholesky(const LowerMatrix& pattern) : impl_(std::make_unique<Impl>()) {
  LPDEFORM_CHECK(impl_->analyse(pattern, nullptr));
}
SparseCholesky::SparseCholesky(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old)
    : impl_(std::make_unique<Impl>()) {
  LPDEFORM_CHECK(new_to_old.size() == static_cast<std::size_t>(pattern.size()));
  LPDEFORM_CHECK(impl_->analyse(pattern, new_to_old.data()));
}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::factor(const LowerMatrix& matrix) {
  const bool is_finite =
      std::all_of(matrix.values.begin(), matrix.values.end(), [](double v) { return std::isfinite(v); });
  if (!is_finite) return false;
  cholmod_sparse view = view_of(matrix);
  const WithoutOpenMp alone;
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

void SparseCholesky::copy_to(SingleFactor& out) const {
  const cholmod_factor& factor = *impl_->factor;
  if (factor.is_super)
    copy_supernodal(factor, out);
  else
    copy_simplicial(factor, out);
  out.finish();
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
