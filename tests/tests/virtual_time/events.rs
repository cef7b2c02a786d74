//! Events: from an input of the drive to the controller.

use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::network::Knobs;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Event, Limits, Step};
use profile_cip::wire::motion::EventNotification;
use profile_cip::wire::motion::codes::{EventChecking, EventType};
use profile_cip::wire::motion::event::{ExtendedEventData, Window};
use profile_generic::capture::CaptureWindow;
use profile_generic::quantity::Position;
use profile_generic::servo::Marks;
use profile_generic::time::DurationNs;

/// Nanounits in a count of the controller: a millionth of a revolution.
const COUNT: i64 = NANO / 1_000_000;

/// Nanounits in a count of the drive's positions, 0.0001 degree, rounded up.
const DRIVE_COUNT: i64 = NANO / 3_600_000 + 1;

/// The telegrams' way of telling events, and the service channel's.
const WAYS: [&str; 2] = ["cyclic", "service-channel"];

const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 50.0, jerk: 1_000.0 };

fn settings(events: &str) -> Settings {
    let line = format!("events = \"{events}\"\ninstance = ");
    Settings { configuration: BOX.replace("instance = ", &line), ..Settings::default() }
}

/// A rig with the turntable, and what was really there.
struct Turntable {
    rig: Rig,
    /// Where the drive was at each telegram, with the system time.
    path: Vec<(i64, u64)>,
    last: i64,
}

impl Turntable {
    /// The turntable on its way at two revolutions a second, for a long time.
    fn turning(settings: Settings) -> Self {
        let mut rig = Rig::ready(settings);
        rig.connect(vec![
            Step::Enable(AxisSet::one(1)),
            Step::MoveAbsolute { axis: 1, position: 60.0, limits: LIMITS },
            Step::MoveAbsolute { axis: 1, position: 0.0, limits: LIMITS },
        ]);
        rig.run_until(millis(5_000), "full speed", |rig| rig.velocity(0) > 199 * NANO / 100);
        Self { last: 0, path: Vec::new(), rig }
    }

    fn run_for(&mut self, span: DurationNs) {
        let end = self.rig.now() + span;
        while self.rig.now() < end {
            self.step();
        }
    }

    fn step(&mut self) {
        self.rig.step();
        let position = self.rig.position(0);
        if position != self.last {
            self.last = position;
            self.path.push((position, self.rig.system().0));
        }
    }

    fn run_until(&mut self, what: &str, done: impl Fn(&Rig) -> bool) {
        let start = self.rig.now();
        while !done(&self.rig) {
            assert!(self.rig.now().since(start) < millis(3_000), "{what}: {:?}", self.told());
            self.step();
        }
    }

    /// Places `ahead` of where the axis is, in nanounits, on a whole count of controller and drive.
    fn ahead(&self, nanounits: i64) -> i64 {
        (self.rig.position(0) + nanounits) / (NANO / 1_000) * (NANO / 1_000)
    }

    fn arm(&mut self, checking: EventChecking, parameters: Option<ExtendedEventData>) {
        let controller = self.rig.controller.as_mut().expect("a controller");
        assert!(controller.arm_events(1, checking, parameters.as_ref()));
    }

    fn status(&self) -> EventChecking {
        self.rig.controller.as_ref().and_then(|controller| controller.event_status(1)).expect("an axis")
    }

    /// Arms and waits until the device says that it checks.
    fn arm_and_wait(&mut self, checking: EventChecking, parameters: Option<ExtendedEventData>) {
        self.arm(checking, parameters);
        self.run_until("the status bits", |rig| {
            rig.controller.as_ref().and_then(|controller| controller.event_status(1)) == Some(checking)
        });
    }

    fn told(&self) -> Vec<EventNotification> {
        let event = |event: &Event| match event {
            Event::AxisEvent { axis: 1, notification } => Some(*notification),
            _ => None,
        };
        self.rig.events.iter().filter_map(event).collect()
    }

    fn places(&self) -> Vec<(EventType, i64)> {
        self.told().iter().map(|event| (event.event_type, i64::from(event.position))).collect()
    }

    /// System time at which the axis was at a position.
    fn time_at(&self, position: i64) -> u64 {
        let pair = self.path.windows(2).find(|pair| {
            let ends = [pair[0].0, pair[1].0];
            ends.iter().min() <= Some(&position) && Some(&position) <= ends.iter().max()
        });
        let [(from, begin), (to, end)] = pair.expect("the axis was there") else { panic!("a pair") };
        let part = i128::from(position - from) * i128::from(end - begin) / i128::from(to - from);
        begin + u64::try_from(part).expect("within the pair")
    }

    /// Holds that an event is that of the edge at `place`: to a count, and to 20 microseconds of the straight line between
    /// two telegrams.
    fn assert_is_at(&self, event: &EventNotification, kind: EventType, place: i64) {
        assert_eq!((event.event_type, event.status), (kind, 0), "{event:?}");
        let position = i64::from(event.position) * COUNT;
        assert!((position - place).abs() <= COUNT / 2 + DRIVE_COUNT, "{position} instead of {place}");
        let late = i128::from(event.time_stamp) - i128::from(self.time_at(place));
        assert!(late.abs() < 20_000, "{late} ns late, {event:?}");
    }
}

