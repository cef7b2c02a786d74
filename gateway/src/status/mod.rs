//! The state of the box as its servers show it: one fixed-size value, published by the cycle thread.

mod bus;
mod image;
pub mod lateness;
mod node;
pub mod pulse;
mod wait;

use std::net::Ipv4Addr;

use profile_cip::device::identity::ModuleState;
use profile_cip::device::visualization::Indication;
use profile_cip::device::visualization::display::{LINE_MAX, Line, LineText};
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::open_code;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;

pub use self::bus::{BUSES_MAX, BusDetail, BusStatus, PortLosses};
pub use self::image::ImageStatus;
pub use self::lateness::Lateness;
pub use self::node::NodeStatus;
pub use self::wait::AxisWait;

use self::bus::BUS_WORDS;
use self::image::IMAGE_WORDS;
use self::lateness::LATENESS_WORDS;
use self::wait::WAIT_WORDS;
use crate::config::AXES_MAX;
use crate::engine::axis::{Owner, Totals};
use crate::engine::phase_lock::{LockState, Phase};
use crate::latest::Words;

/// Owners of an axis by their number in the published form.
const OWNERS: [Owner; 3] = [Owner::Nobody, Owner::Controller, Owner::Local];

/// Words of one axis in the published form.
const AXIS_WORDS: usize = 16 + WAIT_WORDS + IMAGE_WORDS;

/// Words of the box itself.
const BOX_WORDS: usize = 10 + LATENESS_WORDS;

const WORDS: usize = BOX_WORDS + BUSES_MAX * BUS_WORDS + AXES_MAX * AXIS_WORDS;

open_code! {
    /// State of the whole gateway.
    pub struct BoxState(u8) {
        /// The gateway reads its configuration and opens sockets.
        STARTING = 0 => "starting",
        /// At least one bus is not in cyclic operation yet.
        PHASE_UP = 1 => "phase_up",
        /// All buses are in cyclic operation; no controller is connected.
        READY = 2 => "ready",
        /// All buses are in cyclic operation, and a controller is connected.
        RUNNING = 3 => "running",
        /// A bus that was in cyclic operation has failed and is brought up again.
        BUS_LOST = 4 => "bus_lost",
        /// The gateway ends.
        STOPPING = 5 => "stopping",
    }
}

/// SERCOS phase value when there is none: no bus is running.
pub const PHASE_NONE: u8 = 0xFF;

/// Counters since the gateway started; they are never reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Bus cycles, of all buses together.
    pub cycles: u64,
    /// Calls of the engine that were late by more than half of the shortest cycle.
    pub late_cycles: u64,
    /// Updates from controllers that were lost or late.
    pub lost_updates: u64,
    /// Cyclic telegrams of drives that were not received in time.
    pub lost_telegrams: u64,
    /// Frames and datagrams that were malformed or from a stranger.
    pub refused_frames: u64,
    /// Frames and datagrams that could not be sent.
    pub send_failures: u64,
}

