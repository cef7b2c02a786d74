//! Probing, home switch and marker of the drive.
//!
//! ```text
//! S-0-0170 started, S-0-0405 (probe 1) or S-0-0406 (probe 2) = 1, edge selected in S-0-0169
//!     -> the first edge stores the feedback value in S-0-0130..0133 and sets its bit in S-0-0179 and S-0-0409..0412
//!     -> that edge is blocked until the enable has gone 1 -> 0 -> 1
//! enable = 0, or S-0-0170 cancelled -> the bits go away
//! ```
//!
//! This is how Rexroth, Metronix and Moog drives do it. S-0-0440 and S-0-0442, the position of the last marker and their
//! number, are named by the standard and described by nobody that we know of: here the rising edge of each marker counts.

use profile_generic::capture::{CaptureEdge, CaptureRequest, CaptureSource, CaptureStatus};
use profile_generic::quantity::Position;
use profile_generic::servo::{Servo, ServoActual, input};

use super::super::application::{Order, Progress};
use super::super::parameter::{Cyclic, Definition, Store};
use crate::wire::idn::Idn;

/// IDNs of probing.
pub mod idn {
    use crate::wire::idn::Idn;

    /// S-0-0130 to S-0-0133: in the order of the bits of S-0-0169 and S-0-0179.
    pub const VALUES: [Idn; 4] = [
        Idn::PROBE_VALUE_1_POSITIVE_EDGE,
        Idn::PROBE_VALUE_1_NEGATIVE_EDGE,
        Idn::PROBE_VALUE_2_POSITIVE_EDGE,
        Idn::PROBE_VALUE_2_NEGATIVE_EDGE,
    ];
    /// S-0-0401 and S-0-0402: the levels of the inputs.
    pub const INPUTS: [Idn; 2] = [Idn::PROBE_1, Idn::PROBE_2];
    /// S-0-0405 and S-0-0406.
    pub const ENABLES: [Idn; 2] = [Idn::PROBE_1_ENABLE, Idn::PROBE_2_ENABLE];
    /// S-0-0409 to S-0-0412: the bits of S-0-0179, each by itself.
    pub const LATCHED: [Idn; 4] = [
        Idn::PROBE_1_POSITIVE_LATCHED,
        Idn::PROBE_1_NEGATIVE_LATCHED,
        Idn::PROBE_2_POSITIVE_LATCHED,
        Idn::PROBE_2_NEGATIVE_LATCHED,
    ];
}

/// Element 3.
mod attribute {
    pub const BITS_READ: u32 = 0x7001_0001;
    pub const BITS: u32 = 0x0001_0001;
    pub const BITS_CP4: u32 = 0x3001_0001;
    pub const COMMAND_CP4: u32 = 0x3009_0001;
    pub const POSITION_READ: u32 = 0x7422_0001;
    pub const COUNTER_READ: u32 = 0x7011_0001;
}

/// The edges in the order of the bits of S-0-0169 and S-0-0179.
const EDGES: [(CaptureSource, CaptureEdge); 4] = [
    (CaptureSource::Registration1, CaptureEdge::Positive),
    (CaptureSource::Registration1, CaptureEdge::Negative),
    (CaptureSource::Registration2, CaptureEdge::Positive),
    (CaptureSource::Registration2, CaptureEdge::Negative),
];

/// Adds the parameters of probing.
pub fn define(store: &mut Store, length: &'static str) {
    use Cyclic::{Both, Feedback};
    use attribute as a;
    let value = |idn, attribute, name| Definition::value(idn, attribute, name, 0);
    let names = [
        ("Probe value 1 positive edge", "Probe 1 positive latched"),
        ("Probe value 1 negative edge", "Probe 1 negative latched"),
        ("Probe value 2 positive edge", "Probe 2 positive latched"),
        ("Probe value 2 negative edge", "Probe 2 negative latched"),
    ];
    for (edge, (value_name, latched_name)) in names.into_iter().enumerate() {
        store.define(value(idn::VALUES[edge], a::POSITION_READ, value_name).cyclic(Feedback).unit(length));
        store.define(value(idn::LATCHED[edge], a::BITS_READ, latched_name).cyclic(Feedback));
    }
    let definitions = [
        value(Idn::PROBE_CONTROL_PARAMETER, a::BITS, "Probe control parameter"),
        Definition::command(Idn::PROBING_CYCLE, a::COMMAND_CP4, "Probing cycle procedure command"),
        value(Idn::PROBE_STATUS, a::BITS_READ, "Probe status").cyclic(Feedback),
        value(Idn::HOME_SWITCH, a::BITS_READ, "Home switch").cyclic(Feedback),
        value(idn::INPUTS[0], a::BITS_READ, "Probe 1").cyclic(Feedback),
        value(idn::INPUTS[1], a::BITS_READ, "Probe 2").cyclic(Feedback),
        value(idn::ENABLES[0], a::BITS_CP4, "Probe 1 enable").cyclic(Both),
        value(idn::ENABLES[1], a::BITS_CP4, "Probe 2 enable").cyclic(Both),
        value(Idn::MARKER_POSITION_FEEDBACK_1, a::POSITION_READ, "Marker position feedback 1")
            .cyclic(Feedback)
            .unit(length),
        value(Idn::COUNTER_MARKER_POSITION_FEEDBACK_1, a::COUNTER_READ, "Counter marker position feedback 1")
            .cyclic(Feedback),
    ];
    for definition in definitions {
        store.define(definition);
    }
}

