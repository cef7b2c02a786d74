//! The controller of one device of the bench: it opens the connection, and sends an update in every update period, each axis with the
//! block that a frame has brought last.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;

use profile_cip::device::motion_link::{
    CloseParameters, ConnectionTriad, EXPLICIT_DATA_MAX, ExplicitRequest, MotionRequest, ObjectPath,
    OpenParameters, Token,
};
use profile_cip::wire::Writer;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::motion::codes::{
    ActualDataSet, AxisControl, ControlMode, ControlStatus, FeedbackMode, MotionService, NodeControl,
    StatusDataSet, TimeDataSet,
};
use profile_cip::wire::motion::fixed::FixedCommand;
use profile_cip::wire::motion::id_list::IdList;
use profile_cip::wire::motion::{
    CommandBlock, CommandFrame, CommandHeader, CommandInstance, CommandPosition, CommandValues,
    CommandWriter, FORMAT_REVISION, Format, ServiceRequest, WriteBlock,
};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Octets of the largest update.
const UPDATE_MAX: usize = 1400;

/// The controller's address; the bench has no network.
const ORIGINATOR: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 2222);

/// Updates in a row that may be missing before the connection ends.
const TIMEOUT_PERIODS: u64 = 64;

/// Class of the Motion Device Axis Object.
const AXIS_CLASS: u16 = 0x42;

/// What a controller in remote control says in every update.
pub(super) const CONTROLS: NodeControl = NodeControl::REMOTE_CONTROL.union(NodeControl::DATA_VALID);

/// What is asked to be told in every update: whatever a drive tells can be seen then.
const ALL_ACTUAL: ActualDataSet =
    ActualDataSet::POSITION.union(ActualDataSet::VELOCITY).union(ActualDataSet::ACCELERATION);
const ALL_STATUS: StatusDataSet = StatusDataSet::AXIS_STATUS.union(StatusDataSet::IO_STATUS);

/// How far the acknowledged update is from every one that was sent: what is reported again and again stays in sight.
const NEVER_RECEIVED: u8 = 64;

/// What an axis is told.
#[derive(Debug, Clone)]
pub(super) struct Said {
    pub block: CommandBlock,
    /// The update that has its other blocks.
    pub frame: Option<Arc<[u8]>>,
}

/// A service for an axis.
#[derive(Debug, Clone)]
struct Service {
    place: usize,
    transaction: u8,
    service: MotionService,
    body: Vec<u8>,
}

/// The controller of a device.
#[derive(Debug)]
pub(super) struct Controller {
    pub format: Format,
    /// Axes of the device by their numbers in the box, in the order of their instances.
    pub axes: Vec<usize>,
    pub period: DurationNs,
    /// It has a connection.
    pub is_open: bool,
    /// When the next update is due; `None` without a connection, and of one that is silent.
    pub next: Option<MonotonicTime>,
    /// What each axis is told.
    pub said: Vec<Said>,
    /// The update that has blocks of the class.
    pub class: Option<Arc<[u8]>>,
    pub node_control: NodeControl,
    /// An update of a list was taken on this connection.
    pub commands: bool,
    service: Option<Service>,
    /// ID of the list of cyclic write data that each axis has in use.
    pub write_ids: Vec<u8>,
    update_id: u8,
    sequence: u16,
    datagrams: u32,
    transactions: u8,
    opened: u32,
    tokens: u64,
}

/// A block that leaves an axis where it is and says that its configuration is complete.
pub(super) fn at_rest() -> CommandBlock {
    CommandBlock {
        control_mode: ControlMode::POSITION,
        feedback_mode: MOTOR_FEEDBACK,
        control_status: ControlStatus::CONFIGURATION_COMPLETE,
        ..CommandBlock::default()
    }
}

/// The Feedback Mode of every drive here.
pub(super) const MOTOR_FEEDBACK: FeedbackMode = FeedbackMode(2);

impl Controller {
    pub fn new(format: Format, axes: Vec<usize>, period: DurationNs) -> Self {
        let count = axes.len();
        Self {
            format,
            axes,
            period,
            is_open: false,
            next: None,
            said: vec![Said { block: at_rest(), frame: None }; count],
            class: None,
            node_control: CONTROLS,
            commands: false,
            service: None,
            write_ids: vec![0; count],
            update_id: 0,
            sequence: 0,
            datagrams: 0,
            transactions: 0,
            opened: 0,
            tokens: 0,
        }
    }

