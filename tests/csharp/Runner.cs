// SPDX-License-Identifier: MIT Runs the static methods of Tests' classes: mono tests.exe [CLASS]. Without
// NuGet there is no framework of tests.
using System;
using System.Collections.Generic;
using System.Reflection;

namespace Jostle.Tests
{
    static class Runner
    {
        static readonly Type[] groups = { typeof(Pairs), typeof(Worlds), typeof(Asking), typeof(Shaped),
            typeof(Refusals), typeof(Garbage), typeof(Layout) };

        static int Main(string[] arguments)
        {
            int passed = 0, failed = 0;
            foreach (Type group in groups)
            {
                if (arguments.Length > 0 && arguments[0] != group.Name) continue;
                foreach (MethodInfo test in group.GetMethods(BindingFlags.Static | BindingFlags.Public))
                {
                    try
                    {
                        object[] given = test.GetParameters().Length == 0 ? null : new object[] { arguments };
                        test.Invoke(null, given);
                        ++passed;
                    }
                    catch (TargetInvocationException thrown)
                    {
                        ++failed;
                        Console.WriteLine("FAILED " + group.Name + "." + test.Name + ": " +
                            thrown.InnerException);
                    }
                }
            }
            Console.WriteLine(passed + " passed, " + failed + " failed");
            return failed == 0 && passed > 0 ? 0 : 1;
        }
    }

    static class Expect
    {
        public static void True(bool holds, string what)
        {
            if (!holds) throw new Exception(what);
        }

        public static void Same<T>(T expected, T found, string what)
        {
            if (!EqualityComparer<T>.Default.Equals(expected, found)) throw new Exception(what + " is " +
                found + ", not " + expected);
        }

        public static void Near(double expected, double found, string what)
        {
            if (!(Math.Abs(expected - found) <= 1e-5 * (1 + Math.Abs(expected)))) throw new Exception(what +
                " is " + found + ", not " + expected);
        }

        public static void SameSets<T>(HashSet<T> expected, HashSet<T> found, string what)
        {
            foreach (T item in expected)
                if (!found.Contains(item)) throw new Exception(what + " lacks " + item + ", has " +
                    found.Count + " in place of " + expected.Count);
            foreach (T item in found)
                if (!expected.Contains(item)) throw new Exception(what + " has " + item + " too many");
        }

        /// What is thrown, whose message has these parts.
        public static E Throws<E>(Action action, params string[] parts) where E : Exception
        {
            try
            {
                action();
            }
            catch (E thrown)
            {
                foreach (string part in parts)
                    if (!thrown.Message.Contains(part)) throw new Exception("'" + thrown.Message +
                        "' doesn't say '" + part + "'");
                return thrown;
            }
            throw new Exception("nothing was thrown");
        }
    }

    /// Boxes of all kinds, the same ones for the same seed.
    static class Some
    {
        static readonly float[] odd = { 0, -0.0f, 1, -1, 0.5f, float.Epsilon, -float.Epsilon, float.MaxValue,
            -float.MaxValue,
                                        float.PositiveInfinity, float.NegativeInfinity, 1e-30f, 16777216,
                                            16777217 };

        public static float Number(Random random, bool hostile)
        {
            if (hostile && random.Next(3) == 0) return odd[random.Next(odd.Length)];
            return hostile ? random.Next(-4, 5) : (float)(random.NextDouble() * 20);
        }

        public static Box3 Box(Random random, bool hostile)
        {
            float[] lo = new float[3], hi = new float[3];
            for (int d = 0; d < 3; ++d)
            {
                float a = Number(random, hostile), b = hostile ? Number(random, true) : a +
                    (float)random.NextDouble() * 2;
                lo[d] = Math.Min(a, b);
                hi[d] = Math.Max(a, b);
            }
            return new Box3(new Vec3(lo[0], lo[1], lo[2]), new Vec3(hi[0], hi[1], hi[2]));
        }

        public static Box3[] Boxes(int seed, int count, bool hostile)
        {
            Random random = new Random(seed);
            Box3[] boxes = new Box3[count];
            for (int i = 0; i < count; ++i) boxes[i] = Box(random, hostile);
            return boxes;
        }

        /// The definition.
        public static bool Touch(Box3 a, Box3 b)
        {
            return a.Min.X <= b.Max.X && b.Min.X <= a.Max.X && a.Min.Y <= b.Max.Y && b.Min.Y <= a.Max.Y
                && a.Min.Z <= b.Max.Z && b.Min.Z <= a.Max.Z;
        }
    }
}
