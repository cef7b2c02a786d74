use profile_cip::wire::motion::codes::{AxisControl, ControlMode, FeedbackMode, NodeControl, TimeDataSet};
use profile_cip::wire::motion::{
    CommandBlock, CommandHeader, CommandInstance, CommandPosition, CommandValues, CommandWriter,
};

mod can;
mod changes;
mod devicenet;

use profile_generic::mode::OperatingMode;
use profile_generic::program::{CommandProgram, Conversion, Field};
use profile_generic::ratio::Ratio;

use super::*;
use crate::capture::reader::ReadError;
use crate::config::Config;
use crate::mapping::{CipScaling, Mapping};

fn translator() -> Translator {
    let config = Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
    Translator::new(Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap())
}

/// An update for the turntable.
fn update(block: CommandBlock) -> Vec<u8> {
    let header = CommandHeader {
        update_id: 7,
        node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
        instance_count: 0,
        last_received_id: 0,
        time_stamp: None,
        time_offset: None,
        diagnostics: TimeDataSet::empty(),
    };
    let mut bytes = [0; 128];
    let mut writer = CommandWriter::new(&mut bytes, &header).unwrap();
    writer
        .instance(&CommandInstance { number: 1, cyclic: Some(block), ..CommandInstance::default() })
        .unwrap();
    let len = writer.finish();
    bytes[..len].to_vec()
}

fn position(counts: i32) -> CommandBlock {
    CommandBlock {
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(2),
        values: CommandValues {
            position: Some(CommandPosition::Integer(counts)),
            ..CommandValues::default()
        },
        ..CommandBlock::default()
    }
}

/// The counts of a recording that could be read to its end.
fn whole(Captured { counts, error, .. }: Captured) -> Result<Counts, ReadError> {
    error.map_or(Ok(counts), Err)
}

fn text(node: &Node) -> String {
    let mut text = String::new();
    node.write(&mut text, 0, RowNames::Keys).unwrap();
    text
}

/// What lines of a list become, one after the other.
fn lines(translator: &mut Translator, lines: &[&str]) -> String {
    let mut all = String::new();
    for line in lines {
        let line = Line::parse(line).unwrap().unwrap();
        all += &translator.line(&line).map_or_else(|error| format!("error: {error}\n"), |node| text(&node));
    }
    all
}

#[test]
fn a_position_command_becomes_an_mdt() {
    let mut translator = translator();
    insta::assert_snapshot!(text(&translator.frame(&update(position(250_000))).unwrap()));
}

#[test]
fn an_at_becomes_an_update_of_the_device() {
    let mut translator = translator();
    let line = Line::parse("at drive-a 08 c0 20 a1 07 00 00 00 00 00 00 00").unwrap().unwrap();
    insta::assert_snapshot!(text(&translator.line(&line).unwrap()));
}

#[test]
fn requests_follow_the_state_of_the_drive_once_it_was_heard() {
    let mut translator = translator();
    let mut all = String::new();
    let enable = CommandBlock { axis_control: AxisControl::ENABLE, ..position(0) };
    for (at, block) in [("0080", enable), ("00c0", position(1000)), ("0020", position(2000))] {
        let line = format!("at drive-a {at}{}", "00".repeat(10));
        let line = Line::parse(&line).unwrap().unwrap();
        all += &text(&translator.line(&line).unwrap());
        all += &text(&translator.frame(&update(block)).unwrap());
    }
    insta::assert_snapshot!(all);
}

#[test]
fn attributes_and_parameters_are_translated_both_ways() {
    let mut translator = translator();
    let mut all = String::new();
    for line in [
        "set turntable 473 00 00 20 41",
        "set turntable 40 01",
        "set turntable 473 00 00 80 7f",
        "idn drive-a S-0-0011 84 00",
        "idn drive-a S-0-0012 00 00",
        "idn drive-a S-0-0104 e8 03",
    ] {
        let line = Line::parse(line).unwrap().unwrap();
        all += &text(&translator.line(&line).unwrap());
    }
    insta::assert_snapshot!(all);
}

#[test]
fn what_cannot_be_translated_says_why() {
    let mut translator = translator();
    let cases = [
        "at drive-c 00",
        "set drive-a 473 00",
        "set turntable 9999 00",
        "set turntable 473 00",
        "06",
        "ff 00 00",
    ];
    let errors: Vec<_> = cases
        .iter()
        .map(|line| translator.line(&Line::parse(line).unwrap().unwrap()).unwrap_err().to_string())
        .collect();
    insta::assert_snapshot!(errors.join("\n"));
}

