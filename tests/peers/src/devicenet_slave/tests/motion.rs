//! The CIP Motion drive.

use super::*;

/// What a controller sends in a block of 16 bytes.
#[derive(Clone, Copy)]
struct Command {
    node: u8,
    mode: u8,
    control: u8,
    commands: u8,
    actuals: u8,
    statuses: u8,
    value: [u8; 4],
}

const VELOCITY: Command =
    Command { node: 5, mode: 2, control: 0, commands: 2, actuals: 2, statuses: 0, value: [0; 4] };

/// Sends a poll in fragments and puts the answer together.
fn poll(bus: &mut Bus, block: &[u8]) -> Vec<u8> {
    let last = block.len().div_ceil(7) - 1;
    let mut out = Vec::new();
    for (at, part) in block.chunks(7).enumerate() {
        assert_eq!(out, []);
        let kind = if at == 0 {
            0x00
        } else if at == last {
            0x80
        } else {
            0x40
        };
        out = bus.say(0x42D, &[&[kind | u8::try_from(at).unwrap()], part].concat());
    }
    let mut answer = Vec::new();
    for (at, frame) in out.iter().enumerate() {
        assert_eq!(frame.id, 0x3C5);
        assert_eq!(frame.data[0] & 0x3F, u8::try_from(at).unwrap());
        answer.extend_from_slice(&frame.data[1..]);
    }
    answer
}

fn exchange(bus: &mut Bus, id: u8, command: Command) -> Vec<u8> {
    let Command { node, mode, control, commands, actuals, statuses, value } = command;
    let mut block = vec![2, 2, id, node, mode, 2, control, 0, commands, actuals, statuses, 0];
    block.extend(value);
    poll(bus, &block)
}

/// A drive in Stopped.
fn stopped() -> Bus {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(0);
    exchange(&mut bus, 1, VELOCITY);
    bus.wait(25);
    assert_eq!(bus.slave.state(), 2);
    bus
}

/// A drive in Running, with Axis Control back at 0.
fn running(command: Command) -> Bus {
    let mut bus = stopped();
    exchange(&mut bus, 2, Command { control: 1, ..command });
    bus.wait(12);
    let answer = exchange(&mut bus, 3, Command { control: 1, ..command });
    assert_eq!(answer[6..8], [1, 0]);
    assert_eq!(exchange(&mut bus, 4, command)[6..8], [0, 0]);
    assert_eq!(bus.slave.state(), 4);
    bus
}

#[test]
fn the_blocks_are_as_the_tables_say() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(0);
    let out = bus.say(0x42D, &[0x00, 2, 2, 7, 1, 0, 0, 0]);
    assert_eq!(out, []);
    assert_eq!(bus.say(0x42D, &[0x41, 0, 0, 0, 0, 0, 0, 0]), []);
    let out = bus.say(0x42D, &[0x82, 0, 0]);
    // No valid data yet: only the header counts. Remote, but not valid.
    assert_eq!(out[0], Frame::new(0x3C5, &[0x00, 3, 2, 7, 1, 0, 0, 0]));
    assert_eq!(out[1], Frame::new(0x3C5, &[0x41, 0, 0, 0, 0, 0, 0, 0]));
    assert_eq!(out[2], Frame::new(0x3C5, &[0x82, 0, 0]));
    assert_eq!(bus.slave.state(), 0);
    let answer = exchange(&mut bus, 8, VELOCITY);
    assert_eq!(answer, [3, 2, 8, 5, 2, 2, 0, 0, 0, 2, 0, 1, 0, 0, 0, 0]);
    bus.wait(21);
    let answer = exchange(&mut bus, 9, VELOCITY);
    assert_eq!(answer, [3, 2, 9, 5, 2, 2, 0, 0, 0, 2, 0, 2, 0, 0, 0, 0]);
}

