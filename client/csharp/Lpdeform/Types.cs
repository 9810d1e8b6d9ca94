using System;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// A triangle mesh as an engine has it; vertices may be split along seams.
    public sealed class MeshData
    {
        /// x, y, z of each vertex.
        public float[] Positions;
        /// Three 0-based vertex indices per triangle.
        public int[] Indices;
        /// x, y, z of each vertex's normal as drawn at rest; null: smooth ones.
        public float[] Normals;
        /// Whether vertices in the same place are one.
        public bool WeldByPosition;
        /// The largest distance of such vertices as a share of the bounding box's diagonal, 0 to 0.001; 0 takes the server's,
        /// 1e-6.
        public double WeldTolerance;
        /// Instead of that, one number per vertex: vertices with the same number are one.
        public int[] WeldGroups;
    }

    public enum FrameEncoding { Raw, Quantized, Compressed }
    public enum Weights { Cotangent, Uniform, IntrinsicDelaunay }
    public enum FreeComponents { Error, Stay, Follow }

    /// How a session is opened. The engine's coordinates are Unity's by default.
    public sealed class SessionOptions
    {
        public bool LeftHanded = true;
        public bool ZUp = false;
        public double UnitsPerMetre = 1;
        public Weights Weights;
        public FreeComponents FreeComponents;
        public FrameEncoding Encoding;
        /// The least precise encoding that a server may use to keep its limit of bytes per second.
        public FrameEncoding LowestEncoding;
        public bool WithoutDistortion;
        /// How many frames may be under way and not yet taken, 1 to 8; 0 takes 2.
        public int Credit;
        public bool WithNormals;
        /// Whether raw frames are sent as float64.
        public bool DoublePrecision;
        public bool Certify;
        /// 0: without limit.
        public double MaxFramesPerSecond;

        internal Native.Options ToNative()
        {
            return new Native.Options
            {
                StructSize = (uint)Marshal.SizeOf(typeof(Native.Options)),
                Handedness = LeftHanded ? 1 : 0,
                Up = ZUp ? 1 : 0,
                UnitsPerMetre = UnitsPerMetre,
                Weights = (int)Weights,
                FreeComponents = (int)FreeComponents,
                Encoding = (int)Encoding,
                LowestEncoding = (int)LowestEncoding,
                WithoutDistortion = WithoutDistortion ? 1u : 0u,
                Credit = (uint)Credit,
                WithNormals = WithNormals ? 1u : 0u,
                DoublePrecision = DoublePrecision ? 1u : 0u,
                Certify = Certify ? 1u : 0u,
                MaxFramesPerSecond = MaxFramesPerSecond
            };
        }
    }

    public enum Method { Auto, QuasiNewton, LineSearch, LocalGlobal, Conic, Multiresolution }

    /// How solves are made and when they stop; 0 takes the server's default.
    public struct SolverSettings
    {
        public Method Method;
        public double Tolerance;
        public int MaxIterations;
        /// 0 is without limit.
        public double TimeLimitSeconds;
        /// null: all its fields have their defaults.
        public MinimaSearch? Search;
    }

    /// How far to look for lower minima once the first one is found: below p = 2 the energy has many.
    public struct MinimaSearch
    {
        /// The number of further starts is 12 times the effort, 0 to 1000. 0 takes the first minimum. null: 1 if Method is Auto and
        /// p is below 2 somewhere, and for Solve if it also starts cold; otherwise 0. A start takes up to two or three times as long
        /// as the first minimum. Meshes of fewer than 100 vertices are not searched. Meshes of more than 15,000 vertices are
        /// searched on their coarse levels, and only what is lower there is tried on the mesh itself, as one further start.
        ///
        /// Solve searches with what is left of its limits, before it returns. A session searches when nothing changes for a second.
        /// Solve makes it forget the shape that it has announced: TakeBetterShape then fails with NO_BETTER_SHAPE, and the session
        /// searches again.
        public int? Effort;
        /// What the session does with a lower minimum that it has found then. False: NoticeReason.BetterShape announces it, and
        /// TakeBetterShape shows it. True: it is shown at once, as a new frame for the same change.
        public bool Show;
        /// The share of the energy that must be saved for this, up to 1; 0 means 0.02.
        public double LeastShare;
    }

    /// What Session.Solve has searched. Frame.OptimalityGap does not say it: it is about the rotations of the result, and another
    /// minimum may be lower.
    public struct SearchReport
    {
        /// The energies of minima, in order: the first one, then one for each start of the search for lower ones that has
        /// converged, or has come back to the lowest minimum, whose energy it then has. Several starts may come to the same minimum.
        /// Frame.Energy is the lowest. Empty if a limit has ended the solve before the first, and with a server that is older than
        /// the search.
        public double[] Minima;
        /// Of the search, including those that were given up, which have no energy.
        public int FurtherStarts;
        /// The part of Frame.Iteration that the search made.
        public int Iterations;
        /// MinimaSearch.Effort, or its default.
        public int Effort;
    }

    /// Where a handle moves; always relative to the mesh at rest.
    public struct Motion
    {
        /// Rotates about Center, then moves by Translation.
        public Quaternion4 Rotation;
        public Vector3d Center, Translation;

        public static Motion Move(double x, double y, double z)
        {
            return new Motion { Translation = new Vector3d(x, y, z) };
        }

        internal Native.Motion ToNative()
        {
            return new Native.Motion { Kind = 1, Rotation = Rotation, Center = Center, Translation = Translation };
        }
    }

    /// A point inside a face: barycentric coordinates times the face's corners in their order; their sum is 1.
    [StructLayout(LayoutKind.Sequential)]
    public struct SurfacePoint
    {
        public uint Face;
        uint reserved;
        public Vector3d Barycentric;

        public SurfacePoint(uint face, double first, double second, double third)
        {
            Face = face;
            reserved = 0;
            Barycentric = new Vector3d(first, second, third);
        }
    }

    public enum Hold { Exactly, Soft, Orientation, AxisLock, PlaneLock }

    /// How a handle is held.
    public struct HoldOptions
    {
        public Hold Hold;
        /// For Soft (0: 1) and Orientation (0: 100).
        public double Weight;
        /// For AxisLock and PlaneLock.
        public Vector3d Direction;
        /// Radius of a region around the handle that moves with it nearly rigidly.
        public double Footprint;
    }

    /// Where to write a frame; an empty span is not written.
    public ref struct FrameBuffers
    {
        /// x, y, z of each vertex, in the engine's coordinates.
        public Span<float> Positions;
        /// x, y, z of each vertex's normal; needs SessionOptions.WithNormals.
        public Span<float> Normals;
        /// r, g, b, a of each vertex: its distortion, from blue (none) to red.
        public Span<byte> Colours;
        /// E_i of each vertex, lengths in metres.
        public Span<float> Distortion;
    }

    public enum SessionState { Connecting, Live, Reconnecting, Refused }
    public enum NoticeReason { None, Overloaded, Recovered, Other, Mesh, BetterShape }

    /// What a server says about itself or about the mesh; nothing has failed.
    public struct Notice
    {
        /// None: no notice on the present connection. After Overloaded frames come less often, and the last frame of a change
        /// comes later, until Recovered. Other: from a newer server. Mesh: the mesh is split and comes apart there, until another
        /// notice comes. BetterShape: a shape of lower energy is known for the newest change, until it is shown, a frame for a
        /// later change comes, or Session.Solve ends; see Session.TakeBetterShape.
        public NoticeReason Reason;
        /// One sentence for people.
        public string Text;
        /// Of BetterShape: the change, the energy of the shape, and the share of the present energy that it saves, 0 to 1.
        public ulong InputSeq;
        public double Energy, SavedShare;
    }

    public enum StopReason { Running, Converged, IterationLimit, TimeLimit, Cancelled, Stalled, NumericalBreakdown }

    /// The properties of a frame.
    public struct Frame
    {
        public int VertexCount;
        /// The newest change that it answers: see Handles.
        public ulong InputSeq;
        public int Iteration;
        /// Whether this is the result, however its solve ended (StopReason). No further frame comes until there is a new change,
        /// except this one again with its OptimalityGap, and a better shape that is taken or shown.
        public bool IsFinal;
        public StopReason StopReason;
        /// Lengths in metres.
        public double Energy;
        public double SolveSeconds;
        /// Only for results, and if it was requested (SessionOptions.Certify).
        public double? OptimalityGap;
        /// The distortion that the colours show as red.
        public double RedDistortion;

        internal static Frame From(Native.Frame frame)
        {
            return new Frame
            {
                VertexCount = (int)frame.VertexCount,
                InputSeq = frame.InputSeq,
                Iteration = (int)frame.Iteration,
                IsFinal = frame.IsFinal != 0,
                StopReason = (StopReason)frame.StopReason,
                Energy = frame.Energy,
                SolveSeconds = frame.SolveSeconds,
                OptimalityGap = frame.HasOptimalityGap != 0 ? frame.OptimalityGap : (double?)null,
                RedDistortion = frame.RedDistortion
            };
        }
    }
}
