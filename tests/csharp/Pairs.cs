// SPDX-License-Identifier: MIT
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;

namespace Jostle.Tests
{
    static class Pairs
    {
        static HashSet<Pair> ByHand(Box3[] boxes, Func<int, int, bool> wanted = null)
        {
            HashSet<Pair> pairs = new HashSet<Pair>();
            for (int a = 0; a < boxes.Length; ++a)
                for (int b = a + 1; b < boxes.Length; ++b)
                    if (Some.Touch(boxes[a], boxes[b]) && (wanted == null
                        || wanted(a, b))) pairs.Add(new Pair((uint)a, (uint)b));
            return pairs;
        }

        static HashSet<Pair> Set(View<Pair> pairs)
        {
            HashSet<Pair> set = new HashSet<Pair>();
            long count = 0;
            foreach (Pair pair in pairs)
            {
                set.Add(new Pair(Math.Min(pair.A, pair.B), Math.Max(pair.A, pair.B)));
                ++count;
            }
            Expect.Same(count, pairs.Count, "the count");
            Expect.Same(count, (long)set.Count, "how many are different");
            return set;
        }

        public static void AreThoseOfTheDefinition()
        {
            using (PairFinder finder = new PairFinder())
                for (int seed = 0; seed < 60; ++seed)
                {
                    Box3[] boxes = Some.Boxes(seed, seed < 40 ? seed * 7 : 900, seed % 2 == 1);
                    HashSet<Pair> expected = ByHand(boxes);
                    Expect.SameSets(expected, Set(finder.Find(boxes)), "pairs of seed " + seed);
                    Expect.SameSets(expected, Set(finder.Find(new Span<Box3>(boxes))), "pairs of a span");
                    // In their order, copied, and by blocks.
                    Pair[] sorted = finder.Find(boxes, null, Order.Sorted).ToArray();
                    for (int k = 1; k < sorted.Length; ++k)
                        Expect.True(sorted[k - 1].A < sorted[k].A || sorted[k - 1].A == sorted[k].A
                            && sorted[k - 1].B < sorted[k].B, "not sorted");
                    Expect.Same(expected.Count, sorted.Length, "sorted pairs");
                }
        }

        public static void OfTwoSets()
        {
            using (PairFinder finder = new PairFinder())
                for (int seed = 0; seed < 20; ++seed)
                {
                    Box3[] a = Some.Boxes(seed, 200, seed % 2 == 1),
                        b = Some.Boxes(seed + 1000, 300, seed % 2 == 1);
                    HashSet<Pair> expected = new HashSet<Pair>(), found = new HashSet<Pair>();
                    for (int i = 0; i < a.Length; ++i)
                        for (int j = 0; j < b.Length; ++j)
                            if (Some.Touch(a[i], b[j])) expected.Add(new Pair((uint)i, (uint)j));
                    foreach (Pair pair in finder.Find(a, b)) found.Add(pair);
                    Expect.SameSets(expected, found, "pairs of two sets");
                }
        }

        [StructLayout(LayoutKind.Sequential)]
        struct Body
        {
            public int Mass;
            public System.Numerics.Vector3 Max; // the upper corner first, and something between
            public double Speed;
            public System.Numerics.Vector3 Min;
        }

        public static void OfStructsReadInPlace()
        {
            Box3[] boxes = Some.Boxes(5, 300, true);
            Body[] bodies = new Body[boxes.Length];
            System.Numerics.Vector3[] min = new System.Numerics.Vector3[boxes.Length],
                max = new System.Numerics.Vector3[boxes.Length];
            float[] numbers = new float[6 * boxes.Length];
            double[] doubles = new double[6 * boxes.Length];
            for (int i = 0; i < boxes.Length; ++i)
            {
                bodies[i] = new Body { Mass = i, Min = boxes[i].Min, Max = boxes[i].Max, Speed = double.NaN };
                min[i] = boxes[i].Min;
                max[i] = boxes[i].Max;
                float[] row = { boxes[i].Min.X, boxes[i].Min.Y, boxes[i].Min.Z, boxes[i].Max.X,
                    boxes[i].Max.Y, boxes[i].Max.Z };
                for (int k = 0; k < 6; ++k) doubles[6 * i + k] = numbers[6 * i + k] = row[k];
            }
            HashSet<Pair> expected = ByHand(boxes);
            int lo = (int)Marshal.OffsetOf(typeof(Body), "Min"),
                hi = (int)Marshal.OffsetOf(typeof(Body), "Max");
            using (PairFinder finder = new PairFinder())
            {
                Expect.SameSets(expected, Set(finder.Find(Boxes.Of(bodies, lo, hi))), "pairs of bodies");
                Expect.SameSets(expected, Set(finder.Find(Boxes.Of(min, max))), "pairs of two arrays");
                Expect.SameSets(expected, Set(finder.Find(Boxes.Of(numbers))), "pairs of numbers");
                Expect.SameSets(expected, Set(finder.Find(Boxes.Of(doubles, Space.Double3))),
                    "pairs of doubles");
                Expect.Same(0L, finder.Find(new Box3[0]).Count, "pairs of nothing");
                Expect.Same(0L, finder.Find((Box3[])null).Count, "pairs of null");
                Expect.Same(0L, finder.Find(Boxes.Of(new Body[0], lo, hi)).Count, "pairs of no bodies");
                Box2[] flat = { new Box2(new Vec2(0, 0), new Vec2(2, 2)),
                    new Box2(new Vec2(2, 2), new Vec2(3, 3)) };
                Expect.Same(1L, finder.Find(flat).Count, "pairs in 2D");
                Expect.Same(1L, finder.Find(Boxes.Of(new double[] { 0, 0, 2, 2, 2, 2, 3, 3 },
                    Space.Double2)).Count, "pairs of doubles in 2D");
            }
        }

