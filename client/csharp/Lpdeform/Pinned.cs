using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Lpdeform
{
    /// Arrays and texts that are pinned while a call of the library reads them.
    sealed class Pinned : IDisposable
    {
        readonly List<GCHandle> handles = new List<GCHandle>();

        /// IntPtr.Zero for null and for an empty array.
        public IntPtr Array(Array array)
        {
            if (array == null || array.Length == 0) return IntPtr.Zero;
            var handle = GCHandle.Alloc(array, GCHandleType.Pinned);
            handles.Add(handle);
            return handle.AddrOfPinnedObject();
        }

        public IntPtr Text(string text)
        {
            return Array(text == null ? null : Utf8(text));
        }

        public Native.Attribute Floats(float[] numbers)
        {
            if (numbers == null || numbers.Length == 0) return default(Native.Attribute);
            return new Native.Attribute { Data = Array(numbers), Bytes = (UIntPtr)(4L * numbers.Length) };
        }

        static readonly Encoding strict = new UTF8Encoding(false, true);

        /// UTF-8 with a zero byte at the end, as in C. Throws ArgumentException if the text cannot be converted.
        public static byte[] Utf8(string text)
        {
            if (text.IndexOf('\0') >= 0) throw new ArgumentException("A text has a zero character.");
            return strict.GetBytes(text + "\0");
        }

        public void Dispose()
        {
            foreach (var handle in handles) handle.Free();
        }
    }
}
