//! Updates that are lost, doubled, overtaken or late.

use axisbridge_tests::rig::network::Knobs;
use profile_generic::time::DurationNs;

use crate::chain::Chain;
use crate::scenario::Moment;
use crate::table::{Disturbance, Table};

#[test]
fn lost_updates() {
    let table = Table::of(|_| {
        let row = |count: u32| {
            Disturbance::twice(format!("{count} updates lost in a row"), move |rig| {
                let mut left = count;
                rig.tamper_command = Some(Box::new(move |_| {
                    let lost = left > 0;
                    left = left.saturating_sub(1);
                    !lost
                }));
            })
        };
        (1..=10).map(row).collect()
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn doubled_and_overtaken_updates() {
    let table = Table::of(|chain: Chain| {
        let knobs = |name, knobs: Knobs| Disturbance::at(Moment::Begin, name, move |rig| rig.knobs = knobs);
        let hold = chain.period() * 2;
        vec![
            knobs("every second one twice", Knobs { duplication: 500, ..Knobs::GOOD }),
            knobs("every one twice", Knobs { duplication: 1_000, ..Knobs::GOOD }),
            knobs("one in ten held up to 2 periods", Knobs { reordering: 100, hold, ..Knobs::GOOD }),
            knobs("one in two held up to 2 periods", Knobs { reordering: 500, hold, ..Knobs::GOOD }),
        ]
    });
    insta::assert_snapshot!(table.finish());
}

#[test]
fn late_updates() {
    let table = Table::of(|chain: Chain| {
        // Half periods; the way back is as late.
        let late = [1, 2, 3, 4, 5, 6, 8, 10].map(|halves: i64| {
            let latency = DurationNs(chain.period().as_nanos() * halves / 2);
            let (whole, half) = (halves / 2, if halves % 2 == 0 { "" } else { ".5" });
            Disturbance::at(Moment::Begin, format!("all {whole}{half} periods late"), move |rig| {
                rig.knobs = Knobs { latency, ..Knobs::GOOD };
            })
        });
        let jitter = [1, 2, 5].map(|tenths: i64| {
            let hold = DurationNs(chain.period().as_nanos() * tenths / 10);
            Disturbance::at(Moment::Begin, format!("arrival jitter of 0.{tenths} periods"), move |rig| {
                rig.knobs = Knobs { reordering: 1_000, hold, ..Knobs::GOOD };
            })
        });
        late.into_iter().chain(jitter).collect()
    });
    insta::assert_snapshot!(table.finish());
}
