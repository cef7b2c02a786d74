//! A CIP Motion controller on real sockets: the engine of `profile_cip::controller` with a TCP stream, a UDP socket and
//! a time of its own.

use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::Duration;

use profile_cip::controller::{
    Controller, ControllerConfig, DATAGRAM_MAX, Event, Report, Step, StreamAction,
};
use profile_generic::time::DurationNs;
use profile_generic::time_base::TimeBase;

use super::controller_time::ControllerTime;
use super::setup::HOST_CLOCK;
use crate::sys::realtime;
use crate::sys::udp::{self, BindError, DSCP_URGENT, IoSocket, PORT_IO};

/// TCP port of EtherNet/IP explicit messages.
pub const PORT_EXPLICIT: u16 = 44818;

/// How long a device may take to accept the TCP connection.
const CONNECT_TIME_OUT: Duration = Duration::from_secs(5);

/// Longest wait between two looks at whether to stop.
const LOOK_INTERVAL: DurationNs = DurationNs::from_millis(20);

/// Longest wait while the stream has no room for what is to be sent.
const FULL_INTERVAL: DurationNs = DurationNs::from_micros(500);

/// `SCHED_FIFO` priority, below that of the box and of the drives.
const PRIORITY: u8 = 10;

/// Bytes taken from the stream at once.
const STREAM_CHUNK: usize = 4096;

/// Where the controller and its device are.
#[derive(Debug, Clone, Copy)]
pub struct Endpoints {
    /// The device; TCP 44818 and UDP 2222.
    pub target: Ipv4Addr,
    /// The controller's own address, to which it binds UDP 2222.
    pub bind: Ipv4Addr,
}

/// Why a run could not begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The configuration cannot work.
    #[error("controller configuration: {0}")]
    Config(#[from] profile_cip::controller::config::ConfigError),
    /// The UDP socket is not to be had.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The device does not accept the TCP connection.
    #[error("cannot connect to the device at TCP {target}: {source}")]
    Connect {
        /// The device.
        target: SocketAddrV4,
        /// What the system said.
        source: io::Error,
    },
    /// A socket failed during the run.
    #[error("{what}: {source}")]
    Socket {
        /// Which socket.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
}

/// Runs `program` on the device to its end and returns the report. `clock` is the controller's time. `on_event` sees every
/// event as it comes; setting `stop` winds the run up early: the axes are stopped and disabled, the connection is closed.
///
/// Where the configuration has the clock of the host for the grandmaster, Group_Sync is asked with that of `clock`.
///
/// # Errors
/// [`RunError`] when the run could not begin or a socket failed; how the program itself went stands in the report.
pub fn run(
    endpoints: Endpoints,
    mut config: ControllerConfig,
    clock: &mut ControllerTime,
    program: Vec<Step>,
    stop: &AtomicBool,
    on_event: &mut dyn FnMut(&Event),
) -> Result<Report, RunError> {
    // One that a script names stays: it may be meant to be refused.
    let is_named = config.grand_master != Some(HOST_CLOCK);
    let grandmaster = clock.grandmaster();
    if !is_named && grandmaster.is_some() {
        config.grand_master = grandmaster;
    }
    let controller = Controller::new(config, program)?;
    // A controller is a real-time device too; where the host refuses, its updates only come less evenly.
    let _ = realtime::apply(&realtime::Request { priority: Some(PRIORITY), ..realtime::Request::default() });
    let io = IoSocket::bind(SocketAddrV4::new(endpoints.bind, PORT_IO), DSCP_URGENT)?;
    let explicit = SocketAddrV4::new(endpoints.target, PORT_EXPLICIT);
    let stream =
        connect(explicit, endpoints.bind).map_err(|source| RunError::Connect { target: explicit, source })?;
    let mut run = Run {
        endpoints,
        explicit,
        time: TimeBase::new(clock.first_sample()),
        clock,
        grandmaster,
        is_named,
        controller,
        io,
        stream: Some(stream),
        opening: None,
        outgoing: Vec::with_capacity(STREAM_CHUNK),
        buffer: [0; BUFFER],
        stopping: false,
    };
    run.controller.tcp_connected(run.clock.now());
    while !run.controller.is_closed() {
        run.follow_clock();
        run.follow_stop(stop);
        run.take_opened()?;
        run.read_stream();
        run.read_datagrams()?;
        run.handle_time();
        run.send_datagrams()?;
        run.send_stream();
        run.follow_stream_action();
        while let Some(event) = run.controller.poll_event() {
            on_event(&event);
        }
        run.wait()?;
    }
    Ok(run.controller.report())
}

/// Of what is sent and received at once, the larger.
const BUFFER: usize = if DATAGRAM_MAX > STREAM_CHUNK { DATAGRAM_MAX } else { STREAM_CHUNK };

/// A run of a program on its sockets.
struct Run<'c> {
    endpoints: Endpoints,
    /// The device's explicit side.
    explicit: SocketAddrV4,
    clock: &'c mut ControllerTime,
    time: TimeBase,
    /// The one that `clock` follows.
    grandmaster: Option<[u8; 8]>,
    /// A script names the grandmaster.
    is_named: bool,
    controller: Controller,
    io: IoSocket,
    /// Gone when either side has closed it.
    stream: Option<TcpStream>,
    /// Another one is being opened, while the motion connection goes on.
    opening: Option<Receiver<io::Result<TcpStream>>>,
    /// What the stream has not taken yet.
    outgoing: Vec<u8>,
    buffer: [u8; BUFFER],
    stopping: bool,
}

