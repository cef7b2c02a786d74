//! Kernel, processors, real-time privileges and clock.

use std::path::Path;

use super::Check;
use crate::sys::clock::{self, HostTime};
use crate::sys::realtime::{Outcome, Request};

/// Area of the checks of kernel and processors, which come first.
pub(super) const AREA: &str = "kernel";
const REALTIME: &str = "real time";
/// Area of the checks of the clock.
pub(super) const CLOCK: &str = "clock";

/// Clock sources that are read in tens of nanoseconds.
const QUICK_CLOCKS: [&str; 5] =
    ["tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page", "riscv_clocksource"];

/// A sleep that a processor may need so long to wake from matters, us.
const WAKE_MAX_US: u64 = 20;

/// Sleep states of a processor that are looked at; Linux has at most ten.
const SLEEP_STATES: u32 = 10;

/// All that does not depend on the network. `root` is where the files of the kernel are.
pub(super) fn checks(root: &Path, request: Request) -> Vec<Check> {
    let host = Host { root };
    let online = host.processors("online");
    let mut checks = vec![host.preemption()];
    checks.extend(host.virtual_machine());
    checks.push(host.clock_source());
    checks.push(host.processor(request.cpu, &online));
    checks.extend(host.governor(&online));
    checks.extend(host.sleep(request.stay_awake, &online));
    checks.push(discipline(clock::is_disciplined()));
    checks.push(Check::good(CLOCK, "time scale", HostTime.scale().to_string()));
    checks
}

/// What the kernel made of a request of the cycle thread.
pub(super) fn grant(outcome: &Outcome) -> Check {
    let what = outcome.measure.to_string();
    match (outcome.result, outcome.hint()) {
        (Ok(()), _) => Check::good(REALTIME, what, "granted"),
        (Err(number), hint) => {
            let error = std::io::Error::from_raw_os_error(number);
            let advice = hint.unwrap_or("the kernel refused");
            Check::doubtful(REALTIME, what, format!("refused ({error})"), advice)
        }
    }
}

fn discipline(disciplined: bool) -> Check {
    if disciplined {
        return Check::good(CLOCK, "synchronization", "a daemon synchronizes the host's clock");
    }
    Check::doubtful(
        CLOCK,
        "synchronization",
        "no daemon synchronizes the host's clock",
        "run ptp4l with phc2sys, or chronyd; a controller on another host can be synchronous only then",
    )
}

/// The host by its files.
struct Host<'a> {
    root: &'a Path,
}

