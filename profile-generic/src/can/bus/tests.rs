//! The bus against what ISO 11898-1 says happens.

use super::*;
use crate::can::timing::Shape;

const T0: MonotonicTime = MonotonicTime(1_000_000);

fn us(micros: i64) -> MonotonicTime {
    T0 + DurationNs::from_micros(micros)
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), data).unwrap()
}

fn bus<const N: usize>() -> (Bus, [Station; N]) {
    let mut bus = Bus::new(BitRate::MAX_CLASSIC);
    let stations = [(); N].map(|()| bus.add(QUEUE_DEFAULT).unwrap());
    (bus, stations)
}

/// Runs to `until` as a driver does, from one waking to the next, and lists what came out.
fn run(bus: &mut Bus, until: MonotonicTime) -> Vec<String> {
    let mut lines = Vec::new();
    loop {
        let now = bus.wake_at().filter(|at| *at <= until).unwrap_or(until);
        while let Some(output) = bus.poll(now) {
            lines.push(match output {
                Output::Received { at, to, from, frame } => {
                    format!("{} {}->{} {frame}", (at - T0).0, from.0, to.0)
                }
                Output::Sent { at, from, frame } => format!("{} {} sent {frame}", (at - T0).0, from.0),
                Output::State { at, station, state } => format!("{} {} {state:?}", (at - T0).0, station.0),
            });
        }
        if now == until {
            return lines;
        }
    }
}

/// Only what was received.
fn received(lines: &[String]) -> Vec<&str> {
    lines.iter().filter(|line| line.contains("->")).map(String::as_str).collect()
}

fn duration(frame: &Frame) -> i64 {
    BitRate::MAX_CLASSIC.time(exact(frame)).0
}

#[test]
fn the_lowest_identifier_goes_first_and_frames_take_their_time() {
    let (mut bus, [a, b, c]) = bus();
    let (low, mid, high) = (frame(0x181, &[1, 2]), frame(0x182, &[3]), frame(0x281, &[]));
    // Handed in in the wrong order, all at the same moment.
    bus.send(T0, c, &high).unwrap();
    bus.send(T0, b, &mid).unwrap();
    assert_eq!(bus.poll(T0), None);
    bus.send(T0, a, &low).unwrap();
    let ends =
        [duration(&low), duration(&low) + duration(&mid), duration(&low) + duration(&mid) + duration(&high)];
    assert_eq!(bus.wake_at(), Some(T0 + DurationNs(ends[0])));
    assert_eq!(
        run(&mut bus, us(1000)),
        [
            format!("{} 0 sent {low}", ends[0]),
            format!("{} 0->1 {low}", ends[0]),
            format!("{} 0->2 {low}", ends[0]),
            format!("{} 1->0 {mid}", ends[1]),
            format!("{} 1 sent {mid}", ends[1]),
            format!("{} 1->2 {mid}", ends[1]),
            format!("{} 2->0 {high}", ends[2]),
            format!("{} 2->1 {high}", ends[2]),
            format!("{} 2 sent {high}", ends[2]),
        ]
    );
    // 2 bytes: 63 bits and few stuff bits, and the third waited for the other two.
    assert!((63_000..=77_000).contains(&ends[0]), "{}", ends[0]);
    assert_eq!(bus.statistics(c).wait_max, DurationNs(ends[1]));
    assert_eq!(bus.traffic(), Traffic { frames: 3, errors: 0, collisions: 0, busy: DurationNs(ends[2]) });
    bus.judge();
}

#[test]
fn a_frame_on_the_wire_is_not_interrupted() {
    let (mut bus, [a, b]) = bus();
    let (long, short) = (frame(0x7FF, &[0x55; 8]), frame(0x000, &[1, 1]));
    bus.send(T0, a, &long).unwrap();
    bus.send(us(1), b, &short).unwrap();
    let first = duration(&long);
    assert_eq!(
        received(&run(&mut bus, us(1000))),
        [format!("{first} 0->1 {long}"), format!("{} 1->0 {short}", first + duration(&short))]
    );
}

