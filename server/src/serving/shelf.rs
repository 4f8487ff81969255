//! Scenes of a folder, and such as people brought: each is loaded when somebody asks for it, one at a time, and put away when nobody has been there for a while, or when there must be
//! room for another one.
//!
//! Whoever asks is told how far his scene is, and comes again, as clients of a server do whose only scene is being loaded. What he is told stands in the
//! books; loading itself is the work of one task (`tend`).

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use tokio::sync::Notify;

use super::not_open::{NotOpen, loading};
use super::stock::Stock;
use super::within::{SceneFile, Within, file_of};
use crate::limits::SceneLimits;
use crate::session::{House, Over, Shared};
use crate::uploads;

/// Who asks for a scene that could not be loaded is told so for so long; then it is tried again.
const FAILED_FOR: Duration = Duration::from_secs(10);
/// The same where there was no room: that changes as soon as somebody leaves.
const CROWDED_FOR: Duration = Duration::from_secs(2);

/// Scenes that wait to be loaded, at most.
const MOST_ASKED: usize = 64;

/// See the module.
pub(super) struct Shelf {
    stock: Stock,
    limits: SceneLimits,
    /// What its scenes share with all others.
    pub house: House,
    books: Mutex<BTreeMap<String, Book>>,
    /// Of all that are open or were, of those that all may know of.
    thumbnails: Mutex<BTreeMap<String, Bytes>>,
    /// Told when something is to be loaded.
    pub asked: Notify,
}

/// A scene that somebody asked for.
enum Book {
    /// It is to be loaded, from this file.
    Asked(SceneFile),
    /// It is being loaded, and so far it is.
    Loading(String),
    Open(Open),
    /// It was not opened, and is not before a time.
    Shut {
        why: NotOpen,
        until: Instant,
    },
}

struct Open {
    shared: Arc<Shared>,
    file: SceneFile,
    /// When somebody was last here.
    wanted_at: Instant,
    /// It is to be loaded anew.
    is_old: bool,
}

impl Shelf {
    /// With nothing loaded.
    pub fn new(stock: Stock, limits: SceneLimits, house: House) -> Shelf {
        Shelf { stock, limits, house, books: Mutex::default(), thumbnails: Mutex::default(), asked: Notify::new() }
    }

    /// A scene by its file's name and what is chosen within that, or what to tell who comes too early. Reads the folder. Where it is not known what the file has, it is loaded as it is
    /// first: nothing is loaded of which nobody knows that it is there.
    pub fn open(&self, file: &str, within: &Within) -> Result<Arc<Shared>, NotOpen> {
        if within.is_nothing() {
            return self.open_known(file, within);
        }
        let shared = self.open_of(file).map_or_else(|| self.open_known(file, &Within::default()), Ok)?;
        let within = within.resolved(&shared.scene.offer).map_err(NotOpen::for_ever)?;
        self.open_known(file, &within)
    }

    /// The same of one that is open now; it stays open no longer for that.
    pub fn peek(&self, file: &str, within: &Within) -> Option<Arc<Shared>> {
        let within = within.resolved(&self.open_of(file)?.scene.offer).ok()?;
        match self.books().get(&within.name(file))? {
            Book::Open(open) => Some(open.shared.clone()),
            _ => None,
        }
    }

    fn open_known(&self, file: &str, within: &Within) -> Result<Arc<Shared>, NotOpen> {
        let name = within.name(file);
        if let Some(known) = known(&mut self.books(), &name) {
            return known;
        }
        let path = self.stock.file(file).map_err(NotOpen::for_ever)?;
        // Somebody else may have asked meanwhile: looking and writing are one.
        let mut books = self.books();
        known(&mut books, &name).unwrap_or_else(|| {
            // Of a file that somebody brought there may be as many choices as he likes.
            if books.values().filter(|book| matches!(book, Book::Asked(_))).count() >= MOST_ASKED {
                return Err(NotOpen::for_now(format!("{MOST_ASKED} scenes are to be loaded before it")));
            }
            books.insert(name, Book::Asked(SceneFile { path, within: within.clone() }));
            self.asked.notify_one();
            Err(NotOpen::for_now(loading("")))
        })
    }

