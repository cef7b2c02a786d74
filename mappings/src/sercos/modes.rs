//! Which operating modes of an axis its SERCOS drive has, in which parameters they stand, and which values they need.
//!
//! A mode that is configured has to be there. Where none is, every mode that the drive has is used and the others are left
//! out, each with the reason.

use profile_generic::image::Signal;
use profile_generic::mode::ModeSelection;
use profile_sercos::wire::idn::Idn;

use super::captures;
use super::compile::{Compiler, SercosError};
use super::fixed_connections::FixedConnections;
use super::scaling::ScalingError;
use super::tables::{ModeRule, SlotRule};

/// The modes of an axis.
pub(crate) struct Modes<'t> {
    /// Those that it has, each with the parameter that keeps it.
    pub chosen: Vec<(&'t ModeRule, &'t SlotRule)>,
    /// Those that it does without, and why.
    pub left_out: Vec<(ModeSelection, SercosError)>,
}

/// Values with the IDNs that carry them.
pub(crate) type Signals = Vec<(Signal, Idn)>;

impl<'t> Compiler<'t> {
    /// The rows of the modes that the drive can have by what it lists, in the order of their parameters, and those that it
    /// cannot have. One that the axis can do without takes no parameter where it is not there.
    ///
    /// # Errors
    /// A mode has no row, a configured one is not there, none is, or there are more than parameters.
    #[allow(clippy::type_complexity, reason = "chosen and left out, each with what belongs to it")]
    pub fn listed_modes(
        &self,
    ) -> Result<(Vec<&'t ModeRule>, Vec<(ModeSelection, SercosError)>), SercosError> {
        let Self { tables, axis, facts, .. } = *self;
        let fixed = FixedConnections::of(tables, facts)?;
        let mut rules = Vec::with_capacity(axis.modes.len());
        let mut left_out = Vec::new();
        for selection in &axis.modes {
            let rule = tables.modes.iter().find(|rule| rule.selection == *selection);
            let rule = match (rule, tables.procedure(*selection)) {
                (Some(rule), _) => rule,
                (None, Some(_)) => continue,
                (None, None) => return Err(SercosError::Mode(*selection)),
            };
            let lack = self.not_listed(rule);
            match lack.or_else(|| fixed.as_ref().and_then(|fixed| self.not_in_lists(rule, fixed))) {
                None => rules.push(rule),
                Some(_) if rule.optional => {}
                Some(lack) if axis.any_mode => left_out.push((*selection, lack)),
                Some(lack) => return Err(lack),
            }
        }
        if rules.is_empty() {
            return Err(none_left(left_out));
        }
        if rules.len() > tables.slots.len() {
            return Err(SercosError::Slots { slots: tables.slots.len(), modes: rules.len() });
        }
        Ok((rules, left_out))
    }

