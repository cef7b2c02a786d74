//! Lost and late updates, asynchronous and synchronous production.

use super::*;
use crate::device::attribute::id;
use crate::device::axis::drive_link::{DriveAction, Withheld};
use crate::device::axis::state::AxisState;
use crate::device::motion_link::SyncQuality;
use crate::wire::motion::UpdateDiagnostics;
use crate::wire::motion::codes::{NodeAlarm, NodeFault, NodeStatus};

/// A running rig in synchronous operation.
fn synchronous() -> Rig {
    let mut rig = Rig::running();
    rig.time = TimeDataSet::TIME_STAMP | TimeDataSet::UPDATE_DIAGNOSTICS;
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.cycles(4);
    assert!(rig.device.is_synchronous());
    rig
}

#[test]
fn lost_updates_are_counted_and_ridden_through_up_to_the_limit() {
    let mut rig = Rig::running();
    rig.time = TimeDataSet::UPDATE_DIAGNOSTICS;
    let position = rig.follow(0).values.position;
    for age in 0..4 {
        assert_eq!(rig.follow(0).age_updates, age);
        rig.silence();
    }
    assert_eq!(rig.device.node_alarm(), NodeAlarm::CONNECTION_UPDATE, "beyond the low limit of 2");
    assert_eq!((rig.state(0), rig.follow(0).values.position), (AxisState::Running, position));
    rig.update_id += 4;
    rig.cycle();
    assert_eq!(rig.device.counters().lost_updates, 4);
    assert_eq!(rig.device.node_alarm(), NodeAlarm::NONE, "a fresh update ends the alarm");
    let diagnostics = rig.header().update_diagnostics;
    assert_eq!(diagnostics, Some(UpdateDiagnostics { lost_updates: 4, late_updates: 0 }));
    rig.cycles(2);
    assert_eq!(rig.header().update_diagnostics, None, "only when changed");
    assert_eq!(rig.state(0), AxisState::Running);
}

#[test]
fn beyond_the_high_limit_the_axes_stop_until_another_connection() {
    let mut rig = Rig::running();
    rig.cycle();
    for _ in 0..5 {
        assert_eq!(rig.withheld(0), None);
        rig.silence();
    }
    // The fifth update is overdue: the command is withheld even before anybody polls.
    assert_eq!(rig.withheld(0), Some(Withheld::Stale));
    rig.run_device();
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Aborting, DriveAction::Abort));
    assert!(rig.header().node_status.contains(NodeStatus::FAULT));
    // Updates come again, the controller resets everything: it stays.
    rig.control |= NodeControl::FAULT_RESET;
    rig.request_all(AxisControl::FAULT_RESET);
    rig.cycles(5);
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(5);
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    assert_eq!(rig.actual(0).response_status, 0x0C);
    rig.control -= NodeControl::FAULT_RESET;
    rig.close();
    rig.request_all(AxisControl::NONE);
    rig.packet.clear();
    rig.open();
    rig.cycles(4);
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn a_jump_over_the_limit_is_a_fault_although_updates_come() {
    let mut rig = Rig::running();
    rig.update_id += 5;
    rig.cycle();
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!(rig.withheld(0), Some(Withheld::NodeFault));
}

#[test]
fn asynchronous_updates_follow_the_controller_and_then_the_timer() {
    let mut rig = Rig::running();
    let packet = rig.command_packet();
    rig.send(&packet);
    assert!(rig.run_device(), "at once");
    assert_eq!(rig.header().update_id, rig.update_id);
    assert!(!rig.run_device(), "and once");
    // The next one is lost: the device goes on a period later with the next ID.
    rig.now += PERIOD - 1;
    assert!(!rig.run_device());
    rig.now += 1;
    assert!(rig.run_device());
    assert_eq!(rig.header().update_id, rig.update_id.wrapping_add(1));
    assert_eq!(rig.header().last_received_id, rig.update_id);
    // It comes half a period late: the ID was sent, so nothing is sent twice; the schedule follows the controller.
    rig.now += PERIOD / 2;
    let packet = rig.command_packet();
    rig.send(&packet);
    assert!(!rig.run_device());
    rig.now += PERIOD;
    let packet = rig.command_packet();
    rig.send(&packet);
    assert!(rig.run_device());
    assert_eq!(rig.header().update_id, rig.update_id);
}

