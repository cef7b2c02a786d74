//! Single values, whatever table they stand in: each function reports a value that cannot be used.

use std::net::{Ipv4Addr, SocketAddr};
use std::ops::RangeInclusive;

use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::time::DurationNs;

use super::Problems;
use crate::config::{duration, size};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned, closest};

const NAME_LEN_MAX: usize = 32;
/// Longest name of a network interface on Linux.
const INTERFACE_LEN_MAX: usize = 15;

/// A link name that stands for simulated drives.
pub(super) const IN_PROCESS: &str = "in-process";

/// Axis units to units of 1e-9.
pub(super) const NANO: Option<Ratio> = Ratio::new(1_000_000_000, 1);

pub(super) fn path(problems: &mut Problems, path: &Spanned<String>, what: &str) {
    if path.get_ref().is_empty() {
        problems.report::<()>(path.span(), format_args!("the path of {what} is empty"), "expected a path");
    }
}

/// A name that other parts of the file refer to.
pub(super) fn name(problems: &mut Problems, what: &str, name: &Spanned<String>) -> Option<String> {
    let text = name.get_ref();
    let good = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    if good && (1..=NAME_LEN_MAX).contains(&text.len()) {
        return Some(text.clone());
    }
    problems.report(
        name.span(),
        format_args!("`{text}` cannot be the name of a {what}"),
        "expected 1 to 32 letters, digits, `-` and `_`",
    )
}

/// A name for people.
pub(super) fn label(problems: &mut Problems, what: &str, name: &Spanned<String>) -> Option<String> {
    let text = name.get_ref();
    let good = text.bytes().all(|byte| (0x20..0x7F).contains(&byte)) && !text.trim().is_empty();
    if good && text.len() <= NAME_LEN_MAX {
        return Some(text.clone());
    }
    problems.report(
        name.span(),
        format_args!("`{text}` cannot be the name of {what}"),
        "expected 1 to 32 printable ASCII characters",
    )
}

pub(super) fn time_span(problems: &mut Problems, text: &Spanned<String>) -> Option<DurationNs> {
    match duration::parse(text.get_ref()) {
        Some(time) => Some(time),
        None => problems.report(
            text.span(),
            format_args!("`{}` is not a time", text.get_ref()),
            format_args!("expected {}", duration::EXPECTED),
        ),
    }
}

/// A number of bytes in a range.
pub(super) fn size(
    problems: &mut Problems,
    text: &Spanned<String>,
    what: &str,
    range: RangeInclusive<usize>,
) -> Option<usize> {
    let given = text.get_ref();
    match size::parse(given) {
        None => problems.report(
            text.span(),
            format_args!("`{given}` is not a size"),
            format_args!("expected {}", size::EXPECTED),
        ),
        Some(bytes) if range.contains(&bytes) => Some(bytes),
        Some(_) => problems.report_as(
            code::OUT_OF_RANGE,
            text.span(),
            format_args!("{what} is `{given}`"),
            format_args!("expected {} to {}", size::show(*range.start()), size::show(*range.end())),
        ),
    }
}

pub(super) fn own_address(problems: &mut Problems, text: &Spanned<String>) -> Option<Ipv4Addr> {
    match text.get_ref().parse::<Ipv4Addr>() {
        Ok(address) if !address.is_unspecified() && !address.is_multicast() && !address.is_broadcast() => {
            Some(address)
        }
        _ => problems.report(
            text.span(),
            format_args!("`{}` is not an address that a device can have", text.get_ref()),
            "expected one IPv4 address of this host, without port, such as \"192.168.1.10\"",
        ),
    }
}

pub(super) fn socket_address(problems: &mut Problems, text: &Spanned<String>) -> Option<SocketAddr> {
    match text.get_ref().parse() {
        Ok(address) => Some(address),
        Err(_) => problems.report(
            text.span(),
            format_args!("`{}` is not an address with a port", text.get_ref()),
            "expected an address such as \"0.0.0.0:502\" or \"[::]:502\"",
        ),
    }
}

pub(super) fn number<T: TryFrom<i64>>(
    problems: &mut Problems,
    value: &Spanned<i64>,
    what: &str,
    range: RangeInclusive<i64>,
) -> Option<T> {
    let given = *value.get_ref();
    match T::try_from(given) {
        Ok(number) if range.contains(&given) => Some(number),
        _ => problems.report_as(
            code::OUT_OF_RANGE,
            value.span(),
            format_args!("{what} is {given}"),
            format_args!("expected {} to {}", range.start(), range.end()),
        ),
    }
}

pub(super) fn number_or<T: TryFrom<i64>>(
    problems: &mut Problems,
    value: &Option<Spanned<i64>>,
    what: &str,
    range: RangeInclusive<i64>,
    default: T,
) -> Option<T> {
    value.as_ref().map_or(Some(default), |value| number(problems, value, what, range))
}

