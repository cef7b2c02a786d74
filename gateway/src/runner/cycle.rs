//! The cycle thread: sleeps until the engine's next cycle is due, and runs it.

use std::io;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::port::{OpenPort, UdpPort};
use crate::engine::Engine;
use crate::engine::axis::STOP_TIME_OUT;
use crate::engine::axis::rest::Unrested;
use crate::engine::port::{NorthPort, SouthPort};
use crate::sys::clock;
use crate::sys::memory::return_freed_memory;
use crate::sys::realtime;
use crate::sys::thread::{self, STACK};
use crate::time::feed::TimeFeed;

/// What the thread is asked for: to go on, to stop the axes and end, to end without waiting for them.
const RUN: u8 = 0;
const STOP: u8 = 1;
const HURRY: u8 = 2;

/// How long the buses may take to go down.
const DOWN_TIME_OUT: Duration = Duration::from_secs(5);

/// How long the thread may take to its end: longer than the engine waits for any axis.
fn end_limit() -> Duration {
    let stop = u64::try_from(STOP_TIME_OUT.as_nanos()).unwrap_or_default();
    2 * Duration::from_nanos(stop) + 2 * DOWN_TIME_OUT
}

/// How the thread has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// The buses are down; these axes did not come to rest before, or were not seen to.
    Down(Vec<Unrested>),
    /// It has not ended, or ended by a panic: nothing is known.
    Unknown,
}

/// What the thread gets.
pub struct Setup {
    /// The engine; the cycle thread takes it over.
    pub engine: Engine,
    /// A port for each device.
    pub north: Vec<UdpPort>,
    /// The port of each bus.
    pub south: Vec<OpenPort>,
    /// Where system time comes from.
    pub time: TimeFeed,
    /// What to ask of the kernel.
    pub realtime: realtime::Request,
}

/// The running thread.
#[derive(Debug)]
pub struct CycleThread {
    thread: JoinHandle<Vec<Unrested>>,
    asked: Arc<AtomicU8>,
    realtime: Arc<OnceLock<String>>,
}

impl CycleThread {
    /// Starts it.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(setup: Setup) -> io::Result<Self> {
        let asked = Arc::new(AtomicU8::new(RUN));
        let realtime = Arc::new(OnceLock::new());
        let (wish, told) = (Arc::clone(&asked), Arc::clone(&realtime));
        let thread = thread::named("axisbridge-cycle", STACK).spawn(move || {
            return_freed_memory();
            let report = realtime::apply(&setup.realtime);
            let _ = told.set(report.refused().map(ToString::to_string).collect::<Vec<_>>().join("; "));
            run(setup, &wish)
        })?;
        Ok(Self { thread, asked, realtime })
    }

    /// What was refused of the asked-for real-time properties.
    pub fn realtime_report(&self) -> String {
        self.realtime.get().cloned().unwrap_or_default()
    }

    /// Whether it has ended.
    pub fn is_dead(&self) -> bool {
        self.thread.is_finished()
    }

    /// Asks it to stop the axes and to end, and waits until they stand or have had the time for it, or `hurry` says that there is
    /// none.
    pub fn stop(self, hurry: &dyn Fn() -> bool) -> Ended {
        self.asked.store(STOP, Ordering::Relaxed);
        let mut end = Instant::now() + end_limit();
        while !self.thread.is_finished() && Instant::now() < end {
            if hurry() && self.asked.swap(HURRY, Ordering::Relaxed) != HURRY {
                end = Instant::now() + DOWN_TIME_OUT;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        if !self.thread.is_finished() {
            return Ended::Unknown;
        }
        // A panic has been printed where it happened.
        self.thread.join().map_or(Ended::Unknown, Ended::Down)
    }
}

fn run(setup: Setup, asked: &AtomicU8) -> Vec<Unrested> {
    let Setup { mut engine, mut north, mut south, mut time, .. } = setup;
    time.begin(&mut engine);
    let mut ports: Vec<&mut dyn NorthPort> =
        north.iter_mut().map(|port| port as &mut dyn NorthPort).collect();
    let mut buses: Vec<SouthPort<'_>> = south.iter_mut().map(OpenPort::port).collect();
    let mut obeyed = RUN;
    loop {
        let asked = asked.load(Ordering::Relaxed);
        if asked != RUN && obeyed == RUN {
            engine.stop(clock::monotonic_now());
        }
        if asked == HURRY && obeyed != HURRY {
            engine.hurry(clock::monotonic_now());
        }
        obeyed = asked;
        let due = engine.cycle(clock::monotonic_now(), &mut ports, &mut buses);
        time.feed(&mut engine);
        if engine.is_stopped() || clock::sleep_until(due).is_err() {
            return engine.unrested().to_vec();
        }
    }
}
