// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;

namespace Jostle.Tests
{
    static unsafe class Asking
    {
        static readonly Box3[] boxes = Some.Boxes(21, 600, false);

        static World Made(out ObjectId[] ids, Box3[] from)
        {
            World world = new World();
            ids = new ObjectId[from.Length];
            world.Add(from, ids);
            world.Update();
            return world;
        }

        /// By the definition, which the library has for one box: whether it answers, and where.
        static bool Answers(QueryKind kind, float* numbers, int count, Box3 box, out double at)
        {
            Native.jostle_queries queries = new Native.jostle_queries { kind = kind };
            queries.values = new Native.jostle_values { data = numbers, count = 1, stride = 4 * count };
            byte answers;
            double found;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_box_answers(Space.Float3, &queries, &box, &answers, &found,
                &error), &error);
            at = found;
            return answers != 0;
        }

        static Ray3[] Rays(int seed)
        {
            Random random = new Random(seed);
            Ray3[] rays = new Ray3[200];
            for (int i = 0; i < rays.Length; ++i)
            {
                Vec3 from = new Vec3(Some.Number(random, false), Some.Number(random, false),
                    Some.Number(random, false));
                Vec3 to = new Vec3(random.Next(-2, 3), random.Next(-2, 3), (float)random.NextDouble() - 0.5f);
                rays[i] = new Ray3(from, to, i % 3 == 0 ? float.PositiveInfinity
                    : (float)random.NextDouble() * 3);
            }
            return rays;
        }

        public static void FirstAlongRays()
        {
            ObjectId[] ids;
            using (World world = Made(out ids, boxes))
            {
                Ray3[] rays = Rays(1);
                Hit[] hits = new Hit[rays.Length];
                world.First(Query.Rays(rays), hits);
                for (int i = 0; i < rays.Length; ++i)
                {
                    double best = double.PositiveInfinity;
                    ObjectId who = default(ObjectId);
                    Ray3 ray = rays[i];
                    for (int k = 0; k < boxes.Length; ++k)
                    {
                        double at;
                        if (Answers(QueryKind.Ray, (float*)&ray, 7, boxes[k], out at) && at < best)
                        {
                            best = at;
                            who = ids[k];
                        }
                    }
                    Expect.Same(who, hits[i].Object, "what ray " + i + " meets");
                    if (hits[i].Found) Expect.Same(best, hits[i].At, "where");
                    Hit alone;
                    Expect.Same(hits[i].Found, world.First(ray, out alone), "found");
                    Expect.Same(hits[i].Object, alone.Object, "what a ray alone meets");
                    if (!hits[i].Found) continue;
                    Expect.True(!world.First(ray, out alone, new QueryFilter { Exclude = who })
                        || alone.Object != who, "excluded");
                    Expect.True(!world.First(ray, out alone, new QueryFilter { Accept = id => id != who })
                        || alone.Object != who, "refused");
                    Expect.Throws<FormatException>(() => world.First(rays[i], out alone,
                        new QueryFilter { Accept = id => { throw new FormatException("here"); } }), "here");
                }
            }
        }

        public static void AllInBoxes()
        {
            for (int seed = 0; seed < 6; ++seed)
            {
                ObjectId[] ids;
                Box3[] some = Some.Boxes(seed, 300, seed % 2 == 1),
                    asked = Some.Boxes(seed + 50, 40, seed % 2 == 1);
                using (World world = Made(out ids, some))
                using (Answers answers = new Answers())
                {
                    ulong[] counts = new ulong[asked.Length];
                    bool[] any = new bool[asked.Length];
                    world.All(Query.Boxes(asked), answers);
                    world.CountAnswers(Query.Boxes(asked), counts);
                    world.Any(Query.Boxes(asked), any);
                    Expect.Same(asked.Length, answers.Queries, "queries");
                    for (int i = 0; i < asked.Length; ++i)
                    {
                        HashSet<ObjectId> expected = new HashSet<ObjectId>(), found = new HashSet<ObjectId>();
                        for (int k = 0; k < some.Length; ++k)
                            if (Some.Touch(some[k], asked[i])) expected.Add(ids[k]);
                        foreach (ObjectId id in answers.Of(i)) found.Add(id);
                        Expect.SameSets(expected, found, "answers to query " + i);
                        Expect.Same((ulong)expected.Count, counts[i], "the count");
                        Expect.Same(expected.Count > 0, any[i], "whether there is any");
                        Expect.Same(0L, answers.At(i).Count, "places of regions");
                    }
                    world.All(asked[0], answers);
                    Expect.Same((long)counts[0], answers.Of(0).Count, "answers of one box");
                    world.All(Query.Boxes(asked), answers, null, default(Objects), 1);
                    for (int i = 0; i < asked.Length; ++i) Expect.Same(counts[i] > 1, answers.More(i),
                        "whether there are more");
                }
            }
        }

