// SPDX-License-Identifier: MIT
using System;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;

namespace Jostle.Tests
{
    static class Refusals
    {
        static readonly Box3 unit = new Box3(new Vec3(0, 0, 0), new Vec3(1, 1, 1));

        public static void OfBoxes()
        {
            Box3[] boxes = { unit, unit, unit };
            using (PairFinder finder = new PairFinder())
            using (World world = new World())
            {
                boxes[1].Max.Y = float.NaN;
                JostleException thrown = Expect.Throws<JostleException>(() => finder.Find(boxes), "1", "NaN");
                Expect.Same(Status.NanCoordinate, thrown.Status, "the status");
                Expect.Same((ulong?)1, thrown.Index, "the index");
                boxes[1] = unit;
                boxes[2].Min.X = 5;
                thrown = Expect.Throws<JostleException>(() => finder.Find(boxes), "2", "5");
                Expect.Same(Status.InvertedBox, thrown.Status, "the status");
                ObjectId[] ids = new ObjectId[3];
                Expect.Throws<JostleException>(() => world.Add(boxes, ids), "2", "5");
                boxes[2] = unit;
                world.Add(boxes, ids);
                world.Update();
                boxes[0].Min.Z = float.NaN;
                Expect.Throws<JostleException>(() => world.Move(ids, boxes), "NaN");
                Expect.Throws<JostleException>(() => world.Update(ids, boxes), "NaN");
                Expect.Throws<JostleException>(() => world.Add(new Box3(new Vec3(1, 0, 0),
                    new Vec3(0, 0, 0))), "1");
                world.Update();
                Expect.Same(3L, world.Count, "objects");
                Expect.Same(0L, world.Ended.Count, "what ended");
            }
        }

        struct Odd { public Vec3 Min; public Vec2 Max; }
        struct Late { public double Before; public Ray2 Ray; public int After; }
        struct Referring { public Vec3 Min, Max; public string Name; }

