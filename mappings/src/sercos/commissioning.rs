//! What is written to and read from a drive before it takes part in the cycle.

use profile_generic::program::Width;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use super::captures;
use super::compile::{Compiler, SercosAxis, SercosError};
use super::facts::DriveFacts;
use super::survey::{Survey, survey};
use super::tables::{Elements, SercosTables, StepKind, StepRule};
use crate::capture_program::CaptureMode;
use crate::dictionary::SercosDictionary;
use crate::drive_program::Telegram;
use crate::item::Item;

/// Elements that say what a value means.
const DESCRIPTION: [Element; 4] = [Element::Attribute, Element::Unit, Element::Minimum, Element::Maximum];

/// The same, and the value.
const ALL: [Element; 5] =
    [Element::Attribute, Element::Unit, Element::Minimum, Element::Maximum, Element::Data];

/// What happens when a drive refuses a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Commissioning fails.
    Fail,
    /// The next step follows.
    Continue,
}

/// One access to the service channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Writes element 7.
    Write {
        /// The parameter.
        idn: Idn,
        /// Encoded values in order of preference: the next is tried when the drive refuses one.
        candidates: Vec<Vec<u8>>,
        /// What happens when it refuses all.
        refused: Refused,
    },
    /// Reads elements and notes them in the [`DriveFacts`].
    Read {
        /// The parameter.
        idn: Idn,
        /// The elements, in this order. A drive may do without unit, minimum and maximum.
        elements: Elements,
        /// What happens when the drive refuses element 3 or 7.
        refused: Refused,
    },
    /// Executes a procedure command.
    Command {
        /// The command.
        idn: Idn,
        /// What happens when it ends with an error.
        refused: Refused,
    },
}

/// The steps of one communication phase, in order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CommissioningPlan {
    /// The steps.
    pub steps: Vec<Step>,
    /// The phase is planned again, with what these steps tell.
    pub more: bool,
}

impl CommissioningPlan {
    /// The steps of a phase. Parameters are converted by the scaling that earlier phases have read.
    ///
    /// # Errors
    /// A mode has no row, a parameter has no scaling yet, or its value does not fit the drive.
    pub(crate) fn compile(
        tables: &SercosTables,
        dictionary: &SercosDictionary,
        axis: &SercosAxis,
        phase: u8,
        facts: &DriveFacts,
    ) -> Result<Self, SercosError> {
        let mut plan = Self::default();
        if let Some(survey) = survey(tables, facts) {
            plan.survey(survey);
            return Ok(plan);
        }
        let compiler = Compiler { tables, dictionary, axis, facts };
        for rule in tables.steps.iter().filter(|rule| rule.phase == phase && applies(rule, axis)) {
            compiler.step(rule, &mut plan.steps)?;
        }
        Ok(plan)
    }
}

impl CommissioningPlan {
    fn survey(&mut self, survey: Survey) {
        self.more = true;
        let mut read = |idn, elements: &[Element], refused| {
            self.steps.push(Step::Read { idn, elements: elements.iter().copied().collect(), refused });
        };
        match survey {
            Survey::Lists(lists) => {
                for (setup, list) in lists {
                    read(setup, &[Element::Data], Refused::Continue);
                    read(list, &[Element::Data], Refused::Fail);
                }
            }
            Survey::Values(idns) => {
                for idn in idns {
                    read(idn, &DESCRIPTION, Refused::Fail);
                }
            }
            Survey::Modes(idns) => {
                for idn in idns {
                    read(idn, &[Element::Data], Refused::Continue);
                }
            }
        }
    }
}

impl SercosTables {
    /// The IDNs that commissioning writes into the drive of an axis, in order: others have no say in them. What the axis arms its
    /// captures by is among them.
    pub(crate) fn written(&self, axis: &SercosAxis) -> Vec<Idn> {
        let mut idns = Vec::new();
        for rule in self.steps.iter().filter(|rule| applies(rule, axis)) {
            match rule.kind {
                StepKind::WriteValue(idn, _) => idns.push(idn),
                StepKind::WriteParameter(parameter) => {
                    let has_value = axis.parameters.iter().any(|(known, _)| *known == parameter);
                    let rule = self.parameters.iter().find(|rule| has_value && rule.parameter == parameter);
                    idns.extend(rule.map(|rule| rule.at.idn));
                }
                StepKind::WriteModes => idns.extend(self.slots.iter().map(|slot| slot.idn)),
                _ => {}
            }
        }
        if axis.captures != CaptureMode::Off {
            idns.extend(captures::idns(self));
        }
        idns.sort_unstable();
        idns.dedup();
        idns
    }
}

