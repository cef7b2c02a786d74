//! Events of an axis: what the device evaluates itself, and the positions that the controller gets to see.

use super::drive_link::DriveImage;
use super::event_channel::EventChannel;
use super::reference::References;
use crate::wire::motion::codes::{EventChecking, EventType};

/// Watch events: number of the watch position, whether it is passed forward, event type.
const WATCHES: [(usize, bool, EventType); 4] = [
    (0, true, EventType::WATCH_1_FORWARD),
    (0, false, EventType::WATCH_1_REVERSE),
    (1, true, EventType::WATCH_2_FORWARD),
    (1, false, EventType::WATCH_2_REVERSE),
];

/// Counts after which a position that is not unwound shows as the same: a DINT rolls over.
const DINT_RANGE: u64 = 1 << 32;

/// Counts from `from` to the first place on the way to `to` that shows as `mark`, a position that is the same again after
/// `range` counts; `None` if the way does not reach such a place. Standing on it is not reaching it.
fn distance_to(mark: i32, from: i64, to: i64, range: u64, forward: bool) -> Option<u64> {
    let way = if forward { to.checked_sub(from) } else { from.checked_sub(to) };
    let way = u64::try_from(way?).ok()?;
    let gap = i128::from(mark) - i128::from(from);
    let gap = u64::try_from((if forward { gap } else { -gap }).rem_euclid(i128::from(range))).ok()?;
    let gap = if gap == 0 { range } else { gap };
    (1..=way).contains(&gap).then_some(gap)
}

/// The instant at which `part` of `way` was covered, at even speed.
fn instant(before: u64, after: u64, part: u64, way: u64) -> u64 {
    let span = u128::from(after.saturating_sub(before));
    let passed = span * u128::from(part) / u128::from(way.max(1));
    before.saturating_add(u64::try_from(passed).unwrap_or(u64::MAX))
}

/// What of the drive's last report counts for the next one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    online: bool,
    position: i64,
    unwind: Option<u32>,
    torque: Option<f32>,
    captured_at: u64,
    pub scaling_id: u32,
}

impl Sample {
    pub const fn of(image: &DriveImage) -> Self {
        let DriveImage { online, position, unwind, torque, captured_at, scaling_id, .. } = *image;
        Self { online, position, unwind, torque, captured_at, scaling_id }
    }
}

/// The events that the device evaluates itself.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Watch {
    /// Since when the torque is beyond the Home Torque Threshold, system time in ns.
    torque_since: Option<u64>,
}

impl Watch {
    /// New actual values are there: tells the event channel what is being looked for, and looks for what the device
    /// evaluates itself. Values of `before` that the controller armed after do not count.
    pub fn check(
        &mut self,
        events: &mut EventChannel,
        before: &Sample,
        drive: &DriveImage,
        references: &References,
    ) {
        let now = Sample::of(drive);
        events.support(if now.online { drive.events } else { EventChecking::empty() });
        let timed = now.online && now.captured_at != 0;
        if timed && before.online && before.captured_at != 0 && now.captured_at > before.captured_at {
            watch_positions(events, before, &now, references);
            self.watch_torque(events, &now, references);
        }
        let mut checking = if now.online { drive.events_checking } else { EventChecking::empty() };
        checking -= EventChecking::WATCHES | EventChecking::HOME_TORQUE;
        checking.set(EventChecking::WATCHES, timed);
        checking.set(EventChecking::HOME_TORQUE, timed && now.torque.is_some());
        events.confirm(checking);
    }

    /// The torque counts by its magnitude: an axis is driven against a stop in either direction. The threshold has to be
    /// exceeded in every update for the Home Torque Time, zero if the controller gives none.
    fn watch_torque(&mut self, events: &mut EventChannel, now: &Sample, references: &References) {
        let parameters = events.parameters();
        let limit = parameters.home_torque_threshold.map_or(f32::INFINITY, f32::abs);
        let seconds = f64::from(parameters.home_torque_time.unwrap_or(0.0));
        let checking = events.is_checking(EventType::HOME_TORQUE);
        if !checking || now.torque.is_none_or(|torque| torque.abs() <= limit) {
            self.torque_since = None;
            return;
        }
        let since = *self.torque_since.get_or_insert(now.captured_at);
        let lasted = core::time::Duration::from_nanos(now.captured_at.saturating_sub(since));
        if lasted.as_secs_f64() >= seconds {
            self.torque_since = None;
            let position = references.see(now.position, now.unwind).dint();
            events.notify(EventType::HOME_TORQUE, 0, position, now.captured_at);
        }
    }
}

fn watch_positions(events: &mut EventChannel, before: &Sample, now: &Sample, references: &References) {
    let (from, to) = (references.actual(before.position), references.actual(now.position));
    let range = now.unwind.map_or(DINT_RANGE, u64::from);
    let marks = events.parameters().watch_positions;
    for (number, forward, event) in WATCHES {
        let Some(mark) = marks[number].filter(|_| events.is_checking(event)) else { continue };
        if let Some(gap) = distance_to(mark, from, to, range, forward) {
            let at = instant(before.captured_at, now.captured_at, gap, to.abs_diff(from));
            events.notify(event, 0, mark, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_reached_from_either_side_and_across_the_end_of_the_range() {
        let rows = [
            ("forward onto it", 10, 5, 10, true, Some(5)),
            ("forward across it", 10, 5, 50, true, Some(5)),
            ("not far enough", 10, 5, 9, true, None),
            ("standing on it", 10, 10, 10, true, None),
            ("leaving it", 10, 10, 12, true, None),
            ("the other way", 10, 12, 8, true, None),
            ("backward onto it", 10, 12, 10, false, Some(2)),
            ("backward across it", -3, 12, -20, false, Some(15)),
            ("forward, not backward", 10, 5, 20, false, None),
            ("over the top", i32::MIN + 2, i64::from(i32::MAX) - 1, i64::from(i32::MAX) + 9, true, Some(4)),
            ("a turn of the range later", 7, (1 << 32) + 5, (1 << 32) + 9, true, Some(2)),
            ("more than a whole range", 7, 0, 1 << 33, true, Some(7)),
            ("more than an i64", 7, i64::MIN, i64::MAX, true, None),
        ];
        for (what, mark, from, to, forward, expected) in rows {
            assert_eq!(distance_to(mark, from, to, DINT_RANGE, forward), expected, "{what}");
        }
        let cyclic = |mark, from, to, forward| distance_to(mark, from, to, 360, forward);
        assert_eq!(cyclic(10, 355, 375, true), Some(15), "across the end of a cycle");
        assert_eq!(cyclic(350, 5, -15, false), Some(15), "and back");
        assert_eq!(cyclic(10, 10, 369, true), None, "not around yet");
        assert_eq!(cyclic(10, 10, 370, true), Some(360), "once around");
        assert_eq!(cyclic(400, 0, 1_000, true), Some(40), "a mark beyond the cycle is the place in it");
    }

    #[test]
    fn the_instant_lies_between_the_samples() {
        assert_eq!(instant(1_000, 3_000, 5, 20), 1_500);
        assert_eq!(instant(1_000, 3_000, 20, 20), 3_000);
        assert_eq!(instant(u64::MAX - 10, u64::MAX, u64::MAX, u64::MAX), u64::MAX);
        assert_eq!(instant(5, 9, 0, 0), 5);
    }
}
