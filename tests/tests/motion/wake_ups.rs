//! The engine runs late, or not at all for a while; drives, buses and controller go on.

use profile_generic::time::DurationNs;

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
        // The last ones do not end on the grid of any bus: what was built is late by one cycle to one and a half, too.
        [1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 10_700, 2_400, 2_700, 3_000, 5_300].map(row).into()
    });
    insta::assert_snapshot!(table.finish());
}
