//! What of an axis travels in every update: the data sets, and the room they need.

use super::config::AxisSetup;
use crate::wire::class1::SEQUENCE_COUNT_LEN;
use crate::wire::motion::codes::{ActualDataSet, CommandDataSet, ControlMode, FeedbackMode, StatusDataSet};

/// Largest D-to-C header: 8 bytes, time stamp, time offset, update and time diagnostics.
pub(super) const ACTUAL_HEADER_MAX: usize = 44;
/// Header of an instance and of its cyclic block.
const BLOCK_HEADERS: usize = 8 + 8;
/// Bytes of an LREAL or LINT, and of everything else.
const LONG: usize = 8;
const WORD: usize = 4;

/// The data sets of one axis, clauses 6-2.7.1.2.2 and 6-2.7.2.1.5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DataSets {
    /// Command values sent beside the one that the Control Mode needs: Command Velocity along with Command
    /// Position is velocity feed-forward, and so on. Torque, unwind count and displacement are zero where
    /// nothing else is asked.
    pub command: CommandDataSet,
    /// Actual values asked for. The controller itself needs Actual Position; in the fixed format it makes do with Actual
    /// Velocity out of position control.
    pub actual: ActualDataSet,
    /// Status asked for. The controller itself needs the fault record and Axis Status; the fixed format has none.
    pub status: StatusDataSet,
    /// Send Command Position as DINT instead of LREAL.
    pub integer_position: bool,
}

impl Default for DataSets {
    /// Velocity feed-forward in LREAL; position and velocity, fault, alarm and axis status back.
    fn default() -> Self {
        Self {
            command: CommandDataSet::VELOCITY,
            actual: ActualDataSet::POSITION | ActualDataSet::VELOCITY,
            status: StatusDataSet::FAULT | StatusDataSet::ALARM | StatusDataSet::AXIS_STATUS,
            integer_position: false,
        }
    }
}

impl DataSets {
    /// What an update of the fixed format has room for: the value of the Control Mode, a position as DINT, and one actual
    /// value, the position in position control and the velocity otherwise.
    #[must_use]
    pub fn fixed(mode: ControlMode) -> Self {
        let position = mode == ControlMode::POSITION;
        Self {
            command: CommandDataSet::empty(),
            actual: if position { ActualDataSet::POSITION } else { ActualDataSet::VELOCITY },
            status: StatusDataSet::empty(),
            integer_position: true,
        }
    }

    /// Bytes of the axis in a C-to-D update, in any Control Mode and with a Position Displacement.
    pub(super) fn command_len(&self) -> usize {
        let position = if self.integer_position { WORD } else { LONG };
        // Velocity, acceleration and torque may be what the mode needs.
        BLOCK_HEADERS + position + 3 * WORD + 2 * WORD
    }

    /// Bytes of the axis in a D-to-C update.
    pub(super) fn actual_len(&self, feedback_mode: FeedbackMode) -> usize {
        let position = if feedback_mode.position_is_lint() { LONG } else { WORD };
        let actual = self.actual.iter().map(|value| match value {
            ActualDataSet::POSITION => position,
            _ => WORD,
        });
        let status = self.status.iter().map(|value| match value {
            StatusDataSet::FAULT | StatusDataSet::ALARM | StatusDataSet::SAFETY_STATUS => 3 * WORD,
            _ => 2 * WORD,
        });
        BLOCK_HEADERS + actual.sum::<usize>() + status.sum::<usize>()
    }
}

/// Bytes of connection data that every axis in every update needs, beside the service channel.
pub(super) fn cyclic_len(axes: &[AxisSetup]) -> usize {
    let command: usize = axes.iter().map(|axis| axis.sets.command_len()).sum();
    let actual: usize = axes.iter().map(|axis| axis.sets.actual_len(axis.feedback_mode)).sum();
    SEQUENCE_COUNT_LEN + ACTUAL_HEADER_MAX + command.max(actual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion::{ActualBlock, ActualPosition, ActualValues, StatusValues};

    #[test]
    fn the_room_of_an_axis_is_what_its_blocks_take() {
        let block = ActualBlock {
            actual: ActualValues {
                position: Some(ActualPosition::Lint(0)),
                velocity: Some(0.0),
                acceleration: Some(0.0),
                unwind_count: Some(0),
                position_displacement: Some(0),
            },
            status: StatusValues {
                fault: Some(crate::wire::motion::FaultRecord::default()),
                alarm: Some(crate::wire::motion::AlarmRecord::default()),
                axis_status: Some(Default::default()),
                io_status: Some(Default::default()),
                safety: Some(Default::default()),
            },
            ..ActualBlock::default()
        };
        let sets = DataSets {
            actual: block.actual.data_set(),
            status: block.status.data_set(),
            ..DataSets::default()
        };
        let lint = FeedbackMode(2).with_lint(true);
        assert_eq!(sets.actual_len(lint), 8 + block.buffer_len());
        assert_eq!(sets.actual_len(FeedbackMode(2)), 8 + block.buffer_len() - 4);
        assert_eq!(DataSets::default().actual_len(FeedbackMode(2)), 8 + 8 + 4 + 4 + 12 + 12 + 8);
        assert_eq!(DataSets { integer_position: true, ..sets }.command_len() + 4, sets.command_len());
    }
}
