#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "core/base/geometry.h"
#include "lpdeform/v1/data.pb.h"
#include "server/session/frame.h"

namespace lpdeform {

// Functions that the source files of Decoder share.

absl::Status unknown_enum(std::string_view what, int value);
absl::Status wrong_size(std::string_view what, std::uint64_t is, const std::string& should);

/// Packed numbers of type Wire as a row-major matrix of doubles with `columns` columns.
template <typename Wire, typename Result>
void unpack(std::string_view bytes, Result& out) {
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    Wire number;
    std::memcpy(&number, bytes.data() + static_cast<std::size_t>(k) * sizeof(Wire), sizeof(Wire));
    out.data()[k] = number;
  }
}

template <typename Result>
void unpack(Scalar scalar, std::string_view bytes, Result& out) {
  if (scalar == Scalar::kFloat64) {
    unpack<double>(bytes, out);
  } else {
    unpack<float>(bytes, out);
  }
}

inline constexpr std::uint32_t kMostIndex = std::numeric_limits<std::int32_t>::max();

/// The packed index number k.
inline std::uint32_t packed_index(std::string_view bytes, std::size_t k) {
  std::uint32_t index;
  std::memcpy(&index, bytes.data() + k * sizeof(index), sizeof(index));
  return index;
}

/// Indices of vertices or faces. An index over kMostIndex becomes kMostIndex, which no mesh has. Code that
/// names an index in an error must look for such values first, so that it names the number that was sent.
inline void unpack_indices(std::string_view bytes, std::size_t count, std::int32_t* out) {
  for (std::size_t k = 0; k < count; ++k)
    out[k] = static_cast<std::int32_t>(std::min(packed_index(bytes, k), kMostIndex));
}

}  // namespace lpdeform
