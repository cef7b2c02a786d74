//! What `axisbridge attributes` says of each attribute, against what happens on three kinds of bus when it is read and set: the drives are
//! looked at from outside, without the gateway.
//!
//! docs/reference/attributes.md is written by this test: with `AXISBRIDGE_ACCEPT` set it is written anew, otherwise compared.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use axisbridge::config::Config;
use axisbridge::mapping::{Access, AttributeTruth, CipAttribute, CipType, Mapping, Truth};
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use axisbridge::translate::Stage;
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::Step;
use profile_cip::device::axis_state::AxisState;
use profile_sercos::wire::idn::Idn;

const ACCEPT: &str = "AXISBRIDGE_ACCEPT";

pub(super) const GET: u8 = 0x0E;
pub(super) const SET: u8 = 0x10;
pub(super) const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const NOT_SETTABLE: u8 = 0x0E;
const DEVICE_CONFLICT: u8 = 0x10;
const NOT_SUPPORTED: u8 = 0x14;

const BUSES: [&str; 3] = ["SERCOS", "CiA 402", "DeviceNet"];

/// Compared with the torque limits: refused if the drive would use more.
const STOPPING_TORQUE: u16 = 611;

/// Data of motor and power stage that the configuration has.
const NAMEPLATE: &str = "motor = { type = \"rotary-permanent-magnet\", rated_torque = 2.4, rated_current = 3.5, peak_current = 10.0, \
                         rated_speed = 3000.0, max_speed = 6000.0, rated_voltage = 230.0, rated_power = 0.75, poles = 8, \
                         inertia = 0.00012, resistance = 1.25, inductance = 0.008, max_winding_temperature = 130.0, \
                         overload_limit = 110.0, torque_constant = 0.69, voltage_constant = 41.5, q_inductance = 0.009, \
                         d_inductance = 0.007, thermal_time_constant = 600.0 }\n\
                         converter = { bus_voltage = 325.0, rated_current = 7.5, rated_voltage = 230.0, rated_power = 1.5, \
                         thermal_time_constant = 60.0, bus = \"standalone\", mains = \"high\", checks_enable_input = true }\n\
                         encoder = { type = \"hiperface\", startup = \"absolute\", turns = 4096 }\n";

/// Gains that no IDN or object of the drive shows, in the order of the buses.
const LOOPS: [&str; 3] = [
    "loops = { velocity_gain = 400.0 }\n",
    "loops = { position_gain = 50.0, velocity_gain = 400.0, velocity_integral_gain = 100.0, \
     velocity_feed_forward = 100.0 }\n",
    "",
];

/// Cycle Resolution and Cycle Interpolation of both encoders.
const COUNTS_OF_ENCODERS: [u16; 4] = [1416, 1417, 1466, 1467];

/// An attribute of a drive on DeviceNet, as the table of truths names it.
fn attribute_place(id: u16) -> String {
    format!("class 0x42 attribute {id}")
}

/// What the drive of the first axis holds: bytes by the name of their place.
pub(super) type Held = BTreeMap<String, Vec<u8>>;

pub(super) fn held(rig: &Rig) -> Held {
    if let Some(wire) = rig.can.first() {
        let node = wire.bus.nodes().next().expect("a drive");
        let entries = node.dictionary().entries().iter();
        return entries
            .map(|entry| {
                let mux = entry.mux();
                (format!("{:04X}:{:02X}", mux.index, mux.sub), entry.number().to_le_bytes().to_vec())
            })
            .collect();
    }
    if let Some(wire) = rig.devicenet.first() {
        let Some(DevicenetNode::Motion(slave)) = wire.bus.nodes().next() else {
            panic!("a CIP Motion drive")
        };
        let device = slave.application().device();
        let kept = |id| Some((attribute_place(id), device.attribute(0, id).ok()?.to_vec()));
        return (0..u16::MAX).filter_map(kept).collect();
    }
    let store = rig.line.slaves()[0].store();
    store.iter().map(|parameter| (parameter.idn().to_string(), parameter.data().to_vec())).collect()
}

