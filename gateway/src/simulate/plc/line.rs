//! The class 1 connection: what is sent in each interval, and what comes.

use std::io;
use std::net::{IpAddr, UdpSocket};
use std::time::{Duration, Instant};

use profile_cip::assembly::RUN;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};

use super::session::{Ids, TIMEOUT_INTERVALS};
use super::{Images, Plan, PlcError, socket};
use crate::sys::udp::PORT_IO;

/// The shortest wait for a datagram.
const LEAST_WAIT: Duration = Duration::from_micros(1);

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
    /// When input came last.
    heard: Option<Instant>,
}

impl Line {
    pub fn new(io: UdpSocket, ids: Ids) -> Self {
        Self { io, ids, sent: 0, received: None, run: true, heard: None }
    }

    /// Whether input has come within the time-out of the connection.
    pub fn is_live(&self, plan: &Plan) -> bool {
        self.heard.is_some_and(|heard| heard.elapsed() <= plan.interval * TIMEOUT_INTERVALS)
    }

    /// One interval: sends the output and takes what comes. Fails once the device was heard and is silent for longer than
    /// the time-out of the connection.
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
        counts.late += u64::from(self.heard.is_some() && came == 0);
        if self.heard.is_some() && !self.is_live(plan) {
            return Err(PlcError::ConnectionLost { limit: plan.interval * TIMEOUT_INTERVALS });
        }
        Ok(())
    }

    /// Takes what comes until `end`, and what has come before; how many datagrams that were.
    pub fn listen(
        &mut self,
        end: Instant,
        plan: &Plan,
        images: &mut Images,
        counts: &mut Counts,
    ) -> Result<u32, PlcError> {
        let mut buffer = vec![0; CLASS1_HEADER_LEN + images.input.len() + 1];
        let mut came = 0;
        // What came while this process did not run is not lost: it is read at least once.
        let mut is_read = false;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            if left < LEAST_WAIT && is_read {
                return Ok(came);
            }
            is_read = true;
            self.io.set_read_timeout(Some(left.max(LEAST_WAIT))).map_err(socket("cannot wait"))?;
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
                self.heard = Some(Instant::now());
                came += 1;
            }
        }
    }
}
