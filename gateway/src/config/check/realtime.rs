//! `[south.realtime]`.

use profile_generic::time::DurationNs;

use super::{Problems, value};
use crate::config::duration;
use crate::config::file::RealtimeTable;
use crate::sys::realtime::{PRIORITY_MAX, Request};

/// The work for a cycle begins so long before its instant: ordinary kernels wake a real-time thread later than half of that once in
/// a hundred times.
const DEFAULT_LEAD: DurationNs = DurationNs::from_micros(100);

/// Longest lead.
const LEAD_MAX: DurationNs = DurationNs::from_millis(1);

pub(crate) const DEFAULT_PRIORITY: u8 = 80;

/// How long before its instant the work for a cycle begins.
pub(super) fn lead(problems: &mut Problems, table: &RealtimeTable) -> Option<DurationNs> {
    let Some(text) = &table.lead else { return Some(DEFAULT_LEAD) };
    let lead = value::time_span(problems, text)?;
    if (DurationNs::ZERO..=LEAD_MAX).contains(&lead) {
        return Some(lead);
    }
    problems.report(
        text.span(),
        format_args!("a lead of {} is too long", duration::show(lead)),
        format_args!("expected \"0 us\" to \"{}\"", duration::show(LEAD_MAX)),
    )
}

pub(super) fn check(problems: &mut Problems, table: &RealtimeTable) -> Option<Request> {
    let priorities = 0..=i64::from(PRIORITY_MAX);
    let priority = value::number_or(problems, &table.priority, "the priority", priorities, DEFAULT_PRIORITY);
    let cpu = value::optional(&table.cpu, |cpu| value::number(problems, cpu, "the processor", 0..=1023));
    Some(Request {
        priority: priority.map(|priority| (priority > 0).then_some(priority))?,
        cpu: cpu?,
        lock_memory: table.lock_memory.unwrap_or(true),
        stay_awake: table.stay_awake.unwrap_or(false),
    })
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    #[test]
    fn priority_zero_leaves_the_scheduling_class_alone() {
        let request = |text| checked(text, check);
        let usual =
            Request { priority: Some(DEFAULT_PRIORITY), cpu: None, lock_memory: true, stay_awake: false };
        assert_eq!(request(""), Ok(usual));
        assert_eq!(request("priority = 0\ncpu = 3"), Ok(Request { priority: None, cpu: Some(3), ..usual }));
        let both = ["the priority is 100", "the processor is 1024"].map(str::to_owned).to_vec();
        assert_eq!(request("priority = 100\ncpu = 1024"), Err(both));
    }

    #[test]
    fn the_lead_is_at_most_a_millisecond() {
        let found = |text| checked(text, lead);
        assert_eq!(found("lead = \"0 us\""), Ok(DurationNs::ZERO));
        assert_eq!(found("lead = \"2 ms\""), Err(vec!["a lead of 2 ms is too long".to_owned()]));
    }
}
