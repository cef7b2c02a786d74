//! What is wrong with a text as TOML, or as the kind of table that it should be.

use std::ops::Range;

use super::{Problem, Source, closest, registry as code};

impl Problem {
    /// A fault of the syntax; `None` when it only follows from another one.
    pub(super) fn from_syntax(error: &toml::de::Error, source: &Source) -> Option<Self> {
        let span = error.span().unwrap_or(0..0);
        if error.message() == "duplicate key" {
            return twice(span, source);
        }
        let (before, after) = source.line_around(span.start);
        let (message, expected) = parts(error.message());
        let words = in_words(&message, before, after);
        let [title, expected, help] = words.unwrap_or([message, expected, String::new()]);
        Some(Self::new(code::SYNTAX, span).title(title).expected(expected).help(help))
    }

    /// A fault of a type or of a key, in a text that is TOML.
    pub(super) fn from_row(error: &toml::de::Error, source: &Source) -> Self {
        let message = error.message();
        let (title, expected) = parts(message);
        let span = error.span().unwrap_or(0..0);
        if let Some(key) = message.strip_prefix("missing field ") {
            let key = key.trim_matches('`');
            let expected = format!("expected the key `{key}` in this table");
            return Self::new(code::MISSING_KEY, span).key(key).title(title).expected(expected);
        }
        if let Some(rest) = message.strip_prefix("unknown field `") {
            let key = rest.split('`').next().unwrap_or_default();
            let known = rest.split('`').skip(2).step_by(2);
            let problem = Self::new(code::UNKNOWN_KEY, span).key(key).title(title).expected(expected);
            return match closest(key, known) {
                Some(closest) => problem.help(format!("did you mean `{closest}`?")),
                None => problem,
            };
        }
        if is_value(&title) {
            return Self::new(code::OUT_OF_RANGE, span).title(title).expected(expected);
        }
        wrong_type(&title, expected, span, source)
    }
}

/// A value of the wrong type, with the value that was meant where that can be seen.
fn wrong_type(title: &str, expected: String, span: Range<usize>, source: &Source) -> Problem {
    let (before, _) = source.line_around(span.start);
    let given = source.slice(&span);
    let key =
        before.trim_end().strip_suffix('=').map(|before| last_word(before.trim_end())).unwrap_or_default();
    let bare = given.trim_matches('"');
    let head = before.trim_start().strip_prefix('[').map(|path| path.trim_start_matches('['));
    let head = head.map(|path| format!("{path}{given}")).or_else(|| {
        Some(given.strip_prefix('[')?.strip_suffix(']')?.to_owned()).filter(|_| before.trim().is_empty())
    });
    if expected == "expected a list"
        && let Some(head) = head
    {
        let problem = Problem::new(code::WRONG_TYPE, span).title(format!("`{head}` is a list of tables"));
        return problem.expected(expected).help(format!("write the head in double brackets: [[{head}]]"));
    }
    let help = match expected.as_str() {
        "expected a list" if !given.is_empty() => format!("write `[{given}]`"),
        "expected a whole number" if given.starts_with('"') && bare.parse::<i64>().is_ok() => {
            format!("write `{bare}`, without quotation marks")
        }
        "expected a whole number" => match given.split_once('.') {
            Some((whole, rest)) if rest.bytes().all(|digit| matches!(digit, b'0' | b'_')) => {
                format!("write `{whole}`, without a decimal point")
            }
            _ => String::new(),
        },
        "expected a number" if given.starts_with('"') && bare.parse::<f64>().is_ok() => {
            format!("write `{bare}`, without quotation marks")
        }
        "expected true or false" if matches!(bare, "true" | "false") => {
            format!("write `{bare}`, without quotation marks")
        }
        "expected a text in quotation marks" => text_like(key, given),
        _ => String::new(),
    };
    let title = match key {
        "" => title.to_owned(),
        key => format!("`{key}` has the wrong type: {}", title.trim_start_matches("invalid type: ")),
    };
    Problem::new(code::WRONG_TYPE, span).key(key).title(title).expected(expected).help(help)
}

