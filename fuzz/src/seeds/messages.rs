//! Messages, patches, updates, and the bytes that make some.

use std::sync::Arc;

use protocol::codec::{Coding, ColourSteps, Profile, encode_patch};
use protocol::message::{Clock, ServerMessage};
use protocol::plain::write_update;
use protocol::sky::SkyLevel;
use protocol::wire::{Envelope, encode_client, encode_server, encode_update};
use protocol::{Edit, Held, Sky, Update};

use crate::make::{Noise, Source};

/// So many bytes that look like chance.
fn noise(seed: u64, count: usize) -> Vec<u8> {
    let mut noise = Noise(seed);
    (0..count).map(|_| noise.next() as u8).collect()
}

fn tagged(kind: u8, bytes: &[u8]) -> Vec<u8> {
    [&[kind], bytes].concat()
}

/// A copy's life of many edits, as it was sent.
fn updates(seed: u64) -> Vec<Update> {
    let bytes = noise(seed, 4000);
    let (mut source, mut held, mut newest) = (Source::new(&bytes), Held::default(), 0);
    let mut next = || held.commit(vec![source.edit(&mut newest)], 0.5, 1).ok();
    (0..60).filter_map(|_| next()).collect()
}

/// A sky of the roughest level alone.
fn sky() -> Edit {
    let number = Sky::LEVELS - 1;
    let texels = (0..Sky::side_px(number).pow(2)).map(|at| [(at as u16) << Sky::CUT_BITS, 0x3c00, 0x1000]).collect();
    Edit::Sky(Arc::new(Sky {
        diffuse: [[0.5; 3]; Sky::HARMONICS],
        first_level: number as u8,
        levels: vec![SkyLevel { texels }],
    }))
}

/// An update of all edits that may follow each other.
fn whole(seed: u64) -> Update {
    let mut edits: Vec<Edit> = vec![Edit::Clear, sky()];
    edits
        .extend(updates(seed).into_iter().flat_map(|update| update.edits).filter(|edit| *edit != Edit::Clear).take(12));
    let sound = |edits: Vec<Edit>| Held::default().commit(edits, 0.5, 1);
    while edits.len() > 2 && sound(edits.clone()).is_err() {
        edits.pop();
    }
    sound(edits).expect("a sky is whole")
}

pub fn wire() -> Vec<(String, Vec<u8>)> {
    let bytes = noise(1, 4000);
    let mut source = Source::new(&bytes);
    let mut seeds = Vec::new();
    for at in 0..24 {
        let envelope = Envelope { at_s: 0.25, message: source.client_message(Clock::Wall) };
        seeds.push((format!("client-{at}"), tagged(0, &encode_client(&envelope))));
        let envelope = Envelope { at_s: 0.25, message: source.server_message() };
        seeds.push((format!("server-{at}"), tagged(1, &encode_server(&envelope)[0])));
    }
    let small = Update { edits: vec![Edit::Clear, Edit::Join(7)], ..whole(3) };
    let fragments = encode_server(&Envelope { at_s: 1.0, message: ServerMessage::Update(Box::new(small)) });
    let lengthy = fragments.iter().flat_map(|bytes| tagged(bytes.len() as u8, bytes)).collect::<Vec<u8>>();
    seeds.push(("fragments".to_owned(), tagged(2, &lengthy)));
    for seed in 0..6 {
        let update = whole(seed);
        seeds.push((format!("update-{seed}"), tagged(3, &encode_update(&update, Coding::default()).bytes)));
        let mut plain = Vec::new();
        write_update(&update, &mut plain);
        seeds.push((format!("plain-{seed}"), tagged(4, &plain)));
    }
    seeds
}

pub fn codec() -> Vec<(String, Vec<u8>)> {
    let mut seeds = Vec::new();
    for seed in 0..6 {
        let coding = Coding {
            profile: if seed % 2 == 0 { Profile::Dense } else { Profile::Fast },
            colour: ColourSteps::ALL[seed as usize % 3],
        };
        let patches = (0..).map(|round| Source::new(&noise(seed + 6 * round, 300)).patch(seed as u32));
        let mut patch = patches.into_iter().find(|patch| patch.image.camera.is_valid()).expect("most are");
        coding.colour.settle_all(&mut patch.image.colour);
        seeds.push((format!("patch-{seed}"), tagged(0, &encode_patch(&patch, coding))));
        seeds.push((format!("update-{seed}"), tagged(1, &encode_update(&whole(seed), coding).bytes)));
        for (name, kind) in [("image", 2), ("damaged", 3), ("edits", 4)] {
            // Of all ways to code.
            seeds.push((format!("{name}-{seed}"), tagged(kind + 80 * (seed as u8 % 3), &noise(seed + 9, 600))));
        }
    }
    seeds
}

pub fn session() -> Vec<(String, Vec<u8>)> {
    (0..18).map(|seed| (format!("{seed}"), tagged((seed as u8 % 6) * 43, &noise(seed, 400)))).collect()
}
