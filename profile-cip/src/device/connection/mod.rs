//! Connections: which ones there are, and what a Forward_Open of one must be like.

pub(super) mod assembly;
pub mod manager;
pub mod motion;
pub(super) mod path;
pub(super) mod refusal;
