use std::fmt::Write as _;

use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::time::SystemTime;
use proptest::prelude::*;

use super::field::{InputField, OutputField};
use super::handshake::{Axis, Control, Handshake, Link, Reaction, Refusal, State, Status};
use super::layout::{Assemblies, Layout, LayoutError, SHIPPED};
use super::{AxisInput, DriveMode, Scale, SizeError};
use crate::devicenet::wire::speed::SpeedControl;

/// 2.4 Nm.
const SCALE: Scale = Scale { counts_per_unit: 1_000_000, rated_torque: 2_400_000 };

fn shipped(name: &str, axes: usize) -> Assemblies {
    Assemblies::new(Layout::shipped(name).unwrap(), axes).unwrap()
}

#[test]
fn shipped_layouts_have_their_offsets() {
    let mut text = String::new();
    for name in SHIPPED {
        let assemblies = shipped(name, 1);
        for (side, point, len, fields) in [
            ("output", assemblies.output_point(), assemblies.output_len(), assemblies.output()),
            ("input", assemblies.input_point(), assemblies.input_len(), assemblies.input()),
        ] {
            writeln!(text, "{name} {side}: point {point}, {len} bytes").unwrap();
            let mut offset = 0;
            for field in fields {
                assert_eq!(field.offset, offset, "{name} {side} {}", field.name);
                assert_eq!(offset % field.len, 0, "{name} {side}: {} is aligned", field.name);
                offset += field.len;
                writeln!(text, "  {:3} {:5} {}", field.offset, field.kind, field.name).unwrap();
            }
            assert_eq!(offset, len);
            assert!(len % 4 == 0 || name.starts_with("speed-torque"), "the next axis is aligned");
        }
        assert_eq!(usize::from(assemblies.o_to_t_size()), assemblies.output_len() + 6);
        assert_eq!(usize::from(assemblies.t_to_o_size()), assemblies.input_len() + 2);
    }
    insta::assert_snapshot!("shipped_layouts", text);
}

#[test]
fn fields_that_make_no_layout_are_refused() {
    use {InputField as I, OutputField as O};
    let of = |output: &[O], input: &[I]| {
        Layout::of_fields(output.to_vec(), input.to_vec()).map_err(|e| e.to_string())
    };
    for (output, input, expected) in [
        (&[O::Mode][..], &[I::Status][..], "the output has no field `control`"),
        (&[O::Control], &[I::Status], "the output has no field `mode`"),
        (&[O::Control, O::Mode], &[I::Age], "the input has no field `status`"),
        (
            &[O::Control, O::Mode, O::Torque, O::Torque],
            &[I::Status],
            "the output has the field `torque` twice",
        ),
        (&[O::Control, O::Mode], &[I::Status, I::Age, I::Age], "the input has the field `age` twice"),
        (
            &[O::Control, O::Mode, O::TargetPosition64, O::TargetPosition32],
            &[I::Status],
            "the output has target positions of both widths",
        ),
    ] {
        assert_eq!(of(output, input), Err(expected.to_owned()));
    }
    assert!(of(&[O::Control, O::Pad8, O::Pad8, O::Mode], &[I::Pad16, I::Status, I::Pad16]).is_ok());
    let one = Layout::shipped("speed").unwrap();
    assert_eq!(Assemblies::new(one, 2), Err(LayoutError::OneAxis { axes: 2 }));
    let wide = Layout::Fields { output: vec![O::Pad32; 351], input: vec![], mode: None };
    assert_eq!(Assemblies::new(wide, 1), Err(LayoutError::TooLong { output: true, len: 1404 }));
}

