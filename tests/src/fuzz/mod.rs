//! Fuzz targets: whatever reads what strangers send or write, as plain functions from bytes.
//!
//! `fuzz/` runs them under libFuzzer, `tests/tests/bad_input/fuzz.rs` runs them on the seeds of `fuzz/corpus` and on some mutations of each.
//! A target panics when something is wrong. Beside what panics by itself it asserts what a reader owes its caller:
//!
//! - what was read and is written again is read as the same value;
//! - a printed form has a length in proportion to what was read;
//! - an engine answers each input with a bounded number of outputs, and a network that is left alone afterwards works again.
//!
//! What a target may allocate at a time is in its row of [`TARGETS`]; the test weighs it.

mod canopen;
mod cip;
mod cip_engines;
mod conversation;
mod devicenet;
mod files;
mod motion;
mod sercos;

/// One reader, or one engine that reads.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Name of the target, of its binary in `fuzz/fuzz_targets` and of its folder in `fuzz/corpus`.
    pub name: &'static str,
    /// Reads the bytes; panics when something is wrong.
    pub run: fn(&[u8]),
    /// Bytes that it may have on the heap at a time, whatever it reads: twice what the costliest seed needs, or more.
    pub heap_max: u64,
    /// Mutations of the seeds that the test tries.
    pub mutations: u32,
}

/// Octets on the heap for wire formats that are read in place; printing takes most of it.
const PRINTED: u64 = 256 << 10;

/// All targets.
pub const TARGETS: &[Target] = &[
    Target { name: "cip_encapsulation", run: cip::encapsulation, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "cip_message", run: cip::message, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "cip_adapter", run: cip_engines::adapter, heap_max: 4 << 20, mutations: 150 },
    Target { name: "cip_controller", run: cip_engines::controller, heap_max: 4 << 20, mutations: 40 },
    Target { name: "motion_command", run: motion::command, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "motion_actual", run: motion::actual, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "motion_fixed", run: motion::fixed, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "motion_services", run: motion::services, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "motion_device", run: cip_engines::motion_device, heap_max: 4 << 20, mutations: 100 },
    Target { name: "sercos_telegram", run: sercos::telegram, heap_max: 1 << 20, mutations: 500 },
    Target { name: "sercos_describe", run: sercos::describing, heap_max: 4 << 20, mutations: 500 },
    Target { name: "sercos_slave", run: sercos::slave, heap_max: 4 << 20, mutations: 12 },
    Target { name: "sercos_master", run: sercos::master, heap_max: 8 << 20, mutations: 20 },
    Target { name: "canopen_wire", run: canopen::wire, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "canopen_sdo_server", run: canopen::sdo_server, heap_max: PRINTED, mutations: 800 },
    Target { name: "canopen_sdo_client", run: canopen::sdo_client, heap_max: PRINTED, mutations: 800 },
    Target { name: "canopen_lss", run: canopen::lss, heap_max: PRINTED, mutations: 800 },
    Target { name: "canopen_node", run: canopen::node, heap_max: 4 << 20, mutations: 50 },
    Target { name: "canopen_master", run: canopen::master, heap_max: 4 << 20, mutations: 20 },
    Target { name: "canopen_eds", run: canopen::eds, heap_max: 8 << 20, mutations: 60 },
    Target { name: "canopen_concise", run: canopen::concise, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "devicenet_wire", run: devicenet::wire, heap_max: PRINTED, mutations: 1_500 },
    Target { name: "devicenet_slave", run: devicenet::slave, heap_max: 4 << 20, mutations: 20 },
    Target { name: "devicenet_master", run: devicenet::master, heap_max: 4 << 20, mutations: 20 },
    Target { name: "config", run: files::config, heap_max: 32 << 20, mutations: 100 },
    Target { name: "overlay", run: files::overlay, heap_max: 64 << 20, mutations: 1 },
    Target { name: "script", run: files::script, heap_max: 8 << 20, mutations: 200 },
    Target { name: "capture", run: files::capture, heap_max: 8 << 20, mutations: 1_000 },
    Target { name: "decode", run: files::decode, heap_max: 8 << 20, mutations: 300 },
    Target { name: "translate", run: files::translate, heap_max: 8 << 20, mutations: 200 },
    Target { name: "modbus", run: files::modbus, heap_max: PRINTED, mutations: 800 },
];

/// The target with this name.
///
/// # Panics
/// Without such a target.
pub fn run(name: &str, data: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target of the table");
    (target.run)(data);
}

/// A printed form of so many bytes: no line costs more than a name, and no byte more than a few lines.
fn assert_printed(text: &str, bytes: usize) {
    let most = 4_000 + 400 * bytes;
    assert!(text.len() <= most, "{} bytes printed for {bytes}:\n{text}", text.len());
}

/// What `$type` reads is printed within bounds, and is read again as the same value when it was written.
macro_rules! same_again {
    ($type:ty, $data:expr) => {
        if let Ok(value) = <$type>::parse($data) {
            let mut bytes = vec![0xA5; value.buffer_len()];
            assert_eq!(value.emit(&mut bytes), Ok(bytes.len()), "{value:?}");
            assert_eq!(<$type>::parse(&bytes).as_ref(), Ok(&value));
        }
    };
}
use same_again;

/// The same for a value that can be printed.
macro_rules! printed_again {
    ($type:ty, $data:expr) => {
        $crate::fuzz::same_again!($type, $data);
        if let Ok(value) = <$type>::parse($data) {
            $crate::fuzz::assert_printed(&value.to_string(), $data.len());
        }
    };
}
use printed_again;