/// The state of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisStatus {
    /// Instance number in its device; 0 where there is no such axis.
    pub instance: u8,
    /// Number of its device in the configuration, from 0.
    pub device: u8,
    /// Generic drive state.
    pub state: DriveState,
    /// Who controls it.
    pub owner: Owner,
    /// Motion Device Axis Object, attribute Axis State.
    pub cip_axis_state: u8,
    /// Operating mode that the drive shows.
    pub mode: OperatingMode,
    /// Status bits of the drive.
    pub status: StatusBits,
    /// Reasons why the axis cannot be enabled: also [`Inhibits::NO_POWER`] and [`Inhibits::NO_DRIVE`] while it waits for either.
    pub inhibits: Inhibits,
    /// What the axis waits for, when it has waited for longer than a second.
    pub wait: Option<AxisWait>,
    /// The fault present, if any.
    pub fault: Option<FaultCause>,
    /// The drive's own code for the fault; 0 if it reported none.
    pub fault_vendor_code: u32,
    /// Actual position, 1e-9 revolution or mm.
    pub position: Position,
    /// Actual position in counts of the controller; wraps at 32 bits.
    pub position_counts: i32,
    /// Actual velocity, 1e-9 revolution/s or mm/s.
    pub velocity: Velocity,
    /// Actual torque, 1e-6 of the rated torque.
    pub torque: Torque,
    /// Commanded less actual position, 1e-9 revolution or mm.
    pub following_error: Position,
    /// Set-points and targets taken from the north side.
    pub commands: u64,
    /// Updates of the controller that were lost or late.
    pub lost_updates: u32,
    /// Bus cycles without fresh data from the drive.
    pub lost_telegrams: u32,
    /// Values that were clamped in a conversion.
    pub saturated: u32,
    /// Faults raised since the start.
    pub faults: u32,
    /// What the axis has done in its life.
    pub totals: Totals,
    /// What the indicators show for the axis and its device.
    pub indicators: Indicators,
    /// The controller that is connected to its device.
    pub controller: Option<Controller>,
    /// What the master of its bus knows of its node.
    pub node: NodeStatus,
    /// Set-points and further actual values.
    pub image: ImageStatus,
}

/// A controller with an open CIP Motion connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Controller {
    /// The address that its updates come from; never 0.0.0.0.
    pub address: Ipv4Addr,
    /// Controller Update Period, microseconds.
    pub update_period_us: u32,
}

impl Controller {
    fn to_word(controller: Option<Self>) -> u64 {
        controller.map_or(0, |controller| pair(controller.address.to_bits(), controller.update_period_us))
    }

    fn from_word(word: u64) -> Option<Self> {
        let (address, update_period_us) = split(word);
        (address != 0).then_some(Self { address: Ipv4Addr::from_bits(address), update_period_us })
    }
}

/// What the indicators of CIP Motion devices show (Volume 9 clause 9-1.1) for one axis and its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Indicators {
    /// State of the device, which its Module Status LED shows and its Identity object has.
    pub module: ModuleState,
    /// Network Status LED of the device.
    pub network: Indication,
    /// Axis Status LED.
    pub axis: Indication,
    /// Line of the alphanumeric display.
    pub line: Line,
    /// The device has other axes, and lines of the axis begin with its instance number.
    pub several: bool,
    /// A minor fault of the axis is latched.
    pub minor_fault: bool,
}

impl Indicators {
    /// Of no axis.
    pub const NONE: Self = Self {
        module: ModuleState::Standby,
        network: Indication::OFF,
        axis: Indication::OFF,
        line: Line { text: LineText::NONE, code: 0 },
        several: false,
        minor_fault: false,
    };

    fn to_word(self) -> u64 {
        u64::from_be_bytes([
            self.module.code(),
            self.network.0,
            self.axis.0,
            self.line.text.0,
            self.line.code,
            u8::from(self.several),
            u8::from(self.minor_fault),
            0,
        ])
    }

    fn from_word(word: u64) -> Self {
        let [module, network, axis, text, code, several, minor_fault, _] = word.to_be_bytes();
        Self {
            module: ModuleState::from_code(module).unwrap_or(ModuleState::Standby),
            network: Indication(network),
            axis: Indication(axis),
            line: Line { text: LineText(text), code },
            several: several != 0,
            minor_fault: minor_fault != 0,
        }
    }
}

impl AxisStatus {
    /// The line of the display as a person reads it.
    #[must_use]
    pub fn display(&self) -> arrayvec::ArrayString<LINE_MAX> {
        self.indicators.line.characters(self.indicators.several.then_some(self.instance))
    }