/// An optional value above zero in fine units.
pub(super) fn positive(
    problems: &mut Problems,
    value: &Option<Spanned<f64>>,
    what: &str,
    scale: Option<Ratio>,
) -> Option<Option<i64>> {
    optional(value, |value| match fine(problems, value, what, scale)? {
        fine if fine > 0 => Some(fine),
        _ => not_above_zero(problems, value, what),
    })
}

/// An optional value of zero or above in fine units.
pub(super) fn not_negative(
    problems: &mut Problems,
    value: &Option<Spanned<f64>>,
    what: &str,
    scale: Option<Ratio>,
) -> Option<Option<i64>> {
    optional(value, |value| {
        let fine = fine(problems, value, what, scale)?;
        // One that is rounded to zero would be none.
        if *value.get_ref() == 0.0 || fine > 0 {
            return Some(fine);
        }
        let title = format!("{what} is {}", value.get_ref());
        problems.report_as(code::OUT_OF_RANGE, value.span(), title, "expected 0 or a number above it")
    })
}

fn not_above_zero<T>(problems: &mut Problems, value: &Spanned<f64>, what: &str) -> Option<T> {
    let title = format!("{what} is {}", value.get_ref());
    problems.report_as(code::OUT_OF_RANGE, value.span(), title, "expected a number above 0")
}

/// A value in fine units, rounded to the nearest.
pub(super) fn fine(
    problems: &mut Problems,
    value: &Spanned<f64>,
    what: &str,
    scale: Option<Ratio>,
) -> Option<i64> {
    match scale?.apply_f64(*value.get_ref(), Rounding::Nearest) {
        Ok(fine) => Some(fine),
        Err(_) => problems.report_as(
            code::OUT_OF_RANGE,
            value.span(),
            format_args!("{what} {} is too large", value.get_ref()),
            "expected a number that fits 64 bits in units of 1e-9",
        ),
    }
}

/// A number above 0 with up to nine decimals as an exact ratio.
pub(super) fn exact(problems: &mut Problems, value: &Spanned<f64>, what: &str) -> Option<Ratio> {
    let nano = fine(problems, value, what, NANO)?;
    let ratio = Ratio::new(nano, NANO?.num()).filter(|_| nano > 0);
    ratio.or_else(|| not_above_zero(problems, value, what))
}

/// A word of a list.
pub(super) fn word<T: Copy>(
    problems: &mut Problems,
    name: &Spanned<String>,
    what: &str,
    known: &[(&str, T)],
) -> Option<T> {
    let found = known.iter().find(|(word, _)| *word == name.get_ref()).map(|(_, value)| *value);
    found.or_else(|| {
        let all: Vec<_> = known.iter().map(|(word, _)| format!("\"{word}\"")).collect();
        let expected = match all.split_last() {
            Some((last, others @ [_, ..])) => format!("{} or {last}", others.join(", ")),
            _ => all.concat(),
        };
        let near = closest(name.get_ref(), known.iter().map(|(word, _)| *word));
        let help = near
            .map(|near| format!("did you mean \"{near}\"?"))
            .or_else(|| other_word(name.get_ref(), known));
        let problem = Problem::new(code::UNKNOWN_WORD, name.span());
        let problem = problem.title(format!("unknown {what} `{}`", name.get_ref()));
        problems.push(problem.expected(format!("expected {expected}")).help(help.unwrap_or_default()));
        None
    })
}

/// What to write for a word that means one of those known.
fn other_word<T>(word: &str, known: &[(&str, T)]) -> Option<String> {
    const TURNS: [&str; 10] =
        ["degree", "degrees", "deg", "\u{B0}", "rad", "radian", "rev", "turn", "turns", "rotation"];
    const LENGTHS: [&str; 8] = ["mm", "m", "metre", "meter", "cm", "um", "inch", "in"];
    let has = |word: &str| known.iter().any(|(known, _)| *known == word);
    let resolution = "; `motion_resolution` says how many counts of the controller it has";
    match word.to_lowercase().as_str() {
        "mm" if has("millimetre") => Some("write \"millimetre\"".to_owned()),
        word if TURNS.contains(&word) && has("revolution") => {
            Some(format!("write \"revolution\"{resolution}"))
        }
        word if LENGTHS.contains(&word) && has("millimetre") => {
            Some(format!("write \"millimetre\"{resolution}"))
        }
        _ => None,
    }
}

/// A word of a list that may be missing.
pub(super) fn word_or<T: Copy>(
    problems: &mut Problems,
    name: Option<&Spanned<String>>,
    what: &str,
    known: &[(&str, T)],
    default: T,
) -> Option<T> {
    name.map_or(Some(default), |name| word(problems, name, what, known))
}

/// Words of a list, each once.
pub(super) fn words<T: Copy>(
    problems: &mut Problems,
    names: &Spanned<Vec<Spanned<String>>>,
    what: &str,
    known: &[(&str, T)],
) -> Option<Vec<T>> {
    problems.unique(&format!("the {what}"), names.get_ref());
    let words: Vec<_> = names.get_ref().iter().map(|name| word(problems, name, what, known)).collect();
    words.into_iter().collect()
}

