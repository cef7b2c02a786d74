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
    let mut grandmaster = clock.grandmaster();
    if !is_named && grandmaster.is_some() {
        config.grand_master = grandmaster;
    }
    let mut controller = Controller::new(config, program)?;
    // A controller is a real-time device too; where the host refuses, its updates only come less evenly.
    let _ = realtime::apply(&realtime::Request { priority: Some(PRIORITY), ..realtime::Request::default() });
    let io = IoSocket::bind(SocketAddrV4::new(endpoints.bind, PORT_IO), DSCP_URGENT)?;
    let target = SocketAddrV4::new(endpoints.target, PORT_EXPLICIT);
    let stream = connect(target, endpoints.bind).map_err(|source| RunError::Connect { target, source })?;
    let mut time = TimeBase::new(clock.first_sample());
    let mut buffer = [0_u8; if DATAGRAM_MAX > STREAM_CHUNK { DATAGRAM_MAX } else { STREAM_CHUNK }];
    let mut outgoing = Vec::with_capacity(STREAM_CHUNK);
    // Gone when either side has closed it.
    let mut stream = Some(stream);
    // Another one is being opened, while the motion connection goes on.
    let mut opening: Option<Receiver<io::Result<TcpStream>>> = None;
    let mut stopping = false;
    controller.tcp_connected(clock.now());
    while !controller.is_closed() {
        if let Some(sample) = clock.sample() {
            // A step of the clock is told to the device with the controller's time offset.
            time.feed(&sample);
        }
        let followed = clock.grandmaster();
        if followed != grandmaster {
            grandmaster = followed;
            if let Some(followed) = followed.filter(|_| !is_named) {
                controller.set_grand_master(followed);
            }
        }
        if stop.load(Ordering::Relaxed) && !stopping {
            stopping = true;
            controller.interrupt(clock.now());
        }
        if let Some(opened) = opening.as_ref().and_then(outcome) {
            opening = None;
            match opened {
                Ok(opened) => {
                    stream = Some(opened);
                    controller.tcp_connected(clock.now());
                }
                // The axes are led by the motion connection, which is still there.
                Err(_) if controller.is_connected() => controller.tcp_closed(clock.now()),
                Err(source) => return Err(RunError::Connect { target, source }),
            }
        }
        while let Some(open) = &mut stream {
            match open.read(&mut buffer[..STREAM_CHUNK]) {
                Ok(length) if length > 0 => {
                    controller.handle_stream(clock.now(), &buffer[..length]);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                // However a stream breaks, it is as good as closed by the device.
                Ok(_) | Err(_) => {
                    stream = None;
                    controller.tcp_closed(clock.now());
                }
            }
        }
        while let Some(datagram) = io.recv(&mut buffer).map_err(udp_error)? {
            // A longer datagram than any of ours, or one from elsewhere, is none of the device's.
            if !datagram.truncated && *datagram.from.ip() == endpoints.target {
                let bytes = &buffer[..datagram.len];
                let now = clock.now();
                controller.handle_datagram(now, time.system_at(now), bytes);
            }
        }
        let now = clock.now();
        controller.handle_time(now, time.system_at(now));
        while let Some(length) = controller.poll_datagram_transmit(&mut buffer) {
            match io.send_to(&buffer[..length], destination(&controller, endpoints.target)) {
                // A full queue loses this update; the device counts it.
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(udp_error(error)),
                _ => {}
            }
        }
        while let Some(length) = controller.poll_stream_transmit(&mut buffer) {
            outgoing.extend_from_slice(&buffer[..length]);
        }
        if flush(stream.as_mut(), &mut outgoing).is_err() {
            stream = None;
            outgoing.clear();
            controller.tcp_closed(clock.now());
        }
        match controller.poll_stream_action() {
            Some(StreamAction::Close) => stream = None,
            Some(StreamAction::Reopen) => {
                drop(stream.take());
                outgoing.clear();
                opening = Some(connect_aside(target, endpoints.bind));
            }
            None => {}
        }
        while let Some(event) = controller.poll_event() {
            on_event(&event);
        }
        let now = clock.now();
        let latest = now + if outgoing.is_empty() { LOOK_INTERVAL } else { FULL_INTERVAL };
        let wake = controller.wake_at().map_or(latest, |due| due.min(latest));
        if wake > now {
            let timeout = Duration::from_nanos(wake.since(now).as_nanos().unsigned_abs());
            udp::wait(&io, stream.as_ref(), timeout)
                .map_err(|source| RunError::Socket { what: "waiting for the sockets", source })?;
        }
    }
    Ok(controller.report())
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