    /// No axis.
    pub const NONE: Self = Self {
        instance: 0,
        device: 0,
        state: DriveState::NotReady,
        owner: Owner::Nobody,
        cip_axis_state: 0,
        mode: OperatingMode::None,
        status: StatusBits::empty(),
        inhibits: Inhibits::empty(),
        wait: None,
        fault: None,
        fault_vendor_code: 0,
        position: Position(0),
        position_counts: 0,
        velocity: Velocity(0),
        torque: Torque(0),
        following_error: Position(0),
        commands: 0,
        lost_updates: 0,
        lost_telegrams: 0,
        saturated: 0,
        faults: 0,
        totals: Totals { run_time: DurationNs(0), motor_turns: 0, motor_work: 0 },
        indicators: Indicators::NONE,
        controller: None,
        node: NodeStatus::Unknown,
        image: ImageStatus::NONE,
    };
}

/// The status that the gateway publishes: at each change, and every 10 ms otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoxStatus {
    /// State of the whole gateway.
    pub state: BoxState,
    /// SERCOS communication phase 0 to 4, or [`PHASE_NONE`].
    pub phase: u8,
    /// Open CIP Motion connections, and owners of assemblies.
    pub connections: u8,
    /// Buses; the rest of `buses` is [`BusStatus::NONE`].
    pub bus_count: u8,
    /// Axes configured; the rest of `axes` is [`AxisStatus::NONE`].
    pub axis_count: u8,
    /// Shortest cycle of all buses, ns.
    pub cycle_time_ns: u32,
    /// Largest lateness of a call of the engine since the start, ns.
    pub lateness_max_ns: u32,
    /// How late the calls of the engine were.
    pub lateness: Lateness,
    /// Time since the first cycle.
    pub uptime: DurationNs,
    /// How the buses follow system time: the least state of all, and the largest phase error.
    pub phase_lock: Phase,
    /// Counters since the start.
    pub counters: Counters,
    /// The buses: the SERCOS bus, the CANopen buses, the DeviceNet networks.
    pub buses: [BusStatus; BUSES_MAX],
    /// The axes in the order of the configuration.
    pub axes: [AxisStatus; AXES_MAX],
}

impl BoxStatus {
    /// A box that has just been started.
    pub const STARTING: Self = Self {
        state: BoxState::STARTING,
        phase: PHASE_NONE,
        connections: 0,
        bus_count: 0,
        axis_count: 0,
        cycle_time_ns: 0,
        lateness_max_ns: 0,
        lateness: Lateness::NONE,
        uptime: DurationNs(0),
        phase_lock: Phase { state: LockState::Free, error: DurationNs(0) },
        counters: Counters {
            cycles: 0,
            late_cycles: 0,
            lost_updates: 0,
            lost_telegrams: 0,
            refused_frames: 0,
            send_failures: 0,
        },
        buses: [BusStatus::NONE; BUSES_MAX],
        axes: [AxisStatus::NONE; AXES_MAX],
    };

    /// The buses of the configuration, without the unused rest of the array.
    #[must_use]
    pub fn configured_buses(&self) -> &[BusStatus] {
        self.buses.get(..usize::from(self.bus_count)).unwrap_or(&self.buses)
    }

    /// The axes of the configuration, without the unused rest of the array.
    #[must_use]
    pub fn configured_axes(&self) -> &[AxisStatus] {
        self.axes.get(..usize::from(self.axis_count)).unwrap_or(&self.axes)
    }
}

/// Codes of [`DriveState`] for programs outside; never changed, only added to.
#[must_use]
pub const fn state_code(state: DriveState) -> u8 {
    match state {
        DriveState::NotReady => 0,
        DriveState::Inhibited => 1,
        DriveState::AwaitingPower => 2,
        DriveState::Ready => 3,
        DriveState::Starting => 4,
        DriveState::Operating => 5,
        DriveState::Testing => 6,
        DriveState::Stopping => 7,
        DriveState::FaultReaction => 8,
        DriveState::Faulted => 9,
        DriveState::Shutdown => 10,
    }
}