        public static void CopiedFromSeveralBlocks()
        {
            Box3[] boxes = Some.Boxes(13, 6000, false);
            using (PairFinder finder = new PairFinder())
            {
                View<Pair> found = finder.Find(boxes);
                Expect.True(found.BlockCount > 1, "there is one block");
                Pair[] copied = found.ToArray();
                int at = 0;
                for (int block = 0; block < found.BlockCount; ++block)
                    foreach (Pair pair in found.Block(block)) Expect.Same(pair, copied[at++],
                        "a pair of block " + block);
                Expect.Same(copied.Length, at, "pairs in blocks");
                at = 0;
                foreach (Pair pair in found) Expect.Same(copied[at++], pair, "a pair");
                Expect.Throws<ArgumentException>(() =>
                    finder.Find(boxes).CopyTo(new Pair[copied.Length - 1]));
            }
        }

        public static void WithFilters()
        {
            Box3[] boxes = Some.Boxes(9, 500, false);
            Random random = new Random(4);
            Filter filter = new Filter { Category = new uint[500], Mask = new uint[500],
                Owner = new uint[500] };
            for (int i = 0; i < 500; ++i)
            {
                filter.Category[i] = 1u << random.Next(3);
                filter.Mask[i] = (uint)random.Next(8);
                filter.Owner[i] = random.Next(2) == 0 ? uint.MaxValue : (uint)random.Next(5);
            }
            Func<int, int, bool> wanted = (a, b) => (filter.Category[a] & filter.Mask[b]) != 0
                && (filter.Category[b] & filter.Mask[a]) != 0 &&
                (filter.Owner[a] != filter.Owner[b] || filter.Owner[a] == uint.MaxValue);
            using (PairFinder finder = new PairFinder())
            {
                Expect.SameSets(ByHand(boxes, wanted), Set(finder.Find(boxes, filter)), "filtered pairs");
                filter.Accept = (a, b) => (a + b) % 3 != 0;
                Expect.SameSets(ByHand(boxes, (a, b) => wanted(a, b) && (a + b) % 3 != 0),
                    Set(finder.Find(boxes, filter)), "accepted pairs");
                filter.Accept = null;
                filter.Owner = new uint[499];
                Expect.Throws<JostleException>(() => finder.Find(boxes, filter), "499", "500");
            }
        }

        public static void OfTwoSetsWithFilters()
        {
            Box3[] a = Some.Boxes(30, 200, false), b = Some.Boxes(31, 300, false);
            Random random = new Random(5);
            Func<int, int, uint[]> numbers = (count, end) =>
            {
                uint[] made = new uint[count];
                for (int i = 0; i < count; ++i) made[i] = (uint)random.Next(end);
                return made;
            };
            Filter filter = new Filter
            {
                Category = numbers(200, 8), Mask = numbers(200, 8), Owner = numbers(200, 9),
                CategoryB = numbers(300, 8), MaskB = numbers(300, 8), OwnerB = numbers(300, 9)
            };
            HashSet<Pair> expected = new HashSet<Pair>(), found = new HashSet<Pair>();
            for (int i = 0; i < a.Length; ++i)
                for (int j = 0; j < b.Length; ++j)
                    if (Some.Touch(a[i], b[j]) && (filter.Category[i] & filter.MaskB[j]) != 0 &&
                        (filter.CategoryB[j] & filter.Mask[i]) != 0 && filter.Owner[i] != filter.OwnerB[j])
                        expected.Add(new Pair((uint)i, (uint)j));
            using (PairFinder finder = new PairFinder())
                foreach (Pair pair in finder.Find(a, b, filter)) found.Add(pair);
            Expect.True(expected.Count > 10, "there is something to find");
            Expect.SameSets(expected, found, "filtered pairs of two sets");
        }

        public static void Streamed()
        {
            Box3[] boxes = Some.Boxes(11, 3000, false);
            using (PairFinder finder = new PairFinder())
            {
                long expected = finder.Find(boxes).Count, found = 0;
                Expect.True(finder.Stream(boxes, pairs => { Interlocked.Add(ref found,
                    pairs.Length); return true; }), "went to the end");
                Expect.Same(expected, found, "streamed pairs");
                Expect.True(!finder.Stream(boxes, pairs => false), "was stopped");
                Expect.Throws<TimeZoneNotFoundException>(() =>
                    finder.Stream(boxes, pairs => { throw new TimeZoneNotFoundException("mine"); }), "mine");
                Expect.Same(expected, finder.Find(boxes).Count, "pairs afterwards");
            }
        }

        public static void OnAnyThreads()
        {
            Box3[] boxes = Some.Boxes(12, 5000, false);
            Pair[] first = null;
            using (Executor serial = Executor.Serial(), three = Executor.Threads(3))
                foreach (Executor executor in new[] { serial, three, null })
                    using (PairFinder finder = new PairFinder(executor))
                    {
                        Pair[] pairs = finder.Find(boxes).ToArray();
                        if (first == null) first = pairs;
                        Expect.Same(first.Length, pairs.Length, "pairs on other threads");
                        for (int k = 0; k < pairs.Length; ++k) Expect.Same(first[k], pairs[k], "pair " + k);
                    }
        }
    }
}
