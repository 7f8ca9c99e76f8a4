// SPDX-License-Identifier: MIT
using System;
using System.Runtime.ExceptionServices;
using System.Runtime.InteropServices;
using System.Text;
using System.Threading;

namespace Jostle
{
    /// <summary>What the library refuses. The message names the object and the value.</summary>
    public sealed class JostleException : Exception
    {
        public Status Status { get; }
        /// <summary>The lowest object at fault, or null where it is none in particular.</summary>
        public ulong? Index { get; }

        internal JostleException(Status status, string message, ulong? index = null) : base(message)
        {
            Status = status;
            Index = index;
        }

        internal static unsafe void Check(Status status, Native.jostle_error* error)
        {
            if (status != Status.Ok) throw From(status, error);
        }

        static unsafe JostleException From(Status status, Native.jostle_error* error)
        {
            int length = 0;
            while (length < 496 && error->message[length] != 0) ++length;
            ulong? index = null;
            if (error->index != ulong.MaxValue) index = error->index;
            return new JostleException(status, Encoding.UTF8.GetString(error->message, length), index);
        }
    }

    /// <summary>The library that was loaded.</summary>
    public static class Library
    {
        static bool fits;

        /// <summary>Such as 0.3.0.</summary>
        public static unsafe Version Version
        {
            get
            {
                uint major, minor, patch;
                Native.jostle_error error;
                try
                {
                    JostleException.Check(Native.jostle_version(&major, &minor, &patch, &error), &error);
                }
                catch (DllNotFoundException thrown)
                {
                    throw new DllNotFoundException("the library itself isn't found: put jostle.dll " +
                        "(Windows), libjostle.so (Linux) or libjostle.dylib (macOS) beside the program, " +
                        "or in Unity into Assets/Plugins", thrown);
                }
                return new Version((int)major, (int)minor, (int)patch);
            }
        }

        // Before 1.0 a new minor version may have other structs: better a message than a crash.
        internal static void Require()
        {
            if (fits) return;
            Version found = Version;
            if (found.Major != Native.Major || (found.Major == 0 && found.Minor != Native.Minor))
                throw new JostleException(Status.InvalidArgument,
                    "these sources are for jostle " + Native.Major + "." + Native.Minor +
                    ", but the library that was loaded is " + found);
            fits = true;
        }
    }

    /// <summary>What has results that are read in place: they are of one state of it, and refuse to be read
    /// in another.</summary>
    public abstract class Owner : IDisposable
    {
        internal int State;
        int busy;

        internal abstract Handle Handle { get; }

        // Around calls of which there is one at a time, and which end the validity of results.
        internal void Enter()
        {
            if (Interlocked.Exchange(ref busy, 1) != 0)
                throw new InvalidOperationException(GetType().Name +
                    " is at work already, for another thread or around this callback: one call at a time");
            ++State;
        }
        internal void Leave() { Volatile.Write(ref busy, 0); }

        public void Dispose() { Handle.Dispose(); }

        internal void Expect(int state)
        {
            Handle.Open(this);
            if (state == State) return;
            throw new InvalidOperationException("these results are no longer valid: " + GetType().Name +
                " was called since; copy them with ToArray()");
        }
    }

    static class Handles
    {
        // The marshaller would throw as well, without saying what is disposed.
        internal static H Open<H>(this H handle, object owner) where H : Handle
        {
            if (handle.IsClosed) throw new ObjectDisposedException(owner.GetType().Name);
            return handle;
        }
    }

    // A function of the user's while native code calls it: what it throws is kept, ends the call, and is
    // thrown again after it.
    sealed class Asked<F> where F : class
    {
        internal F Function;
        ExceptionDispatchInfo failure;

        // The context that native code hands back. Its handle is the caller's to free.
        internal static unsafe Asked<F> From(void* context)
        {
            return (Asked<F>)GCHandle.FromIntPtr((IntPtr)context).Target;
        }

        internal int Failed(Exception exception)
        {
            Interlocked.CompareExchange(ref failure, ExceptionDispatchInfo.Capture(exception), null);
            return -1;
        }

        internal void Rethrow()
        {
            ExceptionDispatchInfo thrown = failure;
            if (thrown == null) return;
            failure = null;
            thrown.Throw();
        }
    }

    // Unity's ahead-of-time compiler looks for an attribute of this name on what native code calls.
    [AttributeUsage(AttributeTargets.Method)]
    sealed class MonoPInvokeCallbackAttribute : Attribute
    {
        public MonoPInvokeCallbackAttribute(Type type) { }
    }
}
