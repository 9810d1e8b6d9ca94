#include "server/given/surface.h"

#include <utility>

#include "core/base/workers.h"
#include "core/mesh/report.h"

namespace lpdeform {

absl::Status make_surface(GivenSurface given, const Workers& workers, SessionParts& parts) {
  auto shape =
      RestShape::create(given.weld ? welded(given.mesh, *given.weld) : given.mesh, given.weights, workers);
  if (!shape.ok() && given.weld) {
    if (absl::Status status = deformable(check_mesh(given.mesh)); !status.ok()) return status;
  }
  if (!shape.ok()) return shape.status();
  parts.shape = *std::move(shape);
  parts.mesh = std::make_shared<const DrawMesh>(parts.shape, std::move(given.weld),
                                                std::move(given.mesh.faces), std::move(given.normals));
  return absl::OkStatus();
}

absl::Status make_deformer(int threads, std::function<absl::Status(std::size_t bytes)> admit,
                           SessionParts& parts) {
  auto deformer = Deformer::create(
      parts.shape, {.free_components = parts.free_components, .threads = threads, .admit = std::move(admit)});
  if (!deformer.ok()) return deformer.status();
  parts.deformer = *std::move(deformer);
  parts.features = std::make_shared<const ShapeFeatures>(parts.shape, Workers(threads));
  return absl::OkStatus();
}

}  // namespace lpdeform
