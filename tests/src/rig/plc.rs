//! A programmable controller that moves axes through the assemblies of a device, beside the rig's clock.
//!
//! It speaks to the gateway as a scanner does: Forward_Open and Forward_Close on a stream of its own, data at an interval of virtual
//! time. Values of the assemblies are written and read by the names of their fields.

use std::cell::RefCell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use profile_cip::assembly::handshake::{Control, Status};
use profile_cip::assembly::layout::{CONFIGURATION_POINT, INPUT_ONLY_POINT};
use profile_cip::assembly::{Assemblies, Placed, Refusal};
use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::forward_close::ForwardClose;
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_generic::fault::FaultCause;
use profile_generic::servo::ServoActual;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;

use super::explicit::Client;
use super::ports::Bytes;
use super::{CONTROLLER, Rig, Settings};

/// Connection ID of the first connection to the controller; the next ones count up.
pub const T_TO_O_ID: u32 = 0x5500_0000;

/// The path of the Connection Manager.
const CONNECTION_MANAGER: [u8; 4] = [0x20, 6, 0x24, 1];
const FORWARD_OPEN: u8 = 0x54;
const FORWARD_CLOSE: u8 = 0x4E;

/// Time-out multiplier: a connection ends after four intervals of silence.
const MULTIPLIER: u8 = 0;

/// Connection and data of an input assembly.
pub type Input = (u32, Vec<u8>);

/// A controller with a connection at most.
pub struct Plc {
    /// Everything else.
    pub rig: Rig,
    /// Its explicit messages.
    pub client: Client,
    /// Where its datagrams come from.
    pub address: Ipv4Addr,
    /// Connection ID towards the gateway, and the triad of the connection, while there is one.
    pub open: Option<(u32, ConnectionTriad)>,
    /// Datagrams sent on the connection.
    pub sent: u32,
    /// Connections asked for.
    pub serial: u16,
    /// The next connection asks for the input as multicast.
    pub multicast: bool,
    /// Run, or idle.
    pub run: bool,
    /// The output assembly.
    pub output: Vec<u8>,
    /// Connections of the input assemblies that came, and their data.
    pub inputs: Rc<RefCell<Vec<Input>>>,
    /// Interval of both directions.
    pub interval: DurationNs,
    assemblies: Assemblies,
}

impl Plc {
    /// A gateway with these settings, ready, and a controller that is not connected.
    ///
    /// # Panics
    /// When its first device has no assemblies.
    #[must_use]
    pub fn new(settings: Settings, interval: DurationNs) -> Self {
        Self::on(Rig::ready(settings), interval)
    }

    /// A controller of this gateway.
    ///
    /// # Panics
    /// When its first device has no assemblies.
    #[must_use]
    pub fn on(mut rig: Rig, interval: DurationNs) -> Self {
        let assemblies = rig.config.devices[0].assembly.clone().expect("a device with assemblies");
        assert_eq!(rig.engine.assemblies().len(), 1);
        let inputs = Rc::<RefCell<Vec<_>>>::default();
        let seen = Rc::clone(&inputs);
        rig.tamper_actual = Some(Box::new(move |datagram: &mut Bytes| {
            let datagram = Class1Datagram::parse(datagram.as_slice()).expect("a class 1 datagram");
            seen.borrow_mut().push((datagram.connection_id, datagram.data.to_vec()));
            false
        }));
        let client = Client::connect(&mut rig, CONTROLLER);
        Self {
            rig,
            client,
            address: CONTROLLER,
            open: None,
            sent: 0,
            serial: 0,
            multicast: false,
            run: true,
            output: vec![0; assemblies.output_len()],
            inputs,
            interval,
            assemblies,
        }
    }

    // ---- connection ---------------------------------------------------------------------------------------------

