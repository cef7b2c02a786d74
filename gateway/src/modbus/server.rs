//! The server: a bounded number of clients, each answered from the latest status.
//!
//! The requests are parsed by `tokio-modbus`; its server is not used, because it ends with all of its clients when one cannot be
//! accepted.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use profile_cip::device::hosts::Hosts;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tokio_modbus::bytes::Bytes;
use tokio_modbus::prelude::{ExceptionCode, Request};

use super::map::{Refusal, registers};
use super::parameters::Parameters;
use crate::latest::Reader;
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::places::{Place, Places};
use crate::status::BoxStatus;
use crate::sys::clock::monotonic_now;

/// A client that has sent no request for this long gives its place up, and so does one that has not taken an answer.
const IDLE: Duration = Duration::from_secs(120);

/// How long nobody is accepted after somebody could not be.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Transaction identifier, protocol identifier, length, unit identifier.
const HEADER_LEN: usize = 7;

/// Longest request behind it.
const PDU_MAX: usize = 253;

/// Set in the function code of an exception.
const EXCEPTION: u8 = 0x80;

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
    pub async fn run(self, source: impl StatusSource) {
        let Self { listener, clients_max, hosts, idle, parameters, limit } = self;
        let registers = Arc::new(Registers { source: Box::new(source), parameters });
        let places = Places::new(usize::from(clients_max), hosts);
        serve(
            (places, &limit),
            |context| listener.poll_accept(context),
            |stream, place| answer(stream, place, Arc::clone(&registers), idle),
        )
        .await;
    }
}

