#include "core/io/ply_header.h"

#include <array>
#include <charconv>
#include <utility>

#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

struct TypeName {
  std::string_view old_name, new_name;
  PlyType type;
  int size;
};

constexpr std::array<TypeName, 8> kTypes{{{"char", "int8", PlyType::kInt8, 1},
                                          {"uchar", "uint8", PlyType::kUint8, 1},
                                          {"short", "int16", PlyType::kInt16, 2},
                                          {"ushort", "uint16", PlyType::kUint16, 2},
                                          {"int", "int32", PlyType::kInt32, 4},
                                          {"uint", "uint32", PlyType::kUint32, 4},
                                          {"float", "float32", PlyType::kFloat32, 4},
                                          {"double", "float64", PlyType::kFloat64, 8}}};

std::optional<PlyType> type_named(std::string_view word) {
  for (const TypeName& entry : kTypes) {
    if (word == entry.old_name || word == entry.new_name) return entry.type;
  }
  return std::nullopt;
}

std::optional<PlyFormat> format_named(std::string_view word) {
  if (word == "ascii") return PlyFormat::kAscii;
  if (word == "binary_little_endian") return PlyFormat::kBinaryLittleEndian;
  if (word == "binary_big_endian") return PlyFormat::kBinaryBigEndian;
  return std::nullopt;
}

std::optional<std::int64_t> count_in(std::string_view word) {
  std::int64_t count = 0;
  const auto result = std::from_chars(word.data(), word.data() + word.size(), count);
  if (word.empty() || result.ec != std::errc() || result.ptr != word.data() + word.size() || count < 0)
    return {};
  return count;
}

absl::Status read_format(TextScanner& scanner, PlyHeader& header) {
  const auto format = format_named(scanner.next_on_line());
  if (!format) return scanner.error("the format is ascii, binary_little_endian or binary_big_endian");
  header.format = *format;
  return absl::OkStatus();
}

absl::Status read_element(TextScanner& scanner, PlyHeader& header) {
  const std::string_view name = scanner.next_on_line();
  const auto count = count_in(scanner.next_on_line());
  if (!count) return scanner.error("an element line needs a name and a count, which is not negative");
  header.elements.push_back({std::string(name), *count, {}});
  return absl::OkStatus();
}

absl::Status read_property(TextScanner& scanner, PlyHeader& header) {
  if (header.elements.empty()) return scanner.error("a property line comes after an element line");
  PlyProperty property;
  std::string_view word = scanner.next_on_line();
  if (word == "list") {
    property.length = type_named(scanner.next_on_line());
    const bool is_count = property.length && *property.length < PlyType::kFloat32;
    if (!is_count) return scanner.error("the length of a list has an integer type");
    word = scanner.next_on_line();
  }
  const auto type = type_named(word);
  property.name = scanner.next_on_line();
  if (!type || property.name.empty()) return scanner.error("a property line needs a type and a name");
  property.type = *type;
  header.elements.back().properties.push_back(std::move(property));
  return absl::OkStatus();
}

}  // namespace

int size_of(PlyType type) {
  return kTypes[static_cast<std::size_t>(type)].size;
}

absl::StatusOr<PlyHeader> parse_ply_header(std::string_view bytes) {
  TextScanner scanner(bytes);
  if (scanner.next_on_line() != "ply") return scanner.error("a PLY file starts with ply");
  PlyHeader header;
  bool has_format = false;
  while (scanner.skip_line()) {
    const std::string_view keyword = scanner.next_on_line();
    absl::Status status;
    if (keyword == "end_header") {
      if (!has_format) return scanner.error("the header has no format line");
      scanner.skip_line();
      header.data_begin = scanner.position();
      return header;
    }
    if (keyword == "format") {
      status = read_format(scanner, header);
      has_format = true;
    } else if (keyword == "element") {
      status = read_element(scanner, header);
    } else if (keyword == "property") {
      status = read_property(scanner, header);
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      status = scanner.error("format, element, property, comment or end_header is expected here");
    }
    if (!status.ok()) return status;
  }
  return scanner.error("the file ends before end_header");
}

}  // namespace lpdeform
