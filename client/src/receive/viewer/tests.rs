//! The viewer against a real server session, without sockets.

use camera::{Camera, Pinhole, Rigid};
use glam::{DAffine3, DVec3};
use protocol::codec::Coding;
use protocol::held::ObjectPose;
use protocol::message::{Clock, VERSION, ViewSize, Welcome};
use protocol::session::{ServerConfig, ServerEvent, ServerSession};
use protocol::staging::SceneMotion;
use protocol::wire::encode_update;
use protocol::{DepthImage, DepthScale, Edit, Held, Lighting, Limits, Look, Mask, Patch, PatchId, Purpose, Update};
use surface::BuiltSurfaces;

use super::*;

const VIEW: ViewSize = ViewSize { width_px: 64, height_px: 48, fov_y_rad: 1.0 };

fn welcome() -> Welcome {
    Welcome {
        version: VERSION,
        scene_name: "test".to_owned(),
        bounds_min_world: [-1.0; 3],
        bounds_max_world: [1.0; 3],
        start_world_from_eye: Rigid::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO),
        walk: false,
        near_m: 0.01,
        look: Look::Plain,
        update_interval_s: 0.1,
        scene_time_s: 100.0,
        motion: SceneMotion::Still,
        secret: 0,
        resumed: false,
    }
}

fn patch(id: u32) -> Edit {
    let camera = Pinhole::symmetric(welcome().start_world_from_eye, (4, 4), 1.0, 0.01);
    let mut mask = Mask::empty(4, 4);
    mask.set(1, 1, true);
    mask.set(2, 1, true);
    let image = DepthImage {
        camera: Camera::Pinhole(camera),
        depth_scale: DepthScale { w_min: 0.2, w_step: 1e-4 },
        mask,
        depth: vec![0, 1],
        normal: vec![[127, 127]; 2],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[255, 0, 0], [0, 255, 0]],
        object: vec![0; 2],
        material: vec![0; 2],
    };
    Edit::Add(Box::new(Patch { id: PatchId(id), purpose: Purpose::Eye, capture_time_s: 0.0, objects: vec![], image }))
}

/// The other end, and the socket between.
struct Server {
    session: ServerSession,
    held: Held,
}

impl Server {
    fn new() -> Server {
        Server { session: ServerSession::new(ServerConfig::new(Clock::Wall, welcome()), 0.0), held: Held::default() }
    }

    fn update(&mut self, edits: Vec<Edit>, scene_time_s: f64, now_s: f64) {
        let pose_seq = self.session.pose().map_or(0, |pose| pose.seq);
        let update = self.held.commit(edits, scene_time_s, pose_seq).expect("sound edits");
        self.session.send_update(&encode_update(&update, Coding::default()), now_s).expect("credit");
    }
}

fn viewer() -> Viewer {
    Viewer::new("ws://there", Clock::Wall, VIEW, Decoder::inline(Limits::default()), 0.0)
}

/// Carries everything both ways at once.
fn exchange(viewer: &mut Viewer, server: &mut Server, now_s: f64) {
    for _ in 0..4 {
        while let Some(command) = viewer.poll_socket(now_s) {
            match command {
                SocketCommand::Send(bytes) => drop(server.session.handle(&bytes, now_s)),
                SocketCommand::Open => viewer.handle(SocketEvent::Opened, now_s),
                SocketCommand::Close => {}
            }
        }
        while let Some(event) = server.session.poll_event() {
            if matches!(event, ServerEvent::Resume(_)) {
                // It knows of no earlier session.
                server.session.resume(0, None, now_s);
            }
        }
        while let Some(bytes) = server.session.poll_transmit(now_s) {
            viewer.handle(SocketEvent::Message(bytes.into()), now_s);
        }
    }
}

#[derive(Default)]
struct Followed(Vec<(u64, bool)>);

impl Follow for Followed {
    fn follow(&mut self, _: &Held, update: &Update, anew: bool, _: &mut BuiltSurfaces) {
        self.0.push((update.number, anew));
    }
}

