//! The devices that controllers see: their sockets for cyclic data, and the servers of their explicit side.

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use profile_cip::device::adapter::Adapter;
use profile_cip::device::config::AdapterConfig;
use profile_cip::device::event::Event;
use profile_cip::device::identity::{Health, ModuleState};
use profile_cip::wire::motion::codes::AxisStateCode;
use tracing::{info, warn};

use super::StartError;
use super::port::UdpPort;
use super::strangers::DropWatch;
use crate::capture::recorder::Tap;
use crate::config::{Config, Device, TimeSource};
use crate::host::HostPort;
use crate::latest::Reader;
use crate::line_limit::LineLimit;
use crate::north::{self, AdapterEnd, ExplicitServer};
use crate::recording::Recording;
use crate::settings::Store;
use crate::status::BoxStatus;
use crate::sys::gate::Gate;
use crate::sys::udp::{BindError, IoSocket, Marker, PORT_IO};
use crate::time::object::time_sync;
use crate::time::source::TimeService;

/// What the explicit side of a device does to the socket of its cyclic data.
pub(super) struct IoMarker {
    marker: Marker,
    /// Lets the datagrams of one connection through; `None` for a device with assemblies.
    gate: Option<Arc<Gate>>,
}

/// Opens the socket for the cyclic data of each device, and completes the configuration of its explicit side with what the
/// host and the controllers have set.
pub(super) fn open_io(
    config: &Config,
    (adapters, ports): (&mut [(AdapterConfig, AdapterEnd)], &[Option<HostPort>]),
    settings: &Store,
    taps: &mut Vec<Tap>,
) -> Result<(Vec<UdpPort>, Vec<IoMarker>), StartError> {
    let mut north = Vec::with_capacity(config.devices.len());
    let mut markers = Vec::with_capacity(config.devices.len());
    for ((device, (adapter, _)), port) in config.devices.iter().zip(adapters).zip(ports) {
        if let Some(port) = port {
            port.describe(adapter);
        }
        settings.apply(&device.name, adapter);
        let address = SocketAddrV4::new(device.listen, PORT_IO);
        let (socket, gate) = io_socket(device, address, adapter.qos.urgent)?;
        let system = |source| BindError::System { address, step: "dup", source };
        markers.push(IoMarker { marker: socket.marker().map_err(system)?, gate });
        north.push(UdpPort::new(socket, taps.pop()));
    }
    Ok((north, markers))
}

/// Nothing comes in before there is a connection. The socket of a device with assemblies stays open: it has several
/// connections, and the gate lets one through.
fn io_socket(
    device: &Device,
    address: SocketAddrV4,
    dscp: u8,
) -> Result<(IoSocket, Option<Arc<Gate>>), BindError> {
    if device.assembly.is_some() {
        let socket = IoSocket::bind(address, dscp)?;
        socket.prepare_multicast()?;
        return Ok((socket, None));
    }
    let (socket, gate) = IoSocket::bind_closed(address, dscp)?;
    Ok((socket, Some(Arc::new(gate))))
}

/// What the servers of all devices use.
pub(super) struct ServerParts<'a> {
    pub status: &'a Reader<BoxStatus>,
    /// What controllers set.
    pub settings: &'a Arc<Store>,
    pub recording: Option<&'a Arc<Recording>>,
    pub time: (TimeSource, &'a TimeService),
    pub limit: &'a Arc<LineLimit>,
    /// Set when a controller resets the Identity object.
    pub restart: &'a Arc<AtomicBool>,
}

/// What the server of one device has for itself.
pub(super) struct DeviceParts {
    pub adapter: AdapterConfig,
    pub end: AdapterEnd,
    pub port: Option<HostPort>,
    pub marker: IoMarker,
}

