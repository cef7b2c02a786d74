//! The DeviceNet networks of a configuration.

use profile_cip::devicenet::connection::TIMEOUT_MULTIPLIER;
use profile_cip::devicenet::master::config::{DataRate, ExpectedIdentity};
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::time::DurationNs;

use super::can::MODES;
use super::{Problems, can, startup, value};
use crate::config::file::{DevicenetDriveTable, DevicenetTable};
use crate::config::{Devicenet, DevicenetDrive, DevicenetKind, duration};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};

/// DeviceNet networks of one box.
const NETWORKS_MAX: usize = 4;
const RATES: [DataRate; 3] = [DataRate::Rate125, DataRate::Rate250, DataRate::Rate500];
const CYCLE_MS: core::ops::RangeInclusive<i64> = 1..=1_000;
const MAC_IDS: core::ops::RangeInclusive<i64> = 0..=63;
const DEFAULT_MAC_ID: u8 = 0;
const PACKET_RATE_MS: core::ops::RangeInclusive<i64> = 1..=10_000;
const DEFAULT_ASSEMBLY: u8 = 21;
const MILLISECOND_NS: i64 = 1_000_000;

/// What a drive can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::config) enum Kind {
    Motion,
    Speed,
}

pub(in crate::config) const KINDS: [(&str, Kind); 2] = [("motion", Kind::Motion), ("ac-dc", Kind::Speed)];

/// All DeviceNet networks.
pub(super) fn check(problems: &mut Problems, tables: &[Spanned<DevicenetTable>]) -> Option<Vec<Devicenet>> {
    problems.count(tables, "DeviceNet networks", NETWORKS_MAX);
    let networks: Vec<_> = tables.iter().map(|table| network(problems, table.get_ref())).collect();
    networks.into_iter().collect()
}

fn network(problems: &mut Problems, table: &DevicenetTable) -> Option<Devicenet> {
    let link = can::can_link(problems, &table.interface, table.set_bit_rate);
    let rate = data_rate(problems, table.bit_rate.as_ref());
    let cycle_time = whole_milliseconds(problems, &table.cycle_time, "the cycle of a DeviceNet", CYCLE_MS);
    let mac = value::number_or(problems, &table.mac_id, "the MAC ID of the gateway", MAC_IDS, DEFAULT_MAC_ID);
    let allowed_losses =
        value::number_or(problems, &table.allowed_losses, "the number of allowed losses", 1..=100, 3);
    if table.drive.is_empty() {
        return problems.report(
            table.interface.span(),
            format_args!("the DeviceNet on `{}` has no drives", table.interface.get_ref()),
            "expected at least one [[south.devicenet.drive]]",
        );
    }
    mac_ids(problems, table, mac);
    let drives: Vec<_> =
        table.drive.iter().map(|drive| check_drive(problems, drive.get_ref(), cycle_time)).collect();
    Some(Devicenet {
        link: link?,
        rate: rate?,
        cycle_time: DurationNs::from_millis(cycle_time?),
        mac: MacId::new(mac?)?,
        allowed_losses: allowed_losses?,
        drives: drives.into_iter().collect::<Option<_>>()?,
    })
}

fn data_rate(problems: &mut Problems, given: Option<&Spanned<i64>>) -> Option<DataRate> {
    let Some(given) = given else { return Some(DataRate::default()) };
    let known = RATES.into_iter().find(|rate| i64::from(rate.bits_per_second()) == *given.get_ref());
    known.or_else(|| {
        problems.report_as(
            code::OUT_OF_RANGE,
            given.span(),
            format_args!("the bit rate is {}", given.get_ref()),
            "expected 125000, 250000 or 500000",
        )
    })
}

/// A time as so many milliseconds.
fn whole_milliseconds(
    problems: &mut Problems,
    text: &Spanned<String>,
    what: &str,
    range: core::ops::RangeInclusive<i64>,
) -> Option<i64> {
    let time = value::time_span(problems, text)?;
    let ms = time.0 / MILLISECOND_NS;
    if time.0 % MILLISECOND_NS == 0 && range.contains(&ms) {
        return Some(ms);
    }
    problems.report(
        text.span(),
        format_args!("{} cannot be {what}", duration::show(time)),
        format_args!("expected {} ms to {} ms in whole milliseconds", range.start(), range.end()),
    )
}

/// Each MAC ID once, that of the box included.
fn mac_ids(problems: &mut Problems, table: &DevicenetTable, own: Option<u8>) {
    for (index, drive) in table.drive.iter().enumerate() {
        let mac = &drive.get_ref().mac_id;
        let earlier = table.drive[..index].iter().map(|drive| &drive.get_ref().mac_id);
        if let Some(first) = earlier.into_iter().find(|earlier| earlier.get_ref() == mac.get_ref()) {
            let problem = Problem::new(code::TWICE, mac.span())
                .title(format!("MAC ID {} is used twice", mac.get_ref()));
            let problem = problem.expected("expected each MAC ID once on a network");
            problems.push(problem.related(first.span(), "used here first"));
        }
        if own.is_some_and(|own| i64::from(own) == *mac.get_ref()) {
            problems.report_as::<()>(
                code::CONTRADICTION,
                mac.span(),
                format_args!("MAC ID {} is that of the gateway", mac.get_ref()),
                "expected another one, or another `mac_id` of the network",
            );
        }
    }
}

