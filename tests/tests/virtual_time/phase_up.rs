//! How long a SERCOS line takes from nothing to cyclic operation, and what is said meanwhile.

use std::fmt::Write as _;

use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_generic::scaling::UnitKind;

/// A box with four drives at this cycle; `more` stands in its bus.
fn four(cycle: &str, more: &str) -> Settings {
    let mut text = BOX
        .replace("update_period = { min = \"2 ms\", max = \"16 ms\" }\n", "")
        .replace(
            "axes = [\"turntable\", \"slide\"]",
            "axes = [\"turntable\", \"slide\", \"three\", \"four\"]",
        )
        .replace("cycle_time = \"2 ms\"", &format!("cycle_time = \"{cycle}\"\n{more}"));
    for (number, name) in [(3, "three"), (4, "four")] {
        let _ = write!(
            text,
            "\n[[south.sercos.drive]]\nname = \"drive-{number}\"\naddress = {number}\n\n[[axis]]\nname = \"{name}\"\n\
             instance = {number}\ndrive = \"drive-{number}\"\nunit = \"revolution\"\nmotion_resolution = 1_000_000\n"
        );
    }
    let drives =
        vec![(1, UnitKind::Rotary), (2, UnitKind::Linear), (3, UnitKind::Rotary), (4, UnitKind::Rotary)];
    Settings { configuration: text, drives, ..Settings::default() }
}

#[test]
fn four_slaves_are_in_cp4_within_two_seconds() {
    let mut table = String::new();
    for cycle in ["500 us", "1 ms", "2 ms", "4 ms", "10 ms"] {
        let mut rig = Rig::new(four(cycle, ""));
        let begin = rig.now();
        rig.until_up();
        let took = rig.now().since(begin);
        let _ = writeln!(table, "{cycle}: {took}");
        // A service channel does a step in a cycle: that of the slowest bus takes longer.
        let bar = if cycle == "10 ms" { 2_500 } else { 2_000 };
        assert!(took < millis(bar), "{table}");
    }
    println!("{table}");
    let mut rig = Rig::new(four("4 ms", "setup_cycle = \"4 ms\""));
    let begin = rig.now();
    rig.until_up();
    assert!(rig.now().since(begin) > millis(3_000), "the key counts");
}

/// A slave that takes long is named, with the parameter that it is asked for.
#[test]
fn a_phase_that_takes_long_says_which_slave_and_which_parameter() {
    let mut rig = Rig::new(four("4 ms", ""));
    rig.run_until(millis(5_000), "CP2", |rig| rig.told().contains("CP2: waiting for the application"));
    // The second slave is busy for 690 of each 700 ms from now on: bit 1 of its S-SVC.
    let clock = rig.clock();
    rig.tamper_frame = Some(Box::new(move |frame| {
        let bytes = frame.as_mut_slice();
        let busy = clock.get().0 / 1_000_000 % 700 < 690;
        if busy && bytes.get(14).is_some_and(|kind| kind & 0x40 != 0) && bytes[15] & 0x0F == 2 {
            bytes[32] |= 2;
        }
        true
    }));
    rig.run_for(millis(11_000));
    rig.tamper_frame = None;
    let told: Vec<_> =
        rig.told().lines().filter(|line| line.contains(" has taken ")).map(str::to_owned).collect();
    let line = |seconds: u32| format!("CP2 has taken {seconds} s: waiting for slave at position 2, ");
    let rows: Vec<_> = told.iter().filter(|row| row.starts_with("CP2")).collect();
    assert_eq!(rows.len(), 2, "{told:#?}");
    assert!(rows[0].starts_with(&line(5)) && rows[1].starts_with(&line(10)), "{told:#?}");
    assert!(rows.iter().all(|row| row.contains("ing S-0-") || row.contains(" of S-0-")), "{told:#?}");
}
