// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;
using System.Runtime.InteropServices;

namespace Jostle.Tests
{
    /// Where members lie: in Native.cs as in C, and in the public structs as in Native.cs.
    static class Layout
    {
        const BindingFlags members = BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic;

        /// The second argument of the program: what extras/csharp/describe.py --layout prints in C.
        public static void IsThatOfC(string[] arguments)
        {
            Expect.True(arguments.Length == 2, "arguments: Layout FILE");
            List<string> expected = new List<string>(File.ReadAllLines(arguments[1])),
                found = new List<string>();
            foreach (Type type in typeof(Native).GetNestedTypes())
            {
                if (!type.IsValueType) continue;
                found.Add(type.Name + " " + Marshal.SizeOf(type));
                foreach (FieldInfo field in type.GetFields(members)) found.Add(type.Name + "." + field.Name +
                    " " + Marshal.OffsetOf(type, field.Name));
            }
            expected.Sort(StringComparer.Ordinal);
            found.Sort(StringComparer.Ordinal);
            Expect.True(expected.Count > 200, "C has structs");
            for (int i = 0; i < Math.Max(expected.Count, found.Count); ++i)
                Expect.Same(i < expected.Count ? expected[i] : "nothing",
                    i < found.Count ? found[i] : "nothing", "line " + i);
        }

        static readonly Type[] same =
        {
            typeof(Pair), typeof(Native.jostle_pair), typeof(ObjectPair), typeof(Native.jostle_id_pair),
                typeof(EndedPair), typeof(Native.jostle_ended_pair),
            typeof(ObjectFilter), typeof(Native.jostle_object_filter), typeof(Hit), typeof(Native.jostle_hit),
            typeof(ContactPoint2), typeof(Native.jostle_contact_point_2f), typeof(ContactPoint3),
                typeof(Native.jostle_contact_point_3f),
            typeof(Contact2), typeof(Native.jostle_contact_2f), typeof(Contact3),
                typeof(Native.jostle_contact_3f),
            typeof(CastHit2), typeof(Native.jostle_cast_hit_2f), typeof(CastHit3),
                typeof(Native.jostle_cast_hit_3f)
        };

        public static void OfPublicStructs()
        {
            for (int i = 0; i < same.Length; i += 2)
            {
                FieldInfo[] ours = same[i].GetFields(members), native = same[i + 1].GetFields(members);
                Expect.Same(Marshal.SizeOf(same[i + 1]), Marshal.SizeOf(same[i]),
                    "the size of " + same[i].Name);
                Expect.Same(native.Length, ours.Length, "the members of " + same[i].Name);
                for (int k = 0; k < ours.Length; ++k)
                {
                    string name = native[k].Name.Replace("_", "").ToLowerInvariant();
                    Expect.Same(name, ours[k].Name == "Object" ? "id" : ours[k].Name.ToLowerInvariant(),
                        "the name of a member of " + same[i].Name);
                    Expect.Same((int)Marshal.OffsetOf(same[i + 1], native[k].Name),
                        (int)Marshal.OffsetOf(same[i], ours[k].Name), same[i].Name + "." + ours[k].Name);
                }
            }
        }

        public static void OfNumbers()
        {
            Expect.Same(24, SizeOf<Box3>.Bytes, "a box");
            Expect.Same(16, SizeOf<Box2>.Bytes, "a box in 2D");
            Expect.Same(28, SizeOf<Ray3>.Bytes, "a ray");
            Expect.Same(20, SizeOf<Ray2>.Bytes, "a ray in 2D");
            Expect.Same(16, SizeOf<Sphere3>.Bytes, "a ball");
            Expect.Same(12, SizeOf<Sphere2>.Bytes, "a circle");
            Expect.Same(28, SizeOf<Pose3>.Bytes, "a pose");
            Expect.Same(16, SizeOf<Pose2>.Bytes, "a pose in 2D");
            Expect.Same(40, SizeOf<Distance3>.Bytes, "a distance");
            Expect.Same(28, SizeOf<Distance2>.Bytes, "a distance in 2D");
            Expect.Same(8, SizeOf<ObjectId>.Bytes, "an id");
            Expect.Same(12, SizeOf<System.Numerics.Vector3>.Bytes, "a vector of System.Numerics");
        }
    }
}