/// Finding T1: with positions inverted both ways in the box, and velocities times -3, every translated frame was the same as before.
/// Here it is the engine alone that is wrong, and the programs that the translator could look into are right.
#[test]
fn what_the_engine_does_wrong_is_seen() {
    let mut right = translator();
    let mut wrong = translator();
    let axis = &wrong.stage.axes[0];
    let inverted = CipScaling { inverted: true, ..axis.scaling };
    let north = wrong.stage.mapping.cip_program(&inverted).unwrap();
    let mut south = axis.south.clone();
    let mut fields = CommandProgram::new();
    for field in axis.south.command.fields() {
        let conversion = match field.signal {
            Signal::VelocityCommand => {
                let ratio = field.conversion.ratio;
                Conversion { ratio: Ratio::new(-3 * ratio.num(), ratio.den()).unwrap(), ..field.conversion }
            }
            _ => field.conversion,
        };
        fields.push(Field { conversion, ..*field }).unwrap();
    }
    south.command = fields;
    let bench = wrong.bench().unwrap();
    assert!(bench.engine_mut().set_cip_program(0, north), "it has no torque");
    bench.engine_mut().axes_mut()[0].set_south(south);
    let shown = |text: &str, what: &str| {
        let line = text.lines().find(|line| line.contains(what)).map(|line| line.trim().to_owned());
        line.unwrap_or_else(|| panic!("{what} in {text}"))
    };
    let values = CommandValues { velocity: Some(0.75), ..CommandValues::default() };
    let velocity = CommandBlock { control_mode: ControlMode::VELOCITY, values, ..CommandBlock::default() };
    for (block, what) in [(position(250_000), "S-0-0047"), (velocity, "S-0-0036")] {
        let [good, bad] = [&mut right, &mut wrong].map(|one| text(&one.frame(&update(block)).unwrap()));
        assert_ne!(shown(&good, what), shown(&bad, what));
    }
    let at = format!("at drive-a 08c0 20a10700 {}", "00".repeat(6));
    let [good, bad] = [&mut right, &mut wrong].map(|one| lines(one, &[&at]));
    assert_ne!(shown(&good, "Actual Position"), shown(&bad, "Actual Position"));
}

/// What a list says does not depend on the list before: the mode of the last command is forgotten as well.
#[test]
fn a_restart_forgets_the_mode_of_the_last_command() {
    let list = [
        "idn drive-a S-0-0011 04 00",
        "set turntable 40 01",
        "at drive-a 08 c0 20 a1 07 00 00 00 00 00 00 00",
    ];
    let mut fresh = translator();
    let expected = lines(&mut fresh, &list);
    let mut used = translator();
    let values = CommandValues { velocity: Some(0.75), ..CommandValues::default() };
    let velocity = CommandBlock { control_mode: ControlMode::VELOCITY, values, ..CommandBlock::default() };
    used.frame(&update(velocity)).unwrap();
    assert_eq!(used.bench().unwrap().engine().axes()[0].command().mode, OperatingMode::Velocity);
    used.line(&Line::Restart).unwrap();
    assert_eq!(used.bench().unwrap().engine().axes()[0].command().mode, OperatingMode::None);
    assert_eq!(lines(&mut used, &list), expected);
}

/// A drive whose scaling is another one than that of the simulated drive.
#[test]
fn the_values_of_the_machine_count() {
    let config = Config::parse(include_str!("../../cli/demo/two-axes.toml"), "demo.toml").unwrap();
    let stage = || Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap();
    assert_eq!(stage().stand_ins().collect::<Vec<_>>(), ["drive-a", "drive-b"]);
    // Rotational position in its own resolution: 3600 counts in a turn.
    let values = "# scan\nidn drive-a S-0-0076 4a 00\nidn drive-a S-0-0079 10 0e 00 00\n";
    let told = stage().with_values(values).unwrap();
    assert_eq!(told.stand_ins().collect::<Vec<_>>(), ["drive-b"]);
    let mut translator = Translator::new(told);
    let shown = text(&translator.frame(&update(position(250_000))).unwrap());
    assert!(shown.contains("S-0-0047 Position command value: 900 (84 03 00 00"), "{shown}");
    let wrong = [
        "at drive-a 00",
        "idn drive-a 76 00",
        "idn drive-x S-0-0076 00 00",
        "object drive-a 608F:01 00 00 00 00",
        "idn drive-a S-0-0076 03 00",
    ];
    let errors: Vec<_> =
        wrong.iter().map(|values| stage().with_values(values).unwrap_err().to_string()).collect();
    insta::assert_snapshot!(errors.join("\n"));
}
