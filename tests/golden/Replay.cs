// How the C# client reads the golden recordings: see replay.py.   Replay.exe ADDRESS NUMBER_OF_ERRORS

using System;
using System.IO;
using System.Linq;
using System.Text;
using System.Threading;
using Lpdeform;

static class Replay
{
    static readonly TextWriter output = new StreamWriter(Console.OpenStandardOutput(), new UTF8Encoding(false));
    static readonly SessionOptions own = new SessionOptions { LeftHanded = false };  // the server's coordinates

    static MeshData Strip()
    {
        var mesh = new MeshData { Positions = new float[66], Indices = new int[60] };
        for (int i = 0; i < 22; ++i)
        {
            mesh.Positions[3 * i] = i / 2;
            mesh.Positions[3 * i + 1] = i % 2;
        }
        var corners = new[] { 0, 2, 3, 0, 3, 1 };
        for (int k = 0; k < 60; ++k) mesh.Indices[k] = 2 * (k / 6) + corners[k % 6];
        return mesh;
    }

    static void Tell(string name, string what, float[] numbers)
    {
        var words = numbers.Select(number => " " + BitConverter.ToUInt32(BitConverter.GetBytes(number), 0).ToString("x8"));
        output.Write("{0} {1}:{2}\n", name, what, string.Concat(words));
    }

    static void Tell(string where, LpdeformException error)
    {
        output.Write("{0} {1} {2} | {3} | {4} | {5}\n", where, (int)error.Code, error.Reason, error.Element, error.Limit,
                     error.Message);
    }

    static Session OpenStrip(Client client, FrameEncoding encoding, bool doublePrecision)
    {
        var options = new SessionOptions
        {
            LeftHanded = false, Encoding = encoding, DoublePrecision = doublePrecision, WithNormals = true
        };
        var session = client.Open(Strip(), options);
        session.Handles.Set("base", new[] { 0, 1 });
        session.Handles.Set("tip", new[] { 20, 21 }, Motion.Move(-4, 0, 3));
        return session;
    }

    static void TellResult(string name, Session session)
    {
        var buffers = new FrameBuffers { Positions = new float[66], Normals = new float[66], Distortion = new float[22] };
        var frame = session.Settle(buffers, 30);
        output.Write("{0}: result {1}, {2}, iteration {3}, energy {4:x16}\n", name, frame.IsFinal ? 1 : 0,
                     frame.StopReason.ToString().ToLowerInvariant(), frame.Iteration,
                     BitConverter.DoubleToInt64Bits(frame.Energy));
        Tell(name, "positions", buffers.Positions.ToArray());
        Tell(name, "distortion", buffers.Distortion.ToArray());
        Tell(name, "normals", buffers.Normals.ToArray());
    }

    static void TellFrame(Client client, string name, FrameEncoding encoding, bool doublePrecision)
    {
        using (var session = OpenStrip(client, encoding, doublePrecision))
        {
            var notices = 0;
            session.Noticed += notice => notices += notice.Equals(session.Notice) ? 1 : 0;
            TellResult(name, session);
            for (int k = 0; k < 3; ++k) session.TryGetFrame(new float[66]);
            var text = notices == 1 ? session.Notice.Text : "raised " + notices + " times";
            output.Write("{0} notice: {1}, {2}\n", name, session.Notice.Reason.ToString().ToLowerInvariant(), text);
        }
    }

    /// What Settle says that may not wait.
    static void SettleAgain(Session session)
    {
        try
        {
            var frame = session.Settle(new float[66], 0);
            output.Write("settled again: {0}, iteration {1}\n", frame.StopReason.ToString().ToLowerInvariant(), frame.Iteration);
        }
        catch (LpdeformException error)
        {
            output.Write("settled again: {0}\n", error.Reason);
        }
    }

    static void TellUndo(Client client)
    {
        using (var session = OpenStrip(client, FrameEncoding.Raw, false))
        {
            session.Settle(new float[66], 30);
            SettleAgain(session);
            session.Handles.Move("tip", Motion.Move(0, 0, 1));
            SettleAgain(session);
            session.Undo();
            TellResult("undo", session);
            SettleAgain(session);
            var file = session.Snapshot();
            output.Write("snapshot: {0} bytes\n", file.Length);
            using (var restored = client.Restore(file, own))
            {
                while (restored.State == SessionState.Connecting) Thread.Sleep(1);
                output.Write("restored: {0}\n", restored.Name);
            }
        }
    }

    static void TellCall(Client client, int number)
    {
        var mesh = new MeshData { Positions = new float[3 * (1000 + number)], Indices = new[] { 0, 1, 2 } };
        using (var session = client.Open(mesh, own))
        {
            LpdeformException problem;
            while ((problem = session.Problem) == null) Thread.Sleep(1);  // as a game between two frames
            Tell("call", problem);
        }
    }

    static int Main(string[] arguments)
    {
        int errors = int.Parse(arguments[1]);
        using (var client = new Client(arguments[0]))
        {
            TellFrame(client, "float64", FrameEncoding.Raw, true);
            TellFrame(client, "float32", FrameEncoding.Raw, false);
            TellFrame(client, "quantized", FrameEncoding.Quantized, false);
            TellFrame(client, "compressed", FrameEncoding.Compressed, false);
            TellUndo(client);
            for (int k = 0; k < errors; ++k) TellCall(client, k);
            using (var session = client.Open(Strip(), own))
            {
                for (int k = 0; k < errors; ++k)
                {
                    session.Handles.Move(k.ToString(), default(Motion));
                    try { session.Settle(new float[66], 30); }
                    catch (LpdeformException error) { Tell("fault", error); }
                }
            }
        }
        output.Flush();
        return 0;
    }
}
