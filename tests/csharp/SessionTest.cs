// The C# client against a real server, which the test starts, kills and restarts: SessionTest.exe SERVER. Ends with 1 if a test
// fails.

using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Linq;
using System.Threading;
using Lpdeform;

static class SessionTest
{
    const double Patience = 60;
    static Server server;

    static void Expect(bool holds, string claim)
    {
        if (!holds) throw new Exception("not so: " + claim);
    }

    static void Eventually(Func<bool> holds, string claim)
    {
        var clock = Stopwatch.StartNew();
        while (!holds())
        {
            Expect(clock.Elapsed.TotalSeconds < Patience, claim);
            Thread.Sleep(1);  // as a game between two frames
        }
    }

    /// Ten squares in a row along x, 11 x 2 vertices, as Unity winds them: clockwise seen from above.
    static MeshData Strip()
    {
        var mesh = new MeshData { Positions = new float[66], Indices = new int[60] };
        for (int i = 0; i < 22; ++i)
        {
            mesh.Positions[3 * i] = i / 2;
            mesh.Positions[3 * i + 2] = i % 2;
        }
        for (int k = 0, a = 0; k < 60; k += 6, a += 2) new[] { a, a + 1, a + 3, a, a + 3, a + 2 }.CopyTo(mesh.Indices, k);
        return mesh;
    }

    static Session OpenStrip(Client client, SessionOptions options = null)
    {
        var session = client.Open(Strip(), options);
        session.Handles.Set("base", new[] { 0, 1 });
        session.Handles.Set("tip", new[] { 20, 21 }, Motion.Move(0, 2, 0));
        return session;
    }

