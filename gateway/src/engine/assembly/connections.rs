//! The class 1 connections of a device with assemblies: one owner, and those that only get the input assembly.
//!
//! A datagram counts when it comes from the address of its Forward_Open, carries the connection ID, and comes from the port of
//! the first one that counted. Data of another length than the assembly's do not count: the connection then times out. A
//! repeated sequence count keeps the connection, and its data are no new ones.
//!
//! Of datagrams that come together the newest set-points count. A change of run or of a control word is handed on first, however soon the
//! next one comes: what follows waits in the port for the next call.
//!
//! The input assembly is sent to each originator alone, and once to the multicast group, for all connections that asked for that.
//! The group's stream begins with the first of them and ends with the last.

use std::net::SocketAddrV4;
use std::ops::Range;

use arrayvec::ArrayVec;
use profile_cip::assembly::{Assemblies, Link, RUN, RUN_IDLE_LEN};
use profile_cip::device::connection_manager::LISTENERS_MAX;
use profile_cip::device::motion_link::{AssemblyRole, OpenParameters, OpenRefusal};
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::forward_open::FIRST_MESSAGE_TIMEOUT;
use profile_cip::wire::status::{ConnectionStatus, GeneralStatus};
use profile_generic::interpolation::ArrivalClock;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::Destination;
use crate::engine::admission::{Admission, Refused};
use crate::engine::port::{FRAME_MAX, NorthPort};

/// Datagrams taken in one call.
const DATAGRAMS_PER_CYCLE: usize = 64;

/// What connections have counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Datagrams of nobody's connection, malformed, or with data of a wrong length.
    pub refused: u64,
    /// Datagrams that could not be sent.
    pub send_failures: u64,
    /// Datagrams of the owner that did not come.
    pub lost_updates: u64,
}

/// One connection.
#[derive(Debug, Clone, Copy)]
struct Connection {
    open: OpenParameters,
    heard: MonotonicTime,
    deadline: MonotonicTime,
    /// Port of the first datagram that counted.
    port: Option<u16>,
    /// Encapsulation sequence number and sequence count of the last datagram.
    received: Option<(u32, u16)>,
    /// Where the input assembly goes for this connection alone; `None` when it consumes the multicast stream.
    own: Option<Stream>,
}

/// The input assembly on its way to somebody.
#[derive(Debug, Clone, Copy)]
struct Stream {
    id: u32,
    to: Destination,
    interval: DurationNs,
    next: MonotonicTime,
    sent: u32,
}

impl Stream {
    fn new(now: MonotonicTime, open: &OpenParameters) -> Self {
        let us = open.assembly.map_or(open.rpi_us, |assembly| assembly.t_to_o_rpi_us);
        Self {
            id: open.t_to_o_id,
            to: open.t_to_o_destination,
            interval: DurationNs::from_micros(i64::from(us.max(1))),
            next: now,
            sent: 0,
        }
    }

    /// Whether both are one stream.
    fn is_that_of(&self, other: &Self) -> bool {
        (self.id, self.to, self.interval) == (other.id, other.to, other.interval)
    }

    /// Sends the input assembly if it is due; whether all went well.
    fn transmit(
        &mut self,
        now: MonotonicTime,
        input: &[u8],
        buffer: &mut [u8],
        port: &mut dyn NorthPort,
    ) -> bool {
        if self.next > now {
            return true;
        }
        let next = self.next + self.interval;
        // What could not be sent in time is left out.
        self.next = if next <= now { now + self.interval } else { next };
        self.sent = self.sent.wrapping_add(1);
        let [low, high, ..] = self.sent.to_le_bytes();
        let datagram = Class1Datagram {
            connection_id: self.id,
            encapsulation_sequence: self.sent,
            sequence_count: u16::from_le_bytes([low, high]),
            data: input,
        };
        datagram.emit(buffer).is_ok_and(|len| port.send(&buffer[..len], self.to))
    }
}

impl Connection {
    fn new(now: MonotonicTime, open: OpenParameters) -> Self {
        Self {
            open,
            heard: now,
            deadline: now + timeout(&open).max(FIRST_MESSAGE_TIMEOUT),
            port: None,
            received: None,
            own: open.group().is_none().then(|| Stream::new(now, &open)),
        }
    }