impl Run<'_> {
    fn follow_clock(&mut self) {
        if let Some(sample) = self.clock.sample() {
            // A step of the clock is told to the device with the controller's time offset.
            self.time.feed(&sample);
        }
        let followed = self.clock.grandmaster();
        if followed != self.grandmaster {
            self.grandmaster = followed;
            if let Some(followed) = followed.filter(|_| !self.is_named) {
                self.controller.set_grand_master(followed);
            }
        }
    }

    fn follow_stop(&mut self, stop: &AtomicBool) {
        if stop.load(Ordering::Relaxed) && !self.stopping {
            self.stopping = true;
            self.controller.interrupt(self.clock.now());
        }
    }

    /// Takes the stream that was being opened.
    fn take_opened(&mut self) -> Result<(), RunError> {
        let Some(opened) = self.opening.as_ref().and_then(outcome) else { return Ok(()) };
        self.opening = None;
        match opened {
            Ok(opened) => {
                self.stream = Some(opened);
                self.controller.tcp_connected(self.clock.now());
            }
            // The motion connection controls the axes, which is still there.
            Err(_) if self.controller.is_connected() => self.controller.tcp_closed(self.clock.now()),
            Err(source) => return Err(RunError::Connect { target: self.explicit, source }),
        }
        Ok(())
    }

    fn read_stream(&mut self) {
        while let Some(open) = &mut self.stream {
            match open.read(&mut self.buffer[..STREAM_CHUNK]) {
                Ok(length) if length > 0 => {
                    self.controller.handle_stream(self.clock.now(), &self.buffer[..length]);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                // However a stream breaks, it is as good as closed by the device.
                Ok(_) | Err(_) => {
                    self.stream = None;
                    self.controller.tcp_closed(self.clock.now());
                }
            }
        }
    }

    fn read_datagrams(&mut self) -> Result<(), RunError> {
        while let Some(datagram) = self.io.recv(&mut self.buffer).map_err(udp_error)? {
            // A longer datagram than any of ours, or one from elsewhere, is none of the device's.
            if !datagram.truncated && *datagram.from.ip() == self.endpoints.target {
                let bytes = &self.buffer[..datagram.len];
                let now = self.clock.now();
                self.controller.handle_datagram(now, self.time.system_at(now), bytes);
            }
        }
        Ok(())
    }

    fn handle_time(&mut self) {
        let now = self.clock.now();
        self.controller.handle_time(now, self.time.system_at(now));
    }

    fn send_datagrams(&mut self) -> Result<(), RunError> {
        while let Some(length) = self.controller.poll_datagram_transmit(&mut self.buffer) {
            let destination = destination(&self.controller, self.endpoints.target);
            match self.io.send_to(&self.buffer[..length], destination) {
                // A full queue loses this update; the device counts it.
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(udp_error(error)),
                _ => {}
            }
        }
        Ok(())
    }

    fn send_stream(&mut self) {
        while let Some(length) = self.controller.poll_stream_transmit(&mut self.buffer) {
            self.outgoing.extend_from_slice(&self.buffer[..length]);
        }
        if flush(self.stream.as_mut(), &mut self.outgoing).is_err() {
            self.stream = None;
            self.outgoing.clear();
            self.controller.tcp_closed(self.clock.now());
        }
    }

    /// Closes the stream or opens another, as the controller wants.
    fn follow_stream_action(&mut self) {
        match self.controller.poll_stream_action() {
            Some(StreamAction::Close) => self.stream = None,
            Some(StreamAction::Reopen) => {
                drop(self.stream.take());
                self.outgoing.clear();
                self.opening = Some(connect_aside(self.explicit, self.endpoints.bind));
            }
            None => {}
        }
    }

    /// Waits until something comes or is due.
    fn wait(&self) -> Result<(), RunError> {
        let now = self.clock.now();
        let latest = now + if self.outgoing.is_empty() { LOOK_INTERVAL } else { FULL_INTERVAL };
        let due = self.controller.wake_at().map_or(latest, |due| due.min(latest));
        if due > now {
            let timeout = Duration::from_nanos(due.since(now).as_nanos().unsigned_abs());
            udp::wait(&self.io, self.stream.as_ref(), timeout)
                .map_err(|source| RunError::Socket { what: "waiting for the sockets", source })?;
        }
        Ok(())
    }
}

