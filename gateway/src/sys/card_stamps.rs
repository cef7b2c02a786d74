//! Time stamps of a network card for the event messages of PTP: whether it has them, switched on, and what they are on the monotonic
//! clock.
//!
//! A card stamps a message when it passes the cable, by a clock of its own (PHC). Nobody keeps that clock here: it is read beside the
//! monotonic one whenever a stamp comes, and only its distance of that moment counts.

use std::cell::Cell;
use std::io;
use std::os::fd::BorrowedFd;
use std::path::PathBuf;

use profile_generic::time::MonotonicTime;
use thiserror::Error;

use super::clock::PairedReading;
use super::ethtool::{self, PtpStamps};
use super::option::set_option;
use super::phc::Phc;

/// Stamps that may be missing in a row, of one direction. A card has place for few, and its driver may be late with one.
const MISSING_MAX: u8 = 8;

/// A stamp further from the reading of the clock than this is that of another message.
const AGE_MAX_NS: u64 = 1_000_000_000;

/// Why the stamps of a card are not used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NotUsed {
    /// Nobody wants them.
    #[error("`card_stamps` is false")]
    Unwanted,
    /// The card, or its driver, has none for PTP.
    #[error("the network card has none")]
    None,
    /// Its clock is not to be had.
    #[error("cannot open its clock {path}: {reason}")]
    Clock {
        /// The device.
        path: String,
        /// What the system says.
        reason: String,
    },
    /// They cannot be switched on.
    #[error("cannot switch them on: {reason} (this needs CAP_NET_ADMIN)")]
    Refused {
        /// What the system says.
        reason: String,
    },
}

/// The card was to stamp messages, and did not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the network card has stamped none of {MISSING_MAX} messages that {direction}")]
pub struct StampsMissing {
    /// `were sent` or `came`.
    pub direction: &'static str,
}

/// Stamps of a card at work.
#[derive(Debug)]
pub struct CardStamps {
    clock: Phc,
    path: PathBuf,
    sent: Missing,
    received: Missing,
}

/// Stamps missing in a row, of one direction.
#[derive(Debug)]
struct Missing {
    direction: &'static str,
    count: Cell<u8>,
}

impl CardStamps {
    /// Has the card of an interface stamp PTP, and a socket report its stamps.
    ///
    /// # Errors
    /// [`NotUsed`]; the card is as it was.
    pub fn start(interface: &str, socket: BorrowedFd<'_>) -> Result<Self, NotUsed> {
        let features = ethtool::features(interface).ok();
        let (number, stamps) =
            features.and_then(|found| found.clock.zip(found.ptp_stamps)).ok_or(NotUsed::None)?;
        let path = PathBuf::from(format!("/dev/ptp{number}"));
        let clock = Phc::open(&path).map_err(|error| NotUsed::Clock {
            path: path.display().to_string(),
            reason: error.to_string(),
        })?;
        let refused = |error: io::Error| NotUsed::Refused { reason: error.to_string() };
        switch_on(interface, stamps).map_err(refused)?;
        let flags = libc::SOF_TIMESTAMPING_TX_HARDWARE
            | libc::SOF_TIMESTAMPING_RX_HARDWARE
            | libc::SOF_TIMESTAMPING_RAW_HARDWARE
            | libc::SOF_TIMESTAMPING_OPT_TSONLY;
        set_option(socket, libc::SOL_SOCKET, libc::SO_TIMESTAMPING, &flags).map_err(refused)?;
        Ok(Self { clock, path, sent: Missing::of("were sent"), received: Missing::of("came") })
    }

    /// The device of its clock.
    #[must_use]
    pub fn path(&self) -> &std::path::Path {
        &self.path
    }

    /// When a message that was received passed the cable; `stamp` is that of the card.
    ///
    /// # Errors
    /// Too many have had none.
    pub fn received(&self, stamp: Option<u64>) -> Result<Option<MonotonicTime>, StampsMissing> {
        self.received.note(stamp)?;
        Ok(self.at(stamp))
    }

