//! The CIP Motion drive.

use super::*;
