//! Which datagrams the kernel lets through to a UDP socket.
//!
//! A filter (classic BPF, `SO_ATTACH_FILTER`) runs in the kernel before a datagram is queued: what it drops costs the thread
//! that receives nothing, takes no room in the receive buffer, and is not answered with an ICMP message. A closed gate drops
//! everything; an open one lets through what comes from one address, with one connection ID in its sequenced address item,
//! and from one source port once that is known.
//!
//! A connected socket would need the source port from the start, could not look at the connection ID, and would leave
//! nobody at the port between two connections. The filter is exchanged in one step while datagrams come.
//!
//! One dropped datagram in [`SAMPLE`], chosen at random, passes nevertheless: the receiver refuses it again, and can say
//! where such datagrams come from, which the kernel does not.
//!
//! The functions here are system calls that take a lock of the socket and allocate: they are for threads beside the cycle.

use std::io;
use std::net::Ipv4Addr;
use std::os::fd::AsFd;

use profile_cip::wire::class1::CONNECTION_ID_OFFSET;
use socket2::Socket;

use super::option::{counters, set_option};

/// One in so many dropped datagrams passes: at 80 000 a second 20, at 100 a second two or three a minute. A power of two.
pub const SAMPLE: u32 = 4096;

/// Where the program finds the fields: the UDP header begins at 0, the IP header at `SKF_NET_OFF`.
const SOURCE_ADDRESS: u32 = libc::SKF_NET_OFF.cast_unsigned() + 12;
const SOURCE_PORT: u32 = 0;
const UDP_HEADER_LEN: u32 = 8;
/// Not a field: a random number.
const RANDOM: u32 = (libc::SKF_AD_OFF + libc::SKF_AD_RANDOM).cast_unsigned();

/// Value of the verdict that keeps a whole datagram, and of the one that drops it.
const KEEP: u32 = u32::MAX;
const DROP: u32 = 0;

/// Instructions of the longest program.
const PROGRAM_MAX: usize = 12;

/// Bytes of `SO_MEMINFO` at most; newer kernels may have more counters behind those that are known.
const MEMORY_COUNTERS: usize = 16;

/// Whose datagrams an open gate lets through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Admitted {
    /// Address they come from.
    pub address: Ipv4Addr,
    /// Source port, once it is known.
    pub port: Option<u16>,
    /// Connection ID in the sequenced address item.
    pub connection_id: u32,
}

/// The gate of a socket.
#[derive(Debug)]
pub struct Gate {
    socket: Socket,
    /// A part of what is dropped passes.
    sampling: bool,
}

impl Gate {
    /// The gate of this socket; the filter is that of the socket, whichever descriptor it is set by.
    pub(super) fn new(socket: Socket) -> Self {
        Self { socket, sampling: true }
    }

    /// Drops everything; with a value, everything but that. What is in the receive buffer stays there.
    ///
    /// # Errors
    /// What the system says; then everything passes rather than nothing.
    pub fn set(&self, admitted: Option<Admitted>) -> io::Result<()> {
        let program = Program::new(admitted, self.sampling);
        self.attach(&program).inspect_err(|_| {
            let _ = set_option(self.socket.as_fd(), libc::SOL_SOCKET, libc::SO_DETACH_FILTER, &0_i32);
        })
    }

    fn attach(&self, program: &Program) -> io::Result<()> {
        let instructions = &program.instructions[..program.len];
        let program = libc::sock_fprog {
            len: u16::try_from(instructions.len()).unwrap_or(0),
            // The kernel only reads.
            filter: instructions.as_ptr().cast_mut(),
        };
        set_option(self.socket.as_fd(), libc::SOL_SOCKET, libc::SO_ATTACH_FILTER, &program)
    }

    /// Datagrams that the kernel has dropped at this socket so far, modulo 2^32: those that the filter refused, those with a
    /// wrong checksum, and those for which the receive buffer had no room.
    ///
    /// # Errors
    /// What the system says.
    pub fn dropped(&self) -> io::Result<u32> {
        let counters: [u32; MEMORY_COUNTERS] =
            counters(self.socket.as_fd(), libc::SOL_SOCKET, libc::SO_MEMINFO)?;
        usize::try_from(libc::SK_MEMINFO_DROPS)
            .ok()
            .and_then(|place| counters.get(place).copied())
            .ok_or_else(|| io::ErrorKind::Unsupported.into())
    }
}

/// A program of the filter.
struct Program {
    instructions: [libc::sock_filter; PROGRAM_MAX],
    len: usize,
}

impl Program {
    fn new(admitted: Option<Admitted>, sampling: bool) -> Self {
        let nothing = libc::sock_filter { code: 0, jt: 0, jf: 0, k: 0 };
        let mut program = Self { instructions: [nothing; PROGRAM_MAX], len: 0 };
        if let Some(Admitted { address, port, connection_id }) = admitted {
            // Each test jumps over the rest when it fails. A field that is not there drops the datagram at once.
            let id_offset = UDP_HEADER_LEN + u32::try_from(CONNECTION_ID_OFFSET).unwrap_or(0);
            let tests = [
                Some((libc::BPF_W, SOURCE_ADDRESS, u32::from(address))),
                port.map(|port| (libc::BPF_H, SOURCE_PORT, u32::from(port))),
                // Fields are loaded as big endian numbers, and this one is little endian.
                Some((libc::BPF_W, id_offset, connection_id.swap_bytes())),
            ];
            let mut left = u8::try_from(tests.iter().flatten().count()).unwrap_or(0);
            for (width, offset, value) in tests.into_iter().flatten() {
                left -= 1;
                program.push(libc::BPF_LD | libc::BPF_ABS | width, 0, offset);
                // Behind this one: two instructions for each test that is left, and the verdict.
                program.push(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 2 * left + 1, value);
            }
            program.push(libc::BPF_RET | libc::BPF_K, 0, KEEP);
        }
        if sampling {
            program.push(libc::BPF_LD | libc::BPF_ABS | libc::BPF_W, 0, RANDOM);
            program.push(libc::BPF_ALU | libc::BPF_AND | libc::BPF_K, 0, SAMPLE - 1);
            program.push(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 1, 0);
            program.push(libc::BPF_RET | libc::BPF_K, 0, KEEP);
        }
        program.push(libc::BPF_RET | libc::BPF_K, 0, DROP);
        program
    }

