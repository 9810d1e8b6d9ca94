#include <limits>

#include "core/io/readers.h"
#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

absl::Status read_vertex(TextScanner& scanner, MeshBuilder& builder) {
  const auto x = to_number(scanner.next_on_line()), y = to_number(scanner.next_on_line()),
             z = to_number(scanner.next_on_line());
  if (!x || !y || !z) return scanner.error("a v line needs three numbers");
  builder.add_vertex(*x, *y, *z);
  return absl::OkStatus();
}

/// Converts a vertex number of the file, which counts from 1 or backwards from the newest vertex, to an index from 0.
std::int32_t to_zero_based(std::int32_t number, std::int64_t vertices) {
  if (number >= 0) return number - 1;
  const std::int64_t index = vertices + number;
  return static_cast<std::int32_t>(std::max<std::int64_t>(index, std::numeric_limits<std::int32_t>::min()));
}

absl::Status read_face(TextScanner& scanner, std::vector<std::int32_t>& corners, MeshBuilder& builder) {
  corners.clear();
  for (std::string_view word = scanner.next_on_line(); !word.empty(); word = scanner.next_on_line()) {
    const auto number = to_index(word.substr(0, word.find('/')));
    if (!number) return scanner.error("a corner of an f line starts with a vertex number");
    if (*number == 0) return scanner.error("an f line names vertex 0, and the first vertex is 1");
    corners.push_back(to_zero_based(*number, builder.vertices()));
  }
  if (corners.size() < 3) return scanner.error("an f line needs at least three corners");
  builder.add_polygon(corners);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TriangleMesh> parse_obj(std::string_view text) {
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    return mesh_syntax("byte " + std::to_string(zero), "an OBJ file is text, but this byte is 0");
  }
  TextScanner scanner(text, TextScanner::LineEnds::kContinued);
  MeshBuilder builder;
  std::vector<std::int32_t> corners;
  do {
    const std::string_view keyword = scanner.next_on_line();
    absl::Status status;
    if (keyword == "v") status = read_vertex(scanner, builder);
    if (keyword == "f") status = read_face(scanner, corners, builder);
    if (!status.ok()) return status;
  } while (scanner.skip_line());
  return builder.mesh();
}

}  // namespace lpdeform
