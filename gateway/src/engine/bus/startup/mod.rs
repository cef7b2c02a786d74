//! The start-up list of a drive, on the way: every entry is read and compared, what differs is written and read back.
//!
//! | pass | what happens |
//! |---|---|
//! | read | each entry is read and compared; nothing is written before all of them are known |
//! | judge | a difference that refuses the drive, or that can never be written, ends the list |
//! | write | what differs is written and read back; what the drive refuses is tried again after the others, because limits depend on each other |
//! | verify | if anything was written, everything is read once more: one parameter may change another |
//!
//! A SERCOS drive goes through the list in CP2 and in CP3. What its attribute protects in CP2 is left for CP3. A CANopen device goes
//! through it once, in Pre-Operational; a drive on DeviceNet once it is polled, before it is set up.

mod report;

pub use self::report::{
    Difference, NotTaken, Protected, StartupFailure, StartupReport, StartupTrouble, Trouble,
};

use std::collections::VecDeque;

use profile_cia402::sdo::request::SdoFailure;
use profile_sercos::master::svc::request::SvcFailure;
use profile_sercos::wire::attribute::{Attribute, Format};

use crate::engine::direct::{DATA_MAX, DirectFailure};
use crate::mapping::Cia402Type;
use crate::parameter::id::Id;
use crate::parameter::startup::{OnDifference, StartupEntry, StartupValue};
use crate::parameter::value::{Kind, len, letters};

/// Bytes that a value may be longer than the one of the list, and still be read.
const SPARE_LEN: usize = 1_024;

/// Longest item of a list, bytes.
const ITEM_LEN: usize = 8;

/// What the drive is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StartupAccess {
    /// The value of a parameter, of at most so many bytes.
    Read(Id, usize),
    /// Another value, and the attribute of an IDN.
    Write(Id, Option<Attribute>, Vec<u8>),
}

/// In which state the drive is: what can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// CP2 of SERCOS: CP3 follows.
    Cp2,
    /// CP3 of SERCOS: the last phase in which nothing can move.
    Cp3,
    /// Whatever can be written at all.
    Once,
}

/// An entry on the way.
#[derive(Debug, Clone)]
struct Item {
    entry: StartupEntry,
    attribute: Option<Attribute>,
    wanted: Vec<u8>,
    found: Vec<u8>,
    /// The drive has the value of the list.
    equal: bool,
    /// It had it in an earlier phase.
    was_equal: bool,
    /// It was written.
    written: bool,
    /// What people should know of it was said.
    reported: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Read(usize),
    Write(usize),
    Back(usize),
    Verify(usize),
    End,
}

/// The list of one drive.
#[derive(Debug)]
pub struct StartupRun {
    items: Vec<Item>,
    when: When,
    step: Step,
    /// Entries to be written, and those that the drive has refused meanwhile.
    queue: VecDeque<usize>,
    again: Vec<(usize, DirectFailure)>,
    /// Whether one was written since the refused ones were tried.
    progress: bool,
    /// Whether one was written in this phase.
    wrote: bool,
    /// The last request got no answer, and is made once more.
    asked_again: bool,
    reports: Vec<StartupReport>,
    failure: Option<StartupFailure>,
}

impl StartupRun {
    /// The list of a drive; nothing is done before it is begun.
    #[must_use]
    pub fn new(entries: &[StartupEntry]) -> Self {
        let item = |entry: &StartupEntry| Item {
            entry: entry.clone(),
            attribute: None,
            wanted: Vec::new(),
            found: Vec::new(),
            equal: false,
            was_equal: false,
            written: false,
            reported: false,
        };
        Self {
            items: entries.iter().map(item).collect(),
            when: When::Once,
            step: Step::End,
            queue: VecDeque::new(),
            again: Vec::new(),
            progress: false,
            wrote: false,
            asked_again: false,
            reports: Vec::new(),
            failure: None,
        }
    }

