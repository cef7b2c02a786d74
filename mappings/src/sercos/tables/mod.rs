//! Generic <-> SERCOS: the mapping file with every name resolved.

mod builder;

use arrayvec::ArrayVec;
use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::program::BitPattern;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{Action, Report};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use super::captures::CaptureRule;
use super::scaling::ScalingRule;
use crate::dictionary::{Dictionaries, IdnUnit};
use crate::drive_program::FaultRow;
use crate::drive_rows::FixedUnit;
use crate::feedback::FeedbackUse;

#[derive(Debug, Clone)]
pub(crate) struct SignalRule {
    pub signal: Signal,
    pub idn: Idn,
    /// Whether an axis cannot work without it.
    pub refuse: bool,
    /// The bit by which the drive inverts it.
    pub polarity: Option<Polarity>,
    /// The same by the encoder of the load.
    pub load: Option<(Idn, Option<Polarity>)>,
}

/// A bit of a polarity parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Polarity {
    pub idn: Idn,
    pub bit: u32,
}

#[derive(Debug, Clone)]
pub(crate) struct ModeRule {
    pub selection: ModeSelection,
    /// Whether an axis can do without it.
    pub optional: bool,
    pub codes: Vec<u16>,
    /// Those for the encoder of the load; none where it does not matter to the mode.
    pub load_codes: Vec<u16>,
    pub command: Vec<Signal>,
    pub actual: Vec<Signal>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct SlotRule {
    pub control: BitPattern,
    pub status: BitPattern,
    pub idn: Idn,
}

/// A mode that is a sequence of procedure commands.
#[derive(Debug, Clone)]
pub(crate) struct ProcedureRule {
    pub selection: ModeSelection,
    /// The mode in which the controller moves the axis meanwhile.
    pub led_in: Option<ModeSelection>,
    pub commands: Vec<Idn>,
}

/// What a status word says.
#[derive(Debug, Clone, Copy)]
pub struct ReportRule {
    /// Bits of the status word.
    pub pattern: BitPattern,
    /// What they say.
    pub report: Report,
    /// For drives that acknowledge, or for those that do not.
    pub acknowledges: Option<bool>,
    /// While a procedure is carried out, or otherwise.
    pub procedure: Option<bool>,
}

/// A status bit in a word of the drive's telegram.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StatusRule {
    pub word: Idn,
    pub pattern: BitPattern,
    pub bit: StatusBits,
    /// For drives that acknowledge, or for those that do not.
    pub acknowledges: Option<bool>,
}

/// Where a drive keeps a parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ParameterAt {
    pub idn: Idn,
    /// The drive's element 4 reports the unit.
    pub unit_by_drive: bool,
    /// The operation mode in which the drive goes by it, where that is one of several for the same.
    pub acts_in: Option<u16>,
}

pub(crate) type ParameterRule = crate::drive_rows::ParameterRule<ParameterAt>;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum StepKind {
    WriteValue(Idn, i64),
    WriteParameter(Parameter),
    WriteModes,
    Read { idn: Idn, elements: Elements },
    ReadScaling,
    ReadTelegram,
    ReadParameters,
    ReadCaptures,
    ReadProcedures,
    Command(Idn),
}

/// Elements of a data block.
pub(crate) type Elements = ArrayVec<Element, 5>;

#[derive(Debug, Clone)]
pub(crate) struct StepRule {
    pub phase: u8,
    pub kind: StepKind,
    pub axis: Option<UnitKind>,
    pub modulo: Option<bool>,
    pub set_scaling: Option<bool>,
    pub mode: Option<OperatingMode>,
    pub captures: Option<bool>,
    /// Whether commissioning fails when the drive refuses.
    pub fail: bool,
}

