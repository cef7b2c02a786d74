//! Wrong input on every side of the box while its axes move: refused with what the standard says, counted
//! under its
//! name, and nothing moves because of it.

mod explicit;
mod frames;
mod fuzz;
mod strangers;
mod updates;
