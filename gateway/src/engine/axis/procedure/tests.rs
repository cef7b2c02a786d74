use super::*;
use profile_generic::mode::OperatingMode;
use profile_sercos::wire::idn::Idn;
use std::fmt::Write as _;

use crate::engine::access::Refusal;
use crate::mapping::Item;

const BY_DRIVE: ModeSelection = ModeSelection::by_drive(OperatingMode::Homing);

fn procedures() -> Vec<Procedure> {
    let position = ModeSelection::from(OperatingMode::Position);
    let commands = |blocks: &[u16]| {
        ProcedureBy::Commands(blocks.iter().map(|block| Item::from(Idn::standard(*block))).collect())
    };
    vec![
        Procedure { selection: BY_DRIVE, led_in: None, by: commands(&[148]) },
        Procedure {
            selection: OperatingMode::Homing.into(),
            led_in: Some(position),
            by: commands(&[146, 171, 172]),
        },
    ]
}

const GOOD: Surroundings = Surroundings {
    now: MonotonicTime(0),
    operating: true,
    stands: true,
    follows: true,
    shown: Some(ModeSelection {
        mode: OperatingMode::Position,
        interpolation: profile_generic::mode::InterpolationSource::Controller,
    }),
    status: 0,
};

/// What a drive answers to an access.
#[derive(Debug, Clone, Copy)]
enum Reply {
    /// Taken, or done.
    Well,
    /// Still in process.
    Busy,
    /// The command has failed.
    Error,
    /// The access is refused.
    Refused,
}

fn reply(unit: &mut ProcedureUnit, reply: Reply, now: MonotonicTime) -> Option<(Item, String, bool)> {
    let all = procedures();
    let (request, access, generation) = unit.access(&all, now)?;
    unit.sent(access);
    assert_eq!(unit.access(&all, now), None, "one at a time");
    let result = match reply {
        Reply::Well => Ok(Progress::Done),
        Reply::Busy => Ok(Progress::InProcess),
        Reply::Error => Ok(Progress::Failed),
        Reply::Refused => Err(AccessFailure::Refused(Refusal::Other)),
    };
    assert!(!unit.answer(&all, access, generation.wrapping_add(1), result, now), "of another life");
    let shifted = unit.answer(&all, access, generation, result, now);
    Some((request.item, format!("{access:?}"), shifted))
}

/// Replies to each access in turn, the last one for ever; what was asked, and how it ended.
fn run(wanted: usize, replies: &[Reply], around: Surroundings) -> String {
    let all = procedures();
    let mut unit = ProcedureUnit::default();
    let (mut text, mut at) = (String::new(), 0);
    let mut now = MonotonicTime(0);
    for _ in 0..40 {
        now = now + ASK_EVERY;
        unit.want(Some(&all[wanted]), &Surroundings { now, ..around });
        let next = replies.get(at).or(replies.last()).copied().unwrap_or(Reply::Well);
        if let Some((idn, access, shifted)) = reply(&mut unit, next, now) {
            at += 1;
            let shifted = if shifted { " shifted" } else { "" };
            writeln!(text, "  {access} {idn} {next:?}{shifted} -> {:?}", unit.stage).unwrap();
        }
    }
    writeln!(text, "  {:?} {:?}", unit.stage, unit.status()).unwrap();
    text
}

