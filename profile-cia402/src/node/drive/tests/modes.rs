//! The modes of operation.

use profile_generic::quantity::{Position, Torque};
use profile_generic::servo::Marks;

use crate::drive::{Controlword, Mode, State, Statusword, index};
use crate::node::tests::Rig;
use crate::wire::nmt::NmtCommand;

const TURN: i64 = 65_536;

fn position(rig: &Rig) -> i64 {
    rig.node.dictionary().number(index::POSITION_ACTUAL, 0)
}

fn velocity(rig: &Rig) -> i64 {
    rig.node.dictionary().number(index::VELOCITY_ACTUAL, 0)
}

fn word(rig: &mut Rig, word: i64) {
    rig.set(index::CONTROLWORD, 0, word).expect("a controlword");
}

fn reached(rig: &mut Rig, milliseconds: i64) -> bool {
    rig.run_until(milliseconds, |rig| rig.status(0).contains(Statusword::TARGET_REACHED))
}

/// Enables csp by PDO and SYNC of 4 ms, and follows a sine of an eighth of a turn: the error stays small.
#[test]
fn csp_follows_a_moving_target() {
    let mut rig = Rig::new(1);
    rig.map_position();
    rig.set(index::INTERPOLATION_PERIOD, 1, 4).unwrap();
    rig.set(index::MODE, 0, Mode::CYCLIC_POSITION.0.into()).unwrap();
    rig.nmt(NmtCommand::START);
    let (mut word, mut target, mut worst, mut phase) = (6, 0, 0, 0.0_f64);
    // What was sent before the last SYNC.
    let mut history = 0;
    for _ in 0..1_000 {
        let (status, position) = rig.cycle(4, word, target).expect("a TPDO");
        word = match status & 0x6F {
            0x21 => 7,
            0x23 | 0x27 => 15,
            _ => 6,
        };
        if status & 0x6F == 0x27 {
            assert_eq!(status & 0x2000, 0, "no following error");
            worst = worst.max((position - history).abs());
            history = target;
            phase += 0.01;
            #[expect(clippy::cast_possible_truncation, reason = "a few thousand")]
            let next = (8_192.0 * phase.sin()) as i32;
            target = next;
        }
    }
    assert_eq!(rig.state(), State::OperationEnabled);
    assert!(rig.status(0).contains(Statusword::FOLLOWS_COMMAND));
    assert!(phase > 9.0 && worst < 100, "{worst}");
}

/// The target is far away when operation is enabled: 8611h instead of a leap.
#[test]
fn csp_faults_when_the_target_is_far_at_the_start() {
    let mut rig = Rig::new(1);
    rig.set(index::TARGET_POSITION, 0, 10 * TURN).unwrap();
    rig.set(index::MODE, 0, 8).unwrap();
    for word in [6, 7, 15] {
        rig.set(index::CONTROLWORD, 0, word).unwrap();
        rig.run(10);
    }
    assert!(rig.run_until(500, |rig| rig.state() == State::Fault), "{}", rig.state());
    assert_eq!(rig.read(index::ERROR_CODE, 0), Ok(0x8611));
    rig.run(500);
    assert!(position(&rig) < 4 * TURN, "{}", position(&rig));
}

#[test]
fn csp_stays_where_it_is_when_the_target_is_the_position() {
    let mut rig = Rig::new(1);
    rig.node.application_mut().axes_mut()[0].servo_mut().set_position(Position(7_000_000_000));
    rig.run(5);
    assert_eq!(position(&rig), 7 * TURN);
    rig.set(index::TARGET_POSITION, 0, 7 * TURN).unwrap();
    rig.enable(8);
    rig.run(500);
    assert_eq!(position(&rig), 7 * TURN);
    assert!(rig.status(0).contains(Statusword::FOLLOWS_COMMAND));
}

#[test]
fn csp_adds_the_offset_and_wraps_at_32_bits() {
    let mut rig = Rig::new(1);
    // 32767 turns and a half, less than half a turn from the end of the object.
    rig.node.application_mut().axes_mut()[0].servo_mut().set_position(Position(32_767_900_000_000));
    rig.run(5);
    let start = position(&rig);
    rig.set(index::TARGET_POSITION, 0, start).unwrap();
    rig.enable(8);
    rig.set(index::POSITION_OFFSET, 0, 2_000).unwrap();
    rig.run(300);
    assert!((position(&rig) - start - 2_000).abs() <= 2);
    rig.set(index::POSITION_OFFSET, 0, 0).unwrap();
    // Over the end in small steps: what follows the highest number is the lowest one.
    let mut target = start;
    for _ in 0..40 {
        target = i64::from(i32::try_from(target).unwrap().wrapping_add(500));
        rig.set(index::TARGET_POSITION, 0, target).unwrap();
        rig.run(10);
    }
    rig.run(300);
    assert!(target < 0 && (position(&rig) - target).abs() <= 2, "{target} {}", position(&rig));
    assert_eq!(rig.state(), State::OperationEnabled);
}

