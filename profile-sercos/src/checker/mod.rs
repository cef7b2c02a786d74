//! Checks a network: every telegram of the master and every change that a slave makes is judged by the standard.
//!
//! [`Checker`] is told what passes: [`Checker::sent`] for each telegram of the master, [`Checker::passed`] for each
//! station behind which a telegram looks different or not. What the slaves are told over their service channels is
//! learned from the wire, not from the master, so that master and slaves cannot agree on the same mistake. A
//! [`Violation`] names the station and the rule.
//!
//! [`bus::VirtualBus`] is a master and its slaves in virtual time under a checker; it carries the protocol tests. Rigs with
//! other masters, or with the whole box in front, use a [`checked_bus::CheckedBus`] as well.
//! The checker allocates; it is no part of the cyclic path.

pub mod bus;
pub mod checked_bus;
mod hot_plug;
#[cfg(test)]
mod hot_plug_tests;
mod learned;
#[cfg(test)]
pub(crate) mod light;
mod plan;
mod rule;
mod station;
#[cfg(test)]
mod tests;

use profile_generic::time::{DurationNs, MonotonicTime};

pub use self::rule::{Offender, Part, Rule, Violation};

use self::hot_plug::HotPlugs;
use self::plan::Plan;
use self::station::Station;
use crate::wire::connection::CONNECTION_CONTROL_LEN;
use crate::wire::cp0::{self, CommunicationVersion, MdtRepr, NO_SLAVE, SequenceCounter, TopologyField};
use crate::wire::cp12;
use crate::wire::header::{
    Channel, HEADER_LEN, Header, Kind, Phase, PhaseField, TELEGRAMS_MAX, TelegramType,
};
use crate::wire::hot_plug::HOT_PLUG_LEN;
use crate::wire::layout::DEVICE_WORD_LEN;
use crate::wire::svc::SVC_LEN;
use profile_generic::wire::u16_at;

/// Silence before telegrams with a new layout.
pub const SILENCE: DurationNs = DurationNs::from_millis(120);

/// Time for the slaves to stop inserting data.
const SWITCH_TIMEOUT: DurationNs = DurationNs::from_millis(200);

/// Smallest cycle time in CP0 to CP2, with two and with four telegrams, and its step.
const SETUP_CYCLE: DurationNs = DurationNs::from_millis(1);
const SETUP_CYCLE_FOUR: DurationNs = DurationNs::from_millis(2);
const SETUP_STEP_NS: i64 = 250_000;

/// Bytes of a frame on the wire that are not in the buffer: preamble 8, FCS 4.
const WIRE_EXTRA: usize = 12;

/// What the checker has to know besides what is on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckerConfig {
    /// Deviation of the MST in CP0 to CP2, where no slave has been told S-0-1023 yet.
    pub setup_jitter: DurationNs,
    /// The master sends ATs right behind the MDTs instead of at t1, as soft masters do. Masters that tell so in
    /// S-0-1032 need not be named here; slaves with version 1 classes are not told.
    pub soft_master: bool,
}

impl Default for CheckerConfig {
    fn default() -> CheckerConfig {
        CheckerConfig { setup_jitter: DurationNs::from_micros(50), soft_master: true }
    }
}

/// The cycle that is going on.
#[derive(Debug)]
struct Cycle {
    start: MonotonicTime,
    phase: PhaseField,
    seen: Vec<TelegramType>,
}

/// Watches one master and its slaves.
#[derive(Debug)]
pub struct Checker {
    config: CheckerConfig,
    violations: Vec<Violation>,
    /// End of the last telegram, or the start of the watch.
    quiet_since: MonotonicTime,
    cycle: Option<Cycle>,
    /// The phase whose telegrams are on the wire.
    phase: Phase,
    /// The first interval of a phase has no length.
    interval_known: bool,
    version: CommunicationVersion,
    switching_since: Option<MonotonicTime>,
    stations: Vec<Station>,
    plan: Option<Plan>,
    /// The channel whose MST began the cycle.
    leading: Channel,
    /// ATs of this cycle into which each slave has written, one bit each.
    answered: Vec<u16>,
    hot_plugs: HotPlugs,
}

