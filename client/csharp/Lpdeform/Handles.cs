using System;
using System.Collections.Concurrent;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// The handles of a session: groups of vertices that are held and moved. Every change returns its number. A frame whose
    /// InputSeq is at least that number takes the change into account. Changes do not wait, and the newest change of each handle
    /// wins. TryGetFrame throws the server's error about a change.
    public sealed class Handles
    {
        readonly Func<IntPtr> session;
        readonly ConcurrentDictionary<string, byte[]> names = new ConcurrentDictionary<string, byte[]>();

        /// `session` returns the native session; it throws if that is closed.
        internal Handles(Func<IntPtr> session)
        {
            this.session = session;
        }

        /// Holds the vertices where the mesh at rest has them; adds the handle, or replaces the one with this name.
        public ulong Set(string name, int[] vertices)
        {
            return Set(name, vertices, default(Motion));
        }

        public ulong Set(string name, int[] vertices, Motion motion, HoldOptions how = default(HoldOptions))
        {
            if (vertices == null) throw new ArgumentNullException("vertices");
            return Set(name, vertices, null, motion, how);
        }

        /// The same with points inside faces of the mesh instead of vertices; exactly or soft.
        public ulong SetPoints(string name, SurfacePoint[] points, Motion motion = default(Motion),
                               HoldOptions how = default(HoldOptions))
        {
            if (points == null) throw new ArgumentNullException("points");
            return Set(name, null, points, motion, how);
        }

        ulong Set(string name, int[] vertices, SurfacePoint[] points, Motion motion, HoldOptions how)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            using (var pinned = new Pinned())
            {
                var handle = new Native.Handle
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Handle)),
                    Hold = (int)how.Hold,
                    Name = pinned.Array(NameOf(name)),
                    Vertices = pinned.Array(vertices),
                    VertexCount = vertices == null ? 0u : (uint)vertices.Length,
                    Points = pinned.Array(points),
                    PointCount = points == null ? 0u : (uint)points.Length,
                    Motion = motion.ToNative(),
                    Weight = how.Weight,
                    Direction = how.Direction,
                    Footprint = how.Footprint
                };
                LpdeformException.Check(Native.lpdeform_set_handle(session(), ref handle, out inputSeq, error), error);
            }
            return inputSeq;
        }

        [ThreadStatic] static byte[] moveError;

        /// Moves an existing handle. Allocates nothing.
        public ulong Move(string name, Motion motion)
        {
            ulong inputSeq;
            var error = moveError ?? (moveError = LpdeformException.NewError());
            var native = motion.ToNative();
            LpdeformException.Check(
                Native.lpdeform_move_handle(session(), NameOf(name), ref native, out inputSeq, error), error);
            return inputSeq;
        }

        /// The same, but it begins a new step for Session.Undo. Call it when a drag begins.
        public ulong BeginMove(string name, Motion motion)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            using (var pinned = new Pinned())
            {
                var move = new Native.Move { Name = pinned.Array(NameOf(name)), Motion = motion.ToNative() };
                var update = new Native.Update
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Update)), Moves = pinned.Array(new[] { move }), MoveCount = 1,
                    BeginsStep = 1
                };
                LpdeformException.Check(Native.lpdeform_send(session(), ref update, out inputSeq, error), error);
            }
            return inputSeq;
        }

        /// Moves each vertex or point of a handle to a target: x, y, z of each.
        public ulong MoveTo(string name, double[] positions)
        {
            if (positions == null || positions.Length % 3 != 0) throw new ArgumentException("x, y, z of each", "positions");
            ulong inputSeq;
            var error = LpdeformException.NewError();
            using (var pinned = new Pinned())
            {
                var native = new Native.Motion
                {
                    Kind = 2, PositionCount = (uint)(positions.Length / 3), Positions = pinned.Array(positions)
                };
                LpdeformException.Check(
                    Native.lpdeform_move_handle(session(), NameOf(name), ref native, out inputSeq, error), error);
            }
            return inputSeq;
        }

        /// Removes a handle.
        public ulong Remove(string name)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_remove_handle(session(), NameOf(name), out inputSeq, error), error);
            byte[] forgotten;
            names.TryRemove(name, out forgotten);
            return inputSeq;
        }

        byte[] NameOf(string name)
        {
            if (name == null) throw new ArgumentNullException("name");
            byte[] known;
            if (names.TryGetValue(name, out known)) return known;
            return names[name] = Pinned.Utf8(name);
        }
    }
}
