#pragma once

#include <optional>

#include "CoreMinimal.h"

namespace UE::Geometry {

struct FIndex3i {
  int32 A = 0, B = 0, C = 0;
};

/// Numbers of vertices may have gaps.
class FDynamicMesh3 {
 public:
  int32 AppendVertex(const FVector3d& at) {
    vertices_.emplace_back(at);
    return MaxVertexID() - 1;
  }
  void RemoveVertex(int32 vertex) { vertices_[static_cast<std::size_t>(vertex)].reset(); }
  void AppendTriangle(int32 a, int32 b, int32 c) { triangles_.push_back({a, b, c}); }

  int32 MaxVertexID() const { return static_cast<int32>(vertices_.size()); }
  FVector3d GetVertex(int32 vertex) const { return vertices_[static_cast<std::size_t>(vertex)].value(); }
  void SetVertex(int32 vertex, const FVector3d& to) {
    vertices_[static_cast<std::size_t>(vertex)].value() = to;
  }
  FIndex3i GetTriangle(int32 triangle) const { return triangles_[static_cast<std::size_t>(triangle)]; }
  std::vector<int32> VertexIndicesItr() const {
    std::vector<int32> numbers;
    for (int32 k = 0; k < MaxVertexID(); ++k) {
      if (vertices_[static_cast<std::size_t>(k)]) numbers.push_back(k);
    }
    return numbers;
  }
  std::vector<int32> TriangleIndicesItr() const {
    std::vector<int32> numbers(triangles_.size());
    for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = static_cast<int32>(k);
    return numbers;
  }

 private:
  std::vector<std::optional<FVector3d>> vertices_;
  std::vector<FIndex3i> triangles_;
};

}  // namespace UE::Geometry
