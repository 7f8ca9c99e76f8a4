// SPDX-License-Identifier: MIT
use std::marker::PhantomData;
use std::mem::size_of;

#[cfg(feature = "world")]
use crate::error::{Error, ErrorKind};
use crate::ffi;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}
use sealed::Sealed;

/// A number of which points of `D` dimensions are made: `f32` or `f64`, and `D` is 2 or 3.
pub trait Coordinate<const D: usize>:
    Sealed + Copy + PartialOrd + std::fmt::Debug + Default + Send + Sync + 'static
{
    #[doc(hidden)]
    const SPACE: ffi::jostle_space;
    #[doc(hidden)]
    const INFINITY: Self;
    #[doc(hidden)]
    const ONE: Self;
}
impl Coordinate<2> for f32 {
    const SPACE: ffi::jostle_space = ffi::JOSTLE_2F;
    const INFINITY: f32 = f32::INFINITY;
    const ONE: f32 = 1.0;
}
impl Coordinate<3> for f32 {
    const SPACE: ffi::jostle_space = ffi::JOSTLE_3F;
    const INFINITY: f32 = f32::INFINITY;
    const ONE: f32 = 1.0;
}
impl Coordinate<2> for f64 {
    const SPACE: ffi::jostle_space = ffi::JOSTLE_2D;
    const INFINITY: f64 = f64::INFINITY;
    const ONE: f64 = 1.0;
}
impl Coordinate<3> for f64 {
    const SPACE: ffi::jostle_space = ffi::JOSTLE_3D;
    const INFINITY: f64 = f64::INFINITY;
    const ONE: f64 = 1.0;
}

/// An axis-aligned box. It is closed: boxes that share a face touch.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<T, const D: usize> {
    /// The lower bound on each axis.
    pub lo: [T; D],
    /// The upper bound on each axis.
    pub hi: [T; D],
}

impl<T, const D: usize> Aabb<T, D> {
    /// The box from `lo` to `hi`.
    pub const fn new(lo: [T; D], hi: [T; D]) -> Self {
        Aabb { lo, hi }
    }
}
impl<T, const D: usize> From<[[T; D]; 2]> for Aabb<T, D> {
    fn from([lo, hi]: [[T; D]; 2]) -> Self {
        Aabb { lo, hi }
    }
}

/// What is laid out as a box: lower bounds, then upper bounds, and nothing else.
///
/// [`Aabb<T, D>`](Aabb), `[[T; D]; 2]`, `[T; 4]` in 2D and `[T; 6]` in 3D are. [`Boxes::of`] reads those of
/// other types.
pub trait Boxlike<T, const D: usize>: boxlike::Sealed {}
mod boxlike {
    pub trait Sealed {}
    impl<T, const D: usize> Sealed for super::Aabb<T, D> {}
    impl<T, const D: usize> Sealed for [[T; D]; 2] {}
    impl<T> Sealed for [T; 4] {}
    impl<T> Sealed for [T; 6] {}
}
impl<T, const D: usize> Boxlike<T, D> for Aabb<T, D> {}
impl<T, const D: usize> Boxlike<T, D> for [[T; D]; 2] {}
impl<T> Boxlike<T, 2> for [T; 4] {}
impl<T> Boxlike<T, 3> for [T; 6] {}

/// Boxes in your own memory, which are read where they lie.
///
/// Slices, arrays and vectors of what is [`Boxlike`] turn into it by themselves: `finder.find(&boxes)`.
#[derive(Clone, Copy)]
pub struct Boxes<'a, T, const D: usize> {
    pub(crate) raw: ffi::jostle_boxes,
    of: PhantomData<&'a [T]>,
}
// SAFETY: it is a shared reference to numbers. Whatever else there is in the structs around them isn't
// touched.
unsafe impl<T: Sync, const D: usize> Send for Boxes<'_, T, D> {}
unsafe impl<T: Sync, const D: usize> Sync for Boxes<'_, T, D> {}

