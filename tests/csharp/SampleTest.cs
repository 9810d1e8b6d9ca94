// The component of the package for Unity and its sample, against a real server, with its messages called as Unity does: SampleTest.exe SERVER.

using System;
using System.Diagnostics;
using System.Linq;
using System.Reflection;
using System.Threading;
using UnityEngine;

static class SampleTest
{
    static Server server;

    static void Expect(bool holds, string claim)
    {
        if (!holds) throw new Exception("not so: " + claim + "; " + string.Join(" | ", UnityEngine.Debug.Warnings));
    }

    static void Send(object sample, string message)
    {
        sample.GetType().GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(sample, null);
    }

    static void UpdateUntil(LpdeformMesh sample, Func<bool> holds, string claim)
    {
        var clock = Stopwatch.StartNew();
        while (!holds())
        {
            Expect(clock.Elapsed.TotalSeconds < 60, claim);
            Thread.Sleep(1);  // as a game between two frames
            Send(sample, "Update");
        }
    }

    /// Ten squares along x, clockwise seen from above, held at both ends by objects that are there.
    static LpdeformMesh Sample(out UnityEngine.Mesh mesh)
    {
        UnityEngine.Debug.Logs.Clear();
        UnityEngine.Debug.Warnings.Clear();
        mesh = new UnityEngine.Mesh { vertices = new Vector3[22], normals = new Vector3[0], triangles = new int[60] };
        for (int i = 0; i < 22; ++i) mesh.vertices[i] = new Vector3 { x = i / 2, z = i % 2 };
        for (int k = 0, a = 0; k < 60; k += 6, a += 2) new[] { a, a + 1, a + 3, a, a + 3, a + 2 }.CopyTo(mesh.triangles, k);
        var sample = new LpdeformMesh { address = server.Address, handles = new[] { Handle("base", 0), Handle("tip", 10) } };
        sample.Attach(new MeshFilter { mesh = mesh });
        return sample;
    }

    static LpdeformMesh.HandleObject Handle(string name, float x)
    {
        var transform = new Transform { position = new Vector3 { x = x, z = 0.5f } };
        return new LpdeformMesh.HandleObject { name = name, transform = transform, radius = 0.6f };
    }