    /// Opens a connection; the first update goes out at `first`.
    pub fn open(&mut self, first: MonotonicTime) -> MotionRequest {
        self.opened += 1;
        self.is_open = true;
        let count = self.axes.len();
        self.said = vec![Said { block: at_rest(), frame: None }; count];
        (self.class, self.service, self.write_ids) = (None, None, vec![0; count]);
        (self.node_control, self.next, self.commands) = (CONTROLS, Some(first), false);
        let rpi_us = u32::try_from(self.period.as_nanos() / 1000).unwrap_or(u32::MAX);
        MotionRequest::Open(OpenParameters {
            token: self.token(),
            triad: self.triad(),
            o_to_t_id: self.opened,
            t_to_o_id: self.opened,
            originator: *ORIGINATOR.ip(),
            t_to_o_destination: ORIGINATOR,
            rpi_us,
            timeout_us: u64::from(rpi_us) * TIMEOUT_PERIODS,
            o_to_t_size: 1400,
            t_to_o_size: 1400,
            o_to_t_variable: true,
            t_to_o_variable: true,
            t_to_o_dscp: 0,
            format_revision: FORMAT_REVISION,
            configuration_bits: 0,
            assembly: None,
        })
    }

    /// Closes the connection.
    pub fn close(&mut self) -> MotionRequest {
        (self.next, self.is_open) = (None, false);
        MotionRequest::Close(CloseParameters {
            token: self.token(),
            triad: self.triad(),
            o_to_t_id: self.opened,
        })
    }

    fn triad(&self) -> ConnectionTriad {
        ConnectionTriad {
            connection_serial: u16::try_from(self.opened & 0xFFFF).unwrap_or(0),
            originator_vendor: 1,
            originator_serial: 1,
        }
    }

    fn token(&mut self) -> Token {
        self.tokens += 1;
        Token(self.tokens)
    }

    /// An explicit message about an attribute of an axis.
    pub fn explicit(
        &mut self,
        service: u8,
        instance: usize,
        attribute: u16,
        data: &[u8],
    ) -> (Token, MotionRequest) {
        let token = self.token();
        let path = ObjectPath {
            class: AXIS_CLASS,
            instance: u32::try_from(instance).unwrap_or(u32::MAX),
            attribute: Some(attribute),
            ..ObjectPath::default()
        };
        let data = data.iter().copied().take(EXPLICIT_DATA_MAX).collect();
        let request = ExplicitRequest { token, originator: *ORIGINATOR.ip(), service, path, data };
        (token, MotionRequest::Explicit(request))
    }

    /// Asks for a list of cyclic write data; its Transaction ID.
    pub fn ask_writes(&mut self, place: usize, attributes: &[u16]) -> u8 {
        self.transactions = self.transactions.wrapping_add(1);
        let mut body = vec![0; 8 + 2 * attributes.len()];
        let len = IdList::emit(&mut body, attributes).unwrap_or(0);
        body.truncate(len);
        self.service = Some(Service {
            place,
            transaction: self.transactions,
            service: MotionService::SET_CYCLIC_WRITE_LIST,
            body,
        });
        self.transactions
    }

    /// Its answer was seen.
    pub fn end_service(&mut self) {
        self.service = None;
    }

    /// Takes the blocks of an update of the variable format.
    pub fn take(&mut self, bytes: &[u8]) {
        let Ok(frame) = CommandFrame::parse(bytes) else { return };
        self.commands = true;
        let shared: Arc<[u8]> = bytes.into();
        self.node_control = frame.header().node_control - NodeControl::SYNC_CONTROL;
        for instance in frame.instances() {
            match usize::from(instance.number).checked_sub(1) {
                None => self.class = Some(Arc::clone(&shared)),
                Some(place) => {
                    let Some(said) = self.said.get_mut(place) else { continue };
                    said.frame = Some(Arc::clone(&shared));
                    said.block = instance.cyclic.unwrap_or(said.block);
                }
            }
        }
    }

    /// Takes the block of an update of the fixed format, or of an axis alone.
    pub fn tell(&mut self, place: usize, block: CommandBlock) {
        if let Some(said) = self.said.get_mut(place) {
            *said = Said { block, frame: None };
        }
    }