#[test]
fn every_other_length_is_refused_with_both_lengths() {
    for name in SHIPPED {
        let axes = if name.starts_with("speed") { 1 } else { 3 };
        let assemblies = shipped(name, axes);
        let (output, input) = (assemblies.output_len(), assemblies.input_len());
        let bytes = vec![0xA5; output.max(input) + 9];
        for len in 0..output + 9 {
            let found = assemblies.output_of(axes - 1, &bytes[..len], SCALE).map(|_| ());
            let expected =
                if len == output { Ok(()) } else { Err(SizeError { expected: output, found: len }) };
            assert_eq!(found, expected, "{name}");
        }
        for len in 0..input + 9 {
            let mut room = bytes[..len].to_vec();
            let found = assemblies.put_input(0, &AxisInput::default(), SCALE, &mut room);
            let expected = if len == input { Ok(()) } else { Err(SizeError { expected: input, found: len }) };
            assert_eq!(found, expected, "{name}");
            assert_eq!(room != bytes[..len], len == input, "{name}: nothing is written into another length");
        }
        assert!(assemblies.output_of(axes, &bytes[..output], SCALE).is_err(), "there is no such axis");
    }
    assert_eq!(SizeError { expected: 16, found: 15 }.to_string(), "the assembly has 16 bytes, found 15");
}

#[test]
fn values_stand_at_their_offsets_for_each_axis() {
    let assemblies = shipped("position", 2);
    let mut data = vec![0; 32];
    data[16..18].copy_from_slice(&0x0005_u16.to_le_bytes());
    data[20..24].copy_from_slice(&(-1_500_000_i32).to_le_bytes());
    data[24..28].copy_from_slice(&2_000_000_i32.to_le_bytes());
    data[28..32].copy_from_slice(&10_000_000_i32.to_le_bytes());
    let values = assemblies.output_of(1, &data, SCALE).unwrap();
    assert_eq!(values.control, Control::ENABLE | Control::START);
    assert_eq!((values.mode, values.refusal), (1, None));
    assert_eq!(values.position, Some(Position(-1_500_000_000)));
    assert_eq!(values.velocity, Some(Velocity(2_000_000_000)));
    assert_eq!(values.acceleration, Some(Acceleration(10_000_000_000)));
    assert_eq!((values.torque, values.time_stamp), (None, None));
    let first = assemblies.output_of(0, &data, SCALE).unwrap();
    assert_eq!((first.control, first.position), (Control::empty(), Some(Position(0))));

    let actual = AxisInput {
        status: Status::ENABLED | Status::DONE,
        mode: 1,
        refusal: Refusal::TOO_FAST,
        fault: 0x0102,
        position: Position(-2_000_000_500),
        velocity: Velocity(3_000_000),
        torque: Torque(-12_345),
        following_error: Position(7_000),
        ..AxisInput::default()
    };
    let mut data = vec![0xFF; 40];
    assemblies.put_input(1, &actual, SCALE, &mut data).unwrap();
    assert_eq!(&data[..20], &[0xFF; 20], "the other axis is not touched");
    let mut expected = vec![0x12, 0x00, 1, 9, 0x02, 0x01];
    expected.extend((-12_i16).to_le_bytes());
    expected.extend((-2_000_001_i32).to_le_bytes());
    expected.extend(3_000_i32.to_le_bytes());
    expected.extend(7_i32.to_le_bytes());
    assert_eq!(&data[20..], &expected);
}

#[test]
fn a_value_that_does_not_fit_is_held_and_marked() {
    let assemblies = shipped("position", 1);
    let put = |position| {
        let mut data = [0; 20];
        let actual = AxisInput { position: Position(position), ..AxisInput::default() };
        assemblies.put_input(0, &actual, SCALE, &mut data).unwrap();
        let place = i32::from_le_bytes(data[8..12].try_into().unwrap());
        (place, u16::from_le_bytes([data[0], data[1]]) & Status::SATURATED.bits() != 0)
    };
    assert_eq!(put(i64::from(i32::MAX) * 1_000), (i32::MAX, false));
    assert_eq!(put((i64::from(i32::MAX) + 1) * 1_000), (i32::MAX, true));
    assert_eq!(put(i64::MIN), (i32::MIN, true));
    let wide = shipped("motion", 1);
    let mut data = vec![0; 24];
    data[8..16].copy_from_slice(&i64::MAX.to_le_bytes());
    let values = wide.output_of(0, &data, SCALE).unwrap();
    assert_eq!((values.position, values.refusal), (None, Some(Refusal::VALUE)));
    data[8..16].fill(0);
    data[16..24].copy_from_slice(&5_i64.to_le_bytes());
    assert_eq!(wide.output_of(0, &data, SCALE).unwrap().time_stamp, Some(SystemTime(5)));
    data[23] = 0x80;
    assert_eq!(wide.output_of(0, &data, SCALE).unwrap().refusal, Some(Refusal::VALUE));
}