#[test]
fn from_the_first_word_to_a_picture() {
    let (mut viewer, mut server, mut followed) = (viewer(), Server::new(), Followed::default());
    assert_eq!(viewer.status(0.0).as_deref(), Some("connecting to ws://there, retrying"));
    exchange(&mut viewer, &mut server, 1.0);
    assert!(viewer.is_open());
    assert_eq!(viewer.status(1.0), None);
    assert_eq!(viewer.age_ms(1.0), None, "nothing is shown yet");
    assert!(viewer.progress().is_some());

    viewer.set_pose(welcome().start_world_from_eye, 1.0);
    exchange(&mut viewer, &mut server, 1.0);
    // It was 100 s when the server began to wait, a second before it was greeted.
    server.update(vec![patch(1)], 101.0, 1.1);
    exchange(&mut viewer, &mut server, 1.25);
    assert!(viewer.advance(&mut followed, 1.25, 0.0));
    assert_eq!(followed.0, [(1, true)]);
    assert!(viewer.has_picture());
    assert_eq!(viewer.progress(), None);
    viewer.drawn(1.3, Some(2.0), None);
    assert!((viewer.round_trip_ms().expect("closed") - 300.0).abs() < 1e-6);
    assert!((viewer.age_ms(1.5).expect("shown") - 500.0).abs() < 1.0);
    let stats = viewer.stats(1.5);
    assert_eq!((stats.samples, stats.patches, stats.updates, stats.frames), (2, 1, 1, 1));
    assert!(stats.bytes_received > 50 && stats.mbit_per_s > 0.0);
}

#[test]
fn acknowledgements_reach_the_server() {
    let (mut viewer, mut server) = (viewer(), Server::new());
    exchange(&mut viewer, &mut server, 0.0);
    server.update(vec![patch(1)], 100.0, 0.0);
    exchange(&mut viewer, &mut server, 0.1);
    viewer.advance(&mut (), 0.1, 0.0);
    exchange(&mut viewer, &mut server, 0.2);
    assert_eq!(server.session.in_flight_and_window_bytes().0, 0);
}

#[test]
fn the_velocity_is_that_of_the_poses() {
    let (mut viewer, mut server) = (viewer(), Server::new());
    exchange(&mut viewer, &mut server, 0.0);
    let at = |x: f64| Rigid::look_along(DVec3::new(x, 0.0, 0.0), DVec3::NEG_Z);
    for (x, now_s, velocity) in [(0.0, 0.0, 0.0), (0.1, 0.1, 1.0), (0.2, 0.2, 1.0), (0.2, 0.3, 0.0), (9.0, 5.0, 0.0)] {
        viewer.set_pose(at(x), now_s);
        exchange(&mut viewer, &mut server, now_s);
        let pose = server.session.pose().expect("sent");
        let told = f64::from(pose.motion.velocity_world.x);
        assert!((told - velocity).abs() < 1e-5, "at {now_s}: {told}");
    }
}

#[test]
fn the_old_picture_stays_until_a_new_session_brings_one() {
    let (mut viewer, mut server, mut followed) = (viewer(), Server::new(), Followed::default());
    exchange(&mut viewer, &mut server, 0.0);
    for (id, scene_time_s) in [(1, 100.0), (2, 100.1)] {
        server.update(vec![patch(id)], scene_time_s, 0.0);
        exchange(&mut viewer, &mut server, 0.1);
        viewer.advance(&mut followed, 0.1, 10.0);
        exchange(&mut viewer, &mut server, 0.1);
    }
    assert_eq!(viewer.held().sample_count(), 4);

    server.session.close("the server restarts", true, 6.0);
    exchange(&mut viewer, &mut server, 6.0);
    let status = viewer.status(6.0).expect("trouble is told");
    assert_eq!(status, "server closed the connection: the server restarts, retrying in 1 s");
    assert_eq!(viewer.held().sample_count(), 4, "the picture stays");

    let mut server = Server::new();
    exchange(&mut viewer, &mut server, 7.0);
    assert!(viewer.is_open());
    assert_eq!(viewer.held().sample_count(), 4, "still");
    server.update(vec![patch(1)], 100.0, 7.0);
    exchange(&mut viewer, &mut server, 7.1);
    assert!(viewer.advance(&mut followed, 7.1, 10.0));
    assert_eq!(viewer.held().sample_count(), 2);
    assert_eq!(followed.0, [(1, true), (2, false), (1, true)]);
}

