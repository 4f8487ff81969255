//! The server: plan -> discretize -> encode -> socket.
//!
//! - [`app`]: a server's life; `routes`: what its port answers; [`page`]: the web client in it; `metrics`: its figures for Prometheus; [`session`]: one client's connection, on either
//!   clock; [`audience`]: clients that follow another; [`publish`], [`relay`]: the same beyond one host, by a [`broker`].
//! - [`viewer`]: where a viewer will be; [`plan`]: where to look for what it lacks; [`account`]: the copy of what it holds, and
//!   what it lacks; [`beside`]: the same found out on the GPU; [`pace`]: how large images are while it moves; [`frame`]: one tick,
//!   from scene time to edits; [`worker`]: the threads that run it for all sessions in turn; [`imager`]: what they need from a GPU;
//!   [`bodies`]: what is sent as triangles instead; [`pool`]: what was drawn for one viewer, kept for others.
//! - [`render`]: the scene on the GPU; [`discretize`]: depth images of it; [`truth`]: the picture that a reconstruction is
//!   compared with; [`impostors`]: images for mirrors and glass, and which are needed; [`lights`]: what lights see that cast
//!   soft shadows; [`occluders`]: what occludes that the eye never saw; [`look`]: its lights as both ends shade with them; `sky`:
//!   light from all around.
//! - [`operate`]: a server as its operator sees it, by [`signals`]; [`serving`]: which scene new sessions get; [`uploads`]: what people bring; `thumbnail`: small pictures of scenes; [`prepare`]: a scene made ready; [`notify`]: for
//!   systemd; [`agones`]: for Kubernetes.
//! - [`start`], [`scale`], [`source`]: which scene, and where one begins in it; [`cameras`]: cameras that people write for it; [`asked`]: one
//!   whose image a client asked for.
//! - [`config`], [`limits`], [`options`], [`port_options`]: what a server is told; [`settings`]: from where; [`coding`]: how samples are coded; [`access`]: who may connect; [`tls`]: over what;
//!   [`stats`]: what it counts; [`peers`]: what one address may take, and the door; `http`: requests with time-outs; `open_files`: how many connections; [`fault`]: mistakes, met
//!   where they happen; [`devices`]: a GPU after another; [`log`]: lines that nobody waits for.

// Whether a pipeline of wgpu may go from thread to thread is asked through all that it consists of.
#![recursion_limit = "256"]

pub mod access;
pub mod account;
pub mod agones;
mod allowance;
pub mod anticipate;
pub mod app;
pub mod asked;
pub mod audience;
pub mod beside;
pub mod bodies;
pub mod broker;
pub mod cameras;
pub mod client;
pub mod coding;
pub mod config;
pub mod density;
pub mod devices;
pub mod discretize;
pub mod fault;
mod figures;
pub mod frame;
mod host;
mod http;
pub mod imager;
pub mod impostors;
mod inventories;
mod lattice;
pub mod lights;
pub mod limits;
pub mod log;
pub mod look;
pub mod look_times;
pub mod made;
mod memory;
mod metrics;
pub mod notify;
pub mod occluders;
mod open_files;
pub mod operate;
pub mod options;
pub mod pace;
pub mod page;
pub mod peers;
pub mod plan;
pub mod pool;
pub mod port_options;
mod portions;
pub mod prepare;
pub mod publish;
mod queue;
pub mod relay;
pub mod render;
pub mod rest;
mod revise;
mod routes;
pub mod scale;
mod scene_host;
pub mod serving;
pub mod session;
pub mod settings;
pub mod signals;
mod sky;
pub mod source;
pub mod stage_error;
pub mod start;
pub mod stats;
mod targets;
mod thumbnail;
mod timer;
pub mod tls;
pub mod truth;
pub mod uploads;
pub mod viewer;
mod whereabouts;
pub mod worker;

pub use app::{Running, serve};
pub use config::Config;
