//! System time of the host's `ptp4l`: its data sets by its management socket, its time from the clock that it keeps.
//!
//! With hardware time stamps that is the clock of the network card (PHC), otherwise `CLOCK_REALTIME`. Either is read beside the monotonic
//! clock four times in a second, and the [`Line`] through the readings is system time: the PHC has the master's time, and
//! `CLOCK_REALTIME` has it without the seconds to UTC where the master counts those of TAI. How many these are the daemon says while
//! it follows a master; they stay when it falls silent.

mod client;
pub mod message;

use std::path::{Path, PathBuf};

use profile_generic::time::MonotonicTime;

use self::client::Client;
use self::message::Picture;
use super::judge::{Event, Judge};
use super::line::Line;
use super::ptp::FollowerConfig;
use super::status::TimeStatus;
use crate::sys::clock::{PairedReading, realtime_reading};
use crate::sys::phc::Phc;

/// States of a port (IEEE 1588-2008, table 8).
const MASTER: u8 = 6;
const SLAVE: u8 = 9;

/// Polls without a whole answer after which the daemon is taken for gone.
const SILENT: u8 = 3;

/// Readings of the clock to one poll of the daemon.
const READINGS: u8 = 4;

/// The daemon as it is seen.
#[derive(Debug)]
pub struct Daemon {
    config: FollowerConfig,
    socket: PathBuf,
    client: Client,
    phc: Option<Phc>,
    watch: Watch,
    turn: u8,
}

impl Daemon {
    /// A daemon that listens on a socket; the time is that of `phc`, or of the host's clock.
    #[must_use]
    pub fn new(config: &FollowerConfig, socket: &Path, phc: Option<Phc>) -> Self {
        Self {
            config: *config,
            socket: socket.to_owned(),
            client: Client::new(socket, config.domain),
            phc,
            watch: Watch::new(config),
            turn: 0,
        }
    }

    /// The daemon is asked in this domain; in another one than before everything begins anew.
    pub fn set_domain(&mut self, domain: u8) {
        if self.config.domain != domain {
            self.config.domain = domain;
            self.client = Client::new(&self.socket, domain);
            (self.watch, self.turn) = (Watch::new(&self.config), 0);
        }
    }

    /// The largest offset begins anew.
    pub fn forget(&mut self) {
        self.watch.status.max_offset = 0;
    }

    /// The clock is synchronized within another threshold from the next offset on, ns.
    pub fn set_threshold(&mut self, threshold: u64) {
        self.watch.status.threshold = threshold;
        self.watch.judge.set_threshold(threshold);
    }

    /// Looks at clock and daemon, four times in a second.
    pub fn look(&mut self, now: MonotonicTime) -> &TimeStatus {
        // First the daemon: what a reading means depends on the offset to UTC that it says.
        if self.turn == 0 {
            let picture = self.client.ask();
            self.watch.asked(picture, now);
        }
        let reading = match &self.phc {
            Some(phc) => phc.read(),
            None => realtime_reading(),
        };
        self.watch.read(reading, self.phc.is_some());
        self.turn = (self.turn + 1) % READINGS;
        self.watch.status(now)
    }
}

/// What is made of answers and readings.
#[derive(Debug)]
struct Watch {
    line: Line,
    judge: Judge,
    status: TimeStatus,
    ingress: Option<i64>,
    /// Seconds from `CLOCK_REALTIME` to the time of the master; `None` before the first one.
    utc_seconds: Option<i16>,
    silent: u8,
    /// Readings of the clock that failed in a row.
    unread: u8,
}

impl Watch {
    fn new(config: &FollowerConfig) -> Self {
        Self {
            line: Line::direct(),
            judge: Judge::new(config.threshold),
            status: TimeStatus::ptp(config),
            ingress: None,
            utc_seconds: None,
            silent: 0,
            unread: 0,
        }
    }

    fn asked(&mut self, picture: Option<Picture>, now: MonotonicTime) {
        // What the daemon says of a clock that cannot be read is not said of system time, which goes on with the last rate.
        let Some(picture) = picture.filter(|_| self.unread < READINGS) else {
            self.silent = self.silent.saturating_add(1);
            if self.silent == SILENT {
                self.status.master = None;
                self.judge.handle(Event::NoMaster, now);
            }
            // The bound of the error grows on, and ends the holdover.
            self.judge.handle(Event::Time, now);
            return;
        };
        self.silent = 0;
        let follows = matches!(picture.port, SLAVE | MASTER) || picture.has_grandmaster;
        let master = follows.then_some(picture.master);
        if master.is_none() && self.status.master.is_some() {
            self.judge.handle(Event::NoMaster, now);
        }
        if let Some(master) = master {
            self.utc_seconds = Some(picture.utc_seconds);
            let grandmaster = self.status.grandmaster != Some(master.grandmaster);
            if grandmaster {
                self.status.max_offset = 0;
            }
            if grandmaster || self.status.master.is_none() {
                self.judge.handle(Event::Master { grandmaster }, now);
                self.status.grandmaster = Some(master.grandmaster);
            }
        }
        self.status.master = master;
        self.status.mean_path_delay = Some(picture.mean_path_delay);
        let is_new = self.ingress.replace(picture.ingress) != Some(picture.ingress);
        match picture.port {
            // This host is the grandmaster: nothing is nearer to its time than its own clock.
            MASTER => {
                self.status.offset_from_master = Some(0);
                self.judge.handle(Event::Offset(0), now);
            }
            SLAVE if is_new => {
                self.status.offset_from_master = Some(picture.offset);
                self.status.max_offset = self.status.max_offset.max(picture.offset.unsigned_abs());
                self.judge.handle(Event::Offset(picture.offset), now);
            }
            // Its servo is not locked, or no Sync has come.
            _ => {
                self.judge.handle(Event::Time, now);
            }
        }
    }

