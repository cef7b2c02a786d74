//! The faults of the axes, from what the cycle reports of them. One fault comes in up to three notices: that of the gateway, the
//! record for the controller, and what the drive says; they make one record here.

use std::collections::VecDeque;

use profile_cip::device::fault_log::{LogEntry, LogKind};
use profile_cip::wire::motion::codes::{AxisStateCode, ClearingEvent};
use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;

use super::record::{FaultEnd, FaultRecord};
use crate::engine::notice::Notice;
use crate::local::installation::Installation;
use crate::local::protocol::printable;
use crate::status::{AxisStatus, BoxStatus};

/// Faults that are kept.
pub(super) const RECORDS_MAX: usize = 1_000;

/// What ends a fault that was present when an earlier run of the gateway ended.
const UNSEEN: &str = "not seen: the gateway ended first";

/// What ends a fault whose end no controller's record shows.
const GONE: &str = "the axis has no fault any more";

/// Looks at the status without a fault after which a controller's record has ended too: a second. The record of its end comes sooner.
const LOOKS_WITHOUT_FAULT: u32 = 50;

/// The faults of the axes.
#[derive(Debug, Default)]
pub(super) struct Book {
    /// Oldest first.
    records: VecDeque<FaultRecord>,
    /// What else is known of those that are present.
    present: Vec<Present>,
    /// Number of the newest record.
    newest: u64,
    /// Counts changes.
    changes: u64,
}

/// A record that has not ended.
#[derive(Debug)]
struct Present {
    number: u64,
    axis: u8,
    cause: Option<FaultCause>,
    /// Kind and code of the controller's record.
    controller: Option<(LogKind, u8)>,
    /// The published status has shown the fault.
    shown: bool,
    /// Looks since then that have shown none.
    looks_without: u32,
}

impl Book {
    /// The faults of an earlier run, oldest first.
    pub fn of(records: Vec<FaultRecord>) -> Self {
        let newest = records.iter().map(|record| record.number).max().unwrap_or(0);
        let mut records = VecDeque::from(records);
        records.drain(..records.len().saturating_sub(RECORDS_MAX));
        let mut book = Self { records, newest, ..Self::default() };
        book.close();
        // The file says as much.
        book.changes = 0;
        book
    }

    /// The gateway ends: nobody will see how what is present ends.
    pub fn close(&mut self) {
        self.present.clear();
        for record in self.records.iter_mut().filter(|record| record.is_present()) {
            record.end = Some(FaultEnd { time: None, by: UNSEEN.to_owned() });
            self.changes += 1;
        }
    }

    /// The records, newest first.
    pub fn records(&self) -> impl Iterator<Item = &FaultRecord> {
        self.records.iter().rev()
    }

    /// How often something has changed.
    pub const fn changes(&self) -> u64 {
        self.changes
    }

    /// Takes what the cycle reports; `time` is when.
    pub fn note(&mut self, notice: &Notice, names: &Installation, time: &str) {
        match notice {
            Notice::Fault { axis, fault, .. } => {
                let place = self.open(*axis, names, time, |known| {
                    known.cause == Some(fault.cause) || (known.cause.is_none() && known.controller.is_some())
                });
                self.present[place].cause = Some(fault.cause);
                self.change(place, |record| {
                    record.set_cause(fault.cause);
                    record.gateway = Some(notice.to_string());
                    if fault.vendor_code != 0 {
                        record.drive_code = fault.vendor_code;
                    }
                });
            }
            Notice::Logged { axis, entry: entry @ LogEntry { ended: None, .. }, cause } => {
                if matches!(entry.kind, LogKind::Fault(_)) {
                    self.logged(*axis, entry, *cause, notice, names, time);
                }
            }
            Notice::Logged { axis, entry: LogEntry { ended: Some((by, _)), kind, code, .. }, .. } => {
                let by = if *by == ClearingEvent::NONE { GONE.to_owned() } else { by.to_string() };
                self.end(time, &by, |known| known.axis == *axis && known.controller == Some((*kind, *code)));
            }
            Notice::DriveSays { axis, .. } => {
                let said = printable(&notice.to_string());
                let said = said.trim_start_matches("the drive reports").trim_start();
                let unsaid = |book: &Self, place: &usize| {
                    let record = book.record(book.present[*place].number);
                    book.present[*place].axis == *axis
                        && record.is_some_and(|record| record.drive_says.is_none())
                };
                // What is read after a fault is about the last one that came.
                let place = (0..self.present.len()).rev().find(|place| unsaid(self, place));
                if let Some(place) = place {
                    self.change(place, |record| record.drive_says = Some(said.to_owned()));
                }
            }
            Notice::State { axis, to, .. }
                if !matches!(to, DriveState::FaultReaction | DriveState::Faulted) =>
            {
                self.end(time, GONE, |known| known.axis == *axis && known.controller.is_none());
            }
            _ => {}
        }
    }

