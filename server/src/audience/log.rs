//! What a presenter was sent, as far as followers may still need it: updates, and a whole copy of some moment for who comes late.

use std::collections::VecDeque;

use protocol::wire::PackedUpdate;

/// Bytes of updates that are kept at least: a follower who was away so long goes on where he was.
const LEAST_KEPT_BYTES: usize = 4 << 20;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Log {
    whole: Option<PackedUpdate>,
    /// Numbers ascend.
    updates: VecDeque<PackedUpdate>,
    /// Of `updates`.
    bytes: usize,
    /// Number of the newest update; 0 before any.
    last: u64,
}

/// What a follower needs next.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    /// He holds all there is.
    Nothing,
    /// This.
    Update(PackedUpdate),
    /// A whole copy, which is to be made.
    Whole,
}

impl Log {
    /// Whose first update has a greater number than this.
    pub fn after(last: u64) -> Log {
        Log { last, ..Log::default() }
    }

    /// Takes what the presenter was sent; it is kept only where somebody follows.
    pub fn push(&mut self, update: PackedUpdate, is_followed: bool) {
        self.last = update.number;
        if !is_followed {
            return self.forget();
        }
        self.bytes += update.bytes;
        self.updates.push_back(update);
        let kept_bytes = LEAST_KEPT_BYTES.max(2 * self.whole.as_ref().map_or(0, |whole| whole.bytes));
        while self.bytes > kept_bytes
            && let Some(oldest) = self.updates.pop_front()
        {
            self.bytes -= oldest.bytes;
        }
    }

    /// Takes a whole copy of now, or of a moment since the last one.
    pub fn put_whole(&mut self, whole: PackedUpdate) {
        self.last = self.last.max(whole.number);
        self.whole = Some(whole);
    }

    /// Drops the whole copy: whoever needs one waits for another.
    pub fn drop_whole(&mut self) {
        self.whole = None;
    }

    /// The whole copy that is kept.
    pub fn whole(&self) -> Option<&PackedUpdate> {
        self.whole.as_ref()
    }

    /// Drops all but where numbers have come to.
    pub fn forget(&mut self) {
        *self = Log::after(self.last);
    }

    pub fn last(&self) -> u64 {
        self.last
    }

    /// What comes after the update that a follower holds; he may hold nothing that any update follows. Of several beginnings he takes the newest.
    pub fn next(&self, held: Option<u64>) -> Next {
        let number = held.unwrap_or(0);
        if number == self.last {
            return Next::Nothing;
        }
        let whole = self.whole.as_ref().filter(|whole| whole.number > number && self.is_worth_it(whole));
        let newest_beginning = self.updates.iter().rev().find(|update| update.clears && update.number > number);
        // Of one number, the update is what the presenter was sent himself.
        let is_newer = |whole: &&PackedUpdate| newest_beginning.is_none_or(|update| update.number < whole.number);
        let follows = || held.and_then(|number| self.at(number + 1));
        let next = match newest_beginning {
            Some(beginning) => Some(whole.filter(is_newer).unwrap_or(beginning)),
            None => follows().or(whole),
        };
        next.map_or(Next::Whole, |update| Next::Update(update.clone()))
    }

    fn at(&self, number: u64) -> Option<&PackedUpdate> {
        let index = self.updates.partition_point(|update| update.number < number);
        self.updates.get(index).filter(|update| update.number == number)
    }

    /// Whether a whole copy and the updates since cost no more than twice what a new one would.
    fn is_worth_it(&self, whole: &PackedUpdate) -> bool {
        let since = self.updates.partition_point(|update| update.number <= whole.number);
        let bytes: usize = self.updates.range(since..).map(|update| update.bytes).sum();
        let goes_on = whole.number == self.last || self.at(whole.number + 1).is_some();
        goes_on && bytes <= whole.bytes.max(LEAST_KEPT_BYTES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn update(number: u64, clears: bool, bytes: usize) -> PackedUpdate {
        PackedUpdate { number, digest: 0, clears, bytes, fragments: Vec::new().into() }
    }

    /// What a follower is sent until he holds all.
    fn sent(log: &Log, mut held: Option<u64>) -> Vec<u64> {
        let mut numbers = Vec::new();
        while let Next::Update(update) = log.next(held) {
            held = Some(update.number);
            numbers.push(update.number);
        }
        assert_eq!(log.next(held), if held == Some(log.last) { Next::Nothing } else { Next::Whole });
        numbers
    }

    #[test]
    fn who_comes_late_gets_a_whole_copy_and_goes_on() {
        let mut log = Log::default();
        assert_eq!(log.next(None), Next::Nothing, "nobody has presented yet");
        (1..=3).for_each(|number| log.push(update(number, false, 100), true));
        assert_eq!(log.next(None), Next::Whole);
        log.put_whole(update(3, true, 1000));
        log.push(update(4, false, 100), true);
        log.push(update(5, false, 100), true);
        assert_eq!(sent(&log, None), [3, 4, 5]);
        assert_eq!(sent(&log, Some(2)), [3, 4, 5], "who still follows needs no copy");
        assert_eq!(log.last(), 5);
    }

    #[test]
    fn a_fresh_start_and_a_gap_lead_to_the_newest_beginning() {
        let mut log = Log::default();
        log.push(update(1, false, 100), true);
        log.push(update(3, true, 100), true);
        log.push(update(4, false, 100), true);
        for held in [None, Some(1)] {
            assert_eq!(sent(&log, held), [3, 4]);
        }
        log.push(update(6, false, 100), true);
        assert_eq!(log.next(Some(4)), Next::Whole, "5 never came, and nothing has begun anew since");
    }

    #[test]
    fn a_whole_copy_counts_as_what_there_is_and_before_an_older_beginning() {
        let mut log = Log::default();
        log.put_whole(update(7, true, 1000));
        assert_eq!((log.last(), sent(&log, None)), (7, vec![7]), "nothing else has come yet");
        log.push(update(8, true, 100), true);
        log.push(update(9, false, 100), true);
        assert_eq!(sent(&log, None), [8, 9], "the update begins anew later than the copy");
        log.put_whole(update(9, true, 1000));
        assert_eq!(sent(&log, None), [9], "the copy is of a later moment");
        assert_eq!(sent(&log, Some(8)), [9]);
        log.drop_whole();
        assert_eq!(sent(&log, None), [8, 9]);
    }

    #[test]
    fn old_updates_go_and_an_old_copy_is_made_anew() {
        let mut log = Log::default();
        log.put_whole(update(1, true, 1000));
        let each = LEAST_KEPT_BYTES / 4;
        (2..=5).for_each(|number| log.push(update(number, false, each), true));
        assert_eq!(sent(&log, None), [1, 2, 3, 4, 5]);
        log.push(update(6, false, each), true);
        assert_eq!(log.next(None), Next::Whole, "the update after the copy is gone");
        assert_eq!(log.next(Some(1)), Next::Whole);
        assert_eq!(sent(&log, Some(2)), [3, 4, 5, 6]);
        log.push(update(7, false, each), false);
        assert!(log.updates.is_empty() && log.bytes == 0, "nobody follows");
    }
}
