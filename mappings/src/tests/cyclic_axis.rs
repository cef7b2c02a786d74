//! Positions of cyclic axes and changes of the position reference, through both programs of an axis.

use super::*;
use crate::{CipTrackers, PolarityEffect};

/// A cycle of 360000 counts, one turn.
const UNWIND: i64 = 360_000;

fn cyclic() -> CipScaling {
    CipScaling { unwind: Some(UNWIND), counts_per_unit: UNWIND, ..rotary_counts() }
}

fn command(program: &CipProgram, at: (i64, Option<i64>), reference: i64, trackers: &mut CipTrackers) -> i64 {
    let values = CommandValues {
        position: Some(CommandPosition::Integer(i32::try_from(at.0).unwrap())),
        unwind_count: at.1.map(|cycles| i32::try_from(cycles).unwrap()),
        ..CommandValues::default()
    };
    let mut command = AxisCommand::default();
    let report = program.decode(&values, reference, trackers, &mut command);
    assert!(report.is_clean() || report.unmapped == 0);
    program.counts(command.position.0).value
}

#[test]
fn the_unwind_count_says_how_many_cycles_a_command_leads_over() {
    let program = shipped().cip_program(&cyclic()).unwrap();
    let mut trackers = program.trackers();
    // The axis stands at 5 cycles and 10 counts; the controller calls that cycle 100.
    trackers.start(5 * UNWIND + 10, 0);
    let mut at = |position, cycles| command(&program, (position, cycles), 0, &mut trackers);
    assert_eq!(at(20, Some(100)), 5 * UNWIND + 20, "no jump by the 95 cycles that they count apart");
    assert_eq!(at(20, Some(103)), 8 * UNWIND + 20, "three cycles at once");
    assert_eq!(at(UNWIND - 1, Some(96)), 2 * UNWIND - 1, "and back across zero");
    assert_eq!(at(3, None), 2 * UNWIND + 3, "without a count the short way");
    assert_eq!(at(4, Some(97)), 2 * UNWIND + 4, "and with it again");
}

#[test]
fn a_change_of_reference_is_no_motion_however_far_it_leads() {
    // Also by more than half a cycle, or half the range of a DINT, where the short way leads elsewhere.
    for unwind in [Some(UNWIND), None] {
        let program = shipped().cip_program(&CipScaling { unwind, ..cyclic() }).unwrap();
        for displacement in [1, -1, 179_999, 180_001, -250_000, 359_999, 2_147_483_000, -2_147_483_648_i64] {
            for count in [false, true] {
                let mut trackers = program.trackers();
                trackers.start(1_000, 0);
                let see = |counts: i64| match unwind {
                    Some(cycle) => (counts.rem_euclid(cycle), count.then_some(counts.div_euclid(cycle))),
                    None => (
                        i64::from(counts.to_le_bytes()[..4].try_into().map(i32::from_le_bytes).unwrap()),
                        None,
                    ),
                };
                let mut at = |counts: i64, reference| {
                    command(&program, see(counts + reference), reference, &mut trackers)
                };
                assert_eq!(at(1_010, 0), 1_010);
                assert_eq!(at(1_020, displacement), 1_020, "{unwind:?} {displacement} {count}");
                assert_eq!(at(1_030, displacement), 1_030);
                assert_eq!(at(1_040, 2 * displacement), 1_040, "and once more");
                assert_eq!(at(1_050, 0), 1_050, "and back");
            }
        }
    }
}

/// What the device shows of a position: it, and the count of cycles.
fn seen(image: &DriveImage) -> (i64, i64) {
    let unwind = i64::from(image.unwind.unwrap());
    (image.position.rem_euclid(unwind), image.position.div_euclid(unwind))
}

/// The controller's position through command program, drive telegram and feedback program, and back.
struct Chain {
    north: CipProgram,
    trackers: CipTrackers,
    south: DriveProgram,
    cached: crate::CachedStatus,
    feedback: AxisFeedback,
}

impl Chain {
    fn new(unwind: i64, inverted: bool) -> Self {
        let mapping = shipped();
        let scaling =
            CipScaling { unwind: Some(unwind), counts_per_unit: 360_000, inverted, ..rotary_counts() };
        let axis = rotary_axis(true);
        let south = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let north = mapping.cip_program(&scaling).unwrap();
        let mut trackers = north.trackers();
        trackers.start(0, 0);
        let cached = south.cached_status();
        Self { north, trackers, south, cached, feedback: AxisFeedback::default() }
    }

    /// Where the controller sees the axis after a drive without any lag was commanded to `at`.
    fn pass(&mut self, at: (i64, Option<i64>)) -> (i64, i64) {
        let values = CommandValues {
            position: Some(CommandPosition::Integer(i32::try_from(at.0).unwrap())),
            unwind_count: at.1.and_then(|cycles| i32::try_from(cycles).ok()),
            ..CommandValues::default()
        };
        let mut command = AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() };
        self.north.decode(&values, 0, &mut self.trackers, &mut command);
        let mut telegram = [0; 12];
        let mut report = ConversionReport::default();
        self.south.encode(&command, Action::Enable, 0, 0, &mut telegram, &mut report);
        // S-0-0047 follows the control word, S-0-0051 the status word.
        let mut back = [0; 12];
        back[2..6].copy_from_slice(&telegram[2..6]);
        self.south.decode(&back, false, &mut self.feedback, &mut self.cached, &mut report).unwrap();
        let mut image = DriveImage::default();
        self.north.drive_image(&self.feedback, &FaultSet::new(), &mut Told::default(), &mut image);
        seen(&image)
    }
}

