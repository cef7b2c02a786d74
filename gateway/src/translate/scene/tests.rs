use super::*;

const SCRIPT: &str = r#"
[axis.1]
counts_per_unit = 1_000_000
motion = { velocity = 1.0, acceleration = 10.0 }
[axis.2]
[[step]]
enable = 1
[[step]]
move = { axis = 1, to = 0.25 }
[[step]]
dwell = "200 ms"
[[step]]
disable = 1
"#;

/// The scene of the demonstration's drives to which this happens.
fn text(events: &str) -> Result<String, SceneError> {
    let config = Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
    let mapping = Mapping::embedded().unwrap();
    let script = Script::parse(SCRIPT, "test.toml", &mapping).unwrap();
    let events = Events::parse(events, "test.events", &names(&config)).unwrap();
    play(&config, mapping, &script, events, Orders::default())
}

#[test]
fn a_move_is_shown_and_is_the_same_each_time() {
    let shown = text("").unwrap();
    let lines = ["step 2: Move axis 1 to 0.25", "axis 1: Running", "operating 0.250000000 u -> 0.25"];
    for line in lines.into_iter().chain(["the script is at its end", "drive stopping -> ready"]) {
        assert!(shown.contains(line), "{line} in\n{shown}");
    }
    assert_eq!(text("").unwrap(), shown);
}

#[test]
fn what_happens_to_a_drive_is_shown_with_what_follows() {
    let shown = text("at 200 ms fault 1 over_current for 10 ms").unwrap();
    let lines = ["axis 1: event fault over_current for 10 ms", "fault", "step 2 (line 8) failed"];
    for line in lines {
        assert!(shown.contains(line), "{line} in\n{shown}");
    }
    // A jump of one millionth of a turn is seen in the bytes, and nowhere else.
    let (soon, late) = (text("at 200 ms jump 1 0.000001").unwrap(), text("at 200 ms jump 1 0").unwrap());
    let sums = |text: &str| {
        text.lines().filter(|line| line.contains(" sercos ")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_ne!(sums(&soon), sums(&late));
}

#[test]
fn a_scene_builds_no_drives() {
    assert!(matches!(text("resolution 1 4096"), Err(SceneError::Property)));
}

#[test]
fn a_client_moves_an_axis_before_the_controller_comes() {
    let config = Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
    let mapping = Mapping::embedded().unwrap();
    let script = Script::parse(SCRIPT, "test.toml", &mapping).unwrap();
    let orders = "enable turntable # on\nmove turntable 0.1 velocity=1 acceleration=10\nwait 150 ms\nleave\n";
    let orders = Orders::parse(orders, &config).unwrap();
    let shown = play(&config, mapping, &script, Events::default(), orders).unwrap();
    let lines: Vec<_> =
        shown.lines().filter_map(|line| line.split_once("  local: ")).map(|(_, line)| line).collect();
    let move_line = "move turntable 0.1 velocity=1 acceleration=10";
    assert_eq!(lines, ["enable turntable", "done", move_line, "done", "wait 150 ms", "leave"], "{shown}");
    assert!(shown.contains("operating 0.100000000 u -> "), "{shown}");
    for (text, error) in [
        ("wait", "unknown word `wait`: expected an order, `wait TIME` or `leave`"),
        ("axes", "expected an order, `wait TIME` or `leave`"),
        ("enable spindle", "unknown axis `spindle`: expected turntable, slide"),
    ] {
        let text = format!("# first\n{text}");
        assert_eq!(Orders::parse(&text, &config), Err(OrderError { line: 2, error: error.to_owned() }));
    }
}
