//! Hot plug: bringing slaves into a network in CP4.
//!
//! The configuration keeps places in the telegrams for slaves that may come later; a slave that was lost has its
//! place anyway. While such a place is free and the ring is open, the parameters of HP0 are broadcast. A slave
//! that has taken them turns telegrams round, and the last slave in front of it hears its own telegrams come back on
//! its inactive port. That one is commanded to fast forward, and the new slave is scanned (HP1), set up over its
//! service channel (HP2) and in CP4. One slave at a time: the next one behind it is brought in when it is through.
//!
//! On the other port, where there is one, hot plug is off meanwhile. So two slaves that were plugged in at both ends do
//! not take what is meant for one of them. Two of them in a row at the same end both hear it: that is found out
//! before the new slave gets any command value, see `stage.rs`.

mod field;
mod fit;
pub(super) mod refusal;
mod setup;
mod stage;

pub use self::fit::Misfit;
use self::refusal::HotPlugRefusal;
use self::stage::{Stage, StageEvent};
use super::config::{MasterConfig, Ports};
use super::event::{Event, SlaveId};
use super::layout::CyclicLayout;
use super::network::Network;
use super::station::{Facts, Presence, Station};
use super::svc::request::SvcFailure;
use super::topology::{Route, Topology};
use crate::wire::device_control::Topology as Loop;
use crate::wire::device_status::{DeviceStatus, InactivePort};
use crate::wire::header::{Channel, Phase};
use crate::wire::hot_plug::{END_ADDRESS, HotPlug, HotPlugCode};
use crate::wire::svc::SvcStatus;

/// Cycles in which the end of a line has to follow a topology command.
const COMMAND_CYCLES: u16 = 12;
/// Cycles in which a slave has to answer in the hot-plug field, switch to its service channel, and become valid.
const ANSWER_CYCLES: u16 = 50;
/// Cycles in a row in which a slave in front of the new one is not seen, at most.
const BLIND_CYCLES: u16 = 2;
/// Cycles with hot plug switched off before a station that turns telegrams round behind a new slave is taken for a shadow. A
/// slave reports telegrams on its inactive port for two cycles after the last one.
const PROVE_CYCLES: u16 = 10;
/// Cycles without hot plug after a slave has come in.
const REST_CYCLES: u16 = 4;
/// Cycles before a slave that did not come in is tried again, unless it is unplugged before.
const REFUSED_CYCLES: u16 = 1000;
/// Cycles for which parameters are broadcast to something that turns nothing round.
const LINK_CYCLES: u16 = 200;

/// Both channels, P first.
const CHANNELS: [Channel; 2] = [Channel::Primary, Channel::Secondary];

/// Where a slave can come in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// Behind the slave that ends the line on which the telegrams of this channel go.
    Behind(usize, Channel),
    /// At the master's own port, from which the telegrams of this channel go.
    Port(Channel),
}

impl Place {
    const fn channel(self) -> Channel {
        match self {
            Place::Behind(_, channel) | Place::Port(channel) => channel,
        }
    }

    /// The route on which telegrams come back from here.
    const fn route(self) -> Route {
        match self.channel() {
            Channel::Primary => Route::PRIMARY_ONE,
            Channel::Secondary => Route::SECONDARY_TWO,
        }
    }

    const fn end(self) -> Option<usize> {
        match self {
            Place::Behind(index, _) => Some(index),
            Place::Port(_) => None,
        }
    }
}

/// The end of the line hears its own telegrams come back from behind.
fn hears_own(status: DeviceStatus, channel: Channel) -> bool {
    status.topology() == Loop::loopback(channel) && status.inactive_port() == InactivePort::hearing(channel)
}

/// The slave that is coming in.
#[derive(Debug, Default)]
struct Newcomer {
    /// What it has said about its address, also when it is not let in.
    address: Option<u16>,
    /// Its station.
    slave: Option<usize>,
    /// What its station was before, and what was known of it: whether it may come may follow from that.
    before: Option<(Presence, Facts)>,
    /// The application is through, or does not want it.
    proceed: bool,
    turned_away: bool,
    /// Cycles in a row in which a slave was not seen.
    blind: u16,
}

