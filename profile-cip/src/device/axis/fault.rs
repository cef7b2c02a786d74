//! Faults and alarms of an axis: from the conditions that are there to words of bits, records and the log.

use super::drive_link::{AbortCause, AbortOrder, DriveImage};
use super::exception::{DriveCondition, ExceptionAction, ExceptionActions, worst_action};
use super::fault_log::{FaultLog, LogEntry, LogKind};
use super::state::AxisState;
use super::{RAMP_AND_DISABLE, STATE_CHANGE_SHUTDOWN, fault_code};
use crate::reported::RecordLog;
use crate::wire::motion::codes::{AlarmType, ClearingEvent, FaultType};
use crate::wire::motion::{AlarmRecord, FaultRecord};
use arrayvec::ArrayVec;

/// Exceptions that an axis can find in one update.
const FOUND_MAX: usize = 4;

/// Fault types with a word of bits: Initialization, Axis, APR and Axis Safety, each with one of the manufacturer.
const FAULT_WORDS: usize = 8;

/// Alarm types with a word of bits: Start Inhibit and Axis Alarm, each with one of the manufacturer.
const ALARM_WORDS: usize = 4;

/// Place of the axis alarms among the alarm words.
const AXIS_ALARMS: usize = 2;

/// Exceptions that put the position in doubt, bits 41 to 47 of Table 5-2.65: noise, loss of the signal, loss of data, failure of the
/// feedback device.
const OF_FEEDBACK: u64 = 0x7F << 41;

/// The words of bits of an axis, for its attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultWords {
    /// Axis Exceptions and - Mfg, attributes 655 and 656: what is there now.
    pub exceptions: [u64; 2],
    /// Latched faults in the order of Axis Fault Type from 1: attributes 674, 675, 657, 658, 756, 757, 763 and 764.
    pub faults: [u64; FAULT_WORDS],
    /// Alarms in the order of Axis Alarm Type from 1: attributes 676, 677, 659 and 660.
    pub alarms: [u64; ALARM_WORDS],
}

impl FaultWords {
    /// Latched faults of a type; 0 for a type that has no bits.
    #[must_use]
    pub fn fault(&self, fault_type: FaultType) -> u64 {
        place_of(fault_type).map_or(0, |place| self.faults[place])
    }

    /// Alarms of a type; 0 for a type that has no bits.
    #[must_use]
    pub fn alarm(&self, alarm_type: AlarmType) -> u64 {
        let place = usize::from(alarm_type.0).checked_sub(1);
        place.and_then(|place| self.alarms.get(place)).copied().unwrap_or(0)
    }
}

/// Faults, alarms and their records.
pub(crate) struct Faults {
    words: FaultWords,
    /// Those of the latched faults that are major.
    majors: [u64; FAULT_WORDS],
    /// A major fault has latched a shutdown.
    shutdown: bool,
    /// The stop that the axis orders for what it has found itself.
    order: Option<AbortOrder>,
    /// Conditions that were there before this are said to have come now when they are latched again.
    cleared_at: u64,
    newest_fault: FaultRecord,
    newest_alarm: AlarmRecord,
    pub fault_records: RecordLog<FaultRecord>,
    pub alarm_records: RecordLog<AlarmRecord>,
    pub log: FaultLog,
    /// Exceptions that the axis has found itself and that are events: for the next look at the conditions.
    pub found: ArrayVec<DriveCondition, FOUND_MAX>,
}

/// Place of a fault type among the words.
fn place_of(fault_type: FaultType) -> Option<usize> {
    usize::from(fault_type.0).checked_sub(1).filter(|place| *place < FAULT_WORDS)
}

/// Faults that only a restart of the device clears (clause 5-2.6.3.6).
fn is_unrecoverable(fault_type: FaultType) -> bool {
    matches!(fault_type, FaultType::INITIALIZATION | FaultType::INITIALIZATION_MFG)
}

