//! One TCP stream: bytes from the peer to the adapter and back, as far as both take them.

use std::io;
use std::net::SocketAddrV4;
use std::ops::Range;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use profile_cip::device::adapter::SessionSlot;
use profile_generic::time::{DurationNs, MonotonicTime};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

use super::core::Core;
use crate::sys::clock::realtime_now;

/// Bytes of a buffer, one for each direction.
const BUFFER_LEN: usize = 4096;

/// Why a stream has ended.
#[derive(Debug)]
pub(super) enum Ending {
    /// Everything has been sent, and one of the two sides closed it.
    Closed,
    /// The peer did not take a buffer in time.
    Stalled,
    /// The network failed, or the peer broke off.
    Failed(io::Error),
}

/// A buffer of which a part is still to be taken.
#[derive(Debug)]
struct Buffer {
    bytes: Box<[u8; BUFFER_LEN]>,
    rest: Range<usize>,
}

impl Buffer {
    fn new() -> Self {
        Self { bytes: Box::new([0; BUFFER_LEN]), rest: 0..0 }
    }

    fn rest(&self) -> &[u8] {
        &self.bytes[self.rest.clone()]
    }
}

/// A stream with the bytes that are under way. A peer that stalls keeps one buffer of each kind, and nobody
/// waits for it.
#[derive(Debug)]
pub(super) struct Stream {
    tcp: TcpStream,
    pub peer: SocketAddrV4,
    local: SocketAddrV4,
    slot: SessionSlot,
    /// Received, and not taken by the adapter yet.
    input: Buffer,
    /// Taken from the adapter, and not sent yet.
    output: Buffer,
    /// How long the peer may take for one buffer, and until when it may for this one.
    stall_limit: DurationNs,
    stalled_at: MonotonicTime,
    /// The adapter has let go of it, or the peer has: what is in the output still goes out.
    leaving: bool,
}

impl Stream {
    pub fn new(
        tcp: TcpStream,
        (peer, local): (SocketAddrV4, SocketAddrV4),
        slot: SessionSlot,
        stall_limit: Duration,
    ) -> Self {
        Self {
            tcp,
            peer,
            local,
            slot,
            input: Buffer::new(),
            output: Buffer::new(),
            stall_limit: DurationNs(i64::try_from(stall_limit.as_nanos()).unwrap_or(i64::MAX)),
            stalled_at: MonotonicTime::ZERO,
            leaving: false,
        }
    }

    /// Moves what can be moved now, and reports whether anything was. The task is woken when there is more.
    ///
    /// One buffer is read at most, so that the others get their turn.
    ///
    /// # Errors
    /// Why the stream has ended; it is to be dropped.
    pub fn turn(
        &mut self,
        cx: &mut Context<'_>,
        now: MonotonicTime,
        core: &mut Core,
    ) -> Result<bool, Ending> {
        let received = self.receive(cx, now, core)?;
        let sent = self.send(cx, now, core)?;
        if !self.leaving && core.adapter.is_done(self.slot) {
            self.leave(core, false);
        }
        if self.leaving && self.output.rest.is_empty() {
            return Err(Ending::Closed);
        }
        Ok(received || sent)
    }

    /// When the peer has stalled, unless it takes something before.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        (!self.output.rest.is_empty()).then_some(self.stalled_at)
    }

    /// Takes its session from the adapter; the output still goes out.
    pub fn leave(&mut self, core: &mut Core, by_peer: bool) {
        if !std::mem::replace(&mut self.leaving, true) {
            core.adapter.close(self.slot);
            let (from, to) = if by_peer { (self.peer, self.local) } else { (self.local, self.peer) };
            tracing::debug!(peer = %self.peer, by_peer, "stream closed");
            if let Some(tap) = &mut core.tap {
                tap.closed(realtime_now(), from, to);
            }
        }
    }

    /// Says good-bye; what the peer has not read yet, it still can.
    pub fn shut_down(&self) -> io::Result<()> {
        socket2::SockRef::from(&self.tcp).shutdown(std::net::Shutdown::Write)
    }

    fn receive(&mut self, cx: &mut Context<'_>, now: MonotonicTime, core: &mut Core) -> Result<bool, Ending> {
        if self.leaving {
            return Ok(false);
        }
        let mut received = false;
        if self.input.rest.is_empty() {
            let mut buffer = ReadBuf::new(&mut self.input.bytes[..]);
            match Pin::new(&mut self.tcp).poll_read(cx, &mut buffer) {
                Poll::Pending => return Ok(false),
                Poll::Ready(Err(error)) => return Err(Ending::Failed(error)),
                Poll::Ready(Ok(())) => self.input.rest = 0..buffer.filled().len(),
            }
            if self.input.rest.is_empty() {
                self.leave(core, true);
                return Ok(true);
            }
            if let Some(tap) = &mut core.tap {
                tap.stream(realtime_now(), self.peer, self.local, self.input.rest());
            }
            received = true;
        }
        let taken = core.adapter.handle_stream(now, self.slot, self.input.rest());
        self.input.rest.start += taken;
        Ok(received || taken > 0)
    }

    fn send(&mut self, cx: &mut Context<'_>, now: MonotonicTime, core: &mut Core) -> Result<bool, Ending> {
        let mut sent = false;
        loop {
            if self.output.rest.is_empty() && !self.leaving {
                let count = core.adapter.poll_transmit(now, self.slot, &mut self.output.bytes[..]);
                self.output.rest = 0..count;
                self.stalled_at = now + self.stall_limit;
                if let (Some(tap), true) = (&mut core.tap, count > 0) {
                    tap.stream(realtime_now(), self.local, self.peer, self.output.rest());
                }
            }
            if self.output.rest.is_empty() {
                return Ok(sent);
            }
            let rest = &self.output.bytes[self.output.rest.clone()];
            match Pin::new(&mut self.tcp).poll_write(cx, rest) {
                Poll::Ready(Ok(count)) => self.output.rest.start += count,
                Poll::Ready(Err(error)) => return Err(Ending::Failed(error)),
                Poll::Pending if self.stalled_at <= now => return Err(Ending::Stalled),
                Poll::Pending => return Ok(sent),
            }
            sent = true;
        }
    }
}