    /// Sends a Forward_Open to these points with these sizes; its status, extended status and data.
    ///
    /// # Panics
    /// When the answer cannot be read.
    pub fn ask_open(&mut self, consumed: u16, sizes: (u16, u16)) -> (u8, u16, Vec<u8>) {
        self.serial += 1;
        let triad = ConnectionTriad {
            connection_serial: self.serial,
            originator_vendor: 7,
            originator_serial: 0x1234_5678,
        };
        let direction = |size| NetworkParameters {
            redundant_owner: false,
            connection_type: ConnectionType::POINT_TO_POINT,
            priority: Priority::SCHEDULED,
            variable: false,
            size,
        };
        let point = |point: u16| [0x2C, point.to_le_bytes()[0]];
        let configuration = [0x24, CONFIGURATION_POINT.to_le_bytes()[0]];
        let path = [[0x20, 4], configuration, point(consumed), point(self.assemblies.input_point())].concat();
        let us = u32::try_from(self.interval.as_nanos() / 1_000).expect("some milliseconds");
        let open = ForwardOpen {
            large: false,
            priority_tick: 5,
            timeout_ticks: 157,
            o_to_t_id: 0,
            t_to_o_id: T_TO_O_ID + u32::from(self.serial),
            triad,
            timeout_multiplier: MULTIPLIER,
            o_to_t_rpi_us: us,
            o_to_t: direction(sizes.0),
            t_to_o_rpi_us: us,
            t_to_o: NetworkParameters {
                connection_type: if self.multicast {
                    ConnectionType::MULTICAST
                } else {
                    ConnectionType::POINT_TO_POINT
                },
                ..direction(sizes.1)
            },
            transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
            path: &path,
        };
        let mut data = vec![0; open.buffer_len()];
        open.emit(&mut data).expect("it fits");
        let answer = self.client.request_extended(&mut self.rig, FORWARD_OPEN, &CONNECTION_MANAGER, &data);
        if answer.0 == 0 {
            let reply = ForwardOpenReply::parse(&answer.2).expect("a reply");
            self.open = Some((reply.o_to_t_id, triad));
            self.sent = 0;
        }
        answer
    }

    /// Points and sizes of an exclusive owner.
    #[must_use]
    pub fn owner(&self) -> (u16, (u16, u16)) {
        (self.assemblies.output_point(), (self.assemblies.o_to_t_size(), self.assemblies.t_to_o_size()))
    }

    /// Points and sizes of an input-only connection.
    #[must_use]
    pub fn reader(&self) -> (u16, (u16, u16)) {
        (INPUT_ONLY_POINT, (2, self.assemblies.t_to_o_size()))
    }

    /// Connects as owner.
    ///
    /// # Panics
    /// When the gateway refuses.
    pub fn connect(&mut self) {
        let (point, sizes) = self.owner();
        let answer = self.ask_open(point, sizes);
        assert_eq!((answer.0, answer.1), (0, 0));
    }

    /// Closes the connection.
    ///
    /// # Panics
    /// When there is none, or the gateway refuses.
    pub fn close(&mut self) {
        let (_, triad) = self.open.take().expect("a connection");
        let close = ForwardClose { priority_tick: 5, timeout_ticks: 157, triad, path: &[] };
        let mut data = vec![0; close.buffer_len()];
        close.emit(&mut data).expect("it fits");
        let answer = self.client.request(&mut self.rig, FORWARD_CLOSE, &CONNECTION_MANAGER, &data);
        assert_eq!(answer.0, 0);
    }

    /// Sends data on the connection, if there is one, with the next numbers.
    pub fn send(&mut self, data: &[u8]) {
        self.sent += 1;
        let [low, high, ..] = self.sent.to_le_bytes();
        self.send_as(self.sent, u16::from_le_bytes([low, high]), data);
    }