    /// A record for the controller: that of a fault which the gateway has reported, or of one that only the device knows.
    fn logged(
        &mut self,
        axis: u8,
        entry: &LogEntry,
        cause: Option<FaultCause>,
        notice: &Notice,
        names: &Installation,
        time: &str,
    ) {
        let place = self.open(axis, names, time, |known| known.controller.is_none() && known.cause == cause);
        self.present[place].controller = Some((entry.kind, entry.code));
        if self.present[place].cause.is_none() {
            self.present[place].cause = cause;
        }
        self.change(place, |record| {
            if let Some(cause) = cause {
                record.set_cause(cause);
            }
            record.controller = Some(notice.to_string());
            if entry.detail != 0 {
                record.drive_code = entry.detail;
            }
        });
    }

    /// Looks at the published status: what has no record of the controller ends when the axis has no fault any more, and what has one
    /// when its end was not recorded for [`LOOKS_WITHOUT_FAULT`].
    pub fn look(&mut self, status: &BoxStatus, time: &str) {
        for known in &mut self.present {
            let Some(axis) = status.configured_axes().get(usize::from(known.axis)) else { continue };
            let is_faulted =
                axis.fault.is_some() || (known.controller.is_some() && has_controller_fault(axis));
            known.shown |= is_faulted;
            known.looks_without = if known.shown && !is_faulted { known.looks_without + 1 } else { 0 };
        }
        let gone = |known: &Present| {
            let enough = if known.controller.is_some() { LOOKS_WITHOUT_FAULT } else { 1 };
            known.looks_without >= enough
        };
        if self.present.iter().any(gone) {
            self.end(time, GONE, gone);
        }
    }

    /// The place of a record of the axis that is present and fits; otherwise of a new one.
    fn open(&mut self, axis: u8, names: &Installation, time: &str, fits: impl Fn(&Present) -> bool) -> usize {
        if let Some(place) = self.present.iter().rposition(|known| known.axis == axis && fits(known)) {
            return place;
        }
        self.newest += 1;
        let named = names.axes.get(usize::from(axis));
        let bus = names.bus_of(usize::from(axis)).map(|bus| bus.name.clone());
        self.records.push_back(FaultRecord {
            number: self.newest,
            time: time.to_owned(),
            axis: named.map(|axis| axis.name.clone()).unwrap_or_default(),
            drive: named.map(|axis| axis.drive.clone()).unwrap_or_default(),
            bus: bus.unwrap_or_default(),
            ..FaultRecord::default()
        });
        if self.records.len() > RECORDS_MAX {
            let oldest = self.records.pop_front().map(|record| record.number);
            self.present.retain(|known| Some(known.number) != oldest);
        }
        let (cause, controller) = (None, None);
        let known = Present { number: self.newest, axis, cause, controller, shown: false, looks_without: 0 };
        self.present.push(known);
        self.present.len() - 1
    }

    /// Ends what is present and meant.
    fn end(&mut self, time: &str, by: &str, meant: impl Fn(&Present) -> bool) {
        let ended: Vec<u64> =
            self.present.iter().filter(|known| meant(known)).map(|known| known.number).collect();
        self.present.retain(|known| !ended.contains(&known.number));
        for record in self.records.iter_mut().filter(|record| ended.contains(&record.number)) {
            record.end = Some(FaultEnd { time: Some(time.to_owned()), by: by.to_owned() });
            self.changes += 1;
        }
    }

