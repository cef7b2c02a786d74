//! Which drives the demonstration moves: its configuration for each choice.

use std::fmt::Write as _;

use super::CONFIGURATION;

/// A kind of drives behind the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum DriveKind {
    /// SERCOS III.
    Sercos,
    /// CANopen with CiA 402.
    Can,
}

/// What the demonstration moves when nothing is said.
pub const DRIVES: &str = "sercos,can";

/// Where the buses begin in the configuration.
const SOUTH: &str = "[south.sercos]";

/// The names of the drives in the configuration, and what a CANopen drive needs besides.
const NAMES: [(&str, &str); 2] = [("drive-a", ""), ("drive-b", "millimetres_per_turn = 5.0\n")];

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

/// The configuration with these kinds of drives, each axis on the next one; the last one has the rest.
pub fn configuration(kinds: &[DriveKind]) -> String {
    let kind = |place: usize| kinds.get(place).or(kinds.last()).copied().unwrap_or(DriveKind::Sercos);
    if NAMES.iter().enumerate().all(|(place, _)| kind(place) == DriveKind::Sercos) {
        return CONFIGURATION.to_owned();
    }
    let head = CONFIGURATION.split(SOUTH).next().unwrap_or(CONFIGURATION);
    let mut text = format!("{head}{REALTIME}");
    let of = |wanted| NAMES.iter().enumerate().filter(move |(place, _)| kind(*place) == wanted);
    if of(DriveKind::Sercos).count() > 0 {
        text.push_str(SERCOS);
    }
    for (place, (name, _)) in of(DriveKind::Sercos) {
        let _ = write!(text, "\n[[south.sercos.drive]]\nname = \"{name}\"\naddress = {}\n", place + 1);
    }
    if of(DriveKind::Can).count() > 0 {
        text.push_str(CAN);
    }
    for (place, (name, more)) in of(DriveKind::Can) {
        let _ = write!(text, "\n[[south.can.drive]]\nname = \"{name}\"\nnode = {}\n{more}", place + 1);
    }
    text
}

/// The choice in words: `SERCOS III and CANopen`.
pub fn title(kinds: &[DriveKind]) -> String {
    let name = |kind: &DriveKind| match kind {
        DriveKind::Sercos => "SERCOS III",
        DriveKind::Can => "CANopen",
    };
    kinds.iter().map(name).collect::<Vec<_>>().join(" and ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, DriveAt};

    #[test]
    fn every_choice_is_a_box_with_two_axes() {
        use DriveKind::{Can, Sercos};
        let sercos = |drive| DriveAt::Sercos { drive };
        let can = |drive| DriveAt::Can { bus: 0, drive };
        let choices: [(&[DriveKind], _); 5] = [
            (&[], [sercos(0), sercos(1)]),
            (&[Sercos], [sercos(0), sercos(1)]),
            (&[Can], [can(0), can(1)]),
            (&[Sercos, Can], [sercos(0), can(0)]),
            (&[Can, Sercos], [can(0), sercos(0)]),
        ];
        for (kinds, drives) in choices {
            let config =
                Config::parse(&configuration(kinds), "demo").unwrap_or_else(|error| panic!("{error}"));
            let found: Vec<_> = config.axes.iter().map(|axis| axis.drive).collect();
            assert_eq!(found, drives, "{kinds:?}");
        }
        assert_eq!(title(&[Sercos, Can]), "SERCOS III and CANopen");
    }
}
