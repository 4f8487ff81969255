//! Several scenes of one server: each is loaded for who asks for it, within limits, and put away when nobody is there.

// Whether what draws may go from thread to thread is asked through all that it consists of.
#![recursion_limit = "256"]

mod net;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use net::{Client, NoiseImager, VIEW, config, request, room};
use protocol::message::{Clock, Resume};
use protocol::session::{ClientConfig, SessionError};
use scene::load::Offer;
use scene::model::Wrap;
use scene::{Scene, Texture};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use vantage_server::limits::SceneLimits;
use vantage_server::prepare::{PrepareError, Prepared};
use vantage_server::serving::Folder;
use vantage_server::serving::within::SceneFile;
use vantage_server::{Config, Running};

/// For what takes a moment on an idle machine.
const PATIENCE: Duration = Duration::from_secs(60);
const MIB: u64 = 1 << 20;

/// A server of an empty room, with a folder of scenes beside it, which is removed with it.
struct Served {
    running: Running,
    folder: PathBuf,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// A room of so many mebibytes, by the number in its file.
fn load(file: &SceneFile, says: &(dyn Fn(String) + Sync), config: &Config) -> Result<Prepared, PrepareError> {
    let path: &Path = &file.path;
    let text = std::fs::read_to_string(path).expect("a file");
    says("reading files, 50 %".to_owned());
    assert!(text != "fault", "a mistake");
    let Ok(mebibytes) = text.trim().parse::<u32>() else {
        let source = vantage_server::source::load("no such scene", 1.0, &|_| {});
        return Err(source.err().expect("there is none").into());
    };
    let stem = path.file_stem().expect("a name").to_string_lossy();
    let name =
        file.within.variant.as_ref().map_or_else(|| stem.clone().into_owned(), |variant| format!("{variant} {stem}"));
    let offer = Offer { variants: vec!["red".to_owned(), "blue".to_owned()], ..Offer::default() };
    let (width_px, height_px) = (512, 512 * mebibytes);
    let rgba = vec![0; mebibytes as usize * MIB as usize];
    let texture = Texture { width_px, height_px, rgba, wrap: [Wrap::Clamp; 2], nearest: false };
    let scene = Arc::new(Scene { name, textures: vec![texture], offer, ..room(false) });
    Ok(Prepared { config: config.clone(), scene, imager: Box::new(NoiseImager { delay: Duration::ZERO }) })
}

async fn served(name: &str, limits: SceneLimits, files: &[(&str, &str)]) -> Served {
    let folder = std::env::temp_dir().join(format!("vantage-scenes-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    for (file, text) in files {
        std::fs::write(folder.join(file), text).expect("a file");
    }
    let mut config = Config { rest: false, ..config() };
    config.limits.scenes = limits;
    let listening = vantage_server::app::listen(&config).await.expect("a port");
    let of_files = config.clone();
    let open = Folder::open(&folder).expect("a folder of scenes");
    listening.offer(open, None, Arc::new(move |file, says| load(file, says, &of_files)));
    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    let running = listening.serve(config, Arc::new(room(false)), imager).expect("a server");
    Served { running, folder }
}

impl Served {
    async fn client(&self, query: &str, resume: Option<Resume>) -> Client {
        let (socket, _) = connect_async(format!("ws://{}/ws{query}", self.running.addr)).await.expect("a socket");
        Client::over(socket, ClientConfig { resume, ..ClientConfig::new(Clock::Wall, VIEW) })
    }

    /// Asks until there is a session, as clients do, or until it is said that there never will be.
    async fn visited(&self, query: &str) -> Result<Client, String> {
        let begun = Instant::now();
        loop {
            let mut client = self.client(query, None).await;
            match client.run(PATIENCE.as_secs_f64(), |client| !client.updates.is_empty()).await {
                Ok(()) => return Ok(client),
                Err(SessionError::Goodbye { again: true, .. }) if begun.elapsed() < PATIENCE => {}
                Err(SessionError::Goodbye { reason, .. }) => return Err(reason),
                Err(other) => panic!("{other}"),
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    async fn goodbye(&self, query: &str) -> (String, bool) {
        match self.client(query, None).await.run(PATIENCE.as_secs_f64(), |_| false).await {
            Err(SessionError::Goodbye { reason, again }) => (reason, again),
            other => panic!("no goodbye: {other:?}"),
        }
    }

    /// Asks until a text is said.
    async fn waits_to_be_told(&self, query: &str, text: &str) {
        let begun = Instant::now();
        loop {
            let (reason, again) = self.goodbye(query).await;
            if reason.contains(text) {
                return assert!(again, "{reason}");
            }
            assert!(begun.elapsed() < PATIENCE, "{text:?} was never said, but {reason:?}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    fn put_away(&self) -> u64 {
        self.running.stats.scenes.put_away.load(Ordering::Relaxed)
    }

    async fn waits(&self, what: &str, is_so: impl Fn(&Served) -> bool) {
        let begun = Instant::now();
        while !is_so(self) {
            assert!(begun.elapsed() < PATIENCE, "{what}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

fn scene_of(client: &Client) -> &str {
    &client.welcome.as_ref().expect("welcomed").scene_name
}

fn held(client: &Client) -> Resume {
    let secret = client.welcome.as_ref().expect("welcomed").secret;
    Resume { secret, number: client.held.number, digest: client.held.digest() }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_chosen_within_a_file_is_a_scene_of_its_own() {
    let served = served("within", SceneLimits::default(), &[("a.glb", "1"), ("b.glb", "1")]).await;
    let (plain, red) = (served.visited("?scene=a").await, served.visited("?scene=a&variant=red").await);
    let [plain, red] = [plain.expect("the file as it is"), red.expect("its variant")];
    assert_eq!([scene_of(&plain), scene_of(&red)], ["a", "red a"]);
    // What it has not is refused at once where that is known, and after a look at it where not.
    for (query, is_told) in
        [("?scene=a&variant=green", "\"red\", \"blue\""), ("?scene=a&file-scene=1", "there are: none")]
    {
        let (why, again) = served.goodbye(query).await;
        assert!(why.contains(is_told) && !again, "{why}");
    }
    let (why, again) = served.goodbye("?variant=red").await;
    assert!(why.contains("there are: none") && !again, "the first scene is no file: {why}");
    // One file in the list, with all who see any of it.
    let list = request(&served.running, "/scenes", "").await;
    assert_eq!(list.matches("\"name\":\"a").count(), 1, "{list}");
    assert!(list.contains("\"sessions\":2"), "{list}");
    let offer = request(&served.running, "/offer?scene=a", "").await;
    assert!(offer.contains("\"variants\":[\"red\",\"blue\"]") && offer.contains("\"cameras\":[]"), "{offer}");
    // Asking loads nothing.
    for closed in ["c", "b"] {
        assert!(request(&served.running, &format!("/offer?scene={closed}"), "").await.ends_with("{}"), "{closed}");
    }
    let opened = || served.running.stats.scenes.opened.load(Ordering::Relaxed);
    assert_eq!(opened(), 2);
    // Who asks for a choice of a file that nobody has looked at is shown it, once it is known what there is; the same by a number is the same scene.
    let (blue, again) = (served.visited("?scene=b&variant=blue").await, served.visited("?scene=b&variant=01").await);
    assert_eq!([scene_of(&blue.expect("blue")), scene_of(&again.expect("the same"))], ["blue b", "blue b"]);
    assert_eq!(opened(), 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn each_gets_the_scene_that_he_asks_for() {
    let served = served("choose", SceneLimits::default(), &[("a.obj", "1"), ("b.glb", "1"), ("bad.ply", "?")]).await;
    let (reason, again) = served.goodbye("?scene=a").await;
    assert!(reason.contains("the scene is being loaded") && again, "{reason}");
    let (mut a, b) = (served.visited("?scene=a").await.expect("a"), served.visited("?scene=b").await.expect("b"));
    let (first, named) = (served.visited("").await.expect("the first"), served.visited("?scene=room").await);
    assert_eq!([scene_of(&a), scene_of(&b), scene_of(&first)], ["a", "b", "room"]);
    assert_eq!(scene_of(&named.expect("the first")), "room");
    // What cannot be loaded, and what is not there, is said, once and for all; and nobody else notices.
    let why = served.visited("?scene=bad").await.err().expect("it cannot be loaded");
    assert!(why.contains("bad cannot be shown") && why.contains("no such scene"), "{why}");
    for strange in ["?scene=../a", "?scene=%2Fetc%2Fpasswd", "?scene=", "?scene=a.obj"] {
        let why = served.visited(strange).await.err().expect(strange);
        assert!(why.contains("there is no scene") && why.contains("a, b, bad"), "{why}");
    }
    a.run(1.0, |_| false).await.expect("the session goes on");

    let list = request(&served.running, "/scenes", "").await;
    assert!(list.contains("\"uploads\":null"), "{list}");
    for part in ["\"name\":\"room\"", "\"name\":\"bad\",\"open\":false", "\"name\":\"b\",\"open\":true,\"sessions\":1"]
    {
        let mut keys = list.split('{').map(|object| {
            // Keys of an object have no order.
            let has = |pair: &str| object.contains(pair);
            part.split(',').all(has)
        });
        assert!(keys.any(|has| has), "{part} in {list}");
    }
    let metrics = request(&served.running, "/metrics", "").await;
    for line in [
        "vantage_scene_sessions{scene=\"a\"} 1",
        "vantage_scene_bytes{scene=\"b\"} 1048576",
        "vantage_scenes_failed_total 1",
    ] {
        assert!(metrics.contains(line), "{line} in {metrics}");
    }
    let plans = request(&served.running, "/plan", "").await;
    assert!(plans.contains("\"scene\":\"a\"") && plans.contains("\"scene\":\"room\""), "{plans}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fault_ends_no_other_scene_and_what_many_ask_for_is_loaded_once() {
    let served = served("fault", SceneLimits::default(), &[("a.obj", "1"), ("fault.obj", "fault")]).await;
    let why = served.visited("?scene=fault").await.err().expect("it cannot be loaded");
    assert!(why.contains("fault cannot be shown"), "{why}");
    let visits = futures_util::future::join_all((0..20).map(|_| served.visited("?scene=a"))).await;
    assert!(visits.iter().all(|visit| visit.as_ref().is_ok_and(|client| scene_of(client) == "a")));
    assert_eq!(served.running.stats.scenes.opened.load(Ordering::Relaxed), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_goes_on_in_its_own_scene_alone() {
    let served = served("resume", SceneLimits::default(), &[("a.obj", "1"), ("b.obj", "1")]).await;
    let (a, _b) = (served.visited("?scene=a").await.expect("a"), served.visited("?scene=b").await.expect("b"));
    let was_held = held(&a);
    drop(a);
    for (query, resumes) in [("?scene=b", false), ("?scene=a", true)] {
        let mut back = served.client(query, Some(was_held)).await;
        back.run(PATIENCE.as_secs_f64(), |client| client.welcome.is_some()).await.expect("welcomed");
        assert_eq!(back.welcome.as_ref().expect("welcomed").resumed, resumes, "{query}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_nobody_wants_is_put_away_and_comes_again() {
    let limits = SceneLimits { idle: Duration::from_millis(100), ..SceneLimits::default() };
    let served = served("idle", limits, &[("a.obj", "1")]).await;
    let mut a = served.visited("?scene=a").await.expect("a");
    a.run(2.5, |_| false).await.expect("who is there keeps it");
    assert_eq!(served.put_away(), 0);
    // Who is cut off may come back, and who says goodbye does not.
    let normal = CloseFrame { code: CloseCode::Normal, reason: "".into() };
    a.socket.close(Some(normal)).await.expect("closed");
    drop(a);
    served.waits("it is put away", |served| served.put_away() == 1).await;
    let metrics = request(&served.running, "/metrics", "").await;
    assert!(!metrics.contains("vantage_scene_bytes{scene=\"a\"}"), "{metrics}");
    assert_eq!(scene_of(&served.visited("?scene=a").await.expect("a")), "a");
}

#[tokio::test(flavor = "multi_thread")]
async fn no_more_are_open_than_may_be() {
    let limits = SceneLimits { open: 2, ..SceneLimits::default() };
    let served = served("number", limits, &[("a.obj", "1"), ("b.obj", "1"), ("c.obj", "1")]).await;
    let (mut a, b) = (served.visited("?scene=a").await.expect("a"), served.visited("?scene=b").await.expect("b"));
    served.waits_to_be_told("?scene=c", "as many scenes as may be are open (2)").await;
    // Who was cut off may come back, but others are there now.
    drop(b);
    assert_eq!(scene_of(&served.visited("?scene=c").await.expect("c")), "c");
    assert_eq!(served.put_away(), 1);
    a.run(1.0, |_| false).await.expect("the session goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn no_more_memory_is_taken_than_may_be() {
    let limits = SceneLimits { bytes: 5 * MIB, ..SceneLimits::default() };
    let files = [("small.obj", "1"), ("other.obj", "1"), ("large.obj", "4"), ("huge.obj", "6")];
    let served = served("memory", limits, &files).await;
    let mut small = served.visited("?scene=small").await.expect("small");
    let why = served.visited("?scene=huge").await.err().expect("it never fits");
    assert!(why.contains("6 MiB") && why.contains("5 MiB"), "{why}");
    let large = served.visited("?scene=large").await.expect("large");
    served.waits_to_be_told("?scene=other", "other scenes take now that have viewers").await;
    assert_eq!(served.put_away(), 0);
    drop(large);
    assert_eq!(scene_of(&served.visited("?scene=other").await.expect("other")), "other");
    assert_eq!(served.put_away(), 1);
    small.run(1.0, |_| false).await.expect("the session goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn open_scenes_are_loaded_anew_and_stay_where_that_fails() {
    let served = served("reload", SceneLimits::default(), &[("a.obj", "1"), ("b.obj", "1")]).await;
    let (mut a, mut b) = (served.visited("?scene=a").await.expect("a"), served.visited("?scene=b").await.expect("b"));
    std::fs::write(served.folder.join("a.obj"), "2").expect("a file");
    std::fs::write(served.folder.join("b.obj"), "?").expect("a file");
    served.running.reload_others();
    match a.run(PATIENCE.as_secs_f64(), |_| false).await {
        Err(SessionError::Goodbye { reason, again: true }) => assert!(reason.contains("loaded anew"), "{reason}"),
        other => panic!("no goodbye: {other:?}"),
    }
    served.waits("b fails", |served| served.running.stats.scenes.failed.load(Ordering::Relaxed) == 1).await;
    b.run(1.0, |_| false).await.expect("the session goes on");
    served.visited("?scene=a").await.expect("a");
    let metrics = request(&served.running, "/metrics", "").await;
    assert!(metrics.contains("vantage_scene_bytes{scene=\"a\"} 2097152"), "{metrics}");
}
