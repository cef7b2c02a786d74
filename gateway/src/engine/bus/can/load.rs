//! What a network of CANopen drives puts on its bus.

use profile_cia402::master::config::{Direction, MasterConfig, NodeConfig};
use profile_cia402::plan::{Cadence, Plan, Purpose, SHARE_DEFAULT, Traffic};
use profile_cia402::wire::cob_id;
use profile_cia402::wire::error_control::HEARTBEAT_LEN;
use profile_cia402::wire::pdo::mapped_len;
use profile_generic::can::Id;
use profile_generic::can::timing::{BitRate, Shape};
use profile_generic::time::DurationNs;

/// Bytes of an SDO frame.
const SDO_LEN: usize = 8;

/// Everything that comes regularly, with as many SDO requests and answers as the master lets go in a cycle.
#[must_use]
pub fn traffic(config: &MasterConfig) -> Vec<Traffic> {
    let mut traffic = Vec::new();
    let mut add = |purpose, id: Option<Id>, len: usize, cadence| {
        if let (Some(id), Some(shape)) = (id, Shape::classic(len)) {
            traffic.push(Traffic { purpose, id, shape, cadence });
        }
    };
    let sync_len = config.sync.map_or(0, |sync| usize::from(sync.counter_overflow > 0));
    add(Purpose::Sync, Some(cob_id::SYNC), sync_len, Cadence::Sync(1));
    let every = |ms: u16| Cadence::Every(DurationNs::from_millis(i64::from(ms)));
    for node in &config.nodes {
        let number = node.node.get();
        for direction in Direction::BOTH {
            for (number, id, len) in pdos(node, direction) {
                let purpose = match direction {
                    Direction::Receive => Purpose::Rpdo(node.node.get(), number),
                    Direction::Transmit => Purpose::Tpdo(node.node.get(), number),
                };
                add(purpose, id, len, Cadence::Sync(1));
            }
        }
        if let Some(heartbeat) = node.heartbeat {
            let id = cob_id::error_control(node.node);
            add(Purpose::Heartbeat(number), Some(id), 1, every(heartbeat.producer_ms));
        }
        if let Some(guarding) = node.guarding {
            let id = cob_id::error_control(node.node);
            // A remote frame has no data, whatever length it tells.
            for len in [0, HEARTBEAT_LEN] {
                add(Purpose::Guarding(number), Some(id), len, every(guarding.guard_time_ms));
            }
        }
    }
    if let Some(own) = config.heartbeat {
        let id = cob_id::error_control(own.node);
        add(Purpose::Heartbeat(own.node.get()), Some(id), 1, every(own.producer_ms));
    }
    if let Some(node) = config.nodes.first() {
        for _ in 0..config.sdo_frames_per_cycle {
            add(Purpose::Sdo, Some(cob_id::sdo_request(node.node)), SDO_LEN, Cadence::Sync(1));
            add(Purpose::Sdo, Some(cob_id::sdo_response(node.node)), SDO_LEN, Cadence::Sync(1));
        }
    }
    traffic
}

fn pdos(node: &NodeConfig, direction: Direction) -> impl Iterator<Item = (u16, Option<Id>, usize)> + '_ {
    node.pdos(direction)
        .iter()
        .map(move |pdo| (pdo.number, pdo.id(direction, node.node), mapped_len(&pdo.mapping).unwrap_or(0)))
}

/// The plan of a bus at this rate; `traffic` is [`traffic`] of its configuration.
#[must_use]
pub fn plan<'a>(config: &MasterConfig, rate: BitRate, traffic: &'a [Traffic]) -> Plan<'a> {
    let period = config.sync.map_or(0, |sync| i64::from(sync.period_ns));
    Plan { rate, cycle: DurationNs(period), share: SHARE_DEFAULT, traffic }
}
