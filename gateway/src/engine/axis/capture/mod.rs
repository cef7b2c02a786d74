//! Capturing events with the drive of an axis.
//!
//! ```text
//! latch     OFF -> RISING -> ARMED      enable told 1; the drive stores the position at the edge by itself
//!            ^                 |
//!            +--- FALLING <----+        enable told 0, until the drive shows no edge any more: nothing is wanted, or an
//!                                       edge has come and is wanted again
//! counter   a change from one telegram to the next is a marker, at the position that the drive has stored
//! input     a change from one telegram to the next is an edge, at the actual position of the later telegram
//! sequence  the first marker after the edge; both in one telegram: nobody knows which was first
//! ```
//!
//! A drive stores positions, not times: the time follows from the actual positions around the stored one. Between an edge
//! that was latched and the next that can be lie three bus cycles with everything in the telegrams; over the service channel
//! two writes and one or two reads, of which each takes some cycles.

use crate::engine::access::{Access, AccessFailure, Operation};
use arrayvec::ArrayVec;
use profile_generic::capture::{CaptureKind, CaptureResult, CaptureSet, CaptureStatus};
use profile_generic::program::BitPattern;
use profile_generic::quantity::Position;
use profile_generic::time::MonotonicTime;

use super::history::History;
use crate::mapping::{CAPTURES_MAX, CaptureProgram, Latch};

/// Results that wait to be taken, one of each kind in a cycle.
const RESULTS_MAX: usize = CaptureKind::COUNT;

/// Fresh telegrams after which a changed enable has certainly been seen by the drive.
const SEEN_AFTER: u8 = 2;