#[test]
fn assemblies_of_the_speed_profile_have_its_bits() {
    let command = |name, data: [u8; 4]| shipped(name, 1).output_of(0, &data, SCALE).unwrap();
    let of = |name, data| {
        let values = command(name, data);
        (values.control, values.velocity.unwrap().get(), values.refusal)
    };
    let (none, enable, reset) = (Control::empty(), Control::ENABLE, Control::RESET);
    // 600 rpm are ten revolutions a second.
    assert_eq!(of("speed-basic", [0x01, 0, 0x58, 0x02]), (enable, 10_000_000_000, None));
    assert_eq!(of("speed-basic", [0x04, 0, 0, 0]), (reset, 0, None));
    assert_eq!(of("speed-basic", [0x03, 0, 1, 0]), (enable, 16_666_667, None), "20 has no run reverse");
    assert_eq!(of("speed", [0x61, 0, 60, 0]), (enable, 1_000_000_000, None));
    assert_eq!(of("speed", [0x62, 0, 60, 0]), (enable, -1_000_000_000, None));
    assert_eq!(of("speed", [0x63, 0, 60, 0]), (none, -1_000_000_000, Some(Refusal::BOTH_DIRECTIONS)));
    for not_from_network in [0x01, 0x21, 0x41] {
        assert_eq!(of("speed", [not_from_network, 0, 60, 0]).0, none);
    }
    let put = |name, status, velocity| {
        let mut data = [0xFF; 4];
        let actual =
            AxisInput { status, velocity: Velocity(velocity), at_reference: true, ..AxisInput::default() };
        shipped(name, 1).put_input(0, &actual, SCALE, &mut data).unwrap();
        data
    };
    let run = Status::RUN | Status::ENABLED | Status::TORQUE;
    assert_eq!(put("speed", run, 1_000_000_000), [0xF4, 4, 60, 0]);
    assert_eq!(put("speed", run, -1_000_000_000), [0xF8, 4, 0xC4, 0xFF]);
    assert_eq!(put("speed-basic", run, 1_000_000_000), [0x04, 0, 60, 0]);
    assert_eq!(put("speed", Status::FAULT, 0), [0x01, 7, 0, 0]);
    assert_eq!(put("speed", Status::TORQUE, 0), [0, 5, 0, 0]);
    assert_eq!(put("speed", Status::READY, i64::MAX), [0x10, 3, 0xFF, 0x7F]);
}

