// SPDX-License-Identifier: MIT
use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use crate::ask::Ask;
use crate::boxes::{as_many, Aabb, Boxes, Coordinate};
use crate::error::{call, must, Error};
use crate::executor::{options, Executor};
use crate::ffi;
use crate::pairs::{Pair, Results};

/// Boxes that stay, or move now and then, and queries about them. For boxes that all move,
/// [`World`](crate::World).
///
/// ```
/// use jostle::{Aabb, BoxIndex, Nearest};
/// let mut index = BoxIndex::new();
/// index.build(&[[[0.0, 0.0], [1.0, 1.0]], [[2.0, 0.0], [3.0, 1.0]]])?;
/// assert_eq!(index.ask().all(&Aabb::new([0.5, 0.5], [2.0, 2.0]))?, [0, 1]);
/// assert_eq!(index.ask().nearest(&Nearest::new([9.0, 0.0]))?.unwrap().id, 1);
/// # Ok::<(), jostle::Error>(())
/// ```
pub struct BoxIndex<T: Coordinate<D>, const D: usize> {
    handle: *mut ffi::jostle_index,
    executor: Option<Executor>,
    of: PhantomData<T>,
}
// SAFETY: queries may come from any number of threads while nothing changes the index: that takes &mut self.
unsafe impl<T: Coordinate<D>, const D: usize> Send for BoxIndex<T, D> {}
unsafe impl<T: Coordinate<D>, const D: usize> Sync for BoxIndex<T, D> {}

impl<T: Coordinate<D>, const D: usize> Drop for BoxIndex<T, D> {
    fn drop(&mut self) {
        // SAFETY: the handle is ours.
        unsafe { ffi::jostle_free(self.handle.cast(), null_mut()) };
    }
}
impl<T: Coordinate<D>, const D: usize> Default for BoxIndex<T, D> {
    fn default() -> Self {
        BoxIndex::new()
    }
}
impl<T: Coordinate<D>, const D: usize> std::fmt::Debug for BoxIndex<T, D> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("BoxIndex").field("len", &self.len()).finish_non_exhaustive()
    }
}

impl<T: Coordinate<D>, const D: usize> BoxIndex<T, D> {
    /// An empty one that works on all cores.
    pub fn new() -> Self {
        BoxIndex::made(None)
    }
    /// An empty one that works where the executor says.
    pub fn with_executor(executor: &Executor) -> Self {
        BoxIndex::made(Some(executor.clone()))
    }
    fn made(executor: Option<Executor>) -> Self {
        let mut handle = null_mut();
        must(|error| unsafe {
            ffi::jostle_index_new(T::SPACE, &options(executor.as_ref()), &mut handle, error)
        });
        BoxIndex { handle, executor, of: PhantomData }
    }

    /// Forgets everything and takes these boxes: the position of each is its id.
    ///
    /// # Errors
    /// A box that is NaN or inverted, by its position. So with all that takes boxes.
    pub fn build<'b>(&mut self, boxes: impl Into<Boxes<'b, T, D>>) -> Result<(), Error> {
        let (handle, boxes) = (self.handle, boxes.into());
        self.change(|error| unsafe { ffi::jostle_index_build(handle, null(), &boxes.raw, error) })
    }
    /// More boxes, with ids of your own.
    ///
    /// # Errors
    /// As of `build`; an id that is there already.
    pub fn insert<'b>(&mut self, ids: &[u32], boxes: impl Into<Boxes<'b, T, D>>) -> Result<(), Error> {
        let (handle, boxes) = (self.handle, as_many(ids, boxes.into())?);
        self.change(|error| unsafe { ffi::jostle_index_insert(handle, ids.as_ptr(), &boxes.raw, error) })
    }
    /// Other boxes for these ids.
    ///
    /// # Errors
    /// As of `build`; an id that isn't there.
    pub fn move_many<'b>(&mut self, ids: &[u32], boxes: impl Into<Boxes<'b, T, D>>) -> Result<(), Error> {
        let (handle, boxes) = (self.handle, as_many(ids, boxes.into())?);
        self.change(|error| unsafe { ffi::jostle_index_move(handle, ids.as_ptr(), &boxes.raw, error) })
    }
    /// Without these ids.
    ///
    /// # Errors
    /// An id that isn't there.
    pub fn erase(&mut self, ids: &[u32]) -> Result<(), Error> {
        let handle = self.handle;
        self.change(|error| unsafe { ffi::jostle_index_erase(handle, ids.as_ptr(), ids.len() as u64, error) })
    }
    /// All pairs of one of these boxes and an object that it touches, ascending: `a` is the position among
    /// the boxes, `b` the id.
    ///
    /// # Errors
    /// As of `build`.
    pub fn join<'b>(&mut self, boxes: impl Into<Boxes<'b, T, D>>) -> Result<Vec<Pair>, Error> {
        let (handle, boxes) = (self.handle, boxes.into());
        let results = Results::new();
        self.change(|error| unsafe {
            ffi::jostle_query_join(handle.cast(), &boxes.raw, null(), results.raw(), error)
        })?;
        Ok(results.pairs().to_vec())
    }
    /// Rays, overlaps, what is near: see [`Ask`].
    pub fn ask(&self) -> Ask<'_, u32, T, D> {
        Ask::new(self.handle.cast(), self.executor.as_ref())
    }
    /// How many boxes there are.
    pub fn len(&self) -> usize {
        let mut size = 0;
        must(|error| unsafe { ffi::jostle_size(self.handle.cast(), &mut size, error) });
        size as usize
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Whether the id is there.
    pub fn contains(&self, id: u32) -> bool {
        let mut contains = 0;
        must(|error| unsafe { ffi::jostle_index_contains(self.handle, &id, 1, &mut contains, error) });
        contains != 0
    }
    /// The box of an id.
    ///
    /// # Errors
    /// An id that isn't there.
    pub fn box_of(&self, id: u32) -> Result<Aabb<T, D>, Error> {
        let mut aabb = MaybeUninit::<Aabb<T, D>>::uninit();
        call(|error| unsafe {
            ffi::jostle_index_boxes(self.handle, &id, 1, aabb.as_mut_ptr().cast(), error)
        })?;
        // SAFETY: the call has written 2 D numbers.
        Ok(unsafe { aabb.assume_init() })
    }
    /// Goes on with panics of the executor's.
    fn change(
        &mut self,
        function: impl FnOnce(*mut ffi::jostle_error) -> ffi::jostle_status,
    ) -> Result<(), Error> {
        let result = call(function);
        if let (Err(_), Some(executor)) = (&result, &self.executor) {
            executor.resume();
        }
        result
    }
}
