use std::fmt::Write as _;

use super::*;
use proptest::prelude::*;

const MS: DurationNs = DurationNs::from_millis(1);

fn ms(count: i64) -> DurationNs {
    DurationNs::from_millis(count)
}

/// A drive that is as simple as can be: it brakes by `brake` each millisecond, and coasts by `drag`.
#[derive(Debug, Clone, Copy)]
struct Axis {
    velocity: i64,
    command: i64,
    order: Option<Order>,
    on_for: i64,
    brake: i64,
    drag: i64,
}

impl Axis {
    fn moving(velocity: i64) -> Self {
        Self {
            velocity,
            command: velocity,
            order: Some(Order::Enable),
            on_for: 100,
            brake: 100_000_000,
            drag: 20_000_000,
        }
    }

    fn torque(&self) -> bool {
        match self.order {
            Some(Order::Enable | Order::Halt | Order::Ramp) => true,
            Some(Order::Disable) => self.velocity != 0,
            _ => false,
        }
    }

    fn step(&mut self) {
        self.on_for = if self.torque() { self.on_for + 1 } else { 0 };
        let slow = |velocity: i64, by: i64| velocity - velocity.signum() * by.min(velocity.abs());
        self.velocity = match self.order {
            Some(Order::Enable | Order::Ramp) => self.command,
            Some(Order::Disable | Order::Halt) => slow(self.velocity, self.brake),
            _ => slow(self.velocity, self.drag),
        };
    }

    fn sensed(&self) -> Sensed {
        Sensed {
            torque: self.torque(),
            // Three milliseconds to build up torque.
            follows: matches!(self.order, Some(Order::Enable | Order::Ramp)) && self.on_for >= 3,
            halted: self.order == Some(Order::Halt) && self.velocity == 0,
            velocity: Some(Velocity(self.velocity)),
        }
    }
}

/// What happens after a start or a stop, one line for each change, until nothing changes any more.
fn timeline(mut axis: Axis, times: &SequenceTimes, stop: Option<StopPlan>) -> String {
    let mut sequencer = Sequencer::default();
    let mut now = MonotonicTime(0);
    let mut ramp = None;
    let mut out = String::new();
    let begin = match stop {
        None => Some(sequencer.start(now)),
        Some(plan) => {
            sequencer.start(now);
            while !sequencer.is_running() {
                sequencer.poll(now, &axis.sensed(), times);
                now = now + MS;
            }
            now = MonotonicTime(0);
            sequencer.stop(now, plan, &axis.sensed(), times)
        }
    };
    let mut order = begin;
    let mut last = None;
    while now < MonotonicTime(0) + ms(3_000) {
        if let Some(order) = order {
            axis.order = Some(order);
            if order == Order::Ramp {
                ramp = StopRamp::new(now, Position(0), Velocity(axis.velocity), Acceleration(10_000_000_000));
            }
        }
        if let Some(ramp) = ramp {
            axis.command = ramp.at(now).1.get();
        }
        axis.step();
        let shown = (sequencer.step(), axis.torque());
        if last != Some(shown) || order.is_some() {
            let told = order.map_or("", Order::name);
            let torque = if axis.torque() { "torque" } else { "" };
            let line = format!(
                "{:>5} ms  {:<14}{told:<12}{torque:<8}{}",
                now.0 / 1_000_000,
                sequencer.step().name(),
                axis.velocity / 1_000_000
            );
            writeln!(out, "{}", line.trim_end()).unwrap();
            last = Some(shown);
        }
        now = now + MS;
        order = sequencer.poll(now, &axis.sensed(), times);
    }
    out
}

#[test]
fn every_way_to_start_and_stop() {
    let plain =
        SequenceTimes { stopping_limit: ms(1_000), coasting_limit: ms(2_000), ..SequenceTimes::default() };
    let brake = SequenceTimes { brake_release_delay: ms(50), brake_engage_delay: ms(80), ..plain };
    let mut out = String::new();
    for (name, times) in [("no brake", plain), ("brake", brake)] {
        let rest = Axis { order: None, on_for: 0, ..Axis::moving(0) };
        writeln!(out, "== start, {name}\n{}", timeline(rest, &times, None)).unwrap();
        for (moves, velocity) in [("standing", 0), ("moving", 2_000_000_000)] {
            for method in StopMethod::ALL {
                for hold in [false, true] {
                    if hold && *method == StopMethod::Coast {
                        continue;
                    }
                    let plan = StopPlan { method: *method, hold };
                    let then = if hold { "hold" } else { "off" };
                    writeln!(out, "== {}, {then}, {moves}, {name}", method.name()).unwrap();
                    writeln!(out, "{}", timeline(Axis::moving(velocity), &times, Some(plan))).unwrap();
                }
            }
        }
    }
    insta::assert_snapshot!(out);
}