#[test]
fn a_session_goes_on_with_what_is_held() {
    let (mut viewer, mut server, mut followed) = (viewer(), Server::new(), Followed::default());
    viewer = viewer.with_eye(Rigid::IDENTITY);
    exchange(&mut viewer, &mut server, 0.0);
    assert_eq!(server.session.start_world_from_eye(), Some(Rigid::IDENTITY), "the first picture is of what it sees");
    for id in [1, 2] {
        server.update(vec![patch(id)], 100.0, 0.0);
        exchange(&mut viewer, &mut server, 0.1);
        viewer.advance(&mut followed, 0.1, 10.0);
    }
    // The second one is not acknowledged, and the third one never comes.
    server.update(vec![patch(3)], 100.0, 0.1);
    viewer.handle(SocketEvent::Closed(String::new()), 6.0);
    assert!(viewer.status(6.0).expect("trouble").starts_with("the connection was lost"));

    let mut after = Server { held: server.held, ..Server::new() };
    while let Some(command) = viewer.poll_socket(7.0) {
        match command {
            SocketCommand::Open => viewer.handle(SocketEvent::Opened, 7.0),
            SocketCommand::Send(bytes) => after.session.handle(&bytes, 7.0).expect("a hello"),
            SocketCommand::Close => {}
        }
    }
    let Some(ServerEvent::Resume(resume)) = after.session.poll_event() else { panic!("it comes back") };
    assert_eq!(resume.number, 2);
    assert!(after.session.resume(1, Some(server.session.take_trail()), 7.0));
    exchange(&mut viewer, &mut after, 7.1);
    assert!(viewer.advance(&mut followed, 7.1, 10.0));
    assert_eq!(followed.0, [(1, true), (2, false), (3, false)]);
    assert_eq!(viewer.held().digest(), after.held.digest());
    exchange(&mut viewer, &mut after, 7.2);
    after.update(vec![patch(4)], 100.0, 7.2);
    exchange(&mut viewer, &mut after, 7.3);
    assert!(viewer.advance(&mut followed, 7.3, 10.0), "and on");
}

#[test]
fn who_is_refused_is_told_why_and_stays_away() {
    let (mut viewer, mut server) = (viewer(), Server::new());
    server.session.close("the token is wrong", false, 0.0);
    exchange(&mut viewer, &mut server, 0.0);
    assert_eq!(viewer.status(60.0).as_deref(), Some("ws://there does not let you in: the token is wrong"));
    assert_eq!(viewer.poll_socket(60.0), None);
    viewer.retry_now(60.0);
    assert_eq!(viewer.poll_socket(60.0), Some(SocketCommand::Open));
}

#[test]
fn objects_go_on_between_updates_by_the_scenes_clock() {
    let (mut viewer, mut server) = (viewer(), Server::new());
    // Welcome says that it is 100 s in the scene.
    exchange(&mut viewer, &mut server, 0.0);
    let at = |x: f64| ObjectPose { object: 3, world_from_object: DAffine3::from_translation(DVec3::X * x) };
    let shown_at =
        |viewer: &Viewer, now_s: f64| viewer.moment_at(now_s).world_from_objects.get(&3).map(|pose| pose.translation.x);
    assert_eq!(shown_at(&viewer, 0.0), None);
    for (x, scene_time_s) in [(0.0, 100.1), (0.5, 100.2), (1.0, 100.3)] {
        server.update(vec![Edit::Move(vec![at(x)])], scene_time_s, 0.3);
        exchange(&mut viewer, &mut server, 0.3);
        viewer.advance(&mut (), 0.3, 10.0);
        exchange(&mut viewer, &mut server, 0.3);
    }
    for (now_s, x) in [(0.2, 0.5), (0.26, 0.8), (0.3, 1.0), (0.34, 1.2), (0.4, 1.5), (7.0, 1.5)] {
        let shown = shown_at(&viewer, now_s).expect("it is there");
        assert!((shown - x).abs() < 1e-6, "at {now_s}: {shown}");
    }
    assert_eq!(viewer.held().poses_now[&3].translation.x, 1.0, "the copy is that of the server");
    server.update(vec![Edit::Clear, patch(1), Edit::Move(vec![at(9.0)])], 100.4, 0.4);
    exchange(&mut viewer, &mut server, 0.4);
    viewer.advance(&mut (), 0.4, 10.0);
    assert_eq!(shown_at(&viewer, 0.35), Some(9.0), "a copy that begins anew was not seen to move");
}

