//! Processor time of this process, by the names of its threads. One process holds server and load, so that both are measured in one run.

/// Processor seconds of the threads whose names begin with a word, and of all others.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spent {
    /// Of threads of the name.
    pub named_s: f64,
    /// Of the others.
    pub others_s: f64,
}

/// What Linux counts processor time in, a second: `USER_HZ`, which is 100 on every architecture that it runs on.
const TICKS_PER_S: f64 = 100.0;

/// Processor time so far; `None` where the system does not tell it by thread. Threads that ended are among the others.
pub(super) fn spent(name: &str) -> Option<Spent> {
    let of_process = ticks(&std::fs::read_to_string("/proc/self/stat").ok()?)?;
    let mut named = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()?.flatten() {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        let is_named = stat.split_once('(').is_some_and(|(_, after)| after.starts_with(name));
        named += if is_named { ticks(&stat).unwrap_or(0.0) } else { 0.0 };
    }
    Some(Spent { named_s: named / TICKS_PER_S, others_s: (of_process - named) / TICKS_PER_S })
}

/// User and system ticks of a line of `stat`: the 14th and 15th field, counted behind the name, which may hold anything but a last bracket.
fn ticks(stat: &str) -> Option<f64> {
    let (_, behind) = stat.rsplit_once(')')?;
    let mut fields = behind.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some(next()? + next()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_busy_thread_is_told_from_the_others() {
        assert_eq!(ticks("7 (a) b) S 1 2 3 4 5 6 7 8 9 10 30 12 0 0"), Some(42.0));
        let busy = std::thread::Builder::new().name("busy-for-test".into());
        let spin = || {
            let begun = std::time::Instant::now();
            while begun.elapsed().as_millis() < 150 {
                std::hint::spin_loop();
            }
            spent("busy-for-test")
        };
        let Some(spent) = busy.spawn(spin).expect("a thread").join().expect("it ends") else { return };
        assert!(spent.named_s > 0.0 && spent.others_s >= 0.0, "{spent:?}");
    }
}
