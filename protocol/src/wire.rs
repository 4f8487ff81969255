//! The wire format: with `graph`, the only file that names the serializer.
//!
//! Every websocket message is binary and begins with an envelope of nine bytes: its kind, and `at_s` (f64), its time on the
//! sender's clock. Then:
//!
//! | kind | from | what follows |
//! |---|---|---|
//! | 0 | both | a control message: everything but an update, in bincode's legacy form (fixed little-endian widths) |
//! | 1 | server | a fragment of an update: update number (u32, low bits), bytes of the whole update (u32), offset (u32), bytes |
//!
//! An update's bytes are a head of [`UpdateHead`] and its edits one after the other, hand-laid, samples by the
//! [`codec`]. It is split into fragments of at most [`FRAGMENT_BYTES`], so that a pong or a farewell never
//! waits long behind bulk, and so that no message is large.

pub(crate) mod graph;

use std::sync::Arc;

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bytes::Bytes;
use camera::Rigid;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::bytes::{EndsEarly, Reader, Writer};
use crate::codec::{self, CodecError, CodedSamples, Coding, Packer, Unpacker};
use crate::held::{Edit, PatchId, Update};
use crate::inventory::Inventory;
use crate::limits::Limits;
use crate::message::{ClientMessage, ServerMessage, Welcome};
use crate::staging::Playback;
pub use graph::GRAPH_MAX_FRUSTA;

/// Bytes of an update in one message at most.
pub const FRAGMENT_BYTES: usize = 32 * 1024;
/// Kind and time.
pub const ENVELOPE_BYTES: usize = 9;
const CONTROL: u8 = 0;
const FRAGMENT: u8 = 1;
/// What the serializer may read or allocate for one control message.
const CONTROL_LIMIT_BYTES: usize = 32 * 1024;

type Config = Configuration<LittleEndian, Fixint, Limit<CONTROL_LIMIT_BYTES>>;

fn config() -> Config {
    bincode::config::legacy().with_limit::<CONTROL_LIMIT_BYTES>()
}

/// A message with its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope<M> {
    /// On the sender's clock, in seconds; always finite. See [`crate::message`].
    pub at_s: f64,
    /// What is said.
    pub message: M,
}

