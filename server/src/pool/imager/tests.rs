use std::collections::BTreeSet;

use camera::Rigid;
use glam::DAffine3;

use super::*;

/// Draws what it was told last, and nothing else: a colour for its settings, ends for how many samples are asked about.
#[derive(Default)]
struct Told {
    settings: Settings,
    is_placed: bool,
}

impl Told {
    fn colour(&self) -> [u8; 4] {
        let blended = match self.settings.blended {
            Blended::CutOut => 0,
            Blended::LeftOut => 1,
            Blended::Layer(layer) => 2 + layer.0,
        };
        let sum = |objects: &BTreeSet<u16>| objects.iter().map(|&object| object as u8).sum();
        let LeftOut { absent, hiding } = &self.settings.left_out;
        [self.settings.is_smooth.into(), sum(absent), blended, sum(hiding)]
    }
}

impl Imager for Told {
    fn twin(&self) -> Option<Box<dyn Imager>> {
        Some(Box::new(Told::default()))
    }

    fn adapter(&self) -> String {
        "none".into()
    }

    fn materials(&self) -> Vec<Material> {
        Vec::new()
    }

    fn lighting(&self, _: &Snapshot) -> Lighting {
        Lighting::default()
    }

    fn captures(&mut self, _: &Snapshot, views: &[Pinhole], _: Discretization) -> Result<Vec<Capture>, ImagerError> {
        self.is_placed = true;
        Ok(views.iter().map(|view| capture(view, self.colour())).collect())
    }

    fn place(&mut self, _: &Snapshot, _: DVec3) -> Result<(), ImagerError> {
        self.is_placed = true;
        Ok(())
    }

    fn tell_ends(&mut self, capture: &mut Capture, mask: &Mask) -> Result<(), ImagerError> {
        assert!(self.is_placed, "ready to draw");
        capture.ends = vec![mask.count() as u16; capture.ids.len()];
        Ok(())
    }

    fn smooth(&mut self, is_smooth: bool) {
        self.settings.is_smooth = is_smooth;
    }

    fn leave_out(&mut self, left_out: LeftOut) {
        self.settings.left_out = left_out;
    }

    fn blend(&mut self, blended: Blended) {
        self.settings.blended = blended;
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        None
    }

    fn copy_view(&mut self, _: &Account, _: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        Ok(AddressView::empty((view.width_px, view.height_px)))
    }
}

fn capture(view: &Pinhole, colour: [u8; 4]) -> Capture {
    let count = view.width_px as usize * view.height_px as usize;
    Capture {
        camera: *view,
        ids: vec![[1, 0]; count],
        colour: vec![colour; count],
        rests: vec![[0; 2]; count],
        hides: Vec::new(),
        depth: vec![0.5; count],
        ends: Vec::new(),
        gpu_s: None,
    }
}

fn view() -> Pinhole {
    Pinhole::symmetric(Rigid::IDENTITY, (8, 8), 1.0, 0.1)
}

fn still() -> Arc<Snapshot> {
    let world_from_mesh = vec![DAffine3::IDENTITY];
    Arc::new(Snapshot { time_s: 0.0, world_from_mesh, deformed: Vec::new(), lights: Vec::new() })
}

/// An imager and its twin, which draw for those who stand.
fn twins(pool: &Arc<Pool>) -> [Box<dyn Imager>; 2] {
    let mut first = SharingImager::new(Box::new(Told::default()), pool.clone(), still());
    let mut second = first.twin().expect("it has one");
    first.draw_for(Occasion::Standing);
    second.draw_for(Occasion::Standing);
    [Box::new(first), second]
}

#[test]
fn what_was_drawn_otherwise_is_never_an_answer() {
    let pool = Arc::new(Pool::default());
    let mut imagers = twins(&pool);
    let tell: [fn(&mut dyn Imager); 7] = [
        |imager| imager.smooth(true),
        |imager| imager.leave_out(LeftOut { absent: BTreeSet::from([3, 4]), ..LeftOut::default() }),
        |imager| imager.leave_out(LeftOut { absent: BTreeSet::from([5]), ..LeftOut::default() }),
        |imager| imager.leave_out(LeftOut { hiding: BTreeSet::from([5]), ..LeftOut::default() }),
        |imager| imager.blend(Blended::LeftOut),
        |imager| imager.blend(Blended::Layer(Layer(0))),
        |imager| imager.blend(Blended::Layer(Layer(1))),
    ];
    let mut told = Told::default();
    for tell in tell {
        tell(&mut told);
        for imager in &mut imagers {
            tell(&mut **imager);
            let seen = imager.captures(&still(), &[view()], Discretization::Conventional).expect("it draws");
            assert_eq!(seen[0].colour[0], told.colour());
        }
    }
    assert_eq!((pool.drawn(), pool.shared()), (7, 7));
}

#[test]
fn views_methods_and_rests_are_told_apart() {
    let pool = Arc::new(Pool::default());
    let [mut imager, _] = twins(&pool);
    let other = Pinhole { focal_px: 1.001 * view().focal_px, ..view() };
    for (views, method) in [
        (vec![view()], Discretization::Conventional),
        (vec![view()], Discretization::DepthPeeling),
        (vec![other], Discretization::Conventional),
        (vec![view(), other], Discretization::Conventional),
    ] {
        let drawn = pool.drawn();
        let seen = imager.captures(&still(), &views, method).expect("it draws");
        assert_eq!(seen.iter().map(|capture| capture.camera).collect::<Vec<_>>(), views);
        assert_eq!(pool.drawn() - drawn, views.len() as u64);
    }
    let drawn = pool.drawn();
    for (in_parts, precision) in [
        (false, DepthPrecision::Finest),
        (false, DepthPrecision::Parallax { epsilon_px: 1.0, focal_px: 8.0, offset_m: 1.0 }),
        (false, DepthPrecision::Finest),
    ] {
        imager.view_at_rest(&still(), &view(), in_parts, precision).expect("it draws");
    }
    assert_eq!(pool.drawn() - drawn, 2);
}

#[test]
fn ends_are_those_of_the_samples_that_are_asked_about() {
    let pool = Arc::new(Pool::default());
    let mut masks = [Mask::empty(8, 8), Mask::empty(8, 8)];
    masks[0].set(1, 1, true);
    masks[1].set(1, 1, true);
    masks[1].set(2, 1, true);
    // The second one draws nothing, and so has never seen the scene.
    for mut imager in twins(&pool) {
        for mask in &masks {
            let mut seen = imager.captures(&still(), &[view()], Discretization::Conventional).expect("it draws");
            imager.tell_ends(&mut seen[0], mask).expect("it tells");
            assert_eq!(seen[0].ends[0], mask.count() as u16);
        }
    }
    assert_eq!((pool.drawn(), pool.shared()), (3, 5));
    let [_, mut imager] = twins(&pool);
    imager.draw_for(Occasion::Passing);
    let mut seen = imager.captures(&still(), &[view()], Discretization::Conventional).expect("it draws");
    let mut all = Mask::empty(8, 8);
    (0..8).for_each(|x| all.set(x, 3, true));
    imager.tell_ends(&mut seen[0], &all).expect("it tells");
    assert_eq!(seen[0].ends[0], 8);
}
