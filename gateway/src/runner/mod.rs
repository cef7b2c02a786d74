//! The box on a host: sockets, the cycle thread, and the servers beside it.
//!
//! ```text
//! cycle thread:  UDP 2222, SERCOS interface, engine
//! tokio:         TCP and UDP 44818, Modbus TCP, log of the engine's notices
//! HTTP thread:   health, metrics, status, traces, page
//! ```

mod can_watch;
mod cycle;
mod devices;
mod indicators;
pub mod port;
mod scribe;
mod south;
mod strangers;

use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime as WallClock};

use profile_cip::device::config::{AdapterConfig, QosConfig};
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;
use tracing::info;

use self::cycle::{CycleThread, Ended, Setup};
use self::devices::{DeviceParts, ServerParts};
use self::indicators::{Change, Shown};
use self::port::{PacketPort, PortError};
use self::scribe::Scribe;
pub(crate) use self::south::can_port;
use crate::bundle::{Files, Sources};
use crate::capture::can_bus::CanProtocol;
use crate::capture::recorder::{Interfaces, Recorder, Settings, Tap};
use crate::config::{AxisKind, Config, Device, Http, Link, Modbus, ModbusParameter, RollingRecording};
use crate::engine::Engine;
use crate::engine::axis::rest::Unrested;
use crate::engine::build::{BuildError, Built, Commissioners, Host, build};
use crate::engine::direct::DirectNorth;
use crate::engine::local::LocalNorth;
use crate::engine::registers::RegisterNorth;
use crate::history::Histories;
use crate::host::HostPort;
use crate::http::{self, Fixed, HttpServer, RunningServer, Sheets, Token, View};
use crate::latest::Reader;
use crate::line_limit::LineLimit;
use crate::local::attributes::Attributes;
use crate::local::installation::Installation;
use crate::local::protocol::NamedParameter;
use crate::local::{Door, Hub, LocalServer, Shared, SocketFile};
use crate::mapping::Mapping;
use crate::modbus::{Binding, ModbusServer, Parameters};
use crate::north::{self, ServeError};
use crate::parameter::known::Catalogue;
use crate::recording::{self, ContactDevice, Plan, Recording};
use crate::settings::Store;
use crate::simulate::drives::SIMULATED_MAC;
use crate::status::BoxStatus;
use crate::status::pulse::Pulse;
use crate::sys::can_interface::ConfigureError;
use crate::sys::can_socket;
use crate::sys::interface_lock::LockError;
use crate::sys::thread::{self, SMALL_STACK, STACK};
use crate::sys::udp::BindError;
use crate::time::source::{Place, SourceError, TimeService, TimeView};

/// How often the commissioning of drives that come later goes on.
const COMMISSION_INTERVAL: Duration = Duration::from_millis(5);

/// How often notices are taken from the cycle thread.
const NOTICE_INTERVAL: Duration = Duration::from_millis(20);

/// How often it is looked whether the cycle thread publishes.
const PULSE_INTERVAL: Duration = Duration::from_millis(200);

/// Records that each tap of a recording to a file can hold: a disk can be slow for a second.
const CAPTURE_DEPTH: usize = 4_096;

