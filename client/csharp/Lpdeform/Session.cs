using System;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// A mesh that deforms on a server while its handles are moved. Only Settle, Solve, Undo, Redo, Snapshot and
    /// TakeBetterShape wait. Members may be used from any thread, except that Dispose must not overlap another call.
    public sealed unsafe class Session : IDisposable
    {
        IntPtr session;
        readonly byte[] frameError = LpdeformException.NewError();

        internal Session(IntPtr session)
        {
            this.session = session;
            Handles = new Handles(() => Pointer);
        }

        /// The handles that the user moves.
        public Handles Handles { get; }

        internal IntPtr Pointer
        {
            get
            {
                if (session == IntPtr.Zero) throw new ObjectDisposedException("Lpdeform.Session");
                return session;
            }
        }

        /// 0 until a joined session is there.
        public int VertexCount
        {
            get { return (int)Native.lpdeform_vertex_count(Pointer); }
        }

        public SessionState State
        {
            get { return (SessionState)Native.lpdeform_session_state(Pointer, null); }
        }

        /// Why the session is not live; null if there is no problem.
        public LpdeformException Problem
        {
            get
            {
                var error = LpdeformException.NewError();
                Native.lpdeform_session_state(Pointer, error);
                return LpdeformException.From(error);
            }
        }

        /// That of a better shape while it applies, otherwise the server's last notice about itself.
        public Notice Notice
        {
            get
            {
                var better = NewBetterShape();
                Native.lpdeform_session_better_shape(Pointer, ref better, null);
                var text = new byte[512];
                var reason = (NoticeReason)Native.lpdeform_session_notice(Pointer, text, (UIntPtr)(uint)text.Length);
                if (reason != NoticeReason.BetterShape) better = NewBetterShape();
                else if (better.SavedShare == 0) Native.lpdeform_session_better_shape(Pointer, ref better, null);  // it came just now
                return new Notice
                {
                    Reason = reason, Text = System.Text.Encoding.UTF8.GetString(text, 0, Array.IndexOf(text, (byte)0)),
                    InputSeq = better.InputSeq, Energy = better.Energy, SavedShare = better.SavedShare
                };
            }
        }

        static Native.BetterShape NewBetterShape()
        {
            return new Native.BetterShape { StructSize = (uint)sizeof(Native.BetterShape) };
        }

        /// Notice has changed, also where a still better shape is known. Raised by TryGetFrame, before it looks for a frame, on the thread that calls it.
        public event Action<Notice> Noticed;

        Notice noticed;

        bool IsNoticed(NoticeReason reason, ulong inputSeq, double energy)
        {
            return noticed.Reason == reason && noticed.InputSeq == inputSeq && noticed.Energy == energy;
        }

        void TellNotice()
        {
            var told = Noticed;
            if (told == null) return;
            var better = NewBetterShape();
            Native.lpdeform_session_better_shape(Pointer, ref better, null);
            var reason = (NoticeReason)Native.lpdeform_session_notice(Pointer, null, UIntPtr.Zero);
            if (IsNoticed(reason, better.InputSeq, better.Energy)) return;
            var notice = Notice;
            if (IsNoticed(notice.Reason, notice.InputSeq, notice.Energy)) return;
            if (notice.Reason == NoticeReason.BetterShape && notice.SavedShare == 0) return;  // it has just gone
            noticed = notice;
            told(notice);
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

        /// Sets p and stiffness, the same everywhere; 0 keeps the present value. Returns the change's number.
        public ulong Set(double p = 0, double stiffness = 0)
        {
            return Set(new Native.Settings { P = p, Stiffness = stiffness });
        }

        /// Sets p and stiffness from the geometry, with a strength of up to 1; 0 keeps the present value. Returns the change's
        /// number.
        public ulong SetAutomatic(double p = 0, double stiffness = 0)
        {
            return Set(new Native.Settings { PAutomatic = p, StiffnessAutomatic = stiffness });
        }

        /// Replaces all solver settings. Returns the change's number.
        public ulong SetSolver(SolverSettings solver)
        {
            var search = solver.Search ?? new MinimaSearch();
            var effort = search.Effort ?? 1;
            if (effort <= 0) --effort;  // C has -1 for none and 0 for the default, and refuses what is below
            return Set(new Native.Settings
            {
                SetSearch = solver.Search == null ? 0u : 1u, SearchEffort = search.Effort == null ? 0 : effort,
                SearchShows = search.Show ? 1u : 0u, SearchLeastShare = search.LeastShare,
                SetSolver = 1, Method = (int)solver.Method, Tolerance = solver.Tolerance, MaxIterations = (uint)solver.MaxIterations,
                TimeLimitSeconds = solver.TimeLimitSeconds
            });
        }

        /// Sets the unit of length for mixed norms; a negative value restores the mean edge length. Returns the change's number.
        public ulong SetLengthUnit(double lengthUnit)
        {
            return Set(new Native.Settings { LengthUnit = lengthUnit });
        }

        /// Lets only these vertices move from now on; null: all. Returns the change's number.
        public ulong SetRegion(int[] vertices)
        {
            using (var pinned = new Pinned())
            {
                return Set(new Native.Settings
                {
                    SetRegion = 1, Region = pinned.Array(vertices), RegionCount = vertices == null ? 0u : (uint)vertices.Length
                });
            }
        }

        /// Sets p and stiffness, one value per vertex; null keeps the present values. Returns the change's number.
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

        /// Scales the mesh along the engine's axes, each by 0.01 to 100; salient parts keep their shape and size. Sets the handle
        /// "resize", p and stiffness: to end it, remove that handle and set these. Returns the change's number.
        public ulong Resize(double x, double y, double z)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            var resizing = new Native.Resizing
            {
                StructSize = (uint)sizeof(Native.Resizing), Scale = new Vector3d(x, y, z)
            };
            LpdeformException.Check(Native.lpdeform_resize(Pointer, ref resizing, out inputSeq, error), error);
            return inputSeq;
        }

        /// Waits until the server has undone the newest step of the handles; frames follow. Moves of the same handles, none more
        /// than a second after the one before, are one step, unless Handles.BeginMove begins a new one. Returns the change's
        /// number. FailedPrecondition NOTHING_TO_UNDO.
        public ulong Undo()
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_undo(Pointer, out inputSeq, error), error);
            return inputSeq;
        }

        /// Redoes the step that was undone last. As Undo; NOTHING_TO_REDO.
        public ulong Redo()
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_redo(Pointer, out inputSeq, error), error);
            return inputSeq;
        }

        /// Waits until the server has taken the better shape that NoticeReason.BetterShape announces; it comes as a new final frame
        /// for the same change. It is not part of steps for Undo. FailedPrecondition NO_BETTER_SHAPE if none is known any more, as
        /// after Solve. After Unavailable the shape may have been taken, which a frame then shows.
        public void TakeBetterShape()
        {
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_take_better_shape(Pointer, error), error);
        }

        /// Waits for the session as a file, for Client.Restore: mesh, handles, settings, steps to undo and the present surface.
        /// The file includes every earlier change.
        public byte[] Snapshot()
        {
            IntPtr snapshot;
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_take_snapshot(Pointer, out snapshot, error), error);
            try
            {
                UIntPtr bytes;
                var data = Native.lpdeform_snapshot_data(snapshot, out bytes);
                var file = new byte[checked((int)bytes)];
                Marshal.Copy(data, file, 0, file.Length);
                return file;
            }
            finally
            {
                Native.lpdeform_free_snapshot(snapshot);
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

        /// Takes the newest frame that was not taken: x, y, z of each vertex, in the engine's coordinates. Returns false if there
        /// is none; then nothing is written. Throws the server's error about a change, once, and the reason if the session has
        /// ended.
        public bool TryGetFrame(Span<float> positions)
        {
            Frame frame;
            return TryGetFrame(positions, out frame);
        }

        public bool TryGetFrame(Span<float> positions, out Frame frame)
        {
            return TryGetFrame(new FrameBuffers { Positions = positions }, out frame);
        }

        /// The same with normals, colours and distortion.
        public bool TryGetFrame(FrameBuffers buffers, out Frame frame)
        {
            TellNotice();
            return Write(buffers, out frame, Asked.New, 0);
        }

        /// Writes the frame taken last again. False if none was taken.
        public bool TryRepeatFrame(FrameBuffers buffers, out Frame frame)
        {
            return Write(buffers, out frame, Asked.Last, 0);
        }

        /// Waits for the finished result of the newest change, and writes it: for tools and loading screens.
        public Frame Settle(Span<float> positions, double timeoutSeconds = 60)
        {
            return Settle(new FrameBuffers { Positions = positions }, timeoutSeconds);
        }

        public Frame Settle(FrameBuffers buffers, double timeoutSeconds = 60)
        {
            Frame frame;
            Write(buffers, out frame, Asked.Result, timeoutSeconds);
            return frame;
        }

        /// Waits for a separate solve to its end, for the present handles and settings, and writes the result. It takes no
        /// frames. One solve at a time; changes made during a solve are sent after it. `timeoutSeconds`: for the whole call,
        /// including the wait for another solve; 0 is without limit. Client.Dispose ends it with Cancelled, or with
        /// FailedPrecondition SESSION_CLOSED if it had not begun.
        public Frame Solve(FrameBuffers buffers, bool certify = false, double timeoutSeconds = 0)
        {
            Frame frame;
            Write(buffers, out frame, certify ? Asked.CertifiedSolve : Asked.Solve, timeoutSeconds);
            return frame;
        }

        /// The same, and says what was searched.
        public Frame Solve(FrameBuffers buffers, out SearchReport search, bool certify = false, double timeoutSeconds = 0)
        {
            Frame frame;
            var minima = new double[MostMinima];
            fixed (double* room = minima)
            {
                var native = new Native.Search
                {
                    StructSize = (uint)sizeof(Native.Search), Minima = (IntPtr)room, MinimaCapacity = MostMinima
                };
                Write(buffers, out frame, certify ? Asked.CertifiedSolve : Asked.Solve, timeoutSeconds, (IntPtr)(&native));
                search = new SearchReport
                {
                    FurtherStarts = (int)native.FurtherStarts, Iterations = (int)native.SearchIterations, Effort = (int)native.Effort
                };
                Array.Resize(ref minima, (int)Math.Min(native.MinimaCount, MostMinima));
            }
            search.Minima = minima;
            return frame;
        }

        const int MostMinima = 1 + 12 * 1000;  // with the largest effort

        enum Asked { New, Last, Result, Solve, CertifiedSolve }

        /// `search`: null, or a Native.Search for what a solve has searched.
        bool Write(FrameBuffers into, out Frame frame, Asked asked, double timeout, IntPtr search = default(IntPtr))
        {
            var native = new Native.Frame { StructSize = (uint)sizeof(Native.Frame) };
            int code;
            // A call that waits must not keep others from a frame.
            var error = asked == Asked.New || asked == Asked.Last ? frameError : LpdeformException.NewError();
            fixed (float* positions = &MemoryMarshal.GetReference(into.Positions))
            fixed (float* normals = &MemoryMarshal.GetReference(into.Normals))
            fixed (byte* colours = &MemoryMarshal.GetReference(into.Colours))
            fixed (float* distortion = &MemoryMarshal.GetReference(into.Distortion))
            {
                var buffers = new Native.Buffers { StructSize = (uint)sizeof(Native.Buffers) };
                buffers.Positions = At(positions, sizeof(float), into.Positions.Length);
                buffers.Normals = At(normals, sizeof(float), into.Normals.Length);
                buffers.Colours = At(colours, sizeof(byte), into.Colours.Length);
                buffers.Colours.Format = Rgba8;
                buffers.Distortion = At(distortion, sizeof(float), into.Distortion.Length);
                lock (error)
                {
                    code = Call(asked, timeout, search, ref buffers, ref native, error);
                    if (code != Native.Ok && code != Native.NoFrame) throw LpdeformException.From(error);
                }
            }
            frame = Frame.From(native);
            return code == Native.Ok;
        }

        static Native.Attribute At(void* data, int size, int count)
        {
            if (count == 0) return default(Native.Attribute);  // an empty array has an address, too
            return new Native.Attribute { Data = (IntPtr)data, Bytes = (UIntPtr)((ulong)size * (ulong)count) };
        }

        const int Rgba8 = 5;

        int Call(Asked asked, double timeout, IntPtr search, ref Native.Buffers buffers, ref Native.Frame frame, byte[] error)
        {
            if (asked == Asked.New) return Native.lpdeform_poll(Pointer, ref buffers, ref frame, error);
            if (asked == Asked.Last) return Native.lpdeform_repeat(Pointer, ref buffers, ref frame, error);
            if (asked == Asked.Result) return Native.lpdeform_settle(Pointer, timeout, ref buffers, ref frame, error);
            var options = new Native.SolveOptions
            {
                StructSize = (uint)sizeof(Native.SolveOptions), Certify = asked == Asked.CertifiedSolve ? 1u : 0u,
                TimeoutSeconds = timeout, Search = search
            };
            return Native.lpdeform_solve(Pointer, ref options, ref buffers, ref frame, error);
        }

        /// Ends the session; the server's part is ended in the background.
        public void Dispose()
        {
            var closing = session;
            session = IntPtr.Zero;
            Native.lpdeform_close(closing);
        }
    }
}
