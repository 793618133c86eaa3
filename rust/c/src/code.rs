//! Result codes of functions.

use core::ffi::{CStr, c_char};
use core::fmt::{self, Write};

use zerorate_core::Error;

/// Result code of a function. Only `ZR_OK` is zero.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum zr_code {
    /// Success.
    ZR_OK = 0,
    /// A required pointer is null.
    ZR_NULL = 1,
    /// The memory is too small or misaligned.
    ZR_MEMORY = 2,
    /// A parameter is out of range: `zr_drift_explain` and `zr_attitude_explain` name it.
    ZR_PARAMETER = 3,
    /// The buffer is too small for this checkpoint.
    ZR_BUFFER = 4,
    /// The bytes are not a checkpoint.
    ZR_NO_CHECKPOINT = 5,
    /// The checkpoint belongs to another version of zerorate, or to another type.
    ZR_OTHER_CHECKPOINT = 6,
    /// The checkpoint is damaged or incomplete.
    ZR_DAMAGED = 7,
    /// An error of unknown cause.
    ZR_UNKNOWN = 8,
}

impl From<Error> for zr_code {
    fn from(error: Error) -> Self {
        match error {
            Error::Parameter { .. } => Self::ZR_PARAMETER,
            Error::Buffer => Self::ZR_BUFFER,
            Error::NotACheckpoint => Self::ZR_NO_CHECKPOINT,
            Error::Layout { .. } | Error::Type { .. } => Self::ZR_OTHER_CHECKPOINT,
            Error::Length { .. } | Error::Checksum | Error::Content => Self::ZR_DAMAGED,
            _ => Self::ZR_UNKNOWN,
        }
    }
}

impl zr_code {
    fn message(self) -> &'static CStr {
        match self {
            Self::ZR_OK => c"all went well",
            Self::ZR_NULL => c"a pointer that is needed is null",
            Self::ZR_MEMORY => c"the memory given is too small, or does not lie as it must",
            Self::ZR_PARAMETER => c"a parameter is out of its range",
            Self::ZR_BUFFER => c"the buffer given is too small for this checkpoint",
            Self::ZR_NO_CHECKPOINT => c"these bytes are not a zerorate checkpoint",
            Self::ZR_OTHER_CHECKPOINT => {
                c"the checkpoint is of another version or of something else"
            }
            Self::ZR_DAMAGED => c"the checkpoint is damaged or cut",
            Self::ZR_UNKNOWN => c"unknown error",
        }
    }

    fn of(number: i32) -> Self {
        const ALL: [zr_code; 8] = [
            zr_code::ZR_OK,
            zr_code::ZR_NULL,
            zr_code::ZR_MEMORY,
            zr_code::ZR_PARAMETER,
            zr_code::ZR_BUFFER,
            zr_code::ZR_NO_CHECKPOINT,
            zr_code::ZR_OTHER_CHECKPOINT,
            zr_code::ZR_DAMAGED,
        ];
        ALL.into_iter().find(|code| *code as i32 == number).unwrap_or(Self::ZR_UNKNOWN)
    }
}

/// Returns the text of a `zr_code`; it stays valid.
#[unsafe(no_mangle)]
pub extern "C" fn zr_message(code: i32) -> *const c_char {
    zr_code::of(code).message().as_ptr()
}

/// Returns the version of the library, such as "0.2.0"; it stays valid.
#[unsafe(no_mangle)]
pub extern "C" fn zr_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => panic!("a version has no zero in it"),
        };
    VERSION.as_ptr()
}

/// The code that a function returns to C.
pub(crate) fn answer(result: Result<(), zr_code>) -> zr_code {
    result.err().unwrap_or(zr_code::ZR_OK)
}

/// Text in a buffer of C, truncated at its end; counts the length of the full text.
pub(crate) struct Text<'a> {
    buffer: &'a mut [u8],
    length: usize,
}

impl<'a> Text<'a> {
    /// Writes an error and a zero; returns its full length without the zero, as `snprintf` does.
    pub(crate) fn explain(error: &Error, buffer: &'a mut [u8]) -> usize {
        let mut text = Text { buffer, length: 0 };
        // Writing never fails: it truncates.
        let _ = write!(text, "{error}");
        let end = text.length.min(text.buffer.len().saturating_sub(1));
        if let Some(last) = text.buffer.get_mut(end) {
            *last = 0;
        }
        text.length
    }
}

impl Write for Text<'_> {
    fn write_str(&mut self, words: &str) -> fmt::Result {
        for byte in words.bytes() {
            if let Some(place) = self.buffer.get_mut(self.length) {
                *place = byte;
            }
            self.length += 1;
        }
        Ok(())
    }
}
