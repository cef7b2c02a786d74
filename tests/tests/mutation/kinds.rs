//! Changes of rows by the mistakes that people make.

use std::fmt;

use crate::rows::{REMARKS, Row, inner, number, rows, string};

/// A kind of mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Sign,
    TimesTen,
    TimesSixty,
    Swapped,
    BitMoved,
    Widened,
    Removed,
    Doubled,
    Policy,
    Access,
}

impl Kind {
    pub const ALL: [Self; 10] = [
        Self::Sign,
        Self::TimesTen,
        Self::TimesSixty,
        Self::Swapped,
        Self::BitMoved,
        Self::Widened,
        Self::Removed,
        Self::Doubled,
        Self::Policy,
        Self::Access,
    ];
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Sign => "sign",
            Self::TimesTen => "scale x10",
            Self::TimesSixty => "scale x60",
            Self::Swapped => "swapped neighbours",
            Self::BitMoved => "bit moved",
            Self::Widened => "pattern widened",
            Self::Removed => "row removed",
            Self::Doubled => "row doubled",
            Self::Policy => "policy weakened",
            Self::Access => "access ignored",
        })
    }
}

/// A text with one change.
pub struct Mutant {
    pub kind: Kind,
    /// Where the change begins, from 1.
    pub line: usize,
    pub what: String,
    pub text: String,
}

/// Keys that narrow a row: without them it fits more.
const NARROWING: [&str; 8] =
    ["acknowledges", "procedure", "follows", "modes", "when", "voltage", "kind", "without"];

/// IDNs and objects that a drive lets only read.
const READ_ONLY: [&str; 2] = ["\"S-0-0051\"", "\"6061:00\""];

/// Words, and what a careless hand makes of them.
const POLICIES: [(&str, &str, &str); 12] = [
    ("missing", "refuse", "omit"),
    ("missing", "reject", "shadow"),
    ("missing", "absent", "zero"),
    ("missing", "zero", "absent"),
    ("refused", "fail", "continue"),
    ("reaction", "alarm", "ignore"),
    ("least", "Ignore", "Major Fault"),
    ("default", "Alarm", "Ignore"),
    ("abort", "coast_and_disable", "hold_position"),
    ("abort", "decelerate_and_disable", "hold_position"),
    ("method", "coast", "ramp"),
    ("method", "decelerate", "coast"),
];
const DIRECTIONS: [(&str, &str); 4] =
    [("to_drive", "from_drive"), ("from_drive", "to_drive"), ("both", "to_drive"), ("from_drive", "both")];
const OPPOSITES: [(&str, &str); 6] = [
    ("\"off\"", "\"on\""),
    ("\"on\"", "\"off\""),
    ("\"torque off\"", "\"enabled\""),
    ("\"enabled\"", "\"torque off\""),
    ("\"halt\"", "\"restart\""),
    ("\"restart\"", "\"halt\""),
];

/// A value of a row: its key, and where it stands in the text.
struct Value<'t> {
    key: String,
    from: usize,
    to: usize,
    text: &'t str,
}

/// The values of a row, those in inline tables as well.
fn values<'t>(text: &'t str, row: &Row) -> Vec<Value<'t>> {
    let mut found = Vec::new();
    for (key, (start, end)) in &row.keys {
        if REMARKS.contains(&key.as_str()) {
            continue;
        }
        let whole = &text[*start..*end];
        found.push(Value { key: key.clone(), from: *start, to: *end, text: whole });
        for (from, to, key) in inner(whole) {
            let key = key.to_owned();
            found.push(Value { key, from: start + from, to: start + to, text: &whole[from..to] });
        }
    }
    found
}

/// Two whole numbers in brackets.
fn pair(text: &str) -> Option<[i64; 2]> {
    let inside = text.trim().strip_prefix('[')?.strip_suffix(']')?;
    let numbers: Option<Vec<i64>> = inside.split(',').map(|one| whole(one.trim())).collect();
    numbers?.try_into().ok()
}

fn whole(text: &str) -> Option<i64> {
    let digits = text.replace('_', "");
    match digits.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok(),
        None => digits.parse().ok(),
    }
}