/// Accepts clients, each of which is served by a task until the future is dropped.
async fn serve<F: Future<Output = io::Result<()>> + Send + 'static>(
    (places, limit): (Arc<Places>, &LineLimit),
    mut accept: impl FnMut(&mut Context<'_>) -> Poll<io::Result<(TcpStream, SocketAddr)>>,
    client: impl Fn(TcpStream, Place) -> F,
) {
    let mut clients = JoinSet::new();
    let mut is_failing = false;
    loop {
        let accepted = tokio::select! {
            accepted = std::future::poll_fn(&mut accept) => accepted,
            Some(_) = clients.join_next() => continue,
        };
        let (stream, peer) = match accepted {
            Ok(accepted) => accepted,
            // The process may have no file descriptor left for now, or the client is gone already.
            Err(error) => {
                if !is_failing {
                    tracing::warn!(%error, "a Modbus client cannot be accepted");
                }
                is_failing = true;
                sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        is_failing = false;
        match places.take(peer.ip()) {
            Ok(place) => {
                tracing::debug!(%peer, "Modbus client connected");
                let served = client(stream, place);
                clients.spawn(async move {
                    if let Err(error) = served.await {
                        tracing::debug!(%peer, %error, "Modbus client gone");
                    }
                });
            }
            Err(error) if limit.admits(monotonic_now(), LineKind::Modbus, Peer::Host(peer.ip())) => {
                tracing::warn!(%peer, "Modbus client refused: {error}");
            }
            Err(_) => {}
        }
    }
}

/// Answers the requests of one client, which holds its place meanwhile. It ends with the connection, with what is no request, and when
/// no whole request comes or an answer is not taken for too long.
async fn answer(
    mut stream: TcpStream,
    _place: Place,
    registers: Arc<Registers>,
    idle: Duration,
) -> io::Result<()> {
    loop {
        let ([transaction @ .., unit], pdu) = timeout(idle, request(&mut stream)).await??;
        let request = Request::try_from(Bytes::from(pdu))?;
        let function = request.function_code().value();
        let (function, data) = match registers.answer(request).await {
            Ok(data) => (function, data),
            Err(exception) => (function | EXCEPTION, vec![exception.into()]),
        };
        // At most 252 bytes of data.
        let len = u16::try_from(2 + data.len()).map_err(io::Error::other)?;
        let [high, low] = len.to_be_bytes();
        let [first, second] = transaction;
        let head = [first, second, 0, 0, high, low, unit, function];
        timeout(idle, stream.write_all(&[&head, data.as_slice()].concat())).await??;
    }
}

/// Receives a request: its transaction identifier and unit identifier, and its PDU.
async fn request(stream: &mut TcpStream) -> io::Result<([u8; 3], Vec<u8>)> {
    let mut header = [0; HEADER_LEN];
    stream.read_exact(&mut header).await?;
    let [first, second, protocol @ .., high, low, unit] = header;
    // The unit identifier counts.
    let len = usize::from(u16::from_be_bytes([high, low])).saturating_sub(1);
    let malformed = || io::Error::new(io::ErrorKind::InvalidData, "no Modbus TCP header");
    if !(1..=PDU_MAX).contains(&len) {
        return Err(malformed());
    }
    let mut pdu = vec![0; len];
    // A connection that is closed with unread data is reset.
    stream.read_exact(&mut pdu).await?;
    if protocol != [0; 2] {
        return Err(malformed());
    }
    Ok(([first, second, unit], pdu))
}

/// Answers requests.
struct Registers {
    source: Box<dyn StatusSource>,
    parameters: Parameters,
}

impl Registers {
    /// What follows the function code in the answer.
    async fn answer(&self, request: Request<'_>) -> Result<Vec<u8>, ExceptionCode> {
        match request {
            Request::ReadInputRegisters(address, count) | Request::ReadHoldingRegisters(address, count) => {
                let words = self.read(address, count).await?;
                let bytes = words.iter().flat_map(|word| word.to_be_bytes());
                let len = u8::try_from(2 * words.len()).map_err(|_| ExceptionCode::IllegalDataValue)?;
                Ok(std::iter::once(len).chain(bytes).collect())
            }
            Request::WriteSingleRegister(address, word) => {
                self.write(address, &[word]).await?;
                Ok([address.to_be_bytes(), word.to_be_bytes()].concat())
            }
            Request::WriteMultipleRegisters(address, words) => {
                self.write(address, &words).await?;
                let count = u16::try_from(words.len()).unwrap_or(u16::MAX);
                Ok([address.to_be_bytes(), count.to_be_bytes()].concat())
            }
            _ => Err(ExceptionCode::IllegalFunction),
        }
    }

    async fn read(&self, address: u16, count: u16) -> Result<Vec<u16>, ExceptionCode> {
        if self.parameters.has(address) {
            return self.parameters.read(address, count).await;
        }
        registers(&self.source.status(), address, count).map_err(|refusal| match refusal {
            Refusal::Address => ExceptionCode::IllegalDataAddress,
            Refusal::Count => ExceptionCode::IllegalDataValue,
        })
    }

    async fn write(&self, address: u16, words: &[u16]) -> Result<(), ExceptionCode> {
        match self.parameters.has(address) {
            true => self.parameters.write(address, words).await,
            false => Err(ExceptionCode::IllegalFunction),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use profile_generic::parameter::Parameter;
    use tokio::time::Instant;
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
        let (address, _publisher) = start(2, IDLE).await;
        let mut other = connect(address).await;
        let mut bad = TcpStream::connect(address).await.unwrap();
        // Protocol identifier 1 instead of 0.
        bad.write_all(&[0, 1, 0, 1, 0, 6, 1, 4, 0, 0, 0, 1]).await.unwrap();
        assert_eq!(bad.read(&mut [0; 1]).await.unwrap(), 0);
        assert_eq!(other.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);
    }

    /// A client that asks without end and reads no answer.
    #[tokio::test]
    async fn a_client_that_takes_no_answers_loses_its_place() {
        let (address, _publisher) = start(1, Duration::from_millis(300)).await;
        let mut deaf = TcpStream::connect(address).await.unwrap();
        let read_all = [0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0, 125];
        let requests = read_all.repeat(512);
        deaf.write_all(&requests).await.unwrap();
        let asks = tokio::spawn(async move {
            while deaf.write_all(&requests).await.is_ok() {}
            sleep(Duration::from_secs(60)).await;
            drop(deaf);
        });
        let deadline = Instant::now() + Duration::from_secs(20);
        loop {
            let mut other = connect(address).await;
            if let Ok(Ok(values)) = other.read_input_registers(0, 1).await {
                assert_eq!(values, [1]);
                break;
            }
            assert!(Instant::now() < deadline, "the place stays taken");
            sleep(Duration::from_millis(50)).await;
        }
        asks.abort();
    }

    #[tokio::test]
    async fn a_client_that_cannot_be_accepted_ends_neither_the_server_nor_the_others() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
        let address = listener.local_addr().unwrap();
        let (_publisher, reader) = latest(distinct());
        let registers = Arc::new(Registers { source: Box::new(reader), parameters: Parameters::default() });
        // Every second client is gone before it is accepted.
        let mut accepted = 0;
        let accept = move |context: &mut Context<'_>| {
            let result = listener.poll_accept(context);
            accepted += u32::from(result.is_ready());
            match result {
                Poll::Ready(_) if accepted % 2 == 0 => {
                    Poll::Ready(Err(io::ErrorKind::ConnectionAborted.into()))
                }
                other => other,
            }
        };
        tokio::spawn(async move {
            let limit = LineLimit::default();
            serve((Places::new(4, Hosts::EVERYBODY), &limit), accept, |stream, place| {
                answer(stream, place, Arc::clone(&registers), IDLE)
            })
            .await;
        });
        let mut first = connect(address).await;
        assert_eq!(first.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);
        let mut second = TcpStream::connect(address).await.unwrap();
        assert_eq!(second.read(&mut [0; 1]).await.unwrap_or(0), 0, "not accepted");
        let mut third = connect(address).await;
        assert_eq!(third.read_input_registers(0, 1).await.unwrap().unwrap(), [1]);
        assert_eq!(first.read_input_registers(0, 1).await.unwrap().unwrap(), [1], "connected as before");
    }
}