/// The condition with a type and code that have a bit: what has none is an external exception, and stops the axis.
fn with_bit(condition: DriveCondition) -> (DriveCondition, usize, u64) {
    let bit = 1_u64.checked_shl(u32::from(condition.code)).filter(|_| condition.code != 0);
    match (place_of(condition.fault_type), bit) {
        (Some(place), Some(bit)) => (condition, place, bit),
        _ => {
            let (fault_type, code) = (FaultType::AXIS, fault_code::EXTERNAL);
            let place = usize::from(fault_type.0 - 1);
            let least = ExceptionAction::MAJOR_FAULT;
            (DriveCondition { fault_type, code, least, ..condition }, place, 1 << code)
        }
    }
}

/// What an exception that the axis has found is about.
fn found_cause(condition: &DriveCondition) -> AbortCause {
    match condition.code {
        fault_code::CONTROLLER_INITIATED => AbortCause::Controller,
        _ => AbortCause::IllegalMode,
    }
}

impl Faults {
    pub const fn new() -> Self {
        let newest_fault = FaultRecord {
            fault_type: FaultType::CLEARED,
            code: ClearingEvent::DEVICE_RESET.0,
            sub_code: 0,
            action: 0,
            time_stamp: 0,
        };
        let newest_alarm =
            AlarmRecord { alarm_type: AlarmType::NONE, code: 0, sub_code: 0, state: 0, time_stamp: 0 };
        Self {
            words: FaultWords { exceptions: [0; 2], faults: [0; FAULT_WORDS], alarms: [0; ALARM_WORDS] },
            majors: [0; FAULT_WORDS],
            shutdown: false,
            order: None,
            cleared_at: 0,
            newest_fault,
            newest_alarm,
            fault_records: RecordLog::new(),
            alarm_records: RecordLog::new(),
            log: FaultLog::new(),
            found: ArrayVec::new_const(),
        }
    }

    /// A connection begins or ends: nothing is latched, and the controller is told anew what is there.
    pub fn forget(&mut self, system_time: u64) {
        if self.any() {
            self.cleared_at = system_time;
        }
        let by = ClearingEvent::CONNECTION_RESET;
        self.log.end_faults(by, system_time, |_| true);
        for place in 0..ALARM_WORDS {
            for (alarm_type, code) in alarms_of(place, self.words.alarms[place]) {
                self.log.end_alarm(alarm_type, code, by, system_time);
            }
        }
        self.words = FaultWords::default();
        self.majors = [0; FAULT_WORDS];
        (self.shutdown, self.order) = (false, None);
        self.fault_records.clear();
        self.alarm_records.clear();
        self.newest_alarm = AlarmRecord::default();
        self.found.clear();
    }

    /// A reset clears what it can clear; what is still there is latched again by the next look at the conditions.
    pub fn clear(&mut self, by: ClearingEvent, system_time: u64) {
        for (place, majors) in self.majors.iter_mut().enumerate().skip(usize::from(FaultType::AXIS.0 - 1)) {
            self.words.faults[place] = 0;
            *majors = 0;
        }
        (self.shutdown, self.order) = (false, None);
        self.cleared_at = system_time;
        self.log.end_faults(by, system_time, |fault_type| !is_unrecoverable(fault_type));
        self.record_cleared(by, system_time);
    }

    /// Clearing is recorded whether or not there was a fault (attribute 661).
    pub fn record_cleared(&mut self, by: ClearingEvent, system_time: u64) {
        let record = FaultRecord {
            fault_type: FaultType::CLEARED,
            code: by.0,
            time_stamp: system_time,
            ..FaultRecord::default()
        };
        self.newest_fault = record;
        self.fault_records.push(record);
    }

    pub fn words(&self) -> &FaultWords {
        &self.words
    }