        public static void Nearest()
        {
            ObjectId[] ids;
            using (World world = Made(out ids, boxes))
            using (Answers answers = new Answers())
            {
                Random random = new Random(8);
                Sphere3[] points = new Sphere3[100];
                for (int i = 0; i < points.Length; ++i)
                    points[i] = new Sphere3(new Vec3(Some.Number(random, false), Some.Number(random, false),
                        Some.Number(random, false)), i % 2 == 0 ? float.PositiveInfinity : 1);
                world.All(Query.Nearest(points, 5), answers);
                for (int i = 0; i < points.Length; ++i)
                {
                    List<double> distances = new List<double>();
                    Sphere3 point = points[i];
                    foreach (Box3 box in boxes)
                    {
                        double at;
                        if (Answers(QueryKind.Nearest, (float*)&point, 4, box, out at)) distances.Add(at);
                    }
                    distances.Sort();
                    int k = 0;
                    foreach (double at in answers.At(i)) Expect.Same(distances[k++], at,
                        "the distance of neighbour " + k);
                    Expect.Same(Math.Min(5, distances.Count), k, "neighbours");
                    Hit hit;
                    Expect.Same(k > 0, world.Nearest(point, out hit), "found");
                    if (k > 0) Expect.Same(answers.Of(i).ToArray()[0], hit.Object, "the nearest");
                }
            }
        }

        public static void WithFilters()
        {
            using (World world = new World())
            using (Answers answers = new Answers())
            {
                Box3 box = new Box3(new Vec3(0, 0, 0), new Vec3(1, 1, 1));
                ObjectFilter red = ObjectFilter.All, owned = ObjectFilter.All;
                red.Category = 2;
                owned.Owner = 7;
                owned.Mask = 1;
                ObjectId plain = world.Add(box), colored = world.Add(box, red), mine = world.Add(box, owned);
                world.Update();
                QueryFilter[] filters =
                {
                    null, new QueryFilter { Owner = 7 }, new QueryFilter { Mask = 2 },
                        new QueryFilter { Category = 2 },
                    new QueryFilter { Exclude = plain }
                };
                ObjectId[][] expected =
                {
                    new[] { plain, colored, mine }, new[] { plain, colored }, new[] { colored },
                        new[] { plain, colored },
                    new[] { colored, mine }
                };
                for (int k = 0; k < filters.Length; ++k)
                {
                    world.All(box, answers, filters[k]);
                    Expect.SameSets(new HashSet<ObjectId>(expected[k]),
                        new HashSet<ObjectId>(answers.Of(0).ToArray()),
                        "answers with filter " + k);
                }
            }
        }

        public static void AboutShapes()
        {
            using (World world = new World())
            using (Shapes shapes = new Shapes())
            using (Answers answers = new Answers())
            using (Shape ball = Shape.Sphere(1), cube = Shape.Box(new Vec3(1, 1, 1)))
            {
                shapes.Add(ball);
                shapes.Add(cube);
                Pose3[] poses = { new Pose3(new Vec3(0, 0, 0)), new Pose3(new Vec3(10, 0, 0)) };
                Objects objects = new Objects(shapes, poses);
                Box3[] around = new Box3[2];
                objects.Bounds(around);
                ObjectId[] ids = new ObjectId[2];
                world.Add(around, ids);
                world.Update();
                // The first ray passes the ball, but not its box; the second meets the ball, the third the
                // cube.
                Ray3[] rays = { new Ray3(new Vec3(-5, 0.9f, 0.9f), new Vec3(1, 0, 0), 7),
                    new Ray3(new Vec3(-5, 0, 0), new Vec3(1, 0, 0)),
                                new Ray3(new Vec3(5, 0.9f, 0.9f), new Vec3(1, 0, 0)) };
                Hit[] hits = new Hit[3];
                CastHit3[] details = new CastHit3[3];
                world.First(Query.Rays(rays), objects, hits, details);
                Expect.True(!hits[0].Found && hits[1].Object == ids[0] && hits[2].Object == ids[1],
                    "what rays meet");
                Expect.Near(4, details[1].Fraction, "where a ray meets a ball");
                Expect.Near(-1, details[1].Normal.X, "its normal");
                Expect.Near(4, hits[2].At, "where a ray meets a cube");
                world.All(Query.Shapes(new Objects(shapes, new[] { new Pose3(new Vec3(1.5f, 0, 0)),
                    new Pose3(new Vec3(3, 3, 3)) })), answers, null, objects);
                Expect.Same(1L, answers.Of(0).Count, "what touches a ball at 1.5");
                Expect.Same(0L, answers.Of(1).Count, "what touches a cube at 3");
                hits = new Hit[2];
                details = new CastHit3[2];
                Pose3[] from = { new Pose3(new Vec3(-5, 0, 0)), new Pose3(new Vec3(-5, 50, 0)) };
                world.First(Query.ShapeSweeps(new Objects(shapes, from),
                    new[] { new Vec3(10, 0, 0), new Vec3(10, 0, 0) }), objects, hits, details);
                Expect.True(hits[0].Object == ids[0] && !hits[1].Found, "what sweeps meet");
                Expect.Near(0.3, details[0].Fraction, "where a ball that sweeps meets a ball");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(rays),
                    new Objects(shapes, poses), new Hit[3],
                    new CastHit3[2]), "3 hits", "2 details");
                Distance3[] distances = new Distance3[2];
                world.First(Query.NearestToShapes(new Objects(shapes, from)), objects, hits, distances);
                Expect.True(hits[0].Object == ids[0] && hits[1].Object == ids[0], "the nearest shapes");
                Expect.Near(3, distances[0].Distance, "the distance of a ball to a ball");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(rays),
                    new Objects(shapes, poses), new Hit[3], new CastHit2[3]), "CastHit2");
            }
        }
    }
}
