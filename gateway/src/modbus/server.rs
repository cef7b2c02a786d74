//! The server: a bounded number of clients, each answered from the latest status.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use profile_cip::device::hosts::Hosts;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep, sleep};
use tokio_modbus::prelude::{ExceptionCode, Request, Response, SlaveRequest};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;

use super::map::{Refusal, registers};
use super::parameters::Parameters;
use crate::latest::Reader;
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::places::{Place, Places};
use crate::status::BoxStatus;
use crate::sys::clock::monotonic_now;

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
    hosts: Hosts,
    idle: Duration,
    parameters: Parameters,
    limit: Arc<LineLimit>,
}

impl ModbusServer {
    /// Listens at `address` for at most `clients_max` clients at once.
    ///
    /// # Errors
    /// The address cannot be had.
    pub async fn bind(address: SocketAddr, clients_max: u8) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        Ok(Self {
            listener,
            clients_max,
            hosts: Hosts::EVERYBODY,
            idle: IDLE,
            parameters: Parameters::default(),
            limit: Arc::default(),
        })
    }

    /// The same with registers that are parameters of drives.
    #[must_use]
    pub fn with_parameters(self, parameters: Parameters) -> Self {
        Self { parameters, ..self }
    }

    /// Serves these hosts and nobody else.
    #[must_use]
    pub fn serve(self, hosts: Hosts) -> Self {
        Self { hosts, ..self }
    }

    /// Shares the limit of lines that peers can have written with others.
    #[must_use]
    pub fn limit_lines(self, limit: Arc<LineLimit>) -> Self {
        Self { limit, ..self }
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
        let places = Places::new(usize::from(self.clients_max), self.hosts);
        let source: Arc<dyn StatusSource> = Arc::new(source);
        let (idle, parameters, limit) = (self.idle, self.parameters, self.limit);
        let on_connected = |stream: TcpStream, peer: SocketAddr| {
            let place = places.take(peer.ip());
            let (source, parameters, limit) = (Arc::clone(&source), parameters.clone(), Arc::clone(&limit));
            async move {
                let place = match place {
                    Ok(place) => place,
                    Err(error) => {
                        if limit.admits(monotonic_now(), LineKind::Modbus, Peer::Host(peer.ip())) {
                            tracing::warn!(%peer, "Modbus client refused: {error}");
                        }
                        return Ok(None);
                    }
                };
                tracing::debug!(%peer, "Modbus client connected");
                Ok(Some((Registers { source, parameters }, Client::new(stream, place, idle))))
            }
        };
        let on_error = |error: io::Error| tracing::debug!(%error, "Modbus client gone");
        Server::new(self.listener).serve(&on_connected, on_error).await
    }
}

/// Answers one client.
struct Registers {
    source: Arc<dyn StatusSource>,
    parameters: Parameters,
}

impl Service for Registers {
    type Request = SlaveRequest<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Pin<Box<dyn Future<Output = Result<Response, ExceptionCode>> + Send>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        let (source, parameters) = (Arc::clone(&self.source), self.parameters.clone());
        let read = async move |address, count| {
            if parameters.has(address) {
                return parameters.read(address, count).await;
            }
            registers(&source.status(), address, count).map_err(|refusal| match refusal {
                Refusal::Address => ExceptionCode::IllegalDataAddress,
                Refusal::Count => ExceptionCode::IllegalDataValue,
            })
        };
        let parameters = self.parameters.clone();
        let write = async move |address, words: &[u16]| match parameters.has(address) {
            true => parameters.write(address, words).await,
            false => Err(ExceptionCode::IllegalFunction),
        };
        Box::pin(async move {
            match request.request {
                Request::ReadInputRegisters(address, count) => {
                    read(address, count).await.map(Response::ReadInputRegisters)
                }
                Request::ReadHoldingRegisters(address, count) => {
                    read(address, count).await.map(Response::ReadHoldingRegisters)
                }
                Request::WriteSingleRegister(address, word) => {
                    write(address, &[word]).await.map(|()| Response::WriteSingleRegister(address, word))
                }
                Request::WriteMultipleRegisters(address, words) => {
                    let count = u16::try_from(words.len()).unwrap_or(u16::MAX);
                    let written = write(address, &words).await;
                    written.map(|()| Response::WriteMultipleRegisters(address, count))
                }
                _ => Err(ExceptionCode::IllegalFunction),
            }
        })
    }
}

