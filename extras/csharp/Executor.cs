// SPDX-License-Identifier: MIT
using System;

namespace Jostle
{
    /// <summary>Where work runs. What is given none takes all cores, on the library's own threads.</summary>
    public sealed class Executor : IDisposable
    {
        readonly ExecutorHandle made;
        Executor(ExecutorHandle handle) { made = handle; }

        /// <summary>Everything on the calling thread.</summary>
        public static unsafe Executor Serial()
        {
            Library.Require();
            ExecutorHandle handle;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_executor_serial(out handle, &error), &error);
            return new Executor(handle);
        }

        /// <summary>A pool of so many threads; 0 for as many as the machine has cores.</summary>
        public static unsafe Executor Threads(int threads = 0)
        {
            Library.Require();
            if (threads < 0) throw new ArgumentOutOfRangeException("threads", threads, "at least 0");
            ExecutorHandle handle;
            Native.jostle_error error;
            JostleException.Check(Native.jostle_executor_threads((uint)threads, out handle, &error),
                &error);
            return new Executor(handle);
        }

        public void Dispose() { made.Dispose(); }

        // What an object is made with. `held`: whether the executor's handle is to be released after the
        // call.
        internal static unsafe Native.jostle_options Options(Executor executor, ref bool held)
        {
            Native.jostle_options options = new Native.jostle_options();
            options.struct_size = (ulong)sizeof(Native.jostle_options);
            if (executor != null)
            {
                executor.made.Open(executor).DangerousAddRef(ref held);
                options.executor = executor.made.DangerousGetHandle();
            }
            return options;
        }
        internal void Release() { made.DangerousRelease(); }
    }
}
