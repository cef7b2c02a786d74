//! The assemblies of the AC/DC drive profile: what a poll connection of a velocity drive carries.
//!
//! | output assembly | bits of byte 0 | bytes 2, 3 | bytes 4, 5 |
//! |---|---|---|---|
//! | 20 basic speed control | 0 run forward, 2 fault reset | speed reference | |
//! | 21 extended speed control | also 1 run reverse, 5 control from network, 6 reference from network | speed reference | |
//! | 22 basic speed and torque control | as 20 | speed reference | torque reference |
//! | 23 extended speed and torque control | as 21 | speed reference | torque reference |
//!
//! | input assembly | bits of byte 0 | byte 1 | bytes 2, 3 | bytes 4, 5 |
//! |---|---|---|---|---|
//! | 70 basic speed control | 0 faulted, 2 running forward | | speed | |
//! | 71 extended speed control | also 1 warning, 3 running reverse, 4 ready, 5 control from network, 6 reference from network, 7 at reference | drive state | speed | |
//! | 72 basic speed and torque control | as 70 | | speed | torque |
//! | 73 extended speed and torque control | as 71 | drive state | speed | torque |
//!
//! Speed is in rpm / 2^SpeedScale, torque in Nm / 2^TorqueScale (attributes 22 and 24 of the AC/DC Drive object). What an
//! assembly has no place for is read as zero and not written.

use core::fmt;

pub use crate::generated::devicenet::{Assembly, SupervisorState};
use crate::generated::devicenet::{speed_control, speed_status};
use crate::wire::{Error, Reader, Writer};

/// `DriveMode` (attribute 6 of the AC/DC Drive object): closed-loop speed control.
pub const DRIVE_MODE_SPEED: u8 = 2;
/// `DriveMode`: torque control.
pub const DRIVE_MODE_TORQUE: u8 = 3;

impl Assembly {
    /// Whether it is one that a drive consumes.
    #[must_use]
    pub const fn is_output(self) -> bool {
        matches!(self.0, 20..=23)
    }

    /// Whether it is one that a drive produces.
    #[must_use]
    pub const fn is_input(self) -> bool {
        matches!(self.0, 70..=73)
    }

    /// Whether it has a torque.
    #[must_use]
    pub const fn has_torque(self) -> bool {
        matches!(self.0, 22 | 23 | 72 | 73)
    }

    /// Whether it is one of the extended ones.
    #[must_use]
    pub const fn is_extended(self) -> bool {
        matches!(self.0, 21 | 23 | 71 | 73)
    }

    /// The input assembly that goes with an output assembly.
    #[must_use]
    pub const fn status(self) -> Option<Self> {
        if self.is_output() { Some(Self(self.0 + 50)) } else { None }
    }

    /// Its bytes; 0 for another instance.
    #[must_use]
    pub const fn buffer_len(self) -> usize {
        match (self.is_output() || self.is_input(), self.has_torque()) {
            (false, _) => 0,
            (true, false) => 4,
            (true, true) => 6,
        }
    }
}

bitflags::bitflags! {
    /// Byte 0 of an output assembly.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct SpeedControl: u8 {
        /// Run1: run forward.
        const RUN_FORWARD = 1 << speed_control::RUN_FORWARD.0;
        /// Run2: run reverse.
        const RUN_REVERSE = 1 << speed_control::RUN_REVERSE.0;
        /// FaultRst: a rising edge resets the fault.
        const FAULT_RESET = 1 << speed_control::FAULT_RESET.0;
        /// NetCtrl: start and stop come from the network.
        const NET_CONTROL = 1 << speed_control::NET_CONTROL.0;
        /// NetRef: the reference comes from the network.
        const NET_REFERENCE = 1 << speed_control::NET_REFERENCE.0;
    }
}

impl SpeedControl {
    const BASIC: Self = Self::RUN_FORWARD.union(Self::FAULT_RESET);
}

