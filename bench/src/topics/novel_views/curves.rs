//! Where one curve of error crosses another.

/// A curve: error (y) over cost (x), by growing x, each x once.
fn sorted(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<_> =
        points.iter().copied().filter(|point| point.0.is_finite() && point.1.is_finite()).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    sorted.dedup_by_key(|point| point.0);
    sorted
}

/// The curve between its points, linear; `None` outside of them.
fn at(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    if let Some(point) = curve.iter().find(|point| point.0 == x) {
        return Some(point.1);
    }
    let after = curve.iter().position(|point| point.0 > x)?;
    let (low, high) = (curve.get(after.checked_sub(1)?)?, curve[after]);
    let share = (x - low.0) / (high.0 - low.0);
    Some(low.1 + (high.1 - low.1) * share)
}

/// How one curve lies to another where both are known.
#[derive(Debug, Clone, PartialEq)]
pub enum Crossing {
    /// They have no stretch of x in common.
    Apart,
    /// The first is below on all of `from..=to`.
    Below(f64, f64),
    /// The first is above or equal on all of `from..=to`.
    Above(f64, f64),
    /// The first is below on one side of each of these and above on the other; `true` where it is below at larger x.
    At(Vec<(f64, bool)>),
}

/// Compares two curves over the x that both cover.
pub fn crossing(first: &[(f64, f64)], second: &[(f64, f64)]) -> Crossing {
    let (first, second) = (sorted(first), sorted(second));
    let mut xs: Vec<f64> = first.iter().chain(&second).map(|point| point.0).collect();
    xs.sort_by(f64::total_cmp);
    xs.dedup();
    let gaps: Vec<(f64, f64)> = xs.into_iter().filter_map(|x| Some((x, at(&first, x)? - at(&second, x)?))).collect();
    let (Some(&(from, gap)), Some(&(to, _))) = (gaps.first(), gaps.last()) else { return Crossing::Apart };
    let crosses = |pair: &[(f64, f64)]| {
        let ((x0, gap0), (x1, gap1)) = (pair[0], pair[1]);
        ((gap0 < 0.0) != (gap1 < 0.0)).then(|| (x0 + (x1 - x0) * gap0 / (gap0 - gap1), gap1 < 0.0))
    };
    let crossings: Vec<_> = gaps.windows(2).filter_map(crosses).collect();
    match (crossings.is_empty(), gap < 0.0) {
        (false, _) => Crossing::At(crossings),
        (true, true) => Crossing::Below(from, to),
        (true, false) => Crossing::Above(from, to),
    }
}

impl Crossing {
    /// For people, with the unit of x.
    pub fn say(&self, first: &str, second: &str, unit: &str) -> String {
        match self {
            Crossing::Apart => format!("{first} and {second} were not measured at any {unit} in common"),
            Crossing::Below(from, to) => {
                format!("{first} is better than {second} from {from:.1} to {to:.1} {unit}, all of what both cover")
            }
            Crossing::Above(from, to) => {
                format!("{first} is worse than {second} from {from:.1} to {to:.1} {unit}, all of what both cover")
            }
            Crossing::At(places) => {
                let place = |&(x, better): &(f64, bool)| {
                    format!("{} above {x:.1} {unit}", if better { "better" } else { "worse" })
                };
                let places: Vec<_> = places.iter().map(place).collect();
                format!("{first} against {second}: {}", places.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_cross_where_their_lines_do() {
        let falling = [(2.0, 0.0), (0.0, 2.0)];
        let level = [(0.0, 0.5), (4.0, 0.5)];
        assert_eq!(crossing(&falling, &level), Crossing::At(vec![(1.5, true)]));
        assert_eq!(crossing(&level, &falling), Crossing::At(vec![(1.5, false)]));
    }

    #[test]
    fn only_what_both_cover_counts() {
        let low = [(0.0, 1.0), (2.0, 1.0)];
        assert_eq!(crossing(&low, &[(1.0, 3.0), (9.0, 0.0)]), Crossing::Below(1.0, 2.0));
        assert_eq!(crossing(&low, &[(2.0, 0.5)]), Crossing::Above(2.0, 2.0));
        assert_eq!(crossing(&low, &[(3.0, 0.5)]), Crossing::Apart);
        assert_eq!(crossing(&low, &[]), Crossing::Apart);
    }
}
