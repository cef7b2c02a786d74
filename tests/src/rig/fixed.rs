//! A controller that speaks the fixed connection format, as simple as such controllers are: one update a period, services
//! as explicit messages.

use std::cell::RefCell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use profile_cip::wire::motion::CommandValues;
use profile_cip::wire::motion::codes::{
    ActualDataSet, AxisControl, AxisStateCode, ControlMode, FeedbackMode, FeedbackSource, NodeControl,
    StatusDataSet,
};
use profile_cip::wire::motion::fixed::{FixedActual, FixedCommand, LEN};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_cip::wire::{ConnectionTriad, Writer};
use profile_generic::scaling::UnitKind;
use profile_generic::time::DurationNs;

use super::explicit::Client;
use super::{Rig, Settings};

/// Where it sits.
const ADDRESS: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 7);
const PERIOD_US: u32 = 2000;
/// Update period.
pub const PERIOD: DurationNs = DurationNs::from_micros(2000);
const SET_ATTRIBUTE_SINGLE: u8 = 0x10;
const CONTROL_STATUS: u16 = 89;
const COMMAND_CONTROL: u16 = 92;
/// The class, configuration point, data point and configuration block (clause 7-1.1).
const PATH: [u8; 16] = [0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0];
const CONNECTION_MANAGER: [u8; 4] = [0x20, 6, 0x24, 1];
const FORWARD_OPEN: u8 = 0x54;

/// Command Control: DINT with Immediate.
pub const IMMEDIATE: u8 = 0b0100;
/// Command Control: DINT with Interpolate.
pub const INTERPOLATE: u8 = 0b0110;

/// A box with one axis and one rotary drive.
#[must_use]
pub fn settings() -> Settings {
    Settings {
        configuration: include_str!("fixed.toml").to_owned(),
        drives: vec![(1, UnitKind::Rotary)],
        ..Settings::default()
    }
}

/// The controller.
pub struct FixedController {
    /// For services.
    pub client: Client,
    /// What the next update says.
    pub command: FixedCommand,
    connection_id: u32,
    sequence: u16,
    seen: Rc<RefCell<Option<FixedActual>>>,
}

fn parameters(size: u16) -> NetworkParameters {
    NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: false,
        size,
    }
}

impl FixedController {
    /// Asks for a connection of this size each way; the general status if it is refused.
    ///
    /// # Errors
    /// The general status of the refusal.
    ///
    /// # Panics
    /// When there is no answer that can be read.
    pub fn open(rig: &mut Rig, size: u16) -> Result<Self, u8> {
        let client = Client::connect(rig, ADDRESS);
        let open = ForwardOpen {
            large: false,
            priority_tick: 5,
            timeout_ticks: 157,
            o_to_t_id: 0,
            t_to_o_id: 0x5500_0001,
            triad: ConnectionTriad { connection_serial: 1, originator_vendor: 1, originator_serial: 7 },
            // 64 periods.
            timeout_multiplier: 4,
            o_to_t_rpi_us: PERIOD_US,
            o_to_t: parameters(size),
            t_to_o_rpi_us: PERIOD_US,
            t_to_o: parameters(size),
            transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
            path: &PATH,
        };
        let mut data = vec![0; open.buffer_len()];
        open.emit(&mut data).expect("it fits");
        let (status, data) = client.request(rig, FORWARD_OPEN, &CONNECTION_MANAGER, &data);
        if status != 0 {
            return Err(status);
        }
        let connection_id = ForwardOpenReply::parse(&data).expect("a reply").o_to_t_id;
        let seen = Rc::new(RefCell::new(None));
        let into = Rc::clone(&seen);
        rig.tamper_actual = Some(Box::new(move |bytes| {
            let datagram = Class1Datagram::parse(bytes.as_slice()).expect("a datagram");
            *into.borrow_mut() = Some(FixedActual::parse(datagram.data).expect("a fixed update"));
            false
        }));
        Ok(Self {
            client,
            command: FixedCommand {
                update_id: 0,
                node_control: NodeControl::REMOTE_CONTROL,
                control_mode: ControlMode::VELOCITY,
                feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
                axis_control: AxisControl::NONE,
                actual_data_set: ActualDataSet::VELOCITY,
                status_data_set: StatusDataSet::empty(),
                values: CommandValues { velocity: Some(0.0), ..CommandValues::default() },
            },
            connection_id,
            sequence: 0,
            seen,
        })
    }

    /// Sets Command Control and Configuration Complete by services, begins with valid data and waits for Stopped.
    ///
    /// # Panics
    /// When the device refuses, or does not get there.
    pub fn configure(&mut self, rig: &mut Rig, command_control: u8) {
        self.cycle(rig);
        for (attribute, value) in [(COMMAND_CONTROL, command_control), (CONTROL_STATUS, 1)] {
            let answer = self.client.ask(rig, SET_ATTRIBUTE_SINGLE, 1, Some(attribute), &[value]);
            assert_eq!(answer, (0, vec![]), "attribute {attribute}");
        }
        self.command.node_control |= NodeControl::DATA_VALID;
        self.until(rig, "Stopped", |actual| actual.axis_state == AxisStateCode::STOPPED);
    }

    /// One period: an update, and what the box does until the next one is due.
    pub fn cycle(&mut self, rig: &mut Rig) {
        self.send(rig);
        rig.run_for(PERIOD);
    }

    /// Sends the next update.
    ///
    /// # Panics
    /// When the update cannot be written.
    pub fn send(&mut self, rig: &mut Rig) {
        if self.command.node_control.contains(NodeControl::DATA_VALID) {
            self.command.update_id = self.command.update_id.wrapping_add(1);
        }
        let mut data = [0; LEN];
        self.command.emit(&mut Writer::new(&mut data)).expect("16 octets");
        self.send_octets(rig, &data);
    }

    /// Sends these octets as the next update.
    ///
    /// # Panics
    /// When they do not fit a datagram.
    pub fn send_octets(&mut self, rig: &mut Rig, data: &[u8]) {
        self.sequence = self.sequence.wrapping_add(1);
        let datagram = Class1Datagram {
            connection_id: self.connection_id,
            encapsulation_sequence: u32::from(self.sequence),
            sequence_count: self.sequence,
            data,
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).expect("it fits");
        rig.inject_datagram(&bytes, SocketAddrV4::new(ADDRESS, IO_PORT));
    }

    /// What the last update of the device said.
    ///
    /// # Panics
    /// Before the first one.
    #[must_use]
    pub fn actual(&self) -> FixedActual {
        self.seen.borrow().expect("an update of the device")
    }

    /// Goes on until an update of the device says so.
    ///
    /// # Panics
    /// When it does not within five seconds.
    pub fn until(&mut self, rig: &mut Rig, what: &str, done: impl Fn(&FixedActual) -> bool) {
        for _ in 0..2500 {
            self.cycle(rig);
            if done(&self.actual()) {
                return;
            }
        }
        panic!("{what} is not reached: {}\n{}", self.actual(), rig.told());
    }

    /// A whole handshake: the request, its acknowledge, and both taken back.
    ///
    /// # Panics
    /// When the request is refused or not answered.
    pub fn request(&mut self, rig: &mut Rig, control: AxisControl) {
        self.command.axis_control = control;
        self.until(rig, &control.to_string(), |actual| actual.axis_response == control);
        assert_eq!(self.actual().response_status, 0, "{control}");
        self.command.axis_control = AxisControl::NONE;
        self.until(rig, "no request", |actual| actual.axis_response == AxisControl::NONE);
    }
}
