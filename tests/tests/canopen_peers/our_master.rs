//! Our master and a drive on PyPI's canopen, which shares no code with it, over a CAN socket.

use profile_cia402::drive::controlword::Command as Word;
use profile_cia402::drive::homing::Progress;
use profile_cia402::drive::states::transition;
use profile_cia402::drive::{Controlword, ErrorCode, Mode, State, Statusword, index};
use profile_cia402::master::boot::BootState;
use profile_cia402::master::event::{Event, Refusal};
use profile_cia402::sdo::request::{SdoFailure, SdoRequest};
use profile_cia402::wire::{AbortCode, Mux};

use super::bench::{Bench, PERIOD, PROFILE_ACCELERATION, PROFILE_VELOCITY, Shown, node};
use super::*;

/// User units that a velocity makes in this many periods.
fn way(velocity: i32, periods: i32) -> i32 {
    i32::try_from(i64::from(velocity) * i64::from(periods) * PERIOD.0 / 1_000_000_000).unwrap()
}

#[test]
fn a_drive_boots_and_goes_through_its_states() {
    let Some(python) = python_inside("our_master::a_drive_boots_and_goes_through_its_states") else { return };
    let mut bench = Bench::new(&python);
    let marks: Vec<_> = bench.log.iter().filter(|event| !matches!(event, Event::Sdo { .. })).collect();
    let own = node();
    let expected = [
        Event::AwaitingApplication { node: own, kept: false },
        Event::Operational { node: own },
        Event::NetworkOperational,
    ];
    assert_eq!(marks, expected.iter().collect::<Vec<_>>());
    let report: Vec<String> =
        bench.master.node(own).unwrap().report.iter().map(ToString::to_string).collect();
    assert_eq!(bench.read(index::SUPPORTED_MODES, 0), 0x3A5);
    let absent = bench.sdo(SdoRequest::upload(Mux::new(0x5FFF, 0)));
    assert_eq!(absent.result, Err(SdoFailure::Refused(AbortCode::NO_OBJECT)));
    let refused = bench.sdo(SdoRequest::download_number(Mux::new(index::MODE, 0), 7, 1));
    assert_eq!(refused.result, Err(SdoFailure::Refused(AbortCode::VALUE)));

    // Every command from every state that a command leads to; what we hold to be right, the drive shows.
    let commands = [
        Word::EnableOperation,
        Word::Shutdown,
        Word::QuickStop,
        Word::Shutdown,
        Word::DisableVoltage, // 2 7 2 7
        Word::Shutdown,
        Word::SwitchOn,
        Word::Shutdown,
        Word::SwitchOn,
        Word::QuickStop, // 2 3 6 3 10
        Word::Shutdown,
        Word::SwitchOn,
        Word::DisableVoltage, // 2 3 10
        Word::Shutdown,
        Word::SwitchOn,
        Word::EnableOperation,
        Word::SwitchOn,
        Word::EnableOperation, // 2 3 4 5 4
        Word::Shutdown,
        Word::SwitchOn,
        Word::EnableOperation,
        Word::DisableVoltage, // 8 3 4 9
        Word::Shutdown,
        Word::EnableOperation,
        Word::QuickStop, // 2 3 4 11, and 12 at the stand
    ];
    let mut walk = vec![];
    let mut state = bench.last.unwrap().state();
    assert_eq!(state, State::SwitchOnDisabled);
    bench.set.position = bench.last.unwrap().position;
    let mut before = Controlword::empty();
    for command in commands {
        // Enable operation leads through switched on; a quick stop ends in switch on disabled.
        while let Some(step) = transition(state, command.word(), before, false) {
            walk.push(step.number());
            state = step.to();
        }
        if state == State::QuickStopActive {
            walk.push(12);
            state = State::SwitchOnDisabled;
        }
        before = command.word();
        bench.set.word = command.word();
        let shown = bench.shows(state.name(), |shown| shown.state() == state);
        assert_eq!(bench.next().state(), state, "it stays there: {shown:?}");
    }
    assert_eq!(walk, [2, 7, 2, 7, 2, 3, 6, 3, 10, 2, 3, 10, 2, 3, 4, 5, 4, 8, 3, 4, 9, 2, 3, 4, 11, 12]);

    // A quick stop that holds the axis, and 16 out of it.
    bench.write(index::QUICK_STOP_OPTION, 0, 6, 2);
    bench.enable(Mode::CYCLIC_POSITION);
    bench.command(Word::QuickStop, State::QuickStopActive);
    for _ in 0..5 {
        assert_eq!(bench.next().state(), State::QuickStopActive);
    }
    bench.command(Word::EnableOperation, State::OperationEnabled);
    bench.command(Word::DisableVoltage, State::SwitchOnDisabled);
    for reason in Refusal::ALL {
        assert_eq!(bench.master.statistics().refused(reason), 0, "{reason}");
    }
    // Identity, configuration, PDOs both ways and heartbeats: each step written, and read back where that counts. Only here, since
    // the drive misses a master that looks for a snapshot.
    insta::assert_snapshot!(report.join("\n"));
}

