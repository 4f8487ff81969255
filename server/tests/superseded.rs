//! What finer samples have taken the place of is given up, and nothing else.

mod common;

use std::collections::BTreeSet;

use camera::{Pinhole, Rigid};
use common::{ball_before_wall, gpu};
use glam::DVec3;
use protocol::codec::ColourSteps;
use protocol::{PatchId, Purpose};
use vantage_server::Config;
use vantage_server::account::compare::Comparison;
use vantage_server::account::findings::Lacking;
use vantage_server::account::{Account, AccountRules, Deforming, Surroundings};
use vantage_server::discretize::{Capture, DepthPrecision, Discretization};
use vantage_server::imager::{GpuImager, Imager};

const SIZE_PX: u32 = 96;
/// Wider than a sample of the far view in the near one, and the margin.
const RIM_PX: f64 = 6.0;

fn view(eye: DVec3) -> Pinhole {
    Pinhole::symmetric(Rigid::look_along(eye, DVec3::NEG_Z), (SIZE_PX, SIZE_PX), 1.2, 0.1)
}

#[test]
fn a_nearer_view_supersedes_what_it_sees_whole_and_shows_the_same_without_it() {
    let scene = ball_before_wall();
    let mut imager = GpuImager::new(&gpu(), &scene, &Config::default()).expect("the scene uploads");
    let (snapshot, materials) = (scene.at(0.0), imager.materials());
    let lighting = imager.lighting(&snapshot);
    let now = Surroundings {
        sky: None,
        colour: ColourSteps::Lossless,
        time_s: 0.0,
        materials: &materials,
        lighting: &lighting,
        moving: &[],
        deforming: &Deforming::default(),
    };
    // The wall from 4 m and from 1.5 m; the ball is at the rim of the nearer view.
    let (far, near) = (view(DVec3::ZERO), view(DVec3::new(0.8, 0.0, -2.5)));
    let mut account = Account::default();
    account.draw_with(Purpose::Eye, || imager.new_surfaces());
    account.begin(&now).expect("tables");
    let mut capture = |camera: &Pinhole| -> Capture {
        let all = imager.captures(&snapshot, &[*camera], Discretization::Conventional);
        all.expect("a capture").remove(0)
    };
    let captures = [capture(&far), capture(&near)];
    for capture in &captures {
        account.add(Purpose::Eye, capture, &Lacking::all(capture), DepthPrecision::Finest, &now).expect("room");
    }
    account.refresh();

    account.begin(&now).expect("nothing changed");
    let copy = imager.copy_view(&account, Purpose::Eye, &near).expect("a view");
    let rules = AccountRules { outlines_stand_in: true, ..AccountRules::default() };
    let peers = BTreeSet::new();
    let comparison = Comparison::new(&captures[1], (Purpose::Eye, &copy), &account, &peers, rules);
    let superseded = account.superseded(&comparison, &Lacking::nothing(&captures[1]));

    assert!(superseded.iter().all(|(patch, ..)| *patch == PatchId(1)), "the finer patch stays");
    let held = &account.held().patches[&PatchId(1)].patch.image;
    let (mut inside, mut given_up) = (0, 0);
    for ((x, y), &object) in held.mask.occupied().zip(&held.object) {
        let w = captures[0].w((y * SIZE_PX + x) as usize);
        let point =
            far.world_from_image(camera::ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w: w.into() });
        let is_given_up = superseded.contains(&(PatchId(1), x as u16, y as u16));
        let rim = near.image_from_world(point).map_or(-1.0, |at| {
            let size = f64::from(SIZE_PX);
            at.u.min(at.v).min(size - at.u).min(size - at.v)
        });
        assert!(rim >= 0.0 || !is_given_up, "({x}, {y}) is out of sight");
        // The wall's middle, away from the ball.
        if object == 0 && rim > RIM_PX && point.x > 0.8 {
            inside += 1;
            given_up += usize::from(is_given_up);
        }
    }
    assert!(inside > 200 && given_up == inside, "{given_up} of {inside} are given up");

    account.supersede(&superseded).expect("they are held");
    account.refresh();
    assert_eq!(
        imager.copy_view(&account, Purpose::Eye, &near).expect("a view"),
        copy,
        "the view that gave them up shows the same"
    );
}
