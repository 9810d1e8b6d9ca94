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
enum class EDynamicMeshAttributeChangeFlags { Unknown, MeshTopology, VertexPositions };

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
  void FastNotifyPositionsUpdated(bool = false, bool = false, bool = false) { ++times_drawn; }
  UDynamicMesh mesh;
  int times_drawn = 0;
};
