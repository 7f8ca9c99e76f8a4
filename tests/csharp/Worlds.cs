// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;

namespace Jostle.Tests
{
    static class Worlds
    {
        struct Two : IEquatable<Two>
        {
            public ulong A, B;
            public Two(ObjectId a, ObjectId b)
            {
                A = Math.Min(a.Value, b.Value);
                B = Math.Max(a.Value, b.Value);
            }
            public bool Equals(Two other) { return A == other.A && B == other.B; }
            public override int GetHashCode() { return (A * 31 + B).GetHashCode(); }
            public override string ToString() { return (uint)A + " and " + (uint)B; }
        }

        static HashSet<Two> Touching(Dictionary<ObjectId, Box3> boxes)
        {
            HashSet<Two> pairs = new HashSet<Two>();
            foreach (KeyValuePair<ObjectId, Box3> a in boxes)
                foreach (KeyValuePair<ObjectId, Box3> b in boxes)
                    if (a.Key.Index < b.Key.Index && Some.Touch(a.Value, b.Value)) pairs.Add(new Two(a.Key,
                        b.Key));
            return pairs;
        }

        public static void TellWhatBeginsAndEnds()
        {
            for (int seed = 0; seed < 8; ++seed)
                using (World world = new World())
                {
                    Random random = new Random(seed);
                    bool hostile = seed % 2 == 1;
                    Dictionary<ObjectId, Box3> boxes = new Dictionary<ObjectId, Box3>();
                    HashSet<Two> before = new HashSet<Two>();
                    for (int frame = 0; frame < 60; ++frame)
                    {
                        HashSet<ObjectId> moved = new HashSet<ObjectId>(), removed = new HashSet<ObjectId>();
                        ObjectId[] known = new ObjectId[boxes.Count];
                        boxes.Keys.CopyTo(known, 0);
                        foreach (ObjectId id in known)
                            if (random.Next(4) == 0)
                            {
                                boxes[id] = Some.Box(random, hostile);
                                moved.Add(id);
                                world.Move(id, boxes[id]);
                            }
                            else if (random.Next(20) == 0)
                            {
                                boxes.Remove(id);
                                removed.Add(id);
                                world.Remove(id);
                            }
                        Box3[] more = new Box3[random.Next(12)];
                        ObjectId[] ids = new ObjectId[more.Length];
                        for (int i = 0; i < more.Length; ++i) more[i] = Some.Box(random, hostile);
                        world.Add(more, ids);
                        for (int i = 0; i < more.Length; ++i) boxes.Add(ids[i], more[i]);
                        world.Update();

                        HashSet<Two> now = Touching(boxes), began = new HashSet<Two>(now),
                            ended = new HashSet<Two>(before), stays = new HashSet<Two>(now);
                        began.ExceptWith(before);
                        ended.ExceptWith(now);
                        stays.IntersectWith(before);
                        HashSet<Two> found = new HashSet<Two>();
                        foreach (ObjectPair pair in world.Began)
                        {
                            Expect.True(pair.A.Index < pair.B.Index, "not in order");
                            found.Add(new Two(pair.A, pair.B));
                        }
                        Expect.SameSets(began, found, "what began");
                        found.Clear();
                        foreach (EndedPair pair in world.Ended)
                        {
                            found.Add(new Two(pair.A, pair.B));
                            Expect.Same(removed.Contains(pair.A)
                                || removed.Contains(pair.B) ? EndReason.Removed : EndReason.MovedApart,
                                pair.Reason, "the reason");
                        }
                        Expect.SameSets(ended, found, "what ended");
                        found.Clear();
                        foreach (Pair pair in world.Persisted)
                        {
                            ObjectId a = world.Id(pair.A), b = world.Id(pair.B);
                            Two two = new Two(a, b);
                            Expect.True(stays.Contains(two), two + " doesn't persist");
                            found.Add(two);
                        }
                        foreach (Two two in stays)
                            if (moved.Contains(new ObjectId { Value = two.A })
                                || moved.Contains(new ObjectId { Value = two.B }))
                                // the same odd box again is no change
                                Expect.True(hostile || found.Contains(two),
                                    two + " isn't among what persists");
                        Expect.Same(world.Began.Count + world.Persisted.Count, world.ChangedPairs.Count,
                            "changed pairs");
                        Expect.Same((long)boxes.Count, world.Count, "the number of objects");
                        foreach (ObjectId id in removed) Expect.True(!world.Contains(id), "still there");
                        before = now;
                    }
                }
        }

