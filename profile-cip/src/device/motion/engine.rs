//! The cyclic side of the motion device: its connection, its node and its instances, and how time passes for them.

use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::clock::Clock;
use super::device::{AXES_MAX, DeviceConfig};
use super::fixed;
use super::indication::StartupProgress;
use super::instances::Instances;
use super::io_connection::{IoConnection, Mode};
use super::node::NodeHealth;
use super::statistics::Statistics;
use crate::device::attribute::{TableError, id};
use crate::device::axis::Context;
use crate::device::axis::exception::ExceptionActions;
use crate::device::motion_link::{CloseParameters, MotionReply, OpenParameters, OpenRefusal};
use crate::wire::motion::codes::{NodeAlarm, NodeControl, NodeFault};
use crate::wire::motion::{FORMAT_REVISION, FORMAT_REVISION_RUN_IDLE, Format};
use crate::wire::status::GeneralStatus;

/// Instances of an update: the class and the axes.
pub(super) const INSTANCES_MAX: usize = AXES_MAX + 1;
/// Octets of the class-1 sequence count.
pub(super) const SEQUENCE_LEN: usize = 2;

/// Extended status of a refused Forward_Open: the connection has an owner.
const OWNERSHIP_CONFLICT: u16 = 0x0106;
/// Extended status of a refused Forward_Open: the interval is not acceptable.
const INTERVAL_NOT_ACCEPTABLE: u16 = 0x0111;
/// Extended status of a refused Forward_Open: the connection point is not one of ours.
const INVALID_CONNECTION_POINT: u16 = 0x012F;

/// What the last C-to-D update asked to hear about one instance.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Echo {
    pub number: u8,
    pub cyclic: bool,
    /// Write block ID, read block ID and status of the write data.
    pub lists: Option<(u8, u8, GeneralStatus)>,
}

/// The parts of the device that a connection works with.
pub(super) struct Engine {
    pub config: DeviceConfig,
    pub instances: Instances,
    pub connection: Option<IoConnection>,
    pub node: NodeHealth,
    pub clock: Clock,
    pub progress: StartupProgress,
    pub statistics: Statistics,
    pub echo: ArrayVec<Echo, INSTANCES_MAX>,
}

impl Engine {
    pub fn new(config: DeviceConfig) -> Result<Self, TableError> {
        Ok(Self {
            instances: Instances::new(&config)?,
            config,
            connection: None,
            node: NodeHealth::default(),
            clock: Clock::default(),
            progress: StartupProgress::default(),
            statistics: Statistics::default(),
            echo: ArrayVec::new(),
        })
    }

    pub fn context(&self, system_time: Option<SystemTime>) -> Context {
        let control = self.connection.as_ref().map_or(NodeControl::empty(), IoConnection::node_control);
        Context {
            connected: self.connection.is_some(),
            remote: control.contains(NodeControl::REMOTE_CONTROL),
            node_fault: self.node.is_faulted(),
            system_time: system_time.map_or(0, |t| t.0),
        }
    }

    /// Whether a restart would take a controller or a drive by surprise: a motion connection is open, or an axis may
    /// still be energized.
    pub fn is_in_use(&self) -> bool {
        self.connection.is_some() || self.instances.slots.iter().any(super::slot::Slot::is_energized)
    }

    pub fn open(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        parameters: OpenParameters,
    ) -> Result<(), OpenRefusal> {
        let refuse = |extended_status| {
            Err(OpenRefusal { general_status: GeneralStatus::CONNECTION_FAILURE.0, extended_status })
        };
        if self.connection.is_some() {
            return refuse(OWNERSHIP_CONFLICT);
        }
        let has_run_idle = parameters.format_revision == FORMAT_REVISION_RUN_IDLE;
        if parameters.format_revision != FORMAT_REVISION
            && !(has_run_idle && self.config.format == Format::Variable)
        {
            return refuse(INVALID_CONNECTION_POINT);
        }
        fixed::check_format(self.config.format, &parameters)?;
        if parameters.rpi_us == 0 || parameters.timeout_us == 0 {
            return refuse(INTERVAL_NOT_ACCEPTABLE);
        }
        self.connection = Some(IoConnection::new(parameters, self.config.transmission_processing_ns, now));
        self.start_over();
        let system_time = system_time.map_or(0, |t| t.0);
        self.instances.slots.iter_mut().for_each(|slot| slot.axis.open(system_time));
        Ok(())
    }

