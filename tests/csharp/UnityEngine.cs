// Declarations of what the Unity sample uses of UnityEngine, so that it can be compiled without Unity. Nothing here does anything.

using System;

namespace UnityEngine
{
    public class Object { }
    public class Component : Object
    {
        public Transform transform { get { return null; } }
        public T GetComponent<T>() { return default(T); }
    }
    public class Behaviour : Component { public bool enabled { get; set; } }
    public class MonoBehaviour : Behaviour { }
    public sealed class Transform : Component
    {
        public Matrix4x4 worldToLocalMatrix { get { return default(Matrix4x4); } }
        public Matrix4x4 localToWorldMatrix { get { return default(Matrix4x4); } }
    }
    public sealed class MeshFilter : Component { public Mesh mesh { get; set; } }
    public sealed class Mesh : Object
    {
        public Vector3[] vertices { get; set; }
        public Vector3[] normals { get; set; }
        public Color32[] colors32 { get; set; }
        public int[] triangles { get; set; }
        public void MarkDynamic() { }
        public void RecalculateBounds() { }
    }
    public struct Vector3
    {
        public float x, y, z;
        public static Vector3 zero { get { return default(Vector3); } }
        public float magnitude { get { return 0; } }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return default(Vector3); }
    }
    public struct Quaternion { public float x, y, z, w; }
    public struct Color32 { public byte r, g, b, a; }
    public struct Matrix4x4
    {
        public Matrix4x4 inverse { get { return default(Matrix4x4); } }
        public Quaternion rotation { get { return default(Quaternion); } }
        public Vector3 MultiplyPoint3x4(Vector3 point) { return point; }
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) { return a; }
    }
    public static class Debug
    {
        public static void Log(object message, Object context) { }
        public static void LogWarning(object message, Object context) { }
    }
    [AttributeUsage(AttributeTargets.Field)]
    public sealed class RangeAttribute : Attribute { public RangeAttribute(float min, float max) { } }
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute { public RequireComponent(Type type) { } }
}