    static void TheMeshFollowsItsHandles()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the tip is lifted");
        Expect(mesh.vertices[0].y == 0 && mesh.normals[0].y > 0, "the base stays and looks up");
        UpdateUntil(sample, () => sample.status == "Live", "it says so");
        Expect(UnityEngine.Debug.Warnings.Count == 0, "no warnings");
        Send(sample, "OnDisable");
    }

    static void AHandleThatHoldsNothingIsSaidOnceAndNeverMoved()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        sample.handles = sample.handles.Concat(new[] { Handle("far", 100) }).ToArray();
        Send(sample, "OnEnable");
        for (int height = 1; height <= 3; ++height)
        {
            foreach (var handle in sample.handles.Skip(1)) handle.transform.position.y = height;
            UpdateUntil(sample, () => mesh.vertices[20].y == height, "the tip is lifted");
        }
        Expect(UnityEngine.Debug.Warnings.Count == 1 && UnityEngine.Debug.Warnings[0].Contains("far"), "one warning");
        Send(sample, "OnDisable");
    }

    static void PIsSentAgainToANewSession()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        sample.p = 1.25f;
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the first session");
        Send(sample, "OnDisable");
        var sent = typeof(LpdeformMesh).GetField("sentP", BindingFlags.Instance | BindingFlags.NonPublic);
        Send(sample, "OnEnable");
        Expect((float)sent.GetValue(sample) == 0, "nothing was sent to the second");
        int drawn = mesh.timesDrawn;
        UpdateUntil(sample, () => mesh.timesDrawn > drawn, "the second session");
        Expect((float)sent.GetValue(sample) == 1.25f, "p was");
        Send(sample, "OnDisable");
    }

    static void TakingABetterShapeWhereNoneIsKnownIsAWarning()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        sample.TakeBetterShape();
        Expect(UnityEngine.Debug.Warnings.Count == 0, "without a session there is nothing to take");
        sample.showBetterShapes = true;
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the session is live");
        sample.TakeBetterShape();
        Expect(UnityEngine.Debug.Warnings.Single().Contains("NO_BETTER_SHAPE"), "the server's answer");
        sample.handles[1].transform.position.y = 3;
        UpdateUntil(sample, () => mesh.vertices[20].y == 3, "it goes on");
        Send(sample, "OnDisable");
    }

    static void HowFarToLookIsSentWhereItChangesAndARefusalIsSaidOnce()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        sample.searchEffort = 3;
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the session is live");
        Expect(UnityEngine.Debug.Warnings.Count == 0, "no warnings");
        sample.searchEffort = 1001;
        UpdateUntil(sample, () => UnityEngine.Debug.Warnings.Count > 0, "the refusal");
        for (int k = 0; k < 50; ++k) Send(sample, "Update");
        Expect(UnityEngine.Debug.Warnings.Single().Contains("1001"), UnityEngine.Debug.Warnings[0]);
        sample.searchEffort = 0;
        sample.leastShare = 1.5f;
        UpdateUntil(sample, () => UnityEngine.Debug.Warnings.Count > 1, "the other refusal");
        Expect(UnityEngine.Debug.Warnings.Count == 2 && UnityEngine.Debug.Warnings[1].Contains("1.5"), "the share");
        sample.leastShare = 0.05f;
        sample.handles[1].transform.position.y = 3;
        UpdateUntil(sample, () => mesh.vertices[20].y == 3, "it goes on");
        Expect(UnityEngine.Debug.Warnings.Count == 2, "nothing more");
        Send(sample, "OnDisable");
    }

    static void DisablingPutsTheMeshBackAndEnablingGoesOnFromThere()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        var rest = (Vector3[])mesh.vertices.Clone();
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the first session");
        for (int round = 0; round < 2; ++round)
        {
            Send(sample, "OnDisable");
            Expect(mesh.vertices.SequenceEqual(rest) && mesh.normals.Length == 0 && mesh.colors32 == null, "as it was");
            Send(sample, "OnEnable");
            UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the pose is back, and no more than it");
        }
        Expect(UnityEngine.Debug.Warnings.Count == 0, "no warnings");
        Send(sample, "OnDisable");
    }

    static void AnUpdateWithoutNewsMakesNoGarbage()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        Send(sample, "OnEnable");
        sample.handles[1].transform.position.y = 2;
        UpdateUntil(sample, () => mesh.vertices[20].y == 2, "the tip is lifted");
        UpdateUntil(sample, () => sample.status == "Live", "it says so");
        var update = (Action)Delegate.CreateDelegate(typeof(Action), sample, "Update");
        int drawn;
        do  // until nothing more comes
        {
            drawn = mesh.timesDrawn;
            for (int k = 0; k < 100; ++k, Thread.Sleep(1)) update();
        } while (mesh.timesDrawn > drawn);
        int before = GC.CollectionCount(0);
        for (int k = 0; k < 100000; ++k) update();
        Expect(GC.CollectionCount(0) == before, "no garbage");  // 16 bytes of each would fill the nursery three times
        Send(sample, "OnDisable");
    }

    static void ARefusalIsSaidOnceAndShown()
    {
        UnityEngine.Mesh mesh;
        var sample = Sample(out mesh);
        mesh.triangles[3] = 99;
        Send(sample, "OnEnable");
        UpdateUntil(sample, () => sample.status.StartsWith("Refused"), "refused");
        for (int k = 0; k < 50; ++k) Send(sample, "Update");
        Expect(UnityEngine.Debug.Warnings.Count == 1, UnityEngine.Debug.Warnings.Count + " warnings");
        Expect(sample.status.Contains("99") || sample.status.Contains("index"), sample.status);
        Send(sample, "OnDisable");
    }

    static void TheSwingingBarSwings()
    {
        GameObject.All.Clear();
        UnityEngine.Debug.Warnings.Clear();
        var swing = new SwingingBar { address = server.Address };
        Send(swing, "Start");
        var bar = GameObject.All[0];
        var deforms = bar.GetComponent<LpdeformMesh>();
        var mesh = bar.GetComponent<MeshFilter>().mesh;
        var rest = (Vector3[])mesh.vertices.Clone();
        Expect(bar.active[0] && mesh.triangles.Max() == rest.Length - 1, "it is whole");
        for (int k = 0; k < mesh.triangles.Length; k += 3)
        {
            Vector3 a = rest[mesh.triangles[k]], u = rest[mesh.triangles[k + 1]] - a, v = rest[mesh.triangles[k + 2]] - a;
            Expect((u.y * v.z - u.z * v.y) * a.x + (u.x * v.y - u.y * v.x) * a.z > 0, "triangle " + k / 3 + " looks out");
        }
        Send(deforms, "OnEnable");
        int top = Array.FindIndex(rest, at => at.y == 2);
        Time.time = (float)Math.PI / 4;  // where the head is farthest to the right
        Send(swing, "Update");
        UpdateUntil(deforms, () => Math.Abs(mesh.vertices[top].x - rest[top].x - Math.Sin(0.9)) < 1e-4, "the head swings");
        Expect(UnityEngine.Debug.Warnings.Count == 0, "no warnings");
        Send(deforms, "OnDisable");
    }

    static int Main(string[] arguments)
    {
        var tests = new Action[] { TheMeshFollowsItsHandles, AHandleThatHoldsNothingIsSaidOnceAndNeverMoved, PIsSentAgainToANewSession,
                                   TakingABetterShapeWhereNoneIsKnownIsAWarning,
                                   HowFarToLookIsSentWhereItChangesAndARefusalIsSaidOnce,
                                   DisablingPutsTheMeshBackAndEnablingGoesOnFromThere, AnUpdateWithoutNewsMakesNoGarbage,
                                   ARefusalIsSaidOnceAndShown, TheSwingingBarSwings };
        using (server = new Server(arguments[0]))
        {
            foreach (var test in tests)
            {
                test();
                Console.WriteLine("passed " + test.Method.Name);
            }
        }
        return 0;
    }
}
