//! The Identity object (class 0x01).
//!
//! | bit of the status word (attribute 5) | meaning | where it comes from |
//! |---|---|---|
//! | 0 | owned | the motion connection is open |
//! | 2 | configured | [`Health::configured`] |
//! | 7..4 | extended device status | connection and state, see below |
//! | 8, 9 | minor fault, recoverable and not | [`Health::minor_recoverable`], [`Health::minor_unrecoverable`] |
//! | 10, 11 | major fault, recoverable and not | [`ModuleState`] |
//!
//! | extended device status | meaning | when |
//! |---|---|---|
//! | 0 | self-testing or unknown | the state is [`ModuleState::SelfTesting`] |
//! | 2 | at least one faulted I/O connection | the motion connection has timed out and nobody has opened it anew |
//! | 3 | no I/O connection established | there is none |
//! | 5 | major fault | bit 10 or 11 is set |
//! | 6 | at least one I/O connection in run mode | it is open, and the axes are operational |
//! | 7 | all I/O connections in idle mode | it is open, and the device is in standby |

use super::object::Object;
use crate::device::config::IdentityConfig;
use crate::device::event::ResetKind;
use crate::wire::motion::codes::AxisStateCode;
use crate::wire::status::GeneralStatus;

/// Class code of the Identity object.
pub const CLASS_IDENTITY: u16 = 0x01;

/// State of the device as its module status LED shows it, in the order in which one axis outweighs another (Volume 9
/// clause 9-1.1.1.6, from the least).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum ModuleState {
    /// Everything works: solid green.
    #[default]
    Operational,
    /// No power structure is in use: flashing green.
    Standby,
    /// Testing itself after power up: flashing red and green.
    SelfTesting,
    /// The device does not work until the fault is cleared: flashing red.
    MajorRecoverableFault,
    /// The device does not work until it is restarted: solid red.
    MajorUnrecoverableFault,
}

impl ModuleState {
    /// Every state, in the order of their weight.
    pub const ALL: [Self; 5] = [
        Self::Operational,
        Self::Standby,
        Self::SelfTesting,
        Self::MajorRecoverableFault,
        Self::MajorUnrecoverableFault,
    ];

    /// What the state of one axis makes of the device (Volume 9 table 9-1.2).
    ///
    /// | axis state | device |
    /// |---|---|
    /// | Self Test | has no code: nobody can ask then |
    /// | Initializing, Pre-Charge, Start Inhibited, Shutdown | standby |
    /// | Stopped, Starting, Running, Testing, Stopping | operational |
    /// | Aborting, Major Faulted | major fault, unrecoverable after an initialization fault |
    /// | any other code | standby: an axis nobody knows the state of does not work |
    pub const fn of_axis(state: AxisStateCode, initialization_fault: bool) -> Self {
        match state {
            AxisStateCode::STOPPED
            | AxisStateCode::STARTING
            | AxisStateCode::RUNNING
            | AxisStateCode::TESTING
            | AxisStateCode::STOPPING => Self::Operational,
            AxisStateCode::ABORTING | AxisStateCode::MAJOR_FAULTED if initialization_fault => {
                Self::MajorUnrecoverableFault
            }
            AxisStateCode::ABORTING | AxisStateCode::MAJOR_FAULTED => Self::MajorRecoverableFault,
            _ => Self::Standby,
        }
    }

    /// State of a device whose axes make of it what `axes` says: the weightiest of them, standby without any.
    pub fn of_axes(axes: impl IntoIterator<Item = Self>) -> Self {
        axes.into_iter().max().unwrap_or(Self::Standby)
    }

    /// The state with this value of attribute 8.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.code() == code)
    }

    /// Value of attribute 8.
    pub const fn code(self) -> u8 {
        match self {
            Self::SelfTesting => 1,
            Self::Standby => 2,
            Self::Operational => 3,
            Self::MajorRecoverableFault => 4,
            Self::MajorUnrecoverableFault => 5,
        }
    }
}

/// How the device is, as the Identity object reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// State of the device.
    pub state: ModuleState,
    /// The application does something else than it did out of the box.
    pub configured: bool,
    /// Something recoverable is wrong that does not keep the device from working.
    pub minor_recoverable: bool,
    /// Something is wrong that will not go away, but does not keep the device from working.
    pub minor_unrecoverable: bool,
}

/// What has become of the motion connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ownership {
    /// Nobody has it.
    Free,
    /// It has timed out, and nobody has had it since.
    Lost,
    /// It is open.
    Owned,
}

/// The Identity object as it is at this moment.
pub(crate) struct Identity<'a> {
    pub config: &'a IdentityConfig,
    pub health: Health,
    pub ownership: Ownership,
    /// Attribute 9.
    pub consistency: u16,
}

