//! The rules, as what is said when one is broken.

use core::fmt;

use crate::wire::device_control::DeviceControl;
use crate::wire::header::{Kind, Phase, PhaseField, TelegramType};
use crate::wire::hot_plug::{HotPlug, HotPlugCode};
use crate::wire::idn::Idn;
use crate::wire::layout::Offset;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Who broke a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Offender {
    /// The master.
    Master,
    /// The slave with this topology address, 1..=511.
    Slave(u16),
}

impl fmt::Display for Offender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Offender::Master => f.write_str("master"),
            Offender::Slave(address) => write!(f, "slave at position {address}"),
        }
    }
}

/// A part of the telegrams of CP3 and CP4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// Hot-plug field.
    HotPlug,
    /// Extended field of MDT0.
    Extended,
    /// Service channel of the slave.
    Svc(u16),
    /// C-DEV or S-DEV of the slave.
    DeviceWord(u16),
    /// Connection of the slave.
    Connection(u16, u8),
}

impl Part {
    /// Whether it belongs to this slave.
    pub(super) fn is_of(self, slave: u16) -> bool {
        match self {
            Part::HotPlug | Part::Extended => false,
            Part::Svc(owner) | Part::DeviceWord(owner) | Part::Connection(owner, _) => owner == slave,
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::HotPlug => f.write_str("the hot-plug field"),
            Part::Extended => f.write_str("the extended field"),
            Part::Svc(slave) => write!(f, "the service channel of position {slave}"),
            Part::DeviceWord(slave) => write!(f, "the device word of position {slave}"),
            Part::Connection(slave, index) => write!(f, "connection {index} of position {slave}"),
        }
    }
}