#[test]
fn travel_limits_clip_the_target() {
    let mut rig = Rig::new(1);
    rig.set(index::SOFTWARE_LIMIT, 1, -TURN / 4).unwrap();
    rig.set(index::SOFTWARE_LIMIT, 2, TURN / 4).unwrap();
    rig.enable(8);
    rig.set(index::TARGET_POSITION, 0, TURN / 2).unwrap();
    rig.run(500);
    assert!((position(&rig) - TURN / 4).abs() <= 2, "{}", position(&rig));
    assert!(rig.status(0).contains(Statusword::INTERNAL_LIMIT));
    assert!(!rig.status(0).contains(Statusword::FOLLOWS_COMMAND));
    rig.set(index::TARGET_POSITION, 0, 0).unwrap();
    rig.run(500);
    assert!(!rig.status(0).contains(Statusword::INTERNAL_LIMIT));
}

#[test]
fn csv_turns_with_its_offset_and_stops_at_the_travel_limit() {
    let mut rig = Rig::new(1);
    rig.enable(9);
    rig.set(index::TARGET_VELOCITY, 0, TURN).unwrap();
    rig.set(index::VELOCITY_OFFSET, 0, TURN).unwrap();
    rig.run(500);
    assert!((velocity(&rig) - 2 * TURN).abs() < TURN / 100, "{}", velocity(&rig));
    rig.set(index::SOFTWARE_LIMIT, 1, -TURN).unwrap();
    rig.set(index::SOFTWARE_LIMIT, 2, 3 * TURN).unwrap();
    rig.run(2_000);
    assert!((3 * TURN..3 * TURN + TURN / 5).contains(&position(&rig)), "{}", position(&rig));
    assert!(velocity(&rig).abs() < TURN / 100);
}

#[test]
fn cst_pushes_with_what_it_is_told() {
    let mut rig = Rig::new(1);
    rig.enable(10);
    rig.set(index::TARGET_TORQUE, 0, 200).unwrap();
    rig.set(index::TORQUE_OFFSET, 0, 150).unwrap();
    rig.run(20);
    let torque = rig.node.dictionary().number(index::TORQUE_ACTUAL, 0);
    assert!((345..=355).contains(&torque), "{torque}");
    assert_eq!(rig.node.dictionary().number(index::TORQUE_DEMAND, 0), 350);
    assert!(velocity(&rig) > 0);
}

#[test]
fn tq_goes_along_its_slope() {
    let mut rig = Rig::new(1);
    rig.node.application_mut().axes_mut()[0].servo_mut().set_load(Torque(500_000));
    rig.set(index::TORQUE_SLOPE, 0, 1_000).unwrap();
    rig.enable(4);
    rig.run(500);
    rig.set(index::TARGET_TORQUE, 0, 500).unwrap();
    let before = rig.node.dictionary().number(index::TORQUE_DEMAND, 0);
    rig.run(100);
    let after = rig.node.dictionary().number(index::TORQUE_DEMAND, 0);
    assert!((99..=101).contains(&(after - before)), "{before} {after}");
    assert!(!rig.status(0).contains(Statusword::TARGET_REACHED));
    assert!(reached(&mut rig, 1_000));
}

#[test]
fn ip_follows_only_while_bit_4_is_set() {
    let mut rig = Rig::new(1);
    rig.set(index::INTERPOLATION_PERIOD, 1, 10).unwrap();
    rig.enable(7);
    rig.set(index::INTERPOLATION_DATA, 1, 1_000).unwrap();
    rig.run(100);
    assert_eq!(position(&rig), 0);
    assert!(!rig.status(0).contains(Statusword::INTERPOLATION_ACTIVE));
    word(&mut rig, 0x1F);
    rig.run(300);
    assert!((position(&rig) - 1_000).abs() <= 2, "{}", position(&rig));
    assert!(rig.status(0).contains(Statusword::INTERPOLATION_ACTIVE));
}

