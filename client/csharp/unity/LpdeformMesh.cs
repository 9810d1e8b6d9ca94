// A sample for Unity: fits a MeshFilter to the handles around it. Put Lpdeform.dll and liblpdeform_client.so below Assets/Plugins
// and this file below Assets; add it to an object with a MeshFilter whose mesh is readable; give it handles.
//
// Compiled here against declarations of what it uses of UnityEngine, and not run inside Unity.

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
        [NonSerialized] public Motion sent;
    }

    public string address = "localhost:50051";
    [Range(1, 8)] public float p = 2;
    public bool showDistortion = true;
    public HandleObject[] handles = new HandleObject[0];

    Client client;
    Session session;
    UnityEngine.Mesh mesh;
    Vector3[] positions, normals;
    Color32[] colours;
    SessionState state;
    float sentP;

    void OnEnable()
    {
        mesh = GetComponent<MeshFilter>().mesh;  // this object's own copy
        mesh.MarkDynamic();
        positions = mesh.vertices;
        normals = mesh.normals;
        if (normals.Length != positions.Length) normals = new Vector3[positions.Length];
        colours = new Color32[positions.Length];

        client = new Client(address);
        var data = new MeshData
        {
            Positions = Floats(positions).ToArray(),
            Normals = Floats(normals).ToArray(),
            Indices = mesh.triangles,
            WeldByPosition = true  // Unity has several vertices along seams
        };
        session = client.Open(data, new SessionOptions { WithNormals = true, FreeComponents = FreeComponents.Follow });
        foreach (var handle in handles) Hold(handle);
    }

    void Hold(HandleObject handle)
    {
        handle.start = Here(handle);
        var center = handle.start.MultiplyPoint3x4(Vector3.zero);
        var held = Array.FindAll(Numbers(positions.Length), i => (positions[i] - center).magnitude < handle.radius);
        if (held.Length == 0) Debug.LogWarning("No vertex is within the radius of the handle " + handle.name, this);
        else session.Handles.Set(handle.name, held);
    }

    /// Once a picture. Nothing here waits for the network.
    void Update()
    {
        if (session == null) return;
        foreach (var handle in handles) Send(handle);
        if (p != sentP) session.Set(p: sentP = p);
        try
        {
            Frame frame;
            var buffers = new FrameBuffers { Positions = Floats(positions), Normals = Floats(normals), Colours = Bytes(colours) };
            if (session.TryGetFrame(buffers, out frame)) Show();
        }
        catch (LpdeformException error)
        {
            Debug.LogWarning("lpdeform: " + error.Message + " (" + error.Reason + ")", this);
        }
        if (session.State == state) return;
        state = session.State;
        Debug.Log("lpdeform: " + state, this);
        if (state == SessionState.Refused) enabled = false;
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
        if (motion.Equals(handle.sent)) return;
        handle.sent = motion;
        session.Handles.Move(handle.name, motion);
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
