// Like layout.c and the enumerations in run, for the assembly's own structs: their fields in order, by their names in C.

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

    /// As `enumerations` in run tells those of the header.
    static void TellNumbers(string name, Type type)
    {
        foreach (var value in Enum.GetValues(type))
            Console.WriteLine("{0} {1} {2}", name, Snake(value.ToString()).ToUpperInvariant(), (int)value);
    }

    static void Main()
    {
        TellNumbers("encoding", typeof(FrameEncoding));
        TellNumbers("weights", typeof(Weights));
        TellNumbers("free_components", typeof(FreeComponents));
        TellNumbers("state", typeof(SessionState));
        TellNumbers("notice", typeof(NoticeReason));
        TellNumbers("hold", typeof(Hold));
        TellNumbers("method", typeof(Method));
        TellNumbers("stop_reason", typeof(StopReason));
        Tell("Connection", typeof(Native.Connection));
        Tell("Attribute", typeof(Native.Attribute));
        Tell("Attribute", typeof(Native.Attribute));
        Tell("Mesh", typeof(Native.Mesh));
        Tell("Options", typeof(Native.Options));
        Tell("Motion", typeof(Native.Motion));
        Tell("SurfacePoint", typeof(SurfacePoint));
        Tell("Handle", typeof(Native.Handle));
        Tell("Settings", typeof(Native.Settings));
        Tell("BetterShape", typeof(Native.BetterShape));
        Tell("Move", typeof(Native.Move));
        Tell("Update", typeof(Native.Update));
        Tell("Buffers", typeof(Native.Buffers));
        Tell("Frame", typeof(Native.Frame));
        Tell("SolveOptions", typeof(Native.SolveOptions));
        Tell("Search", typeof(Native.Search));
        Tell("Resizing", typeof(Native.Resizing));
        Console.WriteLine("Error {0} {1}", LpdeformException.Size, LpdeformException.Size - 512);
    }
}