#[test]
fn assemblies_with_torque_have_it_in_scaled_newton_metres() {
    use DriveMode::{Speed, Torque as ByTorque};
    let of = |name, mode, scale| {
        Assemblies::new(Layout::shipped(name).unwrap().with_torque(mode, scale), 1).unwrap()
    };
    let output = |name, mode, scale, data: [u8; 6]| {
        let values = of(name, mode, scale).output_of(0, &data, SCALE).unwrap();
        (values.control, values.mode, values.velocity, values.torque, values.refusal)
    };
    let (none, enable, both) = (Control::empty(), Control::ENABLE, Some(Refusal::BOTH_DIRECTIONS));
    let rev = |nano| Some(Velocity(nano));
    let parts = |parts| Some(Torque(parts));
    // Rated are 2.4 Nm: 1.2 Nm are half of it. In speed control the torque reference is not even looked at.
    for (name, mode, scale, data, expected) in [
        ("speed-torque", Speed, 0, [0x61, 0, 60, 0, 0xFF, 0x7F], (enable, 2, rev(1_000_000_000), None, None)),
        ("speed-torque", Speed, 4, [0x62, 0, 60, 0, 1, 0], (enable, 2, rev(-1_000_000_000), None, None)),
        ("speed-torque", ByTorque, 0, [0x61, 0, 60, 0, 6, 0], (enable, 5, None, parts(2_500_000), None)),
        ("speed-torque", ByTorque, 0, [0x62, 0, 60, 0, 6, 0], (enable, 5, None, parts(-2_500_000), None)),
        (
            "speed-torque",
            ByTorque,
            0,
            [0x61, 0, 0, 0, 0xFA, 0xFF],
            (enable, 5, None, parts(-2_500_000), None),
        ),
        // 16ths and 1024ths of a newton metre, and units of 4 Nm.
        ("speed-torque", ByTorque, 4, [0x61, 0, 0, 0, 24, 0], (enable, 5, None, parts(625_000), None)),
        ("speed-torque", ByTorque, 10, [0x61, 0, 0, 0, 1, 0], (enable, 5, None, parts(407), None)),
        ("speed-torque", ByTorque, -2, [0x61, 0, 0, 0, 3, 0], (enable, 5, None, parts(5_000_000), None)),
        ("speed-torque", ByTorque, 0, [0x63, 0, 0, 0, 6, 0], (none, 5, None, parts(-2_500_000), both)),
        ("speed-torque", ByTorque, 0, [0x21, 0, 0, 0, 6, 0], (none, 5, None, parts(2_500_000), None)),
        ("speed-torque-basic", ByTorque, 0, [0x01, 0, 0, 0, 6, 0], (enable, 5, None, parts(2_500_000), None)),
        ("speed-torque-basic", ByTorque, 0, [0x03, 0, 0, 0, 6, 0], (enable, 5, None, parts(2_500_000), None)),
        (
            "speed-torque-basic",
            ByTorque,
            0,
            [0x04, 0, 0, 0, 6, 0],
            (Control::RESET, 5, None, parts(2_500_000), None),
        ),
    ] {
        assert_eq!(output(name, mode, scale, data), expected, "{name} {mode:?} {scale} {data:?}");
    }
    // Without a rated torque no number of newton metres is any torque.
    let unknown = Scale { rated_torque: 0, ..SCALE };
    let values = of("speed-torque", ByTorque, 0).output_of(0, &[0x61, 0, 0, 0, 6, 0], unknown).unwrap();
    assert_eq!((values.torque, values.refusal), (Some(Torque::ZERO), Some(Refusal::VALUE)));

    let input = |name, scale, torque| {
        let mut data = [0xFF; 6];
        let status = Status::RUN | Status::ENABLED | Status::TORQUE;
        let actual = AxisInput {
            status,
            velocity: Velocity(1_000_000_000),
            torque: Torque(torque),
            at_reference: true,
            ..AxisInput::default()
        };
        of(name, ByTorque, scale).put_input(0, &actual, SCALE, &mut data).unwrap();
        data
    };
    assert_eq!(input("speed-torque", 4, 625_000), [0xF4, 4, 60, 0, 24, 0]);
    assert_eq!(input("speed-torque", 4, -625_000), [0xF4, 4, 60, 0, 0xE8, 0xFF]);
    assert_eq!(input("speed-torque", 10, 407), [0xF4, 4, 60, 0, 1, 0]);
    assert_eq!(input("speed-torque", -2, 5_000_000), [0xF4, 4, 60, 0, 3, 0]);
    assert_eq!(input("speed-torque", 0, 200_000), [0xF4, 4, 60, 0, 0, 0], "0.48 Nm");
    assert_eq!(input("speed-torque", 15, i64::MAX), [0xF4, 4, 60, 0, 0xFF, 0x7F]);
    assert_eq!(input("speed-torque", 15, i64::MIN), [0xF4, 4, 60, 0, 0, 0x80]);
    assert_eq!(input("speed-torque-basic", 4, 625_000), [0x04, 0, 60, 0, 24, 0]);
}