#[test]
fn it_is_enabled_and_disabled_with_a_handshake() {
    let mut bus = stopped();
    let answer = exchange(&mut bus, 2, Command { control: 1, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (0, 0, 3));
    assert!(bus.slave.enabled());
    bus.wait(12);
    let answer = exchange(&mut bus, 3, Command { control: 1, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (1, 0, 4));
    let answer = exchange(&mut bus, 4, VELOCITY);
    assert_eq!((answer[6], answer[7], answer[11]), (0, 0, 4));
    let fast = Command { value: 10.0_f32.to_le_bytes(), ..VELOCITY };
    exchange(&mut bus, 5, fast);
    bus.wait(30);
    assert_eq!(exchange(&mut bus, 6, fast)[12..], 10.0_f32.to_le_bytes());
    let answer = exchange(&mut bus, 7, Command { control: 2, ..fast });
    assert_eq!((answer[6], answer[11]), (0, 6));
    bus.wait(110);
    let answer = exchange(&mut bus, 8, Command { control: 2, ..fast });
    assert_eq!((answer[6], answer[7], answer[11]), (2, 0, 2));
    assert!(!bus.slave.enabled());
}

#[test]
fn position_is_followed_in_counts() {
    let command = Command { mode: 1, commands: 1, actuals: 1, ..VELOCITY };
    let mut bus = running(command);
    let goal = Command { value: 25_000_i32.to_le_bytes(), ..command };
    exchange(&mut bus, 5, goal);
    bus.wait(200);
    assert_eq!(exchange(&mut bus, 6, goal)[12..], [0xA8, 0x61, 0, 0]);
    assert_eq!(bus.slave.position().round(), 25_000.0);
    assert_eq!(
        bus.ask_long(&[0x4B, 0x42, 1, 1, 0, 0, 0, 0xB2, 1, 0, 4]),
        [0xCB, 1, 0, 0, 0, 0xB2, 1, 0, 4, 0xA8, 0x61, 0, 0]
    );
}

#[test]
fn a_wide_position_is_taken_when_there_is_room() {
    let mut settings = Settings::motion();
    settings.consumed_size = Some(20);
    let mut bus = Bus::new(settings);
    bus.connect(0);
    let block = |id: u8, control: u8| {
        let mut block = vec![2, 2, id, 5, 1, 2, control, 0, 1, 1, 0, 0];
        block.extend(1234.0_f64.to_le_bytes());
        block
    };
    poll(&mut bus, &block(1, 0));
    bus.wait(25);
    poll(&mut bus, &block(2, 1));
    bus.wait(15);
    poll(&mut bus, &block(3, 1));
    bus.wait(100);
    assert_eq!(bus.slave.position().round(), 1234.0);
}

#[test]
fn torque_accelerates() {
    let command = Command { mode: 4, commands: 8, actuals: 1, ..VELOCITY };
    let mut bus = running(command);
    exchange(&mut bus, 5, Command { value: 10.0_f32.to_le_bytes(), ..command });
    bus.wait(100);
    // A tenth of 500 units per second squared, for 100 ms.
    assert!((bus.slave.velocity() - 5.0).abs() < 0.1, "{}", bus.slave.velocity());
    exchange(&mut bus, 6, Command { value: 0.0_f32.to_le_bytes(), ..command });
    bus.wait(100);
    assert!((bus.slave.velocity() - 5.0).abs() < 0.1);
}

#[test]
fn a_fault_is_told_and_reset() {
    let mut bus = running(VELOCITY);
    exchange(&mut bus, 5, Command { value: 10.0_f32.to_le_bytes(), ..VELOCITY });
    bus.wait(30);
    bus.slave.fail(10);
    assert_eq!(exchange(&mut bus, 6, VELOCITY)[11], 7);
    assert!(!bus.slave.enabled());
    bus.wait(110);
    assert_eq!(bus.slave.state(), 8);
    // Axis fault type 3, code 10.
    assert_eq!(bus.ask_long(&[0x4B, 0x42, 1, 1, 0, 0, 0, 0x95, 2, 0, 1])[9..], [10, 0, 0, 0]);
    assert_eq!(bus.ask_long(&[0x03, 0x42, 1, 1, 0, 0x96, 2]), [0x83, 1, 0, 0x96, 2, 0, 0, 3]);
    assert_eq!(bus.ask_long(&[0x03, 0x42, 1, 1, 0, 0x91, 2])[7..], [0, 4, 0, 0, 0, 0, 0, 0]);
    let answer = exchange(&mut bus, 7, Command { control: 6, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (6, 0, 8));
    bus.slave.mend();
    exchange(&mut bus, 8, VELOCITY);
    let answer = exchange(&mut bus, 9, Command { control: 6, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (6, 0, 2));
}

#[test]
fn enabling_at_the_wrong_time_is_an_error() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(0);
    let answer = exchange(&mut bus, 1, Command { control: 1, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (1, 0x0C, 1));
    let answer = exchange(&mut bus, 2, Command { control: 100, ..VELOCITY });
    assert_eq!((answer[6], answer[7]), (100, 0x09));
    let answer = exchange(&mut bus, 3, Command { control: 127, ..VELOCITY });
    assert_eq!((answer[6], answer[7]), (127, 0));
}

#[test]
fn shutdown_and_back() {
    let mut bus = running(VELOCITY);
    exchange(&mut bus, 5, Command { control: 3, ..VELOCITY });
    bus.wait(2);
    let answer = exchange(&mut bus, 6, Command { control: 3, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (3, 0, 10));
    let answer = exchange(&mut bus, 7, Command { control: 4, ..VELOCITY });
    assert_eq!((answer[6], answer[7], answer[11]), (4, 0, 1));
    bus.wait(21);
    assert_eq!(bus.slave.state(), 2);
}

#[test]
fn an_abort_is_a_fault_of_the_controller() {
    let mut bus = running(VELOCITY);
    let answer = exchange(&mut bus, 5, Command { control: 5, ..VELOCITY });
    assert_eq!((answer[6], answer[7]), (5, 0));
    bus.wait(2);
    assert_eq!(bus.slave.state(), 8);
    assert_eq!(bus.ask_long(&[0x03, 0x42, 1, 1, 0, 0x95, 2])[7..], [62]);
}

#[test]
fn status_data_come_when_they_have_changed() {
    let mut settings = Settings::motion();
    settings.produced_size = Some(24);
    let mut bus = Bus::new(settings);
    bus.connect(0);
    let asked = Command { statuses: 4, ..VELOCITY };
    exchange(&mut bus, 1, asked);
    bus.wait(25);
    let answer = exchange(&mut bus, 2, asked);
    assert_eq!(answer[9..12], [2, 4, 2]);
    // DC Bus Up, Velocity Standstill, Feedback Integrity.
    assert_eq!(answer[16..], [0x04, 0x01, 0x02, 0, 0, 0, 0, 0]);
    let answer = exchange(&mut bus, 3, asked);
    assert_eq!(answer[9..12], [2, 0, 2]);
    assert_eq!(answer[16..], [0; 8]);
}

#[test]
fn another_format_is_a_node_fault() {
    let mut bus = running(VELOCITY);
    let mut block = [2, 1, 5, 5, 2, 2, 0, 0, 2, 2, 0, 0, 0, 0, 0, 0];
    let answer = poll(&mut bus, &block);
    assert_eq!(answer[3], 0x0D);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 16]), [0x8E, 4]);
    bus.wait(2);
    assert_eq!(bus.slave.state(), 8);
    block[1] = 2;
    block[2] = 6;
    block[3] = 0x0D;
    assert_eq!(poll(&mut bus, &block)[3], 0x05);
    assert_eq!(bus.slave.state(), 2);
}

#[test]
fn update_ids_are_watched() {
    let mut bus = stopped();
    exchange(&mut bus, 2, VELOCITY);
    // The same Update ID again: nothing in it counts, but it is answered.
    let answer = exchange(&mut bus, 2, Command { control: 1, ..VELOCITY });
    assert_eq!((answer[2], answer[6], answer[11]), (2, 0, 2));
    exchange(&mut bus, 6, VELOCITY);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 32]), [0x8E, 3]);
    assert_eq!(bus.ask(&[0x10, 0x42, 0, 21, 2]), [0x90]);
    exchange(&mut bus, 9, VELOCITY);
    assert_eq!(bus.slave.state(), 2);
    let answer = exchange(&mut bus, 13, VELOCITY);
    assert_eq!((answer[3], answer[11]), (0x0D, 8));
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 16]), [0x8E, 1]);
}

