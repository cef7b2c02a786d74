//! Everything that the mapping tables say, as text: what no frame shows stands in it.

use axisbridge::mapping::{Mapping, Plan};
use axisbridge::translate::{Behind, Stage};

/// Phases in which drives are commissioned.
const PHASES: [u8; 2] = [2, 3];

/// The resolved tables and, for each axis of a stage, its attributes and how its drive is commissioned.
#[must_use]
pub fn listing(mapping: &Mapping, stage: &Stage) -> String {
    let mut text = String::new();
    section(&mut text, "CIP Motion and the generic model", &numbers_only(&format!("{:?}", mapping.cip)));
    section(&mut text, "the generic model and SERCOS", &format!("{:?}", mapping.sercos));
    section(&mut text, "the generic model and CiA 402", &format!("{:?}", mapping.cia402));
    for axis in &stage.axes {
        let attributes = mapping.attribute_table(&axis.scaling);
        section(&mut text, &format!("attributes of {}", axis.name), &format!("{attributes:?}"));
        match &axis.behind {
            Behind::Sercos(drive) => {
                for phase in PHASES {
                    let plan = mapping.commissioning(&drive.needs, phase, &drive.facts);
                    let title = format!("commissioning of {} in CP{phase}", axis.drive);
                    section(&mut text, &title, &format!("{plan:?}"));
                }
            }
            Behind::Devicenet(drive) => {
                let program = mapping.devicenet_program(&drive.needs);
                section(&mut text, &format!("program of {}", axis.drive), &format!("{program:?}"));
            }
            Behind::Can(drive) => {
                for plan in [Plan::Ask, Plan::Tell] {
                    let steps = mapping.cia402_steps(plan, &drive.needs, &drive.facts);
                    let title = format!("commissioning of {}: {plan:?}", axis.drive);
                    section(&mut text, &title, &format!("{steps:?}"));
                }
            }
        }
    }
    text
}

/// What the dictionary has on an attribute says the dictionary; here its number is enough.
fn numbers_only(debug: &str) -> String {
    let mut parts = debug.split("CipAttribute { id: ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let number = part.split(',').next().unwrap_or_default();
        let rest = part.split_once("}, served").map_or("", |(_, rest)| rest);
        text.push_str(&format!("{number}, served{rest}"));
    }
    text
}

fn section(text: &mut String, title: &str, debug: &str) {
    text.push_str(title);
    text.push('\n');
    broken(text, debug);
    text.push('\n');
}

/// A debug text with a line for each element of the lists in it.
fn broken(text: &mut String, debug: &str) {
    const DEPTH: i32 = 3;
    let (mut depth, mut quoted, mut escaped) = (0, false, false);
    for letter in debug.chars() {
        if quoted {
            text.push(letter);
            (quoted, escaped) = (escaped || letter != '"', !escaped && letter == '\\');
            continue;
        }
        match letter {
            '"' => {
                quoted = true;
                text.push(letter);
            }
            '[' | '{' | '(' => {
                depth += 1;
                text.push(letter);
                if depth < DEPTH {
                    indent(text, depth);
                }
            }
            ']' | '}' | ')' => {
                depth -= 1;
                text.push(letter);
            }
            ',' if depth < DEPTH => {
                text.push(letter);
                indent(text, depth);
            }
            // The blank behind a comma that ended its line.
            ' ' if text.ends_with([' ', '\n']) => {}
            letter => text.push(letter),
        }
    }
}

fn indent(text: &mut String, depth: i32) {
    text.push('\n');
    for _ in 0..depth {
        text.push_str("  ");
    }
}
