use std::collections::BTreeMap;

use profile_cia402::wire::AbortCode;
use profile_sercos::wire::attribute::ItemLength;
use profile_sercos::wire::svc::Element;
use profile_sercos::wire::svc_error::SvcError;

use super::*;

/// A parameter of a drive that does what it is told to.
#[derive(Debug, Clone)]
struct Held {
    attribute: Option<Attribute>,
    data: Vec<u8>,
    /// What it has, whatever is written.
    sticks: bool,
    /// What it answers to writes, so many times.
    refuses: Option<(DirectFailure, usize)>,
    /// Another parameter takes this value when it is written.
    changes: Option<(&'static str, Vec<u8>)>,
}

#[derive(Debug, Default)]
struct Drive {
    held: BTreeMap<String, Held>,
    log: Vec<String>,
    /// So many answers are lost.
    lost: usize,
}

fn unsigned() -> Attribute {
    Attribute::new(ItemLength::Four, Format::Unsigned)
}

fn refusal(code: u16) -> DirectFailure {
    DirectFailure::Svc(SvcFailure::Refused { element: Element::Data, code: SvcError(code) })
}

impl Drive {
    /// With parameters of four bytes, and what protects them.
    fn new(values: &[(&str, u32, [bool; 3])]) -> Self {
        let mut drive = Self::default();
        for (id, value, [cp2, cp3, cp4]) in values {
            let held = Held {
                attribute: Some(unsigned().protect(*cp2, *cp3, *cp4)),
                data: value.to_le_bytes().to_vec(),
                sticks: false,
                refuses: None,
                changes: None,
            };
            drive.held.insert((*id).to_owned(), held);
        }
        drive
    }

    fn of(&mut self, id: &str) -> &mut Held {
        self.held.get_mut(id).expect(id)
    }

    /// Carries a list out as far as it goes in this phase; what was asked stands in the log.
    fn run(&mut self, run: &mut StartupRun, when: When) -> Option<String> {
        run.begin(when);
        while let Some(access) = run.next() {
            if self.lost > 0 {
                self.lost -= 1;
                self.log.push("lost".to_owned());
                run.take(Err(DirectFailure::Svc(SvcFailure::HandshakeTimeout { cycles: 10 })));
                continue;
            }
            match access {
                StartupAccess::Read(id, room) => {
                    self.log.push(format!("read {id}"));
                    match self.held.get(&id.to_string()) {
                        Some(held) => {
                            assert!(held.data.len() <= room, "room for what the list has");
                            run.take(Ok((held.attribute, &held.data)));
                        }
                        None => run.take(Err(refusal(0x1001))),
                    }
                }
                StartupAccess::Write(id, attribute, bytes) => {
                    self.log.push(format!("write {id} {bytes:?}"));
                    let held = self.of(&id.to_string());
                    assert_eq!(attribute, held.attribute);
                    match &mut held.refuses {
                        Some((failure, times)) if *times > 0 => {
                            *times -= 1;
                            let failure = *failure;
                            run.take(Err(failure));
                            continue;
                        }
                        _ => {}
                    }
                    if !held.sticks {
                        held.data.clone_from(&bytes);
                    }
                    if let Some((other, data)) = held.changes.clone() {
                        self.of(other).data = data;
                    }
                    run.take(Ok((None, &bytes)));
                }
            }
        }
        assert!(run.is_done());
        run.take_failure().map(|failure| failure.to_string())
    }
}

fn entry(id: &str, text: &str, on_difference: OnDifference) -> StartupEntry {
    StartupEntry {
        id: Id::parse(id).expect(id),
        value: StartupValue::Text(text.to_owned()),
        data_type: None,
        on_difference,
        from_file: false,
    }
}

fn list(entries: &[(&str, &str, OnDifference)]) -> StartupRun {
    let entries: Vec<_> = entries.iter().map(|(id, text, what)| entry(id, text, *what)).collect();
    StartupRun::new(&entries)
}

fn reports(run: &mut StartupRun) -> Vec<String> {
    run.take_reports().iter().map(ToString::to_string).collect()
}

const OPEN: [bool; 3] = [false, false, true];
const LATER: [bool; 3] = [true, false, true];
const CP4: [bool; 3] = [true, true, false];
const NEVER: [bool; 3] = [true, true, true];

use OnDifference::{Refuse, Warn, Write};

#[test]
fn a_drive_that_has_every_value_is_only_read() {
    let mut drive = Drive::new(&[("S-0-0121", 3, OPEN), ("S-0-0122", 1, NEVER)]);
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "1", Refuse)]);
    assert_eq!(drive.run(&mut run, When::Once), None);
    assert_eq!(drive.log, ["read S-0-0121", "read S-0-0122"]);
    assert!(!run.has_written());
    assert_eq!(reports(&mut run), ["start-up list: 2 entries hold, 0 of them written"]);
}

