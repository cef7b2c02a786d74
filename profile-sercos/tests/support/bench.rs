//! A hand-driven master for a line of slaves: as little as a test needs to take them to CP4 and to use them. The checker
//! judges both.

use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::checker::checked_bus::{CheckedBus, Tried};
use profile_sercos::port::Port;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config, Network, Slave};
use profile_sercos::wire::connection::ConnectionControl;
use profile_sercos::wire::cp0::{AT_LEN, AtRepr, MDT_LEN, MdtRepr, SequenceCounter};
use profile_sercos::wire::cp12;
use profile_sercos::wire::data_status::{CommandState, DataStatus};
use profile_sercos::wire::device_status::DeviceStatus;
use profile_sercos::wire::drive_words::DriveStatus;
use profile_sercos::wire::header::{
    Channel, DATA_LEN_MIN, HEADER_LEN, Header, Kind, Phase, PhaseField, TelegramType,
};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::{AtSvc, Element, MdtSvc, SVC_LEN, SvcControl, SvcStatus};
use profile_sercos::wire::svc_error::SvcError;

/// Cycle in CP3 and CP4.
pub const CYCLE: DurationNs = DurationNs::from_millis(1);
/// Values of the consumed connection: S-0-0134, 0047, 0036, 0080.
const COMMANDS: [u32; 4] = [134, 47, 36, 80];
/// Values of the produced connection: S-0-0135, 0051, 0040, 0084.
const FEEDBACK: [u32; 4] = [135, 51, 40, 84];
/// Bytes of each connection.
const CONNECTION: usize = 14;
/// Where things begin in the data fields.
const SVC: usize = 16;

/// Command values of one slave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Command {
    pub control: u16,
    pub position: i32,
    pub velocity: i32,
    pub torque: i16,
}

/// Feedback of one slave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Feedback {
    pub device: DeviceStatus,
    pub svc: AtSvc,
    pub connection: ConnectionControl,
    pub status: DriveStatus,
    pub position: i32,
    pub velocity: i32,
    pub torque: i16,
}

/// The master and its line.
pub struct Bench {
    pub line: Network<Drive>,
    pub checked: CheckedBus,
    pub now: MonotonicTime,
    pub phase: Phase,
    pub switching: Option<Phase>,
    pub commands: Vec<Command>,
    pub feedback: Vec<Feedback>,
    /// Producers of the master go on.
    pub producing: bool,
    count: u8,
    svc: Vec<MdtSvc>,
    control: ConnectionControl,
}

impl Tried for Bench {
    fn checked(&mut self) -> &mut CheckedBus {
        &mut self.checked
    }
}

impl Bench {
    /// A line of `count` drives in NRT, with this servo.
    pub fn new(count: u16, servo: ServoParameters) -> Self {
        let slave = |address| {
            let config = Config { address, connections: 2, ..Config::default() };
            Slave::new(&config, Drive::new(servo).unwrap())
        };
        let slaves: Vec<_> = (1..=count).map(slave).collect();
        let n = slaves.len();
        Bench {
            line: Network::line(slaves),
            checked: CheckedBus::new(MonotonicTime::ZERO),
            now: MonotonicTime(1_000_000_000),
            phase: Phase::CP0,
            switching: None,
            commands: vec![Command::default(); n],
            feedback: vec![Feedback::default(); n],
            producing: true,
            count: 0,
            svc: vec![MdtSvc::default(); n],
            control: ConnectionControl::READY,
        }
    }

    /// A line of `count` default drives in CP4 with nothing commanded.
    pub fn in_cp4(count: u16) -> Self {
        let mut bench = Bench::new(count, ServoParameters::default());
        bench.up_to_cp2();
        bench.configure();
        bench.up_to_cp4();
        bench
    }

    pub fn drive(&mut self, slave: usize) -> &mut Drive {
        self.line.slaves_mut()[slave].application_mut()
    }

    /// A telegram of this cycle with `len` bytes of zero behind its header.
    pub fn frame(&self, channel: Channel, kind: Kind, number: u8, len: usize) -> Vec<u8> {
        let mut frame = vec![0; HEADER_LEN + len];
        let phase =
            PhaseField::new(self.switching.is_some(), self.count, self.switching.unwrap_or(self.phase));
        let telegram = TelegramType::new(channel, kind, number);
        Header { source: [2; 6], telegram, phase }.emit(&mut frame).unwrap();
        frame
    }

