using System;
using System.Text;

namespace Lpdeform
{
    /// Codes of errors: those of gRPC.
    public enum ErrorCode
    {
        Cancelled = 1, Unknown = 2, InvalidArgument = 3, DeadlineExceeded = 4, NotFound = 5, AlreadyExists = 6, PermissionDenied = 7,
        ResourceExhausted = 8, FailedPrecondition = 9, Aborted = 10, OutOfRange = 11, Unimplemented = 12, Internal = 13,
        Unavailable = 14, DataLoss = 15, Unauthenticated = 16
    }

    /// An error of the server or the library. A call that throws it has changed nothing.
    public sealed class LpdeformException : Exception
    {
        public ErrorCode Code { get; }
        /// For programs: one of Reasons. May be empty.
        public string Reason { get; }
        /// The first offending element: "face 3". May be empty.
        public string Element { get; }
        /// The limit that was violated: "0 <= vertex < 42". May be empty.
        public string Limit { get; }

        LpdeformException(int code, string reason, string element, string limit, string message) : base(message)
        {
            Code = (ErrorCode)code;
            Reason = reason;
            Element = element;
            Limit = limit;
        }

        // lpdeform_error, byte by byte: struct_size, code, and four texts.
        const int TextsAt = 8, ReasonSize = 48, ElementSize = 128, LimitSize = 128, MessageSize = 512;
        internal const int Size = TextsAt + ReasonSize + ElementSize + LimitSize + MessageSize;

        internal static byte[] NewError()
        {
            var error = new byte[Size];
            BitConverter.GetBytes((uint)Size).CopyTo(error, 0);
            return error;
        }

        /// Converts `error`; null if it is not an error.
        internal static LpdeformException From(byte[] error)
        {
            int code = BitConverter.ToInt32(error, 4), at = TextsAt;
            if (code == Native.Ok) return null;
            string reason = Text(error, ref at, ReasonSize), element = Text(error, ref at, ElementSize);
            return new LpdeformException(code, reason, element, Text(error, ref at, LimitSize), Text(error, ref at, MessageSize));
        }

        internal static void Check(int code, byte[] error)
        {
            if (code != Native.Ok) throw From(error);
        }

        static string Text(byte[] bytes, ref int at, int size)
        {
            int start = at, length = Array.IndexOf(bytes, (byte)0, start, size) - start;
            at += size;
            return Encoding.UTF8.GetString(bytes, start, length);
        }
    }
}
