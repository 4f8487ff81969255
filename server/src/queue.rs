//! A queue that several threads take from, in order.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// See the module.
pub(crate) struct Queue<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    waiting: VecDeque<T>,
    is_open: bool,
}

impl<T> Default for Queue<T> {
    fn default() -> Queue<T> {
        Queue { state: Mutex::new(State { waiting: VecDeque::new(), is_open: true }), changed: Condvar::new() }
    }
}

impl<T> Queue<T> {
    fn state(&self) -> MutexGuard<'_, State<T>> {
        // Every change is one call.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts something at the end; gives it back where the queue is closed.
    pub fn push(&self, value: T) -> Result<(), T> {
        let mut state = self.state();
        if !state.is_open {
            return Err(value);
        }
        state.waiting.push_back(value);
        drop(state);
        self.changed.notify_one();
        Ok(())
    }

    /// The first, if there is one.
    pub fn try_next(&self) -> Option<T> {
        self.state().waiting.pop_front()
    }

    /// Waits for the first; `None` once the queue is closed and empty.
    pub fn next(&self) -> Option<T> {
        let mut state = self.state();
        while state.is_open && state.waiting.is_empty() {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.waiting.pop_front()
    }

    /// Takes nothing more.
    pub fn close(&self) {
        self.state().is_open = false;
        self.changed.notify_all();
    }

    /// Takes nothing more, and drops what waits.
    pub fn give_up(&self) {
        let dropped = {
            let mut state = self.state();
            state.is_open = false;
            std::mem::take(&mut state.waiting)
        };
        self.changed.notify_all();
        drop(dropped);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn what_waits_is_taken_in_order_until_the_queue_is_closed() {
        let queue = Arc::new(Queue::default());
        assert_eq!(queue.try_next(), None);
        (1..=3).for_each(|value| queue.push(value).expect("open"));
        assert_eq!((queue.next(), queue.try_next()), (Some(1), Some(2)));
        let taken = [0, 1].map(|_| {
            let queue = queue.clone();
            std::thread::spawn(move || std::iter::from_fn(|| queue.next()).collect::<Vec<i32>>())
        });
        queue.push(4).expect("open");
        queue.close();
        assert_eq!(queue.push(5), Err(5));
        let mut all = taken.map(|thread| thread.join().expect("it ends")).concat();
        all.sort_unstable();
        assert_eq!(all, [3, 4]);
    }

    #[test]
    fn what_waits_is_dropped_where_it_is_given_up() {
        let (queue, told) = (Queue::default(), Arc::new(()));
        queue.push(told.clone()).expect("open");
        queue.give_up();
        assert_eq!(Arc::strong_count(&told), 1);
        assert!(queue.next().is_none());
    }
}
