//! Mistakes in the program that are met while it serves. Each ends what it happened in, and nothing else.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use futures_util::FutureExt;
use thiserror::Error;

/// What is known of one: for the log.
#[derive(Debug, Clone, Error)]
#[error("a fault: {0}")]
pub struct Fault(String);

impl Fault {
    /// Of words.
    pub fn new(words: impl ToString) -> Fault {
        Fault(words.to_string())
    }

    /// Of what a panic left.
    pub fn of(panic: &(dyn Any + Send)) -> Fault {
        let text = panic.downcast_ref::<&str>().copied().map(str::to_owned);
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Fault(text.unwrap_or_else(|| "a panic without words".to_owned()))
    }

    /// Of a task that did not end as it should.
    pub fn of_task(error: tokio::task::JoinError) -> Fault {
        match error.try_into_panic() {
            Ok(panic) => Fault::of(&*panic),
            Err(error) => Fault::new(error),
        }
    }
}

/// What comes of `run`, and be it a panic. What it worked on may be left half done: it is to be dropped then, or made anew.
pub fn caught<T>(run: impl FnOnce() -> T) -> Result<T, Fault> {
    catch_unwind(AssertUnwindSafe(run)).map_err(|panic| Fault::of(&*panic))
}

/// The same of what takes its time.
pub async fn caught_in<T>(run: impl Future<Output = T>) -> Result<T, Fault> {
    AssertUnwindSafe(run).catch_unwind().await.map_err(|panic| Fault::of(&*panic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_fault_with_its_words() {
        assert_eq!(caught(|| 7).ok(), Some(7));
        let panics: [fn(); 3] = [|| panic!("one"), || panic!("number {}", 2), || std::panic::panic_any(3)];
        let words = panics.map(|panics| caught(panics).expect_err("a fault").to_string());
        assert_eq!(words, ["a fault: one", "a fault: number 2", "a fault: a panic without words"]);
    }
}
