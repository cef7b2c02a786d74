//! Finding out which modes of operation a drive has that does not tell them by 6502: each that the axis could use is written to 6060
//! and looked for in 6061, while the drive is without torque and its PDOs are not there yet.

use std::collections::VecDeque;
use std::fmt;

use profile_cia402::sdo::request::{SdoData, SdoFailure, SdoOutcome, SdoRequest};
use profile_cia402::wire::Mux;

use crate::mapping::ModeWords;

/// How often 6061 is read until it has to show the mode: drives need some milliseconds for that.
const LOOKS: u8 = 50;

/// What came of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// 6061 shows it.
    Shown,
    /// The drive takes it, and shows this instead.
    Taken(i8),
    /// The drive does not take it.
    Refused(SdoFailure),
}

/// The trial: what is to be tried, what is under way, what came.
#[derive(Debug)]
pub struct Trial {
    words: ModeWords,
    wait: VecDeque<(String, i8)>,
    at: Option<(String, i8)>,
    looks: u8,
    found: Vec<(String, i8, Verdict)>,
}

/// What a drive was found to have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tried {
    has: Vec<(String, i8)>,
    others: Vec<String>,
}

impl Trial {
    /// Of these modes.
    pub fn new(words: ModeWords) -> Self {
        let wait = words.modes.iter().cloned().collect();
        Self { words, wait, at: None, looks: 0, found: Vec::new() }
    }

    /// The next request, one at a time.
    pub fn begin(&mut self) -> Option<SdoRequest> {
        let (name, code) = self.wait.pop_front()?;
        self.looks = 0;
        let request = SdoRequest::download(mux(self.words.mode), SdoData::inline(&code.to_le_bytes())?);
        self.at = Some((name, code));
        Some(request)
    }

    /// Takes the answer to the last request, and makes the next one; `None` at the end.
    ///
    /// # Errors
    /// The drive has gone.
    pub fn handle(&mut self, outcome: &SdoOutcome) -> Result<Option<SdoRequest>, SdoFailure> {
        let Some((name, code)) = self.at.take() else { return Ok(self.begin()) };
        let verdict = match outcome.result {
            Err(failure @ (SdoFailure::Timeout { .. } | SdoFailure::NodeLost)) => return Err(failure),
            Err(failure) => Verdict::Refused(failure),
            Ok(()) if outcome.object == mux(self.words.mode) => {
                self.at = Some((name, code));
                return Ok(Some(SdoRequest::upload(mux(self.words.shown))));
            }
            Ok(()) => match outcome.data.as_slice().first().map(|byte| i8::from_le_bytes([*byte])) {
                Some(shown) if shown == code => Verdict::Shown,
                _ if self.looks < LOOKS => {
                    self.looks += 1;
                    self.at = Some((name, code));
                    return Ok(Some(SdoRequest::upload(mux(self.words.shown))));
                }
                shown => Verdict::Taken(shown.unwrap_or_default()),
            },
        };
        self.found.push((name, code, verdict));
        Ok(self.begin())
    }

    /// What the drive has. One that shows none of them while it is without torque is believed to have what it took: it does not get
    /// torque in a mode that it does not show.
    pub fn tried(self) -> Tried {
        let shows = self.found.iter().any(|(_, _, verdict)| *verdict == Verdict::Shown);
        let (mut has, mut others) = (Vec::new(), Vec::new());
        for (name, code, verdict) in self.found {
            match verdict {
                Verdict::Shown => has.push((name, code)),
                Verdict::Taken(_) if !shows => has.push((name, code)),
                Verdict::Taken(shown) => others.push(format!("{name} taken, 6061 shows {shown}")),
                Verdict::Refused(failure) => others.push(format!("{name} {failure}")),
            }
        }
        Tried { has, others }
    }
}

impl Tried {
    /// The modes that it has.
    pub fn codes(&self) -> impl Iterator<Item = i8> + '_ {
        self.has.iter().map(|(_, code)| *code)
    }
}

impl fmt::Display for Tried {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let has: Vec<_> = self.has.iter().map(|(name, _)| name.as_str()).collect();
        let has = if has.is_empty() { "none".to_owned() } else { has.join(", ") };
        write!(f, "6502 reports no modes of operation; tried by 6060 and 6061, it has {has}")?;
        match self.others.is_empty() {
            true => Ok(()),
            false => write!(f, " ({})", self.others.join("; ")),
        }
    }
}

fn mux(object: crate::mapping::Object) -> Mux {
    Mux::new(object.index, object.sub)
}
