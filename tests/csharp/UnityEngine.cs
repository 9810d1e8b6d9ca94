// A small replacement of UnityEngine, so that the sample can be compiled and run without Unity. It has only what the sample
// uses. Matrices only translate.

using System;
using System.Collections.Generic;

namespace UnityEngine
{
    public class Object { }
    public class Component : Object
    {
        readonly Dictionary<Type, object> others = new Dictionary<Type, object>();
        readonly Transform own;
        public Component() { own = this as Transform ?? new Transform(); }
        public Transform transform { get { return own; } }
        public T GetComponent<T>() { return (T)others[typeof(T)]; }
        public void Attach<T>(T other) { others[typeof(T)] = other; }
    }
    public class Behaviour : Component { public bool enabled { get; set; } }
    public class MonoBehaviour : Behaviour { }
    public sealed class Transform : Component
    {
        public Vector3 position;
        public Matrix4x4 worldToLocalMatrix { get { return localToWorldMatrix.inverse; } }
        public Matrix4x4 localToWorldMatrix { get { return new Matrix4x4 { shift = position }; } }
    }
    public sealed class MeshFilter : Component { public Mesh mesh { get; set; } }
    public sealed class Mesh : Object
    {
        public Vector3[] vertices { get; set; }
        public Vector3[] normals { get; set; }
        public Color32[] colors32 { get; set; }
        public int[] triangles { get; set; }
        public int timesDrawn;
        public void MarkDynamic() { }
        public void RecalculateBounds() { ++timesDrawn; }
    }
    public struct Vector3
    {
        public float x, y, z;
        public static Vector3 zero { get { return default(Vector3); } }
        public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3 { x = a.x - b.x, y = a.y - b.y, z = a.z - b.z }; }
    }
    public struct Quaternion { public float x, y, z, w; }
    public struct Color32 { public byte r, g, b, a; }
    public struct Matrix4x4
    {
        public Vector3 shift;
        public Matrix4x4 inverse { get { return new Matrix4x4 { shift = Vector3.zero - shift }; } }
        public Quaternion rotation { get { return new Quaternion { w = 1 }; } }
        public Vector3 MultiplyPoint3x4(Vector3 point) { return point - inverse.shift; }
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) { return new Matrix4x4 { shift = a.MultiplyPoint3x4(b.shift) }; }
    }
    public static class Debug
    {
        public static readonly List<string> Logs = new List<string>(), Warnings = new List<string>();
        public static void Log(object message, Object context) { Logs.Add(message.ToString()); }
        public static void LogWarning(object message, Object context) { Warnings.Add(message.ToString()); }
    }
    [AttributeUsage(AttributeTargets.Field)]
    public sealed class RangeAttribute : Attribute { public RangeAttribute(float min, float max) { } }
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class RequireComponent : Attribute { public RequireComponent(Type type) { } }
    [AttributeUsage(AttributeTargets.Method)]
    public sealed class ContextMenu : Attribute { public ContextMenu(string itemName) { } }
}
