//! Computed values in cyclic read lists: what the loops of the drive make, from the signals of the cycle and from settings of the
//! drive.
//!
//! Signals are those of the update. A setting, such as a gain, changes when somebody changes it: it is read at the beginning of a
//! connection, before there are lists, again behind each write of the controller to it, and while a list uses it again and again,
//! one each [`REFRESH`]. A value that needs an actual value of the drive that no telegram carries would be older than its update: it
//! is not for cyclic lists.

use arrayvec::ArrayVec;
use profile_generic::parameter::Parameter;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::engine::access::{Access, AccessFailure, Data};
use crate::engine::axis::AxisChannel;
use crate::mapping::{AttributeEntry, AttributeTable, Backing, DriveProgram, Fact, Item, Mapping, READS_MAX};

/// Time between two reads of settings that are known.
const REFRESH: DurationNs = DurationNs::from_millis(100);

/// A setting of the drive.
#[derive(Debug, Clone, Copy)]
struct Setting {
    parameter: Parameter,
    /// `None` until the drive has answered.
    value: Option<i64>,
    /// It has to be read before the others.
    due: bool,
}

/// The settings of one drive that cyclic lists may need.
#[derive(Debug, Default)]
pub(super) struct CyclicValues {
    settings: ArrayVec<Setting, READS_MAX>,
    /// The one that the drive was asked for, and by which program. Nothing else is asked until there is an answer, whatever became of
    /// the drive.
    asked: Option<(Parameter, u64)>,
    /// The place of the next one to be refreshed, and when.
    next: (usize, MonotonicTime),
    /// A list has used one since then.
    used: bool,
    /// The program of the drive that they are of.
    programs: u64,
}

impl CyclicValues {
    /// Writes the value of a computed attribute and returns its length; `None` while it has none, or is not computed.
    pub fn octets(
        &mut self,
        (mapping, attributes): (&Mapping, &AttributeTable),
        axis: &AxisChannel,
        id: u16,
        octets: &mut [u8; 8],
    ) -> Option<usize> {
        let entry = attributes.get(id)?;
        let Backing::Parameter { parameter, feedback: None, .. } = entry.backing else { return None };
        let generic = &mapping.dictionaries.generic;
        let computation = generic.computation(parameter)?;
        let program = axis.south()?;
        self.used = true;
        let known = computation.known(
            program,
            axis.control(),
            |signal| axis.signal(signal),
            |parameter| axis.kept(parameter),
            |_, parameter| self.fact(parameter),
        );
        let value = computation.value(&known).ok()?;
        entry.from_generic(value, octets).ok().filter(|(_, clamped)| !clamped).map(|(len, _)| len)
    }

    /// What is known of a setting. What is none is computed, or there is no value.
    fn fact(&self, parameter: Parameter) -> Fact {
        match self.settings.iter().find(|known| known.parameter == parameter) {
            Some(known) => known.value.map_or(Fact::Unknown, Fact::Value),
            None => Fact::Absent,
        }
    }

    /// Whether the drive has got another program since [`CyclicValues::commission`].
    pub fn is_outdated(&self, axis: &AxisChannel) -> bool {
        self.programs != axis.programs()
    }

    /// Takes the program of a drive: the settings of what it lets be in lists will be read. Gives the attributes that it does not let
    /// be there.
    pub fn commission<'a>(
        &'a mut self,
        mapping: &'a Mapping,
        attributes: &'a AttributeTable,
        (programs, program): (u64, &'a DriveProgram),
    ) -> impl Iterator<Item = u16> + 'a {
        self.programs = programs;
        self.settings.clear();
        let entries = attributes.entries().iter();
        entries.filter(|entry| !self.admit(mapping, program, entry)).map(|entry| entry.id)
    }

    /// Whether the drive lets an attribute be in a read list, as far as that is for the drive to say.
    fn admit(&mut self, mapping: &Mapping, program: &DriveProgram, entry: &AttributeEntry) -> bool {
        let parameter = match entry.backing {
            Backing::Signal { signal, otherwise: Some(_), .. } => {
                return signal.is_command() || program.tells(signal);
            }
            Backing::Parameter { parameter, feedback: None, .. } => parameter,
            _ => return true,
        };
        let generic = &mapping.dictionaries.generic;
        let Some(computation) = generic.computation(parameter) else { return true };
        if !computation.is_cyclic(program, |parameter| generic.is_setting(parameter)) {
            return false;
        }
        for parameter in computation.reads.iter().filter_map(|read| read.parameter) {
            let is_known = self.settings.iter().any(|known| known.parameter == parameter);
            if !is_known && generic.is_setting(parameter) && program.parameter(parameter).is_some() {
                // What finds no room has no value.
                let _ = self.settings.try_push(Setting { parameter, value: None, due: true });
            }
        }
        true
    }

    /// Whether settings are still to be read that cyclic lists may need.
    pub fn is_reading(&self) -> bool {
        self.asked.is_some() || self.settings.iter().any(|setting| setting.due)
    }

    /// A connection was opened: what was known is old.
    pub fn start_over(&mut self) {
        self.settings.iter_mut().for_each(|setting| (setting.value, setting.due) = (None, true));
    }

    /// The controller has written to an item of the drive.
    pub fn written(&mut self, item: Item, axis: &AxisChannel) {
        for setting in self.settings.iter_mut().filter(|known| item_of(axis, known.parameter) == Some(item)) {
            setting.due = true;
        }
    }

    /// Asks the drive for the setting that is due.
    pub fn advance(&mut self, now: MonotonicTime, axis: &AxisChannel, ask: impl FnOnce(&Access) -> bool) {
        if self.settings.is_empty() || self.asked.is_some() {
            return;
        }
        let at = match self.settings.iter().position(|known| known.due) {
            Some(at) => at,
            None if self.used && now >= self.next.1 => self.next.0 % self.settings.len(),
            None => return,
        };
        (self.next, self.used) = ((at + 1, now + REFRESH), false);
        let Some(setting) = self.settings.get_mut(at) else { return };
        if let Some(item) = item_of(axis, setting.parameter)
            && ask(&Access::read(item))
        {
            setting.due = false;
            self.asked = Some((setting.parameter, axis.programs()));
        }
    }

    /// Takes the answer of the drive. What it does not give has no value.
    pub fn take(&mut self, result: Result<&Data, AccessFailure>, axis: &AxisChannel) {
        let Some((parameter, programs)) = self.asked.take() else { return };
        if programs != axis.programs() {
            return;
        }
        let held = axis.south().and_then(|program| program.parameter(parameter));
        let value = result.ok().and_then(|data| held?.decode(data));
        if let Some(setting) = self.settings.iter_mut().find(|known| known.parameter == parameter) {
            setting.value = value;
        }
    }
}

fn item_of(axis: &AxisChannel, parameter: Parameter) -> Option<Item> {
    axis.south()?.parameter(parameter).map(|held| held.item)
}
