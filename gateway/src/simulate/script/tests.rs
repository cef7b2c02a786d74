//! What a script says, and what is told of one that is wrong.

use super::*;
use profile_cip::controller::Scaling;
use profile_cip::controller::sets::DataSets;
use profile_cip::wire::motion::Format;
use profile_cip::wire::motion::codes::{AxisStatus, CommandTarget, ControlMode, TimeDataSet};

/// A head for the steps below; the first step begins on line 7.
const HEAD: &str = "[connection]
target = \"192.0.2.10\"
[axis.1]
counts_per_unit = 1000
limits = { velocity = 5.0, position_min = -1.0, position_max = 10.0 }
[axis.2]
";

fn mapping() -> Mapping {
    Mapping::embedded().expect("the shipped tables are sound")
}

fn parse(text: &str) -> Result<Script, Findings> {
    Script::parse(text, "script.toml", &mapping())
}

fn good(text: &str) -> Script {
    parse(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Each problem as line:column, title and what was expected.
fn problems(text: &str, mapping: &Mapping) -> String {
    match Script::parse(text, "script.toml", mapping) {
        Ok(script) => format!("accepted: {:?}\n", script.steps),
        Err(findings) => findings
            .list()
            .iter()
            .map(|d| format!("  {}:{} {} | {}\n", d.line, d.column, d.title, d.expected))
            .collect(),
    }
}

#[test]
fn a_step_with_something_wrong_is_shown_at_its_place() {
    let steps = [
        "enabel = 1",
        "within = \"1 s\"",
        "",
        "enable = 1\ndisable = 1",
        "enable = 3",
        "enable = \"both\"",
        "enable = [1, 7]",
        "enable = 1\nwithin = 5",
        "enable = 1\nwithin = \"5 minutes\"",
        "enable = 1\nrefused = \"no\"",
        "dwell = \"1 s\"\nrefused = true",
        "dwell = 1.5",
        "move = { axis = 1, to = 2.0, velocity = 1.0, acceleration = 5.0, speed = 3 }",
        "move = { axis = 1, to = 2.0, by = 1.0, velocity = 1.0, acceleration = 5.0 }",
        "move = { axis = 1, velocity = 1.0, acceleration = 5.0 }",
        "move = { axis = 1, to = \"2\", velocity = 1.0, acceleration = 5.0 }",
        "move = { axis = 1, to = nan, velocity = 1.0, acceleration = 5.0 }",
        "move = { axis = 1, to = 2.0, acceleration = 5.0 }",
        "move = { axis = 1, to = 2.0, velocity = 6.0, acceleration = 5.0 }",
        "move = { axis = 1, to = 11.0, velocity = 1.0, acceleration = 5.0 }",
        "move = { axis = 1, to = 2.0, velocity = 1.0, acceleration = 0.0 }",
        "move = { axis = 2, to = 2.0, velocity = 1.0, acceleration = 5.0 }",
        "move = 3",
        "mode = { axis = 1, control = \"speed\" }",
        "data_sets = { axis = 1, actual = [\"position\", \"torque\"] }",
        "set = { axis = 1, attribute = \"Stoping Action\", value = 1 }",
        "set = { axis = 1, attribute = \"Stopping Action\", value = \"halt\" }",
        "set = { axis = 1, attribute = \"Stopping Action\", value = 256 }",
        "set = { axis = 1, attribute = \"Stopping Action\", value = 1.5 }",
        "set = { axis = 1, attribute = \"Position Lock Tolerance\", value = \"far\" }",
        "set = { axis = 1, attribute = 3001, value = 1 }",
        "set = { axis = 1, attributes = { \"Stopping Action\" = 1, \"Nothing\" = 2 } }",
        "get = { axis = 1, attribute = \"Axis State\", by = \"post\" }",
        "expect = { axis = 1, state = \"Sleeping\" }",
        "expect = { axis = 1, position = 1.0 }",
        "expect = { axis = 1, status = [\"Nice\"] }",
        "expect = { axis = 1 }",
        "expect = { connection = \"found\" }",
        "expect_fault = { axis = 1, code = \"Motor Overcurrant\" }",
        "expect_fault = { axis = 1, type = \"Fault\" }",
        "arm = { axis = 1, events = [\"Reg 3 Pos Edge\"] }",
        "arm = { axis = 1, events = [\"Reg 1 Pos Edge\"], window = [2.0, 1.0] }",
        "arm = { axis = 2, events = [\"Watch Position 1 Fwd\"], watch = 1.0 }",
        "expect_event = { axis = 1, type = \"Registration 1 Positive Edge\", position = 1.0 }",
        "service = { axis = 1, code = \"Run\", data = \"01\" }",
        "service = { axis = 1, code = 0x53, data = \"0\" }",
        "explicit = { service = 0x0E, class = 0x10000 }",
        "misbehave = { shout = 1 }",
        "misbehave = { skip_updates = 1, duplicate = 2 }",
        "misbehave = { skip_updates = 0 }",
        "reconnect = 1",
        "together = [{ enable = 1 }, { disable = 9 }, { mov = 1 }]",
    ];
    let mapping = mapping();
    let table: String = steps
        .iter()
        .map(|step| format!("{step}\n{}", problems(&format!("{HEAD}[[step]]\n{step}\n"), &mapping)))
        .collect();
    insta::assert_snapshot!(table);
}

#[test]
fn a_head_with_something_wrong_is_shown_at_its_place() {
    let heads = [
        "",
        "title = 3\n[axis.1]",
        "speed = 3\n[axis.1]",
        "[axis.1]\n[[stop]]\nenable = 1",
        "[axis.x]",
        "[axis.1]\n[axis.3]",
        "[axis.17]",
        "[axis.1]\ncounts_per_unit = 0",
        "[axis.1]\ncounts = 5",
        "[axis.1]\nlimits = { position_min = 2.0, position_max = 1.0 }",
        "[axis.1]\nlimits = { velocity = -1 }",
        "[axis.1]\nattributes = { \"Stopping Action\" = 1, Foo = { value = 1 } }",
        "[connection]\ntarget = \"box\"\n[axis.1]",
        "[connection]\nupdate_period = \"1.5 us\"\n[axis.1]",
        "[connection]\ntimeout_multiplier = 5\n[axis.1]",
        "[connection]\nsize = 60\n[axis.1]",
        "[connection]\nsize = 2000\n[axis.1]",
        "[connection]\ncommand_target = \"later\"\n[axis.1]",
        "[connection]\nkey = { vendor = 1 }\n[axis.1]",
        "[connection]\nwait = { service = \"1\" }\n[axis.1]",
        "[connection]\nattributes = { \"Step Threshold\" = -1 }\n[axis.1]",
        "[connection\n[axis.1]",
        "[axis.1]\ncounts_per_unit = 1\ncounts_per_unit = 2",
        "unexpected_faults = \"maybe\"\n[axis.1]",
        "[connection]\nformat = \"short\"\n[axis.1]",
        "[connection]\nformat = \"fixed\"\nsynchronous = true\n[axis.1]",
        "[connection]\nformat = \"fixed\"\nsize = 400\n[axis.1]",
        "[connection]\nformat = \"fixed\"\ngrand_master = \"0011223344556677\"\n[axis.1]",
        "[connection]\nformat = \"fixed\"\ntime_data = []\n[axis.1]",
        "[connection]\nformat = \"fixed\"\n[axis.1]\n[axis.2]",
        "[connection]\nformat = \"fixed\"\n[axis.1]\nstatus = [\"fault\"]",
        "[connection]\nformat = \"fixed\"\n[axis.1]\nposition_type = \"LREAL\"",
        "[connection]\nformat = \"fixed\"\n[axis.1]\nactual = [\"position\", \"velocity\"]",
        "[connection]\nformat = \"fixed\"\n[axis.1]\nactual_position_type = \"LINT\"",
    ];
    let mapping = mapping();
    let table: String =
        heads.iter().map(|head| format!("{head}\n{}", problems(&format!("{head}\n"), &mapping))).collect();
    insta::assert_snapshot!(table);
}

#[test]
fn an_error_reads_like_those_of_the_configuration() {
    let text = format!("{HEAD}[[step]]\nset = {{ axis = 1, attribute = \"Stoping Action\", value = 1 }}\n");
    insta::assert_snapshot!(parse(&text).unwrap_err().to_string());
}

#[test]
fn what_is_not_said_has_its_default() {
    let script = good("[axis.1]\n");
    assert_eq!(script.places, Places::default());
    assert_eq!(script.config.rpi_us, 8_000);
    assert_eq!(script.config.connection_timeout(), DurationNs::from_millis(256));
    assert_eq!(script.config.command_target, CommandTarget::INTERPOLATE);
    assert!(script.config.grand_master.is_some());
    assert_eq!(script.config.axes[0].scaling, Scaling::Unknown);
    assert_eq!(script.config.axes[0].control_mode, ControlMode::POSITION);
    // What nothing expected fails at the end.
    assert_eq!(script.steps, [Step::Expect { condition: Condition::NoFault, within: DurationNs::ZERO }]);
    assert!(good("unexpected_faults = \"ignore\"\n[axis.1]\n").steps.is_empty());
}

#[test]
fn the_head_says_everything_about_the_connection() {
    let script = good(
        "title = \"all\"
[connection]
target = \"192.0.2.10\"
bind = \"192.0.2.1\"
update_period = \"2 ms\"
timeout_multiplier = 16
synchronous = false
size = 400
command_target = \"extrapolate\"
time_data = [\"time_diagnostics\"]
late_after = 3
give_up_after = 9
power_structure = 0x0A0B0C0D
key = { vendor_id = 1, device_type = 0x25, major_revision = 2 }
wait = { service = \"2 s\" }
attributes = { \"Controller Update Delay High Limit\" = 12 }
[axis.1]
counts_per_unit = \"device\"
mode = \"velocity\"
feedback = \"load\"
actual_position_type = \"LINT\"
command = [\"position\", \"torque\"]
actual = [\"position\"]
status = [\"fault\"]
position_type = \"DINT\"
limits = { velocity = 5.0, acceleration = 50.0, torque = 30.0, position_min = -1.0, position_max = 1.0 }
attributes = { \"Stopping Action\" = { value = \"Current Decel & Disable\", optional = true } }
",
    );
    insta::assert_debug_snapshot!((script.title, script.places, script.config));
}

/// A head of the fixed format; the first step begins on line 6.
const FIXED: &str = "[connection]
format = \"fixed\"
[axis.1]
mode = \"velocity\"
counts_per_unit = 1000
";

#[test]
fn the_fixed_format_has_its_own_head() {
    let config = good(FIXED).config;
    assert_eq!((config.format, config.connection_size, config.grand_master), (Format::Fixed, 18, None));
    assert_eq!(config.axes[0].sets, DataSets::fixed(ControlMode::VELOCITY));
    assert_eq!(config.time_data, TimeDataSet::empty());
    let text = "[connection]\nformat = \"fixed\"\nsynchronous = false\n[axis.1]\nmode = \"velocity\"\nactual = [\"position\"]\n";
    assert_eq!(good(text).config.axes[0].sets, DataSets::fixed(ControlMode::POSITION));
}

#[test]
fn a_step_that_the_fixed_format_cannot_carry_is_shown_at_its_place() {
    let steps = [
        "cyclic_read_list = { axis = 1, attributes = [\"Axis State\"] }",
        "arm = { axis = 1, events = [\"Reg 1 Pos Edge\"] }",
        "expect_event = { axis = 1, type = \"Registration 1 Positive Edge\" }",
        "time_data = []",
        "data_sets = { axis = 1, status = [\"fault\"] }",
        "data_sets = { axis = 1, actual = [\"position\", \"velocity\"] }",
        "feedback = { axis = 1, source = \"motor\", actual_position_type = \"LINT\" }",
        "misbehave = { stale_time_stamp = \"20 ms\" }",
        "expect = { synchronous = true }",
        "expect = { lost_updates = 2 }",
        "expect = { axis = 1, status = [\"Torque Control Mode\"] }",
        "expect_alarm = { axis = 1, code = 5 }",
        "together = [{ enable = 1 }, { sequence = [{ time_data = [] }] }]",
        "run_hookup_test = { axis = 1, type = \"feedback\", channel = 1, distance = 1.0, time = 2.0 }",
    ];
    let mapping = mapping();
    let table: String = steps
        .iter()
        .map(|step| format!("{step}\n{}", problems(&format!("{FIXED}[[step]]\n{step}\n"), &mapping)))
        .collect();
    insta::assert_snapshot!(table);
}

#[test]
fn every_verb_makes_its_step() {
    let text = include_str!("every_verb.toml");
    let script = good(text);
    for (verb, _) in step::VERBS {
        let used = text.contains(&format!("\n{verb} = ")) || text.contains(&format!("{{ {verb} = "));
        assert!(used, "the verb {verb} is tried");
    }
    let table: String = script
        .titles
        .iter()
        .zip(&script.steps)
        .map(|((title, line), step)| format!("{line:?} {title}\n    {step:?}\n"))
        .collect();
    insta::assert_snapshot!(table);
}

#[test]
fn names_are_compared_by_what_matters() {
    use super::reader::folded;
    assert_eq!(folded("Axis Fault - Mfg"), folded("axis_fault_mfg"));
    let markers = ["++", "+-", "-+", "--"].map(|signs| folded(&format!("Home Switch-Marker {signs}")));
    assert_eq!(
        markers,
        ["homeswitchmarker++", "homeswitchmarker+-", "homeswitchmarker-+", "homeswitchmarker--"]
    );
}

#[test]
fn values_go_out_as_their_type_has_them() {
    let bytes = |attribute: &str, value: &str| {
        let text =
            format!("{HEAD}[[step]]\nset = {{ axis = 1, attribute = \"{attribute}\", value = {value} }}\n");
        match &good(&text).steps[0] {
            Step::SetAttributes { attributes, .. } => attributes[0].value.clone(),
            step => panic!("{step}"),
        }
    };
    assert_eq!(bytes("Stopping Action", "0x02"), [2]);
    assert_eq!(bytes("Position Lock Tolerance", "2"), 2.0_f32.to_le_bytes());
    assert_eq!(bytes("motion resolution", "-1_000"), (-1_000_i32).to_le_bytes());
    assert_eq!(show_attribute(&mapping(), 1, 610, &[2]), "Stopping Action = 2");
    assert_eq!(show_attribute(&mapping(), 1, 9999, &[1, 2]), "attribute 9999 = [01, 02]");
}

#[test]
fn status_bits_are_those_of_the_standard() {
    let text = format!("{HEAD}[[step]]\nexpect = {{ axis = 1, status = [\"Torque Control Mode\"] }}\n");
    let Step::Expect { condition: Condition::Status { bits, on, .. }, .. } = good(&text).steps[0] else {
        panic!("a status is expected")
    };
    assert_eq!((bits, on), (AxisStatus::TORQUE_CONTROL_MODE, true));
}

#[test]
fn the_shipped_scripts_are_sound() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scripts");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("the folder of the scripts") {
        let path = entry.expect("an entry").path();
        let script = Script::load(&path, &mapping()).unwrap_or_else(|error| panic!("{error}"));
        assert!(script.title.is_some() && script.steps.len() > 3, "{}", path.display());
        count += 1;
    }
    assert_eq!(count, 5);
}