impl Checker {
    /// Begins to watch at `now`, with nothing on the wire.
    #[must_use]
    pub fn new(config: CheckerConfig, now: MonotonicTime) -> Checker {
        Checker {
            config,
            violations: Vec::new(),
            quiet_since: now,
            cycle: None,
            phase: Phase::CP0,
            interval_known: false,
            version: CommunicationVersion::empty(),
            switching_since: None,
            stations: Vec::new(),
            plan: None,
            leading: Channel::Primary,
            answered: Vec::new(),
            hot_plugs: HotPlugs::default(),
        }
    }

    /// What was broken so far, in order.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Takes the violations away.
    pub fn take_violations(&mut self) -> Vec<Violation> {
        std::mem::take(&mut self.violations)
    }

    fn violation(&mut self, at: MonotonicTime, offender: Offender, rule: Rule) {
        self.violations.push(Violation { at, offender, rule });
    }

    /// The master sends a telegram; its preamble begins on the wire at `at`.
    pub fn sent(&mut self, at: MonotonicTime, frame: &[u8]) {
        let Ok(header) = Header::parse(frame) else {
            self.violation(at, Offender::Master, Rule::Header);
            return;
        };
        let telegram = header.telegram;
        if telegram.is_mst() && self.leads(telegram.channel(), header.phase) {
            self.mst(at, header.phase);
        }
        let leads = telegram.channel() == self.leading;
        if leads {
            self.order(at, telegram);
        }
        let mst = self.cycle.as_ref().map(|cycle| cycle.phase);
        if let Some(mst) = mst.filter(|&mst| mst != header.phase) {
            self.violation(at, Offender::Master, Rule::PhaseMixed { telegram, found: header.phase, mst });
        }
        let data = &frame[HEADER_LEN..];
        self.length(at, telegram, data.len());
        let end = at + wire_time(frame.len());
        self.window(at, end, telegram);
        self.quiet_since = self.quiet_since.max(end);
        if telegram.kind() == Kind::Mdt && telegram.number() == 0 && self.phase >= Phase::CP3 {
            self.hot_plug_field(at, telegram.channel(), data);
        }
        if telegram.kind() == Kind::Mdt && self.phase >= Phase::CP1 {
            self.topology_commands(at, telegram, data);
        }
        if telegram.kind() == Kind::Mdt && leads {
            self.mdt(at, telegram.number(), data);
        }
    }

    /// Whether the MST begins a cycle. With two ports there are two of each telegram; one of the channels leads.
    fn leads(&mut self, channel: Channel, field: PhaseField) -> bool {
        let copy = channel != self.leading && self.cycle.as_ref().is_some_and(|cycle| cycle.phase == field);
        if !copy {
            self.leading = channel;
            self.answered.clear();
        }
        !copy
    }

    /// Whether this is the first of the copies of an AT into which the slave writes in this cycle.
    fn first_answer(&mut self, index: usize, number: u8) -> bool {
        if self.answered.len() <= index {
            self.answered.resize(index + 1, 0);
        }
        let (place, bit) = (&mut self.answered[index], 1u16 << (number & 0xF));
        let first = *place & bit == 0;
        *place |= bit;
        first
    }

    /// A new cycle: its phase, its counter, and its distance from the one before.
    fn mst(&mut self, at: MonotonicTime, field: PhaseField) {
        self.finish_cycle(at);
        let last = self.cycle.as_ref().map(|cycle| (cycle.start, cycle.phase));
        let silence = at - self.quiet_since;
        let broken = |checker: &mut Checker, rule| checker.violation(at, Offender::Master, rule);
        let cycles = last.is_some() && silence < SILENCE;
        // Behind a silence any count may follow: some masters count the cycles in which they are silent, too.
        if let Some((_, last)) = last.filter(|_| cycles) {
            let expected = (last.cycle_count() + 1) & 7;
            let found = field.cycle_count();
            if found != expected {
                broken(self, Rule::CycleCounter { found, expected });
            }
        }
        let before = last.map(|(_, field)| field);
        let step = phase_step(self.phase, before, field);
        match step {
            // A start with CP0 needs no announcement, but its silence.
            _ if !cycles && field.phase() == Phase::CP0 && !field.switching() => {
                self.enter(at, field.phase(), silence);
            }
            Step::Same => {}
            Step::Announce => {
                self.switching_since = Some(at);
                for station in &mut self.stations {
                    station.reported = false;
                }
            }
            Step::Enter => self.enter(at, field.phase(), silence),
            Step::Wrong => {
                broken(self, Rule::PhaseSequence { last: before, found: field });
                if !field.switching() {
                    self.phase = field.phase();
                }
            }
        }
        // Whoever is gone does not insert any more.
        for station in &mut self.stations {
            station.valid = std::mem::take(&mut station.inserts);
        }
        if let Some((start, _)) = last.filter(|_| cycles) {
            self.interval(at, at - start);
        }
        let mut seen = self.cycle.take().map(|cycle| cycle.seen).unwrap_or_default();
        seen.clear();
        self.cycle = Some(Cycle { start: at, phase: field, seen });
    }

