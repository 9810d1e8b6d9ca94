using System.Runtime.InteropServices;

namespace Lpdeform
{
    /// x, y, z: a place, a direction or a shift, in the engine's coordinates.
    [StructLayout(LayoutKind.Sequential)]
    public struct Vector3d
    {
        public double X, Y, Z;

        public Vector3d(double x, double y, double z)
        {
            X = x;
            Y = y;
            Z = z;
        }
    }

    /// A rotation, of any length; all 0: none.
    [StructLayout(LayoutKind.Sequential)]
    public struct Quaternion4
    {
        public double X, Y, Z, W;

        public Quaternion4(double x, double y, double z, double w)
        {
            X = x;
            Y = y;
            Z = z;
            W = w;
        }
    }
}
