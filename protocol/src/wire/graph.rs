//! Descriptions of graph cameras, as a patch carries them.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use camera::{GraphCamera, GraphDescription};

/// What the description of a graph camera may take: [`GRAPH_MAX_FRUSTA`] frusta of a few hundred bytes each.
pub(crate) const GRAPH_LIMIT_BYTES: usize = 256 * 1024;
/// The most frusta of a camera on the wire: a client cuts every ray with all of them.
pub const GRAPH_MAX_FRUSTA: usize = 256;

fn graph_config() -> Configuration<LittleEndian, Fixint, Limit<GRAPH_LIMIT_BYTES>> {
    bincode::config::legacy().with_limit::<GRAPH_LIMIT_BYTES>()
}

/// Whether a camera is small enough for [`encode_graph`].
pub(crate) fn is_graph_encodable(camera: &GraphCamera) -> bool {
    camera.description().frusta.len() < GRAPH_MAX_FRUSTA && encoded_graph(camera).is_some()
}

fn encoded_graph(camera: &GraphCamera) -> Option<Vec<u8>> {
    bincode::serde::encode_to_vec(camera.description(), graph_config()).ok().filter(|b| b.len() <= GRAPH_LIMIT_BYTES)
}

/// The bytes of a graph camera's description.
pub(crate) fn encode_graph(camera: &GraphCamera) -> Vec<u8> {
    encoded_graph(camera).expect("a held camera is encodable")
}

/// Reads what [`encode_graph`] wrote; `None` where it makes no camera.
pub(crate) fn decode_graph(bytes: &[u8]) -> Option<GraphCamera> {
    let (description, read): (GraphDescription, usize) =
        bincode::serde::decode_from_slice(bytes, graph_config()).ok()?;
    let is_fit = read == bytes.len() && description.frusta.len() < GRAPH_MAX_FRUSTA;
    is_fit.then(|| GraphCamera::from_description(&description).ok())?
}
