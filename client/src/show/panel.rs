//! How the panel writes figures.

/// `1234567` as `1.23 M`: three digits and a unit.
pub fn short_count(count: u64) -> String {
    let (value, unit) = match count {
        0..1_000 => return count.to_string(),
        1_000..1_000_000 => (count as f64 / 1e3, "K"),
        _ => (count as f64 / 1e6, "M"),
    };
    let digits = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_short() {
        assert_eq!(short_count(999), "999");
        assert_eq!(short_count(1_234), "1.23 K");
        assert_eq!(short_count(45_678), "45.7 K");
        assert_eq!(short_count(262_144), "262 K");
        assert_eq!(short_count(1_234_567), "1.23 M");
    }
}
