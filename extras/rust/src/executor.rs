// SPDX-License-Identifier: MIT
use std::ffi::c_void;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::Arc;

use crate::error::{call, must, Caught, Error};
use crate::ffi;

/// Where work runs. The same pairs come in the same order from any of them.
///
/// It is a handle: clones stand for the same threads, which live as long as something uses them.
#[derive(Clone)]
pub struct Executor(Arc<Inner>);

struct Inner {
    handle: *mut ffi::jostle_executor,
    host: Option<Arc<Host>>, // C has its address
}
struct Host {
    run: Box<dyn Fn(&(dyn Fn() + Sync)) + Send + Sync>,
    caught: Caught,
}
// SAFETY: an executor serves several callers at a time.
unsafe impl Send for Inner {}
unsafe impl Sync for Inner {}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: the handle is ours. What was made with it is gone, since it had a clone of the Arc.
        unsafe { ffi::jostle_free(self.handle.cast(), null_mut()) };
    }
}

impl Executor {
    /// Everything on the calling thread.
    pub fn serial() -> Executor {
        Executor::made(None, |_, out, error| unsafe { ffi::jostle_executor_serial(out, error) })
    }
    /// A pool of its own: so many threads, the calling one included. 0 is as many as the machine has cores.
    ///
    /// # Errors
    /// If the system gives no more threads.
    pub fn threads(threads: u32) -> Result<Executor, Error> {
        Executor::try_made(None, |_, out, error| unsafe { ffi::jostle_executor_threads(threads, out, error) })
    }
    /// Your own threads, such as rayon's: `run` is given `work` and calls it from as many threads as it
    /// likes, at once or one after another, and returns when all those calls have returned.
    ///
    /// Each call of `work` takes tasks for as long as there are some. What is then left is done on the
    /// calling thread, so no answer depends on how often it was called. `concurrency` is how many threads
    /// that may be.
    ///
    /// ```
    /// use jostle::{Executor, PairFinder};
    ///
    /// // With rayon:
    /// // Executor::host(rayon::current_num_threads() as u32, |work| { rayon::broadcast(|_| work()); })
    /// let executor = Executor::host(4, |work| {
    ///     std::thread::scope(|scope| for _ in 0..3 {
    ///         scope.spawn(|| work());
    ///     })
    /// });
    /// let mut finder = PairFinder::with_executor(&executor);
    /// # assert_eq!(finder.find(&[[[0.0; 3], [1.0; 3]], [[1.0; 3], [2.0; 3]]])?.len(), 1);
    /// # Ok::<(), jostle::Error>(())
    /// ```
    ///
    /// # Panics
    /// If `concurrency` is 0. A panic of `run` goes on in the call that needed it.
    pub fn host(concurrency: u32, run: impl Fn(&(dyn Fn() + Sync)) + Send + Sync + 'static) -> Executor {
        assert!(concurrency > 0, "an executor has at least one thread");
        let host = Arc::new(Host { run: Box::new(run), caught: Caught::default() });
        Executor::made(Some(host), |context, out, error| unsafe {
            ffi::jostle_executor_callback(concurrency, Some(run_host), context, out, error)
        })
    }
    /// How many threads it has at most.
    pub fn concurrency(&self) -> u32 {
        let mut threads = 0;
        must(|error| unsafe { ffi::jostle_executor_concurrency(self.0.handle, &mut threads, error) });
        threads
    }

    pub(crate) fn raw(&self) -> *const ffi::jostle_executor {
        self.0.handle
    }
    /// Goes on with what a function of the host's panicked with.
    pub(crate) fn resume(&self) {
        if let Some(host) = &self.0.host {
            host.caught.resume();
        }
    }

    fn try_made(
        host: Option<Arc<Host>>,
        make: impl FnOnce(
            *mut c_void,
            *mut *mut ffi::jostle_executor,
            *mut ffi::jostle_error,
        ) -> ffi::jostle_status,
    ) -> Result<Executor, Error> {
        let mut handle = null_mut();
        let context = host.as_ref().map_or(null_mut(), |host| Arc::as_ptr(host) as *mut c_void);
        call(|error| make(context, &mut handle, error))?;
        Ok(Executor(Arc::new(Inner { handle, host })))
    }
    fn made(
        host: Option<Arc<Host>>,
        make: impl FnOnce(
            *mut c_void,
            *mut *mut ffi::jostle_executor,
            *mut ffi::jostle_error,
        ) -> ffi::jostle_status,
    ) -> Executor {
        Executor::try_made(host, make).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// Tasks of the library's, to be called from any thread, each number once.
struct Tasks {
    next: AtomicU32,
    count: u32,
    task: unsafe extern "C" fn(*mut c_void, u32),
    context: *mut c_void,
}
// SAFETY: that is what tasks are for.
unsafe impl Sync for Tasks {}

impl Tasks {
    fn work(&self) {
        while let Ok(i) =
            self.next.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |i| (i < self.count).then(|| i + 1))
        {
            // SAFETY: number i is called this once, and the call that needs it waits until run_host returns.
            unsafe { (self.task)(self.context, i) };
        }
    }
}

unsafe extern "C" fn run_host(
    context: *mut c_void,
    count: u32,
    task: Option<unsafe extern "C" fn(*mut c_void, u32)>,
    task_context: *mut c_void,
) -> i32 {
    // SAFETY: the executor's own, which lives as long as it.
    let host = &*(context as *const Host);
    host.caught.run(|| {
        let tasks =
            Tasks { next: AtomicU32::new(0), count, task: task.expect("a task"), context: task_context };
        (host.run)(&|| tasks.work());
        tasks.work();
        0
    })
}

/// Options that name an executor and nothing else.
pub(crate) fn options(executor: Option<&Executor>) -> ffi::jostle_options {
    ffi::jostle_options {
        struct_size: std::mem::size_of::<ffi::jostle_options>() as u64,
        executor: executor.map_or(std::ptr::null(), Executor::raw),
        allocator: std::ptr::null(),
        instruction_set: ffi::JOSTLE_FASTEST,
        all_points: 0,
    }
}