    fn change(&mut self, place: usize, change: impl FnOnce(&mut FaultRecord)) {
        let number = self.present[place].number;
        if let Some(record) = self.records.iter_mut().rev().find(|record| record.number == number) {
            change(record);
            self.changes += 1;
        }
    }

    fn record(&self, number: u64) -> Option<&FaultRecord> {
        self.records.iter().rev().find(|record| record.number == number)
    }
}

/// Whether an axis has a fault that its controller has to reset.
fn has_controller_fault(axis: &AxisStatus) -> bool {
    let state = AxisStateCode(axis.cip_axis_state);
    axis.indicators.minor_fault || [AxisStateCode::ABORTING, AxisStateCode::MAJOR_FAULTED].contains(&state)
}

#[cfg(test)]
mod tests {
    use arrayvec::ArrayString;
    use profile_cip::device::axis_state::AxisState;
    use profile_cip::wire::motion::codes::FaultType;
    use profile_generic::fault::Fault;
    use profile_generic::time::SystemTime;

    use super::*;
    use crate::engine::axis::DiagnosticMessage;
    use crate::local::installation::tests::installation;
    use crate::status::tests::distinct;

    const CAUSE: FaultCause = FaultCause::OVER_CURRENT;

    fn fault(axis: u8, cause: FaultCause) -> Notice {
        let fault = Fault::new(cause, SystemTime(5)).with_vendor_code(0x2310);
        Notice::Fault { axis, fault, loss: None, trip: None, jump: None }
    }

    fn logged(axis: u8, code: u8, cause: FaultCause, ended: Option<ClearingEvent>) -> Notice {
        let kind = LogKind::Fault(FaultType::AXIS);
        let ended = ended.map(|by| (by, 9));
        let state = AxisState::Running;
        let entry =
            LogEntry { number: 1, kind, code, sub_code: 0, action: 3, detail: 0, state, at: 5, ended };
        Notice::Logged { axis, entry, cause: Some(cause) }
    }

    fn said(axis: u8) -> Notice {
        let text = ArrayString::from("over\u{1b}current").unwrap();
        Notice::DriveSays { axis, said: DiagnosticMessage { number: Some(0xC00F_0007), text } }
    }

    fn noted(notices: &[Notice]) -> Book {
        let mut book = Book::default();
        for (second, notice) in notices.iter().enumerate() {
            book.note(notice, &installation(), &format!("T{second}"));
        }
        book
    }

    #[test]
    fn one_fault_in_three_notices_is_one_record_in_everybodys_words() {
        let book = noted(&[
            fault(0, CAUSE),
            logged(0, 10, CAUSE, None),
            said(0),
            logged(0, 10, CAUSE, Some(ClearingEvent::FAULT_RESET)),
        ]);
        let records: Vec<_> = book.records().collect();
        let [record] = records[..] else { panic!("{records:?}") };
        assert_eq!((record.number, record.time.as_str(), record.axis.as_str()), (1, "T0", "turntable"));
        assert_eq!((record.drive.as_str(), record.bus.as_str()), ("drive-a", "SERCOS"));
        assert_eq!((record.cause.as_str(), record.drive_code), ("over_current", 0x2310));
        assert!(record.gateway.as_deref().is_some_and(|text| text.starts_with("over_current (axis fault, ")));
        assert!(record.controller.as_deref().is_some_and(|text| text.contains("10 (over_current) in ")));
        assert_eq!(record.drive_says.as_deref(), Some("0xC00F0007 \"over?current\""));
        assert_eq!(record.advice, crate::local::advice::advice(CAUSE));
        let end = FaultEnd { time: Some("T3".to_owned()), by: ClearingEvent::FAULT_RESET.to_string() };
        assert_eq!(record.end, Some(end));
    }

    #[test]
    fn record_of_the_controller_may_come_first_and_other_axes_are_left_alone() {
        let book = noted(&[logged(1, 10, CAUSE, None), fault(1, CAUSE), fault(0, CAUSE), said(0)]);
        let records: Vec<_> = book.records().collect();
        let [second, first] = records[..] else { panic!("{records:?}") };
        assert!(first.controller.is_some() && first.gateway.is_some() && first.drive_says.is_none());
        assert_eq!((first.axis.as_str(), second.axis.as_str()), ("slide", "turntable"));
        assert!(second.controller.is_none() && second.drive_says.is_some());
        assert!(first.is_present() && second.is_present());
    }

