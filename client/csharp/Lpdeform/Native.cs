// The C interface (client/c/lpdeform.h) as it is; nothing outside this assembly uses it. Every struct is blittable and laid out
// as in C; tests/csharp compares the two.

using System;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    static class Native
    {
        const string Library = "lpdeform_client";
        const CallingConvention C = CallingConvention.Cdecl;

        public const int Ok = 0, NoFrame = 100;

        [StructLayout(LayoutKind.Sequential)]
        public struct Connection
        {
            public uint StructSize, Tls;
            public IntPtr Address, RootCertificates, CertificateChain, PrivateKey, Token;
            public double ConnectTimeoutSeconds, CallTimeoutSeconds, ReconnectSeconds;
        }

        /// lpdeform_source and lpdeform_target.
        [StructLayout(LayoutKind.Sequential)]
        public struct Attribute
        {
            public IntPtr Data;
            public UIntPtr Bytes;
            public uint Offset, Stride;
            public int Format;
            public uint Reserved;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Mesh
        {
            public uint StructSize, VertexCount;
            public Attribute Positions, Normals;
            public IntPtr Indices;
            public uint IndexCount;
            public int IndexFormat;
            public uint WeldByPosition, Reserved;
            public IntPtr WeldGroups;
            public double WeldTolerance;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Options
        {
            public uint StructSize;
            public int Handedness, Up, Winding;
            public double UnitsPerMetre;
            public int Weights, FreeComponents, Encoding, LowestEncoding;
            public uint WithNormals, WithoutDistortion, DoublePrecision, Certify, Credit, Reserved;
            public double MaxFramesPerSecond;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Motion
        {
            public int Kind;
            public uint PositionCount;
            public Quaternion4 Rotation;
            public Vector3d Center, Translation;
            public IntPtr Positions;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Handle
        {
            public uint StructSize;
            public int Hold;
            public IntPtr Name, Vertices, Points;
            public uint VertexCount, PointCount;
            public Motion Motion;
            public double Weight;
            public Vector3d Direction;
            public double Footprint;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Settings
        {
            public uint StructSize, PCount;
            public double P;
            public IntPtr PPerVertex;
            public double PAutomatic, Stiffness;
            public IntPtr StiffnessPerVertex;
            public double StiffnessAutomatic;
            public uint StiffnessCount, Reserved;
            public double LengthUnit;
            public uint SetSolver;
            public int Method;
            public double Tolerance, TimeLimitSeconds;
            public uint MaxIterations, SetRegion;
            public IntPtr Region;
            public uint RegionCount, ReservedToo;
            public uint SetSearch;
            public int SearchEffort;
            public double SearchLeastShare;
            public uint SearchShows, ReservedSearch;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct BetterShape
        {
            public uint StructSize, Reserved;
            public ulong InputSeq;
            public double Energy, SavedShare;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Move
        {
            public IntPtr Name;
            public Motion Motion;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Update
        {
            public uint StructSize, SetCount;
            public IntPtr Sets, Moves, Removals;
            public uint MoveCount, RemovalCount;
            public IntPtr Settings;
            public uint BeginsStep, Reserved;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Buffers
        {
            public uint StructSize, Reserved;
            public Attribute Positions, Normals, Colours, Distortion;
            public double RedDistortion;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Frame
        {
            public uint StructSize, VertexCount;
            public ulong InputSeq, FrameSeq, Epoch, SkippedInputs;
            public uint Iteration, IsFinal;
            public int StopReason;
            public uint HasOptimalityGap;
            public double Energy, SoftEnergy, SolveSeconds, OptimalityGap, RedDistortion;
            public Vector3d Origin, Extent;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct SolveOptions
        {
            public uint StructSize, Certify;
            public double TimeoutSeconds;
            public IntPtr Search;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Search
        {
            public uint StructSize, MinimaCapacity;
            public IntPtr Minima;
            public uint MinimaCount, FurtherStarts, SearchIterations, Effort;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Resizing
        {
            public uint StructSize, SetOrigin, SetAxes, Reserved;
            public Vector3d Scale, Origin, XAxis, YAxis;
        }

        // An error is passed as the bytes of lpdeform_error: see LpdeformException.

        [DllImport(Library, CallingConvention = C)]
        public static extern uint lpdeform_abi();
        [DllImport(Library, CallingConvention = C)]
        public static extern IntPtr lpdeform_version();
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_connect(ref Connection connection, out IntPtr client, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_set_token(IntPtr client, IntPtr token, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern void lpdeform_disconnect(IntPtr client);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_open(IntPtr client, ref Mesh mesh, ref Options options, out IntPtr session, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_join(IntPtr client, IntPtr name, int role, ref Options options, out IntPtr session,
                                               byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_restore(IntPtr client, byte[] data, UIntPtr bytes, ref Options options, out IntPtr session,
                                                  byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_take_snapshot(IntPtr session, out IntPtr snapshot, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern IntPtr lpdeform_snapshot_data(IntPtr snapshot, out UIntPtr bytes);
        [DllImport(Library, CallingConvention = C)]
        public static extern void lpdeform_free_snapshot(IntPtr snapshot);
        [DllImport(Library, CallingConvention = C)]
        public static extern void lpdeform_close(IntPtr session);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_session_state(IntPtr session, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_session_notice(IntPtr session, byte[] text, UIntPtr bytes);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_session_better_shape(IntPtr session, ref BetterShape better, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_take_better_shape(IntPtr session, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_session_name(IntPtr session, byte[] name, UIntPtr bytes, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern uint lpdeform_vertex_count(IntPtr session);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_send(IntPtr session, ref Update update, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_set_handle(IntPtr session, ref Handle handle, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_move_handle(IntPtr session, byte[] name, ref Motion motion, out ulong inputSeq,
                                                      byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_remove_handle(IntPtr session, byte[] name, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_set(IntPtr session, ref Settings settings, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_resize(IntPtr session, ref Resizing resizing, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_undo(IntPtr session, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_redo(IntPtr session, out ulong inputSeq, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_poll(IntPtr session, ref Buffers buffers, ref Frame frame, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_repeat(IntPtr session, ref Buffers buffers, ref Frame frame, byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_settle(IntPtr session, double timeoutSeconds, ref Buffers buffers, ref Frame frame,
                                                 byte[] error);
        [DllImport(Library, CallingConvention = C)]
        public static extern int lpdeform_solve(IntPtr session, ref SolveOptions options, ref Buffers buffers, ref Frame frame,
                                                byte[] error);
    }
}
