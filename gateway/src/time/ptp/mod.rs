//! PTP in the profile of CIP Sync: IEEE 1588-2008 over UDP and IPv4, end-to-end delay. The box is a follower, slave only; a clock that
//! may be the [`master`] is for the bench.
//!
//! `statime` has the protocol: parsing, best master, delay requests. Around it stand the [`guard`], which keeps from it what it
//! cannot bear, and the [`Line`], which takes its measurements. Nothing sets a clock: the result is a line over the monotonic clock.
//!
//! [`follow`] and [`master::lead`] run until their [`Wire`] ends. The wire has the sockets and the time, so that a test has both in its hand.

pub mod guard;
pub mod master;
mod measured;
#[cfg(test)]
mod tests;
pub mod wire;

use std::io;

use profile_generic::time::{DurationNs, MonotonicTime};
use rand::SeedableRng as _;
use rand::rngs::StdRng;
use statime::config::{
    AcceptAnyMaster, ClockIdentity, DelayMechanism, InstanceConfig, PortConfig, PtpMinorVersion, SdoId,
    TimePropertiesDS, TimeSource,
};
use statime::observability::port::PortState;
use statime::port::{NoForwardedTLVs, Port, PortAction, PortActionIterator, Running, TimestampContext};
use statime::time::{Duration, Interval, Time};
use statime::{PtpInstance, PtpInstanceState};

use self::guard::{Guard, MESSAGE_MAX};
use self::measured::{Collector, LocalClock, Measured};
use self::wire::{Arrived, Wire};
use super::judge::{Event, Judge};
use super::line::{Line, Taken};
use super::status::{Master, TimeStatus};

/// How it follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FollowerConfig {
    /// Identity of our clock, EUI-64.
    pub identity: [u8; 8],
    /// Domain, 0..=127.
    pub domain: u8,
    /// Largest offset of a synchronized clock, ns.
    pub threshold: u64,
    /// By how much the way from the master is longer than the mean of both ways, ns.
    pub asymmetry: i64,
    /// Where the randomness of the delay requests begins.
    pub seed: u64,
}

/// Announces come every two seconds (CIP Sync).
pub(super) const LOG_ANNOUNCE: i8 = 1;

/// Syncs come every second (CIP Sync).
pub(super) const LOG_SYNC: i8 = 0;

/// Delay requests go out every second in the mean.
const LOG_DELAY_REQUEST: i8 = 0;

/// Announces missed until a master is given up.
const ANNOUNCE_TIME_OUT: u8 = 3;

/// Longest wait, so that silence is noticed, ns.
const PATROL_NS: u64 = 250_000_000;

/// Longest time without a report.
const REPORT_EVERY: DurationNs = DurationNs::from_millis(1_000);

type State = std::cell::RefCell<PtpInstanceState>;
type Instance = PtpInstance<Collector, State>;
type RunningPort<'a> = Port<'a, Running, AcceptAnyMaster, StdRng, LocalClock, Collector, State>;

/// Timers of the port, in the order of [`Timer::ALL`]. The last two are those of a master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Timer {
    DelayRequest,
    AnnounceReceipt,
    BestMaster,
    Announce,
    Sync,
}

impl Timer {
    const ALL: [Self; 5] =
        [Self::DelayRequest, Self::AnnounceReceipt, Self::BestMaster, Self::Announce, Self::Sync];
}

#[derive(Debug, Default)]
struct Timers([Option<MonotonicTime>; Timer::ALL.len()]);

impl Timers {
    fn set(&mut self, timer: Timer, at: MonotonicTime) {
        if let Some(place) = self.0.get_mut(timer as usize) {
            *place = Some(at);
        }
    }

    fn next(&self) -> Option<MonotonicTime> {
        self.0.iter().flatten().min().copied()
    }

    /// Takes a timer that has run off.
    fn due(&mut self, now: MonotonicTime) -> Option<Timer> {
        Timer::ALL.into_iter().find(|timer| {
            let place = self.0.get_mut(*timer as usize);
            place.is_some_and(|place| place.take_if(|at| *at <= now).is_some())
        })
    }
}

