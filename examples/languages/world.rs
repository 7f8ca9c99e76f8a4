// SPDX-License-Identifier: MIT
//! Objects that move, from Rust without a crate: which pairs begin and end to touch.
//!     rustc world.rs -L FOLDER_OF_LIBJOSTLE && ./world
use std::ffi::{c_void, CStr};
use std::os::raw::c_char;
use std::ptr::{null, null_mut};

#[repr(C)]
struct Error {
    status: i32,
    callback_result: i32,
    index: u64,
    message: [c_char; 496],
}
#[repr(C)]
struct Boxes {
    lo: [*const c_void; 3],
    hi: [*const c_void; 3],
    count: u64,
    stride: i64,
}
#[repr(C)]
struct EndedPair {
    a: u64,
    b: u64,
    reason: i32,
    reserved: i32,
}
enum World {}
const JOSTLE_3F: i32 = 2;

#[link(name = "jostle")]
extern "C" {
    fn jostle_world_new(space: i32, options: *const c_void, out: *mut *mut World, error: *mut Error) -> i32;
    fn jostle_world_free(world: *mut World, error: *mut Error) -> i32;
    fn jostle_world_add(w: *mut World, b: *const Boxes, o: *const c_void, ids: *mut u64, e: *mut Error) -> i32;
    fn jostle_world_update(world: *mut World, error: *mut Error) -> i32;
    fn jostle_world_update_moves(w: *mut World, ids: *const u64, b: *const Boxes, e: *mut Error) -> i32;
    fn jostle_world_began(w: *const World, p: *mut *const [u64; 2], n: *mut u64, e: *mut Error) -> i32;
    fn jostle_world_ended(w: *const World, p: *mut *const EndedPair, n: *mut u64, e: *mut Error) -> i32;
}

/// Every call takes an error; this makes a Result of it.
fn call(f: impl FnOnce(*mut Error) -> i32) -> Result<(), String> {
    let mut error = Error { status: 0, callback_result: 0, index: 0, message: [0; 496] };
    match f(&mut error) {
        0 => Ok(()),
        _ => Err(unsafe { CStr::from_ptr(error.message.as_ptr()) }.to_string_lossy().into_owned()),
    }
}
fn view(rows: &[[f32; 6]]) -> Boxes {
    let at = |axis: usize| rows[0][axis..].as_ptr().cast();
    Boxes { lo: [at(0), at(1), at(2)], hi: [at(3), at(4), at(5)], count: rows.len() as u64, stride: 24 }
}

fn main() -> Result<(), String> {
    let mut rows = [[0., 0., 0., 1., 1., 1.], [1., 0., 0., 2., 1., 1.], [5., 0., 0., 6., 1., 1.]];
    let (mut world, mut ids) = (null_mut(), [0u64; 3]);
    let (mut began, mut ended, mut count) = (null(), null(), 0u64);
    unsafe {
        call(|e| jostle_world_new(JOSTLE_3F, null(), &mut world, e))?;
        call(|e| jostle_world_add(world, &view(&rows), null(), ids.as_mut_ptr(), e))?;
        call(|e| jostle_world_update(world, e))?;
        rows[1] = [4., 0., 0., 5., 1., 1.]; // the middle one goes over to the other side
        call(|e| jostle_world_update_moves(world, ids.as_ptr(), &view(&rows), e))?;
        call(|e| jostle_world_began(world, &mut began, &mut count, e))?;
        for pair in std::slice::from_raw_parts(began, count as usize) {
            println!("began: {} {}", pair[0] as u32, pair[1] as u32);
        }
        call(|e| jostle_world_ended(world, &mut ended, &mut count, e))?;
        for pair in std::slice::from_raw_parts(ended, count as usize) {
            println!("ended: {} {}, reason {}", pair.a as u32, pair.b as u32, pair.reason);
        }
        call(|e| jostle_world_free(world, e))
    }
}