/// What a key whose value is a text looks like.
fn text_like(key: &str, given: &str) -> String {
    const TIMES: [&str; 9] =
        ["cycle_time", "setup_cycle", "jitter", "lead", "min", "max", "heartbeat", "guarding", "packet_rate"];
    match key {
        _ if TIMES.contains(&key) => {
            format!("a time has its unit: write `{key} = \"{given} ms\"`, or us, or s")
        }
        "idn" => "an IDN is written in full, such as \"S-0-0047\" or \"P-0-0512\"".to_owned(),
        "object" => "an object is written with its sub-index, such as \"6064:00\"".to_owned(),
        _ => String::new(),
    }
}

/// The same key or table a second time.
fn twice(span: Range<usize>, source: &Source) -> Option<Problem> {
    let (before, _) = source.line_around(span.start);
    let key = source.slice(&span);
    let (_, line, _) = source.place(span.start);
    let place = source.locate(&span)?;
    let text = |at: usize| &place.part.text[place.part.line(at)];
    let is_head = |at: usize| text(at).trim_start().starts_with('[');
    let problem = |what: &str| {
        Problem::new(code::TWICE, span.clone()).key(key).title(what).expected("expected each key once")
    };
    if before.trim_start().starts_with('[') {
        let own = text(line).trim();
        let head = own.trim_matches(['[', ']']);
        let earlier = (1..line).find(|at| {
            let known = text(*at).trim();
            known == own || known.trim_matches(['[', ']']).starts_with(&format!("{head}."))
        });
        let first = earlier.map(|at| place.part.line(at));
        let list = earlier.map(|at| text(at).trim()).filter(|known| *known != own);
        let problem = match list {
            Some(list) => problem(&format!("{own} is not the head of a list"))
                .expected(format!("{head} is a table with lists in it"))
                .help(format!("write the list as well, as in {list}")),
            None => problem(&format!("the table {own} is there twice"))
                .help("put its keys into one table, or write a list of tables in double brackets"),
        };
        return Some(match first {
            Some(first) => problem.related(first, "it is here first"),
            None => problem,
        });
    }
    // The keys of a table that is there twice are not reported again.
    let head = (1..line).rev().find(|at| is_head(*at));
    if let Some(head) = head
        && (1..head).any(|at| text(at).trim() == text(head).trim())
        && !text(head).trim_start().starts_with("[[")
    {
        return None;
    }
    let same = |at: &usize| text(*at).split_once('=').is_some_and(|(name, _)| name.trim() == key);
    let first = (head.unwrap_or(1)..line).find(same);
    let problem = problem(&format!("`{key}` is there twice")).help("remove one of the two");
    Some(match first {
        Some(first) => problem.related(place.part.line(first), "it is here first"),
        None => problem,
    })
}

/// The messages of the library that leave a beginner alone, in words: title, what was expected, what to do.
fn in_words(message: &str, before: &str, after: &str) -> Option<[String; 3]> {
    let words = |title: &str, expected: &str, help: &str| Some([title, expected, help].map(str::to_owned));
    let value = after.split('#').next().unwrap_or(after).trim();
    match message {
        "invalid basic string" | "invalid literal string" => {
            words("the quotation mark at the end is missing", "expected `\"`", "")
        }
        "string values must be quoted" => unquoted(value),
        "unexpected key or value" | "invalid float" => number(message, before, after),
        "invalid unquoted key" if after.starts_with(':') => {
            words("a colon in place of `=`", "expected `=`", "write `key = value`")
        }
        "key with no value" if before.trim_end().ends_with(':') => {
            let key = before.trim().trim_end_matches(':');
            words("a colon in place of `=`", "expected `=`", &format!("write `{key} = {value}`"))
        }
        "invalid boolean" => {
            words("`true` and `false` are written in small letters", "expected true or false", "")
        }
        "unexpected leading zero" => {
            let number = value.trim_start_matches('0');
            let number = if number.is_empty() { "0" } else { number };
            words("a number that begins with 0", "expected no 0 in front", &format!("write `{number}`"))
        }
        "too few unicode value digits" | "missing escaped value" | "invalid escape sequence" => words(
            "a backslash in a text in double quotation marks",
            "expected an escape sequence such as `\\n`",
            "write the text in single quotation marks, or each backslash twice",
        ),
        "missing comma between key-value pairs" => {
            words("a comma is missing between two keys", "expected `,` before this key", "")
        }
        "unclosed array table" | "unclosed table" => {
            words("the bracket at the end of the head is missing", "expected `]`", "")
        }
        _ => None,
    }
}

