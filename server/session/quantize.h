#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/geometry.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// How the 16-bit integers q of a frame are decoded: position = origin + q / 65535 * extent, per component;
/// distortion = q / 65535 * distortion_extent.
struct Quantization {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  double distortion_extent = 0;
};

/// Bytes per quantized vertex or normal: four 16-bit integers.
inline constexpr std::size_t kQuantizedBytes = 8;

/// The quantization whose extent fits these values exactly. They must be finite.
Quantization quantization_of(const Points& positions, const Field& cell_energies);

/// Encodes x, y, z and distortion of each vertex, rounded to the nearest; little-endian.
std::string quantize(const Points& positions, const Field& cell_energies, const Quantization& quantization);

/// Encodes x, y, z times 32767, and 0, for each normal, rounded to the nearest; little-endian.
std::string quantize_normals(const Points& normals);

/// Compresses the result of the functions above without loss, by meshoptimizer's vertex codec, version 0.
/// `quantized` is a whole number of vertices.
std::string compress(std::string_view quantized);

}  // namespace lpdeform