#[test]
fn a_drive_follows_in_the_cyclic_modes() {
    let Some(python) = python_inside("our_master::a_drive_follows_in_the_cyclic_modes") else { return };
    let mut bench = Bench::new(&python);
    // csp: a ramp, never overtaken, and its end.
    let start = bench.enable(Mode::CYCLIC_POSITION).position;
    let mut passed = vec![];
    for _ in 0..60 {
        bench.set.position += 500;
        bench.period();
        passed.extend(bench.shown.map(|shown| shown.position));
    }
    let target = bench.set.position;
    assert_eq!(target, start + 30_000);
    let shown = bench.shows("target", |shown| shown.position.abs_diff(target) <= 1);
    assert!(shown.word.contains(Statusword::FOLLOWS_COMMAND), "{shown:?}");
    assert!(passed.is_sorted() && passed.len() > 30, "{passed:?}");
    let halfway = passed.iter().filter(|&&at| at > start + 5_000 && at < target - 5_000).count();
    assert!(halfway > 20, "it did not jump: {passed:?}");

    // csv: the velocity, and the way that it makes in so many periods.
    bench.shows("stand", |shown| shown.velocity == 0);
    bench.set.velocity = -40_000;
    bench.set.mode = Mode::CYCLIC_VELOCITY;
    let is_there = |shown: &Shown| shown.mode == Mode::CYCLIC_VELOCITY && shown.velocity == -40_000;
    let from = bench.shows("velocity", is_there);
    assert!(from.word.contains(Statusword::FOLLOWS_COMMAND), "{from:?}");
    for _ in 0..40 {
        bench.period();
    }
    let to = bench.shows("velocity", is_there);
    let (moved, expected) = (to.position - from.position, way(-40_000, to.syncs - from.syncs));
    assert!(expected <= -32_000 && moved.abs_diff(expected) <= 2 * 800, "{moved} of {expected}");
    bench.set.velocity = 0;
    bench.shows("stand", |shown| shown.velocity == 0);

    // cst: the torque, and the velocity that it makes: 1000 units a second and second for each thousandth.
    bench.set.mode = Mode::CYCLIC_TORQUE;
    bench.set.torque = 20;
    let is_there = |shown: &Shown| shown.mode == Mode::CYCLIC_TORQUE && shown.torque == 20;
    let from = bench.shows("torque", is_there);
    for _ in 0..20 {
        bench.period();
    }
    let to = bench.shows("torque", is_there);
    let (gained, expected) = (to.velocity - from.velocity, way(20_000, to.syncs - from.syncs));
    assert!(expected >= 8_000 && gained.abs_diff(expected) <= 2 * 400, "{gained} of {expected}");
    bench.set.torque = -20;
    bench.shows("stand", |shown| shown.torque == -20 && shown.velocity <= 0);
    bench.command(Word::DisableVoltage, State::SwitchOnDisabled);
    let shown = bench.next();
    assert_eq!((shown.velocity, shown.torque), (0, 0));

    // The drive does nothing for a while and then answers what has queued up, several in a period: late, and no second drive.
    let from = bench.enable(Mode::CYCLIC_POSITION).position;
    bench.log.clear();
    let missed = bench.master.statistics().pdos_missed;
    bench.drive.running.signal("STOP");
    for _ in 0..15 {
        bench.period();
    }
    bench.drive.running.signal("CONT");
    assert_eq!(bench.shown, None);
    assert!(bench.master.statistics().pdos_missed >= missed + 2 * 10);
    bench.set.position = from + 2_000;
    bench.shows("target", |shown| shown.position.abs_diff(from + 2_000) <= 1);
    assert_eq!(bench.log, []);
}

/// A set-point of pp: handed over by the rising edge of bit 4, acknowledged by bit 12.
fn set_point(bench: &mut Bench, position: i32, bits: Controlword) -> Shown {
    bench.set.position = position;
    bench.set.word = Word::EnableOperation.word() | Controlword::NEW_SET_POINT | bits;
    let taken = bench.shows("acknowledge", |shown| shown.word.contains(Statusword::SET_POINT_ACKNOWLEDGE));
    bench.set.word = Word::EnableOperation.word() | bits;
    bench.shows("acknowledge gone", |shown| !shown.word.contains(Statusword::SET_POINT_ACKNOWLEDGE));
    taken
}