/// An event message that has been sent, with the time it left.
type Sent = Option<(TimestampContext, MonotonicTime)>;

/// Does what the port asks for; an event message that left is returned.
fn perform(
    actions: PortActionIterator<'_>,
    timers: &mut Timers,
    wire: &mut impl Wire,
    now: MonotonicTime,
) -> io::Result<Sent> {
    let mut sent = None;
    let later = |duration: core::time::Duration| {
        MonotonicTime(now.0.saturating_add(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)))
    };
    for action in actions {
        match action {
            PortAction::SendEvent { context, data, .. } => {
                // Without the time it left there is no measurement, or no Follow_Up; the next one has it.
                sent = wire.send_event(data)?.map(|at| (context, at));
            }
            PortAction::ResetDelayRequestTimer { duration } => {
                timers.set(Timer::DelayRequest, later(duration))
            }
            PortAction::ResetAnnounceReceiptTimer { duration } => {
                timers.set(Timer::AnnounceReceipt, later(duration))
            }
            PortAction::SendGeneral { data, .. } => wire.send_general(data),
            PortAction::ResetAnnounceTimer { duration } => timers.set(Timer::Announce, later(duration)),
            PortAction::ResetSyncTimer { duration } => timers.set(Timer::Sync, later(duration)),
            // Of filters with a time of their own, of boundary clocks.
            PortAction::ResetFilterUpdateTimer { .. } | PortAction::ForwardTLV { .. } => {}
        }
    }
    Ok(sent)
}

/// What a clock is on the network.
struct PortSettings {
    instance: InstanceConfig,
    log_announce: i8,
    log_sync: i8,
    /// By how much the way from the master is longer than the mean of both ways, ns.
    asymmetry: i64,
}

impl PortSettings {
    fn config(&self) -> PortConfig<AcceptAnyMaster> {
        PortConfig {
            acceptable_master_list: AcceptAnyMaster,
            delay_mechanism: DelayMechanism::E2E { interval: Interval::from_log_2(LOG_DELAY_REQUEST) },
            announce_interval: Interval::from_log_2(self.log_announce),
            announce_receipt_timeout: ANNOUNCE_TIME_OUT,
            sync_interval: Interval::from_log_2(self.log_sync),
            master_only: false,
            delay_asymmetry: Duration::from_nanos(self.asymmetry),
            minor_ptp_version: PtpMinorVersion::Zero,
        }
    }
}

/// A port of the library with what it needs around it.
struct ClockPort<'a> {
    instance: &'a Instance,
    /// Taken while the best master is chosen.
    port: Option<RunningPort<'a>>,
    timers: Timers,
    guard: Guard,
    clock: LocalClock,
    measurements: measured::Measurements,
    /// How often the best master is chosen, ns.
    interval: u64,
    buffer: [u8; MESSAGE_MAX],
}

impl<'a> ClockPort<'a> {
    fn start(
        instance: &'a Instance,
        settings: &PortSettings,
        seed: u64,
        guard: Guard,
        wire: &mut impl Wire,
    ) -> io::Result<Self> {
        let measurements = measured::Measurements::default();
        let clock = LocalClock::new(wire.now());
        let rng = StdRng::seed_from_u64(seed);
        let port = instance.add_port(settings.config(), measurements.clone(), clock.clone(), rng);
        let mut timers = Timers::default();
        let (port, actions) = port.end_bmca();
        perform(actions, &mut timers, wire, wire.now())?;
        let interval = u64::try_from(instance.bmca_interval().as_nanos()).unwrap_or(u64::MAX);
        timers.set(Timer::BestMaster, MonotonicTime(wire.now().0.saturating_add(interval)));
        Ok(Self {
            instance,
            port: Some(port),
            timers,
            guard,
            clock,
            measurements,
            interval,
            buffer: [0; MESSAGE_MAX],
        })
    }

    fn state(&self) -> Option<PortState> {
        self.port.as_ref().map(|port| port.port_ds().port_state)
    }

    /// The master that is followed.
    fn master(&self) -> Option<Master> {
        let is_slave = self.state() == Some(PortState::Slave);
        is_slave.then(|| {
            let instance = self.instance;
            Master::of(&instance.parent_ds(), &instance.time_properties_ds(), &instance.current_ds(None))
        })
    }

