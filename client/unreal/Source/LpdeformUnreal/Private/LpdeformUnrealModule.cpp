// Loads the C library from where the plugin has it: Windows does not look there by itself.
#include "HAL/PlatformProcess.h"
#include "Interfaces/IPluginManager.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"

class FLpdeformUnrealModule : public IModuleInterface {
 public:
  void StartupModule() override {
#if PLATFORM_WINDOWS
    const FString Folder = IPluginManager::Get().FindPlugin(TEXT("lpdeform"))->GetBaseDir();
    Library = FPlatformProcess::GetDllHandle(*FPaths::Combine(Folder, TEXT("Source/ThirdParty/LpdeformClient/Win64/liblpdeform_client.dll")));
    if (Library == nullptr) UE_LOG(LogTemp, Error, TEXT("lpdeform: liblpdeform_client.dll cannot be loaded from %s"), *Folder);
#endif
  }
  // The library is never unloaded: its threads keep running.

 private:
  void* Library = nullptr;
};

IMPLEMENT_MODULE(FLpdeformUnrealModule, LpdeformUnreal)