    /// Appends an instruction; a test that fails jumps over so many.
    fn push(&mut self, code: u32, on_failure: u8, k: u32) {
        if let Some(slot) = self.instructions.get_mut(self.len) {
            *slot = libc::sock_filter { code: u16::try_from(code).unwrap_or(0), jt: 0, jf: on_failure, k };
            self.len += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::{SocketAddrV4, UdpSocket};

    use profile_cip::wire::class1::Class1Datagram;

    use super::super::udp::IoSocket;
    use super::*;

    const OWNER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 11);
    const OTHER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 12);
    const ID: u32 = 0x7A00_0103;

    /// A closed socket at a free port, whose gate takes no samples.
    fn closed() -> (IoSocket, Gate) {
        let address = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
        let (socket, mut gate) = IoSocket::bind_closed(address, 0).unwrap();
        gate.sampling = false;
        gate.set(None).unwrap();
        (socket, gate)
    }

    fn sender(address: Ipv4Addr) -> (UdpSocket, u16) {
        let socket = UdpSocket::bind((address, 0)).unwrap();
        let port = socket.local_addr().unwrap().port();
        (socket, port)
    }

    fn datagram(connection_id: u32) -> Vec<u8> {
        let datagram =
            Class1Datagram { connection_id, encapsulation_sequence: 1, sequence_count: 1, data: &[7; 40] };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).unwrap();
        bytes
    }

    /// How many datagrams are there. On loopback a datagram is in the queue, or dropped, when `send_to` returns.
    fn arrived(socket: &IoSocket) -> usize {
        std::iter::from_fn(|| socket.recv(&mut [0; 1500]).unwrap()).count()
    }

    #[test]
    fn a_closed_gate_drops_everything_and_counts_it() {
        let (socket, gate) = closed();
        let (owner, _) = sender(OWNER);
        let before = gate.dropped().unwrap();
        for bytes in [&datagram(ID)[..], &[], &[0xA5; 1400]] {
            owner.send_to(bytes, socket.local_address()).unwrap();
        }
        assert_eq!((arrived(&socket), gate.dropped().unwrap() - before), (0, 3));
    }

    #[test]
    fn an_open_gate_lets_through_address_connection_id_and_later_one_port_only() {
        let (socket, gate) = closed();
        let to = socket.local_address();
        let ((owner, port), (second, _), (other, _)) = (sender(OWNER), sender(OWNER), sender(OTHER));
        let whole = datagram(ID);
        let mut admitted = Admitted { address: OWNER, port: None, connection_id: ID };
        gate.set(Some(admitted)).unwrap();
        let passes = |from: &UdpSocket, bytes: &[u8]| {
            from.send_to(bytes, to).unwrap();
            arrived(&socket) == 1
        };
        let cut = CONNECTION_ID_OFFSET + 3;
        for (bytes, expected) in [
            (&whole[..], true),
            (&datagram(ID ^ 1 << 31), false),
            (&datagram(ID ^ 1), false),
            (&datagram(ID.swap_bytes()), false),
            (&whole[..cut], false),
            (&[], false),
        ] {
            assert_eq!(passes(&owner, bytes), expected, "{bytes:02x?}");
            assert!(!passes(&other, bytes));
        }
        assert!(passes(&second, &whole), "the port is not known yet");
        let before = gate.dropped().unwrap();
        admitted.port = Some(port);
        gate.set(Some(admitted)).unwrap();
        assert!(passes(&owner, &whole));
        assert!(!passes(&owner, &datagram(ID + 1)));
        assert!(!passes(&second, &whole) && !passes(&other, &whole));
        assert_eq!(gate.dropped().unwrap() - before, 3);
        gate.set(None).unwrap();
        assert!(!passes(&owner, &whole), "closed again");
    }

    #[test]
    fn what_had_come_before_the_gate_was_closed_can_still_be_fetched() {
        let (socket, gate) = closed();
        let (owner, port) = sender(OWNER);
        gate.set(Some(Admitted { address: OWNER, port: Some(port), connection_id: ID })).unwrap();
        owner.send_to(&datagram(ID), socket.local_address()).unwrap();
        gate.set(None).unwrap();
        assert_eq!(arrived(&socket), 1);
    }

    #[test]
    fn of_what_is_dropped_a_small_part_passes_to_name_its_sender() {
        let address = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);
        let (socket, gate) = IoSocket::bind_closed(address, 0).unwrap();
        let (other, port) = sender(OTHER);
        let before = gate.dropped().unwrap();
        let (mut sent, mut passed) = (0_u32, 0_u32);
        // Twenty samples are expected; that none comes has a probability of 2e-9.
        while sent < 20 * SAMPLE {
            other.send_to(&[0xA5; 40], socket.local_address()).unwrap();
            sent += 1;
            while let Some(datagram) = socket.recv(&mut [0; 100]).unwrap() {
                assert_eq!((datagram.len, datagram.from), (40, SocketAddrV4::new(OTHER, port)));
                passed += 1;
            }
        }
        assert!((1..=80).contains(&passed), "{passed} of {sent}");
        assert_eq!(gate.dropped().unwrap() - before, sent - passed);
    }
}