impl Host<'_> {
    fn file(&self, path: &str) -> Option<String> {
        std::fs::read_to_string(self.root.join(path)).ok().map(|text| text.trim().to_owned())
    }

    fn preemption(&self) -> Check {
        let version = self.file("proc/version").unwrap_or_default();
        // `Linux version 6.12.1 (builder) ... #1 SMP PREEMPT_RT Tue ...`
        let release = version.split_whitespace().nth(2).unwrap_or("of an unknown release");
        let model = version.split_whitespace().find(|word| word.starts_with("PREEMPT"));
        let realtime =
            self.file("sys/kernel/realtime").as_deref() == Some("1") || model == Some("PREEMPT_RT");
        let found = format!(
            "Linux {release}, {}",
            if realtime { "PREEMPT_RT" } else { model.unwrap_or("without preemption") }
        );
        if realtime {
            return Check::good(AREA, "preemption", found);
        }
        Check::doubtful(
            AREA,
            "preemption",
            found,
            "a kernel with PREEMPT_RT bounds how long the cycle thread waits for the kernel",
        )
    }

    /// Whether the processor reports a hypervisor; nothing where it cannot.
    fn virtual_machine(&self) -> Option<Check> {
        let flags = self.file("proc/cpuinfo")?;
        let flags = flags.lines().find(|line| line.starts_with("flags"))?;
        if !flags.split_whitespace().any(|flag| flag == "hypervisor") {
            return Some(Check::good(AREA, "machine", "no virtual machine"));
        }
        Some(Check::doubtful(
            AREA,
            "machine",
            "a virtual machine",
            "its host can stop it for milliseconds, and nothing in it can prevent that: use a physical machine",
        ))
    }

    fn clock_source(&self) -> Check {
        let source = self.file("sys/devices/system/clocksource/clocksource0/current_clocksource");
        match source {
            Some(source) if QUICK_CLOCKS.contains(&source.as_str()) => {
                Check::good(AREA, "clock source", source)
            }
            Some(source) => Check::doubtful(
                AREA,
                "clock source",
                source,
                "reading it takes microseconds; see in dmesg why the kernel does not use the processor's counter",
            ),
            None => Check::doubtful(AREA, "clock source", "unknown", "/sys is not mounted"),
        }
    }

    /// Processors of a list of the kernel, such as `0-3,5`.
    fn processors(&self, list: &str) -> Vec<u32> {
        processors(&self.file(&format!("sys/devices/system/cpu/{list}")).unwrap_or_default())
    }

    fn processor(&self, wanted: Option<u16>, online: &[u32]) -> Check {
        let what = "processor of the cycle";
        let alone = self.processors("isolated");
        let Some(wanted) = wanted.map(u32::from) else {
            let advice = "set one aside (isolcpus=N at boot) and name it: [south.realtime] cpu = N";
            return Check::doubtful(AREA, what, format!("any of {}", online.len()), advice);
        };
        if !online.contains(&wanted) {
            let advice = "name an existing one: [south.realtime] cpu";
            return Check::unfit(AREA, what, format!("there is no processor {wanted}"), advice);
        }
        if alone.contains(&wanted) {
            return Check::good(AREA, what, format!("{wanted}, set aside"));
        }
        Check::doubtful(
            AREA,
            what,
            format!("{wanted}, shared with other threads"),
            format!("isolcpus={wanted} at boot"),
        )
    }

    /// Whether the processors may run slower; nothing where nobody can make them.
    fn governor(&self, online: &[u32]) -> Option<Check> {
        let of = |cpu: &u32| self.file(&format!("sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor"));
        let mut governors: Vec<String> = online.iter().filter_map(of).collect();
        governors.sort_unstable();
        governors.dedup();
        let found = governors.join(", ");
        match governors.as_slice() {
            [] => None,
            [only] if only == "performance" => Some(Check::good(AREA, "frequency", found)),
            _ => Some(Check::doubtful(AREA, "frequency", found, "cpupower frequency-set -g performance")),
        }
    }

    /// Whether a processor may sleep so deep that waking takes time; nothing where none sleeps.
    fn sleep(&self, stays_awake: bool, online: &[u32]) -> Option<Check> {
        let deepest = online.iter().flat_map(|cpu| {
            (0..SLEEP_STATES).filter_map(move |state| {
                let of =
                    |name| self.file(&format!("sys/devices/system/cpu/cpu{cpu}/cpuidle/state{state}/{name}"));
                let latency: u64 = of("latency")?.parse().ok()?;
                (of("disable").as_deref() != Some("1")).then_some(latency)
            })
        });
        let deepest = deepest.max()?;
        let found = format!("waking takes up to {deepest} us");
        if stays_awake || deepest <= WAKE_MAX_US {
            let found = if stays_awake { format!("{found}, and stay_awake is set") } else { found };
            return Some(Check::good(AREA, "sleep", found));
        }
        Some(Check::doubtful(AREA, "sleep", found, "[south.realtime] stay_awake = true"))
    }
}

