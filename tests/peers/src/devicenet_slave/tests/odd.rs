//! Odd behaviour.

use super::*;
