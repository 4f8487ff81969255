//! What was drawn and done for one viewer, kept for others.
//!
//! Many viewers see the same: whoever opens a link begins where all others did, gets the same first set with the same outlines, sees the same mirrors, and
//! rests and is looked ahead for at the same poses. Of a scene that never changes a [`Request`] says all that an answer depends on, so what came of it
//! is kept ([`Pool`]) and given to whoever asks for exactly the same, on whatever looking thread.
//!
//! - **Images.** [`SharingImager`] stands before the imager that draws: nothing else of the server knows that an image was drawn for somebody else.
//! - **Looks.** What a look does for a client follows from what looks did for it before and from what it asks for ([`LookRequest`]); so the whole of it is repeated
//!   for the next client, see [`crate::frame`].
//!
//! Only what is likely to be asked for again is kept ([`Occasion`](crate::imager::Occasion)): a viewer who moves is looked at from where it is expected, and nobody
//! will ever be expected just there. What such a viewer asks for is looked up, though. A camera that is nearly the same is another one: what lies behind
//! an edge would be seen from the one and not from the other, and rows of a view at rest show nothing but at their very camera.

mod imager;
mod request;
mod store;

pub use imager::SharingImager;
pub use request::{Answer, LookRequest, Looked, Request, Settings, Subject};
pub use store::{Caps, Pool};