/// The mapping of the generic model to SERCOS.
#[derive(Debug, Clone, Default)]
pub struct SercosTables {
    pub(crate) units: Vec<FixedUnit>,
    pub(crate) scalings: Vec<ScalingRule>,
    /// The polarity whose sign is that of the axis.
    pub(crate) direction: Option<Polarity>,
    pub(crate) control: Idn,
    pub(crate) status_word: Idn,
    pub(crate) signals: Vec<SignalRule>,
    pub(crate) modes: Vec<ModeRule>,
    pub(crate) slots: Vec<SlotRule>,
    /// The drive's list of its operation modes.
    pub(crate) supported_modes: Idn,
    pub(crate) procedures: Vec<ProcedureRule>,
    pub(crate) actions: Vec<(Action, BitPattern)>,
    pub(crate) commands: Vec<(Action, Idn)>,
    pub(crate) reports: Vec<ReportRule>,
    pub(crate) status: Vec<StatusRule>,
    pub(crate) faults: Vec<FaultRow>,
    /// The diagnostic message that the drive has for them: number and text.
    pub(crate) diagnosis: Option<[Idn; 2]>,
    pub(crate) parameters: Vec<ParameterRule>,
    pub(crate) captures: Vec<CaptureRule>,
    /// The drive's lists of what its telegram, and the master's, may carry.
    pub(crate) configurable: [Idn; 2],
    pub(crate) steps: Vec<StepRule>,
    /// IDNs of the drive profile that no row binds, and why.
    pub unbound: Vec<(Idn, String)>,
    /// Those that no row binds for no reason.
    pub(crate) unanswered: Vec<Idn>,
}

impl SercosTables {
    /// The tables for axes with this use of their encoders.
    pub(crate) fn for_feedback(&self, feedback: FeedbackUse) -> Self {
        let mut tables = self.clone();
        if feedback == FeedbackUse::Motor {
            return tables;
        }
        for mode in tables.modes.iter_mut().filter(|mode| !mode.load_codes.is_empty()) {
            mode.codes.clone_from(&mode.load_codes);
        }
        if feedback == FeedbackUse::Load {
            // That of the motor is not meant, and no source has the unit of the load's: the gateway derives it from positions.
            tables.modes.iter_mut().for_each(|mode| mode.actual.retain(|of| *of != Signal::VelocityActual));
        }
        for rule in &mut tables.signals {
            if let Some((idn, polarity)) = rule.load {
                (rule.idn, rule.polarity) = (idn, polarity);
                if rule.signal == Signal::PositionActual {
                    // The axis goes the way of its actual position.
                    tables.direction = polarity.or(tables.direction);
                }
            }
        }
        tables
    }

    pub(crate) fn signal(&self, signal: Signal) -> Option<&SignalRule> {
        self.signals.iter().find(|rule| rule.signal == signal)
    }

    /// The words with status bits beside the status word, once.
    pub(crate) fn status_words(&self) -> Vec<Idn> {
        let mut words: Vec<Idn> = Vec::new();
        for rule in self.status.iter().filter(|rule| rule.word != self.status_word) {
            if !words.contains(&rule.word) {
                words.push(rule.word);
            }
        }
        words
    }

    /// Those of them that are put into the telegram for their status bits. The input of a capture is there where captures are
    /// wanted, and its status bits with it.
    pub(crate) fn added_words(&self) -> Vec<Idn> {
        let input = |idn: Idn| self.captures.iter().any(|rule| rule.input() == Some(idn));
        self.status_words().into_iter().filter(|idn| !input(*idn)).collect()
    }

    pub(crate) fn procedure(&self, selection: ModeSelection) -> Option<&ProcedureRule> {
        self.procedures.iter().find(|rule| rule.selection == selection)
    }

    /// Every polarity parameter, once.
    pub(crate) fn polarity_idns(&self) -> Vec<Idn> {
        let mut idns: Vec<Idn> =
            self.signals.iter().filter_map(|rule| rule.polarity).map(|bit| bit.idn).collect();
        idns.extend(self.direction.map(|bit| bit.idn));
        idns.sort();
        idns.dedup();
        idns
    }

    /// A rule that only converts a value of this IDN, both ways, to the quantity that its scaling gives.
    pub(crate) fn plain_rule(&self, idn: Idn, dictionaries: &Dictionaries) -> Option<ParameterRule> {
        let IdnUnit::Scaled(scaling) = &dictionaries.sercos.idn(idn)?.unit else { return None };
        let rule = self.scalings.iter().find(|rule| rule.scaling == *scaling)?;
        let quantity = rule.methods.first()?.quantity;
        Some(ParameterRule::plain(quantity, ParameterAt { idn, unit_by_drive: false, acts_in: None }))
    }

    /// Whether a row looks for faults in this word.
    pub fn is_diagnostic(&self, idn: Idn) -> bool {
        self.faults.iter().any(|row| row.word == idn.into())
    }

    /// The faults and warnings in the diagnostic words, in the order of the rows.
    pub fn faults(&self) -> &[FaultRow] {
        &self.faults
    }

    /// What a status word says, in the order of the rows.
    pub fn reports(&self) -> &[ReportRule] {
        &self.reports
    }
}