/// The elements of a list, with where they stand in it.
fn elements(text: &str) -> Vec<(usize, usize)> {
    let (mut found, mut depth, mut quoted, mut start) = (Vec::new(), 0, false, 1);
    if !text.starts_with('[') {
        return found;
    }
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => {
                depth -= 1;
                if depth == 0 && !text[start..at].trim().is_empty() {
                    found.push((start, at));
                }
            }
            ',' if !quoted && depth == 1 => {
                found.push((start, at));
                start = at + 1;
            }
            _ => {}
        }
    }
    found
}

/// What becomes of a value.
fn changes(value: &Value<'_>) -> Vec<(Kind, String)> {
    let mut found = Vec::new();
    let text = value.text.trim();
    match (value.key.as_str(), pair(text)) {
        ("base" | "generic_per_unit" | "factor", Some([over, under])) => {
            found.push((Kind::Sign, format!("[{}, {under}]", -over)));
            found.push((Kind::TimesTen, format!("[{}, {under}]", over.saturating_mul(10))));
            found.push((Kind::TimesSixty, format!("[{}, {under}]", over.saturating_mul(60))));
            if over != under && over > 0 {
                found.push((Kind::Swapped, format!("[{under}, {over}]")));
            }
        }
        ("pattern", Some([mask, bits])) => {
            let low = mask & -mask;
            found.push((Kind::BitMoved, format!("[{mask:#x}, {:#x}]", bits ^ low)));
            if mask != low {
                found.push((Kind::Widened, format!("[{:#x}, {:#x}]", mask & !low, bits & !low)));
                let high = 1 << (63 - mask.leading_zeros());
                found.push((Kind::BitMoved, format!("[{mask:#x}, {:#x}]", bits ^ high)));
            }
        }
        ("exponent", _) if whole(text).is_some() => {
            found.push((Kind::TimesTen, (whole(text).unwrap_or(0) + 1).to_string()));
            found.push((Kind::Sign, (1 - whole(text).unwrap_or(0)).to_string()));
        }
        ("divisor" | "nanounits", _) => {
            let number = whole(text).unwrap_or(1);
            found.push((Kind::TimesTen, (number * 10).to_string()));
            found.push((Kind::TimesSixty, (number * 60).to_string()));
            found.push((Kind::Sign, (-number).to_string()));
        }
        ("is" | "bit" | "value" | "slot" | "zero" | "manufacturer", _) => {
            if let Some(number) = whole(text) {
                found.push((Kind::BitMoved, (number ^ 1).to_string()));
                found.push((Kind::BitMoved, (number + 2).to_string()));
            }
            found.extend(
                OPPOSITES
                    .iter()
                    .filter(|(word, _)| *word == text)
                    .map(|(_, other)| (Kind::BitMoved, (*other).to_owned())),
            );
        }
        _ => {}
    }
    let word = text.trim_matches('"');
    let policies = POLICIES.iter().filter(|(key, known, _)| *key == value.key && *known == word);
    found.extend(policies.map(|(_, _, other)| (Kind::Policy, format!("\"{other}\""))));
    if value.key == "direction" {
        let others = DIRECTIONS.iter().filter(|(known, _)| *known == word);
        found.extend(others.map(|(_, other)| (Kind::Access, format!("\"{other}\""))));
    }
    if matches!(value.key.as_str(), "idn" | "object" | "control" | "mode") && !READ_ONLY.contains(&text) {
        let sercos = word.starts_with("S-0");
        if sercos || word.as_bytes().get(4) == Some(&b':') {
            found.push((Kind::Access, READ_ONLY[usize::from(!sercos)].to_owned()));
        }
    }
    if matches!(text, "true" | "false") {
        found.push((Kind::Policy, if text == "true" { "false" } else { "true" }.to_owned()));
    }
    let list = elements(text);
    if list.len() > 1 || value.key == "pattern" && text.contains('{') {
        for (from, to) in &list {
            let rest =
                list.iter().filter(|one| *one != &(*from, *to)).map(|(from, to)| text[*from..*to].trim());
            let without = format!("[{}]", rest.collect::<Vec<_>>().join(", "));
            if text.contains('{') || value.key == "conditions" || value.key == "status" {
                found.push((Kind::Widened, without));
            } else if matches!(value.key.as_str(), "command" | "actual" | "codes" | "commands") {
                found.push((Kind::Removed, without));
            }
        }
        if list.len() > 1 && pair(text).is_none() && text.len() < 400 {
            for two in list.windows(2) {
                let [(a, b), (c, d)] = [two[0], two[1]];
                let swapped =
                    format!("{} {}, {}{}", &text[..a], text[c..d].trim(), text[a..b].trim(), &text[d..]);
                found.push((Kind::Swapped, swapped));
            }
        }
    }
    found
}

