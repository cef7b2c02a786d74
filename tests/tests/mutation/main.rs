//! Changes of the mapping tables and configurations, and what notices each of them.

#![allow(missing_docs)]

mod facts;
mod kinds;
mod rows;
