//! Local control: people move axes in generic units while no controller has them, and a controller gets them without a jump.

use axisbridge::engine::axis::Owner;
use axisbridge::engine::local::{
    Answer, ClientEnd, Failure, Generator, JOG_TIME, Jog, LocalNorth, Move, Order, Request,
};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Step};
use profile_generic::capture::CaptureWindow;
use profile_generic::fault::FaultCause;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::servo::ServoParameters;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::DurationNs;
use profile_sercos::wire::idn::Idn;

use super::beside::connect;

const NANO: i64 = 1_000_000_000;
const TURNTABLE: u8 = 0;
const SLIDE: u8 = 1;
/// Number of the attribute Flying Start Enable.
const FLYING_START_ENABLE: u16 = 380;

/// A box with local control, and its clients.
struct Bench {
    rig: Rig,
    end: ClientEnd,
    ids: u32,
}

/// The box of the rig, whose drives are set up to move by themselves as well.
fn configuration(modes: &str) -> String {
    let limits = "following_error = 0.5\nvelocity = 20.0\nacceleration = 200.0";
    let text = BOX.replacen("following_error = 0.5", limits, 1);
    let modes = format!("address = 1\nmodes = [{modes}]");
    text.replacen("address = 1", &modes, 1)
}

const ALL: &str = "\"position\", \"velocity\", \"positioning\", \"homing\"";

impl Bench {
    fn new(modes: &str) -> Self {
        Self::on(Rig::ready(Settings { configuration: configuration(modes), ..Settings::default() }))
    }

    fn on(mut rig: Rig) -> Self {
        rig.run_until(DurationNs::from_secs(5), "the drives", |rig| {
            rig.engine.axes().iter().all(|axis| axis.state() == DriveState::Inhibited)
        });
        let (local, end) = LocalNorth::new(rig.engine.axes().len());
        rig.engine.set_local(local);
        Self { rig, end, ids: 0 }
    }

    /// Gives an order; its number.
    fn give(&mut self, client: u32, axis: u8, order: Order) -> u32 {
        self.ids += 1;
        self.end.requests.push(Request::Order { client, id: self.ids, axis, order }).expect("room");
        self.ids
    }

    fn run_for(&mut self, millis: i64) {
        self.rig.run_for(DurationNs::from_millis(millis));
    }

    /// The next answer, which comes within so many milliseconds.
    fn answer(&mut self, millis: i64) -> Answer {
        for _ in 0..millis {
            if let Ok(answer) = self.end.answers.pop() {
                return answer;
            }
            self.run_for(1);
        }
        panic!("no answer within {millis} ms: {}", self.rig.told());
    }

    /// Gives an order as the first client and waits for what comes of it.
    fn order(&mut self, axis: u8, order: Order) -> Result<(), Failure> {
        let id = self.give(1, axis, order);
        let answer = self.answer(20_000);
        assert_eq!((answer.client, answer.id), (1, id));
        answer.result.map(|value| assert_eq!(value, None, "an order has no value"))
    }

    fn state(&self, axis: u8) -> DriveState {
        self.rig.engine.axes()[usize::from(axis)].state()
    }

    fn owner(&self, axis: u8) -> Owner {
        self.rig.status().axes[usize::from(axis)].owner
    }

    /// Where the drive really is.
    fn place(&self, axis: u8) -> i64 {
        self.rig.drive(usize::from(axis)).servo().position().get()
    }

    fn speed(&self, axis: u8) -> i64 {
        self.rig.drive(usize::from(axis)).actual().velocity.get()
    }
}

fn jog(velocity: i64) -> Order {
    Order::Jog(Jog {
        velocity: Velocity(velocity),
        acceleration: Some(Acceleration(20 * NANO)),
        time: JOG_TIME,
    })
}

fn to(place: i64, velocity: i64, by: Option<Generator>) -> Move {
    Move {
        to: Position(place),
        velocity: Velocity(velocity),
        acceleration: Some(Acceleration(20 * NANO)),
        by,
    }
}