    fn role(&self) -> AssemblyRole {
        self.open.assembly.map_or(AssemblyRole::ExclusiveOwner, |assembly| assembly.role)
    }

    /// Whether a datagram of this connection counts.
    fn check(&self, from: SocketAddrV4, datagram: &Class1Datagram<'_>) -> Result<(), Refused> {
        if *from.ip() != self.open.originator {
            return Err(Refused::Address { expected: self.open.originator });
        }
        match self.port {
            Some(expected) if from.port() != expected => return Err(Refused::Port { expected }),
            _ => {}
        }
        let behind = |last: u32| datagram.encapsulation_sequence.wrapping_sub(last).cast_signed() <= 0;
        if self.received.is_some_and(|(last, _)| behind(last)) {
            return Err(Refused::Old);
        }
        Ok(())
    }
}

/// What a datagram has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    /// Set-points at most.
    None,
    /// Run, or a control word.
    Order,
}

fn timeout(open: &OpenParameters) -> DurationNs {
    DurationNs::from_micros(i64::try_from(open.timeout_us).unwrap_or(i64::MAX / 1_000))
}

/// The connections of a device.
#[derive(Debug)]
pub(super) struct Connections {
    owner: Option<Connection>,
    listeners: ArrayVec<Connection, LISTENERS_MAX>,
    /// Listen-only connections that have nothing to listen to any more.
    ended: ArrayVec<u32, LISTENERS_MAX>,
    /// The multicast stream, while a connection consumes it.
    group: Option<Stream>,
    /// The last data of the owner in run.
    output: Box<[u8]>,
    /// Where the control words are in them.
    words: Box<[Range<usize>]>,
    link: Link,
    /// When the last data of the owner would have come on an even network, until they are taken.
    fresh: Option<MonotonicTime>,
    arrivals: ArrivalClock,
    admission: Admission,
    counts: Counts,
    buffer: Box<[u8]>,
}

impl Connections {
    pub fn new(assemblies: &Assemblies) -> Self {
        Self {
            owner: None,
            listeners: ArrayVec::new(),
            ended: ArrayVec::new(),
            group: None,
            output: vec![0; assemblies.output_len()].into_boxed_slice(),
            words: assemblies.control_words().collect(),
            link: Link::Lost,
            fresh: None,
            arrivals: ArrivalClock::new(DurationNs::from_millis(1)),
            admission: Admission::default(),
            counts: Counts::default(),
            buffer: vec![0; FRAME_MAX].into_boxed_slice(),
        }
    }

    pub fn owner(&self) -> Option<&OpenParameters> {
        self.owner.as_ref().map(|owner| &owner.open)
    }

    pub fn any(&self) -> bool {
        self.owner.is_some() || !self.listeners.is_empty()
    }

    /// How the owner is.
    pub fn link(&self) -> Link {
        self.link
    }

    /// The data of the owner, while it runs.
    pub fn output(&self) -> Option<&[u8]> {
        (self.link == Link::Run).then_some(&*self.output)
    }

    /// When the last data of the owner would have come on an even network; once for each.
    pub fn take_fresh(&mut self) -> Option<MonotonicTime> {
        self.fresh.take()
    }

    pub fn counts(&self) -> Counts {
        Counts { refused: self.admission.refused(), ..self.counts }
    }

    pub fn strangers(&mut self, now: MonotonicTime) -> Option<(u64, SocketAddrV4, Refused)> {
        self.admission.strangers(now)
    }

    pub fn shortest_interval(&self) -> Option<DurationNs> {
        let owner = self.owner().map(|open| DurationNs::from_micros(i64::from(open.rpi_us)));
        let own = self.owner.iter().chain(&self.listeners).filter_map(|one| one.own);
        own.chain(self.group).map(|stream| stream.interval).chain(owner).min()
    }