    /// The axis has found an exception, an event. What follows from it the controller has set.
    pub fn find(&mut self, code: u8, sub_code: u8, action: u8, system_time: u64) {
        let condition = DriveCondition {
            fault_type: FaultType::AXIS,
            code,
            sub_code,
            detail: 0,
            action,
            least: ExceptionAction::IGNORE,
            at: system_time,
        };
        // One of a kind is enough.
        if !self.found.iter().any(|known| known.code == code) {
            let _ = self.found.try_push(condition);
        }
    }

    /// Whether exceptions wait to be looked at.
    pub fn has_found(&self) -> bool {
        !self.found.is_empty()
    }

    /// Whether any fault is latched, major or minor.
    pub fn any(&self) -> bool {
        self.words.faults.iter().any(|word| *word != 0)
    }

    /// Whether a major fault is latched.
    pub fn any_major(&self) -> bool {
        self.majors.iter().any(|word| *word != 0)
    }

    /// Whether a fault is latched that no reset clears.
    pub fn any_unrecoverable(&self) -> bool {
        self.words.faults[..usize::from(FaultType::AXIS.0 - 1)].iter().any(|word| *word != 0)
    }

    /// Whether an exception is an alarm now (Axis Status bit 1; start inhibits do not count).
    pub fn any_axis_alarm(&self) -> bool {
        self.words.alarms[AXIS_ALARMS..].iter().any(|word| *word != 0)
    }

    /// Whether something puts the position in doubt or has done so since the last reset: an exception of the feedback, or a lost
    /// absolute position.
    pub fn any_of_feedback(&self, image: &DriveImage) -> bool {
        let word = |fault_type| self.words.fault(fault_type);
        let of_axis = self.words.exceptions[0] | word(FaultType::AXIS);
        let of_position =
            |condition: &DriveCondition| matches!(condition.fault_type, FaultType::APR | FaultType::APR_MFG);
        of_axis & OF_FEEDBACK != 0
            || word(FaultType::APR) | word(FaultType::APR_MFG) != 0
            || image.conditions.as_slice().iter().any(of_position)
    }

    /// The record of attributes 661 to 663, 666 and 668.
    pub fn newest_fault(&self) -> &FaultRecord {
        &self.newest_fault
    }

    /// The record of attributes 664, 665, 667, 669 and 670.
    pub fn newest_alarm(&self) -> AlarmRecord {
        let none = self.words.alarms.iter().all(|word| *word == 0);
        if none { AlarmRecord::default() } else { self.newest_alarm }
    }

    /// The stop that the axis orders for what it has found itself.
    pub fn order(&self) -> Option<AbortOrder> {
        self.order
    }

    /// Whether a major fault has latched a shutdown.
    pub fn shuts_down(&self) -> bool {
        self.shutdown
    }

    /// Latches a fault; a fault that is latched as minor may become major. `cause` is what the axis has found itself.
    pub(super) fn latch(
        &mut self,
        condition: &DriveCondition,
        major: bool,
        cause: Option<AbortCause>,
        state: AxisState,
    ) {
        let (condition, place, bit) = with_bit(*condition);
        let known = self.words.faults[place] & bit != 0 && (!major || self.majors[place] & bit != 0);
        if known {
            return;
        }
        let stops = condition.action >> 4 != 0;
        let action = match (major, stops) {
            (false, _) => 0,
            (true, true) => condition.action,
            (true, false) => RAMP_AND_DISABLE,
        };
        self.words.faults[place] |= bit;
        if major {
            self.majors[place] |= bit;
            self.shutdown |= action >> 4 == STATE_CHANGE_SHUTDOWN;
            if let Some(cause) = cause {
                let before = self.order.unwrap_or(AbortOrder { action: 0, cause });
                self.order = Some(AbortOrder { action: worst_action(before.action, action), ..before });
            }
        }
        let at = condition.at.max(self.cleared_at);
        let record = FaultRecord {
            fault_type: condition.fault_type,
            code: condition.code,
            sub_code: condition.sub_code,
            action,
            time_stamp: at,
        };
        self.newest_fault = record;
        self.fault_records.push(record);
        self.log.add(LogEntry {
            number: 0,
            kind: LogKind::Fault(condition.fault_type),
            code: condition.code,
            sub_code: condition.sub_code,
            action,
            detail: condition.detail,
            state,
            at,
            ended: None,
        });
    }

