#include <string>

#include "absl/strings/str_cat.h"
#include "core/io/readers.h"
#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

struct Counts {
  std::int32_t vertices = 0;
  std::int32_t faces = 0;
};

/// "OFF", "COFF", "NOFF", "STOFF", "STCNOFF": each prefix announces numbers after x, y and z, which are ignored.
bool is_known_keyword(std::string_view word) {
  if (!word.ends_with("OFF")) return false;
  word.remove_suffix(3);
  if (word.starts_with("ST")) word.remove_prefix(2);
  if (word.starts_with("C")) word.remove_prefix(1);
  if (word.starts_with("N")) word.remove_prefix(1);
  return word.empty();
}

/// The keyword may be missing, and the counts may follow it on the same line. The number of edges is ignored.
absl::StatusOr<Counts> read_head(TextScanner& scanner) {
  std::string_view word = scanner.next();
  if (is_known_keyword(word)) {
    word = scanner.next();
    if (word == "BINARY") return scanner.error("binary OFF is not supported");
  } else if (!to_index(word)) {
    return scanner.error("an OFF file starts with OFF, COFF, NOFF or STOFF");
  }
  const auto vertices = to_index(word), faces = to_index(scanner.next_on_line());
  if (!vertices || !faces || *vertices < 0 || *faces < 0) {
    return scanner.error("the numbers of vertices and faces are expected here, none of them negative");
  }
  scanner.skip_line();
  return Counts{*vertices, *faces};
}

absl::Status read_vertex(TextScanner& scanner, std::int32_t v, std::int32_t count, MeshBuilder& builder) {
  const auto x = to_number(scanner.next()), y = to_number(scanner.next()), z = to_number(scanner.next());
  if (!x || !y || !z) {
    return scanner.error(absl::StrCat("vertex ", v, " of ", count, " needs three numbers"));
  }
  if (!are_finite(*x, *y, *z)) {
    return scanner.error(absl::StrCat("vertex ", v, " of ", count, " has a NaN or infinite coordinate"));
  }
  builder.add_vertex(*x, *y, *z);
  scanner.skip_line();
  return absl::OkStatus();
}

absl::Status read_face(TextScanner& scanner, std::int32_t f, std::int32_t count,
                       std::vector<std::int32_t>& corners, MeshBuilder& builder) {
  const auto size = to_index(scanner.next());
  if (!size || *size < 0) {
    return scanner.error(absl::StrCat("face ", f, " of ", count, " needs its number of corners"));
  }
  corners.clear();
  for (std::int32_t k = 0; k < *size; ++k) {
    const std::string_view word = scanner.next();
    const auto corner = to_index(word);
    if (!corner) {
      return scanner.error(absl::StrCat("face ", f, " of ", count, " needs ", *size, " vertex indices"));
    }
    if (*corner < 0 || *corner >= builder.vertices()) {
      return scanner.error(absl::StrCat("face ", f, " of ", count, " has the corner ", std::string(word),
                                        "; there are ", builder.vertices(), " vertices, counted from 0"));
    }
    corners.push_back(*corner);
  }
  builder.add_polygon(corners);
  scanner.skip_line();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TriangleMesh> parse_off(std::string_view text) {
  TextScanner scanner(text);
  const absl::StatusOr<Counts> counts = read_head(scanner);
  if (!counts.ok()) return counts.status();
  MeshBuilder builder;
  builder.reserve(counts->vertices, counts->faces, text.size() - scanner.position());
  for (std::int32_t v = 0; v < counts->vertices; ++v) {
    if (const absl::Status status = read_vertex(scanner, v, counts->vertices, builder); !status.ok())
      return status;
  }
  std::vector<std::int32_t> corners;
  for (std::int32_t f = 0; f < counts->faces; ++f) {
    const absl::Status status = read_face(scanner, f, counts->faces, corners, builder);
    if (!status.ok()) return status;
  }
  return builder.mesh();
}

}  // namespace lpdeform