/// Why a message was refused: the sender is at fault, or what lies between.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WireError {
    /// The message ends before what it says does.
    #[error(transparent)]
    EndsEarly(#[from] EndsEarly),
    /// Longer than [`Limits`] allow.
    #[error("a message of {bytes} bytes, at most {limit} are allowed")]
    TooLarge {
        /// Its size.
        bytes: usize,
        /// The limit.
        limit: usize,
    },
    /// A kind that does not exist, or that this end never receives.
    #[error("message of unknown kind {0}")]
    Kind(u8),
    /// Its time is infinite or not a number.
    #[error("a message without a finite time")]
    Time,
    /// The serializer refused a control message.
    #[error("malformed control message: {0}")]
    Control(String),
    /// A fragment that does not go on where the last one ended.
    #[error("a fragment out of sequence: {0}")]
    Fragment(&'static str),
    /// Samples that are damaged or too many.
    #[error("in update: {0}")]
    Codec(#[from] CodecError),
}

/// What a server sends in one websocket message.
#[derive(Debug, Clone, PartialEq)]
pub enum ServerPacket {
    /// Everything but an update.
    Control(ServerMessage),
    /// A part of an update, for an [`Assembler`].
    Fragment(Fragment),
}

/// A part of an update.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fragment {
    /// Low bits of the update's number.
    pub update: u32,
    /// Bytes of the whole update.
    pub total_bytes: u32,
    /// Where `bytes` belong.
    pub offset: u32,
    /// At most [`FRAGMENT_BYTES`].
    pub bytes: Vec<u8>,
}

/// [`ServerMessage`] without bulk.
#[derive(Serialize, Deserialize)]
enum ServerControl {
    Welcome(Welcome),
    Pong(u32),
    Advanced { to_s: f64 },
    Goodbye { reason: String, again: bool },
    Presenter { world_from_eye: Rigid, playback: Playback },
    Inventory(Inventory),
    Name { object: u16, name: String },
}

/// The bytes of a client's message.
pub fn encode_client(envelope: &Envelope<ClientMessage>) -> Vec<u8> {
    encode_control(envelope.at_s, &envelope.message)
}

/// A client's message.
pub fn decode_client(bytes: &[u8], limits: &Limits) -> Result<Envelope<ClientMessage>, WireError> {
    check_size(bytes, limits.client_message_bytes)?;
    let mut reader = Reader::new(bytes);
    let (kind, at_s) = read_envelope(&mut reader)?;
    match kind {
        CONTROL => Ok(Envelope { at_s, message: decode_control(&mut reader)? }),
        kind => Err(WireError::Kind(kind)),
    }
}

/// The messages that carry what a server says: one, or for an update as many as it has fragments.
pub fn encode_server(envelope: &Envelope<ServerMessage>) -> Vec<Bytes> {
    let control = match &envelope.message {
        ServerMessage::Update(update) => {
            return encode_update(update, Coding::default()).packed(envelope.at_s).fragments.to_vec();
        }
        ServerMessage::Welcome(welcome) => ServerControl::Welcome(welcome.clone()),
        ServerMessage::Pong(number) => ServerControl::Pong(*number),
        ServerMessage::Advanced { to_s } => ServerControl::Advanced { to_s: *to_s },
        ServerMessage::Goodbye { reason, again } => ServerControl::Goodbye { reason: reason.clone(), again: *again },
        &ServerMessage::Presenter { world_from_eye, playback } => ServerControl::Presenter { world_from_eye, playback },
        ServerMessage::Inventory(inventory) => ServerControl::Inventory(inventory.clone()),
        ServerMessage::Name { object, name } => ServerControl::Name { object: *object, name: name.clone() },
    };
    vec![encode_control(envelope.at_s, &control).into()]
}

/// A server's message.
pub fn decode_server(bytes: &[u8], limits: &Limits) -> Result<Envelope<ServerPacket>, WireError> {
    check_size(bytes, limits.server_message_bytes)?;
    let mut reader = Reader::new(bytes);
    let (kind, at_s) = read_envelope(&mut reader)?;
    let message = match kind {
        CONTROL => ServerPacket::Control(match decode_control(&mut reader)? {
            ServerControl::Welcome(welcome) => ServerMessage::Welcome(welcome),
            ServerControl::Pong(number) => ServerMessage::Pong(number),
            ServerControl::Advanced { to_s } => ServerMessage::Advanced { to_s },
            ServerControl::Goodbye { reason, again } => ServerMessage::Goodbye { reason, again },
            ServerControl::Presenter { world_from_eye, playback } => {
                ServerMessage::Presenter { world_from_eye, playback }
            }
            ServerControl::Inventory(inventory) => ServerMessage::Inventory(inventory),
            ServerControl::Name { object, name } => ServerMessage::Name { object, name },
        }),
        FRAGMENT => {
            let (update, total_bytes, offset) = (reader.u32()?, reader.u32()?, reader.u32()?);
            let bytes = reader.take(reader.remaining())?.to_vec();
            ServerPacket::Fragment(Fragment { update, total_bytes, offset, bytes })
        }
        kind => return Err(WireError::Kind(kind)),
    };
    Ok(Envelope { at_s, message })
}

fn encode_control(at_s: f64, message: &impl Serialize) -> Vec<u8> {
    let mut out = Writer::default();
    out.u8(CONTROL);
    out.f64(at_s);
    let body = bincode::serde::encode_to_vec(message, config()).expect("control messages are within the limit");
    out.bytes.extend(body);
    out.bytes
}

fn decode_control<M: for<'de> Deserialize<'de>>(reader: &mut Reader) -> Result<M, WireError> {
    let body = reader.take(reader.remaining())?;
    let (message, read) =
        bincode::serde::decode_from_slice(body, config()).map_err(|error| WireError::Control(error.to_string()))?;
    if read == body.len() { Ok(message) } else { Err(WireError::Control("bytes after the message".into())) }
}

fn read_envelope(reader: &mut Reader) -> Result<(u8, f64), WireError> {
    let (kind, at_s) = (reader.u8()?, reader.f64()?);
    if at_s.is_finite() { Ok((kind, at_s)) } else { Err(WireError::Time) }
}

/// When a server's message was sent, or `None` for one that takes no time on the virtual clock: Welcome, Advanced, Goodbye.
pub(crate) fn travel(bytes: &[u8]) -> Result<Option<f64>, WireError> {
    let mut reader = Reader::new(bytes);
    let (kind, at_s) = read_envelope(&mut reader)?;
    let travels = kind != CONTROL
        || matches!(
            decode_control(&mut reader)?,
            ServerControl::Pong(_)
                | ServerControl::Presenter { .. }
                | ServerControl::Inventory(_)
                | ServerControl::Name { .. }
        );
    Ok(travels.then_some(at_s))
}

/// What a client's message is, for who counts what crosses a socket; `None` where it is malformed.
pub fn client_message_kind(bytes: &[u8]) -> Option<&'static str> {
    let mut reader = Reader::new(bytes);
    read_envelope(&mut reader).ok().filter(|(kind, _)| *kind == CONTROL)?;
    Some(match decode_control(&mut reader).ok()? {
        ClientMessage::Hello(_) => "hello",
        ClientMessage::View(_) => "view",
        ClientMessage::Pose { .. } => "pose",
        ClientMessage::Ack { .. } => "ack",
        ClientMessage::Restart => "restart",
        ClientMessage::Ping(_) => "ping",
        ClientMessage::Advance { .. } => "advance",
        ClientMessage::Draws(_) => "draws",
        ClientMessage::Inventory => "inventory",
        ClientMessage::Stages(_) => "stages",
        ClientMessage::AskName { .. } => "ask_name",
    })
}