/// The handshake of bits 4 and 12 with every kind of set-point.
#[test]
fn pp_takes_set_points_by_handshake() {
    let mut rig = Rig::new(1);
    rig.enable(1);
    let acknowledged = |rig: &Rig| rig.status(0).contains(Statusword::SET_POINT_ACKNOWLEDGE);
    rig.set(index::PROFILE_VELOCITY, 0, 10 * TURN).unwrap();
    rig.set(index::TARGET_POSITION, 0, 3 * TURN).unwrap();
    rig.run(50);
    assert_eq!(position(&rig), 0, "not without bit 4");
    word(&mut rig, 0x1F);
    assert!(acknowledged(&rig));
    rig.run(5);
    assert!(!rig.status(0).contains(Statusword::TARGET_REACHED));
    word(&mut rig, 0x0F);
    assert!(!acknowledged(&rig));
    assert!(reached(&mut rig, 2_000));
    assert!((position(&rig) - 3 * TURN).abs() < 70, "{}", position(&rig));
    // Relative, and one more behind it.
    rig.set(index::TARGET_POSITION, 0, TURN).unwrap();
    word(&mut rig, 0x5F);
    word(&mut rig, 0x0F);
    word(&mut rig, 0x5F);
    word(&mut rig, 0x0F);
    assert!(acknowledged(&rig), "no room for a third one");
    rig.run(20);
    assert!(reached(&mut rig, 3_000));
    assert!((position(&rig) - 5 * TURN).abs() < 70, "{}", position(&rig));
    assert!(!acknowledged(&rig));
    // Changed on the way.
    rig.set(index::TARGET_POSITION, 0, 100 * TURN).unwrap();
    word(&mut rig, 0x1F);
    rig.run(300);
    word(&mut rig, 0x0F);
    rig.set(index::TARGET_POSITION, 0, 0).unwrap();
    word(&mut rig, 0x3F);
    rig.run(5);
    assert!(reached(&mut rig, 5_000));
    assert!(position(&rig).abs() < 70, "{}", position(&rig));
}

#[test]
fn pp_keeps_to_its_velocity_and_goes_on_after_a_halt() {
    let mut rig = Rig::new(1);
    rig.enable(1);
    rig.set(index::PROFILE_VELOCITY, 0, 5 * TURN).unwrap();
    rig.set(index::TARGET_POSITION, 0, 10 * TURN).unwrap();
    word(&mut rig, 0x1F);
    rig.run(500);
    assert!((velocity(&rig) - 5 * TURN).abs() < TURN / 50, "{}", velocity(&rig));
    word(&mut rig, 0x11F);
    assert!(reached(&mut rig, 500), "it stands");
    let stood = position(&rig);
    assert!(velocity(&rig).abs() < TURN / 10 && stood < 9 * TURN, "{stood}");
    rig.run(200);
    assert!((position(&rig) - stood).abs() < 20);
    word(&mut rig, 0x1F);
    rig.run(10);
    assert!(reached(&mut rig, 5_000));
    assert!((position(&rig) - 10 * TURN).abs() < 70, "{}", position(&rig));
}

#[test]
fn pv_ramps_to_its_target() {
    let mut rig = Rig::new(1);
    rig.set(index::PROFILE_ACCELERATION, 0, 20 * TURN).unwrap();
    rig.enable(3);
    rig.run(10);
    assert!(rig.status(0).contains(Statusword::SPEED_ZERO));
    rig.set(index::TARGET_VELOCITY, 0, -10 * TURN).unwrap();
    rig.run(250);
    assert!((velocity(&rig) + 5 * TURN).abs() < TURN / 2, "{}", velocity(&rig));
    assert!(!rig.status(0).contains(Statusword::SPEED_ZERO));
    assert!(reached(&mut rig, 500));
    assert!((velocity(&rig) + 10 * TURN).abs() < TURN / 5, "{}", velocity(&rig));
}

#[test]
fn vl_steers_its_ramp_by_three_bits() {
    let mut rig = Rig::new(1);
    rig.set(index::VL_ACCELERATION, 1, 3_000).unwrap();
    rig.set(index::VL_DECELERATION, 1, 3_000).unwrap();
    rig.enable(2);
    let speed = |rig: &Rig| rig.node.dictionary().number(index::VL_VELOCITY_ACTUAL, 0);
    rig.set(index::VL_TARGET_VELOCITY, 0, 600).unwrap();
    rig.run(200);
    assert_eq!(speed(&rig), 0, "bits 4 to 6 are 0");
    word(&mut rig, 0x7F);
    rig.run(100);
    let half = speed(&rig);
    assert!((270..=310).contains(&half), "{half}");
    word(&mut rig, 0x5F);
    rig.run(200);
    assert!((speed(&rig) - half).abs() < 20, "held");
    word(&mut rig, 0x7F);
    assert!(reached(&mut rig, 500));
    rig.run(50);
    assert!((speed(&rig) - 600).abs() < 6, "{}", speed(&rig));
    word(&mut rig, 0x3F);
    rig.run(400);
    assert!(speed(&rig).abs() < 6, "led to 0");
}