#[test]
fn an_axis_is_enabled_moved_and_disabled() {
    for (by, name) in [(None, "the drive"), (Some(Generator::Gateway), "the gateway")] {
        let mut bench = Bench::new(ALL);
        assert_eq!(bench.state(TURNTABLE), DriveState::Inhibited, "no controller has configured it");
        assert_eq!(bench.order(TURNTABLE, Order::Enable), Ok(()), "{name}");
        assert_eq!((bench.state(TURNTABLE), bench.owner(TURNTABLE)), (DriveState::Operating, Owner::Local));
        assert_eq!(bench.owner(SLIDE), Owner::Nobody);
        assert_eq!(bench.order(TURNTABLE, Order::Move(to(3 * NANO / 2, NANO, by))), Ok(()), "{name}");
        let place = bench.place(TURNTABLE);
        assert!((place - 3 * NANO / 2).abs() < NANO / 1_000, "{name}: {place}");
        assert!(
            bench.speed(TURNTABLE).abs() < NANO / 100,
            "it rests when the order is said to be carried out"
        );
        assert_eq!(bench.order(TURNTABLE, Order::Move(to(-NANO / 4, 2 * NANO, by))), Ok(()), "{name}");
        let place = bench.place(TURNTABLE);
        assert!((place + NANO / 4).abs() < NANO / 1_000, "{name}: {place}");
        assert_eq!(bench.order(TURNTABLE, Order::Disable), Ok(()));
        assert!(bench.rig.torque_free());
        bench.run_for(20);
        assert_eq!((bench.state(TURNTABLE), bench.owner(TURNTABLE)), (DriveState::Inhibited, Owner::Nobody));
    }
}

#[test]
fn a_jog_ends_by_itself_when_nobody_repeats_it() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let mut fastest = 0;
    for _ in 0..5 {
        assert_eq!(bench.order(TURNTABLE, jog(-2 * NANO)), Ok(()));
        let end = bench.rig.now() + DurationNs::from_millis(300);
        while bench.rig.now() < end {
            bench.rig.step();
            fastest = fastest.max(bench.speed(TURNTABLE).abs());
        }
    }
    assert!((fastest - 2 * NANO).abs() < NANO / 10, "{fastest}");
    assert!(bench.place(TURNTABLE) < -2 * NANO, "{}", bench.place(TURNTABLE));
    // 500 ms after the last one it brakes.
    bench.run_for(180);
    assert!(bench.speed(TURNTABLE) < -19 * NANO / 10, "{}", bench.speed(TURNTABLE));
    bench.run_for(160);
    assert!(bench.speed(TURNTABLE).abs() < NANO / 50, "{}", bench.speed(TURNTABLE));
    assert_eq!(bench.state(TURNTABLE), DriveState::Operating, "with torque");
    // One that is for a shorter time brakes sooner.
    let short = Jog {
        velocity: Velocity(2 * NANO),
        acceleration: Some(Acceleration(50 * NANO)),
        time: DurationNs::from_millis(200),
    };
    bench.order(TURNTABLE, Order::Jog(short)).unwrap();
    bench.run_for(180);
    assert!(bench.speed(TURNTABLE) > 19 * NANO / 10, "{}", bench.speed(TURNTABLE));
    bench.run_for(80);
    assert!(bench.speed(TURNTABLE).abs() < NANO / 50, "{}", bench.speed(TURNTABLE));
    // The other way at once, and to rest by a stop.
    bench.order(TURNTABLE, jog(3 * NANO)).unwrap();
    bench.run_for(200);
    assert!(bench.speed(TURNTABLE) > 2 * NANO);
    assert_eq!(bench.order(TURNTABLE, Order::Stop), Ok(()));
    // A hundredth of the highest speed counts as standing.
    assert!(bench.speed(TURNTABLE).abs() < NANO / 5, "{}", bench.speed(TURNTABLE));
    assert_eq!(bench.state(TURNTABLE), DriveState::Operating);
}

