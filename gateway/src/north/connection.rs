//! One TCP stream: a task that reads into one buffer and writes from another.
//!
//! The buffers go to and fro between this task and the server: the server gives a read buffer back when all
//! its bytes have been taken, and sends the next bytes when the write buffer has come back. So each stream
//! has at most one buffer of each kind, and never more than two messages waiting at the server.

use std::io;
use std::net::SocketAddrV4;
use std::time::Duration;

use profile_cip::target::adapter::SessionSlot;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::task::Id;
use tokio::time::timeout;

/// Bytes of a buffer.
pub(super) const BUFFER_LEN: usize = 4096;

/// What a task tells the server.
#[derive(Debug)]
pub(super) enum Message {
    /// Bytes came; there are no more until the buffer goes back.
    Received(Id, Vec<u8>),
    /// The buffer has been written.
    Sent(Id, Vec<u8>),
    /// The peer sends no more.
    Finished(Id),
    /// A datagram came, to this address.
    Datagram { from: SocketAddrV4, to: SocketAddrV4, bytes: Vec<u8> },
}

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

/// The server's side of a stream.
#[derive(Debug)]
pub(super) struct Connection {
    pub peer: SocketAddrV4,
    pub local: SocketAddrV4,
    pub slot: SessionSlot,
    /// What came in and how much of it the adapter has taken.
    pub input: Option<(Vec<u8>, usize)>,
    /// The write buffer while there is nothing to write.
    pub spare: Option<Vec<u8>>,
    /// Gives the read buffer back.
    pub to_reader: mpsc::Sender<Vec<u8>>,
    /// Sends the write buffer.
    pub to_writer: mpsc::Sender<Vec<u8>>,
}

/// The task's side of a stream.
#[derive(Debug)]
pub(super) struct Task {
    pub stream: TcpStream,
    pub server: mpsc::Sender<Message>,
    pub read_buffers: mpsc::Receiver<Vec<u8>>,
    pub write_buffers: mpsc::Receiver<Vec<u8>>,
    /// How long the peer may take for one buffer.
    pub stall_limit: Duration,
}

impl Task {
    /// Reads and writes until the server lets go of the stream or it breaks.
    pub async fn run(self) -> Ending {
        let Self { mut stream, server, mut read_buffers, mut write_buffers, stall_limit } = self;
        let id = tokio::task::id();
        let (mut from_peer, mut to_peer) = stream.split();
        let reading = async {
            let mut buffer = Vec::with_capacity(BUFFER_LEN);
            loop {
                match from_peer.read_buf(&mut buffer).await {
                    Ok(0) => break Ok(()),
                    Ok(_) => {}
                    Err(error) => break Err(error),
                }
                if server.send(Message::Received(id, buffer)).await.is_err() {
                    break Ok(());
                }
                match read_buffers.recv().await {
                    Some(taken) => buffer = taken,
                    None => break Ok(()),
                }
                buffer.clear();
            }
        };
        let writing = async {
            while let Some(buffer) = write_buffers.recv().await {
                match timeout(stall_limit, to_peer.write_all(&buffer)).await {
                    Ok(Ok(())) => {}
                    Ok(Err(error)) => return Ending::Failed(error),
                    Err(_) => return Ending::Stalled,
                }
                if server.send(Message::Sent(id, buffer)).await.is_err() {
                    break;
                }
            }
            match to_peer.shutdown().await {
                Ok(()) => Ending::Closed,
                Err(error) => Ending::Failed(error),
            }
        };
        tokio::pin!(reading, writing);
        tokio::select! {
            ending = &mut writing => ending,
            ended = &mut reading => {
                // What the server has handed over already still goes out.
                let _ = server.send(Message::Finished(id)).await;
                match (ended, writing.await) {
                    (Err(error), Ending::Closed) => Ending::Failed(error),
                    (_, ending) => ending,
                }
            }
        }
    }
}