#[test]
fn polarity_turns_positions_and_velocities() {
    let mut rig = Rig::new(1);
    rig.set(index::POLARITY, 0, 0xC0).unwrap();
    rig.enable(8);
    rig.set(index::TARGET_POSITION, 0, 5_000).unwrap();
    rig.run(300);
    assert!((position(&rig) - 5_000).abs() <= 2);
    assert!(rig.node.application().axes()[0].actual().position.0 < 0);
    rig.set(index::MODE, 0, 9).unwrap();
    rig.set(index::TARGET_VELOCITY, 0, TURN).unwrap();
    rig.run(300);
    assert!((velocity(&rig) - TURN).abs() < TURN / 50);
    assert!(rig.node.application().axes()[0].actual().velocity.0 < 0);
}

#[test]
fn the_factor_group_scales() {
    let mut rig = Rig::new(1);
    // Gear 5:1, 10 mm a turn in micrometres, velocities in mm/min.
    rig.set(index::GEAR_RATIO, 1, 5).unwrap();
    rig.set(index::FEED_CONSTANT, 1, 10_000).unwrap();
    rig.set(index::VELOCITY_FACTOR, 1, 60).unwrap();
    rig.set(index::VELOCITY_FACTOR, 2, 1_000).unwrap();
    rig.enable(9);
    rig.set(index::TARGET_VELOCITY, 0, 600).unwrap();
    rig.run(100);
    let start = position(&rig);
    rig.run(1_000);
    assert!((position(&rig) - start - 10_000).abs() < 50, "{}", position(&rig) - start);
    let turns = rig.node.application().axes()[0].actual().velocity.0;
    assert!((turns - 5_000_000_000).abs() < 50_000_000, "{turns}");
    let increments = rig.node.dictionary().number(index::POSITION_INTERNAL, 0);
    assert_eq!(increments / (1 << 20), rig.node.application().axes()[0].actual().position.0 / 1_000_000_000);
}

#[test]
fn a_modulo_axis_takes_the_short_way() {
    let mut rig = Rig::new(1);
    rig.set(index::RANGE_LIMIT, 1, 0).unwrap();
    rig.set(index::RANGE_LIMIT, 2, TURN - 1).unwrap();
    rig.enable(8);
    rig.set(index::TARGET_POSITION, 0, TURN - 2_000).unwrap();
    rig.run(300);
    assert!((position(&rig) - (TURN - 2_000)).abs() <= 2, "{}", position(&rig));
    assert!(rig.node.application().axes()[0].actual().position.0 < 0, "downward over the end");
}

#[test]
fn the_following_error_has_a_window_and_a_time() {
    let mut rig = Rig::new(1);
    rig.set(index::FOLLOWING_TIME_OUT, 0, 100).unwrap();
    rig.set(index::FOLLOWING_WINDOW, 0, 1_000).unwrap();
    rig.enable(8);
    rig.node.application_mut().axes_mut()[0].servo_mut().set_load(Torque(3_200_000));
    rig.run(50);
    assert!(rig.status(0).contains(Statusword::FOLLOWING_ERROR));
    assert_eq!(rig.state(), State::OperationEnabled);
    assert!(rig.run_until(200, |rig| rig.state() != State::OperationEnabled));
    assert_eq!(rig.read(index::ERROR_CODE, 0), Ok(0x8611));
    let mut rig = Rig::new(1);
    rig.set(index::FOLLOWING_WINDOW, 0, 0xFFFF_FFFF).unwrap();
    rig.enable(8);
    rig.node.application_mut().axes_mut()[0].servo_mut().set_load(Torque(3_200_000));
    rig.run(300);
    assert_ne!(rig.read(index::ERROR_CODE, 0), Ok(0x8611), "switched off");
}

#[test]
fn a_mode_changes_while_the_axis_moves() {
    let mut rig = Rig::new(1);
    rig.enable(3);
    rig.set(index::TARGET_VELOCITY, 0, 5 * TURN).unwrap();
    rig.run(300);
    rig.set(index::MODE, 0, 1).unwrap();
    assert_eq!(rig.read(index::MODE_DISPLAY, 0), Ok(1));
    rig.run(500);
    assert!(velocity(&rig).abs() < TURN / 50, "without a set-point it stands");
    assert_eq!(rig.state(), State::OperationEnabled);
}