/// State of probing.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Probe {
    /// S-0-0170 is in process.
    active: bool,
    enabled: [bool; 2],
    /// S-0-0179.
    latched: u8,
    markers: u16,
    /// Where the home switch went active, and where a marker was, since they were taken.
    homing: (Option<Position>, Option<Position>),
}

impl Probe {
    /// Lets the servo capture every edge; which of them count is decided here.
    pub fn new(servo: &mut Servo) -> Self {
        let others = [CaptureSource::Marker, CaptureSource::HomeSwitch];
        let others = others.map(|source| (source, CaptureEdge::Positive));
        for (source, edge) in EDGES.into_iter().chain(others) {
            servo.capture(CaptureRequest { auto_rearm: true, ..CaptureRequest::arm(0, source, edge) });
        }
        Self::default()
    }

    /// The master's order to S-0-0170.
    pub fn order(&mut self, order: Order) -> Progress {
        self.active = matches!(order, Order::Start | Order::Resume);
        if order == Order::Cancel {
            self.latched = 0;
        }
        Progress::InProcess
    }

    /// Before the servo moves: the enables of this cycle count from now on.
    pub fn enable(&mut self, store: &Store) {
        for (probe, idn) in idn::ENABLES.into_iter().enumerate() {
            self.enabled[probe] = store.number_of(idn) & 1 != 0;
            if !self.enabled[probe] {
                self.latched &= !(0b11 << (2 * probe));
            }
        }
    }

    /// Takes what the servo has captured; `counts` are the feedback counts of a position.
    pub fn collect(&mut self, servo: &mut Servo, store: &mut Store, counts: impl Fn(Position) -> i64) {
        while let Some(result) = servo.poll_capture() {
            if result.status != CaptureStatus::Captured {
                continue;
            }
            if result.source == CaptureSource::HomeSwitch {
                self.homing.0 = Some(result.position);
                continue;
            }
            if result.source == CaptureSource::Marker {
                self.homing.1 = Some(result.position);
                self.markers = self.markers.wrapping_add(1);
                store.set_number_of(Idn::MARKER_POSITION_FEEDBACK_1, counts(result.position));
                continue;
            }
            let Some(edge) = EDGES.iter().position(|known| *known == (result.source, result.edge)) else {
                continue;
            };
            let selected = store.number_of(Idn::PROBE_CONTROL_PARAMETER) & 1 << edge != 0;
            let open = self.active && self.enabled[edge / 2] && selected && self.latched & 1 << edge == 0;
            if open {
                self.latched |= 1 << edge;
                store.set_number_of(idn::VALUES[edge], counts(result.position));
            }
        }
    }

    /// Where the home switch went active, and where the last marker was, since the last call.
    pub fn take_homing_edges(&mut self) -> (Option<Position>, Option<Position>) {
        core::mem::take(&mut self.homing)
    }

