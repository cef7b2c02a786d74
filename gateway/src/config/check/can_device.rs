//! What a configuration says of CANopen devices as a whole, whatever axes they have.

use profile_cia402::master::config::{Expected, GuardingConfig};
use profile_cia402::wire::NodeId;
use profile_cia402::wire::lss::LssAddress;
use profile_cia402::wire::pdo::TransmissionType;

use super::can::NODES;
use super::{Problems, can, value};
use crate::config::file::{CanDeviceTable, CanTable};
use crate::config::{CanDevice, Lss};
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};

const NUMBERS: core::ops::RangeInclusive<i64> = 0..=0xFFFF_FFFF;
const LIFE_TIME_FACTORS: core::ops::RangeInclusive<i64> = 2..=255;
const DEFAULT_LIFE_TIME_FACTOR: u8 = 3;

/// Whether a node-id is kept.
pub(in crate::config) const LSS: [(&str, bool); 2] = [("assign", false), ("store", true)];

/// What a device has to say of itself.
pub(in crate::config) const DEVICE_TYPES: [(&str, Expected); 2] =
    [("drive", Expected::DRIVE), ("any", Expected { profile: None, ..Expected::DRIVE })];

/// Transmission types that PDOs can be used with.
const RPDO_TYPES: &[core::ops::RangeInclusive<u8>] = &[0..=240, 254..=255];
const TPDO_TYPES: &[core::ops::RangeInclusive<u8>] = &[1..=1, 254..=255];

/// Whether the mapping of PDOs is kept.
pub(in crate::config) const MAPPINGS: [(&str, bool); 2] = [("write", false), ("keep", true)];

/// The devices of a bus that something is said of.
pub(super) fn check(problems: &mut Problems, bus: &CanTable) -> Option<Vec<CanDevice>> {
    for (index, table) in bus.device.iter().enumerate() {
        let node = &table.get_ref().node;
        let same = |earlier: &&Spanned<CanDeviceTable>| earlier.get_ref().node.get_ref() == node.get_ref();
        if let Some(first) = bus.device[..index].iter().find(same) {
            let problem = Problem::new(code::TWICE, node.span())
                .title(format!("the device with node-id {} is defined twice", node.get_ref()))
                .expected("expected all that is said of a device in one [[south.can.device]]");
            problems.push(problem.related(first.get_ref().node.span(), "said here first"));
        }
        // Of two drives with the same node-id one may have been meant to have this one.
        let nodes: Vec<_> = bus.drive.iter().map(|drive| *drive.get_ref().node.get_ref()).collect();
        let twice = bus.drive.iter().enumerate().any(|(at, drive)| {
            drive.get_ref().axis.is_none() && nodes[..at].contains(drive.get_ref().node.get_ref())
        });
        if !twice && !nodes.contains(node.get_ref()) {
            problems.report_as::<()>(
                code::CONFIG_REFERENCE,
                node.span(),
                format_args!("no drive of this bus has node-id {}", node.get_ref()),
                "expected the `node` of a [[south.can.drive]]",
            );
        }
    }
    let devices: Vec<_> = bus.device.iter().map(|device| check_device(problems, device.get_ref())).collect();
    let address = |device: &Option<CanDevice>| Some(device.as_ref()?.lss?.address);
    for (index, device) in devices.iter().enumerate() {
        let own = address(device);
        let first = devices[..index].iter().position(|earlier| own.is_some() && address(earlier) == own);
        let spans = |index: usize| bus.device[index].get_ref().lss.as_ref().map(Spanned::span);
        if let Some((first, second)) = first.and_then(spans).zip(spans(index)) {
            let problem = Problem::new(code::TWICE, second).title("one device is to get two node-ids");
            let problem = problem.expected("expected another `identity`");
            problems.push(problem.related(first, "the same one gets its node-id here"));
        }
    }
    devices.into_iter().collect()
}

