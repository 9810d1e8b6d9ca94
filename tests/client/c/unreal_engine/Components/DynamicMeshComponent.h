#pragma once

#include "CoreMinimal.h"
#include "DynamicMesh/DynamicMesh3.h"

class AActor {};

namespace EEndPlayReason {
enum Type { Destroyed };
}
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction {
  bool bCanEverTick = false;
};

class UActorComponent {
 public:
  virtual ~UActorComponent() = default;
  virtual void BeginPlay() {}
  virtual void EndPlay(const EEndPlayReason::Type) {}
  virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
  void SetComponentTickEnabled(bool is_enabled) { is_ticking = is_enabled; }
  AActor* GetOwner() const { return nullptr; }
  FActorComponentTickFunction PrimaryComponentTick;
  bool is_ticking = false;
};

class USceneComponent : public UActorComponent {
 public:
  const FTransform& GetComponentTransform() const { return transform; }
  FTransform transform;
};

template <typename To>
To* Cast(UActorComponent* from) {
  return dynamic_cast<To*>(from);
}

struct FComponentReference {
  UActorComponent* GetComponent(AActor*) const { return component; }
  UActorComponent* component = nullptr;
};

enum class EDynamicMeshChangeType { GeneralEdit, MeshChange, MeshReplacementChange, MeshVertexChange };
enum class EDynamicMeshAttributeChangeFlags {
  Unknown = 0,
  MeshTopology = 1,
  VertexPositions = 2,
  NormalsTangents = 4,
  VertexColors = 8
};
inline EDynamicMeshAttributeChangeFlags operator|(EDynamicMeshAttributeChangeFlags a,
                                                  EDynamicMeshAttributeChangeFlags b) {
  return static_cast<EDynamicMeshAttributeChangeFlags>(static_cast<int>(a) | static_cast<int>(b));
}

class UDynamicMesh {
 public:
  void ProcessMesh(const std::function<void(const UE::Geometry::FDynamicMesh3&)>& work) const { work(mesh); }
  void EditMesh(const std::function<void(UE::Geometry::FDynamicMesh3&)>& work,
                EDynamicMeshChangeType = EDynamicMeshChangeType::GeneralEdit,
                EDynamicMeshAttributeChangeFlags = EDynamicMeshAttributeChangeFlags::Unknown, bool = false) {
    work(mesh);
  }
  UE::Geometry::FDynamicMesh3 mesh;
};

class UDynamicMeshComponent : public USceneComponent {
 public:
  UDynamicMesh* GetDynamicMesh() { return &mesh; }
  void FastNotifyPositionsUpdated(bool with_normals = false, bool with_colours = false, bool = false) {
    ++times_drawn;
    draws_normals = with_normals;
    draws_colours = with_colours;
  }
  UDynamicMesh mesh;
  int times_drawn = 0;
  bool draws_normals = false, draws_colours = false;
};
