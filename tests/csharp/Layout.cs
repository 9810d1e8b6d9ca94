// The same as layout.c, of the assembly's own structs.

using System;
using System.Runtime.InteropServices;
using Lpdeform;

static class Layout
{
    static void Tell(string name, Type type, string last)
    {
        Console.WriteLine("{0} {1} {2}", name, Marshal.SizeOf(type), Marshal.OffsetOf(type, last));
    }

    static void Main()
    {
        Tell("Connection", typeof(Native.Connection), "ReconnectSeconds");
        Tell("Attribute", typeof(Native.Attribute), "Reserved");
        Tell("Attribute", typeof(Native.Attribute), "Reserved");
        Tell("Mesh", typeof(Native.Mesh), "WeldGroups");
        Tell("Options", typeof(Native.Options), "MaxFramesPerSecond");
        Tell("Motion", typeof(Native.Motion), "Positions");
        Tell("Handle", typeof(Native.Handle), "Footprint");
        Tell("Settings", typeof(Native.Settings), "ReservedToo");
        Tell("Buffers", typeof(Native.Buffers), "RedDistortion");
        Tell("Frame", typeof(Native.Frame), "Extent");
        Console.WriteLine("Error {0} {1}", LpdeformException.Size, LpdeformException.Size - 512);
    }
}
