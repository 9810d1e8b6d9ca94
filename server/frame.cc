#include "server/frame.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace lpdeform {
namespace {

template <typename Matrix>
std::string float32_bytes(const Matrix& values) {
  std::string bytes(static_cast<std::size_t>(values.size()) * sizeof(float), '\0');
  Eigen::Map<Eigen::VectorXf>(reinterpret_cast<float*>(bytes.data()), values.size()) =
      Eigen::Map<const Eigen::VectorXd>(values.data(), values.size()).template cast<float>();
  return bytes;
}

template <typename Matrix>
std::string_view float64_bytes(const Matrix& values) {
  return {reinterpret_cast<const char*>(values.data()),
          static_cast<std::size_t>(values.size()) * sizeof(double)};
}

}  // namespace

std::size_t bytes_of(Scalar scalar) {
  return scalar == Scalar::kFloat64 ? sizeof(double) : sizeof(float);
}

Surface::Surface(Points positions, Field cell_energies, std::shared_ptr<const DrawMesh> mesh)
    : positions_(std::move(positions)), cell_energies_(std::move(cell_energies)), mesh_(std::move(mesh)) {
  LPDEFORM_CHECK(cell_energies_.size() == positions_.rows());
}

std::string_view Surface::position_bytes(Scalar scalar) const {
  if (scalar == Scalar::kFloat64) return float64_bytes(positions_);
  make_float32();
  return float32_positions_;
}

std::string_view Surface::distortion_bytes(Scalar scalar) const {
  if (scalar == Scalar::kFloat64) return float64_bytes(cell_energies_);
  make_float32();
  return float32_distortion_;
}

std::string_view Surface::normal_bytes(Scalar scalar) const {
  make_normals();
  return scalar == Scalar::kFloat64 ? float64_bytes(normals_) : std::string_view(float32_normals_);
}

void Surface::prepare(Scalar scalar, bool with_normals) const {
  position_bytes(scalar);
  if (with_normals) make_normals();
}

void Surface::make_normals() const {
  LPDEFORM_CHECK(mesh_ != nullptr);
  std::call_once(normals_once_, [this] {
    normals_ = mesh_->normals(positions_);
    float32_normals_ = float32_bytes(normals_);
    has_normals_ = true;
  });
}

void Surface::make_float32() const {
  std::call_once(once_, [this] {
    float32_positions_ = float32_bytes(positions_);
    float32_distortion_ = float32_bytes(cell_energies_);
  });
}

std::size_t Surface::memory_bytes() const {
  const Eigen::Index numbers = positions_.size() * (has_normals_ ? 2 : 1) + cell_energies_.size();
  return static_cast<std::size_t>(numbers) * (sizeof(double) + sizeof(float));
}

FrameCutter::FrameCutter(std::shared_ptr<const Frame> frame, Scalar scalar, bool with_distortion,
                         bool with_normals, std::uint64_t skipped_inputs)
    : frame_(std::move(frame)),
      scalar_(scalar),
      with_distortion_(with_distortion),
      with_normals_(with_normals),
      skipped_inputs_(skipped_inputs) {}

FramePiece FrameCutter::next() {
  LPDEFORM_CHECK(has_more());
  const std::size_t numbers = 3 + (with_distortion_ ? 1 : 0) + (with_normals_ ? 3 : 0);
  const std::size_t vertex_bytes = numbers * bytes_of(scalar_);
  const auto most = static_cast<std::uint32_t>(kMostBytes / vertex_bytes);
  const std::uint32_t left = frame_->surface->vertex_count() - at_;
  FramePiece piece{frame_,          at_,     std::min(most, left), left <= most,
                   skipped_inputs_, scalar_, with_distortion_,     with_normals_};
  at_ += piece.count;
  if (piece.is_last) frame_.reset();
  return piece;
}

}  // namespace lpdeform
