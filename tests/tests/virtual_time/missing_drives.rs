//! Drives of a SERCOS bus that are lost on its way up or in operation: the others are not kept waiting, and the bus is brought up anew
//! for one that nothing else brings back, while no controller is connected.

use axisbridge::engine::notice::Notice;
use axisbridge::simulate::drives::{hot_plug_drives, linear};
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_generic::scaling::UnitKind;
use profile_generic::state::DriveState;
use profile_sercos::master::event::Event;
use profile_sercos::master::station::Presence;
use profile_sercos::slave::communication::CLASSES_WITH_HOT_PLUG;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config as SlaveConfig, Slave};
use profile_sercos::wire::header::Phase;

/// How often an event has come.
fn count(rig: &Rig, is: impl Fn(&Event) -> bool) -> usize {
    rig.notices.iter().filter(|notice| matches!(notice, Notice::Sercos(event) if is(event))).count()
}

/// How often the bus was brought up anew.
fn scans(rig: &Rig) -> usize {
    count(rig, |event| *event == Event::Phase(Phase::CP0))
}

/// The same configuration with both ports of the gateway.
fn in_a_ring(configuration: &str) -> String {
    configuration
        .replace("interface = \"in-process\"", "interface = \"in-process\"\nring_interface = \"in-process\"")
}

/// Both drives of the line, and a place for a third one.
fn with_a_place() -> Settings {
    let axes = "axes = [\"turntable\", \"slide\", \"feeder\"]";
    let mut configuration = BOX.replace("axes = [\"turntable\", \"slide\"]", axes);
    configuration.push_str(
        "\n[[south.sercos.drive]]\nname = \"drive-c\"\naddress = 3\nhot_plug = true\n\n[[axis]]\nname = \"feeder\"\n\
         instance = 3\ndrive = \"drive-c\"\nunit = \"millimetre\"\nmotion_resolution = 10_000\n",
    );
    Settings { configuration, ..Settings::default() }
}

#[test]
fn a_drive_that_is_lost_on_the_way_up_keeps_no_other_one_waiting() {
    let mut waiting = Vec::new();
    for by_power in [false, true] {
        for cycles in (0..160).step_by(10) {
            let mut rig = Rig::new(Settings::default());
            rig.run_until(millis(5_000), "CP1", |rig| {
                count(rig, |event| *event == Event::Phase(Phase::CP1)) > 0
            });
            rig.run_for(millis(4 * cycles));
            if by_power {
                rig.line.set_power(1, false);
            } else {
                rig.line.cut(1);
            }
            let reached = (0..8_000).any(|_| {
                rig.run_for(millis(1));
                rig.status().phase == 4 && rig.engine.axes()[0].south().is_some()
            });
            if !reached {
                waiting.push((by_power, cycles, rig.status().phase));
            }
        }
    }
    assert_eq!(waiting, []);
}

#[test]
fn a_missing_drive_is_looked_for_although_another_one_has_come_by_hot_plug() {
    let mut rig = Rig::ready(with_a_place());
    rig.notices.clear();
    // The turntable takes part in nothing any more, and passes all telegrams on.
    rig.line.set_mute(0, true);
    rig.run_until(millis(1_000), "the loss", |rig| {
        count(rig, |event| matches!(event, Event::SlaveLost { address: 1, .. })) == 1
    });
    let config = SlaveConfig { address: 3, classes: CLASSES_WITH_HOT_PLUG, ..SlaveConfig::default() };
    rig.line.append(Slave::new(&config, Drive::new(linear()).expect("the servo works")));
    rig.line.mend(2);
    rig.run_until(millis(9_000), "the third drive", |rig| {
        count(rig, |event| matches!(event, Event::HotPlugged { address: 3, .. })) == 1
    });
    assert_eq!(scans(&rig), 0);
    rig.run_until(millis(15_000), "a new scan", |rig| scans(rig) == 1);
    rig.line.set_mute(0, false);
    rig.run_for(millis(10_000));
    let active = rig.sercos().master().slaves().filter(|slave| slave.presence == Presence::Active);
    assert_eq!((scans(&rig), rig.status().phase, active.count()), (1, 4, 3), "{}", rig.told());
}

#[test]
fn a_drive_that_is_heard_again_is_not_looked_for_although_a_place_is_free() {
    let mut rig = Rig::ready(with_a_place());
    rig.notices.clear();
    rig.line.set_mute(0, true);
    rig.run_for(millis(200));
    rig.line.set_mute(0, false);
    rig.run_until(millis(1_000), "the return", |rig| {
        count(rig, |event| matches!(event, Event::SlaveReturned { .. })) == 1
    });
    rig.run_for(millis(30_000));
    assert_eq!((scans(&rig), rig.status().phase), (0, 4), "{}", rig.told());
}

