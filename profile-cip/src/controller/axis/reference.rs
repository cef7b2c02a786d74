//! Change of the position reference of an axis, Table 5-2.109.
//!
//! First the device moves its actual position by the displacement; with the acknowledge of that this side moves its
//! command position by the same and asks the device to take it so. Nothing turns by that.

use super::Axis;
use crate::controller::failure::Failure;
use crate::controller::number::{counts, float};
use crate::controller::program::Redefine;
use crate::wire::motion::codes::{AxisControl, AxisStateCode};

/// A change under way, and how it ended.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reference {
    /// Counts; sent along with the two requests.
    pub displacement: i32,
    under_way: bool,
    ended: Option<Result<(), (AxisControl, u8)>>,
}

impl Axis {
    /// Begins to change the position reference of a standing axis.
    pub fn redefine(&mut self, change: Redefine) -> Result<(), Failure> {
        let axis = self.instance();
        let scale = self.scale.ok_or(Failure::NotScaled { axis })?;
        if self.is_moving() {
            return Err(Failure::AxisBusy { axis });
        }
        if !self.has_position() {
            return Err(Failure::NoPosition { axis });
        }
        if self.fixed && self.seen.state == Some(AxisStateCode::RUNNING) {
            // The one command value is the set-point of the mode.
            let what = "room for a Position Displacement only while the axis is not Running";
            return Err(Failure::NotInFormat { what });
        }
        let present = self.command.position;
        let displacement = match change {
            Redefine::To(position) => position * scale - present,
            Redefine::By(distance) => distance * scale,
        };
        let end = present + displacement;
        let whole = i32::try_from(counts(displacement)).ok().filter(|_| self.setup.has_room_for(end));
        let Some(displacement) = whole.filter(|_| displacement.is_finite()) else {
            return Err(Failure::OutOfRange { axis, counts: end });
        };
        self.reference = Reference { displacement, under_way: true, ended: None };
        self.handshake.request(AxisControl::CHANGE_ACTUAL_POSITION);
        Ok(())
    }

    /// How the change ended, once.
    pub fn take_redefined(&mut self) -> Option<Result<(), Failure>> {
        let (axis, state) = (self.instance(), self.seen.state.unwrap_or(AxisStateCode::INITIALIZING));
        let ended = self.reference.ended.take()?;
        Some(ended.map_err(|(request, status)| Failure::RequestRefused { axis, request, status, state }))
    }

    /// Takes the acknowledges of both requests.
    pub(super) fn advance_reference(&mut self) {
        if !self.reference.under_way {
            return;
        }
        if let Some(answer) = self.handshake.take(AxisControl::CHANGE_ACTUAL_POSITION) {
            if answer.status != 0 {
                self.end_reference(Err((answer.request, answer.status)));
                return;
            }
            // In the same update as the request for it the command position is one of the new reference.
            self.command.position += f64::from(self.reference.displacement);
            self.following.clear();
            self.seen.rereference();
            self.handshake.chain(AxisControl::CHANGE_COMMAND_POSITION);
        } else if let Some(answer) = self.handshake.take(AxisControl::CHANGE_COMMAND_POSITION) {
            let refused = answer.status != 0;
            self.end_reference(if refused { Err((answer.request, answer.status)) } else { Ok(()) });
        }
    }

    fn end_reference(&mut self, ended: Result<(), (AxisControl, u8)>) {
        self.reference.under_way = false;
        self.reference.ended = Some(ended);
    }

    /// The displacement to send along with the request under way.
    pub(super) fn displacement(&self) -> Option<i32> {
        let changing = [AxisControl::CHANGE_ACTUAL_POSITION, AxisControl::CHANGE_COMMAND_POSITION];
        (self.reference.under_way && changing.contains(&self.handshake.code()))
            .then_some(self.reference.displacement)
    }

    /// Command Position has 32 bits: a position beyond them, after endless turning, is counted anew from
    /// what the device gives.
    pub(super) fn rebased(&mut self, actual: i64) -> i64 {
        if i32::try_from(actual).is_ok() || self.setup.unwind.is_some() {
            return actual;
        }
        let rolled = i64::from(crate::controller::number::roll(actual));
        self.seen.actual = Some(rolled);
        rolled
    }

    /// Actual position in units, as far as the scaling is known; else in counts.
    pub fn actual_units(&self) -> Option<f64> {
        self.seen.actual.map(|actual| float(actual) / self.scale())
    }
}
