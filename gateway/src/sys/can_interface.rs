//! Bit rate, restart and transmit queue of a CAN interface, over netlink.
//!
//! These calls wait and allocate: they belong to the start of the box and to its tools, never to the cycle.

use std::fmt;
use std::io;
use std::os::fd::AsFd;

use profile_generic::can::timing::BitRate;
use socketcan::nl::{CanState, InterfaceDetails};
use socketcan::{CanCtrlMode, CanInterface};
use thiserror::Error;

use super::can_error::BusState;
use super::can_netlink::{self, Parameters, Timing};
use super::link::{self, LinkState};

/// Highest sample point, thousandths of a bit.
const SAMPLE_POINT_MAX: u16 = 999;

/// What is to be set; `None` leaves a thing as it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Settings {
    /// Rates of the bus.
    pub bit_rate: Option<BitRate>,
    /// Where in a bit it is sampled, thousandths; the driver chooses if there is none.
    pub sample_point: Option<u16>,
    /// The same for the data of FD frames.
    pub data_sample_point: Option<u16>,
    /// After how many milliseconds a controller that is off the bus is to start again by itself; 0 is never. A wish: an
    /// interface that is up keeps what it has, and some drivers cannot ([`State::restart_ms`] tells).
    pub restart_ms: Option<u32>,
    /// Frames that the transmit queue holds.
    pub queue: Option<u32>,
}

/// What an interface is set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct State {
    /// Its number. An interface that comes in place of one of the same name has another number.
    pub index: i32,
    /// Whether it is switched on, and on the bus.
    pub link: LinkState,
    /// Whether it is a controller with a bit rate, and not a virtual interface.
    pub has_bit_rate: bool,
    /// Rate of everything but FD data, bit/s; `None` while it is not set.
    pub nominal: Option<u32>,
    /// Where a bit is sampled, thousandths.
    pub sample_point: Option<u32>,
    /// Rate of FD data, bit/s.
    pub data: Option<u32>,
    /// Whether FD frames go.
    pub fd: bool,
    /// Error state of the controller; `None` where it is stopped or does not say.
    pub state: Option<BusState>,
    /// After how many milliseconds it starts again; 0 is never.
    pub restart_ms: Option<u32>,
    /// Errors counted: transmit, receive.
    pub errors: Option<(u16, u16)>,
    /// Frames that the transmit queue holds.
    pub queue: u32,
}

/// Why an interface was not set.
#[derive(Debug, Error)]
pub enum ConfigureError {
    /// No interface has this name.
    #[error("there is no network interface `{name}`")]
    NoSuchInterface {
        /// The name asked for.
        name: String,
    },
    /// The process may not set up interfaces.
    #[error(
        "not allowed to set up `{name}`: the process needs CAP_NET_ADMIN (run as root, or set {what} beforehand: `{command}`)"
    )]
    NotPermitted {
        /// The interface.
        name: String,
        /// What was to be set.
        what: &'static str,
        /// What does it by hand.
        command: String,
    },
    /// It is switched on, and what is asked for differs from what it has.
    #[error(
        "`{name}` is up with {found}, expected {expected}: set it down first (`ip link set {name} down`)"
    )]
    IsUp {
        /// The interface.
        name: String,
        /// What it is set to.
        found: String,
        /// What is asked for.
        expected: String,
    },
    /// It has no bit rate at all.
    #[error("`{name}` has no {what} to set: it is a virtual interface")]
    Virtual {
        /// The interface.
        name: String,
        /// What was to be set.
        what: &'static str,
    },
    /// The driver does not do that.
    #[error("the driver of `{name}` refuses {what}: {source}")]
    Refused {
        /// The interface.
        name: String,
        /// What was to be set.
        what: String,
        /// What it says.
        source: io::Error,
    },
    /// A number that no interface could take.
    #[error("expected a {what} of {expected}, got {got}")]
    Value {
        /// Of what.
        what: &'static str,
        /// What could be.
        expected: &'static str,
        /// What came.
        got: u32,
    },
    /// The system refused for another reason.
    #[error("cannot set up `{name}`: {step}: {source}")]
    System {
        /// The interface.
        name: String,
        /// What was being done.
        step: &'static str,
        /// The error.
        source: io::Error,
    },
}

/// What the interface is set to now.
///
/// # Errors
/// [`ConfigureError::NoSuchInterface`], [`ConfigureError::System`].
pub fn state(name: &str) -> Result<State, ConfigureError> {
    Interface::find(name)?.state()
}

