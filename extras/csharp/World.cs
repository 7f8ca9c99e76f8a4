// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Jostle
{
    /// <summary>Names an object of a world; the default names none. It is never used again for another
    /// object.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct ObjectId : IEquatable<ObjectId>
    {
        public ulong Value;
        /// <summary>A small number, good for arrays of your own; of objects that are gone it is used
        /// again.</summary>
        public uint Index { get { return (uint)Value; } }
        public bool Equals(ObjectId other) { return Value == other.Value; }
        public override bool Equals(object other) { return other is ObjectId && Equals((ObjectId)other); }
        public override int GetHashCode() { return Value.GetHashCode(); }
        public static bool operator ==(ObjectId a, ObjectId b) { return a.Value == b.Value; }
        public static bool operator !=(ObjectId a, ObjectId b) { return a.Value != b.Value; }
        public override string ToString() { return Value == 0 ? "none" : Index + "." + (Value >> 32); }
    }

    /// <summary>Two objects that touch: the index of A is less than that of B.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct ObjectPair
    {
        public ObjectId A, B;
        public override string ToString() { return A + " and " + B; }
    }

    /// <summary>Two objects that no longer touch, and why.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct EndedPair
    {
        public ObjectId A, B;
        public EndReason Reason;
        /// <summary>0.</summary>
        public int Reserved;
        public override string ToString() { return A + " and " + B + ": " + Reason; }
    }

    /// <summary>Whom an object pairs with. Begin with ObjectFilter.All.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct ObjectFilter
    {
        /// <summary>Two pair if each has its category, a set of bits, in the other's mask.</summary>
        public uint Category, Mask;
        /// <summary>Those of one owner never pair; uint.MaxValue belongs to nobody.</summary>
        public uint Owner;
        int isStatic;
        /// <summary>Never pairs with static ones.</summary>
        public bool IsStatic
        {
            get { return isStatic != 0; }
            set { isStatic = value ? 1 : 0; }
        }
        public static ObjectFilter All { get { return new ObjectFilter { Category = 1, Mask = uint.MaxValue,
            Owner = uint.MaxValue }; } }
        public static ObjectFilter Static { get { return new ObjectFilter { Category = 1,
            Mask = uint.MaxValue, Owner = uint.MaxValue, isStatic = 1 }; } }
    }

    /// <summary>Objects with identity that live, move and rest, and the pairs between them. Any thread may
    /// queue commands (Add, Remove, Move, Set...) at any time; they take effect in the next Update, one of
    /// which runs at a time. Queries may run beside each other, but not beside an Update.</summary>
    public sealed unsafe partial class World : Owner
    {
        static readonly Native.jostle_accept_object_pair_function acceptFunction = Accept;
        static readonly IntPtr acceptPointer = Marshal.GetFunctionPointerForDelegate(acceptFunction);

        readonly WorldHandle made;
        WorldHandle handle { get { return made.Open(this); } }
        readonly Asked<Func<ObjectId, ObjectId, bool>> accept;
        public Space Space { get; }
        internal override Handle Handle { get { return made; } }

        /// <summary>`margin`: by how much all boxes are enlarged. `accept`: asked in Update, on its thread,
        /// about each pair that would begin. What it throws ends the update, which then has done nothing, and
        /// is thrown again by it.</summary>
        public World(Space space = Space.Float3, double margin = 0,
            Func<ObjectId, ObjectId, bool> accept = null, Executor executor = null)
        {
            Library.Require();
            Space = space;
            bool held = false;
            GCHandle context = default(GCHandle);
            try
            {
                Native.jostle_options common = Executor.Options(executor, ref held);
                Native.jostle_world_options options = new Native.jostle_world_options();
                options.struct_size = (ulong)sizeof(Native.jostle_world_options);
                options.common = &common;
                options.margin = margin;
                if (accept != null)
                {
                    this.accept = new Asked<Func<ObjectId, ObjectId, bool>> { Function = accept };
                    // what it refers to may refer to this world
                    context = GCHandle.Alloc(this.accept, GCHandleType.Weak);
                    options.accept = acceptPointer;
                    options.context = (void*)GCHandle.ToIntPtr(context);
                }
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_new(space, &options, out made, &error), &error);
                made.Keep(context); // which is freed after the world
                context = default(GCHandle);
            }
            finally
            {
                if (context.IsAllocated) context.Free();
                if (held) executor.Release();
            }
        }

        // --- Commands ---

        /// <summary>As many new objects as boxes; ids[i] becomes that of box i, good at once.</summary>
        public void Add(Boxes boxes, Span<ObjectId> ids) { Add(boxes, ids, ObjectFilter.All); }
        public void Add(Boxes boxes, Span<ObjectId> ids, ObjectFilter filter, double margin = 0)
        {
            boxes.Expect(Space, "a world");
            if (ids.Length != boxes.Count) throw Differ(ids.Length, "ids", boxes.Count, "boxes");
            Native.jostle_object_options options = new Native.jostle_object_options();
            options.struct_size = (ulong)sizeof(Native.jostle_object_options);
            options.filter = (Native.jostle_object_filter*)&filter;
            options.margin = margin;
            Native.jostle_error error;
            fixed (byte* min = boxes.Min)
            fixed (byte* max = boxes.Max)
            fixed (ObjectId* given = ids)
            {
                Native.jostle_boxes view = boxes.At(min, max);
                JostleException.Check(Native.jostle_world_add(handle, &view, &options, (ulong*)given,
                    &error), &error);
            }
        }
        /// <summary>A filter for each box.</summary>
        public void Add(Boxes boxes, Span<ObjectId> ids, ReadOnlySpan<ObjectFilter> filters)
        {
            boxes.Expect(Space, "a world");
            if (ids.Length != boxes.Count) throw Differ(ids.Length, "ids", boxes.Count, "boxes");
            if (filters.Length != boxes.Count) throw Differ(filters.Length, "filters", boxes.Count, "boxes");
            Native.jostle_object_options[] options = new Native.jostle_object_options[filters.Length];
            Native.jostle_error error;
            fixed (byte* min = boxes.Min)
            fixed (byte* max = boxes.Max)
            fixed (ObjectId* given = ids)
            fixed (ObjectFilter* filter = filters)
            fixed (Native.jostle_object_options* first = options)
            {
                for (int i = 0; i < options.Length; ++i)
                {
                    options[i].struct_size = (ulong)sizeof(Native.jostle_object_options);
                    options[i].filter = (Native.jostle_object_filter*)(filter + i);
                    options[i].count = (ulong)options.Length;
                }
                Native.jostle_boxes view = boxes.At(min, max);
                JostleException.Check(Native.jostle_world_add(handle, &view, first, (ulong*)given, &error),
                    &error);
            }
        }
        public ObjectId Add(Box3 box) { return Add(box, ObjectFilter.All); }
        public ObjectId Add(Box3 box, ObjectFilter filter, double margin = 0)
        {
            ObjectId id;
            Add(Boxes.Of(new ReadOnlySpan<Box3>(&box, 1)), new Span<ObjectId>(&id, 1), filter, margin);
            return id;
        }
        public ObjectId Add(Box2 box) { return Add(box, ObjectFilter.All); }
        public ObjectId Add(Box2 box, ObjectFilter filter, double margin = 0)
        {
            ObjectId id;
            Add(Boxes.Of(new ReadOnlySpan<Box2>(&box, 1), Space.Float2), new Span<ObjectId>(&id, 1), filter,
                margin);
            return id;
        }

        /// <summary>All or none of them.</summary>
        public void Remove(ReadOnlySpan<ObjectId> ids)
        {
            Native.jostle_error error;
            fixed (ObjectId* given = ids)
                JostleException.Check(Native.jostle_world_remove(handle, (ulong*)given, (ulong)ids.Length,
                    &error), &error);
        }
        public void Remove(ObjectId id) { Remove(new ReadOnlySpan<ObjectId>(&id, 1)); }

        /// <summary>New boxes of objects: all or none of them. Of equal commands of several threads for one
        /// object the greatest `sequence` wins.</summary>
        public void Move(ReadOnlySpan<ObjectId> ids, Boxes boxes, uint sequence = 0)
        {
            boxes.Expect(Space, "a world");
            if (ids.Length != boxes.Count) throw Differ(ids.Length, "ids", boxes.Count, "boxes");
            Native.jostle_error error;
            fixed (byte* min = boxes.Min)
            fixed (byte* max = boxes.Max)
            fixed (ObjectId* given = ids)
            {
                Native.jostle_boxes view = boxes.At(min, max);
                JostleException.Check(Native.jostle_world_move(handle, (ulong*)given, &view, null, sequence,
                    &error), &error);
            }
        }
        public void Move(ObjectId id, Box3 box)
        {
            Move(new ReadOnlySpan<ObjectId>(&id, 1), Boxes.Of(new ReadOnlySpan<Box3>(&box, 1)));
        }
        public void Move(ObjectId id, Box2 box)
        {
            Move(new ReadOnlySpan<ObjectId>(&id, 1), Boxes.Of(new ReadOnlySpan<Box2>(&box, 1), Space.Float2));
        }

        public void SetFilter(ObjectId id, ObjectFilter filter, uint sequence = 0)
        {
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_set_filter(handle, &id.Value, 1,
                (Native.jostle_object_filter*)&filter, sequence, &error), &error);
        }
        public void SetMargin(ObjectId id, double margin, uint sequence = 0)
        {
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_set_margin(handle, &id.Value, 1, &margin, sequence,
                &error), &error);
        }
        /// <summary>What isn't enabled keeps its id and its box, and touches nothing.</summary>
        public void SetEnabled(ObjectId id, bool enabled, uint sequence = 0)
        {
            Native.jostle_error error;
            byte given = (byte)(enabled ? 1 : 0);
            JostleException.Check(Native.jostle_world_set_enabled(handle, &id.Value, 1, &given, sequence,
                &error), &error);
        }

        /// <summary>64 bits of your own, 0 at first; at once, and also for what the last update has
        /// removed.</summary>
        public ulong UserData(ObjectId id)
        {
            ulong data;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_user_data(handle, &id.Value, 1, &data, &error), &error);
            return data;
        }
        public void SetUserData(ObjectId id, ulong data)
        {
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_set_user_data(handle, &id.Value, 1, &data, &error),
                &error);
        }

        // --- A step, and what it did ---

        /// <summary>Applies what was queued, and finds out what that did to the pairs.</summary>
        public void Update()
        {
            Enter();
            try
            {
                Native.jostle_error error;
                Status status = Native.jostle_world_update(handle, &error);
                if (accept != null) accept.Rethrow();
                JostleException.Check(status, &error);
            }
            finally
            {
                Leave();
            }
        }

        /// <summary>Moves these objects and updates: the fastest where most move.</summary>
        public void Update(ReadOnlySpan<ObjectId> ids, Boxes boxes)
        {
            boxes.Expect(Space, "a world");
            if (ids.Length != boxes.Count) throw Differ(ids.Length, "ids", boxes.Count, "boxes");
            Enter();
            try
            {
                Native.jostle_error error;
                fixed (byte* min = boxes.Min)
                fixed (byte* max = boxes.Max)
                fixed (ObjectId* given = ids)
                {
                    Native.jostle_boxes view = boxes.At(min, max);
                    Status status = Native.jostle_world_update_moves(handle, (ulong*)given, &view, &error);
                    if (accept != null) accept.Rethrow();
                    JostleException.Check(status, &error);
                }
            }
            finally
            {
                Leave();
            }
        }

        /// <summary>Those that touch now and didn't before.</summary>
        public View<ObjectPair> Began
        {
            get
            {
                Native.jostle_id_pair* pairs;
                ulong count;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_began(handle, &pairs, &count, &error), &error);
                return new View<ObjectPair>(this, pairs, count);
            }
        }

        /// <summary>Those that touched before and don't now.</summary>
        public View<EndedPair> Ended
        {
            get
            {
                Native.jostle_ended_pair* pairs;
                ulong count;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_ended(handle, &pairs, &count, &error), &error);
                return new View<EndedPair>(this, pairs, count);
            }
        }

        /// <summary>Those that touched before and still do, and of which one has changed; by index.</summary>
        public View<Pair> Persisted
        {
            get
            {
                Native.jostle_blocks pairs;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_persisted(handle, &pairs, &error), &error);
                return new View<Pair>(this, pairs);
            }
        }

        /// <summary>Began and Persisted as one list, by index: what a ContactFinder wants.</summary>
        public View<Pair> ChangedPairs
        {
            get
            {
                Native.jostle_blocks pairs;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_changed_pairs(handle, &pairs, &error), &error);
                return new View<Pair>(this, pairs);
            }
        }

        // --- The objects ---

        /// <summary>How many there are, as of the last update.</summary>
        public long Count
        {
            get
            {
                ulong size;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_size(handle, &size, &error), &error);
                return (long)size;
            }
        }

        /// <summary>Every index is less than this.</summary>
        public uint IndexEnd
        {
            get
            {
                uint end;
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_index_end(handle, &end, &error), &error);
                return end;
            }
        }

        /// <summary>The id of the object with this index; none where there is none.</summary>
        public ObjectId Id(uint index)
        {
            ObjectId id;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_ids(handle, &index, 1, (ulong*)&id, &error), &error);
            return id;
        }

        public bool Contains(ObjectId id)
        {
            byte found;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_world_contains(handle, &id.Value, 1, &found, &error), &error);
            return found != 0;
        }

        /// <summary>The boxes of objects, as they were given: plain numbers, or structs that are a box of
        /// this space.</summary>
        public void GetBoxes<T>(ReadOnlySpan<ObjectId> ids, Span<T> boxes) where T : struct
        {
            if (Boxes.Of((ReadOnlySpan<T>)boxes, Space).Count != ids.Length)
                throw Differ(ids.Length, "ids", Boxes.Of((ReadOnlySpan<T>)boxes, Space).Count, "boxes");
            Native.jostle_error error;
            fixed (ObjectId* given = ids)
            fixed (byte* room = MemoryMarshal.AsBytes(boxes))
                JostleException.Check(Native.jostle_world_boxes(handle, (ulong*)given, (ulong)ids.Length,
                    room, &error), &error);
        }

        // --- The whole ---

        /// <summary>What the world is, as bytes: the same on every machine.</summary>
        public byte[] Save()
        {
            using (ResultsHandle results = Answers.NewResults())
            {
                Native.jostle_error error;
                JostleException.Check(Native.jostle_world_save(handle, results, &error), &error);
                void* bytes;
                ulong count;
                JostleException.Check(Native.jostle_results_bytes(results, &bytes, &count, &error), &error);
                return new ReadOnlySpan<byte>(bytes, checked((int)count)).ToArray();
            }
        }

        /// <summary>Becomes the world that was saved.</summary>
        public void Restore(ReadOnlySpan<byte> snapshot)
        {
            Enter();
            try
            {
                Native.jostle_error error;
                fixed (byte* bytes = snapshot)
                    JostleException.Check(Native.jostle_world_restore(handle, bytes, (ulong)snapshot.Length,
                        &error), &error);
            }
            finally
            {
                Leave();
            }
        }

        static JostleException Differ(int a, string ofA, int b, string ofB)
        {
            return new JostleException(Status.SizeMismatch, a + " " + ofA + " and " + b + " " + ofB);
        }

        [MonoPInvokeCallback(typeof(Native.jostle_accept_object_pair_function))]
        static int Accept(void* context, ulong a, ulong b)
        {
            Asked<Func<ObjectId, ObjectId, bool>> asked = Asked<Func<ObjectId, ObjectId, bool>>.From(context);
            try
            {
                return asked.Function(new ObjectId { Value = a }, new ObjectId { Value = b }) ? 1 : 0;
            }
            catch (Exception thrown)
            {
                return asked.Failed(thrown);
            }
        }
    }
}
