//! The program of a device: compared, and downloaded where it is another one and that is permitted (CiA 302-2 and 302-3).
//!
//! ```text
//! 1F56:1 is what it should be --> on to the configuration
//!        is another one ------> 1F51:1 stop, clear; 1F50:1 program; 1F57:1 until it is written; 1F56:1; 1F51:1 start
//!                               --> from the beginning, as a device that has just come
//! ```
//!
//! A device without a program is often another one, a boot loader, which starts anew when it is stopped and says nothing while it
//! erases and writes. Silence is borne until the time of the download is over. A device is given a program once, however often it is
//! tried again: flash wears out. Only a stop and start of the master permits it once more.

use super::boot::BootStatus;
use super::config::NodeConfig;
use super::plan::{Step, Verdict};
use super::report::RowOutcome;
use super::station::Station;
use crate::sdo::request::{SdoData, SdoFailure, SdoRequest};
use crate::wire::Mux;

/// Program data.
const DATA: Mux = Mux::new(0x1F50, 1);
/// Program control.
const CONTROL: Mux = Mux::new(0x1F51, 1);
/// Program software identification.
const IDENTIFICATION: Mux = Mux::new(0x1F56, 1);
/// Flash status: bit 0 while it works, bits 1 to 7 what became of it.
const FLASH: Mux = Mux::new(0x1F57, 1);

const STOP: u8 = 0;
const START: u8 = 1;
const CLEAR: u8 = 3;

/// One SDO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProgramStep {
    Identification,
    /// Whether it runs.
    Control,
    Stop,
    Clear,
    Download,
    Flash,
    Verify,
    Start,
    /// Whether it runs again.
    Running,
}

impl ProgramStep {
    /// All of them, in their order.
    pub const ALL: [Self; 9] = [
        Self::Identification,
        Self::Control,
        Self::Stop,
        Self::Clear,
        Self::Download,
        Self::Flash,
        Self::Verify,
        Self::Start,
        Self::Running,
    ];

    /// The request. The bytes of the program go with it, and come back with the outcome.
    pub fn request(self, node: &mut NodeConfig) -> SdoRequest {
        let control = |value: u8| SdoRequest::download_number(CONTROL, value.into(), 1);
        match self {
            Self::Identification | Self::Verify => SdoRequest::upload(IDENTIFICATION),
            Self::Control | Self::Running => SdoRequest::upload(CONTROL),
            Self::Stop => control(STOP),
            Self::Clear => control(CLEAR),
            Self::Download => {
                let image = image(node).map(core::mem::take);
                SdoRequest::download(DATA, image.unwrap_or_default())
            }
            Self::Flash => SdoRequest::upload(FLASH),
            Self::Start => control(START),
        }
    }

    /// What its outcome means.
    // Flat: one arm per step.
    pub fn judge(
        self,
        value: Option<u32>,
        row: RowOutcome,
        node: &NodeConfig,
        station: &mut Station,
    ) -> (RowOutcome, Verdict) {
        let failed = Verdict::Fail(BootStatus::PROGRAM_DOWNLOAD);
        let failure = match row {
            RowOutcome::Failed(failure) => Some(failure),
            _ => None,
        };
        let silent = matches!(failure, Some(SdoFailure::Timeout { .. }));
        let tolerated = failure.map_or(row, RowOutcome::Tolerated);
        let same = |found: u32, expected: u32, other: Verdict| match found == expected {
            true => (row, Verdict::Next),
            false => (RowOutcome::Differs { found, expected }, other),
        };
        let expected = node.program.as_ref().map_or(0, |program| program.identification);
        match (self, value) {
            (Self::Identification, Some(found)) if found == expected => (row, Verdict::Finish),
            (Self::Identification, Some(found)) => {
                let permitted = node.program.as_ref().is_some_and(|program| program.image.is_some());
                let verdict = match (permitted, core::mem::replace(&mut station.programmed, permitted)) {
                    (false, _) => Verdict::Fail(BootStatus::PROGRAM_OTHER),
                    // It was downloaded and started, and is still another one.
                    (true, true) => failed,
                    (true, false) => Verdict::Program,
                };
                (RowOutcome::Differs { found, expected }, verdict)
            }
            (Self::Identification, None) => (row, Verdict::Fail(BootStatus::PROGRAM_VERSION)),
            // It need not be stopped if it does not run, and who does not say so is told to stop.
            (Self::Control, Some(0)) => (row, Verdict::SkipTo(Step::Program(Self::Clear))),
            (Self::Control, _) => (tolerated, Verdict::Next),
            // Devices that start anew with it do not answer.
            (Self::Stop | Self::Start, _) if failure.is_none() || silent => (tolerated, Verdict::Next),
            (_, _) if silent => (tolerated, Verdict::Again(self.step())),
            (Self::Clear | Self::Download, _) if failure.is_none() => (row, Verdict::Next),
            (Self::Flash, Some(status)) if status & 1 != 0 => (row, Verdict::Again(self.step())),
            (Self::Flash, Some(status)) => same(status >> 1 & 0x7F, 0, failed),
            // One that does not tell is asked for the program it has.
            (Self::Flash, None) if failure.is_some_and(SdoFailure::is_absent) => {
                (RowOutcome::Absent, Verdict::Next)
            }
            (Self::Verify, Some(found)) => same(found, expected, failed),
            (Self::Running, Some(value)) if value == u32::from(START) => (row, Verdict::Restart),
            (Self::Running, Some(_)) => (row, Verdict::Again(self.step())),
            _ => (row, failed),
        }
    }

    const fn step(self) -> Step {
        Step::Program(self)
    }
}

/// The bytes of the program, to be taken or put back.
pub(super) fn image(node: &mut NodeConfig) -> Option<&mut SdoData> {
    node.program.as_mut()?.image.as_mut()
}
