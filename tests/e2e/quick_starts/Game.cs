// What the quick start of client/csharp/README.md leaves to its reader.
using System;
using System.Globalization;
using System.Threading;
using Lpdeform;

static class Game
{
    static readonly float[] positions = new float[66];
    static readonly int[] indices = new int[60], feet = { 0, 1 }, head = { 20, 21 };
    const double height = 1;
    static int pictures;
    static bool isDrawn;

    static void Draw(float[] drawn)
    {
        isDrawn = drawn[3 * 20 + 1] == 1;
    }

    /// Until the lifted head was drawn, a minute at most; 60 frames a second.
    static bool GameRuns()
    {
        Thread.Sleep(16);
        return !isDrawn && ++pictures < 3600;
    }

    static void Main()
    {
        var corners = new[] { 0, 1, 3, 0, 3, 2 };
        for (int i = 0; i < 22; ++i)
        {
            positions[3 * i] = i / 2;
            positions[3 * i + 2] = i % 2;
        }
        for (int k = 0; k < 60; ++k) indices[k] = 2 * (k / 6) + corners[k % 6];
        QUICK_START
        Console.WriteLine(positions[3 * 20 + 1].ToString(CultureInfo.InvariantCulture));
    }
}
