using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;

namespace Lpdeform
{
    /// Arrays and texts at fixed places while a call of the library reads them.
    sealed class Pinned : IDisposable
    {
        readonly List<GCHandle> handles = new List<GCHandle>();

        /// IntPtr.Zero for null.
        public IntPtr Array(Array array)
        {
            if (array == null) return IntPtr.Zero;
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
            if (numbers == null) return default(Native.Attribute);
            return new Native.Attribute { Data = Array(numbers), Bytes = (UIntPtr)(4L * numbers.Length) };
        }

        /// As C has texts, ending in a zero byte.
        public static byte[] Utf8(string text)
        {
            return Encoding.UTF8.GetBytes(text + "\0");
        }

        public void Dispose()
        {
            foreach (var handle in handles) handle.Free();
        }
    }
}
