//! Hot plug: what the master may say in the hot-plug field, and who may answer there.

use std::collections::BTreeSet;

use super::learned::Learned;
use super::rule::{Offender, Part, Rule};
use super::station::Station;
use super::{Checker, position};
use crate::wire::cp0::CommunicationVersion;
use crate::wire::device_control::Topology;
use crate::wire::header::{Channel, Kind, Phase, TelegramType};
use crate::wire::hot_plug::{BROADCAST_ADDRESS, HOT_PLUG_LEN, HotPlug, HotPlugCode};
use crate::wire::idn::Idn;
use crate::wire::layout::Offset;
use crate::wire::svc::SVC_LEN;
use profile_generic::time::MonotonicTime;
use profile_generic::wire::u16_at;

/// Control bits that mean something.
const CONTROL_BITS: u16 = HotPlug::SUPPORTED | HotPlug::ENABLED | HotPlug::SWITCH_TO_SVC | 0x00FF;

/// What is known of hot plug on one channel.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// The field of the last MDT0.
    field: HotPlug,
    /// What was asked in this CP4: codes of the control word. A slave that was cut off may go on with an old answer.
    asked: BTreeSet<u8>,
    /// The place that is being given: address, MDT, AT.
    offsets: (u16, [Option<Offset>; 2]),
}

/// What is known of hot plug.
#[derive(Debug, Default)]
pub(super) struct HotPlugs {
    lines: [Line; 2],
    /// Channels on which MDT0 has passed each station in this cycle on the way on which slaves write.
    passed: Vec<u8>,
}

impl HotPlugs {
    /// A phase begins.
    pub fn reset(&mut self) {
        *self = HotPlugs::default();
    }

    pub fn is_enabled(&self, channel: Channel) -> bool {
        self.lines[channel.index()].field.word & HotPlug::ENABLED != 0
    }

    /// MDT0 passes a station.
    pub fn pass(&mut self, index: usize, channel: Channel) {
        if self.passed.len() <= index {
            self.passed.resize(index + 1, 0);
        }
        self.passed[index] |= 1 << channel.index();
    }

    /// The cycle is over: every slave that takes part has both channels and passes both on.
    pub fn ring_is_closed(&mut self, stations: &[Station]) -> bool {
        let passed = std::mem::take(&mut self.passed);
        let mut active = stations.iter().enumerate().filter(|(_, station)| station.inserts).peekable();
        active.peek().is_some()
            && active.all(|(index, station)| {
                station.topology == Some(Topology::FastForward) && passed.get(index) == Some(&3)
            })
    }
}

/// Whether a field with hot plug on says something that there is.
fn is_allowed(field: HotPlug) -> bool {
    let switch = field.word & HotPlug::SWITCH_TO_SVC != 0;
    let good = match field.code() {
        HotPlugCode::NONE => field.info == 0 && field.address() == 0,
        HotPlugCode::SVC_OFFSET_MDT | HotPlugCode::SVC_OFFSET_AT => {
            (1..=511).contains(&field.address()) && !switch
        }
        HotPlugCode(1..=5 | 0x10..=0x13 | 0x20..=0x23) => field.address() == BROADCAST_ADDRESS && !switch,
        _ => false,
    };
    good && field.word & HotPlug::SUPPORTED != 0 && field.word & !CONTROL_BITS == 0
}

