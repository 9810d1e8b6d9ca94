#include "core/energy/membrane.h"

#include <Eigen/Geometry>
#include <utility>

#include "core/energy/cell_kernel.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 1024;  // faces or vertices
constexpr std::size_t kLanes = MembraneFaces::kLanes;

/// The face of a row of MembraneFaces::derivatives.
std::size_t face_of(std::size_t row) {
  return row / (2 * kLanes) * kLanes + row % kLanes;
}

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
  const auto part = [&](Eigen::Index t, int c) {
    return 2 * static_cast<std::size_t>(faces(t, c)) + (c == 0 ? 0 : 1);
  };
  offsets_.assign(2 * static_cast<std::size_t>(shape_->vertex_count()) + 1, 0);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) ++offsets_[part(t, c) + 1];
  }
  for (std::size_t i = 1; i < offsets_.size(); ++i) offsets_[i] += offsets_[i - 1];
  rows_.resize(3 * count);
  std::vector<std::int32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const std::size_t row = MembraneFaces::row_of_derivative(static_cast<std::size_t>(t), c == 2 ? 1 : 0);
      rows_[next[part(t, c)]++] = static_cast<std::int32_t>(row);
    }
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
  for (std::int32_t k = offsets_[2 * i]; k < offsets_[2 * i + 2]; ++k)
    sum += faces_.squared[face_of(rows_[k])];
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
  const auto* const derivatives = reinterpret_cast<const SingleRow*>(faces_.derivatives.data());
  workers.for_chunks(c.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t begin_of_own = offsets_[2 * i + 1], end_of_own = offsets_[2 * i + 2];
      Row sum{};
      for (std::int32_t k = offsets_[2 * i]; k < begin_of_own; ++k) {
        const auto row = static_cast<std::size_t>(rows_[k]);
        const SingleRow of_others = derivatives[row] + derivatives[row + kLanes];  // minus the first corner's
        sum -= weights_[face_of(row)] * __builtin_convertvector(of_others, Row);
      }
      for (std::int32_t k = begin_of_own; k < end_of_own; ++k) {
        const auto row = static_cast<std::size_t>(rows_[k]);
        sum += weights_[face_of(row)] * __builtin_convertvector(derivatives[row], Row);
      }
      for (int e = 0; e < 3; ++e) result(static_cast<Eigen::Index>(i), e) += sum[e];
    }
  });
}

std::size_t Membrane::memory_bytes() const {
  return faces_.memory_bytes() + weights_.capacity() * sizeof(double) +
         (offsets_.capacity() + rows_.capacity()) * sizeof(std::int32_t) +
         (some_ ? some_->size() * sizeof(std::int32_t) : 0);
}

}  // namespace lpdeform