#[test]
fn every_course() {
    use Reply::{Busy, Error, Refused, Well};
    let mut text = String::new();
    for (name, wanted, replies, around) in [
        ("drive, all well", 0, &[Well, Well, Busy, Busy, Well][..], GOOD),
        ("drive, error", 0, &[Well, Well, Busy, Error, Well], GOOD),
        ("drive, not started", 0, &[Well, Refused, Well], GOOD),
        ("drive, not cleared", 0, &[Refused, Well], GOOD),
        ("drive, status refused", 0, &[Well, Well, Refused, Well], GOOD),
        ("drive, never cancelled", 0, &[Well, Well, Well, Refused], GOOD),
        ("controller, all well", 1, &[Well], GOOD),
        ("controller, never stands", 1, &[Well], Surroundings { stands: false, ..GOOD }),
        ("controller, second fails", 1, &[Well, Well, Well, Well, Well, Error, Well], GOOD),
        ("controller, other mode", 1, &[Well], Surroundings { shown: None, ..GOOD }),
        ("without torque", 0, &[Well], Surroundings { operating: false, ..GOOD }),
        ("does not follow", 0, &[Well], Surroundings { follows: false, ..GOOD }),
    ] {
        writeln!(text, "{name}").unwrap();
        text.push_str(&run(wanted, replies, around));
    }
    insta::assert_snapshot!(text);
}

/// Nothing begins before everything that a drive may have brought with it is cancelled, the last command first.
#[test]
fn what_is_left_over_is_cancelled_first() {
    let all = procedures();
    let mut unit = ProcedureUnit::default();
    unit.restart(&all);
    let mut asked = Vec::new();
    for replies in [Reply::Well, Reply::Refused, Reply::Well, Reply::Well] {
        unit.want(Some(&all[0]), &GOOD);
        assert_eq!((unit.selection(), unit.leads()), (None, false));
        asked.push(reply(&mut unit, replies, GOOD.now).unwrap().0.to_string());
    }
    assert_eq!(asked, ["S-0-0172", "S-0-0171", "S-0-0146", "S-0-0148"]);
    assert_eq!(reply(&mut unit, Reply::Well, GOOD.now), None);
    unit.want(Some(&all[0]), &GOOD);
    assert_eq!(unit.selection(), Some(BY_DRIVE));
}

/// At every point of its course: dropping it, and losing the operation of the drive, end with everything cancelled.
#[test]
fn it_can_be_ended_at_any_point() {
    let all = procedures();
    for procedure in &all {
        for after in 0..12 {
            for dropped in [true, false] {
                let mut unit = ProcedureUnit::default();
                let mut now = MonotonicTime(0);
                for _ in 0..after {
                    now = now + ASK_EVERY;
                    unit.want(Some(procedure), &Surroundings { now, ..GOOD });
                    reply(&mut unit, Reply::Well, now);
                }
                let mut set: Vec<Item> = Vec::new();
                for _ in 0..20 {
                    now = now + FOLLOW_TIME_OUT;
                    let around = Surroundings { now, operating: dropped, follows: dropped, ..GOOD };
                    unit.want((!dropped).then_some(procedure), &around);
                    if let Some((idn, access, _)) = reply(&mut unit, Reply::Well, now) {
                        assert!(access.starts_with("Cancel"), "{access}");
                        set.push(idn);
                    }
                }
                assert!(set.len() <= procedure.commands().len(), "each once: {set:?}");
                assert!(
                    set.is_empty() || set.last() == procedure.commands().first(),
                    "to the first: {set:?}"
                );
                assert!(!unit.leads(), "{procedure:?} {after} {dropped}: {:?}", unit.stage);
                if dropped {
                    assert_eq!(unit.selection(), None);
                }
            }
        }
    }
}

#[test]
fn it_is_asked_for_once() {
    let all = procedures();
    let mut unit = ProcedureUnit::default();
    let mut starts = 0;
    for turn in 0..200_u64 {
        let now = MonotonicTime(turn * 10_000_000);
        // No longer wanted for a moment, in the middle.
        let wanted = (turn != 100).then_some(&all[0]);
        unit.want(wanted, &Surroundings { now, ..GOOD });
        if let Some((_, access, _)) = reply(&mut unit, Reply::Well, now) {
            starts += usize::from(access.starts_with("Start"));
        }
    }
    assert_eq!(starts, 2);
    assert!(unit.status().contains(StatusBits::HOMED));
    unit.lose_reference();
    assert!(!unit.status().contains(StatusBits::HOMED));
}
