//! A simulated CANopen drive that is like a real one, by its data sheet or device configuration.

use std::path::{Path, PathBuf};

use profile_cia402::eds::{self, DeviceDescription, Diagnostics, Severity};
use profile_cia402::node::drive::DeviceError;
use profile_cia402::wire::NodeId;

use super::can_drive::{DriveNode, like};
use super::drive_events::setup::Setup;
use crate::finding::read_bytes;

/// So many oddities of a file are shown.
const SHOWN_MAX: usize = 10;

/// What a drive is like.
#[derive(Debug)]
pub struct Sheet {
    path: PathBuf,
    description: DeviceDescription,
    diagnostics: Diagnostics,
}

/// Why there is no drive like that of a file.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// It cannot be read.
    #[error("{path}: {reason}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
    /// It describes no drive.
    #[error(
        "{0}: expected a data sheet (EDS) or device configuration (DCF) with 6040 and 6041, as drives have them"
    )]
    NoDrive(String),
}

impl Sheet {
    /// Reads a file.
    ///
    /// # Errors
    /// [`SheetError`].
    pub fn load(path: &Path) -> Result<Self, SheetError> {
        let most = u64::try_from(eds::BYTES_MAX).unwrap_or(u64::MAX);
        let unreadable = |reason| SheetError::Unreadable { path: path.display().to_string(), reason };
        let bytes = read_bytes(path, most).map_err(|(_, expected)| unreadable(expected))?;
        let reading = eds::read(&bytes).map_err(|error| unreadable(error.to_string()))?;
        if reading.description.axes().first().is_none_or(|axis| axis.number != 0) {
            return Err(SheetError::NoDrive(path.display().to_string()));
        }
        let (description, diagnostics) = (reading.description, reading.diagnostics);
        Ok(Self { path: path.to_owned(), description, diagnostics })
    }

    /// The node-id that a device configuration is made for.
    #[must_use]
    pub fn node(&self) -> Option<NodeId> {
        NodeId::new(self.description.commissioning.as_ref()?.node_id?).ok()
    }

    /// How many axes the device has, 1 to 8.
    #[must_use]
    pub fn axes(&self) -> u8 {
        let last = self.description.axes().last().map_or(0, |axis| axis.number);
        u8::try_from(last + 1).unwrap_or(1)
    }

    /// What is wrong in the file and costs the drive an entry, with its place.
    pub fn oddities(&self) -> impl Iterator<Item = String> + '_ {
        let errors = self.diagnostics.list().iter().filter(|found| found.severity() == Severity::Error);
        errors.take(SHOWN_MAX).map(|found| {
            format!(
                "{}:{}:{}: {}: expected {}, got {}",
                self.path.display(),
                found.line,
                found.column,
                found.place,
                found.expected,
                found.got
            )
        })
    }

    /// The drive. What the file does not say of its identity, it has of the simulated one, with this serial number.
    ///
    /// # Errors
    /// An axis that cannot work.
    pub fn drive(self, node: Option<NodeId>, serial: u32, setup: &Setup) -> Result<DriveNode, DeviceError> {
        let axes = self.axes();
        like(node, serial, axes, setup, self.description)
    }
}
