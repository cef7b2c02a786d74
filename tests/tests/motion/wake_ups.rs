//! The engine runs late, or not at all for a while; drives, buses and controller go on.

use profile_generic::time::DurationNs;

use crate::chain::Bus;
use crate::scenario::Moment;
use crate::table::{Disturbance, Table};

#[test]
fn jitter_of_the_wake_ups() {
    let table = Table::of(|_| {
        let jitters = [0, 50, 200, 500, 1_000];
        let row = |jitter| {
            Disturbance::at(Moment::Begin, format!("wake-ups up to {jitter} us late"), move |rig| {
                rig.wake_ups.jitter = DurationNs::from_micros(jitter);
            })
        };
        jitters.map(row).into()
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn pauses_of_the_engine() {
    let table = Table::of(|_| {
        let row = |micros| {
            let pause = DurationNs::from_micros(micros);
            Disturbance::twice(format!("no wake-up for {pause}"), move |rig| {
                rig.wake_ups.pause(rig.now() + pause)
            })
        };
        // The last one does not end on the grid of any bus.
        [1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 10_700].map(row).into()
    });
    insta::assert_snapshot!(table.finish());
}

/// Between the call that builds the telegrams of a cycle and the one that sends them, and one cycle lasts a hundred.
#[test]
fn late_calls_for_what_is_built() {
    let table = Table::of(|chain| {
        // On DeviceNet nothing is built ahead, and no frame begins a cycle.
        if chain.bus == Bus::Devicenet {
            return Vec::new();
        }
        let cycle = chain.cycle();
        let row = |late: i64| {
            let pause = DurationNs(cycle.as_nanos() * late / 100);
            Disturbance::twice(format!("sending late by {late} % of a cycle"), move |rig| {
                let sent = rig.cycle_sent_at().expect("the bus is up");
                rig.wake_ups.pause_from(sent + cycle, sent + cycle + pause);
            })
        };
        [20, 70, 120, 170, 220].map(row).into()
    });
    insta::assert_snapshot!(table.finish());
}
