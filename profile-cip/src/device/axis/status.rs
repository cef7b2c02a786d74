//! Which bits of Axis Status (attribute 651) may be set in which state, Table 5-2.61.
//!
//! The table's "1" is what the device reaches there by itself; a drive that says otherwise (its bus has dropped, its
//! torque is off while it coasts) is believed. The table's "0" holds whatever the drive says. "0/1" and "0/x" are 0
//! unless the axis was stopped by a category 2 stop, that is unless it still has torque.

use super::state::{AxisState, ControlKind};
use crate::wire::motion::codes::AxisStatus;

/// Bits of control loops: none without torque.
const LOOPS: AxisStatus = AxisStatus::POSITION_LOCK
    .union(AxisStatus::VELOCITY_LOCK)
    .union(AxisStatus::VELOCITY_LIMIT)
    .union(AxisStatus::ACCELERATION_LIMIT)
    .union(AxisStatus::DECELERATION_LIMIT)
    .union(AxisStatus::TORQUE_THRESHOLD)
    .union(AxisStatus::TORQUE_LIMIT)
    .union(AxisStatus::CURRENT_LIMIT)
    .union(AxisStatus::MOTOR_FLUX_UP)
    .union(AxisStatus::POSITION_CONTROL_MODE);

/// Bits of a power structure, which a feedback device and a converter do not have.
const DRIVE_ONLY: AxisStatus = LOOPS
    .union(AxisStatus::POWER_STRUCTURE_ENABLED)
    .union(AxisStatus::TRACKING_COMMAND)
    .union(AxisStatus::VELOCITY_CONTROL_MODE)
    .union(AxisStatus::TORQUE_CONTROL_MODE);

/// The bits that may be set in `state`; `powered` when the drive has torque.
pub(crate) fn allowed(kind: ControlKind, state: AxisState, powered: bool) -> AxisStatus {
    use AxisStatus as A;
    let forbidden = match state {
        AxisState::Off | AxisState::SelfTest | AxisState::Initializing => {
            DRIVE_ONLY
                | A::VELOCITY_STANDSTILL
                | A::VELOCITY_THRESHOLD
                | A::SHUTDOWN
                | A::IN_PROCESS
                | A::DC_BUS_UNLOAD
        }
        AxisState::PreCharge => DRIVE_ONLY | A::DC_BUS_UP | A::SHUTDOWN | A::DC_BUS_UNLOAD,
        AxisState::Shutdown => DRIVE_ONLY,
        AxisState::StartInhibited => DRIVE_ONLY | A::SHUTDOWN | A::DC_BUS_UNLOAD,
        AxisState::Stopped => {
            A::TRACKING_COMMAND
                | A::VELOCITY_CONTROL_MODE
                | A::TORQUE_CONTROL_MODE
                | A::SHUTDOWN
                | A::DC_BUS_UNLOAD
        }
        AxisState::Starting | AxisState::Stopping => {
            A::TRACKING_COMMAND | A::SHUTDOWN | A::IN_PROCESS | A::DC_BUS_UNLOAD
        }
        AxisState::Running => A::SHUTDOWN | A::IN_PROCESS | A::DC_BUS_UNLOAD,
        AxisState::Testing => {
            A::TRACKING_COMMAND | A::POSITION_LOCK | A::VELOCITY_LOCK | A::SHUTDOWN | A::DC_BUS_UNLOAD
        }
        AxisState::Aborting => A::TRACKING_COMMAND | A::IN_PROCESS,
        AxisState::MajorFaulted => {
            A::TRACKING_COMMAND | A::VELOCITY_CONTROL_MODE | A::TORQUE_CONTROL_MODE | A::IN_PROCESS
        }
    };
    let unpowered = if powered { A::empty() } else { LOOPS };
    let function = if kind == ControlKind::Active { A::empty() } else { DRIVE_ONLY };
    A::all() - forbidden - unpowered - function
}

#[cfg(test)]
mod tests {
    use super::*;
    use AxisState as S;

    const STATES: [AxisState; 11] = [
        S::Initializing,
        S::PreCharge,
        S::Shutdown,
        S::StartInhibited,
        S::Stopped,
        S::Starting,
        S::Running,
        S::Testing,
        S::Stopping,
        S::Aborting,
        S::MajorFaulted,
    ];

    /// Table 5-2.61: bit, then a cell for each of [`STATES`]. `?` is "0/1" or "0/x".
    const CELLS: &str = "
         0  x x x x x x x x x x x
         1  x x x x x x x x x x x
         2  x 0 x 1 1 1 1 1 1 1 1
         3  0 0 0 0 ? 1 1 1 1 1 ?
         4  0 0 0 0 ? 1 1 1 1 1 ?
         5  0 0 0 0 0 0 1 0 0 0 0
         6  0 0 0 0 ? x x 0 x x ?
         7  0 0 0 0 ? x x 0 x x ?
         8  0 x x x x x x x x x x
         9  0 x x x x x x x x x x
        10  0 0 0 0 ? x x ? x x ?
        11  0 0 0 0 ? x x ? x x ?
        12  0 0 0 0 ? x x ? x x ?
        13  0 0 0 0 ? x x ? x x ?
        14  0 0 0 0 ? x x ? x x ?
        15  0 0 0 0 ? x x ? x x ?
        16  x x x x x x x x x x x
        17  x x x x x x x x x x x
        18  0 0 1 0 0 0 0 0 0 x x
        19  0 x x x x 0 0 1 0 0 0
        20  0 0 x 0 0 0 0 0 0 x x
        22  0 0 0 0 ? x x x x x ?
        23  0 0 0 0 0 x x x x x 0
        24  0 0 0 0 0 x x x x x 0
    ";

    #[test]
    fn every_cell_of_table_5_2_61() {
        let mut cells = 0;
        for line in CELLS.lines().filter(|line| !line.trim().is_empty()) {
            let mut words = line.split_whitespace();
            let bit: u32 = words.next().and_then(|bit| bit.parse().ok()).expect("a bit number");
            for (state, cell) in STATES.into_iter().zip(words) {
                let may = |powered| allowed(ControlKind::Active, state, powered).bits() & 1 << bit != 0;
                let expected = match cell {
                    "0" => (false, false),
                    "?" if bit == 3 => (true, true), // What the drive says is that bit.
                    "?" => (true, false),
                    // Bits of the loops need torque in every state: a coasting axis has none.
                    _ if LOOPS.bits() & 1 << bit != 0 => (true, false),
                    _ => (true, true),
                };
                assert_eq!((may(true), may(false)), expected, "bit {bit} in {state}: {cell}");
                cells += 1;
            }
        }
        assert_eq!(cells, 24 * 11);
    }

    #[test]
    fn what_is_no_drive_has_no_bits_of_a_power_structure() {
        for kind in [ControlKind::FeedbackOnly, ControlKind::Converter] {
            for state in STATES {
                // Clause 5-2.6.2.7: in Running both Power Structure Enabled and Tracking Command are clear.
                assert!(!allowed(kind, state, true).intersects(DRIVE_ONLY), "{kind:?} {state}");
            }
            assert!(allowed(kind, S::Running, false).contains(AxisStatus::DC_BUS_UP));
        }
    }
}
