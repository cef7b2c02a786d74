//! What is wrong with a text as TOML, or as the kind of table that it should be.

use super::{Problem, registry as code};

impl Problem {
    /// A fault of the syntax.
    #[must_use]
    pub fn from_syntax(error: &toml::de::Error) -> Self {
        let (title, expected) = parts(error.message());
        let code = if error.message() == "duplicate key" { code::TWICE } else { code::SYNTAX };
        Self::new(code, error.span().unwrap_or(0..0)).title(title).expected(expected)
    }

    /// A fault of a type or of a key, in a text that is TOML.
    #[must_use]
    pub fn from_row(error: &toml::de::Error) -> Self {
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
            return match super::closest(key, known) {
                Some(closest) => problem.help(format!("did you mean `{closest}`?")),
                None => problem,
            };
        }
        let code = if is_value(&title) { code::OUT_OF_RANGE } else { code::WRONG_TYPE };
        Self::new(code, span).title(title).expected(expected)
    }
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