/// Sets an interface that is down, and switches it on. One that is up and has what is asked for is left alone.
///
/// # Errors
/// [`ConfigureError`]; nothing has been switched on then.
pub fn configure(name: &str, settings: &Settings) -> Result<State, ConfigureError> {
    for (what, point) in
        [("sample point", settings.sample_point), ("data sample point", settings.data_sample_point)]
    {
        if let Some(got) = point.filter(|point| *point == 0 || *point > SAMPLE_POINT_MAX) {
            return Err(ConfigureError::Value {
                what,
                expected: "1 to 999 thousandths of a bit",
                got: got.into(),
            });
        }
    }
    let interface = Interface::find(name)?;
    let now = interface.state()?;
    if let Some(queue) = settings.queue.filter(|queue| *queue != now.queue) {
        interface.set_queue(queue)?;
    }
    let is_down = now.link == LinkState::Down;
    let other_rate = settings.bit_rate.is_some_and(|rate| !now.has(rate));
    let other_restart = settings.restart_ms.is_some_and(|wanted| now.restart_ms != Some(wanted));
    if other_rate || other_restart {
        if !now.has_bit_rate {
            let what = if settings.bit_rate.is_some() { "bit rate" } else { "restart time" };
            return Err(ConfigureError::Virtual { name: name.to_owned(), what });
        }
        if other_rate && !is_down {
            let found = now.to_string();
            return Err(ConfigureError::IsUp {
                name: name.to_owned(),
                found,
                expected: settings.to_string(),
            });
        }
        if is_down {
            interface.set_parameters(settings)?;
        }
    }
    if is_down {
        interface.switch_on()?;
    }
    interface.state()
}

/// Starts a controller again that is off the bus and does not do so by itself: as its driver does it, else by switching the
/// interface off and on.
///
/// # Errors
/// [`ConfigureError`].
pub fn restart(name: &str) -> Result<(), ConfigureError> {
    let interface = Interface::find(name)?;
    let done = match can_netlink::restart(interface.index) {
        Err(error) if is_unsupported(&error) => can_netlink::switch(interface.index, false)
            .and_then(|()| can_netlink::switch(interface.index, true)),
        done => done,
    };
    let command = format!("ip link set {name} type can restart");
    done.map_err(|error| interface.refused("a restart", &command, "a restart".to_owned(), error))
}

impl State {
    /// Whether it comes back by itself after it was off the bus.
    #[must_use]
    pub fn restarts(&self) -> bool {
        self.restart_ms.is_some_and(|restart| restart > 0)
    }

    /// Whether it is set to this rate.
    #[must_use]
    pub fn has(&self, rate: BitRate) -> bool {
        self.nominal == Some(rate.nominal())
            && self.fd == rate.is_fd()
            && (!self.fd || self.data == rate.data())
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nominal = self.nominal.and_then(BitRate::classic);
        let rate = match (nominal, self.data) {
            (Some(rate), Some(data)) if self.fd => BitRate::fd(rate.nominal(), data).or(nominal),
            _ => nominal,
        };
        match rate {
            Some(rate) => write!(f, "{rate}")?,
            None => f.write_str("no bit rate")?,
        }
        if let Some(restart) = self.restart_ms {
            write!(f, ", restart {restart} ms")?;
        }
        Ok(())
    }
}

impl fmt::Display for Settings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bit_rate {
            Some(rate) => write!(f, "{rate}")?,
            None => f.write_str("any bit rate")?,
        }
        if let Some(restart) = self.restart_ms {
            write!(f, ", restart {restart} ms")?;
        }
        Ok(())
    }
}

struct Interface<'a> {
    name: &'a str,
    index: i32,
    netlink: CanInterface,
    /// For questions that netlink is not needed for.
    socket: std::net::UdpSocket,
}

impl<'a> Interface<'a> {
    fn find(name: &'a str) -> Result<Self, ConfigureError> {
        let index =
            link::index(name).map_err(|_| ConfigureError::NoSuchInterface { name: name.to_owned() })?;
        let socket = std::net::UdpSocket::bind("0.0.0.0:0").map_err(|source| ConfigureError::System {
            name: name.to_owned(),
            step: "socket",
            source,
        })?;
        let netlink = CanInterface::open_iface(u32::try_from(index).unwrap_or(0));
        Ok(Self { name, index, netlink, socket })
    }

    fn system(&self, step: &'static str, source: io::Error) -> ConfigureError {
        ConfigureError::System { name: self.name.to_owned(), step, source }
    }

    fn state(&self) -> Result<State, ConfigureError> {
        let details: InterfaceDetails =
            self.netlink.details().map_err(|error| self.system("RTM_GETLINK", plain(&error)))?;
        let queue = link::queue_length(self.socket.as_fd(), self.name)
            .map_err(|error| self.system("SIOCGIFTXQLEN", error))?;
        let can = details.can;
        let rate = |timing: Option<socketcan::nl::CanBitTiming>| timing.filter(|timing| timing.bitrate != 0);
        Ok(State {
            index: self.index,
            link: link::state(self.socket.as_fd(), self.index, self.name),
            // A virtual interface has no parameters at all.
            has_bit_rate: can.ctrl_mode.is_some() || can.clock.is_some() || can.restart_ms.is_some(),
            nominal: rate(can.bit_timing).map(|timing| timing.bitrate),
            sample_point: rate(can.bit_timing).map(|timing| timing.sample_point),
            data: rate(can.data_bit_timing).map(|timing| timing.bitrate),
            fd: can.ctrl_mode.is_some_and(|modes| modes.has_mode(CanCtrlMode::Fd)),
            state: can.state.and_then(bus_state),
            restart_ms: can.restart_ms,
            errors: can.berr_counter.map(|counter| (counter.txerr, counter.rxerr)),
            queue,
        })
    }

