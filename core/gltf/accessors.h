#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "core/gltf/document.h"

namespace lpdeform::gltf {

/// One row per element.
using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kFloat = 5126;  // a componentType
constexpr std::uint64_t kMostElements = 20'000'000;

/// Where an accessor's elements lie in a buffer: `count` times `size` bytes, each `stride` bytes after the one before.
struct Layout {
  std::size_t buffer = 0;
  std::uint64_t begin = 0, stride = 0, size = 0, count = 0;

  std::uint64_t end() const { return count == 0 ? begin : begin + stride * (count - 1) + size; }
};

/// The number of elements; at most kMostElements.
std::uint64_t element_count(const Json& root, std::size_t accessor);

/// Throws a Refusal if the accessor has no bufferView, or reaches beyond its bufferView or that beyond its buffer.
Layout layout_of(const Document& document, std::size_t accessor);

/// Its elements as numbers, normalized integers as -1 to 1, values of "sparse" put in. `columns`: 3 for VEC3, 4 for VEC4,
/// 16 for MAT4, which has its columns one after another. Throws a Refusal if the accessor is of another type or out of range.
Table read_table(const Document& document, std::size_t accessor, int columns);

/// The indices of a primitive.
std::vector<std::uint32_t> read_indices(const Document& document, std::size_t accessor);

}  // namespace lpdeform::gltf
