//! What is watched at one slave: its service channel, its slots, its connections.

use super::learned::Learned;
use super::plan::{Connection, Places};
use super::rule::Rule;
use crate::wire::connection::ConnectionControl;
use crate::wire::cp12;
use crate::wire::device_control::{DeviceControl, Topology};
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::{Channel, Kind, Phase};
use crate::wire::idn::Idn;
use crate::wire::svc::{AtSvc, MdtSvc, SVC_LEN, SvcStatus};
use profile_generic::wire::u16_at;

/// Bits of C-SVC that are on the wire.
const CONTROL_BITS: u16 = 0x003F;

/// One slave.
#[derive(Debug)]
pub(super) struct Station {
    pub learned: Learned,
    /// SERCOS address of the last scan.
    pub address: u16,
    /// What the master sent last, `None` before the first MDT of CP1.
    sent: Option<MdtSvc>,
    /// The first MDT of the phase is still to come: the word may change without a handshake.
    fresh: bool,
    /// What the slave answered last in this phase.
    answer: Option<AtSvc>,
    /// The step on the wire has been answered.
    through: bool,
    /// The slave still puts in what has to vanish when the phase is switched.
    pub inserts: bool,
    /// It has inserted in the last cycle: it takes part.
    pub valid: bool,
    /// On its way in by hot plug, with the telegrams of this channel.
    pub joining: bool,
    pub channel: Channel,
    /// Topology command of C-DEV by channel, P first; `None` before the first MDT of the phase.
    commands: [Option<DeviceControl>; 2],
    /// How it passed telegrams on in the last cycle.
    pub topology: Option<Topology>,
    /// Reported for this switch.
    pub reported: bool,
}

impl Default for Station {
    fn default() -> Station {
        Station {
            learned: Learned::default(),
            address: 0,
            sent: None,
            fresh: false,
            answer: None,
            through: false,
            inserts: false,
            valid: false,
            joining: false,
            channel: Channel::Primary,
            commands: [None; 2],
            topology: None,
            reported: false,
        }
    }
}

impl Station {
    /// A slave on its way in by hot plug, of which nothing else is known yet.
    pub fn joining(address: u16, channel: Channel) -> Station {
        Station { address, joining: true, channel, ..Station::default() }
    }

    /// New telegrams begin.
    pub fn enter(&mut self, phase: Phase) {
        self.fresh = true;
        self.answer = None;
        self.commands = [None; 2];
        self.inserts = false;
        self.reported = false;
        if phase <= Phase::CP1 {
            self.sent = None;
        }
        if phase == Phase::CP2 {
            self.learned = Learned::default();
        }
    }

    /// The SERCOS address: of the scan, or what S-0-1040 was set to since.
    pub fn address(&self) -> u16 {
        self.learned.half(Idn::ADDRESS).unwrap_or(self.address)
    }

    /// What the master sends it.
    pub fn request(&mut self, slave: u16, phase: Phase, word: MdtSvc) -> Option<Rule> {
        let fresh = std::mem::take(&mut self.fresh);
        if word == MdtSvc::default() && phase > Phase::CP1 {
            // The master has given the slave up: nothing is left of the last step.
            self.sent = None;
            return None;
        }
        let last = self.sent.replace(word);
        if word.control.0 & !CONTROL_BITS != 0 {
            return Some(Rule::StepChanged { slave });
        }
        if phase == Phase::CP1 {
            let rest = word.control.0 <= 1 && word.info == 0;
            return (!rest).then_some(Rule::StepInCp1 { slave });
        }
        let last = last?;
        if last.control.mhs() == word.control.mhs() {
            let changed = last != word && !fresh;
            return changed.then_some(Rule::StepChanged { slave });
        }
        let ready = self.answer.is_some_and(|answer| {
            answer.status.contains(SvcStatus::AHS) == last.control.mhs()
                && answer.status.contains(SvcStatus::VALID)
                && !answer.status.contains(SvcStatus::BUSY)
        });
        self.through = false;
        (!ready).then_some(Rule::StepTooEarly { slave })
    }

    /// What it answers.
    pub fn answer(&mut self, phase: Phase, answer: AtSvc) -> Option<Rule> {
        let last = self.answer.replace(answer);
        let sent = self.sent?;
        if phase < Phase::CP2 || !answer.status.contains(SvcStatus::VALID) {
            return None;
        }
        let ahs = answer.status.contains(SvcStatus::AHS);
        let busy = answer.status.contains(SvcStatus::BUSY);
        let moved = last.is_some_and(|last| last.status.contains(SvcStatus::AHS) != ahs);
        if ahs != sent.control.mhs() {
            return moved.then_some(Rule::Handshake);
        }
        if self.through {
            return busy.then_some(Rule::Busy);
        }
        if !busy {
            self.through = true;
            let error = answer.status.contains(SvcStatus::ERROR);
            self.learned.step(sent, (!error).then_some(answer.info));
        }
        None
    }

    /// Takes its part of an MDT in CP1 to CP4.
    pub fn mdt(
        &mut self,
        slave: u16,
        phase: Phase,
        number: u8,
        data: &[u8],
        places: Option<&Places>,
    ) -> Option<Rule> {
        let at = svc_place(Kind::Mdt, slave, phase, places).filter(|&(telegram, _)| telegram == number)?;
        let word = data.get(at.1..at.1 + SVC_LEN).and_then(|bytes| MdtSvc::parse(bytes).ok())?;
        self.request(slave, phase, word)
    }

