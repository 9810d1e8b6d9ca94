// Like layout.c, for the assembly's own structs: their fields in order, by their names in C.

using System;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using Lpdeform;

static class Layout
{
    static void Tell(string name, Type type)
    {
        Console.WriteLine("{0} {1}", name, Marshal.SizeOf(type));
        var fields = type.GetFields(BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic);
        foreach (var field in fields.OrderBy(one => (long)Marshal.OffsetOf(type, one.Name)))
            Console.WriteLine("  {0} {1}", Snake(field.Name), Marshal.OffsetOf(type, field.Name));
    }

    /// "StructSize" is "struct_size".
    static string Snake(string name)
    {
        return Regex.Replace(name, "(?<!^)([A-Z])", "_$1").ToLowerInvariant();
    }

    static void Main()
    {
        Tell("Connection", typeof(Native.Connection));
        Tell("Attribute", typeof(Native.Attribute));
        Tell("Attribute", typeof(Native.Attribute));
        Tell("Mesh", typeof(Native.Mesh));
        Tell("Options", typeof(Native.Options));
        Tell("Motion", typeof(Native.Motion));
        Tell("SurfacePoint", typeof(SurfacePoint));
        Tell("Handle", typeof(Native.Handle));
        Tell("Settings", typeof(Native.Settings));
        Tell("Move", typeof(Native.Move));
        Tell("Update", typeof(Native.Update));
        Tell("Buffers", typeof(Native.Buffers));
        Tell("Frame", typeof(Native.Frame));
        Tell("SolveOptions", typeof(Native.SolveOptions));
        Tell("Resizing", typeof(Native.Resizing));
        Console.WriteLine("Error {0} {1}", LpdeformException.Size, LpdeformException.Size - 512);
    }
}