impl<'a, T: Coordinate<D>, const D: usize> Boxes<'a, T, D> {
    /// The boxes inside structs: `bounds` says where in one of them the lower and the upper corner lie.
    ///
    /// Vectors of glam, nalgebra and others are arrays by `as_ref()`. It is asked about every struct, so that
    /// it can't be wrong; with optimisation nothing is left of that.
    ///
    /// ```
    /// struct Body { name: &'static str, min: [f32; 3], max: [f32; 3] }
    /// let bodies = [
    ///     Body { name: "a", min: [0.0; 3], max: [1.0; 3] },
    ///     Body { name: "b", min: [1.0; 3], max: [2.0; 3] },
    /// ];
    /// let boxes = jostle::Boxes::of(&bodies, |body| (&body.min, &body.max));
    /// let pairs = jostle::find_pairs(boxes)?;
    /// assert_eq!(pairs, [jostle::Pair { a: 0, b: 1 }]);
    /// # Ok::<(), jostle::Error>(())
    /// ```
    ///
    /// # Panics
    /// If a corner doesn't lie in the struct, or not at the same place in each: the slice has to hold the
    /// numbers themselves.
    pub fn of<E>(structs: &'a [E], bounds: impl Fn(&'a E) -> (&'a [T; D], &'a [T; D])) -> Self {
        let mut at = None;
        for one in structs {
            let (lo, hi) = bounds(one);
            let here = (offset_in(one, lo), offset_in(one, hi));
            assert!(
                *at.get_or_insert(here) == here,
                "the corners of boxes don't lie at the same place in each struct"
            );
        }
        let (lo, hi) = at.unwrap_or((0, 0));
        Boxes::strided(structs, lo, hi)
    }

    /// One slice for each coordinate: `lo[axis]` and `hi[axis]` have the bounds of all boxes on an axis.
    ///
    /// # Panics
    /// If the slices aren't of one length.
    pub fn of_arrays(lo: [&'a [T]; D], hi: [&'a [T]; D]) -> Self {
        let count = lo[0].len();
        assert!(
            lo.iter().chain(&hi).all(|bounds| bounds.len() == count),
            "the bounds of boxes aren't of one length"
        );
        let mut raw = empty();
        for axis in 0..D {
            raw.lo[axis] = lo[axis].as_ptr().cast();
            raw.hi[axis] = hi[axis].as_ptr().cast();
        }
        raw.count = count as u64;
        raw.stride = size_of::<T>() as i64;
        Boxes { raw, of: PhantomData }
    }

    /// How many boxes there are.
    pub fn len(&self) -> usize {
        self.raw.count as usize
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.raw.count == 0
    }

    /// In each struct there are D numbers at each of two places.
    fn strided<E>(structs: &'a [E], lo: usize, hi: usize) -> Self {
        let first = structs.as_ptr().cast::<u8>();
        let mut raw = empty();
        for axis in 0..D {
            raw.lo[axis] = first.wrapping_add(lo + axis * size_of::<T>()).cast();
            raw.hi[axis] = first.wrapping_add(hi + axis * size_of::<T>()).cast();
        }
        raw.count = structs.len() as u64;
        raw.stride = size_of::<E>() as i64;
        Boxes { raw, of: PhantomData }
    }
}

fn empty() -> ffi::jostle_boxes {
    ffi::jostle_boxes { lo: [std::ptr::null(); 3], hi: [std::ptr::null(); 3], count: 0, stride: 0 }
}

/// How many bytes into a struct something in it lies.
fn offset_in<E, P>(one: &E, part: &P) -> usize {
    let offset = (part as *const P as usize).wrapping_sub(one as *const E as usize);
    let end = offset.checked_add(size_of::<P>());
    assert!(
        end.map_or(false, |end| end <= size_of::<E>()),
        "what was referred to doesn't lie in the struct itself"
    );
    offset
}

impl<'a, B: Boxlike<T, D>, T: Coordinate<D>, const D: usize> From<&'a [B]> for Boxes<'a, T, D> {
    fn from(boxes: &'a [B]) -> Self {
        Boxes::strided(boxes, 0, D * size_of::<T>())
    }
}
impl<'a, B: Boxlike<T, D>, T: Coordinate<D>, const D: usize> From<&'a Vec<B>> for Boxes<'a, T, D> {
    fn from(boxes: &'a Vec<B>) -> Self {
        boxes.as_slice().into()
    }
}
impl<'a, B: Boxlike<T, D>, T: Coordinate<D>, const D: usize, const N: usize> From<&'a [B; N]>
    for Boxes<'a, T, D>
{
    fn from(boxes: &'a [B; N]) -> Self {
        boxes.as_slice().into()
    }
}

/// The boxes, if there are as many as ids: C takes that number from the boxes.
#[cfg(feature = "world")]
pub(crate) fn as_many<'b, I, T: Coordinate<D>, const D: usize>(
    ids: &[I],
    boxes: Boxes<'b, T, D>,
) -> Result<Boxes<'b, T, D>, Error> {
    if ids.len() == boxes.len() {
        return Ok(boxes);
    }
    Err(Error::new(ErrorKind::SizeMismatch, format!("there are {} ids and {} boxes", ids.len(), boxes.len())))
}

/// One number for each object, read where it lies: categories, masks, owners.
///
/// Slices, arrays and vectors of `u32` turn into it by themselves.
#[derive(Clone, Copy)]
pub struct Values<'a> {
    pub(crate) raw: ffi::jostle_values,
    of: PhantomData<&'a [u32]>,
}
// SAFETY: as of Boxes.
unsafe impl Send for Values<'_> {}
unsafe impl Sync for Values<'_> {}

impl<'a> Values<'a> {
    /// The numbers inside structs: `value` says where in one of them.
    ///
    /// # Panics
    /// As [`Boxes::of`].
    pub fn of<E>(structs: &'a [E], value: impl Fn(&'a E) -> &'a u32) -> Self {
        let mut at = None;
        for one in structs {
            let here = offset_in(one, value(one));
            assert!(*at.get_or_insert(here) == here, "the values don't lie at the same place in each struct");
        }
        let data = structs.as_ptr().cast::<u8>().wrapping_add(at.unwrap_or(0)).cast();
        Values {
            raw: ffi::jostle_values { data, count: structs.len() as u64, stride: size_of::<E>() as i64 },
            of: PhantomData,
        }
    }
    /// Not given.
    pub(crate) fn none() -> Self {
        Values { raw: ffi::jostle_values { data: std::ptr::null(), count: 0, stride: 0 }, of: PhantomData }
    }
}
impl<'a> From<&'a [u32]> for Values<'a> {
    fn from(values: &'a [u32]) -> Self {
        Values::of(values, |value| value)
    }
}
impl<'a> From<&'a Vec<u32>> for Values<'a> {
    fn from(values: &'a Vec<u32>) -> Self {
        values.as_slice().into()
    }
}
impl<'a, const N: usize> From<&'a [u32; N]> for Values<'a> {
    fn from(values: &'a [u32; N]) -> Self {
        values.as_slice().into()
    }
}