#[test]
fn millions_of_cycles_lose_no_count_in_either_direction() {
    for (unwind, inverted) in [(97, false), (97, true), (1_000, false), (777, true)] {
        let mut chain = Chain::new(unwind, inverted);
        // The first command says which cycle the controller calls 0.
        assert_eq!(chain.pass((0, Some(0))), (0, 0));
        let mut whole: i64 = 0;
        let mut cycles: i64 = 0;
        // Somewhat less than half a turn between two telegrams.
        let step = 170_003;
        for direction in [1, -1, -1, 1] {
            for _ in 0..6_000 {
                whole += direction * step;
                let at = (whole.rem_euclid(unwind), whole.div_euclid(unwind));
                assert_eq!(chain.pass((at.0, Some(at.1))), at, "{unwind} {whole}");
                cycles += step / unwind;
            }
        }
        assert_eq!(whole, 0);
        assert!(cycles > 2_000_000, "{cycles}");
    }
}

#[test]
fn millions_of_turns_lose_no_count_of_the_drive_in_either_direction() {
    for inverted in [false, true] {
        let mut chain = Chain::new(UNWIND, inverted);
        assert_eq!(chain.pass((0, Some(0))), (0, 0));
        let mut whole: i64 = 0;
        // 249 turns and three counts; the drive's own modulo of 512 turns allows less than half of that between two telegrams.
        let step = 249 * UNWIND + 3;
        for direction in [1, -1, -1, 1] {
            for _ in 0..6_000 {
                whole += direction * step;
                let at = (whole.rem_euclid(UNWIND), whole.div_euclid(UNWIND));
                assert_eq!(chain.pass((at.0, Some(at.1))), at, "{whole}");
            }
            assert!(whole == 0 || whole.abs() > 1_400_000 * UNWIND, "{whole}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_short_way_needs_no_count(unwind in 1_000_i64..2_000_000, inverted: bool,
        parts in proptest::collection::vec(-49_i64..50, 200)) {
        let mut chain = Chain::new(unwind, inverted);
        prop_assert_eq!(chain.pass((0, None)), (0, 0));
        let mut whole: i64 = 0;
        for part in parts.iter().cycle().take(2_000) {
            whole += unwind.min(360_000) * part / 100;
            let at = (whole.rem_euclid(unwind), whole.div_euclid(unwind));
            prop_assert_eq!(chain.pass((at.0, None)), at);
        }
    }
}

/// Table 5-2.15: what the controller sets for one direction becomes the drive's limit of the other.
#[test]
fn inverted_polarity_exchanges_limits_and_turns_signals() {
    let mapping = shipped();
    let table = |inverted| mapping.attribute_table(&CipScaling { inverted, ..rotary_counts() }).unwrap();
    let (normal, inverted) = (table(false), table(true));
    let parameter = |table: &AttributeTable, id: u16, value: f32| {
        let entry = table.get(id).unwrap();
        let Backing::Parameter { parameter, .. } = entry.backing else { panic!("{id}") };
        let generic = entry.to_generic(&value.to_le_bytes()).unwrap();
        let mut back = [0; 8];
        entry.from_generic(generic, &mut back).unwrap();
        assert_eq!(back[..4], value.to_le_bytes(), "{id}");
        (parameter, generic)
    };
    for (id, value) in [(448, 7.0), (449, -3.0), (473, 20.0), (474, -10.0), (504, 150.0), (505, -80.0)] {
        let PolarityEffect::Swap(other) = mapping.dictionaries.cip.attribute_by_id(id).unwrap().polarity
        else {
            panic!("{id}")
        };
        let (own, straight) = parameter(&normal, id, value);
        let (turned, generic) = parameter(&inverted, id, value);
        assert_eq!(turned, parameter(&normal, other, -value).0, "{id}");
        assert_ne!(turned, own);
        assert_eq!(generic, -straight, "{id}");
    }
    for (id, other) in [(485, 486), (486, 485)] {
        let (_, straight) = parameter(&normal, id, 50.0);
        let (turned, generic) = parameter(&inverted, id, 50.0);
        assert_eq!(turned, parameter(&normal, other, 50.0).0);
        assert_eq!(generic, straight, "magnitudes stay so");
    }
    let actual = |table: &AttributeTable, id: u16| {
        let mut bytes = [0; 8];
        table.get(id).unwrap().from_generic(2_000_000_000, &mut bytes).unwrap();
        bytes
    };
    for id in [430, 434] {
        let value = |table| i32::from_le_bytes(actual(table, id)[..4].try_into().unwrap());
        assert_eq!((value(&normal), value(&inverted)), (2_000_000, -2_000_000), "{id}");
    }
}
