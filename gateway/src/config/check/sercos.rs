//! `[south.sercos]`.

use profile_generic::time::DurationNs;
use profile_sercos::master::config::{AddressPolicy, MasterConfig};

use super::can::check_modes;
use super::{Problems, names, startup, value};
use crate::config::file::{DriveTable, SercosTable};
use crate::config::{Drive, Link, Sercos, duration, rated};
use crate::finding::Spanned;
use crate::finding::registry as code;

const ADDRESS_MAX: i64 = 511;
/// Cycles shorter than the step of the others (S-0-1002).
const SHORT_CYCLES_NS: [i64; 3] = [31_250, 62_500, 125_000];
const CYCLE_STEP_NS: i64 = 250_000;
const CYCLE_MAX_NS: i64 = 65_000_000;
pub(crate) const DEFAULT_JITTER: DurationNs = DurationNs::from_micros(50);
pub(crate) const DEFAULT_ALLOWED_LOSSES: u16 = 5;

pub(super) fn check(problems: &mut Problems, table: &SercosTable) -> Option<Sercos> {
    let link = link(problems, &table.interface, table.ring_interface.as_ref());
    let cycle_time = cycle_time(problems, &table.cycle_time);
    let least = MasterConfig::setup_cycle_least(Sercos::slaves_max(table.drive.len()));
    let setup_cycle =
        value::optional(&table.setup_cycle, |text| setup_cycle(problems, text, DurationNs(i64::from(least))));
    let master_mac = value::optional(&table.master_mac, |text| mac(problems, text));
    let jitter = jitter(problems, table.jitter.as_ref(), cycle_time);
    let cp0_stable_cycles =
        value::number_or(problems, &table.cp0_stable_cycles, "the number of stable cycles", 1..=1000, 100);
    let allowed_losses = value::number_or(
        problems,
        &table.allowed_losses,
        "the number of allowed losses",
        1..=65_535,
        DEFAULT_ALLOWED_LOSSES,
    );
    problems.unique("the SERCOS address", &names(&table.drive, |drive| &drive.address));
    let drives: Vec<_> = table.drive.iter().map(|drive| check_drive(problems, drive.get_ref())).collect();
    let later = || table.drive.iter().filter_map(|drive| drive.get_ref().hot_plug.as_ref());
    let all = later().filter(|hot_plug| *hot_plug.get_ref()).count() == table.drive.len();
    if let Some(first) = later().next().filter(|_| all) {
        problems.report::<()>(first.span(),
            "every drive has `hot_plug = true`",
            "expected at least one drive without it: a bus on which nobody is does not run, and drives are plugged in \
             while it runs",
        );
    }
    Some(Sercos {
        link: link?,
        cycle_time: cycle_time?,
        setup_cycle: setup_cycle?,
        master_mac: master_mac?,
        jitter: jitter?,
        cp0_stable_cycles: cp0_stable_cycles?,
        allowed_losses: allowed_losses?,
        addresses: match table.assign_addresses {
            Some(true) => AddressPolicy::Assign,
            Some(false) | None => AddressPolicy::Refuse,
        },
        drives: drives.into_iter().collect::<Option<_>>()?,
    })
}

fn link(problems: &mut Problems, name: &Spanned<String>, ring: Option<&Spanned<String>>) -> Option<Link> {
    let first = value::interface(problems, name);
    let second = ring.map(|ring| value::interface(problems, ring));
    let Some(ring) = ring else {
        return first.map(|first| match first {
            None => Link::InProcess { ring: false },
            Some(name) => Link::Interface { name, ring: None },
        });
    };
    match (first?, second??) {
        (None, None) => Some(Link::InProcess { ring: true }),
        (Some(first), Some(second)) if first != second => {
            Some(Link::Interface { name: first, ring: Some(second) })
        }
        (Some(first), Some(_)) => problems.report(
            ring.span(),
            format_args!("`{first}` is the interface of the first port already"),
            "expected another interface: both ends of a ring have a port of their own",
        ),
        _ => problems.report_as(
            code::CONTRADICTION,
            ring.span(),
            "simulated and real drives cannot share a ring",
            "expected two names of interfaces, or \"in-process\" for both",
        ),
    }
}

fn cycle_time(problems: &mut Problems, text: &Spanned<String>) -> Option<DurationNs> {
    let time = value::time_span(problems, text)?;
    let long = (CYCLE_STEP_NS..=CYCLE_MAX_NS).contains(&time.0) && time.0 % CYCLE_STEP_NS == 0;
    if long || SHORT_CYCLES_NS.contains(&time.0) {
        return Some(time);
    }
    problems.report(
        text.span(),
        format_args!("{} is not a SERCOS III cycle time", duration::show(time)),
        "expected 31.25 us, 62.5 us, 125 us, 250 us, or a multiple of 250 us up to 65 ms",
    )
}

fn setup_cycle(problems: &mut Problems, text: &Spanned<String>, least: DurationNs) -> Option<DurationNs> {
    let time = value::time_span(problems, text)?;
    if (least.0..=CYCLE_MAX_NS).contains(&time.0) && time.0 % CYCLE_STEP_NS == 0 {
        return Some(time);
    }
    problems.report(
        text.span(),
        format_args!("{} cannot be the cycle of phases 0 to 2", duration::show(time)),
        format_args!("expected a multiple of 250 us from {} to 65 ms", duration::show(least)),
    )
}

