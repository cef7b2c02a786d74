use profile_generic::capture::{CaptureEdge as Edge, CaptureSource as Source};
use profile_generic::mode::OperatingMode;
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;

use super::*;
use crate::engine::access::Refusal;
use crate::mapping::{CaptureMode, DriveFacts, DriveProgram, Mapping, SercosAxis};

const REGISTRATION: CaptureKind = CaptureKind::new(Source::Registration1, Edge::Positive);
const OTHER_EDGE: CaptureKind = CaptureKind::new(Source::Registration1, Edge::Negative);
const HOME: CaptureKind = CaptureKind::new(Source::HomeSwitch, Edge::Positive);
const HOME_MARKER: CaptureKind = CaptureKind::new(Source::HomeSwitchMarkerPositive, Edge::Positive);

/// Element 3 of a word, and of a position at 0.0001 degree.
const WORD: Attribute = Attribute(0x7001_0001);
const PLACE: Attribute = Attribute(0x7422_0001);
const COMMAND: Attribute = Attribute(0x3009_0001);

/// A drive of 3 600 000 counts a turn that has answered for these IDNs, and lists them as configurable or not.
fn program(words: &[u16], places: &[u16], listed: bool) -> DriveProgram {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let axis = SercosAxis {
        modes: [OperatingMode::Position.into()].into_iter().collect(),
        captures: if listed { CaptureMode::Cyclic } else { CaptureMode::ServiceChannel },
        ..SercosAxis::default()
    };
    let mut facts = DriveFacts::new();
    for polarity in [43, 55, 85] {
        facts.note_data(Idn::standard(polarity), &[0, 0]);
    }
    for (block, value) in [(76, 0x42_u16), (44, 0x42), (160, 0x42), (86, 0)] {
        facts.note_data(Idn::standard(block), &value.to_le_bytes());
    }
    // The words and values of position control, beside what is to be captured.
    let cyclic = [134, 47, 135, 51, 40, 84].map(Idn::standard);
    let mut list: Vec<u8> = cyclic.iter().flat_map(|idn| idn.0.to_le_bytes()).collect();
    for (blocks, attribute) in [(words, WORD), (places, PLACE)] {
        for block in blocks {
            facts.note_attribute(Idn::standard(*block), attribute);
            list.extend(Idn::standard(*block).0.to_le_bytes());
        }
    }
    facts.note_attribute(Idn::standard(170), COMMAND);
    facts.note_data(Idn::standard(187), &list);
    facts.note_data(Idn::standard(188), &list);
    mapping.sercos_program(&axis, &facts).expect("a program")
}

fn probe(listed: bool) -> DriveProgram {
    program(&[179, 405], &[130, 131], listed)
}

/// The unit with its drive, a cycle of a millisecond at a time.
struct Rig {
    unit: CaptureUnit,
    program: DriveProgram,
    feedback: Vec<u8>,
    at: u64,
}

impl Rig {
    fn new(program: DriveProgram) -> Self {
        let feedback = vec![0; usize::from(program.telegram.feedback_bytes)];
        Self { unit: CaptureUnit::default(), program, feedback, at: 1_000_000 }
    }

    /// Puts a value where the telegram has it.
    fn set(&mut self, block: u16, value: i32) {
        let mut offset = 0;
        for idn in self.program.telegram.feedback.iter().filter_map(|item| item.idn()) {
            let wide = matches!(idn.block(), 51 | 40 | 130..=133 | 440);
            let len = if wide { 4 } else { 2 };
            if idn == Idn::standard(block) {
                self.feedback[offset..offset + len].copy_from_slice(&value.to_le_bytes()[..len]);
                return;
            }
            offset += len;
        }
        panic!("S-0-{block:04} is not in {:?}", self.program.telegram.feedback);
    }

    /// A cycle with the axis at a position in counts of the drive. Returns what was captured, and the enable.
    fn cycle(&mut self, counts: i64, wanted: &[CaptureKind]) -> (Vec<CaptureResult>, bool) {
        self.at += 1_000_000;
        let program = self.program.captures();
        let position = Position(counts * 2_500 / 9);
        self.unit.sample(program, &self.feedback, position, MonotonicTime(self.at));
        let results = core::iter::from_fn(|| self.unit.poll()).collect();
        self.unit.want(program, wanted.iter().copied().collect());
        let mut telegram = vec![0xA5; usize::from(self.program.telegram.command_bytes)];
        self.unit.encode(program, &mut telegram);
        (results, telegram.last_chunk() == Some(&[1, 0]))
    }

    /// The drive answers the next access.
    fn answer(&mut self, result: Result<&[u8], AccessFailure>) -> Option<CaptureAccess> {
        let program = self.program.captures();
        let (_, access, generation) = self.unit.access(program)?;
        self.unit.sent(access);
        assert_eq!(self.unit.access(program).map(|next| next.1), None, "one at a time");
        self.unit.answer(program, access, generation, result);
        Some(access)
    }