    /// Forgets the drive.
    pub fn restart(&mut self) {
        for item in &mut self.items {
            (item.equal, item.was_equal, item.written, item.reported) = (false, false, false, false);
        }
        self.give_up();
    }

    /// Ends what is under way.
    pub fn give_up(&mut self) {
        self.step = Step::End;
        self.queue.clear();
        self.again.clear();
        self.reports.clear();
        self.failure = None;
    }

    /// Begins with the first entry.
    pub fn begin(&mut self, when: When) {
        self.give_up();
        (self.when, self.progress, self.wrote, self.asked_again) = (when, false, false, false);
        for item in &mut self.items {
            (item.was_equal, item.equal) = (item.was_equal || item.equal, false);
        }
        self.step = if self.items.is_empty() { Step::End } else { Step::Read(0) };
    }

    /// Whether there is nothing more to do, or something keeps the drive from being used.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.step == Step::End
    }

    /// Whether something was written since it was begun.
    #[must_use]
    pub const fn has_written(&self) -> bool {
        self.wrote
    }

    /// Takes what keeps the drive from being used.
    pub fn take_failure(&mut self) -> Option<StartupFailure> {
        self.failure.take()
    }

    /// Takes what people should know.
    pub fn take_reports(&mut self) -> Vec<StartupReport> {
        std::mem::take(&mut self.reports)
    }

    /// What the drive is to be asked, until the answer is taken; `None` when the list is done.
    #[must_use]
    pub fn next(&self) -> Option<StartupAccess> {
        let item = |at: usize| self.items.get(at);
        match self.step {
            Step::Read(at) | Step::Back(at) | Step::Verify(at) => {
                let entry = &item(at)?.entry;
                Some(StartupAccess::Read(entry.id, room(&entry.value)))
            }
            Step::Write(at) => {
                let item = item(at)?;
                Some(StartupAccess::Write(item.entry.id, item.attribute, item.wanted.clone()))
            }
            Step::End => None,
        }
    }

    /// Takes the answer of the drive: what was read, with the attribute of an IDN.
    pub fn take(&mut self, answer: Result<(Option<Attribute>, &[u8]), DirectFailure>) {
        match &answer {
            // A frame was lost, or the drive was busy: once more. What is written here is the same the second time.
            Err(failure) if is_silence(failure) && !self.asked_again => {
                self.asked_again = true;
                return;
            }
            _ => self.asked_again = false,
        }
        match self.step {
            Step::Read(at) => self.take_value(at, answer),
            Step::Write(at) => match answer {
                Ok(_) => self.step = Step::Back(at),
                Err(failure) => {
                    if is_silence(&failure) {
                        let not_taken = NotTaken { difference: self.items[at].difference(), failure };
                        return self.fail(StartupTrouble::NotTaken(vec![not_taken]));
                    }
                    self.again.push((at, failure));
                    self.write_next();
                }
            },
            Step::Back(at) => self.take_back(at, answer),
            Step::Verify(at) => self.take_again(at, answer),
            Step::End => {}
        }
    }

    /// The value of an entry, the first time in this phase.
    fn take_value(&mut self, at: usize, answer: Result<(Option<Attribute>, &[u8]), DirectFailure>) {
        let item = &mut self.items[at];
        let id = item.entry.id;
        let compared = match answer {
            Ok((attribute, data)) => item.compare(attribute, data),
            Err(failure) => Err(Trouble::Unread(failure)),
        };
        if let Err(trouble) = compared {
            if item.entry.on_difference != OnDifference::Warn {
                return self.fail(StartupTrouble::NotCompared(id, trouble));
            }
            item.skip();
            if !std::mem::replace(&mut item.reported, true) {
                self.reports.push(StartupReport::NotCompared(id, trouble));
            }
        }
        if at + 1 < self.items.len() {
            self.step = Step::Read(at + 1);
        } else {
            self.judge();
        }
    }

    /// Everything is known: what follows from it.
    fn judge(&mut self) {
        let differing = |items: &[Item], what| -> Vec<usize> {
            let is = |item: &Item| !item.equal && item.entry.on_difference == what;
            items.iter().enumerate().filter(|(_, item)| is(item)).map(|(at, _)| at).collect()
        };
        let refusing = differing(&self.items, OnDifference::Refuse);
        if !refusing.is_empty() {
            let all = refusing.into_iter().map(|at| self.items[at].difference()).collect();
            return self.fail(StartupTrouble::Refused(all));
        }
        for at in differing(&self.items, OnDifference::Warn) {
            let item = &mut self.items[at];
            // One that could not be compared was reported.
            if !std::mem::replace(&mut item.reported, true) {
                self.reports.push(StartupReport::Differs(item.difference()));
            }
        }
        let (mut protected, mut lost) = (Vec::new(), None);
        for at in differing(&self.items, OnDifference::Write) {
            let item = &self.items[at];
            match item.writable(self.when) {
                Writable::Now => self.queue.push_back(at),
                Writable::Later => {}
                Writable::Never if item.was_equal => lost = lost.or(Some(item)),
                Writable::Never => protected.push(Protected {
                    difference: item.difference(),
                    until_cp4: item.attribute.is_some_and(|attribute| !attribute.write_protected(4)),
                }),
            }
        }
        if let Some(item) = lost {
            let (difference, written) = (item.difference(), item.written);
            return self.fail(match written {
                true => StartupTrouble::NotKept(difference),
                false => StartupTrouble::Changed(difference),
            });
        }
        if !protected.is_empty() {
            return self.fail(StartupTrouble::Protected(protected));
        }
        self.write_next();
    }

    /// On to the next entry that is written; behind the last one to what was refused, or to the last look.
    fn write_next(&mut self) {
        if self.queue.is_empty() && !self.again.is_empty() {
            if !std::mem::replace(&mut self.progress, false) {
                let not_taken = |(at, failure): &(usize, DirectFailure)| NotTaken {
                    difference: self.items[*at].difference(),
                    failure: *failure,
                };
                let all = self.again.iter().map(not_taken).collect();
                return self.fail(StartupTrouble::NotTaken(all));
            }
            self.queue.extend(self.again.drain(..).map(|(at, _)| at));
        }
        match self.queue.pop_front() {
            Some(at) => self.step = Step::Write(at),
            None if self.wrote => self.verify_from(0),
            None => self.end(),
        }
    }

    /// What was written, as the drive has it.
    fn take_back(&mut self, at: usize, answer: Result<(Option<Attribute>, &[u8]), DirectFailure>) {
        let item = &mut self.items[at];
        let id = item.entry.id;
        let data = match answer {
            Ok((_, data)) => data,
            Err(failure) => {
                item.written = true;
                return self.fail(StartupTrouble::NotReadBack(id, failure));
            }
        };
        let before = item.show(&item.found);
        item.found = data.to_vec();
        item.written = true;
        self.wrote = true;
        if !item.is_equal() {
            let difference = item.difference();
            return self.fail(StartupTrouble::NotKept(difference));
        }
        item.equal = true;
        self.progress = true;
        let value = item.show(&item.found);
        self.reports.push(StartupReport::Written { id, before, value });
        self.write_next();
    }

    fn verify_from(&mut self, first: usize) {
        let next = (first..self.items.len()).find(|at| self.items[*at].equal);
        match next {
            Some(at) => self.step = Step::Verify(at),
            None => self.end(),
        }
    }

    /// The value of an entry after others were written.
    fn take_again(&mut self, at: usize, answer: Result<(Option<Attribute>, &[u8]), DirectFailure>) {
        let item = &mut self.items[at];
        match answer {
            Ok((_, data)) => item.found = data.to_vec(),
            Err(failure) => {
                let id = item.entry.id;
                return self.fail(StartupTrouble::NotCompared(id, Trouble::Unread(failure)));
            }
        }
        if !item.is_equal() {
            let difference = item.difference();
            return self.fail(StartupTrouble::Changed(difference));
        }
        self.verify_from(at + 1);
    }

    fn end(&mut self) {
        self.step = Step::End;
        // In CP2 others may still come.
        if self.when != When::Cp2 {
            let equal = self.items.iter().filter(|item| item.equal).count();
            let written = self.items.iter().filter(|item| item.equal && item.written).count();
            self.reports.push(StartupReport::Through { equal, written });
        }
    }

    fn fail(&mut self, trouble: StartupTrouble) {
        let written = self.items.iter().filter(|item| item.written).map(|item| item.entry.id).collect();
        self.failure = Some(StartupFailure { trouble, written });
        self.step = Step::End;
    }
}

