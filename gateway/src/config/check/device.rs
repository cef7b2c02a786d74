//! A `[[device]]`.

use std::ops::RangeInclusive;

use profile_cip::wire::motion::Format;
use profile_generic::time::DurationNs;

use super::{Problems, assembly, hosts, value};
use crate::config::file::{DeviceTable, IdentityTable, UpdatePeriodTable};
use crate::config::{Device, Identity, duration};
use crate::finding::Spanned;
use crate::finding::registry as code;

const UPDATE_PERIOD_NS: RangeInclusive<i64> = 250_000..=100_000_000;
/// Updates of the controller in a cycle of the bus at most. All but the last of a cycle change nothing (CIP Volume 9, table
/// 6-2.25: below a half, command data is to be applied immediately).
const UPDATES_PER_CYCLE_MAX: i64 = 4;
const DEFAULT_UPDATE_PERIOD_MIN: DurationNs = DurationNs::from_millis(1);
const DEFAULT_UPDATE_PERIOD_MAX: DurationNs = DurationNs::from_millis(32);
const DEFAULT_REVISION: (u8, u8) = (1, 1);
const DEFAULT_PRODUCT_NAME: &str = "Axisbridge";

/// Formats of the motion connection.
pub(in crate::config) const FORMATS: [(&str, Format); 2] =
    [("variable", Format::Variable), ("fixed", Format::Fixed)];

pub(super) fn check(problems: &mut Problems, table: &DeviceTable, cycle_time: DurationNs) -> Option<Device> {
    let name = value::name(problems, "device", &table.name);
    let listen = value::own_address(problems, &table.listen);
    let controllers = hosts::check(problems, table.controllers.as_ref(), "controllers", true);
    let tools = match (&table.tools, &table.controllers) {
        (Some(tools), None) => problems.report_as(
            code::CONTRADICTION,
            tools.span(),
            "`tools` without `controllers`: the tools could own the device, and nobody else",
            "expected `controllers` as well",
        ),
        (tools, _) => hosts::check(problems, tools.as_ref(), "tools", true),
    };
    let identity = identity(problems, &table.identity);
    let power_structure_class_id = value::number_or(
        problems,
        &table.power_structure_class_id,
        "the power structure class ID",
        0..=i64::from(u32::MAX),
        0,
    );
    let connection_format = connection_format(problems, table);
    let assembly = assembly::check(problems, table);
    let update_period = update_period(problems, table.update_period.as_ref(), cycle_time);
    let (update_period_min, update_period_max) = update_period?;
    Some(Device {
        name: name?,
        listen: listen?,
        controllers: controllers?,
        tools: tools?,
        identity: identity?,
        power_structure_class_id: power_structure_class_id?,
        connection_format: connection_format?,
        assembly: assembly?,
        update_period_min,
        update_period_max,
    })
}

fn identity(problems: &mut Problems, table: &IdentityTable) -> Option<Identity> {
    let vendor_id = value::number(problems, &table.vendor_id, "the vendor ID", 1..=65_535);
    let product_code = value::number(problems, &table.product_code, "the product code", 1..=65_535);
    let serial_number =
        value::number(problems, &table.serial_number, "the serial number", 1..=i64::from(u32::MAX));
    let revision = match &table.revision {
        None => Some(DEFAULT_REVISION),
        Some(text) => {
            let parts = text.get_ref().split_once('.');
            let numbers =
                parts.and_then(|(major, minor)| Some((major.parse::<u8>().ok()?, minor.parse::<u8>().ok()?)));
            match numbers {
                Some((major @ 1..=127, minor @ 1..)) => Some((major, minor)),
                _ => problems.report(
                    text.span(),
                    format_args!("`{}` is not a revision", text.get_ref()),
                    "expected major and minor, such as \"1.1\" (1 to 127, 1 to 255)",
                ),
            }
        }
    };
    let product_name = match &table.product_name {
        None => Some(DEFAULT_PRODUCT_NAME.to_owned()),
        Some(name) => value::label(problems, "the product", name),
    };
    let vendor_name = match &table.vendor_name {
        None => vendor_id.map(|id: u16| format!("Vendor {id}")),
        Some(name) => value::label(problems, "the vendor", name),
    };
    let catalog = match &table.catalog {
        None => product_name.clone(),
        Some(name) => value::label(problems, "the catalogue entry", name),
    };
    let (revision_major, revision_minor) = revision?;
    Some(Identity {
        vendor_id: vendor_id?,
        vendor_name: vendor_name?,
        catalog: catalog?,
        product_code: product_code?,
        revision_major,
        revision_minor,
        serial_number: serial_number?,
        product_name: product_name?,
    })
}

