use std::fmt::Write as _;

use super::*;
use AxisEvent as E;
use AxisState as S;

const EVENTS: [AxisEvent; 22] = [
    E::PowerUp,
    E::SelfTestComplete,
    E::InitializationFault,
    E::InitializationComplete,
    E::BusUp,
    E::BusDown,
    E::StartInhibit,
    E::InhibitsCleared,
    E::Enable,
    E::Disable,
    E::Test,
    E::StartComplete,
    E::StopComplete,
    E::TestComplete,
    E::Shutdown,
    E::ShutdownReset,
    E::Abort,
    E::MajorFault,
    E::FaultReset,
    E::Reconnection,
    E::ConnectionClose,
    E::ConnectionLoss,
];

const SYMBOLS: [&str; 5] = ["BU", "SD", "IP", "SI", "flying"];

fn conditions(bits: u8) -> AxisConditions {
    AxisConditions {
        bus_up: bits & 1 != 0,
        shutdown: bits & 2 != 0,
        in_process: bits & 4 != 0,
        start_inhibited: bits & 8 != 0,
        flying_start: bits & 16 != 0,
    }
}

/// The condition column of a row.
type Condition = fn(&AxisConditions) -> bool;

/// A row of the standard: state (`None` is Any State), events, condition, next state.
type Row = (Option<AxisState>, &'static [AxisEvent], Condition, AxisState);

const ANY: Condition = |_| true;
const SD: Condition = |c| c.shutdown;
const NO_SD: Condition = |c| !c.shutdown;
const NO_SD_NO_BU: Condition = |c| !c.shutdown && !c.bus_up;
const NO_SD_BU_SI: Condition = |c| !c.shutdown && c.bus_up && c.start_inhibited;
const NO_SD_BU_NO_SI: Condition = |c| !c.shutdown && c.bus_up && !c.start_inhibited;
const NO_SD_SI: Condition = |c| !c.shutdown && c.start_inhibited;
const NO_SD_NO_SI: Condition = |c| !c.shutdown && !c.start_inhibited;
const NO_SI: Condition = |c| !c.start_inhibited;
const SI: Condition = |c| c.start_inhibited;
const IP: Condition = |c| c.in_process;
const NO_IP: Condition = |c| !c.in_process;
const NO_SD_FLYING: Condition = |c| !c.shutdown && c.flying_start;

/// Table 5-2.97, row by row.
const ACTIVE: &[Row] = &[
    (Some(S::Off), &[E::PowerUp], ANY, S::SelfTest),
    (Some(S::SelfTest), &[E::SelfTestComplete], ANY, S::Initializing),
    (Some(S::Initializing), &[E::InitializationFault], ANY, S::MajorFaulted),
    (Some(S::Initializing), &[E::InitializationComplete], ANY, S::PreCharge),
    (Some(S::Shutdown), &[E::MajorFault, E::Abort], ANY, S::MajorFaulted),
    (Some(S::Shutdown), &[E::ShutdownReset], ANY, S::PreCharge),
    (Some(S::PreCharge), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::PreCharge), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::PreCharge), &[E::BusUp], ANY, S::Stopped),
    (Some(S::StartInhibited), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::StartInhibited), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::StartInhibited), &[E::InhibitsCleared], ANY, S::Stopped),
    (Some(S::MajorFaulted), &[E::FaultReset], SD, S::Shutdown),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD_NO_BU, S::PreCharge),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD_BU_SI, S::StartInhibited),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD_BU_NO_SI, S::Stopped),
    (Some(S::MajorFaulted), &[E::Reconnection], ANY, S::Initializing),
    (Some(S::Stopped), &[E::BusDown], ANY, S::PreCharge),
    (Some(S::Stopped), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::Stopped), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::Stopped), &[E::StartInhibit], ANY, S::StartInhibited),
    (Some(S::Stopped), &[E::Enable], ANY, S::Starting),
    (Some(S::Stopped), &[E::Test], ANY, S::Starting),
    (Some(S::Starting), &[E::Shutdown], ANY, S::Stopping),
    (Some(S::Starting), &[E::MajorFault, E::Abort], ANY, S::Aborting),
    (Some(S::Starting), &[E::Disable], ANY, S::Stopping),
    (Some(S::Starting), &[E::StartComplete], NO_IP, S::Running),
    (Some(S::Starting), &[E::StartComplete], IP, S::Testing),
    (Some(S::Stopping), &[E::StopComplete], NO_SD, S::Stopped),
    (Some(S::Stopping), &[E::StopComplete], SD, S::Shutdown),
    (Some(S::Stopping), &[E::MajorFault], ANY, S::Aborting),
    // Without SD by the text of clause 5-2.6.2.13.
    (Some(S::Stopping), &[E::Enable], NO_SD_FLYING, S::Starting),
    (Some(S::Aborting), &[E::StopComplete], ANY, S::MajorFaulted),
    (Some(S::Aborting), &[E::FaultReset], ANY, S::Stopping),
    (Some(S::Testing), &[E::Shutdown], ANY, S::Stopping),
    (Some(S::Testing), &[E::MajorFault, E::Abort], ANY, S::Aborting),
    (Some(S::Testing), &[E::Disable], ANY, S::Stopping),
    (Some(S::Testing), &[E::TestComplete], ANY, S::Stopping),
    (Some(S::Running), &[E::Shutdown], ANY, S::Stopping),
    (Some(S::Running), &[E::MajorFault, E::Abort], ANY, S::Aborting),
    (Some(S::Running), &[E::Disable], ANY, S::Stopping),
    (None, &[E::ConnectionClose], ANY, S::Initializing),
    (None, &[E::ConnectionLoss], ANY, S::MajorFaulted),
];