/// When an entry can be written.
enum Writable {
    Now,
    Later,
    Never,
}

impl Item {
    /// Takes the value of the drive; why it cannot be compared.
    fn compare(&mut self, attribute: Option<Attribute>, data: &[u8]) -> Result<(), Trouble> {
        self.attribute = attribute;
        self.found = data.to_vec();
        if attribute.is_some_and(Attribute::is_command) {
            return Err(Trouble::Command);
        }
        self.wanted = self.entry.bytes(self.kind()).map_err(Trouble::Value)?;
        if let (Some(kind), StartupValue::Text(_)) = (self.entry.data_type, &self.entry.value)
            && let Some(expected) = len(kind).filter(|expected| *expected != data.len())
        {
            return Err(Trouble::Length { kind: kind.name(), expected, found: data.len() });
        }
        self.equal = self.is_equal();
        Ok(())
    }

    /// An entry that could not be compared is not looked at again.
    fn skip(&mut self) {
        self.equal = false;
        self.found.clear();
        self.wanted.clear();
    }

    fn kind(&self) -> Kind {
        match (self.attribute, self.entry.data_type) {
            (Some(attribute), _) => Kind::Sercos(attribute),
            (None, Some(kind)) => Kind::Object(kind),
            (None, None) => Kind::Unknown,
        }
    }