/// Which rule was broken, with the numbers that show it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rule {
    /// Every SERCOS frame is a broadcast with EtherType 88CD and the right CRC over its header.
    Header,
    /// Telegrams with a new layout follow at least 120 ms of silence.
    Silence {
        /// Silence kept.
        kept: DurationNs,
    },
    /// The phase goes up by one with CPS, or down to CP0.
    PhaseSequence {
        /// The phase byte of the last cycle, `None` after a start.
        last: Option<PhaseField>,
        /// The phase byte found.
        found: PhaseField,
    },
    /// All telegrams of a cycle have the phase byte of its MST.
    PhaseMixed {
        /// Kind and number of the telegram.
        telegram: TelegramType,
        /// Its phase byte.
        found: PhaseField,
        /// The MST's.
        mst: PhaseField,
    },
    /// The cycle counter goes up by one every cycle. Across a silence it may go on as it likes.
    CycleCounter {
        /// Counter found.
        found: u8,
        /// Counter expected.
        expected: u8,
    },
    /// The phase has no such telegram.
    Unexpected {
        /// Kind and number of the telegram.
        telegram: TelegramType,
        /// The phase whose layout is in force.
        phase: Phase,
    },
    /// MDTs before ATs, each kind by number, each once.
    Order {
        /// The telegram that came.
        telegram: TelegramType,
        /// The one before it in this cycle.
        last: TelegramType,
    },
    /// Every telegram of the phase is sent in every cycle.
    Missing {
        /// Kind and number of the telegram.
        telegram: TelegramType,
    },
    /// The data field has the length of the phase, or of S-0-1010 and S-0-1012.
    Length {
        /// Kind and number of the telegram.
        telegram: TelegramType,
        /// Bytes found.
        found: usize,
        /// Bytes expected.
        expected: usize,
    },
    /// The cycle time of CP0 to CP2 is a multiple of 250 us, at least 1 ms (2 ms with four telegrams).
    SetupCycle {
        /// Time from one MST to the next.
        found: DurationNs,
    },
    /// The MST comes once per cycle time, within the declared jitter.
    MstInterval {
        /// Time from one MST to the next.
        found: DurationNs,
        /// The cycle time, S-0-1002.
        cycle: DurationNs,
        /// What it may deviate, S-0-1023.
        jitter: DurationNs,
    },
    /// A hardware master's ATs begin at t1.
    AtTooEarly {
        /// Start of AT0 in the cycle.
        start: DurationNs,
        /// t1, S-0-1006.
        t1: DurationNs,
    },
    /// SERCOS telegrams end before the unified communication channel begins, or else before the cycle ends.
    TelegramTooLate {
        /// Kind and number of the telegram.
        telegram: TelegramType,
        /// Its end in the cycle.
        end: DurationNs,
        /// t6 or the end of the cycle.
        limit: DurationNs,
    },
    /// A phase is left when no slave inserts data any more.
    LeftEarly {
        /// The phase left.
        phase: Phase,
        /// Position of a slave that still inserts.
        slave: u16,
    },
    /// A slave inserts nothing 200 ms after a phase switch was announced.
    InsertsWhileSwitching {
        /// The phase that is being left.
        phase: Phase,
    },
    /// Parts of the telegrams lie beside each other.
    Overlap {
        /// MDT or AT.
        kind: Kind,
        /// Place of the second part.
        at: Offset,
        /// The first part.
        first: Part,
        /// The second part.
        second: Part,
    },
    /// Parts of the telegrams lie within a telegram that is sent.
    Beyond {
        /// MDT or AT.
        kind: Kind,
        /// Place of the part.
        at: Offset,
        /// Its bytes.
        len: usize,
        /// Bytes of the telegram.
        available: usize,
        /// The part.
        part: Part,
    },
    /// Before CP3 each slave is told what it needs.
    NotConfigured {
        /// Number of the slave in the line.
        slave: u16,
        /// The parameter that is missing or impossible.
        idn: Idn,
    },
    /// What concerns all slaves is told to all of them alike.
    NotAlike {
        /// The slave that was told something else than the first one.
        slave: u16,
        /// The parameter.
        idn: Idn,
    },
    /// tScyc is 31250, 62500, 125000 or a multiple of 250000 ns up to 65 ms.
    CycleTime {
        /// The value, ns.
        found: u32,
    },
    /// MDTs and ATs fit into the cycle.
    Load {
        /// Time on the wire with gaps, ns.
        needed_ns: u64,
        /// Cycle time, ns.
        cycle_ns: u32,
    },
    /// A time is not in its window.
    Window {
        /// The parameter.
        idn: Idn,
        /// The value, ns.
        found: u64,
        /// Smallest permitted value, ns.
        min: u64,
        /// Largest permitted value, ns.
        max: u64,
    },
    /// SERCOS addresses are 1..=511 and unique from CP3 on.
    Address {
        /// Number of the slave in the line.
        slave: u16,
        /// Its address.
        address: u16,
    },
    /// The master starts a step only when the slave is through with the one before.
    StepTooEarly {
        /// Number of the slave in the line.
        slave: u16,
    },
    /// Control word and info stay as they are until the next step; unused bits are 0.
    StepChanged {
        /// Number of the slave in the line.
        slave: u16,
    },
    /// C-DEV commands another topology together with its handshake bit only, and never store and forward.
    TopologyCommand {
        /// Number of the slave in the line.
        slave: u16,
        /// The commanded topology and the handshake bit.
        found: DeviceControl,
    },
    /// The MDTs of the two channels command a slave alike, unless those of one channel ask it to turn that channel's telegrams
    /// round: told anything else, it would turn its back on the only telegrams that it may get.
    TopologyApart {
        /// Number of the slave in the line.
        slave: u16,
        /// What the P telegrams command.
        primary: DeviceControl,
        /// What the S telegrams command.
        secondary: DeviceControl,
    },
    /// In CP1 the service channel only takes over the handshake bit.
    StepInCp1 {
        /// Number of the slave in the line.
        slave: u16,
    },
    /// A slave changes nothing but its own slots in an AT; this byte of the frame is another's.
    OutsideSlots {
        /// Kind and number of the telegram.
        telegram: TelegramType,
        /// Offset in the data field; `None` for the header.
        offset: Option<usize>,
    },
    /// A slave changes a telegram on its way to the end of the line only.
    ReturnPath {
        /// Kind and number of the telegram.
        telegram: TelegramType,
    },
    /// A slave adds one to the sequence counter at each pass and writes its address at its own place.
    Scan {
        /// The counter before.
        before: u16,
        /// The counter after.
        after: u16,
    },
    /// AHS follows MHS, and does not move by itself.
    Handshake,
    /// BUSY belongs to a step: a slave that is through with it does not become busy again.
    Busy,
    /// The counter of a connection goes up by one with each production, and the new-data bit toggles with it.
    Production {
        /// The connection.
        connection: u8,
        /// C-CON before.
        last: u16,
        /// C-CON found.
        found: u16,
    },
    /// Hot plug goes on in CP4 only.
    HotPlugPhase {
        /// The phase.
        phase: Phase,
    },
    /// There is no hot plug in a closed ring.
    HotPlugInRing,
    /// The hot-plug field of MDT0 says something that makes sense: known codes, HP0 to everybody, offsets to one slave.
    HotPlugField {
        /// The field.
        field: HotPlug,
    },
    /// HP0 tells what the slaves that take part were told.
    HotPlugValue {
        /// The parameter.
        code: HotPlugCode,
        /// The value.
        found: u32,
        /// What the others were told.
        expected: u32,
    },
    /// HP1 gives no place to an address that has one.
    HotPlugAddress {
        /// The address.
        address: u16,
    },
    /// A slave answers in the hot-plug field what it was asked.
    HotPlugAnswer {
        /// The status word.
        word: u16,
    },
}

