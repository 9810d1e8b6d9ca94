#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/io/byte_order.h"
#include "core/io/number_text.h"
#include "core/io/ply_header.h"
#include "core/io/readers.h"
#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

constexpr std::int64_t kMostVertices = std::numeric_limits<std::int32_t>::max();
constexpr double kLongestList = 4294967295.0;  // the largest number of the largest integer type

/// Numbers of an ASCII file, one word each.
class TextNumbers {
 public:
  TextNumbers(std::string_view bytes, std::size_t begin)
      : scanner_(bytes.substr(begin)),
        lines_before_(std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(begin), '\n')) {}

  std::optional<double> next(PlyType) { return to_number(scanner_.next()); }
  std::string place() const { return absl::StrCat("line ", lines_before_ + scanner_.line()); }

 private:
  TextScanner scanner_;
  std::int64_t lines_before_;
};

/// Numbers of a binary file.
class BinaryNumbers {
 public:
  BinaryNumbers(std::string_view bytes, std::size_t begin, std::endian order)
      : bytes_(bytes), at_(begin), order_(order) {}

  std::optional<double> next(PlyType type) {
    switch (type) {
      case PlyType::kInt8:
        return take<std::int8_t>();
      case PlyType::kUint8:
        return take<std::uint8_t>();
      case PlyType::kInt16:
        return take<std::int16_t>();
      case PlyType::kUint16:
        return take<std::uint16_t>();
      case PlyType::kInt32:
        return take<std::int32_t>();
      case PlyType::kUint32:
        return take<std::uint32_t>();
      case PlyType::kFloat32:
        return take<float>();
      case PlyType::kFloat64:
        return take<double>();
    }
    return std::nullopt;
  }
  std::string place() const { return absl::StrCat("byte ", at_); }

 private:
  template <typename Number>
  std::optional<double> take() {
    if (bytes_.size() - at_ < sizeof(Number)) return std::nullopt;
    const auto number = load<Number>(bytes_.data() + at_, order_);
    at_ += sizeof(Number);
    return static_cast<double>(number);
  }

  std::string_view bytes_;
  std::size_t at_;
  std::endian order_;
};

/// The position of each of x, y, z among the properties of the vertices, or -1.
std::array<int, 3> coordinate_places(const PlyElement& element) {
  std::array<int, 3> places{-1, -1, -1};
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    const PlyProperty& property = element.properties[k];
    if (property.length || property.name.size() != 1) continue;
    const int axis = property.name[0] - 'x';
    if (axis >= 0 && axis < 3) places[axis] = static_cast<int>(k);
  }
  return places;
}

bool is_corner_list(const PlyProperty& property) {
  return property.length && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// Reads the data of one element after the other into a mesh.
template <typename Numbers>
class PlyData {
 public:
  PlyData(Numbers numbers, std::int64_t vertices) : numbers_(numbers), vertices_(vertices) {}

  absl::Status read(const PlyElement& element) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    const std::array<int, 3> places = coordinate_places(element);
    if (is_vertex && (places[0] < 0 || places[1] < 0 || places[2] < 0)) {
      return mesh_syntax("element vertex", "it needs the properties x, y and z");
    }
    if (element.properties.empty()) return absl::OkStatus();
    for (std::int64_t row = 0; row < element.count; ++row) {
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        if (!read_property(element.properties[k])) {
          return wrong(element, row, absl::StrCat("lacks a valid ", element.properties[k].name));
        }
        if (!is_face || !is_corner_list(element.properties[k])) continue;
        if (const absl::Status status = add_face(element, row); !status.ok()) return status;
      }
      if (is_vertex) {
        const double x = values_[places[0]], y = values_[places[1]], z = values_[places[2]];
        if (!are_finite(x, y, z)) return wrong(element, row, "has a NaN or infinite coordinate");
        builder_.add_vertex(x, y, z);
      }
      values_.clear();
    }
    return absl::OkStatus();
  }

  MeshBuilder& builder() { return builder_; }

 private:
  /// Appends one value to values_. For a list, this is its length; its items go to items_.
  bool read_property(const PlyProperty& property) {
    const auto value = numbers_.next(property.length.value_or(property.type));
    if (!value) return false;
    values_.push_back(*value);
    if (!property.length) return true;
    if (!(*value >= 0 && *value <= kLongestList && *value == std::floor(*value))) return false;
    const auto length = static_cast<std::int64_t>(*value);
    items_.clear();
    for (std::int64_t k = 0; k < length; ++k) {
      const auto item = numbers_.next(property.type);
      if (!item) return false;
      items_.push_back(*item);
    }
    return true;
  }

  absl::Status add_face(const PlyElement& element, std::int64_t row) {
    corners_.clear();
    for (const double item : items_) {
      if (!(item >= 0 && item < static_cast<double>(vertices_) && item == std::floor(item))) {
        std::string corner;
        append_number(corner, item);
        return wrong(
            element, row,
            absl::StrCat("has the corner ", corner, "; there are ", vertices_, " vertices, counted from 0"));
      }
      corners_.push_back(static_cast<std::int32_t>(item));
    }
    builder_.add_polygon(corners_);
    return absl::OkStatus();
  }

  absl::Status wrong(const PlyElement& element, std::int64_t row, std::string_view what) const {
    return mesh_syntax(numbers_.place(),
                       absl::StrCat(element.name, " ", row, " of ", element.count, " ", std::string(what)));
  }

  Numbers numbers_;
  std::int64_t vertices_;  // in the whole file: faces may stand before them
  MeshBuilder builder_;
  std::vector<double> values_, items_;
  std::vector<std::int32_t> corners_;
};

template <typename Numbers>
absl::StatusOr<TriangleMesh> read_elements(const PlyHeader& header, std::size_t bytes_left, Numbers numbers) {
  std::int64_t vertices = 0, faces = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex")
      vertices = std::min(kMostVertices, vertices + std::min(kMostVertices, element.count));
    if (element.name == "face") faces = element.count;
  }
  PlyData<Numbers> data(numbers, vertices);
  data.builder().reserve(vertices, faces, bytes_left);
  for (const PlyElement& element : header.elements) {
    if (const absl::Status status = data.read(element); !status.ok()) return status;
  }
  return data.builder().mesh();
}

}  // namespace

absl::StatusOr<TriangleMesh> parse_ply(std::string_view bytes) {
  const absl::StatusOr<PlyHeader> header = parse_ply_header(bytes);
  if (!header.ok()) return header.status();
  const std::size_t begin = header->data_begin, bytes_left = bytes.size() - begin;
  if (header->format == PlyFormat::kAscii)
    return read_elements(*header, bytes_left, TextNumbers(bytes, begin));
  const bool is_big = header->format == PlyFormat::kBinaryBigEndian;
  const std::endian order = is_big ? std::endian::big : std::endian::little;
  return read_elements(*header, bytes_left, BinaryNumbers(bytes, begin, order));
}

}  // namespace lpdeform
