using System;
using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// How a server is reached.
    public sealed class ConnectionOptions
    {
        public bool Tls;
        /// PEM; null: the system's trusted certificates.
        public string RootCertificates;
        /// PEM: the client's own certificate and its key, if the server asks for one.
        public string CertificateChain, PrivateKey;
        /// Bearer token of each call; see Client.SetToken.
        public string Token;
        /// For how long a session tries to reach a server that is away; 0 is without limit.
        public double ReconnectSeconds;
    }

    /// A connection to an lpdeform server, shared by its sessions. Members may be used from any thread.
    public sealed class Client : IDisposable
    {
        IntPtr client;

        /// `address`: with the C library of a package, which has gRPC-Web in it, that of the Envoy in front of a server:
        /// "host:port", "http://host:port" or "https://host:port"; "localhost:8080" with deploy/up. With the C library of
        /// a build of the project, which has gRPC in it, that of the server: "host:port"; "localhost:50051".
        /// Does not wait; the connection is made in the background.
        public Client(string address, ConnectionOptions options = null)
        {
            if (Native.lpdeform_abi() != 1) throw new NotSupportedException("This assembly is for another lpdeform_client.");
            options = options ?? new ConnectionOptions();
            var error = LpdeformException.NewError();
            using (var pinned = new Pinned())
            {
                var connection = new Native.Connection
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Connection)),
                    Tls = options.Tls ? 1u : 0u,
                    Address = pinned.Text(address),
                    RootCertificates = pinned.Text(options.RootCertificates),
                    CertificateChain = pinned.Text(options.CertificateChain),
                    PrivateKey = pinned.Text(options.PrivateKey),
                    Token = pinned.Text(options.Token),
                    ReconnectSeconds = options.ReconnectSeconds
                };
                LpdeformException.Check(Native.lpdeform_connect(ref connection, out client, error), error);
            }
        }

        /// "0.1.0"
        public static string LibraryVersion
        {
            get { return Marshal.PtrToStringAnsi(Native.lpdeform_version()); }
        }

        /// Sets the bearer token of later calls; null: none.
        public void SetToken(string token)
        {
            var error = LpdeformException.NewError();
            using (var pinned = new Pinned())
                LpdeformException.Check(Native.lpdeform_set_token(client, pinned.Text(token), error), error);
        }

        /// Begins to make a session of the mesh; does not wait. Handles may be set at once.
        public Session Open(MeshData mesh, SessionOptions options = null)
        {
            if (mesh == null || mesh.Positions == null || mesh.Indices == null) throw new ArgumentNullException("mesh");
            var error = LpdeformException.NewError();
            IntPtr session;
            var native = (options ?? new SessionOptions()).ToNative();
            using (var pinned = new Pinned())
            {
                var copy = new Native.Mesh
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Mesh)),
                    VertexCount = (uint)(mesh.Positions.Length / 3),
                    Positions = pinned.Floats(mesh.Positions),
                    Normals = pinned.Floats(mesh.Normals),
                    Indices = pinned.Array(mesh.Indices),
                    IndexCount = (uint)mesh.Indices.Length,
                    WeldByPosition = mesh.WeldByPosition ? 1u : 0u,
                    WeldGroups = Groups(mesh, pinned),
                    WeldTolerance = mesh.WeldTolerance
                };
                LpdeformException.Check(Native.lpdeform_open(client, ref copy, ref native, out session, error), error);
            }
            return new Session(session);
        }

        static IntPtr Groups(MeshData mesh, Pinned pinned)
        {
            if (mesh.WeldGroups != null && mesh.WeldGroups.Length != mesh.Positions.Length / 3)
                throw new ArgumentException("one number a vertex", "mesh.WeldGroups");
            return pinned.Array(mesh.WeldGroups);
        }

        /// Joins an existing session by its name: as a reader, or as its writer in place of the present one.
        public Session Join(string name, bool asWriter = false, SessionOptions options = null)
        {
            var error = LpdeformException.NewError();
            IntPtr session;
            var native = (options ?? new SessionOptions()).ToNative();
            using (var pinned = new Pinned())
                LpdeformException.Check(
                    Native.lpdeform_join(client, pinned.Text(name), asWriter ? 1 : 0, ref native, out session, error), error);
            return new Session(session);
        }

        /// Begins to make a session from a file of Session.Snapshot; does not wait. The surface is the same to the last bit, in
        /// the coordinates that `options` names. If the file is not a snapshot, the session's state is Refused, with the reason.
        public Session Restore(byte[] snapshot, SessionOptions options = null)
        {
            if (snapshot == null) throw new ArgumentNullException("snapshot");
            var error = LpdeformException.NewError();
            IntPtr session;
            var native = (options ?? new SessionOptions()).ToNative();
            LpdeformException.Check(
                Native.lpdeform_restore(client, snapshot, (UIntPtr)(uint)snapshot.Length, ref native, out session, error), error);
            return new Session(session);
        }

        /// Waits until the sessions are closed, usually milliseconds. Call it before the process ends.
        public void Dispose()
        {
            var disconnecting = System.Threading.Interlocked.Exchange(ref client, IntPtr.Zero);
            Native.lpdeform_disconnect(disconnecting);
        }
    }
}
