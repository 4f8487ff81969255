//! What every case is run with, and the ways in which it can be broken on purpose.

use std::cell::RefCell;
use std::str::FromStr;

use glam::DVec3;
use gpu::Gpu;
use protocol::DepthImage;
use server::discretize::DepthPrecision;
use surface::{CornerRules, Corners, HeldSurfaces};

use super::case::{Case, PICTURE_PX};
use crate::client_view::ClientView;
use crate::stage::Stage;

/// See the module.
pub struct Lab {
    pub gpu: Gpu,
    /// A client without effects.
    pub view: ClientView,
    /// What is broken between the stages; `None` where all is as it should be.
    pub broken: Option<Break>,
    /// What was looked at first, since somebody took it.
    pub case: RefCell<Option<Case>>,
}

impl Lab {
    pub fn new(gpu: &Gpu, broken: Option<Break>) -> anyhow::Result<Lab> {
        Ok(Lab {
            gpu: gpu.clone(),
            view: ClientView::new(gpu, (PICTURE_PX, PICTURE_PX))?,
            broken,
            case: RefCell::default(),
        })
    }

    /// Remembers a case if it is the first one.
    pub fn looks_at(&self, case: &Case) {
        self.case.borrow_mut().get_or_insert_with(|| case.clone());
    }
}

/// A fault put into what goes from one stage to the next: a report that cannot fail says nothing. No product code knows of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Break {
    /// Depth in steps ten times as coarse as planned.
    Step,
    /// Every code of depth one too high.
    Code,
    /// Coordinates on the server's GPU relative to the origin, wherever the scene is.
    Anchor,
    /// Normals of 4 + 4 bits.
    Normals,
    /// Surfaces that do not rise within a sample.
    Corners,
    /// Cameras half a pixel beside those that captured.
    Camera,
    /// Colours of four bits a channel.
    Colours,
    /// Objects that stay where they were first.
    Poses,
    /// Shadows of nothing that a server sent for lights.
    Shadows,
    /// Mirrors and glass without images.
    Impostors,
}

impl Break {
    pub const ALL: [(&'static str, Break); 10] = [
        ("step", Break::Step),
        ("code", Break::Code),
        ("anchor", Break::Anchor),
        ("normals", Break::Normals),
        ("corners", Break::Corners),
        ("camera", Break::Camera),
        ("colours", Break::Colours),
        ("poses", Break::Poses),
        ("shadows", Break::Shadows),
        ("impostors", Break::Impostors),
    ];
    /// What depth steps are multiplied by.
    const COARSER: f64 = 10.0;
    /// What is left of a byte of a normal, and of a colour.
    const KEPT_BITS: u8 = 0b1111_0000;

    /// The scene as it is drawn from.
    pub fn anchored(broken: Option<Break>, stage: &mut Stage) -> anyhow::Result<()> {
        if broken == Some(Break::Anchor) {
            let snapshot = stage.snapshot().clone();
            stage.renderer.update(&snapshot, DVec3::ZERO)?;
        }
        Ok(())
    }

    /// The precision that images are packed with.
    pub fn packed(broken: Option<Break>, precision: DepthPrecision) -> DepthPrecision {
        match precision {
            DepthPrecision::Parallax { epsilon_px, focal_px, offset_m } if broken == Some(Break::Step) => {
                DepthPrecision::Parallax { epsilon_px: Break::COARSER * epsilon_px, focal_px, offset_m }
            }
            precision => precision,
        }
    }

    /// The images that are sent.
    pub fn sent(broken: Option<Break>, images: &mut [DepthImage]) {
        for image in images {
            match broken {
                Some(Break::Code) => image.depth.iter_mut().for_each(|code| *code = code.saturating_add(1)),
                Some(Break::Normals) => {
                    image.normal.as_flattened_mut().iter_mut().for_each(|code| *code &= Break::KEPT_BITS);
                }
                Some(Break::Colours) => {
                    image.colour.as_flattened_mut().iter_mut().for_each(|code| *code &= Break::KEPT_BITS);
                }
                Some(Break::Camera) => {
                    if let camera::Camera::Pinhole(camera) = &mut image.camera {
                        camera.centre_px += 0.5;
                    }
                }
                _ => {}
            }
        }
    }

    /// What builds surfaces.
    pub fn surfaces(broken: Option<Break>, gpu: &Gpu) -> HeldSurfaces {
        let rules = match broken {
            Some(Break::Corners) => CornerRules { max_ratio: 1.0, ..CornerRules::default() },
            _ => CornerRules::default(),
        };
        HeldSurfaces::with_corners(gpu, Corners::default(), rules)
    }
}

impl FromStr for Break {
    type Err = String;

    fn from_str(text: &str) -> Result<Break, String> {
        let known = Break::ALL.iter().find(|(name, _)| *name == text);
        known.map(|(_, broken)| *broken).ok_or_else(|| {
            let names: Vec<&str> = Break::ALL.iter().map(|(name, _)| *name).collect();
            format!("{text:?} is no way to break it; there are: {}", names.join(", "))
        })
    }
}
