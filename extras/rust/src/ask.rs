// SPDX-License-Identifier: MIT
use std::ffi::c_void;
use std::marker::PhantomData;
use std::mem::size_of;
use std::num::NonZeroU64;
use std::ops::ControlFlow;
use std::ptr::{null, null_mut};

use crate::boxes::{Aabb, Coordinate, Values};
use crate::error::{call, must, Caught, Error};
use crate::executor::Executor;
use crate::ffi;
use crate::pairs::{slice_of, Results};

/// Names an object of a [`World`](crate::World), for ever: after the object is gone it names nothing, and
/// calls that are given it are [`ErrorKind::StaleId`](crate::ErrorKind::StaleId).
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(NonZeroU64);

impl Id {
    /// The place of the object: less than [`World::index_end`](crate::World::index_end), and used again after
    /// it is gone. Good for arrays with one element per object.
    pub fn index(self) -> u32 {
        self.0.get() as u32
    }
    /// How often the index had been used before.
    pub fn generation(self) -> u32 {
        (self.0.get() >> 32) as u32
    }
    /// As a number, for what is saved or sent.
    pub fn to_bits(self) -> u64 {
        self.0.get()
    }
    /// The id whose number that is. 0 is none; one that names nothing does no harm.
    pub fn from_bits(bits: u64) -> Option<Id> {
        NonZeroU64::new(bits).map(Id)
    }
}
impl std::fmt::Debug for Id {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Id({}, generation {})", self.index(), self.generation())
    }
}

mod sealed {
    pub trait Sealed {}
}
use sealed::Sealed;

/// How objects are named: by [`Id`] in a world, by `u32` in an index.
pub trait Named: Sealed + Copy + Send + Sync {
    #[doc(hidden)]
    fn from_c(name: u64) -> Option<Self>;
    #[doc(hidden)]
    fn to_c(self) -> u64;
}
impl Sealed for Id {}
impl Named for Id {
    fn from_c(name: u64) -> Option<Id> {
        Id::from_bits(name)
    }
    fn to_c(self) -> u64 {
        self.to_bits()
    }
}
impl Sealed for u32 {}
impl Named for u32 {
    fn from_c(name: u64) -> Option<u32> {
        name.try_into().ok()
    }
    fn to_c(self) -> u64 {
        self.into()
    }
}

/// A ray from `origin` to `origin + max_fraction * direction`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<T, const D: usize> {
    /// Where it begins.
    pub origin: [T; D],
    /// Of any length: [`Hit::at`] counts in it.
    pub direction: [T; D],
    /// The greatest fraction; infinity is no end.
    pub max_fraction: T,
}
impl<T: Coordinate<D>, const D: usize> Ray<T, D> {
    /// A ray without end.
    pub fn new(origin: [T; D], direction: [T; D]) -> Self {
        Ray { origin, direction, max_fraction: T::INFINITY }
    }
}
/// A box that moves from where it is by `max_fraction * motion`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep<T, const D: usize> {
    /// Where it begins.
    pub aabb: Aabb<T, D>,
    /// Where to.
    pub motion: [T; D],
    /// The greatest fraction of it, usually 1.
    pub max_fraction: T,
}
impl<T: Coordinate<D>, const D: usize> Sweep<T, D> {
    /// The whole of a motion.
    pub fn new(aabb: impl Into<Aabb<T, D>>, motion: [T; D]) -> Self {
        Sweep { aabb: aabb.into(), motion, max_fraction: T::ONE }
    }
}
/// All points within a radius: in 2D a disc.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere<T, const D: usize> {
    /// Its center.
    pub center: [T; D],
    /// How far it reaches.
    pub radius: T,
}
/// All points `p` with `normal . p + offset >= 0`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<T, const D: usize> {
    /// Points to the inside.
    pub normal: [T; D],
    /// See above.
    pub offset: T,
}
/// The space on the inner side of some planes, such as what a camera sees.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Frustum<'a, T, const D: usize> {
    raw: ffi::jostle_frustum,
    of: PhantomData<&'a [Plane<T, D>]>,
}
// SAFETY: it is a shared reference to planes.
unsafe impl<T: Sync, const D: usize> Send for Frustum<'_, T, D> {}
unsafe impl<T: Sync, const D: usize> Sync for Frustum<'_, T, D> {}
impl<'a, T, const D: usize> Frustum<'a, T, D> {
    /// Between these planes.
    pub fn new(planes: &'a [Plane<T, D>]) -> Self {
        Frustum {
            raw: ffi::jostle_frustum { planes: planes.as_ptr().cast(), count: planes.len() as u64 },
            of: PhantomData,
        }
    }
}
/// What is near a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest<T, const D: usize> {
    /// The point.
    pub point: [T; D],
    /// How far is looked; infinity is no end.
    pub max_distance: T,
}
impl<T: Coordinate<D>, const D: usize> Nearest<T, D> {
    /// However far.
    pub fn new(point: [T; D]) -> Self {
        Nearest { point, max_distance: T::INFINITY }
    }
}
/// What is near a box.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestToBox<T, const D: usize> {
    /// The box.
    pub aabb: Aabb<T, D>,
    /// How far is looked; infinity is no end.
    pub max_distance: T,
}

