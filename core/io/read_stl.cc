#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/hash_map.h"
#include "core/io/byte_order.h"
#include "core/io/readers.h"
#include "core/io/text_scanner.h"

namespace lpdeform {
namespace {

constexpr std::size_t kHeadBytes = 84, kFaceBytes = 50, kNormalBytes = 12;

using Corner = std::array<double, 3>;

bool is_place(const Corner& corner) {
  return are_finite(corner[0], corner[1], corner[2]);
}

/// Corners with the same coordinates become one vertex, in order of first appearance.
class Welder {
 public:
  void add_face(const std::array<Corner, 3>& corners) {
    builder_.add_polygon(std::array{vertex(corners[0]), vertex(corners[1]), vertex(corners[2])});
  }
  TriangleMesh mesh() const { return builder_.mesh(); }

 private:
  std::int32_t vertex(const Corner& corner) {
    std::array<std::uint64_t, 3> key;
    for (int k = 0; k < 3; ++k) key[k] = std::bit_cast<std::uint64_t>(corner[k] == 0 ? 0.0 : corner[k]);
    const auto next = static_cast<std::int32_t>(builder_.vertices());
    const auto [entry, is_new] = vertices_.try_emplace(key, next);
    if (is_new) builder_.add_vertex(corner[0], corner[1], corner[2]);
    return entry->second;
  }

  MeshBuilder builder_;
  HashMap<std::array<std::uint64_t, 3>, std::int32_t> vertices_;
};

std::uint64_t claimed_size(std::string_view bytes) {
  if (bytes.size() < kHeadBytes) return kHeadBytes;
  return kHeadBytes +
         kFaceBytes * std::uint64_t{load_little_endian<std::uint32_t>(bytes.data() + kHeadBytes - 4)};
}

bool starts_with_solid(std::string_view bytes) {
  constexpr std::string_view kSolid = "solid";
  if (bytes.size() < kSolid.size()) return false;
  for (std::size_t k = 0; k < kSolid.size(); ++k) {
    if (std::tolower(static_cast<unsigned char>(bytes[k])) != kSolid[k]) return false;
  }
  return true;
}

absl::StatusOr<TriangleMesh> parse_binary(std::string_view bytes) {
  const std::uint64_t claimed = claimed_size(bytes);
  if (bytes.size() < claimed) {
    return mesh_syntax(
        absl::StrCat("byte ", bytes.size()),
        absl::StrCat("the file ends here, but its head of 84 bytes and the faces that it claims need ",
                     claimed, " bytes"));
  }
  Welder welder;
  for (std::size_t at = kHeadBytes; at < claimed; at += kFaceBytes) {
    std::array<Corner, 3> corners;
    for (int k = 0; k < 9; ++k) {
      corners[k / 3][k % 3] = load_little_endian<float>(bytes.data() + at + kNormalBytes + 4 * k);
    }
    if (!std::ranges::all_of(corners, is_place)) {
      return mesh_syntax(absl::StrCat("byte ", at),
                         absl::StrCat("face ", (at - kHeadBytes) / kFaceBytes,
                                      ", counted from 0, has a NaN or infinite coordinate"));
    }
    welder.add_face(corners);
  }
  return welder.mesh();
}

std::string lower_case(std::string_view word) {
  std::string result(word);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Reads from after "outer loop" to after "endloop".
absl::Status read_loop(TextScanner& scanner, Welder& welder) {
  std::array<Corner, 3> corners;
  for (Corner& corner : corners) {
    if (lower_case(scanner.next()) != "vertex") return scanner.error("a loop needs three vertex lines");
    for (double& coordinate : corner) {
      const auto number = to_number(scanner.next());
      if (!number) return scanner.error("a vertex line needs three numbers");
      coordinate = *number;
    }
    if (!is_place(corner)) return scanner.error("the vertex has a NaN or infinite coordinate");
  }
  if (lower_case(scanner.next()) != "endloop")
    return scanner.error("endloop is expected after three vertex lines");
  welder.add_face(corners);
  return absl::OkStatus();
}

/// Reads from after "facet" to after "endfacet"; the normal is ignored.
absl::Status read_facet(TextScanner& scanner, Welder& welder) {
  scanner.skip_line();
  if (lower_case(scanner.next()) != "outer" || lower_case(scanner.next()) != "loop") {
    return scanner.error("outer loop is expected after a facet line");
  }
  if (const absl::Status status = read_loop(scanner, welder); !status.ok()) return status;
  if (lower_case(scanner.next()) != "endfacet") return scanner.error("endfacet is expected after endloop");
  return absl::OkStatus();
}

absl::StatusOr<TriangleMesh> parse_ascii(std::string_view text) {
  TextScanner scanner(text);
  Welder welder;
  bool is_inside = false;
  for (std::string word = lower_case(scanner.next()); !word.empty(); word = lower_case(scanner.next())) {
    if (word == (is_inside ? "endsolid" : "solid")) {
      is_inside = !is_inside;
      scanner.skip_line();
    } else if (is_inside && word == "facet") {
      if (absl::Status status = read_facet(scanner, welder); !status.ok()) return status;
    } else {
      return scanner.error(is_inside ? "facet or endsolid is expected here" : "solid is expected here");
    }
  }
  if (is_inside) return scanner.error("the file ends before endsolid");
  return welder.mesh();
}

}  // namespace

/// Binary files may start with "solid" as well; they are recognised by their size.
absl::StatusOr<TriangleMesh> parse_stl(std::string_view bytes) {
  const bool is_exact = bytes.size() >= kHeadBytes && bytes.size() == claimed_size(bytes);
  return is_exact || !starts_with_solid(bytes) ? parse_binary(bytes) : parse_ascii(bytes);
}

}  // namespace lpdeform
