//! The server: a bounded number of connections on a thread of its own.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::http::Request;
use hyper::body::Incoming;
use hyper::service::Service;
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use profile_cip::device::hosts::Hosts;
use rustls::ServerConfig;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::{Semaphore, oneshot};
use tokio_rustls::TlsAcceptor;

use super::access::Token;
use super::events::Events;
use super::limits::{HEADER_TIME_OUT, Peer, STALL_TIME_OUT, builder};
use super::login::{Gate, Remote};
use super::parameters::Readers;
use super::routes::{Sources, routes};
use super::view::View;
use crate::line_limit::{LineKind, LineLimit, Peer as LinePeer};
use crate::local::Door;
use crate::places::Places;
use crate::sys::clock::monotonic_now;
use crate::sys::thread::{self, STACK};

/// Pause after accepting has failed, mostly because the process has no descriptors left.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Nice value of the thread: it runs when no other thread of the gateway needs the processor.
const NICE: i32 = 10;

/// A server that listens; [`HttpServer::start`] lets it answer.
#[derive(Debug)]
pub struct HttpServer {
    listener: TcpListener,
    connections_max: usize,
    clients: Hosts,
    header_time_out: Duration,
    stall_time_out: Duration,
    limit: Arc<LineLimit>,
    tls: Option<Arc<ServerConfig>>,
    control: Option<(Token, Door)>,
    parameters: Option<Door>,
}

/// A server that answers until this is dropped.
#[derive(Debug)]
pub struct RunningServer {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for RunningServer {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A panic has been printed where it happened.
            let _ = thread.join();
        }
    }
}

/// What the server counts of itself.
#[derive(Debug, Default)]
pub struct Load {
    accepted: AtomicU64,
    refused: AtomicU64,
}

/// The counters at one moment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Connections that were accepted.
    pub accepted: u64,
    /// Connections that were closed because too many were open, or the host is not served.
    pub refused: u64,
}

impl Load {
    /// The counters now.
    pub fn read(&self) -> Counts {
        Counts {
            accepted: self.accepted.load(Ordering::Relaxed),
            refused: self.refused.load(Ordering::Relaxed),
        }
    }
}