bitflags::bitflags! {
    /// Byte 0 of an input assembly.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct SpeedStatus: u8 {
        /// Faulted.
        const FAULTED = 1 << speed_status::FAULTED.0;
        /// Warning.
        const WARNING = 1 << speed_status::WARNING.0;
        /// Running1: running forward.
        const RUNNING_FORWARD = 1 << speed_status::RUNNING_FORWARD.0;
        /// Running2: running in reverse.
        const RUNNING_REVERSE = 1 << speed_status::RUNNING_REVERSE.0;
        /// Ready.
        const READY = 1 << speed_status::READY.0;
        /// CtrlFromNet.
        const CONTROL_FROM_NET = 1 << speed_status::CONTROL_FROM_NET.0;
        /// RefFromNet.
        const REFERENCE_FROM_NET = 1 << speed_status::REFERENCE_FROM_NET.0;
        /// AtReference.
        const AT_REFERENCE = 1 << speed_status::AT_REFERENCE.0;
    }
}

impl SpeedStatus {
    const BASIC: Self = Self::FAULTED.union(Self::RUNNING_FORWARD);
}

/// Contents of an output assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SpeedCommand {
    /// The bits.
    pub control: SpeedControl,
    /// Speed reference, rpm / 2^SpeedScale.
    pub speed: i16,
    /// Torque reference, Nm / 2^TorqueScale.
    pub torque: i16,
}

/// Contents of an input assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SpeedActual {
    /// The bits.
    pub status: SpeedStatus,
    /// State of the Control Supervisor.
    pub state: SupervisorState,
    /// Speed, rpm / 2^SpeedScale.
    pub speed: i16,
    /// Torque, Nm / 2^TorqueScale.
    pub torque: i16,
}

const DATA: &str = "drive assembly";

fn check(assembly: Assembly, fits: bool, expected: u32) -> Result<(), Error> {
    let found = u32::from(assembly.0);
    if fits { Ok(()) } else { Err(Error::invalid("assembly instance", 0, expected, found)) }
}

/// The four parts of either assembly.
fn parse(assembly: Assembly, data: &[u8]) -> Result<([u8; 2], i16, i16), Error> {
    let reader = &mut Reader::new(data);
    let head = reader.array(DATA)?;
    let speed = i16::from_le_bytes(reader.array(DATA)?);
    let torque = if assembly.has_torque() { i16::from_le_bytes(reader.array(DATA)?) } else { 0 };
    reader.finish(DATA)?;
    Ok((head, speed, torque))
}

fn emit(
    assembly: Assembly,
    head: [u8; 2],
    speed: i16,
    torque: i16,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let writer = &mut Writer::new(buffer);
    writer.slice(DATA, &head)?;
    writer.slice(DATA, &speed.to_le_bytes())?;
    if assembly.has_torque() {
        writer.slice(DATA, &torque.to_le_bytes())?;
    }
    Ok(writer.written())
}

impl SpeedCommand {
    /// Reads the data of an output assembly.
    ///
    /// # Errors
    /// It is another assembly, or has another length.
    pub fn parse(assembly: Assembly, data: &[u8]) -> Result<Self, Error> {
        check(assembly, assembly.is_output(), 21)?;
        let ([bits, _], speed, torque) = parse(assembly, data)?;
        let mask = if assembly.is_extended() { SpeedControl::all() } else { SpeedControl::BASIC };
        Ok(Self { control: SpeedControl::from_bits_retain(bits) & mask, speed, torque })
    }

    /// Writes the data of an output assembly.
    ///
    /// # Errors
    /// It is another assembly, or the buffer is too short.
    pub fn emit(&self, assembly: Assembly, buffer: &mut [u8]) -> Result<usize, Error> {
        check(assembly, assembly.is_output(), 21)?;
        let mask = if assembly.is_extended() { SpeedControl::all() } else { SpeedControl::BASIC };
        emit(assembly, [(self.control & mask).bits(), 0], self.speed, self.torque, buffer)
    }
}