/// An object found along a ray or sweep, or near something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<I> {
    /// The object.
    pub id: I,
    /// The fraction of the direction or motion; of the nearest the squared distance.
    pub at: f64,
}

/// What can be asked of boxes that are named by `I`.
pub trait Query<T, const D: usize, I>: Sealed {
    /// What is found: an id, or a [`Hit`] where answers have an order.
    type Answer;
    #[doc(hidden)]
    const KIND: ffi::jostle_query_kind;
    #[doc(hidden)]
    fn answer(id: I, at: f64) -> Self::Answer;
}
/// A query about what touches something: any, count, all, visit.
pub trait Overlap<T, const D: usize, I>: Query<T, D, I> {}
/// A query along a way, which meets something first.
pub trait Line<T, const D: usize, I>: Overlap<T, D, I> {}
/// A query about what is nearest.
pub trait Near<T, const D: usize, I>: Query<T, D, I> {}

macro_rules! query {
    ($type:ty, $kind:ident, hit $(, $role:ident)*) => {
        impl<T, const D: usize> Sealed for $type {}
        impl<T, const D: usize, I> Query<T, D, I> for $type {
            type Answer = Hit<I>;
            const KIND: ffi::jostle_query_kind = ffi::$kind;
            fn answer(id: I, at: f64) -> Hit<I> {
                Hit { id, at }
            }
        }
        $(impl<T, const D: usize, I> $role<T, D, I> for $type {})*
    };
    ($type:ty, $kind:ident, id $(, $role:ident)*) => {
        impl<T, const D: usize> Sealed for $type {}
        impl<T, const D: usize, I> Query<T, D, I> for $type {
            type Answer = I;
            const KIND: ffi::jostle_query_kind = ffi::$kind;
            fn answer(id: I, _: f64) -> I {
                id
            }
        }
        $(impl<T, const D: usize, I> $role<T, D, I> for $type {})*
    };
}
query!(Ray<T, D>, JOSTLE_RAY, hit, Overlap, Line);
query!(Sweep<T, D>, JOSTLE_SWEEP, hit, Overlap, Line);
query!(Aabb<T, D>, JOSTLE_BOX, id, Overlap);
query!(Sphere<T, D>, JOSTLE_SPHERE, id, Overlap);
query!(Frustum<'_, T, D>, JOSTLE_FRUSTUM, id, Overlap);
query!(Nearest<T, D>, JOSTLE_NEAREST, hit, Near);
query!(NearestToBox<T, D>, JOSTLE_NEAREST_TO_BOX, hit, Near);

/// The answers to many queries.
#[derive(Clone, Debug, PartialEq)]
pub struct Lists<A> {
    first: Vec<usize>,
    answers: Vec<A>,
}
impl<A> Lists<A> {
    /// How many queries there were.
    pub fn len(&self) -> usize {
        self.first.len() - 1
    }
    /// Whether there were none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The answers to each query, in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[A]> {
        self.first.windows(2).map(|ends| &self.answers[ends[0]..ends[1]])
    }
    /// All answers, those to one query behind those to the one before.
    pub fn answers(&self) -> &[A] {
        &self.answers
    }
}
impl<A> std::ops::Index<usize> for Lists<A> {
    type Output = [A];
    fn index(&self, query: usize) -> &[A] {
        &self.answers[self.first[query]..self.first[query + 1]]
    }
}

