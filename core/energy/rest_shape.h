#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/workers.h"
#include "core/energy/weights.h"
#include "core/mesh/mesh.h"
#include "core/mesh/report.h"

namespace lpdeform {

/// The undeformed mesh, prepared for the solver: neighbours, weights and rest edges in flat arrays. Immutable; shared
/// between sessions and threads.
class RestShape {
 public:
  /// Errors: INVALID_ARGUMENT with the reasons of deformable(), or MESH_SCALE; names the element. O(n log n).
  static absl::StatusOr<std::shared_ptr<const RestShape>> create(const TriangleMesh& mesh,
                                                                 WeightKind kind = WeightKind::kCotangent,
                                                                 const Workers& workers = Workers(1));

  static constexpr double kLargestCoordinate = 1e25, kSmallestDiagonal = 1e-25;

  std::int32_t vertex_count() const { return static_cast<std::int32_t>(positions_.rows()); }

  /// The number of vertices that faces use. The cells of all other vertices are empty.
  std::int32_t cell_count() const {
    return vertex_count() - static_cast<std::int32_t>(report_.unreferenced_vertices.count);
  }
  std::int32_t face_count() const { return static_cast<std::int32_t>(faces_.rows()); }

  /// Rest positions in the caller's units, as given.
  const Points& positions() const { return positions_; }
  const Faces& faces() const { return faces_; }
  const MeshReport& report() const { return report_; }
  WeightKind weight_kind() const { return kind_; }

  /// Component of each vertex, from 0; -1 if no face uses the vertex.
  const std::vector<std::int32_t>& components() const { return components_; }
  std::int32_t component_count() const { return component_count_; }

  /// Mean length of the rest edges: the default length unit of mixed norms. > 0.
  double mean_edge_length() const { return mean_edge_length_; }
  /// Length of the diagonal of the bounding box of the vertices that faces use. > 0.
  double diagonal() const { return diagonal_; }

  /// The rest positions that the solver computes with, "scaled units": (positions - centre) / mean_edge_length. With
  /// them, no result depends on the unit of length or on the distance from the origin. 0 for vertices that no face
  /// uses.
  const Points& scaled_positions() const { return scaled_positions_; }
  /// Mean of the rest positions of the vertices that faces use, in the caller's units.
  const Eigen::RowVector3d& centre() const { return centre_; }

  // The cell of vertex i is its one-ring (in the intrinsic triangulation if kIntrinsicDelaunay): entries offsets[i] to
  // offsets[i + 1] - 1 of neighbours (ascending) and weights. Symmetric.
  const std::vector<std::int32_t>& offsets() const { return offsets_; }
  const std::vector<std::int32_t>& neighbours() const { return neighbours_; }
  const std::vector<double>& weights() const { return weights_; }

  /// Bytes held, for admission control.
  std::size_t memory_bytes() const;

 private:
  RestShape() = default;

  Points positions_;
  Points scaled_positions_;
  Eigen::RowVector3d centre_ = Eigen::RowVector3d::Zero();
  Faces faces_;
  MeshReport report_;
  WeightKind kind_ = WeightKind::kCotangent;
  std::vector<std::int32_t> components_;
  std::int32_t component_count_ = 0;
  double mean_edge_length_ = 0;
  double diagonal_ = 0;
  std::vector<std::int32_t> offsets_;
  std::vector<std::int32_t> neighbours_;
  std::vector<double> weights_;
};

}  // namespace lpdeform