fn update_period(
    problems: &mut Problems,
    table: Option<&UpdatePeriodTable>,
    cycle_time: DurationNs,
) -> Option<(DurationNs, DurationNs)> {
    let given_min = table.and_then(|table| table.min.as_ref());
    let given_max = table.and_then(|table| table.max.as_ref());
    let min = match given_min {
        Some(text) => one_update_period(problems, text)?,
        None => DEFAULT_UPDATE_PERIOD_MIN.max(cycle_time),
    };
    let max = match given_max {
        Some(text) => one_update_period(problems, text)?,
        None => DEFAULT_UPDATE_PERIOD_MAX.max(cycle_time),
    };
    let least = DurationNs(cycle_time.as_nanos() / UPDATES_PER_CYCLE_MAX);
    if let Some(text) = given_min
        && min < least
    {
        return problems.report_as(
            code::CONTRADICTION,
            text.span(),
            format_args!(
                "the shortest update period {} is shorter than a quarter of the bus cycle",
                duration::show(min)
            ),
            format_args!("expected at least {}", duration::show(least)),
        );
    }
    match given_max.or(given_min) {
        Some(text) if min > max => problems.report_as(
            code::CONTRADICTION,
            text.span(),
            format_args!(
                "the shortest update period {} is longer than the longest {}",
                duration::show(min),
                duration::show(max)
            ),
            "expected min no longer than max",
        ),
        _ => Some((min, max)),
    }
}

fn one_update_period(problems: &mut Problems, text: &Spanned<String>) -> Option<DurationNs> {
    let period = value::time_span(problems, text)?;
    if UPDATE_PERIOD_NS.contains(&period.0) && period.0 % 1_000 == 0 {
        return Some(period);
    }
    problems.report(
        text.span(),
        format_args!("{} cannot be an update period", duration::show(period)),
        "expected 250 us to 100 ms in whole microseconds",
    )
}

/// The fixed format carries one axis, and not more.
fn connection_format(problems: &mut Problems, table: &DeviceTable) -> Option<Format> {
    let Some(format) = &table.connection_format else { return Some(Format::Variable) };
    let axes = table.axes.get_ref().len();
    match value::word(problems, format, "connection format", &FORMATS)? {
        Format::Fixed if axes > 1 => problems.report_as(
            code::CONTRADICTION,
            format.span(),
            format_args!("the fixed connection format for a device with {axes} axes"),
            "expected \"variable\", or a single axis in the device",
        ),
        format => Some(format),
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::super::checked;
    use super::*;

    fn device(keys: &str, identity: &str, cycle: DurationNs) -> Result<Device, Vec<String>> {
        let text = format!(
            "name = \"d\"\nlisten = \"192.0.2.1\"\naxes = [\"x\"]\n{keys}\n[identity]\nvendor_id = 7\nproduct_code = 1\nserial_number = 1\n{identity}"
        );
        checked(&text, |problems, table| check(problems, table, cycle))
    }

    #[test]
    fn an_identity_has_defaults_from_its_numbers() {
        let found = device("", "revision = \"127.255\"", DurationNs::from_millis(2)).unwrap();
        let Identity { vendor_name, catalog, product_name, revision_major, revision_minor, .. } =
            found.identity;
        assert_eq!(
            (vendor_name.as_str(), catalog.as_str(), product_name.as_str()),
            ("Vendor 7", "Axisbridge", "Axisbridge")
        );
        assert_eq!((revision_major, revision_minor), (127, 255));
        assert_eq!(found.update_period_min, DurationNs::from_millis(2), "no shorter than the bus cycle");
        for bad in ["128.1", "1.0", "1", "1.256"] {
            let found = device("", &format!("revision = \"{bad}\""), DurationNs::ZERO);
            assert_eq!(found, Err(vec![format!("`{bad}` is not a revision")]));
        }
    }

    #[test]
    fn tools_are_those_beside_the_controllers() {
        let both = "controllers = [\"192.0.2.7\"]\ntools = []";
        let found = device(both, "", DurationNs::ZERO).unwrap();
        let host = |last: u8| Ipv4Addr::new(192, 0, 2, last);
        assert!(found.controllers.has_v4(host(7)) && !found.controllers.has_v4(host(8)));
        assert!(!found.tools.has_v4(host(8)));
        let open = device("controllers = [\"192.0.2.7\"]", "", DurationNs::ZERO).unwrap();
        assert!(open.tools.has_v4(host(8)), "everybody may read");
        let alone = device("tools = [\"192.0.2.7\"]", "", DurationNs::ZERO);
        let title = "`tools` without `controllers`: the tools could own the device, and nobody else";
        assert_eq!(alone, Err(vec![title.to_owned()]));
    }

    #[test]
    fn update_periods_fit_each_other_and_the_bus() {
        for (period, title) in [
            ("{ min = \"2.5 us\" }", "2500 ns cannot be an update period"),
            (
                "{ min = \"499 us\" }",
                "the shortest update period 499 us is shorter than a quarter of the bus cycle",
            ),
            (
                "{ min = \"4 ms\", max = \"3 ms\" }",
                "the shortest update period 4 ms is longer than the longest 3 ms",
            ),
        ] {
            let found = device(&format!("update_period = {period}"), "", DurationNs::from_millis(2));
            assert_eq!(found, Err(vec![title.to_owned()]));
        }
    }
}
