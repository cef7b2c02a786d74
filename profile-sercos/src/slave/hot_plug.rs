//! Hot plug: a slave that joins a network in CP4.
//!
//! ```text
//!      all parameters of HP0          both offsets and the           S-0-0127, S-0-0128
//!      have been broadcast            switch to the SVC              and its cancellation
//! NRT ----------------------> HP1 ----------------------------> HP2 ----------------------> CP4
//!  ^    passes telegrams on    |  turns telegrams round,         |  service channel only
//!  |                           |  answers in the hot-plug field  |
//!  +---------------------------+---------------------------------+
//!        hot plug is not enabled any more, another phase, no MST
//! ```
//!
//! In NRT the slave passes telegrams on, so that the slave in front of it sees none come back. Once it turns them
//! round, that one reports them, and the master lets them through. Only a slave that has SCP_HP among its classes
//! does any of this. Each slave is a device of its own: it answers for slave index 0, and with the end mark for
//! the others.

use super::phase::{Event, Stage, State};
use super::{Application, Port, Slave};
use crate::wire::cp0::CommunicationVersion;
use crate::wire::header::{Channel, DATA_LEN_MAX, DATA_LEN_MIN, PhaseField};
use crate::wire::hot_plug::{BROADCAST_ADDRESS, END_ADDRESS, HotPlug, HotPlugCode};
use crate::wire::idn::Idn;
use crate::wire::layout::Offset;
use crate::wire::scp::{ScpClass, ScpEntry};
use crate::wire::svc::SVC_LEN;

/// Parameters of HP0: cycle time, eight lengths, t6, t7, MTU, communication version.
const PARAMETERS: usize = 13;
/// Both offsets of the service channel are known.
const BOTH_OFFSETS: u8 = 3;

/// What a slave has learned on its way into a network.
#[derive(Debug, Default)]
pub(super) struct Joining {
    /// SCP_HP is among the classes.
    supported: bool,
    parameters: [Option<u32>; PARAMETERS],
    /// Offsets received: bit 0 MDT, bit 1 AT.
    offsets: u8,
    /// Answer in the hot-plug field of the next AT0.
    answer: HotPlug,
}

impl Joining {
    pub fn new(classes: &[ScpEntry]) -> Joining {
        Joining {
            supported: classes.iter().any(|entry| entry.class == ScpClass::HOT_PLUG),
            ..Joining::default()
        }
    }

    pub fn forget(&mut self) {
        *self = Joining { supported: self.supported, ..Joining::default() };
    }

    /// Takes a broadcast parameter.
    fn take(&mut self, code: HotPlugCode, info: u32) {
        let place = match code {
            HotPlugCode::CYCLE_TIME => 0,
            HotPlugCode(code @ 0x10..=0x13) => 1 + usize::from(code & 3),
            HotPlugCode(code @ 0x20..=0x23) => 5 + usize::from(code & 3),
            HotPlugCode::T6 => 9,
            HotPlugCode::T7 => 10,
            HotPlugCode::REQUESTED_MTU => 11,
            HotPlugCode::COMMUNICATION_VERSION => 12,
            _ => return,
        };
        self.parameters[place] = Some(info);
    }

    /// Data field length of a telegram; 0 when it is not sent.
    fn len(&self, first: usize, telegram: u8) -> usize {
        let len = self.parameters.get(first + usize::from(telegram)).copied().flatten().unwrap_or(0);
        usize::try_from(len).unwrap_or(usize::MAX)
    }

    /// Every parameter is there and possible.
    fn is_complete(&self) -> bool {
        let possible = |len: usize| len == 0 || (DATA_LEN_MIN..=DATA_LEN_MAX).contains(&len);
        let lengths = || (1..9).map(|place| self.len(place, 0));
        self.parameters.iter().all(Option::is_some)
            && self.parameters[0].is_some_and(super::communication::is_cycle_time)
            && lengths().all(possible)
            && self.len(1, 0) > 0
            && self.len(5, 0) > 0
    }
}

impl<A: Application> Slave<A> {
    /// MDT0 of CP4 while the slave takes no part.
    pub(super) fn listen(&mut self, port: Port, channel: Channel, phase: PhaseField, data: &[u8]) {
        let Ok(field) = HotPlug::parse(data) else { return };
        if !self.joining.supported {
            return;
        }
        if field.word & HotPlug::ENABLED == 0 {
            self.joining.forget();
            return;
        }
        if field.address() != BROADCAST_ADDRESS {
            return;
        }
        self.joining.take(field.code(), field.info);
        if !self.joining.is_complete() {
            return;
        }
        let word = |info: Option<u32>| i64::from(info.unwrap_or(0));
        let parameters = self.joining.parameters;
        let store = &mut self.core.store;
        store.set_number_of(Idn::CYCLE_TIME, word(parameters[0]));
        let lengths = |from: usize| {
            let mut bytes = [0; 8];
            for (to, info) in bytes.chunks_exact_mut(2).zip(&parameters[from..from + 4]) {
                let len = u16::try_from(info.unwrap_or(0)).unwrap_or(0);
                to.copy_from_slice(&len.to_le_bytes());
            }
            bytes
        };
        store.set_data_of(Idn::MDT_LENGTHS, &lengths(1));
        store.set_data_of(Idn::AT_LENGTHS, &lengths(5));
        let mut times = [0; 8];
        times[..4].copy_from_slice(&parameters[9].unwrap_or(0).to_le_bytes());
        times[4..].copy_from_slice(&parameters[10].unwrap_or(0).to_le_bytes());
        store.set_data_of(Idn::UC_TIMES, &times);
        store.set_number_of(Idn::MTU_REQUESTED, word(parameters[11]));
        self.version = CommunicationVersion::from_bits_retain(parameters[12].unwrap_or(0));
        self.core.conditions = super::phase::Conditions::default();
        self.core.configuration = None;
        self.ports.join(port, channel);
        self.core.state = State::Joining(Stage::Scan);
        self.joining.answer = HotPlug::default();
        self.joining.offsets = 0;
        // This MDT0 is the first one of the slave's own cycles.
        self.round = super::Round { phase: phase.0, mdts: 1, acted: false };
        self.show_diagnosis();
    }

