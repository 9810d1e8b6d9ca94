#include "core/energy/membrane.h"

#include <Eigen/Geometry>
#include <utility>

#include "core/energy/cell_kernel.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 1024;  // faces or vertices

/// The faces at marked vertices.
std::optional<Faces> faces_at(const Faces& all, const std::vector<char>& cells) {
  if (cells.empty()) return std::nullopt;
  std::vector<Eigen::Index> found;
  for (Eigen::Index t = 0; t < all.rows(); ++t) {
    if (cells[all(t, 0)] != 0 || cells[all(t, 1)] != 0 || cells[all(t, 2)] != 0) found.push_back(t);
  }
  Faces result(static_cast<Eigen::Index>(found.size()), 3);
  for (std::size_t k = 0; k < found.size(); ++k) result.row(static_cast<Eigen::Index>(k)) = all.row(found[k]);
  return result;
}

}  // namespace

Membrane::Membrane(std::shared_ptr<const RestShape> shape, const Workers& workers,
                   const std::vector<char>& cells)
    : shape_(std::move(shape)),
      some_(faces_at(shape_->faces(), cells)),
      faces_(static_cast<std::size_t>(corners().rows())),
      weights_(static_cast<std::size_t>(corners().rows())) {
  const Faces& faces = corners();
  const Points& rest = shape_->scaled_positions();
  const auto count = static_cast<std::size_t>(faces.rows());
  workers.for_chunks(count, kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto row = static_cast<Eigen::Index>(t);
      const Eigen::RowVector3d u = rest.row(faces(row, 1)) - rest.row(faces(row, 0)),
                               v = rest.row(faces(row, 2)) - rest.row(faces(row, 0));
      const double length = u.norm(), twice = u.cross(v).norm();
      if (!(twice > 1e-8 * u.norm() * v.norm()) || length == 0) continue;  // stays without area
      const double along = u.dot(v) / length, height = twice / length;
      faces_.inverse[0][t] = 1 / length;
      faces_.inverse[1][t] = -along / (length * height);
      faces_.inverse[2][t] = 1 / height;
      faces_.area[t] = twice / 2;
    }
  });
  offsets_.assign(static_cast<std::size_t>(shape_->vertex_count()) + 1, 0);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) ++offsets_[faces(t, c) + 1];
  }
  for (std::size_t i = 1; i < offsets_.size(); ++i) offsets_[i] += offsets_[i - 1];
  places_.resize(3 * count);
  std::vector<std::int32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) places_[next[faces(t, c)]++] = static_cast<std::int32_t>(3 * t + c);
  }
}

void Membrane::evaluate(const double* rows, const Workers& workers) {
  workers.for_chunks(static_cast<std::size_t>(corners().rows()), kChunk,
                     [&](std::size_t, std::size_t begin, std::size_t end) {
                       evaluate_faces(corners(), begin, end, rows, faces_);
                     });
}

double Membrane::share(std::int32_t i) const {
  double sum = 0;
  for (std::int32_t k = offsets_[i]; k < offsets_[i + 1]; ++k) sum += faces_.squared[places_[k] / 3];
  return sum / 3;
}

void Membrane::add_gradient(const std::vector<double>& c, const Workers& workers, Points& result) const {
  using Row = double __attribute__((vector_size(kRow * sizeof(double))));
  using SingleRow = float __attribute__((vector_size(kRow * sizeof(float)), aligned(sizeof(float))));
  const Faces& faces = corners();
  workers.for_chunks(weights_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto row = static_cast<Eigen::Index>(t);
      weights_[t] = (c[faces(row, 0)] + c[faces(row, 1)] + c[faces(row, 2)]) / 3;
    }
  });
  const auto derivative = [&](std::size_t t, std::size_t corner) -> const SingleRow& {
    return *reinterpret_cast<const SingleRow*>(faces_.derivatives.data() +
                                               MembraneFaces::place_of_derivative(t, corner));
  };
  workers.for_chunks(c.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Row sum{};
      for (std::int32_t k = offsets_[i]; k < offsets_[i + 1]; ++k) {
        const auto t = static_cast<std::size_t>(places_[k] / 3);
        const std::int32_t corner = places_[k] % 3;
        const SingleRow own = corner == 0 ? -derivative(t, 0) - derivative(t, 1) : derivative(t, corner - 1);
        sum += weights_[t] * __builtin_convertvector(own, Row);
      }
      for (int e = 0; e < 3; ++e) result(static_cast<Eigen::Index>(i), e) += sum[e];
    }
  });
}

std::size_t Membrane::memory_bytes() const {
  return faces_.memory_bytes() + weights_.capacity() * sizeof(double) +
         (offsets_.capacity() + places_.capacity()) * sizeof(std::int32_t) +
         (some_ ? some_->size() * sizeof(std::int32_t) : 0);
}

}  // namespace lpdeform
