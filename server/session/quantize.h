#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/geometry.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// What the 16-bit integers q of a frame mean: position = origin + q / 65535 extent, by components;
/// distortion = q / 65535 distortion_extent.
struct Quantization {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();
  double distortion_extent = 0;
};

/// Bytes of a vertex, and of a normal, when quantized: four 16-bit integers.
inline constexpr std::size_t kQuantizedBytes = 8;

/// The quantization whose extent is just that of these, which must be finite.
Quantization quantization_of(const Points& positions, const Field& cell_energies);

/// x, y, z and distortion of each vertex, to the nearest; little-endian.
std::string quantize(const Points& positions, const Field& cell_energies, const Quantization& quantization);

/// x, y, z times 32767 and 0 of each normal, to the nearest; little-endian.
std::string quantize_normals(const Points& normals);

/// The same without loss by meshoptimizer's vertex codec, version 0. `quantized` is a whole number of vertices.
std::string compress(std::string_view quantized);

}  // namespace lpdeform
