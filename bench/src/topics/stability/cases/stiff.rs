//! What a case is, and what surfaces keep in all of them.

use crate::topics::stability::case::Case;
use crate::topics::stability::check::Check;
use crate::topics::stability::judge::Errors;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::way::shown;

/// A case by its name.
pub struct Stiff {
    pub name: &'static str,
    pub judge: fn(&mut Lab) -> anyhow::Result<Vec<Check>>,
}

/// What surfaces that are flat keep.
pub fn flat(lab: &mut Lab, case: &Case) -> anyhow::Result<Vec<Check>> {
    Ok(Check::of_flat(&Errors::of(&shown(lab, case)?)))
}

/// What surfaces that bend keep, of which a sample's normal says less.
pub fn bent(lab: &mut Lab, case: &Case) -> anyhow::Result<Vec<Check>> {
    Ok(Check::of_all(&Errors::of(&shown(lab, case)?)))
}