/// Whether slaves can come in, where, and how far one of them is.
#[derive(Debug, Default)]
pub(super) struct Admission {
    /// A slave of the configuration may come later.
    supported: bool,
    stage: Stage,
    /// Cycles in this stage.
    cycles: u16,
    /// Where it comes in.
    place: Option<Place>,
    /// Number of the parameter (HP0), of the slave index, or of the offset (HP1).
    step: u8,
    newcomer: Newcomer,
    /// Cycles to rest.
    rest: u16,
    /// The last refusal that was told: it is not told again until something changes.
    told: Option<(Option<u16>, HotPlugRefusal)>,
    /// The closed ring was told of.
    ring_told: bool,
    /// Cycles in which the ends of the lines have had a link and not heard their own telegrams from behind.
    linked: [u16; 2],
}

impl Admission {
    pub fn new(config: &MasterConfig) -> Admission {
        let supported = config.slaves.iter().any(|slave| slave.hot_plug.is_some());
        Admission { supported, ..Admission::default() }
    }

    /// A phase begins.
    pub fn reset(&mut self) {
        *self = Admission { supported: self.supported, ..Admission::default() };
    }

    /// Ends of lines are being commanded.
    pub fn is_busy(&self) -> bool {
        self.stage.is_busy()
    }

    fn is(&self, slave: SlaveId) -> bool {
        self.newcomer.slave == Some(slave.index())
    }

    /// The phase whose application work is waited for at this slave.
    pub fn awaits(&self, slave: SlaveId) -> Option<Phase> {
        let phase = match self.stage {
            Stage::Await2 => Phase::CP2,
            Stage::Await3 => Phase::CP3,
            _ => return None,
        };
        (self.is(slave) && !self.newcomer.proceed).then_some(phase)
    }

    /// The application is through with the slave; `false` when it is not waited for.
    pub fn proceed(&mut self, slave: SlaveId) -> bool {
        let awaits = self.awaits(slave).is_some();
        self.newcomer.proceed |= awaits;
        awaits
    }

    /// The application does not want the slave; `false` when it is not on its way in.
    pub fn turn_away(&mut self, slave: SlaveId) -> bool {
        let joining = self.stage.is_joining() && self.is(slave);
        self.newcomer.turned_away |= joining;
        joining
    }

    /// The fields of the next MDT0 in P and in S telegrams; `None` for zeros.
    pub fn fields(&self, config: &MasterConfig, layout: &CyclicLayout) -> Option<[HotPlug; 2]> {
        let quiet = field::quiet(self.supported);
        if !self.stage.is_busy() && self.stage != Stage::Offer {
            return self.supported.then_some([quiet; 2]);
        }
        let places = self.newcomer.slave.and_then(|index| layout.slaves.get(index)?.as_ref());
        let active = match self.stage {
            Stage::Offer => return Some([field::parameter(self.step, config, layout); 2]),
            Stage::Open => field::scan(0),
            Stage::Scan => field::scan(u16::from(self.step)),
            Stage::Place => {
                let address = self.newcomer.address.unwrap_or(0);
                let (code, offset) = match self.step {
                    0 => (HotPlugCode::SVC_OFFSET_MDT, places.map(|places| places.svc_mdt)),
                    _ => (HotPlugCode::SVC_OFFSET_AT, places.map(|places| places.svc_at)),
                };
                field::offset(address, code, offset.map_or(0, |offset| offset.to_parameter()))
            }
            // It stays where it is until the line is closed in front of it.
            Stage::Close => field::scan(0),
            Stage::Prove => quiet,
            _ => field::SWITCH,
        };
        let channel = self.place.map(Place::channel);
        Some(CHANNELS.map(|own| if channel == Some(own) { active } else { quiet }))
    }

    /// Takes a stage on; `true` when it is another one.
    fn move_on(&mut self, event: StageEvent) -> bool {
        let Some(next) = self.stage.next(event) else { return false };
        self.stage = next;
        self.cycles = 0;
        self.step = 0;
        self.newcomer.proceed = false;
        self.newcomer.blind = 0;
        true
    }
}

impl Admission {
    /// One cycle of hot plug: the AT0 of the cycle has been evaluated. `true` when a slave has come in.
    pub fn step(&mut self, net: &mut Network) -> bool {
        self.cycles = self.cycles.saturating_add(1);
        self.tell_closed_ring(net);
        let event = match self.judge_stage(net) {
            Ok(None) => return false,
            Ok(Some(event)) => event,
            Err(reason) => {
                self.refuse(net, reason);
                StageEvent::Failed
            }
        };
        self.move_on(event) && self.enter_stage(net)
    }