/// Table 5-2.99, row by row.
const FEEDBACK_ONLY: &[Row] = &[
    (Some(S::Off), &[E::PowerUp], ANY, S::SelfTest),
    (Some(S::SelfTest), &[E::SelfTestComplete], ANY, S::Initializing),
    (Some(S::Initializing), &[E::InitializationFault], ANY, S::MajorFaulted),
    (Some(S::Initializing), &[E::InitializationComplete], ANY, S::StartInhibited),
    (Some(S::Shutdown), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::Shutdown), &[E::ShutdownReset], ANY, S::Running),
    (Some(S::StartInhibited), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::StartInhibited), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::StartInhibited), &[E::InhibitsCleared], ANY, S::Running),
    (Some(S::MajorFaulted), &[E::FaultReset], SD, S::Shutdown),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD_SI, S::StartInhibited),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD_NO_SI, S::Running),
    (Some(S::MajorFaulted), &[E::Reconnection], ANY, S::Initializing),
    (Some(S::Running), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::Running), &[E::MajorFault], ANY, S::MajorFaulted),
    (None, &[E::ConnectionClose], ANY, S::Initializing),
    (None, &[E::ConnectionLoss], ANY, S::MajorFaulted),
];

/// Table 5-2.100, row by row.
const CONVERTER: &[Row] = &[
    (Some(S::Off), &[E::PowerUp], ANY, S::SelfTest),
    (Some(S::SelfTest), &[E::SelfTestComplete], ANY, S::Initializing),
    (Some(S::Initializing), &[E::InitializationFault], ANY, S::MajorFaulted),
    (Some(S::Initializing), &[E::InitializationComplete], ANY, S::PreCharge),
    (Some(S::Shutdown), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::Shutdown), &[E::ShutdownReset], ANY, S::PreCharge),
    (Some(S::StartInhibited), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::StartInhibited), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::StartInhibited), &[E::InhibitsCleared], ANY, S::PreCharge),
    (Some(S::PreCharge), &[E::StartInhibit], ANY, S::StartInhibited),
    (Some(S::PreCharge), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::PreCharge), &[E::MajorFault], ANY, S::MajorFaulted),
    (Some(S::PreCharge), &[E::BusUp], ANY, S::Running),
    (Some(S::MajorFaulted), &[E::FaultReset], SD, S::Shutdown),
    (Some(S::MajorFaulted), &[E::FaultReset], NO_SD, S::PreCharge),
    (Some(S::MajorFaulted), &[E::Reconnection], ANY, S::Initializing),
    (Some(S::Running), &[E::BusDown], ANY, S::PreCharge),
    (Some(S::Running), &[E::Shutdown], ANY, S::Shutdown),
    (Some(S::Running), &[E::MajorFault], ANY, S::MajorFaulted),
    (None, &[E::ConnectionClose], ANY, S::Initializing),
    (None, &[E::ConnectionLoss], ANY, S::MajorFaulted),
];

/// Transitions that the text of clauses 5-2.6.2.2 and 5-2.6.2.13 asks for beside the tables.
fn rows_of_the_text(kind: ControlKind) -> &'static [Row] {
    match kind {
        ControlKind::FeedbackOnly => &[
            (Some(S::SelfTest), &[E::InitializationFault], ANY, S::MajorFaulted),
            (Some(S::MajorFaulted), &[E::ShutdownReset], SI, S::StartInhibited),
            (Some(S::MajorFaulted), &[E::ShutdownReset], NO_SI, S::Running),
        ],
        _ => &[
            (Some(S::SelfTest), &[E::InitializationFault], ANY, S::MajorFaulted),
            (Some(S::MajorFaulted), &[E::ShutdownReset], ANY, S::PreCharge),
        ],
    }
}

