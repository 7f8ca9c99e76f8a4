// SPDX-License-Identifier: MIT
use std::ffi::c_void;
use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::ptr::{null, null_mut};
use std::slice;

use crate::boxes::{Boxes, Coordinate, Values};
use crate::error::{call, must, Caught, Error};
use crate::executor::{options, Executor};
use crate::ffi;

/// Two touching objects, by their positions in the input.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pair {
    /// Within one set the lower position; of two sets that in the first.
    pub a: u32,
    /// The other one.
    pub b: u32,
}

/// In which order pairs come. Either is the same for any number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// By their place in space: the fastest.
    #[default]
    Canonical,
    /// Ascending by `(a, b)`.
    Sorted,
}

/// Which pairs are wanted. What isn't given filters nothing.
///
/// ```
/// use jostle::{Filter, Order, PairFinder};
/// let boxes = [[[0.0, 0.0], [2.0, 2.0]], [[1.0, 1.0], [3.0, 3.0]], [[1.0, 1.0], [2.0, 2.0]]];
/// let (category, mask) = ([1, 2, 4], [2, 1, 1]); // the first would meet category 2 alone
/// let filter = Filter::new().layers(&category, &mask);
/// let mut finder = PairFinder::new();
/// let pairs = finder.find_with(&boxes, None, &filter, Order::Sorted)?;
/// assert_eq!(pairs.to_vec(), [jostle::Pair { a: 0, b: 1 }]);
/// # Ok::<(), jostle::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Filter<'a> {
    layers: [Values<'a>; 2],
    owners: Values<'a>,
    layers_of_second: [Values<'a>; 2],
    owners_of_second: Values<'a>,
    accept: Option<&'a (dyn Fn(u32, u32) -> bool + Sync)>,
    ghosts: u64,
}

impl Default for Filter<'_> {
    fn default() -> Self {
        Filter::new()
    }
}

impl<'a> Filter<'a> {
    /// No owner: see [`Filter::owners`].
    pub const NO_OWNER: u32 = u32::MAX;

    /// All pairs.
    pub fn new() -> Self {
        let none = Values::none();
        Filter {
            layers: [none; 2],
            owners: none,
            layers_of_second: [none; 2],
            owners_of_second: none,
            accept: None,
            ghosts: 0,
        }
    }
    /// Two objects pair if the mask of each has a bit of the other's category.
    pub fn layers(mut self, category: impl Into<Values<'a>>, mask: impl Into<Values<'a>>) -> Self {
        self.layers = [category.into(), mask.into()];
        self
    }
    /// Objects of one owner never pair. [`Filter::NO_OWNER`] is no owner.
    pub fn owners(mut self, owners: impl Into<Values<'a>>) -> Self {
        self.owners = owners.into();
        self
    }
    /// Categories and masks of the second set.
    pub fn layers_of_second(mut self, category: impl Into<Values<'a>>, mask: impl Into<Values<'a>>) -> Self {
        self.layers_of_second = [category.into(), mask.into()];
        self
    }
    /// Owners of the second set.
    pub fn owners_of_second(mut self, owners: impl Into<Values<'a>>) -> Self {
        self.owners_of_second = owners.into();
        self
    }
    /// Is called last, for pairs that touch and pass all other filters, from several threads at a time.
    ///
    /// A panic ends the search and goes on in the call.
    pub fn accept(mut self, accept: &'a (dyn Fn(u32, u32) -> bool + Sync)) -> Self {
        self.accept = Some(accept);
        self
    }
    /// The last so many boxes of one set meet the others, and not each other.
    pub fn ghosts(mut self, ghosts: usize) -> Self {
        self.ghosts = ghosts as u64;
        self
    }
}