/// Where the device wants the C-to-D datagrams: at its own address and the usual port, where it does not say otherwise.
fn destination(controller: &Controller, target: Ipv4Addr) -> SocketAddrV4 {
    let named = controller.datagram_destination().unwrap_or(SocketAddrV4::new(target, PORT_IO));
    if named.ip().is_unspecified() { SocketAddrV4::new(target, named.port()) } else { named }
}

/// Connects beside the run: a device that does not answer must not hold up its updates.
fn connect_aside(target: SocketAddrV4, bind: Ipv4Addr) -> Receiver<io::Result<TcpStream>> {
    let (sender, receiver) = mpsc::sync_channel(1);
    std::thread::spawn(move || {
        // The run may have ended meanwhile.
        let _ = sender.send(connect(target, bind));
    });
    receiver
}

/// What became of [`connect_aside`], once it has ended.
fn outcome(opening: &Receiver<io::Result<TcpStream>>) -> Option<io::Result<TcpStream>> {
    match opening.try_recv() {
        Ok(result) => Some(result),
        Err(TryRecvError::Empty) => None,
        Err(TryRecvError::Disconnected) => Some(Err(io::ErrorKind::ConnectionAborted.into())),
    }
}

fn connect(target: SocketAddrV4, bind: Ipv4Addr) -> io::Result<TcpStream> {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None)?;
    socket.bind(&SocketAddr::from((bind, 0)).into())?;
    socket.connect_timeout(&SocketAddr::V4(target).into(), CONNECT_TIME_OUT)?;
    socket.set_tcp_nodelay(true)?;
    socket.set_nonblocking(true)?;
    Ok(socket.into())
}

/// Writes what the stream takes now; the rest waits.
fn flush(stream: Option<&mut TcpStream>, outgoing: &mut Vec<u8>) -> io::Result<()> {
    let Some(stream) = stream else {
        outgoing.clear();
        return Ok(());
    };
    while !outgoing.is_empty() {
        match stream.write(outgoing) {
            Ok(written) => {
                outgoing.drain(..written);
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn udp_error(source: io::Error) -> RunError {
    RunError::Socket { what: "UDP socket of the motion connection", source }
}