#[test]
fn the_first_synchronous_update_is_two_periods_after_the_time_stamp() {
    let mut rig = Rig::running();
    rig.time = TimeDataSet::TIME_STAMP;
    rig.control |= NodeControl::SYNC_CONTROL;
    // The update arrives two thirds into its cycle, stamped with the start of the cycle.
    let start = rig.now;
    let mut header = {
        rig.command_packet();
        rig.command_header()
    };
    header.time_stamp = Some(EPOCH + start);
    let asked = rig.update_id;
    rig.now = start + 2 * PERIOD / 3;
    let packet = rig.packet_with(&header);
    rig.send(&packet);
    assert!(rig.run_device(), "still answered at once");
    assert!(!rig.header().node_status.contains(NodeStatus::SYNC_MODE));
    rig.now = start + 5 * PERIOD / 3;
    let mut header = {
        rig.command_packet();
        rig.command_header()
    };
    header.time_stamp = Some(EPOCH + start + PERIOD);
    let packet = rig.packet_with(&header);
    rig.send(&packet);
    assert!(rig.run_device(), "and the next one too");
    let first = start + 2 * PERIOD - 100_000;
    assert_eq!(rig.device.wake_at(), Some(MonotonicTime(first)));
    rig.now = first - 1;
    assert!(!rig.run_device());
    rig.now = first;
    assert!(rig.run_device());
    let header = rig.header();
    assert_eq!(header.update_id, asked.wrapping_add(2), "the ID of the cycle that starts");
    assert!(header.node_status.contains(NodeStatus::SYNC_MODE));
    assert_eq!(header.time_stamp, Some(EPOCH + first));
    // From here one update per period, whether or not the controller's comes.
    for cycle in 1..4 {
        rig.now = first + cycle * PERIOD - 1;
        assert!(!rig.run_device());
        rig.now += 1;
        assert!(rig.run_device());
        let ahead = u8::try_from(2 + cycle).expect("small");
        assert_eq!(rig.header().update_id, asked.wrapping_add(ahead));
    }
}

#[test]
fn synchronous_production_stays_aligned_with_the_controllers_cycle() {
    let mut rig = synchronous();
    // The controller's clock as seen here runs 10 us per period slow: cycles start later and later.
    for _ in 0..50 {
        rig.now += 10_000;
        let packet = rig.command_packet();
        rig.send(&packet);
        let until = rig.now + PERIOD;
        while rig.now < until {
            let wake = rig.device.wake_at().expect("connected").0.clamp(rig.now, until);
            rig.now = wake;
            let sent = rig.run_device();
            if !sent {
                rig.now = until;
            }
        }
        rig.now = until;
    }
    let wake = rig.device.wake_at().expect("connected").0;
    let phase = (wake + 100_000).abs_diff(rig.now) % PERIOD;
    assert!(phase <= 20_000 || phase >= PERIOD - 20_000, "phase {phase}");
    assert_eq!(rig.device.counters().late_updates, 0);
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
}

/// A device that is asked once in a bus cycle, at instants that are never exact: one update goes each time, in step with
/// the controller's cycles wherever in the bus cycle these begin, and none is later than the start of its cycle, which is the
/// one constraint that clause 2-1.3 sets, nor earlier than a bus cycle and the processing time before it.
#[test]
fn an_update_goes_with_the_last_call_that_is_not_too_late() {
    const CALL: u64 = 1_000_000;
    for phase in [0, 60_000, 100_000, 140_000, 250_000, 499_000, 501_000, 750_000, 860_000, 999_000_u64] {
        let mut rig = Rig::running();
        rig.control |= NodeControl::SYNC_CONTROL;
        rig.time = TimeDataSet::TIME_STAMP | TimeDataSet::UPDATE_DIAGNOSTICS;
        let start = rig.now;
        let mut sent = Vec::new();
        for call in 0..200_u64 {
            // Up to 40 us late, in no order.
            let jitter = (call * 7919) % 41_000;
            rig.now = start + call * CALL + jitter;
            if call.is_multiple_of(PERIOD / CALL) {
                rig.command_packet();
                let mut header = rig.command_header();
                header.time_stamp = Some(EPOCH + start + call * CALL - phase);
                let packet = rig.packet_with(&header);
                rig.send(&packet);
            }
            rig.device.expect_poll(MonotonicTime(start + (call + 1) * CALL));
            if rig.run_device() && rig.header().node_status.contains(NodeStatus::SYNC_MODE) {
                // The cycle that this update begins.
                let early = PERIOD - (rig.now + phase - start) % PERIOD;
                sent.push((call, early % PERIOD));
            }
        }
        assert!(rig.device.is_synchronous());
        let steady = &sent[10..];
        assert!(steady.windows(2).all(|pair| pair[1].0 - pair[0].0 == PERIOD / CALL), "{phase}: {steady:?}");
        let in_window = |early: &u64| (1..=CALL + 150_000).contains(early);
        assert!(steady.iter().all(|(_, early)| in_window(early)), "{phase}: {steady:?}");
    }
}

