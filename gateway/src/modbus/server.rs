//! The server: a bounded number of clients, each answered from the latest status.

use std::future::{Future, Ready, ready};
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep, sleep};
use tokio_modbus::prelude::{ExceptionCode, Request, Response, SlaveRequest};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;

use super::map::{Refusal, registers};
use crate::latest::Reader;
use crate::status::BoxStatus;

/// A client that has sent nothing for this long gives its place up.
const IDLE: Duration = Duration::from_secs(120);

/// Where the server takes the status from.
pub trait StatusSource: Send + Sync + 'static {
    /// The latest status.
    fn status(&self) -> BoxStatus;
}

impl StatusSource for Reader<BoxStatus> {
    fn status(&self) -> BoxStatus {
        self.read()
    }
}

/// A server that listens; [`ModbusServer::run`] answers.
#[derive(Debug)]
pub struct ModbusServer {
    listener: TcpListener,
    clients_max: u8,
    idle: Duration,
}

impl ModbusServer {
    /// Listens at `address` for at most `clients_max` clients at once.
    ///
    /// # Errors
    /// The address cannot be had.
    pub async fn bind(address: SocketAddr, clients_max: u8) -> io::Result<Self> {
        Ok(Self { listener: TcpListener::bind(address).await?, clients_max, idle: IDLE })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the system says.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers clients until the future is dropped. A client above the limit is disconnected at once.
    ///
    /// # Errors
    /// Accepting failed.
    pub async fn run(self, source: impl StatusSource) -> io::Result<()> {
        let places = Arc::new(Semaphore::new(usize::from(self.clients_max)));
        let source: Arc<dyn StatusSource> = Arc::new(source);
        let idle = self.idle;
        let on_connected = |stream: TcpStream, peer: SocketAddr| {
            let place = Arc::clone(&places).try_acquire_owned().ok();
            let source = Arc::clone(&source);
            async move {
                let Some(place) = place else {
                    tracing::warn!(%peer, "Modbus client refused: too many clients are connected");
                    return Ok(None);
                };
                tracing::debug!(%peer, "Modbus client connected");
                Ok(Some((Registers { source }, Client::new(stream, place, idle))))
            }
        };
        let on_error = |error: io::Error| tracing::debug!(%error, "Modbus client gone");
        Server::new(self.listener).serve(&on_connected, on_error).await
    }
}

/// Answers one client.
struct Registers {
    source: Arc<dyn StatusSource>,
}

impl Service for Registers {
    type Request = SlaveRequest<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        let read = |address, count| {
            registers(&self.source.status(), address, count).map_err(|refusal| match refusal {
                Refusal::Address => ExceptionCode::IllegalDataAddress,
                Refusal::Count => ExceptionCode::IllegalDataValue,
            })
        };
        ready(match request.request {
            Request::ReadInputRegisters(address, count) => {
                read(address, count).map(Response::ReadInputRegisters)
            }
            Request::ReadHoldingRegisters(address, count) => {
                read(address, count).map(Response::ReadHoldingRegisters)
            }
            _ => Err(ExceptionCode::IllegalFunction),
        })
    }
}

/// A client's connection with its place among the clients; it ends when nothing comes for too long.
struct Client {
    stream: TcpStream,
    idle: Duration,
    deadline: Pin<Box<Sleep>>,
    _place: OwnedSemaphorePermit,
}

impl Client {
    fn new(stream: TcpStream, place: OwnedSemaphorePermit, idle: Duration) -> Self {
        Self { stream, idle, deadline: Box::pin(sleep(idle)), _place: place }
    }
}

impl AsyncRead for Client {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        if read.is_ready() {
            let deadline = Instant::now() + self.idle;
            self.deadline.as_mut().reset(deadline);
            return read;
        }
        match self.deadline.as_mut().poll(context) {
            Poll::Ready(()) => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            Poll::Pending => Poll::Pending,
        }
    }
}

impl AsyncWrite for Client {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
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

    use tokio::io::AsyncReadExt;
    use tokio_modbus::client::{Client as _, Context as Master, Reader as _, Writer as _, tcp};
    use tokio_modbus::slave::SlaveContext as _;

    use super::*;
    use crate::latest::latest;
    use crate::status::tests::distinct;