#[test]
fn the_drive_homes_and_goes_on_from_its_reference() {
    let mut bench = Bench::new(ALL);
    let window = CaptureWindow { from: Position(1_300_000_000), to: Position(1_600_000_000) };
    bench.rig.drive_mut(0).servo_mut().set_home_switch(Some(window));
    let store =
        |bench: &mut Bench, idn, value| bench.rig.line.slaves_mut()[0].store_mut().set_number_of(idn, value);
    // The reference point is 0.05 turns behind the marker, and its position 10 turns, in 0.0001 degree.
    store(&mut bench, Idn::REFERENCE_DISTANCE_1, 36_000_000);
    store(&mut bench, Idn::REFERENCE_OFFSET_1, 180_000);
    store(&mut bench, Idn::HOMING_VELOCITY, 600_000);
    store(&mut bench, Idn::HOMING_ACCELERATION, 31_416);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    for round in 0..2 {
        assert_eq!(bench.order(TURNTABLE, Order::Home), Ok(()), "round {round}");
        let here = bench.place(TURNTABLE);
        assert!((995 * NANO / 100..11 * NANO).contains(&here), "round {round}: {here}");
        bench.run_for(200);
        assert!((bench.place(TURNTABLE) - here).abs() < NANO / 200, "round {round}: it stays");
        // The switch keeps its place in what the drive counts.
        assert_eq!(bench.order(TURNTABLE, Order::Move(to(0, 5 * NANO, Some(Generator::Gateway)))), Ok(()));
        assert!(bench.place(TURNTABLE).abs() < NANO / 1_000, "round {round}");
    }
    assert_eq!(bench.rig.engine.axes()[0].faults().count(), 0);
}

#[test]
fn a_stop_ends_a_way_that_the_drive_makes() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let id = bench.give(1, TURNTABLE, Order::Move(to(100 * NANO, 2 * NANO, Some(Generator::Drive))));
    bench.run_for(1_000);
    assert!(bench.speed(TURNTABLE) > 19 * NANO / 10);
    let stop = bench.give(1, TURNTABLE, Order::Stop);
    let answer = bench.answer(10);
    assert_eq!((answer.id, answer.result), (id, Err(Failure::Replaced("stop"))));
    // Until the drive has halted, nothing else moves the axis.
    let early = bench.give(1, TURNTABLE, jog(NANO));
    let answer = bench.answer(10);
    assert_eq!((answer.id, answer.result), (early, Err(Failure::Stopping)));
    for order in [Order::Enable, Order::Reset] {
        let early = bench.give(1, TURNTABLE, order);
        let answer = bench.answer(10);
        assert_eq!((answer.id, answer.result), (early, Err(Failure::Stopping)), "{order:?}");
    }
    let answer = bench.answer(5_000);
    assert_eq!((answer.id, answer.result), (stop, Ok(None)));
    let here = bench.place(TURNTABLE);
    bench.run_for(300);
    assert!((bench.place(TURNTABLE) - here).abs() < NANO / 100, "it stays where it stopped");
    assert_eq!(bench.state(TURNTABLE), DriveState::Operating);
    assert_eq!(bench.order(TURNTABLE, Order::Move(to(0, 5 * NANO, None))), Ok(()), "and goes on");
}

