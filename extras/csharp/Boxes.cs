// SPDX-License-Identifier: MIT
using System;
using System.Runtime.CompilerServices;
using System.Runtime.InteropServices;

namespace Jostle
{
    /// <summary>Two floats, as System.Numerics, Unity and Godot have them.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Vec2
    {
        public float X, Y;
        public Vec2(float x, float y) { X = x; Y = y; }
        public static implicit operator Vec2(System.Numerics.Vector2 v) { return new Vec2(v.X, v.Y); }
        public static implicit operator System.Numerics.Vector2(Vec2 v)
        {
            return new System.Numerics.Vector2(v.X, v.Y);
        }
#if UNITY_5_3_OR_NEWER
        public static implicit operator Vec2(UnityEngine.Vector2 v) { return new Vec2(v.x, v.y); }
        public static implicit operator UnityEngine.Vector2(Vec2 v)
        {
            return new UnityEngine.Vector2(v.X, v.Y);
        }
#elif GODOT
        public static implicit operator Vec2(Godot.Vector2 v) { return new Vec2((float)v.X, (float)v.Y); }
        public static implicit operator Godot.Vector2(Vec2 v) { return new Godot.Vector2(v.X, v.Y); }
#endif
        public override string ToString() { return "(" + X + ", " + Y + ")"; }
    }

    /// <summary>Three floats, as System.Numerics, Unity and Godot have them.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Vec3
    {
        public float X, Y, Z;
        public Vec3(float x, float y, float z) { X = x; Y = y; Z = z; }
        public static implicit operator Vec3(System.Numerics.Vector3 v) { return new Vec3(v.X, v.Y, v.Z); }
        public static implicit operator System.Numerics.Vector3(Vec3 v)
        {
            return new System.Numerics.Vector3(v.X, v.Y, v.Z);
        }
#if UNITY_5_3_OR_NEWER
        public static implicit operator Vec3(UnityEngine.Vector3 v) { return new Vec3(v.x, v.y, v.z); }
        public static implicit operator UnityEngine.Vector3(Vec3 v)
        {
            return new UnityEngine.Vector3(v.X, v.Y, v.Z);
        }
#elif GODOT
        public static implicit operator Vec3(Godot.Vector3 v)
        {
            return new Vec3((float)v.X, (float)v.Y, (float)v.Z);
        }
        public static implicit operator Godot.Vector3(Vec3 v) { return new Godot.Vector3(v.X, v.Y, v.Z); }
#endif
        public override string ToString() { return "(" + X + ", " + Y + ", " + Z + ")"; }
    }

    /// <summary>A box: all points from Min to Max.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Box2
    {
        public Vec2 Min, Max;
        public Box2(Vec2 min, Vec2 max) { Min = min; Max = max; }
        public override string ToString() { return Min + " to " + Max; }
    }

    /// <summary>A box: all points from Min to Max.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Box3
    {
        public Vec3 Min, Max;
        public Box3(Vec3 min, Vec3 max) { Min = min; Max = max; }
        public static Box3 Around(Vec3 center, Vec3 halfSize)
        {
            return new Box3(new Vec3(center.X - halfSize.X, center.Y - halfSize.Y, center.Z - halfSize.Z),
                            new Vec3(center.X + halfSize.X, center.Y + halfSize.Y, center.Z + halfSize.Z));
        }
        public override string ToString() { return Min + " to " + Max; }
    }

    static class Numbers
    {
        internal static int Dim(Space space)
        {
            return space == Space.Float2 || space == Space.Double2 ? 2 : 3;
        }
        internal static int Size(Space space)
        {
            return space == Space.Float2 || space == Space.Float3 ? 4 : 8;
        }
    }

    // sizeof for generic code.
    static class SizeOf<T> where T : struct
    {
        // 0 of what has references, which AsBytes refuses wherever it is used: not here, where the exception
        // would be wrapped.
        internal static readonly int Bytes =
            RuntimeHelpers.IsReferenceOrContainsReferences<T>() ? 0
                : MemoryMarshal.AsBytes(new ReadOnlySpan<T>(new T[1])).Length;
        internal static readonly bool IsNumber = typeof(T) == typeof(float) || typeof(T) == typeof(double);
    }

