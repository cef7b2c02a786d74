//! The DeviceNet networks of a configuration.

use profile_cip::devicenet::connection::TIMEOUT_MULTIPLIER;
use profile_cip::devicenet::master::config::{DataRate, ExpectedIdentity};
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::time::DurationNs;

use super::can::MODES;
use super::check::Checker;
use super::file::{DevicenetDriveTable, DevicenetTable};
use super::{Devicenet, DevicenetDrive, DevicenetKind, duration};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};

/// DeviceNet networks of one box.
const NETWORKS_MAX: usize = 4;
const RATES: [DataRate; 3] = [DataRate::Rate125, DataRate::Rate250, DataRate::Rate500];
const CYCLE_MS: core::ops::RangeInclusive<i64> = 1..=1_000;
const MAC_IDS: core::ops::RangeInclusive<i64> = 0..=63;
const DEFAULT_MAC_ID: u8 = 0;
const DEFAULT_ALLOWED_LOSSES: u8 = 3;
const PACKET_RATE_MS: core::ops::RangeInclusive<i64> = 1..=10_000;
const DEFAULT_ASSEMBLY: u8 = 21;
const MILLISECOND_NS: i64 = 1_000_000;

/// What a drive can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Motion,
    Speed,
}

const KINDS: [(&str, Kind); 2] = [("motion", Kind::Motion), ("ac-dc", Kind::Speed)];

impl Checker {
    /// All DeviceNet networks.
    pub(super) fn devicenet(&mut self, tables: &[Spanned<DevicenetTable>]) -> Option<Vec<Devicenet>> {
        self.count(tables, "DeviceNet networks", NETWORKS_MAX);
        let networks: Vec<_> = tables.iter().map(|table| self.network(table.get_ref())).collect();
        networks.into_iter().collect()
    }

    fn network(&mut self, table: &DevicenetTable) -> Option<Devicenet> {
        let link = self.can_link(&table.interface, table.set_bit_rate);
        let rate = self.data_rate(table.bit_rate.as_ref());
        let cycle_time = self.whole_milliseconds(&table.cycle_time, "the cycle of a DeviceNet", CYCLE_MS);
        let mac = self.number_or(table.mac_id.as_ref(), "the MAC ID of the box", MAC_IDS, DEFAULT_MAC_ID);
        let allowed_losses = self.number_or(
            table.allowed_losses.as_ref(),
            "the number of allowed losses",
            1..=100,
            DEFAULT_ALLOWED_LOSSES,
        );
        if table.drive.is_empty() {
            return self.report(
                table.interface.span(),
                format_args!("the DeviceNet on `{}` has no drives", table.interface.get_ref()),
                "expected at least one [[south.devicenet.drive]]",
            );
        }
        self.mac_ids(table, mac);
        let drives: Vec<_> =
            table.drive.iter().map(|drive| self.devicenet_drive(drive.get_ref(), cycle_time)).collect();
        Some(Devicenet {
            link: link?,
            rate: rate?,
            cycle_time: DurationNs::from_millis(cycle_time?),
            mac: MacId::new(mac?)?,
            allowed_losses: allowed_losses?,
            drives: drives.into_iter().collect::<Option<_>>()?,
        })
    }

    fn data_rate(&mut self, given: Option<&Spanned<i64>>) -> Option<DataRate> {
        let Some(given) = given else { return Some(DataRate::default()) };
        let known = RATES.into_iter().find(|rate| i64::from(rate.bits_per_second()) == *given.get_ref());
        known.or_else(|| {
            self.report_as(
                code::OUT_OF_RANGE,
                given.span(),
                format_args!("the bit rate is {}", given.get_ref()),
                "expected 125000, 250000 or 500000",
            )
        })
    }

    /// A time as so many milliseconds.
    fn whole_milliseconds(
        &mut self,
        text: &Spanned<String>,
        what: &str,
        range: core::ops::RangeInclusive<i64>,
    ) -> Option<i64> {
        let time = self.time_span(text)?;
        let ms = time.0 / MILLISECOND_NS;
        if time.0 % MILLISECOND_NS == 0 && range.contains(&ms) {
            return Some(ms);
        }
        self.report(
            text.span(),
            format_args!("{} cannot be {what}", duration::show(time)),
            format_args!("expected {} ms to {} ms in whole milliseconds", range.start(), range.end()),
        )
    }

    /// Each MAC ID once, that of the box included.
    fn mac_ids(&mut self, table: &DevicenetTable, own: Option<u8>) {
        for (index, drive) in table.drive.iter().enumerate() {
            let mac = &drive.get_ref().mac_id;
            let earlier = table.drive[..index].iter().map(|drive| &drive.get_ref().mac_id);
            if let Some(first) = earlier.into_iter().find(|earlier| earlier.get_ref() == mac.get_ref()) {
                let problem = Problem::new(code::TWICE, mac.span())
                    .title(format!("MAC ID {} is used twice", mac.get_ref()));
                let problem = problem.expected("expected each MAC ID once on a network");
                self.push(problem.related(first.span(), "used here first"));
            }
            if own.is_some_and(|own| i64::from(own) == *mac.get_ref()) {
                self.report::<()>(
                    mac.span(),
                    format_args!("MAC ID {} is that of the gateway", mac.get_ref()),
                    "expected another one, or another `mac_id` of the network",
                );
            }
        }
    }