/// What stands behind the context of a filter's callback.
struct Accept<'a> {
    accept: &'a (dyn Fn(u32, u32) -> bool + Sync),
    caught: &'a Caught,
}
unsafe extern "C" fn accept(context: *mut c_void, a: u32, b: u32) -> i32 {
    let this = &*(context as *const Accept<'_>);
    this.caught.run(|| (this.accept)(a, b).into())
}

/// Calls with the filter as C has it, and goes on with panics of callbacks.
fn with_filter<R>(
    filter: &Filter<'_>,
    executor: Option<&Executor>,
    inside: impl FnOnce(*const ffi::jostle_filter, &Caught) -> Result<R, Error>,
) -> Result<R, Error> {
    let caught = Caught::default();
    let context = filter.accept.map(|accept| Accept { accept, caught: &caught });
    let raw = ffi::jostle_filter {
        struct_size: std::mem::size_of::<ffi::jostle_filter>() as u64,
        category: filter.layers[0].raw,
        mask: filter.layers[1].raw,
        owner: filter.owners.raw,
        category_b: filter.layers_of_second[0].raw,
        mask_b: filter.layers_of_second[1].raw,
        owner_b: filter.owners_of_second.raw,
        accept: context.as_ref().map(|_| accept as _),
        context: context.as_ref().map_or(null_mut(), |context| context as *const Accept<'_> as *mut c_void),
        ghosts: filter.ghosts,
        vertices: Values::none().raw,
    };
    let result = inside(&raw, &caught);
    if result.is_err() {
        caught.resume();
        if let Some(executor) = executor {
            executor.resume();
        }
    }
    result
}

/// Pairs that lie in what found them, block by block.
#[derive(Clone, Copy)]
pub struct Pairs<'a> {
    raw: ffi::jostle_blocks,
    of: PhantomData<&'a [Pair]>,
}
// SAFETY: it is a shared reference to pairs.
unsafe impl Send for Pairs<'_> {}
unsafe impl Sync for Pairs<'_> {}

impl<'a> Pairs<'a> {
    /// # Safety
    /// The blocks are pairs and stay as they are for `'a`.
    pub(crate) unsafe fn from_raw(raw: ffi::jostle_blocks) -> Self {
        Pairs { raw, of: PhantomData }
    }
    pub(crate) fn none() -> ffi::jostle_blocks {
        ffi::jostle_blocks { blocks: null(), block_count: 0, count: 0, item_size: 0 }
    }
    /// How many there are.
    pub fn len(&self) -> usize {
        self.raw.count as usize
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.raw.count == 0
    }
    /// The pairs as slices, one after another: work for several threads.
    pub fn blocks(&self) -> impl ExactSizeIterator<Item = &'a [Pair]> + Clone {
        // SAFETY: what from_raw was promised. Pair is laid out as jostle_pair.
        unsafe { slice_of(self.raw.blocks, self.raw.block_count) }
            .iter()
            .map(|block| unsafe { slice_of(block.items.cast(), block.count) })
    }
    /// All pairs, in their order.
    pub fn iter(&self) -> PairsIter<'a> {
        PairsIter {
            // SAFETY: as above.
            blocks: unsafe { slice_of(self.raw.blocks, self.raw.block_count) }.iter(),
            here: [].iter(),
            left: self.len(),
        }
    }
    /// A copy as one vector.
    pub fn to_vec(&self) -> Vec<Pair> {
        let mut all = Vec::with_capacity(self.len());
        self.blocks().for_each(|block| all.extend_from_slice(block));
        all
    }
}
impl<'a> IntoIterator for Pairs<'a> {
    type Item = Pair;
    type IntoIter = PairsIter<'a>;
    fn into_iter(self) -> PairsIter<'a> {
        self.iter()
    }
}
impl std::fmt::Debug for Pairs<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_list().entries(self.iter()).finish()
    }
}

/// Iterates over [`Pairs`].
#[derive(Clone)]
pub struct PairsIter<'a> {
    blocks: slice::Iter<'a, ffi::jostle_block>,
    here: slice::Iter<'a, Pair>,
    left: usize,
}
// SAFETY: as of Pairs.
unsafe impl Send for PairsIter<'_> {}
unsafe impl Sync for PairsIter<'_> {}

impl Iterator for PairsIter<'_> {
    type Item = Pair;
    fn next(&mut self) -> Option<Pair> {
        loop {
            if let Some(pair) = self.here.next() {
                self.left -= 1;
                return Some(*pair);
            }
            let block = self.blocks.next()?;
            // SAFETY: a block of Pairs.
            self.here = unsafe { slice_of(block.items.cast::<Pair>(), block.count) }.iter();
        }
    }
    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}
impl ExactSizeIterator for PairsIter<'_> {}

/// A slice of C's, which may be NULL where it is empty.
///
/// # Safety
/// There are so many elements, and they stay as they are for `'a`.
pub(crate) unsafe fn slice_of<'a, T>(first: *const T, count: u64) -> &'a [T] {
    if count == 0 {
        &[]
    } else {
        slice::from_raw_parts(first, count as usize)
    }
}

/// A piece of what a [stream](PairFinder::stream) finds.
#[derive(Clone, Copy, Debug)]
pub struct Chunk<'a> {
    /// The pairs.
    pub pairs: &'a [Pair],
    /// In ascending order of `(block, part)` chunks are in the canonical order.
    pub block: u64,
    /// See `block`.
    pub part: u64,
}

