//! The timing model of CIP Volume 9, chapter 2, against the real engine: controllers of one, two and three cycles, and device update
//! periods (cycles of the bus) that are a part of the controller's, a multiple of it, and neither.

use axisbridge::engine::notice::Notice;
use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::network::Knobs;
use profile_cip::controller::{AttributeSet, Failure, Limits, Step, TimingModel};
use profile_cip::wire::motion::codes::{NodeAlarm, NodeFault};
use profile_generic::cast::f64_from_i64;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::chain::{Bus, Chain};
use crate::probe::{COUNT, Commanded, Probe, Reported};
use crate::scenario::AXIS;

/// Two revolutions in a second, after an acceleration that is never constant.
const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 20.0, jerk: 100.0 };

/// Class attributes: Controller Update Delay High Limit and Low Limit.
const HIGH_LIMIT: u16 = 21;
const LOW_LIMIT: u16 = 22;

/// What was seen of a motion of the axis.
struct Seen {
    rig: Rig,
    probe: Probe,
    period: DurationNs,
    cycle: DurationNs,
    /// By how much an update comes later than the first set-point that is made of it: the drive takes set-points a cycle behind the
    /// frame, which is built a tenth of a cycle ahead.
    overdue: DurationNs,
}

/// Enables the axis and moves it.
fn run(bus: Bus, cycle: DurationNs, period: DurationNs, model: TimingModel, latency: DurationNs) -> Seen {
    let mut rig = bus.ready(cycle, period, "");
    rig.knobs = Knobs { latency, ..Knobs::GOOD };
    let overdue = model.phase(period) + latency + cycle + DurationNs(cycle.0 / 10) - period;
    if overdue > DurationNs::ZERO {
        // Its curve is that of updates that come in time.
        rig.motion_checker.record();
    }
    let mut config = Chain { bus, synchronous: true }.controller(&rig);
    config.rpi_us = u32::try_from(period.as_nanos() / 1_000).expect("some milliseconds");
    config.timing = model;
    let step = Step::MoveAbsolute { axis: 1, position: 2.0, limits: LIMITS };
    rig.connect_with(config, vec![Step::Enable(AXIS), step]);
    let mut probe = Probe::new(&mut rig, bus, cycle);
    while rig.report().steps_finished < 2 {
        assert!(rig.report().failure.is_none(), "{:?}", rig.report().failure);
        probe.run_for(&mut rig, DurationNs::from_millis(20));
    }
    Seen { rig, probe, period, cycle, overdue }
}

impl Seen {
    /// Every set-point of the motion is on the curve of the controller at the instant at which the drive takes it. One that had to be
    /// made before its update came goes on evenly from the update before.
    fn set_points_are_on_the_curve(&self) -> usize {
        let start = self.first_motion().stamp;
        let mut count = 0;
        let seconds = f64_from_i64(self.overdue.0.max(0)) / 1e9;
        // A count of each side.
        let allowed = COUNT + self.probe.count() + LIMITS.acceleration * 1e9 * seconds * seconds / 2.0;
        for taken in &self.probe.taken {
            let Some(expected) = self.probe.curve_at(taken.at, self.period).filter(|_| taken.at > start)
            else {
                continue;
            };
            let off = (taken.position - expected).abs();
            assert!(off <= allowed, "{}: {} instead of {expected}", taken.at.since(start), taken.position);
            count += 1;
        }
        count
    }

    /// The first update that commands another position than the one before.
    fn first_motion(&self) -> Commanded {
        let commanded = self.probe.commanded();
        let running = self.first_running().sent;
        let rows = commanded.windows(2).filter(|pair| pair[1].sent > running);
        rows.map(|pair| (pair[0], pair[1])).find(|(a, b)| a.position != b.position).expect("a motion").1
    }

    /// The first update of the gateway that says that the axis is Running.
    fn first_running(&self) -> Reported {
        *self.probe.reported().iter().find(|row| row.running).expect("a running axis")
    }

    /// The update cycle of the controller that begins at `at` or later: how much later.
    fn before_cycle(&self, at: MonotonicTime) -> DurationNs {
        let start = self.first_motion().stamp;
        DurationNs((start.since(at).0).rem_euclid(self.period.0))
    }