    fn devicenet_drive(&mut self, table: &DevicenetDriveTable, cycle: Option<i64>) -> Option<DevicenetDrive> {
        let name = self.name("drive", &table.name);
        let mac: Option<u8> = self.number(&table.mac_id, "the MAC ID", MAC_IDS);
        let kind = match &table.kind {
            None => Some(Kind::Motion),
            Some(word) => self.word(word, "kind of drive", &KINDS),
        };
        let packet_rate = self.packet_rate(table, cycle);
        let vendor = self.optional(table.vendor_id.as_ref(), "the vendor number", 1..=65_535);
        let product = self.optional(table.product_code.as_ref(), "the product code", 0..=65_535);
        let way_of_a_turn = match &table.millimetres_per_turn {
            None => Some(None),
            Some(value) => self.exact(value, "the way of a turn").map(Some),
        };
        let kind = match kind {
            Some(Kind::Motion) => self.motion_drive(table),
            Some(Kind::Speed) => self.speed_drive(table),
            None => None,
        };
        let identity = ExpectedIdentity { vendor: vendor?, product_code: product?, ..Default::default() };
        Some(DevicenetDrive {
            name: name?,
            mac: MacId::new(mac?)?,
            packet_rate_ms: packet_rate?,
            identity,
            way_of_a_turn: way_of_a_turn?,
            kind: kind?,
        })
    }

    fn motion_drive(&mut self, table: &DevicenetDriveTable) -> Option<DevicenetKind> {
        let only = "expected it only at a drive of kind \"ac-dc\"";
        self.out_of_place(table.assembly.as_ref().map(|value| (value.span(), "assembly")), only);
        self.out_of_place(table.speed_scale.as_ref().map(|value| (value.span(), "speed_scale")), only);
        let modes = match &table.modes {
            None => Some(MODES.iter().map(|(_, mode)| *mode).collect()),
            Some(names) => self.words(names, "mode", &MODES),
        };
        if let Some(names) = table.modes.as_ref().filter(|names| names.get_ref().is_empty()) {
            self.report::<()>(names.span(), "an axis without a mode", "expected at least one mode");
        }
        let Some(resolution) = &table.resolution else {
            return self.report(
                table.name.span(),
                format_args!("`resolution` of the drive `{}` is missing", table.name.get_ref()),
                "expected `resolution`, its position counts in a unit: no update of the fixed format tells it",
            );
        };
        let resolution = self.number(resolution, "the resolution", 1..=i64::from(i32::MAX));
        Some(DevicenetKind::Motion { modes: modes?, resolution: resolution? })
    }

    fn speed_drive(&mut self, table: &DevicenetDriveTable) -> Option<DevicenetKind> {
        let only = "expected it only at a drive of kind \"motion\"";
        self.out_of_place(table.modes.as_ref().map(|value| (value.span(), "modes")), only);
        self.out_of_place(table.resolution.as_ref().map(|value| (value.span(), "resolution")), only);
        let assembly =
            self.number_or(table.assembly.as_ref(), "the output assembly", 20..=21, DEFAULT_ASSEMBLY);
        let scale = self.number_or(table.speed_scale.as_ref(), "SpeedScale", -15..=15, 0_i8);
        Some(DevicenetKind::Speed { assembly: Assembly(assembly?), scale: scale? })
    }

    /// A key that the other kind of drive has.
    fn out_of_place(&mut self, key: Option<(core::ops::Range<usize>, &str)>, expected: &str) {
        if let Some((span, key)) = key {
            self.report::<()>(span, format_args!("`{key}` does not apply to this drive"), expected);
        }
    }

    /// The drive must not give the box up between two polls.
    fn packet_rate(&mut self, table: &DevicenetDriveTable, cycle: Option<i64>) -> Option<u16> {
        let given = match &table.packet_rate {
            None => cycle,
            Some(text) => self.whole_milliseconds(text, "an expected packet rate", PACKET_RATE_MS),
        };
        let (given, cycle) = (given?, cycle?);
        if given * TIMEOUT_MULTIPLIER < cycle * 2 {
            let span = table.packet_rate.as_ref().map_or_else(|| table.name.span(), Spanned::span);
            return self.report(
                span,
                format_args!("the drive stops by itself after {} ms", given * TIMEOUT_MULTIPLIER),
                format_args!("expected a packet rate of at least half of the cycle of {cycle} ms"),
            );
        }
        u16::try_from(given).ok()
    }

    fn optional(
        &mut self,
        value: Option<&Spanned<i64>>,
        what: &str,
        range: core::ops::RangeInclusive<i64>,
    ) -> Option<Option<u16>> {
        let Some(value) = value else { return Some(None) };
        self.number(value, what, range).map(Some)
    }
}