    /// A scene of a file that is open, whatever is chosen within it.
    fn open_of(&self, file: &str) -> Option<Arc<Shared>> {
        self.open_ones().into_iter().find(|(name, _)| file_of(name) == file).map(|(_, shared)| shared)
    }

    /// What is to be loaded next, and its file: what nobody can see yet before what is to be loaded anew. `None` where nothing is.
    pub fn next_asked(&self) -> Option<(String, SceneFile)> {
        let asked = |book: &Book| match book {
            Book::Asked(file) => Some((false, file.clone())),
            Book::Open(Open { file, is_old: true, .. }) => Some((true, file.clone())),
            _ => None,
        };
        let books = self.books();
        let all = books.iter().filter_map(|(name, book)| asked(book).map(|(is_old, file)| (is_old, name, file)));
        // Files before what is chosen within them.
        all.min_by_key(|(is_old, name, _)| (*is_old, file_of(name) != name.as_str()))
            .map(|(_, name, file)| (name.clone(), file))
    }

    /// Loading has begun, or is so far. One that is loaded anew is open meanwhile.
    pub fn says(&self, name: &str, said: String) {
        if let Some(book) = self.books().get_mut(name)
            && !matches!(book, Book::Open(_))
        {
            *book = Book::Loading(said);
        }
    }

    /// A scene was loaded: it is open from now on, if it fits beside what others take outside of the shelf. Sessions of the one before are told to come again.
    pub fn show(&self, (name, file): (&str, SceneFile), shared: Arc<Shared>, others_bytes: u64) {
        let needed = shared.scene.bytes();
        let room = self.limits.bytes.saturating_sub(others_bytes);
        if needed > room {
            let why =
                format!("{name} needs {} of memory, and {} are left for scenes", mebibytes(needed), mebibytes(room));
            return self.shut(name, NotOpen::for_ever(why), FAILED_FOR);
        }
        if !self.make_room(name, room - needed) {
            let why =
                format!("{name} needs {} of memory, which other scenes take now that have viewers", mebibytes(needed));
            return self.shut(name, NotOpen::for_now(why), CROWDED_FOR);
        }
        if let Some(thumbnail) =
            shared.thumbnail.clone().filter(|_| !uploads::is_brought(name) && file.within.is_nothing())
        {
            self.thumbnails().insert(name.to_owned(), thumbnail);
        }
        let open = Open { shared, file, wanted_at: Instant::now(), is_old: false };
        self.house.stats.scenes.opened.fetch_add(1, Ordering::Relaxed);
        if let Some(Book::Open(before)) = self.books().insert(name.to_owned(), Book::Open(open)) {
            self.put_away(&before);
        }
    }

    /// A scene is not opened. One that is open already stays as it is.
    pub fn shut(&self, name: &str, why: NotOpen, lasts: Duration) {
        let mut books = self.books();
        match books.get_mut(name) {
            Some(Book::Open(open)) => open.is_old = false,
            _ => {
                books.insert(name.to_owned(), Book::Shut { why, until: Instant::now() + lasts });
            }
        }
    }

    /// A scene could not be loaded. Where the folder is stands in the log alone.
    pub fn failed(&self, name: &str, why: &str) {
        tracing::error!("{name} cannot be shown: {why}");
        let why = self.stock.without_paths(why);
        self.house.stats.scenes.failed.fetch_add(1, Ordering::Relaxed);
        self.shut(name, NotOpen::for_ever(format!("{name} cannot be shown: {why}")), FAILED_FOR);
    }

    /// Makes sure that one more may be open. Otherwise who asked is told.
    pub fn has_place(&self, name: &str) -> bool {
        let most = self.limits.open;
        let count = |shelf: &Shelf| shelf.books().values().filter(|book| matches!(book, Book::Open(_))).count();
        while count(self) >= most && !self.is_open(name) {
            if !self.put_away_oldest(name) {
                let why = format!("as many scenes as may be are open ({most}), and all have viewers");
                self.shut(name, NotOpen::for_now(why), CROWDED_FOR);
                return false;
            }
        }
        true
    }

    /// All that are open are loaded anew, one after the other.
    pub fn reload(&self) {
        for book in self.books().values_mut() {
            if let Book::Open(open) = book {
                open.is_old = true;
            }
        }
        self.asked.notify_one();
    }