    /// Waits for one message or timer and handles it. `time` is the time of the clock at an instant, as messages have it.
    fn turn(
        &mut self,
        wire: &mut impl Wire,
        time: &impl Fn(MonotonicTime) -> Time,
    ) -> io::Result<MonotonicTime> {
        let patrol = MonotonicTime(wire.now().0.saturating_add(PATROL_NS));
        let until = self.timers.next().map_or(patrol, |at| at.min(patrol));
        let arrived = wire.wait(until, &mut self.buffer)?;
        let now = wire.now();
        self.clock.set(now);
        let Some(mut port) = self.port.take() else { return Ok(now) };
        let timers = &mut self.timers;
        let sent = if let Some(Arrived { len, event }) = arrived {
            match (self.guard.pass(self.buffer.get(..len).unwrap_or(&[]), now), event) {
                (Ok(message), Some(at)) => {
                    perform(port.handle_event_receive(message, time(at)), timers, wire, now)?
                }
                (Ok(message), None) => perform(port.handle_general_receive(message), timers, wire, now)?,
                (Err(_), _) => None,
            }
        } else {
            match timers.due(now) {
                Some(Timer::DelayRequest) => perform(port.handle_delay_request_timer(), timers, wire, now)?,
                Some(Timer::AnnounceReceipt) => {
                    perform(port.handle_announce_receipt_timer(), timers, wire, now)?
                }
                Some(Timer::BestMaster) => {
                    let mut deciding = port.start_bmca();
                    self.instance.bmca(&mut [&mut deciding]);
                    let (running, actions) = deciding.end_bmca();
                    port = running;
                    timers.set(Timer::BestMaster, MonotonicTime(now.0.saturating_add(self.interval)));
                    perform(actions, timers, wire, now)?
                }
                Some(Timer::Announce) => {
                    perform(port.handle_announce_timer(&mut NoForwardedTLVs), timers, wire, now)?
                }
                Some(Timer::Sync) => perform(port.handle_sync_timer(), timers, wire, now)?,
                None => None,
            }
        };
        if let Some((context, at)) = sent {
            perform(port.handle_send_timestamp(context, time(at)), timers, wire, now)?;
        }
        self.port = Some(port);
        Ok(now)
    }
}

/// Follows the best master until the wire ends. `report` gets the status after each change.
///
/// # Errors
/// What the wire says.
pub fn follow(
    config: &FollowerConfig,
    wire: &mut impl Wire,
    report: &mut dyn FnMut(&TimeStatus),
) -> io::Result<()> {
    let settings = PortSettings {
        instance: InstanceConfig {
            clock_identity: ClockIdentity(config.identity),
            priority_1: 255,
            priority_2: 255,
            domain_number: config.domain,
            slave_only: true,
            sdo_id: SdoId::default(),
            path_trace: false,
        },
        log_announce: LOG_ANNOUNCE,
        log_sync: LOG_SYNC,
        asymmetry: config.asymmetry,
    };
    let instance = Instance::new(settings.instance, time_properties());
    let guard = Guard::new(config.identity, config.domain);
    let mut port = ClockPort::start(&instance, &settings, config.seed, guard, wire)?;
    let mut follower = Follower::new(config);
    report(follower.status(wire.now(), &port.guard));
    while !wire.is_ended() {
        let now = port.turn(wire, &time)?;
        follower.master(port.master(), now);
        while let Some(measured) = port.measurements.take() {
            follower.measured(measured);
        }
        if wire.take_forget() {
            follower.forget();
        }
        if let Some(threshold) = wire.threshold() {
            follower.set_threshold(threshold);
        }
        if follower.pass(now) {
            report(follower.status(now, &port.guard));
        }
    }
    Ok(())
}

/// A clock that nobody has set by a standard.
fn time_properties() -> TimePropertiesDS {
    TimePropertiesDS::new_arbitrary_time(false, false, TimeSource::InternalOscillator)
}

fn time(at: MonotonicTime) -> Time {
    Time::from_nanos(at.0)
}