fn check_drive(
    problems: &mut Problems,
    table: &DevicenetDriveTable,
    cycle: Option<i64>,
) -> Option<DevicenetDrive> {
    let name = value::name(problems, "drive", &table.name);
    let mac: Option<u8> = value::number(problems, &table.mac_id, "the MAC ID", MAC_IDS);
    let kind = match &table.kind {
        None => Some(Kind::Motion),
        Some(word) => value::word(problems, word, "kind of drive", &KINDS),
    };
    let packet_rate = packet_rate(problems, table, cycle);
    let vendor =
        value::optional(&table.vendor_id, |id| value::number(problems, id, "the vendor number", 1..=65_535));
    let product = value::optional(&table.product_code, |code| {
        value::number(problems, code, "the product code", 0..=65_535)
    });
    let way_of_a_turn = value::optional(&table.millimetres_per_turn, |value| {
        value::exact(problems, value, "the way of a turn")
    });
    let kind = match kind {
        Some(Kind::Motion) => motion_drive(problems, table),
        Some(Kind::Speed) => speed_drive(problems, table),
        None => None,
    };
    let startup = startup::devicenet(problems, table);
    let identity = ExpectedIdentity { vendor: vendor?, product_code: product?, ..Default::default() };
    Some(DevicenetDrive {
        name: name?,
        mac: MacId::new(mac?)?,
        packet_rate_ms: packet_rate?,
        identity,
        way_of_a_turn: way_of_a_turn?,
        startup: startup?,
        kind: kind?,
    })
}

fn motion_drive(problems: &mut Problems, table: &DevicenetDriveTable) -> Option<DevicenetKind> {
    let only = "expected it only at a drive of kind \"ac-dc\"";
    out_of_place(problems, table.assembly.as_ref().map(|value| (value.span(), "assembly")), only);
    out_of_place(problems, table.speed_scale.as_ref().map(|value| (value.span(), "speed_scale")), only);
    let modes = match &table.modes {
        None => Some(MODES.iter().map(|(_, mode)| *mode).collect()),
        Some(names) => value::words(problems, names, "mode", &MODES),
    };
    if let Some(names) = table.modes.as_ref().filter(|names| names.get_ref().is_empty()) {
        problems.report::<()>(names.span(), "an axis without a mode", "expected at least one mode");
    }
    let Some(resolution) = &table.resolution else {
        return problems.report(
            table.name.span(),
            format_args!("`resolution` of the drive `{}` is missing", table.name.get_ref()),
            "expected `resolution`, its position counts in a unit: no update of the fixed format tells it",
        );
    };
    let resolution = value::number(problems, resolution, "the resolution", 1..=i64::from(i32::MAX));
    Some(DevicenetKind::Motion { modes: modes?, resolution: resolution? })
}

fn speed_drive(problems: &mut Problems, table: &DevicenetDriveTable) -> Option<DevicenetKind> {
    let only = "expected it only at a drive of kind \"motion\"";
    out_of_place(problems, table.modes.as_ref().map(|value| (value.span(), "modes")), only);
    out_of_place(problems, table.resolution.as_ref().map(|value| (value.span(), "resolution")), only);
    let assembly =
        value::number_or(problems, &table.assembly, "the output assembly", 20..=21, DEFAULT_ASSEMBLY);
    let scale = value::number_or(problems, &table.speed_scale, "SpeedScale", -15..=15, 0_i8);
    Some(DevicenetKind::Speed { assembly: Assembly(assembly?), scale: scale? })
}

/// A key that the other kind of drive has.
fn out_of_place(problems: &mut Problems, key: Option<(core::ops::Range<usize>, &str)>, expected: &str) {
    if let Some((span, key)) = key {
        problems.report::<()>(span, format_args!("`{key}` does not apply to this drive"), expected);
    }
}

/// The drive must not give the box up between two polls.
fn packet_rate(problems: &mut Problems, table: &DevicenetDriveTable, cycle: Option<i64>) -> Option<u16> {
    let given = match &table.packet_rate {
        None => cycle,
        Some(text) => whole_milliseconds(problems, text, "an expected packet rate", PACKET_RATE_MS),
    };
    let (given, cycle) = (given?, cycle?);
    if given * TIMEOUT_MULTIPLIER < cycle * 2 {
        let span = table.packet_rate.as_ref().map_or_else(|| table.name.span(), Spanned::span);
        return problems.report(
            span,
            format_args!("the drive stops by itself after {} ms", given * TIMEOUT_MULTIPLIER),
            format_args!("expected a packet rate of at least half of the cycle of {cycle} ms"),
        );
    }
    u16::try_from(given).ok()
}