    /// Sends a frame through the line, before the checker, and puts what comes back in its place. Returns whether
    /// something did.
    pub fn send(&mut self, frame: &mut [u8]) -> bool {
        let mut back = None;
        let mut arrived = |port, frame: &mut [u8]| {
            if port == Port::One {
                back = Some(frame.to_vec());
            }
        };
        self.checked.send(self.now, Port::One, frame, &mut self.line, &mut |_, _, _| {}, &mut arrived);
        self.checked.judge();
        back.inspect(|back| frame.copy_from_slice(back)).is_some()
    }

    /// Time goes on to the next cycle.
    fn tick(&mut self) {
        self.now = self.now + CYCLE;
        self.count = (self.count + 1) & 7;
    }

    /// One cycle.
    pub fn cycle(&mut self) {
        if self.phase == Phase::CP0 {
            self.scan();
            return;
        }
        self.tick();
        match self.phase {
            Phase::CP1 | Phase::CP2 => self.slots(),
            _ => self.cyclic(),
        }
    }

    pub fn cycles(&mut self, count: usize) {
        (0..count).for_each(|_| self.cycle());
    }

    /// A cycle of CP0; gives what came back.
    pub fn scan(&mut self) -> AtRepr {
        self.tick();
        let mut mdt = self.frame(Channel::Primary, Kind::Mdt, 0, MDT_LEN);
        MdtRepr::default().emit(&mut mdt[HEADER_LEN..]).unwrap();
        assert!(self.send(&mut mdt));
        let mut at = self.frame(Channel::Primary, Kind::At, 0, AT_LEN);
        AtRepr::empty(SequenceCounter::START_PRIMARY).emit(&mut at[HEADER_LEN..]).unwrap();
        assert!(self.send(&mut at));
        AtRepr::parse(&at[HEADER_LEN..]).unwrap()
    }

    fn slots(&mut self) {
        for number in 0..2 {
            let mut mdt = self.frame(Channel::Primary, Kind::Mdt, number, cp12::LEN);
            for (index, svc) in self.svc.iter().enumerate() {
                let place = cp12::place(u16::try_from(index + 1).unwrap()).unwrap();
                if place.telegram == number {
                    svc.emit(&mut mdt[HEADER_LEN + place.svc..]).unwrap();
                    mdt[HEADER_LEN + place.device + 1] = 1;
                }
            }
            self.send(&mut mdt);
        }
        for number in 0..2 {
            let mut at = self.frame(Channel::Primary, Kind::At, number, cp12::LEN);
            self.send(&mut at);
            for (index, feedback) in self.feedback.iter_mut().enumerate() {
                let place = cp12::place(u16::try_from(index + 1).unwrap()).unwrap();
                if place.telegram == number {
                    let data = &at[HEADER_LEN..];
                    feedback.svc = AtSvc::parse(&data[place.svc..]).unwrap();
                    let word = u16::from_le_bytes([data[place.device], data[place.device + 1]]);
                    feedback.device = DeviceStatus::from_bits_retain(word);
                }
            }
        }
    }

    /// Offsets of service channel, device word and connection of a slave; the same in MDT0 and AT0.
    fn places(&self, slave: usize) -> (usize, usize, usize) {
        let n = self.svc.len();
        let words = SVC + SVC_LEN * n;
        (SVC + SVC_LEN * slave, words + 2 * slave, words + 2 * n + CONNECTION * slave)
    }

    /// Length of the data fields.
    fn len(&self) -> usize {
        (self.places(self.svc.len() - 1).2 + CONNECTION).max(DATA_LEN_MIN)
    }

    /// MDT0 and AT0 of the next cycle of CP3 or CP4, to be sent by the caller.
    pub fn next_telegrams(&mut self) -> (Vec<u8>, Vec<u8>) {
        self.tick();
        self.telegrams()
    }