/// What a follower makes of the measurements of its port.
#[derive(Debug)]
struct Follower {
    line: Line,
    judge: Judge,
    status: TimeStatus,
    /// Who has sent the Syncs of the line.
    parent: Option<([u8; 8], u16)>,
    changed: bool,
    /// When the status was reported last: the bound of the error grows while nothing happens.
    reported: MonotonicTime,
}

impl Follower {
    fn new(config: &FollowerConfig) -> Self {
        Self {
            line: Line::default(),
            judge: Judge::new(config.threshold),
            status: TimeStatus::ptp(config),
            parent: None,
            changed: true,
            reported: MonotonicTime::ZERO,
        }
    }

    fn judge(&mut self, event: Event, now: MonotonicTime) {
        self.changed |= self.judge.handle(event, now).is_some();
    }

    /// The largest offset begins anew.
    fn forget(&mut self) {
        (self.status.max_offset, self.changed) = (0, true);
    }

    /// The clock is synchronized within another threshold from the next offset on, ns.
    fn set_threshold(&mut self, threshold: u64) {
        self.changed |= self.status.threshold != threshold;
        self.status.threshold = threshold;
        self.judge.set_threshold(threshold);
    }

    /// Looks whether another master is followed.
    fn master(&mut self, master: Option<Master>, now: MonotonicTime) {
        if master == self.status.master {
            return;
        }
        self.changed = true;
        let before = std::mem::replace(&mut self.status.master, master);
        let Some(master) = master else {
            self.judge(Event::NoMaster, now);
            return;
        };
        let same_port = self.parent.replace(master.parent) == Some(master.parent);
        let grandmaster = self.status.grandmaster != Some(master.grandmaster);
        self.status.grandmaster = Some(master.grandmaster);
        if grandmaster {
            self.line.begin_anew();
            self.status.max_offset = 0;
        } else if !same_port {
            // Another way to the same time has another delay.
            self.line.forget_delay();
        }
        if grandmaster || before.is_none() {
            self.judge(Event::Master { grandmaster }, now);
        }
    }

    fn measured(&mut self, measured: Measured) {
        self.changed = true;
        let (at, phase) = match measured {
            Measured::Sync { at, phase } => (at, phase),
            Measured::Delay { at, phase } => return self.line.delay(at, phase),
        };
        let had_time = self.line.mean_path_delay().is_some();
        let event = match self.line.sync(at, phase) {
            Taken::Stepped { by } if by.unsigned_abs() > self.status.threshold => {
                self.status.steps = self.status.steps.saturating_add(1);
                self.status.offset_from_master = Some(by.saturating_neg());
                Event::Step
            }
            // A step within the threshold is an offset like others: the clock was as far off as a synchronized one may be.
            Taken::Stepped { by: offset } | Taken::Near { offset } | Taken::PutAside { offset }
                if had_time =>
            {
                // Of us from the master, as everywhere in PTP.
                self.status.offset_from_master = Some(offset.saturating_neg());
                self.status.max_offset = self.status.max_offset.max(offset.unsigned_abs());
                Event::Offset(offset)
            }
            Taken::First | Taken::Stepped { .. } | Taken::Near { .. } | Taken::PutAside { .. } => {
                Event::NoDelay
            }
        };
        self.judge(event, at);
    }

    /// Time passes. Whether there is something to report: once in a second at least.
    fn pass(&mut self, now: MonotonicTime) -> bool {
        self.judge(Event::Time, now);
        let is_due = now.since(self.reported) >= REPORT_EVERY;
        std::mem::take(&mut self.changed) || is_due
    }

    fn status(&mut self, now: MonotonicTime, guard: &Guard) -> &TimeStatus {
        self.reported = now;
        self.status.phase = self.judge.phase();
        self.status.error_bound = self.judge.error_bound(now);
        self.status.sample = self.line.sample(now);
        self.status.mean_path_delay = self.line.mean_path_delay();
        self.status.spread = self.line.spread();
        self.status.refused = guard::Refusal::ALL.map(|reason| guard.refused(reason));
        &self.status
    }
}