#[test]
fn a_lost_connection_is_a_node_fault() {
    let mut bus = Bus::new(Settings::motion());
    bus.connect(10);
    exchange(&mut bus, 1, VELOCITY);
    bus.wait(60);
    assert_eq!(bus.slave.state(), 8);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 16]), [0x8E, 6]);
    assert_eq!(bus.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x02, MASTER]).data, [MASTER, 0xCB, 0]);
    assert_eq!(bus.slave.state(), 0);
}

#[test]
fn attributes_of_the_axis() {
    let mut bus = stopped();
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 1]), [0x8E, 4, 0]);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 3]), [0x8E, 1, 0]);
    assert_eq!(bus.ask_long(&[0x10, 0x42, 0, 18, 0x40, 0x42, 0x0F, 0]), [0x90]);
    assert_eq!(bus.ask(&[0x0E, 0x42, 0, 18]), [0x8E, 0x40, 0x42, 0x0F, 0]);
    assert_eq!(bus.ask(&[0x10, 0x42, 1, 41, 2]), [0x90]);
    assert_eq!(bus.ask(&[0x10, 0x42, 1, 41, 3]), [0x94, 0x09, 0xFF]);
    // Stopping Action and Axis State in one list: the state cannot be set.
    let answer = bus.ask_long(&[0x04, 0x42, 1, 2, 0, 0x62, 2, 1, 0x8A, 2, 4]);
    assert_eq!(answer, [0x84, 2, 0, 0x62, 2, 0, 0, 0x8A, 2, 0x0E, 0]);
    // Axis Exception Action from element 10 on, three of them.
    let set = [0x4C, 0x42, 1, 1, 0, 0, 0, 0xA0, 2, 1, 1, 10, 0, 3, 0, 3, 2, 3, 0];
    assert_eq!(bus.ask_long(&set), [0xCC, 1, 0, 0, 0, 0xA0, 2, 0, 0]);
    let get = [0x4B, 0x42, 1, 1, 0, 0, 0, 0xA0, 2, 1, 1, 9, 0, 4, 0];
    assert_eq!(bus.ask_long(&get)[5..], [0xA0, 2, 1, 1, 9, 0, 4, 0, 0, 3, 2, 3]);
    assert_eq!(bus.ask_long(&[0x03, 0x42, 1, 1, 0, 0xFF, 0xFF]), [0x83, 1, 0, 0xFF, 0xFF, 0x14, 0]);
    let last = bus.slave.sets().last().unwrap();
    assert_eq!((last.attribute, last.data.len(), &last.data[9..14]), (672, 64, &[0, 3, 2, 3, 0][..]));
}

