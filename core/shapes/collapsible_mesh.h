#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// OpenMesh's half-edge mesh with double coordinates and the status attributes that edge collapses need.
struct CollapsibleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};
using CollapsibleMesh = OpenMesh::TriMesh_ArrayKernelT<CollapsibleTraits>;

/// Converts a mesh. Faces at which it is not a manifold are left out; vertices keep their numbers.
CollapsibleMesh to_collapsible(const TriangleMesh& mesh);

/// Whether, when `half_edge` collapses into its target, the remaining faces turn by no more than the angle with this
/// cosine.
bool keeps_orientation(const CollapsibleMesh& mesh, OpenMesh::SmartHalfedgeHandle half_edge, double cosine);

}  // namespace lpdeform