fn mark(from: i64) -> Option<Marks> {
    Some(Marks { from: Position(from), length: Position(NANO / 100), every: None })
}

fn marks(from: i64, every: i64) -> Option<Marks> {
    Some(Marks { every: Some(Position(every)), ..mark(from)? })
}

#[test]
fn registration_on_a_moving_axis_is_exact_in_place_and_time() {
    for way in WAYS {
        let mut table = Turntable::turning(settings(way));
        let both = EventChecking::REG_1_POSITIVE | EventChecking::REG_2_NEGATIVE;
        table.arm_and_wait(both, None);
        let (first, second) = (table.ahead(NANO / 3), table.ahead(NANO / 2));
        table.rig.drive_mut(0).servo_mut().set_marks(1, mark(first));
        table.rig.drive_mut(0).servo_mut().set_marks(2, mark(second));
        table.run_for(millis(700));
        let told = table.told();
        assert_eq!(told.len(), 2, "{way}: {told:?}");
        table.assert_is_at(&told[0], EventType::REGISTRATION_1_POSITIVE, first);
        table.assert_is_at(&told[1], EventType::REGISTRATION_2_NEGATIVE, second + NANO / 100);
        assert_eq!(table.status(), EventChecking::empty(), "{way}: once each");
        // Another mark without arming is nobody's.
        let third = table.ahead(NANO / 3);
        table.rig.drive_mut(0).servo_mut().set_marks(1, mark(third));
        table.run_for(millis(400));
        assert_eq!(table.told().len(), 2, "{way}");
        // Armed again: only what comes then counts.
        table.arm_and_wait(EventChecking::REG_1_POSITIVE, None);
        let fourth = table.ahead(NANO / 3);
        table.rig.drive_mut(0).servo_mut().set_marks(1, mark(fourth));
        table.run_for(millis(700));
        let told = table.told();
        assert_eq!(told.len(), 3, "{way}: {told:?}");
        table.assert_is_at(&told[2], EventType::REGISTRATION_1_POSITIVE, fourth);
        assert_eq!(table.rig.report().failure, None, "{way}: {}", table.rig.log());
    }
}

/// Marks 25 ms apart with the telegrams, 500 ms with the service channel.
#[test]
fn auto_rearm_tells_every_mark_of_a_burst_whatever_the_network_loses() {
    for (way, every, seconds) in [("cyclic", NANO / 20, 2), ("service-channel", NANO, 5)] {
        for loss in [0, 150] {
            let mut table = Turntable::turning(settings(way));
            let bits = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_REARM;
            table.arm_and_wait(bits, None);
            table.rig.knobs = Knobs { loss, ..Knobs::GOOD };
            let first = table.ahead(NANO / 4);
            table.rig.drive_mut(0).servo_mut().set_marks(1, marks(first, every));
            // The marks reach back as well: the first is the one ahead.
            let first = (table.rig.position(0) - first).div_euclid(every) * every + first + every;
            table.run_for(millis(1_000 * seconds));
            table.rig.knobs = Knobs::GOOD;
            table.rig.drive_mut(0).servo_mut().set_marks(1, None);
            table.run_for(millis(300));
            let told = table.told();
            for (place, event) in (0..).zip(&told) {
                table.assert_is_at(event, EventType::REGISTRATION_1_POSITIVE, first + place * every);
            }
            let expected = 2 * NANO / every * seconds;
            let count = i64::try_from(told.len()).expect("few");
            assert!((count - expected).abs() <= 1, "{way}, loss {loss}: {count} of {expected}");
            let ids: Vec<u8> = told.iter().map(|event| event.event_id).collect();
            assert!(ids.windows(2).all(|pair| pair[1] == pair[0].wrapping_add(1)), "{ids:?}");
            assert_eq!(table.status(), bits);
        }
    }
}

#[test]
fn a_window_lets_only_the_edges_within_it_through() {
    let mut table = Turntable::turning(settings("cyclic"));
    let first = table.ahead(NANO);
    let counts = |place: i64| i32::try_from(place / COUNT).expect("near");
    let window = Window { min: counts(first + NANO * 9 / 10), max: counts(first + NANO * 11 / 10) };
    let data =
        ExtendedEventData { windows: [Some(window), None, None, None], ..ExtendedEventData::default() };
    let bits = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_WINDOW;
    table.arm_and_wait(bits, Some(data));
    table.rig.drive_mut(0).servo_mut().set_marks(1, marks(first, NANO / 2));
    table.run_for(millis(2_000));
    let told = table.told();
    assert_eq!(told.len(), 1, "{told:?}");
    table.assert_is_at(&told[0], EventType::REGISTRATION_1_POSITIVE, first + NANO);
    let counters = table.rig.engine.devices()[0].device().event_counters(0).expect("an axis");
    assert!(counters.outside_window >= 2, "{counters:?}");
}