#[test]
fn the_feedback_resolution_counts() {
    let mut bus = stopped();
    let set = [0x4C, 0x42, 1, 2, 0, 0, 0, 0x88, 5, 0, 4, 0xE8, 3, 0, 0, 0x89, 5, 0, 4, 4, 0, 0, 0];
    assert_eq!(bus.ask_long(&set), [0xCC, 2, 0, 0, 0, 0x88, 5, 0, 0, 0x89, 5, 0, 0]);
    let command = Command { value: 1.0_f32.to_le_bytes(), ..VELOCITY };
    exchange(&mut bus, 2, Command { control: 1, ..command });
    bus.wait(1012);
    assert!((bus.slave.position() - 4_000.0).abs() < 20.0, "{}", bus.slave.position());
}

#[test]
fn the_position_counts_over_the_highest_dint() {
    let command = Command { mode: 1, commands: 1, actuals: 1, ..VELOCITY };
    let mut settings = Settings::motion();
    settings.counts_per_unit = 1_000_000_000;
    let mut bus = Bus::new(settings);
    bus.connect(0);
    exchange(&mut bus, 1, command);
    bus.wait(25);
    exchange(&mut bus, 2, Command { control: 1, ..command });
    bus.wait(15);
    exchange(&mut bus, 3, Command { value: 2_000_000_000_i32.to_le_bytes(), ..command });
    bus.wait(300);
    let over = Command { value: (-2_000_000_000_i32).to_le_bytes(), ..command };
    exchange(&mut bus, 4, over);
    bus.wait(300);
    assert_eq!(bus.slave.position().round(), 2_294_967_296.0);
    assert_eq!(exchange(&mut bus, 5, over)[12..], (-2_000_000_000_i32).to_le_bytes());
}