#[test]
fn the_queue_goes_in_order_and_refuses_when_full() {
    let (mut bus, [a, b]) = bus();
    for n in 0..10_u8 {
        bus.send(T0, a, &frame(0x300 - u16::from(n), &[n])).unwrap();
    }
    assert_eq!(bus.send(T0, a, &frame(0, &[])), Err(SendError::Full));
    assert_eq!(bus.waiting(a), 10);
    // Lower than what stands behind the first one: not seen before its turn.
    bus.send(T0, b, &frame(0x2FF, &[99])).unwrap();
    let lines = run(&mut bus, us(2000));
    let ids: Vec<&str> = received(&lines).iter().map(|line| &line.split(' ').nth(2).unwrap()[..3]).collect();
    assert_eq!(ids, ["2FF", "300", "2FF", "2FE", "2FD", "2FC", "2FB", "2FA", "2F9", "2F8", "2F7"]);
    let statistics = bus.statistics(a);
    assert_eq!((statistics.sent, statistics.refused, statistics.queue_max), (10, 1, 10));
    // The same identifier once from each: the second one is told.
    assert_eq!(
        bus.violations().iter().map(Violation::to_string).collect::<Vec<_>>(),
        ["0.001000000 s: station 1 sends 2FF, which is an identifier of station 0"]
    );
}

#[test]
fn arbitration_follows_the_bits() {
    let extended = |id| Frame::new(Id::Extended(id), &[1]).unwrap();
    let order = [
        frame(0x100, &[1]),
        Frame::remote(Id::Standard(0x100), 1).unwrap(),
        extended(0x100 << 18),
        extended(0x100 << 18 | 1),
        Frame::remote(Id::Extended(0x100 << 18 | 1), 1).unwrap(),
        frame(0x101, &[1]),
        extended(0x101 << 18),
    ];
    let (mut bus, stations) = bus::<7>();
    for (station, frame) in stations.iter().zip(&order).rev() {
        bus.send(T0, *station, frame).unwrap();
    }
    let lines = run(&mut bus, us(2000));
    let sent = lines.iter().filter_map(|line| line.split_once(" sent ").map(|(_, frame)| frame.to_owned()));
    assert_eq!(sent.collect::<Vec<_>>(), order.map(|frame| frame.to_string()));
}

#[test]
fn the_same_bits_at_the_same_time_are_one_frame() {
    let (mut bus, [a, b, c]) = bus();
    let answer = frame(0x7E4, &[0x4F, 0, 0, 0, 0, 0, 0, 0]);
    bus.share(answer.id());
    bus.send(T0, a, &answer).unwrap();
    bus.send(T0, b, &answer).unwrap();
    let lines = run(&mut bus, us(1000));
    assert_eq!(received(&lines), [format!("{} 0->{} {answer}", duration(&answer), c.0)]);
    assert_eq!((bus.statistics(a).sent, bus.statistics(b).sent, bus.traffic().frames), (1, 1, 1));
    bus.judge();
}

