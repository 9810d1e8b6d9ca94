using System.IO;
using UnrealBuildTool;

public class LpdeformUnreal : ModuleRules
{
    public LpdeformUnreal(ReadOnlyTargetRules Target) : base(Target)
    {
        PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
        bEnableExceptions = true;  // LpdeformFollower's constructor throws
        PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "GeometryCore", "GeometryFramework" });
        PrivateDependencyModuleNames.Add("Projects");  // IPluginManager

        string client = Path.GetFullPath(Path.Combine(ModuleDirectory, "..", "ThirdParty", "LpdeformClient"));
        PublicSystemIncludePaths.Add(Path.Combine(client, "include"));
        string folder = Path.Combine(client, Target.Platform.ToString());
        if (Target.Platform == UnrealTargetPlatform.Win64)
        {
            PublicAdditionalLibraries.Add(Path.Combine(folder, "lpdeform_client.lib"));
            PublicDelayLoadDLLs.Add("liblpdeform_client.dll");
            RuntimeDependencies.Add(Path.Combine(folder, "liblpdeform_client.dll"));
        }
        else if (Target.Platform == UnrealTargetPlatform.Mac)
        {
            PublicAdditionalLibraries.Add(Path.Combine(folder, "liblpdeform_client.1.dylib"));
            RuntimeDependencies.Add(Path.Combine(folder, "liblpdeform_client.1.dylib"));
        }
        else if (Target.Platform == UnrealTargetPlatform.Linux || Target.Platform == UnrealTargetPlatform.LinuxArm64)
        {
            PublicAdditionalLibraries.Add(Path.Combine(folder, "liblpdeform_client.so"));
            PublicRuntimeLibraryPaths.Add(folder);
            RuntimeDependencies.Add(Path.Combine(folder, "liblpdeform_client.so.1"));
        }
        else
        {
            throw new BuildException("lpdeform has no library for {0}", Target.Platform);
        }
    }
}
