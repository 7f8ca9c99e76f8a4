// SPDX-License-Identifier: MIT
use std::any::Any;
use std::ffi::CStr;
use std::fmt;
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::Mutex;

use crate::ffi;

/// What kind of mistake an [`Error`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A bound of a box is NaN.
    NanCoordinate,
    /// `lo > hi` on some axis.
    InvertedBox,
    /// More objects than a 32-bit index can name.
    TooManyObjects,
    /// Slices that have to be of one length aren't.
    SizeMismatch,
    /// Anything else that the documentation of the call forbids.
    InvalidArgument,
    /// An id that names no object of this world.
    StaleId,
    /// A snapshot that is cut short, altered, or of another kind of world.
    BadSnapshot,
    /// There was no memory left.
    OutOfMemory,
    /// A mistake of Jostle's own: please report it.
    Internal,
}

/// What went wrong, in words that name the object and its value.
///
/// After an error nothing is changed.
///
/// ```
/// let boxes = [[[0.0, 0.0], [1.0, 1.0]], [[0.0, f32::NAN], [1.0, 1.0]]];
/// let error = jostle::find_pairs(&boxes).unwrap_err();
/// assert_eq!(error.kind(), jostle::ErrorKind::NanCoordinate);
/// assert_eq!(error.index(), Some(1));
/// println!("{error}"); // box 1: lo.y is NaN; every bound must be a number (infinite is allowed)
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    index: Option<u64>,
    message: String,
}

impl Error {
    /// What kind of mistake it was.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
    /// The position of the lowest box, id or other object at fault, where one is.
    pub fn index(&self) -> Option<u64> {
        self.index
    }
    #[cfg(feature = "world")]
    pub(crate) fn new(kind: ErrorKind, message: String) -> Error {
        Error { kind, index: None, message }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}
impl fmt::Debug for Error {
    /// As `unwrap()` shows it.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:?}: {}", self.kind, self.message)
    }
}
impl std::error::Error for Error {}

/// Calls a function of the C interface.
pub(crate) fn call(function: impl FnOnce(*mut ffi::jostle_error) -> ffi::jostle_status) -> Result<(), Error> {
    let mut told = std::mem::MaybeUninit::<ffi::jostle_error>::uninit();
    let status = function(told.as_mut_ptr());
    if status == ffi::JOSTLE_OK {
        return Ok(());
    }
    // SAFETY: a function that fails fills it in, and the message ends with a zero.
    let (index, message) = unsafe {
        let told = told.assume_init_ref();
        (told.index, CStr::from_ptr(told.message.as_ptr()).to_string_lossy().into_owned())
    };
    let kind = match status {
        ffi::JOSTLE_NAN_COORDINATE => ErrorKind::NanCoordinate,
        ffi::JOSTLE_INVERTED_BOX => ErrorKind::InvertedBox,
        ffi::JOSTLE_TOO_MANY_OBJECTS => ErrorKind::TooManyObjects,
        ffi::JOSTLE_SIZE_MISMATCH => ErrorKind::SizeMismatch,
        ffi::JOSTLE_INVALID_ARGUMENT => ErrorKind::InvalidArgument,
        ffi::JOSTLE_STALE_ID => ErrorKind::StaleId,
        ffi::JOSTLE_BAD_SNAPSHOT => ErrorKind::BadSnapshot,
        ffi::JOSTLE_OUT_OF_MEMORY => ErrorKind::OutOfMemory,
        _ => ErrorKind::Internal,
    };
    Err(Error { kind, index: (index != u64::MAX).then(|| index), message })
}

/// The same of a function that can fail for want of memory alone.
pub(crate) fn must(function: impl FnOnce(*mut ffi::jostle_error) -> ffi::jostle_status) {
    call(function).unwrap_or_else(|error| panic!("{error}"));
}

/// Keeps the first panic of callbacks, which must not unwind through C++, until the call is over.
#[derive(Default)]
pub(crate) struct Caught(Mutex<Option<Box<dyn Any + Send>>>);

impl Caught {
    /// What a callback returns: less than 0 ends the call around it.
    pub(crate) fn run(&self, callback: impl FnOnce() -> i32) -> i32 {
        catch_unwind(AssertUnwindSafe(callback)).unwrap_or_else(|panic| {
            self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).get_or_insert(panic);
            -1
        })
    }
    /// Goes on with the panic, if there was one.
    pub(crate) fn resume(&self) {
        let panic = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}