#[test]
fn a_damaged_update_begins_anew() {
    let (mut viewer, mut server, mut followed) = (viewer(), Server::new(), Followed::default());
    exchange(&mut viewer, &mut server, 0.0);
    server.update(vec![patch(1)], 100.0, 0.0);
    exchange(&mut viewer, &mut server, 0.0);
    viewer.advance(&mut followed, 0.0, 10.0);
    exchange(&mut viewer, &mut server, 0.1);
    // The server's copy goes another way than the client was told.
    let wrong = server.held.commit(vec![Edit::Remove(PatchId(1))], 100.2, 0).expect("sound");
    let wrong = Update { digest: wrong.digest ^ 1, ..wrong };
    server.session.send_update(&encode_update(&wrong, Coding::default()), 0.2).expect("credit");
    exchange(&mut viewer, &mut server, 0.2);
    assert!(!viewer.advance(&mut followed, 0.2, 10.0));
    assert_eq!(viewer.held().sample_count(), 2, "nothing of it was applied");
    exchange(&mut viewer, &mut server, 0.3);

    let black =
        Lighting { ambient: [0.0; 3], lights: vec![], background: [0; 3], burley: false, ..Lighting::default() };
    server.update(vec![Edit::Clear, patch(2), patch(3), Edit::Light(Box::new(black))], 100.3, 0.3);
    exchange(&mut viewer, &mut server, 0.4);
    assert!(viewer.advance(&mut followed, 0.4, 10.0));
    assert_eq!(viewer.held().sample_count(), 4);
    assert_eq!(followed.0.last().map(|followed| followed.1), Some(true));
    assert!(viewer.is_open());
}

#[test]
fn a_broken_message_ends_the_session_and_says_why() {
    let (mut viewer, mut server) = (viewer(), Server::new());
    exchange(&mut viewer, &mut server, 0.0);
    viewer.handle(SocketEvent::Message(vec![255; 40]), 1.0);
    assert!(!viewer.is_open());
    assert_eq!(viewer.poll_socket(1.0), Some(SocketCommand::Close));
    assert!(viewer.status(1.0).expect("trouble").starts_with("something is wrong with the server at ws://there"));
    assert_eq!(viewer.poll_socket(1.4), None);
    assert_eq!(viewer.poll_socket(1.5), Some(SocketCommand::Open));
}

/// Needs so many pieces before it may follow.
struct Uploading(usize, Followed);

impl Follow for Uploading {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces) {
        self.1.follow(held, update, anew, built);
    }

    fn upload(&mut self, _: &mut BuiltSurfaces) -> bool {
        self.0 = self.0.saturating_sub(1);
        self.0 == 0
    }
}

#[test]
fn an_update_is_applied_once_all_of_its_surfaces_are_uploaded() {
    let (mut viewer, mut server, mut follower) = (viewer(), Server::new(), Uploading(3, Followed::default()));
    exchange(&mut viewer, &mut server, 0.0);
    server.update(vec![patch(1)], 100.0, 0.0);
    exchange(&mut viewer, &mut server, 0.0);
    for _ in 0..2 {
        assert!(!viewer.advance(&mut follower, 0.0, 0.0));
        assert!(viewer.is_uploading() && viewer.held().sample_count() == 0 && follower.1.0.is_empty());
    }
    assert!(viewer.advance(&mut follower, 0.0, 0.0));
    assert!(!viewer.is_uploading());
    assert_eq!(follower.1.0, [(1, true)]);
    follower.0 = 3;
    server.update(vec![patch(2)], 100.0, 0.0);
    exchange(&mut viewer, &mut server, 0.0);
    assert!(viewer.advance(&mut follower, 0.0, 10.0), "there is time for all pieces");
}

#[test]
fn a_thread_decodes_the_same() {
    let decoder = Decoder::on_thread(Limits::default(), std::sync::Arc::new(|| {})).expect("a thread");
    let mut viewer = Viewer::new("ws://there", Clock::Wall, VIEW, decoder, 0.0);
    let mut server = Server::new();
    exchange(&mut viewer, &mut server, 0.0);
    server.update(vec![patch(1)], 100.0, 0.0);
    exchange(&mut viewer, &mut server, 0.0);
    for _ in 0..1000 {
        if viewer.advance(&mut (), 0.0, 0.0) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert_eq!(viewer.held().sample_count(), 2);
}