/// Asks a [`World`](crate::World) or a [`BoxIndex`](crate::BoxIndex): first about whom, then one of the
/// verbs.
///
/// One query is answered on the calling thread, many (those of `..._each`) on the executor. Any number of
/// threads may ask at a time.
///
/// ```
/// use jostle::{Aabb, Ray, World3f};
/// let mut world = World3f::new();
/// let me = world.add([[0.0; 3], [1.0; 3]])?;
/// let wall = world.add([[5.0, 0.0, 0.0], [6.0, 9.0, 9.0]])?;
/// world.update()?;
/// let ray = Ray::new([0.5; 3], [1.0, 0.0, 0.0]);
/// let hit = world.ask().exclude(me).first(&ray)?.unwrap();
/// assert_eq!((hit.id, hit.at), (wall, 4.5));
/// assert_eq!(world.ask().all(&Aabb::new([0.0; 3], [9.0; 3]))?.len(), 2);
/// # Ok::<(), jostle::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Ask<'a, I, T, const D: usize> {
    target: *const c_void, // a world or an index
    executor: Option<&'a Executor>,
    objects: [Values<'a>; 3], // category, mask, owner
    asker: ffi::jostle_asker,
    exclude: Option<I>,
    accept: Option<&'a (dyn Fn(u32, I) -> bool + Sync)>,
    at_most: u64,
    of: PhantomData<&'a T>,
}