/// A client's connection with its place among the clients; it ends when nothing comes for too long.
struct Client {
    stream: TcpStream,
    idle: Duration,
    deadline: Pin<Box<Sleep>>,
    _place: Place,
}

impl Client {
    fn new(stream: TcpStream, place: Place, idle: Duration) -> Self {
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

    use profile_generic::parameter::Parameter;
    use tokio::io::AsyncReadExt;
    use tokio_modbus::client::{Client as _, Context as Master, Reader as _, Writer as _, tcp};
    use tokio_modbus::slave::SlaveContext as _;

    use super::super::parameters::Binding;
    use super::*;
    use crate::engine::parameter::ParameterFailure;
    use crate::engine::registers::{RegisterAnswer, RegisterEnd, RegisterRequest};
    use crate::latest::latest;
    use crate::modbus::map::Kind;
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

    /// Behind the map a client reads and writes parameters of drives; what is beside them is not there.
    #[tokio::test]
    async fn registers_of_parameters_are_read_and_written_through_the_engine() {
        let (requests, mut taken) = rtrb::RingBuffer::<RegisterRequest>::new(4);
        let (mut given, answers) = rtrb::RingBuffer::new(4);
        let binding =
            |register, kind, write| Binding { register, kind, axis: 1, parameter: Parameter(0x8001), write };
        let bindings = vec![binding(4_160, Kind::I32, true), binding(4_162, Kind::U16, true)];
        let (parameters, hub) = Parameters::new(bindings, RegisterEnd { requests, answers });
        tokio::spawn(hub.run());
        // A drive that holds what was written last, and takes up to 1000.
        tokio::spawn(async move {
            let mut held = -123_456;
            loop {
                while let Ok(request) = taken.pop() {
                    let result = match request.wanted {
                        Some(wanted) if wanted > 1_000 => Err(ParameterFailure::Value.into()),
                        Some(wanted) => {
                            held = wanted;
                            Ok(wanted)
                        }
                        None => Ok(held),
                    };
                    given.push(RegisterAnswer { id: request.id, result }).unwrap();
                }
                sleep(Duration::from_millis(1)).await;
            }
        });
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let server = ModbusServer::bind(address, 2).await.unwrap().with_parameters(parameters);
        let address = server.local_address().unwrap();
        let (_publisher, reader) = latest(distinct());
        tokio::spawn(server.run(reader));
        let mut client = connect(address).await;
        // -123456 is FFFE 1DC0.
        assert_eq!(client.read_holding_registers(4_160, 2).await.unwrap().unwrap(), [0xFFFE, 0x1DC0]);
        assert_eq!(client.read_input_registers(4_160, 2).await.unwrap().unwrap(), [0xFFFE, 0x1DC0]);
        assert_eq!(client.write_multiple_registers(4_160, &[0, 700]).await.unwrap(), Ok(()));
        assert_eq!(client.read_holding_registers(4_162, 1).await.unwrap().unwrap(), [700]);
        assert_eq!(client.write_single_register(4_162, 900).await.unwrap(), Ok(()));
        assert_eq!(client.read_holding_registers(4_160, 2).await.unwrap().unwrap(), [0, 900]);
        let refused = client.write_single_register(4_162, 1_001).await.unwrap();
        assert_eq!(refused, Err(ExceptionCode::IllegalDataValue));
        assert_eq!(client.read_holding_registers(4_162, 1).await.unwrap().unwrap(), [900]);
        for (register, count) in [(4_160, 3), (4_160, 1), (4_161, 1), (4_163, 1), (4_159, 2)] {
            let refused = client.read_holding_registers(register, count).await.unwrap();
            assert_eq!(refused, Err(ExceptionCode::IllegalDataAddress), "{register} {count}");
        }
        assert_eq!(client.write_single_register(0, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
        assert_eq!(client.read_input_registers(0, 1).await.unwrap().unwrap(), [1], "the map as before");
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