    /// Takes its C-DEV of an MDT in CP1 to CP4, on either channel: how it is to pass telegrams on.
    pub fn command(
        &mut self,
        slave: u16,
        phase: Phase,
        (channel, number): (Channel, u8),
        data: &[u8],
        places: Option<&Places>,
    ) -> Option<Rule> {
        let (_, at) = control_place(slave, phase, places).filter(|&(telegram, _)| telegram == number)?;
        let word = data.get(at..at + 2).map(|bytes| DeviceControl::from_bits_retain(u16_at(bytes, 0)))?;
        let own = DeviceControl::TOPOLOGY_CHANGE | DeviceControl::TOPOLOGY_1 | DeviceControl::TOPOLOGY_0;
        let found = word.intersection(own);
        let last = self.commands[usize::from(channel == Channel::Secondary)].replace(found);
        let toggled = |last: DeviceControl| (last ^ found).contains(DeviceControl::TOPOLOGY_CHANGE);
        let changed = last.is_some_and(|last| last.topology() != found.topology() && !toggled(last));
        if changed || found.topology() == Topology::StoreAndForward {
            return Some(Rule::TopologyCommand { slave, found });
        }
        let [Some(primary), Some(secondary)] = self.commands else { return None };
        // One of the two is a question to whom the other one does not reach. In mid-cycle one of them may be the last cycle's.
        let apart = primary != secondary && channel == Channel::Secondary;
        let question = primary.topology() == Topology::LoopbackForwardPrimary
            || secondary.topology() == Topology::LoopbackForwardSecondary;
        (apart && !question).then_some(Rule::TopologyApart { slave, primary, secondary })
    }

    /// Takes its part of an AT that it has just passed on.
    pub fn at(
        &mut self,
        slave: u16,
        phase: Phase,
        number: u8,
        data: &[u8],
        places: Option<&Places>,
    ) -> Option<Rule> {
        let svc = svc_place(Kind::At, slave, phase, places).filter(|&(telegram, _)| telegram == number);
        let answer = svc.and_then(|(_, at)| AtSvc::parse(data.get(at..at + SVC_LEN)?).ok());
        let word = status_place(slave, phase, places).filter(|&(telegram, _)| telegram == number);
        let status = word
            .filter(|&(_, at)| at + 2 <= data.len())
            .map(|(_, at)| DeviceStatus::from_bits_retain(u16_at(data, at)));
        match phase {
            Phase::CP1 => {
                if let Some(answer) = answer {
                    self.inserts = answer.status.intersects(SvcStatus::VALID | SvcStatus::AHS);
                }
            }
            Phase::CP2 => {
                if let Some(status) = status {
                    self.inserts = !status.is_empty();
                }
            }
            _ => {
                if let Some(status) = status {
                    self.inserts = status.contains(DeviceStatus::SLAVE_VALID);
                    self.topology = self.inserts.then(|| status.topology());
                }
            }
        }
        self.answer(phase, answer?)
    }
}

/// Telegram and offset of a service channel.
fn svc_place(kind: Kind, slave: u16, phase: Phase, places: Option<&Places>) -> Option<(u8, usize)> {
    if phase < Phase::CP3 {
        return cp12::place(slave).map(|place| (place.telegram, place.svc));
    }
    let offset = match kind {
        Kind::Mdt => places?.svc_mdt,
        Kind::At => places?.svc_at,
    };
    Some((offset.telegram, usize::from(offset.offset)))
}

fn control_place(slave: u16, phase: Phase, places: Option<&Places>) -> Option<(u8, usize)> {
    if phase < Phase::CP3 {
        return cp12::place(slave).map(|place| (place.telegram, place.device));
    }
    let offset = places?.control?;
    Some((offset.telegram, usize::from(offset.offset)))
}

fn status_place(slave: u16, phase: Phase, places: Option<&Places>) -> Option<(u8, usize)> {
    if phase < Phase::CP3 {
        return cp12::place(slave).map(|place| (place.telegram, place.device));
    }
    let offset = places?.status?;
    Some((offset.telegram, usize::from(offset.offset)))
}

impl Connection {
    /// Judges C-CON of one cycle.
    pub fn judge(&mut self, data: &[u8]) -> Option<Rule> {
        let at = usize::from(self.at.offset);
        if at + 2 > data.len() {
            return None;
        }
        let found = u16_at(data, at);
        let last = std::mem::replace(&mut self.last, found);
        let (old, new) =
            (ConnectionControl::from_bits_retain(last), ConnectionControl::from_bits_retain(found));
        let both = old.contains(ConnectionControl::READY) && new.contains(ConnectionControl::READY);
        if last == found || !both {
            return None;
        }
        let toggled = (old ^ new).contains(ConnectionControl::NEW_DATA);
        let counting = old.counter() != 0 || new.counter() != 0;
        let good = if counting {
            let produced = new.counter() == (old.counter() + 1) & 0xF;
            toggled == produced && (produced || new.counter() == old.counter())
        } else {
            true
        };
        (!good).then_some(Rule::Production { connection: self.index, last, found })
    }
}
