//! Both copies of what a client holds, and what crosses between them.

use protocol::codec::{Coding, ColourSteps, Profile};
use protocol::plain::{read_update, write_update};
use protocol::wire::{decode_update, encode_update};
use protocol::{Edit, Held, Limits, Update};

/// The server's copy and the client's.
#[derive(Default)]
pub struct Copies {
    server: Held,
    client: Held,
}

impl Copies {
    /// The server makes an update of these edits, if it can, and sends it; whether it could.
    pub fn exchange(&mut self, edits: Vec<Edit>, coding: Coding) -> bool {
        let before = (self.server.number, self.server.digest());
        let Ok(update) = self.server.commit(edits, 0.25, 3) else {
            assert_eq!((self.server.number, self.server.digest()), before, "a refused update changed the copy");
            return false;
        };
        let received = crossed(&update, coding);
        if let Err(error) = self.client.apply(&received) {
            panic!("the client refuses what the server holds: {error}");
        }
        assert_eq!((self.client.number, self.client.digest()), (self.server.number, self.server.digest()));
        true
    }

    /// Whether both are the same, and who comes late gets the same.
    pub fn check(&self) {
        let mut late = Held::default();
        if let Err(error) = late.apply(&crossed(&self.server.whole(), Coding::default())) {
            panic!("who comes late refuses the whole: {error}");
        }
        for copy in [&self.client, &late] {
            assert_eq!((copy.number, copy.digest()), (self.server.number, self.server.digest()));
            assert_eq!(copy.sample_count(), self.server.sample_count());
            assert!(plain(&copy.whole()) == plain(&self.server.whole()), "the copies differ");
        }
    }
}

/// One of all ways to code patches.
pub fn coding(choice: u8) -> Coding {
    let profile = if choice & 1 == 1 { Profile::Fast } else { Profile::Dense };
    Coding { profile, colour: ColourSteps::ALL[usize::from(choice >> 1) % 3] }
}

/// An update on the other side, by the wire and by plain bytes.
pub fn crossed(update: &Update, coding: Coding) -> Update {
    let bytes = encode_update(update, coding).bytes;
    let received = decode_update(&bytes, &Limits::default())
        .unwrap_or_else(|error| panic!("what was encoded is refused: {error}"));
    let sent = plain(update);
    assert!(plain(&received) == sent, "another update comes back");
    let again = read_update(&sent).unwrap_or_else(|error| panic!("plain bytes are refused: {error}"));
    assert!(plain(&again) == sent, "another update comes back from plain bytes");
    received
}

/// Bytes that tell any two updates apart: numbers that are none are equal to themselves in them.
pub fn plain(update: &Update) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_update(update, &mut bytes);
    bytes
}

/// Rounds colours to what a coding gives back.
pub fn settle(edits: &mut [Edit], coding: Coding) {
    for edit in edits {
        if let Edit::Add(patch) = edit {
            coding.colour.settle_all(&mut patch.image.colour);
        }
    }
}
