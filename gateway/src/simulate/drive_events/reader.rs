//! The words of a script for simulated drives: one event a line, the same in a file and on standard input.

use std::ops::Range;
use std::path::Path;

use profile_generic::capture::CaptureWindow;
use profile_generic::cast;
use profile_generic::fault::FaultCause;
use profile_generic::quantity::{Position, TorqueAbsolute};
use profile_generic::time::DurationNs;

use super::setup::{Property, Setup};
use super::{Change, Delay, Event, Names};
use crate::config::{FILE_LEN_MAX, duration};
use crate::finding::{Findings, Problem, Source, closest, read_file, registry as code};

/// Farthest jump of an encoder, in units.
const JUMP_MAX: f64 = 1e6;

/// Most counts of an encoder in a unit.
const RESOLUTION_MAX: u32 = 0x7FFF_FFFF;

/// Rated torques in newton metre, or forces in newton.
const RATED_TORQUES: std::ops::RangeInclusive<f64> = 0.01..=100_000.0;

/// Most turns on a side of a gear.
const TURNS_MAX: u32 = 1_000_000;

/// Each verb with its usage and what it does; `[N]` is the number of a drive, without which all are meant.
const VERBS: [(&str, &str, &str); 18] = [
    ("fault", "fault [N] CAUSE [for TIME]", "the drive faults; its cause stays, or ends after the time"),
    ("clear", "clear [N] [CAUSE]", "ends the cause of a fault, or of all; the drive still needs a reset"),
    ("warning", "warning [N] CAUSE [for TIME] | off", "the drive warns"),
    ("power", "power [N] off [for TIME] | on", "switches main power"),
    ("silence", "silence [N] [for TIME] | off", "the master hears nothing from the drive"),
    ("freeze", "freeze [N] [for TIME] | off", "feedback values stay as they are"),
    ("jump", "jump [N] UNITS", "the encoder jumps by so many revolutions or millimetres"),
    ("delay", "delay [N] ready|torque|brake TIME", "main power to ready, enable to torque, brake to move"),
    ("registration_1", "registration_1 [N] on [for TIME] | off", "switches registration input 1"),
    ("registration_2", "registration_2 [N] on [for TIME] | off", "switches registration input 2"),
    ("home_switch", "home_switch [N] FROM TO | off", "the home switch is closed between these places"),
    ("limit_switches", "limit_switches [N] LOWER UPPER", "the limit switches close there; CANopen only"),
    ("resolution", "resolution [N] COUNTS", "encoder counts in a unit; at the start only"),
    ("rated_torque", "rated_torque [N] NM", "rated torque in Nm, or force in N; at the start only"),
    ("gear", "gear [N] MOTOR:LOAD", "turns of motor and load; at the start only"),
    ("status", "status", "shows the state of each drive; not in a file"),
    ("causes", "causes", "lists the causes that a fault or a warning can have; not in a file"),
    ("help", "help", "shows this; not in a file"),
];

/// A line as it is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Something happens.
    Event(Event),
    /// What a drive is built with.
    Property(Option<u16>, Property),
    /// Show the state of each drive.
    Status,
    /// Show the words.
    Help,
    /// Show the causes of faults and warnings.
    Causes,
}

/// What can be typed, a line each.
#[must_use]
pub fn help() -> String {
    VERBS.iter().map(|(_, usage, what)| format!("  {usage:<39} {what}\n")).collect()
}

/// The causes that a fault or a warning can have.
#[must_use]
pub fn causes() -> String {
    let names: Vec<_> = FaultCause::NAMED.iter().map(|(_, name)| *name).collect();
    names.chunks(4).map(|line| format!("  {}\n", line.join(" "))).collect()
}

/// A script for drives: properties, and events by their time since the start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Script {
    /// What the drives are built with.
    pub setup: Setup,
    /// The events in the order of their time.
    pub events: Vec<(DurationNs, Event)>,
}

impl Script {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// The file cannot be read, or everything that is wrong in it, each at its place.
    pub fn load(path: &Path, names: &Names) -> Result<Self, Findings> {
        let text = read_file(path, FILE_LEN_MAX)?;
        Self::parse(&text, &path.display().to_string(), names)
    }