impl SpeedActual {
    /// Reads the data of an input assembly.
    ///
    /// # Errors
    /// It is another assembly, or has another length.
    pub fn parse(assembly: Assembly, data: &[u8]) -> Result<Self, Error> {
        check(assembly, assembly.is_input(), 71)?;
        let ([bits, state], speed, torque) = parse(assembly, data)?;
        let extended = assembly.is_extended();
        let mask = if extended { SpeedStatus::all() } else { SpeedStatus::BASIC };
        let state = SupervisorState(if extended { state } else { 0 });
        Ok(Self { status: SpeedStatus::from_bits_retain(bits) & mask, state, speed, torque })
    }

    /// Writes the data of an input assembly.
    ///
    /// # Errors
    /// It is another assembly, or the buffer is too short.
    pub fn emit(&self, assembly: Assembly, buffer: &mut [u8]) -> Result<usize, Error> {
        check(assembly, assembly.is_input(), 71)?;
        let extended = assembly.is_extended();
        let mask = if extended { SpeedStatus::all() } else { SpeedStatus::BASIC };
        let state = if extended { self.state.0 } else { 0 };
        emit(assembly, [(self.status & mask).bits(), state], self.speed, self.torque, buffer)
    }
}

impl fmt::Display for SpeedCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { control, speed, torque } = self;
        write!(f, "{:#04x}, speed reference {speed}, torque reference {torque}", control.bits())
    }
}

