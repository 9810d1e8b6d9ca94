#include <limits>

#include "absl/strings/str_cat.h"
#include "core/io/readers.h"
#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

absl::Status read_vertex(TextScanner& scanner, MeshBuilder& builder) {
  const auto x = to_number(scanner.next_on_line()), y = to_number(scanner.next_on_line()),
             z = to_number(scanner.next_on_line());
  const auto error = [&](const char* what) {
    return scanner.error(absl::StrCat("vertex ", builder.vertices() + 1, what));
  };
  if (!x || !y || !z) return error(" needs three numbers");
  if (!are_finite(*x, *y, *z)) return error(" has a NaN or infinite coordinate");
  builder.add_vertex(*x, *y, *z);
  return absl::OkStatus();
}

/// Converts a vertex number of the file, which counts from 1 or backwards from the newest vertex, to an index from 0.
std::int32_t to_zero_based(std::int32_t number, std::int64_t vertices) {
  if (number >= 0) return number - 1;
  const std::int64_t index = vertices + number;
  return static_cast<std::int32_t>(std::max<std::int64_t>(index, std::numeric_limits<std::int32_t>::min()));
}

std::optional<std::int32_t> vertex_number(std::string_view corner) {
  return to_index(corner.substr(0, corner.find('/')));
}

/// `face`: its number, from 1 on.
absl::Status read_face(TextScanner& scanner, std::int64_t face, std::vector<std::int32_t>& corners,
                       MeshBuilder& builder) {
  const auto error = [&](const char* what) { return scanner.error(absl::StrCat("face ", face, what)); };
  corners.clear();
  for (std::string_view word = scanner.next_on_line(); !word.empty(); word = scanner.next_on_line()) {
    const auto number = vertex_number(word);
    if (!number) return error(" has a corner that does not start with a vertex number");
    if (*number == 0) return error(" names vertex 0, and the first vertex is 1");
    corners.push_back(to_zero_based(*number, builder.vertices()));
  }
  if (corners.size() < 3) return error(" needs at least three corners");
  builder.add_polygon(corners);
  return absl::OkStatus();
}

bool are_in_range(const TriangleMesh& mesh) {
  return mesh.faces.size() == 0 ||
         (mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.vertices.rows());
}

/// Names the first corner whose vertex is not there. Only a second look finds it: a face may name vertices after it.
absl::Status wrong_corner(std::string_view text, std::int64_t vertices) {
  TextScanner scanner(text, TextScanner::LineEnds::kContinued);
  std::int64_t before = 0, face = 0;
  do {
    const std::string_view keyword = scanner.next_on_line();
    if (keyword == "v") ++before;
    if (keyword != "f") continue;
    ++face;
    for (std::string_view word = scanner.next_on_line(); !word.empty(); word = scanner.next_on_line()) {
      const std::int32_t number = vertex_number(word).value();
      const std::int64_t index = to_zero_based(number, before);
      if (index >= 0 && index < vertices) continue;
      const std::string limit = number < 0 ? absl::StrCat(before, " vertices come before it")
                                           : absl::StrCat("there are ", vertices, " vertices");
      return scanner.error(absl::StrCat("face ", face, " has the corner \"",
                                        std::string(word.substr(0, word.find('/'))), "\"; ", limit));
    }
  } while (scanner.skip_line());
  return absl::InternalError("all corners are there");
}

}  // namespace

absl::StatusOr<TriangleMesh> parse_obj(std::string_view text) {
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    return mesh_syntax("byte " + std::to_string(zero), "an OBJ file is text, but this byte is 0");
  }
  TextScanner scanner(text, TextScanner::LineEnds::kContinued);
  MeshBuilder builder;
  std::vector<std::int32_t> corners;
  std::int64_t faces = 0;
  do {
    const std::string_view keyword = scanner.next_on_line();
    absl::Status status;
    if (keyword == "v") status = read_vertex(scanner, builder);
    if (keyword == "f") status = read_face(scanner, ++faces, corners, builder);
    if (!status.ok()) return status;
  } while (scanner.skip_line());
  TriangleMesh mesh = builder.mesh();
  if (!are_in_range(mesh)) return wrong_corner(text, mesh.vertices.rows());
  return mesh;
}

}  // namespace lpdeform