    /// Checks the text of a script; `name` stands in the errors.
    ///
    /// # Errors
    /// Everything that is wrong.
    pub fn parse(text: &str, name: &str, names: &Names) -> Result<Self, Findings> {
        let source = Source::new(name, text);
        let (mut script, mut findings) = (Self::default(), Findings::default());
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let words = Words::new(line, start, names);
            start += line.len();
            if words.is_empty() {
                continue;
            }
            match words.line() {
                Ok((at, Order::Event(event))) => script.events.push((at.unwrap_or(DurationNs::ZERO), event)),
                Ok((_, Order::Property(drive, property))) => script.setup.set(drive, property),
                // `line` lets nothing else pass.
                Ok((_, Order::Status | Order::Help | Order::Causes)) => {}
                Err(problem) => findings.push(&source, *problem),
            }
        }
        // Events of the same time stay in the order of the file.
        script.events.sort_by_key(|(at, _)| *at);
        findings.into_result(script)
    }
}

impl Order {
    /// Reads a line that a person has typed; `None` for one without words.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(line: &str, names: &Names) -> Option<Result<Self, Findings>> {
        let words = Words::new(line, 0, names);
        if words.is_empty() {
            return None;
        }
        Some(words.typed().map_err(|problem| {
            let mut findings = Findings::default();
            findings.push(&Source::new("standard input", line), *problem);
            findings
        }))
    }
}

/// The words of a line that were not taken yet.
struct Words<'l> {
    words: Vec<(&'l str, Range<usize>)>,
    next: usize,
    /// Behind the last word.
    end: usize,
    names: &'l Names,
    usage: &'static str,
}

type Read<T> = Result<T, Box<Problem>>;

fn problem<T>(span: Range<usize>, title: impl Into<String>, expected: impl Into<String>) -> Read<T> {
    Err(Box::new(Problem::new(code::SCRIPT, span).title(title).expected(expected)))
}

impl<'l> Words<'l> {
    fn new(line: &'l str, start: usize, names: &'l Names) -> Self {
        let text = line.split_once('#').map_or(line, |(text, _)| text);
        let mut words = Vec::new();
        let mut rest = text;
        while let Some(skipped) = rest.find(|letter: char| !letter.is_whitespace()) {
            let begin = text.len() - rest.len() + skipped;
            let length = text[begin..].find(char::is_whitespace).unwrap_or(text.len() - begin);
            words.push((&text[begin..begin + length], start + begin..start + begin + length));
            rest = &text[begin + length..];
        }
        let end = start + text.trim_end().len();
        Self { words, next: 0, end, names, usage: "" }
    }

    fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    fn left(&self) -> usize {
        self.words.len() - self.next
    }