/// Every reaction to byte 0 of the assemblies with torque: state of the handshake by byte, the torque being 1.2 Nm.
#[test]
fn every_byte_of_the_drive_profile_in_every_state_has_its_reaction() {
    let mut text = String::new();
    for (name, mode) in [
        ("speed-torque-basic", DriveMode::Speed),
        ("speed-torque-basic", DriveMode::Torque),
        ("speed-torque", DriveMode::Speed),
        ("speed-torque", DriveMode::Torque),
    ] {
        let layout = Layout::shipped(name).unwrap().with_torque(mode, 1);
        let extended = name == "speed-torque";
        let assemblies = Assemblies::new(layout, 1).unwrap();
        let values = |bits: u8| assemblies.output_of(0, &[bits, 0, 60, 0, 2, 0], SCALE).unwrap();
        let from_network = if extended { 0x60 } else { 0 };
        // Beside the profile's bits some that the assembly does not have; without run two bytes are enough.
        let of_profile =
            |bits: &u8| SpeedControl::from_bits(*bits).is_some_and(|_| extended || bits & !5 == 0);
        let in_run: Vec<u8> = (0..=u8::MAX).filter(of_profile).chain([0x99 | from_network]).collect();
        let out_of_run = vec![0, 1 | from_network];
        for link in [Link::Run, Link::Idle, Link::Lost] {
            for state in [State::Locked, State::Armed, State::Enabled] {
                writeln!(text, "{name} in {} control, {link:?}, {state:?}", mode.name()).unwrap();
                let axis = Axis { faulted: false, operating: state == State::Enabled };
                for &bits in if link == Link::Run { &in_run } else { &out_of_run } {
                    let mut handshake = Handshake::default();
                    let before: &[u8] = match state {
                        State::Locked => &[],
                        State::Armed => &[0],
                        State::Enabled => &[0, 1],
                    };
                    for one in before {
                        handshake.step(Link::Run, values(one | from_network).control, axis);
                    }
                    assert_eq!(handshake.state(), state);
                    let values = values(bits);
                    let (reaction, refusal) = handshake.step(link, values.control, axis);
                    let names: Vec<_> = reaction.iter_names().map(|(name, _)| name).collect();
                    let follows = match (handshake.state(), values.velocity, values.torque) {
                        (State::Enabled, Some(velocity), None) => {
                            format!(", {} rpm", velocity.get() * 60 / 1_000_000_000)
                        }
                        (State::Enabled, None, Some(torque)) => format!(", {} ppm of torque", torque.get()),
                        (State::Enabled, ..) => panic!("one of them moves it"),
                        _ => String::new(),
                    };
                    let refusal = values.refusal.unwrap_or(refusal);
                    writeln!(
                        text,
                        "  {bits:#04X} -> {:?}{}{follows}{}",
                        handshake.state(),
                        if names.is_empty() { String::new() } else { format!(" {}", names.join(" ")) },
                        if refusal == Refusal::NONE { String::new() } else { format!(" ({refusal})") },
                    )
                    .unwrap();
                }
            }
        }
    }
    insta::assert_snapshot!("profile_byte_by_state", text);
}

/// Every reaction to a control word: state of the handshake by word, with all bits 0 before.
#[test]
fn every_word_in_every_state_has_its_reaction() {
    let reached = |state| {
        let mut handshake = Handshake::default();
        let axis = Axis { faulted: false, operating: state == State::Enabled };
        if state != State::Locked {
            handshake.step(Link::Run, Control::empty(), axis);
        }
        if state == State::Enabled {
            handshake.step(Link::Run, Control::ENABLE, axis);
        }
        assert_eq!(handshake.state(), state);
        handshake
    };
    let mut text = String::new();
    for link in [Link::Run, Link::Idle, Link::Lost] {
        for faulted in [false, true] {
            for state in [State::Locked, State::Armed, State::Enabled] {
                writeln!(text, "{link:?}, {state:?}{}", if faulted { ", faulted" } else { "" }).unwrap();
                for bits in (0..32).chain([0x20, 0x8001]) {
                    let mut handshake = reached(state);
                    let axis = Axis { faulted, operating: state == State::Enabled && !faulted };
                    let word = Control::from_bits_retain(bits);
                    let (reaction, refusal) = handshake.step(link, word, axis);
                    let names: Vec<_> = reaction.iter_names().map(|(name, _)| name).collect();
                    writeln!(
                        text,
                        "  {bits:#06X} -> {:?}{}{}",
                        handshake.state(),
                        if names.is_empty() { String::new() } else { format!(" {}", names.join(" ")) },
                        if refusal == Refusal::NONE { String::new() } else { format!(" ({refusal})") },
                    )
                    .unwrap();
                    // The same once more has no further effect.
                    if faulted || state != State::Enabled || link != Link::Run {
                        let operating = Axis { faulted, operating: false };
                        let (again, _) = handshake.step(link, word, operating);
                        let once = Reaction::ENABLE | Reaction::DISABLE | Reaction::LOSE | Reaction::RESET;
                        assert!(
                            !again.intersects(once | Reaction::START),
                            "{link:?} {state:?} {bits:#x}: {again:?}"
                        );
                    }
                }
            }
        }
    }
    insta::assert_snapshot!("word_by_state", text);
}