impl Checker {
    /// The field of MDT0.
    pub(super) fn hot_plug_field(&mut self, at: MonotonicTime, channel: Channel, data: &[u8]) {
        let Ok(field) = HotPlug::parse(data) else { return };
        let line = &mut self.hot_plugs.lines[channel.index()];
        line.field = field;
        if field.word & HotPlug::ENABLED == 0 {
            line.offsets = (0, [None, None]);
            let nothing = field.word & !HotPlug::SUPPORTED == 0;
            // In CP3 and CP4 single parameters may be told without hot plug.
            let told = field.address() == BROADCAST_ADDRESS && field.word & HotPlug::SWITCH_TO_SVC == 0;
            if !nothing && !told {
                self.violation(at, Offender::Master, Rule::HotPlugField { field });
            }
            return;
        }
        if self.phase != Phase::CP4 {
            self.violation(at, Offender::Master, Rule::HotPlugPhase { phase: self.phase });
            return;
        }
        let code = field.code();
        line.asked.insert(code.0);
        if !is_allowed(field) {
            self.violation(at, Offender::Master, Rule::HotPlugField { field });
            return;
        }
        match code {
            HotPlugCode::NONE if field.word & HotPlug::SWITCH_TO_SVC != 0 => self.switch_to_svc(channel),
            HotPlugCode::NONE => {}
            HotPlugCode::SVC_OFFSET_MDT => self.offset(at, channel, field, Kind::Mdt),
            HotPlugCode::SVC_OFFSET_AT => self.offset(at, channel, field, Kind::At),
            _ => self.parameter(at, field),
        }
    }

    /// HP0: everything is told as the others were told it.
    fn parameter(&mut self, at: MonotonicTime, field: HotPlug) {
        let active = self.stations.iter().find(|station| station.learned.checked);
        let Some(learned) = active.map(|station| &station.learned) else { return };
        let expected = expected(field.code(), learned, self.version);
        if let Some(expected) = expected.filter(|&expected| expected != field.info) {
            let (code, found) = (field.code(), field.info);
            self.violation(at, Offender::Master, Rule::HotPlugValue { code, found, expected });
        }
    }

    /// HP1: a place for the service channel of a slave that does not take part yet, where nobody has one.
    fn offset(&mut self, at: MonotonicTime, channel: Channel, field: HotPlug, kind: Kind) {
        let address = field.address();
        let taken = self.stations.iter().any(|station| station.address() == address && station.valid);
        if taken {
            self.violation(at, Offender::Master, Rule::HotPlugAddress { address });
            return;
        }
        self.drop_absent(address);
        let offset = Offset::from_parameter(u16::try_from(field.info).unwrap_or(u16::MAX));
        let line = &mut self.hot_plugs.lines[channel.index()];
        if line.offsets.0 != address {
            line.offsets = (address, [None, None]);
        }
        let entry = &mut line.offsets.1[usize::from(kind == Kind::At)];
        if entry.replace(offset) == Some(offset) {
            return;
        }
        let mut broken = Vec::new();
        if let Some(plan) = &self.plan {
            plan.check_free(kind, offset, SVC_LEN, Part::Svc(0), &mut broken);
        }
        for rule in broken {
            self.violation(at, Offender::Master, rule);
        }
    }

    /// Slaves that have this address and do not take part have no places any more.
    fn drop_absent(&mut self, address: u16) {
        let Some(plan) = &mut self.plan else { return };
        for (index, station) in self.stations.iter().enumerate() {
            if station.address() == address && !station.valid {
                plan.drop(index);
            }
        }
    }

    /// HP2 begins for the slave that was told its place.
    fn switch_to_svc(&mut self, channel: Channel) {
        let line = &mut self.hot_plugs.lines[channel.index()];
        let (address, [Some(mdt), Some(at)]) = line.offsets else { return };
        line.offsets.1 = [None, None];
        let joining = self.stations.iter().position(|station| {
            station.joining && station.address() == address && !station.valid && station.channel == channel
        });
        if let (Some(index), Some(plan)) = (joining, &mut self.plan) {
            self.stations[index] = Station::joining(address, channel);
            plan.admit_service(index, mdt, at);
        }
    }

    /// The bytes of the field, for a slave that does not take part and may answer there.
    pub(super) fn may_answer(&self, telegram: TelegramType, index: usize) -> bool {
        let first = telegram.kind() == Kind::At && telegram.number() == 0;
        let station = self.stations.get(index);
        let out = station.is_none_or(|station| !station.valid);
        self.phase == Phase::CP4 && first && out && self.hot_plugs.is_enabled(telegram.channel())
    }