    pub fn close(&mut self, system_time: Option<SystemTime>, parameters: &CloseParameters) {
        let same = self.connection.as_ref().is_some_and(|c| {
            c.parameters.triad == parameters.triad && c.parameters.o_to_t_id == parameters.o_to_t_id
        });
        if same {
            self.connection = None;
            self.start_over();
            let system_time = system_time.map_or(0, |t| t.0);
            self.instances.slots.iter_mut().for_each(|slot| slot.axis.close(system_time));
        }
    }

    /// Factory defaults and idle channels: a connection begins or ends.
    fn start_over(&mut self) {
        self.node.clear();
        self.progress = StartupProgress::default();
        self.clock.start_over();
        self.statistics.start_over();
        self.echo.clear();
        self.instances.start_over();
    }

    /// Ends a connection whose controller was silent for too long. Returns the report of it.
    fn time_out(&mut self, now: MonotonicTime) -> Option<MotionReply> {
        let connection = self.connection.take_if(|connection| connection.is_timed_out(now))?;
        self.statistics.counters.connection_losses += 1;
        self.node.raise(NodeFault::CONNECTION_LOSS);
        self.progress = StartupProgress { connection_lost: true, ..StartupProgress::default() };
        self.echo.clear();
        self.instances.lose();
        Some(MotionReply::ConnectionLost {
            o_to_t_id: connection.parameters.o_to_t_id,
            silent_us: connection.silence(now) / 1000,
        })
    }

    /// Lets time pass: alarms, time-outs, missed updates, state machines. Returns the report of a lost connection.
    pub fn poll(&mut self, now: MonotonicTime, system_time: Option<SystemTime>) -> Option<MotionReply> {
        self.node.tick(now);
        let lost = self.time_out(now);
        if let Some(connection) = &self.connection {
            let missed = connection.missed(now);
            if missed > self.instances.high_limit() {
                self.node.raise(NodeFault::CONNECTION_UPDATE);
            } else if missed > self.instances.low_limit() {
                self.node.post(NodeAlarm::CONNECTION_UPDATE, now);
            }
            if connection.schedule.mode == Mode::Synchronous {
                self.node.synchronization(self.clock.is_synchronized(), now);
                let variance = u64::from(self.clock.quality().variance);
                if self.instances.sync_threshold().is_some_and(|threshold| variance > threshold) {
                    self.node.jitter(now);
                }
            }
        }
        self.step(system_time);
        lost
    }

    /// One step of the state machines.
    pub fn step(&mut self, system_time: Option<SystemTime>) {
        let context = self.context(system_time);
        for instance in 1..=self.instances.axis_count() {
            let Some((slot, table)) = self.instances.axis(instance) else { continue };
            // They are looked up only where there is something that they say anything about.
            let nothing = slot.axis.drive().conditions.as_slice().is_empty() && !slot.axis.has_found();
            let actions = match nothing {
                true => ExceptionActions::NONE,
                false => ExceptionActions::of(table, &slot.store),
            };
            slot.axis.step(&context, &actions);
        }
    }

    /// Puts the engine's own values into the attributes of an instance, so that a service reads them.
    pub fn publish(&mut self, instance: usize) {
        if instance > 0 {
            let (fixed, context) = (self.config.format == Format::Fixed, self.context(None));
            self.instances.publish_axis(instance, fixed, &context);
            return;
        }
        let header = self.connection.as_ref().and_then(|c| c.header);
        let (lost, late) = self.statistics.diagnostics();
        let quality = self.clock.quality();
        self.instances.publish_class(&[
            (id::NODE_CONTROL, header.map_or(0, |h| u64::from(h.node_control.bits()))),
            (id::NODE_STATUS, u64::from(self.node_status().bits())),
            (id::NODE_FAULT_CODE, u64::from(self.node.fault().0)),
            (id::NODE_ALARM_CODE, u64::from(self.node.alarm().0)),
            (id::CONTROLLER_UPDATE_PERIOD, self.connection.as_ref().map_or(0, IoConnection::period)),
            (id::CONTROLLER_TIME_STAMP, header.and_then(|h| h.time_stamp).unwrap_or(0)),
            (id::SYNC_VARIANCE, u64::from(quality.variance)),
            (id::SYNC_UPDATE_DELAY, u64::from(quality.update_delay().to_bits())),
            (id::TIME_DATA_SET, header.map_or(0, |h| u64::from(h.time_data_set().bits()))),
            (id::LOST_UPDATES, u64::from(lost)),
            (id::LATE_UPDATES, u64::from(late)),
            (
                id::CONNECTION_CONFIGURATION_BITS,
                self.connection.as_ref().map_or(0, |c| u64::from(c.parameters.configuration_bits)),
            ),
            (id::POWER_STRUCTURE_CLASS_ID, u64::from(self.config.power_structure_class_id)),
        ]);
    }
}