    fn peek(&self) -> Option<&'l str> {
        self.words.get(self.next).map(|(word, _)| *word)
    }

    /// The place of the next word, or behind the last one.
    fn place(&self) -> Range<usize> {
        self.words.get(self.next).map_or(self.end..self.end, |(_, span)| span.clone())
    }

    fn take(&mut self, expected: &str) -> Read<(&'l str, Range<usize>)> {
        let Some((word, span)) = self.words.get(self.next) else {
            return problem(self.place(), format!("the line ends without {expected}"), self.expected());
        };
        self.next += 1;
        Ok((word, span.clone()))
    }

    fn expected(&self) -> String {
        format!("expected `{}`", self.usage)
    }

    /// A line of a file: `[at TIME] EVENT`.
    fn line(mut self) -> Read<(Option<DurationNs>, Order)> {
        let at = match self.peek() {
            Some("at") => {
                self.usage = "at TIME EVENT";
                self.next += 1;
                Some(self.time()?)
            }
            _ => None,
        };
        let verb = self.place();
        let order = self.order()?;
        match (order, at) {
            (Order::Status | Order::Help | Order::Causes, _) => {
                let title = "this is for a person who types".to_owned();
                problem(verb, title, "expected an event; standard input takes this line")
            }
            (Order::Property(..), Some(_)) => problem(
                verb,
                "a drive cannot change this while it runs",
                "expected the line without `at`: it counts from the start",
            ),
            _ => Ok((at, order)),
        }
    }

    /// A line of a person.
    fn typed(mut self) -> Read<Order> {
        let verb = self.place();
        match self.order()? {
            Order::Property(..) => problem(
                verb,
                "a drive cannot change this while it runs",
                "expected it in the file of `--script`, without `at`",
            ),
            order => Ok(order),
        }
    }

    fn order(&mut self) -> Read<Order> {
        if self.usage.is_empty() {
            self.usage = "EVENT";
        }
        let (name, span) = self.take("an event")?;
        let Some((verb, usage, _)) = VERBS.iter().find(|(verb, ..)| *verb == name) else {
            let verbs = VERBS.map(|(verb, ..)| verb);
            let expected = match closest(name, verbs) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("expected one of {}", verbs.join(", ")),
            };
            return problem(span, format!("`{name}` is no event"), expected);
        };
        self.usage = usage;
        let order = self.of_verb(verb)?;
        match self.peek() {
            None => Ok(order),
            Some(word) => problem(self.place(), format!("`{word}` is too much"), self.expected()),
        }
    }

    fn of_verb(&mut self, verb: &str) -> Read<Order> {
        match verb {
            "status" => return Ok(Order::Status),
            "help" => return Ok(Order::Help),
            "causes" => return Ok(Order::Causes),
            // Their own number comes last: one before it is that of the drive.
            "jump" | "resolution" | "rated_torque" | "gear" => {
                let drive = if self.left() > 1 { self.drive()? } else { None };
                return match verb {
                    "jump" => {
                        let change = Change::Jump(self.units("a distance")?);
                        Ok(Order::Event(Event { drive, change, lasts: None }))
                    }
                    "resolution" => {
                        let counts = self.whole("a number of counts", RESOLUTION_MAX)?;
                        Ok(Order::Property(drive, Property::Resolution(counts)))
                    }
                    "rated_torque" => {
                        let torque = self.number("a torque", RATED_TORQUES)?;
                        let torque = TorqueAbsolute(cast::i64_from_f64(torque * 1e6));
                        Ok(Order::Property(drive, Property::RatedTorque(torque)))
                    }
                    _ => Ok(Order::Property(drive, self.gear()?)),
                };
            }
            "home_switch" | "limit_switches" => {
                let places = if self.words.last().is_some_and(|(word, _)| *word == "off") { 1 } else { 2 };
                let drive = if self.left() > places { self.drive()? } else { None };
                let change = match verb {
                    "home_switch" if self.takes("off") => Change::HomeSwitch(None),
                    "home_switch" => {
                        let (from, to) = (self.units("a position")?, self.units("a position")?);
                        Change::HomeSwitch(Some(CaptureWindow { from, to }))
                    }
                    _ => Change::LimitSwitches(self.units("a position")?, self.units("a position")?),
                };
                return Ok(Order::Event(Event { drive, change, lasts: None }));
            }
            _ => {}
        }
        let drive = self.drive()?;
        let change = match verb {
            "fault" => Change::Fault(self.cause()?),
            "clear" if self.left() == 0 => Change::Clear(None),
            "clear" => Change::Clear(Some(self.cause()?)),
            "warning" if self.takes("off") => Change::Warning(None),
            "warning" => Change::Warning(Some(self.cause()?)),
            "power" => Change::Power(self.on_off()?),
            "silence" => Change::Silence(!self.takes("off")),
            "freeze" => Change::Freeze(!self.takes("off")),
            "registration_1" => Change::Registration(1, self.on_off()?),
            "registration_2" => Change::Registration(2, self.on_off()?),
            _ => {
                let (word, span) = self.take("a delay")?;
                let delay = match word {
                    "ready" => Delay::Ready,
                    "torque" => Delay::Torque,
                    "brake" => Delay::Brake,
                    _ => return problem(span, format!("`{word}` is no delay"), self.expected()),
                };
                Change::Delay(delay, self.time()?)
            }
        };
        let lasts = if change.end().is_some() && self.takes("for") { Some(self.time()?) } else { None };
        Ok(Order::Event(Event { drive, change, lasts }))
    }

    fn on_off(&mut self) -> Read<bool> {
        match self.take("`on` or `off`")? {
            ("on", _) => Ok(true),
            ("off", _) => Ok(false),
            (word, span) => problem(span, format!("`{word}` is neither on nor off"), self.expected()),
        }
    }

    fn units(&mut self, what: &str) -> Read<Position> {
        let units = self.number(what, -JUMP_MAX..=JUMP_MAX)?;
        Ok(Position(cast::i64_from_f64(units * 1e9)))
    }

    fn takes(&mut self, word: &str) -> bool {
        let taken = self.peek() == Some(word);
        self.next += usize::from(taken);
        taken
    }

    /// The number of a drive, where a number comes next.
    fn drive(&mut self) -> Read<Option<u16>> {
        let is_number = self.peek().is_some_and(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
        if !is_number {
            return Ok(None);
        }
        let Names { what, numbers } = self.names;
        let (word, span) = self.take(what)?;
        match word.parse() {
            Ok(number) if numbers.contains(&number) => Ok(Some(number)),
            _ => {
                let known = match (numbers.start(), numbers.end()) {
                    (first, last) if first == last => format!("expected {first}"),
                    (first, last) => format!("expected {first} to {last}"),
                };
                problem(span, format!("there is no {what} {word}"), known)
            }
        }
    }

    fn cause(&mut self) -> Read<FaultCause> {
        let (word, span) = self.take("a cause")?;
        FaultCause::from_name(word).map_or_else(
            || {
                let known = FaultCause::NAMED.iter().map(|(_, name)| *name);
                let expected = match closest(word, known) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => "expected one such as over_current; `causes` on standard input lists them".into(),
                };
                problem(span, format!("`{word}` is no cause of a fault"), expected)
            },
            Ok,
        )
    }

    /// A time with its unit, in one word or two.
    fn time(&mut self) -> Read<DurationNs> {
        let (word, span) = self.take("a time")?;
        if let Some(time) = duration::parse(word) {
            return Ok(time);
        }
        let both = self.peek().map(|unit| (format!("{word} {unit}"), span.start..self.place().end));
        if let Some(time) = both.as_ref().and_then(|(text, _)| duration::parse(text)) {
            self.next += 1;
            return Ok(time);
        }
        problem(span, format!("`{word}` is not a time"), format!("expected {}", duration::EXPECTED))
    }

    fn number(&mut self, what: &str, range: std::ops::RangeInclusive<f64>) -> Read<f64> {
        let (word, span) = self.take(what)?;
        match word.parse::<f64>() {
            Ok(number) if range.contains(&number) => Ok(number),
            _ => {
                let expected = format!("expected a number from {} to {}", range.start(), range.end());
                problem(span, format!("`{word}` is not {what}"), expected)
            }
        }
    }

    fn whole(&mut self, what: &str, most: u32) -> Read<u32> {
        let (word, span) = self.take(what)?;
        match word.parse() {
            Ok(number) if (1..=most).contains(&number) => Ok(number),
            _ => problem(
                span,
                format!("`{word}` is not {what}"),
                format!("expected a whole number from 1 to {most}"),
            ),
        }
    }

    fn gear(&mut self) -> Read<Property> {
        let (word, span) = self.take("a gear")?;
        let turns = |text: &str| text.parse().ok().filter(|turns| (1..=TURNS_MAX).contains(turns));
        let both = word.split_once(':').and_then(|(motor, load)| turns(motor).zip(turns(load)));
        match both {
            Some((motor, load)) => Ok(Property::Gear(motor, load)),
            None => {
                let expected =
                    format!("expected turns of motor and load, such as 10:1, each from 1 to {TURNS_MAX}");
                problem(span, format!("`{word}` is no gear"), expected)
            }
        }
    }
}
