//! The metrics for Prometheus: made from one look at the gateway at each scrape, so that nothing is counted twice.

use std::fmt;
use std::time::SystemTime;

use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::cast::{f64_from_i64, f64_from_u128};
use profile_generic::state::DriveState;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry, Unit};

use super::server::Counts;
use super::view::Look;
use crate::config::AxisKind;
use crate::engine::phase_lock::LockState;
use crate::local::overview::{Axis, Overview};
use crate::local::protocol::unit;
use crate::status::BoxState;

/// Nanoseconds in a second.
const NANO: f64 = 1e9;

/// Microseconds in a second.
const MICRO: f64 = 1e6;

/// Millimetres in a metre.
const MILLI: f64 = 1e3;

/// Percent in the whole.
const PERCENT: f64 = 100.0;

/// The metrics in the text format of OpenMetrics.
#[must_use]
pub fn metrics(look: &Look, started: SystemTime, load: &Counts) -> String {
    let mut registry = Registry::default();
    let started = started.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    registry.register_collector(Box::new(Scrape { look: look.clone(), started, load: *load }));
    let mut text = String::new();
    // A string takes everything.
    let _ = encode(&mut text, &registry);
    text
}

/// One scrape.
#[derive(Debug)]
struct Scrape {
    look: Look,
    /// Seconds of Unix time.
    started: f64,
    load: Counts,
}

impl Collector for Scrape {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut families = Families(encoder);
        let status = &self.look.status;
        self.process(&mut families)?;
        cycles(&mut families, status)?;
        buses(&mut families, status)?;
        devices(&mut families, status)?;
        time(&mut families, status)?;
        states(&mut families, &status.axes)?;
        motion(&mut families, &status.axes)?;
        axis_counters(&mut families, &status.axes)
    }
}

/// The labels of a metric: names and values.
type Labels<'a> = &'a [(&'a str, &'a str)];

/// Writes families of metrics.
struct Families<'a>(DescriptorEncoder<'a>);

impl Families<'_> {
    /// A gauge without labels.
    fn gauge(&mut self, name: &str, unit: Option<Unit>, help: &str, value: f64) -> fmt::Result {
        let encoder = self.0.encode_descriptor(name, help, unit.as_ref(), MetricType::Gauge)?;
        ConstGauge::new(value).encode(encoder)
    }

    /// A counter without labels.
    fn counter(&mut self, name: &str, help: &str, value: u64) -> fmt::Result {
        let mut encoder = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        encoder.encode_counter::<NoLabelSet, _, u64>(&value, None)
    }

    /// A gauge of each part of the gateway. A family without any part is left out.
    fn gauges<'a, L: AsRef<[(&'a str, &'a str)]>>(
        &mut self,
        name: &str,
        unit: Option<Unit>,
        help: &str,
        values: impl IntoIterator<Item = (L, f64)>,
    ) -> fmt::Result {
        let mut values = values.into_iter().peekable();
        if values.peek().is_none() {
            return Ok(());
        }
        let mut encoder = self.0.encode_descriptor(name, help, unit.as_ref(), MetricType::Gauge)?;
        for (labels, value) in values {
            let labels: Labels<'_> = labels.as_ref();
            ConstGauge::new(value).encode(encoder.encode_family(&labels)?)?;
        }
        Ok(())
    }

    /// A counter of each part of the gateway.
    fn counters<'a>(
        &mut self,
        name: &str,
        help: &str,
        label: &'a str,
        values: impl IntoIterator<Item = (&'a str, u64)>,
    ) -> fmt::Result {
        let mut values = values.into_iter().peekable();
        if values.peek().is_none() {
            return Ok(());
        }
        let mut encoder = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        for (part, value) in values {
            ConstCounter::new(value).encode(encoder.encode_family(&[(label, part)])?)?;
        }
        Ok(())
    }

    /// A counter of seconds of each part of the gateway.
    fn seconds<'a>(
        &mut self,
        name: &str,
        help: &str,
        label: &'a str,
        values: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> fmt::Result {
        let mut values = values.into_iter().peekable();
        if values.peek().is_none() {
            return Ok(());
        }
        let unit = Some(Unit::Seconds);
        let mut encoder = self.0.encode_descriptor(name, help, unit.as_ref(), MetricType::Counter)?;
        for (part, value) in values {
            ConstCounter::new(value).encode(encoder.encode_family(&[(label, part)])?)?;
        }
        Ok(())
    }

    /// One state of several: 1 for the present one, 0 for each other.
    fn states<'a>(
        &mut self,
        name: &str,
        help: &str,
        label: Option<&'a str>,
        states: &[&'a str],
        parts: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> fmt::Result {
        let rows = parts.into_iter().flat_map(|(part, present)| {
            states.iter().map(move |state| {
                let own = ("state", *state);
                let labels = label.map_or(vec![own], |label| vec![(label, part), own]);
                (labels, flag(*state == present))
            })
        });
        self.gauges(name, None, help, rows)
    }
}