        public static void UpdateWithMoves()
        {
            using (World one = new World(), other = new World())
            {
                Box3[] boxes = Some.Boxes(1, 400, false);
                ObjectId[] ids = new ObjectId[400], others = new ObjectId[400];
                one.Add(boxes, ids);
                other.Add(boxes, others);
                one.Update();
                other.Update();
                Random random = new Random(2);
                for (int frame = 0; frame < 10; ++frame)
                {
                    for (int i = 0; i < 400; ++i)
                    {
                        float by = (float)random.NextDouble();
                        boxes[i].Min.X += by;
                        boxes[i].Max.X += by;
                    }
                    one.Update(ids, boxes);
                    other.Move(others, boxes);
                    other.Update();
                    Expect.Same(other.Began.Count, one.Began.Count, "what began");
                    Expect.Same(other.Ended.Count, one.Ended.Count, "what ended");
                    Box3[] asked = new Box3[400];
                    one.GetBoxes(ids, new Span<Box3>(asked));
                    for (int i = 0; i < 400; ++i) Expect.Same(boxes[i].Min.X, asked[i].Min.X, "a box");
                }
            }
        }

        public static void FiltersMarginsAndData()
        {
            using (World world = new World(Space.Float2))
            {
                Box2 box = new Box2(new Vec2(0, 0), new Vec2(1, 1));
                ObjectId wall = world.Add(box, ObjectFilter.Static),
                    floor = world.Add(box, ObjectFilter.Static), ball = world.Add(box);
                world.Update();
                Expect.Same(2L, world.Began.Count, "pairs of two static ones and another");
                ObjectFilter still = ObjectFilter.All;
                still.IsStatic = true;
                Expect.True(still.IsStatic && ObjectFilter.Static.IsStatic && !ObjectFilter.All.IsStatic,
                    "static");
                world.SetFilter(ball, still);
                world.Update();
                Expect.Same(2L, world.Ended.Count, "pairs of what is static now");
                world.SetFilter(ball, ObjectFilter.All);
                world.Update();
                ObjectFilter nobody = ObjectFilter.All;
                nobody.Mask = 0;
                world.SetFilter(ball, nobody);
                world.Update();
                foreach (EndedPair pair in world.Ended) Expect.Same(EndReason.Filtered, pair.Reason,
                    "the reason");
                Expect.Same(2L, world.Ended.Count, "what ended");
                world.SetFilter(ball, ObjectFilter.All);
                world.SetEnabled(wall, false);
                world.Update();
                Expect.Same(1L, world.Began.Count, "with one that is disabled");
                world.Move(ball, new Box2(new Vec2(2, 0), new Vec2(3, 1)));
                world.Update();
                Expect.Same(1L, world.Ended.Count, "moved apart");
                world.SetMargin(ball, 1);
                world.Update();
                Expect.Same(1L, world.Began.Count, "with a margin");
                world.Add(new Box2(new Vec2(9, 0), new Vec2(10, 1)));
                world.Add(new Box2(new Vec2(11, 0), new Vec2(12, 1)), ObjectFilter.All, 1.5);
                world.Update();
                Expect.Same(1L, world.Began.Count, "with a margin from the beginning");
                // Of several commands for one object the one with the greatest sequence counts.
                world.Move(new[] { ball }, new[] { new Box2(new Vec2(50, 0), new Vec2(51, 1)) }, 5);
                world.Move(new[] { ball }, new[] { new Box2(new Vec2(60, 0), new Vec2(61, 1)) }, 3);
                world.Update();
                Box2[] where = new Box2[1];
                world.GetBoxes(new[] { ball }, new Span<Box2>(where));
                Expect.Same(50f, where[0].Min.X, "where the ball is");
                world.SetUserData(floor, 77);
                Expect.Same(77UL, world.UserData(floor), "user data");
                Expect.Same(0UL, world.UserData(ball), "user data of another");
            }
        }

        public static void FiltersOfEach()
        {
            Random random = new Random(3);
            Box3[] boxes = new Box3[60];
            ObjectFilter[] filters = new ObjectFilter[60];
            for (int i = 0; i < 60; ++i)
            {
                float x = random.Next(20), y = random.Next(4);
                boxes[i] = new Box3(new Vec3(x, y, 0), new Vec3(x + 1, y + 1, 1));
                filters[i] = new ObjectFilter { Category = 1u << random.Next(3), Mask = (uint)random.Next(8),
                    Owner = (uint)random.Next(20), IsStatic = random.Next(4) == 0 };
            }
            using (World many = new World(), one = new World())
            {
                ObjectId[] ids = new ObjectId[60];
                many.Add(boxes, ids, filters);
                for (int i = 0; i < 60; ++i)
                    Expect.Same(ids[i], one.Add(boxes[i], filters[i]), "the id");
                many.Add(default(Boxes), new ObjectId[0], default(ReadOnlySpan<ObjectFilter>));
                many.Update();
                one.Update();
                Expect.True(one.Began.Count > 10, "pairs");
                Expect.True(Convert.ToBase64String(one.Save()) == Convert.ToBase64String(many.Save()),
                    "one world isn't the other");
                Expect.Throws<JostleException>(() => many.Add(boxes, ids, new ObjectFilter[59]), "59 filters",
                    "60 boxes");
            }
        }

