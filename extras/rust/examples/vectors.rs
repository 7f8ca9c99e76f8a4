// SPDX-License-Identifier: MIT
//! Boxes that lie inside a program's own structs, as vectors like glam's: read in place, nothing is copied.
//!     cargo run --release --example vectors
use jostle::{Boxes, Filter, Order, PairFinder, Values};

/// As glam has it, where this `as_ref()` comes with the vector.
#[repr(C)]
#[derive(Clone, Copy)]
struct Vec3 {
    x: f32,
    y: f32,
    z: f32,
}
impl AsRef<[f32; 3]> for Vec3 {
    fn as_ref(&self) -> &[f32; 3] {
        // SAFETY: repr(C), three f32 in a row.
        unsafe { &*(self as *const Vec3).cast() }
    }
}

#[allow(dead_code)]
struct Body {
    name: String,
    team: u32,
    min: Vec3,
    max: Vec3,
}

fn main() -> Result<(), jostle::Error> {
    let mut bodies: Vec<Body> = (0..100_000)
        .map(|i| {
            let [x, y, z] = [i % 50, i / 50 % 50, i / 2500].map(|k| k as f32 * 1.5);
            let (min, max) = (Vec3 { x, y, z }, Vec3 { x: x + 1.0, y: y + 1.0, z: z + 1.0 });
            Body { name: format!("body {i}"), team: i % 2, min, max }
        })
        .collect();
    let mut finder = PairFinder::new(); // keeps its memory from frame to frame
    for frame in 0..3 {
        bodies
            .iter_mut()
            .step_by(2)
            .for_each(|body| (body.min.x, body.max.x) = (body.min.x + 0.3, body.max.x + 0.3));
        // Where in a body the corners are, and its team. The view is gone at the end of the frame, so bodies
        // may move.
        let boxes = Boxes::of(&bodies, |body| (body.min.as_ref(), body.max.as_ref()));
        let filter = Filter::new().owners(Values::of(&bodies, |body| &body.team)); // of one team: no pair
        let pairs = finder.find_with(boxes, None, &filter, Order::Canonical)?;
        let first =
            pairs.iter().min().map(|pair| (&bodies[pair.a as usize].name, &bodies[pair.b as usize].name));
        println!("frame {frame}: {} pairs, the first {first:?}", pairs.len());
    }
    Ok(())
}
