//! The cycle thread: sleeps until the engine's next cycle is due, and runs it.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::port::{OpenPort, UdpPort};
use crate::engine::Engine;
use crate::engine::port::{NorthPort, SouthPort};
use crate::sys::clock::{self, SystemClock};
use crate::sys::realtime;

/// What the thread gets.
pub struct Setup {
    /// The engine.
    pub engine: Engine,
    /// A port for each device.
    pub north: Vec<UdpPort>,
    /// The port of each bus.
    pub south: Vec<OpenPort>,
    /// What to ask of the kernel.
    pub realtime: realtime::Request,
}

/// The running thread.
#[derive(Debug)]
pub struct CycleThread {
    thread: JoinHandle<()>,
    stop: Arc<AtomicBool>,
    realtime: Arc<OnceLock<String>>,
}

impl CycleThread {
    /// Starts it.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(setup: Setup) -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let realtime = Arc::new(OnceLock::new());
        let (asked, told) = (Arc::clone(&stop), Arc::clone(&realtime));
        let thread = std::thread::Builder::new().name("axisbridge-cycle".to_owned()).spawn(move || {
            let report = realtime::apply(&setup.realtime);
            let _ = told.set(report.refused().map(ToString::to_string).collect::<Vec<_>>().join("; "));
            run(setup, &asked);
        })?;
        Ok(Self { thread, stop, realtime })
    }

    /// What was refused of the asked-for real-time properties.
    pub fn realtime_report(&self) -> String {
        self.realtime.get().cloned().unwrap_or_default()
    }

    /// Whether it has ended.
    pub fn is_dead(&self) -> bool {
        self.thread.is_finished()
    }

    /// Asks it to stop the axes and to end, and waits for at most `limit`.
    pub fn stop(self, limit: Duration) {
        self.stop.store(true, Ordering::Relaxed);
        let end = Instant::now() + limit;
        while !self.thread.is_finished() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(2));
        }
        if self.thread.is_finished() {
            // A panic has been printed where it happened.
            let _ = self.thread.join();
        }
    }
}

fn run(setup: Setup, stop: &AtomicBool) {
    let Setup { mut engine, mut north, mut south, .. } = setup;
    let clock = SystemClock::detect();
    let mut ports: Vec<&mut dyn NorthPort> =
        north.iter_mut().map(|port| port as &mut dyn NorthPort).collect();
    let mut buses: Vec<SouthPort<'_>> = south.iter_mut().map(OpenPort::port).collect();
    let mut stopping = false;
    loop {
        if stop.load(Ordering::Relaxed) && !stopping {
            stopping = true;
            engine.stop(clock::monotonic_now(), clock.now());
        }
        let due = engine.cycle(clock::monotonic_now(), clock.now(), &mut ports, &mut buses);
        if engine.is_stopped() {
            return;
        }
        if clock::sleep_until(due).is_err() {
            return;
        }
    }
}
