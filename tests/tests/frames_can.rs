//! Frames of CiA 402 drives and of their controller through the shipped tables, compared with the golden texts next to them.
//!
//! With `AXISBRIDGE_ACCEPT` set the texts are written instead.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use axisbridge::mapping::Mapping;
use axisbridge::translate::{RowNames, translate_list};
use axisbridge_tests::can_frames::{folder, stage};
use axisbridge_tests::can_led;

/// Set to take what is found now as the golden texts.
const ACCEPT: &str = "AXISBRIDGE_ACCEPT";

#[test]
fn the_golden_texts_of_cia_402_drives_stand() {
    let stage = Arc::new(stage(Mapping::embedded().expect("the shipped tables")).expect("its drives"));
    let mut lists: Vec<_> =
        fs::read_dir(folder()).expect("the folder").map(|entry| entry.expect("an entry").path()).collect();
    lists.retain(|path| path.extension().is_some_and(|ending| ending == "hex"));
    lists.sort();
    let (mut frames, mut rows, mut wrong) = (0, BTreeSet::new(), Vec::new());
    for path in &lists {
        let text = fs::read_to_string(path).expect("a list");
        let list = translate_list(&stage, &text).unwrap_or_else(|error| panic!("{}:{error}", path.display()));
        frames += list.frames.len();
        let mut found = String::new();
        for frame in &list.frames {
            frame.write(&mut found, 0, RowNames::Keys).expect("a string takes it");
        }
        rows.extend(found.match_indices("[[").map(|(at, _)| {
            let row = &found[at..];
            row[..row.find([',', '\n']).unwrap_or(row.len())].to_owned()
        }));
        wrong.extend(difference(&path.with_extension("golden"), &found));
    }
    println!("{frames} frames in {} lists, by {} rows", lists.len(), rows.len());
    assert!(frames > 1_000, "{frames}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Modes that no word of CIP asks for are led by the generic side; probes go with them.
#[test]
fn the_golden_text_of_generic_commands_stands() {
    let mapping = Mapping::embedded().expect("the shipped tables");
    let found = can_led::text(&mapping).expect("its drives have programs");
    let lines = found.lines().count();
    assert!(lines > 300, "{lines}");
    let wrong = difference(&folder().with_file_name("frames-generic").join("can.golden"), &found);
    assert!(wrong.is_none(), "{}", wrong.unwrap_or_default());
}

/// The first line in which a text is not the golden one, which is written instead if that is asked for.
fn difference(golden: &Path, found: &str) -> Option<String> {
    if std::env::var_os(ACCEPT).is_some() {
        fs::write(golden, found).expect("the golden text can be written");
    }
    let expected = fs::read_to_string(golden).unwrap_or_default();
    if expected == found {
        return None;
    }
    let line = expected.lines().zip(found.lines()).position(|(one, two)| one != two);
    let line = line.unwrap_or_else(|| expected.lines().count().min(found.lines().count()));
    let of = |text: &str| text.lines().nth(line).unwrap_or("the end").to_owned();
    Some(format!("{}:{}\n-{}\n+{}", golden.display(), line + 1, of(&expected), of(found)))
}