    fn checks(&self, kind: CaptureKind) -> bool {
        self.unit.checking(self.program.captures()).contains(kind)
    }
}

fn refused() -> AccessFailure {
    AccessFailure::Refused(Refusal::Other)
}

#[test]
fn a_latch_in_the_telegrams_rises_once_the_command_works_and_rises_again_after_an_edge() {
    let mut rig = Rig::new(probe(true));
    assert!(!rig.cycle(0, &[REGISTRATION]).1, "S-0-0170 is not in process");
    let access = rig.unit.access(rig.program.captures()).expect("an access");
    assert_eq!((access.0.item, access.0.operation), (Idn::standard(170).into(), Operation::Start));
    assert_eq!(rig.answer(Ok(&[])), Some(CaptureAccess::Start));
    let mut log = Vec::new();
    for counts in 1..12 {
        if counts == 5 {
            // 4.5 counts: half way between the telegrams.
            rig.set(130, 4);
            rig.set(179, 1);
        }
        if !rig.cycle(counts, &[REGISTRATION]).1 {
            rig.set(179, 0);
        }
        log.push((rig.unit.gates[0].phase, rig.checks(REGISTRATION)));
    }
    use Phase::{Armed, Falling, Rising};
    let expected = [
        (Rising, false),
        (Armed, true),
        (Armed, true),
        (Armed, true),
        (Falling, false),
        (Falling, false),
        (Rising, false),
        (Rising, false),
        (Armed, true),
    ];
    assert_eq!(log[..9], expected);
    let mut rig = Rig::new(probe(true));
    rig.cycle(0, &[REGISTRATION, OTHER_EDGE]);
    rig.answer(Ok(&[]));
    for counts in 1..5 {
        rig.cycle(10 * counts, &[REGISTRATION, OTHER_EDGE]);
    }
    rig.set(131, 45);
    rig.set(179, 0b10);
    let at = rig.at;
    let (results, enable) = rig.cycle(50, &[REGISTRATION]);
    assert_eq!(results.len(), 1);
    assert_eq!(
        (results[0].edge, results[0].position, results[0].status),
        (Edge::Negative, Position(12_500), CaptureStatus::Captured)
    );
    let half_way = MonotonicTime(at + 500_000);
    assert!(results[0].at.since(half_way).as_nanos().abs() < 1_000, "{:?} of {at}", results[0].at);
    assert!(enable, "the other edge is still armed");
    assert!(rig.checks(REGISTRATION) && !rig.checks(OTHER_EDGE));
    // Nothing is wanted: the enable falls, and nothing is captured any more.
    rig.set(179, 0b11);
    assert_eq!(rig.cycle(60, &[]).0.len(), 1, "it was still wanted when it came");
    assert_eq!(rig.cycle(70, &[]), (vec![], false));
    assert_eq!(rig.cycle(80, &[REGISTRATION]), (vec![], false), "not before the drive shows no edge");
}

#[test]
fn a_latch_over_the_service_channel_goes_the_same_way() {
    let mut rig = Rig::new(probe(false));
    assert_eq!(rig.program.telegram.feedback.len(), 4, "nothing more in the telegrams");
    rig.cycle(0, &[REGISTRATION]);
    assert_eq!(rig.answer(Ok(&[])), Some(CaptureAccess::Start));
    rig.cycle(10, &[REGISTRATION]);
    assert_eq!(rig.answer(Ok(&[])), Some(CaptureAccess::Enable(0, true)));
    assert!(rig.checks(REGISTRATION));
    assert_eq!(rig.answer(Ok(&[0, 0])), Some(CaptureAccess::Word(0)));
    rig.cycle(20, &[REGISTRATION]);
    rig.cycle(30, &[REGISTRATION]);
    let at = rig.at;
    assert_eq!(rig.answer(Ok(&[1, 0])), Some(CaptureAccess::Word(0)));
    assert!(!rig.checks(REGISTRATION));
    rig.cycle(40, &[REGISTRATION]);
    assert_eq!(rig.answer(Ok(&25_i32.to_le_bytes())), Some(CaptureAccess::Value(0)));
    let (results, _) = rig.cycle(50, &[REGISTRATION]);
    let position = Position(25 * 2_500 / 9);
    assert_eq!((results[0].position, results[0].status), (position, CaptureStatus::Captured));
    assert!(
        results[0].at.since(MonotonicTime(at - 500_000)).as_nanos().abs() < 100,
        "{:?} of {at}",
        results[0].at
    );
    // Armed again: down, up, and polled anew.
    let accesses: Vec<_> = (0..3)
        .filter_map(|_| {
            let next = rig.answer(Ok(&[0, 0]));
            rig.cycle(60, &[REGISTRATION]);
            next
        })
        .collect();
    assert_eq!(
        accesses,
        [CaptureAccess::Enable(0, false), CaptureAccess::Enable(0, true), CaptureAccess::Word(0)]
    );
}

