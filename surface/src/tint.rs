//! False colours: what samples are, in place of what they saw. They are lit as the surfaces are, so that one sees their shapes.

use std::str::FromStr;

/// What the colours of surfaces tell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tint {
    /// What samples saw.
    #[default]
    Own,
    /// How long ago they were taken, by the logarithm: yellow a tenth of a second, red and violet a second and ten, dark blue a hundred seconds.
    Age,
    /// How many there are to a pixel of the picture, along a side, by the logarithm: yellow eight, between red and violet one, dark blue an eighth.
    Density,
}

/// Ages at the ends of the colours, in seconds.
const AGES_S: [f64; 2] = [0.1, 100.0];

impl Tint {
    /// What the upper half of `View::smoothing` says for a sample of an age: where it is among the colours, of 65,535; of [`Tint::Density`], that each pixel says so itself.
    pub(crate) fn code(self, age_s: f64) -> u32 {
        let [newest, oldest] = AGES_S;
        let level = (age_s.max(newest) / newest).ln() / (oldest / newest).ln();
        match self {
            Tint::Own => 0,
            Tint::Density => 1 << 8,
            Tint::Age => ((level.clamp(0.0, 1.0) * 65535.0) as u32) << 16,
        }
    }
}

impl FromStr for Tint {
    type Err = String;

    fn from_str(name: &str) -> Result<Tint, String> {
        match name {
            "picture" => Ok(Tint::Own),
            "age" => Ok(Tint::Age),
            "density" => Ok(Tint::Density),
            other => Err(format!("{other} is nothing that colours tell: use picture, age or density")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_are_told_by_their_logarithm() {
        let level = |age_s: f64| f64::from(Tint::Age.code(age_s) >> 16) / 65535.0;
        for (age_s, wanted) in
            [(-1.0, 0.0), (0.0, 0.0), (0.1, 0.0), (1.0, 1.0 / 3.0), (10.0, 2.0 / 3.0), (100.0, 1.0), (1e9, 1.0)]
        {
            assert!((level(age_s) - wanted).abs() < 1e-4, "{age_s} s: {}", level(age_s));
        }
        assert_eq!(level(f64::NAN), 0.0);
        assert_eq!("density".parse(), Ok(Tint::Density));
        assert!("depth".parse::<Tint>().unwrap_err().contains("picture, age or density"));
    }
}