/// Figure 2-1.6: updates of 1 ms, a Drive Task every 187.5 us. The update goes with the last task before the start of the cycle, and
/// its stamp is 0, 62.5, 125, 0, ... us before it: the figure shows the first two.
#[test]
fn the_actual_update_window_is_that_of_figure_2_1_6() {
    const CUP: u64 = 1_000_000;
    const TASK: u64 = 187_500;
    let mut rig = Rig::processing(0, definitions());
    rig.period = CUP;
    let mut rig = rig.connected();
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::TIME_STAMP;
    let start = rig.now;
    let mut sent = Vec::new();
    let mut commanded = 0;
    for task in 0..130_u64 {
        let now = start + task * TASK;
        rig.now = now;
        while start + commanded * CUP <= now {
            rig.command_packet();
            let mut header = rig.command_header();
            header.time_stamp = Some(EPOCH + start + commanded * CUP);
            let packet = rig.packet_with(&header);
            rig.send(&packet);
            commanded += 1;
        }
        for drive in &mut rig.drives {
            drive.image.captured_at = EPOCH + now;
        }
        rig.device.expect_poll(MonotonicTime(start + (task + 1) * TASK));
        if rig.run_device() && rig.device.is_synchronous() {
            let stamp = rig.header().time_stamp.expect("asked for") - EPOCH - start;
            assert_eq!(stamp, task * TASK, "the actual values of this very task");
            sent.push((stamp.div_ceil(CUP), stamp.next_multiple_of(CUP) - stamp));
        }
    }
    let (cycles, early): (Vec<u64>, Vec<u64>) = sent.into_iter().unzip();
    assert!(cycles.len() > 15 && cycles.windows(2).all(|pair| pair[1] == pair[0] + 1), "{cycles:?}");
    let expected = cycles.iter().map(|cycle| cycle * CUP % TASK);
    assert_eq!(early, expected.collect::<Vec<_>>());
    assert_eq!(
        early[cycles.iter().position(|cycle| cycle % 3 == 0).expect("one")..][..4],
        [0, 62_500, 125_000, 0]
    );
}

/// A device that was not asked for some cycles: the next update has the ID of its own cycle, and the one behind it is on the grid.
#[test]
fn cycles_without_an_update_keep_their_ids() {
    for periods in [1, 2, 5, 260] {
        let mut rig = synchronous();
        let send = |rig: &mut Rig| {
            rig.now = rig.device.wake_at().expect("connected").0;
            assert!(rig.run_device());
            (rig.now, rig.header().update_id)
        };
        let (before, id) = send(&mut rig);
        // The controller goes on, and so does its connection; its cycles begin behind the processing time.
        for _ in 0..periods {
            rig.now += PERIOD;
            send_aged(&mut rig, -100_000);
        }
        rig.now = before + periods * PERIOD + PERIOD / 2;
        assert!(rig.run_device());
        let expected = id.wrapping_add(u8::try_from(periods % 256).expect("small"));
        assert_eq!(rig.header().update_id, expected, "{periods}");
        let (next, _) = send(&mut rig);
        assert_eq!(next, before + (periods + 1) * PERIOD, "{periods}");
        assert_eq!(rig.header().update_id, expected.wrapping_add(1));
    }
}

/// An update that came in time and was looked at late is not late: class attribute 33 goes by the Data Received Time Stamp, which
/// Time Diagnostics have as well.
#[test]
fn an_update_is_as_old_as_it_was_when_it_came() {
    for (waited, late, applied) in
        [(0, 0, true), (PERIOD / 2, 0, true), (3 * PERIOD, 0, true), (6 * PERIOD, 0, true)]
    {
        let mut rig = synchronous();
        rig.time |= TimeDataSet::TIME_DIAGNOSTICS;
        let counted = rig.device.counters().applied;
        let stamp = EPOCH + rig.now;
        rig.command_packet();
        let mut header = rig.command_header();
        header.time_stamp = Some(stamp);
        let packet = rig.packet_with(&header);
        let arrival = rig.now + PERIOD / 3;
        rig.now = arrival + waited;
        let (now, system) = (rig.now(), rig.system());
        rig.device.handle_io_arrived(now, MonotonicTime(arrival), system, &packet);
        let seen = (rig.device.counters().late_updates, rig.device.counters().applied - counted);
        assert_eq!(seen, (late, u64::from(applied)), "{waited}");
        assert!(rig.run_device());
        let diagnostics = rig.header().time_diagnostics.expect("asked for");
        assert_eq!(diagnostics.received_at, EPOCH + arrival);
    }
}

