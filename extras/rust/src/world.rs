// SPDX-License-Identifier: MIT
use std::ffi::c_void;
use std::marker::PhantomData;
use std::mem::{size_of, MaybeUninit};
use std::ptr::{null, null_mut};
use std::sync::Arc;

use crate::ask::{Ask, Id, Named};
use crate::boxes::{as_many, Aabb, Boxes, Coordinate};
use crate::error::{call, must, Caught, Error};
use crate::executor::{options, Executor};
use crate::ffi;
use crate::pairs::{slice_of, Pair, Pairs, Results};

/// Two objects of a world. The index of `a` is less than that of `b`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct IdPair {
    /// The one with the lower index.
    pub a: Id,
    /// The other one.
    pub b: Id,
}

/// Why a pair ended.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum EndReason {
    /// The boxes touch no more.
    MovedApart = ffi::JOSTLE_MOVED_APART,
    /// One of the objects is gone; its id names nothing any more.
    Removed = ffi::JOSTLE_REMOVED,
    /// One of the objects was disabled.
    Disabled = ffi::JOSTLE_DISABLED,
    /// The boxes touch, but a filter or `accept` is against it now.
    Filtered = ffi::JOSTLE_FILTERED,
}

/// A pair that touches no more.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EndedPair {
    /// The one with the lower index.
    pub a: Id,
    /// The other one.
    pub b: Id,
    /// Why it ended.
    pub reason: EndReason,
    reserved: i32,
}

/// Whom an object pairs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ObjectFilter {
    /// Two objects pair if the mask of each has a bit of the other's category.
    pub category: u32,
    /// See `category`.
    pub mask: u32,
    /// Objects of one owner never pair; `u32::MAX` is no owner.
    pub owner: u32,
    /// Never pairs with static ones.
    pub is_static: bool,
}
impl Default for ObjectFilter {
    /// Pairs with all.
    fn default() -> Self {
        ObjectFilter { category: 1, mask: u32::MAX, owner: u32::MAX, is_static: false }
    }
}
impl ObjectFilter {
    fn raw(self) -> ffi::jostle_object_filter {
        ffi::jostle_object_filter {
            category: self.category,
            mask: self.mask,
            owner: self.owner,
            is_static: self.is_static.into(),
        }
    }
}

/// What new objects are like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectOptions {
    /// Whom they pair with.
    pub filter: ObjectFilter,
    /// Added to every side of their boxes, on top of the world's.
    pub margin: f64,
    /// They keep their ids and boxes, and touch nothing.
    pub disabled: bool,
    /// Your own: see [`World::user_data`].
    pub user_data: u64,
}
/// One for all objects, where there may be one for each.
impl AsRef<[ObjectOptions]> for ObjectOptions {
    fn as_ref(&self) -> &[ObjectOptions] {
        std::slice::from_ref(self)
    }
}

/// What a world is made with.
///
/// ```
/// let options = jostle::WorldOptions::new().margin(0.1).accept(|a, b| (a.index() + b.index()) % 2 == 1);
/// let world = jostle::World2f::with_options(options)?;
/// # Ok::<(), jostle::Error>(())
/// ```
#[derive(Clone, Default)]
pub struct WorldOptions {
    margin: f64,
    executor: Option<Executor>,
    layers: Vec<ffi::jostle_query_layer>,
    accept: Option<Arc<Accept>>,
}
struct Accept {
    accept: Box<dyn Fn(Id, Id) -> bool + Send + Sync>,
    caught: Caught,
}
impl WorldOptions {
    /// On all cores, without margin.
    pub fn new() -> Self {
        WorldOptions::default()
    }
    /// Added to every side of every box: pairs begin before boxes touch.
    pub fn margin(mut self, margin: f64) -> Self {
        self.margin = margin;
        self
    }
    /// Where work runs.
    pub fn executor(mut self, executor: &Executor) -> Self {
        self.executor = Some(executor.clone());
        self
    }
    /// For queries about a few of many objects: those that ask with this category and mask have an index of
    /// their own. Up to 8 times. No answer depends on it.
    pub fn layer(mut self, category: u32, mask: u32) -> Self {
        self.layers.push(ffi::jostle_query_layer { category, mask });
        self
    }
    /// Is called once for each pair that would begin, in [`update`](World::update) on its thread, in
    /// ascending order of the pairs. A panic leaves the world unchanged and continues in the call.
    pub fn accept(mut self, accept: impl Fn(Id, Id) -> bool + Send + Sync + 'static) -> Self {
        self.accept = Some(Arc::new(Accept { accept: Box::new(accept), caught: Caught::default() }));
        self
    }
}
unsafe extern "C" fn accept(context: *mut c_void, a: u64, b: u64) -> i32 {
    let this = &*(context as *const Accept);
    this.caught.run(|| match (Id::from_c(a), Id::from_c(b)) {
        (Some(a), Some(b)) => (this.accept)(a, b).into(),
        _ => 0,
    })
}