    /// Each update of the gateway leaves before the start of its cycle, by no more than a cycle of the bus and what is built ahead,
    /// carries the Update ID of the controller's update for that cycle, and leaves no cycle out.
    fn updates_begin_the_cycles_of_the_controller(&self) -> usize {
        let commanded = self.probe.commanded();
        let reported: Vec<_> = self.probe.reported().into_iter().filter(|row| row.synchronous).collect();
        let longest = self.cycle + DurationNs(self.cycle.0 / 10) + DurationNs::from_micros(150);
        for row in &reported {
            let early = self.before_cycle(row.sent);
            assert!(early <= longest, "{early} before its cycle, {longest} at most");
            let cycle = row.sent + early;
            if let Some(answer) = commanded.iter().find(|command| command.stamp == cycle) {
                assert_eq!(row.id, answer.id, "the IDs of a cycle match");
            }
            let stamp = row.stamp.expect("a time stamp");
            assert!(
                stamp <= row.sent && row.sent.since(stamp) <= self.cycle * 2,
                "{}",
                row.sent.since(stamp)
            );
        }
        assert!(reported.windows(2).all(|pair| pair[1].id == pair[0].id.wrapping_add(1)));
        reported.len()
    }
}

/// From the update of the gateway at the start of a cycle to the update of the controller that it leads to: within the same cycle,
/// the next one, and the one behind that. Set-points reach the drive at the instants for which they are made in all three.
#[test]
fn controllers_of_one_two_and_three_cycles() {
    let period = DurationNs::from_millis(6);
    // The model, the cycles, and the time that updates may need on the network: a third of the period, a half, the whole.
    let rows = [
        (TimingModel::OneCycle, 1, 1_500),
        (TimingModel::TwoCycle, 2, 700),
        (TimingModel::ThreeCycle, 3, 3_500),
    ];
    for bus in [Bus::Sercos, Bus::Canopen] {
        for (model, cycles, latency) in rows {
            let (cycle, latency) = (DurationNs::from_millis(2), DurationNs::from_micros(latency));
            let seen = run(bus, cycle, period, model, latency);
            assert!(seen.overdue <= DurationNs::ZERO, "{model:?}: {}", seen.overdue);
            assert!(seen.set_points_are_on_the_curve() > 500, "{bus} {model:?}");
            assert!(seen.updates_begin_the_cycles_of_the_controller() > 150, "{bus} {model:?}");
            let (running, motion) = (seen.first_running(), seen.first_motion());
            let begun = running.sent + seen.before_cycle(running.sent);
            let arrived = motion.sent + latency;
            let took = arrived.since(begun).magnitude().div_ceil(period.magnitude());
            assert_eq!(
                took,
                cycles,
                "{bus} {model:?}: {} after {}",
                arrived.since(begun),
                motion.stamp.since(begun)
            );
            assert_eq!(motion.sent.since(motion.stamp), model.phase(period), "{bus} {model:?}");
            let report = seen.rig.report();
            assert_eq!((report.lost_updates, report.late_updates), (0, 0), "{bus} {model:?}");
        }
    }
}

/// Clause 2-1.5: the cycle of the bus need not fit the update period of the controller.
#[test]
fn device_update_periods_that_fit_the_controllers_and_some_that_do_not() {
    let rows = [
        (Bus::Sercos, 4_000, 2_000, "a half"),
        (Bus::Sercos, 4_000, 4_000, "the same"),
        (Bus::Sercos, 4_000, 8_000, "twice as long"),
        (Bus::Sercos, 4_000, 1_750, "neither"),
        (Bus::Sercos, 5_000, 7_250, "neither, longer"),
        (Bus::Canopen, 4_000, 2_000, "a half"),
        (Bus::Canopen, 4_000, 8_000, "twice as long"),
        (Bus::Canopen, 7_000, 3_000, "neither"),
    ];
    for (bus, period, cycle, name) in rows {
        println!("{bus}: {name}");
        let (period, cycle) = (DurationNs::from_micros(period), DurationNs::from_micros(cycle));
        for model in [TimingModel::OneCycle, TimingModel::ThreeCycle] {
            let seen = run(bus, cycle, period, model, DurationNs::from_micros(100));
            assert!(seen.set_points_are_on_the_curve() > 150, "{bus}: {name}");
            assert!(seen.updates_begin_the_cycles_of_the_controller() > 150, "{bus}: {name}");
        }
    }
}

/// Clause 2-1.6: however long an update is on its way, as long as it comes before it is needed, no set-point changes.
#[test]
fn set_points_do_not_depend_on_the_latency_of_the_network() {
    let (period, cycle) = (DurationNs::from_millis(6), DurationNs::from_millis(2));
    for tenths in [0, 3, 6, 9] {
        let latency = DurationNs(period.as_nanos() * tenths / 10);
        let seen = run(Bus::Sercos, cycle, period, TimingModel::ThreeCycle, latency);
        assert!(seen.set_points_are_on_the_curve() > 500, "{latency}");
    }
}