#[test]
fn what_differs_is_written_when_its_attribute_lets_it_and_read_back() {
    let mut drive = Drive::new(&[("S-0-0121", 1, OPEN), ("S-0-0122", 1, LATER)]);
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "2", Write)]);
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    let both = ["read S-0-0121", "read S-0-0122"];
    let first = ["write S-0-0121 [3, 0, 0, 0]", "read S-0-0121", "read S-0-0121"];
    assert_eq!(drive.log, [&both[..], &first].concat(), "read back, and looked at once more at the end");
    assert!(run.has_written());
    assert_eq!(reports(&mut run), ["start-up list: S-0-0121 was 1 and is set to 3"]);
    drive.log.clear();
    assert_eq!(drive.run(&mut run, When::Cp3), None);
    let second = ["write S-0-0122 [2, 0, 0, 0]", "read S-0-0122", "read S-0-0121", "read S-0-0122"];
    assert_eq!(drive.log, [&both[..], &second].concat());
    let expected =
        ["start-up list: S-0-0122 was 1 and is set to 2", "start-up list: 2 entries hold, 2 of them written"];
    assert_eq!(reports(&mut run), expected);
    // The drive comes back: the list is compared again from the start.
    run.restart();
    drive.log.clear();
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    assert_eq!(drive.log, both);
}

#[test]
fn a_difference_that_refuses_the_drive_is_found_before_anything_is_written() {
    let mut drive = Drive::new(&[("S-0-0121", 1, OPEN), ("S-0-0122", 1, OPEN), ("P-0-0123", 9, OPEN)]);
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "2", Refuse), ("P-0-0123", "8", Refuse)]);
    let expected = "S-0-0122 is 1, expected 2; P-0-0123 is 9, expected 8 (on_difference = \"refuse\")";
    assert_eq!(drive.run(&mut run, When::Cp2).as_deref(), Some(expected));
    assert!(drive.log.iter().all(|line| line.starts_with("read")), "{:?}", drive.log);
}

#[test]
fn a_difference_that_warns_is_reported_once_and_left() {
    let mut drive = Drive::new(&[("S-0-0121", 1, OPEN)]);
    let mut run = list(&[("S-0-0121", "3", Warn), ("P-0-0001", "1", Warn)]);
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    let expected = [
        "start-up list: P-0-0001 is not compared: the drive refuses the operation data with 0x1001: IDN not available; the drive \
         is used nevertheless (on_difference = \"warn\")",
        "start-up list: S-0-0121 is 1, expected 3; the drive is used nevertheless (on_difference = \"warn\")",
    ];
    assert_eq!(reports(&mut run), expected);
    assert_eq!(drive.run(&mut run, When::Cp3), None);
    assert_eq!(reports(&mut run), ["start-up list: 0 entries hold, 0 of them written"]);
    assert_eq!(drive.of("S-0-0121").data, [1, 0, 0, 0]);
}

#[test]
fn what_is_write_protected_for_good_keeps_the_drive_out_before_anything_is_written() {
    let mut drive = Drive::new(&[("S-0-0121", 1, OPEN), ("S-0-0122", 1, NEVER), ("S-0-0123", 1, CP4)]);
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "2", Write), ("S-0-0123", "2", Write)]);
    let expected = "S-0-0122 is 1, expected 2, and is write protected in every phase to come (by its attribute); S-0-0123 is 1, \
                    expected 2, and is write protected until CP4, where the axis may move (by its attribute)";
    assert_eq!(drive.run(&mut run, When::Cp2).as_deref(), Some(expected));
    assert_eq!(drive.of("S-0-0121").data, [1, 0, 0, 0]);
}

