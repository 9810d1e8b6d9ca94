// What Unreal's tool generates from the header's macros: the name of the base class.
#pragma once

#define GENERATED_BODY() using Super = UDynamicMeshComponent;
