//! Events in their time.

use std::collections::VecDeque;

use profile_generic::time::{DurationNs, MonotonicTime};

use super::{Change, Event, Names, Script, SimulatedDrives};
use crate::config::duration;

/// Plays events on drives, and reports every change of a drive's state.
#[derive(Debug)]
pub struct Player<D: SimulatedDrives> {
    names: Names,
    start: MonotonicTime,
    events: VecDeque<(DurationNs, Event)>,
    /// What ends by itself: when, drive, change.
    ends: Vec<(MonotonicTime, u16, Change)>,
    shown: Vec<(u16, Option<D::State>)>,
}

impl<D: SimulatedDrives> Player<D> {
    /// Plays the events of a script, beginning at `start`.
    #[must_use]
    pub fn new(names: Names, script: Script, start: MonotonicTime) -> Self {
        let shown = names.numbers.clone().map(|number| (number, None)).collect();
        Self { names, start, events: script.events.into(), ends: Vec::new(), shown }
    }

    /// The drives that can be named.
    #[must_use]
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// When it began.
    #[must_use]
    pub fn start(&self) -> MonotonicTime {
        self.start
    }

    /// When the next event begins or ends.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let begins = self.events.front().map(|(at, _)| self.start + *at);
        self.ends.iter().map(|(at, ..)| *at).chain(begins).min()
    }

    /// Lets begin and end what is due, and reports every change of a drive's state to `say`.
    pub fn poll(&mut self, now: MonotonicTime, drives: &mut D, say: &mut dyn FnMut(&str)) {
        while let Some(due) = self.wake_at().filter(|due| *due <= now) {
            // What ends makes room for what begins.
            if let Some(index) = self.ends.iter().position(|(at, ..)| *at == due) {
                let (_, drive, change) = self.ends.remove(index);
                self.change(drive, change, None, drives, say);
            } else if let Some((_, event)) = self.events.pop_front() {
                self.play(due, event, drives, say);
            }
        }
        let what = self.names.what;
        for (number, shown) in &mut self.shown {
            let state = drives.state(*number);
            if let Some(now) = state.filter(|_| state != *shown) {
                say(&format!("{what} {number}: {now}"));
            }
            *shown = state;
        }
    }

    /// Lets an event begin.
    pub fn play(&mut self, now: MonotonicTime, event: Event, drives: &mut D, say: &mut dyn FnMut(&str)) {
        let numbers = match event.drive {
            Some(number) => number..=number,
            None => self.names.numbers.clone(),
        };
        for number in numbers {
            let done = self.change(number, event.change, event.lasts, drives, say);
            if let (true, Some(time), Some(end)) = (done, event.lasts, event.change.end()) {
                self.ends.push((now + time, number, end));
            }
        }
    }

    fn change(
        &mut self,
        drive: u16,
        change: Change,
        lasts: Option<DurationNs>,
        drives: &mut D,
        say: &mut dyn FnMut(&str),
    ) -> bool {
        let what = self.names.what;
        // The last word on a matter counts: an end that was planned before it is none any more.
        self.ends.retain(|(_, number, end)| {
            let same = *end == change
                || Some(*end) == change.end()
                || change == Change::Clear(None) && matches!(end, Change::Clear(_));
            *number != drive || !same
        });
        match drives.apply(drive, change) {
            Ok(()) => {
                let time = lasts.map(|time| format!(" for {}", duration::show(time))).unwrap_or_default();
                say(&format!("{what} {drive}: event {change}{time}"));
                true
            }
            Err(reason) => {
                say(&format!("{what} {drive}: event {change} has no effect: {reason}"));
                false
            }
        }
    }

    /// Shows the state of every drive, and where it is.
    pub fn show(&self, drives: &D, say: &mut dyn FnMut(&str)) {
        for number in self.names.numbers.clone() {
            if let Some(state) = drives.state(number) {
                let position = drives.position(number).map(|position| format!(", at {position:.3}"));
                say(&format!("{} {number}: {state}{}", self.names.what, position.unwrap_or_default()));
            }
        }
    }
}
