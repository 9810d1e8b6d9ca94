using System.Reflection;

[assembly: AssemblyTitle("Lpdeform")]
[assembly: AssemblyDescription("L_p shape deformation on an lpdeform server")]
[assembly: AssemblyVersion("0.1.0")]