/// A value that begins like a text, without quotation marks.
fn unquoted(value: &str) -> Option<[String; 3]> {
    let curly = ['\u{201C}', '\u{201D}', '\u{201E}', '\u{201F}', '\u{2018}', '\u{2019}', '\u{AB}', '\u{BB}'];
    let (title, help) = if let Some((value, _)) = value.split_once("//") {
        ("a comment begins with `#`".to_owned(), format!("write `{} # ...`", value.trim_end()))
    } else if value.starts_with(curly) {
        let text = value.trim_matches(curly);
        (
            "typographic quotation marks".to_owned(),
            format!("write `\"{text}\"`, with the quotation marks of a keyboard"),
        )
    } else if value.starts_with(|first: char| first.is_ascii_digit() || first == '-') {
        let number: String =
            value.chars().take_while(|letter| letter.is_ascii_digit() || "-_.".contains(*letter)).collect();
        let help = format!(
            "write `{number}` if the unit is that of the key, or `\"{value}\"` if the key takes a text"
        );
        ("a number with something after it".to_owned(), help)
    } else {
        ("a text without quotation marks".to_owned(), format!("write `\"{value}\"`"))
    };
    Some([title, "expected a number, true, false, or a text in quotation marks".to_owned(), help])
}

/// A number as it is written elsewhere.
fn number(message: &str, before: &str, after: &str) -> Option<[String; 3]> {
    let start = before.rsplit(['=', ' ']).next().unwrap_or_default();
    let all = format!("{start}{after}");
    let value = all.split(['#', ' ']).next().unwrap_or_default();
    let digits =
        |text: &str| !text.is_empty() && text.bytes().all(|digit| digit.is_ascii_digit() || digit == b'_');
    let (whole, rest) = value.split_once([',', '.'])?;
    if !digits(whole.trim_start_matches('-')) {
        return None;
    }
    if value.contains(',') && digits(rest) {
        let help = format!("write `{whole}.{rest}`");
        return Some(["a comma in a number".to_owned(), "expected a decimal point".to_owned(), help]);
    }
    if message == "invalid float" && rest.split('.').all(digits) {
        let help = format!("write `{}` if the points separate thousands", value.replace('.', "_"));
        return Some([
            "a number with more than one point".to_owned(),
            "expected one decimal point at most".to_owned(),
            help,
        ]);
    }
    None
}

/// The word at the end of a text.
fn last_word(text: &str) -> &str {
    text.rsplit(|letter: char| !(letter.is_ascii_alphanumeric() || "_-".contains(letter)))
        .next()
        .unwrap_or_default()
}

/// The library says what it expected behind the last comma of its message, in words of the language.
fn parts(message: &str) -> (String, String) {
    let (title, expected) = match message.split_once(", expected ") {
        Some((title, "u8")) if is_value(title) => (title, "expected 0 to 255".to_owned()),
        Some((title, "u16")) if is_value(title) => (title, "expected 0 to 65535".to_owned()),
        Some((title, "u32")) if is_value(title) => (title, "expected 0 to 4294967295".to_owned()),
        Some((title, "i32")) if is_value(title) => (title, "expected -2147483648 to 2147483647".to_owned()),
        Some((title, "i64" | "u8" | "u16" | "u32" | "i32" | "u64")) => {
            (title, "expected a whole number".to_owned())
        }
        Some((title, "f64" | "f32")) => (title, "expected a number".to_owned()),
        Some((title, "a string")) => (title, "expected a text in quotation marks".to_owned()),
        Some((title, "a boolean")) => (title, "expected true or false".to_owned()),
        Some((title, "a sequence")) => (title, "expected a list".to_owned()),
        Some((title, expected)) => (title, format!("expected {expected}")),
        None => (message, String::new()),
    };
    let title = title.replace("unknown field", "unknown key").replace("missing field", "missing key");
    (title, expected)
}

/// Whether the type is right and the value is not.
fn is_value(title: &str) -> bool {
    title.starts_with("invalid value")
}