    /// Opens a connection.
    pub fn open(&mut self, now: MonotonicTime, open: OpenParameters) -> Result<(), OpenRefusal> {
        let refusal = |status: ConnectionStatus| OpenRefusal {
            general_status: GeneralStatus::CONNECTION_FAILURE.0,
            extended_status: status.0,
        };
        let connection = Connection::new(now, open);
        let stream = Stream::new(now, &open);
        if open.group().is_some() && self.group.is_some_and(|group| !group.is_that_of(&stream)) {
            // The explicit side hands out one stream at a time.
            return Err(refusal(ConnectionStatus::OUT_OF_CONNECTIONS));
        }
        if connection.role() != AssemblyRole::ExclusiveOwner {
            let full = |_| refusal(ConnectionStatus::OUT_OF_CONNECTIONS);
            self.listeners.try_push(connection).map_err(full)?;
            self.join(&open, stream);
            return Ok(());
        }
        if self.owner.is_some() {
            return Err(refusal(ConnectionStatus::OWNERSHIP_CONFLICT));
        }
        self.owner = Some(connection);
        self.join(&open, stream);
        self.link = Link::Idle;
        self.fresh = None;
        self.arrivals = ArrivalClock::new(DurationNs::from_micros(i64::from(open.rpi_us.max(1))));
        Ok(())
    }

    /// Begins the multicast stream for its first connection.
    fn join(&mut self, open: &OpenParameters, stream: Stream) {
        if open.group().is_some() {
            self.group.get_or_insert(stream);
        }
    }

    /// Ends the multicast stream behind its last connection.
    fn leave(&mut self) {
        if self.owner.iter().chain(&self.listeners).all(|one| one.own.is_some()) {
            self.group = None;
        }
    }

    /// Closes the connection with this ID, if there is one.
    pub fn close(&mut self, o_to_t_id: u32) {
        if self.owner.is_some_and(|owner| owner.open.o_to_t_id == o_to_t_id) {
            self.lose_owner();
        }
        self.listeners.retain(|one| one.open.o_to_t_id != o_to_t_id);
        self.leave();
    }

    fn lose_owner(&mut self) {
        (self.owner, self.link, self.fresh) = (None, Link::Lost, None);
    }

    /// Takes out a connection whose time is up: its ID, and the silence in microseconds.
    pub fn poll_lost(&mut self, now: MonotonicTime) -> Option<(u32, u64)> {
        let silence = |one: &Connection| {
            (one.open.o_to_t_id, u64::try_from(now.since(one.heard).as_nanos() / 1_000).unwrap_or(0))
        };
        if let Some(owner) = self.owner.filter(|owner| owner.deadline <= now) {
            self.lose_owner();
            self.leave();
            return Some(silence(&owner));
        }
        let late = self.listeners.iter().position(|one| one.deadline <= now)?;
        let late = self.listeners.swap_remove(late);
        self.leave();
        Some(silence(&late))
    }

    /// Ends listen-only connections that have nothing to listen to any more.
    pub fn end_listen_only(&mut self) {
        let is_listen_only = |one: &Connection| one.role() == AssemblyRole::ListenOnly;
        if self.owner.is_some() || !self.listeners.iter().all(is_listen_only) {
            return;
        }
        let ended = self.listeners.drain(..).map(|one| one.open.o_to_t_id);
        // There is room: what was taken out of the same number of places.
        self.ended.extend(ended);
        self.leave();
    }

    /// The ID of a listen-only connection that was ended.
    pub fn poll_ended(&mut self) -> Option<u32> {
        self.ended.pop()
    }

    /// Takes the datagrams that came.
    pub fn receive(&mut self, now: MonotonicTime, port: &mut dyn NorthPort) {
        let mut buffer = std::mem::take(&mut self.buffer);
        for _ in 0..DATAGRAMS_PER_CYCLE {
            let Some(datagram) = port.receive(&mut buffer) else { break };
            let arrival = datagram.arrived_at.map_or(now, |at| at.min(now));
            match self.datagram((now, arrival), &buffer[..datagram.len], datagram.from) {
                Ok(Change::Order) => break,
                Ok(Change::None) => {}
                Err(why) => self.admission.refuse(now, datagram.from, why),
            }
        }
        self.buffer = buffer;
    }