/// Changes what the drive holds from inside, past the gateway.
fn put(rig: &mut Rig, place: &str, bytes: &[u8]) {
    if let Some(wire) = rig.can.first_mut() {
        let node = wire.bus.nodes_mut().next().expect("a drive");
        let (index, sub) = place.split_once(':').expect("an object");
        let (index, sub) = (u16::from_str_radix(index, 16), u8::from_str_radix(sub, 16));
        let number = i64::from_le_bytes(bytes.try_into().expect("a number"));
        return node.dictionary_mut().set(index.expect("an index"), sub.expect("a sub-index"), number);
    }
    if let Some(wire) = rig.devicenet.first_mut() {
        let Some(DevicenetNode::Motion(slave)) = wire.bus.nodes_mut().next() else { panic!("a drive") };
        let id = place.rsplit(' ').next().and_then(|id| id.parse().ok()).expect("an attribute");
        return slave.application_mut().device_mut().put_attribute(0, id, bytes).expect("it fits");
    }
    let idn: Idn = place.parse().expect("an IDN");
    rig.line.slaves_mut()[0].store_mut().set_data_of(idn, bytes);
}

/// Places whose content is another one now.
pub(super) fn changed(before: &Held, after: &Held) -> BTreeSet<String> {
    after
        .iter()
        .filter(|(place, bytes)| before.get(*place) != Some(bytes))
        .map(|(place, _)| place.clone())
        .collect()
}

/// Another value of an attribute, near the one that it has; `None` for what is no number.
pub(super) fn another(row: &CipAttribute, value: &[u8]) -> Option<Vec<u8>> {
    if row.length.is_some() || row.data_type == CipType::ShortString {
        return None;
    }
    let mut other = value.to_vec();
    match (row.data_type, value) {
        (CipType::Real, &[a, b, c, d]) => {
            let before = f32::from_le_bytes([a, b, c, d]);
            let near = match before {
                0.0 if row.max == Some(0) => -1_000.0,
                0.0 => 1_000.0,
                _ => before * 0.9,
            };
            other.copy_from_slice(&near.to_le_bytes());
        }
        _ => *other.first_mut()? ^= 1,
    }
    Some(other)
}

/// Whether a value is the new one and not the old one: drives round reals to steps of their own.
fn is_near(row: &CipAttribute, now: &[u8], before: &[u8], wanted: &[u8]) -> bool {
    let real = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("a REAL"));
    if row.data_type != CipType::Real {
        return now == wanted;
    }
    (real(now) - real(wanted)).abs() * 4.0 < (real(before) - real(wanted)).abs()
}

/// A box whose axes stand, with a client of its first device.
pub(super) struct Bench {
    name: &'static str,
    pub(super) rig: Rig,
    client: Client,
    /// Places of the drive that change by themselves.
    alive: BTreeSet<String>,
}

impl Bench {
    pub(super) fn start(name: &'static str, settings: Settings) -> Self {
        let mut rig = Rig::ready(settings);
        rig.connect(vec![Step::Dwell { seconds: 100_000.0 }]);
        rig.run_until(millis(20_000), "Stopped", |rig| {
            rig.engine.devices()[0].axis_states().next().is_some_and(|(_, state)| state == AxisState::Stopped)
        });
        let client = Client::connect(&mut rig, CONTROLLER);
        // Encoders that nobody has described count nothing. An axis without the second one refuses.
        for id in COUNTS_OF_ENCODERS {
            client.ask(&mut rig, SET, 1, Some(id), &1_000_u32.to_le_bytes());
        }
        let mut alive = BTreeSet::new();
        let mut before = held(&rig);
        for _ in 0..200 {
            rig.run_for(millis(5));
            let after = held(&rig);
            alive.extend(changed(&before, &after));
            before = after;
        }
        Self { name, rig, client, alive }
    }

    pub(super) fn ask(&mut self, service: u8, id: u16, value: &[u8]) -> (u8, Vec<u8>) {
        self.client.ask(&mut self.rig, service, 1, Some(id), value)
    }