/// Finds all pairs of boxes that touch, from scratch in each call.
///
/// It keeps nothing between calls but memory, so that a steady scene allocates nothing. One call at a time:
/// `find` takes `&mut self`, and pairs lie in the finder for as long as they are borrowed.
///
/// ```
/// let boxes = vec![[[0.0; 3], [2.0; 3]], [[1.0; 3], [3.0; 3]], [[5.0, 0.0, 0.0], [6.0, 1.0, 1.0]]];
/// let mut finder = jostle::PairFinder::new();
/// for pair in finder.find(&boxes)? {
///     println!("box {} touches box {}", pair.a, pair.b);
/// }
/// # assert_eq!(finder.find(&boxes)?.to_vec(), [jostle::Pair { a: 0, b: 1 }]);
/// # Ok::<(), jostle::Error>(())
/// ```
///
/// Pairs can't be kept while the finder searches again:
///
/// ```compile_fail,E0499
/// let boxes = [[[0.0_f32; 3], [1.0; 3]]];
/// let mut finder = jostle::PairFinder::new();
/// let before = finder.find(&boxes).unwrap();
/// let after = finder.find(&boxes).unwrap();
/// println!("{}", before.len());
/// ```
///
/// nor when it is gone:
///
/// ```compile_fail,E0716
/// let boxes = [[[0.0_f32; 3], [1.0; 3]]];
/// let pairs = jostle::PairFinder::new().find(&boxes).unwrap();
/// println!("{}", pairs.len());
/// ```
pub struct PairFinder {
    handle: *mut ffi::jostle_finder,
    executor: Option<Executor>,
}
// SAFETY: it may be used by any thread, one at a time; what is shared, statistics, is read.
unsafe impl Send for PairFinder {}
unsafe impl Sync for PairFinder {}

impl Default for PairFinder {
    fn default() -> Self {
        PairFinder::new()
    }
}
impl Drop for PairFinder {
    fn drop(&mut self) {
        // SAFETY: the handle is ours.
        unsafe { ffi::jostle_free(self.handle.cast(), null_mut()) };
    }
}
impl std::fmt::Debug for PairFinder {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("PairFinder").finish_non_exhaustive()
    }
}

impl PairFinder {
    /// One that works on all cores.
    pub fn new() -> PairFinder {
        PairFinder::made(None)
    }
    /// One that works where the executor says.
    pub fn with_executor(executor: &Executor) -> PairFinder {
        PairFinder::made(Some(executor.clone()))
    }
    fn made(executor: Option<Executor>) -> PairFinder {
        let mut handle = null_mut();
        must(|error| unsafe { ffi::jostle_finder_new(&options(executor.as_ref()), &mut handle, error) });
        PairFinder { handle, executor }
    }