    /// When a message that was sent passed the cable.
    ///
    /// # Errors
    /// Too many have had no stamp.
    pub fn sent(&self, stamp: Option<u64>) -> Result<Option<MonotonicTime>, StampsMissing> {
        self.sent.note(stamp)?;
        Ok(self.at(stamp))
    }

    fn at(&self, stamp: Option<u64>) -> Option<MonotonicTime> {
        instant(stamp?, self.clock.read()?)
    }
}

impl Missing {
    fn of(direction: &'static str) -> Self {
        Self { direction, count: Cell::new(0) }
    }

    fn note(&self, stamp: Option<u64>) -> Result<(), StampsMissing> {
        self.count.set(if stamp.is_some() { 0 } else { self.count.get().saturating_add(1) });
        if self.count.get() < MISSING_MAX { Ok(()) } else { Err(StampsMissing { direction: self.direction }) }
    }
}

/// Switches on the stamps, unless somebody has done so already: that needs no privilege then.
fn switch_on(interface: &str, stamps: PtpStamps) -> io::Result<()> {
    if ethtool::stamping(interface).is_ok_and(|present| stamps.are_on(present)) {
        return Ok(());
    }
    ethtool::set_stamping(interface, stamps.wanted())
}

/// The monotonic time of a stamp, by a reading of the card's clock of about the same time.
fn instant(stamp: u64, reading: PairedReading) -> Option<MonotonicTime> {
    let age = reading.time.wrapping_sub(stamp).cast_signed();
    if age.unsigned_abs() > AGE_MAX_NS {
        return None;
    }
    reading.at.0.checked_add_signed(age.checked_neg()?).map(MonotonicTime)
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd as _;

    use super::*;
    use crate::sys::namespace::{in_namespace, ip};

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn a_stamp_is_as_long_ago_as_the_clock_of_the_card_has_gone_on_since() {
        // The clock of the card counts something else altogether.
        let reading = |time| PairedReading { apart: 900, at: MonotonicTime(70 * SECOND), time };
        let card = 1_700_000_000 * SECOND;
        for (stamp, time, expected) in [
            (card - 1_500, card, Some(70 * SECOND - 1_500)),
            (card, card, Some(70 * SECOND)),
            // The stamp is of after the first of the two readings.
            (card + 300, card, Some(70 * SECOND + 300)),
            (card - SECOND, card, Some(69 * SECOND)),
            (card - SECOND - 1, card, None),
            (card + SECOND + 1, card, None),
            (0, card, None),
            (u64::MAX, 5, Some(70 * SECOND - 6)),
        ] {
            assert_eq!(instant(stamp, reading(time)), expected.map(MonotonicTime), "{stamp} at {time}");
        }
        let early = PairedReading { apart: 0, at: MonotonicTime(10), time: 100 };
        assert_eq!(instant(80, early), None, "before the host began");
    }

    #[test]
    fn eight_stamps_missing_in_a_row_of_one_direction_are_a_failure() {
        let (sent, received) = (Missing::of("were sent"), Missing::of("came"));
        let (sent, received) = (|stamp| sent.note(stamp), |stamp| received.note(stamp));
        for _ in 0..7 {
            assert_eq!(sent(None), Ok(()));
            assert_eq!(received(Some(1)), Ok(()));
        }
        let text = "the network card has stamped none of 8 messages that were sent";
        assert_eq!(sent(None).unwrap_err().to_string(), text);
        assert_eq!(sent(Some(1)), Ok(()), "they begin anew");
        for _ in 0..7 {
            assert_eq!(received(None), Ok(()));
        }
        assert_eq!(received(None).unwrap_err().direction, "came");
    }

    #[test]
    fn a_cable_without_a_card_has_none() {
        in_namespace("a_cable_without_a_card_has_none", || {
            ip("link add north0 type veth peer name north1");
            let socket = std::net::UdpSocket::bind(("0.0.0.0", 0)).unwrap();
            assert_eq!(CardStamps::start("north0", socket.as_fd()).unwrap_err(), NotUsed::None);
            assert_eq!(CardStamps::start("north7", socket.as_fd()).unwrap_err(), NotUsed::None);
        });
    }
}