    /// <summary>Boxes in the caller's memory: read in place, during the call that they are given
    /// to.</summary>
    public readonly ref struct Boxes
    {
        internal readonly ReadOnlySpan<byte> Min, Max;
        internal readonly Space Space;
        readonly int stride;
        /// <summary>How many there are.</summary>
        public int Count { get; }

        Boxes(ReadOnlySpan<byte> min, ReadOnlySpan<byte> max, Space space, int stride, int count)
        {
            Min = min;
            Max = max;
            Space = space;
            this.stride = stride;
            Count = count;
        }

        /// <summary>Structs that are a box and nothing else, such as { Vector3 min, max }; or plain numbers:
        /// all of a lower corner, all of an upper one, the next box.</summary>
        public static Boxes Of<T>(ReadOnlySpan<T> items, Space space = Space.Float3) where T : struct
        {
            ReadOnlySpan<byte> bytes = MemoryMarshal.AsBytes(items);
            int corner = Numbers.Dim(space) * Numbers.Size(space), size = SizeOf<T>.Bytes;
            if (SizeOf<T>.IsNumber ? size != Numbers.Size(space) : size != 2 * corner)
                throw new JostleException(Status.SizeMismatch,
                    "a box of " + space + " has " + 2 * corner + " bytes, and " + typeof(T) + " has " + size +
                    "; if the box is a part of it, say where: Boxes.Of(items, min, max)");
            if (bytes.Length % (2 * corner) != 0)
                throw new JostleException(Status.SizeMismatch,
                    items.Length + " numbers are no whole boxes of " + space);
            return new Boxes(bytes, bytes.Slice(Math.Min(corner, bytes.Length)), space, 2 * corner,
                bytes.Length / (2 * corner));
        }
        public static Boxes Of<T>(T[] items, Space space = Space.Float3) where T : struct
        {
            return Of(new ReadOnlySpan<T>(items), space);
        }

        /// <summary>Structs with a box inside: its corners lie that many bytes from the beginning.</summary>
        public static Boxes Of<T>(ReadOnlySpan<T> items, int min, int max, Space space = Space.Float3)
            where T : struct
        {
            ReadOnlySpan<byte> bytes = MemoryMarshal.AsBytes(items);
            int corner = Numbers.Dim(space) * Numbers.Size(space), size = SizeOf<T>.Bytes;
            if (min < 0 || max < 0 || min > size - corner || max > size - corner)
                throw new JostleException(Status.InvalidArgument,
                    "a corner of " + corner + " bytes at " + min + " or " + max + " isn't inside " +
                    typeof(T) + ", which has " + size);
            if (bytes.Length == 0) return new Boxes(bytes, bytes, space, size, 0);
            return new Boxes(bytes.Slice(min), bytes.Slice(max), space, size, items.Length);
        }
        public static Boxes Of<T>(T[] items, int min, int max, Space space = Space.Float3) where T : struct
        {
            return Of(new ReadOnlySpan<T>(items), min, max, space);
        }

        /// <summary>An array of lower corners, and one of upper ones.</summary>
        public static Boxes Of<T>(ReadOnlySpan<T> min, ReadOnlySpan<T> max, Space space = Space.Float3)
            where T : struct
        {
            ReadOnlySpan<byte> lo = MemoryMarshal.AsBytes(min), hi = MemoryMarshal.AsBytes(max);
            int corner = Numbers.Dim(space) * Numbers.Size(space), size = SizeOf<T>.Bytes;
            if (size < corner)
                throw new JostleException(Status.SizeMismatch,
                    "a corner of " + space + " has " + corner + " bytes, and " + typeof(T) + " has " + size);
            if (min.Length != max.Length)
                throw new JostleException(Status.SizeMismatch,
                    min.Length + " lower corners and " + max.Length + " upper ones");
            return new Boxes(lo, hi, space, size, min.Length);
        }
        public static Boxes Of<T>(T[] min, T[] max, Space space = Space.Float3) where T : struct
        {
            return Of(new ReadOnlySpan<T>(min), new ReadOnlySpan<T>(max), space);
        }

        public static implicit operator Boxes(Box3[] boxes) { return Of(boxes); }
        public static implicit operator Boxes(Span<Box3> boxes) { return Of((ReadOnlySpan<Box3>)boxes); }
        public static implicit operator Boxes(ReadOnlySpan<Box3> boxes) { return Of(boxes); }
        public static implicit operator Boxes(Box2[] boxes) { return Of(boxes, Space.Float2); }
        public static implicit operator Boxes(Span<Box2> boxes)
        {
            return Of((ReadOnlySpan<Box2>)boxes, Space.Float2);
        }
        public static implicit operator Boxes(ReadOnlySpan<Box2> boxes) { return Of(boxes, Space.Float2); }

        // As C wants them, while Min and Max are pinned.
        internal unsafe Native.jostle_boxes At(byte* min, byte* max)
        {
            Native.jostle_boxes boxes = new Native.jostle_boxes();
            boxes.count = (ulong)Count;
            boxes.stride = stride;
            if (Count == 0) return boxes;
            int size = Numbers.Size(Space);
            boxes.lo_0 = min;
            boxes.lo_1 = min + size;
            boxes.hi_0 = max;
            boxes.hi_1 = max + size;
            if (Numbers.Dim(Space) == 3)
            {
                boxes.lo_2 = min + 2 * size;
                boxes.hi_2 = max + 2 * size;
            }
            return boxes;
        }

        internal void Expect(Space space, string what)
        {
            if (Space != space && Count != 0)
                throw new JostleException(Status.InvalidArgument,
                    "boxes of " + Space + " are given to " + what + " of " + space);
        }
    }

