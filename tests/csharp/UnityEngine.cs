// A small replacement of UnityEngine, so that the component and the sample of the package can be compiled and run without Unity. It has
// only what these use. Matrices only translate, and objects that are below others have no place of their own.

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
        public Vector3 localPosition { get { return position; } set { position = value; } }
        public Quaternion localRotation { get; set; }
        public void SetParent(Transform parent, bool worldPositionStays) { }
        public Matrix4x4 worldToLocalMatrix { get { return localToWorldMatrix.inverse; } }
        public Matrix4x4 localToWorldMatrix { get { return new Matrix4x4 { shift = position }; } }
    }
    public enum PrimitiveType { Cube = 3 }
    public sealed class GameObject : Object
    {
        public static readonly List<GameObject> All = new List<GameObject>();
        readonly Component components = new Component();
        public readonly bool[] active = { true };
        public GameObject(string name) { All.Add(this); }
        public static GameObject CreatePrimitive(PrimitiveType type)
        {
            var made = new GameObject("Cube");
            made.components.Attach(new MeshFilter());
            return made;
        }
        public Transform transform { get { return components.transform; } }
        public void SetActive(bool value) { active[0] = value; }
        public T GetComponent<T>() { return components.GetComponent<T>(); }
        public T AddComponent<T>() where T : Component, new()
        {
            var added = new T();
            added.Attach(GetComponent<MeshFilter>());
            components.Attach(added);
            return added;
        }
    }
    public static class Time { public static float time { get; set; } }
    public static class Mathf
    {
        public const float Rad2Deg = 57.29578f;
        public static float Sin(float x) { return (float)Math.Sin(x); }
        public static float Cos(float x) { return (float)Math.Cos(x); }
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
        public void RecalculateNormals() { normals = new Vector3[0]; }  // as a mesh that has none
    }
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero { get { return default(Vector3); } }
        public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3 { x = a.x - b.x, y = a.y - b.y, z = a.z - b.z }; }
    }
    public struct Quaternion
    {
        public float x, y, z, w;
        /// About y or z alone.
        public static Quaternion Euler(float x, float y, float z)
        {
            double half = (y + z) * Math.PI / 360;
            return new Quaternion { y = y == 0 ? 0 : (float)Math.Sin(half), z = z == 0 ? 0 : (float)Math.Sin(half), w = (float)Math.Cos(half) };
        }
        /// About y.
        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            float c = q.w * q.w - q.y * q.y, s = 2 * q.w * q.y;
            return new Vector3(c * v.x + s * v.z, v.y, c * v.z - s * v.x);
        }
    }
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