    #[test]
    fn fault_without_a_controller_ends_with_the_state_or_with_the_status() {
        let state = |to| Notice::State { axis: 0, from: DriveState::Operating, to };
        let book = noted(&[fault(0, CAUSE), state(DriveState::Faulted)]);
        assert!(book.records().all(FaultRecord::is_present));
        let book = noted(&[fault(0, CAUSE), state(DriveState::Faulted), state(DriveState::Ready)]);
        let ended = book.records().next().and_then(|record| record.end.clone()).expect("an end");
        assert_eq!((ended.time.as_deref(), ended.by.as_str()), (Some("T2"), GONE));

        let mut book = noted(&[fault(1, CAUSE)]);
        let mut status = distinct();
        let present = |book: &Book| book.records().next().is_some_and(FaultRecord::is_present);
        let shown = status.axes[1].fault.take();
        book.look(&status, "T8");
        assert!(present(&book), "it is not published yet");
        status.axes[1].fault = shown.or(Some(CAUSE));
        book.look(&status, "T9");
        assert!(present(&book));
        status.axes[1].fault = None;
        book.look(&status, "T10");
        assert!(!present(&book));
    }

    #[test]
    fn same_fault_again_is_another_record_and_old_ones_go() {
        let mut notices = Vec::new();
        for _ in 0..RECORDS_MAX + 5 {
            notices.push(logged(0, 10, CAUSE, None));
            notices.push(logged(0, 10, CAUSE, Some(ClearingEvent::FAULT_RESET)));
        }
        let book = noted(&notices);
        let numbers: Vec<u64> = book.records().map(|record| record.number).collect();
        assert_eq!((numbers.len(), numbers[0], numbers[RECORDS_MAX - 1]), (RECORDS_MAX, 1_005, 6));
        assert!(book.present.is_empty());
        assert_eq!(book.changes(), 2 * 1_005);
    }

    #[test]
    fn faults_of_an_earlier_run_have_ended_and_numbers_go_on() {
        let earlier = noted(&[fault(0, CAUSE), logged(1, 3, CAUSE, None)]);
        let mut records: Vec<_> = earlier.records().cloned().collect();
        records.reverse();
        let mut book = Book::of(records);
        assert!(book.records().all(|record| record.end.as_ref().is_some_and(|end| end.by == UNSEEN)));
        book.note(&fault(0, CAUSE), &installation(), "later");
        let newest = book.records().next().expect("the new one");
        assert_eq!((newest.number, newest.is_present(), book.records().count()), (3, true, 3));
    }

    /// The end of a controller's record may never come.
    #[test]
    fn fault_with_a_record_of_the_controller_ends_when_the_axis_shows_none_for_a_second() {
        let mut book = noted(&[fault(1, CAUSE), logged(1, 10, CAUSE, None)]);
        let present = |book: &Book| book.records().next().is_some_and(FaultRecord::is_present);
        let mut status = distinct();
        let axis = &mut status.axes[1];
        (axis.cip_axis_state, axis.indicators.minor_fault) = (4, false);
        let look = |book: &mut Book, status: &BoxStatus, times: u32| {
            (0..times).for_each(|_| book.look(status, "T9"));
            present(book)
        };
        status.axes[1].fault = None;
        assert!(look(&mut book, &status, 200), "it is not published yet");
        status.axes[1].fault = Some(CAUSE);
        assert!(look(&mut book, &status, 200));
        status.axes[1].fault = None;
        assert!(look(&mut book, &status, 10), "the end of the record is under way");
        status.axes[1].indicators.minor_fault = true;
        assert!(look(&mut book, &status, 200), "the controller has still to reset it");
        status.axes[1].indicators.minor_fault = false;
        assert!(!look(&mut book, &status, 200));
        let end = book.records().next().and_then(|record| record.end.clone()).expect("an end");
        assert_eq!((end.time.as_deref(), end.by.as_str()), (Some("T9"), GONE));
    }
}