/// The controller that was lost would have caught the axis at its speed. Nobody leads on what a person enables.
#[test]
fn an_enable_holds_an_axis_that_still_turns() {
    let coast = "on_command_loss = \"disable-and-coast\"\ninstance = ";
    let configuration = configuration(ALL).replace("instance = ", coast);
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    let servo = rig.drive_mut(0).servo_mut();
    let parameters = *servo.parameters();
    let free = ServoParameters { coulomb_friction: Torque(0), viscous_friction: Torque(0), ..parameters };
    servo.set_parameters(free).expect("such a servo exists");
    let catches = AttributeSet::usint(FLYING_START_ENABLE, 1);
    let turn = Step::RunAt { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0 };
    let program = vec![
        Step::SetAttributes { axis: 1, attributes: vec![catches] },
        Step::Enable(AxisSet::one(1)),
        turn,
        Step::Dwell { seconds: 500.0 },
    ];
    connect(&mut rig, program);
    rig.run_until(DurationNs::from_secs(10), "the speed", |rig| rig.velocity(0) > 199 * NANO / 100);
    rig.kill_controller();
    rig.run_until(DurationNs::from_secs(5), "the loss", |rig| rig.status().connections == 0);
    rig.run_for(DurationNs::from_millis(100));
    assert!(rig.torque_free());
    let (local, end) = LocalNorth::new(rig.engine.axes().len());
    rig.engine.set_local(local);
    let mut bench = Bench { rig, end, ids: 0 };
    assert_eq!(bench.order(TURNTABLE, Order::Reset), Ok(()));
    assert!(bench.speed(TURNTABLE) > 19 * NANO / 10, "it turns still: {}", bench.speed(TURNTABLE));
    assert_eq!(bench.order(TURNTABLE, Order::Enable), Ok(()));
    bench.run_for(2_000);
    assert!(bench.speed(TURNTABLE).abs() < NANO / 100, "{}", bench.speed(TURNTABLE));
    assert_eq!(bench.state(TURNTABLE), DriveState::Operating);
}

#[test]
fn a_controller_gets_an_axis_on_the_move_without_a_jump() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let id = bench.give(1, TURNTABLE, Order::Move(to(50 * NANO, 2 * NANO, Some(Generator::Gateway))));
    bench.run_for(800);
    assert!(bench.speed(TURNTABLE) > 19 * NANO / 10);
    let axis = AxisSet::one(1);
    bench.rig.connect(vec![Step::Enable(axis), Step::Dwell { seconds: 0.2 }, Step::Disable(axis)]);
    let answer = bench.answer(2_000);
    assert_eq!((answer.id, answer.result), (id, Err(Failure::Taken)));
    assert_eq!(bench.owner(TURNTABLE), Owner::Controller);
    assert_eq!(bench.order(TURNTABLE, Order::Enable), Err(Failure::Controller));
    let mut last = bench.place(TURNTABLE);
    let mut steps = Vec::new();
    for _ in 0..3_000 {
        bench.run_for(1);
        let here = bench.place(TURNTABLE);
        steps.push(here - last);
        last = here;
    }
    // 2 turns per second are 4 million nanoturns in a cycle of 2 ms; it only gets slower.
    assert!(
        steps.iter().all(|step| (-30_000..4_100_000).contains(step)),
        "{:?}",
        (steps.iter().min(), steps.iter().max())
    );
    let report = bench.rig.report();
    assert_eq!((report.failure.as_ref(), report.steps_finished), (None, 3), "{report}");
}

