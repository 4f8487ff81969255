//! Numbers in lines of text.

/// Up to `N` numbers, of which `needed` must be there; the rest is 0.
pub(super) fn numbers<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a str>,
    needed: usize,
) -> Option<[f64; N]> {
    let mut values = [0.0; N];
    for (index, value) in values.iter_mut().enumerate() {
        match words.next() {
            Some(word) => *value = word.parse().ok()?,
            None if index < needed => return None,
            None => break,
        }
    }
    Some(values)
}