const TABLES: [(ControlKind, &[Row]); 3] = [
    (ControlKind::Active, ACTIVE),
    (ControlKind::FeedbackOnly, FEEDBACK_ONLY),
    (ControlKind::Converter, CONVERTER),
];

/// Whether a row speaks of this state, event and these conditions. Without power, and until the self test is over, there
/// is no connection that could be closed or lost.
fn speaks(row: &Row, state: AxisState, event: AxisEvent, conditions: &AxisConditions) -> bool {
    let (from, events, condition, _) = row;
    let in_state = match from {
        Some(from) => *from == state,
        None => !matches!(state, S::Off | S::SelfTest),
    };
    in_state && events.contains(&event) && condition(conditions)
}

#[test]
fn every_state_and_event_goes_where_the_rows_of_the_standard_say_and_nowhere_else() {
    for (kind, rows) in TABLES {
        for (state, event, bits) in all() {
            let conditions = conditions(bits);
            let of_table: Vec<_> = rows.iter().filter(|row| speaks(row, state, event, &conditions)).collect();
            assert!(of_table.len() <= 1, "{kind:?} {state} {event:?}: two rows");
            let of_text = rows_of_the_text(kind).iter().find(|row| speaks(row, state, event, &conditions));
            assert!(of_table.is_empty() || of_text.is_none(), "{kind:?} {state} {event:?}: text and table");
            let expected = of_table.first().copied().or(of_text).map(|row| row.3);
            assert_eq!(
                state.next(kind, event, &conditions),
                expected,
                "{kind:?} {state} {event:?} {bits:05b}"
            );
        }
    }
}

fn all() -> impl Iterator<Item = (AxisState, AxisEvent, u8)> {
    AxisState::ALL.into_iter().flat_map(|state| {
        EVENTS.into_iter().flat_map(move |event| (0..32).map(move |bits| (state, event, bits)))
    })
}

/// Every state with every event, and the row of the standard that it is; conditions are listed only where the outcome
/// depends on them.
fn table(kind: ControlKind, number: &str) -> String {
    let rows = TABLES.iter().find(|(known, _)| *known == kind).map(|(_, rows)| *rows).unwrap_or_default();
    let mut out = String::new();
    for state in AxisState::ALL {
        for event in EVENTS {
            let next = |bits| state.next(kind, event, &conditions(bits));
            let relevant: u8 = (0..5)
                .map(|bit| 1 << bit)
                .filter(|bit| (0..32).any(|bits| next(bits) != next(bits ^ bit)))
                .sum();
            for bits in (0..32).filter(|bits| bits & !relevant == 0) {
                let Some(to) = next(bits) else { continue };
                let with: Vec<String> = SYMBOLS
                    .iter()
                    .enumerate()
                    .filter(|(bit, _)| relevant & (1 << bit) != 0)
                    .map(
                        |(bit, name)| {
                            if bits & (1 << bit) == 0 { format!("!{name}") } else { (*name).into() }
                        },
                    )
                    .collect();
                let row = rows.iter().position(|row| speaks(row, state, event, &conditions(bits)));
                let source = row
                    .map_or_else(|| "clause 5-2.6.2".to_owned(), |row| format!("{number} row {}", row + 1));
                let (state, event, to) = (state.to_string(), format!("{event:?}"), to.to_string());
                writeln!(out, "{state:<16}{event:<24}{:<14}{to:<16}{source}", with.join(" "))
                    .expect("a string");
            }
        }
    }
    out
}

#[test]
fn active_control_follows_table_5_2_97() {
    insta::assert_snapshot!(table(ControlKind::Active, "5-2.97"));
}

#[test]
fn feedback_only_follows_table_5_2_99() {
    insta::assert_snapshot!(table(ControlKind::FeedbackOnly, "5-2.99"));
}

#[test]
fn converter_follows_table_5_2_100() {
    insta::assert_snapshot!(table(ControlKind::Converter, "5-2.100"));
}

#[test]
fn no_single_event_leads_into_motion_except_from_starting() {
    for (state, event, bits) in all() {
        if state.next(ControlKind::Active, event, &conditions(bits)) == Some(S::Running) {
            assert_eq!((state, event), (S::Starting, E::StartComplete));
        }
    }
}