/// What a service channel access of a capture does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CaptureAccess {
    /// Starts the procedure command.
    Start,
    /// Writes an enable: its place in the program, and its value.
    Enable(usize, bool),
    /// Reads a word: its place in the program.
    Word(usize),
    /// Reads the position of a latch: its place in the program.
    Value(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Command {
    #[default]
    Idle,
    Active,
    Refused,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Phase {
    #[default]
    Off,
    Rising,
    Armed,
    Falling,
}

/// A fresh telegram of the drive.
struct Sample<'t> {
    telegram: &'t [u8],
    /// The actual position, and when the drive captured it.
    position: Position,
    at: MonotonicTime,
    /// Time of the sample before.
    since: Option<MonotonicTime>,
}

/// A marker that a counter has shown.
#[derive(Clone, Copy)]
struct Marker {
    position: Position,
    at: MonotonicTime,
    /// It was not the only one since the sample before.
    several: bool,
}

/// An enable and the edges that it lets through.
#[derive(Debug, Clone, Copy, Default)]
struct Gate {
    phase: Phase,
    /// Fresh telegrams since the enable was changed; with the service channel the write's answer completes it.
    fresh: u8,
    /// What the drive has been told over the service channel.
    told: Option<bool>,
    /// Bits that stand since it rose.
    bits: u32,
}

impl Gate {
    fn go(&mut self, phase: Phase) {
        (self.phase, self.fresh) = (phase, 0);
    }

    const fn is_on(self) -> bool {
        matches!(self.phase, Phase::Rising | Phase::Armed)
    }

    /// The bits that stand now.
    const fn word(self) -> u32 {
        if self.is_on() { self.bits } else { 0 }
    }
}

/// Captures of one axis.
#[derive(Debug, Default)]
pub struct CaptureUnit {
    wanted: CaptureSet,
    /// Counters, inputs and sequences that were wanted when the last telegram came.
    watching: CaptureSet,
    /// Not tried again before it has not been wanted.
    failed: CaptureSet,
    command: Command,
    gates: [Gate; crate::mapping::CAPTURE_WORDS_MAX],
    words: [u32; crate::mapping::CAPTURE_WORDS_MAX],
    /// The latch has shown its edge since its enable rose.
    latched: [bool; CAPTURES_MAX],
    /// The position of the latch has to be read, and then counts.
    unread: [bool; CAPTURES_MAX],
    counters: [Option<i64>; CAPTURES_MAX],
    inputs: [Option<bool>; CAPTURES_MAX],
    /// The edge of the switch has come, the marker has not.
    awaiting: [bool; crate::mapping::CAPTURE_WORDS_MAX],
    history: History,
    results: ArrayVec<CaptureResult, RESULTS_MAX>,
    outstanding: Option<CaptureAccess>,
    /// Answers of before the drive was lost do not count.
    generation: u8,
    /// Nothing is wanted and nothing is under way, since [`CaptureUnit::want`] has looked.
    rests: bool,
}

impl CaptureUnit {
    /// Another drive, or the same after it was lost: what was armed there is not any more.
    pub fn restart(&mut self) {
        let (wanted, generation) = (self.wanted, self.generation.wrapping_add(1));
        *self = Self { wanted, generation, ..Self::default() };
    }

    /// The oldest result.
    pub fn poll(&mut self) -> Option<CaptureResult> {
        (!self.results.is_empty()).then(|| self.results.remove(0))
    }

    /// Tells what is to be captured; to be called in each cycle, after the results were taken.
    pub fn want(&mut self, program: &CaptureProgram, wanted: CaptureSet) {
        if self.rests && wanted.is_empty() {
            return;
        }
        self.wanted = wanted;
        self.failed = self.failed.intersection(wanted);
        self.watching = self.watching.intersection(wanted);
        for (place, sequence) in program.sequences.iter().enumerate() {
            self.awaiting[place] &= wanted.contains(sequence.kind);
        }
        if self.command == Command::Refused && self.failed.is_empty() {
            self.command = Command::Idle;
        }
        for (place, latch) in program.latches.iter().enumerate() {
            self.unread[place] &= wanted.contains(latch.kind);
        }
        for place in 0..program.enables.len() {
            self.move_gate(program, place);
        }
        self.rests = self.is_at_rest();
    }

    /// What is being looked for at this moment.
    pub fn checking(&self, program: &CaptureProgram) -> CaptureSet {
        if self.rests {
            return CaptureSet::EMPTY;
        }
        let armed = program.latches.iter().enumerate().filter(|(place, latch)| {
            let armed = self.gates[latch.enable].phase == Phase::Armed;
            armed && !self.latched[*place] && self.is_wanted(latch.kind)
        });
        let mut checking = self.watching;
        armed.for_each(|(_, latch)| checking.set(latch.kind, true));
        checking
    }

    /// Puts the enables into the master's telegram.
    pub fn encode(&self, program: &CaptureProgram, telegram: &mut [u8]) {
        for (enable, gate) in program.enables.iter().zip(self.gates) {
            enable.place.write_bits(telegram, BitPattern::new(enable.mask, gate.word()));
        }
    }

    /// Takes a fresh telegram of the drive, with its actual position at the instant it was captured. What follows for the
    /// enables is decided in [`CaptureUnit::want`]: an edge that has come may not be wanted again.
    pub fn sample(
        &mut self,
        program: &CaptureProgram,
        telegram: &[u8],
        position: Position,
        at: MonotonicTime,
    ) {
        let since = self.history.newest().map(|(_, at)| at);
        self.history.push(position, at);
        let sample = Sample { telegram, position, at, since };
        for (word, place) in self.words.iter_mut().zip(&program.words) {
            *word = place.read_word(telegram).unwrap_or(*word);
        }
        if self.rests {
            // The levels count that are there when something is wanted.
            self.compare(program, &sample);
            return;
        }
        for gate in &mut self.gates {
            gate.fresh = gate.fresh.saturating_add(1);
        }
        for place in 0..program.latches.len() {
            let latch = &program.latches[place];
            if program.words[latch.word].offset.is_some() && self.shows(latch, place) {
                match latch.value.place.read(telegram) {
                    Some(raw) if self.is_wanted(latch.kind) => self.stored(latch, raw, since),
                    Some(_) => {}
                    None => self.unread[place] = self.is_wanted(latch.kind),
                }
            }
        }
        self.compare(program, &sample);
        self.watching = CaptureSet::EMPTY;
        if !self.wanted.is_empty() {
            let kinds = program.kinds();
            for kind in CaptureKind::all() {
                let latch = program.latches.iter().any(|latch| latch.kind == kind);
                self.watching.set(kind, !latch && self.is_wanted(kind) && kinds.contains(kind));
            }
        }
    }

    /// Whether nothing is wanted and nothing is under way: then there is nothing to ask of the drive, and no edge to come.
    fn is_at_rest(&self) -> bool {
        self.wanted.is_empty()
            && self.watching.is_empty()
            && self.failed.is_empty()
            && self.command != Command::Refused
            && self.gates.iter().all(|gate| gate.phase == Phase::Off)
            && !self.unread.contains(&true)
            && !self.awaiting.contains(&true)
    }

    fn is_wanted(&self, kind: CaptureKind) -> bool {
        self.wanted.contains(kind) && !self.failed.contains(kind)
    }

    /// Whether a latch shows its edge for the first time since its enable rose.
    fn shows(&mut self, latch: &Latch, place: usize) -> bool {
        let on = self.gates[latch.enable].is_on();
        let new = on && !self.latched[place] && latch.pattern.matches(self.words[latch.word]);
        self.latched[place] |= new;
        new
    }

    /// A latch has stored a raw position, not before `since`.
    fn stored(&mut self, latch: &Latch, raw: i64, since: Option<MonotonicTime>) {
        let near = self.history.newest().map_or(0, |(position, _)| position.get());
        let position = Position(latch.value.position(raw, near));
        let at = self.history.time_at(position, since);
        self.give(latch.kind, CaptureStatus::Captured, position, at);
    }

    /// Compares counters and inputs with those of the last telegram.
    fn compare(&mut self, program: &CaptureProgram, sample: &Sample<'_>) {
        if program.inputs.is_empty() && program.counters.is_empty() && program.sequences.is_empty() {
            return;
        }
        let switched = self.compare_inputs(program, sample);
        let markers = self.compare_counters(program, sample);
        for (place, sequence) in program.sequences.iter().enumerate() {
            if !self.watching.contains(sequence.kind) {
                self.awaiting[place] = false;
                continue;
            }
            let status = match (switched[sequence.switch], self.awaiting[place], markers[sequence.marker]) {
                (true, _, None) => {
                    self.awaiting[place] = true;
                    continue;
                }
                (false, true, Some(Marker { position, at, several: false })) => {
                    self.awaiting[place] = false;
                    self.give(sequence.kind, CaptureStatus::Captured, position, at);
                    continue;
                }
                // Which of several markers was the first, or whether it came after the switch, cannot be told.
                (true, _, Some(_)) | (false, true, Some(_)) => CaptureStatus::Ambiguous,
                (false, ..) => continue,
            };
            self.awaiting[place] = false;
            self.give(sequence.kind, status, sample.position, sample.at);
        }
    }

    /// The inputs that have switched on; those that are looked for by themselves are captured at the actual position.
    fn compare_inputs(&mut self, program: &CaptureProgram, sample: &Sample<'_>) -> [bool; CAPTURES_MAX] {
        let mut switched = [false; CAPTURES_MAX];
        for (place, input) in program.inputs.iter().enumerate() {
            let Some(word) = input.word.read_word(sample.telegram) else { continue };
            let level = input.pattern.matches(word);
            let before = self.inputs[place].replace(level);
            switched[place] = level && before == Some(false);
            if switched[place] && self.watching.contains(input.kind) {
                self.give(input.kind, CaptureStatus::Captured, sample.position, sample.at);
            }
        }
        switched
    }

    /// The newest marker of each counter that has changed; those that are looked for by themselves are captured.
    fn compare_counters(
        &mut self,
        program: &CaptureProgram,
        sample: &Sample<'_>,
    ) -> [Option<Marker>; CAPTURES_MAX] {
        let mut markers = [None; CAPTURES_MAX];
        for (place, counter) in program.counters.iter().enumerate() {
            let Some(count) = counter.counter.read(sample.telegram) else { continue };
            let Some(last) = self.counters[place].replace(count).filter(|last| *last != count) else {
                continue;
            };
            let Some(raw) = counter.value.place.read(sample.telegram) else { continue };
            let position = Position(counter.value.position(raw, sample.position.get()));
            let at = self.history.time_at(position, sample.since);
            let bits = counter.counter.width.bits();
            let several =
                count.wrapping_sub(last).rem_euclid(1_i64.checked_shl(bits).unwrap_or(i64::MAX)) != 1;
            markers[place] = Some(Marker { position, at, several });
            if self.watching.contains(counter.kind) {
                self.give(counter.kind, CaptureStatus::Captured, position, at);
            }
        }
        markers
    }

    fn move_gate(&mut self, program: &CaptureProgram, place: usize) {
        if self.wanted.is_empty() && self.gates[place].phase == Phase::Off {
            // It stays as it is.
            return;
        }
        let Some(next) = self.next_phase(program, place) else { return };
        self.gates[place].go(next);
        match next {
            Phase::Rising => self.select(program, place),
            // It may rise again at once.
            Phase::Off => self.move_gate(program, place),
            _ => {}
        }
    }

    /// The phase that a gate goes to; `None` while it stays in its own.
    fn next_phase(&self, program: &CaptureProgram, place: usize) -> Option<Phase> {
        let own = |latch: &&Latch| latch.enable == place;
        let wanted = program.latches.iter().filter(own).any(|latch| self.is_wanted(latch.kind));
        let cyclic = program.enables[place].place.offset.is_some();
        let gate = self.gates[place];
        let arrived = if cyclic { gate.fresh >= SEEN_AFTER } else { gate.told == Some(gate.is_on()) };
        // What is read over the service channel has no newer word than the one that showed the edge.
        let clear = program.latches.iter().filter(own).all(|latch| {
            program.words[latch.word].offset.is_none() || !latch.pattern.matches(self.words[latch.word])
        });
        match gate.phase {
            Phase::Off => {
                let ready = program.command.is_none() || self.command == Command::Active;
                (wanted && ready && clear).then_some(Phase::Rising)
            }
            Phase::Rising | Phase::Armed => {
                let mut latches = (0..).zip(&program.latches);
                let reading = latches.any(|(at, latch)| own(&latch) && self.unread[at]);
                if !reading && (!wanted || self.selects_again(program, place)) {
                    Some(Phase::Falling)
                } else {
                    (gate.phase == Phase::Rising && arrived).then_some(Phase::Armed)
                }
            }
            Phase::Falling => (arrived && clear).then_some(Phase::Off),
        }
    }

    /// Whether something is wanted of a gate that has come, or that the drive was not told to look for.
    fn selects_again(&self, program: &CaptureProgram, place: usize) -> bool {
        let gate = self.gates[place];
        let mut own = program.latches.iter().enumerate().filter(|(_, latch)| latch.enable == place);
        own.any(|(at, latch)| {
            let open = latch.select & !gate.bits == 0;
            self.is_wanted(latch.kind) && (self.latched[at] || !open)
        })
    }

    /// Selects what is wanted of a gate that rises, and forgets the edges of before.
    fn select(&mut self, program: &CaptureProgram, place: usize) {
        let own = |latch: &&Latch| latch.enable == place;
        let latches = program.latches.iter().filter(own);
        let selected = latches.filter(|latch| self.is_wanted(latch.kind)).map(|latch| latch.select);
        self.gates[place].bits = selected.fold(program.enables[place].on, |bits, one| bits | one);
        for (at, latch) in program.latches.iter().enumerate().filter(|(_, latch)| own(latch)) {
            self.latched[at] = false;
            if program.words[latch.word].offset.is_none() {
                self.words[latch.word] &= !latch.pattern.mask;
            }
        }
    }

    fn give(&mut self, kind: CaptureKind, status: CaptureStatus, position: Position, at: MonotonicTime) {
        if status != CaptureStatus::Captured {
            self.failed.set(kind, true);
        }
        let CaptureKind { source, edge } = kind;
        // There is room for one of each kind, and they are taken in each cycle.
        let _ = self.results.try_push(CaptureResult { id: 0, source, edge, status, position, at });
    }

    // ---- over the service channel ------------------------------------------------------------------------------

    /// The next access to the drive's service channel, if one is due and none under way.
    pub fn access(&self, program: &CaptureProgram) -> Option<(Access, CaptureAccess, u8)> {
        if self.outstanding.is_some() || self.rests {
            return None;
        }
        let next = self.next_access(program)?;
        let request = match next {
            CaptureAccess::Start => Access::new(program.command?, Operation::Start),
            CaptureAccess::Enable(place, _) => {
                let enable = program.enables.get(place)?.place;
                // One word may have the bits of several.
                let gates = program.enables.iter().zip(self.gates);
                let same = gates.filter(|(gate, _)| gate.place.item == enable.item);
                let word = same.fold(0, |word, (_, gate)| word | gate.word());
                Access::write(enable.item, &u64::from(word).to_le_bytes()[..enable.width.bytes()])?
            }
            CaptureAccess::Word(place) => Access::read(program.words.get(place)?.item),
            CaptureAccess::Value(place) => Access::read(program.latches.get(place)?.value.place.item),
        };
        Some((request, next, self.generation))
    }

    fn next_access(&self, program: &CaptureProgram) -> Option<CaptureAccess> {
        let mut latches = program.latches.iter().enumerate();
        let wanted = program.latches.iter().any(|latch| self.is_wanted(latch.kind));
        if wanted && program.command.is_some() && self.command == Command::Idle {
            return Some(CaptureAccess::Start);
        }
        if let Some((place, _)) = latches.find(|(place, _)| self.unread[*place]) {
            return Some(CaptureAccess::Value(place));
        }
        for (place, enable) in program.enables.iter().enumerate() {
            let gate = self.gates[place];
            let changes = gate.phase != Phase::Off && gate.told != Some(gate.is_on());
            if enable.place.offset.is_none() && changes {
                return Some(CaptureAccess::Enable(place, gate.is_on()));
            }
        }
        let polled = program.latches.iter().enumerate().find(|(place, latch)| {
            let open = self.gates[latch.enable].is_on() && !self.latched[*place];
            program.words[latch.word].offset.is_none() && open && self.is_wanted(latch.kind)
        });
        polled.map(|(_, latch)| CaptureAccess::Word(latch.word))
    }

    /// The access was handed to the service channel.
    pub fn sent(&mut self, access: CaptureAccess) {
        self.outstanding = Some(access);
    }

    /// Takes the answer to an access.
    pub fn answer(
        &mut self,
        program: &CaptureProgram,
        access: CaptureAccess,
        generation: u8,
        result: Result<&[u8], AccessFailure>,
    ) {
        if generation != self.generation || self.outstanding != Some(access) {
            return;
        }
        self.outstanding = None;
        match (access, result) {
            (CaptureAccess::Start, Ok(_)) => self.command = Command::Active,
            (CaptureAccess::Start, Err(_)) => {
                self.command = Command::Refused;
                self.fail(program, |_, _| true);
            }
            (CaptureAccess::Enable(place, on), Ok(_)) => self.gates[place].told = Some(on),
            (CaptureAccess::Enable(place, _), Err(_)) => {
                self.gates[place].go(Phase::Off);
                self.gates[place].told = None;
                self.fail(program, |_, latch| latch.enable == place);
            }
            (CaptureAccess::Word(place), Ok(bytes)) => {
                let Some(raw) = program.words.get(place).and_then(|word| word.decode(bytes)) else { return };
                let [a, b, c, d, ..] = raw.to_le_bytes();
                self.words[place] = u32::from_le_bytes([a, b, c, d]);
                for (at, latch) in program.latches.iter().enumerate() {
                    if latch.word == place && self.shows(latch, at) {
                        self.unread[at] = self.is_wanted(latch.kind);
                    }
                }
            }
            (CaptureAccess::Word(place), Err(_)) => self.fail(program, |_, latch| latch.word == place),
            (CaptureAccess::Value(place), result) => {
                self.unread[place] = false;
                let Some(latch) = program.latches.get(place) else { return };
                match result.ok().and_then(|bytes| latch.value.place.decode(bytes)) {
                    // Everything that is remembered may hold the instant.
                    Some(raw) => self.stored(latch, raw, None),
                    None => self.fail(program, |at, _| at == place),
                }
            }
        }
        for place in 0..program.enables.len() {
            self.move_gate(program, place);
        }
    }

    /// Ends the latches that the drive does not let work, with a result that says so.
    fn fail(&mut self, program: &CaptureProgram, concerns: impl Fn(usize, &Latch) -> bool) {
        for (place, latch) in program.latches.iter().enumerate() {
            if concerns(place, latch) && self.is_wanted(latch.kind) {
                self.give(latch.kind, CaptureStatus::Failed, Position::ZERO, MonotonicTime::ZERO);
            }
        }
    }
}

#[cfg(test)]
mod tests;