fn check_device(problems: &mut Problems, table: &CanDeviceTable) -> Option<CanDevice> {
    let node = value::number(problems, &table.node, "the node-id", NODES);
    let expected = identity(problems, table);
    if let Some(path) = &table.configuration {
        value::path(problems, path, "the configuration of a device");
    }
    if let Some(path) = &table.eds {
        value::path(problems, path, "the data sheet of a device");
    }
    if let (Some(store), None) = (&table.store, &table.configuration) {
        problems.report::<()>(
            store.span(),
            "there is no configuration to be stored",
            "expected `store` only together with `configuration`",
        );
    }
    let keeps_mapping = match &table.pdo_mapping {
        None => Some(false),
        Some(word) => value::word(problems, word, "handling of the PDO mapping", &MAPPINGS),
    };
    let types = transmission_types(problems, table);
    let guarding = guarding(problems, table);
    let lss = lss(problems, table, expected.as_ref());
    Some(CanDevice {
        node: NodeId::new(node?).ok()?,
        expected: expected?,
        lss: lss?,
        eds: table.eds.as_ref().map(|path| path.get_ref().into()),
        // It is read when all of the configuration is good.
        file: None,
        stores: table.store.as_ref().is_some_and(|store| *store.get_ref()),
        keeps_mapping: keeps_mapping?,
        types: types?,
        guarding: guarding?,
    })
}

fn transmission_types(
    problems: &mut Problems,
    table: &CanDeviceTable,
) -> Option<[Option<TransmissionType>; 2]> {
    let both = [
        (&table.rpdo_type, "RPDOs", RPDO_TYPES, "expected 0 to 240, 254 or 255"),
        (&table.tpdo_type, "TPDOs", TPDO_TYPES, "expected 1, 254 or 255: it has to send in every cycle"),
    ];
    let types = both.map(|(value, which, allowed, expected)| {
        let Some(value) = value else { return Some(None) };
        let number = u8::try_from(*value.get_ref()).ok();
        match number.filter(|number| allowed.iter().any(|range| range.contains(number))) {
            Some(number) => Some(Some(TransmissionType(number))),
            None => problems.report_as(
                code::OUT_OF_RANGE,
                value.span(),
                format_args!("{} cannot be the transmission type of {which}", value.get_ref()),
                expected,
            ),
        }
    });
    let [receive, transmit] = types;
    Some([receive?, transmit?])
}

fn identity(problems: &mut Problems, table: &CanDeviceTable) -> Option<Expected> {
    let any = match &table.device_type {
        None => Expected::DRIVE,
        Some(word) => value::word(problems, word, "device type", &DEVICE_TYPES)?,
    };
    let Some(identity) = &table.identity else { return Some(any) };
    let given = identity.get_ref();
    let all = [
        (&given.vendor_id, "the vendor-ID"),
        (&given.product_code, "the product code"),
        (&given.revision_number, "the revision number"),
        (&given.serial_number, "the serial number"),
    ];
    if all.iter().all(|(number, _)| number.is_none()) {
        return problems.report(identity.span(), "an empty identity", "expected `vendor_id` at least");
    }
    let numbers = all.map(|(number, what)| match number {
        None => Some(None),
        Some(number) => value::number(problems, number, what, NUMBERS).map(Some),
    });
    let [vendor, product, revision, serial] = numbers;
    Some(Expected { vendor: vendor?, product: product?, revision: revision?, serial: serial?, ..any })
}

fn lss(problems: &mut Problems, table: &CanDeviceTable, expected: Option<&Expected>) -> Option<Option<Lss>> {
    let Some(word) = &table.lss else { return Some(None) };
    let stores = value::word(problems, word, "use of LSS", &LSS)?;
    let Expected { vendor, product, revision, serial, .. } = *expected?;
    let (Some(vendor), Some(product), Some(revision), Some(serial)) = (vendor, product, revision, serial)
    else {
        return problems.report(
            word.span(),
            "the device that is to get a node-id is not known",
            "expected an `identity` with `vendor_id`, `product_code`, `revision_number` and `serial_number`",
        );
    };
    Some(Some(Lss { address: LssAddress([vendor, product, revision, serial]), stores }))
}

fn guarding(problems: &mut Problems, table: &CanDeviceTable) -> Option<Option<GuardingConfig>> {
    let factor = &table.life_time_factor;
    let Some(text) = &table.guarding else {
        let Some(factor) = factor else { return Some(None) };
        return problems.report(
            factor.span(),
            "there is no guarding for a life time factor",
            "expected `life_time_factor` only together with `guarding`",
        );
    };
    let guard_time_ms = can::watch_time(problems, text, "the time between two requests of guarding");
    let factor = value::number_or(
        problems,
        factor,
        "the life time factor",
        LIFE_TIME_FACTORS,
        DEFAULT_LIFE_TIME_FACTOR,
    );
    Some(Some(GuardingConfig { guard_time_ms: guard_time_ms?, life_time_factor: factor? }))
}