    fn refuse(&mut self, net: &mut Network, reason: HotPlugRefusal) {
        let address = self.newcomer.address;
        if self.told != Some((address, reason)) {
            self.told = Some((address, reason));
            net.emit(Event::HotPlugRefused { address, reason });
        }
    }

    /// A place is free, and the ring is open.
    fn is_wanted(&mut self, net: &mut Network) -> bool {
        let free = net.stations.census().free > 0;
        let open = !net.redundancy.topology().is_ring() && net.redundancy.is_at_ease();
        free && open && self.ends_are_known(net)
    }

    /// Where telegrams come back past slaves, one of them has turned them round. Else somebody in between has, on whom
    /// the parameters would be lost, and who would be lost to them.
    fn ends_are_known(&self, net: &Network) -> bool {
        CHANNELS.into_iter().all(|channel| {
            let bit = 1 << Place::Port(channel).route().index();
            let seen = |station: &Station| station.is_active() && station.link.valid_routes & bit != 0;
            self.end_of(net, channel).is_some() || !net.stations.iter().any(seen)
        })
    }

    /// All parameters were broadcast behind this place, where something is plugged in; the last of them comes back in its
    /// own cycle. Otherwise a station that turns telegrams round there is left over from before, perhaps with others in front of it
    /// that have not taken them yet.
    fn was_offered(&self, place: Place) -> bool {
        let number = usize::from(place.channel() == Channel::Secondary);
        matches!(place, Place::Port(_)) || self.linked[number] + 1 >= u16::from(field::PARAMETERS)
    }

    fn tell_closed_ring(&mut self, net: &mut Network) {
        let closed = net.redundancy.topology().is_ring();
        if !closed || self.ring_told || net.stations.census().free == 0 {
            self.ring_told &= closed;
            return;
        }
        for index in 0..net.stations.len() {
            if net.stations[index].may_come() {
                self.ring_told = true;
                let address = Some(net.stations[index].address);
                net.emit(Event::HotPlugRefused { address, reason: HotPlugRefusal::RingClosed });
            }
        }
    }

    /// What this cycle means to the stage.
    // Flat: one arm per stage.
    fn judge_stage(&mut self, net: &mut Network) -> Result<Option<StageEvent>, HotPlugRefusal> {
        let cycles = self.cycles;
        if self.stage.is_joining() {
            if core::mem::take(&mut self.newcomer.turned_away) {
                return Err(HotPlugRefusal::Application);
            }
            self.watch_line(net)?;
        }
        let done = |done: bool| Ok(done.then_some(StageEvent::Done));
        let stage = self.stage;
        match stage {
            Stage::Idle | Stage::Offer => Ok(self.look_for_slave(net)),
            Stage::Open if self.end_follows(net) => Ok(Some(StageEvent::Done)),
            Stage::Open if cycles >= COMMAND_CYCLES => Err(HotPlugRefusal::Opening),
            Stage::Open => Ok(None),
            Stage::Scan => done(self.scan_slave(net)?),
            Stage::Place => done(self.place_slave(net)?),
            Stage::Switch => done(self.switch_slave(net)?),
            Stage::Enter => {
                let valid = self.newcomer.slave.and_then(|index| net.stations.valid_status(index)).is_some();
                if !valid && cycles >= ANSWER_CYCLES {
                    return Err(HotPlugRefusal::NotValid);
                }
                done(valid)
            }
            Stage::Prove => done(self.prove_slave(net)?),
            Stage::Close if self.end_follows(net) => Ok(Some(StageEvent::Done)),
            Stage::Close => Ok((cycles >= COMMAND_CYCLES).then_some(StageEvent::Elapsed)),
            Stage::Rest => Ok(self.is_rested(net).then_some(StageEvent::Elapsed)),
            _ => self.set_up_slave(net),
        }
    }