impl HttpServer {
    /// Listens at `address` for at most `connections_max` connections at once, half of them for pages.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn bind(address: SocketAddr, connections_max: u16) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            listener,
            connections_max: usize::from(connections_max),
            clients: Hosts::EVERYBODY,
            header_time_out: HEADER_TIME_OUT,
            stall_time_out: STALL_TIME_OUT,
            limit: Arc::default(),
            tls: None,
            control: None,
            parameters: None,
        })
    }

    /// Serves these hosts and nobody else.
    #[must_use]
    pub fn serve(self, clients: Hosts) -> Self {
        Self { clients, ..self }
    }

    /// Shares the limit of lines that peers can have written with others.
    #[must_use]
    pub fn limit_lines(self, limit: Arc<LineLimit>) -> Self {
        Self { limit, ..self }
    }

    /// Encrypts every connection.
    #[must_use]
    pub fn encrypt(self, config: Arc<ServerConfig>) -> Self {
        Self { tls: Some(config), ..self }
    }

    /// Lets those who have the token control axes, through this door.
    #[must_use]
    pub fn control(self, token: Token, door: Door) -> Self {
        Self { control: Some((token, door)), ..self }
    }

    /// Lets everybody read the parameters of drives, through this door.
    #[must_use]
    pub fn read_parameters(self, door: Door) -> Self {
        Self { parameters: Some(door), ..self }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's error.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Sets how long a peer may take for its request, and how long it may leave an answer unread.
    #[cfg(test)]
    pub(super) fn limit_times(&mut self, header: Duration, stall: Duration) {
        (self.header_time_out, self.stall_time_out) = (header, stall);
    }

    /// Answers on a thread of its own.
    ///
    /// # Errors
    /// The system refuses the thread or its runtime.
    pub fn start(self, view: View) -> io::Result<RunningServer> {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().thread_stack_size(STACK).build()?;
        let (stop, stopped) = oneshot::channel::<()>();
        let run = move || {
            // It never needs a privilege to be nicer; without it the server works all the same.
            let _ = rustix::process::setpriority_process(None, NICE);
            runtime.block_on(async {
                tokio::select! {
                    ended = self.run(view) => if let Err(error) = ended {
                        tracing::warn!(%error, "HTTP ended");
                    },
                    _ = stopped => {}
                }
            });
            // The connections end with the runtime.
        };
        let thread = thread::named("axisbridge-http", STACK).spawn(run)?;
        Ok(RunningServer { stop: Some(stop), thread: Some(thread) })
    }

    /// Answers until the future is dropped. A connection above the limit is closed at once.
    async fn run(self, view: View) -> io::Result<()> {
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let view = Arc::new(view);
        let events = Arc::new(Events::new(Arc::clone(&view), self.connections_max / 2));
        let load = Arc::new(Load::default());
        let router = routes(Sources {
            view,
            events: Arc::clone(&events),
            load: Arc::clone(&load),
            downloads: Arc::new(Semaphore::new(1)),
            readers: self.parameters.map(|door| Arc::new(Readers::new(door))),
            gate: self.control.map(|(token, door)| Arc::new(Gate::new(token, door, Arc::clone(&self.limit)))),
            encrypted: self.tls.is_some(),
        });
        let tls = self.tls.map(TlsAcceptor::from);
        let places = Places::new(self.connections_max, self.clients);
        tokio::spawn(async move { events.run().await });
        loop {
            let (stream, peer) = match listener.accept().await {
                Ok(accepted) => accepted,
                Err(error) => {
                    tracing::debug!(%error, "no HTTP connection can be accepted");
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                    continue;
                }
            };
            let place = match places.take(peer.ip()) {
                Ok(place) => place,
                Err(error) => {
                    load.refused.fetch_add(1, Ordering::Relaxed);
                    if self.limit.admits(monotonic_now(), LineKind::Http, LinePeer::Host(peer.ip())) {
                        tracing::warn!(%peer, "HTTP connection refused: {error}");
                    }
                    continue;
                }
            };
            load.accepted.fetch_add(1, Ordering::Relaxed);
            // Small messages of a control stream do not wait for one another. Without it they are only later.
            let _ = stream.set_nodelay(true);
            let stream = Peer::new(stream, self.stall_time_out, place);
            let connection = Connection {
                router: router.clone(),
                from: Remote(peer),
                header_time_out: self.header_time_out,
            };
            match tls.clone() {
                None => drop(tokio::spawn(connection.serve(stream))),
                Some(tls) => drop(tokio::spawn(connection.encrypt(stream, tls))),
            }
        }
    }
}

/// A connection that was accepted.
struct Connection {
    router: Router,
    from: Remote,
    header_time_out: Duration,
}

impl Connection {
    /// Answers its one request after the handshake, which may take as long as the head of a request.
    async fn encrypt(self, stream: Peer, tls: TlsAcceptor) {
        match tokio::time::timeout(self.header_time_out, tls.accept(stream)).await {
            Ok(Ok(stream)) => self.serve(stream).await,
            Ok(Err(error)) => tracing::debug!(%error, "no TLS handshake"),
            Err(_) => tracing::debug!("no TLS handshake in time"),
        }
    }

    /// Answers its one request.
    async fn serve(self, stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static) {
        let service = Named { inner: TowerToHyperService::new(self.router), from: self.from };
        let connection = builder(self.header_time_out).serve_connection(TokioIo::new(stream), service);
        if let Err(error) = connection.with_upgrades().await {
            tracing::debug!(%error, "HTTP connection gone");
        }
    }
}

/// The router, with the host that asks in each request.
struct Named {
    inner: TowerToHyperService<Router>,
    from: Remote,
}

impl Service<Request<Incoming>> for Named {
    type Response = <TowerToHyperService<Router> as Service<Request<Incoming>>>::Response;
    type Error = <TowerToHyperService<Router> as Service<Request<Incoming>>>::Error;
    type Future = <TowerToHyperService<Router> as Service<Request<Incoming>>>::Future;

    fn call(&self, mut request: Request<Incoming>) -> Self::Future {
        request.extensions_mut().insert(self.from);
        self.inner.call(request)
    }
}