    /// Telegrams with the layout of `phase` begin.
    fn enter(&mut self, at: MonotonicTime, phase: Phase, silence: DurationNs) {
        let fast = self.version.contains(CommunicationVersion::FAST_PHASE_SWITCH);
        if phase != Phase::CP4 && silence < SILENCE && !fast {
            self.violation(at, Offender::Master, Rule::Silence { kept: silence });
        }
        if self.switching_since.take().is_some() {
            for index in 0..self.stations.len() {
                if self.stations[index].inserts {
                    let rule = Rule::LeftEarly { phase: self.phase, slave: position(index) };
                    self.violation(at, Offender::Master, rule);
                }
            }
        }
        self.phase = phase;
        self.hot_plugs.reset();
        self.interval_known = false;
        for station in &mut self.stations {
            station.enter(phase);
        }
        match phase {
            Phase::CP0 => {
                self.stations.clear();
                self.plan = None;
            }
            Phase::CP3 => self.configure(at),
            _ => {}
        }
    }

    /// CP3 begins: what the slaves were told has to fit together.
    fn configure(&mut self, at: MonotonicTime) {
        let learned: Vec<_> = self.stations.iter().map(|station| &station.learned).collect();
        let mut broken = Vec::new();
        self.plan = Some(Plan::new(&learned, &mut broken));
        let active = || self.stations.iter().enumerate().filter(|(_, station)| station.learned.checked);
        for (index, station) in active() {
            let address = station.address();
            let twice = active().any(|(other, station)| other < index && station.address() == address);
            if !(1..=511).contains(&address) || twice {
                broken.push(Rule::Address { slave: position(index), address });
            }
        }
        // Most concern every slave alike.
        for rule in broken {
            if !self.violations.iter().any(|violation| violation.at == at && violation.rule == rule) {
                self.violation(at, Offender::Master, rule);
            }
        }
    }

    /// The time from one MST to the next.
    fn interval(&mut self, at: MonotonicTime, found: DurationNs) {
        let entered = !std::mem::replace(&mut self.interval_known, true);
        if entered && self.phase != Phase::CP4 {
            return;
        }
        let Some(plan) = self.plan.as_ref().filter(|_| self.phase >= Phase::CP3) else {
            let four = self.version.contains(CommunicationVersion::FOUR_TELEGRAMS);
            let min = if four && self.phase > Phase::CP0 { SETUP_CYCLE_FOUR } else { SETUP_CYCLE };
            let jitter = self.config.setup_jitter.0;
            let off = (found.0 + jitter).rem_euclid(SETUP_STEP_NS) > 2 * jitter;
            if found.0 < min.0 - jitter || off {
                self.violation(at, Offender::Master, Rule::SetupCycle { found });
            }
            return;
        };
        let cycle = DurationNs(i64::from(plan.cycle_ns));
        let jitter = DurationNs(i64::from(plan.jitter_ns));
        if (found.0 - cycle.0).abs() > jitter.0 {
            self.violation(at, Offender::Master, Rule::MstInterval { found, cycle, jitter });
        }
    }