/// Runs the axis at constant velocity, loses so many updates in a row, and goes on for a while. `direction` loses them. Returns how many
/// the controller misses of it.
fn lose(
    bus: Bus,
    (cycle, period): (i64, i64),
    model: TimingModel,
    (high_limit, count): (u8, u32),
    direction: fn(&mut Rig, Box<dyn FnMut() -> bool>),
) -> (Rig, u64) {
    let (cycle, period) = (DurationNs::from_millis(cycle), DurationNs::from_millis(period));
    let mut rig = bus.ready(cycle, period, "");
    // Whatever goes on evenly is wrong by some of the acceleration where the ratio is one.
    rig.motion_checker.record();
    let mut config = Chain { bus, synchronous: true }.controller(&rig);
    config.rpi_us = u32::try_from(period.as_nanos() / 1_000).expect("some milliseconds");
    config.timing = model;
    config.update_delay_high_limit = Some(high_limit);
    let limits = [(HIGH_LIMIT, high_limit), (LOW_LIMIT, 2)].map(|(id, value)| AttributeSet::usint(id, value));
    config.class_attributes.extend(limits);
    let step = Step::MoveAbsolute { axis: 1, position: 20.0, limits: LIMITS };
    rig.connect_with(config, vec![Step::Enable(AXIS), step]);
    rig.run_until(DurationNs::from_millis(8_000), "the axis enabled", |rig| rig.report().steps_finished == 1);
    rig.run_for(DurationNs::from_millis(700));
    let before = rig.report().lost_updates;
    let mut left = count;
    direction(
        &mut rig,
        Box::new(move || {
            let lost = left > 0;
            left = left.saturating_sub(1);
            !lost
        }),
    );
    rig.run_for(period * 30);
    let lost = rig.report().lost_updates - before;
    (rig, lost)
}

/// Both sides ride through as many missed updates as the high limit says, and not through one more. The device counts them in class
/// attributes 32 and 33, which the controller gets as Update Diagnostics.
#[test]
fn as_many_missed_updates_as_the_high_limit_says_are_ridden_through() {
    let ratios = [(2, 2), (2, 4), (2, 8)];
    let models = [TimingModel::OneCycle, TimingModel::TwoCycle, TimingModel::ThreeCycle];
    let rows = ratios.into_iter().flat_map(|ratio| models.map(|model| (Bus::Sercos, ratio, model, 4)));
    // As high as it can be set, and lower than the default.
    let rows = rows.chain([10, 3].map(|limit| (Bus::Sercos, (2, 4), TimingModel::ThreeCycle, limit)));
    for (bus, periods, model, limit) in rows {
        let name = format!("{bus} {periods:?} {model:?}, limit {limit}");
        let at_limit = u32::from(limit);
        for (count, fault) in [(at_limit, false), (at_limit + 1, true)] {
            let (rig, _) = lose(bus, periods, model, (limit, count), |rig, mut keep| {
                rig.tamper_command = Some(Box::new(move |_| keep()));
            });
            // The controller closes the connection of a device at fault, and that ends the fault.
            let node = rig.notices.iter().filter_map(|notice| match notice {
                Notice::Node { fault, alarm, .. } => Some((*fault, *alarm)),
                _ => None,
            });
            let node: Vec<_> = node.collect();
            let faults = rig.notices.iter().filter(|notice| matches!(notice, Notice::Fault { .. })).count();
            let faulted = node.iter().any(|(found, _)| *found == NodeFault::CONNECTION_UPDATE);
            assert_eq!((faulted, faults > 0), (fault, fault), "{name}: {count} lost\n{}", rig.told());
            let alarmed = node.iter().any(|(_, alarm)| *alarm == NodeAlarm::CONNECTION_UPDATE);
            assert!(alarmed, "{name}: {count} lost: the low limit of two is an alarm\n{}", rig.told());
            let lost = rig.engine.devices()[0].device().counters().lost_updates;
            assert!(lost == u64::from(count) || fault, "{name}: {lost} of {count} counted");
        }
        for (count, goes_on) in [(at_limit, true), (at_limit + 1, false)] {
            let (rig, lost) = lose(bus, periods, model, (limit, count), |rig, mut keep| {
                rig.tamper_actual = Some(Box::new(move |_| keep()));
            });
            let report = rig.report();
            let missing = Failure::UpdatesMissing { missing: at_limit + 1, limit };
            assert_eq!(report.failure, (!goes_on).then_some(missing), "{name}: {count} lost");
            if goes_on {
                assert_eq!(lost, u64::from(count), "{name}");
            }
        }
    }
}