/// Why the box cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The configuration makes no box.
    #[error("{0}")]
    Build(#[from] BuildError),
    /// The SERCOS interface cannot be opened, or has a master.
    #[error("{0}")]
    Interface(#[from] PortError),
    /// A CAN interface has a master.
    #[error("{0}")]
    Lock(#[from] LockError),
    /// A CAN interface cannot be opened.
    #[error("{0}")]
    Can(#[from] can_socket::OpenError),
    /// A CAN interface cannot be set to its bit rate.
    #[error("{0}")]
    BitRate(#[from] ConfigureError),
    /// The UDP port of a device is not to be had.
    #[error("{0}")]
    Bind(#[from] BindError),
    /// The TCP and UDP port of a device is not to be had.
    #[error("{0}")]
    Serve(#[from] ServeError),
    /// The device's explicit side refuses its configuration.
    #[error("device {name}: {error}")]
    Adapter {
        /// Its name.
        name: String,
        /// Why.
        error: profile_cip::device::config::ConfigError,
    },
    /// A register is bound to a parameter that no overlay defines.
    #[error("no overlay defines the parameter `{name}` that a Modbus register is bound to")]
    ModbusParameter {
        /// The name.
        name: String,
    },
    /// The Modbus TCP port is not to be had.
    #[error("cannot listen on {address} for Modbus TCP: {source}")]
    Modbus {
        /// The address.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// The HTTP port is not to be had.
    #[error("cannot listen on {address} for HTTP: {source}")]
    Http {
        /// The address.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// A file of the HTTP server cannot be used.
    #[error("`{key}` of [http]: {path}: {why}")]
    HttpFile {
        /// The key of the configuration.
        key: &'static str,
        /// The file.
        path: String,
        /// What is wrong with it.
        why: String,
    },
    /// The recording cannot be written.
    #[error("cannot write the recording {path}: {source}")]
    Recording {
        /// The file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// The socket of local control is not to be had.
    #[error("cannot serve local control on {path}: {source}")]
    Local {
        /// The path.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// There is no system time.
    #[error("{0}")]
    Time(#[from] SourceError),
    /// A thread or runtime cannot be started.
    #[error("cannot start {what}: {source}")]
    Thread {
        /// Which one.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
}

/// A box that runs.
#[derive(Debug)]
pub struct RunningBox {
    status: Reader<BoxStatus>,
    cycle: CycleThread,
    runtime: tokio::runtime::Runtime,
    servers: Vec<north::Handle>,
    recorder: Option<Recorder>,
    stop_notices: Arc<AtomicBool>,
    restart: Arc<AtomicBool>,
    /// Name and kind of each axis.
    axes: Vec<(String, AxisKind)>,
    /// Where system time comes from.
    time: TimeService,
    /// The HTTP server; it ends when this is dropped.
    http: Option<RunningServer>,
    /// What has happened.
    histories: Histories,
    /// The rolling recording.
    recording: Option<Arc<Recording>>,
    /// The socket of local control, removed at the end.
    _socket: Option<SocketFile>,
}

/// How a box has ended.
#[derive(Debug)]
pub struct Stopped {
    /// How many records the recording lost, or why it has ended early; `None` without one.
    pub recording: Option<io::Result<u64>>,
    /// Each axis that is not known to stand, with its speed and state.
    pub unrested: Vec<String>,
}

/// What a box does besides its configuration.
#[derive(Debug, Clone, Copy, Default)]
pub struct Extras<'a> {
    /// Records both sides to this file.
    pub capture: Option<&'a Path>,
    /// Offers local control on this Unix socket.
    pub local: Option<&'a Path>,
    /// What has happened so far; without it the histories begin here, and the log is not among them.
    pub histories: Option<&'a Histories>,
    /// The files of the configuration, for the page and the diagnostics bundle.
    pub files: Option<&'a Files>,
}

/// Starts a box with these tables; `settings` has what controllers set.
///
/// # Errors
/// [`StartError`]; nothing runs then.
pub fn start(
    config: &Config,
    mapping: Mapping,
    extras: Extras<'_>,
    settings: &Arc<Store>,
) -> Result<RunningBox, StartError> {
    let wire = south::sercos_wire(config)?;
    let mac = wire.as_ref().map_or(SIMULATED_MAC, PacketPort::mac);
    let recording = rolling(config, &mapping);
    let Built { mut engine, mut adapters, notices, status, commissioners } =
        build(config, mapping, Host { mac, incarnation: incarnation() })?;
    let (recorder, mut taps) = record(config, extras.capture, recording.as_ref())?;
    let (south, watches) = south::open(config, wire, &mut taps)?;
    let ports: Vec<_> = config.devices.iter().map(|device| HostPort::find(device.listen)).collect();
    let (north, markers) = devices::open_io(config, (&mut adapters, &ports), settings, &mut taps)?;

    let histories = extras.histories.cloned().unwrap_or_default();
    for (axis, of) in engine.axes_mut().iter_mut().zip(&config.axes) {
        axis.begin_totals(histories.counters.of(&of.name));
    }
    let limit = Arc::new(LineLimit::default());
    let (time, feed) = TimeService::start(&config.time, &clock_place(&adapters, &ports))?;

    let runtime = auxiliary_runtime()?;
    let _inside = runtime.enter();
    let named = config.devices.iter().zip(&adapters);
    let sheets: Vec<_> =
        named.map(|(device, (adapter, _))| (device.name.clone(), adapter.eds.clone())).collect();
    let restart = Arc::new(AtomicBool::new(false));
    let shared = ServerParts {
        status: &status,
        settings,
        recording: recording.as_ref(),
        time: (config.time.source, &time),
        limit: &limit,
        restart: &restart,
    };
    let mut servers = Vec::with_capacity(adapters.len());
    let parts = adapters.into_iter().zip(ports).zip(markers);
    for (number, (device, (((adapter, end), port), marker))) in config.devices.iter().zip(parts).enumerate() {
        let parts = DeviceParts { adapter, end, port, marker };
        servers.push(shared.serve((number, device), parts, &mut taps)?);
    }
    if let Some(modbus) = &config.modbus {
        serve_modbus(modbus, &mut engine, &status, (&limit, &runtime))?;
    }
    let sources = Arc::new(Sources {
        config: config.clone(),
        files: extras.files.cloned().unwrap_or_default(),
        installation: Installation::of(config),
        status: status.clone(),
        pulse: Pulse::default(),
        time: time.view(),
        histories: histories.clone(),
        recording: recording.clone(),
    });
    let stop_notices = Arc::new(AtomicBool::new(false));
    runtime.spawn(watch_pulse(Arc::clone(&sources), Arc::clone(&stop_notices)));
    let door = (extras.local.is_some() || config.http.is_some()).then(|| {
        let shared = Shared {
            names: config.axes.iter().map(|axis| axis.name.clone()).collect(),
            parameters: NamedParameter::of(engine.mapping()),
            catalogue: Catalogue::of(config, engine.mapping()),
            attributes: Attributes::of(config, &engine),
            limit: Arc::clone(&limit),
            sources: Arc::clone(&sources),
        };
        offer_local_control(shared, &mut engine, &runtime)
    });
    let http = config
        .http
        .as_ref()
        .map(|http| {
            let files = http::Files { sheets, configuration: sources.files.shown() };
            let fixed = Fixed { sheets: Sheets::of(config, engine.mapping()), files };
            serve_http(http, &sources, fixed, (&limit, door.as_ref()))
        })
        .transpose()?;
    let socket = extras.local.zip(door).map(|(path, door)| serve_local(path, door, &runtime)).transpose()?;
    let scribe = Scribe::new(Installation::of(config), histories.clone(), status.clone(), limit)
        .with_recording(recording.clone());
    runtime.spawn(scribe.run(notices, Arc::clone(&stop_notices)));
    let devices = config.devices.iter().map(|device| device.name.clone()).collect();
    let axes = config.axes.iter().map(|axis| axis.name.clone()).collect();
    runtime.spawn(log_indicators(status.clone(), devices, axes, Arc::clone(&stop_notices)));
    runtime.spawn(can_watch::watch(watches, Arc::clone(&stop_notices)));

    commission(commissioners)?;
    let setup = Setup { engine, north, south, time: feed, realtime: config.realtime };
    let cycle = CycleThread::start(setup)
        .map_err(|source| StartError::Thread { what: "the cycle thread", source })?;
    drop(_inside);
    let axes = config.axes.iter().map(|axis| (axis.name.clone(), axis.kind)).collect();
    Ok(RunningBox {
        status,
        cycle,
        runtime,
        servers,
        recorder,
        stop_notices,
        restart,
        axes,
        time,
        http,
        histories,
        recording,
        _socket: socket,
    })
}

/// Looks at the published status regularly, so that its age is known to whoever asks once.
async fn watch_pulse(sources: Arc<Sources>, stop: Arc<AtomicBool>) {
    let mut interval = tokio::time::interval(PULSE_INTERVAL);
    while !stop.load(Ordering::Relaxed) {
        interval.tick().await;
        sources.pulse.age(&sources.status.read());
    }
}

/// The runtime of the servers and of everything else beside the cycle.
fn auxiliary_runtime() -> Result<tokio::runtime::Runtime, StartError> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .thread_name("axisbridge-aux")
        .thread_stack_size(STACK)
        .build()
        .map_err(|source| StartError::Thread { what: "the runtime of the servers", source })
}

/// Serves the registers to Modbus TCP clients.
fn serve_modbus(
    modbus: &Modbus,
    engine: &mut Engine,
    status: &Reader<BoxStatus>,
    (limit, runtime): (&Arc<LineLimit>, &tokio::runtime::Runtime),
) -> Result<(), StartError> {
    let parameters = modbus_parameters(&modbus.parameters, engine, runtime)?;
    let server = runtime
        .block_on(ModbusServer::bind(modbus.listen, modbus.clients_max))
        .map_err(|source| StartError::Modbus { address: modbus.listen, source })?
        .with_parameters(parameters)
        .serve(modbus.clients.clone())
        .limit_lines(Arc::clone(limit));
    info!(address = %modbus.listen, "Modbus TCP");
    runtime.spawn(server.run(status.clone()));
    Ok(())
}

/// Lets the HTTP server show the state.
fn serve_http(
    http: &Http,
    sources: &Arc<Sources>,
    fixed: Fixed,
    (limit, door): (&Arc<LineLimit>, Option<&Door>),
) -> Result<RunningServer, StartError> {
    let bad =
        |key, path: &Path, why: String| StartError::HttpFile { key, path: path.display().to_string(), why };
    let token = http.token.as_ref().zip(door).map(|(path, door)| match Token::read(path) {
        Ok(token) => Ok((token, door.clone())),
        Err(error) => Err(bad("token", path, error.to_string())),
    });
    let (token, tls) = (token.transpose()?, http.tls.as_ref());
    let tls = tls.map(|files| {
        http::tls::read(files).map_err(|http::tls::BadTls { file, why }| match file {
            http::tls::TlsFile::Certificate => bad("certificate", &files.certificate, why.to_string()),
            http::tls::TlsFile::Key => bad("key", &files.key, why.to_string()),
        })
    });
    let tls = tls.transpose()?;
    let failed = |source| StartError::Http { address: http.listen, source };
    let server = HttpServer::bind(http.listen, http.connections_max).map_err(failed)?;
    let mut server = server.serve(http.clients.clone()).limit_lines(Arc::clone(limit));
    if let Some(door) = door {
        server = server.read_parameters(door.clone());
    }
    let (encrypted, control) = (tls.is_some(), token.is_some());
    if let Some(tls) = tls {
        server = server.encrypt(tls);
    }
    if let Some((token, door)) = token {
        server = server.control(token, door);
    }
    let address = server.local_address().map_err(failed)?;
    let view = View::new(Arc::clone(sources), fixed, WallClock::now());
    let running =
        server.start(view).map_err(|source| StartError::Thread { what: "the HTTP server", source })?;
    info!(%address, "{}", if encrypted { "HTTPS" } else { "HTTP" });
    if control {
        info!(encrypted, "those who have the token can control axes over HTTP");
    }
    Ok(running)
}

/// The registers that are parameters of drives, served by the engine.
fn modbus_parameters(
    bound: &[ModbusParameter],
    engine: &mut Engine,
    runtime: &tokio::runtime::Runtime,
) -> Result<Parameters, StartError> {
    if bound.is_empty() {
        return Ok(Parameters::default());
    }
    let binding = |row: &ModbusParameter| {
        let named = engine.mapping().dictionaries.generic.parameter(&row.parameter);
        let named = named.filter(|named| named.parameter.is_of_vendor());
        let named = named.ok_or_else(|| StartError::ModbusParameter { name: row.parameter.clone() })?;
        let axis = u8::try_from(row.axis).unwrap_or(u8::MAX);
        let ModbusParameter { register, kind, write, .. } = *row;
        Ok(Binding { register, kind, axis, parameter: named.parameter, write })
    };
    let bindings = bound.iter().map(binding).collect::<Result<Vec<_>, StartError>>()?;
    let (registers, end) = RegisterNorth::new();
    let (parameters, hub) = Parameters::new(bindings, end);
    engine.set_registers(registers);
    runtime.spawn(hub.run());
    Ok(parameters)
}

/// Offers local control of all axes to clients that come through a door.
fn offer_local_control(shared: Shared, engine: &mut Engine, runtime: &tokio::runtime::Runtime) -> Door {
    let (local, end) = LocalNorth::new(shared.names.len());
    let (direct, accesses) = DirectNorth::new();
    let (hub, door) = Hub::new(shared, (end, accesses));
    engine.set_local(local);
    engine.set_direct(direct);
    runtime.spawn(hub.run());
    door
}

/// Lets clients in on a socket.
fn serve_local(path: &Path, door: Door, runtime: &tokio::runtime::Runtime) -> Result<SocketFile, StartError> {
    let (server, file) = LocalServer::bind(path, door)
        .map_err(|source| StartError::Local { path: path.display().to_string(), source })?;
    info!(socket = %path.display(), "local control");
    runtime.spawn(server.run());
    Ok(file)
}

/// Where the clock of the box is on the network: at the address of the first device.
fn clock_place<End>(adapters: &[(AdapterConfig, End)], ports: &[Option<HostPort>]) -> Place {
    let adapter = adapters.first().map(|(adapter, _)| adapter);
    Place {
        interface: ports.first().and_then(Option::as_ref).map(|port| port.interface().to_owned()),
        mac: adapter.map_or([0; 6], |adapter| adapter.link.mac),
        event_dscp: adapter.map_or(QosConfig::default().ptp_event, |adapter| adapter.qos.ptp_event),
    }
}

/// Runs the commissioning of drives that come later, until the cycle thread has gone.
fn commission(mut commissioners: Commissioners) -> Result<(), StartError> {
    let run = move || {
        while !commissioners.is_abandoned() {
            commissioners.poll();
            std::thread::sleep(COMMISSION_INTERVAL);
        }
    };
    thread::named("axisbridge-commission", SMALL_STACK)
        .spawn(run)
        .map(drop)
        .map_err(|source| StartError::Thread { what: "the commissioning of drives that come later", source })
}

/// Starts the recorder thread, where there is something to record, with a tap for each place where traffic is seen.
fn record(
    config: &Config,
    capture: Option<&Path>,
    recording: Option<&Arc<Recording>>,
) -> Result<(Option<Recorder>, Vec<Tap>), StartError> {
    if capture.is_none() && recording.is_none() {
        return Ok((None, Vec::new()));
    }
    let file = capture.map(|path| Settings { interfaces: interfaces(config), ..Settings::new(path) });
    // The buses, and for each device its I/O and its explicit side.
    let buses = usize::from(config.sercos.is_some()) + config.can.len() + config.devicenet.len();
    let taps = buses + 2 * config.devices.len();
    let depth = if file.is_some() { CAPTURE_DEPTH } else { recording::depth(taps) };
    let (recorder, taps) =
        Recorder::start_with(file, recording.map(Recording::sink), depth, taps).map_err(|source| {
            match capture {
                Some(path) => StartError::Recording { path: path.display().to_string(), source },
                None => StartError::Thread { what: "the recorder", source },
            }
        })?;
    Ok((Some(recorder), taps))
}

/// The interfaces of a recording.
fn interfaces(config: &Config) -> Interfaces {
    let north = config.devices.iter().map(|device| device.listen.to_string()).collect::<Vec<_>>().join(", ");
    let south = match config.sercos.as_ref().map(|sercos| &sercos.link) {
        Some(Link::Interface { name, ring }) => {
            [name.clone(), ring.as_deref().unwrap_or("not used").to_owned()]
        }
        Some(Link::InProcess { ring }) => {
            let one = if *ring { "simulated SERCOS III ring" } else { "simulated SERCOS III line" };
            [one, if *ring { one } else { "not used" }].map(str::to_owned)
        }
        None => ["not used"; 2].map(str::to_owned),
    };
    let can = config.can.iter().map(|bus| CanProtocol::Canopen.describe(&bus.link));
    let devicenet = config.devicenet.iter().map(|network| CanProtocol::Devicenet.describe(&network.link));
    Interfaces { north, south, can: can.chain(devicenet).collect() }
}

/// The rolling recording of a configuration.
fn rolling(config: &Config, mapping: &Mapping) -> Option<Arc<Recording>> {
    let RollingRecording { seconds, memory } = config.recording?;
    let named = |device: &Device| ContactDevice { name: device.name.clone(), address: device.listen };
    let attributes = mapping.dictionaries.cip.attributes().iter();
    let attributes = attributes.map(|row| (row.id, row.name.clone())).collect();
    Some(Recording::new(Plan {
        span: DurationNs::from_secs(seconds.into()),
        memory,
        interfaces: interfaces(config),
        devices: config.devices.iter().map(named).collect(),
        axes: config.axes.iter().map(|axis| (axis.name.clone(), axis.device)).collect(),
        attributes: Arc::new(attributes),
        buses: Installation::of(config).buses.into_iter().map(|bus| bus.name).collect(),
        directory: config.history_dir.clone(),
    }))
}

/// Differs from start to start.
fn incarnation() -> u16 {
    let seconds = WallClock::now().duration_since(WallClock::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let [low, high, ..] = seconds.to_le_bytes();
    u16::from_le_bytes([low, high]).max(1)
}

/// Logs what the indicators show whenever it changes, until the box has ended.
async fn log_indicators(
    status: Reader<BoxStatus>,
    devices: Vec<String>,
    axes: Vec<String>,
    stop: Arc<AtomicBool>,
) {
    let mut interval = tokio::time::interval(NOTICE_INTERVAL);
    let mut shown = Shown::default();
    while !stop.load(Ordering::Relaxed) {
        interval.tick().await;
        let status = status.read();
        for change in shown.changes(&status) {
            match change {
                Change::Device { device, module_status, network_status } => {
                    let device = devices.get(device).map_or("", String::as_str);
                    info!(device, %module_status, %network_status, "indicators");
                }
                Change::Axis { axis, axis_status, display: line } => {
                    let axis = axes.get(axis).map_or("", String::as_str);
                    info!(axis, %axis_status, display = line, "indicators");
                }
            }
        }
    }
}

impl RunningBox {
    /// The status of the box.
    #[must_use]
    pub fn status(&self) -> BoxStatus {
        self.status.read()
    }

    /// Where the status is read from, also while the box is stopped.
    #[must_use]
    pub fn reader(&self) -> Reader<BoxStatus> {
        self.status.clone()
    }

    /// The state of system time.
    #[must_use]
    pub fn time(&self) -> TimeView {
        self.time.view()
    }

    /// What was refused of the asked-for real-time properties, in words; empty when everything was granted.
    #[must_use]
    pub fn realtime_report(&self) -> String {
        self.cycle.realtime_report()
    }

    /// Whether a controller has reset the Identity object: the box is to be stopped and started again.
    #[must_use]
    pub fn wants_restart(&self) -> bool {
        self.restart.load(Ordering::Relaxed)
    }

    /// Whether some drive may have torque.
    #[must_use]
    pub fn has_torque(&self) -> bool {
        use DriveState::{FaultReaction, Operating, Starting, Stopping, Testing};
        let torque = |state| matches!(state, Starting | Operating | Testing | Stopping | FaultReaction);
        self.status.read().configured_axes().iter().any(|axis| torque(axis.state))
    }

    /// Whether the cycle thread has ended by itself, which it should never do.
    #[must_use]
    pub fn is_dead(&self) -> bool {
        self.cycle.is_dead()
    }

    /// Stops the axes, waits until they stand or have had the time that their own limits give them, takes the buses down, ends
    /// every server, and finishes the recording. `hurry` says when the axes are waited for no longer.
    pub fn stop(self, hurry: &dyn Fn() -> bool) -> Stopped {
        let unrested = match self.cycle.stop(hurry) {
            Ended::Down(unrested) => unrested.iter().map(|axis| describe(axis, &self.axes)).collect(),
            Ended::Unknown => vec!["the cycle thread has not ended: no axis is known to stand".to_owned()],
        };
        self.stop_notices.store(true, Ordering::Relaxed);
        let servers = self.servers;
        self.runtime.block_on(async {
            for server in servers {
                server.stop().await;
            }
            tokio::time::sleep(2 * NOTICE_INTERVAL).await;
        });
        // Viewers see the stop until here.
        drop(self.http);
        self.runtime.shutdown_timeout(Duration::from_secs(1));
        self.histories.faults.close();
        if let Some(recording) = self.recording {
            recording.close();
        }
        self.histories.counters.save();
        let recording = self.recorder.map(|recorder| recorder.finish().map(|summary| summary.dropped));
        Stopped { recording, unrested }
    }
}

/// An axis that is not known to stand, in words.
fn describe(unrested: &Unrested, axes: &[(String, AxisKind)]) -> String {
    let Unrested { axis, state, velocity } = unrested;
    let (name, kind) =
        axes.get(usize::from(*axis)).map_or(("", AxisKind::Rotary), |(name, kind)| (name, *kind));
    let unit = match kind {
        AxisKind::Rotary => "rev/s",
        AxisKind::Linear => "mm/s",
    };
    match velocity {
        Some(velocity) => {
            let thousandths = velocity.get() / 1_000_000;
            let (whole, rest) = (thousandths.unsigned_abs() / 1_000, thousandths.unsigned_abs() % 1_000);
            let sign = if thousandths < 0 { "-" } else { "" };
            format!("axis {name} did not come to rest: {sign}{whole}.{rest:03} {unit}, drive state {state}")
        }
        None => {
            format!("axis {name} was not seen to come to rest: its speed is not known, drive state {state}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::quantity::Velocity;

    #[test]
    fn an_axis_that_does_not_stand_is_said_with_speed_and_state() {
        let axes = [("table".to_owned(), AxisKind::Rotary), ("slide".to_owned(), AxisKind::Linear)];
        let said = |axis, state, velocity: Option<i64>| {
            describe(&Unrested { axis, state, velocity: velocity.map(Velocity) }, &axes)
        };
        assert_eq!(
            said(0, DriveState::FaultReaction, Some(1_998_500_000)),
            "axis table did not come to rest: 1.998 rev/s, drive state fault_reaction"
        );
        assert_eq!(
            said(1, DriveState::Ready, Some(-20_000_000)),
            "axis slide did not come to rest: -0.020 mm/s, drive state ready"
        );
        assert_eq!(
            said(1, DriveState::Faulted, None),
            "axis slide was not seen to come to rest: its speed is not known, drive state faulted"
        );
    }
}