#[test]
fn what_does_not_come_to_rest_in_time_loses_its_torque() {
    let times = SequenceTimes {
        stopping_limit: ms(100),
        coasting_limit: ms(200),
        brake_engage_delay: ms(50),
        ..SequenceTimes::default()
    };
    for method in [StopMethod::Decelerate, StopMethod::Ramp] {
        for hold in [false, true] {
            let mut sequencer = Sequencer::default();
            let pulled = Sensed {
                torque: true,
                follows: true,
                halted: false,
                velocity: Some(Velocity(1_000_000_000)),
            };
            sequencer.start(MonotonicTime(0));
            sequencer.poll(MonotonicTime(0), &pulled, &times);
            sequencer.poll(MonotonicTime(0), &pulled, &times);
            assert!(sequencer.is_running());
            let plan = StopPlan { method, hold };
            assert!(sequencer.stop(MonotonicTime(0), plan, &pulled, &times).is_some());
            let mut told = Vec::new();
            for milli in 1..=200 {
                let now = MonotonicTime(0) + ms(milli);
                told.extend(sequencer.poll(now, &pulled, &times).map(|order| (milli, order)));
                assert_eq!(sequencer.is_stopped(), milli >= 200, "{method:?} {milli}");
            }
            assert_eq!(told, [(100, Order::TimeOut)], "{method:?} {hold}");
        }
    }
}

#[test]
fn zero_speed_has_to_last() {
    let times =
        SequenceTimes { zero_speed: Velocity(10), zero_speed_time: ms(20), ..SequenceTimes::default() };
    let mut sequencer = Sequencer::default();
    let sensed = |velocity| Sensed { torque: true, follows: true, halted: false, velocity };
    sequencer.start(MonotonicTime(0));
    sequencer.poll(MonotonicTime(0), &sensed(Some(Velocity(500))), &times);
    sequencer.poll(MonotonicTime(0), &sensed(Some(Velocity(500))), &times);
    let plan = StopPlan { method: StopMethod::Ramp, hold: false };
    sequencer.stop(MonotonicTime(0), plan, &sensed(Some(Velocity(500))), &times);
    let mut poll = |milli, velocity| sequencer.poll(MonotonicTime(0) + ms(milli), &sensed(velocity), &times);
    assert_eq!(poll(1, Some(Velocity(-10))), None);
    assert_eq!(poll(15, Some(Velocity(11))), None, "it moves again: the time counts anew");
    assert_eq!(poll(16, Some(Velocity(0))), None);
    assert_eq!(poll(35, None), None, "what cannot be seen does not rest");
    assert_eq!(poll(36, Some(Velocity(0))), None);
    assert_eq!(poll(56, Some(Velocity(0))), Some(Order::Disable));
}

#[test]
fn nothing_starts_by_time_and_a_stop_without_a_start_is_none() {
    let times = SequenceTimes::default();
    let mut sequencer = Sequencer::default();
    let sensed = Sensed { torque: true, follows: true, halted: true, velocity: Some(Velocity(0)) };
    assert_eq!(sequencer.stop(MonotonicTime(5), StopPlan::default(), &sensed, &times), None);
    for second in 0..100 {
        assert_eq!(sequencer.poll(MonotonicTime(0) + DurationNs::from_secs(second), &sensed, &times), None);
        assert_eq!(sequencer.step(), SequenceStep::Off);
    }
}

proptest! {
    /// Speed never rises, never turns round, never changes by more than the deceleration allows, and ends at zero.
    #[test]
    fn a_ramp_only_slows_down(
        velocity in -100_000_000_000_i64..100_000_000_000, deceleration in 1_000_000_000_i64..1_000_000_000_000,
    ) {
        let begun = MonotonicTime(77);
        let ramp = StopRamp::new(begun, Position(5), Velocity(velocity), Acceleration(deceleration)).unwrap();
        prop_assert_eq!(ramp.at(begun), (Position(5), Velocity(velocity)));
        let (mut last_position, mut last_velocity) = (5, velocity);
        let mut now = begun;
        for _ in 0..200 {
            now = now + DurationNs::from_millis(1);
            let (position, speed) = ramp.at(now);
            let (position, speed) = (position.get(), speed.get());
            prop_assert!(speed.abs() <= last_velocity.abs() && speed.signum() * velocity.signum() >= 0);
            prop_assert!((speed - last_velocity).abs() <= deceleration / 1_000 + 1);
            let way = (position - last_position).abs();
            prop_assert!(way <= last_velocity.abs() / 1_000 + 1 && way >= speed.abs() / 1_000 - 1);
            (last_position, last_velocity) = (position, speed);
        }
        let end = begun + DurationNs::from_secs(200);
        prop_assert_eq!(ramp.at(end).1, Velocity(0));
        prop_assert_eq!(ramp.at(end), ramp.at(end + DurationNs::from_secs(1)));
    }
}