    /// MDT of CP4 in HP1 and HP2.
    pub(super) fn joining_mdt(&mut self, number: u8, data: &[u8]) {
        let field = HotPlug::parse(data).unwrap_or_default();
        if number == 0 && field.word & HotPlug::ENABLED == 0 {
            self.give_up_joining();
            return;
        }
        match self.core.state {
            State::Joining(Stage::Scan) if number == 0 => self.answer_hot_plug(field),
            State::Joining(Stage::Setup) => {
                let at = self.svc_offset(Idn::SVC_MDT_OFFSET);
                if at.telegram == number
                    && let Some(slot) = data.get(at.range(SVC_LEN))
                {
                    self.handle_svc(slot);
                }
            }
            _ => {}
        }
    }

    /// AT of CP4 in HP1 and HP2, on the way on which slaves write.
    pub(super) fn joining_at(&mut self, number: u8, data: &mut [u8]) {
        match self.core.state {
            State::Joining(Stage::Scan) if number == 0 && self.joining.answer != HotPlug::default() => {
                // A telegram of CP4 begins with the field; a shorter one is none.
                let _ = self.joining.answer.emit(data);
            }
            State::Joining(Stage::Setup) => {
                let at = self.svc_offset(Idn::SVC_AT_OFFSET);
                let answer = self.svc.answer();
                if at.telegram == number
                    && let Some(slot) = data.get_mut(at.range(SVC_LEN))
                {
                    // The slice has the length of a slot.
                    let _ = answer.emit(slot);
                }
            }
            _ => {}
        }
    }

    fn svc_offset(&self, idn: Idn) -> Offset {
        Offset::from_parameter(u16::try_from(self.core.store.number_of(idn)).unwrap_or(u16::MAX))
    }

    /// HP1: the field of this cycle's MDT0.
    fn answer_hot_plug(&mut self, field: HotPlug) {
        let own = u16::try_from(self.core.store.number_of(Idn::ADDRESS)).unwrap_or(0);
        let mine = field.slave_index() == 0 && field.address() == own && own != 0;
        let answer = |address: u16, word: u16, info: u32| HotPlug {
            selection: field.slave_index() << 12 | address & 0x0FFF,
            word,
            info,
        };
        if field.word & HotPlug::SWITCH_TO_SVC != 0 {
            if self.joining.offsets == BOTH_OFFSETS {
                self.core.state = State::Joining(Stage::Setup);
                self.svc.reset();
                self.svc.set_valid();
                self.show_diagnosis();
            } else {
                self.joining.answer = answer(own, HotPlug::ERROR | HotPlug::ERROR_SWITCH, 0);
            }
            return;
        }
        let taken = match field.code() {
            HotPlugCode::NONE if field.address() == 0 => {
                self.joining.answer = match (field.slave_index(), own) {
                    (0, 0) => answer(0, HotPlug::ERROR | HotPlug::ERROR_NO_ADDRESS, 0),
                    (0, own) => answer(own, HotPlug::SCANNED, 0),
                    _ => answer(END_ADDRESS, HotPlug::SCANNED, 0),
                };
                return;
            }
            HotPlugCode::SVC_OFFSET_MDT if mine => self.take_offset(0, Idn::SVC_MDT_OFFSET, field.info),
            HotPlugCode::SVC_OFFSET_AT if mine => self.take_offset(1, Idn::SVC_AT_OFFSET, field.info),
            _ => return,
        };
        let error = if taken { 0 } else { HotPlug::ERROR };
        self.joining.answer = answer(own, error | u16::from(field.code().0), field.info);
    }

    /// Takes the place of the service channel in the MDTs (0) or ATs (1), if there is such a place.
    fn take_offset(&mut self, place: u8, idn: Idn, info: u32) -> bool {
        let word = u16::try_from(info).unwrap_or(u16::MAX);
        let at = Offset::from_parameter(word);
        let len = self.joining.len(1 + 4 * usize::from(place), at.telegram & 3);
        let free = at.telegram > 0 || usize::from(at.offset) >= crate::wire::hot_plug::HOT_PLUG_LEN;
        let fits = at.telegram < 4 && free && at.range(SVC_LEN).end <= len;
        if fits {
            self.core.store.set_number_of(idn, i64::from(word));
            self.joining.offsets |= 1 << place;
        }
        fits
    }

    fn give_up_joining(&mut self) {
        self.core.state = State::Nrt;
        self.enter_nrt(false);
        self.show_diagnosis();
    }

    /// A cycle begins: both checks are through and cancelled, so that the slave takes part from now on.
    pub(super) fn finish_joining(&mut self) {
        if self.core.state == State::Joining(Stage::Setup) && !self.core.command_changed() {
            self.advance(Event::Joined);
        }
    }
}
