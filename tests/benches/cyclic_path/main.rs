//! What the code of a cycle costs: codecs, explicit requests, the SERCOS master, the translation, the whole cycle of
//! the engine.
//!
//! Methods, numbers and what they do not say stand in `docs/performance.md`.

mod engine;
mod explicit;
mod master;
mod motion;
mod translation;

use std::time::Duration;

use criterion::Criterion;

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_millis(1_500))
        .configure_from_args();
    motion::bench(&mut criterion);
    explicit::bench(&mut criterion);
    master::bench(&mut criterion);
    translation::bench(&mut criterion);
    engine::bench(&mut criterion);
    criterion.final_summary();
}