impl fmt::Display for Rule {
    // Flat: one arm per rule.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let us = |duration: &DurationNs| format!("{} us", duration.0 / 1000);
        match self {
            Rule::Header => f.write_str("not a SERCOS frame, or wrong header CRC"),
            Rule::Silence { kept } => {
                write!(f, "new telegrams after {} of silence, 120 ms at least", us(kept))
            }
            Rule::PhaseSequence { last: Some(last), found } => write!(f, "{found} cannot follow {last}"),
            Rule::PhaseSequence { last: None, found } => write!(f, "a start with {found}"),
            Rule::PhaseMixed { telegram, found, mst } => {
                write!(f, "{telegram} has phase byte {found}, the MST of its cycle {mst}")
            }
            Rule::CycleCounter { found, expected } => {
                write!(f, "cycle counter {found}, expected {expected}")
            }
            Rule::Unexpected { telegram, phase } => write!(f, "{telegram} is no telegram of this {phase}"),
            Rule::Order { telegram, last } => write!(f, "{telegram} behind {last}"),
            Rule::Missing { telegram } => write!(f, "{telegram} was not sent"),
            Rule::Length { telegram, found, expected } => {
                write!(f, "{telegram} has {found} bytes of data, expected {expected}")
            }
            Rule::SetupCycle { found } => write!(f, "a cycle of {} in CP0 to CP2", us(found)),
            Rule::MstInterval { found, cycle, jitter } => {
                write!(f, "{} from MST to MST, the cycle has {} +- {}", us(found), us(cycle), us(jitter))
            }
            Rule::AtTooEarly { start, t1 } => {
                write!(f, "AT0 begins at {} of the cycle, t1 is {}", us(start), us(t1))
            }
            Rule::TelegramTooLate { telegram, end, limit } => {
                write!(f, "{telegram} ends at {} of the cycle, {} is the limit", us(end), us(limit))
            }
            Rule::LeftEarly { phase, slave } => {
                write!(f, "{phase} was left while position {slave} inserted data")
            }
            Rule::InsertsWhileSwitching { phase } => {
                write!(f, "still inserts data 200 ms after the switch from {phase} was announced")
            }
            Rule::Overlap { kind, at, first, second } => {
                write!(f, "{second} overlaps {first} in {kind} {at}")
            }
            Rule::Beyond { kind, at, len, available, part } => {
                write!(f, "{part}, {len} bytes at {kind} {at}, leaves its telegram of {available} bytes")
            }
            Rule::NotConfigured { slave, idn } => {
                write!(f, "CP3 without a good {idn} at position {slave}")
            }
            Rule::NotAlike { slave, idn } => {
                write!(f, "position {slave} got another {idn} than the first slave")
            }
            Rule::CycleTime { found } => write!(f, "{found} ns is no cycle time"),
            Rule::Load { needed_ns, cycle_ns } => {
                write!(f, "telegrams take {needed_ns} ns, the cycle has {cycle_ns} ns")
            }
            Rule::Window { idn, found, min, max } => {
                write!(f, "{idn} is {found} ns, its window {min} to {max} ns")
            }
            Rule::Address { slave, address } => {
                write!(f, "position {slave} has address {address}: not an address of its own")
            }
            Rule::StepTooEarly { slave } => {
                write!(f, "next step at position {slave} before the last one is through")
            }
            Rule::StepChanged { slave } => {
                write!(f, "the step on the wire at position {slave} was changed without a handshake")
            }
            Rule::TopologyCommand { slave, found } => {
                write!(
                    f,
                    "position {slave} is commanded {} without a handshake, or what is no command",
                    found.topology()
                )
            }
            Rule::TopologyApart { slave, primary, secondary } => write!(
                f,
                "position {slave} is commanded {} by P telegrams and {} by S telegrams",
                primary.topology(),
                secondary.topology()
            ),
            Rule::StepInCp1 { slave } => write!(f, "a step at position {slave} in CP1"),
            Rule::OutsideSlots { telegram, offset: Some(offset) } => {
                write!(f, "changed byte {offset} of {telegram}, outside of its slots")
            }
            Rule::OutsideSlots { telegram, offset: None } => write!(f, "changed the header of {telegram}"),
            Rule::ReturnPath { telegram } => write!(f, "changed {telegram} on the way back"),
            Rule::Scan { before, after } => {
                write!(f, "sequence counter {before:#06x} became {after:#06x}")
            }
            Rule::Handshake => f.write_str("AHS moved without MHS"),
            Rule::Busy => f.write_str("busy again with a step that was through"),
            Rule::Production { connection, last, found } => {
                write!(f, "connection {connection}: C-CON {found:#06x} behind {last:#06x}")
            }
            Rule::HotPlugPhase { phase } => write!(f, "hot plug is on in {phase}"),
            Rule::HotPlugInRing => f.write_str("hot plug is on in a closed ring"),
            Rule::HotPlugField { field } => write!(
                f,
                "hot-plug field with selection {:#06x}, control {:#06x}, info {}",
                field.selection, field.word, field.info
            ),
            Rule::HotPlugValue { code, found, expected } => {
                write!(f, "HP0 announces {code} {found}, the others got {expected}")
            }
            Rule::HotPlugAddress { address } => {
                write!(f, "HP1 gives a place to address {address}, which takes part already")
            }
            Rule::HotPlugAnswer { word } => {
                write!(f, "answers {word:#06x} in the hot-plug field without a question")
            }
        }
    }
}

/// A broken rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// When.
    pub at: MonotonicTime,
    /// Who.
    pub offender: Offender,
    /// What.
    pub rule: Rule,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} us: {}: {}", self.at.0 / 1000, self.offender, self.rule)
    }
}