impl ServerParts<'_> {
    /// Starts the server of the explicit side of a device.
    pub fn serve(
        &self,
        (number, device): (usize, &Device),
        parts: DeviceParts,
        taps: &mut Vec<Tap>,
    ) -> Result<north::Handle, StartError> {
        let DeviceParts { adapter, end, port, marker: IoMarker { marker, gate } } = parts;
        let mut adapter = Adapter::new(adapter)
            .map_err(|error| StartError::Adapter { name: device.name.clone(), error })?;
        adapter.hide_connection_ids(secret());
        let address = SocketAddrV4::new(device.listen, PORT_IO);
        let drops = gate.as_ref().map(|gate| DropWatch::new(Arc::clone(gate), address));
        let server = ExplicitServer::bind(device.listen, adapter, end, taps.pop())?
            .serve_tools(device.tools.clone())
            .limit_lines(Arc::clone(self.limit))
            .attend(self.attend(number, port, drops))
            .on_open(move |open| {
                // Data are sent unmarked rather than not at all.
                if let Err(error) = marker.mark(open.t_to_o_dscp) {
                    warn!(dscp = open.t_to_o_dscp, %error, "the datagrams of the connection carry no DSCP mark");
                }
            })
            .on_admit(move |admitted| {
                // The cycle refuses what the kernel lets through, at its own cost.
                if let Some(gate) = &gate
                    && let Err(error) = gate.set(admitted)
                {
                    warn!(%error, "the kernel does not drop foreign datagrams");
                }
            })
            .on_event(self.on_event(number, device.name.clone()));
        info!(device = device.name, address = %server.local_address(), "EtherNet/IP");
        Ok(north::spawn(server)?)
    }

    /// What the objects of the device show of its axes, the clock, and the port of the host.
    fn attend(
        &self,
        number: usize,
        port: Option<HostPort>,
        mut drops: Option<DropWatch>,
    ) -> impl FnMut(&mut Adapter) + Send + use<> {
        let (status, kept) = (self.status.clone(), Arc::clone(self.settings));
        let (clock_source, service) = self.time;
        let clock = service.view();
        move |adapter| {
            if let Some(drops) = &mut drops {
                drops.look();
            }
            let of_axes = health(&status.read(), number);
            let minor_recoverable = of_axes.minor_recoverable || kept.is_unsaved();
            adapter.set_health(Health { minor_recoverable, ..of_axes });
            adapter.set_time_sync(time_sync(clock_source, &clock.read()));
            if let Some(port) = &port {
                adapter.set_link(port.state());
            }
        }
    }

    /// Records an event, keeps what it sets, and carries out what it asks for.
    fn on_event(&self, number: usize, device: String) -> impl FnMut(&Event) + Send + use<> {
        let (recording, keeper) = (self.recording.cloned(), Arc::clone(self.settings));
        let (setter, restart) = (self.time.1.setter(), Arc::clone(self.restart));
        move |event| {
            if let Some(recording) = &recording {
                recording.note_event(number, event);
            }
            if let Err(error) = keeper.note(&device, event) {
                warn!(device, %error, "the settings cannot be written; they last until Axisbridge ends");
            }
            match event {
                Event::Reset { .. } => restart.store(true, Ordering::Relaxed),
                Event::TimeSyncSet(setting) => setter.set(*setting),
                _ => {}
            }
        }
    }
}

/// How a device is, by its axes: what its Module Status LED shows is what its Identity object says.
fn health(status: &BoxStatus, device: usize) -> Health {
    let axes = || status.configured_axes().iter().filter(|axis| usize::from(axis.device) == device);
    Health {
        state: axes().next().map_or(ModuleState::Standby, |axis| axis.indicators.module),
        // A controller has given every axis its attributes.
        configured: axes().all(|axis| axis.cip_axis_state != AxisStateCode::INITIALIZING.0),
        minor_recoverable: axes().any(|axis| axis.indicators.minor_fault),
        ..Health::default()
    }
}

/// A number that nobody can guess: the standard library seeds its hash tables from the system's random numbers.
fn secret() -> u64 {
    RandomState::new().build_hasher().finish()
}