#[test]
fn two_stations_with_one_identifier_collide_until_both_are_off() {
    let (mut bus, [a, b, c, _d]) = bus();
    bus.send(T0, a, &frame(0x701, &[0])).unwrap();
    bus.send(T0, b, &frame(0x701, &[5])).unwrap();
    bus.send(T0, c, &frame(0x702, &[0])).unwrap();
    let lines = run(&mut bus, us(20_000));
    let states: Vec<&str> = lines
        .iter()
        .filter(|line| !line.contains("sent") && !line.contains("->"))
        .map(|line| line.split_once(' ').unwrap().1)
        .collect();
    assert_eq!(
        states,
        ["0 Warning", "1 Warning", "0 Passive", "1 Passive", "0 BusOff", "1 BusOff"],
        "the listener has counted 32 errors only"
    );
    // The third gets through once the two are off.
    assert_eq!((bus.statistics(c).sent, bus.traffic().collisions), (1, 32));
    assert_eq!(bus.state(a), State::BusOff);
    assert_eq!(bus.send(us(20_000), a, &frame(1, &[])), Err(SendError::BusOff));
    let violations = bus.violations().iter().map(Violation::to_string).collect::<Vec<_>>();
    assert_eq!(
        violations,
        [
            "0.001000000 s: station 1 sends 701, which is an identifier of station 0",
            "0.001000000 s: station 0 sends 701 at the same time as station 1, with other bits behind it"
        ]
    );
    // 1408 recessive bits later it is back, its queue empty.
    bus.restart(us(20_000), a);
    assert_eq!(run(&mut bus, us(22_000)), ["21408000 0 Active"]);
    assert_eq!(bus.waiting(a), 0);
    bus.send(us(22_000), a, &frame(0x701, &[0])).unwrap();
    assert_eq!(received(&run(&mut bus, us(23_000))).len(), 2);
}

#[test]
#[should_panic(expected = "station 0 sends 701 at the same time as station 1")]
fn a_collision_ends_a_test_that_did_not_mean_it() {
    let (mut bus, [a, b]) = bus();
    bus.send(T0, a, &frame(0x701, &[0])).unwrap();
    bus.send(T0, b, &frame(0x701, &[5])).unwrap();
    run(&mut bus, us(200));
    bus.judge();
}

