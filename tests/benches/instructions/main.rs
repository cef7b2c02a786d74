//! What `instructions.sh` counts: each case is a function of its own that is called so many times.
//!
//! ```text
//! instructions CASE COUNT     runs a case
//! instructions --list         names the cases
//! ```
//!
//! The functions are not inlined, so that callgrind can be told to count between entering and leaving one.

// The cases are those of the other benchmark; what only that one needs stays unused here.
#[expect(dead_code, reason = "shared with the benchmark of times")]
#[path = "../cyclic_path/engine.rs"]
mod engine;
#[expect(dead_code, reason = "shared with the benchmark of times")]
#[path = "../cyclic_path/explicit.rs"]
mod explicit;
#[expect(dead_code, reason = "shared with the benchmark of times")]
#[path = "../cyclic_path/motion.rs"]
mod motion;
#[expect(dead_code, reason = "shared with the benchmark of times")]
#[path = "../cyclic_path/translation.rs"]
mod translation;

use std::hint::black_box;

use axisbridge_tests::rig::Rig;
use profile_cip::wire::motion::{ActualInstance, CommandInstance};

const CASES: &[&str] = &[
    "c_to_d_parse_1",
    "c_to_d_parse_4",
    "c_to_d_parse_16",
    "c_to_d_emit_1",
    "c_to_d_emit_4",
    "c_to_d_emit_16",
    "d_to_c_parse_1",
    "d_to_c_parse_4",
    "d_to_c_parse_16",
    "d_to_c_emit_1",
    "d_to_c_emit_4",
    "d_to_c_emit_16",
    "axis_attribute",
    "ten_axis_attributes",
    "identity_through_the_adapter",
    "engine_cycle_two_axes",
    "engine_cycle_1",
    "engine_cycle_2",
    "engine_cycle_4",
    "engine_cycle_16",
    "engine_cycle_64",
    "rpdos_out",
    "tpdos_in_and_rpdos_out",
    "new_state_in_and_rpdos_out",
];

#[inline(never)]
fn counted_parse_command(update: &[u8]) -> usize {
    motion::parse_command(update)
}

#[inline(never)]
fn counted_emit_command(buffer: &mut [u8], instances: &[CommandInstance<'_>]) -> usize {
    motion::emit_command(buffer, instances)
}

#[inline(never)]
fn counted_parse_actual(update: &[u8]) -> usize {
    motion::parse_actual(update)
}

#[inline(never)]
fn counted_emit_actual(buffer: &mut [u8], instances: &[ActualInstance<'_>]) -> usize {
    motion::emit_actual(buffer, instances)
}

#[inline(never)]
fn counted_single(attributes: &mut explicit::Attributes) -> usize {
    attributes.single()
}

#[inline(never)]
fn counted_list(attributes: &mut explicit::Attributes) -> usize {
    attributes.list()
}

#[inline(never)]
fn counted_identity(session: &mut explicit::Session) -> usize {
    session.identity()
}

#[inline(never)]
fn counted_engine(cycle: &mut dyn FnMut()) {
    cycle();
}

#[inline(never)]
fn counted_rpdos(axis: &mut translation::Axis) {
    axis.encode();
}

#[inline(never)]
fn counted_step(axis: &mut translation::Axis, telegram: &[u8]) {
    axis.step(telegram);
}

fn repeat<T>(count: u32, mut case: impl FnMut() -> T) {
    for _ in 0..count {
        black_box(case());
    }
}

fn codec(case: &str, axes: u8, count: u32) {
    let (commands, actuals) = (motion::commands(axes), motion::actuals(axes));
    let mut buffer = [0; motion::ROOM];
    match case {
        "c_to_d_parse" => {
            let len = motion::emit_command(&mut buffer, &commands);
            repeat(count, || counted_parse_command(black_box(&buffer[..len])));
        }
        "c_to_d_emit" => repeat(count, || counted_emit_command(black_box(&mut buffer), black_box(&commands))),
        "d_to_c_parse" => {
            let len = motion::emit_actual(&mut buffer, &actuals);
            repeat(count, || counted_parse_actual(black_box(&buffer[..len])));
        }
        "d_to_c_emit" => repeat(count, || counted_emit_actual(black_box(&mut buffer), black_box(&actuals))),
        other => panic!("no case {other:?}; see --list"),
    }
}

fn run(case: &str, count: u32) {
    match case {
        "axis_attribute" => {
            let mut attributes = explicit::Attributes::new();
            repeat(count, || counted_single(&mut attributes));
        }
        "ten_axis_attributes" => {
            let mut attributes = explicit::Attributes::new();
            repeat(count, || counted_list(&mut attributes));
        }
        "identity_through_the_adapter" => {
            let mut session = explicit::Session::new();
            repeat(count, || counted_identity(&mut session));
        }
        "engine_cycle_two_axes" => {
            let mut rig: Rig = engine::shuttle();
            repeat(count, || rig.cycle_in(|cycle| counted_engine(cycle)));
        }
        "rpdos_out" => {
            let mut axis = translation::Axis::on_can();
            repeat(count, || counted_rpdos(&mut axis));
        }
        "tpdos_in_and_rpdos_out" => {
            let mut axis = translation::Axis::on_can();
            let telegram = translation::csp_telegram();
            repeat(count, || counted_step(&mut axis, black_box(&telegram)));
        }
        "new_state_in_and_rpdos_out" => {
            let mut axis = translation::Axis::on_can();
            let mut telegrams = translation::changing_telegrams();
            repeat(count, || {
                counted_step(&mut axis, black_box(&telegrams[0]));
                telegrams.swap(0, 1);
            });
        }
        by_axes => {
            let (name, axes) = by_axes.rsplit_once('_').expect("see --list");
            let axes = axes.parse().expect("see --list");
            match name {
                "engine_cycle" => {
                    let mut many = engine::crowd(usize::from(axes));
                    repeat(count, || many.cycle_in(|cycle| counted_engine(cycle)));
                }
                codec_case => codec(codec_case, axes, count),
            }
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--list"] => CASES.iter().for_each(|case| println!("{case}")),
        [case, count] => run(case, count.parse().expect("a count")),
        // `cargo bench` and `cargo test` start every benchmark with options of their own.
        _ => println!("counted by tests/benches/instructions.sh"),
    }
}