/// Sends an update whose time stamp is `age` ns old; negative is ahead.
fn send_aged(rig: &mut Rig, age: i64) {
    rig.command_packet();
    let mut header = rig.command_header();
    header.time_stamp = Some((EPOCH + rig.now).saturating_add_signed(-age));
    let packet = rig.packet_with(&header);
    rig.send(&packet);
}

/// Sends the next update so late that it is `age` ns old when it comes.
fn send_late(rig: &mut Rig, age: i64) {
    let stamped = rig.now;
    rig.now = rig.now.saturating_add_signed(age);
    send_aged(rig, i64::try_from(rig.now - stamped).expect("fits"));
}

/// Lets the controller's clock run ahead, up to `ahead` ns in the last update.
fn send_ahead(rig: &mut Rig, ahead: i64) {
    let step = i64::try_from(PERIOD).expect("fits") * 2 / 5;
    let mut reached = 0;
    while ahead - reached > step {
        reached += step;
        send_aged(rig, -reached);
        rig.run_device();
        rig.now += PERIOD;
    }
    send_aged(rig, -ahead);
}

/// Updates whose stamps run backwards, or jump, while their IDs and arrivals go on evenly: a clock was set, and the offsets do
/// not say so. None of them is a command, and after the update delay high limit the connection is at fault.
#[test]
fn a_time_stamp_that_does_not_follow_from_the_one_before_commands_nothing() {
    let period = i64::try_from(PERIOD).expect("fits");
    for jump in
        [period, -period, 5 * period, -10 * period, 3_600_000_000_000, -3_600_000_000_000, period / 2 + 1]
    {
        let mut rig = synchronous();
        let before = rig.follow(0).sequence;
        for late in 1..=4_u64 {
            send_aged(&mut rig, jump);
            let sequence = match rig.command(0).command {
                Command::Follow(points) => points.sequence,
                Command::Withheld(_) => before,
            };
            assert_eq!((sequence, rig.device.counters().stamp_jumps), (before, late), "{jump}");
            assert_eq!(rig.device.node_fault(), NodeFault::NONE, "{jump}");
            rig.run_device();
            rig.now += PERIOD;
        }
        // It comes back, as it does when the offset is reported an update later.
        send_aged(&mut rig, 0);
        assert_ne!(rig.follow(0).sequence, before, "{jump}");
        for _ in 0..6 {
            rig.run_device();
            rig.now += PERIOD;
            send_aged(&mut rig, jump);
        }
        rig.run_device();
        assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE, "{jump}");
    }
}

/// A controller that has left out cycles has stamps as much later as its updates are.
#[test]
fn a_time_stamp_that_is_later_by_as_much_as_its_update_is_good() {
    let mut rig = synchronous();
    let before = rig.follow(0).sequence;
    rig.now += 3 * PERIOD;
    send_aged(&mut rig, 0);
    assert_eq!(rig.device.counters().stamp_jumps, 0);
    assert_ne!(rig.follow(0).sequence, before);
}