    /// A slave has answered in the field of AT0.
    pub(super) fn hot_plug_answer(
        &mut self,
        at: MonotonicTime,
        slave: u16,
        channel: Channel,
        before: &[u8],
        after: &[u8],
    ) {
        // A frame too short for the field holds no answer; nothing of it can have changed as one.
        let Ok(answer) = HotPlug::parse(after) else { return };
        if before.get(..HOT_PLUG_LEN) == after.get(..HOT_PLUG_LEN) {
            return;
        }
        let asked = &self.hot_plugs.lines[channel.index()].asked;
        let [code, _] = answer.word.to_le_bytes();
        let error = answer.word & HotPlug::ERROR != 0;
        let known = match u16::from(code) {
            HotPlug::SCANNED if !error => asked.contains(&0),
            HotPlug::ERROR_SWITCH | HotPlug::ERROR_NO_ADDRESS | HotPlug::ERROR_SCAN if error => {
                asked.contains(&0)
            }
            _ => asked.contains(&code),
        };
        if !known || answer.word & !(HotPlug::ERROR | 0x00FF) != 0 {
            self.violation(at, Offender::Slave(slave), Rule::HotPlugAnswer { word: answer.word });
        }
        let index = usize::from(slave) - 1;
        while self.stations.len() <= index {
            self.stations.push(Station::default());
        }
        let station = &mut self.stations[index];
        if answer.slave_index() == 0 && !error {
            if !station.joining {
                *station = Station::default();
            }
            (station.joining, station.channel, station.address) = (true, channel, answer.address());
        }
    }

    /// The checks of a slave that is on its way in are through: its places count from now on.
    pub(super) fn admit_checked(&mut self, at: MonotonicTime, index: usize) {
        let Some(station) = self.stations.get_mut(index) else { return };
        if !station.joining || !station.learned.checked || !station.learned.ready {
            return;
        }
        station.joining = false;
        let first = self.stations.iter().find(|station| station.valid).map(|station| &station.learned);
        let learned = &self.stations[index].learned;
        let mut broken = Vec::new();
        if let Some(plan) = &mut self.plan {
            plan.admit(index, learned, first.unwrap_or(learned), &mut broken);
        }
        let address = self.stations[index].address();
        let twice = self.stations.iter().any(|station| station.valid && station.address() == address);
        if twice || !(1..=511).contains(&address) {
            broken.push(Rule::Address { slave: position(index), address });
        }
        for rule in broken {
            self.violation(at, Offender::Master, rule);
        }
    }
}

/// The value of a parameter of HP0, from what a slave was told that takes part.
fn expected(code: HotPlugCode, learned: &Learned, version: CommunicationVersion) -> Option<u32> {
    let length = |idn, number: u8| {
        let at = 2 * usize::from(number & 3);
        let list = learned.list(idn)?;
        (list.len() >= at + 2).then(|| u32::from(u16_at(list, at)))
    };
    let time = |number: usize| {
        let bytes = learned.list(Idn::UC_TIMES)?.get(4 * number..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    match code {
        HotPlugCode::CYCLE_TIME => learned.word(Idn::CYCLE_TIME),
        HotPlugCode::T6 => time(0),
        HotPlugCode::T7 => time(1),
        HotPlugCode::REQUESTED_MTU => learned.half(Idn::MTU_REQUESTED).map(u32::from),
        HotPlugCode::COMMUNICATION_VERSION => Some(version.bits()),
        HotPlugCode(code @ 0x10..=0x13) => length(Idn::MDT_LENGTHS, code),
        HotPlugCode(code @ 0x20..=0x23) => length(Idn::AT_LENGTHS, code),
        _ => None,
    }
}