    /// Sends data with this encapsulation sequence number and sequence count.
    ///
    /// # Panics
    /// When the data are too long.
    pub fn send_as(&mut self, encapsulation_sequence: u32, sequence_count: u16, data: &[u8]) {
        let Some((connection_id, _)) = self.open else { return };
        let datagram = Class1Datagram { connection_id, encapsulation_sequence, sequence_count, data };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).expect("it fits");
        self.rig.inject_datagram(&bytes, SocketAddrV4::new(self.address, IO_PORT));
    }

    /// The run/idle header and the output assembly.
    #[must_use]
    pub fn data(&self) -> Vec<u8> {
        [&u32::from(self.run).to_le_bytes()[..], &self.output].concat()
    }

    // ---- time -----------------------------------------------------------------------------------------------------

    /// One interval.
    pub fn scan(&mut self) {
        let data = self.data();
        self.send(&data);
        self.rig.run_for(self.interval);
    }

    /// Scans for so many milliseconds.
    pub fn run_for(&mut self, millis: i64) {
        for _ in 0..DurationNs::from_millis(millis).as_nanos() / self.interval.as_nanos() {
            self.scan();
        }
    }

    /// Scans until `done`.
    ///
    /// # Panics
    /// When it takes longer than the limit.
    pub fn until(&mut self, limit_ms: i64, what: &str, done: impl Fn(&Self) -> bool) {
        if !self.reaches(limit_ms, done) {
            let told = self.rig.told();
            panic!("{what} is not reached in {limit_ms} ms: {:02x?}\n{told}", self.input());
        }
    }

    /// Scans until `done`; whether that came within the limit.
    pub fn reaches(&mut self, limit_ms: i64, done: impl Fn(&Self) -> bool) -> bool {
        for _ in 0..DurationNs::from_millis(limit_ms).as_nanos() / self.interval.as_nanos() {
            if done(self) {
                return true;
            }
            self.scan();
        }
        done(self)
    }

    // ---- data -----------------------------------------------------------------------------------------------------

    /// Writes a field of the output assembly; `axis` counts from 0.
    ///
    /// # Panics
    /// When the layout has no such field.
    pub fn set(&mut self, axis: usize, name: &str, value: i64) {
        let field = placed(&self.assemblies.output(), axis, name);
        self.output[field.offset..field.offset + field.len]
            .copy_from_slice(&value.to_le_bytes()[..field.len]);
    }

    /// A field of the last input assembly; `axis` counts from 0.
    ///
    /// # Panics
    /// When the layout has no such field, or nothing has come.
    #[must_use]
    pub fn get(&self, axis: usize, name: &str) -> i64 {
        let field = placed(&self.assemblies.input(), axis, name);
        let input = self.input();
        let bytes = &input[field.offset..field.offset + field.len];
        let signed = matches!(field.kind, "SINT" | "INT" | "DINT" | "LINT");
        let negative = signed && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut octets = [if negative { 0xFF } else { 0 }; 8];
        octets[..bytes.len()].copy_from_slice(bytes);
        i64::from_le_bytes(octets)
    }

    /// Writes the control word of the first axis.
    pub fn word(&mut self, word: Control) {
        self.set(0, "control", i64::from(word.bits()));
    }

    /// The last input assembly.
    ///
    /// # Panics
    /// When none has come.
    #[must_use]
    pub fn input(&self) -> Vec<u8> {
        self.inputs.borrow().last().expect("an input assembly").1.clone()
    }

    /// The status word of the first axis.
    ///
    /// # Panics
    /// When none has come.
    #[must_use]
    pub fn status(&self) -> Status {
        Status::from_bits_retain(u16::try_from(self.get(0, "status")).expect("16 bits"))
    }

    /// Whether the status word of the first axis has all of these bits.
    #[must_use]
    pub fn is(&self, status: Status) -> bool {
        self.status().contains(status)
    }

    /// Why the last order of the first axis was refused.
    ///
    /// # Panics
    /// When nothing has come.
    #[must_use]
    pub fn refusal(&self) -> Refusal {
        Refusal(u8::try_from(self.get(0, "refusal")).expect("8 bits"))
    }

    /// The cause of the fault of the first axis.
    ///
    /// # Panics
    /// When nothing has come.
    #[must_use]
    pub fn fault(&self) -> FaultCause {
        FaultCause(u16::try_from(self.get(0, "fault")).expect("16 bits"))
    }

    // ---- the axis -------------------------------------------------------------------------------------------------

    /// The first drive of the first bus.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn actual(&self) -> &ServoActual {
        let rig = &self.rig;
        if rig.config.sercos.is_some() {
            return rig.drive(0).actual();
        }
        if let Some(wire) = rig.can.first() {
            return wire.bus.nodes().next().expect("a node").application().axes()[0].actual();
        }
        rig.devicenet[0].bus.nodes().next().expect("a drive").actual()
    }

    /// Where it really is, nanounits.
    #[must_use]
    pub fn place(&self) -> i64 {
        self.actual().position.get()
    }

    /// How fast it really is, nanounits per second.
    #[must_use]
    pub fn speed(&self) -> i64 {
        self.actual().velocity.get()
    }

    /// State of the first axis.
    #[must_use]
    pub fn state(&self) -> DriveState {
        self.rig.engine.axes()[0].state()
    }

    /// Enables the first axis: a word of 0, and ENABLE until it is in operation.
    pub fn enable(&mut self) {
        self.word(Control::empty());
        self.run_for(40);
        self.word(Control::ENABLE);
        self.until(2_000, "operation", |plc| plc.is(Status::ENABLED));
    }
}

fn placed(fields: &[Placed], axis: usize, name: &str) -> Placed {
    let found = fields.iter().find(|field| field.axis == axis && field.name == name);
    *found.unwrap_or_else(|| panic!("the layout has no field {name} of axis {axis}"))
}