/// A world of `f32` in 3D.
pub type World3f = World<f32, 3>;
/// A world of `f32` in 2D.
pub type World2f = World<f32, 2>;
/// A world of `f64` in 3D.
pub type World3d = World<f64, 3>;
/// A world of `f64` in 2D.
pub type World2d = World<f64, 2>;

/// Objects that live, move and rest, and the pairs between them: which began, persist and ended.
///
/// What is done to objects is queued, from any thread, and takes effect, all at once, in the next
/// [`update`](World::update). Objects at rest cost nothing.
///
/// ```
/// let mut world = jostle::World3f::new();
/// let door = world.add([[0.0; 3], [1.0; 3]])?;
/// let player = world.add([[5.0; 3], [6.0; 3]])?;
/// world.update()?;
/// assert!(world.began().is_empty());
///
/// world.move_to(player, [[0.5; 3], [1.5; 3]])?;
/// world.update()?;
/// for pair in world.began() {
///     println!("{:?} touches {:?}", pair.a, pair.b);
/// }
/// assert_eq!(world.began(), [jostle::IdPair { a: door, b: player }]);
/// # Ok::<(), jostle::Error>(())
/// ```
///
/// Lists of pairs can't be kept over an update:
///
/// ```compile_fail,E0502
/// let mut world = jostle::World3f::new();
/// let began = world.began();
/// world.update().unwrap();
/// println!("{}", began.len());
/// ```
///
/// and no query runs while a world is updated:
///
/// ```compile_fail,E0502
/// let mut world = jostle::World3f::new();
/// std::thread::scope(|scope| {
///     scope.spawn(|| world.ask().any(&jostle::Aabb::new([0.0; 3], [1.0; 3])));
///     world.update().unwrap();
/// });
/// ```
pub struct World<T: Coordinate<D>, const D: usize> {
    handle: *mut ffi::jostle_world,
    executor: Option<Executor>,
    accept: Option<Arc<Accept>>,
    of: PhantomData<T>,
}
// SAFETY: commands may come from any number of threads, and all that reads may be called by any number of
// them while nothing changes the world: that takes &mut self.
unsafe impl<T: Coordinate<D>, const D: usize> Send for World<T, D> {}
unsafe impl<T: Coordinate<D>, const D: usize> Sync for World<T, D> {}

impl<T: Coordinate<D>, const D: usize> Drop for World<T, D> {
    fn drop(&mut self) {
        // SAFETY: the handle is ours.
        unsafe { ffi::jostle_free(self.handle.cast(), null_mut()) };
    }
}
impl<T: Coordinate<D>, const D: usize> Default for World<T, D> {
    fn default() -> Self {
        World::new()
    }
}
impl<T: Coordinate<D>, const D: usize> std::fmt::Debug for World<T, D> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("World").field("len", &self.len()).finish_non_exhaustive()
    }
}

impl<T: Coordinate<D>, const D: usize> World<T, D> {
    /// An empty world that works on all cores.
    pub fn new() -> Self {
        World::with_options(WorldOptions::new()).unwrap_or_else(|error| panic!("{error}"))
    }
    /// An empty world.
    ///
    /// # Errors
    /// A margin that is negative, infinite or NaN; more than 8 layers.
    pub fn with_options(given: WorldOptions) -> Result<Self, Error> {
        let common = options(given.executor.as_ref());
        let raw = ffi::jostle_world_options {
            struct_size: size_of::<ffi::jostle_world_options>() as u64,
            common: &common,
            margin: given.margin,
            accept: given.accept.as_ref().map(|_| accept as _),
            context: given.accept.as_ref().map_or(null_mut(), |accept| Arc::as_ptr(accept) as *mut c_void),
            layers: given.layers.as_ptr(),
            layer_count: given.layers.len() as u64,
        };
        let mut handle = null_mut();
        call(|error| unsafe { ffi::jostle_world_new(T::SPACE, &raw, &mut handle, error) })?;
        Ok(World { handle, executor: given.executor, accept: given.accept, of: PhantomData })
    }

