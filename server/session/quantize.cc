#include "server/session/quantize.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace lpdeform {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers travel as they lie in memory");

constexpr double kMostUnsigned = 65535, kMostSigned = 32767;

/// Steps per unit of length; 0 if the length is 0 or tiny.
double steps(double extent) {
  const double steps = kMostUnsigned / extent;
  return std::isfinite(steps) ? steps : 0;
}

std::uint16_t nearest(double steps) {
  return static_cast<std::uint16_t>(std::min(std::max(steps + 0.5, 0.0), kMostUnsigned));
}

}  // namespace

Quantization quantization_of(const Points& positions, const Field& cell_energies) {
  Quantization found;
  if (positions.rows() == 0) return found;
  found.origin = positions.colwise().minCoeff();
  found.extent = positions.colwise().maxCoeff().transpose() - found.origin;
  found.distortion_extent = std::max(0.0, cell_energies.maxCoeff());
  return found;
}

std::string quantize(const Points& positions, const Field& cell_energies, const Quantization& quantization) {
  const auto count = static_cast<std::size_t>(positions.rows());
  std::string bytes(count * kQuantizedBytes, '\0');
  auto* out = reinterpret_cast<std::uint16_t*>(bytes.data());
  const Eigen::Vector3d scale = quantization.extent.unaryExpr(&steps);
  const double distortion_scale = steps(quantization.distortion_extent);
  for (Eigen::Index k = 0; k < positions.rows(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      *out++ = nearest((positions(k, axis) - quantization.origin[axis]) * scale[axis]);
    }
    *out++ = nearest(cell_energies[k] * distortion_scale);
  }
  return bytes;
}

std::string quantize_normals(const Points& normals) {
  std::string bytes(static_cast<std::size_t>(normals.rows()) * kQuantizedBytes, '\0');
  auto* out = reinterpret_cast<std::int16_t*>(bytes.data());
  for (Eigen::Index k = 0; k < normals.rows(); ++k) {
    for (int axis = 0; axis < 3; ++axis)
      *out++ = static_cast<std::int16_t>(std::lround(normals(k, axis) * kMostSigned));
    *out++ = 0;
  }
  return bytes;
}

std::string compress(std::string_view quantized) {
  [[maybe_unused]] static const bool is_version_set = [] {
    meshopt_encodeVertexVersion(0);
    return true;
  }();
  const std::size_t count = quantized.size() / kQuantizedBytes;
  std::string bytes(meshopt_encodeVertexBufferBound(count, kQuantizedBytes), '\0');
  bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                          quantized.data(), count, kQuantizedBytes));
  return bytes;
}

}  // namespace lpdeform
