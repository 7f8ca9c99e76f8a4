// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Jostle
{
    /// <summary>Two that touch, by their positions in what was given, or in a World by their
    /// indices.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Pair : IEquatable<Pair>
    {
        public uint A, B;
        public Pair(uint a, uint b) { A = a; B = b; }
        public bool Equals(Pair other) { return A == other.A && B == other.B; }
        public override bool Equals(object other) { return other is Pair && Equals((Pair)other); }
        public override int GetHashCode() { return (int)(A * 0x9E3779B1 ^ B); }
        public override string ToString() { return A + " and " + B; }
    }

    /// <summary>Which pairs are wanted. Arrays have one number for each box; what is null filters nothing.
    /// Those that end in B are for the second set.</summary>
    public sealed class Filter
    {
        /// <summary>Two pair if each has its category, a set of bits, in the other's mask. Give both or
        /// neither.</summary>
        public uint[] Category, Mask;
        /// <summary>Those of one owner never pair; uint.MaxValue belongs to nobody.</summary>
        public uint[] Owner;
        public uint[] CategoryB, MaskB, OwnerB;
        /// <summary>Asked about each pair, from several threads at a time. What it throws ends the search and
        /// is thrown again by it.</summary>
        public Func<uint, uint, bool> Accept;
    }

    /// <summary>Takes a piece of the result; false stops the search. Called from several threads at a
    /// time.</summary>
    public delegate bool PairSink(ReadOnlySpan<Pair> pairs);

    /// <summary>All pairs of boxes that touch. It keeps its memory from call to call. One call at a
    /// time.</summary>
    public sealed unsafe class PairFinder : Owner
    {
        static readonly Native.jostle_accept_pair_function acceptFunction = Accept;
        static readonly IntPtr acceptPointer = Marshal.GetFunctionPointerForDelegate(acceptFunction);
        static readonly Native.jostle_sink_function sinkFunction = Sink;
        static readonly IntPtr sinkPointer = Marshal.GetFunctionPointerForDelegate(sinkFunction);

        readonly FinderHandle made;
        FinderHandle handle { get { return made.Open(this); } }
        readonly Asked<Func<uint, uint, bool>> accept = new Asked<Func<uint, uint, bool>>();
        readonly Asked<PairSink> sink = new Asked<PairSink>();
        internal override Handle Handle { get { return made; } }

        public PairFinder(Executor executor = null)
        {
            Library.Require();
            bool held = false;
            try
            {
                Native.jostle_options options = Executor.Options(executor, ref held);
                Native.jostle_error error;
                JostleException.Check(Native.jostle_finder_new(&options, out made, &error), &error);
            }
            finally
            {
                if (held) executor.Release();
            }
        }

        /// <summary>All pairs among these boxes.</summary>
        public View<Pair> Find(Boxes boxes, Filter filter = null, Order order = Order.Canonical)
        {
            bool finished;
            return Search(boxes, default(Boxes), false, filter, order, null, out finished);
        }

        /// <summary>All pairs of one of `a` and one of `b`.</summary>
        public View<Pair> Find(Boxes a, Boxes b, Filter filter = null, Order order = Order.Canonical)
        {
            bool finished;
            return Search(a, b, true, filter, order, null, out finished);
        }

        /// <summary>Hands the pairs over instead of storing them. Whether that went to the end.</summary>
        public bool Stream(Boxes boxes, PairSink sink, Filter filter = null)
        {
            return Hand(boxes, default(Boxes), false, filter, sink);
        }
        public bool Stream(Boxes a, Boxes b, PairSink sink, Filter filter = null)
        {
            return Hand(a, b, true, filter, sink);
        }

        bool Hand(Boxes a, Boxes b, bool two, Filter filter, PairSink to)
        {
            if (to == null) throw new ArgumentNullException("sink");
            bool finished;
            Search(a, b, two, filter, Order.Canonical, to, out finished);
            return finished;
        }

        /// <summary>Gives working memory back.</summary>
        public void ReleaseMemory()
        {
            Enter();
            try
            {
                Native.jostle_error error;
                JostleException.Check(Native.jostle_release_memory(handle, &error), &error);
            }
            finally
            {
                Leave();
            }
        }

        View<Pair> Search(Boxes a, Boxes b, bool two, Filter filter, Order order, PairSink to,
            out bool finished)
        {
            if (two) b.Expect(a.Space, "a search with others");
            Enter();
            Native.jostle_error error;
            Native.jostle_blocks found = new Native.jostle_blocks();
            Native.jostle_filter given = new Native.jostle_filter();
            given.struct_size = (ulong)sizeof(Native.jostle_filter);
            GCHandle asked = default(GCHandle), handing = default(GCHandle);
            int ended = 1;
            fixed (byte* minA = a.Min)
            fixed (byte* maxA = a.Max)
            fixed (byte* minB = b.Min)
            fixed (byte* maxB = b.Max)
            fixed (uint* category = filter?.Category)
            fixed (uint* mask = filter?.Mask)
            fixed (uint* owner = filter?.Owner)
            fixed (uint* categoryB = filter?.CategoryB)
            fixed (uint* maskB = filter?.MaskB)
            fixed (uint* ownerB = filter?.OwnerB)
            {
                Native.jostle_boxes boxesA = a.At(minA, maxA), boxesB = b.At(minB, maxB);
                try
                {
                    if (filter != null)
                    {
                        given.category = Given(category, filter.Category);
                        given.mask = Given(mask, filter.Mask);
                        given.owner = Given(owner, filter.Owner);
                        given.category_b = Given(categoryB, filter.CategoryB);
                        given.mask_b = Given(maskB, filter.MaskB);
                        given.owner_b = Given(ownerB, filter.OwnerB);
                        if (filter.Accept != null)
                        {
                            accept.Function = filter.Accept;
                            asked = GCHandle.Alloc(accept);
                            given.accept = acceptPointer;
                            given.context = (void*)GCHandle.ToIntPtr(asked);
                        }
                    }
                    Native.jostle_boxes* others = two ? &boxesB : null;
                    Native.jostle_filter* wanted = filter == null ? null : &given;
                    Status status;
                    if (to == null)
                        status = Native.jostle_finder_find(handle, a.Space, &boxesA, others, wanted, order,
                            &found, &error);
                    else
                    {
                        sink.Function = to;
                        handing = GCHandle.Alloc(sink);
                        status = Native.jostle_finder_stream(handle, a.Space, &boxesA, others, wanted,
                            sinkPointer, (void*)GCHandle.ToIntPtr(handing), &ended, &error);
                    }
                    accept.Rethrow();
                    sink.Rethrow();
                    JostleException.Check(status, &error);
                }
                finally
                {
                    if (asked.IsAllocated) asked.Free();
                    if (handing.IsAllocated) handing.Free();
                    accept.Function = null;
                    sink.Function = null;
                    Leave();
                }
            }
            finished = ended != 0;
            return new View<Pair>(this, found);
        }

        static Native.jostle_values Given(uint* pinned, uint[] numbers)
        {
            // An array of no numbers is pinned as null, too: the library then says that it is too short, if
            // it is.
            return new Native.jostle_values { data = pinned,
                count = numbers == null ? 0 : (ulong)numbers.Length, stride = 4 };
        }

        [MonoPInvokeCallback(typeof(Native.jostle_accept_pair_function))]
        static int Accept(void* context, uint a, uint b)
        {
            Asked<Func<uint, uint, bool>> asked = Asked<Func<uint, uint, bool>>.From(context);
            try
            {
                return asked.Function(a, b) ? 1 : 0;
            }
            catch (Exception thrown)
            {
                return asked.Failed(thrown);
            }
        }

        [MonoPInvokeCallback(typeof(Native.jostle_sink_function))]
        static int Sink(void* context, Native.jostle_pair* pairs, ulong count, ulong block, ulong part)
        {
            Asked<PairSink> asked = Asked<PairSink>.From(context);
            try
            {
                return asked.Function(new ReadOnlySpan<Pair>(pairs, checked((int)count))) ? 1 : 0;
            }
            catch (Exception thrown)
            {
                return asked.Failed(thrown);
            }
        }
    }
}
