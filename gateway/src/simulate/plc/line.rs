//! The class 1 connection: what is sent in each interval, and what comes.

use std::io;
use std::net::{IpAddr, UdpSocket};
use std::time::{Duration, Instant};

use profile_cip::assembly::RUN;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};

use super::session::Ids;
use super::{Images, Plan, PlcError, socket};
use crate::sys::udp::PORT_IO;

/// What was counted on the connections.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counts {
    /// Datagrams sent.
    pub sent: u64,
    /// Datagrams of the device that are missing in their sequence.
    pub lost: u64,
    /// Intervals in which none came.
    pub late: u64,
}

/// An open connection.
#[derive(Debug)]
pub(super) struct Line {
    io: UdpSocket,
    pub ids: Ids,
    sent: u32,
    received: Option<u32>,
    /// The controller is in run.
    pub run: bool,
    /// Input has come.
    pub heard: bool,
}

impl Line {
    pub fn new(io: UdpSocket, ids: Ids) -> Self {
        Self { io, ids, sent: 0, received: None, run: true, heard: false }
    }

    /// One interval: sends the output and takes what comes.
    pub fn exchange(
        &mut self,
        plan: &Plan,
        images: &mut Images,
        counts: &mut Counts,
    ) -> Result<(), PlcError> {
        let end = Instant::now() + plan.interval;
        let header = if self.run { RUN } else { 0 };
        let data = [&header.to_le_bytes()[..], &images.output].concat();
        self.sent = self.sent.wrapping_add(1);
        let [low, high, ..] = self.sent.to_le_bytes();
        let datagram = Class1Datagram {
            connection_id: self.ids.o_to_t,
            encapsulation_sequence: self.sent,
            sequence_count: u16::from_le_bytes([low, high]),
            data: &data,
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).map_err(|_| PlcError::Answer("class 1"))?;
        self.io.send_to(&bytes, (plan.address, PORT_IO)).map_err(socket("cannot send"))?;
        counts.sent += 1;
        let came = self.listen(end, plan, images, counts)?;
        counts.late += u64::from(self.heard && came == 0);
        Ok(())
    }

    /// Takes what comes until `end`; how many datagrams that were.
    pub fn listen(
        &mut self,
        end: Instant,
        plan: &Plan,
        images: &mut Images,
        counts: &mut Counts,
    ) -> Result<u32, PlcError> {
        let mut buffer = vec![0; CLASS1_HEADER_LEN + images.input.len() + 1];
        let mut came = 0;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if left < Duration::from_micros(1) {
                return Ok(came);
            }
            self.io.set_read_timeout(Some(left)).map_err(socket("cannot wait"))?;
            let (len, from) = match self.io.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(came);
                }
                Err(source) => return Err(PlcError::Socket { what: "cannot receive", source }),
            };
            if from.ip() == IpAddr::V4(plan.address)
                && let Ok(datagram) = Class1Datagram::parse(&buffer[..len])
                && datagram.connection_id == self.ids.t_to_o
                && datagram.data.len() == images.input.len()
            {
                let number = datagram.encapsulation_sequence;
                let gap = self.received.map_or(1, |last| number.wrapping_sub(last));
                if gap.cast_signed() <= 0 {
                    continue;
                }
                counts.lost += u64::from(gap - 1);
                self.received = Some(number);
                images.input.copy_from_slice(datagram.data);
                self.heard = true;
                came += 1;
            }
        }
    }
}