#[test]
fn nothing_is_enabled_by_a_level() {
    let (ready, enable) = (Axis::default(), Control::ENABLE);
    for loss in [Link::Lost, Link::Idle] {
        let mut handshake = Handshake::default();
        let mut step = |link, word| handshake.step(link, word, ready);
        assert_eq!(step(Link::Run, enable), (Reaction::empty(), Refusal::NONE), "it was not seen at 0");
        step(Link::Run, Control::empty());
        assert_eq!(step(Link::Run, enable).0, Reaction::ENABLE);
        assert_eq!(step(Link::Run, enable).0, Reaction::empty());
        assert_eq!(step(loss, enable).0, Reaction::LOSE);
        assert_eq!(step(loss, Control::empty()).0, Reaction::empty(), "data do not count then");
        let all = enable | Control::RESET | Control::START;
        assert_eq!(step(Link::Run, all).0, Reaction::empty(), "{loss:?}: nothing moves on a reconnection");
        assert_eq!(step(Link::Run, all).0, Reaction::empty());
    }
}

#[test]
fn a_fault_needs_an_edge_of_reset_and_of_enable() {
    let mut handshake = Handshake::default();
    let (well, ill) = (Axis { faulted: false, operating: true }, Axis { faulted: true, operating: false });
    handshake.step(Link::Run, Control::empty(), well);
    handshake.step(Link::Run, Control::ENABLE, well);
    assert_eq!(handshake.step(Link::Run, Control::ENABLE, ill), (Reaction::empty(), Refusal::NONE));
    assert_eq!(handshake.state(), State::Locked);
    assert_eq!(handshake.step(Link::Run, Control::ENABLE | Control::RESET, ill).0, Reaction::RESET);
    assert_eq!(
        handshake.step(Link::Run, Control::ENABLE, well).0,
        Reaction::empty(),
        "ENABLE is still of before"
    );
    handshake.step(Link::Run, Control::empty(), well);
    assert_eq!(handshake.step(Link::Run, Control::ENABLE, well).0, Reaction::ENABLE);
}

fn any_control() -> impl Strategy<Value = (Link, u16, bool, bool)> {
    let link = prop_oneof![1 => Just(Link::Lost), 1 => Just(Link::Idle), 8 => Just(Link::Run)];
    (link, prop_oneof![8 => 0_u16..32, 1 => any::<u16>()], any::<bool>(), any::<bool>())
}