    /// <summary>Some numbers for each object or query (a pose, a ray), in the caller's memory: read in place,
    /// during the call that they are given to.</summary>
    public readonly ref struct Values
    {
        internal readonly ReadOnlySpan<byte> Bytes;
        readonly int stride, number; // 0: plain numbers, of so many bytes
        Values(ReadOnlySpan<byte> bytes, int stride, int number)
        {
            Bytes = bytes;
            this.stride = stride;
            this.number = number;
        }

        /// <summary>Plain numbers, one object's after another's; or structs that begin with them, or have
        /// them that many bytes from the beginning.</summary>
        public static Values Of<T>(ReadOnlySpan<T> items, int offset = 0) where T : struct
        {
            ReadOnlySpan<byte> bytes = MemoryMarshal.AsBytes(items);
            int size = SizeOf<T>.Bytes;
            if (SizeOf<T>.IsNumber) return new Values(bytes, 0, size);
            if (offset < 0 || offset >= size)
                throw new JostleException(Status.InvalidArgument,
                    "byte " + offset + " isn't inside " + typeof(T) + ", which has " + size);
            return new Values(bytes.Length == 0 ? bytes : bytes.Slice(offset), size, 0);
        }
        public static Values Of<T>(T[] items, int offset = 0) where T : struct
        {
            return Of(new ReadOnlySpan<T>(items), offset);
        }

        public static implicit operator Values(float[] numbers) { return Of(numbers); }
        public static implicit operator Values(double[] numbers) { return Of(numbers); }
        public static implicit operator Values(Vec2[] points) { return Of(points); }
        public static implicit operator Values(Vec3[] points) { return Of(points); }
        public static implicit operator Values(Pose2[] poses) { return Of(poses); }
        public static implicit operator Values(Pose3[] poses) { return Of(poses); }

        // As C wants them, so many numbers of that size for each, while Bytes is pinned.
        internal unsafe Native.jostle_values At(byte* bytes, int count, int size, string what)
        {
            Native.jostle_values values = new Native.jostle_values();
            int wanted = count * size, step = stride == 0 ? wanted : stride;
            if (stride == 0 && Bytes.Length != 0 && number != size)
                throw new JostleException(Status.SizeMismatch,
                    what + " are numbers of " + size + " bytes, not of " + number);
            // of structs that have something before their numbers the last is shorter
            int last = Bytes.Length % step;
            if (step < wanted || last != 0 && (stride == 0 || last < wanted))
                throw new JostleException(Status.SizeMismatch,
                    what + " are " + count + " numbers each, " + wanted + " bytes; given are " +
                    Bytes.Length + " bytes in steps of " + step);
            values.count = (ulong)((Bytes.Length + step - 1) / step);
            values.data = values.count == 0 ? null : bytes;
            values.stride = step;
            return values;
        }
    }
}