#[test]
fn what_the_drive_refuses_is_told_once_and_not_tried_again() {
    for (listed, before) in [(true, 0), (false, 0), (false, 1), (false, 2), (false, 3)] {
        let mut rig = Rig::new(probe(listed));
        rig.cycle(0, &[REGISTRATION]);
        let good: [&[u8]; 3] = [&[], &[], &[1, 0]];
        for bytes in &good[..before] {
            rig.answer(Ok(bytes)).expect("an access");
            rig.cycle(0, &[REGISTRATION]);
        }
        rig.answer(Err(refused())).expect("an access");
        let (results, _) = rig.cycle(0, &[REGISTRATION]);
        assert_eq!(
            results.iter().map(|result| result.status).collect::<Vec<_>>(),
            [CaptureStatus::Failed],
            "{listed} {before}"
        );
        assert!(!rig.checks(REGISTRATION));
        for _ in 0..5 {
            let access = rig.answer(Ok(&[]));
            assert!(matches!(access, None | Some(CaptureAccess::Enable(0, false))), "{access:?}");
            assert_eq!(rig.cycle(0, &[REGISTRATION]), (vec![], false));
        }
        // Armed anew it is tried anew.
        rig.cycle(0, &[]);
        rig.cycle(0, &[REGISTRATION]);
        rig.cycle(0, &[REGISTRATION]);
        let tried = rig.unit.access(rig.program.captures()).is_some() || rig.unit.gates[0].is_on();
        assert!(tried, "{listed} {before}");
    }
}

#[test]
fn answers_of_before_a_loss_do_not_count() {
    let mut rig = Rig::new(probe(false));
    rig.cycle(0, &[REGISTRATION]);
    let (_, access, generation) = rig.unit.access(rig.program.captures()).expect("an access");
    rig.unit.sent(access);
    rig.unit.restart();
    rig.unit.answer(rig.program.captures(), access, generation, Ok(&[]));
    assert_eq!(rig.unit.command, Command::Idle);
    assert_eq!(rig.unit.access(rig.program.captures()).map(|next| next.1), Some(CaptureAccess::Start));
}

#[test]
fn a_drive_has_what_it_answers_for() {
    let kinds = |program: &DriveProgram| program.captures().kinds();
    assert!(kinds(&program(&[], &[], true)).is_empty());
    assert!(kinds(&program(&[179, 405], &[130], true)).contains(REGISTRATION));
    assert!(!kinds(&program(&[179, 405], &[130], true)).contains(OTHER_EDGE));
    assert!(!kinds(&program(&[405], &[130], true)).contains(REGISTRATION), "no status");
    assert!(kinds(&program(&[400], &[], true)).contains(HOME));
    assert!(!kinds(&program(&[400], &[], false)).contains(HOME), "only in the telegram");
    assert!(!kinds(&program(&[400], &[], true)).contains(HOME_MARKER), "no marker");
    assert!(kinds(&program(&[400, 442], &[440], true)).contains(HOME_MARKER));
}

#[test]
fn home_switch_and_marker_in_one_telegram_are_told_as_unknown() {
    let rows = [
        ("after it", [(1, 0), (1, 1)], CaptureStatus::Captured),
        ("with it", [(1, 1), (1, 1)], CaptureStatus::Ambiguous),
        ("two after it", [(1, 0), (1, 2)], CaptureStatus::Ambiguous),
        ("before and after", [(0, 1), (1, 1)], CaptureStatus::Captured),
    ];
    for (what, words, expected) in rows {
        let mut rig = Rig::new(program(&[400, 442], &[440], true));
        rig.cycle(0, &[HOME_MARKER]);
        rig.cycle(10, &[HOME_MARKER]);
        assert!(rig.checks(HOME_MARKER));
        let mut results = Vec::new();
        for (counts, (switch, markers)) in (2..).zip(words) {
            rig.set(400, switch);
            rig.set(442, markers);
            rig.set(440, 10 * markers + 15);
            results.extend(rig.cycle(10 * counts, &[HOME_MARKER]).0);
        }
        if what == "before and after" {
            assert_eq!(results, [], "the marker before does not count");
            rig.set(442, 2);
            rig.set(440, 35);
            results = rig.cycle(40, &[HOME_MARKER]).0;
        }
        assert_eq!(results.iter().map(|result| result.status).collect::<Vec<_>>(), [expected], "{what}");
    }
}
