//! Asking the kernel for real-time treatment of the calling thread.
//!
//! Every measure may be refused: by missing privilege, by a control group without real-time budget
//! (`CONFIG_RT_GROUP_SCHED`), by a processor that does not exist. The box then runs on without it, so a
//! refusal is data in a [`Report`], to be shown, and never an error.
#![allow(unsafe_code)]

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::num::NonZeroU64;

use arrayvec::ArrayVec;
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, geteuid, getrlimit};
use rustix::thread::{CpuSet, sched_setaffinity, set_current_timer_slack};

/// The highest priority of `SCHED_FIFO` on Linux; the lowest is 1.
pub const PRIORITY_MAX: u8 = 99;

/// Without real-time scheduling a wake-up may be put off by this much less than the kernel's usual 50 us.
const TIMER_SLACK_NS: Option<NonZeroU64> = NonZeroU64::new(1);

/// Takes the longest time in microseconds that a processor may need to wake, as four octets.
const LATENCY_LIMIT: &str = "/dev/cpu_dma_latency";

/// What to ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Request {
    /// `SCHED_FIFO` priority, 1 to [`PRIORITY_MAX`]; `None` leaves the scheduling class alone.
    pub priority: Option<u8>,
    /// The processor to stay on, from 0; `None` lets the kernel choose.
    pub cpu: Option<u16>,
    /// Keep all memory of the process resident, so that the cycle never waits for a page.
    pub lock_memory: bool,
    /// Let no processor of the host sleep so deep that waking takes time, as long as the [`Report`] lives.
    pub stay_awake: bool,
}

/// One thing asked of the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Wake-ups without the usual slack (asked always: it needs no privilege).
    TimerSlack,
    /// `SCHED_FIFO` with this priority.
    Scheduler {
        /// 1 to 99.
        priority: u8,
    },
    /// Staying on one processor.
    Affinity {
        /// Its number from 0.
        cpu: u16,
    },
    /// Memory locked, including what is allocated later.
    LockMemory,
    /// Memory locked as far as it is allocated now: the process has a limit on locked memory, and locking
    /// what comes later would make allocations fail once the limit is reached.
    LockPresentMemory,
    /// Processors that wake at once (PM QoS limit of 0 us).
    StayAwake,
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimerSlack => f.write_str("timer slack 1 ns"),
            Self::Scheduler { priority } => write!(f, "SCHED_FIFO priority {priority}"),
            Self::Affinity { cpu } => write!(f, "processor {cpu}"),
            Self::LockMemory => f.write_str("memory locked"),
            Self::LockPresentMemory => f.write_str("memory locked as allocated now"),
            Self::StayAwake => f.write_str("processors kept awake"),
        }
    }
}

/// A measure and what became of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// What was asked.
    pub measure: Measure,
    /// `Err` with the kernel's error number when it refused.
    pub result: Result<(), i32>,
}

impl Outcome {
    /// What the person at the machine can do about a refusal.
    #[must_use]
    pub fn hint(&self) -> Option<&'static str> {
        let error = self.result.err()?;
        Some(match (self.measure, error) {
            (Measure::Scheduler { .. }, libc::EPERM) => {
                "needs CAP_SYS_NICE or LimitRTPRIO=, and a control group with real-time budget"
            }
            (Measure::Scheduler { .. }, libc::EINVAL) => "priority must be 1 to 99",
            (Measure::Affinity { .. }, libc::EINVAL) => "no such processor is allowed to this process",
            (Measure::LockMemory | Measure::LockPresentMemory, libc::EPERM | libc::ENOMEM | libc::EAGAIN) => {
                "needs CAP_IPC_LOCK or a higher LimitMEMLOCK="
            }
            (Measure::StayAwake, libc::EACCES | libc::EPERM | libc::ENOENT) => {
                "needs to write to /dev/cpu_dma_latency"
            }
            _ => "the kernel refused",
        })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.result {
            Ok(()) => write!(f, "{}: granted", self.measure),
            Err(number) => {
                let error = io::Error::from_raw_os_error(number);
                let hint = self.hint().unwrap_or("the kernel refused");
                write!(f, "{}: refused ({error}): {hint}", self.measure)
            }
        }
    }
}

/// What the kernel granted and refused. Dropped, it lets the processors sleep again; all else stays with the thread.
#[derive(Debug, Default)]
pub struct Report {
    outcomes: ArrayVec<Outcome, 5>,
    /// The limit holds as long as its file is open.
    awake: Option<File>,
}

impl Report {
    /// Every measure that was asked for, in order.
    #[must_use]
    pub fn outcomes(&self) -> &[Outcome] {
        &self.outcomes
    }

