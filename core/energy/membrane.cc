#include "core/energy/membrane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 1024;  // faces

}  // namespace

Membrane::Membrane(std::shared_ptr<const RestShape> shape, const Workers& workers)
    : shape_(std::move(shape)),
      faces_(static_cast<std::size_t>(shape_->face_count())),
      squared_(faces_.size(), 0.0),
      derivatives_(faces_.size()) {
  const Faces& faces = shape_->faces();
  const Points& rest = shape_->scaled_positions();
  workers.for_chunks(faces_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto row = static_cast<Eigen::Index>(t);
      const Eigen::RowVector3d u = rest.row(faces(row, 1)) - rest.row(faces(row, 0)),
                               v = rest.row(faces(row, 2)) - rest.row(faces(row, 0));
      const double length = u.norm(), twice = u.cross(v).norm();
      if (!(twice > 1e-8 * u.norm() * v.norm()) || length == 0) {
        faces_[t] = {};
        continue;
      }
      const double along = u.dot(v) / length, height = twice / length;
      faces_[t] = {{1 / length, -along / (length * height), 1 / height}, twice / 2};
    }
  });
  offsets_.assign(static_cast<std::size_t>(shape_->vertex_count()) + 1, 0);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) ++offsets_[faces(t, c) + 1];
  }
  for (std::size_t i = 1; i < offsets_.size(); ++i) offsets_[i] += offsets_[i - 1];
  corners_.resize(3 * faces_.size());
  std::vector<std::int32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (Eigen::Index t = 0; t < faces.rows(); ++t) {
    for (int c = 0; c < 3; ++c) corners_[next[faces(t, c)]++] = static_cast<std::int32_t>(3 * t + c);
  }
}

void Membrane::evaluate(const Points& x, const Workers& workers) {
  workers.for_chunks(faces_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) evaluate(x, t);
  });
}

void Membrane::evaluate(const Points& x, std::size_t t) {
  const auto row = static_cast<Eigen::Index>(t);
  const Faces& faces = shape_->faces();
  const Face& face = faces_[t];
  const Eigen::RowVector3d a = x.row(faces(row, 0));
  const Eigen::RowVector3d u = x.row(faces(row, 1)) - a, v = x.row(faces(row, 2)) - a;
  const Eigen::RowVector3d f = u * face.inverse[0], g = u * face.inverse[1] + v * face.inverse[2];
  const Eigen::RowVector3d n = f.cross(g);
  const double j = n.norm(), norm2 = f.squaredNorm() + g.squaredNorm();
  const double sum = std::sqrt(norm2 + 2 * j);  // of the singular values
  squared_[t] = std::max(0.0, 2 * face.area * (norm2 + 2 - 2 * sum));
  const double over = sum > 0 ? 1 / sum : 0, k = j > 0 ? over / j : 0;
  const Eigen::RowVector3d by_f = 4 * face.area * (f - f * over - k * g.cross(n)),
                           by_g = 4 * face.area * (g - g * over - k * n.cross(f));
  const Eigen::RowVector3d by_u = by_f * face.inverse[0] + by_g * face.inverse[1],
                           by_v = by_g * face.inverse[2];
  Derivative& d = derivatives_[t];
  for (int e = 0; e < 3; ++e) d.of[0][e] = by_u[e], d.of[1][e] = by_v[e];
}

double Membrane::share(std::int32_t i) const {
  double sum = 0;
  for (std::int32_t k = offsets_[i]; k < offsets_[i + 1]; ++k) sum += squared_[corners_[k] / 3];
  return sum / 3;
}

void Membrane::add_gradient(double factor, const std::vector<double>& c, std::size_t begin, std::size_t end,
                            Points& result) const {
  const Faces& faces = shape_->faces();
  for (std::size_t i = begin; i < end; ++i) {
    double sum[3] = {0, 0, 0};
    for (std::int32_t k = offsets_[i]; k < offsets_[i + 1]; ++k) {
      const std::int32_t t = corners_[k] / 3, corner = corners_[k] % 3;
      const double weight = c[faces(t, 0)] + c[faces(t, 1)] + c[faces(t, 2)];
      const Derivative& d = derivatives_[t];
      for (int e = 0; e < 3; ++e)
        sum[e] += weight * (corner == 0 ? -d.of[0][e] - d.of[1][e] : d.of[corner - 1][e]);
    }
    for (int e = 0; e < 3; ++e) result(static_cast<Eigen::Index>(i), e) += factor / 3 * sum[e];
  }
}

std::size_t Membrane::memory_bytes() const {
  return faces_.capacity() * sizeof(Face) + squared_.capacity() * sizeof(double) +
         derivatives_.capacity() * sizeof(Derivative) +
         (offsets_.capacity() + corners_.capacity()) * sizeof(std::int32_t);
}

}  // namespace lpdeform