#[test]
fn a_drive_goes_to_targets_by_itself_and_homes() {
    let Some(python) = python_inside("our_master::a_drive_goes_to_targets_by_itself_and_homes") else {
        return;
    };
    let mut bench = Bench::new(&python);
    let reached = |shown: &Shown| shown.word.contains(Statusword::TARGET_REACHED);
    // What was written while it booted.
    assert_eq!(bench.read(index::PROFILE_VELOCITY, 0), u64::from(PROFILE_VELOCITY));
    assert_eq!(bench.read(index::PROFILE_ACCELERATION, 0), u64::from(PROFILE_ACCELERATION));

    // pp: there, back by a distance, and halted on the way.
    let start = bench.enable(Mode::PROFILE_POSITION).position;
    let taken = set_point(&mut bench, start + 30_000, Controlword::empty());
    assert!(!reached(&taken), "{taken:?}");
    let shown = bench.shows("target", reached);
    assert_eq!((shown.position, shown.velocity), (start + 30_000, 0));
    let taken = set_point(&mut bench, -20_000, Controlword::RELATIVE);
    assert!(!reached(&taken), "{taken:?}");
    let shown = bench.shows("target", reached);
    assert_eq!((shown.position, shown.velocity), (start + 10_000, 0));
    set_point(&mut bench, start + 200_000, Controlword::empty());
    bench.shows("way", |shown| shown.velocity > 10_000);
    bench.set.word |= Controlword::HALT;
    let halted = bench.shows("stand", |shown| shown.velocity == 0);
    assert!(halted.position < start + 190_000, "{halted:?}");
    for _ in 0..5 {
        let shown = bench.next();
        assert_eq!((shown.position, reached(&shown)), (halted.position, false));
    }
    bench.set.word -= Controlword::HALT;
    let shown = bench.shows("target", reached);
    assert_eq!((shown.position, shown.velocity), (start + 200_000, 0));
    bench.command(Word::DisableVoltage, State::SwitchOnDisabled);

    // pv: a velocity that the drive comes to by its ramp, and halt.
    bench.enable(Mode::PROFILE_VELOCITY);
    bench.set.velocity = -60_000;
    let between = bench.shows("way", |shown| shown.velocity < 0);
    let fast = bench.shows("velocity", |shown| shown.velocity == -60_000 && reached(shown));
    assert!(fast.position < between.position, "{fast:?} after {between:?}");
    bench.set.word |= Controlword::HALT;
    bench.shows("stand", |shown| shown.velocity == 0 && reached(shown));
    bench.set.velocity = 0;
    bench.command(Word::DisableVoltage, State::SwitchOnDisabled);

    // hm: at the current position, which is then called by the home offset.
    let refused = bench.sdo(SdoRequest::download_number(Mux::new(index::HOMING_METHOD, 0), 1, 1));
    assert_eq!(refused.result, Err(SdoFailure::Refused(AbortCode::VALUE)));
    bench.write(index::HOMING_METHOD, 0, 37, 1);
    bench.write(index::HOME_OFFSET, 0, 12_345, 4);
    bench.enable(Mode::HOMING);
    bench.set.word |= Controlword::START_HOMING;
    let shown = bench.shows("homing", |shown| Progress::decode(shown.word) == Some(Progress::Done));
    assert_eq!((shown.state(), shown.position), (State::OperationEnabled, 12_345));
    bench.command(Word::DisableVoltage, State::SwitchOnDisabled);
    // Back in csp it stays where it is.
    let shown = bench.enable(Mode::CYCLIC_POSITION);
    assert_eq!(shown.position, 12_345);
    assert_eq!(bench.next().position, 12_345);
    assert_eq!(bench.emergencies(), []);
}

#[test]
fn a_fault_is_raised_seen_and_cleared() {
    let Some(python) = python_inside("our_master::a_fault_is_raised_seen_and_cleared") else { return };
    let mut bench = Bench::new(&python);
    bench.enable(Mode::CYCLIC_POSITION);
    // Raised by hand, while it moves.
    for _ in 0..10 {
        bench.set.position += 1_000;
        bench.period();
    }
    bench.write(0x2FFF, 1, 0x7305, 2);
    let fault = bench.shows("fault", |shown| shown.state() == State::Fault);
    bench.until("EMCY", |bench| !bench.emergencies().is_empty());
    assert_eq!(bench.emergencies(), [(0x7305, 0x81)]);
    assert_eq!(bench.read(index::ERROR_CODE, 0), u64::from(ErrorCode::INCREMENTAL_SENSOR_1_FAULT.0));
    assert_eq!(bench.read(0x1001, 0), 0x81);
    // The word that still enables operation leads nowhere, and no target moves it.
    bench.set.position += 5_000;
    for _ in 0..5 {
        let shown = bench.next();
        assert_eq!((shown.state(), shown.position, shown.velocity), (State::Fault, fault.position, 0));
    }
    clear(&mut bench);
    assert_eq!(bench.emergencies(), [(0x7305, 0x81), (0, 0)]);
    assert_eq!(bench.read(index::ERROR_CODE, 0), 0);
    let again = bench.enable(Mode::CYCLIC_POSITION);
    assert_eq!(again.position, fault.position, "enabling moves nothing");

    // Raised by the drive: a target too far away.
    bench.write(index::FOLLOWING_WINDOW, 0, 2_000, 4);
    bench.log.clear();
    bench.set.position += 100_000;
    bench.shows("fault", |shown| shown.state() == State::Fault);
    bench.until("EMCY", |bench| !bench.emergencies().is_empty());
    assert_eq!(bench.emergencies(), [(ErrorCode::FOLLOWING_ERROR.0, 0x21)]);
    clear(&mut bench);
    let position = bench.enable(Mode::CYCLIC_POSITION).position;
    bench.set.position = position + 1_000;
    bench.shows("target", |shown| shown.position.abs_diff(position + 1_000) <= 1);
    assert_eq!(bench.master.node(node()).unwrap().state, BootState::Operational);
}