    /// The same, and the places of the drive that it has changed.
    pub(super) fn set(&mut self, id: u16, value: &[u8]) -> (u8, BTreeSet<String>) {
        let before = held(&self.rig);
        let (status, _) = self.ask(SET, id, value);
        let mut places = changed(&before, &held(&self.rig));
        places.retain(|place| !self.alive.contains(place));
        (status, places)
    }

    /// Whether an answer follows what the drive holds at a place.
    fn follows(&mut self, id: u16, place: &str) -> bool {
        let Some(bytes) = held(&self.rig).get(place).cloned() else { return false };
        let (_, before) = self.ask(GET, id, &[]);
        // A REAL does not show each bit of a long number.
        (0..bytes.len().min(3)).any(|octet| {
            let mut other = bytes.clone();
            other[octet] ^= 0x44;
            put(&mut self.rig, place, &other);
            let (_, now) = self.ask(GET, id, &[]);
            put(&mut self.rig, place, &bytes);
            let (_, again) = self.ask(GET, id, &[]);
            now != before && again == before
        })
    }

    /// Reads and sets one attribute. Returns what was seen, for the page.
    fn try_one(&mut self, known: &CipAttribute, row: &AttributeTruth<'_>) -> String {
        let what = format!("{}: {} {} is {} by {}", self.name, row.id, row.name, row.truth, row.by);
        let (status, value) = self.ask(GET, row.id, &[]);
        if row.truth == Truth::Absent {
            assert_eq!(status, NOT_SUPPORTED, "{what}");
            let octets = known.data_type.width().map_or(1, |width| width.bytes());
            let zero = vec![0; octets * usize::from(known.length.unwrap_or(1))];
            let (set, places) = self.set(row.id, &zero);
            let refused = set == NOT_SUPPORTED || row.access == Access::Get && set == NOT_SETTABLE;
            assert!(refused && places.is_empty(), "{what}: 0x{set:02X} {places:?}");
            return "-".to_owned();
        }
        // A signal may have no value now.
        assert!(status == OK || status == DEVICE_CONFLICT, "{what}: 0x{status:02X}");
        let truth = row.truth;
        let place = row.by.strip_suffix(" of the drive").unwrap_or(&row.by);
        let of_drive = held(&self.rig).contains_key(place);
        let reads = if self.follows(row.id, place) { "r" } else { "" };
        let shown = if of_drive { format!("{truth} {place} {reads}") } else { truth.to_string() };
        if row.access != Access::Set {
            let (set, places) = self.set(row.id, &value);
            let expected = if row.access == Access::Get { NOT_SETTABLE } else { OK };
            assert_eq!((set, places), (expected, BTreeSet::new()), "{what}");
            return shown.trim_end().to_owned();
        }
        let (same, _) = self.set(row.id, &value);
        // A Stopping Torque that was never set is 0, and no drive stops without torque.
        assert_eq!(same, if row.id == STOPPING_TORQUE { INVALID_VALUE } else { OK }, "{what}: as it is");
        // A Stopping Torque of 10 % is below the torque limits of any drive.
        let other = if row.id == STOPPING_TORQUE {
            Some(10_f32.to_le_bytes().to_vec())
        } else {
            another(known, &value)
        };
        let Some(other) = other else { return shown.trim_end().to_owned() };
        let (set, places) = self.set(row.id, &other);
        let (_, after) = self.ask(GET, row.id, &[]);
        let mut seen = shown;
        match (truth, set) {
            (Truth::Compared, _) => {
                assert_eq!((set, places, &after), (INVALID_VALUE, BTreeSet::new(), &value), "{what}");
            }
            (Truth::Live, OK) => {
                assert!(
                    is_near(known, &after, &value, &other),
                    "{what}: {value:02X?} {other:02X?} {after:02X?}"
                );
                assert_eq!(places.contains(place), of_drive, "{what}: {places:?}");
                if of_drive {
                    seen.push('w');
                }
                assert_eq!(self.set(row.id, &value).0, OK, "{what}");
            }
            (Truth::Live, _) => {
                assert_eq!((places, &after), (BTreeSet::new(), &value), "{what}");
                write!(seen, " 0x{set:02X}").expect("a string");
            }
            (Truth::Stored, _) => {
                assert_eq!((set, places, after), (OK, BTreeSet::new(), other), "{what}");
                assert_eq!(self.set(row.id, &value).0, OK, "{what}");
            }
            (Truth::Computed, OK) => {
                assert!(
                    is_near(known, &after, &value, &other),
                    "{what}: {value:02X?} {other:02X?} {after:02X?}"
                );
                assert!(!places.is_empty(), "{what}: nothing has changed in the drive");
                seen.push('w');
                assert_eq!(self.set(row.id, &value).0, OK, "{what}");
            }
            (Truth::Computed | Truth::Absent, _) => panic!("{what}: 0x{set:02X}"),
        }
        seen.trim_end().to_owned()
    }
}

