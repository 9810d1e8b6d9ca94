// Fits a MeshFilter to the handles around it: add this to an object with a MeshFilter whose mesh is readable, and give it handles.
// The tests compile it against declarations of the parts of UnityEngine that it uses; they do not run it inside Unity.

using System;
using System.Runtime.InteropServices;
using Lpdeform;
using UnityEngine;

[RequireComponent(typeof(MeshFilter))]
public sealed class LpdeformMesh : MonoBehaviour
{
    [Serializable]
    public sealed class HandleObject
    {
        public string name;
        /// Its movement since the start moves the vertices.
        public Transform transform;
        /// Vertices closer than this are held, in the object's own unit.
        public float radius = 0.1f;
        [NonSerialized] public Matrix4x4 start;
        [NonSerialized] public bool hasStart;
        [NonSerialized] public Motion sent;
        /// Whether it holds vertices, so that it can be moved.
        [NonSerialized] public bool holds;
    }

    public string address = "localhost:8080";
    [Range(1, 8)] public float p = 2;
    public bool showDistortion = true;
    /// A shape of lower energy that the server finds while nothing moves is shown at once. Otherwise the log says that there is
    /// one, and "Take the better shape" in the component's menu shows it.
    public bool showBetterShapes;
    /// How far the server looks for such shapes while nothing moves. Each unit stands for 12 starts; at 0 there are none. At -1 the
    /// server decides: 1 where p is below 2, otherwise 0.
    [Range(-1, 1000)] public int searchEffort = -1;
    /// The share of the energy that such a shape must save; 0 is the server's own, 0.02.
    [Range(0, 1)] public float leastShare = 0.02f;
    public HandleObject[] handles = new HandleObject[0];

    Client client;
    Session session;
    UnityEngine.Mesh mesh;
    /// The mesh as it was when the object was first enabled; it is restored when the object is disabled.
    Vector3[] rest, restNormals;
    Color32[] restColours;
    Vector3[] positions, normals;
    Color32[] colours;
    float sentP;
    MinimaSearch? sentSearch;

    /// The session's state for the Inspector: "Live", or "Refused: " and the reason.
    public string status = "";
    SessionState? said;

    void OnEnable()
    {
        sentP = 0;  // a new session knows nothing
        sentSearch = null;
        status = "";
        said = null;
        var present = GetComponent<MeshFilter>().mesh;  // this object's own copy
        if (present != mesh) Remember(present);
        positions = (Vector3[])rest.Clone();
        normals = restNormals.Length == rest.Length ? (Vector3[])restNormals.Clone() : new Vector3[rest.Length];
        colours = new Color32[rest.Length];

        var data = new MeshData
        {
            Positions = Floats(positions).ToArray(),
            Normals = Floats(normals).ToArray(),
            Indices = mesh.triangles,
            WeldByPosition = true  // Unity has several vertices along seams
        };
        try
        {
            client = new Client(address);
            session = client.Open(data, new SessionOptions { WithNormals = true, FreeComponents = FreeComponents.Follow });
        }
        catch (LpdeformException error)
        {
            Give("Refused: " + error.Message);
            return;
        }
        session.Noticed += notice => { if (notice.Reason != NoticeReason.None) Debug.Log("lpdeform: " + notice.Text, this); };
        foreach (var handle in handles) handle.holds = false;
        foreach (var handle in handles)
            if (session != null) Hold(handle);
    }

    void Remember(UnityEngine.Mesh present)
    {
        mesh = present;
        mesh.MarkDynamic();
        rest = mesh.vertices;
        restNormals = mesh.normals;
        restColours = mesh.colors32;
        foreach (var handle in handles) handle.hasStart = false;
    }

    void Hold(HandleObject handle)
    {
        if (string.IsNullOrEmpty(handle.name) || handle.transform == null)
        {
            Debug.LogWarning("Handle " + Array.IndexOf(handles, handle) + " has no name or no object", this);
            return;
        }
        if (!handle.hasStart) handle.start = Here(handle);
        handle.hasStart = true;
        var center = handle.start.MultiplyPoint3x4(Vector3.zero);
        var held = Array.FindAll(Numbers(positions.Length), i => (positions[i] - center).magnitude < handle.radius);
        handle.sent = default(Motion);
        if (held.Length == 0)
        {
            Debug.LogWarning("No vertex is within the radius of the handle " + handle.name, this);
            return;
        }
        try
        {
            session.Handles.Set(handle.name, held);
            handle.holds = true;
        }
        catch (LpdeformException error)
        {
            Warn(error);
        }
    }

