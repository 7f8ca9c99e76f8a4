// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace Jostle.Tests
{
    static class Shaped
    {
        static Shape Cube() // as a hull
        {
            List<Vec3> corners = new List<Vec3>();
            for (int k = 0; k < 8; ++k) corners.Add(new Vec3((k & 1) * 2 - 1, (k & 2) - 1, (k & 4) / 2 - 1));
            return Shape.Hull(corners.ToArray());
        }

        public static void Spheres()
        {
            Random random = new Random(1);
            using (ContactFinder3 finder = new ContactFinder3())
            using (Shapes shapes = new Shapes())
            using (PairFinder pairFinder = new PairFinder())
            {
                const int count = 400;
                double[] radii = new double[count];
                Pose3[] poses = new Pose3[count];
                for (int i = 0; i < count; ++i)
                {
                    radii[i] = 0.25 + random.NextDouble();
                    using (Shape ball = Shape.Sphere(radii[i])) shapes.Add(ball); // which the list keeps
                    poses[i] = new Pose3(new Vec3(Some.Number(random, false), Some.Number(random, false),
                        Some.Number(random, false)));
                }
                Box3[] boxes = new Box3[count];
                new Objects(shapes, poses).Bounds(boxes);
                View<Pair> near = pairFinder.Find(boxes);
                Dictionary<Pair, float> found = new Dictionary<Pair, float>();
                foreach (Contact3 contact in finder.Find(new Objects(shapes, poses), near))
                {
                    found.Add(contact.Pair, contact.Point0.Depth);
                    Vec3 a = poses[contact.Pair.A].Position, b = poses[contact.Pair.B].Position;
                    Vec3 point = contact.Point(0).FromA, other = contact.Point0.FromB;
                    Expect.Same(1u, contact.Count, "points");
                    Expect.Near(a.X + point.X, b.X + other.X, "the point from both");
                    double length = Math.Sqrt(contact.Normal.X * contact.Normal.X +
                        contact.Normal.Y * contact.Normal.Y + contact.Normal.Z * contact.Normal.Z);
                    Expect.Near(1, length, "the normal's length");
                }
                int expected = 0;
                for (int a = 0; a < count; ++a)
                    for (int b = a + 1; b < count; ++b)
                    {
                        double x = poses[a].Position.X - poses[b].Position.X,
                            y = poses[a].Position.Y - poses[b].Position.Y,
                            z = poses[a].Position.Z - poses[b].Position.Z;
                        double depth = radii[a] + radii[b] - Math.Sqrt(x * x + y * y + z * z);
                        if (Math.Abs(depth) < 1e-4) continue; // rounding decides
                        float seen;
                        bool has = found.TryGetValue(new Pair((uint)a, (uint)b), out seen)
                            || found.TryGetValue(new Pair((uint)b, (uint)a), out seen);
                        Expect.Same(depth > 0, has, "whether " + a + " and " + b + " touch");
                        if (has) Expect.True(Math.Abs(depth - seen) < 1e-4, "the depth");
                        expected += has ? 1 : 0;
                    }
                Expect.True(expected > 50, "there is something to find");
            }
        }

        public static void BoxesCapsulesAndHulls()
        {
            using (ContactFinder3 finder = new ContactFinder3())
            using (Shapes shapes = new Shapes())
            using (Shape box = Shape.Box(new Vec3(1, 1, 1)), hull = Cube(), capsule = Shape.Capsule(1, 0.5),
                ground = Shape.HalfSpace(new Vec3(0, 1, 0)))
            {
                shapes.Add(box);
                shapes.Add(hull);
                shapes.Add(capsule);
                shapes.Add(ground);
                Pose3[] poses = { new Pose3(new Vec3(0, 0, 0)), new Pose3(new Vec3(1.75f, 0.25f, 0)),
                    new Pose3(new Vec3(0, 2.25f, 0)), new Pose3(new Vec3(0, -0.875f, 0)) };
                Pair[] pairs = { new Pair(0, 1), new Pair(0, 2), new Pair(0, 3), new Pair(1, 2) };
                Contact3[] contacts = finder.Find(new Objects(shapes, poses), pairs).ToArray();
                Expect.Same(3, contacts.Length, "contacts");
                Expect.Same(4u, contacts[0].Count, "points of two boxes");
                Expect.Near(0.25, contacts[0].Point0.Depth, "the depth of a hull in a box");
                Expect.Near(1, contacts[0].Normal.X, "their normal");
                Expect.Near(0.25, contacts[1].Point0.Depth, "the depth of a capsule in a box");
                Expect.Near(1, contacts[1].Normal.Y, "their normal");
                Expect.Near(0.125, contacts[2].Point0.Depth, "the depth of a box in the ground");
                Expect.Near(-1, contacts[2].Normal.Y, "their normal");
                Expect.Throws<ArgumentOutOfRangeException>(() => contacts[0].Point(4));

                bool[] touching = new bool[4];
                Distance3[] distances = new Distance3[4];
                finder.Touching(new Objects(shapes, poses), pairs, touching);
                finder.Distances(new Objects(shapes, poses), pairs, distances);
                Expect.True(touching[0] && touching[1] && touching[2] && !touching[3], "what touches");
                Expect.Near(-0.25, distances[0].Distance, "the distance of what overlaps");
                Expect.True(distances[3].Distance > 0 && distances[3].Distance < 1.5,
                    "the distance of what doesn't");
                finder.Distances(new Objects(shapes, poses), pairs, distances, 0.01);
                Expect.True(float.IsPositiveInfinity(distances[3].Distance), "beyond what was looked at");
                // The same as two sets, and as parts of one shape.
                Contact3[] again = finder.Find(new Objects(shapes, poses), new Objects(shapes, poses),
                    new ReadOnlySpan<Pair>(pairs, 0, 1)).ToArray();
                Expect.Same(contacts[0].Point0.Depth, again[0].Point0.Depth, "the depth in two sets");
                using (Shape both = Shape.Compound(new[] { box, capsule },
                    new[] { new Pose3(new Vec3(0, 0, 0)), new Pose3(new Vec3(0, 2.25f, 0)) }))
                {
                    shapes.Set(0, both);
                    again = finder.Find(new Objects(shapes, poses),
                        new ReadOnlySpan<Pair>(pairs, 0, 1)).ToArray();
                    Expect.Near(0.25, again[0].Point0.Depth, "the depth in a part");
                }
            }
        }

        [StructLayout(LayoutKind.Sequential)]
        struct Body
        {
            public ulong Name;
            public System.Numerics.Vector3 Position;
            public System.Numerics.Quaternion Rotation;
            public float Health;
        }

        public static void PosesInsideStructs()
        {
            Body[] bodies = new Body[2];
            bodies[0] = new Body { Name = 1, Rotation = System.Numerics.Quaternion.Identity,
                Health = float.NaN };
            bodies[1] = new Body { Name = 2, Position = new System.Numerics.Vector3(1.5f, 0, 0),
                Rotation = new System.Numerics.Quaternion(0, 0, 1, 0) };
            using (ContactFinder3 finder = new ContactFinder3())
            using (Shapes shapes = new Shapes())
            using (Shape ball = Shape.Sphere(1), mesh = Shape.Mesh(new[] { new Vec3(-9, 0, -9),
                new Vec3(9, 0, -9), new Vec3(0, 0, 9) }, new[] { 0, 2, 1 }))
            {
                shapes.Add(ball, 2);
                int at = (int)Marshal.OffsetOf(typeof(Body), "Position");
                Pair[] pairs = { new Pair(0, 1) };
                Contact3[] contacts = finder.Find(new Objects(shapes, Values.Of(bodies, at)),
                    pairs).ToArray();
                Expect.Near(0.5, contacts[0].Point0.Depth, "the depth");
                shapes.Set(0, mesh);
                bodies[1].Position = new System.Numerics.Vector3(0, 0.75f, 0);
                contacts = finder.Find(new Objects(shapes, Values.Of(bodies, at)), pairs).ToArray();
                Expect.Near(0.25, contacts[0].Point0.Depth, "the depth on a mesh");
            }
        }

        public static void InTwoDimensions()
        {
            using (ContactFinder2 finder = new ContactFinder2())
            using (Shapes shapes = new Shapes(2))
            using (Shape box = Shape.Box(new Vec2(1, 1)), circle = Shape.Sphere(1, 2),
                hull = Shape.Hull(new[] { new Vec2(-1, -1), new Vec2(1, -1), new Vec2(0, 1) }, Space.Float2))
            {
                shapes.Add(box);
                shapes.Add(circle);
                shapes.Add(hull);
                Pose2[] poses = { new Pose2(new Vec2(0, 0)), new Pose2(new Vec2(1.75f, 0)),
                    new Pose2(new Vec2(0, 1.875f)) };
                Contact2[] contacts = finder.Find(new Objects(shapes, poses),
                    new[] { new Pair(0, 1), new Pair(0, 2) }).ToArray();
                Expect.Near(0.25, contacts[0].Point0.Depth, "the depth");
                Expect.Near(0.125, contacts[1].Point(0).Depth, "the depth of a hull");
                Expect.Same(2u, contacts[1].Count, "points");
            }
        }
    }
}