#[test]
fn watch_positions_in_both_directions() {
    let mut table = Turntable::turning(settings("off"));
    let (first, second) = (table.ahead(NANO / 2), table.ahead(NANO * 2 / 3));
    let counts = |place: i64| Some(i32::try_from(place / COUNT).expect("near"));
    let data = ExtendedEventData {
        watch_positions: [counts(first), counts(second)],
        ..ExtendedEventData::default()
    };
    let bits =
        EventChecking::WATCH_1_FORWARD | EventChecking::WATCH_1_REVERSE | EventChecking::WATCH_2_FORWARD;
    // With the captures off nothing of the drive can be checked, and the status bits say so.
    table.arm(bits | EventChecking::REG_1_POSITIVE | EventChecking::HOME_POSITIVE, Some(data));
    table.run_for(millis(100));
    assert_eq!(table.status(), bits);
    table.run_for(millis(500));
    let told = table.told();
    assert_eq!(told.len(), 2, "{told:?}");
    table.assert_is_at(&told[0], EventType::WATCH_1_FORWARD, first);
    table.assert_is_at(&told[1], EventType::WATCH_2_FORWARD, second);
    table.path.clear();
    table.rig.run_until(millis(60_000), "the way back", |rig| rig.velocity(0) < -NANO);
    table.rig.run_until(millis(60_000), "the last turns", |rig| rig.position(0) < first + NANO);
    table.run_for(millis(800));
    let told = table.told();
    assert_eq!(told.len(), 3, "{told:?}");
    table.assert_is_at(&told[2], EventType::WATCH_1_REVERSE, first);
}

#[test]
fn home_switch_and_the_first_marker_after_it() {
    let mut table = Turntable::turning(settings("cyclic"));
    // The switch closes 0.4 turns before a marker.
    let turn = table.ahead(2 * NANO) / NANO * NANO;
    let from = turn - 4 * NANO / 10;
    let window = CaptureWindow { from: Position(from), to: Position(turn + NANO / 2) };
    table.rig.drive_mut(0).servo_mut().set_home_switch(Some(window));
    let bits = EventChecking::HOME_POSITIVE
        | EventChecking::HOME_NEGATIVE
        | EventChecking::HOME_MARKER_PP
        | EventChecking::HOME_MARKER_NP;
    // The falling edge of the marker is nothing that the drive shows: refused.
    table.arm(bits | EventChecking::HOME_MARKER_PN | EventChecking::MARKER_NEGATIVE, None);
    table.run_for(millis(50));
    assert_eq!(table.status(), bits);
    table.run_for(millis(2_500));
    let kinds: Vec<_> = table.places().iter().map(|(kind, _)| *kind).collect();
    use EventType as T;
    assert_eq!(kinds, [T::HOME_POSITIVE, T::HOME_MARKER_PP, T::HOME_NEGATIVE, T::HOME_MARKER_NP]);
    let told = table.told();
    table.assert_is_at(&told[1], T::HOME_MARKER_PP, turn);
    table.assert_is_at(&told[3], T::HOME_MARKER_NP, turn + NANO);
    // An input is seen with the telegram after its edge: never early, a bus cycle late at most.
    for (event, place) in [(&told[0], from), (&told[2], turn + NANO / 2)] {
        let late = i128::from(event.time_stamp) - i128::from(table.time_at(place));
        assert!((0..=2_000_000).contains(&late), "{late} ns late");
        let beyond = i64::from(event.position) * COUNT - place;
        assert!((-COUNT..NANO / 200).contains(&beyond), "{beyond} beyond");
    }
}

#[test]
fn telegrams_lost_on_the_bus_lose_no_event() {
    let mut table = Turntable::turning(settings("cyclic"));
    table.arm_and_wait(EventChecking::REG_1_POSITIVE | EventChecking::MARKER_POSITIVE, None);
    let place = table.ahead(NANO / 8);
    table.rig.drive_mut(0).servo_mut().set_marks(1, mark(place));
    table.run_until("the mark", |rig| rig.position(0) > place - NANO / 200);
    // Every second pair of frames is lost while the mark is passed.
    let mut frames = 0_u32;
    table.rig.tamper_frame = Some(Box::new(move |_| {
        frames += 1;
        (frames / 4).is_multiple_of(2)
    }));
    table.run_for(millis(30));
    table.rig.tamper_frame = None;
    table.run_for(millis(600));
    let told = table.told();
    assert_eq!(told.len(), 2, "{told:?} {}", table.rig.told());
    table.assert_is_at(&told[0], EventType::REGISTRATION_1_POSITIVE, place);
    let turn = i64::from(told[1].position) * COUNT;
    table.assert_is_at(&told[1], EventType::MARKER_POSITIVE, (turn + NANO / 2) / NANO * NANO);
}