        public static void OfLayouts()
        {
            using (PairFinder finder = new PairFinder())
            using (World world = new World())
            {
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new float[7])), "7", "Float3");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new double[6])), "Double", "8");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Odd[2])), "Odd", "20");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Odd[2], 0, 12)), "12", "Odd");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Odd[2], -4, 0)), "-4");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Odd[2], 2, 2)), "aligned");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Vec3[2], new Vec3[3])), "2",
                    "3");
                Expect.Throws<JostleException>(() => finder.Find(Boxes.Of(new Vec2[2], new Vec2[2])), "Vec2");
                Expect.Throws<ArgumentException>(() => finder.Find(Boxes.Of(new Referring[2], 0, 12)));
                Expect.Throws<JostleException>(() => finder.Find(new[] { unit }, new[] { new Box2() }),
                    "Float3", "Float2");
                Expect.Throws<JostleException>(() => world.Add(new Box2()), "Float2", "Float3");
                Expect.Throws<JostleException>(() => world.Add(new[] { unit }, new ObjectId[2]), "2 ids",
                    "1 boxes");
                Expect.Throws<JostleException>(() => world.Move(new ObjectId[2], new[] { unit }), "2 ids",
                    "1 boxes");
                Expect.Throws<JostleException>(() => world.Update(new ObjectId[2], new[] { unit }), "2 ids",
                    "1 boxes");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(new Ray3[2]), new Hit[1]),
                    "2 queries", "1 ");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(new float[8]), new Hit[1]),
                    "queries", "7 numbers");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(new double[7]), new Hit[1]), "8",
                    "4");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(new Ray2[1]), new Hit[1]), "28",
                    "steps of 20");
                Expect.Throws<JostleException>(() => world.First(Query.Rays(Values.Of(new Late[2], 8)),
                    new Hit[2]), "28", "56 bytes");
                Expect.Throws<JostleException>(() => world.Any(Query.Boxes(new[] { unit }), new bool[2]),
                    "1 queries", "2 ");
                Expect.Throws<ArgumentOutOfRangeException>(() => Query.Nearest(new Sphere3[1], 0));
                Expect.Throws<JostleException>(() => world.GetBoxes(new ObjectId[1],
                    new Span<Box3>(new Box3[2])), "1 ids", "2 boxes");
            }
        }

        public static void OfIds()
        {
            using (World world = new World(), other = new World())
            {
                ObjectId id = world.Add(unit);
                world.Update();
                world.Remove(id);
                world.Update();
                Expect.Same(Status.StaleId, Expect.Throws<JostleException>(() => world.Move(id, unit),
                    "0").Status, "the status");
                Expect.Throws<JostleException>(() => world.Remove(id));
                Expect.Throws<JostleException>(() => world.SetEnabled(id, true));
                Expect.Throws<JostleException>(() => world.SetFilter(id, ObjectFilter.All));
                Expect.Throws<JostleException>(() => world.SetMargin(id, 1));
                Expect.Throws<JostleException>(() => world.Remove(default(ObjectId)));
                Expect.Throws<JostleException>(() => other.Move(id, unit));
                Expect.Throws<JostleException>(() => world.Update(new[] { id }, new[] { unit }));
                Expect.True(!world.Contains(id) && !world.Contains(new ObjectId { Value = ulong.MaxValue }),
                    "contains");
                Expect.Same(default(ObjectId), world.Id(77), "the id of no index");
            }
        }

        public static void OfWhatIsDisposed()
        {
            PairFinder finder = new PairFinder();
            World world = new World();
            Answers answers = new Answers();
            Shape ball = Shape.Sphere(1);
            Shapes shapes = new Shapes();
            ContactFinder3 contacts = new ContactFinder3();
            Executor executor = Executor.Serial();
            shapes.Add(ball);
            ObjectId id = world.Add(unit);
            world.Update();
            world.All(unit, answers);
            foreach (IDisposable one in new IDisposable[] { finder, world, answers, ball, shapes, contacts,
                executor })
            {
                one.Dispose();
                one.Dispose(); // twice is once
            }
            Hit hit;
            Gone("PairFinder", () => finder.Find(new[] { unit }));
            Gone("PairFinder", () => finder.Stream(new[] { unit }, pairs => true));
            Gone("PairFinder", () => finder.ReleaseMemory());
            Gone("World", () => world.Update());
            Gone("World", () => world.Add(unit));
            Gone("World", () => world.Move(id, unit));
            Gone("World", () => Began(world));
            Gone("World", () => world.Save());
            Gone("World", () => world.First(new Ray3(), out hit));
            Gone("Answers", () => Of(answers, 0));
            Gone("Answers", () => { using (World other = new World()) other.All(unit, answers); });
            Gone("Shape", () => new Shapes().Add(ball));
            Gone("Shape", () => Shape.Compound(new[] { ball }, new Pose3[1]));
            Gone("Shapes", () => shapes.Add(Shape.Sphere(1)));
            Gone("Shapes", () => new ContactFinder3().Find(new Objects(shapes, new Pose3[1]), new Pair[1]));
            Gone("Shapes", () => new Objects(shapes, new Pose3[1]).Bounds(new Box3[1]));
            Gone("ContactFinder3", () => contacts.Find(new Objects(new Shapes(), new Pose3[0]), new Pair[0]));
            Gone("Executor", () => new PairFinder(executor));
            Gone("Executor", () => new World(Space.Float3, 0, null, executor));
        }

        static void Gone(string owner, Action action)
        {
            Expect.Same(owner, Expect.Throws<ObjectDisposedException>(action).ObjectName, "what is disposed");
        }

        static void Began(World world)
        {
            foreach (ObjectPair pair in world.Began) Expect.True(false, "read");
        }
        static void Of(Answers answers, int query) { answers.Of(query).ToArray(); }

        public static void OfResultsThatAreOver()
        {
            using (World world = new World())
            using (Answers answers = new Answers())
            {
                world.Add(unit);
                world.Add(unit);
                world.Update();
                // Disposed, or called again, in the middle of its own result.
                PairFinder finder = new PairFinder();
                Expect.Throws<ObjectDisposedException>(() =>
                    { foreach (Pair pair in finder.Find(new[] { unit, unit, unit })) finder.Dispose(); });
                PairFinder other = new PairFinder();
                Expect.Throws<InvalidOperationException>(() =>
                    { foreach (Pair pair in other.Find(new[] { unit, unit, unit })) other.Find(new[] { unit,
                    unit }); }, "PairFinder");
                Expect.Throws<InvalidOperationException>(() =>
                    { View<Pair> pairs = other.Find(new[] { unit,
                    unit }); other.ReleaseMemory(); pairs.ToArray(); });
                Expect.Throws<InvalidOperationException>(() =>
                    { View<ObjectPair> pairs = world.Began; world.Update(); pairs.ToArray(); }, "World");
                Expect.Throws<InvalidOperationException>(() =>
                {
                    world.All(unit, answers);
                    View<ObjectId> ids = answers.Of(0);
                    world.All(unit, answers);
                    ids.ToArray();
                }, "Answers");
                // Pairs that are over are refused by what is given them, too.
                using (ContactFinder3 contacts = new ContactFinder3())
                using (Shapes shapes = new Shapes())
                    Expect.Throws<InvalidOperationException>(() =>
                    {
                        View<Pair> pairs = other.Find(new[] { unit, unit });
                        other.Find(new[] { unit });
                        contacts.Find(new Objects(shapes, new Pose3[0]), pairs);
                    }, "PairFinder");
                Expect.Throws<ArgumentOutOfRangeException>(() => Of(answers, 1), "1");
                Expect.Throws<ArgumentOutOfRangeException>(() => Of(answers, -1), "-1");
                Expect.Throws<ArgumentOutOfRangeException>(() => other.Find(new[] { unit }).Block(0));
            }
        }

        public static void WithinCallbacks()
        {
            Box3[] boxes = { unit, unit, unit };
            using (Executor serial = Executor.Serial())
            using (World world = new World())
            {
                PairFinder finder = new PairFinder(serial);
                // One call at a time; afterwards all is well.
                Expect.Throws<InvalidOperationException>(() =>
                    finder.Find(boxes, new Filter { Accept = (a, b) => finder.Find(boxes).Count > 0 }),
                    "PairFinder");
                Expect.Same(3L, finder.Find(boxes).Count, "pairs afterwards");
                // Disposed in its own callback: it lives until the call is over.
                Expect.Throws<ObjectDisposedException>(() =>
                    finder.Find(boxes, new Filter { Accept = (a, b) =>
                    { finder.Dispose(); return true; } }).ToArray());
                Expect.Throws<ObjectDisposedException>(() => finder.Find(boxes));
                PairFinder another = new PairFinder();
                FormatException thrown = Expect.Throws<FormatException>(() =>
                    another.Find(boxes, new Filter { Accept = Thrower }), "no pair");
                Expect.True(thrown.StackTrace.Contains("Thrower"),
                    "the trace names who threw it: " + thrown.StackTrace);
                Expect.Same(3L, another.Find(boxes).Count, "pairs afterwards");
            }
        }

        static bool Thrower(uint a, uint b) { throw new FormatException("no pair"); }

        public static void OfShapes()
        {
            Expect.Throws<JostleException>(() => Shape.Sphere(-1), "-1");
            Expect.Throws<JostleException>(() => Shape.Sphere(1, 4), "4");
            Expect.Throws<JostleException>(() => Shape.Box(new Vec3(1, float.NaN, 1)), "nan");
            Expect.Throws<JostleException>(() => Shape.Capsule(1, double.PositiveInfinity), "inf");
            Expect.Throws<JostleException>(() => Shape.Hull(new Vec3[0]));
            Expect.Throws<JostleException>(() => Shape.Hull(new[] { new Vec2(0, 0) }), "8");
            // Not side by side.
            Expect.Throws<JostleException>(() => Shape.Hull(Values.Of(new Ray3[4])), "12", "28");
            Expect.Throws<JostleException>(() => Shape.Mesh(new Vec3[3], new[] { 0, 1, 3 }), "3");
            Expect.Throws<JostleException>(() => Shape.Mesh(new Vec3[3], new[] { 0, 1, -1 }), "4294967295");
            Expect.Throws<JostleException>(() => Shape.Mesh(new Vec3[3], new[] { 0, 1 }), "2");
            Expect.Throws<ArgumentNullException>(() => Shape.Compound(new Shape[1], new Pose3[1]), "child 0");
            Expect.Throws<JostleException>(() => Shape.Compound(new[] { Shape.Sphere(1) }, new Pose3[2]),
                "1 children", "2 poses");
            Expect.Throws<JostleException>(() => Shape.Compound(new[] { Shape.Sphere(1) }, new Pose3[1]),
                "rotation");
            using (Shapes shapes = new Shapes(), flat = new Shapes(2))
            using (ContactFinder3 finder = new ContactFinder3())
            {
                shapes.Add(Shape.Sphere(1), 2);
                Pair[] pairs = { new Pair(0, 2) };
                Pose3[] poses = { new Pose3(new Vec3(0, 0, 0)), new Pose3(new Vec3(0, 0, 0)) };
                Expect.Throws<JostleException>(() => finder.Find(new Objects(shapes, poses), pairs), "2");
                pairs[0].B = 1;
                Expect.Throws<JostleException>(() => finder.Find(new Objects(shapes, new Pose3[1]), pairs),
                    "1", "2");
                Expect.Throws<JostleException>(() => finder.Find(new Objects(flat, poses), pairs),
                    "2 dimensions", "Float3");
                Expect.Throws<JostleException>(() => finder.Touching(new Objects(shapes, poses), pairs,
                    new bool[2]), "1 pairs", "2");
                Expect.Throws<JostleException>(() => new Objects(shapes, poses).Bounds(new Box3[3]),
                    "2 poses", "3 boxes");
                Expect.Throws<JostleException>(() => shapes.Set(2, Shape.Sphere(1)), "2");
                Expect.Throws<JostleException>(() => flat.Add(Shape.Sphere(1)));
                Expect.Throws<ArgumentNullException>(() => new Objects(null, poses));
                poses[1].W = float.NaN;
                Expect.Throws<JostleException>(() => finder.Find(new Objects(shapes, poses), pairs), "1");
            }
            Expect.Throws<JostleException>(() => new Shapes(5), "5");
            Expect.Throws<JostleException>(() => new World((Space)9), "9");
            Expect.Throws<JostleException>(() => new World(Space.Float3, double.NaN), "margin");
            Expect.Throws<ArgumentOutOfRangeException>(() => Executor.Threads(-1), "threads", "-1");
        }

        /// Structs that nobody filled in: refused, or empty, but never read.
        public static void OfDefaults()
        {
            using (PairFinder finder = new PairFinder())
            using (World world = new World())
            using (Answers answers = new Answers())
            using (Shapes shapes = new Shapes())
            using (ContactFinder3 contacts = new ContactFinder3())
            {
                Expect.Throws<JostleException>(() => finder.Find(default(Boxes)), "space");
                Expect.Same(0, default(Boxes).Count, "boxes");
                world.Add(default(Boxes), new ObjectId[0]);
                world.Add(unit);
                world.Update();
                Expect.Throws<JostleException>(() => world.First(default(Query), new Hit[0]), "kind");
                Expect.Throws<JostleException>(() => world.First(default(Query), new Hit[1]), "0 queries");
                Expect.Throws<JostleException>(() => world.All(default(Query), answers), "kind");
                Expect.Throws<JostleException>(() => world.All(Query.Shapes(default(Objects)), answers));
                Expect.Throws<JostleException>(() => world.All(Query.NearestToShapes(default(Objects)),
                    answers));
                Expect.Throws<JostleException>(() => world.All(Query.ShapeSweeps(default(Objects),
                    new Vec3[1]), answers));
                Expect.Throws<ArgumentOutOfRangeException>(() => Of(answers, 0));
                // A call that fails leaves no answers, also where there were some.
                world.All(unit, answers);
                Expect.Same(1, answers.Queries, "queries");
                Expect.Throws<JostleException>(() => world.All(default(Query), answers), "kind");
                Expect.Same(0, answers.Queries, "queries after a failure");
                Expect.Throws<ArgumentOutOfRangeException>(() => Of(answers, 0));
                Expect.Throws<ArgumentNullException>(() => world.All(unit, null));
                Expect.Throws<ArgumentNullException>(() => contacts.Find(default(Objects), new Pair[0]));
                Expect.Throws<JostleException>(() => default(Objects).Bounds(new Box3[0]));
                Expect.Same(0L, contacts.Find(new Objects(shapes, default(Values)),
                    default(View<Pair>)).Count, "contacts");
                Expect.Same(0, default(View<Pair>).ToArray().Length, "pairs");
                foreach (Pair pair in default(View<Pair>)) Expect.True(false, "a pair");
                Expect.Throws<ArgumentOutOfRangeException>(() => default(View<Pair>).Block(0));
                Expect.Throws<JostleException>(() => world.SetUserData(default(ObjectId), 1));
                Expect.Throws<JostleException>(() => Shape.Hull(default(Values)));
                Expect.Throws<ArgumentNullException>(() => shapes.Add(null));
                Expect.Throws<ArgumentNullException>(() => finder.Stream(new[] { unit }, null));
            }
        }

        /// How often a handle is held: once while its object isn't disposed, and by nobody afterwards.
        static int Holds(object owner)
        {
            const BindingFlags hidden = BindingFlags.Instance | BindingFlags.NonPublic;
            FieldInfo state = typeof(SafeHandle).GetField("_state",
                hidden) ?? typeof(SafeHandle).GetField("state", hidden);
            foreach (FieldInfo field in owner.GetType().GetFields(hidden))
                if (typeof(SafeHandle).IsAssignableFrom(field.FieldType))
                    return (int)state.GetValue(field.GetValue(owner)) >> 2; // the lower bits are flags
            throw new Exception(owner + " has no handle");
        }

        public static void HoldNoHandles()
        {
            Executor executor = Executor.Serial();
            Shape ball = Shape.Sphere(1);
            Shapes shapes = new Shapes();
            shapes.Add(ball);
            Pose3[] poses = { new Pose3(new Vec3(0, 0, 0)) };
            Box3[] boxes = new Box3[1];
            Objects objects = new Objects(shapes, poses);
            using (Shape.Compound(new[] { ball }, poses))
            using (PairFinder finder = new PairFinder(executor))
            using (ContactFinder3 contacts = new ContactFinder3(executor))
            using (World world = new World(Space.Float3, 0, null, executor))
            using (Answers answers = new Answers())
            {
                objects.Bounds(boxes);
                world.Add(boxes[0]);
                world.Update();
                Objects others = new Objects(shapes, new Pose3[] { poses[0] });
                contacts.Find(objects, others, new[] { new Pair(0, 0) });
                Ray3[] rays = { new Ray3(new Vec3(-5, 0, 0), new Vec3(1, 0, 0)) };
                world.First(Query.Rays(rays), objects, new Hit[1], new CastHit3[1]);
                world.All(Query.Shapes(objects), answers, null, objects);
                Expect.Throws<JostleException>(() => contacts.Find(new Objects(shapes, poses),
                    new[] { new Pair(0, 1) }));
            }
            foreach (IDisposable one in new IDisposable[] { executor, ball, shapes })
            {
                Expect.Same(1, Holds(one), "how often " + one + " is held");
                one.Dispose();
                Expect.Same(0, Holds(one), "how often " + one + " is held afterwards");
            }
        }

        /// What is disposed, or forgotten, is given back: the library doesn't know it any more.
        public static unsafe void KeepNothingAlive()
        {
            IntPtr[] seen = new IntPtr[20];
            Thread making = new Thread(() =>
            {
                for (int i = 0; i < seen.Length; ++i)
                {
                    PairFinder finder = new PairFinder();
                    seen[i] = finder.Handle.DangerousGetHandle();
                    if (i % 2 == 0) finder.Dispose();
                }
            });
            making.Start();
            making.Join();
            for (int tries = 0; tries < 5; ++tries)
            {
                GC.Collect();
                GC.WaitForPendingFinalizers();
            }
            int alive = 0;
            for (int i = 0; i < seen.Length; ++i)
            {
                bool freed = Native.jostle_free((void*)seen[i], null) == Status.BadHandle;
                if (i % 2 == 0) Expect.True(freed, "a finder that was disposed is there");
                alive += freed ? 0 : 1;
            }
            // A stack may still name some.
            Expect.True(alive < 3, alive + " of 10 finders that were forgotten are there");
        }

        public static void OfAnotherVersion()
        {
            Version version = Library.Version;
            Expect.Same(Native.Major, version.Major, "major");
            Expect.Same(Native.Minor, version.Minor, "minor");
        }
    }
}