    /// HP0: whether a place is free, and something has come to one.
    fn look_for_slave(&mut self, net: &mut Network) -> Option<StageEvent> {
        if self.stage == Stage::Idle {
            // Only the lost ones can be named, and only with them does it matter how long a link has been there.
            if net.stations.census().lost > 0 {
                self.watch_links(net, false);
            } else {
                self.linked = [0; 2];
            }
            return self.is_wanted(net).then_some(StageEvent::Wanted);
        }
        if !self.is_wanted(net) {
            return Some(StageEvent::Unwanted);
        }
        self.step = (self.step + 1) % field::PARAMETERS;
        self.place = self.heard(net);
        let offered = self.place.is_none_or(|place| self.was_offered(place));
        self.watch_links(net, true);
        self.place.map(|_| if offered { StageEvent::Heard } else { StageEvent::Failed })
    }

    fn enter_stage(&mut self, net: &mut Network) -> bool {
        let place = self.place;
        match self.stage {
            Stage::Open => {
                self.newcomer.address = None;
                if let Some(end) = place.and_then(Place::end) {
                    net.stations[end].command_topology(Loop::FastForward);
                }
            }
            Stage::Offer => {
                self.linked = [0; 2];
                self.rest = REST_CYCLES;
            }
            Stage::Switch => self.begin_service(net),
            Stage::Close => {
                if let Some(Place::Behind(end, channel)) = place {
                    net.stations[end].command_topology(Loop::loopback(channel));
                }
                self.release_slave(net);
                self.rest = REFUSED_CYCLES;
            }
            Stage::Rest if self.newcomer.slave.is_some() => {
                self.welcome(net);
                return true;
            }
            stage => self.enter_set_up(net, stage),
        }
        false
    }

    /// The slave at the end of the line whose telegrams are those of `channel`.
    fn end_of(&self, net: &Network, channel: Channel) -> Option<(usize, DeviceStatus)> {
        let ends = net.stations.turning.iter().filter_map(|&index| {
            let index = usize::from(index);
            let status = net.stations.valid_status(index).filter(|_| net.stations[index].is_active())?;
            let position = net.redundancy.position(index)?;
            (status.topology() == Loop::loopback(channel)).then_some((position, index, status))
        });
        ends.min_by_key(|(position, ..)| *position).map(|(_, index, status)| (index, status))
    }

    /// Where a slave has taken the parameters and turns telegrams round.
    fn heard(&self, net: &Network) -> Option<Place> {
        CHANNELS.into_iter().find_map(|channel| match self.end_of(net, channel) {
            Some((end, status)) => hears_own(status, channel).then_some(Place::Behind(end, channel)),
            None => {
                let place = Place::Port(channel);
                let free = matches!(
                    (net.redundancy.topology(), channel),
                    (Topology::LineOne, Channel::Secondary)
                        | (Topology::LineTwo, Channel::Primary)
                        | (Topology::BrokenRing, _)
                );
                let both = net.config.ports == Ports::Both;
                (both && free && self.is_alone(net, place.route())).then_some(place)
            }
        })
    }

    /// Telegrams come back on this route, and no slave that takes part has put anything into them.
    fn is_alone(&self, net: &Network, route: Route) -> bool {
        let bit = 1 << route.index();
        let nobody = |index: usize| net.stations[index].link.valid_routes & bit == 0;
        net.frames.came(route) && (0..net.stations.len()).all(nobody)
    }

    /// Watches what is plugged in and does not take part: with `offering`, or where a lost slave is known to be.
    fn watch_links(&mut self, net: &mut Network, offering: bool) {
        for (number, channel) in CHANNELS.into_iter().enumerate() {
            let seen = self.end_of(net, channel);
            let linked = &mut self.linked[number];
            let Some((end, status)) = seen else {
                // One that is not seen in this cycle is taken to be as it was.
                *linked = if *linked > 0 { linked.saturating_add(1) } else { 0 };
                continue;
            };
            let alone = status.inactive_port() != InactivePort::NoLink && !hears_own(status, channel);
            *linked = if alone { linked.saturating_add(1) } else { 0 };
            if *linked != LINK_CYCLES || status.inactive_port() != InactivePort::Link {
                continue;
            }
            let next = net.redundancy.next_to(end, channel);
            let lost = next.filter(|&next| net.stations[next].presence == Presence::Lost);
            if offering || lost.is_some() {
                self.newcomer.address = lost.map(|index| net.stations[index].address);
                self.refuse(net, HotPlugRefusal::NoTelegram);
            }
        }
    }