    /// A running server on a free port, with `clients` places.
    async fn start(clients: u8, idle: Duration) -> (SocketAddr, crate::latest::Publisher<BoxStatus>) {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let mut server = ModbusServer::bind(address, clients).await.unwrap();
        server.idle = idle;
        let address = server.local_address().unwrap();
        let (publisher, reader) = latest(distinct());
        tokio::spawn(server.run(reader));
        (address, publisher)
    }

    async fn connect(address: SocketAddr) -> Master {
        tcp::connect(address).await.unwrap()
    }

    #[tokio::test]
    async fn input_and_holding_registers_show_the_latest_status() {
        let (address, mut publisher) = start(1, IDLE).await;
        let mut client = connect(address).await;
        client.set_slave(tokio_modbus::Slave(17));
        let expected = registers(&distinct(), 64, 125).unwrap();
        assert_eq!(client.read_input_registers(64, 125).await.unwrap().unwrap(), expected);
        assert_eq!(client.read_holding_registers(64, 125).await.unwrap().unwrap(), expected);

        let mut next = distinct();
        next.counters.cycles = 5;
        publisher.publish(&next);
        assert_eq!(client.read_input_registers(16, 4).await.unwrap().unwrap(), [0, 0, 0, 5]);
    }

    #[tokio::test]
    async fn writing_is_an_illegal_function_and_the_rest_of_the_space_an_illegal_address() {
        let (address, _publisher) = start(1, IDLE).await;
        let mut client = connect(address).await;
        assert_eq!(client.write_single_register(0, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
        assert_eq!(
            client.write_multiple_registers(0, &[1, 2]).await.unwrap(),
            Err(ExceptionCode::IllegalFunction)
        );
        assert_eq!(client.write_single_coil(0, true).await.unwrap(), Err(ExceptionCode::IllegalFunction));
        assert_eq!(client.masked_write_register(0, 1, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
        let both = client.read_write_multiple_registers(0, 1, 0, &[1]).await.unwrap();
        assert_eq!(both, Err(ExceptionCode::IllegalFunction));
        assert_eq!(client.read_coils(0, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
        assert_eq!(
            client.read_input_registers(4159, 2).await.unwrap(),
            Err(ExceptionCode::IllegalDataAddress)
        );
        assert_eq!(client.read_input_registers(0, 126).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
        // Still served after all that.
        assert_eq!(client.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);
    }

    #[tokio::test]
    async fn the_number_of_clients_is_bounded_and_a_place_becomes_free_again() {
        let (address, _publisher) = start(1, IDLE).await;
        let mut first = connect(address).await;
        assert_eq!(first.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);

        let mut second = TcpStream::connect(address).await.unwrap();
        assert_eq!(second.read(&mut [0; 1]).await.unwrap(), 0, "closed by the server");

        first.disconnect().await.unwrap();
        let deadline = Instant::now() + Duration::from_secs(5);
        loop {
            let mut third = connect(address).await;
            if let Ok(Ok(values)) = third.read_input_registers(0, 1).await {
                assert_eq!(values, [1]);
                break;
            }
            assert!(Instant::now() < deadline, "the place stays taken");
            sleep(Duration::from_millis(5)).await;
        }
    }

    #[tokio::test]
    async fn a_silent_client_loses_its_place() {
        let (address, _publisher) = start(1, Duration::from_millis(50)).await;
        let mut silent = TcpStream::connect(address).await.unwrap();
        let ended = tokio::time::timeout(Duration::from_secs(5), silent.read(&mut [0; 1])).await;
        assert_eq!(ended.unwrap().unwrap(), 0);
    }

    #[tokio::test]
    async fn a_malformed_request_costs_only_its_own_connection() {
        use tokio::io::AsyncWriteExt;

        let (address, _publisher) = start(2, IDLE).await;
        let mut other = connect(address).await;
        let mut bad = TcpStream::connect(address).await.unwrap();
        // Protocol identifier 1 instead of 0.
        bad.write_all(&[0, 1, 0, 1, 0, 6, 1, 4, 0, 0, 0, 1]).await.unwrap();
        assert_eq!(bad.read(&mut [0; 1]).await.unwrap(), 0);
        assert_eq!(other.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);
    }
}