    /// A reading of the clock that the daemon keeps.
    fn read(&mut self, reading: Option<PairedReading>, is_phc: bool) {
        let Some(reading) = reading else {
            self.unread = self.unread.saturating_add(1);
            return;
        };
        self.unread = 0;
        // Before anybody has said what the host's clock counts, its time is not known.
        let Some(seconds) = (if is_phc { Some(0) } else { self.utc_seconds }) else { return };
        let time = i128::from(reading.time) + i128::from(seconds) * 1_000_000_000;
        if let Ok(phase) = i64::try_from(time - i128::from(reading.at.0)) {
            self.line.sync(reading.at, phase);
        }
    }

    fn status(&mut self, now: MonotonicTime) -> &TimeStatus {
        self.status.phase = self.judge.phase();
        self.status.error_bound = self.judge.error_bound(now);
        self.status.sample = self.line.sample(now);
        self.status.spread = self.line.spread();
        &self.status
    }
}

#[cfg(test)]
mod tests {
    use super::super::judge::{Reason, SyncPhase};
    use super::super::status::{Master, Quality};
    use super::*;

    const CONFIG: FollowerConfig =
        FollowerConfig { identity: [9; 8], domain: 0, threshold: 10_000, asymmetry: 0, seed: 0 };

    const SLAVE_OF: Picture = Picture {
        master: Master {
            grandmaster: [1; 8],
            quality: Quality { class: 6, accuracy: 0x21, variance: 0 },
            priorities: [128, 128],
            parent: ([1; 8], 1),
            steps_removed: 1,
            utc_offset: Some(37),
            ptp_time_scale: true,
            time_source: 0x20,
            time_traceable: true,
            frequency_traceable: true,
        },
        utc_seconds: 37,
        port: SLAVE,
        offset: 300,
        ingress: 0,
        has_grandmaster: true,
        mean_path_delay: 700,
    };

    fn at(second: u64) -> MonotonicTime {
        MonotonicTime((100 + second) * 1_000_000_000)
    }

    /// A daemon that was a slave for ten seconds.
    fn slave() -> Watch {
        let mut watch = Watch::new(&CONFIG);
        for second in 0..10_u64 {
            let ingress = i64::try_from(second).unwrap();
            watch.asked(Some(Picture { ingress, ..SLAVE_OF }), at(second));
        }
        watch
    }

    #[test]
    fn a_slave_is_synchronized_after_eight_offsets() {
        let mut watch = slave();
        let status = watch.status(at(10));
        assert_eq!((status.phase, status.grandmaster), (SyncPhase::Synchronized, Some([1; 8])));
        assert_eq!((status.offset_from_master, status.mean_path_delay), (Some(300), Some(700)));
    }

    #[test]
    fn a_daemon_without_new_syncs_or_without_an_answer_is_held_over() {
        let mut watch = slave();
        (10..14).for_each(|second| watch.asked(Some(Picture { ingress: 9, ..SLAVE_OF }), at(second)));
        assert_eq!(watch.status(at(14)).phase, SyncPhase::Holdover);
        let mut watch = slave();
        (10..13).for_each(|second| watch.asked(None, at(second)));
        assert_eq!((watch.status(at(13)).phase, watch.status(at(13)).master), (SyncPhase::Holdover, None));
    }

    #[test]
    fn holdover_without_a_daemon_ends_when_the_bound_passes_the_threshold() {
        let mut watch = slave();
        // 300 ns, and 500 ns each second since the last offset at second 9.
        for (second, phase) in
            [(28, SyncPhase::Holdover), (29, SyncPhase::Listening), (600, SyncPhase::Listening)]
        {
            (10..=second).for_each(|second| watch.asked(None, at(second)));
            assert_eq!(watch.status(at(second)).phase, phase, "{second}");
        }
    }