#[test]
fn what_cannot_be_is_refused_and_moves_nothing() {
    let mut bench = Bench::new("\"position\"");
    for order in [jog(NANO), Order::Move(to(NANO, NANO, None)), Order::Home] {
        assert!(matches!(bench.order(TURNTABLE, order), Err(Failure::NotEnabled(_))), "{order:?}");
    }
    assert_eq!(bench.order(9, Order::Enable), Err(Failure::NoAxis));
    bench.order(SLIDE, Order::Enable).unwrap();
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let by_drive = |mode| Err(Failure::Mode(ModeSelection::by_drive(mode)));
    for (axis, order, expected) in [
        (TURNTABLE, Order::Home, by_drive(OperatingMode::Homing)),
        (TURNTABLE, Order::Move(to(NANO, NANO, Some(Generator::Drive))), by_drive(OperatingMode::Position)),
        (TURNTABLE, jog(21 * NANO), Err(Failure::TooFast(Velocity(20 * NANO)))),
        (TURNTABLE, Order::Move(to(NANO, 0, None)), Err(Failure::NotPositive)),
        (
            TURNTABLE,
            Order::Jog(Jog {
                velocity: Velocity(NANO),
                acceleration: Some(Acceleration(201 * NANO)),
                time: JOG_TIME,
            }),
            Err(Failure::TooSteep(Acceleration(200 * NANO))),
        ),
        (SLIDE, Order::Move(to(1_001 * NANO, NANO, None)), Err(Failure::Beyond(Position(1_000 * NANO)))),
        (SLIDE, Order::Move(to(-6 * NANO, NANO, None)), Err(Failure::Beyond(Position(-5 * NANO)))),
        (
            SLIDE,
            Order::Jog(Jog { velocity: Velocity(NANO), acceleration: None, time: JOG_TIME }),
            Err(Failure::NoAcceleration),
        ),
    ] {
        assert_eq!(bench.order(axis, order), expected, "{order:?}");
    }
    // A refused order does not end the one in progress.
    let id = bench.give(1, TURNTABLE, Order::Move(to(NANO / 1_000, NANO, None)));
    let refused = bench.give(1, TURNTABLE, jog(21 * NANO));
    let answers = [bench.answer(10), bench.answer(2_000)];
    assert_eq!(answers.map(|answer| answer.id), [refused, id]);
    assert_eq!(answers.map(|answer| answer.result.is_ok()), [false, true]);
    // Another client cannot have it.
    let id = bench.give(2, TURNTABLE, jog(NANO));
    let answer = bench.answer(10);
    assert_eq!((answer.client, answer.id, answer.result), (2, id, Err(Failure::Held)));
    bench.run_for(100);
    assert!(bench.place(TURNTABLE).abs() < NANO / 500 && bench.place(SLIDE).abs() < NANO / 100);
}

#[test]
fn a_jog_ends_at_the_end_of_the_axis() {
    let mut bench = Bench::new(ALL);
    bench.order(SLIDE, Order::Enable).unwrap();
    for _ in 0..10 {
        let jog = Jog {
            velocity: Velocity(-5 * NANO),
            acceleration: Some(Acceleration(50 * NANO)),
            time: JOG_TIME,
        };
        assert_eq!(bench.order(SLIDE, Order::Jog(jog)), Ok(()));
        bench.run_for(300);
    }
    let place = bench.place(SLIDE);
    assert!((place + 5 * NANO).abs() < NANO / 20, "{place}");
    let faults: Vec<_> = bench.rig.engine.axes()[1].faults().map(|active| active.fault.cause).collect();
    assert_eq!((bench.state(SLIDE), faults), (DriveState::Operating, vec![]));
}

#[test]
fn a_client_that_is_gone_leaves_an_axis_at_rest_without_torque() {
    for deserted in [false, true] {
        let mut bench = Bench::new(ALL);
        bench.order(TURNTABLE, Order::Enable).unwrap();
        bench.give(1, TURNTABLE, Order::Move(to(100 * NANO, 2 * NANO, None)));
        bench.run_for(1_000);
        assert!(bench.speed(TURNTABLE) > 19 * NANO / 10);
        if deserted {
            // The whole server has gone.
            bench.end = LocalNorth::new(0).1;
        } else {
            bench.end.requests.push(Request::Gone { client: 1 }).unwrap();
        }
        bench.run_for(3_000);
        assert!(bench.rig.torque_free(), "deserted: {deserted}");
        assert!(bench.speed(TURNTABLE).abs() < NANO / 100);
        assert_eq!(bench.owner(TURNTABLE), Owner::Nobody);
        if !deserted {
            let id = bench.give(2, TURNTABLE, Order::Enable);
            let answer = bench.answer(5_000);
            assert_eq!(
                (answer.client, answer.id, answer.result),
                (2, id, Ok(None)),
                "somebody else can have it"
            );
        }
    }
}

