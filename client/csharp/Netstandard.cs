// Makes an assembly of Mono's compiler one for .NET Standard 2.1:   Netstandard.exe IN OUT
// Mono's compiler writes that types come from Mono's own libraries. .NET has all of them in "netstandard".

using System;
using System.Linq;
using Mono.Cecil;

static class Netstandard
{
    static bool IsOfMono(AssemblyNameReference library)
    {
        return library.Name == "mscorlib" || library.Name == "System" || library.Name == "System.Core";
    }

    static void Main(string[] arguments)
    {
        // Writing constants looks into the library that their enumerations come from. Mono's has them all.
        var resolver = new DefaultAssemblyResolver();
        resolver.ResolveFailure += (sender, name) => AssemblyDefinition.ReadAssembly(typeof(object).Assembly.Location);
        using (var assembly = AssemblyDefinition.ReadAssembly(arguments[0], new ReaderParameters { AssemblyResolver = resolver }))
        {
            var module = assembly.MainModule;
            var standard = new AssemblyNameReference("netstandard", new Version(2, 1, 0, 0))
            {
                PublicKeyToken = new byte[] { 0xcc, 0x7b, 0x13, 0xff, 0xcd, 0x2d, 0xdd, 0x51 }
            };
            var before = module.AssemblyReferences.Where(IsOfMono).ToArray();
            module.AssemblyReferences.Add(standard);
            foreach (var type in module.GetTypeReferences())
                if (before.Contains(type.Scope)) type.Scope = standard;
            foreach (var reference in before) module.AssemblyReferences.Remove(reference);
            var target = new TypeReference("System.Runtime.Versioning", "TargetFrameworkAttribute", module, standard);
            var made = new MethodReference(".ctor", module.TypeSystem.Void, target) { HasThis = true };
            made.Parameters.Add(new ParameterDefinition(module.TypeSystem.String));
            var attribute = new CustomAttribute(made);
            attribute.ConstructorArguments.Add(new CustomAttributeArgument(module.TypeSystem.String, ".NETStandard,Version=v2.1"));
            assembly.CustomAttributes.Add(attribute);
            assembly.SecurityDeclarations.Clear();  // "unsafe code", which .NET does not know
            assembly.Write(arguments[1]);
        }
    }
}
