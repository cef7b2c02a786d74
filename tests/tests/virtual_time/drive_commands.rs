//! Procedure commands of drives: a line of local control, its accesses in the engine and on the bus, the drive, and the reply.

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::motion::millis;
use profile_cip::controller::Step as Move;
use profile_generic::inhibit::Inhibits;
use profile_generic::time::DurationNs;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

use super::drive_parameters::{Bench, held};

/// S-0-0264 of the simulated drive takes 200 ms.
const BACKUP: Idn = Idn::standard(264);

/// How long the memory of the turntable takes, and whether that fails.
fn with_memory(millis: i64, is_broken: bool) -> impl FnOnce(&mut Rig) {
    move |rig| {
        let drive = rig.line.slaves_mut()[0].application_mut();
        drive.set_memory(DurationNs::from_millis(millis), is_broken);
    }
}

/// Asks until the command is no longer in process; the last reply.
fn until_ended(bench: &mut Bench, idn: &str) -> String {
    for _ in 0..100 {
        let reply = bench.say(&format!("command turntable {idn} progress"));
        if !reply.contains("\"in-process\"") {
            return reply;
        }
        bench.rig.run_for(millis(10));
    }
    panic!("{idn} does not end");
}

#[test]
fn a_command_goes_from_in_process_to_done_as_the_drive_answers() {
    let mut bench = Bench::sercos(|_| {});
    let begun = bench.say("command turntable S-0-0264 start");
    let expected = "ok command turntable {\"id\":\"S-0-0264\",\"name\":\"Backup working memory procedure command\",\
                    \"state\":\"in-process\",\"status\":\"0x0007\"}\n";
    assert_eq!(begun, expected);
    assert_eq!(held(&bench, BACKUP), 3, "set and started");
    // It is neither started a second time nor forgotten.
    let again = bench.say("command turntable S-0-0264 start");
    let expected = "error command turntable in-process: S-0-0264 is in process already: cancel it, or wait for its end\n";
    assert_eq!(again, expected);
    bench.rig.run_for(millis(100));
    assert!(bench.say("command turntable S-0-0264 progress").contains("\"in-process\""), "100 ms of 200");
    let done = until_ended(&mut bench, "S-0-0264");
    assert_eq!(done, "ok command turntable {\"id\":\"S-0-0264\",\"state\":\"done\",\"status\":\"0x0003\"}\n");
    let cancelled = bench.say("command turntable S-0-0264 cancel");
    assert_eq!(
        cancelled,
        "ok command turntable {\"id\":\"S-0-0264\",\"state\":\"not-set\",\"status\":\"0x0000\"}\n"
    );
    assert_eq!(held(&bench, BACKUP), 0);
}

#[test]
fn a_command_that_failed_comes_with_the_diagnosis_of_the_drive() {
    let mut bench = Bench::sercos(with_memory(50, true));
    bench.say("command turntable S-0-0264 start");
    let failed = until_ended(&mut bench, "S-0-0264");
    let expected = "ok command turntable {\"id\":\"S-0-0264\",\"state\":\"failed\",\"status\":\"0x000f\",\
                    \"diagnostic\":\"DIAGNOSTIC\",\"message\":\"Backup working memory failed\"}\n";
    let shown = bench.object("read turntable S-0-0390");
    let number = shown["data"].as_str().expect("bytes");
    let bytes: Vec<&str> = (0..number.len() / 2).rev().map(|at| &number[2 * at..2 * at + 2]).collect();
    assert_eq!(failed, expected.replace("DIAGNOSTIC", &format!("0x{}", bytes.concat())));
    // What is left set is cancelled by the next start.
    bench.rig.line.slaves_mut()[0].application_mut().set_memory(DurationNs::from_millis(50), false);
    assert!(bench.say("command turntable S-0-0264 start").contains("\"in-process\""));
    assert!(until_ended(&mut bench, "S-0-0264").contains("\"done\""));
}

#[test]
fn a_command_in_process_is_cancelled() {
    let mut bench = Bench::sercos(with_memory(60_000, false));
    assert!(bench.say("command turntable S-0-0264 start").contains("\"in-process\""));
    assert!(bench.say("command turntable S-0-0264 cancel").contains("\"not-set\",\"status\":\"0x0000\""));
    assert!(bench.say("command turntable S-0-0264 progress").contains("\"not-set\""));
    assert_eq!(held(&bench, BACKUP), 0);
}

#[test]
fn what_is_no_command_for_people_is_refused_with_the_reason() {
    let mut bench = Bench::sercos(|rig| {
        let load = Definition::command(Idn::standard(262), 0x0009_0001, "Load defaults");
        rig.line.slaves_mut()[0].store_mut().define(load);
    });
    let before = held(&bench, Idn::POSITION_LOOP_KV);
    for (line, reply) in [
        (
            "command turntable S-0-0104 start",
            "error command turntable not-command: S-0-0104 is no procedure command: it is a parameter, which is written\n",
        ),
        (
            "command turntable S-0-0104 cancel",
            "error command turntable not-command: S-0-0104 is no procedure command: it is a parameter, which is written\n",
        ),
        (
            "command turntable S-0-0148 start",
            "error command turntable gateway: S-0-0148 is not executed: the gateway executes it for a controller\n",
        ),
        (
            "command turntable S-0-0262 start",
            "error command turntable refused: S-0-0262: the drive refuses the operation data with 0x7012: procedure command \
             cannot be executed at this time\n",
        ),
        (
            "command turntable P-0-0009 start",
            "error command turntable absent: P-0-0009: the drive refuses the IDN with 0x1001: IDN not available\n",
        ),
        (
            "command turntable 1010:01 start",
            "error command turntable no-parameter: 1010:01 is a number of CANopen drives: the drive of this axis is another \
             one\n",
        ),
    ] {
        assert_eq!(bench.say(line), reply, "{line}");
    }
    assert_eq!(held(&bench, Idn::POSITION_LOOP_KV), before, "nothing was written to it");
}

