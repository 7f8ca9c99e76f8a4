// SPDX-License-Identifier: MIT
using System;
using System.Runtime.InteropServices;

namespace Jostle
{
    /// <summary>Where an object is: a position, and a rotation as cosine and sine.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Pose2
    {
        public Vec2 Position;
        public float Cos, Sin;
        public Pose2(Vec2 position, double angle = 0)
        {
            Position = position;
            Cos = (float)Math.Cos(angle);
            Sin = (float)Math.Sin(angle);
        }
    }

    /// <summary>Where an object is: a position, and a rotation as a quaternion x, y, z, w, as
    /// System.Numerics, Unity and Godot have it.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Pose3
    {
        public Vec3 Position;
        public float X, Y, Z, W;
        public Pose3(Vec3 position) { Position = position; X = Y = Z = 0; W = 1; }
        public Pose3(Vec3 position, float x, float y, float z, float w)
        {
            Position = position;
            X = x;
            Y = y;
            Z = z;
            W = w;
        }
        public Pose3(Vec3 position, System.Numerics.Quaternion q) : this(position, q.X, q.Y, q.Z, q.W) { }
#if UNITY_5_3_OR_NEWER
        public Pose3(Vec3 position, UnityEngine.Quaternion q) : this(position, q.x, q.y, q.z, q.w) { }
#elif GODOT
        public Pose3(Vec3 position, Godot.Quaternion q)
            : this(position, (float)q.X, (float)q.Y, (float)q.Z, (float)q.W)
        {
        }
#endif
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct ContactPoint2
    {
        /// <summary>The one point, counted from the positions of A and of B.</summary>
        public Vec2 FromA, FromB;
        /// <summary>Below 0 it is a gap.</summary>
        public float Depth;
        /// <summary>What meets there: the same from frame to frame.</summary>
        public uint Feature;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct ContactPoint3
    {
        /// <summary>The one point, counted from the positions of A and of B.</summary>
        public Vec3 FromA, FromB;
        /// <summary>Below 0 it is a gap.</summary>
        public float Depth;
        /// <summary>What meets there: the same from frame to frame.</summary>
        public uint Feature;
    }

    /// <summary>Where two objects touch. B moved by depth along the normal comes out of A.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Contact2
    {
        public Pair Pair;
        public uint PartA, PartB;
        /// <summary>A unit vector from A to B.</summary>
        public Vec2 Normal;
        /// <summary>How many points there are.</summary>
        public uint Count;
        /// <summary>The deepest is the first.</summary>
        public ContactPoint2 Point0, Point1;
        public ContactPoint2 Point(int point)
        {
            if ((uint)point >= Count) throw new ArgumentOutOfRangeException(nameof(point));
            return point == 0 ? Point0 : Point1;
        }
    }

    /// <summary>Where two objects touch. B moved by depth along the normal comes out of A.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Contact3
    {
        public Pair Pair;
        public uint PartA, PartB;
        /// <summary>A unit vector from A to B.</summary>
        public Vec3 Normal;
        /// <summary>How many points there are.</summary>
        public uint Count;
        /// <summary>The deepest is the first.</summary>
        public ContactPoint3 Point0, Point1, Point2, Point3;
        public ContactPoint3 Point(int point)
        {
            if ((uint)point >= Count) throw new ArgumentOutOfRangeException(nameof(point));
            return point == 0 ? Point0 : point == 1 ? Point1 : point == 2 ? Point2 : Point3;
        }
    }

    /// <summary>How far apart two shapes are.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Distance2
    {
        /// <summary>Infinite beyond what was looked at; below 0, how far B has to move along the normal to
        /// come out of A.</summary>
        public float Distance;
        /// <summary>A unit vector from A to B; the nearest points, from the positions of A and of
        /// B.</summary>
        public Vec2 Normal, FromA, FromB;
    }

    /// <summary>How far apart two shapes are.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Distance3
    {
        /// <summary>Infinite beyond what was looked at; below 0, how far B has to move along the normal to
        /// come out of A.</summary>
        public float Distance;
        /// <summary>A unit vector from A to B; the nearest points, from the positions of A and of
        /// B.</summary>
        public Vec3 Normal, FromA, FromB;
    }

    /// <summary>Where a ray or a moving shape meets a shape.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct CastHit2
    {
        /// <summary>Infinite where it doesn't.</summary>
        public float Fraction;
        /// <summary>The normal points out of the shape; the point counts from its position.</summary>
        public Vec2 Normal, Point;
        public uint Part, MovingPart;
    }

    /// <summary>Where a ray or a moving shape meets a shape.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct CastHit3
    {
        /// <summary>Infinite where it doesn't.</summary>
        public float Fraction;
        /// <summary>The normal points out of the shape; the point counts from its position.</summary>
        public Vec3 Normal, Point;
        public uint Part, MovingPart;
    }

    /// <summary>What an object looks like. It never changes, and any number of objects and lists may have
    /// it.</summary>
    public sealed unsafe class Shape : IDisposable
    {
        readonly ShapeHandle made;
        internal ShapeHandle Handle { get { return made.Open(this); } }
        Shape(ShapeHandle handle) { made = handle; }
        public void Dispose() { made.Dispose(); }

        static Shape Made(Status status, ShapeHandle handle, Native.jostle_error* error)
        {
            Library.Require();
            JostleException.Check(status, error);
            return new Shape(handle);
        }

        public static Shape Sphere(double radius, int dim = 3)
        {
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_sphere(dim, radius, out handle, &error), handle, &error);
        }
        /// <summary>All within a radius of a segment along the y axis.</summary>
        public static Shape Capsule(double halfLength, double radius, int dim = 3)
        {
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_capsule(dim, halfLength, radius, out handle, &error), handle,
                &error);
        }
        /// <summary>Half the edges.</summary>
        public static Shape Box(Vec3 half)
        {
            double* edges = stackalloc double[3];
            edges[0] = half.X;
            edges[1] = half.Y;
            edges[2] = half.Z;
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_box(3, edges, 0, out handle, &error), handle, &error);
        }
        public static Shape Box(Vec2 half)
        {
            double* edges = stackalloc double[2];
            edges[0] = half.X;
            edges[1] = half.Y;
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_box(2, edges, 0, out handle, &error), handle, &error);
        }
        public static Shape Cylinder(double halfLength, double radius)
        {
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_cylinder(halfLength, radius, out handle, &error), handle, &error);
        }
        /// <summary>From a disc at y = -halfLength to a tip at halfLength.</summary>
        public static Shape Cone(double halfLength, double radius)
        {
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_cone(halfLength, radius, out handle, &error), handle, &error);
        }
        /// <summary>All below a plane: normal . p at most offset.</summary>
        public static Shape HalfSpace(Vec3 normal, double offset = 0)
        {
            double* given = stackalloc double[3];
            given[0] = normal.X;
            given[1] = normal.Y;
            given[2] = normal.Z;
            ShapeHandle handle;
            Native.jostle_error error;
            return Made(Native.jostle_shape_half_space(3, given, offset, out handle, &error), handle, &error);
        }
        /// <summary>The convex hull of points, enlarged by a radius.</summary>
        public static Shape Hull(Values points, Space space = Space.Float3, double radius = 0)
        {
            ShapeHandle handle;
            Native.jostle_error error;
            fixed (byte* bytes = points.Bytes)
            {
                Native.jostle_values given = Row(points, bytes, space);
                return Made(Native.jostle_shape_hull(space, given.data, given.count, radius, out handle, &error),
                    handle, &error);
            }
        }
        /// <summary>Triangles: three numbers of vertices each.</summary>
        public static Shape Mesh(Values vertices, ReadOnlySpan<uint> triangles, Space space = Space.Float3)
        {
            int dim = Numbers.Dim(space);
            if (triangles.Length % dim != 0) throw new JostleException(Status.SizeMismatch,
                triangles.Length + " numbers of vertices are no whole elements of " + dim);
            ShapeHandle handle;
            Native.jostle_error error;
            fixed (byte* bytes = vertices.Bytes)
            fixed (uint* elements = triangles)
            {
                Native.jostle_values given = Row(vertices, bytes, space);
                return Made(Native.jostle_shape_mesh(space, given.data, given.count, elements,
                    (ulong)(triangles.Length / dim), 0, out handle, &error), handle, &error);
            }
        }
        /// <summary>The same with int, which Unity's meshes have.</summary>
        public static Shape Mesh(Values vertices, ReadOnlySpan<int> triangles, Space space = Space.Float3)
        {
            // less than 0 is no vertex in either
            return Mesh(vertices, MemoryMarshal.Cast<int, uint>(triangles), space);
        }
        /// <summary>Several shapes that move as one.</summary>
        public static Shape Compound(Shape[] children, Pose3[] poses)
        {
            if (children == null) throw new ArgumentNullException(nameof(children));
            if (poses == null) throw new ArgumentNullException(nameof(poses));
            if (children.Length != poses.Length)
                throw new JostleException(Status.SizeMismatch,
                    children.Length + " children and " + poses.Length + " poses");
            IntPtr[] handles = new IntPtr[children.Length];
            bool[] held = new bool[children.Length];
            double[] numbers = new double[7 * poses.Length];
            try
            {
                for (int i = 0; i < children.Length; ++i)
                {
                    if (children[i] == null) throw new ArgumentNullException(nameof(children), "child " + i);
                    children[i].Handle.DangerousAddRef(ref held[i]);
                    handles[i] = children[i].Handle.DangerousGetHandle();
                    Pose3 pose = poses[i];
                    Vec3 at = pose.Position;
                    double[] given = { at.X, at.Y, at.Z, pose.X, pose.Y, pose.Z, pose.W };
                    given.CopyTo(numbers, 7 * i);
                }
                ShapeHandle handle;
                Native.jostle_error error;
                fixed (IntPtr* first = handles)
                fixed (double* row = numbers)
                    return Made(Native.jostle_shape_compound(3, first, row, (ulong)children.Length,
                        out handle, &error), handle, &error);
            }
            finally
            {
                for (int i = 0; i < children.Length; ++i)
                    if (held[i]) children[i].made.DangerousRelease();
            }
        }

        // Points one after another, which C wants.
        static Native.jostle_values Row(Values points, byte* bytes, Space space)
        {
            int dim = Numbers.Dim(space), size = Numbers.Size(space);
            Native.jostle_values given = points.At(bytes, dim, size, "points");
            if (given.stride != dim * size) throw new JostleException(Status.SizeMismatch,
                "points of " + space + " have " + dim * size + " bytes, not " + given.stride);
            return given;
        }
    }

    /// <summary>One shape for each object. Read by any number of threads, changed by one.</summary>
    public sealed unsafe class Shapes : IDisposable
    {
        readonly ShapesHandle made;
        ShapesHandle handle { get { return made.Open(this); } }
        public int Dim { get; }
        public void Dispose() { made.Dispose(); }

        public Shapes(int dim = 3)
        {
            Library.Require();
            Dim = dim;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_shapes_new(dim, out made, &error), &error);
        }

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

        /// <summary>The same shape for that many more objects.</summary>
        public void Add(Shape shape, int count = 1)
        {
            if (shape == null) throw new ArgumentNullException(nameof(shape));
            if (count < 0) throw new ArgumentOutOfRangeException(nameof(count));
            Native.jostle_error error;
            JostleException.Check(Native.jostle_shapes_add(handle, shape.Handle, (ulong)count, &error),
                &error);
        }

        /// <summary>Gives one object another shape.</summary>
        public void Set(int index, Shape shape)
        {
            if (shape == null) throw new ArgumentNullException(nameof(shape));
            if (index < 0) throw new ArgumentOutOfRangeException(nameof(index));
            Native.jostle_error error;
            JostleException.Check(Native.jostle_shapes_set(handle, (ulong)index, shape.Handle, &error),
                &error);
        }

        public void Clear()
        {
            Native.jostle_error error;
            JostleException.Check(Native.jostle_clear(handle, &error), &error);
        }

        internal IntPtr Hold(ref bool held)
        {
            handle.DangerousAddRef(ref held);
            return handle.DangerousGetHandle();
        }
        internal void Release() { made.DangerousRelease(); } // maybe disposed meanwhile
    }

    /// <summary>Objects with a shape and a pose each. Poses are Pose3, Pose2, or numbers or structs like
    /// them: read in place.</summary>
    public readonly unsafe ref struct Objects
    {
        internal readonly Shapes Shapes;
        internal readonly Values Poses;
        public Objects(Shapes shapes, Values poses)
        {
            if (shapes == null) throw new ArgumentNullException(nameof(shapes));
            Shapes = shapes;
            Poses = poses;
        }

        internal Native.jostle_objects At(byte* poses, Space space, ref bool held)
        {
            Native.jostle_objects objects = new Native.jostle_objects();
            if (Shapes == null) return objects;
            int dim = Numbers.Dim(space);
            if (Shapes.Dim != dim) throw new JostleException(Status.InvalidArgument,
                "shapes of " + Shapes.Dim + " dimensions are given to " + space);
            objects.poses = Poses.At(poses, dim == 3 ? 7 : 4, Numbers.Size(space), "poses");
            objects.shapes = Shapes.Hold(ref held);
            return objects;
        }

        /// <summary>The box around each object, enlarged by a margin: what a PairFinder or a World is
        /// given.</summary>
        public void Bounds(Span<Box3> boxes, double margin = 0)
        {
            Bounds(Space.Float3, MemoryMarshal.AsBytes(boxes), boxes.Length, margin);
        }
        public void Bounds(Span<Box2> boxes, double margin = 0)
        {
            Bounds(Space.Float2, MemoryMarshal.AsBytes(boxes), boxes.Length, margin);
        }

        void Bounds(Space space, Span<byte> boxes, int room, double margin)
        {
            bool held = false;
            fixed (byte* poses = Poses.Bytes)
            fixed (byte* to = boxes)
            {
                try
                {
                    Native.jostle_objects objects = At(poses, space, ref held);
                    if (objects.poses.count != (ulong)room)
                        throw new JostleException(Status.SizeMismatch,
                            objects.poses.count + " poses and room for " + room + " boxes");
                    Native.jostle_error error;
                    JostleException.Check(Native.jostle_bounds(space, &objects, margin, ExecutorHandle.None,
                        to, &error), &error);
                }
                finally
                {
                    if (held) Shapes.Release();
                }
            }
        }
    }

    /// <summary>From pairs to contacts. One call at a time.</summary>
    public abstract unsafe class ContactFinder<TContact, TDistance> : Owner where TContact : struct
        where TDistance : struct
    {
        readonly Space space;
        readonly ContactFinderHandle made;
        ContactFinderHandle handle { get { return made.Open(this); } }
        internal override Handle Handle { get { return made; } }

        internal ContactFinder(Space space, Executor executor)
        {
            Library.Require();
            this.space = space;
            bool held = false;
            try
            {
                Native.jostle_options options = Executor.Options(executor, ref held);
                Native.jostle_error error;
                JostleException.Check(Native.jostle_contact_finder_new(space, &options, out made, &error),
                    &error);
            }
            finally
            {
                if (held) executor.Release();
            }
        }

        /// <summary>The contacts of pairs that touch or have a gap of up to `margin`, in the order of the
        /// pairs. Pairs are positions in `objects`, or in `a` and `b`.</summary>
        public View<TContact> Find(Objects objects, View<Pair> pairs, double margin = 0)
        {
            return Find(objects, default(Objects), pairs, margin);
        }
        public View<TContact> Find(Objects objects, ReadOnlySpan<Pair> pairs, double margin = 0)
        {
            fixed (Pair* items = pairs) return Find(objects, default(Objects), Given(items, pairs.Length),
                margin);
        }
        public View<TContact> Find(Objects a, Objects b, View<Pair> pairs, double margin = 0)
        {
            Native.jostle_blocks found = new Native.jostle_blocks();
            Work(Verb.Find, a, b, pairs, margin, null, &found);
            return new View<TContact>(this, found);
        }
        public View<TContact> Find(Objects a, Objects b, ReadOnlySpan<Pair> pairs, double margin = 0)
        {
            fixed (Pair* items = pairs) return Find(a, b, Given(items, pairs.Length), margin);
        }

        /// <summary>Whether the shapes of each pair touch: touching[i].</summary>
        public void Touching(Objects objects, ReadOnlySpan<Pair> pairs, Span<bool> touching)
        {
            Touching(objects, default(Objects), pairs, touching);
        }
        public void Touching(Objects a, Objects b, ReadOnlySpan<Pair> pairs, Span<bool> touching)
        {
            Expect(pairs.Length, touching.Length);
            fixed (Pair* items = pairs)
            fixed (byte* to = MemoryMarshal.AsBytes(touching))
                Work(Verb.Touching, a, b, Given(items, pairs.Length), 0, to, null);
        }

        /// <summary>How far apart the shapes of each pair are, up to `most`: distances[i].</summary>
        public void Distances(Objects objects, ReadOnlySpan<Pair> pairs, Span<TDistance> distances,
            double most = double.PositiveInfinity)
        {
            Distances(objects, default(Objects), pairs, distances, most);
        }
        public void Distances(Objects a, Objects b, ReadOnlySpan<Pair> pairs, Span<TDistance> distances,
            double most = double.PositiveInfinity)
        {
            Expect(pairs.Length, distances.Length);
            fixed (Pair* items = pairs)
            fixed (byte* to = MemoryMarshal.AsBytes(distances))
                Work(Verb.Distances, a, b, Given(items, pairs.Length), most, to, null);
        }

        enum Verb { Find, Touching, Distances }

        static View<Pair> Given(Pair* items, int count) { return new View<Pair>(items, (ulong)count); }

        static void Expect(int pairs, int room)
        {
            if (pairs != room) throw new JostleException(Status.SizeMismatch,
                pairs + " pairs and room for " + room + " answers");
        }

        void Work(Verb verb, Objects a, Objects b, View<Pair> pairs, double length, byte* to,
            Native.jostle_blocks* found)
        {
            bool heldA = false, heldB = false;
            Native.jostle_error error;
            Enter();
            fixed (byte* posesA = a.Poses.Bytes)
            fixed (byte* posesB = b.Poses.Bytes)
            {
                try
                {
                    if (a.Shapes == null)
                        throw new ArgumentNullException("objects", "objects without shapes");
                    Native.jostle_block room;
                    Native.jostle_blocks given = pairs.Blocks(&room);
                    Native.jostle_objects objectsA = a.At(posesA, space, ref heldA),
                        objectsB = b.At(posesB, space, ref heldB);
                    Native.jostle_objects* others = b.Shapes == null ? null : &objectsB;
                    Status status;
                    switch (verb)
                    {
                        case Verb.Find:
                            status = Native.jostle_contact_finder_find(handle, &objectsA, others, &given,
                                length, found, &error);
                            break;
                        case Verb.Touching:
                            status = Native.jostle_contact_finder_touching(handle, &objectsA, others, &given,
                                to, &error);
                            break;
                        default:
                            status = Native.jostle_contact_finder_distances(handle, &objectsA, others, &given,
                                length, to, &error);
                            break;
                    }
                    JostleException.Check(status, &error);
                }
                finally
                {
                    if (heldA) a.Shapes.Release();
                    if (heldB) b.Shapes.Release();
                    Leave();
                }
            }
        }
    }

    /// <summary>Contacts in 3D.</summary>
    public sealed class ContactFinder3 : ContactFinder<Contact3, Distance3>
    {
        public ContactFinder3(Executor executor = null) : base(Space.Float3, executor) { }
    }

    /// <summary>Contacts in 2D.</summary>
    public sealed class ContactFinder2 : ContactFinder<Contact2, Distance2>
    {
        public ContactFinder2(Executor executor = null) : base(Space.Float2, executor) { }
    }
}
