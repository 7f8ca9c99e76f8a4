// SPDX-License-Identifier: MIT
using System;

namespace Jostle.Tests
{
    /// What a frame leaves to the garbage collector: nothing.
    static class Garbage
    {
        const int frames = 400;

        static long Measure(Action<int> frame)
        {
            for (int k = 0; k < 50; ++k) frame(k); // code is compiled, memory grows
            long before = GC.GetAllocatedBytesForCurrentThread();
            for (int k = 0; k < frames; ++k) frame(k);
            return GC.GetAllocatedBytesForCurrentThread() - before;
        }

        public static object Kept;

        public static void IsNoticed()
        {
            Expect.True(Measure(k => { Kept = new object(); }) >= 16 * frames,
                "an object in each frame isn't noticed");
        }

        public static void OfAFrame()
        {
            const int count = 64;
            Box3[] boxes = Some.Boxes(1, count, false);
            Box3[] bounds = new Box3[count];
            Pose3[] poses = new Pose3[count];
            for (int i = 0; i < count; ++i) poses[i] = new Pose3(new Vec3(i, 0, 0));
            Ray3[] rays = { new Ray3(new Vec3(-1, 10, 10), new Vec3(1, 0, 0)),
                new Ray3(new Vec3(-1, 1, 1), new Vec3(1, 1, 1)) };
            Hit[] hits = new Hit[2];
            ObjectId[] ids = new ObjectId[count];
            Filter filter = new Filter { Category = new uint[count], Mask = new uint[count],
                Accept = (a, b) => a + b > 3 };
            QueryFilter asking = new QueryFilter { Accept = id => id.Index > 2 };
            for (int i = 0; i < count; ++i) filter.Category[i] = filter.Mask[i] = 1;
            using (Executor serial = Executor.Serial())
            using (PairFinder finder = new PairFinder(serial))
            using (World world = new World(Space.Float3, 0, (a, b) => a.Index + b.Index > 3, serial))
            using (Answers answers = new Answers())
            using (Shapes shapes = new Shapes())
            using (Shape ball = Shape.Sphere(0.75))
            using (ContactFinder3 contacts = new ContactFinder3(serial))
            {
                shapes.Add(ball, count);
                world.Add(boxes, ids);
                PairSink sink = pairs => true;
                long seen = 0;
                Action<int> frame = k =>
                {
                    for (int i = 0; i < count; ++i)
                    {
                        float by = (i + k) % 2 == 0 ? 0.5f : -0.5f;
                        boxes[i].Min.X += by;
                        boxes[i].Max.X += by;
                    }
                    foreach (Pair pair in finder.Find(boxes)) seen += pair.A;
                    foreach (Pair pair in finder.Find(boxes, filter, Order.Sorted)) seen += pair.A;
                    finder.Stream(boxes, sink);
                    world.Move(ids[0], boxes[0]);
                    world.SetUserData(ids[0], 5);
                    if (k % 2 == 0)
                    {
                        world.Move(ids, boxes);
                        world.Update();
                    }
                    else
                        world.Update(ids, boxes);
                    foreach (ObjectPair pair in world.Began) seen += pair.A.Index;
                    foreach (EndedPair pair in world.Ended) seen += pair.A.Index;
                    foreach (Pair pair in world.Persisted) seen += pair.A;
                    Hit hit;
                    if (world.First(rays[0], out hit)) seen += hit.Object.Index;
                    if (world.First(rays[1], out hit, asking)) seen += hit.Object.Index;
                    world.First(Query.Rays(rays), hits);
                    if (world.Nearest(new Sphere3(new Vec3(1, 2, 3), 100), out hit)) seen += hit.Object.Index;
                    world.All(boxes[3], answers);
                    foreach (ObjectId id in answers.Of(0)) seen += id.Index;
                    new Objects(shapes, poses).Bounds(bounds);
                    foreach (Contact3 contact in contacts.Find(new Objects(shapes, poses),
                        finder.Find(bounds))) seen += contact.Count;
                };
                long made = Measure(frame);
                Expect.Same(0L, made, "garbage of " + frames + " frames, in bytes,");
                Expect.True(seen > 0, "something was found");
            }
        }
    }
}