    /// Which telegrams a cycle has in the phase on the wire, in order.
    fn expected(&self) -> impl Iterator<Item = (TelegramType, usize)> + '_ {
        let (phase, four) = (self.phase, usize::from(self.version.telegrams()));
        [Kind::Mdt, Kind::At].into_iter().flat_map(move |kind| {
            (0..TELEGRAMS_MAX).zip(0u8..).filter_map(move |(number, short)| {
                let len = match (phase, kind) {
                    (Phase::CP0, Kind::Mdt) if number == 0 => cp0::MDT_LEN,
                    (Phase::CP0, Kind::At) if number == 0 => cp0::AT_LEN,
                    (Phase::CP1 | Phase::CP2, _) if number < four => cp12::LEN,
                    (Phase::CP3 | Phase::CP4, _) => self.plan.as_ref()?.lengths(kind)[number],
                    _ => 0,
                };
                (len > 0).then_some((TelegramType::new(Channel::Primary, kind, short), len))
            })
        })
    }

    /// A cycle is over: every telegram of it was sent.
    fn finish_cycle(&mut self, at: MonotonicTime) {
        let closed = self.hot_plugs.ring_is_closed(&self.stations);
        let enabled = [Channel::Primary, Channel::Secondary].into_iter();
        if closed && enabled.into_iter().any(|channel| self.hot_plugs.is_enabled(channel)) {
            self.violation(at, Offender::Master, Rule::HotPlugInRing);
        }
        let Some(cycle) = &self.cycle else { return };
        let missing: Vec<_> =
            self.expected().map(|(telegram, _)| telegram).filter(|t| !cycle.seen.contains(t)).collect();
        for telegram in missing {
            self.violation(at, Offender::Master, Rule::Missing { telegram });
        }
        if self.switching_since.is_some_and(|since| at - since >= SWITCH_TIMEOUT) {
            for index in 0..self.stations.len() {
                let station = &mut self.stations[index];
                if station.inserts && !std::mem::replace(&mut station.reported, true) {
                    let rule = Rule::InsertsWhileSwitching { phase: self.phase };
                    self.violation(at, Offender::Slave(position(index)), rule);
                }
            }
        }
    }

    fn order(&mut self, at: MonotonicTime, telegram: TelegramType) {
        let phase = self.phase;
        // Both channels have the same telegrams.
        let telegram = TelegramType(telegram.0 & 0x7F);
        if !self.expected().any(|(expected, _)| expected == telegram) {
            self.violation(at, Offender::Master, Rule::Unexpected { telegram, phase });
            return;
        }
        let Some(cycle) = &mut self.cycle else { return };
        let last = cycle.seen.last().copied();
        cycle.seen.push(telegram);
        let rank = |telegram: TelegramType| (telegram.kind() == Kind::At, telegram.number());
        if let Some(last) = last.filter(|&last| rank(last) >= rank(telegram)) {
            self.violation(at, Offender::Master, Rule::Order { telegram, last });
        }
    }

    fn length(&mut self, at: MonotonicTime, telegram: TelegramType, found: usize) {
        let same = TelegramType::new(Channel::Primary, telegram.kind(), telegram.number());
        let expected = self.expected().find(|&(expected, _)| expected == same).map(|(_, len)| len);
        if let Some(expected) = expected.filter(|&expected| expected != found) {
            self.violation(at, Offender::Master, Rule::Length { telegram, found, expected });
        }
    }

    /// The telegram's time in the cycle of CP3 and CP4.
    fn window(&mut self, at: MonotonicTime, end: MonotonicTime, telegram: TelegramType) {
        let (Some(cycle), Some(plan)) = (&self.cycle, &self.plan) else { return };
        if self.phase < Phase::CP3 {
            return;
        }
        let (start, end) = (at - cycle.start, end - cycle.start);
        let jitter = i64::from(plan.jitter_ns);
        let soft = plan.soft || self.config.soft_master;
        let first = telegram.kind() == Kind::At && telegram.number() == 0;
        let t1 = plan.at_start_ns.map(|t1| DurationNs(i64::from(t1))).filter(|_| first && !soft);
        let limit = plan.uc_start_ns.unwrap_or(plan.cycle_ns);
        let limit = DurationNs(i64::from(limit) + jitter);
        if let Some(t1) = t1.filter(|t1| start.0 + jitter < t1.0) {
            self.violation(at, Offender::Master, Rule::AtTooEarly { start, t1 });
        }
        if end > limit {
            self.violation(at, Offender::Master, Rule::TelegramTooLate { telegram, end, limit });
        }
    }

    /// What the master tells the slaves.
    fn mdt(&mut self, at: MonotonicTime, number: u8, data: &[u8]) {
        if self.phase == Phase::CP0 {
            if let Ok(repr) = MdtRepr::parse(data) {
                self.version = repr.version;
            }
            return;
        }
        let operating = self.operating();
        for index in 0..self.stations.len() {
            let places = self.plan.as_mut().and_then(|plan| plan.slaves.get_mut(index)?.as_mut());
            let slave = position(index);
            let rule = self.stations[index].mdt(slave, self.phase, number, data, places.as_deref());
            let connections = places.into_iter().flat_map(|places| &mut places.connections);
            let produced = connections
                .filter(|link| operating && !link.producer && link.kind == Kind::Mdt)
                .filter(|link| link.at.telegram == number);
            let rules: Vec<_> =
                rule.into_iter().chain(produced.filter_map(|link| link.judge(data))).collect();
            for rule in rules {
                self.violation(at, Offender::Master, rule);
            }
        }
    }

    /// What the master tells the slaves about their topology, by either channel.
    fn topology_commands(&mut self, at: MonotonicTime, telegram: TelegramType, data: &[u8]) {
        let telegram = (telegram.channel(), telegram.number());
        for index in 0..self.stations.len() {
            let places = self.plan.as_ref().and_then(|plan| plan.slaves.get(index)?.as_ref());
            let rule = self.stations[index].command(position(index), self.phase, telegram, data, places);
            rule.into_iter().for_each(|rule| self.violation(at, Offender::Master, rule));
        }
    }

    /// CP4, not announced only.
    fn operating(&self) -> bool {
        let switching = self.cycle.as_ref().is_some_and(|cycle| cycle.phase.switching());
        self.phase == Phase::CP4 && !switching
    }

    /// A telegram has passed the slave with topology address `slave`, or a number above 511 that tells a slave
    /// which was in no scan from others: `before` it, and `after` it. `outward` on the
    /// way to the end of the line, where slaves write; not on the way back.
    pub fn passed(&mut self, at: MonotonicTime, slave: u16, outward: bool, before: &[u8], after: &[u8]) {
        let Ok(header) = Header::parse(before) else { return };
        let telegram = header.telegram;
        let offender = Offender::Slave(slave);
        if before.len() != after.len() || before[..HEADER_LEN] != after[..HEADER_LEN] {
            self.violation(at, offender, Rule::OutsideSlots { telegram, offset: None });
            return;
        }
        let (before, after) = (&before[HEADER_LEN..], &after[HEADER_LEN..]);
        if self.phase == Phase::CP0 {
            self.scan(at, slave, outward, telegram, header.phase.switching(), before, after);
            return;
        }
        if !outward {
            if before != after {
                self.violation(at, offender, Rule::ReturnPath { telegram });
            }
            return;
        }
        let index = usize::from(slave).saturating_sub(1);
        if telegram.kind() == Kind::Mdt && telegram.number() == 0 {
            self.hot_plugs.pass(index, telegram.channel());
        }
        let mut own = self.own(telegram, index);
        let answers = self.may_answer(telegram, index);
        if answers {
            own.insert(0, 0..HOT_PLUG_LEN);
        }
        if let Some(offset) = first_change(before, after, &own) {
            self.violation(at, offender, Rule::OutsideSlots { telegram, offset: Some(offset) });
        }
        if answers {
            self.hot_plug_answer(at, slave, telegram.channel(), before, after);
        }
        if telegram.kind() == Kind::At && self.first_answer(index, telegram.number()) {
            self.answers(at, index, telegram.number(), after);
            self.admit_checked(at, index);
        }
    }

    /// What a slave has put into an AT.
    fn answers(&mut self, at: MonotonicTime, index: usize, number: u8, data: &[u8]) {
        let operating = self.operating();
        let places = self.plan.as_mut().and_then(|plan| plan.slaves.get_mut(index)?.as_mut());
        let Some(station) = self.stations.get_mut(index) else { return };
        let slave = position(index);
        let rule = station.at(slave, self.phase, number, data, places.as_deref());
        let links = places.into_iter().flat_map(|places| &mut places.connections);
        let produced = links
            .filter(|link| operating && link.producer && link.at.telegram == number)
            .filter_map(|link| link.judge(data));
        let rules: Vec<_> = rule.into_iter().chain(produced).collect();
        for rule in rules {
            self.violation(at, Offender::Slave(slave), rule);
        }
    }

    /// The bytes of a telegram which the slave may write, sorted.
    fn own(&self, telegram: TelegramType, index: usize) -> Vec<core::ops::Range<usize>> {
        if telegram.kind() == Kind::Mdt {
            return Vec::new();
        }
        if self.phase >= Phase::CP3 {
            let places = self.plan.as_ref().and_then(|plan| plan.slaves.get(index)?.as_ref());
            let own = places.and_then(|places| places.own.get(usize::from(telegram.number())));
            return own.cloned().unwrap_or_default();
        }
        match cp12::place(position(index)) {
            Some(place) if place.telegram == telegram.number() => {
                vec![place.svc..place.svc + SVC_LEN, place.device..place.device + DEVICE_WORD_LEN]
            }
            _ => Vec::new(),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one telegram at one slave")]
    fn scan(
        &mut self,
        at: MonotonicTime,
        slave: u16,
        outward: bool,
        telegram: TelegramType,
        switching: bool,
        before: &[u8],
        after: &[u8],
    ) {
        let offender = Offender::Slave(slave);
        if before == after {
            if outward && telegram.kind() == Kind::At {
                self.stations.get_mut(usize::from(slave) - 1).into_iter().for_each(|s| s.inserts = false);
            }
            return;
        }
        if telegram.kind() == Kind::Mdt || before.len() < cp0::AT_LEN {
            let offset = first_change(before, after, &[]);
            self.violation(at, offender, Rule::OutsideSlots { telegram, offset });
            return;
        }
        let (first, second) = (u16_at(before, 0), u16_at(after, 0));
        if SequenceCounter(first).next().0 != second {
            self.violation(at, offender, Rule::Scan { before: first, after: second });
        }
        let topology = usize::from(SequenceCounter(first).count() & 0x1FF);
        let field = 2 * topology..2 * topology + 2;
        if switching && outward {
            let inserts = topology > 0 && before.get(field.clone()) != after.get(field.clone());
            self.stations.get_mut(topology.max(1) - 1).into_iter().for_each(|s| s.inserts = inserts);
        }
        let writes = outward && topology > 0;
        let own = if writes { field } else { 0..0 };
        if let Some(offset) = first_change(before, after, &[0..CONNECTION_CONTROL_LEN, own]) {
            self.violation(at, offender, Rule::OutsideSlots { telegram, offset: Some(offset) });
        } else if writes && usize::from(slave) == topology {
            // In a ring the S telegram counts from the other end; the P telegram gives the number.
            self.note_station(topology, u16_at(after, 2 * topology));
        }
    }

    /// Notes what a slave has written into its topology field, by its place from 1.
    fn note_station(&mut self, topology: usize, word: u16) {
        while self.stations.len() < topology {
            self.stations.push(Station::default());
        }
        let station = &mut self.stations[topology - 1];
        station.address = TopologyField(word).address().unwrap_or(0);
        station.inserts = word != NO_SLAVE;
    }
}

/// What an MST does to the phase.
enum Step {
    Same,
    Announce,
    Enter,
    Wrong,
}

/// Whether the phase byte may follow the one of the last cycle, with the telegrams of `layout` on the wire.
fn phase_step(layout: Phase, last: Option<PhaseField>, found: PhaseField) -> Step {
    let Some(last) = last else { return Step::Wrong };
    let (wanted, announced) = (found.phase(), found.switching());
    let same = wanted == last.phase() && announced == last.switching();
    let up = layout.next() == Some(wanted);
    match (last.switching(), announced) {
        _ if same => Step::Same,
        (false, true) if up || (wanted == Phase::CP0 && layout > Phase::CP0) => Step::Announce,
        // A switch that fails goes down.
        (true, true) if wanted == Phase::CP0 => Step::Announce,
        (true, false) if wanted == last.phase() => Step::Enter,
        _ => Step::Wrong,
    }
}

/// First byte that was changed outside of the `own` ranges, which are sorted.
fn first_change(before: &[u8], after: &[u8], own: &[core::ops::Range<usize>]) -> Option<usize> {
    if before == after {
        return None;
    }
    let mut at = 0;
    let ends = own.iter().cloned().chain(core::iter::once(before.len()..before.len()));
    for range in ends {
        let stretch = at.min(before.len())..range.start.clamp(at, before.len().max(at)).min(before.len());
        if before[stretch.clone()] != after[stretch.clone()] {
            return stretch.clone().find(|&byte| before[byte] != after[byte]);
        }
        at = at.max(range.end);
    }
    None
}

fn position(index: usize) -> u16 {
    u16::try_from(index + 1).unwrap_or(u16::MAX)
}

/// Time of a frame on the wire, preamble and check sequence included.
#[must_use]
pub fn wire_time(frame_len: usize) -> DurationNs {
    let bytes = u64::try_from(frame_len + WIRE_EXTRA).unwrap_or(u64::MAX);
    DurationNs(i64::try_from(bytes.saturating_mul(plan::BYTE_NS)).unwrap_or(i64::MAX))
}