/// Codes of [`OperatingMode`] for programs outside: those of the CIP Motion control mode, homing after them.
#[must_use]
pub const fn mode_code(mode: OperatingMode) -> u8 {
    match mode {
        OperatingMode::None => 0,
        OperatingMode::Position => 1,
        OperatingMode::Velocity => 2,
        OperatingMode::Acceleration => 3,
        OperatingMode::Torque => 4,
        OperatingMode::Homing => 5,
    }
}

/// Two halves in one word, the first one high.
const fn pair(high: u32, low: u32) -> u64 {
    (high as u64) << 32 | low as u64
}

const fn split(word: u64) -> (u32, u32) {
    let [a, b, c, d, e, f, g, h] = word.to_be_bytes();
    (u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]))
}

impl AxisStatus {
    fn to_words(self) -> [u64; AXIS_WORDS] {
        let [cause_high, cause_low] = self.fault.map_or(0, |cause| cause.0).to_be_bytes();
        let head = [
            self.instance,
            self.device,
            state_code(self.state),
            self.cip_axis_state,
            mode_code(self.mode),
            u8::from(self.fault.is_some()) | ((self.owner as u8) << 1),
            cause_high,
            cause_low,
        ];
        let front = [
            u64::from_be_bytes(head),
            pair(self.status.bits(), self.inhibits.bits()),
            pair(self.fault_vendor_code, self.position_counts.cast_unsigned()),
            self.position.0.cast_unsigned(),
            self.velocity.0.cast_unsigned(),
            self.torque.0.cast_unsigned(),
            self.following_error.0.cast_unsigned(),
            self.commands,
            pair(self.lost_updates, self.lost_telegrams),
            pair(self.saturated, self.faults),
            self.totals.run_time.0.cast_unsigned(),
            self.totals.motor_turns.cast_unsigned(),
            self.totals.motor_work.cast_unsigned(),
            self.indicators.to_word(),
            Controller::to_word(self.controller),
            self.node.to_word(),
        ];
        let mut words = [0; AXIS_WORDS];
        let (own, rest) = words.split_at_mut(front.len());
        let (wait, image) = rest.split_at_mut(WAIT_WORDS);
        own.copy_from_slice(&front);
        wait.copy_from_slice(&AxisWait::to_words(self.wait));
        image.copy_from_slice(&self.image.to_words());
        words
    }

    fn from_words(words: &[u64; AXIS_WORDS]) -> Self {
        let [
            head,
            bits,
            codes,
            position,
            velocity,
            torque,
            error,
            commands,
            lost,
            other,
            run_time,
            motor_turns,
            motor_work,
            indicators,
            controller,
            node,
            wait_0,
            wait_1,
            wait_2,
            image @ ..,
        ] = *words;
        let [instance, device, state, cip_axis_state, mode, flags, cause_high, cause_low] =
            head.to_be_bytes();
        let (status, inhibits) = split(bits);
        let (fault_vendor_code, counts) = split(codes);
        let (lost_updates, lost_telegrams) = split(lost);
        let (saturated, faults) = split(other);
        let state = DriveState::ALL.iter().copied().find(|known| state_code(*known) == state);
        let mode = OperatingMode::ALL.iter().copied().find(|known| mode_code(*known) == mode);
        Self {
            instance,
            device,
            state: state.unwrap_or_default(),
            owner: OWNERS[usize::from(flags >> 1) % OWNERS.len()],
            cip_axis_state,
            mode: mode.unwrap_or_default(),
            status: StatusBits::from_bits_retain(status),
            inhibits: Inhibits::from_bits_retain(inhibits),
            wait: AxisWait::from_words(&[wait_0, wait_1, wait_2]),
            fault: (flags & 1 != 0).then(|| FaultCause(u16::from_be_bytes([cause_high, cause_low]))),
            fault_vendor_code,
            position: Position(position.cast_signed()),
            position_counts: counts.cast_signed(),
            velocity: Velocity(velocity.cast_signed()),
            torque: Torque(torque.cast_signed()),
            following_error: Position(error.cast_signed()),
            commands,
            lost_updates,
            lost_telegrams,
            saturated,
            faults,
            totals: Totals {
                run_time: DurationNs(run_time.cast_signed()),
                motor_turns: motor_turns.cast_signed(),
                motor_work: motor_work.cast_signed(),
            },
            indicators: Indicators::from_word(indicators),
            controller: Controller::from_word(controller),
            node: NodeStatus::from_word(node),
            image: ImageStatus::from_words(&image),
        }
    }
}