fn line_of(text: &str, at: usize) -> usize {
    text[..at].matches('\n').count() + 1
}

/// Every change of a table.
pub fn mutants(text: &str) -> Vec<Mutant> {
    let all = rows(text);
    let mut found = Vec::new();
    let mut push = |kind, what: String, edits: &[(usize, usize, &str)]| {
        let mut text = text.to_owned();
        let mut edits = edits.to_vec();
        edits.sort_unstable();
        let line = line_of(&text, edits[0].0);
        edits.iter().rev().for_each(|(from, to, new)| text.replace_range(*from..*to, new));
        found.push(Mutant { kind, line, what, text });
    };
    for (place, row) in all.iter().enumerate().filter(|(_, row)| row.section != "unbound") {
        let (start, end) = row.span;
        if row.repeats {
            push(Kind::Removed, format!("{}: removed", row.name), &[(start, end, "")]);
            let own = &text[start..end];
            let comma = if own.starts_with('{') && !own.ends_with(',') { "," } else { "" };
            let again = format!("{comma}\n{own}");
            push(Kind::Doubled, format!("{}: doubled", row.name), &[(end, end, &again)]);
        }
        let next = all.get(place + 1).filter(|next| next.section == row.section);
        for value in values(text, row) {
            let Value { key, from, to, text: own } = &value;
            for (kind, new) in changes(&value) {
                let what = format!("{}: {key} = {} -> {new}", row.name, own.trim());
                push(kind, what, &[(*from, *to, &new)]);
            }
            if NARROWING.contains(&key.as_str()) && text[..*from].ends_with(&format!("{key} = ")) {
                // With the comma before or behind it.
                let key_at = from - key.len() - 3;
                let before = text[..key_at].trim_end();
                let cut = if before.ends_with(',') { before.len() - 1 } else { key_at };
                push(Kind::Widened, format!("{}: {key} left out", row.name), &[(cut, *to, "")]);
            }
            let top = row.keys.iter().any(|(_, span)| *span == (*from, *to));
            let other = next.and_then(|next| next.keys.iter().find(|(known, _)| known == key));
            if let Some((_, (start, end))) = other.filter(|_| top) {
                let theirs = &text[*start..*end];
                let plain = !own.contains('[') && (string(own).is_some() || number(own).is_some());
                if plain && theirs.trim() != own.trim() && !theirs.contains('[') {
                    let what = format!("{}: {key} {} <-> {}", row.name, own.trim(), theirs.trim());
                    push(Kind::Swapped, what, &[(*from, *to, theirs), (*start, *end, own)]);
                }
            }
        }
    }
    found
}

/// Every change of a configuration: numbers, units, switches and whole keys.
pub fn config_mutants(text: &str) -> Vec<Mutant> {
    let mut found = Vec::new();
    let mut begin = 0;
    let mut table = "";
    for line in text.split_inclusive('\n') {
        let end = begin + line.len();
        let plain = line.split('#').next().unwrap_or_default().trim();
        if plain.starts_with('[') {
            table = plain;
        } else if let Some((key, value)) = plain.split_once(" = ") {
            let mut push = |kind, new: String| {
                let what = format!("{table} {key} = {value} -> {}", new.trim());
                let line = line_of(text, begin);
                let text = format!("{}{new}\n{}", &text[..begin], &text[end..]);
                found.push(Mutant { kind, line, what, text });
            };
            push(Kind::Removed, String::new());
            if let Some((from, to)) = number(value).filter(|_| !value.contains(':')) {
                let number = whole(&value[from..to]).unwrap_or(1);
                let with = |number: i64| format!("{key} = {}{number}{}", &value[..from], &value[to..]);
                push(Kind::Sign, with(-number));
                push(Kind::TimesTen, with(number * 10));
                push(Kind::TimesSixty, with(number * 60));
            }
            for (one, other) in
                [("\"revolution\"", "\"millimetre\""), ("true", "false"), ("drive-a", "drive-b")]
            {
                for (from, to) in [(one, other), (other, one)] {
                    if value.contains(from) {
                        push(Kind::Swapped, format!("{key} = {}", value.replace(from, to)));
                    }
                }
            }
        }
        begin = end;
    }
    found
}
