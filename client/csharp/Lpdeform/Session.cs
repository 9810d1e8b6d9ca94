using System;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// A mesh that deforms on a server while its handles are moved. Nothing here waits but Settle. Members may be used from
    /// any thread, except that Dispose must not overlap another.
    public sealed unsafe class Session : IDisposable
    {
        IntPtr session;
        readonly byte[] frameError = LpdeformException.NewError();

        internal Session(IntPtr session)
        {
            this.session = session;
            Handles = new Handles(this);
        }

        /// What the user holds.
        public Handles Handles { get; }

        internal IntPtr Pointer
        {
            get
            {
                if (session == IntPtr.Zero) throw new ObjectDisposedException("Lpdeform.Session");
                return session;
            }
        }

        /// 0 while a session that was joined is not there yet.
        public int VertexCount
        {
            get { return (int)Native.lpdeform_vertex_count(Pointer); }
        }

        public SessionState State
        {
            get { return (SessionState)Native.lpdeform_session_state(Pointer, null); }
        }

        /// Why the session is not live; null where there is nothing to say.
        public LpdeformException Problem
        {
            get
            {
                var error = LpdeformException.NewError();
                Native.lpdeform_session_state(Pointer, error);
                return LpdeformException.From(error);
            }
        }

        /// "sessions/...", for Client.Join.
        public string Name
        {
            get
            {
                var name = new byte[64];
                var error = LpdeformException.NewError();
                LpdeformException.Check(Native.lpdeform_session_name(Pointer, name, (UIntPtr)(uint)name.Length, error), error);
                return System.Text.Encoding.UTF8.GetString(name, 0, Array.IndexOf(name, (byte)0));
            }
        }

        /// p and stiffness, the same everywhere; 0 leaves one as it is. Returns the change's number.
        public ulong Set(double p = 0, double stiffness = 0)
        {
            return Set(new Native.Settings { P = p, Stiffness = stiffness });
        }

        /// p and stiffness, one a vertex; null leaves one as it is. Returns the change's number.
        public ulong SetPerVertex(double[] p, double[] stiffness = null)
        {
            using (var pinned = new Pinned())
            {
                return Set(new Native.Settings
                {
                    PPerVertex = pinned.Array(p),
                    PCount = p == null ? 0u : (uint)p.Length,
                    StiffnessPerVertex = pinned.Array(stiffness),
                    StiffnessCount = stiffness == null ? 0u : (uint)stiffness.Length
                });
            }
        }

        ulong Set(Native.Settings settings)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            settings.StructSize = (uint)Marshal.SizeOf(typeof(Native.Settings));
            LpdeformException.Check(Native.lpdeform_set(Pointer, ref settings, out inputSeq, error), error);
            return inputSeq;
        }

        /// Takes the newest frame that was not taken yet: x, y, z of each vertex, in the engine's coordinates. False where there is
        /// none; nothing is written then. Throws what the server had to say about a change, once, and why the session is over.
        public bool TryGetFrame(Span<float> positions)
        {
            Frame frame;
            return TryGetFrame(positions, out frame);
        }

        public bool TryGetFrame(Span<float> positions, out Frame frame)
        {
            return TryGetFrame(positions, default(Span<float>), default(Span<byte>), out frame);
        }

        /// The same with x, y, z of each vertex's normal (needs SessionOptions.WithNormals) and r, g, b, a of its distortion as a
        /// colour; empty: not wanted.
        public bool TryGetFrame(Span<float> positions, Span<float> normals, Span<byte> colours, out Frame frame)
        {
            return Write(positions, normals, colours, out frame, Asked.New, 0);
        }

        /// Writes the frame taken last once more. False where none was taken.
        public bool TryRepeatFrame(Span<float> positions, Span<float> normals, Span<byte> colours, out Frame frame)
        {
            return Write(positions, normals, colours, out frame, Asked.Last, 0);
        }

        /// Waits until the finished result of the newest change has come, and writes it: for tools and loading screens.
        public Frame Settle(Span<float> positions, double timeoutSeconds = 60)
        {
            Frame frame;
            Write(positions, default(Span<float>), default(Span<byte>), out frame, Asked.Result, timeoutSeconds);
            return frame;
        }

        enum Asked { New, Last, Result }

        bool Write(Span<float> positions, Span<float> normals, Span<byte> colours, out Frame frame, Asked asked, double timeout)
        {
            var native = new Native.Frame { StructSize = (uint)sizeof(Native.Frame) };
            int code;
            // Settle does not keep others from a frame meanwhile.
            var error = asked == Asked.Result ? LpdeformException.NewError() : frameError;
            fixed (float* positionsAt = &MemoryMarshal.GetReference(positions))
            fixed (float* normalsAt = &MemoryMarshal.GetReference(normals))
            fixed (byte* coloursAt = &MemoryMarshal.GetReference(colours))
            {
                var buffers = new Native.Buffers { StructSize = (uint)sizeof(Native.Buffers) };
                buffers.Positions.Data = (IntPtr)positionsAt;
                buffers.Positions.Bytes = (UIntPtr)(4UL * (ulong)positions.Length);
                buffers.Normals.Data = (IntPtr)normalsAt;
                buffers.Normals.Bytes = (UIntPtr)(4UL * (ulong)normals.Length);
                buffers.Colours.Data = (IntPtr)coloursAt;
                buffers.Colours.Bytes = (UIntPtr)(ulong)colours.Length;
                buffers.Colours.Format = Rgba8;
                lock (error)
                {
                    code = Call(asked, timeout, ref buffers, ref native, error);
                    if (code != Native.Ok && code != Native.NoFrame) throw LpdeformException.From(error);
                }
            }
            frame = Frame.From(native);
            return code == Native.Ok;
        }

        const int Rgba8 = 5;

        int Call(Asked asked, double timeout, ref Native.Buffers buffers, ref Native.Frame frame, byte[] error)
        {
            if (asked == Asked.New) return Native.lpdeform_poll(Pointer, ref buffers, ref frame, error);
            if (asked == Asked.Last) return Native.lpdeform_repeat(Pointer, ref buffers, ref frame, error);
            return Native.lpdeform_settle(Pointer, timeout, ref buffers, ref frame, error);
        }

        /// The session is over; its end on the server goes on by itself.
        public void Dispose()
        {
            var closing = session;
            session = IntPtr.Zero;
            Native.lpdeform_close(closing);
        }
    }
}
