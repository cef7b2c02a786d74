//! Which drives the demonstration moves: its configuration for each choice.

use std::fmt::Write as _;

use clap::ValueEnum;

use super::CONFIGURATION;

/// A kind of drives behind the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum DriveKind {
    /// SERCOS III.
    Sercos,
    /// CANopen with CiA 402.
    Can,
    /// DeviceNet with CIP Motion.
    Devicenet,
}

impl DriveKind {
    /// The bus of such drives.
    const fn bus(self) -> &'static str {
        match self {
            Self::Sercos => SERCOS,
            Self::Can => CAN,
            Self::Devicenet => DEVICENET,
        }
    }
}

/// What the demonstration moves when nothing is said.
pub const DRIVES: &str = "sercos,can";

/// Where the buses begin in the configuration.
const SOUTH: &str = "[south.sercos]";

/// The names of the drives in the configuration, and what one on CAN needs besides.
const NAMES: [(&str, &str); 3] =
    [("drive-a", ""), ("drive-b", "millimetres_per_turn = 5.0\n"), ("drive-c", "")];

/// The shortest update period of the configuration.
const PERIOD: &str = "min = \"2 ms\"";

/// Axes of the configuration.
const AXES: usize = 2;

/// Where the axes of the device stand, and where they do with a third one.
const MEMBERS: [&str; 2] =
    ["axes = [\"turntable\", \"slide\"]", "axes = [\"turntable\", \"slide\", \"spindle\"]"];

/// The third axis, where three kinds of drives are named.
const THIRD: &str = "\
[[axis]]
name = \"spindle\"
instance = 3
drive = \"drive-c\"
unit = \"revolution\"
motion_resolution = 1_000_000

[axis.limits]
following_error = 0.5

";

const REALTIME: &str = "\
[south.realtime]
priority = 20 # helps where it is granted, as to root
lock_memory = false
";

// The drives are in this process: when the host pauses it, they pause too.
const SERCOS: &str = "
[south.sercos]
interface = \"in-process\"
cycle_time = \"2 ms\"
jitter = \"100 us\"
allowed_losses = 100
";

const CAN: &str = "
[[south.can]]
interface = \"in-process\"
cycle_time = \"2 ms\"
heartbeat = \"1 s\"
allowed_losses = 100
";

const DEVICENET: &str = "
[[south.devicenet]]
interface = \"in-process\"
bit_rate = 500_000
cycle_time = \"4 ms\"
mac_id = 63
allowed_losses = 100
";

/// The configuration with these kinds of drives, each axis on the next one; the last one has the rest. A third kind has a third axis.
pub fn configuration(kinds: &[DriveKind]) -> String {
    let kind = |place: usize| kinds.get(place).or(kinds.last()).copied().unwrap_or(DriveKind::Sercos);
    let names = &NAMES[..kinds.len().clamp(AXES, NAMES.len())];
    let third = names.len() > AXES;
    if !third && names.iter().enumerate().all(|(place, _)| kind(place) == DriveKind::Sercos) {
        return CONFIGURATION.to_owned();
    }
    // No controller may be faster than the fastest bus.
    let slow = (0..names.len()).all(|place| kind(place) == DriveKind::Devicenet);
    let period = if slow { "min = \"4 ms\"" } else { PERIOD };
    let head = CONFIGURATION.split(SOUTH).next().unwrap_or(CONFIGURATION).replace(PERIOD, period);
    let mut text = match third {
        true => format!("{}{THIRD}{REALTIME}", head.replace(MEMBERS[0], MEMBERS[1])),
        false => format!("{head}{REALTIME}"),
    };
    for wanted in DriveKind::value_variants() {
        let mut drives = names.iter().enumerate().filter(|(place, _)| kind(*place) == *wanted).peekable();
        if drives.peek().is_some() {
            text.push_str(wanted.bus());
        }
        for (place, (name, more)) in drives {
            let number = place + 1;
            let (table, own) = match wanted {
                DriveKind::Sercos => ("sercos", format!("address = {number}\n")),
                DriveKind::Can => ("can", format!("node = {number}\n{more}")),
                DriveKind::Devicenet => {
                    ("devicenet", format!("mac_id = {number}\nresolution = 1_048_576\n{more}"))
                }
            };
            let _ = write!(text, "\n[[south.{table}.drive]]\nname = \"{name}\"\n{own}");
        }
    }
    text
}

/// The choice in words: `SERCOS III, CANopen and DeviceNet`.
pub fn title(kinds: &[DriveKind]) -> String {
    let name = |kind: &DriveKind| match kind {
        DriveKind::Sercos => "SERCOS III",
        DriveKind::Can => "CANopen",
        DriveKind::Devicenet => "DeviceNet",
    };
    match kinds.iter().take(NAMES.len()).map(name).collect::<Vec<_>>().split_last() {
        None => String::new(),
        Some((only, [])) => (*only).to_owned(),
        Some((last, first)) => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, DriveAt};

    #[test]
    fn every_choice_is_a_box_with_two_axes_or_three() {
        use DriveKind::{Can, Devicenet, Sercos};
        let sercos = |drive| DriveAt::Sercos { drive };
        let can = |drive| DriveAt::Can { bus: 0, drive };
        let devicenet = |drive| DriveAt::Devicenet { network: 0, drive };
        let choices: [(&[DriveKind], Vec<DriveAt>); 10] = [
            (&[], vec![sercos(0), sercos(1)]),
            (&[Sercos], vec![sercos(0), sercos(1)]),
            (&[Can], vec![can(0), can(1)]),
            (&[Devicenet], vec![devicenet(0), devicenet(1)]),
            (&[Sercos, Can], vec![sercos(0), can(0)]),
            (&[Can, Sercos], vec![can(0), sercos(0)]),
            (&[Sercos, Devicenet], vec![sercos(0), devicenet(0)]),
            (&[Sercos, Can, Devicenet], vec![sercos(0), can(0), devicenet(0)]),
            (&[Sercos, Sercos, Sercos], vec![sercos(0), sercos(1), sercos(2)]),
            (&[Sercos, Can, Devicenet, Can], vec![sercos(0), can(0), devicenet(0)]),
        ];
        for (kinds, drives) in choices {
            let config =
                Config::parse(&configuration(kinds), "demo").unwrap_or_else(|error| panic!("{error}"));
            let found: Vec<_> = config.axes.iter().map(|axis| axis.drive).collect();
            assert_eq!(found, drives, "{kinds:?}");
        }
        assert_eq!(title(&[Sercos, Can]), "SERCOS III and CANopen");
        assert_eq!(title(&[Sercos, Can, Devicenet]), "SERCOS III, CANopen and DeviceNet");
        assert_eq!((title(&[Can]), title(&[])), ("CANopen".to_owned(), String::new()));
    }
}
