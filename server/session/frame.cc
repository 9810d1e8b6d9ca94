#include "server/session/frame.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"

namespace lpdeform {
namespace {

template <typename Matrix>
Eigen::VectorXf float32_of(const Matrix& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), values.size()).template cast<float>();
}

/// The numbers in the order in which they lie in memory.
template <typename Matrix>
std::string_view bytes_of_all(const Matrix& values) {
  return {reinterpret_cast<const char*>(values.data()),
          static_cast<std::size_t>(values.size()) * sizeof(*values.data())};
}

constexpr std::size_t kMostBytes = (1u << 20) - 1024;  // of the numbers in a message; the rest is for headers

/// Vertices in a part of a quantized format. A part stays below kMostBytes even if it does not compress at
/// all.
constexpr std::uint32_t kQuantizedPart = 56u << 10;

std::size_t vertex_bytes(Format format, bool with_distortion, bool with_normals) {
  if (format >= Format::kQuantized) return kQuantizedBytes * (with_normals ? 2 : 1);
  const std::size_t numbers = 3 + (with_distortion ? 1 : 0) + (with_normals ? 3 : 0);
  return numbers * (format == Format::kFloat64 ? sizeof(double) : sizeof(float));
}

std::vector<std::string> compressed_parts(std::string_view quantized) {
  constexpr std::size_t part_bytes = kQuantizedPart * kQuantizedBytes;
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < quantized.size(); at += part_bytes) {
    parts.push_back(compress(quantized.substr(at, part_bytes)));
  }
  return parts;
}

}  // namespace

std::size_t bytes_of(Scalar scalar) {
  return scalar == Scalar::kFloat64 ? sizeof(double) : sizeof(float);
}

Format format_of(Scalar scalar) {
  return scalar == Scalar::kFloat64 ? Format::kFloat64 : Format::kFloat32;
}

Surface::Surface(Points positions, Field cell_energies, std::shared_ptr<const DrawMesh> mesh)
    : positions_(std::move(positions)), cell_energies_(std::move(cell_energies)), mesh_(std::move(mesh)) {
  LPDEFORM_CHECK(cell_energies_.size() == positions_.rows());
}

Surface::Bytes Surface::bytes(Format format, std::uint32_t first, std::uint32_t count, bool with_distortion,
                              bool with_normals) const {
  Bytes out;
  const auto cut = [&](std::string_view whole, std::size_t vertex_bytes) {
    return whole.substr(first * vertex_bytes, count * vertex_bytes);
  };
  switch (format) {
    case Format::kFloat64:
      out.positions = cut(bytes_of_all(positions_), 3 * sizeof(double));
      if (with_distortion) out.distortion = cut(bytes_of_all(cell_energies_), sizeof(double));
      if (with_normals) out.normals = cut(bytes_of_all(normals()), 3 * sizeof(double));
      break;
    case Format::kFloat32:
      out.positions = cut(bytes_of_all(float32().positions), 3 * sizeof(float));
      if (with_distortion) out.distortion = cut(bytes_of_all(float32().distortion), sizeof(float));
      if (with_normals) out.normals = cut(bytes_of_all(float32_normals()), 3 * sizeof(float));
      break;
    case Format::kQuantized:
      out.positions = cut(quantized().vertices, kQuantizedBytes);
      if (with_normals) out.normals = cut(quantized_normals(), kQuantizedBytes);
      break;
    case Format::kCompressed:
      LPDEFORM_CHECK(first % kQuantizedPart == 0);
      out.positions = compressed()[first / kQuantizedPart];
      if (with_normals) out.normals = compressed_normals()[first / kQuantizedPart];
      break;
  }
  return out;
}

std::uint32_t Surface::vertices_a_part(Format format, bool with_distortion, bool with_normals) {
  if (format >= Format::kQuantized) return kQuantizedPart;
  return static_cast<std::uint32_t>(kMostBytes / vertex_bytes(format, with_distortion, with_normals));
}

std::size_t Surface::size(Format format, bool with_distortion, bool with_normals) const {
  return vertex_count() * vertex_bytes(format, with_distortion, with_normals);
}

const Quantization& Surface::quantization() const {
  return quantized().quantization;
}

void Surface::prepare(Format format, bool with_normals) const {
  bytes(format, 0, 0, true, with_normals);
}

std::size_t Surface::memory_bytes() const {
  return bytes_of_all(positions_).size() + bytes_of_all(cell_energies_).size() + form_bytes_;
}

const Surface::Float32& Surface::float32() const {
  return float32_.get([this] {
    return Float32{counted(float32_of(positions_)), counted(float32_of(cell_energies_))};
  });
}

const Surface::Quantized& Surface::quantized() const {
  return quantized_.get([this] {
    const Quantization found = quantization_of(positions_, cell_energies_);
    return Quantized{found, counted(quantize(positions_, cell_energies_, found))};
  });
}

const Surface::Parts& Surface::compressed() const {
  return compressed_.get([this] { return counted(compressed_parts(quantized().vertices)); });
}

const Points& Surface::normals() const {
  LPDEFORM_CHECK(mesh_ != nullptr);
  return normals_.get([this] {
    Points made = mesh_->normals(positions_);
    form_bytes_ += bytes_of_all(made).size();
    return made;
  });
}

const Eigen::VectorXf& Surface::float32_normals() const {
  return float32_normals_.get([this] { return counted(float32_of(normals())); });
}

const std::string& Surface::quantized_normals() const {
  return quantized_normals_.get([this] { return counted(quantize_normals(normals())); });
}

const Surface::Parts& Surface::compressed_normals() const {
  return compressed_normals_.get([this] { return counted(compressed_parts(quantized_normals())); });
}

std::string Surface::counted(std::string form) const {
  form_bytes_ += form.size();
  return form;
}

Eigen::VectorXf Surface::counted(Eigen::VectorXf form) const {
  form_bytes_ += bytes_of_all(form).size();
  return form;
}

Surface::Parts Surface::counted(Parts form) const {
  for (const std::string& part : form) form_bytes_ += part.size();
  return form;
}

FrameCutter::FrameCutter(std::shared_ptr<const Frame> frame, Format format, bool with_distortion,
                         bool with_normals, std::uint64_t skipped_inputs, bool with_certificate)
    : frame_(std::move(frame)),
      format_(format),
      with_distortion_(with_distortion),
      with_normals_(with_normals),
      with_certificate_(with_certificate),
      skipped_inputs_(skipped_inputs) {}

FramePiece FrameCutter::next() {
  LPDEFORM_CHECK(has_more());
  const std::uint32_t most = Surface::vertices_a_part(format_, with_distortion_, with_normals_);
  const std::uint32_t left = frame_->surface->vertex_count() - at_;
  FramePiece piece{frame_,           at_,     std::min(most, left), left <= most,
                   skipped_inputs_,  format_, with_distortion_,     with_normals_,
                   with_certificate_};
  at_ += piece.count;
  if (piece.is_last) frame_.reset();
  return piece;
}

}  // namespace lpdeform