/// A gateway with these settings and its commissioned drives.
pub(super) fn rehearse(mapping: &Mapping, settings: &Settings) -> Stage {
    let config = Config::parse(&settings.configuration, "rig.toml").expect("sound");
    Stage::rehearse(&config, mapping.clone()).expect("it can be commissioned")
}

/// What is said of the attributes of the first axis.
pub(super) fn truths(stage: &Stage) -> Vec<AttributeTruth<'_>> {
    let mut axes = stage.axes.iter();
    let axis = axes.find(|axis| axis.device == 0 && axis.instance == 1).expect("the first axis");
    stage.mapping.truths(&axis.attributes, &axis.south)
}

/// Gateways whose first axis has all that a configuration can say, in the order of the buses.
fn full_drives() -> [Settings; 3] {
    let with = |text: &str, bus: usize| {
        let loops = LOOPS[bus];
        text.replacen("instance = 1\n", &format!("instance = 1\n{NAMEPLATE}{loops}"), 1)
    };
    [
        Settings { configuration: with(BOX, 0), ..Settings::default() },
        Settings::without_line(with(include_str!("can.toml"), 1)),
        Settings::without_line(with(include_str!("devicenet.toml"), 2)),
    ]
}

#[test]
fn attributes_are_what_the_table_of_truths_says() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let mut cells: BTreeMap<u16, Vec<String>> = BTreeMap::new();
    let mut counts = Vec::new();
    for (bus, settings) in BUSES.into_iter().zip(full_drives()) {
        let stage = rehearse(&mapping, &settings);
        let truths = truths(&stage);
        let mut bench = Bench::start(bus, settings);
        for row in &truths {
            let known = mapping.dictionaries.cip.attribute_by_id(row.id).expect("of the dictionary");
            cells.entry(row.id).or_default().push(bench.try_one(known, row));
        }
        counts.push(Truth::ALL.map(|truth| truths.iter().filter(|row| row.truth == truth).count()));
    }
    let page = page(&mapping, &cells, &counts);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/attributes.md");
    if std::env::var_os(ACCEPT).is_some() {
        std::fs::write(&path, &page).expect("the page can be written");
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = page.lines().zip(written.lines()).find(|(now, written)| now != written);
    assert!(
        page == written,
        "{} is not what was measured (write it with {ACCEPT}=1): {differs:?}",
        path.display()
    );
}

/// The ids of the first cell of a row of the table of docs/mapping.md, `605, 640 to 642 of CiA 402`, and what is said of them.
fn ids_of(cell: &str) -> (BTreeSet<u16>, &str) {
    let ends = [" of ", " without "].into_iter().filter_map(|word| cell.find(word));
    let end = ends.min().unwrap_or(cell.len());
    let (ids, condition) = cell.split_at(end);
    let number = |text: &str| text.trim().parse::<u16>().unwrap_or_else(|_| panic!("`{text}` of `{cell}`"));
    let ids = ids.split(',').flat_map(|part| match part.split_once(" to ") {
        Some((first, last)) => number(first)..=number(last),
        None => number(part)..=number(part),
    });
    (ids.collect(), condition.trim())
}