const fn flag(is: bool) -> f64 {
    if is { 1.0 } else { 0.0 }
}

fn seconds(nanos: i64) -> f64 {
    f64_from_i64(nanos) / NANO
}

fn seconds_of_unsigned(nanos: u64) -> f64 {
    f64_from_u128(u128::from(nanos)) / NANO
}

impl Scrape {
    fn process(&self, families: &mut Families<'_>) -> fmt::Result {
        let Look { health, status, .. } = &self.look;
        let labels = [("name", status.name.as_str()), ("version", status.version.as_str())];
        families.gauges("axisbridge_build_info", None, "Name and version of the gateway", [(labels, 1.0)])?;
        let start = Some(Unit::Seconds);
        families.gauge("process_start_time", start, "Start of the gateway, in Unix time", self.started)?;
        let uptime = Some(Unit::Seconds);
        families.gauge("axisbridge_uptime", uptime, "Time since the first cycle", status.uptime_s)?;
        let help = "1 while the cycle thread publishes its state in time";
        families.gauge("axisbridge_alive", None, help, flag(health.alive))?;
        let help = "1 while every bus is in cyclic operation, and every axis commissioned and without fault";
        families.gauge("axisbridge_ready", None, help, flag(health.ready))?;
        let states: Vec<_> = BoxState::NAMED.iter().map(|(_, name)| *name).collect();
        let help = "State of the gateway: 1 for the present one";
        families.states("axisbridge_state", help, None, &states, [("", status.state.as_str())])?;
        let help = "HTTP connections that were accepted";
        families.counter("axisbridge_http_connections", help, self.load.accepted)?;
        let help = "HTTP connections that were closed because too many were open or the host is not served";
        families.counter("axisbridge_http_refused_connections", help, self.load.refused)
    }
}

fn cycles(families: &mut Families<'_>, status: &Overview) -> fmt::Result {
    let cycles = &status.cycles;
    let unit = || Some(Unit::Seconds);
    families.gauge(
        "axisbridge_cycle",
        unit(),
        "Shortest cycle of all buses",
        f64::from(cycles.cycle_ns) / NANO,
    )?;
    families.counter(
        "axisbridge_late_cycles",
        "Calls of the engine late by more than half a cycle",
        cycles.late,
    )?;
    let help = "Largest lateness of a call of the engine since the start";
    families.gauge("axisbridge_lateness_max", unit(), help, f64::from(cycles.latest_ns) / NANO)?;
    let lateness = &cycles.lateness;
    let (help, in_seconds) = ("How late the calls of the engine were", unit());
    let name = "axisbridge_lateness";
    let encoder = families.0.encode_descriptor(name, help, in_seconds.as_ref(), MetricType::Histogram);
    let bounds = lateness.bounds_ns.iter().map(|bound| f64::from(*bound) / NANO);
    // The encoder sums them up.
    let classes: Vec<_> = bounds.chain([f64::INFINITY]).zip(lateness.counts.iter().copied()).collect();
    let sum = seconds_of_unsigned(lateness.sum_ns);
    encoder?.encode_histogram::<NoLabelSet>(sum, lateness.counts.iter().sum(), &classes, None)?;
    let help = "How the buses follow system time, the least of all: 1 for the present state";
    let states = LockState::ALL.map(LockState::name);
    families.states("axisbridge_phase_lock", help, None, &states, [("", cycles.phase_lock.as_str())])?;
    let help = "Latest cycle after its instant of system time, the largest of all buses";
    families.gauge("axisbridge_phase_error", unit(), help, seconds(cycles.phase_error_ns))?;
    let help = "Updates of controllers that were lost or late";
    families.counter("axisbridge_lost_updates", help, cycles.lost_updates)?;
    let help = "Frames and datagrams that were malformed or from a stranger";
    families.counter("axisbridge_refused_frames", help, cycles.refused_frames)?;
    let help = "Frames and datagrams that could not be sent";
    families.counter("axisbridge_send_failures", help, cycles.send_failures)
}

