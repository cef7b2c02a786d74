//! Times that are configured: cycle times, loss limits, declared jitter. What slaves are told of them, and what follows.

use super::full_slaves::{FullRig, configured, full_rig, mirror};
use super::*;
use crate::checker::light::Mirror;
use crate::master::config::ConfigError;
use crate::slave::{self, Network, Slave};
use crate::wire::connection::ConnectionControl;
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Kind, TelegramType};
use crate::wire::scp::{ScpClass, ScpEntry};

/// What a slave holds as an unsigned number.
fn told(rig: &FullRig, slave: usize, idn: Idn) -> i64 {
    rig.line.slaves()[slave].store().number_of(idn)
}

/// The eight bytes of S-0-1017 as t6 and t7.
fn uc_times(rig: &FullRig, slave: usize) -> (u32, u32) {
    let store = rig.line.slaves()[slave].store();
    let data = store.get(store.find(Idn::UC_TIMES).unwrap()).data();
    let word = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap());
    (word(0), word(4))
}

#[test]
fn every_legal_cycle_time_is_taken_and_every_other_refused_with_its_value() {
    let check = |cycle| MasterConfig { mst_jitter_ns: 0, ..MasterConfig::new(MAC, cycle) }.check();
    let legal: Vec<u32> =
        [31_250, 62_500, 125_000].into_iter().chain((1..=260).map(|n| n * 250_000)).collect();
    assert_eq!((legal.len(), legal.last()), (263, Some(&65_000_000)));
    for &cycle in &legal {
        assert_eq!(check(cycle), Ok(()), "{cycle}");
        for other in [cycle - 1, cycle + 1] {
            assert_eq!(check(other), Err(ConfigError::CycleTime { nanoseconds: other }));
        }
    }
    // Every other multiple of the smallest one, and the next one behind the largest.
    for other in (0..=2_088).map(|n| n * 31_250).filter(|cycle| !legal.contains(cycle)) {
        assert_eq!(check(other), Err(ConfigError::CycleTime { nanoseconds: other }));
    }
    let said = "cycle time 187500 ns: 31250, 62500, 125000 or a multiple of 250000 up to 65000000";
    assert_eq!(check(187_500).unwrap_err().to_string(), said);
}

#[test]
fn networks_run_at_every_kind_of_cycle_time() {
    // Cycle, and whether there is room for a unified communication channel of 125 us.
    let cases = [
        (31_250, false),
        (62_500, false),
        (125_000, false),
        (250_000, true),
        (500_000, true),
        (750_000, true),
        (1_000_000, true),
        (4_000_000, true),
        (10_250_000, true),
        (65_000_000, true),
    ];
    for (cycle_ns, channel) in cases {
        let config = MasterConfig {
            slaves: (1..=2).map(configured).collect(),
            cycle_ns,
            // The jitter of a hardware master, where that of a soft one is longer than the cycle.
            mst_jitter_ns: if cycle_ns < 1_000_000 { 1_000 } else { 45_000 },
            ..config(&[])
        };
        let mut rig = VirtualBus::new(config, Network::line(vec![mirror(1), mirror(2)])).unwrap();
        rig.up_to(Phase::CP4);
        rig.cycles(20);
        let last: Vec<_> = rig.cycles[rig.cycles.len() - 2..].iter().map(|(at, _)| *at).collect();
        assert_eq!(last[1] - last[0], DurationNs(i64::from(cycle_ns)));
        let times = rig.master.layout().times;
        for slave in 0..2 {
            assert_eq!(told(&rig, slave, Idn::CYCLE_TIME), i64::from(cycle_ns));
            for (idn, ns) in [
                (Idn::AT_START, times.at_start_ns),
                (Idn::SYNC_TIME, times.sync_ns),
                (Idn::COMMAND_VALID, times.command_valid_ns),
                (Idn::RING_DELAY, times.ring_delay_ns),
                (Idn::SYNC_JITTER, times.sync_jitter_ns),
            ] {
                assert_eq!(told(&rig, slave, idn), i64::from(ns), "{idn} at {cycle_ns}");
            }
            assert_eq!(uc_times(&rig, slave), times.uc_ns.unwrap_or((0, 0)), "{cycle_ns}");
        }
        assert_eq!(times.uc_ns.is_some(), channel, "{cycle_ns}");
        assert!(rig.master.consumer(SlaveId(1), 1).is_some_and(|consumer| consumer.fresh), "{cycle_ns}");
    }
}