    /// Whether the drive has the value. Texts are equal by their letters: drives have them in UTF-8 or in Latin-1, and zeros fill them up.
    fn is_equal(&self) -> bool {
        let is_text = match self.kind() {
            Kind::Sercos(attribute) => attribute.format() == Format::Text,
            Kind::Object(kind) => kind == Cia402Type::VisibleString,
            Kind::Array(..) | Kind::ShortString | Kind::Unknown => false,
        };
        let [wanted, found] = [&self.wanted, &self.found];
        wanted == found || (is_text && letters(wanted) == letters(found))
    }

    fn show(&self, bytes: &[u8]) -> String {
        self.kind().decode(bytes)
    }

    fn difference(&self) -> Difference {
        Difference { id: self.entry.id, expected: self.show(&self.wanted), found: self.show(&self.found) }
    }

    fn writable(&self, when: When) -> Writable {
        let open = |phase| self.attribute.is_none_or(|attribute| !attribute.write_protected(phase));
        match when {
            When::Cp2 if open(2) => Writable::Now,
            When::Cp2 if open(3) => Writable::Later,
            When::Cp3 if open(3) => Writable::Now,
            When::Once => Writable::Now,
            When::Cp2 | When::Cp3 => Writable::Never,
        }
    }
}

/// Bytes to be kept for the value of a drive.
fn room(value: &StartupValue) -> usize {
    let len = match value {
        StartupValue::Text(text) => text.len().saturating_mul(ITEM_LEN),
        StartupValue::Bytes(bytes) => bytes.len(),
    };
    len.saturating_add(SPARE_LEN).min(DATA_MAX)
}

/// Whether the drive has not said a word.
fn is_silence(failure: &DirectFailure) -> bool {
    matches!(
        failure,
        DirectFailure::Svc(SvcFailure::HandshakeTimeout { .. } | SvcFailure::BusyTimeout { .. })
            | DirectFailure::Sdo(SdoFailure::Timeout { .. } | SdoFailure::NodeLost)
            | DirectFailure::Unanswered
    )
}

#[cfg(test)]
mod tests;