    /// The end of the line does as commanded, where it is a slave.
    fn end_follows(&self, net: &Network) -> bool {
        let end = self.place.and_then(Place::end);
        end.is_none_or(|end| net.stations[end].follows_command())
    }

    /// The line in front of the new slave: it stays open, and everybody stays visible.
    fn watch_line(&mut self, net: &mut Network) -> Result<(), HotPlugRefusal> {
        let place = self.place;
        if place.and_then(Place::end).is_some_and(|end| !net.stations[end].is_active()) {
            return Err(HotPlugRefusal::Gone);
        }
        let seen = place.and_then(Place::end).is_none_or(|end| net.stations.valid_status(end).is_some());
        if self.stage != Stage::Open && seen && !self.end_follows(net) {
            // It has lost the link and turned telegrams round by itself.
            return Err(HotPlugRefusal::Gone);
        }
        let port_silent = matches!(place, Some(Place::Port(_)))
            && place.is_some_and(|place| !net.frames.came(place.route()));
        let unseen = net.stations.any_unseen();
        let admission = &mut *self;
        admission.newcomer.blind = if unseen || port_silent { admission.newcomer.blind + 1 } else { 0 };
        if admission.newcomer.blind >= net.config.slave_valid_misses.clamp(1, BLIND_CYCLES) {
            return Err(if unseen { HotPlugRefusal::Blind } else { HotPlugRefusal::Gone });
        }
        Ok(())
    }

    /// The hot-plug field of AT0 as it came back from the new slave in this cycle.
    fn answer(&self, net: &Network) -> Option<HotPlug> {
        let at0 = net.frames.at(self.place?.route(), 0)?;
        HotPlug::parse(at0).ok()
    }

    /// HP1: the address, and whether there is a second slave in the device.
    fn scan_slave(&mut self, net: &mut Network) -> Result<bool, HotPlugRefusal> {
        let index = u16::from(self.step);
        let answer = self.answer(net).filter(|answer| answer.word != 0 && answer.slave_index() == index);
        let Some(answer) = answer else { return self.wait_for_answer() };
        let [code, _] = answer.word.to_le_bytes();
        if answer.word & HotPlug::ERROR != 0 {
            return Err(match u16::from(code) {
                HotPlug::ERROR_NO_ADDRESS => HotPlugRefusal::NoAddress,
                _ => HotPlugRefusal::Scan { code },
            });
        }
        if u16::from(code) != HotPlug::SCANNED {
            return self.wait_for_answer();
        }
        match (index, answer.address()) {
            (0, 0 | END_ADDRESS) => Err(HotPlugRefusal::NoAddress),
            (0, address) => {
                self.newcomer.address = Some(address);
                let same = |index: &usize| {
                    let station = &net.stations[*index];
                    station.address == address && (station.is_active() || station.may_come())
                };
                let Some(found) = (0..net.stations.len()).find(same) else {
                    return Err(HotPlugRefusal::Unknown);
                };
                if net.stations[found].is_active() {
                    return Err(HotPlugRefusal::Duplicate);
                }
                if net.layout.slaves.get(found).is_none_or(Option::is_none) {
                    return Err(Misfit::Place.into());
                }
                self.newcomer.slave = Some(found);
                (self.step, self.cycles) = (1, 0);
                Ok(false)
            }
            (_, END_ADDRESS) => Ok(true),
            _ => Err(HotPlugRefusal::Several),
        }
    }

    fn wait_for_answer(&self) -> Result<bool, HotPlugRefusal> {
        if self.cycles >= ANSWER_CYCLES { Err(HotPlugRefusal::Silent) } else { Ok(false) }
    }

    /// HP1: both offsets.
    fn place_slave(&mut self, net: &Network) -> Result<bool, HotPlugRefusal> {
        let code = match self.step {
            0 => HotPlugCode::SVC_OFFSET_MDT,
            _ => HotPlugCode::SVC_OFFSET_AT,
        };
        let address = self.newcomer.address.unwrap_or(0);
        let own = code.0;
        let answer = self.answer(net).filter(|answer| answer.selection == address);
        let Some(answer) = answer.filter(|answer| answer.word.to_le_bytes()[0] == own) else {
            return self.wait_for_answer();
        };
        if answer.word & HotPlug::ERROR != 0 {
            return Err(HotPlugRefusal::Offset { code: own });
        }
        if self.step == 0 {
            (self.step, self.cycles) = (1, 0);
            return Ok(false);
        }
        Ok(true)
    }