#[test]
fn what_the_drive_refuses_is_tried_after_the_others_and_then_ends_the_list() {
    let mut drive = Drive::new(&[("S-0-0091", 1, OPEN), ("S-0-0121", 1, OPEN)]);
    drive.of("S-0-0091").refuses = Some((refusal(0x7007), 1));
    let entries = [("S-0-0091", "5", Write), ("S-0-0121", "3", Write)];
    let mut run = list(&entries);
    assert_eq!(drive.run(&mut run, When::Cp2), None, "{:?}", drive.log);
    let writes: Vec<_> = drive.log.iter().filter(|line| line.starts_with("write")).collect();
    assert_eq!(
        writes,
        ["write S-0-0091 [5, 0, 0, 0]", "write S-0-0121 [3, 0, 0, 0]", "write S-0-0091 [5, 0, 0, 0]"]
    );
    drive.of("S-0-0091").data = vec![1, 0, 0, 0];
    drive.of("S-0-0091").refuses = Some((refusal(0x7007), 9));
    drive.of("S-0-0121").data = vec![1, 0, 0, 0];
    run.restart();
    let expected = "writing S-0-0091 = 5 (it is 1): the drive refuses the operation data with 0x7007: operation data is greater \
                    than the maximum; written before: S-0-0121";
    let failed = drive.run(&mut run, When::Cp2).expect("a failure");
    assert!(
        failed.starts_with(
            "writing S-0-0091 = 5 (it is 1): the drive refuses the operation data with 0x7007: "
        ),
        "{failed}"
    );
    assert!(failed.ends_with("; written before: S-0-0121"), "{failed} not as {expected}");
    assert_eq!(
        drive.log.iter().filter(|line| line.contains("write S-0-0091")).count(),
        4,
        "twice in each run"
    );
}

#[test]
fn a_value_that_the_drive_takes_and_does_not_keep_is_named() {
    let mut drive = Drive::new(&[("S-0-0121", 1, OPEN), ("S-0-0122", 1, OPEN)]);
    drive.of("S-0-0122").sticks = true;
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "2", Write)]);
    let expected = "the drive took S-0-0122 = 2 and has 1 afterwards; written before: S-0-0121, S-0-0122";
    assert_eq!(drive.run(&mut run, When::Cp2).as_deref(), Some(expected));
}

#[test]
fn a_value_that_is_changed_by_another_one_or_by_the_next_phase_is_named() {
    let mut drive = Drive::new(&[("S-0-0121", 3, OPEN), ("S-0-0122", 1, OPEN)]);
    drive.of("S-0-0122").changes = Some(("S-0-0121", vec![7, 0, 0, 0]));
    let mut run = list(&[("S-0-0121", "3", Write), ("S-0-0122", "2", Write)]);
    let expected = "S-0-0121 is 7, expected 3 after the other entries were written; before it was as expected; written before: \
                    S-0-0122";
    assert_eq!(drive.run(&mut run, When::Cp2).as_deref(), Some(expected));
    // Written in CP2, and lost on the way to CP3, where it is protected.
    let mut drive = Drive::new(&[("S-0-0121", 1, [false, true, true])]);
    let mut run = list(&[("S-0-0121", "3", Write)]);
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    drive.of("S-0-0121").data = vec![1, 0, 0, 0];
    let expected = "the drive took S-0-0121 = 3 and has 1 afterwards; written before: S-0-0121";
    assert_eq!(drive.run(&mut run, When::Cp3).as_deref(), Some(expected));
}

#[test]
fn values_are_those_of_the_attribute() {
    let mut drive = Drive::new(&[("S-0-0104", 150, OPEN), ("S-0-0121", 1, OPEN), ("S-0-0099", 0, OPEN)]);
    drive.of("S-0-0104").attribute = Some(unsigned().with_decimals(2));
    drive.of("S-0-0099").attribute = Some(unsigned().command());
    let mut run = list(&[("S-0-0104", "2.5", Write)]);
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    assert_eq!(drive.of("S-0-0104").data, [250, 0, 0, 0]);
    assert_eq!(reports(&mut run), ["start-up list: S-0-0104 was 1.50 and is set to 2.50"]);
    let fails =
        |drive: &mut Drive, id, text| drive.run(&mut list(&[(id, text, Write)]), When::Cp2).expect(id);
    assert_eq!(fails(&mut drive, "S-0-0121", "1.5"), "S-0-0121: `1.5` is not a whole number");
    assert_eq!(fails(&mut drive, "S-0-0121", "-1"), "S-0-0121: `-1` is not a number from 0 to 4294967295");
    let command = "S-0-0099: it is a procedure command, which is executed and has no value";
    assert_eq!(fails(&mut drive, "S-0-0099", "3"), command);
    assert!(
        fails(&mut drive, "P-0-0001", "3")
            .starts_with("P-0-0001: the drive refuses the operation data with 0x1001")
    );
}

