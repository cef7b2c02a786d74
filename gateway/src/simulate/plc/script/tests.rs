use super::*;
use crate::simulate::plc::Step;

/// A device with two axes whose layout has every field, one in the drive profile's, and one of CIP Motion.
const CONFIGURATION: &str = include_str!("box.toml");
const EVERY_VERB: &str = include_str!("every_verb.toml");

fn config() -> Config {
    Config::parse(CONFIGURATION, "box.toml").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_verb_makes_its_step() {
    let script =
        Script::parse(EVERY_VERB, "every_verb.toml", &config()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(script.title.as_deref(), Some("every verb"));
    assert_eq!(script.plan.names, ["turntable", "slide"]);
    assert_eq!(
        (script.plan.interval, script.plan.address),
        (Duration::from_millis(20), [127, 0, 0, 3].into())
    );
    let lines: Vec<_> = script
        .steps
        .iter()
        .map(|planned| {
            let Planned { step, within, title, line } = planned;
            format!("{:>3} {title} ({within:?})\n        {step:?}", line.unwrap_or(0))
        })
        .collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn the_only_device_with_assemblies_is_meant() {
    let config = CONFIGURATION.replacen("assembly = { layout = \"speed\" }\n", "", 1);
    let config = Config::parse(&config, "box.toml").unwrap_or_else(|error| panic!("{error}"));
    let script = Script::parse("[[step]]\nenable = \"all\"\n", "short.toml", &config).expect("a script");
    assert_eq!(script.plan.names, ["turntable", "slide"]);
    assert_eq!(script.plan.interval, Duration::from_millis(8));
    assert_eq!(script.steps[0].step, Step::Enable(vec![0, 1]));
}

#[test]
fn what_is_wrong_is_reported_at_its_place() {
    let config = config();
    let mut text = String::new();
    let head = "device = \"plc\"\n";
    for script in [
        "",
        "device = \"front\"",
        "device = 3",
        "device = \"plc\"\ninterval = \"200 ms\"",
        "device = \"plc\"\ninterval = 5",
        "device = \"plc\"\ncolour = 1",
        "device = \"plc\"\nstep = 1",
    ] {
        let error = Script::parse(script, "script.toml", &config).expect_err(script);
        text.push_str(&format!("# {}\n{error}\n", script.replace('\n', "; ")));
    }
    for step in [
        "",
        "fly = 1",
        "enabel = \"all\"",
        "enable = \"spindle\"",
        "enable = 1",
        "enable = []",
        "enable = \"all\", disable = \"all\"",
        "enable = \"all\", colour = 1",
        "enable = \"all\", within = 5",
        "move = { axis = \"slide\", to = 1, by = 1, velocity = 1 }",
        "move = { axis = \"slide\", to = 1 }",
        "move = { axis = \"slide\", to = 1, velocity = 1e9 }",
        "move = { axis = \"slide\", to = 1, velocity = nan }",
        "velocity = { axis = \"slide\", velocity = \"fast\" }",
        "word = { axis = \"slide\", bits = [\"warp\"] }",
        "word = { axis = \"slide\", value = 65536 }",
        "word = { axis = \"slide\" }",
        "set = { axis = \"slide\", field = \"warp\", value = 1 }",
        "set = { axis = \"slide\", field = \"torque\", value = 32768 }",
        "dwell = 5",
        "idle = \"5 parsecs\"",
        "close = false",
        "expect = { axis = \"slide\" }",
        "expect = { axis = \"slide\", fault = \"none\", refusal = \"none\" }",
        "expect = { axis = \"slide\", fault = \"hunger\" }",
        "expect = { axis = \"slide\", refusal = \"hunger\" }",
        "expect = { axis = \"slide\", status = [] }",
        "expect = { axis = \"slide\", position = 1.0 }",
        "expect = { axis = \"slide\", velocity = \"fast\", tolerance = 1 }",
    ] {
        let script = format!("{head}step = [{{ {step} }}]");
        let error = Script::parse(&script, "script.toml", &config).expect_err(step);
        text.push_str(&format!("# {step}\n{error}\n"));
    }
    insta::assert_snapshot!(text);
}

/// A layout with a mode of its own has that one only.
#[test]
fn the_mode_of_the_layout_is_the_only_one() {
    let text = CONFIGURATION.replacen("layout = \"mixed\"", "layout = \"motion\"", 1);
    let config = Config::parse(&text, "box.toml").unwrap_or_else(|error| panic!("{error}"));
    let script = "device = \"plc\"\nstep = [{ move = { axis = \"slide\", to = 1, velocity = 1 } }]";
    let error = Script::parse(script, "script.toml", &config).expect_err("mode 3").to_string();
    assert!(error.contains("no mode 1, only 3"), "{error}");
}

/// Assemblies of the AC/DC drive profile run at a speed or take a torque, and have neither STOP nor targets nor reasons.
#[test]
fn assemblies_of_the_drive_profile_run_and_do_not_move() {
    let torque = "layout = \"speed-torque\", drive_mode = \"torque\"";
    let by_torque = CONFIGURATION.replacen("layout = \"speed\"", torque, 1).replacen(
        "limits = { acceleration = 100.0 }",
        "limits = { acceleration = 100.0, velocity = 20.0 }\nmotor = { rated_torque = 1.0 }",
        1,
    );
    let parse = |text: &str, step: &str| {
        let config = Config::parse(text, "box.toml").unwrap_or_else(|error| panic!("{error}"));
        let script = format!("device = \"conveyor\"\nstep = [{{ {step} }}]");
        Script::parse(&script, "script.toml", &config).map(|script| script.steps[0].step.clone())
    };
    let velocity = "velocity = { axis = \"spindle\", velocity = -2 }";
    let step = parse(CONFIGURATION, velocity).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(step, Step::Velocity { axis: 0, velocity: -2_000_000, acceleration: 0, wait: true });
    let set = "set = { axis = \"spindle\", field = \"torque_reference\", value = -3 }";
    let step = parse(&by_torque, set).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(step, Step::Set { axis: 0, field: "torque_reference", value: -3 });
    for (text, step, title) in [
        (CONFIGURATION, "stop = \"spindle\"", "which has neither STOP nor START"),
        (
            CONFIGURATION,
            "word = { axis = \"spindle\", bits = [\"start\"] }",
            "which has neither STOP nor START",
        ),
        (CONFIGURATION, "move = { axis = \"spindle\", to = 1, velocity = 1 }", "no mode 1, only 2"),
        (CONFIGURATION, "velocity = { axis = \"spindle\", velocity = 600 }", "36000 does not fit"),
        (CONFIGURATION, set, "the output has no field `torque_reference`"),
        (
            CONFIGURATION,
            "expect = { axis = \"spindle\", fault = \"none\" }",
            "the input has no field `fault`",
        ),
        (
            CONFIGURATION,
            "expect = { axis = \"spindle\", refusal = \"none\" }",
            "the input has no field `refusal`",
        ),
        (&by_torque, velocity, "no mode 2, only 5"),
    ] {
        let error = parse(text, step).expect_err(step).to_string();
        assert!(error.contains(title), "{step}: {error}");
    }
}