#[test]
fn nothing_is_started_or_cancelled_while_somebody_controls_the_axis() {
    let mut bench = Bench::sercos(with_memory(60_000, false));
    bench.enable();
    for act in ["start", "cancel"] {
        let reply = bench.say(&format!("command turntable S-0-0264 {act}"));
        let expected = "error command turntable held: S-0-0264: a client of local control has this axis\n";
        assert_eq!(reply, expected, "{act}");
    }
    assert!(bench.say("command turntable S-0-0264 progress").contains("\"not-set\""), "anybody may look");
    assert!(bench.say("command slide S-0-0264 start").contains("\"in-process\""), "another drive");
    bench.rig.connect(vec![Move::Dwell { seconds: 1_000.0 }]);
    bench.rig.run_until(millis(60_000), "a controller", |rig| rig.engine.axes()[0].has_controller());
    bench.rig.run_for(millis(100));
    let reply = bench.say("command turntable S-0-0264 start");
    let expected = "error command turntable controller: S-0-0264: a controller is connected to the device of this axis\n";
    assert_eq!(reply, expected);
    assert_eq!(held(&bench, BACKUP), 0);
}

#[test]
fn an_axis_is_not_enabled_after_a_command_that_changes_what_values_mean() {
    let mut bench = Bench::sercos(|_| {});
    let inhibits = |bench: &Bench| bench.rig.engine.axes()[0].feedback().inhibits;
    let stored = bench.say("command turntable S-0-0264 start");
    assert!(!stored.contains("recommission"), "{stored}");
    bench.rig.run_for(millis(300));
    assert!(!inhibits(&bench).contains(Inhibits::TRANSFER_ACTIVE));
    let moved = bench.say("command turntable S-0-0447 start");
    assert!(moved.ends_with("\"state\":\"done\",\"status\":\"0x0003\",\"recommission\":true}\n"), "{moved}");
    bench.rig.run_for(millis(100));
    assert!(inhibits(&bench).contains(Inhibits::TRANSFER_ACTIVE));
}

#[test]
fn a_canopen_device_stores_and_restores_by_its_signatures() {
    let mut bench = Bench::canopen("", |_| {});
    bench.object("write turntable 6081h 4711");
    let stored = bench.say("command turntable 1010:03 start");
    let expected = "ok command turntable {\"id\":\"1010:03\",\"name\":\"Store parameters: Save application parameters\",\
                    \"state\":\"done\"}\n";
    assert_eq!(stored, expected);
    let value_after_power_cycle = |bench: &mut Bench| {
        let now = bench.rig.clock().get();
        let node = bench.rig.can[0].bus.nodes_mut().next().expect("a device");
        node.power_cycle(now);
        node.dictionary().number(0x6081, 0)
    };
    assert_eq!(value_after_power_cycle(&mut bench), 4711, "kept");
    // It is commissioned again.
    bench.rig.run_for(millis(5_000));
    let restored = bench.say("command turntable 1011:01 start");
    assert!(restored.ends_with("\"state\":\"done\",\"recommission\":true}\n"), "{restored}");
    assert_ne!(value_after_power_cycle(&mut bench), 4711, "the default");
}

#[test]
fn a_canopen_device_refuses_with_its_own_code() {
    let mut bench = Bench::canopen("", |_| {});
    for (line, reply) in [
        (
            "command turntable 1010:09 start",
            "error command turntable absent: 1010:09: the drive refuses it with 0x06090011: sub-index does not exist\n",
        ),
        (
            "command turntable 6081h start",
            "error command turntable not-command: 6081:00 is no command: expected 1010:01 (store parameters) or 1011:01 \
             (restore defaults), or another sub-index of them from 1 to 127\n",
        ),
        (
            "command turntable 1010:01 cancel",
            "error command turntable not-command: 1010:01 ends with its answer: it cannot be cancelled\n",
        ),
        (
            "write turntable 1010:01 1",
            "error write turntable gateway: 1010:01 is not written: it is a command and has no value that can be read back; \
             `param command` executes it\n",
        ),
    ] {
        assert_eq!(bench.say(line), reply, "{line}");
    }
    bench.enable();
    let reply = bench.say("command turntable 1010:01 start");
    assert_eq!(reply, "error command turntable held: 1010:01: a client of local control has this axis\n");
}

#[test]
fn commands_of_a_drive_are_a_list() {
    let mut bench = Bench::sercos(|_| {});
    let list = bench.say("list turntable commands");
    assert!(list.contains("parameter S-0-0264 name=Backup working memory procedure command\n"), "{list}");
    assert!(list.ends_with(" bus=sercos source=S-0-0025\n") && !list.contains("S-0-0104"), "{list}");
    let mut bench = Bench::canopen("", |_| {});
    let list = bench.say("list turntable commands");
    assert_eq!(list.lines().count(), 9, "{list}");
    assert!(list.contains("parameter 1010:01 access=rw type=u32 name="), "{list}");
}