#[test]
fn jitter_is_declared_from_a_microsecond_on() {
    const SECOND: &[ScpEntry] =
        &[ScpEntry { class: ScpClass::VAR_CFG, version: 2 }, ScpEntry { class: ScpClass::SYNC, version: 2 }];
    for (jitter, soft) in [(0, 0), (1_000, 0), (1_001, 1 << 4), (45_000, 1 << 4)] {
        let config = MasterConfig { slaves: vec![configured(1)], mst_jitter_ns: jitter, ..config(&[]) };
        let slave = slave::Config { address: 1, classes: SECOND, ..slave::Config::default() };
        let slave = Slave::new(&slave, Mirror::default());
        let mut rig = VirtualBus::new(config, Network::line(vec![slave])).unwrap();
        rig.up_to(Phase::CP4);
        assert_eq!(told(&rig, 0, Idn::COMMUNICATION_CONTROL), soft, "{jitter}");
        // Half of what the MST deviates, and half a gap of 17 bytes.
        assert_eq!(told(&rig, 0, Idn::INTER_FRAME_GAP), 17);
        assert_eq!(told(&rig, 0, Idn::SYNC_JITTER), i64::from((jitter + 17 * 80) / 2), "{jitter}");
    }
}

/// One slave in CP4 whose connections bear `losses`, with values going both ways.
fn bearing(losses: u16) -> FullRig {
    let mut slave = configured(1);
    slave.connections.iter_mut().for_each(|connection| connection.allowed_losses = losses);
    let config = MasterConfig { slaves: vec![slave], mst_losses: 7, ..config(&[]) };
    let mut rig = VirtualBus::new(config, Network::line(vec![mirror(1)])).unwrap();
    rig.up_to(Phase::CP4);
    for _ in 0..5 {
        rig.master.commit(SlaveId(0), 0);
        rig.step();
    }
    rig
}

#[test]
fn lost_data_are_borne_as_often_as_configured_on_both_sides() {
    for losses in [1, 3, 12] {
        let mut rig = bearing(losses);
        assert_eq!(told(&rig, 0, Idn::connection(0, 11)), i64::from(losses), "S-0-1050.0.11");
        assert_eq!(told(&rig, 0, Idn::connection(1, 11)), i64::from(losses), "S-0-1050.1.11");
        assert_eq!(told(&rig, 0, Idn::MST_LOSSES), 7, "S-0-1003");
        // The master produces nothing new: the slave bears it, and once more is an error that it shows.
        let error = DeviceStatus::CONNECTION_ERROR;
        rig.cycles(usize::from(losses));
        rig.master.commit(SlaveId(0), 0);
        rig.cycles(1);
        let shown = |rig: &FullRig| {
            rig.log.iter().rev().find_map(|event| match event {
                Event::DeviceStatus { status, .. } => Some(*status),
                _ => None,
            })
        };
        assert_eq!(shown(&rig), None, "{losses} losses");
        // The loss that is too much, and it stands in the AT of the same cycle.
        rig.cycles(usize::from(losses));
        assert_eq!(shown(&rig), None, "{losses} losses");
        rig.cycles(1);
        assert!(shown(&rig).is_some_and(|status| status.contains(error)), "{losses} losses and one");
        // The slave's values stop: the same on the master's side.
        let mut rig = bearing(losses);
        rig.master.commit(SlaveId(0), 0);
        let at = rig.master.layout().slaves[0].as_ref().unwrap().connections[1].at;
        let state = |rig: &FullRig| rig.master.consumer(SlaveId(0), 1).unwrap().state;
        let mut held = None;
        rig.station = Box::new(move |_, outward, frame| {
            let telegram = TelegramType(frame[14]);
            if outward && telegram.kind() == Kind::At && telegram.number() == at.telegram {
                let place = HEADER_LEN + usize::from(at.offset);
                let control = [frame[place], frame[place + 1]];
                let held = held.get_or_insert(control);
                frame[place..place + 2].copy_from_slice(held);
            }
        });
        rig.cycles(1);
        rig.cycles(usize::from(losses));
        assert_eq!(state(&rig), ConsumerState::Warning, "{losses}");
        rig.cycles(1);
        assert_eq!(state(&rig), ConsumerState::Error, "{losses}");
        let control = rig.master.consumer(SlaveId(0), 1).unwrap().control;
        assert!(control.contains(ConnectionControl::READY));
    }
}

#[test]
fn lost_msts_are_borne_as_often_as_configured() {
    let mut rig = full_rig(1);
    rig.up_to(Phase::CP4);
    assert_eq!(told(&rig, 0, Idn::MST_LOSSES), 10);
    // Ten cycles without a telegram and half of one more, then it is too long.
    let last = rig.cycles.last().unwrap().0;
    let limit = last + DurationNs(11_500_000);
    rig.line.handle_time(limit);
    assert_eq!(rig.line.slaves()[0].fault(), None);
    rig.line.handle_time(limit + DurationNs(1));
    assert_eq!(rig.line.slaves()[0].fault(), Some(slave::phase::Fault::MstLoss));
}
