//! What one peer may cost: how much it may send, and for how long it may do nothing.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use hyper::server::conn::http1;
use hyper_util::rt::TokioTimer;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};

use crate::places::Place;

/// How long a peer may take to send the head of its request.
pub const HEADER_TIME_OUT: Duration = Duration::from_secs(5);

/// How long a peer may take nothing of an answer that waits for it.
pub const STALL_TIME_OUT: Duration = Duration::from_secs(10);

/// Bytes of the head of a request: the least that hyper can be limited to.
const REQUEST_LEN_MAX: usize = 8_192;

/// Header lines of a request.
const HEADERS_MAX: usize = 64;

/// One connection, as it is served, within its limits. Every answer but that of a WebSocket closes it: `routes` says so in its head.
pub fn builder(header_time_out: Duration) -> http1::Builder {
    let mut builder = http1::Builder::new();
    builder
        .timer(TokioTimer::new())
        .header_read_timeout(header_time_out)
        .max_headers(HEADERS_MAX)
        .max_buf_size(REQUEST_LEN_MAX);
    builder
}

/// A peer's connection with its place among the connections. It ends when the peer takes nothing of an answer for too long.
#[derive(Debug)]
pub struct Peer {
    stream: TcpStream,
    stall: Duration,
    /// Runs while bytes wait for the peer.
    deadline: Option<Pin<Box<Sleep>>>,
    _place: Place,
}

impl Peer {
    /// A connection that holds this place.
    pub fn new(stream: TcpStream, stall: Duration, place: Place) -> Self {
        Self { stream, stall, deadline: None, _place: place }
    }

    /// Lets a write that has to wait fail after the time for it.
    fn timed<T>(&mut self, written: Poll<io::Result<T>>, context: &mut Context<'_>) -> Poll<io::Result<T>> {
        if written.is_ready() {
            self.deadline = None;
            return written;
        }
        let stall = self.stall;
        let deadline = self.deadline.get_or_insert_with(|| Box::pin(sleep(stall)));
        match deadline.as_mut().poll(context) {
            Poll::Ready(()) => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            Poll::Pending => Poll::Pending,
        }
    }
}

impl AsyncRead for Peer {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Peer {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.timed(written, context)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use profile_cip::device::hosts::Hosts;
    use tokio::io::AsyncWriteExt as _;
    use tokio::net::TcpListener;
    use tokio::time::Instant;

    use super::*;
    use crate::places::Places;

    #[tokio::test]
    async fn peer_that_takes_nothing_of_an_answer_loses_its_place() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let _reads_nothing = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let places = Places::new(1, Hosts::EVERYBODY);
        let place = places.take(Ipv4Addr::LOCALHOST.into()).unwrap();
        let (stream, _) = listener.accept().await.unwrap();
        let stall = Duration::from_millis(300);
        let mut peer = Peer::new(stream, stall, place);
        let began = Instant::now();
        // More than the buffers of the sockets hold.
        let error = peer.write_all(&vec![0; 64 << 20]).await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(began.elapsed() >= stall, "{:?}", began.elapsed());
        assert!(!places.is_empty());
        drop(peer);
        assert!(places.is_empty());
    }

    #[tokio::test]
    async fn slow_peer_that_takes_something_is_served_on() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let mut reader = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let place = Places::new(1, Hosts::EVERYBODY).take(Ipv4Addr::LOCALHOST.into()).unwrap();
        let (stream, _) = listener.accept().await.unwrap();
        let mut peer = Peer::new(stream, Duration::from_millis(900), place);
        const LEN: usize = 32 << 20;
        let write = tokio::spawn(async move { peer.write_all(&vec![0; LEN]).await });
        let mut buffer = vec![0; 1 << 20];
        let mut count = 0;
        while count < LEN {
            // All pauses together are longer than the time for one.
            sleep(Duration::from_millis(100)).await;
            let end = (count + (1 << 20)).min(LEN);
            while count < end {
                let read = tokio::io::AsyncReadExt::read(&mut reader, &mut buffer).await.unwrap();
                assert!(read > 0, "closed after {count} bytes");
                count += read;
            }
        }
        write.await.unwrap().unwrap();
    }
}