#[test]
fn a_spoilt_frame_is_sent_again_behind_an_error_frame() {
    let (mut bus, [a, _b]) = bus();
    let sdo = frame(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    assert!(bus.disturb(Disturbance::all(Effect::Spoil).id(sdo.id()).skip(1).count(2)));
    bus.send(T0, a, &sdo).unwrap();
    bus.send(T0, a, &sdo).unwrap();
    let time = duration(&sdo);
    assert_eq!(
        received(&run(&mut bus, us(2000))),
        [format!("{time} 0->1 {sdo}"), format!("{} 0->1 {sdo}", 4 * time + 2 * 23_000)]
    );
    assert_eq!((bus.traffic().frames, bus.traffic().errors), (2, 2));
    assert_eq!((bus.statistics(a).errors, bus.state(a)), (2, State::Active));
}

#[test]
fn a_station_whose_every_frame_is_spoilt_goes_off_and_comes_back_by_itself() {
    let (mut bus, [a, b]) = bus();
    bus.set_restart(Some(DurationNs::from_millis(100)));
    bus.disturb(Disturbance::all(Effect::Spoil).from(a));
    bus.send(T0, a, &frame(0x181, &[1])).unwrap();
    let one = duration(&frame(0x181, &[1])) + 23_000;
    let lines = run(&mut bus, us(150_000));
    assert_eq!(
        lines,
        [
            format!("{} 0 Warning", 12 * one),
            format!("{} 0 Passive", 16 * one),
            format!("{} 0 BusOff", 32 * one),
            format!("{} 0 Active", 32 * one + 100_000_000 + 1_408_000),
        ]
    );
    assert_eq!((bus.statistics(a).errors, bus.statistics(a).sent, bus.statistics(b).received), (32, 0, 0));
    bus.calm();
    bus.send(us(150_000), a, &frame(0x181, &[1])).unwrap();
    assert_eq!(received(&run(&mut bus, us(151_000))).len(), 1);
}

#[test]
fn nobody_acknowledges_to_a_station_that_is_alone() {
    let (mut bus, [a, b]) = bus();
    bus.disconnect(T0, b);
    let sync = frame(0x80, &[]);
    bus.send(T0, a, &sync).unwrap();
    let one = duration(&sync) + 23_000;
    // It goes on for as long as it takes, also across a jump in time.
    assert_eq!(
        run(&mut bus, us(3000)),
        [format!("{} 0 Warning", 12 * one), format!("{} 0 Passive", 16 * one)]
    );
    let hour = T0 + DurationNs::from_secs(3600);
    assert_eq!(bus.poll(hour), None);
    let errors = bus.traffic().errors;
    assert_eq!(errors, u64::try_from(3_600_000_000_000 / one).unwrap());
    assert_eq!(bus.send(hour, b, &sync), Err(SendError::Disconnected));
    bus.connect(hour, b);
    let lines = run(&mut bus, hour + DurationNs::from_millis(1));
    assert_eq!(received(&lines).len(), 1);
    // 128 less one is warning, and it takes 32 good frames to be active.
    assert!(lines.iter().any(|line| line.ends_with("0 Warning")), "{lines:?}");
}

#[test]
fn frames_get_lost_doubled_and_late_in_order() {
    let (mut bus, [a, b, c]) = bus();
    let frames = [frame(0x181, &[1]), frame(0x181, &[2]), frame(0x181, &[3])];
    bus.disturb(Disturbance::all(Effect::Lose).to(b).count(1));
    bus.disturb(Disturbance::all(Effect::Double).to(c).skip(2).count(1));
    bus.disturb(Disturbance::all(Effect::Delay(DurationNs::from_micros(500))).to(c).count(1));
    for frame in &frames {
        bus.send(T0, a, frame).unwrap();
    }
    let ends = [1, 2, 3].map(|n| frames[..n].iter().map(duration).sum::<i64>());
    let lines = run(&mut bus, us(2000));
    let late = ends[0] + 500_000;
    assert_eq!(
        received(&lines),
        [
            format!("{} 0->1 {}", ends[1], frames[1]),
            format!("{} 0->1 {}", ends[2], frames[2]),
            format!("{late} 0->2 {}", frames[0]),
            format!("{late} 0->2 {}", frames[1]),
            format!("{late} 0->2 {}", frames[2]),
            format!("{late} 0->2 {}", frames[2]),
        ]
    );
    assert_eq!((bus.statistics(b).lost, bus.statistics(b).received, bus.statistics(c).received), (1, 2, 4));
}

#[test]
fn a_station_that_is_unplugged_in_the_middle_of_a_frame_spoils_it() {
    let (mut bus, [a, b, c]) = bus();
    bus.send(T0, a, &frame(0x181, &[1; 8])).unwrap();
    bus.send(T0, a, &frame(0x181, &[2; 8])).unwrap();
    assert_eq!(bus.poll(us(10)), None);
    bus.disconnect(us(10), a);
    bus.send(us(10), b, &frame(0x182, &[3])).unwrap();
    let lines = run(&mut bus, us(1000));
    assert_eq!(received(&lines).len(), 1);
    assert_eq!((bus.statistics(c).received, bus.traffic().errors), (1, 1));
    bus.connect(us(1000), a);
    assert_eq!(run(&mut bus, us(2000)), Vec::<String>::new(), "what waited is lost");
}

#[test]
fn off_by_order_in_the_middle_of_a_frame() {
    let (mut bus, [a, b]) = bus();
    bus.send(T0, a, &frame(0x181, &[1; 8])).unwrap();
    assert_eq!(bus.poll(us(10)), None);
    bus.take_off(us(10), a);
    assert_eq!(run(&mut bus, us(500)), ["10000 0 BusOff"]);
    assert_eq!(bus.statistics(b).received, 0);
}

#[test]
fn the_load_is_what_the_bits_take() {
    let (mut bus, [a, _b]) = bus();
    let pdo = frame(0x181, &[0; 8]);
    assert_eq!(bus.take_load(T0), 0);
    bus.send(T0, a, &pdo).unwrap();
    run(&mut bus, us(1000));
    let time = duration(&pdo);
    assert_eq!(i64::from(bus.take_load(us(1000))), time / 1000);
    assert_eq!(bus.take_load(us(2000)), 0);
    // Half of a frame counts half.
    bus.send(us(2000), a, &pdo).unwrap();
    assert_eq!(bus.poll(us(2050)), None);
    assert_eq!(bus.take_load(us(2050)), 1000);
    assert!(time <= BitRate::MAX_CLASSIC.time(Shape::of(&pdo).most()).0);
}

#[test]
fn waiting_too_long_and_frames_of_fd_are_told() {
    let (mut bus, [a, b]) = bus();
    bus.set_patience(DurationNs::from_micros(100));
    bus.send(T0, a, &frame(0x181, &[0x55; 8])).unwrap();
    bus.send(T0, b, &frame(0x281, &[1])).unwrap();
    let fd = Frame::fd(Id::Standard(0x301), &[0; 12], true).unwrap();
    assert_eq!(bus.send(T0, b, &fd), Err(SendError::Fd));
    run(&mut bus, us(1000));
    let waited = duration(&frame(0x181, &[0x55; 8]));
    let violations = bus.violations().iter().map(Violation::to_string).collect::<Vec<_>>();
    assert_eq!(
        violations,
        [
            "0.001000000 s: station 1 sends 301 as an FD frame on a classic bus".to_owned(),
            format!(
                "{}: station 1 waited {} for the bus with 281, expected at most 100 us",
                T0 + DurationNs(waited),
                DurationNs(waited)
            ),
        ]
    );
    assert_eq!((bus.pardon(), bus.violations().len()), (2, 0));
}

#[test]
fn an_fd_bus_carries_both_kinds() {
    let rate = BitRate::fd(1_000_000, 5_000_000).unwrap();
    let mut bus = Bus::new(rate);
    let [a, b] = [(); 2].map(|()| bus.add(2).unwrap());
    let fd = Frame::fd(Id::Standard(0x181), &[0xA5; 64], true).unwrap();
    bus.send(T0, a, &fd).unwrap();
    bus.send(T0, b, &frame(0x80, &[])).unwrap();
    let sync = duration(&frame(0x80, &[]));
    let end = sync + rate.time(exact(&fd)).0;
    assert!(end < sync + 169_600, "{end}");
    assert_eq!(received(&run(&mut bus, us(1000))), [format!("{sync} 1->0 080#"), format!("{end} 0->1 {fd}")]);
}

#[test]
fn stations_and_disturbances_have_a_limit() {
    let mut bus = Bus::new(BitRate::MAX_CLASSIC);
    let added = (0..STATIONS_MAX + 1).filter(|_| bus.add(1).is_some()).count();
    assert_eq!(added, STATIONS_MAX);
    let disturbed = (0..DISTURBANCES_MAX + 1).filter(|_| bus.disturb(Disturbance::all(Effect::Lose))).count();
    assert_eq!(disturbed, DISTURBANCES_MAX);
}

/// A full bus: 127 nodes answer each SYNC, in the order of their identifiers, and the bus is never idle meanwhile.
#[test]
fn a_hundred_nodes_answer_a_sync_back_to_back() {
    let (mut bus, stations) = bus::<128>();
    bus.send(T0, stations[0], &frame(0x80, &[])).unwrap();
    let (mut order, mut last, mut sum) = (Vec::new(), T0, 0);
    while let Some(now) = bus.wake_at() {
        while let Some(output) = bus.poll(now) {
            match output {
                Output::Received { to, frame: got, .. } if got.id() == Id::Standard(0x80) => {
                    let id = 0x180 + u16::from(to.0);
                    bus.send(now, to, &frame(id, &[0; 6])).unwrap();
                }
                Output::Sent { at, frame, .. } => {
                    order.push(frame.id());
                    sum += duration(&frame);
                    last = at;
                }
                _ => {}
            }
        }
    }
    let expected = std::iter::once(0x80).chain(0x181..=0x1FF).map(Id::Standard);
    assert_eq!(order, expected.collect::<Vec<_>>());
    assert_eq!((last - T0).0, sum);
    bus.judge();
}