fn buses(families: &mut Families<'_>, status: &Overview) -> fmt::Result {
    let buses = || status.buses.iter();
    let of_bus = |value: fn(&crate::local::overview::Bus) -> f64| {
        buses().map(move |bus| ([("bus", bus.name.as_str())], value(bus)))
    };
    let help = "1 while every drive that answers is in cyclic operation";
    families.gauges("axisbridge_bus_up", None, help, of_bus(|bus| flag(bus.up)))?;
    let cycle = of_bus(|bus| f64::from(bus.cycle_ns) / NANO);
    families.gauges("axisbridge_bus_cycle", Some(Unit::Seconds), "Cycle of the bus", cycle)?;
    let phases = buses().filter_map(|bus| Some(([("bus", bus.name.as_str())], f64::from(bus.phase?))));
    families.gauges("axisbridge_bus_phase", None, "SERCOS communication phase, 0 to 4", phases)?;
    let count = |value: fn(&crate::local::overview::Bus) -> u64| {
        buses().map(move |bus| (bus.name.as_str(), value(bus)))
    };
    families.counters("axisbridge_bus_cycles", "Cycles of the bus", "bus", count(|bus| bus.cycles))?;
    let help = "Telegrams of drives that were not received in time";
    families.counters("axisbridge_bus_lost_telegrams", help, "bus", count(|bus| bus.lost_telegrams))?;
    let help = "Frames of the bus that were received and refused";
    families.counters("axisbridge_bus_refused_frames", help, "bus", count(|bus| bus.refused_frames))?;
    let errors = buses()
        .filter(|bus| bus.phase_lock != LockState::Free.name())
        .map(|bus| ([("bus", bus.name.as_str())], seconds(bus.phase_error_ns)));
    let help = "Latest cycle of the bus after its instant of system time";
    families.gauges("axisbridge_bus_phase_error", Some(Unit::Seconds), help, errors)?;
    let busy = buses().filter_map(|bus| Some((bus.name.as_str(), seconds_of_unsigned(bus.busy_ns?))));
    families.seconds(
        "axisbridge_bus_busy",
        "Time for which frames have occupied a bus on CAN, at most",
        "bus",
        busy,
    )
}

fn devices(families: &mut Families<'_>, status: &Overview) -> fmt::Result {
    let help = "Open CIP Motion connections, and owners of assemblies";
    families.gauge("axisbridge_controller_connections", None, help, f64::from(status.connections))?;
    let devices = || status.devices.iter();
    let connected =
        devices().map(|device| ([("device", device.name.as_str())], flag(device.controller.is_some())));
    let help = "1 while a controller is connected to the device";
    families.gauges("axisbridge_device_connected", None, help, connected)?;
    let periods = devices().filter_map(|device| {
        Some(([("device", device.name.as_str())], f64::from(device.update_period_us?) / MICRO))
    });
    let help = "Controller Update Period of the connection";
    families.gauges("axisbridge_device_update_period", Some(Unit::Seconds), help, periods)?;
    let lost = devices().map(|device| (device.name.as_str(), u64::from(device.lost_updates)));
    let help = "Updates of the controller of the device that were lost or late";
    families.counters("axisbridge_device_lost_updates", help, "device", lost)
}