    /// An update with the block of the axis at a place and its cyclic write data.
    pub fn written(&self, place: usize, block: CommandBlock, data: &[u8]) -> Vec<u8> {
        let header = CommandHeader {
            update_id: self.update_id,
            node_control: CONTROLS,
            instance_count: 0,
            last_received_id: 0,
            time_stamp: None,
            time_offset: None,
            diagnostics: TimeDataSet::empty(),
        };
        let mut bytes = vec![0; UPDATE_MAX];
        let Ok(mut writer) = CommandWriter::new(&mut bytes, &header) else { return Vec::new() };
        let instance = CommandInstance {
            number: u8::try_from(place + 1).unwrap_or(u8::MAX),
            cyclic: Some(block),
            // The number of the list is put in its place when the update goes out.
            write: Some(WriteBlock { write_block_id: 1, read_block_id: 0, data }),
            ..CommandInstance::default()
        };
        let _ = writer.instance(&instance);
        let len = writer.finish();
        bytes.truncate(len);
        bytes
    }

    /// The next update as a datagram; the one after it is due a period later.
    pub fn update(&mut self) -> (Vec<u8>, SocketAddrV4) {
        self.next = self.next.map(|next| next + self.period);
        self.update_id = self.update_id.wrapping_add(1);
        self.sequence = self.sequence.wrapping_add(1);
        self.datagrams = self.datagrams.wrapping_add(1);
        let mut bytes = vec![0; CLASS1_HEADER_LEN + UPDATE_MAX];
        let (header, body) = bytes.split_at_mut(CLASS1_HEADER_LEN);
        let len = match self.format {
            Format::Variable => self.variable(body),
            Format::Fixed => self.fixed(body),
        };
        // There is room for it.
        let _ = Class1Datagram::emit_header(self.opened, self.datagrams, self.sequence, len, header);
        bytes.truncate(CLASS1_HEADER_LEN + len);
        (bytes, ORIGINATOR)
    }

    fn variable(&self, buffer: &mut [u8]) -> usize {
        let header = CommandHeader {
            update_id: self.update_id,
            node_control: self.node_control,
            instance_count: 0,
            last_received_id: self.update_id.wrapping_add(NEVER_RECEIVED),
            time_stamp: None,
            time_offset: None,
            diagnostics: TimeDataSet::empty(),
        };
        let Ok(mut writer) = CommandWriter::new(buffer, &header) else { return 0 };
        if let Some(instance) = self.class.as_deref().and_then(|frame| instance_of(frame, 0)) {
            let _ = writer.instance(&instance);
        }
        for (place, said) in self.said.iter().enumerate() {
            let number = u8::try_from(place + 1).unwrap_or(u8::MAX);
            let mut instance =
                said.frame.as_deref().and_then(|frame| instance_of(frame, number)).unwrap_or_default();
            instance.number = number;
            instance.cyclic =
                Some(CommandBlock { actual_data_set: ALL_ACTUAL, status_data_set: ALL_STATUS, ..said.block });
            if let Some(write) = &mut instance.write
                && write.write_block_id != 0
                && self.write_ids[place] != 0
            {
                write.write_block_id = self.write_ids[place];
            }
            if let Some(service) = self.service.as_ref().filter(|service| service.place == place) {
                instance.service = Some(ServiceRequest {
                    transaction_id: service.transaction,
                    service: service.service,
                    data: &service.body,
                });
            }
            let _ = writer.instance(&instance);
        }
        writer.finish()
    }

    fn fixed(&self, buffer: &mut [u8]) -> usize {
        let Some(Said { block, .. }) = self.said.first() else { return 0 };
        let position = match block.values.position {
            Some(CommandPosition::Float(_)) => None,
            position => position,
        };
        let command = FixedCommand {
            update_id: self.update_id,
            node_control: self.node_control,
            control_mode: block.control_mode,
            feedback_mode: block.feedback_mode,
            axis_control: block.axis_control,
            actual_data_set: ActualDataSet::POSITION,
            status_data_set: StatusDataSet::empty(),
            values: CommandValues { position, ..block.values },
        };
        let mut writer = Writer::new(buffer);
        let _ = command.emit(&mut writer);
        writer.written()
    }

    /// Asks the drive of an axis for something.
    pub fn ask(&mut self, place: usize, control: AxisControl) {
        if let Some(said) = self.said.get_mut(place) {
            said.block.axis_control = control;
        }
    }
}

/// The instance of an update with this number.
fn instance_of(frame: &[u8], number: u8) -> Option<CommandInstance<'_>> {
    CommandFrame::parse(frame).ok()?.instances().find(|instance| instance.number == number)
}