/// The name of an interface, `None` for drives in the process.
#[expect(clippy::option_option, reason = "the outer one says that there is an error, as everywhere here")]
pub(super) fn interface(problems: &mut Problems, name: &Spanned<String>) -> Option<Option<String>> {
    let text = name.get_ref();
    if text == IN_PROCESS {
        return Some(None);
    }
    if text.is_empty() || text.len() > INTERFACE_LEN_MAX || text.contains(['/', ' ', '\0']) {
        return problems.report(
            name.span(),
            format_args!("`{text}` cannot be a network interface"),
            "expected the name of an interface, 1 to 15 characters, or \"in-process\"",
        );
    }
    Some(Some(text.clone()))
}

/// A value that may be missing, read by `read` where it is there.
#[expect(clippy::option_option, reason = "the outer one says that there is an error, as everywhere here")]
pub(super) fn optional<T, V>(value: &Option<T>, read: impl FnOnce(&T) -> Option<V>) -> Option<Option<V>> {
    value.as_ref().map_or(Some(None), |value| read(value).map(Some))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on<V, T>(
        value: V,
        read: impl FnOnce(&mut Problems, &Spanned<V>) -> Option<T>,
    ) -> Result<T, Vec<String>> {
        let mut problems = Problems::default();
        let read = read(&mut problems, &Spanned::new(3..5, value));
        problems.done(read).map_err(|problems| {
            assert_eq!(problems[0].span, 3..5);
            problems.into_iter().map(|problem| format!("{}: {}", problem.title, problem.expected)).collect()
        })
    }

    #[test]
    fn names_are_plain_and_labels_printable() {
        let long = "x".repeat(33);
        assert_eq!(
            on("a-B_1".to_owned(), |problems, text| name(problems, "axis", text)),
            Ok("a-B_1".to_owned())
        );
        for bad in ["", "a b", "ä", long.as_str()] {
            let expected = format!(
                "`{bad}` cannot be the name of a axis: expected 1 to 32 letters, digits, `-` and `_`"
            );
            assert_eq!(
                on(bad.to_owned(), |problems, text| name(problems, "axis", text)),
                Err(vec![expected])
            );
        }
        assert_eq!(
            on("a b".to_owned(), |problems, text| label(problems, "the box", text)),
            Ok("a b".to_owned())
        );
        for bad in ["", "  ", "ä", long.as_str()] {
            assert!(on(bad.to_owned(), |problems, text| label(problems, "the box", text)).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_fit_range_and_type() {
        let read =
            |number_: i64| on(number_, |problems, value| number::<u8>(problems, value, "the node", 1..=300));
        assert_eq!((read(1), read(255)), (Ok(1), Ok(255)));
        for bad in [0, 256, 301, -1] {
            assert_eq!(read(bad), Err(vec![format!("the node is {bad}: expected 1 to 300")]));
        }
    }

    #[test]
    fn words_are_those_of_the_list_each_once() {
        let known = [("one", 1), ("two", 2)];
        let list = |words_: &[&str]| {
            words_.iter().map(|word| Spanned::new(3..5, (*word).to_owned())).collect::<Vec<_>>()
        };
        let read = |given: &[&str]| on(list(given), |problems, names| words(problems, names, "mode", &known));
        assert_eq!(read(&["two", "one"]), Ok(vec![2, 1]));
        assert_eq!(
            read(&["one", "one", "three"]),
            Err(vec![
                "the mode `one` is used twice: expected one that is not used yet".to_owned(),
                "unknown mode `three`: expected \"one\" or \"two\"".to_owned(),
            ])
        );
    }

    #[test]
    fn exact_numbers_are_above_zero_and_fit() {
        assert_eq!(
            on(2.5, |problems, value| exact(problems, value, "the way")),
            Ok(Ratio::new(5, 2).unwrap())
        );
        assert_eq!(
            on(0.0, |problems, value| exact(problems, value, "the way")),
            Err(vec!["the way is 0: expected a number above 0".to_owned()])
        );
        assert!(on(1e18, |problems, value| exact(problems, value, "the way")).is_err());
    }

    #[test]
    fn addresses_are_those_that_can_be_had() {
        let device = |text: &str| on(text.to_owned(), own_address);
        assert_eq!(device("192.0.2.1"), Ok(Ipv4Addr::new(192, 0, 2, 1)));
        for bad in ["0.0.0.0", "224.0.0.1", "255.255.255.255", "192.0.2.1:1", "x"] {
            assert!(device(bad).is_err(), "{bad}");
        }
        let listen = |text: &str| on(text.to_owned(), socket_address).is_ok();
        assert_eq!((listen("[::]:502"), listen("0.0.0.0")), (true, false));
        let names = ["eth0", "in-process", "", "a/b", "sixteen-letters-"];
        let names = names.map(|text| on(text.to_owned(), interface).ok());
        assert_eq!(names, [Some(Some("eth0".to_owned())), Some(None), None, None, None]);
    }
}