fn time(families: &mut Families<'_>, status: &Overview) -> fmt::Result {
    let time = &status.time;
    let unit = || Some(Unit::Seconds);
    let info = [([("source", time.source.as_str())], 1.0)];
    families.gauges("axisbridge_time_info", None, "Source of system time", info)?;
    let help = "1 while controllers are informed that system time is synchronized";
    families.gauge("axisbridge_time_synchronized", None, help, flag(time.synchronized))?;
    if let Some(offset) = time.offset_ns {
        let help = "Offset from the master that the last Sync has shown";
        families.gauge("axisbridge_time_offset", unit(), help, seconds(offset))?;
    }
    if let Some(delay) = time.path_delay_ns {
        let help = "Mean delay of the path to the master";
        families.gauge("axisbridge_time_path_delay", unit(), help, seconds(delay))?;
    }
    if let Some(bound) = time.error_bound_ns {
        let help = "Bound of the error of system time";
        families.gauge("axisbridge_time_error_bound", unit(), help, seconds_of_unsigned(bound))?;
    }
    let help = "Largest offset of a synchronized clock";
    families.gauge("axisbridge_time_threshold", unit(), help, seconds_of_unsigned(time.threshold_ns))?;
    families.counter("axisbridge_time_steps", "Steps of the master's clock", u64::from(time.steps))
}

fn states(families: &mut Families<'_>, axes: &[Axis]) -> fmt::Result {
    let info = axes.iter().map(|axis| {
        let device = axis.device.as_deref().unwrap_or_default();
        let labels =
            [("axis", axis.name.as_str()), ("bus", &axis.bus), ("device", device), ("drive", &axis.drive)];
        (labels, 1.0)
    });
    families.gauges("axisbridge_axis_info", None, "Bus, device and drive of the axis", info)?;
    let states: Vec<_> = DriveState::ALL.iter().map(|state| state.name()).collect();
    let present = axes.iter().map(|axis| (axis.name.as_str(), axis.state.as_str()));
    let help = "State of the axis in the generic drive model: 1 for the present one";
    families.states("axisbridge_axis_state", help, Some("axis"), &states, present)?;
    let states: Vec<_> = AxisStateCode::NAMED.iter().map(|(_, name)| *name).collect();
    let present = axes.iter().filter_map(|axis| Some((axis.name.as_str(), axis.cip_state.as_deref()?)));
    let help = "Axis State that the controller sees: 1 for the present one";
    families.states("axisbridge_axis_cip_state", help, Some("axis"), &states, present)?;
    let reported = axes.iter().flat_map(|axis| {
        axis.drive_status.iter().map(|bit| ([("axis", axis.name.as_str()), ("status", bit.as_str())], 1.0))
    });
    let help = "A status bit that the drive reports as set";
    families.gauges("axisbridge_axis_drive_status", None, help, reported)?;
    let faulted = axes.iter().map(|axis| ([("axis", axis.name.as_str())], flag(axis.fault.is_some())));
    families.gauges("axisbridge_axis_faulted", None, "1 while the axis has a fault", faulted)?;
    let faults = axes
        .iter()
        .filter_map(|axis| Some(([("axis", axis.name.as_str()), ("fault", axis.fault.as_deref()?)], 1.0)));
    families.gauges("axisbridge_axis_fault", None, "The fault that the axis has", faults)?;
    let inhibits = axes.iter().flat_map(|axis| {
        axis.inhibits.iter().map(|name| ([("axis", axis.name.as_str()), ("inhibit", name.as_str())], 1.0))
    });
    families.gauges("axisbridge_axis_inhibit", None, "A reason why the axis cannot be enabled", inhibits)
}