impl fmt::Display for SpeedActual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { status, state, speed, torque } = self;
        write!(f, "{:#04x}, {state}, speed {speed}, torque {torque}", status.bits())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use profile_generic::wire::Expected;

    /// Layouts: Rockwell 160-DN2, Toshiba DEV003Z, ABB FDNA-01.
    #[test]
    fn commands_both_ways() {
        let run = SpeedControl::RUN_FORWARD;
        let net = SpeedControl::NET_CONTROL | SpeedControl::NET_REFERENCE;
        let cases: [(u8, &[u8], SpeedCommand); 5] = [
            (20, &[0x01, 0, 0xDC, 0x05], SpeedCommand { control: run, speed: 1500, torque: 0 }),
            (20, &[0x04, 0, 0, 0], SpeedCommand { control: SpeedControl::FAULT_RESET, speed: 0, torque: 0 }),
            (
                21,
                &[0x62, 0, 0x18, 0xFC],
                SpeedCommand { control: net | SpeedControl::RUN_REVERSE, speed: -1000, torque: 0 },
            ),
            (22, &[0x01, 0, 1, 0, 2, 0], SpeedCommand { control: run, speed: 1, torque: 2 }),
            (23, &[0x61, 0, 1, 0, 0xFE, 0xFF], SpeedCommand { control: net | run, speed: 1, torque: -2 }),
        ];
        for (assembly, bytes, command) in cases {
            let assembly = Assembly(assembly);
            assert_eq!(SpeedCommand::parse(assembly, bytes), Ok(command), "{assembly}");
            let mut buffer = [0xA5; 8];
            assert_eq!(command.emit(assembly, &mut buffer), Ok(assembly.buffer_len()));
            assert_eq!((&buffer[..bytes.len()], buffer[bytes.len()]), (bytes, 0xA5), "{assembly}");
            for cut in 0..bytes.len() {
                assert!(SpeedCommand::parse(assembly, &bytes[..cut]).is_err(), "{assembly} cut at {cut}");
                assert!(command.emit(assembly, &mut buffer[..cut]).is_err(), "{assembly} into {cut}");
            }
            let long = [bytes, &[0]].concat();
            assert!(
                matches!(SpeedCommand::parse(assembly, &long), Err(Error { expected: Expected::End, .. })),
                "{assembly}"
            );
        }
        // What the assembly has no bits for does not run a drive.
        let all = SpeedCommand::parse(Assembly(20), &[0xFF, 0xFF, 0, 0]).unwrap();
        assert_eq!(all.control, SpeedControl::RUN_FORWARD | SpeedControl::FAULT_RESET);
        let all = SpeedCommand::parse(Assembly(21), &[0xFF, 0xFF, 0, 0]).unwrap();
        assert_eq!(all.control, SpeedControl::all());
        assert!(SpeedCommand::parse(Assembly(71), &[0; 4]).is_err());
        assert!(SpeedActual::parse(Assembly(21), &[0; 4]).is_err());
    }

    #[test]
    fn actual_values_both_ways() {
        let running = SpeedStatus::RUNNING_FORWARD;
        let state = SupervisorState::ENABLED;
        let basic = SpeedActual { status: running, speed: 1500, ..SpeedActual::default() };
        let extended = SpeedActual { status: SpeedStatus::all(), state, speed: -1, torque: 0 };
        let cases: [(u8, &[u8], SpeedActual); 4] = [
            (70, &[0x04, 0, 0xDC, 0x05], basic),
            (71, &[0xFF, 4, 0xFF, 0xFF], extended),
            (72, &[0x04, 0, 0xDC, 0x05, 3, 0], SpeedActual { torque: 3, ..basic }),
            (73, &[0xFF, 4, 0xFF, 0xFF, 0xFD, 0xFF], SpeedActual { torque: -3, ..extended }),
        ];
        for (assembly, bytes, actual) in cases {
            let assembly = Assembly(assembly);
            assert_eq!(SpeedActual::parse(assembly, bytes), Ok(actual), "{assembly}");
            let mut buffer = [0xA5; 8];
            assert_eq!(actual.emit(assembly, &mut buffer), Ok(assembly.buffer_len()));
            assert_eq!((&buffer[..bytes.len()], buffer[bytes.len()]), (bytes, 0xA5), "{assembly}");
            for cut in 0..bytes.len() {
                assert!(SpeedActual::parse(assembly, &bytes[..cut]).is_err(), "{assembly} cut at {cut}");
                assert!(actual.emit(assembly, &mut buffer[..cut]).is_err(), "{assembly} into {cut}");
            }
        }
        let mut buffer = [0; 4];
        extended.emit(Assembly(70), &mut buffer).unwrap();
        assert_eq!(buffer, [0x05, 0, 0xFF, 0xFF], "the basic assembly has two bits and no state");
    }

    #[test]
    fn assemblies_come_in_pairs() {
        for output in 20..24 {
            let status = Assembly(output).status().unwrap();
            assert!(Assembly(output).is_output() && status.is_input());
            assert_eq!(Assembly(output).has_torque(), status.has_torque());
            assert_eq!(Assembly(output).is_extended(), status.is_extended());
        }
        assert_eq!((Assembly(71).status(), Assembly(5).buffer_len()), (None, 0));
    }

    proptest! {
        #[test]
        fn round_trips(output in 20_u8..24, bits in 0_u8..0x80, speed: i16, torque: i16, state in 0_u8..8) {
            let mut buffer = [0xA5; 8];
            let control = SpeedControl::from_bits_truncate(bits);
            let command = SpeedCommand { control, speed, torque };
            let assembly = Assembly(output);
            let len = command.emit(assembly, &mut buffer).unwrap();
            let back = SpeedCommand::parse(assembly, &buffer[..len]).unwrap();
            prop_assert_eq!((back.speed, back.control & SpeedControl::BASIC), (speed, control & SpeedControl::BASIC));
            prop_assert_eq!(back.torque, if assembly.has_torque() { torque } else { 0 });
            let assembly = Assembly(output + 50);
            let actual = SpeedActual { status: SpeedStatus::from_bits_truncate(bits), state: SupervisorState(state), speed, torque };
            let len = actual.emit(assembly, &mut buffer).unwrap();
            let back = SpeedActual::parse(assembly, &buffer[..len]).unwrap();
            if assembly.0 == 73 {
                prop_assert_eq!(back, actual);
            }
        }
    }
}