    /// Once per picture. Nothing here waits for the network.
    void Update()
    {
        if (session == null) return;
        Tell();
        if (session == null) return;
        try
        {
            foreach (var handle in handles)
                if (handle.holds) Send(handle);
            if (!p.Equals(sentP))
            {
                sentP = p;  // also if it is refused: that is said once
                session.Set(p: p);
            }
            var search = new MinimaSearch
            {
                Show = showBetterShapes, LeastShare = leastShare, Effort = searchEffort < 0 ? (int?)null : searchEffort
            };
            if (sentSearch == null || !Same(search, sentSearch.Value))
            {
                sentSearch = search;
                session.SetSolver(new SolverSettings { Search = search });
            }
            Frame frame;
            var buffers = new FrameBuffers { Positions = Floats(positions), Normals = Floats(normals), Colours = Bytes(colours) };
            if (session.TryGetFrame(buffers, out frame)) Show();
        }
        catch (LpdeformException error)
        {
            Warn(error);
        }
    }

    /// Shows the shape of lower energy that the log has announced. Waits for the server's answer.
    [ContextMenu("Take the better shape")]
    public void TakeBetterShape()
    {
        if (session == null) return;
        try
        {
            session.TakeBetterShape();
        }
        catch (LpdeformException error)
        {
            Warn(error);
        }
    }

    /// Says what was wrong with a change; each error comes once. If the session was refused meanwhile, the error is the refusal.
    void Warn(LpdeformException error)
    {
        if (session.State == SessionState.Refused) Tell();
        else Debug.LogWarning("lpdeform: " + error.Message + " (" + error.Reason + ")", this);
    }

    /// Shows the session's state if it has changed, and releases a session that has ended, because it would throw at every call.
    void Tell()
    {
        var state = session.State;
        if (state == SessionState.Refused) Give("Refused: " + (session.Problem == null ? "" : session.Problem.Message));
        else if (said != state)
        {
            said = state;
            status = state.ToString();
            Debug.Log("lpdeform: " + status, this);
        }
    }

    /// Ends the session; the mesh stays as it is.
    void Give(string why)
    {
        status = why;
        Debug.LogWarning("lpdeform: " + why, this);
        Release();
    }

    void Send(HandleObject handle)
    {
        var now = Here(handle) * handle.start.inverse;  // since the start, in the object's coordinates
        Quaternion turn = now.rotation;
        Vector3 shift = now.MultiplyPoint3x4(Vector3.zero);
        var motion = new Motion
        {
            Rotation = new Quaternion4(turn.x, turn.y, turn.z, turn.w), Translation = new Vector3d(shift.x, shift.y, shift.z)
        };
        if (Same(motion, handle.sent)) return;
        session.Handles.Move(handle.name, motion);
        handle.sent = motion;
    }

    static bool Same(MinimaSearch a, MinimaSearch b)
    {
        return a.Show == b.Show && a.Effort == b.Effort && a.LeastShare.Equals(b.LeastShare);
    }

    /// Without the allocation of Equals(object).
    static bool Same(Motion a, Motion b)
    {
        return a.Rotation.X == b.Rotation.X && a.Rotation.Y == b.Rotation.Y && a.Rotation.Z == b.Rotation.Z &&
               a.Rotation.W == b.Rotation.W && a.Translation.X == b.Translation.X && a.Translation.Y == b.Translation.Y &&
               a.Translation.Z == b.Translation.Z;
    }

    Matrix4x4 Here(HandleObject handle)
    {
        return transform.worldToLocalMatrix * handle.transform.localToWorldMatrix;
    }

    void Show()
    {
        mesh.vertices = positions;
        mesh.normals = normals;
        if (showDistortion) mesh.colors32 = colours;
        mesh.RecalculateBounds();
    }

    void OnDisable()
    {
        Release();
        if (mesh == null) return;
        mesh.vertices = rest;
        mesh.normals = restNormals;
        mesh.colors32 = restColours;
        mesh.RecalculateBounds();
    }

    void Release()
    {
        if (session != null) session.Dispose();
        if (client != null) client.Dispose();
        session = null;
        client = null;
    }

    static Span<float> Floats(Vector3[] vectors)
    {
        return MemoryMarshal.Cast<Vector3, float>(vectors);
    }

    static Span<byte> Bytes(Color32[] colours)
    {
        return MemoryMarshal.Cast<Color32, byte>(colours);
    }

    static int[] Numbers(int count)
    {
        var numbers = new int[count];
        for (int k = 0; k < count; ++k) numbers[k] = k;
        return numbers;
    }
}