#[test]
fn late_updates_are_applied_within_the_limit_and_never_beyond() {
    let period = i64::try_from(PERIOD).expect("fits");
    let rows = [
        (0, true, 0, NodeAlarm::NONE, NodeFault::NONE),
        (period, true, 0, NodeAlarm::NONE, NodeFault::NONE),
        (period + 1, true, 1, NodeAlarm::NONE, NodeFault::NONE),
        (2 * period, true, 1, NodeAlarm::NONE, NodeFault::NONE),
        (2 * period + 1, true, 1, NodeAlarm::CONNECTION_UPDATE, NodeFault::NONE),
        (4 * period, true, 1, NodeAlarm::CONNECTION_UPDATE, NodeFault::NONE),
        (4 * period + 1, false, 1, NodeAlarm::NONE, NodeFault::CONNECTION_UPDATE),
        // A clock that is ahead is served, and said to be wrong.
        (-1, true, 0, NodeAlarm::NONE, NodeFault::NONE),
        (-1_000_001, true, 0, NodeAlarm::CLOCK_SKEW, NodeFault::NONE),
        (-4 * period, true, 0, NodeAlarm::CLOCK_SKEW, NodeFault::NONE),
        (-4 * period - 1, false, 0, NodeAlarm::CLOCK_SKEW, NodeFault::NONE),
    ];
    for (age, applied, late, alarm, fault) in rows {
        let mut rig = synchronous();
        if age < 0 {
            send_ahead(&mut rig, -age - 1);
            rig.run_device();
            rig.now += PERIOD;
        }
        let before = rig.follow(0).sequence;
        let counted = rig.device.counters().applied;
        if age < 0 {
            send_aged(&mut rig, age)
        } else {
            send_late(&mut rig, age)
        }
        assert_eq!(rig.device.counters().applied - counted, u64::from(applied), "age {age}");
        let fresh = matches!(rig.command(0).command, Command::Follow(s) if s.sequence != before);
        let seen =
            (fresh, rig.device.counters().late_updates, rig.device.node_alarm(), rig.device.node_fault());
        assert_eq!(seen, (applied, late, alarm, fault), "age {age}");
    }
}

#[test]
fn set_points_carry_their_target_time() {
    let mut rig = synchronous();
    rig.blocks[0].target = crate::wire::motion::codes::CommandTarget::INTERPOLATE;
    send_aged(&mut rig, 5);
    let stamp = EPOCH + rig.now - 5;
    let set_points = rig.follow(0);
    assert_eq!((set_points.time_stamp, set_points.target_time), (Some(stamp), Some(stamp + 2 * PERIOD)));
}

#[test]
fn synchronous_updates_without_a_time_are_not_applied() {
    let mut rig = synchronous();
    rig.time = TimeDataSet::empty();
    let before = rig.follow(0).sequence;
    rig.cycle();
    assert_eq!(rig.device.counters().untimed, 1);
    assert_eq!(rig.follow(0).sequence, before);
    rig.cycles(5);
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE, "as if nothing came");
}

#[test]
fn skewed_clocks_keep_the_device_asynchronous_and_fault_after_a_minute() {
    let mut rig = Rig::running();
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::TIME_STAMP;
    let skew = 3 * i64::try_from(PERIOD).expect("fits");
    for _ in 0..(60_000_000_000 / PERIOD) {
        send_aged(&mut rig, skew);
        rig.run_device();
        rig.now += PERIOD;
        assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    }
    assert_eq!(rig.header().node_alarm, NodeAlarm::CLOCK_SKEW);
    assert!(!rig.device.is_synchronous());
    assert_eq!(rig.follow(0).time_stamp, None, "the time stamp is not trusted");
    send_aged(&mut rig, skew);
    rig.now += PERIOD;
    send_aged(&mut rig, skew);
    assert_eq!(rig.device.node_fault(), NodeFault::CLOCK_SKEW);
}

/// The minute of clock skew is one in which the controller asks for synchronous operation (clause 7-1.3).
#[test]
fn skew_of_an_earlier_request_for_synchronous_operation_does_not_count() {
    let mut rig = Rig::running();
    let skew = 3 * i64::try_from(PERIOD).expect("fits");
    let ask = |rig: &mut Rig| {
        rig.control |= NodeControl::SYNC_CONTROL;
        rig.time = TimeDataSet::TIME_STAMP;
        send_aged(rig, skew);
        rig.run_device();
        rig.now += PERIOD;
        rig.control -= NodeControl::SYNC_CONTROL;
        rig.time = TimeDataSet::empty();
        assert_eq!(rig.device.node_alarm(), NodeAlarm::CLOCK_SKEW);
    };
    ask(&mut rig);
    rig.cycles(usize::try_from(61_000_000_000 / PERIOD).expect("fits"));
    ask(&mut rig);
    assert_eq!((rig.device.node_fault(), rig.state(0)), (NodeFault::NONE, AxisState::Running));
}

#[test]
fn clocks_that_agree_again_within_the_minute_lead_to_synchronous_operation() {
    let mut rig = Rig::running();
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::TIME_STAMP;
    let period = i64::try_from(PERIOD).expect("fits");
    // The stamp and a period are compared with the time: between now and two periods ago there is no skew.
    for (age, synchronous) in [(2 * period + 1, false), (-1, false), (2 * period, true)] {
        send_aged(&mut rig, age);
        rig.run_device();
        rig.now += PERIOD;
        rig.cycles(if synchronous { 3 } else { 0 });
        assert_eq!(rig.device.is_synchronous(), synchronous, "{age}");
    }
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    assert!(rig.header().node_status.contains(NodeStatus::SYNC_MODE));
}