    fn telegrams(&mut self) -> (Vec<u8>, Vec<u8>) {
        let mut mdt = self.frame(Channel::Primary, Kind::Mdt, 0, self.len());
        if self.phase == Phase::CP4 && self.producing {
            self.control = self.control.produced();
        }
        for slave in 0..self.svc.len() {
            let (svc, device, connection) = self.places(slave);
            let data = &mut mdt[HEADER_LEN..];
            self.svc[slave].emit(&mut data[svc..]).unwrap();
            data[device + 1] = 1;
            let command = &self.commands[slave];
            let mut bytes = self.control.bits().to_le_bytes().to_vec();
            bytes.extend(command.control.to_le_bytes());
            bytes.extend(command.position.to_le_bytes());
            bytes.extend(command.velocity.to_le_bytes());
            bytes.extend(command.torque.to_le_bytes());
            data[connection..connection + CONNECTION].copy_from_slice(&bytes);
        }
        (mdt, self.frame(Channel::Primary, Kind::At, 0, self.len()))
    }

    fn cyclic(&mut self) {
        let (mut mdt, mut at) = self.telegrams();
        self.send(&mut mdt);
        self.send(&mut at);
        self.collect(&at[HEADER_LEN..]);
    }

    /// Reads the AT of CP3 or CP4.
    pub fn collect(&mut self, data: &[u8]) {
        for slave in 0..self.svc.len() {
            let (svc, device, at) = self.places(slave);
            let two = |at: usize| [data[at], data[at + 1]];
            let four = |at: usize| [data[at], data[at + 1], data[at + 2], data[at + 3]];
            self.feedback[slave] = Feedback {
                device: DeviceStatus::from_bits_retain(u16::from_le_bytes(two(device))),
                svc: AtSvc::parse(&data[svc..]).unwrap(),
                connection: ConnectionControl::from_bits_retain(u16::from_le_bytes(two(at))),
                status: DriveStatus::from_bits_retain(u16::from_le_bytes(two(at + 2))),
                position: i32::from_le_bytes(four(at + 4)),
                velocity: i32::from_le_bytes(four(at + 8)),
                torque: i16::from_le_bytes(two(at + 12)),
            };
        }
    }

    /// One step of the service channel; gives INFO or the error.
    pub fn step(
        &mut self,
        slave: usize,
        element: Element,
        write: bool,
        last: bool,
        info: u32,
    ) -> Result<u32, SvcError> {
        let mhs = !self.svc[slave].control.mhs();
        self.svc[slave] = MdtSvc { control: SvcControl::new(mhs, element, write, last), info };
        for _ in 0..10 {
            self.cycle();
            let answer = self.feedback[slave].svc;
            if answer.status.contains(SvcStatus::AHS) == mhs && !answer.status.contains(SvcStatus::BUSY) {
                let error = answer.status.contains(SvcStatus::ERROR);
                return if error { Err(SvcError(answer.info_word())) } else { Ok(answer.info) };
            }
        }
        panic!("no answer from slave {slave}: {:?}", self.feedback[slave].svc);
    }

    pub fn open(&mut self, slave: usize, idn: Idn) -> Result<DataStatus, SvcError> {
        let info = self.step(slave, Element::Idn, true, true, idn.0)?;
        Ok(DataStatus::from_bits_retain(u16::try_from(info & 0xFFFF).unwrap()))
    }

    /// Reads a value of up to four bytes.
    pub fn read(&mut self, slave: usize, idn: Idn) -> Result<u32, SvcError> {
        self.open(slave, idn)?;
        self.step(slave, Element::Data, false, true, 0)
    }

    /// Reads a list without its head.
    pub fn read_list(&mut self, slave: usize, idn: Idn) -> Result<Vec<u8>, SvcError> {
        self.open(slave, idn)?;
        let head = self.step(slave, Element::Data, false, false, 0)?;
        let len = usize::try_from(head & 0xFFFF).unwrap();
        let mut data = Vec::new();
        while data.len() < len {
            let last = data.len() + 4 >= len;
            data.extend(self.step(slave, Element::Data, false, last, 0)?.to_le_bytes());
        }
        data.truncate(len);
        Ok(data)
    }

    /// Writes a value of up to four bytes.
    pub fn write(&mut self, slave: usize, idn: Idn, value: i64) -> Result<u32, SvcError> {
        self.open(slave, idn)?;
        let [a, b, c, d, ..] = value.to_le_bytes();
        self.step(slave, Element::Data, true, true, u32::from_le_bytes([a, b, c, d]))
    }