    /// Looks at what is there now. While the axis is Initializing only initialization faults are latched: the controller
    /// has not said yet what is to be done about the others.
    pub(super) fn look(
        &mut self,
        image: &DriveImage,
        found: &[DriveCondition],
        actions: &ExceptionActions<'_>,
        state: AxisState,
        system_time: u64,
    ) {
        let initializing = state == AxisState::Initializing;
        let mut exceptions = [0; 2];
        let mut alarms = [0; ALARM_WORDS];
        alarms[0] = u64::from(image.start_inhibits);
        alarms[1] = u64::from(image.start_inhibits_mfg);
        let reported = image.conditions.as_slice().iter().map(|condition| (condition, None));
        let own = found.iter().map(|condition| (condition, Some(found_cause(condition))));
        for (condition, cause) in reported.chain(own) {
            let (condition, place, bit) = with_bit(*condition);
            let bank = place.checked_sub(usize::from(FaultType::AXIS.0 - 1)).filter(|bank| *bank < 2);
            if let Some(bank) = bank {
                exceptions[bank] |= bit;
            }
            match (actions.action(&condition), bank) {
                (ExceptionAction::IGNORE, _) => {}
                (ExceptionAction::ALARM, Some(bank)) => alarms[AXIS_ALARMS + bank] |= bit,
                _ if initializing && !is_unrecoverable(condition.fault_type) => {}
                (action, _) => {
                    self.latch(&condition, action == ExceptionAction::MAJOR_FAULT, cause, state);
                }
            }
        }
        self.words.exceptions = exceptions;
        if alarms != self.words.alarms {
            let before = core::mem::replace(&mut self.words.alarms, alarms);
            self.tell_alarms(&before, image, found, state, system_time);
        }
    }

    fn tell_alarms(
        &mut self,
        before: &[u64; ALARM_WORDS],
        image: &DriveImage,
        found: &[DriveCondition],
        state: AxisState,
        system_time: u64,
    ) {
        for (place, (was, is)) in before.iter().zip(self.words.alarms).enumerate() {
            for (alarm_type, code) in alarms_of(place, was & !is) {
                let by = ClearingEvent::NONE;
                let sub_code = self.log.end_alarm(alarm_type, code, by, system_time);
                self.record_alarm(AlarmRecord {
                    alarm_type,
                    code,
                    sub_code,
                    state: 0,
                    time_stamp: system_time,
                });
            }
            for (alarm_type, code) in alarms_of(place, is & !was) {
                let of = |condition: &&DriveCondition| {
                    usize::from(condition.fault_type.0) == place + 1 && condition.code == code
                };
                let condition =
                    image.conditions.as_slice().iter().chain(found).find(of).copied().unwrap_or_default();
                let time_stamp = if condition.at == 0 { system_time } else { condition.at };
                let sub_code = condition.sub_code;
                self.record_alarm(AlarmRecord { alarm_type, code, sub_code, state: 1, time_stamp });
                self.log.add(LogEntry {
                    number: 0,
                    kind: LogKind::Alarm(alarm_type),
                    code,
                    sub_code,
                    action: 0,
                    detail: condition.detail,
                    state,
                    at: time_stamp,
                    ended: None,
                });
            }
        }
    }

    fn record_alarm(&mut self, record: AlarmRecord) {
        self.newest_alarm = record;
        self.alarm_records.push(record);
    }
}

/// The alarms whose bits stand in a word: type and code.
fn alarms_of(place: usize, word: u64) -> impl Iterator<Item = (AlarmType, u8)> {
    let alarm_type = AlarmType(u8::try_from(place + 1).unwrap_or(0));
    (0..64_u8).filter(move |code| word & 1 << code != 0).map(move |code| (alarm_type, code))
}
