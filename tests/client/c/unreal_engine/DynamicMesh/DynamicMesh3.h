#pragma once

#include <map>
#include <optional>

#include "CoreMinimal.h"

namespace UE::Geometry {

struct FIndex3i {
  FIndex3i() = default;
  FIndex3i(int32 a, int32 b, int32 c) : A(a), B(b), C(c) {}
  int32 A = 0, B = 0, C = 0;
};

/// Values at corners of triangles. An element belongs to one vertex of the mesh.
template <typename Value>
class TDynamicMeshOverlay {
 public:
  void ClearElements() { *this = {}; }
  int32 AppendElement(const Value& value) {
    elements_.push_back(value);
    parents_.push_back(-1);
    return MaxElementID() - 1;
  }
  int32 MaxElementID() const { return static_cast<int32>(elements_.size()); }
  std::vector<int32> ElementIndicesItr() const {
    std::vector<int32> numbers(elements_.size());
    for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = static_cast<int32>(k);
    return numbers;
  }
  Value GetElement(int32 element) const { return elements_.at(static_cast<std::size_t>(element)); }
  void SetElement(int32 element, const Value& value) {
    elements_.at(static_cast<std::size_t>(element)) = value;
  }
  int32 GetParentVertex(int32 element) const { return parents_.at(static_cast<std::size_t>(element)); }
  bool IsSetTriangle(int32 triangle) const { return triangles_.count(triangle) != 0; }
  FIndex3i GetTriangle(int32 triangle) const { return triangles_.at(triangle); }
  void SetTriangle(int32 triangle, const FIndex3i& elements) { triangles_[triangle] = elements; }
  void set_parent(int32 element, int32 vertex) { parents_.at(static_cast<std::size_t>(element)) = vertex; }

 private:
  std::vector<Value> elements_;
  std::vector<int32> parents_;
  std::map<int32, FIndex3i> triangles_;
};
using FDynamicMeshNormalOverlay = TDynamicMeshOverlay<FVector3f>;
using FDynamicMeshColorOverlay = TDynamicMeshOverlay<FVector4f>;

class FDynamicMeshAttributeSet {
 public:
  FDynamicMeshNormalOverlay* PrimaryNormals() { return &normals_; }
  const FDynamicMeshNormalOverlay* PrimaryNormals() const { return &normals_; }
  void EnablePrimaryColors() {
    if (!colours_) colours_.emplace();
  }
  FDynamicMeshColorOverlay* PrimaryColors() { return colours_ ? &*colours_ : nullptr; }

 private:
  FDynamicMeshNormalOverlay normals_;
  std::optional<FDynamicMeshColorOverlay> colours_;
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

  void EnableAttributes() {
    if (!attributes_) attributes_.emplace();
  }
  bool HasAttributes() const { return attributes_.has_value(); }
  FDynamicMeshAttributeSet* Attributes() { return &attributes_.value(); }
  const FDynamicMeshAttributeSet* Attributes() const { return &attributes_.value(); }

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
  std::optional<FDynamicMeshAttributeSet> attributes_;
};

}  // namespace UE::Geometry