    pub fn write_list(&mut self, slave: usize, idn: Idn, data: &[u8]) -> Result<u32, SvcError> {
        self.open(slave, idn)?;
        let len = u32::try_from(data.len()).unwrap();
        let mut result = self.step(slave, Element::Data, true, data.is_empty(), len | len << 16);
        for (index, part) in data.chunks(4).enumerate() {
            result?;
            let mut info = [0; 4];
            info[..part.len()].copy_from_slice(part);
            let last = 4 * index + 4 >= data.len();
            result = self.step(slave, Element::Data, true, last, u32::from_le_bytes(info));
        }
        result
    }

    /// Runs a procedure command to its end and cancels it; gives how it ended.
    pub fn command(&mut self, slave: usize, idn: Idn) -> Result<CommandState, SvcError> {
        self.write(slave, idn, 3)?;
        let mut state = CommandState::InProcess;
        for _ in 0..1000 {
            state = self.open(slave, idn)?.command_state();
            if state != CommandState::InProcess {
                break;
            }
        }
        self.write(slave, idn, 0)?;
        Ok(state)
    }

    /// Announces a phase, waits, and begins it.
    pub fn switch(&mut self, phase: Phase) {
        self.switching = Some(phase);
        self.cycles(3);
        self.switching = None;
        if phase != Phase::CP4 {
            self.now = self.now + DurationNs::from_millis(130);
        }
        self.phase = phase;
        self.cycle();
    }

    /// The master starts anew with CP0, after the silence of a master that has just been switched on.
    pub fn restart(&mut self) {
        self.now = self.now + DurationNs::from_millis(130);
        self.phase = Phase::CP0;
    }

    pub fn up_to_cp2(&mut self) {
        self.cycles(2);
        self.svc.fill(MdtSvc::default());
        self.switch(Phase::CP1);
        for svc in &mut self.svc {
            svc.control = SvcControl::new(true, Element::Close, false, false);
        }
        self.cycles(2);
        self.switch(Phase::CP2);
    }

    /// Writes the communication parameters of every slave.
    pub fn configure(&mut self) {
        let len = u16::try_from(self.len()).unwrap();
        let mut lengths = len.to_le_bytes().to_vec();
        lengths.resize(8, 0);
        for slave in 0..self.svc.len() {
            let (svc, device, connection) = self.places(slave);
            let number = |n: usize| i64::try_from(n).unwrap();
            for idn in [Idn::MDT_LENGTHS, Idn::AT_LENGTHS] {
                self.write_list(slave, idn, &lengths).unwrap();
            }
            for (index, idns) in [COMMANDS, FEEDBACK].into_iter().enumerate() {
                let list: Vec<u8> = idns.iter().flat_map(|idn| idn.to_le_bytes()).collect();
                let x = |element| Idn::connection(u8::try_from(index).unwrap(), element);
                self.write_list(slave, x(6), &list).unwrap();
                assert_eq!(self.read(slave, x(5)).map(usize::try_from), Ok(Ok(CONNECTION)));
                self.write(slave, x(1), if index == 0 { 0x8000 } else { 0xC000 }).unwrap();
                let mdt = if index == 0 { 0x0800 } else { 0 };
                self.write(slave, x(3), number(connection) | mdt).unwrap();
                self.write(slave, x(10), CYCLE.0).unwrap();
                self.write(slave, x(11), 2).unwrap();
            }
            for (idn, value) in [
                (Idn::CYCLE_TIME, CYCLE.0),
                (Idn::CONTROL_OFFSET, number(device)),
                (Idn::STATUS_OFFSET, number(device)),
                (Idn::SVC_MDT_OFFSET, number(svc)),
                (Idn::SVC_AT_OFFSET, number(svc)),
                (Idn::MST_LOSSES, 4),
            ] {
                self.write(slave, idn, value).unwrap();
            }
        }
    }

    pub fn up_to_cp4(&mut self) {
        for slave in 0..self.svc.len() {
            assert_eq!(self.command(slave, Idn::CP3_CHECK), Ok(CommandState::Done));
        }
        self.switch(Phase::CP3);
        for slave in 0..self.svc.len() {
            assert_eq!(self.command(slave, Idn::CP4_CHECK), Ok(CommandState::Done));
        }
        self.switch(Phase::CP4);
        self.cycles(2);
    }
}
