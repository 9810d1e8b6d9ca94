#include "core/energy/cell_pass.h"

#include <numeric>

#include "core/energy/rotation_fit.h"

namespace lpdeform {
namespace {

Eigen::Vector3d edge(const Points& points, std::int32_t i, std::int32_t j) {
  return points.row(i) - points.row(j);
}

/// B of fit_rotation: sum_j w_ij (x_i - x_j) (p_i - p_j)^T.
Eigen::Matrix3d covariance(const RestShape& shape, const Points& x, std::int32_t i) {
  const Points& rest = shape.scaled_positions();
  Eigen::Matrix3d b = Eigen::Matrix3d::Zero();
  for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
    const std::int32_t j = shape.neighbours()[k];
    b.noalias() += (shape.weights()[k] * edge(x, i, j)) * edge(rest, i, j).transpose();
  }
  return b;
}

/// E_i^2 for a given rotation, as a sum of squares: no cancellation where it is small.
double squared_energy(const RestShape& shape, const Points& x, std::int32_t i,
                      const Eigen::Matrix3d& rotation) {
  const Points& rest = shape.scaled_positions();
  double sum = 0;
  for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
    const std::int32_t j = shape.neighbours()[k];
    sum += shape.weights()[k] * (edge(x, i, j) - rotation * edge(rest, i, j)).squaredNorm();
  }
  return sum;
}

}  // namespace

CellPass::CellPass(std::shared_ptr<const RestShape> shape, Workers workers)
    : shape_(std::move(shape)),
      workers_(std::move(workers)),
      rotations_(shape_->vertex_count(), Eigen::Matrix3d::Identity()),
      e2_(shape_->vertex_count(), 0.0),
      c_(shape_->vertex_count(), 0.0),
      chunk_sums_((shape_->vertex_count() + kChunk - 1) / kChunk) {}

double CellPass::evaluate(const Points& x, const LpNorm& norm) {
  return evaluate_cells(x, norm, true);
}

double CellPass::evaluate_held(const Points& x, const LpNorm& norm) {
  return evaluate_cells(x, norm, false);
}

double CellPass::evaluate_cells(const Points& x, const LpNorm& norm, bool fit) {
  workers_.for_chunks(e2_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto vertex = static_cast<std::int32_t>(i);
      if (fit) rotations_[i] = fit_rotation(covariance(*shape_, x, vertex));
      e2_[i] = squared_energy(*shape_, x, vertex, rotations_[i]);
    }
  });
  return reweigh(norm);
}

double CellPass::reweigh(const LpNorm& norm) {
  workers_.for_chunks(e2_.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const LpNorm::Term term = norm.term(static_cast<std::int32_t>(i), e2_[i]);
      c_[i] = term.weight;
      sum += term.value;
    }
    chunk_sums_[chunk] = sum;
  });
  return std::accumulate(chunk_sums_.begin(), chunk_sums_.end(), 0.0);
}

double CellPass::sum(const LpNorm& norm) const {
  workers_.for_chunks(e2_.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += norm.term(static_cast<std::int32_t>(i), e2_[i]).value;
    chunk_sums_[chunk] = sum;
  });
  return std::accumulate(chunk_sums_.begin(), chunk_sums_.end(), 0.0);
}

void CellPass::gradient(const Points& x, Points& result) const {
  result.resize(x.rows(), 3);
  const Points& rest = shape_->scaled_positions();
  workers_.for_chunks(e2_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto vertex = static_cast<std::int32_t>(i);
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::int32_t k = shape_->offsets()[i]; k < shape_->offsets()[i + 1]; ++k) {
        const std::int32_t j = shape_->neighbours()[k];
        const Eigen::Vector3d p = edge(rest, vertex, j), y = edge(x, vertex, j);
        sum += 2 * shape_->weights()[k] * (c_[i] * (y - rotations_[i] * p) + c_[j] * (y - rotations_[j] * p));
      }
      result.row(vertex) = sum;
    }
  });
}

std::size_t CellPass::memory_bytes() const {
  return rotations_.capacity() * sizeof(Eigen::Matrix3d) + (e2_.capacity() + c_.capacity()) * sizeof(double) +
         chunk_sums_.capacity() * sizeof(double);
}

}  // namespace lpdeform