/// What the configurations of the page, of full drives, do not give an axis has a reason in docs/mapping.md: all that position, velocity or
/// torque control requires, and all that the tables have a row for. What stands there is not given.
#[test]
fn what_a_full_drive_does_not_have_stands_with_its_reason() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/mapping.md");
    let page = std::fs::read_to_string(path).expect("the page");
    let table = page.split_once("| id | why not |\n|---|---|\n").expect("the table").1;
    let rows = table.lines().take_while(|line| line.starts_with('|'));
    let rows: Vec<_> =
        rows.map(|line| ids_of(line.trim_matches('|').split('|').next().expect("a cell").trim())).collect();
    assert!(rows.len() > 20, "{rows:?}");
    let mut wrong = Vec::new();
    for (bus, settings) in BUSES.into_iter().zip(full_drives()).take(2) {
        let stage = rehearse(&mapping, &settings);
        for row in truths(&stage) {
            let known = mapping.dictionaries.cip.attribute_by_id(row.id).expect("of the dictionary");
            // Nobody has a third encoder.
            if known.channel.is_some_and(|channel| channel > 2) {
                continue;
            }
            let is_there = !matches!(row.truth, Truth::Absent | Truth::Stored);
            let applies = |condition: &str| match condition {
                "" => true,
                _ if condition.ends_with("]`") => false,
                _ if BUSES.iter().any(|bus| condition.ends_with(bus)) => condition.ends_with(bus),
                _ => condition.starts_with("of a rotary motor"),
            };
            let stands = rows.iter().any(|(ids, condition)| ids.contains(&row.id) && applies(condition));
            let what = format!("{bus} {} {}: {} by {}", row.id, row.name, row.truth, row.by);
            let is_required = known.need.chars().skip(3).any(|need| need == 'R');
            let is_bound = !mapping.cip.rejected.iter().any(|(id, _)| *id == row.id);
            if stands && is_there {
                wrong.push(format!("{what}: docs/mapping.md says why not"));
            }
            if !stands && !is_there && (is_required || is_bound) {
                wrong.push(format!("{what}: docs/mapping.md does not say why"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The page of what was measured.
fn page(
    mapping: &Mapping,
    cells: &BTreeMap<u16, Vec<String>>,
    counts: &[[usize; Truth::ALL.len()]],
) -> String {
    let mut page = include_str!("attributes.md.head").to_owned();
    page.push_str("\n| bus |");
    Truth::ALL.iter().for_each(|truth| write!(page, " {truth} |").expect("a string"));
    page.push_str("\n|---|---|---|---|---|---|\n");
    for (bus, counts) in BUSES.iter().zip(counts) {
        write!(page, "| {bus} |").expect("a string");
        counts.iter().for_each(|count| write!(page, " {count} |").expect("a string"));
        page.push('\n');
    }
    page.push_str("\n| id | name | access | SERCOS | CiA 402 | DeviceNet |\n|---|---|---|---|---|---|\n");
    for (id, cells) in cells {
        let row = mapping.dictionaries.cip.attribute_by_id(*id).expect("of the dictionary");
        let (name, access) = (&row.name, row.access.name());
        writeln!(page, "| {id} | {name} | {access} | {} |", cells.join(" | ")).expect("a string");
    }
    page
}

/// What is said of the drives of a running gateway follows them: nothing before they are commissioned and while they are gone.
#[test]
fn the_programs_of_the_drives_can_be_read_while_they_are_commissioned() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    for (settings, truth) in [
        (Settings::default(), Truth::Live),
        (Settings::without_line(include_str!("can.toml").to_owned()), Truth::Absent),
    ] {
        let stage = rehearse(&mapping, &settings);
        let mut rig = Rig::new(settings);
        let programs = rig.engine.programs();
        assert!(programs.get(0).is_none() && programs.get(9).is_none());
        rig.until_ready();
        let program = programs.get(0).expect("it is commissioned");
        let kpp = stage.mapping.truths(&stage.axes[0].attributes, &program);
        let kpp = kpp.iter().find(|row| row.id == 441).expect("Kpp");
        assert_eq!(kpp.truth, truth, "{}", kpp.by);
        rig.cable = false;
        rig.run_for(millis(3_000));
        if truth == Truth::Live {
            assert!(programs.get(0).is_none(), "the line is gone");
        }
    }
}