/// Resets a fault by the edge of bit 7, which counts once.
fn clear(bench: &mut Bench) {
    bench.set.word = Word::DisableVoltage.word();
    bench.next();
    bench.set.word = Controlword::FAULT_RESET;
    bench.shows("reset", |shown| shown.state() == State::SwitchOnDisabled);
    bench.until("EMCY", |bench| bench.emergencies().last() == Some(&(0, 0)));
    bench.set.word = Word::DisableVoltage.word();
    bench.next();
}

/// What the master told, without transfers and EMCYs.
fn marks(bench: &Bench) -> Vec<Event> {
    let told = bench.log.iter();
    told.filter(|event| !matches!(event, Event::Sdo { .. } | Event::Emcy { .. })).cloned().collect()
}

/// The heartbeat has come back and the drive is brought up again: it stands until it is enabled anew, though the words of before
/// still come.
fn comes_back(bench: &mut Bench) {
    let own = node();
    bench.until("operation", |bench| bench.log.contains(&Event::NetworkOperational));
    assert_eq!(
        marks(bench),
        [
            Event::HeartbeatLost { node: own },
            Event::AwaitingApplication { node: own, kept: false },
            Event::Operational { node: own },
            Event::NetworkOperational,
        ]
    );
    assert_eq!(bench.set.word, Word::EnableOperation.word());
    for _ in 0..5 {
        let shown = bench.next();
        assert_eq!((shown.state(), shown.velocity), (State::SwitchOnDisabled, 0));
    }
    bench.log.clear();
    let from = bench.enable(Mode::CYCLIC_POSITION).position;
    bench.set.position = from + 3_000;
    bench.shows("target", |shown| shown.position.abs_diff(from + 3_000) <= 1);
}

#[test]
fn heartbeats_are_lost_and_regained_both_ways() {
    let Some(python) = python_inside("our_master::heartbeats_are_lost_and_regained_both_ways") else {
        return;
    };
    let mut bench = Bench::new(&python);
    bench.enable(Mode::CYCLIC_POSITION);
    // The drive falls silent, and speaks again when it is reset.
    bench.log.clear();
    bench.write(0x2FFF, 2, 1, 1);
    bench.until("loss", |bench| bench.log.contains(&Event::HeartbeatLost { node: node() }));
    assert!(bench.drive.has_said("heartbeat off"), "{}", bench.drive.said());
    // Stopped, and nothing of it counts.
    bench.period();
    assert!(!bench.master.consumer(node(), 1).unwrap().fresh);
    bench.until("stop", |bench| bench.drive.has_said("nmt 02"));
    comes_back(&mut bench);

    // The drive loses its supply.
    bench.drive.running.signal("KILL");
    bench.until("loss", |bench| bench.log.contains(&Event::HeartbeatLost { node: node() }));
    bench.drive = Bench::start_drive(&python);
    comes_back(&mut bench);

    // The master falls silent: the drive stops by itself.
    std::thread::sleep(Duration::from_millis(2_500));
    assert!(bench.drive.has_said("fault reaction active -> fault"), "{}", bench.drive.said());
    bench.shows("fault", |shown| shown.state() == State::Fault);
    bench.until("EMCY", |bench| !bench.emergencies().is_empty());
    assert_eq!(bench.emergencies()[0], (ErrorCode::HEARTBEAT.0, 0x11));
    assert_eq!(bench.read(index::ERROR_CODE, 0), 0x8130);
    clear(&mut bench);
    let from = bench.enable(Mode::CYCLIC_POSITION).position;
    bench.set.position = from + 1_000;
    bench.shows("target", |shown| shown.position.abs_diff(from + 1_000) <= 1);
    assert_eq!(bench.master.node(node()).unwrap().state, BootState::Operational);
}