/// Hot plug brings a slave in at the end of a line alone. One that is lost amid others, and passes their telegrams on, needs a new scan.
#[test]
fn a_drive_with_hot_plug_that_is_lost_amid_others_is_looked_for() {
    let kinds = || vec![(1, UnitKind::Rotary), (2, UnitKind::Linear)];
    let mut seen = Vec::new();
    for (configuration, is_ring) in [(BOX.to_owned(), false), (in_a_ring(BOX), true)] {
        let mut rig = Rig::new(Settings { configuration, drives: kinds(), ..Settings::default() });
        rig.line = hot_plug_drives(kinds(), is_ring);
        rig.until_ready();
        rig.notices.clear();
        if is_ring {
            rig.line.slaves_mut()[0].restart();
        } else {
            // Amid a line one that began anew would interrupt it.
            rig.line.set_mute(0, true);
        }
        rig.run_until(millis(1_000), "the loss", |rig| {
            count(rig, |event| matches!(event, Event::SlaveLost { address: 1, .. })) == 1
        });
        rig.run_for(millis(11_000));
        let scanned = scans(&rig);
        rig.line.set_mute(0, false);
        rig.run_for(millis(10_000));
        let slaves = rig.sercos().master().slaves();
        let active = slaves.filter(|slave| slave.presence == Presence::Active).count();
        seen.push((is_ring, scanned, scans(&rig), rig.status().phase, active));
    }
    assert_eq!(seen, [(false, 1, 1, 4, 2), (true, 1, 1, 4, 2)]);
}

/// One at the end of a line comes back by itself.
#[test]
fn a_drive_with_hot_plug_at_the_end_of_a_line_needs_no_new_scan() {
    let kinds = || vec![(1, UnitKind::Rotary), (2, UnitKind::Linear)];
    let mut rig = Rig::new(Settings::default());
    rig.line = hot_plug_drives(kinds(), false);
    rig.until_ready();
    rig.notices.clear();
    rig.line.cut(1);
    rig.run_for(millis(20_000));
    assert_eq!(scans(&rig), 0, "{}", rig.told());
    rig.line.mend(1);
    rig.run_until(millis(9_000), "the drive", |rig| {
        count(rig, |event| matches!(event, Event::HotPlugged { address: 2, .. })) == 1
    });
    rig.run_for(millis(20_000));
    assert_eq!((scans(&rig), rig.status().phase), (0, 4), "{}", rig.told());
}

/// Cycles in a row, at most, for which the gateway has heard nothing of each axis within half a second.
fn longest_silences(rig: &mut Rig, change: impl FnOnce(&mut Rig)) -> Vec<u32> {
    let mut longest = vec![0; rig.engine.axes().len()];
    change(rig);
    let end = rig.now() + millis(500);
    while rig.now() < end {
        rig.step();
        for (longest, axis) in longest.iter_mut().zip(rig.engine.axes()) {
            *longest = axis.feedback().age_cycles.max(*longest);
        }
    }
    longest
}

/// A drive whose telegram has come was heard, whatever becomes of those of another line.
#[test]
fn a_drive_is_heard_while_others_are_searched_for() {
    let configuration = in_a_ring(BOX);
    let kinds = || vec![(1, UnitKind::Rotary), (2, UnitKind::Linear)];
    // A line on each port: the cable to the second one is cut.
    let mut rig = Rig::new(Settings { configuration, drives: kinds(), ..Settings::default() });
    rig.line = hot_plug_drives(kinds(), true);
    rig.line.cut(1);
    rig.until_ready();
    let silences = longest_silences(&mut rig, |rig| rig.line.cut(2));
    assert!(silences[0] == 0 && silences[1] > 100, "{silences:?}");
}

/// In a ring those behind a drive that hangs are heard again as soon as one of them turns the telegrams round.
#[test]
fn no_drive_of_a_ring_is_unheard_for_long_because_another_one_hangs() {
    let configuration = in_a_ring(&with_a_place().configuration).replace("hot_plug = true\n", "");
    let kinds = || vec![(1, UnitKind::Rotary), (2, UnitKind::Linear), (3, UnitKind::Linear)];
    let mut seen = Vec::new();
    for hung in 0..3 {
        let mut rig = Rig::new(Settings {
            configuration: configuration.clone(),
            drives: kinds(),
            ..Settings::default()
        });
        rig.line = hot_plug_drives(kinds(), true);
        rig.until_ready();
        let mut silences = longest_silences(&mut rig, |rig| rig.line.set_hung(hung, true));
        silences.remove(hung);
        seen.push(silences.into_iter().max());
    }
    assert!(seen.iter().all(|longest| longest.is_some_and(|cycles| cycles <= 5)), "{seen:?}");
}

/// A command that the machine relies on, and that the drives do not have.
const NEEDED: &str = "format = 1\noverlay = \"a command that the machine relies on\"\n[[generic-sercos.commission]]\nphase = 2\ndo = \"command\"\n\
                      idn = \"S-0-0262\"\nrefused = \"fail\"\nsource = \"drives that start from stored parameters\"\n";

/// A drive that was refused gets no command at the next attempt, and gets through. That is no reason to move it without the command.
#[test]
fn a_drive_without_a_command_that_it_has_to_take_is_not_used_at_any_attempt() {
    let mut rig = Rig::new(Settings { overlays: vec![NEEDED], ..Settings::default() });
    let failed = "executing S-0-0262";
    for attempts in 1..4 {
        rig.run_until(millis(60_000), "an attempt", |rig| {
            assert!(
                rig.engine.axes().iter().all(|axis| axis.state() == DriveState::NotReady),
                "{}",
                rig.told()
            );
            rig.told().matches(failed).count() >= 2 * attempts
        });
    }
    let spared = |notice: &&Notice| matches!(notice, Notice::CommandsWithheld { .. });
    assert_eq!(rig.notices.iter().filter(spared).count(), 4, "{}", rig.told());
}
