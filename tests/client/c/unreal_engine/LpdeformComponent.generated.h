// What Unreal's tool makes of the header's marks: the name of the class before.
#pragma once

#define GENERATED_BODY() using Super = UDynamicMeshComponent;