    /// All pairs among the boxes: `a < b`.
    ///
    /// # Errors
    /// A box that is NaN or inverted, by its position.
    pub fn find<'b, T: Coordinate<D>, const D: usize>(
        &mut self,
        boxes: impl Into<Boxes<'b, T, D>>,
    ) -> Result<Pairs<'_>, Error> {
        self.find_with(boxes, None, &Filter::new(), Order::Canonical)
    }
    /// All pairs of a box of the first set and one of the second, such as bullets and targets.
    ///
    /// # Errors
    /// As of [`find`](PairFinder::find).
    pub fn find_between<'b, T: Coordinate<D>, const D: usize>(
        &mut self,
        first: impl Into<Boxes<'b, T, D>>,
        second: impl Into<Boxes<'b, T, D>>,
    ) -> Result<Pairs<'_>, Error> {
        self.find_with(first, Some(second.into()), &Filter::new(), Order::Canonical)
    }
    /// The pairs that the filter wants, in that order.
    ///
    /// # Errors
    /// As of [`find`](PairFinder::find), and values that aren't as many as boxes.
    pub fn find_with<'b, T: Coordinate<D>, const D: usize>(
        &mut self,
        first: impl Into<Boxes<'b, T, D>>,
        second: Option<Boxes<'b, T, D>>,
        filter: &Filter<'_>,
        order: Order,
    ) -> Result<Pairs<'_>, Error> {
        let first = first.into();
        let mut raw = Pairs::none();
        let second = second.as_ref().map_or(null(), |second| &second.raw as *const _);
        with_filter(filter, self.executor.as_ref(), |filter, _| {
            call(|error| unsafe {
                let order = order as ffi::jostle_order;
                ffi::jostle_finder_find(
                    self.handle,
                    T::SPACE,
                    &first.raw,
                    second,
                    filter,
                    order,
                    &mut raw,
                    error,
                )
            })
        })?;
        // SAFETY: they stay until the next call, which takes &mut self.
        Ok(unsafe { Pairs::from_raw(raw) })
    }
    /// Hands the pairs to `sink` as they are found and stores none: for more of them than memory holds.
    ///
    /// `sink` is called from several threads at a time. If it breaks, the search ends; whether it did is the
    /// answer. A panic of it goes on in the call.
    ///
    /// # Errors
    /// As of [`find_with`](PairFinder::find_with).
    pub fn stream<'b, T: Coordinate<D>, const D: usize>(
        &mut self,
        first: impl Into<Boxes<'b, T, D>>,
        second: Option<Boxes<'b, T, D>>,
        filter: &Filter<'_>,
        sink: impl Fn(Chunk<'_>) -> ControlFlow<()> + Sync,
    ) -> Result<ControlFlow<()>, Error> {
        struct Sink<'a, F> {
            sink: &'a F,
            caught: &'a Caught,
        }
        unsafe extern "C" fn take<F: Fn(Chunk<'_>) -> ControlFlow<()> + Sync>(
            context: *mut c_void,
            pairs: *const ffi::jostle_pair,
            count: u64,
            block: u64,
            part: u64,
        ) -> i32 {
            let this = &*(context as *const Sink<'_, F>);
            let chunk = Chunk { pairs: slice_of(pairs.cast(), count), block, part };
            this.caught.run(|| (this.sink)(chunk).is_continue().into())
        }
        fn of<F: Fn(Chunk<'_>) -> ControlFlow<()> + Sync>(_: &F) -> ffi::jostle_sink_function {
            Some(take::<F>)
        }
        let first = first.into();
        let second = second.as_ref().map_or(null(), |second| &second.raw as *const _);
        let mut finished = 0;
        with_filter(filter, self.executor.as_ref(), |filter, caught| {
            let context = Sink { sink: &sink, caught };
            let context = &context as *const Sink<'_, _> as *mut c_void;
            call(|error| unsafe {
                ffi::jostle_finder_stream(
                    self.handle,
                    T::SPACE,
                    &first.raw,
                    second,
                    filter,
                    of(&sink),
                    context,
                    &mut finished,
                    error,
                )
            })
        })?;
        Ok(if finished == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }
    /// Gives working memory back.
    pub fn release_memory(&mut self) {
        must(|error| unsafe { ffi::jostle_release_memory(self.handle.cast(), error) });
    }
}

/// All pairs among the boxes, once. Who searches again keeps a [`PairFinder`].
///
/// # Errors
/// As of [`PairFinder::find`].
pub fn find_pairs<'b, T: Coordinate<D>, const D: usize>(
    boxes: impl Into<Boxes<'b, T, D>>,
) -> Result<Vec<Pair>, Error> {
    Ok(PairFinder::new().find(boxes)?.to_vec())
}

/// The definition: every box against every other, ascending by `(a, b)`. For checking results.
///
/// # Errors
/// As of [`PairFinder::find_with`].
pub fn find_pairs_brute_force<'b, T: Coordinate<D>, const D: usize>(
    first: impl Into<Boxes<'b, T, D>>,
    second: Option<Boxes<'b, T, D>>,
    filter: &Filter<'_>,
) -> Result<Vec<Pair>, Error> {
    let first = first.into();
    let second = second.as_ref().map_or(null(), |second| &second.raw as *const _);
    let results = Results::new();
    with_filter(filter, None, |filter, _| {
        call(|error| unsafe {
            ffi::jostle_find_pairs_brute_force(T::SPACE, &first.raw, second, filter, results.raw(), error)
        })
    })?;
    Ok(results.pairs().to_vec())
}

/// What a call found and we own.
pub(crate) struct Results(*mut ffi::jostle_results);

impl Results {
    pub(crate) fn new() -> Results {
        let mut handle = null_mut();
        must(|error| unsafe { ffi::jostle_results_new(null(), &mut handle, error) });
        Results(handle)
    }
    pub(crate) fn raw(&self) -> *mut ffi::jostle_results {
        self.0
    }
    pub(crate) fn pairs(&self) -> Pairs<'_> {
        let mut raw = Pairs::none();
        must(|error| unsafe { ffi::jostle_results_blocks(self.0, &mut raw, error) });
        // SAFETY: they stay as long as these results aren't filled again.
        unsafe { Pairs::from_raw(raw) }
    }
}
impl Drop for Results {
    fn drop(&mut self) {
        // SAFETY: the handle is ours.
        unsafe { ffi::jostle_free(self.0.cast(), null_mut()) };
    }
}