/// What stands behind the context of a callback.
struct Accept<'a, I> {
    accept: &'a (dyn Fn(u32, I) -> bool + Sync),
    caught: &'a Caught,
}
unsafe extern "C" fn accept<I: Named>(context: *mut c_void, query: u32, id: u64) -> i32 {
    let this = &*(context as *const Accept<'_, I>);
    this.caught.run(|| I::from_c(id).map_or(false, |id| (this.accept)(query, id)).into())
}

impl<'a, I: Named, T: Coordinate<D>, const D: usize> Ask<'a, I, T, D> {
    pub(crate) fn new(target: *const c_void, executor: Option<&'a Executor>) -> Self {
        Ask {
            target,
            executor,
            objects: [Values::none(); 3],
            asker: ffi::jostle_asker { category: u32::MAX, mask: u32::MAX, owner: u32::MAX },
            exclude: None,
            accept: None,
            at_most: u64::MAX,
            of: PhantomData,
        }
    }

    /// About objects alone with whom one of this category and mask would pair.
    pub fn layers(mut self, category: u32, mask: u32) -> Self {
        (self.asker.category, self.asker.mask) = (category, mask);
        self
    }
    /// Not about objects of this owner.
    pub fn not_of_owner(mut self, owner: u32) -> Self {
        self.asker.owner = owner;
        self
    }
    /// Not about this object.
    pub fn exclude(mut self, id: I) -> Self {
        self.exclude = Some(id);
        self
    }
    /// About objects alone that `accept(query, id)` lets through; `query` is the position among many. It is
    /// asked last, of many queries from several threads at a time. A panic goes on in the call.
    pub fn accept(mut self, accept: &'a (dyn Fn(u32, I) -> bool + Sync)) -> Self {
        self.accept = Some(accept);
        self
    }
    /// `all` gives no more than so many answers to each query.
    pub fn at_most(mut self, answers: usize) -> Self {
        self.at_most = answers as u64;
        self
    }

    /// Whether there is any answer.
    ///
    /// # Errors
    /// These and the others: a query that is NaN or inverted, by its position; and an `exclude` that names no
    /// object is none.
    pub fn any(&self, query: &impl Overlap<T, D, I>) -> Result<bool, Error> {
        let mut any = 0;
        self.ask(std::slice::from_ref(query), 0, |target, queries, filter, error| unsafe {
            ffi::jostle_query_any(target, queries, null(), filter, &mut any, error)
        })?;
        Ok(any != 0)
    }
    /// The same of many.
    ///
    /// # Errors
    /// As of `any`.
    pub fn any_each<Q: Overlap<T, D, I>>(&self, queries: &[Q]) -> Result<Vec<bool>, Error> {
        let mut any = vec![0; queries.len()];
        let out = any.as_mut_ptr();
        self.ask(queries, 0, |target, queries, filter, error| unsafe {
            ffi::jostle_query_any(target, queries, null(), filter, out, error)
        })?;
        Ok(any.into_iter().map(|any| any != 0).collect())
    }
    /// How many answers there are.
    ///
    /// # Errors
    /// As of `any`.
    pub fn count(&self, query: &impl Overlap<T, D, I>) -> Result<u64, Error> {
        Ok(self.count_each(std::slice::from_ref(query))?[0])
    }
    /// The same of many.
    ///
    /// # Errors
    /// As of `any`.
    pub fn count_each<Q: Overlap<T, D, I>>(&self, queries: &[Q]) -> Result<Vec<u64>, Error> {
        let mut counts = vec![0; queries.len()];
        let out = counts.as_mut_ptr();
        self.ask(queries, 0, |target, queries, filter, error| unsafe {
            ffi::jostle_query_count(target, queries, null(), filter, out, error)
        })?;
        Ok(counts)
    }
    /// What a ray or sweep meets first.
    ///
    /// # Errors
    /// As of `any`.
    pub fn first(&self, query: &impl Line<T, D, I>) -> Result<Option<Hit<I>>, Error> {
        let mut hit = [nothing()];
        self.hits(std::slice::from_ref(query), &mut hit)?;
        Ok(hit_of(&hit[0]))
    }
    /// The same of many.
    ///
    /// # Errors
    /// As of `any`.
    pub fn first_each<Q: Line<T, D, I>>(&self, queries: &[Q]) -> Result<Vec<Option<Hit<I>>>, Error> {
        let mut hits = vec![nothing(); queries.len()];
        self.hits(queries, &mut hits)?;
        Ok(hits.iter().map(hit_of).collect())
    }
    /// The nearest object.
    ///
    /// # Errors
    /// As of `any`.
    pub fn nearest(&self, query: &impl Near<T, D, I>) -> Result<Option<Hit<I>>, Error> {
        let mut hit = [nothing()];
        self.hits(std::slice::from_ref(query), &mut hit)?;
        Ok(hit_of(&hit[0]))
    }
    /// The same of many.
    ///
    /// # Errors
    /// As of `any`.
    pub fn nearest_each<Q: Near<T, D, I>>(&self, queries: &[Q]) -> Result<Vec<Option<Hit<I>>>, Error> {
        let mut hits = vec![nothing(); queries.len()];
        self.hits(queries, &mut hits)?;
        Ok(hits.iter().map(hit_of).collect())
    }
    /// The `k` nearest objects, the nearest first.
    ///
    /// # Errors
    /// As of `any`.
    pub fn k_nearest(&self, query: &impl Near<T, D, I>, k: u32) -> Result<Vec<Hit<I>>, Error> {
        if k == 0 {
            return Ok(Vec::new()); // which in C would be one
        }
        let lists = self.lists(std::slice::from_ref(query), k)?;
        Ok(lists.answers.into_iter().map(|(id, at)| Hit { id, at }).collect())
    }
    /// All answers: along rays and sweeps as they are met, else ascending by id.
    ///
    /// # Errors
    /// As of `any`.
    pub fn all<Q: Overlap<T, D, I>>(&self, query: &Q) -> Result<Vec<Q::Answer>, Error> {
        Ok(self.all_each(std::slice::from_ref(query))?.answers)
    }
    /// The same of many.
    ///
    /// # Errors
    /// As of `any`.
    pub fn all_each<Q: Overlap<T, D, I>>(&self, queries: &[Q]) -> Result<Lists<Q::Answer>, Error> {
        let lists = self.lists(queries, 0)?;
        let answers = lists.answers.into_iter().map(|(id, at)| Q::answer(id, at)).collect();
        Ok(Lists { first: lists.first, answers })
    }
    /// Hands the answers over one by one, without memory for them, until `visit` breaks: along a line and
    /// near something as in `all`, those in a region in no order to rely on. Whether it broke is the answer.
    /// A panic goes on in the call.
    ///
    /// # Errors
    /// As of `any`.
    pub fn visit<Q: Query<T, D, I>>(
        &self,
        query: &Q,
        visit: impl FnMut(Q::Answer) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Error> {
        struct Visit<F, Q> {
            visit: F,
            caught: Caught,
            of: PhantomData<Q>,
        }
        unsafe extern "C" fn take<
            I: Named,
            Q: Query<T, D, I>,
            F: FnMut(Q::Answer) -> ControlFlow<()>,
            T,
            const D: usize,
        >(
            context: *mut c_void,
            id: u64,
            at: f64,
            _: *const c_void,
            _: *mut f64,
        ) -> i32 {
            let Visit { visit, caught, .. } = &mut *(context as *mut Visit<F, Q>);
            caught.run(|| match I::from_c(id) {
                Some(id) => visit(Q::answer(id, at)).is_continue().into(),
                None => 1,
            })
        }
        fn of<I: Named, Q: Query<T, D, I>, F: FnMut(Q::Answer) -> ControlFlow<()>, T, const D: usize>(
            _: &Visit<F, Q>,
        ) -> ffi::jostle_visit_answer_function {
            Some(take::<I, Q, F, T, D>)
        }
        let mut visit = Visit::<_, Q> { visit, caught: Caught::default(), of: PhantomData };
        let function = of::<I, Q, _, T, D>(&visit);
        let context = &mut visit as *mut Visit<_, Q> as *mut c_void;
        let mut finished = 0;
        let result = self.ask(std::slice::from_ref(query), u32::MAX, |target, query, filter, error| unsafe {
            ffi::jostle_query_visit(target, query, null(), filter, function, context, &mut finished, error)
        });
        visit.caught.resume();
        result?;
        Ok(if finished == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    fn hits<Q: Query<T, D, I>>(&self, queries: &[Q], hits: &mut [ffi::jostle_hit]) -> Result<(), Error> {
        self.ask(queries, 0, |target, queries, filter, error| unsafe {
            ffi::jostle_query_first(target, queries, null(), filter, hits.as_mut_ptr(), null_mut(), error)
        })
    }
    fn lists<Q: Query<T, D, I>>(&self, queries: &[Q], nearest: u32) -> Result<Lists<(I, f64)>, Error> {
        let results = Results::new();
        self.ask(queries, nearest, |target, queries, filter, error| unsafe {
            ffi::jostle_query_all(target, queries, null(), filter, self.at_most, results.raw(), error)
        })?;
        let mut raw = std::mem::MaybeUninit::uninit();
        must(|error| unsafe { ffi::jostle_results_lists(results.raw(), raw.as_mut_ptr(), error) });
        // SAFETY: the call that succeeded filled it in; its lists stay as long as the results.
        let (first, ids, at) = unsafe {
            let raw: ffi::jostle_lists = raw.assume_init();
            let at: &[f64] = if raw.at.is_null() { &[] } else { slice_of(raw.at, raw.count) };
            (slice_of(raw.first, raw.queries + 1), slice_of(raw.ids, raw.count), at)
        };
        let answers = ids.iter().enumerate().map(|(i, id)| {
            let id = I::from_c(*id).expect("an answer has an id");
            (id, at.get(i).copied().unwrap_or(0.0))
        });
        Ok(Lists { first: first.iter().map(|first| *first as usize).collect(), answers: answers.collect() })
    }
    /// Calls with queries and filter as C has them, and goes on with panics of callbacks.
    fn ask<Q: Query<T, D, I>>(
        &self,
        queries: &[Q],
        nearest: u32,
        inside: impl FnOnce(
            *const c_void,
            *const ffi::jostle_queries,
            *const ffi::jostle_query_filter,
            *mut ffi::jostle_error,
        ) -> ffi::jostle_status,
    ) -> Result<(), Error> {
        // Queries are laid out as in C.
        let queries = ffi::jostle_queries {
            kind: Q::KIND,
            nearest,
            values: ffi::jostle_values {
                data: queries.as_ptr().cast(),
                count: queries.len() as u64,
                stride: size_of::<Q>() as i64,
            },
            shapes: null(),
        };
        let caught = Caught::default();
        let context = self.accept.map(|accept| Accept { accept, caught: &caught });
        let exclude = self.exclude.map(Named::to_c);
        let filter = ffi::jostle_query_filter {
            struct_size: size_of::<ffi::jostle_query_filter>() as u64,
            category: self.objects[0].raw,
            mask: self.objects[1].raw,
            owner: self.objects[2].raw,
            asker: &self.asker,
            exclude: exclude.as_ref().map_or(null(), |id| id as *const u64),
            accept: context.as_ref().map(|_| accept::<I> as _),
            context: context
                .as_ref()
                .map_or(null_mut(), |context| context as *const Accept<'_, I> as *mut c_void),
            count: 0,
        };
        let result = call(|error| inside(self.target, &queries, &filter, error));
        if result.is_err() {
            caught.resume();
            if let Some(executor) = self.executor {
                executor.resume();
            }
        }
        result
    }
}

impl<'a, T: Coordinate<D>, const D: usize> Ask<'a, u32, T, D> {
    /// The categories and masks of the objects by their ids, for [`layers`](Ask::layers).
    pub fn layers_of_objects(mut self, category: impl Into<Values<'a>>, mask: impl Into<Values<'a>>) -> Self {
        [self.objects[0], self.objects[1]] = [category.into(), mask.into()];
        self
    }
    /// The owners of the objects by their ids, for [`not_of_owner`](Ask::not_of_owner).
    pub fn owners_of_objects(mut self, owners: impl Into<Values<'a>>) -> Self {
        self.objects[2] = owners.into();
        self
    }
}

fn nothing() -> ffi::jostle_hit {
    ffi::jostle_hit { id: 0, at: 0.0 }
}
/// An index has an object 0, and says `u64::MAX` where there is none; a world says 0.
fn hit_of<I: Named>(hit: &ffi::jostle_hit) -> Option<Hit<I>> {
    I::from_c(hit.id).map(|id| Hit { id, at: hit.at })
}
