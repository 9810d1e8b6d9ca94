#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"

namespace lpdeform {

// The readers behind parse_mesh, one per format. All are our own; CONTRIBUTING.md compares them with libraries, which keep
// coordinates as floats, trust the counts in a file, or do not say where it is wrong. Ours trust a count only as far as the
// following bytes can hold that many items, so memory and time are bounded by the size of the input.

absl::StatusOr<TriangleMesh> parse_off(std::string_view text);
absl::StatusOr<TriangleMesh> parse_obj(std::string_view text);
absl::StatusOr<TriangleMesh> parse_ply(std::string_view bytes);
absl::StatusOr<TriangleMesh> parse_stl(std::string_view bytes);

/// INVALID_ARGUMENT (MESH_SYNTAX). `where` ("line 7", "byte 84") is the element and the beginning of the sentence.
absl::Status mesh_syntax(std::string_view where, std::string_view what);

/// Whether these coordinates are a place: none is NaN or infinite.
bool are_finite(double x, double y, double z);

/// Collects a mesh piece by piece.
class MeshBuilder {
 public:
  /// Reserves memory for the counts that a file claims, limited to what `bytes_left` bytes can hold.
  void reserve(std::int64_t vertices, std::int64_t faces, std::size_t bytes_left);

  void add_vertex(double x, double y, double z) { coordinates_.insert(coordinates_.end(), {x, y, z}); }

  /// Adds a fan of triangles around the first corner; nothing if there are fewer than three corners.
  void add_polygon(std::span<const std::int32_t> corners);

  std::int64_t vertices() const { return static_cast<std::int64_t>(coordinates_.size() / 3); }

  TriangleMesh mesh() const;

 private:
  std::vector<double> coordinates_;
  std::vector<std::int32_t> corners_;
};

}  // namespace lpdeform
