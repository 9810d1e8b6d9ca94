#pragma once

#include <cstdint>
#include <memory>
#include <mutex>

#include "absl/status/statusor.h"
#include "core/energy/rest_shape.h"
#include "core/mesh/carried_normals.h"
#include "core/mesh/weld.h"

namespace lpdeform {

/// A session's mesh as its client draws it. The contract speaks of the client's vertices, in the client's
/// order. The solver knows the welded vertices. This class converts between them; without a weld they are the
/// same. Thread-safe.
class DrawMesh {
 public:
  /// No weld, and smooth normals.
  explicit DrawMesh(std::shared_ptr<const RestShape> shape);

  /// `shape`: of the welded mesh. `weld`: null if nothing is welded. `faces`: the client's. `rest_normals`:
  /// one per vertex of the client, or no rows.
  DrawMesh(std::shared_ptr<const RestShape> shape, std::shared_ptr<const Weld> weld, Faces faces,
           Points rest_normals);

  std::uint32_t vertex_count() const;
  /// Null if nothing is welded.
  const std::shared_ptr<const Weld>& weld() const { return weld_; }
  /// The client's faces.
  const Faces& faces() const { return weld_ ? faces_ : shape_->faces(); }
  /// As they were given: one per vertex of the client, or no rows.
  const Points& rest_normals() const { return rest_normals_; }
  /// How many vertices are copies of an earlier one.
  std::uint32_t copy_count() const {
    return vertex_count() - static_cast<std::uint32_t>(shape_->vertex_count());
  }

  MeshReport report() const;
  Points positions(const Points& solved) const { return weld_ ? scattered(solved, *weld_) : solved; }
  Field distortion(const Field& solved) const { return weld_ ? scattered(solved, *weld_) : solved; }

  /// Initial positions for the solver, from positions of the client's vertices. Errors: COPIES_DIFFER,
  /// POSITIONS_NOT_FINITE.
  absl::StatusOr<Points> solver_positions(Points positions) const;

  /// Rewrites an error of the solver so that it names the client's vertices.
  absl::Status for_client(const absl::Status& status) const;

  /// Normals at the given positions, one per vertex of the client. See CarriedNormals.
  Points normals(const Points& positions) const;

  std::size_t memory_bytes() const;

 private:
  const std::shared_ptr<const RestShape> shape_;
  const std::shared_ptr<const Weld> weld_;
  const Faces faces_;  // empty if nothing is welded
  const Points rest_normals_;
  mutable std::once_flag once_;
  mutable std::unique_ptr<const CarriedNormals> carried_;  // made when first used
};

}  // namespace lpdeform