#[test]
fn the_devices_time_offset_is_told_when_it_changes_and_its_time_diagnostics_when_asked_for() {
    use crate::wire::motion::TimeDiagnostics;
    let mut rig = synchronous();
    assert_eq!(rig.header().time_offset, None, "told before, and acknowledged");
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: -77 });
    rig.cycle();
    assert_eq!(rig.header().time_offset, Some(-77));
    rig.cycles(2);
    assert_eq!(rig.header().time_offset, None, "only until it has arrived");
    // The offset is told with a time stamp alone (Table 6-2.11).
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: 5 });
    rig.control -= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::TIME_DIAGNOSTICS;
    rig.cycle();
    assert_eq!((rig.header().time_stamp, rig.header().time_offset), (None, None));
    let packet = rig.command_packet();
    rig.send(&packet);
    let received_at = EPOCH + rig.now;
    rig.now += 1_000;
    assert!(rig.run_device());
    let expected = TimeDiagnostics { received_at, transmitted_at: received_at + 1_000 };
    assert_eq!(rig.header().time_diagnostics, Some(expected));
    // A device without synchronized time answers zeros and has no offset to tell.
    rig.device.engine.config.supports_sync = false;
    rig.time = TimeDataSet::TIME_STAMP | TimeDataSet::TIME_DIAGNOSTICS;
    rig.now += PERIOD;
    rig.cycle();
    let header = rig.header();
    assert_eq!((header.time_stamp, header.time_offset), (Some(0), None));
    assert_eq!(header.time_diagnostics, Some(TimeDiagnostics { received_at: 0, transmitted_at: 0 }));
}

#[test]
fn sync_control_needs_a_synchronized_clock_and_its_loss_is_reported() {
    let mut rig = Rig::running();
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: false, offset: 0 });
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::TIME_STAMP;
    rig.cycles(5);
    assert!(!rig.device.is_synchronous());

    let mut rig = synchronous();
    rig.device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: false, offset: 0 });
    rig.cycles(usize::try_from(10_100_000_000 / PERIOD).expect("fits"));
    assert_eq!(rig.device.node_alarm(), NodeAlarm::CLOCK_SYNC);
    rig.control -= NodeControl::SYNC_CONTROL;
    rig.cycle();
    assert!(!rig.device.is_synchronous());
    assert!(!rig.header().node_status.contains(NodeStatus::SYNC_MODE));
}

#[test]
fn a_step_of_the_controllers_time_is_compensated() {
    let mut rig = synchronous();
    // The controller jumps an hour ahead and says so in its offset; the device has not followed yet.
    let hour = 3_600_000_000_000_u64;
    rig.command_packet();
    let mut header = rig.command_header();
    header.time_stamp = Some(EPOCH + rig.now + hour);
    header.time_offset = Some(hour.cast_signed());
    let packet = rig.packet_with(&header);
    let before = rig.follow(0).sequence;
    rig.send(&packet);
    let set_points = rig.follow(0);
    assert_ne!(set_points.sequence, before);
    assert_eq!(set_points.time_stamp, Some(EPOCH + rig.now));
    assert_eq!(rig.device.counters().ahead_of_time, 0);
}

/// Captures a position, `age` ns before now, with this rate in counts per second.
fn capture(rig: &mut Rig, axis: usize, position: i64, rate: i64, age: u64) {
    let captured_at = EPOCH + rig.now - age;
    let image = &mut rig.drives[axis].image;
    (image.position, image.position_rate, image.captured_at) = (position, rate, captured_at);
}

/// Time stamp of the last update, as an age in ns, and the position of each axis in it.
fn stamped(rig: &Rig) -> (u64, [Option<i64>; 2]) {
    let stamp = rig.header().time_stamp.expect("a time stamp");
    let sent = rig.now - PERIOD;
    let position = |axis| match rig.actual(axis).actual.position {
        Some(ActualPosition::Dint(position)) => Some(i64::from(position)),
        Some(ActualPosition::Lint(position)) => Some(position),
        None => None,
    };
    (EPOCH + sent - stamp, [position(0), position(1)])
}