    /// The words for the master.
    pub fn publish(&self, actual: &ServoActual, store: &mut Store) {
        store.set_number_of(Idn::PROBE_STATUS, i64::from(self.latched));
        for (edge, idn) in idn::LATCHED.into_iter().enumerate() {
            store.set_number_of(idn, i64::from(self.latched >> edge & 1));
        }
        let level = |bit| i64::from(actual.digital_inputs & bit != 0);
        store.set_number_of(Idn::HOME_SWITCH, level(input::HOME_SWITCH));
        store.set_number_of(idn::INPUTS[0], level(input::REGISTRATION_1));
        store.set_number_of(idn::INPUTS[1], level(input::REGISTRATION_2));
        store.set_number_of(Idn::COUNTER_MARKER_POSITION_FEEDBACK_1, i64::from(self.markers));
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::servo::{Marks, ServoCommand, ServoParameters};
    use profile_generic::time::{DurationNs, MonotonicTime};

    use super::super::super::application::{Application, Cycle};
    use super::super::super::phase::State;
    use super::super::Drive;
    use super::*;
    use crate::wire::header::Phase;

    struct Rig {
        drive: Drive,
        store: Store,
    }

    impl Rig {
        fn new() -> Self {
            let mut drive = Drive::new(ServoParameters::default()).expect("a drive");
            let mut store = Store::new();
            drive.define(&mut store);
            store.set_number_of(Idn::PROBE_CONTROL_PARAMETER, 0xF);
            Self { drive, store }
        }

        fn cycle(&mut self) {
            let cycle = Cycle {
                now: MonotonicTime(0),
                elapsed: DurationNs::from_millis(1),
                state: State::In(Phase::CP4),
                connected: true,
                fresh: true,
            };
            self.drive.cycle(cycle, &mut self.store);
        }

        fn enable(&mut self, on: [bool; 2]) {
            for (idn, on) in idn::ENABLES.into_iter().zip(on) {
                self.store.set_number_of(idn, i64::from(on));
            }
            self.cycle();
        }

        /// A pulse on both inputs with the axis a little further each time.
        fn pulse(&mut self, place: i64) -> i64 {
            self.drive.servo_mut().set_position(Position(place));
            for level in [true, false] {
                for input in [1, 2] {
                    self.drive.servo_mut().set_registration(input, level);
                }
            }
            self.cycle();
            self.status()
        }

        fn status(&self) -> i64 {
            let bits = idn::LATCHED.into_iter().rev();
            let single = bits.fold(0, |word, idn| word << 1 | self.store.number_of(idn));
            assert_eq!(self.store.number_of(Idn::PROBE_STATUS), single);
            single
        }
    }

    /// S-0-0170, the enables and the selection: what of them lets an edge through.
    #[test]
    fn an_edge_needs_the_command_its_enable_and_its_selection() {
        for command in [false, true] {
            for enables in 0..4_u8 {
                for control in 0..16 {
                    let mut rig = Rig::new();
                    if command {
                        let store = &mut rig.store;
                        assert_eq!(
                            rig.drive.order(Idn::PROBING_CYCLE, Order::Start, store),
                            Ok(Progress::InProcess)
                        );
                        assert_eq!(rig.drive.progress(Idn::PROBING_CYCLE, store), Progress::InProcess);
                    }
                    rig.store.set_number_of(Idn::PROBE_CONTROL_PARAMETER, control);
                    rig.enable([enables & 1 != 0, enables & 2 != 0]);
                    let open = [0, 0b0011, 0b1100, 0b1111][usize::from(enables)];
                    let expected = if command { open & control } else { 0 };
                    assert_eq!(rig.pulse(1_000_000), expected, "{command} {enables} {control:#b}");
                }
            }
        }
    }

    #[test]
    fn an_edge_that_was_latched_is_blocked_until_the_enable_rises_again() {
        let mut rig = Rig::new();
        rig.drive.order(Idn::PROBING_CYCLE, Order::Start, &mut rig.store).expect("a command");
        rig.enable([true, false]);
        // 0.0001 degree: 3600 counts are a thousandth of a turn.
        assert_eq!(rig.pulse(1_000_000), 0b0011);
        assert_eq!(rig.pulse(2_000_000), 0b0011);
        assert_eq!(idn::VALUES.map(|idn| rig.store.number_of(idn)), [3_600, 3_600, 0, 0]);
        rig.enable([false, false]);
        assert_eq!(rig.status(), 0);
        assert_eq!(rig.pulse(3_000_000), 0, "disabled");
        rig.enable([true, true]);
        assert_eq!(rig.pulse(4_000_000), 0b1111);
        assert_eq!(idn::VALUES.map(|idn| rig.store.number_of(idn)), [14_400; 4]);
        rig.drive.order(Idn::PROBING_CYCLE, Order::Cancel, &mut rig.store).expect("a command");
        rig.cycle();
        assert_eq!(rig.status(), 0);
        assert_eq!(rig.pulse(5_000_000), 0, "cancelled");
    }

    #[test]
    fn marks_markers_and_the_home_switch_show_where_they_are_passed() {
        let mut rig = Rig::new();
        rig.drive.order(Idn::PROBING_CYCLE, Order::Start, &mut rig.store).expect("a command");
        let marks = Marks { from: Position(250_000_000), length: Position(100_000_000), every: None };
        rig.drive.servo_mut().set_marks(2, Some(marks));
        rig.enable([true, true]);
        let turn = ServoCommand {
            control: profile_generic::servo::ServoControl::Enable,
            mode: profile_generic::mode::OperatingMode::Velocity,
            velocity: profile_generic::quantity::Velocity(10_000_000_000),
            ..ServoCommand::default()
        };
        for _ in 0..4_000 {
            rig.drive.servo_mut().step(100_000, &ServoCommand::default());
        }
        for _ in 0..1_500 {
            rig.drive.servo_mut().step(100_000, &turn);
            let Drive { probe, servo, .. } = &mut rig.drive;
            probe.collect(servo, &mut rig.store, |place| place.0);
        }
        let passed = rig.drive.servo().position().0;
        assert!(passed > 1_000_000_000, "{passed}");
        let values = idn::VALUES.map(|idn| rig.store.number_of(idn));
        assert_eq!(values, [0, 0, 250_000_000, 349_999_999]);
        rig.cycle();
        assert_eq!(rig.store.number_of(Idn::COUNTER_MARKER_POSITION_FEEDBACK_1), passed / 1_000_000_000);
        assert_eq!(
            rig.store.number_of(Idn::MARKER_POSITION_FEEDBACK_1),
            passed / 1_000_000_000 * 1_000_000_000
        );
        assert_eq!(rig.status(), 0b1100);
    }
}