    fn set_queue(&self, queue: u32) -> Result<(), ConfigureError> {
        link::set_queue_length(self.socket.as_fd(), self.name, queue).map_err(|error| {
            match error.raw_os_error() {
                Some(libc::EPERM) => ConfigureError::NotPermitted {
                    name: self.name.to_owned(),
                    what: "the transmit queue",
                    command: format!("ip link set {} txqueuelen {queue}", self.name),
                },
                _ => self.system("SIOCSIFTXQLEN", error),
            }
        })
    }

    fn set_parameters(&self, settings: &Settings) -> Result<(), ConfigureError> {
        let timing = |rate: u32, sample_point: Option<u16>| Timing {
            rate,
            sample_point: sample_point.map_or(0, u32::from),
        };
        let mut parameters = Parameters { restart_ms: settings.restart_ms, ..Parameters::default() };
        let mut command = format!("ip link set {} type can", self.name);
        if let Some(rate) = settings.bit_rate {
            parameters.nominal = Some(timing(rate.nominal(), settings.sample_point));
            command += &format!(" bitrate {}", rate.nominal());
            parameters.data = rate.data().map(|data| timing(data, settings.data_sample_point));
            // A driver that knows classic frames only refuses to be told of FD at all.
            parameters.fd = (rate.is_fd() || self.state()?.fd).then_some(rate.is_fd());
            if let Some(data) = rate.data() {
                command += &format!(" dbitrate {data} fd on");
            }
        }
        if let Some(restart) = settings.restart_ms {
            command += &format!(" restart-ms {restart}");
        }
        let done = match can_netlink::set(self.index, &parameters) {
            Err(error) if is_unsupported(&error) && parameters.restart_ms.take().is_some() => {
                can_netlink::set(self.index, &parameters)
            }
            done => done,
        };
        done.map_err(|error| self.refused("the bit rate", &command, settings.to_string(), error))
    }

    fn switch_on(&self) -> Result<(), ConfigureError> {
        let command = format!("ip link set {} up", self.name);
        let done = can_netlink::switch(self.index, true);
        done.map_err(|error| {
            self.refused("the interface up", &command, "to be switched on".to_owned(), error)
        })
    }

    fn refused(&self, what: &'static str, command: &str, asked: String, source: io::Error) -> ConfigureError {
        let name = self.name.to_owned();
        match source.raw_os_error() {
            Some(libc::EPERM | libc::EACCES) => {
                ConfigureError::NotPermitted { name, what, command: command.to_owned() }
            }
            Some(libc::ENODEV) => ConfigureError::NoSuchInterface { name },
            _ => ConfigureError::Refused { name, what: asked, source },
        }
    }
}

fn bus_state(state: CanState) -> Option<BusState> {
    match state {
        CanState::ErrorActive => Some(BusState::Active),
        CanState::ErrorWarning => Some(BusState::Warning),
        CanState::ErrorPassive => Some(BusState::Passive),
        CanState::BusOff => Some(BusState::Off),
        CanState::Stopped | CanState::Sleeping => None,
    }
}

/// Whether a driver says that it has no such thing.
fn is_unsupported(error: &io::Error) -> bool {
    error.raw_os_error() == Some(libc::EOPNOTSUPP)
}

/// The system's error behind one of the crate.
fn plain(error: &socketcan::Error) -> io::Error {
    match error {
        socketcan::Error::Io(error) => match error.raw_os_error() {
            Some(code) => io::Error::from_raw_os_error(code),
            None => io::Error::other(error.to_string()),
        },
        socketcan::Error::Nl(error) => match error.errno() {
            Some(code) => io::Error::from_raw_os_error(code),
            None => io::Error::other(error.to_string()),
        },
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_set_says_why() {
        let text = |settings: &Settings| configure("axb-none", settings).unwrap_err().to_string();
        assert_eq!(text(&Settings::default()), "there is no network interface `axb-none`");
        let settings = Settings { sample_point: Some(1000), ..Settings::default() };
        assert_eq!(text(&settings), "expected a sample point of 1 to 999 thousandths of a bit, got 1000");
        assert_eq!(state("").unwrap_err().to_string(), "there is no network interface ``");
    }

    #[test]
    fn settings_print_as_they_are_asked_for() {
        let settings =
            Settings { bit_rate: BitRate::classic(500_000), restart_ms: Some(100), ..Settings::default() };
        assert_eq!(settings.to_string(), "500 kbit/s, restart 100 ms");
        assert_eq!(Settings::default().to_string(), "any bit rate");
    }
}