#[test]
fn a_lost_drive_holds_back_neither_the_time_stamp_nor_the_other_axis() {
    for lost in 0..2 {
        let mut rig = synchronous();
        let other = 1 - lost;
        for period in 0..200 {
            capture(&mut rig, other, 1_000 + period, 0, 300_000);
            if period == 3 {
                rig.drives[lost].image.online = false;
            } else if period < 3 {
                capture(&mut rig, lost, 7_000, 900_000, 300_000);
            }
            rig.cycle();
            let (age, positions) = stamped(&rig);
            assert_eq!(age, 300_000, "axis {lost} lost, period {period}");
            assert_eq!((positions[other], positions[lost]), (Some(1_000 + period), Some(7_000)));
        }
        // The controller learns that the position is not measured any more from the state and fault of the axis.
        assert_eq!(rig.state(other), AxisState::Running);
        assert_eq!(rig.state(lost), AxisState::MajorFaulted);
        assert_eq!(rig.device.axis_faults(lost), Some(1 << 63));
    }
}

#[test]
fn with_every_drive_lost_the_time_stamp_is_that_of_the_update() {
    let mut rig = synchronous();
    for axis in 0..2 {
        capture(&mut rig, axis, 5, 1_000_000, 300_000);
    }
    rig.cycle();
    rig.drives.iter_mut().for_each(|drive| drive.image.online = false);
    for _ in 0..50 {
        rig.cycle();
        assert_eq!(stamped(&rig), (0, [Some(5), Some(5)]));
    }
}

#[test]
fn positions_of_different_captures_are_taken_to_the_one_time_stamp() {
    let mut rig = synchronous();
    // Position, rate in counts per second, age in ns; expected at the age of the newest capture.
    let rows = [
        ("one bus", (100, 2_000_000, 300_000), (-50, -1_000_000, 300_000), 300_000, [100, -50]),
        ("a slower bus", (100, 2_000_000, 300_000), (-50, -1_000_000, 4_300_000), 300_000, [100, -4_050]),
        ("the first is older", (100, 2_000_000, 1_300_000), (-50, 0, 300_000), 300_000, [2_100, -50]),
        ("half a count, away from zero", (0, 1_000, 800_000), (0, -1_000, 300_000), 300_000, [1, 0]),
        ("at rest", (7, 0, 50_000_000), (8, 0, 0), 0, [7, 8]),
        ("older than a drive online can be", (7, 1_000_000, 1_000_000_001), (8, 0, 0), 0, [7, 8]),
        ("the fastest", (i64::MAX, i64::MAX, 1_000_000_000), (0, 0, 0), 0, [-1, 0]),
    ];
    for (what, first, second, age, expected) in rows {
        capture(&mut rig, 0, first.0, first.1, first.2);
        capture(&mut rig, 1, second.0, second.1, second.2);
        rig.cycle();
        assert_eq!(stamped(&rig), (age, expected.map(Some)), "{what}");
    }
    // Only the axes of the update count.
    capture(&mut rig, 0, 3, 0, 900_000);
    capture(&mut rig, 1, 4, 0, 300_000);
    rig.blocks.truncate(1);
    rig.cycle();
    let stamp = rig.header().time_stamp.expect("a time stamp");
    assert_eq!(EPOCH + rig.now - PERIOD - stamp, 900_000);
}

#[test]
fn a_lost_drive_reports_no_velocity() {
    let mut rig = synchronous();
    rig.blocks.iter_mut().for_each(|block| block.actual_data_set |= ActualDataSet::VELOCITY);
    rig.drives[0].image.velocity = Some(2.5);
    rig.cycles(2);
    assert_eq!(rig.actual(0).actual.velocity, Some(2.5));
    rig.drives[0].image.online = false;
    rig.cycles(2);
    assert_eq!(rig.actual(0).actual.velocity, None);
}

/// A running rig in synchronous operation, whose clock measures how well it is synchronized.
fn measuring() -> Rig {
    let class = |id, data_type, access| AttributeDefinition::new(Scope::Class, id, data_type, access, "");
    let mut attributes = definitions();
    attributes.extend([
        class(id::SYNC_VARIANCE, DataType::Udint, Access::Get),
        class(id::SYNC_THRESHOLD, DataType::Udint, Access::Set),
        class(id::SYNC_UPDATE_DELAY, DataType::Real, Access::Get),
    ]);
    let mut rig = Rig::measuring(10_000, attributes);
    rig.open();
    rig.request_all(AxisControl::ENABLE);
    rig.time = TimeDataSet::TIME_STAMP | TimeDataSet::UPDATE_DIAGNOSTICS;
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.cycles(10);
    assert!(rig.device.is_synchronous());
    rig
}