fn motion(families: &mut Families<'_>, axes: &[Axis]) -> fmt::Result {
    type Value = fn(&Axis) -> f64;
    let quantities: [(&str, &str, &str, Value); 3] = [
        ("axisbridge_axis_position", "", "Actual position", |axis| axis.position),
        ("axisbridge_axis_velocity", "_per_second", "Actual velocity", |axis| axis.velocity),
        ("axisbridge_axis_following_error", "", "Commanded less actual position", |axis| {
            axis.following_error
        }),
    ];
    for (name, per, help, value) in quantities {
        // Prometheus has metres, and one unit for each metric.
        for (kind, word, scale) in
            [(AxisKind::Rotary, "revolutions", 1.0), (AxisKind::Linear, "meters", MILLI)]
        {
            let alike = axes.iter().filter(|axis| axis.unit == unit(kind));
            let values = alike.map(|axis| ([("axis", axis.name.as_str())], value(axis) / scale));
            families.gauges(name, Some(Unit::Other(format!("{word}{per}"))), help, values)?;
        }
    }
    let torque = axes.iter().map(|axis| ([("axis", axis.name.as_str())], axis.torque / PERCENT));
    let help = "Actual torque or force, 1 for the rated one";
    families.gauges("axisbridge_axis_torque", Some(Unit::Other("ratio".to_owned())), help, torque)
}

fn axis_counters(families: &mut Families<'_>, axes: &[Axis]) -> fmt::Result {
    let faults = axes.iter().map(|axis| (axis.name.as_str(), u64::from(axis.faults)));
    families.counters("axisbridge_axis_faults", "Faults that have occurred", "axis", faults)?;
    let lost = axes.iter().map(|axis| (axis.name.as_str(), u64::from(axis.lost_telegrams)));
    let help = "Bus cycles without fresh data from the drive";
    families.counters("axisbridge_axis_lost_telegrams", help, "axis", lost)
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::view;
    use super::*;

    #[test]
    fn every_value_is_in_the_metrics() {
        let (view, _publisher) = view();
        let load = Counts { accepted: 31, refused: 32 };
        let text = metrics(&view.look(), view.started(), &load);
        // The version changes with each release.
        let text = text.replace(env!("CARGO_PKG_VERSION"), "VERSION");
        insta::assert_snapshot!(text);
    }

    /// The names of metrics in a query.
    fn names(query: &str) -> impl Iterator<Item = &str> {
        let words = query.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        words.filter(|word| word.starts_with("axisbridge_"))
    }

    /// The labels in a legend such as `{{axis}}: {{state}}`.
    fn labels(legend: &str) -> impl Iterator<Item = &str> {
        legend.split("{{").skip(1).filter_map(|rest| rest.split("}}").next())
    }

    #[test]
    fn dashboard_asks_for_metrics_and_labels_that_exist() {
        let (view, _publisher) = view();
        let text = metrics(&view.look(), view.started(), &Counts::default());
        let dashboard = include_str!("../../../examples/grafana/axisbridge.json");
        let dashboard: serde_json::Value = serde_json::from_str(dashboard).unwrap();
        let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
        let mut count = 0;
        for panel in list(&dashboard["panels"]) {
            for target in list(&panel["targets"]) {
                let query = target["expr"].as_str().unwrap();
                let legend = target["legendFormat"].as_str().unwrap();
                let name = names(query).next().unwrap_or_else(|| panic!("{query} asks for no metric"));
                let series = text.lines().find(|line| line.split(['{', ' ']).next() == Some(name));
                let series = series.unwrap_or_else(|| panic!("{query}: there is no {name}"));
                for label in labels(legend) {
                    assert!(series.contains(&format!("{label}=\"")), "{name} has no label {label}: {series}");
                }
                count += 1;
            }
        }
        for variable in list(&dashboard["templating"]["list"]) {
            for name in names(variable["query"]["query"].as_str().unwrap_or_default()) {
                assert!(text.contains(&format!("\n{name}{{")), "{name}");
            }
        }
        assert!(count > 20, "{count} queries");
    }
}