    /// Puts away what nobody has wanted for a while, and what can be drawn no more.
    pub fn tidy(&self, now: Instant) {
        self.books().retain(|name, book| match book {
            Book::Open(open) => {
                if open.shared.is_wanted() {
                    open.wanted_at = now;
                }
                let failure = open.shared.worker.failure().borrow().clone();
                let is_idle = now.duration_since(open.wanted_at) >= self.limits.idle;
                match &failure {
                    Some(why) => tracing::error!("{name} can be drawn no more: {why}"),
                    None if is_idle => tracing::info!("{name} is put away: nobody is there"),
                    None => return true,
                }
                self.put_away(open);
                false
            }
            Book::Shut { until, .. } => *until > now,
            Book::Asked(_) | Book::Loading(_) => true,
        });
        let has_some = |prefix: &str| self.books().keys().any(|name| name.starts_with(prefix));
        self.stock.tidy(now, self.limits.idle, has_some);
    }

    /// Tells all sessions that they are over.
    pub fn end(&self, over: Over) {
        self.each_open(|_, open| open.shared.end(over));
        self.stock.close();
    }

    /// Where its scenes are from.
    pub fn stock(&self) -> &Stock {
        &self.stock
    }

    /// What sessions of each open scene share, by its name.
    pub fn open_ones(&self) -> Vec<(String, Arc<Shared>)> {
        let mut ones = Vec::new();
        self.each_open(|name, open| ones.push((name.to_owned(), open.shared.clone())));
        ones
    }

    /// A small picture of a scene that is or was open.
    pub fn thumbnail(&self, name: &str) -> Option<Bytes> {
        self.thumbnails().get(name).cloned()
    }

    fn each_open(&self, mut does: impl FnMut(&str, &Open)) {
        for (name, book) in &*self.books() {
            if let Book::Open(open) = book {
                does(name, open);
            }
        }
    }

    fn is_open(&self, name: &str) -> bool {
        matches!(self.books().get(name), Some(Book::Open(_)))
    }

    /// Puts scenes away, those first that were wanted longest ago, until all but one take no more than so many bytes; whether that was possible.
    fn make_room(&self, but: &str, most_bytes: u64) -> bool {
        loop {
            let mut taken = 0;
            self.each_open(|name, open| taken += if name == but { 0 } else { open.shared.scene.bytes() });
            if taken <= most_bytes {
                return true;
            }
            if !self.put_away_oldest(but) {
                return false;
            }
        }
    }

    /// Puts away the one that was wanted longest ago, of those that nobody is in; whether there was one. Where somebody may come back to, that goes last.
    fn put_away_oldest(&self, but: &str) -> bool {
        let mut books = self.books();
        let unwanted = books.iter().filter_map(|(name, book)| match book {
            Book::Open(open) if name != but && open.shared.session_count() == 0 => {
                Some((open.shared.is_wanted(), open.wanted_at, name.clone()))
            }
            _ => None,
        });
        let Some((_, _, name)) = unwanted.min() else { return false };
        if let Some(Book::Open(open)) = books.remove(&name) {
            tracing::info!("{name} is put away, to make room");
            self.put_away(&open);
        }
        true
    }

    /// Its sessions are told to come again, and what it took goes back to the system.
    fn put_away(&self, open: &Open) {
        open.shared.end(Over::Replaced);
        self.house.stats.scenes.put_away.fetch_add(1, Ordering::Relaxed);
        self.house.ended.notify_one();
    }

    fn thumbnails(&self) -> MutexGuard<'_, BTreeMap<String, Bytes>> {
        self.thumbnails.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn books(&self) -> MutexGuard<'_, BTreeMap<String, Book>> {
        self.books.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the books say of a scene.
fn known(books: &mut BTreeMap<String, Book>, name: &str) -> Option<Result<Arc<Shared>, NotOpen>> {
    Some(match books.get_mut(name)? {
        Book::Shut { until, .. } if *until <= Instant::now() => return None,
        Book::Shut { why, .. } => Err(why.clone()),
        Book::Asked(_) => Err(NotOpen::for_now("the scene is being loaded, after another one".to_owned())),
        Book::Loading(said) => Err(NotOpen::for_now(loading(said))),
        Book::Open(open) => {
            open.wanted_at = Instant::now();
            Ok(open.shared.clone())
        }
    })
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}
