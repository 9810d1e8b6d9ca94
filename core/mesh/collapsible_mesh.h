#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

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

}  // namespace lpdeform
