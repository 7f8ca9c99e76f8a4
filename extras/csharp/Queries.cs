// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Jostle
{
    /// <summary>Origin + t * Direction for t from 0 to Reach, which may be infinite.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Ray3
    {
        public Vec3 Origin, Direction;
        public float Reach;
        public Ray3(Vec3 origin, Vec3 direction, float reach = float.PositiveInfinity)
        {
            Origin = origin;
            Direction = direction;
            Reach = reach;
        }
    }

    /// <summary>Origin + t * Direction for t from 0 to Reach, which may be infinite.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Ray2
    {
        public Vec2 Origin, Direction;
        public float Reach;
        public Ray2(Vec2 origin, Vec2 direction, float reach = float.PositiveInfinity)
        {
            Origin = origin;
            Direction = direction;
            Reach = reach;
        }
    }

    /// <summary>All within Radius of a point; of the nearest, how far to look, which may be infinitely
    /// far.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Sphere3
    {
        public Vec3 Center;
        public float Radius;
        public Sphere3(Vec3 center, float radius) { Center = center; Radius = radius; }
    }

    /// <summary>All within Radius of a point; of the nearest, how far to look, which may be infinitely
    /// far.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Sphere2
    {
        public Vec2 Center;
        public float Radius;
        public Sphere2(Vec2 center, float radius) { Center = center; Radius = radius; }
    }

    /// <summary>What a query met. At: how far along a ray; of the nearest boxes the squared distance, of the
    /// nearest shapes the distance.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Hit
    {
        public ObjectId Object;
        public double At;
        public bool Found { get { return Object.Value != 0; } }
        public override string ToString() { return Object + " at " + At; }
    }

    /// <summary>Which objects a query is about.</summary>
    public sealed class QueryFilter
    {
        /// <summary>The asker, as if it were an object: it is met by what it would pair with.</summary>
        public uint Category = uint.MaxValue, Mask = uint.MaxValue, Owner = uint.MaxValue;
        /// <summary>An object that doesn't count, such as the one that asks.</summary>
        public ObjectId Exclude;
        /// <summary>Asked about what is met; of many queries at once from several threads at a time. What it
        /// throws ends the query and is thrown again by it.</summary>
        public Func<ObjectId, bool> Accept;
    }

    /// <summary>Queries of one kind: any number of them, in the caller's memory, read in place. Numbers are
    /// the world's own.</summary>
    public readonly ref struct Query
    {
        internal readonly QueryKind Kind;
        internal readonly Values Values;
        internal readonly Objects Asking;
        internal readonly int Wanted;
        Query(QueryKind kind, Values values, Objects asking, int wanted)
        {
            Kind = kind;
            Values = values;
            Asking = asking;
            Wanted = wanted;
        }

        /// <summary>Ray3, Ray2 or the like: origin, direction, reach.</summary>
        public static Query Rays(Values rays) { return new Query(QueryKind.Ray, rays, default(Objects), 0); }
        public static Query Rays(Ray3[] rays) { return Rays(Values.Of(rays)); }
        public static Query Rays(Ray2[] rays) { return Rays(Values.Of(rays)); }
        /// <summary>What touches these boxes: Box3, Box2 or the like.</summary>
        public static Query Boxes(Values boxes)
        {
            return new Query(QueryKind.Box, boxes, default(Objects), 0);
        }
        public static Query Boxes(Box3[] boxes) { return Boxes(Values.Of(boxes)); }
        public static Query Boxes(Box2[] boxes) { return Boxes(Values.Of(boxes)); }
        /// <summary>What touches these balls: center, radius.</summary>
        public static Query Spheres(Values spheres)
        {
            return new Query(QueryKind.Sphere, spheres, default(Objects), 0);
        }
        public static Query Spheres(Sphere3[] spheres) { return Spheres(Values.Of(spheres)); }
        public static Query Spheres(Sphere2[] spheres) { return Spheres(Values.Of(spheres)); }
        /// <summary>The `wanted` nearest to each point: point, how far to look.</summary>
        public static Query Nearest(Values points, int wanted = 1)
        {
            if (wanted < 1) throw new ArgumentOutOfRangeException(nameof(wanted));
            return new Query(QueryKind.Nearest, points, default(Objects), wanted);
        }
        public static Query Nearest(Sphere3[] points, int wanted = 1)
        {
            return Nearest(Values.Of(points), wanted);
        }
        public static Query Nearest(Sphere2[] points, int wanted = 1)
        {
            return Nearest(Values.Of(points), wanted);
        }
        /// <summary>Boxes on their way: box, motion, reach.</summary>
        public static Query Sweeps(Values sweeps)
        {
            return new Query(QueryKind.Sweep, sweeps, default(Objects), 0);
        }
        /// <summary>Shapes on their way: where they begin, and a displacement for each. Asked about the
        /// shapes of objects.</summary>
        public static Query ShapeSweeps(Objects moving, Values displacements)
        {
            return new Query(QueryKind.ShapeSweep, displacements, moving, 0);
        }
        /// <summary>What touches these shapes. Asked about the shapes of objects.</summary>
        public static Query Shapes(Objects shapes)
        {
            return new Query(QueryKind.PosedShape, default(Values), shapes, 0);
        }

        /// <summary>The `wanted` nearest to each of these shapes. Asked about the shapes of
        /// objects.</summary>
        public static Query NearestToShapes(Objects shapes, int wanted = 1)
        {
            if (wanted < 1) throw new ArgumentOutOfRangeException(nameof(wanted));
            return new Query(QueryKind.NearestToShape, default(Values), shapes, wanted);
        }

        internal bool HasValues { get { return Kind != QueryKind.PosedShape
            && Kind != QueryKind.NearestToShape; } }

        internal int Count(int dim)
        {
            switch (Kind)
            {
                case QueryKind.Ray: return 2 * dim + 1;
                case QueryKind.Sweep: return 3 * dim + 1;
                case QueryKind.Box: return 2 * dim;
                case QueryKind.Sphere:
                case QueryKind.Nearest: return dim + 1;
                default: return dim;
            }
        }
    }

    /// <summary>The answers to many queries, read in place. Made once and filled again and again.</summary>
    public sealed unsafe class Answers : Owner
    {
        readonly ResultsHandle made = NewResults();
        internal ResultsHandle Results { get { return made.Open(this); } }
        internal override Handle Handle { get { return made; } }
        Native.jostle_lists lists;

        internal static ResultsHandle NewResults()
        {
            Library.Require();
            ResultsHandle results;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_results_new(null, out results, &error), &error);
            return results;
        }

        internal void Forget() { lists = default(Native.jostle_lists); }

        internal void Read()
        {
            Native.jostle_error error;
            Native.jostle_lists read;
            JostleException.Check(Native.jostle_results_lists(Results, &read, &error), &error);
            lists = read;
        }

        /// <summary>How many queries there were.</summary>
        public int Queries { get { return made.IsClosed ? 0 : checked((int)lists.queries); } }
        /// <summary>What the query of that number found; along rays and nearest first, else by id.</summary>
        public View<ObjectId> Of(int query)
        {
            Known(query);
            return new View<ObjectId>(this, lists.ids + lists.first[query],
                lists.first[query + 1] - lists.first[query]);
        }
        /// <summary>Where, as Hit.At; empty where queries have none.</summary>
        public View<double> At(int query)
        {
            Known(query);
            if (lists.at == null) return new View<double>(this, null, 0);
            return new View<double>(this, lists.at + lists.first[query],
                lists.first[query + 1] - lists.first[query]);
        }
        /// <summary>Whether it has more answers than were asked for.</summary>
        public bool More(int query)
        {
            Known(query);
            return lists.more[query] != 0;
        }

        void Known(int query)
        {
            made.Open(this);
            if ((ulong)query >= lists.queries)
                throw new ArgumentOutOfRangeException(nameof(query),
                    "query " + query + " of " + lists.queries);
        }
    }

    public sealed unsafe partial class World
    {
        static readonly Native.jostle_accept_answer_function acceptAnswerFunction = AcceptAnswer;
        static readonly IntPtr acceptAnswerPointer =
            Marshal.GetFunctionPointerForDelegate(acceptAnswerFunction);

        /// <summary>What a ray meets first.</summary>
        public bool First(Ray3 ray, out Hit hit, QueryFilter filter = null)
        {
            Hit found;
            First(Query.Rays(Values.Of(new ReadOnlySpan<Ray3>(&ray, 1))), new Span<Hit>(&found, 1), filter);
            hit = found;
            return found.Found;
        }
        public bool First(Ray2 ray, out Hit hit, QueryFilter filter = null)
        {
            Hit found;
            First(Query.Rays(Values.Of(new ReadOnlySpan<Ray2>(&ray, 1))), new Span<Hit>(&found, 1), filter);
            hit = found;
            return found.Found;
        }
        /// <summary>What is nearest to a point.</summary>
        public bool Nearest(Sphere3 point, out Hit hit, QueryFilter filter = null)
        {
            Hit found;
            First(Query.Nearest(Values.Of(new ReadOnlySpan<Sphere3>(&point, 1))), new Span<Hit>(&found, 1),
                filter);
            hit = found;
            return found.Found;
        }
        public bool Nearest(Sphere2 point, out Hit hit, QueryFilter filter = null)
        {
            Hit found;
            First(Query.Nearest(Values.Of(new ReadOnlySpan<Sphere2>(&point, 1))), new Span<Hit>(&found, 1),
                filter);
            hit = found;
            return found.Found;
        }
        /// <summary>All that touch a box: answers.Of(0).</summary>
        public void All(Box3 box, Answers answers, QueryFilter filter = null)
        {
            All(Query.Boxes(Values.Of(new ReadOnlySpan<Box3>(&box, 1))), answers, filter);
        }
        public void All(Box2 box, Answers answers, QueryFilter filter = null)
        {
            All(Query.Boxes(Values.Of(new ReadOnlySpan<Box2>(&box, 1))), answers, filter);
        }

        /// <summary>What each query meets first, or is nearest to: hits[i]. With `objects`, the queries are
        /// about the shapes in the boxes, which have a shape and a pose for every index; `details` is empty,
        /// or details[i] becomes where and how: CastHit3, CastHit2; of the nearest shapes Distance3,
        /// Distance2.</summary>
        public void First(Query query, Span<Hit> hits, QueryFilter filter = null)
        {
            Ask(Verb.First, query, default(Objects), MemoryMarshal.AsBytes(hits), hits.Length,
                default(Span<byte>), null, 0, filter);
        }
        public void First<D>(Query query, Objects objects, Span<Hit> hits, Span<D> details,
            QueryFilter filter = null) where D : struct
        {
            int dim = Numbers.Dim(Space), size = Numbers.Size(Space);
            int wanted = (3 * dim + 1) * size; // a distance
            if (query.Kind != QueryKind.NearestToShape) wanted = (2 * dim + 1) * size + 8; // a cast
            if (SizeOf<D>.Bytes != wanted)
                throw new JostleException(Status.SizeMismatch,
                    "details of " + query.Kind + " in " + Space + " aren't " + typeof(D));
            if (details.Length != 0 && details.Length != hits.Length)
                throw Differ(hits.Length, "hits", details.Length, "details");
            Ask(Verb.First, query, objects, MemoryMarshal.AsBytes(hits), hits.Length,
                MemoryMarshal.AsBytes(details), null, 0, filter);
        }
        public void First<D>(Query query, Objects objects, Hit[] hits, D[] details,
            QueryFilter filter = null) where D : struct
        {
            First(query, objects, new Span<Hit>(hits), new Span<D>(details), filter);
        }
        /// <summary>Whether there is any answer: any[i].</summary>
        public void Any(Query query, Span<bool> any, QueryFilter filter = null,
            Objects objects = default(Objects))
        {
            Ask(Verb.Any, query, objects, MemoryMarshal.AsBytes(any), any.Length, default(Span<byte>), null,
                0, filter);
        }
        /// <summary>How many there are: counts[i].</summary>
        public void CountAnswers(Query query, Span<ulong> counts, QueryFilter filter = null,
            Objects objects = default(Objects))
        {
            Ask(Verb.Count, query, objects, MemoryMarshal.AsBytes(counts), counts.Length,
                default(Span<byte>), null, 0, filter);
        }
        /// <summary>All answers, or so many of each.</summary>
        public void All(Query query, Answers answers, QueryFilter filter = null,
            Objects objects = default(Objects), long most = long.MaxValue)
        {
            if (answers == null) throw new ArgumentNullException(nameof(answers));
            if (most < 0) throw new ArgumentOutOfRangeException(nameof(most));
            answers.Enter();
            try
            {
                answers.Forget(); // if the call fails, there are none
                Ask(Verb.All, query, objects, default(Span<byte>), -1, default(Span<byte>), answers,
                    most == long.MaxValue ? ulong.MaxValue : (ulong)most, filter);
                answers.Read();
            }
            finally
            {
                answers.Leave();
            }
        }

        enum Verb { Any, Count, First, All }

        // All that queries have in common. `room`: for how many answers there is room in `written`; -1: they
        // go to `answers`.
        void Ask(Verb verb, Query query, Objects objects, Span<byte> written, int room, Span<byte> details,
            Answers answers, ulong most, QueryFilter filter)
        {
            int dim = Numbers.Dim(Space), size = Numbers.Size(Space);
            Native.jostle_error error;
            Native.jostle_queries asked = new Native.jostle_queries { kind = query.Kind,
                nearest = (uint)query.Wanted };
            Native.jostle_query_filter given = new Native.jostle_query_filter();
            given.struct_size = (ulong)sizeof(Native.jostle_query_filter);
            Native.jostle_asker asker;
            ulong exclude;
            Asked<Func<ObjectId, bool>> asking = null;
            GCHandle context = default(GCHandle);
            bool heldAsking = false, heldObjects = false;
            fixed (byte* values = query.Values.Bytes)
            fixed (byte* posesAsking = query.Asking.Poses.Bytes)
            fixed (byte* posesOf = objects.Poses.Bytes)
            fixed (byte* to = written)
            fixed (byte* how = details)
            {
                try
                {
                    Native.jostle_objects shapesAsking = query.Asking.At(posesAsking, Space, ref heldAsking);
                    Native.jostle_objects shapesOf = objects.At(posesOf, Space, ref heldObjects);
                    if (query.HasValues)
                        asked.values = query.Values.At(values, query.Count(dim), size, "queries");
                    if (query.Asking.Shapes != null) asked.shapes = &shapesAsking;
                    ulong count = !query.HasValues ? shapesAsking.poses.count : asked.values.count;
                    if (room >= 0 && (ulong)room != count)
                        throw new JostleException(Status.SizeMismatch,
                            count + " queries and room for " + room + " answers");
                    if (filter != null)
                    {
                        asker = new Native.jostle_asker { category = filter.Category, mask = filter.Mask,
                            owner = filter.Owner };
                        given.asker = &asker;
                        exclude = filter.Exclude.Value;
                        if (exclude != 0) given.exclude = &exclude;
                        if (filter.Accept != null)
                        {
                            asking = Spare() ?? new Asked<Func<ObjectId, bool>>();
                            asking.Function = filter.Accept;
                            context = GCHandle.Alloc(asking);
                            given.accept = acceptAnswerPointer;
                            given.context = (void*)GCHandle.ToIntPtr(context);
                        }
                    }
                    Native.jostle_objects* about = objects.Shapes == null ? null : &shapesOf;
                    Native.jostle_query_filter* wanted = filter == null ? null : &given;
                    Status status;
                    switch (verb)
                    {
                        case Verb.Any:
                            status = Native.jostle_query_any(handle, &asked, about, wanted, to, &error);
                            break;
                        case Verb.Count:
                            status = Native.jostle_query_count(handle, &asked, about, wanted, (ulong*)to,
                                &error);
                            break;
                        case Verb.First:
                            status = Native.jostle_query_first(handle, &asked, about, wanted,
                                (Native.jostle_hit*)to, how, &error);
                            break;
                        default:
                            status = Native.jostle_query_all(handle, &asked, about, wanted, most,
                                answers.Results, &error);
                            break;
                    }
                    if (asking != null) asking.Rethrow();
                    JostleException.Check(status, &error);
                }
                finally
                {
                    if (context.IsAllocated) context.Free();
                    if (asking != null) Spare(asking);
                    if (heldAsking) query.Asking.Shapes.Release();
                    if (heldObjects) objects.Shapes.Release();
                }
            }
        }

        // Queries run beside each other: the last one's is kept for the next, so that a steady frame makes
        // none.
        Asked<Func<ObjectId, bool>> spare;
        Asked<Func<ObjectId, bool>> Spare() { return System.Threading.Interlocked.Exchange(ref spare, null); }
        void Spare(Asked<Func<ObjectId, bool>> used)
        {
            used.Function = null;
            System.Threading.Interlocked.Exchange(ref spare, used);
        }

        [MonoPInvokeCallback(typeof(Native.jostle_accept_answer_function))]
        static int AcceptAnswer(void* context, uint query, ulong id)
        {
            Asked<Func<ObjectId, bool>> asked = Asked<Func<ObjectId, bool>>.From(context);
            try
            {
                return asked.Function(new ObjectId { Value = id }) ? 1 : 0;
            }
            catch (Exception thrown)
            {
                return asked.Failed(thrown);
            }
        }
    }
}