#[test]
fn objects_have_the_type_of_the_list() {
    let mut drive = Drive::new(&[("6091:01", 1, OPEN), ("2000:00", 0, OPEN), ("1008:00", 0, OPEN)]);
    drive.held.values_mut().for_each(|held| held.attribute = None);
    drive.of("1008:00").data = b"drive\0\0".to_vec();
    let typed = |id: &str, text: &str, kind| StartupEntry { data_type: kind, ..entry(id, text, Write) };
    let entries = [
        typed("6091:01", "3", Some(Cia402Type::U32)),
        typed("2000:00", "hex:05000000", None),
        typed("1008:00", "drive", Some(Cia402Type::VisibleString)),
    ];
    let mut run = StartupRun::new(&entries);
    assert_eq!(drive.run(&mut run, When::Once), None);
    assert_eq!((drive.of("6091:01").data[0], drive.of("2000:00").data[0]), (3, 5));
    assert_eq!(
        reports(&mut run)[2],
        "start-up list: 3 entries hold, 2 of them written",
        "zeros fill up a text"
    );
    let mut run = StartupRun::new(&[typed("6091:01", "5", Some(Cia402Type::U16))]);
    let expected = "6091:01: the drive has 4 bytes, and the type `u16` has 2";
    assert_eq!(drive.run(&mut run, When::Once).as_deref(), Some(expected));
    drive.of("6091:01").refuses = Some((DirectFailure::Sdo(SdoFailure::Refused(AbortCode::READ_ONLY)), 9));
    let mut run = StartupRun::new(&[typed("6091:01", "5", Some(Cia402Type::U32))]);
    let failed = drive.run(&mut run, When::Once).expect("a failure");
    assert!(
        failed.starts_with("writing 6091:01 = 5 (it is 3): the drive refuses it with 0x06010002: "),
        "{failed}"
    );
}

#[test]
fn an_answer_that_is_lost_is_asked_for_once_more() {
    let mut drive = Drive::new(&[("S-0-0121", 3, OPEN)]);
    drive.lost = 1;
    let mut run = list(&[("S-0-0121", "3", Write)]);
    assert_eq!(drive.run(&mut run, When::Cp2), None);
    drive.lost = 2;
    run.restart();
    let expected = "S-0-0121: no handshake from the slave within 10 cycles";
    assert_eq!(drive.run(&mut run, When::Cp2).as_deref(), Some(expected));
}

#[test]
fn a_list_without_entries_is_done_at_once() {
    let mut run = list(&[]);
    run.begin(When::Cp2);
    assert!(run.is_done() && run.next().is_none() && run.take_reports().is_empty());
}

/// A file of a backup has the text of a drive that it is for, whatever bytes the drive has for its letters.
#[test]
fn text_in_latin_1_is_equal_to_the_text_of_the_list() {
    for text in ["Gr\u{f6}\u{df}e", "latin1:Gr\u{f6}\u{df}e", "hex:4772f6df65"] {
        let mut drive = Drive::new(&[("S-0-1300.0.5", 0, OPEN)]);
        let held = drive.of("S-0-1300.0.5");
        held.attribute = Some(Attribute::new(ItemLength::One, Format::Text).list());
        held.data = b"Gr\xF6\xDFe".to_vec();
        let mut run = list(&[("S-0-1300.0.5", text, OnDifference::Refuse)]);
        assert_eq!(drive.run(&mut run, When::Cp2), None, "{text}");
        let mut run = list(&[("S-0-1300.0.5", "Gr\u{f6}sse", OnDifference::Refuse)]);
        assert!(drive.run(&mut run, When::Cp2).is_some(), "another drive");
    }
}