/// What a server's message is, for who counts what crosses a socket; `None` where it is malformed. Every fragment is `update`.
pub fn server_message_kind(bytes: &[u8]) -> Option<&'static str> {
    let mut reader = Reader::new(bytes);
    if read_envelope(&mut reader).ok()?.0 == FRAGMENT {
        return Some("update");
    }
    Some(match decode_control(&mut reader).ok()? {
        ServerControl::Welcome(_) => "welcome",
        ServerControl::Pong(_) => "pong",
        ServerControl::Advanced { .. } => "advanced",
        ServerControl::Goodbye { .. } => "goodbye",
        ServerControl::Presenter { .. } => "presenter",
        ServerControl::Inventory(_) => "inventory",
        ServerControl::Name { .. } => "name",
    })
}

fn check_size(bytes: &[u8], limit: usize) -> Result<(), WireError> {
    if bytes.len() > limit { Err(WireError::TooLarge { bytes: bytes.len(), limit }) } else { Ok(()) }
}

/// An update in its bytes, with what the sending session needs to know of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedUpdate {
    /// Head, edits, and what objects do next.
    pub bytes: Vec<u8>,
    /// [`Update::number`].
    pub number: u64,
    /// [`Update::digest`].
    pub digest: u64,
    /// Whether it begins with [`Edit::Clear`].
    pub clears: bool,
    /// Where in `bytes` each edit ends.
    pub ends: Vec<usize>,
}

/// An update in the messages that carry it, each of at most [`FRAGMENT_BYTES`] and a head. Clones share their bytes: as many sessions as like
/// send the same ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedUpdate {
    /// [`Update::number`].
    pub number: u64,
    /// [`Update::digest`].
    pub digest: u64,
    /// Whether it begins with [`Edit::Clear`].
    pub clears: bool,
    /// Bytes of the update, without the messages' heads.
    pub bytes: usize,
    /// The messages, in order.
    pub fragments: Arc<[Bytes]>,
}

impl EncodedUpdate {
    /// Bytes of some of the edits, which must be there.
    pub fn bytes_of(&self, edits: std::ops::Range<usize>) -> usize {
        let end = |edits: usize| edits.checked_sub(1).map_or(UpdateHead::BYTES, |last| self.ends[last]);
        end(edits.end) - end(edits.start)
    }

    /// Its messages, stamped with the sender's time.
    pub fn packed(&self, at_s: f64) -> PackedUpdate {
        PackedUpdate {
            number: self.number,
            digest: self.digest,
            clears: self.clears,
            bytes: self.bytes.len(),
            fragments: fragments(at_s, self).map(Bytes::from).collect(),
        }
    }
}