impl Identity<'_> {
    /// Attribute 5.
    pub fn status(&self) -> u16 {
        let Health { state, configured, minor_recoverable, minor_unrecoverable } = self.health;
        let extended: u16 = match (state, self.ownership) {
            (ModuleState::MajorRecoverableFault | ModuleState::MajorUnrecoverableFault, _) => 5,
            (ModuleState::SelfTesting, _) => 0,
            (_, Ownership::Lost) => 2,
            (_, Ownership::Free) => 3,
            (ModuleState::Operational, Ownership::Owned) => 6,
            (ModuleState::Standby, Ownership::Owned) => 7,
        };
        u16::from(self.ownership == Ownership::Owned)
            | u16::from(configured) << 2
            | extended << 4
            | u16::from(minor_recoverable) << 8
            | u16::from(minor_unrecoverable) << 9
            | u16::from(state == ModuleState::MajorRecoverableFault) << 10
            | u16::from(state == ModuleState::MajorUnrecoverableFault) << 11
    }

    pub fn state(&self) -> u8 {
        self.health.state.code()
    }
}

impl Object for Identity<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6, 7, 8, 9];
    const CLASS_ALL: &'static [u16] = &[1, 2, 6, 7];
    const ATTRIBUTE_MAX: u16 = 9;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = self.config;
        match attribute {
            1 => out.extend(c.vendor.to_le_bytes()),
            2 => out.extend(c.device_type.to_le_bytes()),
            3 => out.extend(c.product_code.to_le_bytes()),
            4 => out.extend([c.major, c.minor]),
            5 => out.extend(self.status().to_le_bytes()),
            6 => out.extend(c.serial_number.to_le_bytes()),
            7 => short_string(&c.product_name, out),
            8 => out.push(self.state()),
            9 => out.extend(self.consistency.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }
}

/// Reads the parameter of a Reset service; without one the type is 0.
pub(crate) fn reset_kind(data: &[u8]) -> Result<ResetKind, GeneralStatus> {
    match data {
        [] | [0] => Ok(ResetKind::PowerCycle),
        [1] => Ok(ResetKind::FactoryDefaults),
        [_] => Err(GeneralStatus::INVALID_PARAMETER),
        _ => Err(GeneralStatus::TOO_MUCH_DATA),
    }
}

/// Appends a SHORT_STRING: length byte and text.
pub(crate) fn short_string(text: &str, out: &mut Vec<u8>) {
    let bytes = text.as_bytes();
    let length = u8::try_from(bytes.len()).unwrap_or(u8::MAX);
    out.push(length);
    out.extend(bytes.iter().take(usize::from(length)));
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;
    use crate::device::config::tests::device;

    #[test]
    fn each_axis_state_makes_its_state_of_the_device() {
        let mut text = String::new();
        for code in 0..=12 {
            let state = AxisStateCode(code);
            let (plain, faulted) = (ModuleState::of_axis(state, false), ModuleState::of_axis(state, true));
            writeln!(text, "{code:2} {state}: {plain:?}, after an initialization fault {faulted:?}").unwrap();
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn the_weightiest_axis_speaks_for_the_device() {
        use ModuleState::{
            MajorRecoverableFault, MajorUnrecoverableFault, Operational, SelfTesting, Standby,
        };
        assert_eq!(ModuleState::of_axes([]), Standby);
        assert_eq!(ModuleState::of_axes([Operational, Operational]), Operational);
        assert_eq!(ModuleState::of_axes([Operational, Standby, Operational]), Standby);
        assert_eq!(ModuleState::of_axes([Standby, MajorRecoverableFault]), MajorRecoverableFault);
        assert_eq!(
            ModuleState::of_axes([MajorUnrecoverableFault, MajorRecoverableFault, SelfTesting]),
            MajorUnrecoverableFault
        );
    }

    #[test]
    fn the_status_word_for_every_state_and_ownership() {
        let config = device().identity;
        let mut text = String::new();
        for ownership in [Ownership::Free, Ownership::Lost, Ownership::Owned] {
            for state in [
                ModuleState::SelfTesting,
                ModuleState::Standby,
                ModuleState::Operational,
                ModuleState::MajorRecoverableFault,
                ModuleState::MajorUnrecoverableFault,
            ] {
                let health = Health { state, ..Health::default() };
                let identity = Identity { config: &config, health, ownership, consistency: 0 };
                writeln!(text, "{ownership:?} {state:?}: {:#06x} {}", identity.status(), identity.state())
                    .unwrap();
            }
        }
        insta::assert_snapshot!(text);
        let health = Health {
            configured: true,
            minor_recoverable: true,
            minor_unrecoverable: true,
            ..Health::default()
        };
        let identity = Identity { config: &config, health, ownership: Ownership::Free, consistency: 0 };
        assert_eq!(identity.status(), 0x0334);
    }
}