impl Words for BoxStatus {
    type Array = [u64; WORDS];
    const EMPTY: Self::Array = [0; WORDS];

    fn to_words(&self, words: &mut Self::Array) -> usize {
        let counters = &self.counters;
        let head = [
            self.state.0,
            self.phase,
            self.connections,
            self.axis_count,
            self.phase_lock.state.code(),
            self.bus_count,
            0,
            0,
        ];
        let of_box = [
            u64::from_be_bytes(head),
            pair(self.cycle_time_ns, self.lateness_max_ns),
            self.uptime.0.cast_unsigned(),
            counters.cycles,
            counters.late_cycles,
            counters.lost_updates,
            counters.lost_telegrams,
            counters.refused_frames,
            counters.send_failures,
            self.phase_lock.error.0.cast_unsigned(),
        ];
        let (front, rest) = words.split_at_mut(BOX_WORDS);
        let (own, lateness) = front.split_at_mut(of_box.len());
        own.copy_from_slice(&of_box);
        lateness.copy_from_slice(&self.lateness.to_words());
        let buses = self.configured_buses();
        let (middle, rest) = rest.split_at_mut(buses.len() * BUS_WORDS);
        for (place, bus) in middle.as_chunks_mut::<BUS_WORDS>().0.iter_mut().zip(buses) {
            *place = bus.to_words();
        }
        let axes = self.configured_axes();
        for (place, axis) in rest.as_chunks_mut::<AXIS_WORDS>().0.iter_mut().zip(axes) {
            *place = axis.to_words();
        }
        BOX_WORDS + buses.len() * BUS_WORDS + axes.len() * AXIS_WORDS
    }