/// What the first bytes of an update say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateHead {
    /// [`Update::number`].
    pub number: u64,
    /// [`Update::scene_time_s`].
    pub scene_time_s: f64,
    /// [`Update::pose_seq`].
    pub pose_seq: u64,
    /// [`Update::digest`].
    pub digest: u64,
    /// Whether it begins with [`Edit::Clear`].
    pub clears: bool,
    edit_count: u32,
}

impl UpdateHead {
    const BYTES: usize = 37;

    /// The head of [`encode_update`]'s bytes.
    pub fn peek(bytes: &[u8]) -> Result<UpdateHead, WireError> {
        UpdateHead::read(&mut Reader::new(bytes))
    }

    fn read(reader: &mut Reader) -> Result<UpdateHead, WireError> {
        Ok(UpdateHead {
            number: reader.u64()?,
            scene_time_s: reader.f64()?,
            pose_seq: reader.u64()?,
            digest: reader.u64()?,
            clears: reader.u8()? != 0,
            edit_count: reader.u32()?,
        })
    }
}

const ADD: u8 = 1;
const REMOVE: u8 = 2;
const DELETE: u8 = 3;
const TRIM: u8 = 4;
const MOVE: u8 = 5;
const MATERIALS: u8 = 6;
const LIGHT: u8 = 7;
const PLACE: u8 = 8;
const WITHDRAW: u8 = 9;
const SKY: u8 = 10;
const JOIN: u8 = 11;
const BODY: u8 = 12;
const SHIFT: u8 = 13;

/// The bytes of an update, before they are split; colours must be settled by `coding`. Pure: it may run on any thread.
pub fn encode_update(update: &Update, coding: Coding) -> EncodedUpdate {
    encode_update_with(update, &CodedSamples::of(&update.edits, coding))
}

/// The same of an update whose samples are coded already.
pub fn encode_update_with(update: &Update, samples: &CodedSamples) -> EncodedUpdate {
    let mut out = Writer { bytes: Vec::with_capacity(UpdateHead::BYTES) };
    let clears = matches!(update.edits.first(), Some(Edit::Clear));
    let edits = &update.edits[usize::from(clears)..];
    out.u64(update.number);
    out.f64(update.scene_time_s);
    out.u64(update.pose_seq);
    out.u64(update.digest);
    out.u8(clears.into());
    out.u32(u32::try_from(edits.len()).expect("fewer than 2^32 edits"));
    let mut packer = Packer::new();
    let mut coded = samples.patches();
    // Clearing is said by the head.
    let mut ends = if clears { vec![out.bytes.len()] } else { Vec::new() };
    for edit in edits {
        match edit {
            Edit::Add(patch) => {
                out.u8(ADD);
                out.block(&codec::patch_bytes(patch, coded.next().expect("samples of each added patch")));
            }
            edit => write_edit(edit, &mut packer, &mut out),
        }
        ends.push(out.bytes.len());
    }
    write_section(&codec::next_bytes(&update.next), &mut packer, &mut out);
    EncodedUpdate { bytes: out.bytes, number: update.number, digest: update.digest, clears, ends }
}

/// The update of [`encode_update`]'s bytes. Pure: it may run on any thread, away from the one that draws.
pub fn decode_update(bytes: &[u8], limits: &Limits) -> Result<Update, WireError> {
    check_size(bytes, limits.update_bytes)?;
    let mut reader = Reader::new(bytes);
    let head = UpdateHead::read(&mut reader)?;
    let count = head.edit_count as usize;
    // Every edit takes a byte at least.
    if count > limits.update_edits || count > reader.remaining() {
        return Err(CodecError::TooMuch("edits").into());
    }
    let mut edits = Vec::with_capacity(count + usize::from(head.clears));
    if head.clears {
        edits.push(Edit::Clear);
    }
    let mut left = limits.clone();
    let mut unpacker = Unpacker::new();
    for _ in 0..count {
        edits.push(read_edit(&mut reader, &mut unpacker, &mut left)?);
    }
    let next = codec::next_steps(&read_section(&mut reader, &mut unpacker, codec::MOST_OBJECTS)?)?;
    if reader.remaining() > 0 {
        return Err(CodecError::Damaged("bytes after the last step").into());
    }
    let UpdateHead { number, scene_time_s, pose_seq, digest, .. } = head;
    Ok(Update { number, scene_time_s, pose_seq, edits, next, digest })
}