    // --- Commands ---

    /// A new object. Its id is good at once.
    ///
    /// # Errors
    /// A box that is NaN or inverted. So with all that takes boxes.
    pub fn add(&self, aabb: impl Into<Aabb<T, D>>) -> Result<Id, Error> {
        Ok(self.add_many(&[aabb.into()])?[0])
    }
    /// A new object for each box: all or none.
    ///
    /// # Errors
    /// As of `add`.
    pub fn add_many<'b>(&self, boxes: impl Into<Boxes<'b, T, D>>) -> Result<Vec<Id>, Error> {
        self.add_with(boxes, &[] as &[ObjectOptions])
    }
    /// The same with a filter and so on: `&options` for all of them, or a slice with one for each, or with
    /// none.
    ///
    /// # Errors
    /// As of `add`, and a margin that is negative, infinite or NaN; a slice of any other length.
    pub fn add_with<'b>(
        &self,
        boxes: impl Into<Boxes<'b, T, D>>,
        given: impl AsRef<[ObjectOptions]>,
    ) -> Result<Vec<Id>, Error> {
        let boxes = boxes.into();
        let given = given.as_ref();
        let filters: Vec<_> = given.iter().map(|each| each.filter.raw()).collect();
        let options: Vec<_> = given
            .iter()
            .zip(&filters)
            .map(|(each, filter)| ffi::jostle_object_options {
                struct_size: size_of::<ffi::jostle_object_options>() as u64,
                filter,
                margin: each.margin,
                disabled: each.disabled.into(),
                user_data: each.user_data,
                count: given.len() as u64,
            })
            .collect();
        let first = if options.is_empty() { std::ptr::null() } else { options.as_ptr() };
        let mut ids: Vec<Id> = Vec::with_capacity(boxes.len());
        call(|error| unsafe {
            ffi::jostle_world_add(self.handle, &boxes.raw, first, ids.as_mut_ptr().cast(), error)
        })?;
        // SAFETY: so many were written, and none is 0.
        unsafe { ids.set_len(boxes.len()) };
        Ok(ids)
    }
    /// The object is gone from the next update on, and its pairs end.
    ///
    /// # Errors
    /// [`ErrorKind::StaleId`](crate::ErrorKind::StaleId) where the id names no object. So with all that takes
    /// ids.
    pub fn remove(&self, id: Id) -> Result<(), Error> {
        self.remove_many(&[id])
    }
    /// The same of many: all or none.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn remove_many(&self, ids: &[Id]) -> Result<(), Error> {
        call(|error| unsafe { ffi::jostle_world_remove(self.handle, raw(ids), ids.len() as u64, error) })
    }
    /// Gives an object another box.
    ///
    /// # Errors
    /// As of `add` and `remove`.
    pub fn move_to(&self, id: Id, aabb: impl Into<Aabb<T, D>>) -> Result<(), Error> {
        self.move_many(&[id], &[aabb.into()])
    }
    /// The same of many: all or none.
    ///
    /// # Errors
    /// As of `move_to`, and if there aren't as many boxes as ids.
    pub fn move_many<'b>(&self, ids: &[Id], boxes: impl Into<Boxes<'b, T, D>>) -> Result<(), Error> {
        let boxes = as_many(ids, boxes.into())?;
        call(|error| unsafe { ffi::jostle_world_move(self.handle, raw(ids), &boxes.raw, null(), 0, error) })
    }
    /// The same, and during the coming step the object moves on by that much: it touches what lies on its
    /// way.
    ///
    /// # Errors
    /// As of `move_to`; a displacement that is NaN or infinite.
    pub fn move_along(&self, id: Id, aabb: impl Into<Aabb<T, D>>, displacement: [T; D]) -> Result<(), Error> {
        let aabb = [aabb.into()];
        let boxes = Boxes::from(&aabb);
        call(|error| unsafe {
            ffi::jostle_world_move(
                self.handle,
                raw(&[id]),
                &boxes.raw,
                displacement.as_ptr().cast(),
                0,
                error,
            )
        })
    }
    /// New edge lengths, the same center.
    ///
    /// # Errors
    /// As of `remove`; a length that is negative or NaN.
    pub fn resize(&self, id: Id, size: [T; D]) -> Result<(), Error> {
        call(|error| unsafe {
            ffi::jostle_world_resize(self.handle, raw(&[id]), 1, size.as_ptr().cast(), 0, error)
        })
    }
    /// Another filter.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn set_filter(&self, id: Id, filter: ObjectFilter) -> Result<(), Error> {
        call(|error| unsafe {
            ffi::jostle_world_set_filter(self.handle, raw(&[id]), 1, &filter.raw(), 0, error)
        })
    }
    /// Another margin, on top of the world's.
    ///
    /// # Errors
    /// As of `remove`; a margin that is negative, infinite or NaN.
    pub fn set_margin(&self, id: Id, margin: f64) -> Result<(), Error> {
        call(|error| unsafe { ffi::jostle_world_set_margin(self.handle, raw(&[id]), 1, &margin, 0, error) })
    }
    /// A disabled object keeps its id and box, and touches nothing.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn set_enabled(&self, id: Id, enabled: bool) -> Result<(), Error> {
        let enabled = enabled.into();
        call(|error| unsafe { ffi::jostle_world_set_enabled(self.handle, raw(&[id]), 1, &enabled, 0, error) })
    }
    /// 64 bits of your own. At once.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn set_user_data(&self, id: Id, data: u64) -> Result<(), Error> {
        call(|error| unsafe { ffi::jostle_world_set_user_data(self.handle, raw(&[id]), 1, &data, error) })
    }
    /// In the next update the pairs of the object come among those that began, as if they were new.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn report_again(&self, id: Id) -> Result<(), Error> {
        call(|error| unsafe { ffi::jostle_world_report_again(self.handle, raw(&[id]), null(), 1, error) })
    }

    // --- Changes ---

    /// Applies what was queued and finds out what that did to the pairs.
    ///
    /// # Errors
    /// Out of memory. The world is then unchanged.
    pub fn update(&mut self) -> Result<(), Error> {
        let handle = self.handle;
        self.change(|error| unsafe { ffi::jostle_world_update(handle, error) })
    }
    /// [`move_many`](World::move_many), then [`update`](World::update); the boxes are read where they lie.
    ///
    /// # Errors
    /// As of both.
    pub fn update_moves<'b>(&mut self, ids: &[Id], boxes: impl Into<Boxes<'b, T, D>>) -> Result<(), Error> {
        let boxes = as_many(ids, boxes.into())?;
        let handle = self.handle;
        self.change(|error| unsafe { ffi::jostle_world_update_moves(handle, raw(ids), &boxes.raw, error) })
    }
    /// Shows what was queued to queries and to all that is known of objects, ahead of the next update, which
    /// does the same as without.
    ///
    /// # Errors
    /// As of `update`.
    pub fn apply(&mut self) -> Result<(), Error> {
        let handle = self.handle;
        self.change(|error| unsafe { ffi::jostle_world_apply(handle, error) })
    }
    /// Becomes the world that was saved. Ids are good again, too.
    ///
    /// # Errors
    /// [`ErrorKind::BadSnapshot`](crate::ErrorKind::BadSnapshot) for bytes that were cut short, altered, or saved
    /// by another kind of world.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), Error> {
        let handle = self.handle;
        let (bytes, size) = (snapshot.as_ptr().cast(), snapshot.len() as u64);
        self.change(|error| unsafe { ffi::jostle_world_restore(handle, bytes, size, error) })
    }
    /// Becomes the world whose changes these are, of the same base.
    ///
    /// # Errors
    /// As of `restore`.
    pub fn restore_changes(&mut self, changes: &[u8]) -> Result<(), Error> {
        let handle = self.handle;
        let (bytes, size) = (changes.as_ptr().cast(), changes.len() as u64);
        self.change(|error| unsafe { ffi::jostle_world_restore_changes(handle, bytes, size, error) })
    }
    /// Becomes a world without objects, as it was when it was made.
    pub fn clear(&mut self) {
        must(|error| unsafe { ffi::jostle_clear(self.handle.cast(), error) });
    }
    /// What the world is, as bytes: the same on every machine.
    pub fn save(&self) -> Vec<u8> {
        bytes(|results, error| unsafe { ffi::jostle_world_save(self.handle, results, error) })
    }
    /// The same, and from now on what differs from this base is recorded.
    pub fn save_base(&mut self) -> Vec<u8> {
        bytes(|results, error| unsafe { ffi::jostle_world_save_base(self.handle, results, error) })
    }
    /// How the world differs from its base. What rests costs nothing.
    ///
    /// # Errors
    /// If there is no base.
    pub fn save_changes(&mut self) -> Result<Vec<u8>, Error> {
        try_bytes(|results, error| unsafe { ffi::jostle_world_save_changes(self.handle, results, error) })
    }
    /// Another world like this one, with the same `accept`.
    pub fn fork(&self) -> Self {
        let mut handle = null_mut();
        must(|error| unsafe { ffi::jostle_world_fork(self.handle, &mut handle, error) });
        World { handle, executor: self.executor.clone(), accept: self.accept.clone(), of: PhantomData }
    }

    // --- Pairs, as of the last update ---

    /// Those that touch now and didn't before, ascending by index.
    pub fn began(&self) -> &[IdPair] {
        let (mut pairs, mut count) = (null(), 0);
        must(|error| unsafe { ffi::jostle_world_began(self.handle, &mut pairs, &mut count, error) });
        // SAFETY: laid out the same, and valid until the next change, which takes &mut self.
        unsafe { slice_of(pairs.cast(), count) }
    }
    /// Those that touched before and don't now, ascending by index, and why.
    pub fn ended(&self) -> &[EndedPair] {
        let (mut pairs, mut count) = (null(), 0);
        must(|error| unsafe { ffi::jostle_world_ended(self.handle, &mut pairs, &mut count, error) });
        // SAFETY: as above.
        unsafe { slice_of(pairs.cast(), count) }
    }
    /// Those that touched before and still do, and of which one object changed, by index.
    pub fn persisted(&self) -> Pairs<'_> {
        let mut raw = Pairs::none();
        must(|error| unsafe { ffi::jostle_world_persisted(self.handle, &mut raw, error) });
        // SAFETY: as above.
        unsafe { Pairs::from_raw(raw) }
    }
    /// Began and persisted as one list, by index.
    pub fn changed_pairs(&self) -> Pairs<'_> {
        let mut raw = Pairs::none();
        must(|error| unsafe { ffi::jostle_world_changed_pairs(self.handle, &mut raw, error) });
        // SAFETY: as above.
        unsafe { Pairs::from_raw(raw) }
    }
    /// All pairs that touch, by index. Costs as much as a search.
    pub fn pairs(&self) -> Vec<Pair> {
        let results = Results::new();
        must(|error| unsafe { ffi::jostle_world_pairs(self.handle, results.raw(), error) });
        results.pairs().to_vec()
    }
    /// Who an object touches, ascending by index.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn touching(&self, id: Id) -> Result<Vec<Id>, Error> {
        let results = Results::new();
        call(|error| unsafe {
            ffi::jostle_world_touching(self.handle, raw(&[id]), 1, results.raw(), error)
        })?;
        let mut lists = MaybeUninit::<ffi::jostle_lists>::uninit();
        must(|error| unsafe { ffi::jostle_results_lists(results.raw(), lists.as_mut_ptr(), error) });
        // SAFETY: filled in by a call that succeeded; the ids stay as long as the results.
        let ids = unsafe {
            let lists = lists.assume_init();
            slice_of(lists.ids, lists.count)
        };
        Ok(ids.iter().copied().filter_map(Id::from_c).collect())
    }

    // --- Queries and objects, as of the last update or apply ---

    /// Rays, overlaps, what is near: see [`Ask`].
    pub fn ask(&self) -> Ask<'_, Id, T, D> {
        Ask::new(self.handle.cast(), self.executor.as_ref())
    }
    /// All pairs of one of these boxes and an object that it touches, ascending: `a` is the position among
    /// the boxes, `b` the object's index.
    ///
    /// # Errors
    /// As of `add`.
    pub fn join<'b>(&mut self, boxes: impl Into<Boxes<'b, T, D>>) -> Result<Vec<Pair>, Error> {
        let boxes = boxes.into();
        let results = Results::new();
        let handle = self.handle;
        self.change(|error| unsafe {
            ffi::jostle_query_join(handle.cast(), &boxes.raw, null(), results.raw(), error)
        })?;
        Ok(results.pairs().to_vec())
    }
    /// How many objects there are.
    pub fn len(&self) -> usize {
        let mut size = 0;
        must(|error| unsafe { ffi::jostle_size(self.handle.cast(), &mut size, error) });
        size as usize
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Every index is less than this.
    pub fn index_end(&self) -> u32 {
        let mut end = 0;
        must(|error| unsafe { ffi::jostle_world_index_end(self.handle, &mut end, error) });
        end
    }
    /// Whether the id names an object.
    pub fn contains(&self, id: Id) -> bool {
        let mut contains = 0;
        must(|error| unsafe { ffi::jostle_world_contains(self.handle, raw(&[id]), 1, &mut contains, error) });
        contains != 0
    }
    /// The id of the object with that index.
    pub fn id_at(&self, index: u32) -> Option<Id> {
        let mut id = 0;
        must(|error| unsafe { ffi::jostle_world_ids(self.handle, &index, 1, &mut id, error) });
        Id::from_c(id)
    }
    /// The box of an object, as it was given.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn box_of(&self, id: Id) -> Result<Aabb<T, D>, Error> {
        let mut aabb = MaybeUninit::<Aabb<T, D>>::uninit();
        call(|error| unsafe {
            ffi::jostle_world_boxes(self.handle, raw(&[id]), 1, aabb.as_mut_ptr().cast(), error)
        })?;
        // SAFETY: the call has written 2 D numbers.
        Ok(unsafe { aabb.assume_init() })
    }
    /// Your own 64 bits, also of objects that the last update has removed.
    ///
    /// # Errors
    /// As of `remove`.
    pub fn user_data(&self, id: Id) -> Result<u64, Error> {
        let mut data = 0;
        call(|error| unsafe { ffi::jostle_world_user_data(self.handle, raw(&[id]), 1, &mut data, error) })?;
        Ok(data)
    }
    /// What the world looks like, in words.
    pub fn explain(&self) -> String {
        let text = bytes(|results, error| unsafe { ffi::jostle_world_explain(self.handle, results, error) });
        String::from_utf8_lossy(&text).into_owned()
    }

    /// Goes on with panics of callbacks.
    fn change(
        &mut self,
        function: impl FnOnce(*mut ffi::jostle_error) -> ffi::jostle_status,
    ) -> Result<(), Error> {
        let result = call(function);
        if result.is_err() {
            if let Some(accept) = &self.accept {
                accept.caught.resume();
            }
            if let Some(executor) = &self.executor {
                executor.resume();
            }
        }
        result
    }
}

/// Ids are laid out as C's.
fn raw(ids: &[Id]) -> *const u64 {
    ids.as_ptr().cast()
}

fn try_bytes(
    fill: impl FnOnce(*mut ffi::jostle_results, *mut ffi::jostle_error) -> ffi::jostle_status,
) -> Result<Vec<u8>, Error> {
    let results = Results::new();
    call(|error| fill(results.raw(), error))?;
    let (mut first, mut count) = (null(), 0);
    must(|error| unsafe { ffi::jostle_results_bytes(results.raw(), &mut first, &mut count, error) });
    // SAFETY: they stay as long as the results.
    Ok(unsafe { slice_of(first.cast(), count) }.to_vec())
}
fn bytes(
    fill: impl FnOnce(*mut ffi::jostle_results, *mut ffi::jostle_error) -> ffi::jostle_status,
) -> Vec<u8> {
    try_bytes(fill).unwrap_or_else(|error| panic!("{error}"))
}
