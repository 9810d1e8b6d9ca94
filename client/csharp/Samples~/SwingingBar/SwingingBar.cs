// Put this on an empty object of a scene: it makes a bar whose lower end stands and whose upper end swings, as a game would move it.

using UnityEngine;

public sealed class SwingingBar : MonoBehaviour
{
    public string address = "localhost:8080";

    const int Rows = 41;
    Transform head;

    void Start()
    {
        var bar = GameObject.CreatePrimitive(PrimitiveType.Cube);  // for its material
        bar.SetActive(false);  // until it has its handles
        bar.GetComponent<MeshFilter>().mesh = Tube();
        var deforms = bar.AddComponent<LpdeformMesh>();
        deforms.address = address;
        head = Handle(bar, 2);
        deforms.handles = new[] { Held("foot", Handle(bar, 0)), Held("head", head) };
        bar.SetActive(true);
    }

    void Update()
    {
        float angle = 0.9f * Mathf.Sin(2 * Time.time);
        head.localPosition = new Vector3(Mathf.Sin(angle), 1.3f + 0.7f * Mathf.Cos(angle), 0);
        head.localRotation = Quaternion.Euler(0, 0, -angle * Mathf.Rad2Deg);
    }

    static Transform Handle(GameObject bar, float height)
    {
        var handle = new GameObject("Handle").transform;
        handle.SetParent(bar.transform, false);
        handle.localPosition = new Vector3(0, height, 0);
        return handle;
    }

    static LpdeformMesh.HandleObject Held(string name, Transform transform)
    {
        return new LpdeformMesh.HandleObject { name = name, transform = transform, radius = 0.3f };
    }

    /// Four sides of 0.3 by 2, each with its own vertices, so that edges are hard.
    static Mesh Tube()
    {
        const int Columns = 6;
        var vertices = new Vector3[4 * Rows * Columns];
        var triangles = new int[4 * (Rows - 1) * (Columns - 1) * 6];
        int vertex = 0, corner = 0;
        for (int side = 0; side < 4; ++side)
        {
            var turn = Quaternion.Euler(0, 90 * side, 0);
            for (int row = 0; row < Rows; ++row)
                for (int column = 0; column < Columns; ++column, ++vertex)
                {
                    vertices[vertex] = turn * new Vector3(0.3f * column / (Columns - 1) - 0.15f, 2f * row / (Rows - 1), -0.15f);
                    if (row + 1 == Rows || column + 1 == Columns) continue;
                    // Clockwise seen from outside.
                    foreach (int next in new[] { 0, Columns, Columns + 1, 0, Columns + 1, 1 }) triangles[corner++] = vertex + next;
                }
        }
        var mesh = new Mesh { vertices = vertices, triangles = triangles };
        mesh.RecalculateNormals();
        return mesh;
    }
}