    static void FramesComeIntoTheCallersSpans()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client, new SessionOptions { WithNormals = true }))
        {
            var positions = new float[66];
            var first = session.Settle(positions);
            Expect(first.IsFinal && first.VertexCount == 22 && first.InputSeq == 2, "the result of two changes");
            Expect(positions[3 * 20 + 1] == 2 && positions[1] == 0, "the tip is lifted, the base is not");

            ulong moved = session.Handles.Move("tip", Motion.Move(0, 3, 0));
            var normals = new float[66];
            var colours = new byte[88];
            var frame = default(Frame);
            Eventually(() => session.TryGetFrame(
                new FrameBuffers { Positions = positions, Normals = normals, Colours = colours }, out frame) && frame.InputSeq >= moved, "a frame");
            Expect(positions[3 * 20 + 1] == 3, "it is the newest");
            double length = Math.Sqrt(normals.Take(3).Sum(n => (double)n * n));
            Expect(Math.Abs(length - 1) < 1e-6, "normals of length 1");
            Expect(normals[1] > 0, "Unity's winding looks up");
            Expect(colours.Where((c, i) => i % 4 == 3).All(alpha => alpha == 255), "colours without gaps");
            Expect(session.TryRepeatFrame(new FrameBuffers { Positions = new float[66] }, out frame), "the same again");
        }
    }

    static void ErrorsCarryTheServersReason()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            session.Settle(new float[66]);
            session.Handles.Set("beyond", new[] { 22 });
            LpdeformException said = null;
            Eventually(() =>
            {
                try { session.TryGetFrame(new float[66]); }
                catch (LpdeformException error) { said = error; }
                return said != null;
            }, "the error comes");
            Expect(said.Code == ErrorCode.InvalidArgument && said.Reason == "HANDLE_VERTEX_OUT_OF_RANGE", said.Reason);
            Expect(said.Element == "vertex 22" && said.Limit == "0 <= vertex < 22", said.Element + said.Limit);
            Expect(session.State == SessionState.Live, "the session goes on");
            try
            {
                session.TryGetFrame(new float[65]);
                Expect(false, "a buffer that is too small is refused");
            }
            catch (LpdeformException error)
            {
                Expect(error.Reason == "BUFFER_TOO_SMALL", error.Reason);
            }
        }
    }

    static void ARefusedMeshIsAState()
    {
        var mesh = Strip();
        mesh.Indices[3] = 99;
        using (var client = new Client(server.Address))
        using (var session = client.Open(mesh))
        {
            Eventually(() => session.State == SessionState.Refused, "refused");
            Expect(session.Problem.Reason == "MESH_INDEX_OUT_OF_RANGE" && session.Problem.Element == "face 1", "it says why");
        }
    }

    static void WorkGoesOnWhenTheServerComesBack()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            var positions = new float[66];
            session.Settle(positions);
            server.Kill();
            Eventually(() => session.State == SessionState.Reconnecting, "reconnecting");
            Expect(positions[3 * 20 + 1] == 2, "the last frame stays");
            session.Handles.Move("tip", Motion.Move(0, 1, 0));
            server.Start();
            session.Settle(positions);
            Expect(positions[3 * 20 + 1] == 1, "the move of meanwhile");
        }
    }

    static void PerFrameCallsMakeNoGarbage()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            var positions = new float[66];
            session.Settle(positions);
            session.Handles.Move("tip", Motion.Move(0, 1, 0));
            Frame frame;
            session.TryGetFrame(positions, out frame);
            Expect(Collections(calls, k => GC.KeepAlive(new object())) > 0, "the smallest garbage would show");
            Expect(Collections(calls, k => session.TryGetFrame(positions, out frame)) == 0, "none of polls");
            Expect(Collections(calls, k => session.Handles.Move("tip", Motion.Move(0, 1, 1e-5 * k))) == 0, "none of moves");
        }
    }

    /// 16 bytes of each would fill the nursery of 512 KiB (tests/csharp/run) three times.
    const int calls = 100000;

    static int Collections(int count, Action<int> work)
    {
        int before = GC.CollectionCount(0);
        for (int k = 0; k < count; ++k) work(k);
        return GC.CollectionCount(0) - before;
    }

    static void Refused(string reason, Action change)
    {
        try
        {
            change();
            Expect(false, reason);
        }
        catch (LpdeformException error)
        {
            Expect(error.Reason == reason, error.Reason);
        }
    }

    static void EmptyArraysAreNothing()
    {
        var mesh = Strip();
        mesh.Normals = new float[0];  // as Unity has them where there are none
        using (var client = new Client(server.Address))
        using (var session = client.Open(mesh))
        {
            session.Handles.Set("base", new[] { 0, 1 });
            var positions = new float[66];
            session.Settle(new FrameBuffers { Positions = positions, Normals = new float[0], Colours = new byte[0],
                                              Distortion = new float[0] });
            Refused("HANDLE_EMPTY", () =>
            {
                session.Handles.Set("none", new int[0]);
                session.Settle(positions);
            });
            session.SetPerVertex(new double[0]);  // changes nothing
            session.Settle(positions);
        }
        using (var client = new Client(server.Address))
        using (var session = client.Open(new MeshData { Positions = new float[0], Indices = new int[0] }))
        {
            Eventually(() => session.State == SessionState.Refused, "refused");
            Expect(session.Problem.Reason == "MESH_EMPTY", session.Problem.Reason);
        }
    }

    static void TextsThatCannotBeSaidAreRefused()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            foreach (var name in new[] { "tip\0", "\ud800" })
            {
                try
                {
                    session.Handles.Move(name, Motion.Move(0, 1, 0));
                    Expect(false, "refused");
                }
                catch (ArgumentException)
                {
                }
            }
        }
    }

    static void TargetsPointsAndRegions()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            var positions = new float[66];
            session.Handles.MoveTo("tip", new double[] { 9, 1, 0, 9, 2, 1 });
            session.Settle(positions);
            Expect(positions[3 * 20] == 9 && positions[3 * 20 + 1] == 1 && positions[3 * 21 + 1] == 2, "each at its own place");
            session.Handles.Remove("tip");
            session.Handles.SetPoints("middle", new[] { new SurfacePoint(10, 0.25, 0.25, 0.5) }, Motion.Move(0, 1, 0));
            session.Settle(positions);
            var corners = Strip().Indices.Skip(30).Take(3).ToArray();
            double height = 0.25 * positions[3 * corners[0] + 1] + 0.25 * positions[3 * corners[1] + 1] + 0.5 * positions[3 * corners[2] + 1];
            Expect(Math.Abs(height - 1) < 1e-5, "the point is lifted: " + height);
            session.Handles.Remove("middle");
            session.SetRegion(new[] { 18, 19, 20, 21 });
            session.Settle(positions);
            session.Handles.Set("tip", new[] { 20, 21 }, Motion.Move(0, 3, 0));
            var before = (float[])positions.Clone();
            session.Settle(positions);
            Expect(positions.Take(48).SequenceEqual(before.Take(48)), "outside of the region nothing moves");
            session.SetRegion(null);
            session.SetAutomatic(p: 0.5);
            session.Settle(positions);
        }
    }

    static void ASolveIsItsOwnResult()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            var positions = new float[66];
            var frame = session.Solve(new FrameBuffers { Positions = positions }, certify: true, timeoutSeconds: Patience);
            Expect(frame.IsFinal && frame.OptimalityGap < 1e-3 && frame.InputSeq == 2, "a result with its bound");
            Expect(positions[3 * 20 + 1] == 2, "the tip is lifted");
        }
    }

    static void ASolveTellsWhatItHasSearched()
    {
        const int side = 11;  // 121 vertices: enough to be searched
        var rest = new float[3 * side * side];
        var indices = new List<int>();
        for (int v = 0; v < side * side; ++v)
        {
            rest[3 * v] = v / side;
            rest[3 * v + 2] = v % side;
            if (v / side == side - 1 || v % side == side - 1) continue;
            foreach (var corner in new[] { 0, 1, side + 1, 0, side + 1, side }) indices.Add(v + corner);
        }
        using (var client = new Client(server.Address))
        using (var session = client.Open(new MeshData { Positions = rest, Indices = indices.ToArray() }))
        {
            session.Handles.Set("base", new[] { 0, 1, 2 });
            session.Handles.Set("tip", new[] { 118, 119, 120 }, Motion.Move(-6, 3, 0));
            session.Set(p: 1.5);
            var buffers = new FrameBuffers { Positions = new float[rest.Length] };
            SearchReport search;
            session.SetSolver(new SolverSettings { Search = new MinimaSearch { Effort = 1 } });
            var frame = session.Solve(buffers, out search, timeoutSeconds: Patience);
            Expect(search.Effort == 1 && search.FurtherStarts == 12, "twelve further starts");
            Expect(search.Iterations > 0 && search.Iterations < frame.Iteration, "some of the iterations were the search's");
            Expect(search.Minima.Length <= 13 && search.Minima.Min() == frame.Energy, "the result is the lowest minimum");
            session.SetSolver(new SolverSettings { Search = new MinimaSearch { Effort = 0 } });
            session.Solve(buffers, out search, timeoutSeconds: Patience);
            Expect(search.Minima.Length == 1 && search.FurtherStarts == 0 && search.Effort == 0, "one minimum without a search");
            Refused("EFFORT_OUT_OF_RANGE", () => session.SetSolver(new SolverSettings { Search = new MinimaSearch { Effort = -1 } }));
        }
    }

    static void StepsAreTakenBackAndDoneAgain()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            var positions = new float[66];
            session.Settle(positions);
            ulong moved = session.Handles.Move("tip", Motion.Move(0, 3, 0));
            session.Settle(positions);
            session.Handles.BeginMove("tip", Motion.Move(0, 4, 0));
            session.Settle(positions);
            Expect(positions[3 * 20 + 1] == 4, "moved on");
            Expect(session.Undo() == moved + 2, "it has a number");
            session.Settle(positions);
            Expect(positions[3 * 20 + 1] == 3, "as it was before the step of its own");
            session.Undo();
            session.Settle(positions);
            Expect(positions[3 * 20 + 1] == 2, "as it was before the move");
            session.Redo();
            session.Settle(positions);
            Expect(positions[3 * 20 + 1] == 3, "and as it was after");
            session.Redo();
            Refused("NOTHING_TO_REDO", () => session.Redo());
        }
    }

    static void ResizingScalesAlongUnitysAxes()
    {
        using (var client = new Client(server.Address))
        using (var session = client.Open(Strip()))
        {
            var positions = new float[66];
            session.Resize(2, 1, 1.5);
            session.Settle(positions);
            var along = positions.Where((c, i) => i % 3 == 0);
            var across = positions.Where((c, i) => i % 3 == 2);
            Expect(Math.Abs(along.Max() - along.Min() - 20) < 1e-3, "twice as long");
            Expect(Math.Abs(across.Max() - across.Min() - 1.5) < 1e-3, "and half as wide again");
        }
    }

    static void SolversStopWhereTheyAreToldTo()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            session.Handles.Move("tip", Motion.Move(-4, 3, 0));
            session.Set(p: 1.5);
            session.SetLengthUnit(2);
            session.SetSolver(new SolverSettings { Method = Method.LineSearch, MaxIterations = 3 });
            var frame = session.Solve(new FrameBuffers { Positions = new float[66] }, timeoutSeconds: Patience);
            Expect(frame.Iteration == 3 && frame.StopReason == StopReason.IterationLimit, frame.Iteration + " iterations, " + frame.StopReason);
            Refused("LENGTH_UNIT_OUT_OF_RANGE", () =>
            {
                session.SetLengthUnit(double.NaN);
                session.Settle(new float[66]);
            });
        }
    }

    static void GroupsOfVerticesAreOne()
    {
        var mesh = Strip();
        mesh.WeldGroups = Enumerable.Range(0, 22).ToArray();
        mesh.WeldGroups[21] = 20;  // which lie apart
        using (var client = new Client(server.Address))
        {
            using (var session = client.Open(mesh))
            {
                Eventually(() => session.State == SessionState.Refused, "refused");
                Expect(session.Problem.Reason.StartsWith("WELD_"), session.Problem.Reason);
            }
            mesh.WeldGroups = new int[3];
            try
            {
                client.Open(mesh);
                Expect(false, "refused");
            }
            catch (ArgumentException error)
            {
                Expect(error.ParamName == "mesh.WeldGroups", error.ParamName);
            }
            mesh.WeldGroups = Enumerable.Range(0, 22).ToArray();
            using (var session = client.Open(mesh, new SessionOptions { WithoutDistortion = true, Credit = 1, LowestEncoding = FrameEncoding.Quantized }))
            {
                session.Handles.Set("base", new[] { 0, 1 });
                session.Settle(new float[66]);
            }
        }
    }

    static void ASessionLeavesAsAFileAndComesBackTheSame()
    {
        using (var client = new Client(server.Address))
        {
            var positions = new float[66];
            byte[] file;
            using (var session = OpenStrip(client))
            {
                session.Settle(positions);
                session.Handles.Move("tip", Motion.Move(0, 3, 0));
                session.Settle(positions);
                file = session.Snapshot();
            }
            using (var session = client.Restore(file))
            {
                var restored = new float[66];
                Eventually(() => session.TryGetFrame(restored), "a frame");
                Expect(restored.Zip(positions, (a, b) => Math.Abs(a - b)).Max() < 1e-3, "the same, or a step further");
                session.Undo();
                session.Settle(restored);
                Expect(restored[3 * 20 + 1] == 2, "its steps came along");
            }
            using (var session = client.Restore(new byte[] { 1, 2, 3 }))
            {
                Eventually(() => session.State == SessionState.Refused, "refused");
                Expect(session.Problem.Reason == "SNAPSHOT_FOREIGN", session.Problem.Reason);
            }
        }
    }

    static void SettingsAndReaders()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            session.Set(p: 1.5, stiffness: 2);
            var positions = new float[66];
            session.Settle(positions);
            using (var reader = client.Join(session.Name))
            {
                var seen = new float[66];
                reader.Settle(seen);
                Expect(seen.SequenceEqual(positions), "a reader sees the same");
                try
                {
                    reader.Handles.Remove("tip");
                    Expect(false, "a reader changes nothing");
                }
                catch (LpdeformException error)
                {
                    Expect(error.Reason == "NOT_THE_WRITER", error.Reason);
                }
            }
        }
    }

    static void ASearchIsAskedForAndABetterShapeOnlyThereWhenAnnounced()
    {
        using (var client = new Client(server.Address))
        using (var session = OpenStrip(client))
        {
            session.SetSolver(new SolverSettings { Search = new MinimaSearch { Effort = 1, LeastShare = 0.5 } });
            var positions = new float[66];
            session.Settle(positions);
            // There may be a notice about the load of this machine.
            Expect(session.Notice.Reason != NoticeReason.BetterShape && session.Notice.SavedShare == 0, "there is none");
            Refused("NO_BETTER_SHAPE", () => session.TakeBetterShape());
            session.SetSolver(new SolverSettings { Search = new MinimaSearch { Effort = 1001 } });
            Refused("EFFORT_OUT_OF_RANGE", () => session.Settle(positions));
        }
    }

    static int Main(string[] arguments)
    {
        var tests = new Action[] { FramesComeIntoTheCallersSpans, ErrorsCarryTheServersReason, ARefusedMeshIsAState,
                                   WorkGoesOnWhenTheServerComesBack, PerFrameCallsMakeNoGarbage, EmptyArraysAreNothing,
                                   TextsThatCannotBeSaidAreRefused, TargetsPointsAndRegions, ASolveIsItsOwnResult, ASolveTellsWhatItHasSearched, StepsAreTakenBackAndDoneAgain,
                                   ResizingScalesAlongUnitysAxes, SolversStopWhereTheyAreToldTo,
                                   GroupsOfVerticesAreOne, ASessionLeavesAsAFileAndComesBackTheSame, SettingsAndReaders,
                                   ASearchIsAskedForAndABetterShapeOnlyThereWhenAnnounced };
        int failed = 0;
        using (server = new Server(arguments[0]))
        {
            foreach (var test in tests)
            {
                try
                {
                    test();
                    Console.WriteLine("passed " + test.Method.Name);
                }
                catch (Exception error)
                {
                    ++failed;
                    Console.WriteLine("FAILED " + test.Method.Name + ": " + error);
                }
            }
        }
        return failed == 0 ? 0 : 1;
    }
}