fn write_edit(edit: &Edit, packer: &mut Packer, out: &mut Writer) {
    let table = |out: &mut Writer, tag: u8, table: Vec<u8>| {
        out.u8(tag);
        out.block(&table);
    };
    match edit {
        Edit::Clear => unreachable!("only the first edit clears, and the head says so"),
        Edit::Add(_) => unreachable!("patches are coded side by side, see CodedSamples"),
        Edit::Remove(id) => {
            out.u8(REMOVE);
            out.u32(id.0);
        }
        Edit::Delete(id, addresses) => {
            out.u8(DELETE);
            out.u32(id.0);
            codec::write_addresses(addresses.iter().copied(), packer, out);
        }
        Edit::Trim(id, trims) => {
            out.u8(TRIM);
            out.u32(id.0);
            codec::write_addresses(trims.iter().map(|&(x, y, _)| (x, y)), packer, out);
            packer.pack(&trims.iter().map(|&(_, _, extent)| extent).collect::<Vec<u8>>(), out);
        }
        Edit::Move(poses) => {
            out.u8(MOVE);
            codec::write_objects(poses, out);
        }
        Edit::Shift(shifts) => {
            out.u8(SHIFT);
            write_section(&codec::shift_bytes(shifts), packer, out);
        }
        Edit::Place(relief, instances) => {
            out.u8(PLACE);
            codec::write_instances(*relief, instances, out);
        }
        Edit::Withdraw(objects) => {
            out.u8(WITHDRAW);
            codec::write_ids(objects, out);
        }
        Edit::Materials(materials) => table(out, MATERIALS, encode_table(materials)),
        Edit::Light(lighting) => table(out, LIGHT, encode_table(lighting)),
        Edit::Sky(sky) => {
            out.u8(SKY);
            codec::write_sky(sky, packer, out);
        }
        Edit::Body(id, body) => {
            out.u8(BODY);
            out.u32(id.0);
            // Once for a shape, not once a tick: it may take its time.
            codec::write_body(body, &mut Packer::thorough(), out);
        }
        Edit::Join(bits) => {
            out.u8(JOIN);
            out.u64(*bits);
        }
    }
}

/// Appends bytes of poses, and how many they are, packed where that is less.
fn write_section(bytes: &[u8], packer: &mut Packer, out: &mut Writer) {
    out.varint(u32::try_from(bytes.len()).expect("poses stay under 4 GiB"));
    if !bytes.is_empty() {
        packer.pack(bytes, out);
    }
}

/// Of so many objects at most.
fn read_section(reader: &mut Reader, unpacker: &mut Unpacker, most: usize) -> Result<Vec<u8>, WireError> {
    match reader.varint()? as usize {
        0 => Ok(Vec::new()),
        length if length > codec::most_bytes(most) => Err(CodecError::TooMuch("bytes of poses").into()),
        length => Ok(unpacker.unpack(reader, length)?),
    }
}

/// The bytes of an edit that adds no patch, by itself.
pub fn edit_bytes(edit: &Edit) -> Vec<u8> {
    let mut out = Writer::default();
    write_edit(edit, &mut Packer::new(), &mut out);
    out.bytes
}

/// Reads an edit and takes its samples, pixels and ways off `left`.
fn read_edit(reader: &mut Reader, unpacker: &mut Unpacker, left: &mut Limits) -> Result<Edit, WireError> {
    let edit = match reader.u8()? {
        ADD => {
            let patch = codec::decode_patch(reader.block()?, left)?;
            let (width_px, height_px) = patch.image.mask.size_px();
            left.update_pixels -= width_px as usize * height_px as usize;
            left.update_samples -= patch.image.sample_count();
            Edit::Add(Box::new(patch))
        }
        REMOVE => Edit::Remove(PatchId(reader.u32()?)),
        DELETE => {
            let id = PatchId(reader.u32()?);
            let addresses = codec::read_addresses(reader, unpacker, left)?;
            left.update_samples -= addresses.len();
            Edit::Delete(id, addresses)
        }
        TRIM => {
            let id = PatchId(reader.u32()?);
            let addresses = codec::read_addresses(reader, unpacker, left)?;
            left.update_samples -= addresses.len();
            let extents = unpacker.unpack(reader, addresses.len())?;
            Edit::Trim(id, addresses.iter().zip(extents).map(|(&(x, y), extent)| (x, y, extent)).collect())
        }
        MOVE => Edit::Move(codec::read_objects(reader)?),
        SHIFT => {
            let shifts = codec::shifts(&read_section(reader, unpacker, left.update_shifts)?, left.update_shifts)?;
            left.update_shifts -= shifts.len();
            Edit::Shift(shifts)
        }
        PLACE => {
            let (relief, instances) = codec::read_instances(reader)?;
            Edit::Place(relief, instances)
        }
        WITHDRAW => Edit::Withdraw(codec::read_ids(reader)?),
        MATERIALS => Edit::Materials(decode_table(reader.block()?)?),
        LIGHT => Edit::Light(Box::new(decode_table(reader.block()?)?)),
        SKY => Edit::Sky(Arc::new(codec::read_sky(reader, unpacker)?)),
        BODY => Edit::Body(PatchId(reader.u32()?), Arc::new(codec::read_body(reader, unpacker, left)?)),
        JOIN => Edit::Join(reader.u64()?),
        _ => return Err(CodecError::Damaged("kind of edit").into()),
    };
    Ok(edit)
}

