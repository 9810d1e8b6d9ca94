using System;
using System.Collections.Concurrent;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// The handles of a session: groups of vertices that are held and moved. Every change returns its number: a frame whose InputSeq
    /// is at least that takes it into account. Changes do not wait, and the newest of each handle wins; what the server says
    /// of one is thrown by TryGetFrame.
    public sealed class Handles
    {
        readonly Session session;
        readonly ConcurrentDictionary<string, byte[]> names = new ConcurrentDictionary<string, byte[]>();

        internal Handles(Session session)
        {
            this.session = session;
        }

        /// Holds the vertices where the mesh at rest has them; adds the handle or replaces the one of that name.
        public ulong Set(string name, int[] vertices)
        {
            return Set(name, vertices, default(Motion));
        }

        public ulong Set(string name, int[] vertices, Motion motion, HoldOptions how = default(HoldOptions))
        {
            if (vertices == null) throw new ArgumentNullException("vertices");
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
                    VertexCount = (uint)vertices.Length,
                    Motion = motion.ToNative(),
                    Weight = how.Weight,
                    Direction = how.Direction,
                    Footprint = how.Footprint
                };
                LpdeformException.Check(Native.lpdeform_set_handle(session.Pointer, ref handle, out inputSeq, error), error);
            }
            return inputSeq;
        }

        [ThreadStatic] static byte[] moveError;

        /// Moves a handle that is there. Makes no garbage.
        public ulong Move(string name, Motion motion)
        {
            ulong inputSeq;
            var error = moveError ?? (moveError = LpdeformException.NewError());
            var native = motion.ToNative();
            LpdeformException.Check(
                Native.lpdeform_move_handle(session.Pointer, NameOf(name), ref native, out inputSeq, error), error);
            return inputSeq;
        }

        /// Lets go of a handle.
        public ulong Remove(string name)
        {
            ulong inputSeq;
            var error = LpdeformException.NewError();
            LpdeformException.Check(Native.lpdeform_remove_handle(session.Pointer, NameOf(name), out inputSeq, error), error);
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