    /// The refused ones.
    pub fn refused(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|outcome| outcome.result.is_err())
    }

    /// Whether everything was granted.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.refused().next().is_none()
    }

    fn stay_awake(&mut self) {
        let asked = OpenOptions::new().write(true).open(LATENCY_LIMIT).and_then(|mut file| {
            file.write_all(&0_i32.to_ne_bytes())?;
            Ok(file)
        });
        let result = asked.map(|file| self.awake = Some(file));
        self.record(Measure::StayAwake, result);
    }

    fn record<E: Into<io::Error>>(&mut self, measure: Measure, result: Result<(), E>) {
        let result = result.map_err(|error| error.into().raw_os_error().unwrap_or(libc::EINVAL));
        self.outcomes.push(Outcome { measure, result });
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, outcome) in self.outcomes.iter().enumerate() {
            if index > 0 {
                f.write_str("; ")?;
            }
            write!(f, "{outcome}")?;
        }
        Ok(())
    }
}

/// Asks for real-time treatment of the calling thread (and, for memory, of the process).
#[must_use]
pub fn apply(request: &Request) -> Report {
    let mut report = Report::default();
    report.record(Measure::TimerSlack, set_current_timer_slack(TIMER_SLACK_NS));

    if request.lock_memory {
        let (measure, flags) = if may_lock_without_limit() {
            (Measure::LockMemory, MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)
        } else {
            (Measure::LockPresentMemory, MlockAllFlags::CURRENT)
        };
        report.record(measure, mlockall(flags));
    }
    if request.stay_awake {
        report.stay_awake();
    }
    if let Some(cpu) = request.cpu {
        // A processor beyond the set leaves it empty, which is refused with EINVAL.
        let mut set = CpuSet::new();
        if usize::from(cpu) < CpuSet::MAX_CPU {
            set.set(usize::from(cpu));
        }
        report.record(Measure::Affinity { cpu }, sched_setaffinity(None, &set));
    }
    if let Some(priority) = request.priority {
        report.record(Measure::Scheduler { priority }, schedule_fifo(priority));
    }
    report
}

fn schedule_fifo(priority: u8) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: i32::from(priority) };
    // SAFETY: `parameters` outlives the call; thread 0 is the calling one.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

fn may_lock_without_limit() -> bool {
    geteuid().is_root() || getrlimit(Resource::Memlock).current.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scheduling policy of the calling thread: field 41 of its `stat`, of which the second ends with a parenthesis.
    fn policy() -> String {
        let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
        stat[stat.rfind(')').unwrap()..].split_whitespace().nth(39).unwrap().to_owned()
    }

    fn on_own_thread(request: Request) -> Report {
        // Scheduling is per thread: a thread of its own keeps the test runner's ones as they are.
        std::thread::spawn(move || apply(&request)).join().unwrap()
    }

    #[test]
    fn staying_on_the_first_allowed_processor_is_granted() {
        let report = on_own_thread(Request { cpu: Some(0), ..Request::default() });
        let affinity = report.outcomes()[1];
        assert_eq!(affinity.measure, Measure::Affinity { cpu: 0 });
        if affinity.result.is_err() {
            println!("SKIPPED: processor 0 is not allowed to this process: {affinity}");
            return;
        }
        assert_eq!(report.to_string(), "timer slack 1 ns: granted; processor 0: granted");
    }

    #[test]
    fn staying_awake_is_granted_or_refused_with_a_reason() {
        let report = on_own_thread(Request { stay_awake: true, ..Request::default() });
        let outcome = report.outcomes()[1];
        assert_eq!(outcome.measure, Measure::StayAwake);
        assert_eq!(
            (report.awake.is_some(), outcome.hint().is_none()),
            (outcome.result.is_ok(), outcome.result.is_ok())
        );
    }

    #[test]
    fn refusals_are_reported_with_a_reason_and_do_not_stop_the_rest() {
        let request = Request { cpu: Some(u16::MAX), priority: Some(100), ..Request::default() };
        let report = on_own_thread(request);
        assert!(!report.is_complete());
        let refused: Vec<_> = report.refused().map(|outcome| (outcome.measure, outcome.result)).collect();
        assert_eq!(
            refused,
            [
                (Measure::Affinity { cpu: u16::MAX }, Err(libc::EINVAL)),
                (Measure::Scheduler { priority: 100 }, Err(libc::EINVAL)),
            ]
        );
        assert_eq!(
            report.outcomes()[2].to_string(),
            "SCHED_FIFO priority 100: refused (Invalid argument (os error 22)): priority must be 1 to 99"
        );
    }

    #[test]
    fn fifo_scheduling_is_granted_or_the_refusal_says_what_is_needed() {
        let scheduler = std::thread::spawn(|| {
            let report = apply(&Request { priority: Some(10), ..Request::default() });
            (report.outcomes()[1], policy())
        });
        let (outcome, policy) = scheduler.join().unwrap();
        match outcome.result {
            Ok(()) => assert_eq!(policy, libc::SCHED_FIFO.to_string()),
            Err(number) => {
                assert_eq!(number, libc::EPERM);
                assert!(outcome.to_string().contains("CAP_SYS_NICE"), "{outcome}");
                println!("SKIPPED: {outcome}");
            }
        }
    }
}