proptest! {
    /// Whatever comes: torque is wanted only after ENABLE was 0 and then 1, both in run, and a movement starts only then.
    #[test]
    fn torque_needs_an_edge_in_run(steps in proptest::collection::vec(any_control(), 1..60)) {
        let mut handshake = Handshake::default();
        let mut low_in_run = false;
        let mut on = false;
        for (link, bits, faulted, operating) in steps {
            let word = Control::from_bits_retain(bits);
            let axis = Axis { faulted, operating };
            let (reaction, _) = handshake.step(link, word, axis);
            if reaction.contains(Reaction::ENABLE) {
                prop_assert!(low_in_run && link == Link::Run && word.contains(Control::ENABLE) && !faulted && !on);
                on = true;
            }
            if reaction.intersects(Reaction::DISABLE | Reaction::LOSE) {
                prop_assert!(on, "{:?}", reaction);
                on = false;
            }
            if link == Link::Run && on && faulted {
                on = false;
            }
            if reaction.contains(Reaction::START) {
                prop_assert!(on && operating && link == Link::Run && !word.contains(Control::STOP));
            }
            prop_assert_eq!(on, handshake.state() == State::Enabled);
            low_in_run = link == Link::Run && !word.has_reserved() && !word.contains(Control::ENABLE);
        }
    }

    /// A torque in newton metres comes back, whatever the scale and the motor.
    #[test]
    fn scaled_newton_metres_come_back(units: i16, scale in -15_i8..=15, rated in 1_000_i64..1_000_000_000) {
        let of = Scale { counts_per_unit: 1, rated_torque: rated };
        let torque = of.torque(units, scale).unwrap();
        // A millionth of the rated torque is less than half a unit.
        let fine = 2.0 * f64::from(i32::try_from(rated).unwrap()) / 1e12 < f64::from(scale).exp2().recip();
        if fine {
            prop_assert_eq!(of.torque_units(torque, scale), units);
        }
        prop_assert_eq!(torque.get().signum() * i64::from(units.signum()) >= 0, true);
    }

    #[test]
    fn counts_and_nanounits_are_nearest(counts in any::<i32>(), resolution in 1_u32..2_000_000_000) {
        let scale = Scale { counts_per_unit: resolution, rated_torque: 0 };
        let nano = scale.nano(i64::from(counts)).unwrap();
        let exact = i128::from(counts) * 1_000_000_000;
        prop_assert!((i128::from(nano) * i128::from(resolution) - exact).abs() * 2 <= i128::from(resolution));
        if resolution <= 1_000_000_000 {
            prop_assert_eq!(scale.counts(nano), Some(i64::from(counts)), "a count is not lost");
        }
    }

    /// Any layout of any fields: what stands at the offset of a field is what comes out of it.
    #[test]
    fn any_layout_reads_its_fields_at_their_offsets(
        order in Just(OutputField::ALL.to_vec()).prop_shuffle(),
        wide in any::<bool>(),
        axes in 1_usize..5,
        seed in proptest::collection::vec(any::<u8>(), 256),
    ) {
        let dropped = if wide { OutputField::TargetPosition32 } else { OutputField::TargetPosition64 };
        let fields: Vec<_> = order.into_iter().filter(|field| *field != dropped).collect();
        let layout = Layout::of_fields(fields, vec![InputField::Status]).unwrap();
        let assemblies = Assemblies::new(layout, axes).unwrap();
        let data = &seed[..assemblies.output_len()];
        let scale = Scale { counts_per_unit: 1_000_000_000, rated_torque: 0 };
        for axis in 0..axes {
            let values = assemblies.output_of(axis, data, scale).unwrap();
            let raw = |name: &str| {
                let fields = assemblies.output();
                let at = fields.iter().find(|field| field.axis == axis && field.name == name).unwrap();
                let bytes = &data[at.offset..at.offset + at.len];
                match at.len {
                    1 => i64::from(bytes[0]),
                    2 => i64::from(i16::from_le_bytes(bytes.try_into().unwrap())),
                    4 => i64::from(i32::from_le_bytes(bytes.try_into().unwrap())),
                    _ => i64::from_le_bytes(bytes.try_into().unwrap()),
                }
            };
            let position = raw(if wide { "target_position_64" } else { "target_position_32" });
            prop_assert_eq!(values.position.map(|value| value.get()), Some(position));
            prop_assert_eq!(values.velocity.map(|value| value.get()), Some(raw("velocity")));
            prop_assert_eq!(values.torque.map(|value| value.get()), Some(raw("torque") * 1_000));
            prop_assert_eq!(i64::from(values.mode), raw("mode"));
            prop_assert_eq!(values.control.bits(), u16::from_le_bytes((i16::try_from(raw("control")).unwrap()).to_le_bytes()));
            prop_assert_eq!(values.refusal, (raw("time_stamp") < 0).then_some(Refusal::VALUE));
        }
    }
}