    fn from_words(words: &Self::Array) -> Self {
        let (front, rest) = words.split_at(BOX_WORDS);
        let lateness = front.last_chunk().map_or(Lateness::NONE, Lateness::from_words);
        let [state, phase, connections, axis_count, lock, bus_count, ..] = front[0].to_be_bytes();
        let (cycle_time_ns, lateness_max_ns) = split(front[1]);
        let mut buses = [BusStatus::NONE; BUSES_MAX];
        let (middle, rest) = rest.split_at(usize::from(bus_count).min(BUSES_MAX) * BUS_WORDS);
        for (bus, place) in buses.iter_mut().zip(middle.as_chunks::<BUS_WORDS>().0) {
            *bus = BusStatus::from_words(place);
        }
        let mut axes = [AxisStatus::NONE; AXES_MAX];
        let configured = rest.as_chunks::<AXIS_WORDS>().0.iter().take(usize::from(axis_count));
        for (axis, place) in axes.iter_mut().zip(configured) {
            *axis = AxisStatus::from_words(place);
        }
        Self {
            state: BoxState(state),
            phase,
            connections,
            bus_count,
            axis_count,
            cycle_time_ns,
            lateness_max_ns,
            lateness,
            uptime: DurationNs(front[2].cast_signed()),
            phase_lock: Phase {
                state: LockState::ALL.get(usize::from(lock)).copied().unwrap_or_default(),
                error: DurationNs(front[9].cast_signed()),
            },
            counters: Counters {
                cycles: front[3],
                late_cycles: front[4],
                lost_updates: front[5],
                lost_telegrams: front[6],
                refused_frames: front[7],
                send_failures: front[8],
            },
            buses,
            axes,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use profile_cia402::master::boot::BootState;
    use profile_cia402::wire::emcy::ErrorRegister;
    use profile_cia402::wire::nmt::NmtState;
    use profile_generic::image::{CommandSet, FeedbackSet};
    use profile_generic::program::BitPattern;
    use profile_generic::quantity::{Current, Temperature, Voltage};
    use profile_sercos::master::station::Presence;
    use profile_sercos::master::topology::Topology;
    use profile_sercos::wire::device_status::DeviceStatus;

    use super::*;
    use crate::engine::axis::{Awaited, Waiting};
    use crate::latest::latest;
    use crate::mapping::Item;

    /// A status in which no two values are the same.
    pub(crate) fn distinct() -> BoxStatus {
        let mut status = BoxStatus {
            state: BoxState::RUNNING,
            phase: 4,
            connections: 2,
            bus_count: 2,
            axis_count: 2,
            cycle_time_ns: 2_000_000,
            lateness_max_ns: 123_456,
            lateness: Lateness {
                counts: [101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112],
                sum_ns: 987_654_321,
            },
            uptime: DurationNs(987_654_321_012),
            phase_lock: Phase { state: LockState::Locked, error: DurationNs(-789) },
            counters: Counters {
                cycles: 0x0102_0304_0506_0708,
                late_cycles: 11,
                lost_updates: 12,
                lost_telegrams: 13,
                refused_frames: 14,
                send_failures: 15,
            },
            ..BoxStatus::STARTING
        };
        status.buses[0] = BusStatus {
            up: true,
            phase: 4,
            cycle_time_ns: 2_000_001,
            cycles: 0x0102_0304_0506_0000,
            lost_telegrams: 21,
            refused_frames: 22,
            phase_lock: Phase { state: LockState::Locked, error: DurationNs(-789) },
            detail: BusDetail::Sercos {
                topology: Topology::BrokenRing,
                lost: [PortLosses { mdt: 25, at: 26 }, PortLosses { mdt: 27, at: 28 }],
            },
        };
        status.buses[1] = BusStatus {
            up: false,
            phase: PHASE_NONE,
            cycle_time_ns: 4_000_000,
            cycles: 0x0708,
            lost_telegrams: 23,
            refused_frames: 24,
            phase_lock: Phase { state: LockState::Pulling, error: DurationNs(456) },
            detail: BusDetail::Can { nominal: 1_234_567, data: 89 },
        };
        status.axes[0] = AxisStatus {
            instance: 1,
            device: 0,
            state: DriveState::Operating,
            owner: Owner::Local,
            cip_axis_state: 4,
            mode: OperatingMode::Position,
            status: StatusBits::READY | StatusBits::TRACKING,
            inhibits: Inhibits::empty(),
            wait: None,
            fault: None,
            fault_vendor_code: 0,
            position: Position(-1_234_567_890_123),
            position_counts: -1_234_567,
            velocity: Velocity(-2_500_000_000),
            torque: Torque(-333_333),
            following_error: Position(77),
            commands: 0x1111_2222_3333_4444,
            lost_updates: 0x5555_6666,
            lost_telegrams: 0x7777_8888,
            saturated: 0x0999_0AAA,
            faults: 0x0BBB_0CCC,
            totals: Totals {
                run_time: DurationNs(3_600_000_000_017),
                motor_turns: 12_345_678_901_234,
                motor_work: -55_555,
            },
            indicators: Indicators {
                module: ModuleState::MajorRecoverableFault,
                network: Indication::SOLID_GREEN,
                axis: Indication::RED_GREEN,
                line: Line { text: LineText::RUNNING, code: 0 },
                several: true,
                minor_fault: true,
            },
            controller: Some(Controller { address: Ipv4Addr::new(192, 0, 2, 77), update_period_us: 8_000 }),
            node: NodeStatus::Sercos {
                place: 3,
                presence: Presence::Active,
                status: Some(DeviceStatus::SLAVE_VALID | DeviceStatus::DEVICE_WARNING),
            },
            image: ImageStatus {
                commands: CommandSet::POSITION | CommandSet::VELOCITY | CommandSet::TORQUE,
                actual: FeedbackSet::POSITION
                    | FeedbackSet::VELOCITY
                    | FeedbackSet::TORQUE
                    | FeedbackSet::FOLLOWING_ERROR
                    | FeedbackSet::CURRENT
                    | FeedbackSet::BUS_VOLTAGE
                    | FeedbackSet::TEMPERATURE,
                position_command: Position(-1_234_567_890_046),
                velocity_command: Velocity(-2_500_000_001),
                torque_command: Torque(-333_334),
                current: Current(1_250_000),
                bus_voltage: Voltage(565_000_000),
                temperature: Temperature(41_500),
            },
        };
        status.axes[1] = AxisStatus {
            instance: 200,
            device: 1,
            state: DriveState::Faulted,
            owner: Owner::Controller,
            cip_axis_state: 8,
            mode: OperatingMode::Homing,
            inhibits: Inhibits::SAFETY,
            wait: Some(AxisWait {
                waiting: Waiting {
                    awaited: Awaited::Following,
                    shown: Some((Item::object(0x6041, 0), 0x8_0237, BitPattern::new(0x1040, 0x1000))),
                },
                seconds: 0x0001_0002,
            }),
            fault: Some(FaultCause(0x0905)),
            fault_vendor_code: 0xC30A_0040,
            position_counts: i32::MAX,
            indicators: Indicators {
                module: ModuleState::MajorUnrecoverableFault,
                axis: Indication::SOLID_RED,
                line: Line { text: LineText::INIT_FAULT, code: 12 },
                ..Indicators::NONE
            },
            node: NodeStatus::Can {
                state: BootState::Lost,
                nmt: Some(NmtState::STOPPED),
                emcy: Some((0x8130, ErrorRegister::COMMUNICATION)),
            },
            image: ImageStatus { actual: FeedbackSet::POSITION, ..ImageStatus::NONE },
            ..AxisStatus::NONE
        };
        status
    }

    #[test]
    fn a_status_crosses_the_cell_unchanged() {
        let (mut publisher, reader) = latest(BoxStatus::STARTING);
        assert_eq!(reader.read(), BoxStatus::STARTING);
        publisher.publish(&distinct());
        assert_eq!(reader.read(), distinct());
        assert_eq!(distinct().configured_axes().len(), 2);
    }

    #[test]
    fn the_axes_of_a_full_box_cross_the_cell_and_those_that_are_not_configured_do_not() {
        let (mut publisher, reader) = latest(BoxStatus::STARTING);
        let mut status = distinct();
        let model = status.axes[1];
        for (place, axis) in (0..).zip(&mut status.axes) {
            *axis = AxisStatus { instance: place % 16 + 1, device: place / 16, ..model };
            axis.position.0 = -i64::from(place);
        }
        status.axis_count = 64;
        publisher.publish(&status);
        assert_eq!(reader.read(), status);
        status.bus_count = u8::try_from(BUSES_MAX).unwrap();
        for (place, bus) in (0..).zip(&mut status.buses) {
            *bus = BusStatus { cycles: place, ..BusStatus::NONE };
        }
        publisher.publish(&status);
        assert_eq!(reader.read(), status);
        // Fewer than before: the others are no axes any more.
        (status.axis_count, status.bus_count) = (17, 1);
        publisher.publish(&status);
        let seen = reader.read();
        assert_eq!(seen.buses[1..], [BusStatus::NONE; BUSES_MAX - 1]);
        assert_eq!(seen.configured_axes(), &status.axes[..17]);
        assert_eq!(seen.axes[17..], [AxisStatus::NONE; AXES_MAX - 17]);
    }

    #[test]
    fn every_state_and_mode_has_a_code_of_its_own_and_crosses() {
        for state in DriveState::ALL {
            for mode in OperatingMode::ALL {
                let axis = AxisStatus { state: *state, mode: *mode, ..AxisStatus::NONE };
                assert_eq!(AxisStatus::from_words(&axis.to_words()), axis);
            }
        }
    }
}