#[test]
fn a_fault_is_told_and_reset() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let id = bench.give(1, TURNTABLE, Order::Move(to(100 * NANO, 2 * NANO, None)));
    bench.run_for(500);
    bench.rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    let answer = bench.answer(2_000);
    assert_eq!(answer.id, id);
    let Err(Failure::Fault(cause)) = answer.result else { panic!("{answer:?}") };
    assert_eq!(cause, FaultCause::OVER_CURRENT);
    bench.run_for(2_000);
    assert!(bench.rig.torque_free());
    assert!(matches!(bench.order(TURNTABLE, Order::Enable), Err(Failure::Fault(_))));
    bench.rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT);
    assert_eq!(bench.order(TURNTABLE, Order::Reset), Ok(()));
    assert_eq!(bench.order(TURNTABLE, Order::Enable), Ok(()));
    assert_eq!(bench.order(TURNTABLE, Order::Move(to(0, 5 * NANO, None))), Ok(()));
}

/// A reset of a drive that is not heard ends in vain at once, not when its time is over.
#[test]
fn a_reset_of_a_drive_that_is_not_heard_is_answered_at_once() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    bench.rig.line.set_mute(0, true);
    bench.rig.run_until(DurationNs::from_secs(10), "the end of the stop", |rig| {
        rig.engine.axes()[0].state() == DriveState::Faulted
    });
    let before = bench.end.answers.pop();
    assert!(before.is_err(), "no order is in progress: {before:?}");
    let id = bench.give(1, TURNTABLE, Order::Reset);
    let answer = bench.answer(20);
    let Err(Failure::Fault(cause)) = answer.result else { panic!("{answer:?}") };
    assert_eq!((answer.id, cause), (id, FaultCause::SOUTH_SILENCE));
    assert_eq!(bench.state(TURNTABLE), DriveState::Faulted);
    bench.rig.line.set_mute(0, false);
    bench.rig.run_until(DurationNs::from_secs(10), "the drive", |rig| {
        rig.engine.axes()[0].feedback().report != Report::Silent
    });
    assert_eq!(bench.order(TURNTABLE, Order::Reset), Ok(()));
    assert_eq!(bench.order(TURNTABLE, Order::Enable), Ok(()));
}

#[test]
fn the_end_of_the_box_ends_local_control() {
    let mut bench = Bench::new(ALL);
    bench.order(TURNTABLE, Order::Enable).unwrap();
    let id = bench.give(1, TURNTABLE, Order::Move(to(100 * NANO, 2 * NANO, None)));
    bench.run_for(500);
    let now = bench.rig.clock().get();
    bench.rig.engine.stop(now);
    let answer = bench.answer(20);
    assert_eq!((answer.id, answer.result), (id, Err(Failure::Ending)));
    bench.run_for(2_000);
    assert!(bench.rig.torque_free() && bench.rig.engine.is_stopped());
    assert_eq!(bench.rig.engine.unrested(), []);
}

#[test]
fn a_canopen_drive_positions_and_homes_by_itself() {
    let modes = "node = 1\nmodes = [\"position\", \"positioning\", \"homing\"]";
    let configuration = include_str!("can.toml").replacen("node = 1", modes, 1);
    let rig = Rig::ready(Settings::without_line(configuration));
    let mut bench = Bench::on(rig);
    let actual = |bench: &Bench| {
        *bench.rig.can[0].bus.nodes().next().expect("a device").application().axes()[0].actual()
    };
    assert_eq!(bench.order(TURNTABLE, Order::Enable), Ok(()));
    assert_eq!(bench.order(TURNTABLE, Order::Move(to(3 * NANO, 2 * NANO, Some(Generator::Drive)))), Ok(()));
    let place = actual(&bench).position.get();
    assert!((place - 3 * NANO).abs() < NANO / 1_000, "{place}");
    // No method at all: the drive refuses.
    let method = |bench: &mut Bench, method| {
        let node = bench.rig.can[0].bus.nodes_mut().next().expect("a device");
        node.dictionary_mut().set(0x6098, 0, method);
    };
    method(&mut bench, 0);
    assert_eq!(bench.order(TURNTABLE, Order::Home), Err(Failure::HomingFailed));
    // Method 37: the position where the axis stands becomes the home offset. What is answered is of this homing.
    method(&mut bench, 37);
    assert_eq!(bench.order(TURNTABLE, Order::Home), Ok(()));
    let feedback = *bench.rig.engine.axes()[0].feedback();
    assert!(feedback.position.get().abs() < NANO / 1_000, "{feedback:?}");
    let before = actual(&bench).position.get();
    assert_eq!(bench.order(TURNTABLE, Order::Move(to(-NANO, 2 * NANO, Some(Generator::Gateway)))), Ok(()));
    let way = actual(&bench).position.get() - before;
    assert!((way + NANO).abs() < NANO / 500, "{way}");
    assert_eq!(bench.rig.engine.axes()[0].faults().count(), 0);
}

