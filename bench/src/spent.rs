//! Processor time of this process, by the names of its threads. Where one process holds server and load, both are measured in one run.

/// Processor seconds so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spent<const NAMES: usize> {
    /// Of the threads that run now whose names begin with each word.
    pub named_s: [f64; NAMES],
    /// Of the whole process.
    pub all_s: f64,
}

impl<const NAMES: usize> Spent<NAMES> {
    /// What was spent since an earlier moment.
    pub fn since(&self, earlier: &Spent<NAMES>) -> Spent<NAMES> {
        let named_s = std::array::from_fn(|name| self.named_s[name] - earlier.named_s[name]);
        Spent { named_s, all_s: self.all_s - earlier.all_s }
    }
}

/// What Linux counts processor time in, a second: `USER_HZ`, which is 100 on every architecture that it runs on.
const TICKS_PER_S: f64 = 100.0;

/// Processor time so far, by words that names of threads begin with; `None` where the system does not tell it by thread.
pub(crate) fn spent<const NAMES: usize>(names: [&str; NAMES]) -> Option<Spent<NAMES>> {
    let mut spent = Spent { named_s: [0.0; NAMES], all_s: seconds(&std::fs::read_to_string("/proc/self/stat").ok()?)? };
    for task in std::fs::read_dir("/proc/self/task").ok()?.flatten() {
        // A thread that ended meanwhile has no line.
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        let Some((_, name)) = stat.split_once('(') else { continue };
        if let Some(place) = names.iter().position(|begin| name.starts_with(begin)) {
            spent.named_s[place] += seconds(&stat).unwrap_or(0.0);
        }
    }
    Some(spent)
}

/// Processor seconds of another process so far; `None` where it is gone, or the system does not tell.
pub(crate) fn of_process(id: u32) -> Option<f64> {
    seconds(&std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?)
}

/// User and system time of a line of `stat`: the 14th and 15th field, counted behind the name, which may hold anything but a last bracket.
fn seconds(stat: &str) -> Option<f64> {
    let (_, behind) = stat.rsplit_once(')')?;
    let mut fields = behind.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some((next()? + next()?) / TICKS_PER_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_busy_thread_is_told_from_the_others() {
        assert_eq!(seconds("7 (a) b) S 1 2 3 4 5 6 7 8 9 10 30 12 0 0"), Some(0.42));
        let busy = std::thread::Builder::new().name("busy-for-test".into());
        let spin = || {
            let begun = std::time::Instant::now();
            while begun.elapsed().as_millis() < 150 {
                std::hint::spin_loop();
            }
            spent(["busy-for-test", "nobody"])
        };
        let Some(spent) = busy.spawn(spin).expect("a thread").join().expect("it ends") else { return };
        assert!(spent.named_s[0] > 0.0 && spent.named_s[1] == 0.0 && spent.all_s >= spent.named_s[0], "{spent:?}");
    }
}