    #[test]
    fn daemon_whose_clock_cannot_be_read_is_held_over_and_then_not_synchronized() {
        let mut watch = slave();
        let mut phases = Vec::new();
        for second in 10..40_u64 {
            (0..READINGS).for_each(|_| watch.read(None, true));
            let ingress = i64::try_from(second).unwrap();
            watch.asked(Some(Picture { ingress, ..SLAVE_OF }), at(second));
            phases.push(watch.status(at(second)).phase);
        }
        assert_eq!(
            (phases[0], phases[9], phases[29]),
            (SyncPhase::Synchronized, SyncPhase::Holdover, SyncPhase::Listening)
        );
        // One reading, and what the daemon says counts again.
        for second in 40..50_u64 {
            let time = 1_700_000_000_000_000_000 + at(second).0;
            watch.read(Some(PairedReading { apart: 100, at: at(second), time }), true);
            (1..READINGS).for_each(|_| watch.read(None, true));
            let ingress = i64::try_from(second).unwrap();
            watch.asked(Some(Picture { ingress, ..SLAVE_OF }), at(second));
        }
        assert_eq!(watch.status(at(50)).phase, SyncPhase::Synchronized);
    }

    #[test]
    fn an_unlocked_servo_is_not_synchronized_and_a_grandmaster_of_its_own_is() {
        let mut watch = Watch::new(&CONFIG);
        (0..20).for_each(|second| watch.asked(Some(Picture { port: 8, ..SLAVE_OF }), at(second)));
        assert_eq!(watch.status(at(20)).phase, SyncPhase::Uncalibrated(Reason::NoSync));
        let mut watch = Watch::new(&CONFIG);
        let own = Picture { port: MASTER, has_grandmaster: false, ..SLAVE_OF };
        (0..10).for_each(|second| watch.asked(Some(own), at(second)));
        assert_eq!(watch.status(at(10)).phase, SyncPhase::Synchronized);
    }

    #[test]
    fn system_time_is_the_hardware_clock_or_the_hosts_with_the_seconds_to_utc() {
        for (is_phc, ahead) in [(true, 0), (false, 37_000_000_000)] {
            let mut watch = slave();
            for quarter in 0..8_u64 {
                let now = MonotonicTime(at(10).0 + quarter * 250_000_000);
                let time = 1_700_000_000_000_000_000 + now.0 + quarter * 25_000;
                watch.read(Some(PairedReading { apart: 100, at: now, time }), is_phc);
            }
            let sample = watch.status(at(12)).sample.unwrap();
            let expected = 1_700_000_000_000_000_000 + at(12).0 + 200_000 + ahead;
            assert!(sample.system.0.abs_diff(expected) <= 5, "{} {expected}", sample.system.0);
            assert!((sample.rate_ppb - 100_000).abs() <= 5, "{}", sample.rate_ppb);
        }
    }

    /// Readings of the host's clock from second 10 on, a quarter of a second apart, and the sample after each.
    fn read_on(watch: &mut Watch, quarters: std::ops::Range<u64>) -> Vec<u64> {
        let readings = quarters.map(|quarter| {
            let now = MonotonicTime(at(10).0 + quarter * 250_000_000);
            let time = 1_700_000_000_000_000_000 + now.0;
            watch.read(Some(PairedReading { apart: 100, at: now, time }), false);
            watch.status(now).sample.map_or(0, |sample| sample.system.0 - now.0)
        });
        readings.collect()
    }

    #[test]
    fn system_time_keeps_the_seconds_to_utc_when_daemon_or_master_fall_silent() {
        const PHASE: u64 = 1_700_000_000_000_000_000 + 37_000_000_000;
        let mut watch = slave();
        assert_eq!(read_on(&mut watch, 0..8), [PHASE; 8]);
        (0..3).for_each(|second| watch.asked(None, at(12 + second)));
        assert_eq!(watch.status(at(15)).master, None);
        assert_eq!(read_on(&mut watch, 20..28), [PHASE; 8]);
        // It listens for a master, and is its own grandmaster meanwhile.
        let listening = Picture { port: 4, has_grandmaster: false, utc_seconds: 0, ..SLAVE_OF };
        watch.asked(Some(listening), at(17));
        assert_eq!(read_on(&mut watch, 28..36), [PHASE; 8]);
    }

    #[test]
    fn the_hosts_clock_is_not_system_time_before_the_daemon_says_what_it_counts() {
        let mut watch = Watch::new(&CONFIG);
        assert_eq!(read_on(&mut watch, 0..4), [0; 4]);
    }

    #[test]
    fn the_largest_offset_begins_anew_with_another_grandmaster() {
        let mut watch = slave();
        assert_eq!(watch.status(at(10)).max_offset, 300);
        let other = Master { grandmaster: [2; 8], ..SLAVE_OF.master };
        watch.asked(Some(Picture { master: other, offset: -20, ingress: 77, ..SLAVE_OF }), at(11));
        assert_eq!(watch.status(at(11)).max_offset, 20);
    }

    #[test]
    fn another_domain_begins_anew_and_the_same_one_does_not() {
        let mut daemon = Daemon::new(&CONFIG, Path::new("/nonexistent/ptp4l"), None);
        daemon.watch = slave();
        daemon.set_domain(0);
        assert_eq!(daemon.watch.status(at(10)).phase, SyncPhase::Synchronized);
        daemon.forget();
        assert_eq!(daemon.watch.status(at(10)).max_offset, 0);
        daemon.set_domain(5);
        let status = daemon.watch.status(at(10));
        assert_eq!((status.phase, status.domain, status.grandmaster), (SyncPhase::Listening, 5, None));
    }
}