/// The acceleration of the jog is the only one that is known: it also brakes.
#[test]
fn a_jog_at_velocity_zero_brakes_with_the_acceleration_of_the_jog_before_it() {
    let mut bench = Bench::new(ALL);
    bench.order(SLIDE, Order::Enable).unwrap();
    let moving =
        Jog { velocity: Velocity(10 * NANO), acceleration: Some(Acceleration(50 * NANO)), time: JOG_TIME };
    let brake = Jog { velocity: Velocity::ZERO, acceleration: None, time: JOG_TIME };
    assert_eq!(bench.order(SLIDE, Order::Jog(brake)), Ok(()), "it rests already");
    assert_eq!(bench.order(SLIDE, Order::Jog(moving)), Ok(()));
    bench.run_for(300);
    assert!(bench.speed(SLIDE) > 9 * NANO, "{}", bench.speed(SLIDE));
    assert_eq!(bench.order(SLIDE, Order::Jog(brake)), Ok(()));
    bench.run_for(100);
    let amid = bench.speed(SLIDE);
    assert!((3 * NANO..8 * NANO).contains(&amid), "on a ramp: {amid}");
    bench.run_for(200);
    let place = bench.place(SLIDE);
    // Also when the jog would have ended by itself.
    bench.run_for(300);
    assert!((bench.place(SLIDE) - place).abs() < NANO / 100, "{} after {place}", bench.place(SLIDE));
    assert_eq!(bench.state(SLIDE), DriveState::Operating);
}

/// The end is behind the axis: a jog away from it must not bring the axis back there.
#[test]
fn a_jog_away_from_the_end_beyond_it_is_refused() {
    let configuration = configuration(ALL).replacen("position_max = 1_000.0", "position_max = -1.0", 1);
    let mut bench = Bench::on(Rig::ready(Settings { configuration, ..Settings::default() }));
    bench.order(SLIDE, Order::Enable).unwrap();
    let jog = |velocity| {
        Order::Jog(Jog {
            velocity: Velocity(velocity),
            acceleration: Some(Acceleration(50 * NANO)),
            time: JOG_TIME,
        })
    };
    assert_eq!(bench.order(SLIDE, jog(NANO)), Err(Failure::Beyond(Position(-NANO))));
    bench.run_for(500);
    assert!(bench.place(SLIDE).abs() < NANO / 100, "{}", bench.place(SLIDE));
    assert_eq!(bench.order(SLIDE, jog(-2 * NANO)), Ok(()));
    bench.run_for(400);
    assert!(bench.place(SLIDE) < -NANO / 2, "{}", bench.place(SLIDE));
    // Speed zero brakes, wherever the axis is.
    assert_eq!(bench.order(SLIDE, jog(0)), Ok(()));
    bench.run_for(100);
    let place = bench.place(SLIDE);
    bench.run_for(50);
    assert!((bench.place(SLIDE) - place).abs() < NANO / 100, "{} after {place}", bench.place(SLIDE));
}
