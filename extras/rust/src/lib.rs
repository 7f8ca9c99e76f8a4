// SPDX-License-Identifier: MIT
#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

#[cfg(feature = "world")]
mod ask;
mod boxes;
mod error;
mod executor;
#[rustfmt::skip] // generated
pub mod ffi;
#[cfg(feature = "world")]
mod index;
mod pairs;
#[cfg(feature = "world")]
mod world;

#[cfg(feature = "world")]
pub use crate::{
    ask::{
        Ask, Frustum, Hit, Id, Line, Lists, Named, Near, Nearest, NearestToBox, Overlap, Plane, Query, Ray,
        Sphere, Sweep,
    },
    index::BoxIndex,
    world::{
        EndReason, EndedPair, IdPair, ObjectFilter, ObjectOptions, World, World2d, World2f, World3d, World3f,
        WorldOptions,
    },
};
pub use boxes::{Aabb, Boxes, Boxlike, Coordinate, Values};
pub use error::{Error, ErrorKind};
pub use executor::Executor;
pub use pairs::{
    find_pairs, find_pairs_brute_force, Chunk, Filter, Order, Pair, PairFinder, Pairs, PairsIter,
};
