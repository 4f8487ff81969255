//! The one place where other people's decoders are called from.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a decoder that is not ours on bytes from outside: a panic is an error like any other.
///
/// Why: such decoders are ports of C++ and index what a file claims. A panic there says that the file is damaged, not
/// that this program is. Nothing of the decoder is used after it, so no half-made state is ever seen.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err("the compressed data is damaged".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        let bytes: &[u8] = &[];
        assert_eq!(guarded(|| Ok(bytes[std::hint::black_box(1)])), Err("the compressed data is damaged".into()));
        assert_eq!(guarded(|| Ok(7)), Ok(7));
    }
}