#[test]
fn variation_beyond_the_threshold_of_the_controller_is_an_alarm_while_synchronous() {
    let mut rig = measuring();
    let quality = SyncQuality { variance: 20_000, steps_removed: 3, log_sync_interval: -1 };
    rig.device.set_sync_quality(SyncQuality { variance: 9_000, ..quality });
    rig.cycles(10_000_000_000 / usize::try_from(PERIOD).expect("a period") + 10);
    assert_eq!(rig.device.node_alarm(), NodeAlarm::NONE);
    rig.device.set_sync_quality(quality);
    rig.cycle();
    assert_eq!(rig.device.node_alarm(), NodeAlarm::CLOCK_JITTER);
    let read = |rig: &Rig, id| rig.device.engine.instances.class_value(id);
    rig.device.engine.publish(0);
    assert_eq!(read(&rig, id::SYNC_VARIANCE), 20_000);
    assert_eq!(read(&rig, id::SYNC_UPDATE_DELAY), u64::from(1.5_f32.to_bits()), "3 steps of half a second");

    // A controller that takes more: the source of the time goes by it, and so does the alarm.
    assert_eq!(rig.device.sync_threshold(), Some(10_000));
    rig.device.engine.instances.publish_class(&[(id::SYNC_THRESHOLD, 30_000)]);
    assert_eq!(rig.device.sync_threshold(), Some(30_000));
    rig.cycles(10_000_000_000 / usize::try_from(PERIOD).expect("a period") + 10);
    assert_eq!(rig.device.node_alarm(), NodeAlarm::NONE, "ten seconds after its cause");

    // It counts as long as the connection.
    rig.close();
    assert_eq!(rig.device.sync_threshold(), None);
    rig.packet.clear();
    rig.open();
    assert_eq!(rig.device.sync_threshold(), Some(10_000));
}

/// Connection point 3: a run/idle header in front of each update, both ways, and its revision in it.
#[test]
fn updates_of_format_revision_3_run_or_are_idle() {
    let mut rig = Rig::new();
    let parameters =
        OpenParameters { format_revision: 3, configuration_bits: 0b101, ..rig.open_parameters() };
    let reply = rig.request(MotionRequest::Open(parameters));
    assert_eq!(reply, Some(MotionReply::Opened { token: parameters.token, outcome: Ok(()) }));
    // Connection Configuration Bits, of later editions too.
    let bits = super::services::reply_of(rig.request(super::services::explicit(9, 0x0E, 0, Some(36), &[])));
    assert_eq!(bits, (9, 0, vec![0b101]));
    rig.configure();
    // What the rig writes, as such a controller would.
    let send = |rig: &mut Rig, header: [u8; 4], revision: u8| -> NodeStatus {
        rig.now += PERIOD;
        let command = CommandHeader { last_received_id: 0, ..rig.command_header() };
        rig.sequence += 1;
        rig.update_id += 1;
        let packet = rig.packet_with(&CommandHeader { update_id: rig.update_id, ..command });
        let mut data = [&packet[..2], &header, &packet[2..]].concat();
        data[2 + 4 + 1] = revision;
        rig.send(&data);
        assert!(rig.run_device(), "an update goes out in each period");
        let sent = std::mem::take(&mut rig.packet);
        assert_eq!((&sent[2..6], &sent[6..8]), (&[1, 0, 0, 0][..], &[7, 3][..]), "{sent:?}");
        let frame = ActualFrame::parse_as(&sent[6..], 3).expect("an update");
        // The rig reads updates of revision 2.
        rig.packet = [&sent[..2], &[7, 2], &sent[8..]].concat();
        frame.header().node_status
    };
    let run = |rig: &mut Rig, header| (0..20).map(|_| send(rig, header, 3)).last().expect("20 periods");
    assert!(run(&mut rig, [1, 0, 0, 0]).contains(NodeStatus::DATA_VALID));
    rig.request_all(AxisControl::ENABLE);
    run(&mut rig, [1, 0, 0, 0]);
    assert_eq!(rig.state(0), AxisState::Running);
    // An idle originator: its data mean nothing, and the axes stop as without data.
    assert!(!run(&mut rig, [0, 0, 0, 0]).contains(NodeStatus::DATA_VALID));
    assert_ne!(rig.state(0), AxisState::Running);
    // The revision of another connection point is a wrong form.
    assert_eq!(rig.device.counters().malformed, 0);
    send(&mut rig, [1, 0, 0, 0], 2);
    assert_eq!(rig.device.counters().malformed, 1);
}
