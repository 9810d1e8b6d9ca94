#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// OpenMesh's half-edges with double coordinates and what collapses need to know of deleted elements.
struct CollapsibleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};
using CollapsibleMesh = OpenMesh::TriMesh_ArrayKernelT<CollapsibleTraits>;

/// Faces at which the mesh is not a manifold are left out; vertices keep their numbers.
CollapsibleMesh to_collapsible(const TriangleMesh& mesh);

/// Whether the faces that stay when `half_edge` collapses into its target turn by no more than this cosine says.
bool keeps_orientation(const CollapsibleMesh& mesh, OpenMesh::SmartHalfedgeHandle half_edge, double cosine);

}  // namespace lpdeform