/// The bytes of a table, or of what else is small.
pub(crate) fn encode_table(table: &impl Serialize) -> Vec<u8> {
    bincode::serde::encode_to_vec(table, config()).expect("tables are within the limit")
}

/// Reads what [`encode_table`] wrote, and no byte more.
pub(crate) fn decode_table<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T, WireError> {
    let (table, read) =
        bincode::serde::decode_from_slice(bytes, config()).map_err(|error| WireError::Control(error.to_string()))?;
    if read == bytes.len() { Ok(table) } else { Err(CodecError::Damaged("bytes after a table").into()) }
}

/// The messages of an update's fragments, in order.
fn fragments(at_s: f64, update: &EncodedUpdate) -> impl Iterator<Item = Vec<u8>> + '_ {
    let total_bytes = u32::try_from(update.bytes.len()).expect("updates stay under 4 GiB");
    update.bytes.chunks(FRAGMENT_BYTES).enumerate().map(move |(index, bytes)| {
        let mut out = Writer { bytes: Vec::with_capacity(ENVELOPE_BYTES + 12 + bytes.len()) };
        out.u8(FRAGMENT);
        out.f64(at_s);
        out.u32(update.number as u32);
        out.u32(total_bytes);
        out.u32((index * FRAGMENT_BYTES) as u32);
        out.bytes.extend_from_slice(bytes);
        out.bytes
    })
}

/// Puts updates together again. Fragments come in order, for the transport keeps it.
#[derive(Debug, Default)]
pub struct Assembler {
    update: u32,
    total_bytes: u32,
    bytes: Vec<u8>,
}

impl Assembler {
    /// Takes the next fragment; gives the bytes of the update with its last one. Memory grows with the bytes that came, not
    /// with what a fragment claims.
    pub fn push(&mut self, fragment: Fragment, limits: &Limits) -> Result<Option<Vec<u8>>, WireError> {
        let Fragment { update, total_bytes, offset, bytes } = fragment;
        check_size(&bytes, FRAGMENT_BYTES)?;
        if total_bytes as usize > limits.update_bytes {
            return Err(WireError::TooLarge { bytes: total_bytes as usize, limit: limits.update_bytes });
        }
        if offset == 0 && self.bytes.is_empty() {
            (self.update, self.total_bytes) = (update, total_bytes);
        }
        if (update, total_bytes) != (self.update, self.total_bytes) {
            return Err(WireError::Fragment("of another update"));
        }
        if offset as usize != self.bytes.len() || bytes.is_empty() {
            return Err(WireError::Fragment("not where the last one ended"));
        }
        if self.bytes.len() + bytes.len() > total_bytes as usize {
            return Err(WireError::Fragment("past the update's end"));
        }
        self.bytes.extend_from_slice(&bytes);
        Ok((self.bytes.len() == total_bytes as usize).then(|| std::mem::take(&mut self.bytes)))
    }

    /// Bytes of the update that is still on its way, received and in all.
    pub fn progress_bytes(&self) -> (usize, usize) {
        (self.bytes.len(), if self.bytes.is_empty() { 0 } else { self.total_bytes as usize })
    }
}
