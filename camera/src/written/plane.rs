use glam::DVec3;
use serde::Deserialize;

use super::error::WrittenError;
use crate::{HalfSpace, Rigid};

/// A plane across a frustum: through a point, or some way along the frustum's axis.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenPlane {
    /// A point on it.
    #[serde(default)]
    pub point: Option<DVec3>,
    /// Instead of the point: how far along the axis of the frustum that it cuts, in metres.
    #[serde(default)]
    pub after_m: Option<f64>,
    /// Across it, of any length; along that axis where it is left out.
    #[serde(default)]
    pub normal: Option<DVec3>,
}

/// A frustum's middle ray, in world space: from the middle of its face, or from the eye, on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub from: DVec3,
    /// Unit length.
    pub along: DVec3,
}

impl WrittenPlane {
    /// The points before it: `outward` as it is written.
    pub(super) fn half_space(&self, name: &str, axis: &Axis, place: &Rigid) -> Result<HalfSpace, WrittenError> {
        let point = match (self.point, self.after_m) {
            (Some(point), None) => place.transform_point(point),
            (None, Some(after_m)) => axis.from + axis.along * after_m,
            _ => return Err(WrittenError::OneOf { name: name.to_owned(), one: "point", other: "after_m" }),
        };
        let outward = self.normal.map_or(axis.along, |normal| place.transform_vector(normal));
        let number = WrittenError::Number {
            name: name.to_owned(),
            what: "a plane",
            needed: "of finite numbers, its normal of some length",
        };
        HalfSpace { point, outward }.normalized().ok_or(number)
    }

    /// The same, whichever way its normal is written: what holds a point, which is not on it.
    pub(super) fn holding(
        &self,
        p_world: DVec3,
        name: &str,
        axis: &Axis,
        place: &Rigid,
    ) -> Result<HalfSpace, WrittenError> {
        let half_space = self.half_space(name, axis, place)?;
        Ok(if half_space.depth_m(p_world) < 0.0 { half_space.opposite() } else { half_space })
    }
}