    fn datagram(
        &mut self,
        (now, arrival): (MonotonicTime, MonotonicTime),
        bytes: &[u8],
        from: SocketAddrV4,
    ) -> Result<Change, Refused> {
        if !self.any() {
            return Err(Refused::NoConnection);
        }
        let datagram = Class1Datagram::parse(bytes).map_err(|_| Refused::Malformed)?;
        let id = datagram.connection_id;
        if let Some(owner) = self.owner.as_mut().filter(|owner| owner.open.o_to_t_id == id) {
            owner.check(from, &datagram)?;
            let size =
                Refused::Size { expected: RUN_IDLE_LEN + self.output.len(), found: datagram.data.len() };
            let (header, data) = datagram.data.split_first_chunk::<RUN_IDLE_LEN>().ok_or(size)?;
            if data.len() != self.output.len() {
                return Err(size);
            }
            let number = (datagram.encapsulation_sequence, datagram.sequence_count);
            let before = owner.received.replace(number);
            owner.port = Some(from.port());
            (owner.heard, owner.deadline) = (now, now + timeout(&owner.open));
            let periods = before.map_or(1, |(last, _)| number.0.wrapping_sub(last));
            self.counts.lost_updates += u64::from(periods.saturating_sub(1));
            let is_new = before.is_none_or(|(_, count)| count != number.1);
            let run = u32::from_le_bytes(*header) & RUN != 0;
            let was_running = self.link == Link::Run;
            self.link = if run { Link::Run } else { Link::Idle };
            let mut change = if run == was_running { Change::None } else { Change::Order };
            let paced_at = self.arrivals.arrive(arrival, periods);
            if run && (is_new || !was_running) {
                if self.words.iter().any(|word| self.output[word.clone()] != data[word.clone()]) {
                    change = Change::Order;
                }
                self.output.copy_from_slice(data);
                self.fresh = Some(paced_at);
            }
            return Ok(change);
        }
        let expected = self.owner.or(self.listeners.first().copied()).map_or(0, |one| one.open.o_to_t_id);
        let listener = self.listeners.iter_mut().find(|one| one.open.o_to_t_id == id);
        let listener = listener.ok_or(Refused::ConnectionId { expected, found: id })?;
        listener.check(from, &datagram)?;
        listener.received = Some((datagram.encapsulation_sequence, datagram.sequence_count));
        listener.port = Some(from.port());
        (listener.heard, listener.deadline) = (now, now + timeout(&listener.open));
        Ok(Change::None)
    }

    /// Sends the input assembly on each connection on which it is due.
    pub fn transmit(&mut self, now: MonotonicTime, input: &[u8], port: &mut dyn NorthPort) {
        let Self { owner, listeners, group, buffer, counts, .. } = self;
        let own = owner.iter_mut().chain(listeners).filter_map(|one| one.own.as_mut());
        for stream in own.chain(group) {
            counts.send_failures += u64::from(!stream.transmit(now, input, buffer, port));
        }
    }
}