    /// The service channel takes over: its station is set up for a slave that has just been found.
    fn begin_service(&mut self, net: &mut Network) {
        let Some(index) = self.newcomer.slave else { return };
        let station = &mut net.stations[index];
        self.newcomer.before = Some((station.presence, core::mem::take(&mut station.facts)));
        let address = station.address;
        station.found(address, net.config.slave(address));
        station.presence = Presence::Joining;
        // As at the end of CP1.
        station.channel.rest(true);
        station.channel.set_open(false);
        net.stations.count_anew();
    }

    /// HP1 ends with a valid service channel that has taken over the handshake bit.
    fn switch_slave(&mut self, net: &Network) -> Result<bool, HotPlugRefusal> {
        let Some(index) = self.newcomer.slave else { return Err(HotPlugRefusal::Switch) };
        let refused = HotPlug::ERROR | HotPlug::ERROR_SWITCH;
        if self.answer(net).is_some_and(|answer| answer.word == refused) {
            return Err(HotPlugRefusal::Switch);
        }
        let station = &net.stations[index];
        let status = station.link.svc.unwrap_or_default().status;
        let ready =
            status.contains(SvcStatus::VALID) && status.contains(SvcStatus::AHS) == station.channel.mhs();
        if !ready && self.cycles >= ANSWER_CYCLES {
            return Err(HotPlugRefusal::Switch);
        }
        Ok(ready)
    }

    /// Nobody else may have come in with it.
    fn prove_slave(&mut self, net: &mut Network) -> Result<bool, HotPlugRefusal> {
        let (Some(index), Some(place)) = (self.newcomer.slave, self.place) else {
            return Err(HotPlugRefusal::Gone);
        };
        let cycles = self.cycles;
        match net.stations.valid_status(index) {
            None => {
                let station = &mut net.stations[index];
                station.link.misses = station.link.misses.saturating_add(1);
                let gone = station.link.misses > net.config.slave_valid_misses;
                if gone { Err(HotPlugRefusal::NotValid) } else { Ok(false) }
            }
            Some(_) if cycles < PROVE_CYCLES => Ok(false),
            Some(status) if hears_own(status, place.channel()) => Err(HotPlugRefusal::Shadow),
            Some(_) => Ok(true),
        }
    }

    /// The slave takes part.
    fn welcome(&mut self, net: &mut Network) {
        let (Some(index), Some(place)) = (self.newcomer.slave.take(), self.place) else { return };
        let station = &mut net.stations[index];
        station.presence = Presence::Active;
        station.link.misses = 0;
        station.channel.set_open(true);
        let address = station.address;
        net.stations.count_anew();
        net.redundancy.insert(index, place.end(), place.channel());
        self.told = None;
        self.newcomer.before = None;
        net.emit(Event::HotPlugged { slave: SlaveId::from_index(index), address });
    }

    /// The slave does not come in: its place is free again.
    fn release_slave(&mut self, net: &mut Network) {
        let Some(index) = self.newcomer.slave.take() else { return };
        let station = &mut net.stations[index];
        // Before the service channel took over nothing of it has changed.
        let Some((presence, facts)) = self.newcomer.before.take() else { return };
        (station.presence, station.facts) = (presence, facts);
        station.channel.abort(SvcFailure::SlaveLost);
        station.channel.set_open(false);
        net.stations.count_anew();
    }

    /// Time is over, and nobody turns telegrams round without having been asked.
    fn is_rested(&mut self, net: &mut Network) -> bool {
        let place = self.place;
        let behind = place.and_then(|place| self.end_of(net, place.channel()));
        let unplugged = behind.is_some_and(|(_, status)| status.inactive_port() == InactivePort::NoLink);
        if unplugged {
            self.told = None;
        }
        if self.cycles < self.rest && !unplugged || self.cycles < REST_CYCLES {
            return false;
        }
        if self.heard(net).is_some() {
            if self.cycles > PROVE_CYCLES {
                self.newcomer.address = None;
                self.refuse(net, HotPlugRefusal::Occupied);
            }
            return false;
        }
        true
    }
}