#[test]
fn touch_probes_store_both_edges() {
    let mut rig = Rig::new(1);
    let marks = Marks {
        from: Position(250_000_000),
        length: Position(100_000_000),
        every: Some(Position(1_000_000_000)),
    };
    rig.node.application_mut().axes_mut()[0].servo_mut().set_marks(1, Some(marks));
    rig.enable(9);
    // Probe 1 both edges once, probe 2 the index pulse continuously on its rising edge.
    rig.set(index::PROBE_FUNCTION, 0, 0x1731).unwrap();
    assert_eq!(rig.read(index::PROBE_STATUS, 0), Ok(0x0101));
    rig.set(index::TARGET_VELOCITY, 0, TURN).unwrap();
    rig.run(2_700);
    assert_eq!(rig.read(index::PROBE_STATUS, 0), Ok(0x0307));
    let number = |rig: &Rig, index| rig.node.dictionary().number(index, 0);
    let near = |value: i64, turns: f64| {
        #[expect(clippy::cast_precision_loss, reason = "a few turns")]
        let turned = value as f64 / 65_536.0;
        assert!((turned - turns).abs() < 0.002, "{turned} for {turns}");
    };
    near(number(&rig, index::PROBE_1_RISING), 0.25);
    near(number(&rig, index::PROBE_1_FALLING), 0.35);
    near(number(&rig, index::PROBE_2_RISING), 2.0);
    let counters =
        [index::PROBE_1_RISING_COUNTER, index::PROBE_1_FALLING_COUNTER, index::PROBE_2_RISING_COUNTER];
    assert_eq!(counters.map(|index| number(&rig, index)), [1, 1, 2]);
    // A rising enable begins anew.
    rig.set(index::PROBE_FUNCTION, 0, 0).unwrap();
    assert_eq!(rig.read(index::PROBE_STATUS, 0), Ok(0));
    rig.set(index::PROBE_FUNCTION, 0, 0x0011).unwrap();
    rig.run(1_000);
    assert_eq!(rig.read(index::PROBE_STATUS, 0), Ok(0x0003));
    assert!(number(&rig, index::PROBE_1_RISING) > 3 * TURN);
}

#[test]
fn a_limit_switch_ends_the_motion_into_it() {
    let mut rig = Rig::new(1);
    rig.node.application_mut().axes_mut()[0]
        .set_limit_switches(Position(-1_000_000_000), Position(1_000_000_000));
    rig.enable(9);
    rig.set(index::TARGET_VELOCITY, 0, 2 * TURN).unwrap();
    assert!(rig.run_until(2_000, |rig| rig.state() == State::Fault));
    assert_eq!(rig.read(index::ERROR_CODE, 0), Ok(0x8612));
    assert_eq!(rig.read(index::DIGITAL_INPUTS, 0).unwrap() & 0xF, 2);
    word(&mut rig, 0x80);
    rig.set(index::TARGET_VELOCITY, 0, -2 * TURN).unwrap();
    rig.enable(9);
    rig.run(300);
    assert_eq!(rig.state(), State::OperationEnabled, "away from it");
    assert_eq!(rig.read(index::DIGITAL_INPUTS, 0).unwrap() & 0xF, 0);
}

/// Inverted positions do not move a switch: the one of the servo's way back is at the end where positions are highest.
#[test]
fn polarity_leaves_the_limit_switches_where_they_are() {
    let mut rig = Rig::new(1);
    rig.set(index::POLARITY, 0, 0xC0).unwrap();
    rig.node.application_mut().axes_mut()[0]
        .set_limit_switches(Position(-1_000_000_000), Position(1_000_000_000));
    rig.enable(9);
    rig.set(index::TARGET_VELOCITY, 0, 2 * TURN).unwrap();
    assert!(rig.run_until(2_000, |rig| rig.state() == State::Fault));
    assert_eq!(rig.read(index::DIGITAL_INPUTS, 0).unwrap() & 0xF, 1);
    assert!(position(&rig) > TURN && rig.node.application().axes()[0].actual().position.0 < -1_000_000_000);
}

#[test]
fn halt_is_a_bit_of_every_mode() {
    for mode in [1, 2, 3, 4, 6, 7, 8, 9, 10] {
        let mut rig = Rig::new(1);
        rig.enable(mode);
        rig.set(index::TARGET_VELOCITY, 0, TURN).unwrap();
        rig.set(index::TARGET_TORQUE, 0, 100).unwrap();
        rig.run(200);
        word(&mut rig, i64::from((Controlword::from_bits_retain(15) | Controlword::HALT).bits()));
        rig.run(600);
        assert!(velocity(&rig).abs() < TURN / 50, "mode {mode}: {}", velocity(&rig));
        assert_eq!(rig.state(), State::OperationEnabled, "mode {mode}");
    }
}