const _: () = assert!(FRAME_MAX > CLASS1_HEADER_LEN + profile_cip::assembly::layout::ASSEMBLY_LEN_MAX);

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::net::Ipv4Addr;

    use profile_cip::assembly::Layout;
    use profile_cip::device::motion_link::{AssemblyOpen, ConnectionTriad, Token};
    use profile_cip::wire::network_parameters::Priority;

    use super::*;
    use crate::engine::port::Datagram;

    const PLC: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 1);
    const RPI_US: u32 = 4_000;

    /// A port with what comes in, and what went out.
    #[derive(Default)]
    struct Port {
        inbound: VecDeque<(Vec<u8>, SocketAddrV4)>,
        outbound: Vec<(Vec<u8>, SocketAddrV4)>,
    }

    impl NorthPort for Port {
        fn receive(&mut self, buffer: &mut [u8]) -> Option<Datagram> {
            let (bytes, from) = self.inbound.pop_front()?;
            buffer[..bytes.len()].copy_from_slice(&bytes);
            Some(Datagram { len: bytes.len(), from, arrived_at: None })
        }

        fn send(&mut self, datagram: &[u8], to: SocketAddrV4) -> bool {
            self.outbound.push((datagram.to_vec(), to));
            true
        }
    }

    fn at(micros: i64) -> MonotonicTime {
        MonotonicTime(1_000_000_000) + DurationNs::from_micros(micros)
    }

    fn open(id: u32, role: AssemblyRole) -> OpenParameters {
        OpenParameters {
            token: Token(1),
            triad: ConnectionTriad { connection_serial: 1, originator_vendor: 2, originator_serial: id },
            o_to_t_id: id,
            t_to_o_id: id + 100,
            originator: PLC,
            t_to_o_destination: SocketAddrV4::new(PLC, 2222),
            rpi_us: RPI_US,
            timeout_us: 4 * u64::from(RPI_US),
            o_to_t_size: 22,
            t_to_o_size: 22,
            o_to_t_variable: false,
            t_to_o_variable: false,
            t_to_o_dscp: 47,
            format_revision: 0,
            configuration_bits: 0,
            assembly: Some(AssemblyOpen {
                role,
                t_to_o_rpi_us: 2 * RPI_US,
                t_to_o_priority: Priority::SCHEDULED,
                multicast: false,
            }),
        }
    }

    const GROUP: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(239, 192, 1, 0), 2222);

    fn multicast(id: u32, role: AssemblyRole) -> OpenParameters {
        let one = open(id, role);
        let assembly = one.assembly.map(|assembly| AssemblyOpen { multicast: true, ..assembly });
        OpenParameters { t_to_o_id: 500, t_to_o_destination: GROUP, assembly, ..one }
    }

    fn owned() -> (Connections, Port) {
        let assemblies = Assemblies::new(Layout::shipped("position").unwrap(), 1).unwrap();
        let mut connections = Connections::new(&assemblies);
        assert_eq!(connections.open(at(0), open(7, AssemblyRole::ExclusiveOwner)), Ok(()));
        assert_eq!(connections.link(), Link::Idle, "nothing has come yet");
        (connections, Port::default())
    }

    fn datagram(connection_id: u32, number: u32, count: u16, run: u32, fill: u8) -> Vec<u8> {
        let data = [&run.to_le_bytes()[..], &[fill; 16]].concat();
        let datagram = Class1Datagram {
            connection_id,
            encapsulation_sequence: number,
            sequence_count: count,
            data: &data,
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).unwrap();
        bytes
    }

    fn take(
        connections: &mut Connections,
        port: &mut Port,
        now: MonotonicTime,
        bytes: &[u8],
        from: (Ipv4Addr, u16),
    ) {
        port.inbound.push_back((bytes.to_vec(), SocketAddrV4::new(from.0, from.1)));
        connections.receive(now, port);
    }

    #[test]
    fn only_whole_data_of_the_owner_from_its_port_in_their_order_count() {
        let (mut connections, mut port) = owned();
        let plc = (PLC, 2222);
        take(&mut connections, &mut port, at(1_000), &datagram(7, 5, 1, 1, 0x11), plc);
        assert_eq!(connections.output(), Some(&[0x11; 16][..]));
        assert!(connections.take_fresh().is_some() && connections.take_fresh().is_none());
        let whole = datagram(7, 6, 2, 1, 0x22);
        let mut refused = 0;
        let mut none = |connections: &mut Connections, port: &mut Port, bytes: &[u8], from, what: &str| {
            take(connections, port, at(2_000), bytes, from);
            refused += 1;
            assert_eq!(connections.counts().refused, refused, "{what}");
            assert_eq!((connections.output(), connections.fresh), (Some(&[0x11; 16][..]), None), "{what}");
        };
        for len in 0..whole.len() {
            none(&mut connections, &mut port, &whole[..len], plc, &format!("{len} bytes"));
        }
        none(&mut connections, &mut port, &[&whole[..], &[0]].concat(), plc, "a byte too many");
        none(&mut connections, &mut port, &whole, (Ipv4Addr::new(10, 0, 0, 2), 2222), "another address");
        none(&mut connections, &mut port, &whole, (PLC, 2223), "another port");
        none(&mut connections, &mut port, &datagram(8, 6, 2, 1, 0x22), plc, "another connection");
        none(&mut connections, &mut port, &datagram(7, 5, 2, 1, 0x22), plc, "the same number");
        none(&mut connections, &mut port, &datagram(7, 4, 2, 1, 0x22), plc, "a number of before");
        take(&mut connections, &mut port, at(3_000), &datagram(7, 9, 2, 1, 0x22), plc);
        assert_eq!(connections.output(), Some(&[0x22; 16][..]));
        assert_eq!(connections.counts().lost_updates, 3, "6, 7 and 8");
    }

    #[test]
    fn idle_data_do_not_count_and_a_repeated_count_is_no_new_set() {
        let (mut connections, mut port) = owned();
        let plc = (PLC, 2222);
        take(&mut connections, &mut port, at(1_000), &datagram(7, 1, 1, 0, 0x11), plc);
        assert_eq!((connections.link(), connections.output()), (Link::Idle, None));
        assert_eq!(connections.take_fresh(), None);
        take(&mut connections, &mut port, at(2_000), &datagram(7, 2, 1, 1, 0x11), plc);
        assert!(connections.link() == Link::Run && connections.take_fresh().is_some());
        take(&mut connections, &mut port, at(3_000), &datagram(7, 3, 1, 1, 0x33), plc);
        assert_eq!(connections.take_fresh(), None);
        assert_eq!(connections.output(), Some(&[0x11; 16][..]));
        take(&mut connections, &mut port, at(4_000), &datagram(7, 4, 2, 0, 0x33), plc);
        assert_eq!((connections.link(), connections.output()), (Link::Idle, None));
    }

    /// The same with its own word in the first two bytes.
    fn worded(number: u32, run: u32, word: u16, fill: u8) -> Vec<u8> {
        let [low, high, ..] = number.to_le_bytes();
        let mut bytes = datagram(7, number, u16::from_le_bytes([low, high]), run, fill);
        let at = bytes.len() - 16;
        bytes[at..at + 2].copy_from_slice(&word.to_le_bytes());
        bytes
    }

    #[test]
    fn each_change_of_run_or_of_a_control_word_is_handed_on_before_the_next_one() {
        let (mut connections, mut port) = owned();
        take(&mut connections, &mut port, at(1_000), &worded(1, 1, 1, 0x10), (PLC, 2222));
        let together = [
            // Set-points alone are overtaken by newer ones.
            worded(2, 1, 1, 0x20),
            worded(3, 1, 1, 0x30),
            worded(4, 1, 0, 0x40),
            worded(5, 1, 1, 0x50),
            worded(6, 0, 1, 0x60),
            worded(7, 0, 0, 0x70),
            worded(8, 1, 1, 0x80),
            worded(9, 1, 1, 0x90),
        ];
        port.inbound.extend(together.map(|bytes| (bytes, SocketAddrV4::new(PLC, 2222))));
        let mut seen = Vec::new();
        for call in 2..8 {
            connections.receive(at(call * 1_000), &mut port);
            connections.take_fresh();
            seen.push(connections.output().map(|data| (data[0], data[15])));
        }
        assert_eq!(
            seen,
            [Some((0, 0x40)), Some((1, 0x50)), None, Some((1, 0x80)), Some((1, 0x90)), Some((1, 0x90))]
        );
        assert!(port.inbound.is_empty());
    }

    #[test]
    fn silence_ends_a_connection_and_listen_only_ends_with_the_last_other_one() {
        let (mut connections, mut port) = owned();
        let second = connections.open(at(0), open(8, AssemblyRole::ExclusiveOwner));
        assert_eq!(second.map_err(|refused| refused.extended_status), Err(0x0106));
        connections.open(at(0), open(9, AssemblyRole::InputOnly)).unwrap();
        connections.open(at(0), open(10, AssemblyRole::ListenOnly)).unwrap();
        assert_eq!(connections.poll_lost(at(9_999_999)), None, "the first datagram may take ten seconds");
        take(&mut connections, &mut port, at(1_000), &datagram(7, 1, 1, 1, 0), (PLC, 2222));
        take(&mut connections, &mut port, at(1_000), &datagram(10, 1, 1, 1, 0), (PLC, 2222));
        assert_eq!(connections.poll_lost(at(16_999)), None);
        assert_eq!(connections.poll_lost(at(17_000)), Some((7, 16_000)));
        assert_eq!((connections.link(), connections.owner()), (Link::Lost, None));
        assert_eq!(connections.poll_lost(at(17_000)), Some((10, 16_000)));
        connections.open(at(20_000), open(11, AssemblyRole::ListenOnly)).unwrap();
        connections.end_listen_only();
        assert_eq!(connections.poll_ended(), None, "an input-only one is there");
        connections.close(9);
        connections.end_listen_only();
        assert_eq!((connections.poll_ended(), connections.poll_ended()), (Some(11), None));
        assert!(!connections.any());
    }

    #[test]
    fn each_connection_gets_the_input_at_its_interval() {
        let (mut connections, mut port) = owned();
        connections.open(at(0), open(9, AssemblyRole::InputOnly)).unwrap();
        assert_eq!(connections.shortest_interval(), Some(DurationNs::from_micros(i64::from(RPI_US))));
        for step in 0..40 {
            connections.transmit(at(step * 1_000), &[0xAB; 20], &mut port);
        }
        let of = |id: u32| {
            let sent = port.outbound.iter().map(|(bytes, _)| Class1Datagram::parse(bytes).unwrap());
            sent.filter(|one| one.connection_id == id)
                .map(|one| one.encapsulation_sequence)
                .collect::<Vec<_>>()
        };
        // Twice the interval of the other direction: 0, 8, 16, 24 and 32 ms.
        assert_eq!(of(107), [1, 2, 3, 4, 5]);
        assert_eq!(of(109), [1, 2, 3, 4, 5]);
        let (bytes, to) = &port.outbound[0];
        assert_eq!(Class1Datagram::parse(bytes).unwrap().data, [0xAB; 20]);
        assert_eq!(*to, SocketAddrV4::new(PLC, 2222));
        // After a pause it does not catch up.
        let before = port.outbound.len();
        for step in 1_000..1_008 {
            connections.transmit(at(step * 1_000), &[0xAB; 20], &mut port);
        }
        assert_eq!(port.outbound.len() - before, 2);
    }

    #[test]
    fn connections_to_a_group_share_one_stream_that_ends_with_the_last_of_them() {
        let (mut connections, mut port) = owned();
        connections.open(at(0), multicast(8, AssemblyRole::InputOnly)).unwrap();
        connections.open(at(3_000), multicast(9, AssemblyRole::ListenOnly)).unwrap();
        let run = |connections: &mut Connections, port: &mut Port, steps: std::ops::Range<i64>| {
            port.outbound.clear();
            for step in steps {
                connections.transmit(at(step * 1_000), &[0xAB; 20], port);
            }
            let parsed = port.outbound.iter().map(|(bytes, to)| (Class1Datagram::parse(bytes).unwrap(), *to));
            parsed.map(|(one, to)| (one.connection_id, to, one.encapsulation_sequence)).collect::<Vec<_>>()
        };
        let sent = run(&mut connections, &mut port, 0..20);
        let to_group: Vec<_> = sent.iter().filter(|(id, ..)| *id == 500).collect();
        // One datagram in 8 ms, whoever listens.
        assert_eq!(to_group, [&(500, GROUP, 1), &(500, GROUP, 2), &(500, GROUP, 3)]);
        assert_eq!(
            sent.iter().filter(|(id, to, _)| *id == 107 && *to.ip() == PLC).count(),
            3,
            "the owner's own"
        );

        let other = OpenParameters { t_to_o_id: 501, ..multicast(10, AssemblyRole::InputOnly) };
        let refused = connections.open(at(20_000), other).map_err(|refused| refused.extended_status);
        assert_eq!(refused, Err(0x0113), "there is one stream");
        // The first of its connections goes, and the stream goes on in its order.
        connections.close(8);
        assert_eq!(connections.shortest_interval(), Some(DurationNs::from_micros(i64::from(RPI_US))));
        let sent = run(&mut connections, &mut port, 20..30);
        assert!(sent.contains(&(500, GROUP, 4)), "{sent:?}");
        // With the owner the last connection goes that is more than listen-only.
        connections.close(7);
        connections.end_listen_only();
        assert_eq!(connections.poll_ended(), Some(9));
        assert_eq!(run(&mut connections, &mut port, 30..60), []);

        // An owner may consume it too, and a stream that begins again counts from 1.
        connections.open(at(60_000), multicast(11, AssemblyRole::ExclusiveOwner)).unwrap();
        connections.open(at(60_000), multicast(12, AssemblyRole::InputOnly)).unwrap();
        assert_eq!(run(&mut connections, &mut port, 60..68), [(500, GROUP, 1)]);
        take(&mut connections, &mut port, at(68_000), &datagram(11, 1, 1, 1, 0), (PLC, 2222));
        assert_eq!(connections.poll_lost(at(84_000)), Some((11, 16_000)));
        assert_eq!(
            run(&mut connections, &mut port, 84..85),
            [(500, GROUP, 2)],
            "the other one still listens"
        );
        connections.close(12);
        assert_eq!(run(&mut connections, &mut port, 92..120), []);
    }
}