        public static void SaveAndRestore()
        {
            using (World world = new World(), other = new World())
            {
                ObjectId[] ids = new ObjectId[50];
                world.Add(Some.Boxes(3, 50, true), ids);
                world.Update();
                byte[] saved = world.Save();
                other.Restore(saved);
                Expect.Same(50L, other.Count, "objects");
                Expect.True(other.Contains(ids[7]), "an object");
                Expect.Throws<JostleException>(() => other.Restore(new byte[3]), "snapshot");
                Expect.Same(50L, other.Count, "objects after a refusal");
            }
        }

        public static void AskAboutPairsThatBegin()
        {
            int asked = 0;
            bool fail = false;
            using (World world = new World(Space.Float3, 0, (a, b) =>
            {
                ++asked;
                if (fail) throw new FormatException("not now");
                return a.Index != 0;
            }))
            {
                Box3 box = new Box3(new Vec3(0, 0, 0), new Vec3(1, 1, 1));
                for (int i = 0; i < 3; ++i) world.Add(box);
                fail = true;
                Expect.Throws<FormatException>(() => world.Update(), "not now");
                Expect.Same(0L, world.Began.Count, "pairs of an update that failed");
                fail = false;
                asked = 0;
                world.Update();
                Expect.Same(3, asked, "how often it was asked");
                Expect.Same(1L, world.Began.Count, "accepted pairs");
            }
        }

        public static void TakeCommandsFromAnyThread()
        {
            Box3[] boxes = Some.Boxes(41, 2000, false);
            ObjectId[][] ids = new ObjectId[4][];
            using (PairFinder finder = new PairFinder())
            using (World world = new World())
            {
                Action<Action<int>> onFour = work =>
                {
                    Thread[] threads = new Thread[4];
                    for (int k = 0; k < 4; ++k)
                    {
                        int which = k;
                        threads[k] = new Thread(() => work(which));
                        threads[k].Start();
                    }
                    foreach (Thread thread in threads) thread.Join();
                };
                onFour(k =>
                {
                    ids[k] = new ObjectId[500];
                    world.Add(new Span<Box3>(boxes, 500 * k, 500), ids[k]);
                });
                world.Update();
                Expect.Same(finder.Find(boxes).Count, world.Began.Count,
                    "pairs of objects from four threads");
                onFour(k => { foreach (ObjectId id in ids[k]) world.Move(id, new Box3()); });
                world.Update();
                Expect.Same(2000L * 1999 / 2, world.Began.Count + world.Persisted.Count,
                    "pairs in one place");

                // Disposed while others use it: they are told so.
                World doomed = new World();
                int told = 0;
                onFour(k =>
                {
                    try
                    {
                        for (int i = 0; ; ++i)
                        {
                            if (k == 0 && i == 2000) doomed.Dispose();
                            doomed.Add(new Box3());
                        }
                    }
                    catch (ObjectDisposedException)
                    {
                        Interlocked.Increment(ref told);
                    }
                });
                Expect.Same(4, told, "how many are told");
                // A finder that two use at a time does one call, or the other is refused.
                int done = 0, refused = 0;
                onFour(k =>
                {
                    for (int i = 0; i < 50; ++i)
                        try
                        {
                            finder.Find(boxes);
                            Interlocked.Increment(ref done);
                        }
                        catch (InvalidOperationException)
                        {
                            Interlocked.Increment(ref refused);
                        }
                });
                Expect.Same(200, done + refused, "calls");
                Expect.True(done > 0, "none was done");
            }
        }

        /// What native code is given as the context of accept lives as long as the world, and no longer.
        public static void GiveTheContextBack()
        {
            FieldInfo field = typeof(Handle).GetField("context",
                BindingFlags.Instance | BindingFlags.NonPublic);
            World world = new World(Space.Float3, 0, (a, b) => true);
            Expect.True(((GCHandle)field.GetValue(world.Handle)).IsAllocated, "no context");
            world.Dispose();
            Expect.True(!((GCHandle)field.GetValue(world.Handle)).IsAllocated, "a context");
        }

        /// A world whose accept refers to it is collected all the same.
        public static void AreCollected()
        {
            WeakReference[] seen = new WeakReference[50];
            Thread making = new Thread(() =>
            {
                for (int i = 0; i < 50; ++i)
                {
                    World world = null;
                    World[] itself = new World[1];
                    world = new World(Space.Float3, 0, (a, b) => itself[0].Contains(a));
                    itself[0] = world;
                    world.Add(new Box3());
                    world.Add(new Box3());
                    world.Update();
                    Expect.Same(1L, world.Began.Count, "pairs");
                    seen[i] = new WeakReference(world);
                }
            });
            making.Start();
            making.Join();
            int alive = 0;
            for (int tries = 0; tries < 10; ++tries)
            {
                GC.Collect();
                GC.WaitForPendingFinalizers();
            }
            foreach (WeakReference one in seen) alive += one.IsAlive ? 1 : 0;
            // some may be seen on a stack
            Expect.True(alive < 10, alive + " of 50 worlds are never collected");
        }
    }
}
