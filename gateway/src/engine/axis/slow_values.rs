//! Values of the drive that change slowly and that no telegram carries: read again and again while the controller has a limit of theirs
//! watched.

use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::diagnosis::ANSWER_TIME_OUT;
use super::user_limits::UserLimits;
use crate::mapping::{DriveProgram, Item};

/// Each of them, and the signal that takes its place in a telegram.
const SLOW: [(Parameter, Option<Signal>); 3] = [
    (Parameter::BUS_VOLTAGE, Some(Signal::BusVoltage)),
    (Parameter::MOTOR_TEMPERATURE, Some(Signal::Temperature)),
    (Parameter::DRIVE_TEMPERATURE, None),
];

/// Time between two reads.
const REFRESH: DurationNs = DurationNs::from_millis(250);

/// A value is older than this, and nothing follows from it.
const STALE: DurationNs = DurationNs::from_millis(5_000);

/// What is known of the slow values of one drive.
#[derive(Debug, Default)]
pub(super) struct SlowValues {
    /// In their generic units, and when the drive has said so.
    known: [Option<(i64, MonotonicTime)>; SLOW.len()],
    /// The place of the one that the drive was asked for, and when.
    asked: Option<(usize, MonotonicTime)>,
    /// The place of the next one, and when.
    next: (usize, MonotonicTime),
}

impl SlowValues {
    /// The next one that has a limit and should be read now: its place and what carries it.
    pub fn wanted(
        &self,
        now: MonotonicTime,
        limits: &UserLimits,
        program: &DriveProgram,
    ) -> Option<(usize, Item)> {
        let waits = self.asked.is_some_and(|(_, since)| now.since(since) < ANSWER_TIME_OUT);
        if waits || now < self.next.1 {
            return None;
        }
        let mut places = (0..SLOW.len()).map(|step| (self.next.0 + step) % SLOW.len());
        places.find_map(|place| {
            let (parameter, signal) = *SLOW.get(place)?;
            let is_in_telegram = signal.is_some_and(|signal| program.tells(signal));
            let is_wanted = limits.watches(parameter) && !is_in_telegram;
            let held = program.parameter(parameter).filter(|_| is_wanted)?;
            Some((place, held.item))
        })
    }

    /// The one in this place is on its way.
    pub fn ask(&mut self, now: MonotonicTime, place: usize) {
        (self.asked, self.next) = (Some((place, now)), (place + 1, now + REFRESH));
    }

    /// Takes the answer of the drive. What it does not give is not known.
    pub fn take(
        &mut self,
        now: MonotonicTime,
        item: Item,
        data: Option<&[u8]>,
        program: Option<&DriveProgram>,
    ) {
        let Some((place, _)) = self.asked.take() else { return };
        let parameter = SLOW.get(place).map(|(parameter, _)| *parameter);
        let held = parameter.and_then(|parameter| program?.parameter(parameter));
        let held = held.filter(|held| held.item == item);
        if let Some(known) = self.known.get_mut(place) {
            *known = data.and_then(|data| held?.decode(data)).map(|value| (value, now));
        }
    }

    /// Voltage of the bus, temperature of the motor and of the power stage, as far as they are known at `now`. `signal` gives what the
    /// telegram carries.
    pub fn at(
        &self,
        now: MonotonicTime,
        signal: impl Fn(Signal) -> Option<i64>,
    ) -> [Option<i64>; SLOW.len()] {
        let mut values =
            self.known.map(|known| known.filter(|(_, at)| now.since(*at) <= STALE).map(|(value, _)| value));
        for (value, (_, of_telegram)) in values.iter_mut().zip(SLOW) {
            *value = of_telegram.and_then(&signal).or(*value);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime(1) + DurationNs::from_millis(millis)
    }

    #[test]
    fn a_value_counts_for_five_seconds_and_the_telegram_before_it() {
        let slow =
            SlowValues { known: [Some((3, at(0))), Some((4, at(1_000))), None], ..SlowValues::default() };
        assert_eq!(slow.at(at(5_000), |_| None), [Some(3), Some(4), None]);
        assert_eq!(slow.at(at(5_001), |_| None), [None, Some(4), None], "that was too long ago");
        let telegram = |signal| (signal == Signal::BusVoltage).then_some(9);
        assert_eq!(slow.at(at(9_000), telegram), [Some(9), None, None]);
    }
}