fn jitter(
    problems: &mut Problems,
    text: Option<&Spanned<String>>,
    cycle: Option<DurationNs>,
) -> Option<DurationNs> {
    let Some(text) = text else {
        return cycle.map(|cycle| DEFAULT_JITTER.min(DurationNs(cycle.0 / 4)));
    };
    let jitter = value::time_span(problems, text)?;
    let most = DurationNs(cycle?.0 / 4);
    if (DurationNs(1_000)..=most).contains(&jitter) {
        return Some(jitter);
    }
    problems.report(
        text.span(),
        format_args!("a jitter of {} does not suit the cycle", duration::show(jitter)),
        format_args!("expected 1 us to a quarter of the cycle, {}", duration::show(most)),
    )
}

fn mac(problems: &mut Problems, text: &Spanned<String>) -> Option<[u8; 6]> {
    let bytes: Vec<u8> = text
        .get_ref()
        .split(':')
        .filter(|part| part.len() == 2 && part.bytes().all(|byte| byte.is_ascii_hexdigit()))
        .filter_map(|part| u8::from_str_radix(part, 16).ok())
        .collect();
    match <[u8; 6]>::try_from(bytes) {
        // A group address cannot send, and all zeroes is no address.
        Ok(mac) if text.get_ref().len() == 17 && mac[0] & 1 == 0 && mac != [0; 6] => Some(mac),
        _ => problems.report(
            text.span(),
            format_args!("`{}` is not the Ethernet address of a station", text.get_ref()),
            "expected six bytes, such as \"02:00:00:00:00:01\", the first one even",
        ),
    }
}

fn check_drive(problems: &mut Problems, table: &DriveTable) -> Option<Drive> {
    let name = value::name(problems, "drive", &table.name);
    let address = value::number(problems, &table.address, "the SERCOS address", 1..=ADDRESS_MAX);
    let rated = value::optional(&table.rated_torque, |text| {
        rated::parse(text.get_ref()).or_else(|| {
            problems.report(
                text.span(),
                format!("`{}` is not a torque or force", text.get_ref()),
                rated::EXPECTED,
            )
        })
    });
    let modes = value::optional(&table.modes, |names| check_modes(problems, names));
    let startup = startup::sercos(problems, table);
    Some(Drive {
        name: name?,
        address: address?,
        set_scaling: table.set_scaling.unwrap_or(false),
        acknowledges: table.acknowledges.unwrap_or(true),
        modes: modes?,
        rated: rated?,
        hot_plug: table.hot_plug.as_ref().is_some_and(|hot_plug| *hot_plug.get_ref()),
        startup: startup?,
    })
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    const DRIVE: &str = "[[drive]]\nname = \"a\"\naddress = 1\n";

    fn titles(keys: &str, drives: &str) -> Vec<String> {
        let text = format!("interface = \"in-process\"\n{keys}\n{drives}");
        checked(&text, check).map(|_: Sercos| Vec::new()).unwrap_or_else(|titles| titles)
    }

    #[test]
    fn cycles_are_those_of_the_standard_and_the_jitter_fits() {
        for good in ["31.25 us", "250 us", "65 ms"] {
            assert!(titles(&format!("cycle_time = \"{good}\""), DRIVE).is_empty(), "{good}");
        }
        assert_eq!(titles("cycle_time = \"300 us\"", DRIVE), ["300 us is not a SERCOS III cycle time"]);
        assert_eq!(
            titles("cycle_time = \"1 ms\"\njitter = \"251 us\"", DRIVE),
            ["a jitter of 251 us does not suit the cycle"]
        );
    }

    #[test]
    fn a_master_has_the_address_of_a_station() {
        for (text, good) in [
            ("02:00:00:00:00:01", true),
            ("03:00:00:00:00:01", false),
            ("00:00:00:00:00:00", false),
            ("02:00:00:00:00", false),
        ] {
            let titles = titles(&format!("cycle_time = \"1 ms\"\nmaster_mac = \"{text}\""), DRIVE);
            assert_eq!(titles.is_empty(), good, "{text}");
        }
    }

    #[test]
    fn faults_of_several_drives_are_reported_together() {
        let drives = "[[drive]]\nname = \"a b\"\naddress = 512\n[[drive]]\nname = \"b\"\naddress = 512\nrated_torque = \"2\"\n";
        assert_eq!(
            titles("cycle_time = \"1 ms\"", drives),
            [
                "the SERCOS address `512` is used twice",
                "`a b` cannot be the name of a drive",
                "the SERCOS address is 512",
                "the SERCOS address is 512",
                "`2` is not a torque or force",
            ]
        );
    }

    #[test]
    fn modes_begin_with_one_that_set_points_lead() {
        let with = |modes: &str| titles("cycle_time = \"1 ms\"", &format!("{DRIVE}modes = [{modes}]\n"));
        assert_eq!(with("\"velocity\", \"homing\", \"positioning\""), Vec::<String>::new());
        for (modes, expected) in [
            ("\"homing\"", "an axis cannot start in the mode `homing`"),
            ("\"positioning\", \"position\"", "an axis cannot start in the mode `positioning`"),
            ("", "an axis without a mode"),
            ("\"position\", \"gearing\"", "unknown mode `gearing`"),
        ] {
            assert_eq!(with(modes), [expected], "{modes}");
        }
    }
}
