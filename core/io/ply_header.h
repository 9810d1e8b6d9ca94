#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace lpdeform {

enum class PlyFormat { kAscii, kBinaryLittleEndian, kBinaryBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

/// The bytes that a number of this type takes in a binary file.
int size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;  // type of the value, or of a list's items
  std::optional<PlyType> length;     // type of a list's length; set for lists only
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The header of a PLY file.
struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;  // in the order of their data
  std::size_t data_begin = 0;        // the byte after the line "end_header"
};

/// Parses the header. INVALID_ARGUMENT (MESH_SYNTAX) names the line if the header is malformed.
absl::StatusOr<PlyHeader> parse_ply_header(std::string_view bytes);

}  // namespace lpdeform
