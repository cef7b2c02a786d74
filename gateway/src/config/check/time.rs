//! `[time]`.

use std::net::Ipv4Addr;
use std::path::PathBuf;

use profile_generic::time::DurationNs;

use super::{Problems, value};
use crate::config::duration;
use crate::config::file::TimeTable;
use crate::config::{Time, TimeSource};
use crate::finding::Spanned;

/// Where system time can come from.
pub(in crate::config) const SOURCES: [(&str, TimeSource); 5] = [
    ("ptp", TimeSource::Ptp),
    ("daemon", TimeSource::Daemon),
    ("host", TimeSource::Host),
    ("shared", TimeSource::Shared),
    ("none", TimeSource::None),
];

/// Least and largest offset of a clock that is called synchronized.
const THRESHOLD: [DurationNs; 2] = [DurationNs::from_micros(1), DurationNs::from_millis(10)];

/// Largest asymmetry of a path.
const ASYMMETRY_MAX: DurationNs = DurationNs::from_millis(10);

/// Checks the table, or takes the defaults where there is none; `listen` has the addresses of the devices.
pub(super) fn check(problems: &mut Problems, table: Option<&TimeTable>, listen: &[Ipv4Addr]) -> Option<Time> {
    let usual = usual_source(listen);
    let Some(table) = table else { return Some(Time { source: usual, ..Time::default() }) };
    let source = value::word_or(problems, table.source.as_ref(), "time source", &SOURCES, usual);
    let interface = value::optional(&table.interface, |name| value::interface(problems, name));
    let domain = value::number_or(problems, &table.domain, "the PTP domain", 0..=127, 0);
    let threshold = value::optional(&table.threshold, |text| value::time_span(problems, text));
    let threshold = threshold.map(|given| given.unwrap_or(Time::default().threshold));
    if let (Some(text), Some(threshold)) = (&table.threshold, threshold)
        && !(THRESHOLD[0]..=THRESHOLD[1]).contains(&threshold)
    {
        let [least, most] = THRESHOLD.map(duration::show);
        problems.report::<()>(
            text.span(),
            format_args!("a threshold of {} cannot be used", duration::show(threshold)),
            format_args!("expected \"{least}\" to \"{most}\""),
        );
        return None;
    }
    let asymmetry = value::optional(&table.asymmetry, |text| value::time_span(problems, text));
    let asymmetry = asymmetry.map(|given| given.unwrap_or(DurationNs::ZERO));
    if let (Some(text), Some(asymmetry)) = (&table.asymmetry, asymmetry)
        && asymmetry > ASYMMETRY_MAX
    {
        return problems.report(
            text.span(),
            format_args!("an asymmetry of {} cannot be used", duration::show(asymmetry)),
            format_args!("expected \"0 ns\" to \"{}\"", duration::show(ASYMMETRY_MAX)),
        );
    }
    let asymmetry = if table.asymmetry_is_upstream == Some(true) {
        asymmetry.map(|asymmetry| DurationNs::ZERO - asymmetry)
    } else {
        asymmetry
    };
    for path in table.socket.iter().chain(&table.phc) {
        value::path(problems, path, "system time");
    }
    let path = |path: &Spanned<String>| PathBuf::from(path.get_ref());
    Some(Time {
        card_stamps: table.card_stamps.unwrap_or(Time::default().card_stamps),
        socket: table.socket.as_ref().map_or(Time::default().socket, path),
        phc: table.phc.as_ref().map(path),
        source: source?,
        interface: interface?.flatten(),
        domain: domain?,
        threshold: threshold?,
        asymmetry: asymmetry?,
    })
}

/// A box that only programs of its own host can reach shares their clock.
fn usual_source(listen: &[Ipv4Addr]) -> TimeSource {
    if listen.iter().all(Ipv4Addr::is_loopback) { TimeSource::Shared } else { TimeSource::Host }
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    const OUTSIDE: [Ipv4Addr; 2] = [Ipv4Addr::LOCALHOST, Ipv4Addr::new(192, 0, 2, 1)];

    #[test]
    fn a_box_that_nobody_outside_can_reach_shares_its_clock() {
        let source = |listen: &[Ipv4Addr]| check(&mut Problems::default(), None, listen).unwrap().source;
        assert_eq!(source(&[Ipv4Addr::LOCALHOST, Ipv4Addr::new(127, 0, 0, 9)]), TimeSource::Shared);
        assert_eq!(source(&OUTSIDE), TimeSource::Host);
    }

    #[test]
    fn every_key_is_taken() {
        let time = |text| checked(text, |problems, table| check(problems, Some(table), &OUTSIDE));
        assert_eq!(time(""), Ok(Time { source: TimeSource::Host, ..Time::default() }));
        let expected = Time {
            source: TimeSource::Ptp,
            interface: Some("eth1".to_owned()),
            domain: 3,
            threshold: DurationNs::from_micros(50),
            asymmetry: DurationNs(250),
            card_stamps: false,
            socket: "/run/ptp/own".into(),
            phc: Some("/dev/ptp3".into()),
        };
        let text = "source = \"ptp\"\ninterface = \"eth1\"\ndomain = 3\nthreshold = \"50 us\"\nasymmetry = \"250 ns\"\ncard_stamps = false\n\
             socket = \"/run/ptp/own\"\nphc = \"/dev/ptp3\"";
        assert_eq!(time(text), Ok(expected.clone()));
        let upstream = format!("{text}\nasymmetry_is_upstream = true");
        assert_eq!(time(&upstream), Ok(Time { asymmetry: DurationNs(-250), ..expected }));
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let errors =
            |text| checked(text, |problems, table| check(problems, Some(table), &OUTSIDE)).unwrap_err();
        for (text, title) in [
            ("domain = 128", "the PTP domain is 128"),
            ("threshold = \"999 ns\"", "a threshold of 999 ns cannot be used"),
            ("threshold = \"11 ms\"", "a threshold of 11 ms cannot be used"),
            ("threshold = \"now\"", "`now` is not a time"),
            ("asymmetry = \"11 ms\"", "an asymmetry of 11 ms cannot be used"),
            ("interface = \"a/b\"", "`a/b` cannot be a network interface"),
        ] {
            assert_eq!(errors(text), [title], "{text}");
        }
    }
}