    /// The modes of the axis, once the drive has taken or refused them and has told its scaling.
    ///
    /// # Errors
    /// As [`Self::listed_modes`].
    pub fn modes(&self) -> Result<Modes<'t>, SercosError> {
        let (rules, mut left_out) = self.listed_modes()?;
        let mut chosen = Vec::with_capacity(rules.len());
        for (rule, slot) in rules.into_iter().zip(&self.tables.slots) {
            match self.lack(rule, slot) {
                None => chosen.push((rule, slot)),
                Some(_) if rule.optional => {}
                Some(lack) if self.axis.any_mode => left_out.push((rule.selection, lack)),
                Some(lack) => return Err(lack),
            }
        }
        if chosen.is_empty() { Err(none_left(left_out)) } else { Ok(Modes { chosen, left_out }) }
    }

    /// The values of all modes, each once, in the order of the modes: to the drive and from it.
    ///
    /// # Errors
    /// As [`Self::modes`].
    pub fn signals(&self) -> Result<(Signals, Signals), SercosError> {
        let Self { tables, facts, .. } = *self;
        let (mut command, mut actual) = (Signals::new(), Signals::new());
        let fixed = FixedConnections::of(tables, facts)?;
        for (rule, _) in self.modes()?.chosen {
            for (wanted, list) in [(&rule.command, &mut command), (&rule.actual, &mut actual)] {
                for &signal in wanted {
                    let Some(row) = tables.signal(signal) else { continue };
                    if list.iter().any(|(known, _)| *known == signal) {
                        continue;
                    }
                    let may = || captures::may_be_cyclic(tables, facts, row.idn, signal.is_command());
                    let there = match &fixed {
                        Some(fixed) => fixed.of_signal(signal).idns.contains(&row.idn),
                        None if row.refuse => true,
                        None => !self.axis.bare && may() && self.scaling_lack(signal, row.idn).is_none(),
                    };
                    if there {
                        list.push((signal, row.idn));
                    }
                }
            }
        }
        Ok((command, actual))
    }

    /// Codes of an operation mode that the drive may have, in order of preference.
    pub fn codes(&self, rule: &ModeRule) -> Vec<u16> {
        let listed = self.facts.words(self.tables.supported_modes);
        let listed = listed.unwrap_or_else(|| self.set_modes().into_iter().map(|(_, code)| code).collect());
        let has = |code: &u16| listed.is_empty() || listed.contains(code);
        rule.codes.iter().copied().filter(has).collect()
    }

    /// What a drive that does not list its modes is set to, unless they are configured.
    fn set_modes(&self) -> Vec<(Idn, u16)> {
        if !self.axis.any_mode || !self.facts.is_told(self.tables.supported_modes) {
            return Vec::new();
        }
        let slots = self.tables.slots.iter().map(|slot| slot.idn);
        let set = slots.filter_map(|idn| Some((idn, *self.facts.words(idn)?.first()?)));
        set.filter(|(_, code)| *code != 0).collect()
    }

    /// Why the drive cannot have a mode by what it says of its modes.
    fn not_listed(&self, rule: &ModeRule) -> Option<SercosError> {
        let has = |code: &u16| rule.codes.contains(code);
        let show =
            |codes: &[u16]| codes.iter().map(|code| format!("{code:#06x}")).collect::<Vec<_>>().join(", ");
        let (list, mode) = (self.tables.supported_modes, rule.selection);
        if let Some(found) = self.facts.words(list) {
            return (!found.iter().any(has)).then(|| {
                let (wanted, found) = (show(&rule.codes), show(&found));
                SercosError::NotSupported { list, mode, wanted, found }
            });
        }
        let set = self.set_modes();
        let lacks = !set.is_empty() && !set.iter().any(|(_, code)| has(code));
        lacks.then(|| {
            let found: Vec<_> = set.iter().map(|(idn, code)| format!("{idn} = {code:#06x}")).collect();
            SercosError::NotSelected { mode, wanted: show(&rule.codes), found: found.join(", ") }
        })
    }

    /// A value that a mode needs and that the fixed connections of a drive do not carry.
    fn not_in_lists(&self, rule: &ModeRule, fixed: &FixedConnections) -> Option<SercosError> {
        self.needed(rule).find_map(|(signal, idn)| {
            let connection = fixed.of_signal(signal);
            let lacks = !connection.idns.contains(&idn);
            let (list, mode) = (connection.list(), rule.selection);
            lacks.then_some(SercosError::FixedMissing { list, idn, signal, mode })
        })
    }

    /// Why the drive does not have a mode that it lists: it has refused it, or a value that the mode needs is not there, or
    /// not in a telegram, or in a unit that nobody knows.
    fn lack(&self, rule: &ModeRule, slot: &SlotRule) -> Option<SercosError> {
        let facts = self.facts;
        if facts.is_refused(slot.idn) || facts.is_missing(slot.idn) {
            return Some(SercosError::SlotRefused(slot.idn));
        }
        self.needed(rule).find_map(|(signal, idn)| {
            let list = self.tables.configurable[usize::from(signal.is_command())];
            let fixed = facts.has_fixed_connections();
            if facts.is_missing(idn) {
                Some(SercosError::Missing { idn, signal })
            } else if !fixed && facts.data(list).is_some() && !captures::is_listed(list, idn, facts) {
                Some(SercosError::NotConfigurable { list, idn, signal })
            } else {
                self.scaling_lack(signal, idn)
            }
        })
    }

    /// Why a value cannot be scaled. What was not asked yet is no reason.
    fn scaling_lack(&self, signal: Signal, idn: Idn) -> Option<SercosError> {
        match self.unit(idn, signal.quantity()).err()? {
            SercosError::Scaling(ScalingError::NotRead(parameter)) if !self.facts.is_told(parameter) => None,
            lack => Some(lack),
        }
    }

    /// The values that a mode cannot do without.
    fn needed(&self, rule: &'t ModeRule) -> impl Iterator<Item = (Signal, Idn)> + use<'t> {
        let tables = self.tables;
        rule.command.iter().chain(&rule.actual).filter_map(move |signal| {
            let row = tables.signal(*signal).filter(|row| row.refuse)?;
            Some((*signal, row.idn))
        })
    }
}

/// What is told when no mode is left: the reason for the first.
fn none_left(left_out: Vec<(ModeSelection, SercosError)>) -> SercosError {
    left_out.into_iter().next().map_or(SercosError::NoMode, |(_, lack)| lack)
}