fn applies(rule: &StepRule, axis: &SercosAxis) -> bool {
    rule.axis.is_none_or(|kind| kind == axis.units.kind)
        && rule.modulo.is_none_or(|modulo| modulo == axis.modulo)
        && rule.set_scaling.is_none_or(|set| set == axis.set_scaling)
        && rule.captures.is_none_or(|captures| captures == (axis.captures != CaptureMode::Off))
        && rule.mode.is_none_or(|mode| axis.modes.iter().any(|known| known.mode == mode))
}

impl Compiler<'_> {
    fn step(&self, rule: &StepRule, steps: &mut Vec<Step>) -> Result<(), SercosError> {
        let refused = if rule.fail { Refused::Fail } else { Refused::Continue };
        let read = |steps: &mut Vec<Step>, idns: Vec<Idn>, elements: &[Element]| {
            for idn in idns {
                steps.push(Step::Read { idn, elements: elements.iter().copied().collect(), refused });
            }
        };
        match rule.kind.clone() {
            StepKind::WriteValue(idn, value) => {
                let width = self.facts.width(idn, self.dictionary).ok_or(SercosError::Length(idn))?;
                let candidates = vec![encode(idn, value, width)?];
                steps.push(Step::Write { idn, candidates, refused });
            }
            StepKind::WriteParameter(parameter) => {
                let values = self.axis.parameters.iter().filter(|(known, _)| *known == parameter);
                let rules = self.tables.parameters.iter().find(|rule| rule.parameter == parameter);
                for ((_, generic), rule) in values.zip(rules) {
                    let Some(entry) = self.parameter(rule)? else { continue };
                    let Some(conversion) = entry.to_drive else { continue };
                    let outcome = conversion.convert(*generic);
                    if outcome.saturated {
                        let unlimited = conversion.within(i64::MIN, i64::MAX).convert(*generic).value;
                        return Err(SercosError::Limit {
                            idn: rule.at.idn,
                            value: unlimited,
                            limits: (conversion.min, conversion.max),
                        });
                    }
                    let candidates = vec![encode(rule.at.idn, outcome.value, entry.width)?];
                    steps.push(Step::Write { idn: rule.at.idn, candidates, refused });
                }
            }
            StepKind::WriteModes => {
                for (mode, slot) in self.listed_modes()?.0.into_iter().zip(&self.tables.slots) {
                    let codes = self.codes(mode);
                    let candidates = codes.iter().map(|code| code.to_le_bytes().to_vec()).collect();
                    let optional = mode.optional || self.axis.any_mode;
                    let refused = if optional { Refused::Continue } else { refused };
                    steps.push(Step::Write { idn: slot.idn, candidates, refused });
                }
            }
            StepKind::Read { idn, elements } => steps.push(Step::Read { idn, elements, refused }),
            StepKind::ReadScaling => {
                let mut idns: Vec<Idn> = Vec::new();
                for idn in self.tables.scalings.iter().flat_map(|rule| rule.idns()) {
                    if !idns.contains(&idn) {
                        idns.push(idn);
                    }
                }
                idns.extend(self.tables.polarity_idns());
                read(steps, idns, &ALL);
            }
            StepKind::ReadTelegram => {
                let telegram = Telegram::compile(self.tables, self.dictionary, self.axis, self.facts)?;
                let both = telegram.command.into_iter().chain(telegram.feedback);
                let mut idns: Vec<Idn> = both.filter_map(Item::idn).collect();
                // Whether they come into it shows only now.
                let words = self.tables.added_words();
                idns.extend(words.into_iter().filter(|idn| !self.facts.is_missing(*idn)));
                read(steps, idns, &DESCRIPTION);
            }
            StepKind::ReadParameters => {
                // What is in a telegram was read for it.
                let telegram = Telegram::compile(self.tables, self.dictionary, self.axis, self.facts)?;
                let cyclic = |idn: &Idn| {
                    let item = Item::from(*idn);
                    telegram.command.contains(&item) || telegram.feedback.contains(&item)
                };
                let idns = self.tables.parameters.iter().map(|rule| rule.at.idn).filter(|idn| !cyclic(idn));
                read(steps, idns.collect(), &DESCRIPTION);
            }
            StepKind::ReadCaptures => read(steps, captures::idns(self.tables), &DESCRIPTION),
            StepKind::ReadProcedures => {
                let rules = self.axis.modes.iter().filter_map(|mode| self.tables.procedure(*mode));
                let idns = rules.flat_map(|rule| rule.commands.iter().copied()).collect();
                read(steps, idns, &[Element::Attribute]);
            }
            StepKind::Command(idn) => steps.push(Step::Command { idn, refused }),
        }
        Ok(())
    }
}

fn encode(idn: Idn, value: i64, width: Width) -> Result<Vec<u8>, SercosError> {
    let (min, max) = width.range();
    if !(min..=max).contains(&value) {
        return Err(SercosError::Range { idn, value, width });
    }
    let bytes = value.to_le_bytes();
    Ok(bytes.iter().copied().take(width.bytes()).collect())
}