fn processors(list: &str) -> Vec<u32> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.trim().parse::<u32>().ok()?..=last.trim().parse::<u32>().ok()?.min(1023))
    };
    list.split(',').filter_map(range).flatten().collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::doctor::Verdict;
    use crate::sys::realtime::Measure;

    /// A folder with files as the kernel shows them, gone when dropped.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str, files: &[(&str, &str)]) -> Self {
            let root = std::env::temp_dir().join(format!("axisbridge-doctor-{}-{name}", std::process::id()));
            for (path, text) in files {
                let path = root.join(path);
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(path, format!("{text}\n")).unwrap();
            }
            Self(root)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    const CPU: &str = "sys/devices/system/cpu";

    fn of(files: &[(&str, &str)], name: &str, request: Request) -> Vec<(String, Verdict, String)> {
        let folder = Folder::new(name, files);
        let checks = checks(&folder.0, request).into_iter().filter(|check| check.area == AREA);
        checks.map(|check| (check.what, check.verdict, check.found)).collect()
    }

    #[test]
    fn a_host_that_was_made_for_it() {
        let path = |name: &str| format!("{CPU}/{name}");
        let files = [
            ("proc/version".to_owned(), "Linux version 6.12.1-rt (builder@host) (gcc) #1 SMP PREEMPT_RT Tue"),
            ("proc/cpuinfo".to_owned(), "processor : 0\nflags : fpu tsc"),
            ("sys/devices/system/clocksource/clocksource0/current_clocksource".to_owned(), "tsc"),
            (path("online"), "0-3"),
            (path("isolated"), "2-3"),
            (path("cpu0/cpufreq/scaling_governor"), "performance"),
            (path("cpu3/cpufreq/scaling_governor"), "performance"),
            (path("cpu3/cpuidle/state1/latency"), "2"),
            (path("cpu3/cpuidle/state2/latency"), "400"),
            (path("cpu3/cpuidle/state2/disable"), "1"),
        ];
        let files: Vec<_> = files.iter().map(|(path, text)| (path.as_str(), *text)).collect();
        let found = of(&files, "good", Request { cpu: Some(3), ..Request::default() });
        let expected = [
            ("preemption", "Linux 6.12.1-rt, PREEMPT_RT"),
            ("machine", "no virtual machine"),
            ("clock source", "tsc"),
            ("processor of the cycle", "3, set aside"),
            ("frequency", "performance"),
            ("sleep", "waking takes up to 2 us"),
        ];
        let expected = expected.map(|(what, found)| (what.to_owned(), Verdict::Good, found.to_owned()));
        assert_eq!(found, expected);
    }

    #[test]
    fn a_host_that_was_not() {
        let path = |name: &str| format!("{CPU}/{name}");
        let files = [
            ("proc/version".to_owned(), "Linux version 6.8.0 (builder@host) #1 SMP PREEMPT_DYNAMIC Tue"),
            ("proc/cpuinfo".to_owned(), "flags : fpu hypervisor tsc"),
            ("sys/devices/system/clocksource/clocksource0/current_clocksource".to_owned(), "hpet"),
            (path("online"), "0-1"),
            (path("isolated"), ""),
            (path("cpu0/cpufreq/scaling_governor"), "performance"),
            (path("cpu1/cpufreq/scaling_governor"), "powersave"),
            (path("cpu1/cpuidle/state3/latency"), "133"),
        ];
        let files: Vec<_> = files.iter().map(|(path, text)| (path.as_str(), *text)).collect();
        let doubtful = [
            ("preemption", "Linux 6.8.0, PREEMPT_DYNAMIC"),
            ("machine", "a virtual machine"),
            ("clock source", "hpet"),
            ("processor of the cycle", "1, shared with other threads"),
            ("frequency", "performance, powersave"),
            ("sleep", "waking takes up to 133 us"),
        ];
        let doubtful = doubtful.map(|(what, found)| (what.to_owned(), Verdict::Doubtful, found.to_owned()));
        assert_eq!(of(&files, "bad", Request { cpu: Some(1), ..Request::default() }), doubtful);

        let request = Request { cpu: Some(2), stay_awake: true, ..Request::default() };
        let found = of(&files, "bad", request);
        assert_eq!(
            found[3],
            ("processor of the cycle".to_owned(), Verdict::Unfit, "there is no processor 2".to_owned())
        );
        let awake = "waking takes up to 133 us, and stay_awake is set";
        assert_eq!(found[5], ("sleep".to_owned(), Verdict::Good, awake.to_owned()));
        let anywhere = of(&files, "bad", Request::default());
        assert_eq!((anywhere[3].1, anywhere[3].2.as_str()), (Verdict::Doubtful, "any of 2"));
    }

    #[test]
    fn a_host_that_tells_nothing_is_not_called_good() {
        let found = of(&[], "nothing", Request::default());
        let whats: Vec<_> = found.iter().map(|(what, verdict, _)| (what.as_str(), *verdict)).collect();
        use Verdict::Doubtful;
        assert_eq!(
            whats,
            [("preemption", Doubtful), ("clock source", Doubtful), ("processor of the cycle", Doubtful)]
        );
    }

    #[test]
    fn refusals_come_with_what_helps() {
        let refused = Outcome { measure: Measure::Scheduler { priority: 80 }, result: Err(1) };
        let check = grant(&refused);
        assert_eq!((check.verdict, check.what.as_str()), (Verdict::Doubtful, "SCHED_FIFO priority 80"));
        assert!(check.found.starts_with("refused (") && check.advice.unwrap().contains("CAP_SYS_NICE"));
        let granted = grant(&Outcome { result: Ok(()), ..refused });
        assert_eq!((granted.verdict, granted.found.as_str()), (Verdict::Good, "granted"));
    }

    #[test]
    fn a_clock_is_kept_right_or_it_is_told() {
        assert_eq!(discipline(true).verdict, Verdict::Good);
        assert_eq!(discipline(false).verdict, Verdict::Doubtful);
    }

    #[test]
    fn lists_of_processors() {
        assert_eq!(processors("0-3,5"), [0, 1, 2, 3, 5]);
        assert_eq!(processors("7"), [7]);
        assert!(processors("").is_empty());
        assert_eq!(processors("nonsense,2"), [2]);
        assert_eq!(processors("0-4294967295").len(), 1024, "a list is not believed any length");
    }
}
