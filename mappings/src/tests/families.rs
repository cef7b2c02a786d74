//! Families of CiA 402 drives, the shipped ones and those of overlays.

use super::*;
use crate::finding::registry as code;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;

/// A drive with this identity and these objects, with csp, csv, cst, pv and pp.
fn drive(vendor: u32, product: u32, objects: &[((u16, u8), u32)]) -> ObjectFacts {
    let mut facts = ObjectFacts::of(DriveIdentity { vendor: Some(vendor), product: Some(product) });
    let modes = ((0x6502, 0), 0x3A5);
    for ((index, sub), value) in objects.iter().copied().chain([modes]) {
        facts.note_data(Object { index, sub }, &value.to_le_bytes());
    }
    facts
}

fn axis(modes: &[OperatingMode]) -> Cia402Axis {
    Cia402Axis {
        modes: modes.iter().copied().map(ModeSelection::from).collect(),
        any_mode: true,
        cycle: profile_generic::time::DurationNs::from_millis(4),
        ..Cia402Axis::default()
    }
}

/// What a count of a value is, `None` where the axis does without.
fn count(mapping: &Mapping, signal: Signal, facts: &ObjectFacts) -> Option<(i64, i64)> {
    let axis = axis(&[OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque]);
    let program = mapping.of_drive(facts).cia402_program(&axis, facts).unwrap();
    let ratio = program.feedback.fields().find(|field| field.signal == signal)?.conversion.ratio;
    Some((ratio.num(), ratio.den()))
}

fn over(overlays: &[String]) -> (Option<Mapping>, Findings) {
    let mut texts = TableTexts::embedded();
    let path = |place: usize| format!("own-{place}.toml");
    texts.overlays =
        overlays.iter().enumerate().map(|(place, text)| Overlay::new(&path(place), text)).collect();
    let mut findings = Findings::default();
    (Mapping::resolve(&texts, &mut findings), findings)
}

const COUNTS: [((u16, u8), u32); 2] = [((0x608F, 1), 4_096), ((0x608F, 2), 1)];
const FACTOR: [((u16, u8), u32); 4] =
    [((0x608F, 1), 4_096), ((0x608F, 2), 1), ((0x6096, 1), 1), ((0x6096, 2), 1)];
const RPM: [((u16, u8), u32); 3] = [((0x608F, 1), 4_096), ((0x608F, 2), 1), ((0x60A9, 0), 0x00B4_4700)];

/// Velocity counts of drives by their identity and what they tell.
#[test]
fn what_a_maker_counts_counts_for_its_drives() {
    let velocity = |vendor, product, objects: &[((u16, u8), u32)]| {
        count(shipped(), Signal::VelocityActual, &drive(vendor, product, objects))
    };
    let turn = Ratio::new(1_000_000_000, 4_096).unwrap();
    let per_second = Some((turn.num(), turn.den()));
    let rpm = Some((50_000_000, 3));
    // Nobody knows the maker: no velocity unless the drive tells it.
    assert_eq!(velocity(0x7FFF, 1, &COUNTS), None);
    assert_eq!(velocity(0x7FFF, 1, &FACTOR), per_second);
    // Those of a maker, where the drive does not tell it; Oriental is known by its product codes.
    assert_eq!(velocity(0x2BE, 0x13F7, &COUNTS), rpm);
    assert_eq!(velocity(0x2BE, 0x1430, &COUNTS), rpm);
    assert_eq!(velocity(0x2BE, 0x1431, &COUNTS), None);
    assert_eq!(velocity(0x9A, 30_923, &COUNTS), per_second);
    assert_eq!(velocity(0x1DD, 0x6000, &COUNTS), Some((5_000_000, 3)));
    // What the drive tells goes before it.
    assert_eq!(velocity(0x9A, 30_923, &RPM), rpm);
    // What a Technosoft drive tells is not what it counts.
    assert_eq!(velocity(0x1A3, 0x0142_9000, &FACTOR), None);
    assert_eq!(velocity(0x1A3, 0x0142_9000, &RPM), None);
}

#[test]
fn torque_that_is_no_thousandth_is_not_used_as_one() {
    let torque = |vendor| count(shipped(), Signal::TorqueActual, &drive(vendor, 1, &FACTOR));
    assert_eq!(torque(0x7FFF), Some((1_000, 1)));
    assert_eq!(torque(0x1A3), None);
    // Nor is there torque control of it, unless the configuration says what a count is.
    let technosoft = drive(0x1A3, 1, &FACTOR);
    let mut own = axis(&[OperatingMode::Position, OperatingMode::Torque]);
    let tables = shipped().of_drive(&technosoft);
    let left = |own: &Cia402Axis| -> Vec<_> {
        tables
            .cia402_modes_left_out(own, &technosoft)
            .into_iter()
            .map(|(mode, why)| format!("{mode}: {why}"))
            .collect()
    };
    assert_eq!(
        left(&own),
        [
            "torque: the size of a count of permille of rated torque is not known: expected a factor group in the drive, or `counts` in the \
          configuration"
        ]
    );
    own.counts = vec![(Quantity::Torque, Ratio::new(125, 3).unwrap())];
    assert_eq!(left(&own), [""; 0]);
}

#[test]
fn the_rated_torque_of_an_epos4_is_in_micronewtonmetre() {
    let rated = |vendor, product| {
        let facts = drive(vendor, product, &[COUNTS[0], COUNTS[1], ((0x6076, 0), 300_000)]);
        let program =
            shipped().of_drive(&facts).cia402_program(&axis(&[OperatingMode::Position]), &facts).unwrap();
        program.parameter(Parameter::MOTOR_RATED_TORQUE).unwrap().decode(&300_000_u32.to_le_bytes())
    };
    // Micronewtonmetre are the generic unit: 0.3 Nm.
    assert_eq!(rated(0xFB, 0x6050_0000), Some(300_000));
    assert_eq!(rated(0xFB, 0x6150_0000), Some(300_000));
    assert_eq!(rated(0xFB, 0x6552_0000), Some(300_000));
    // 300 Nm of any other drive.
    assert_eq!(rated(0xFB, 0x6322_0000), Some(300_000_000));
}

/// Each shipped file is for drives, says where it has it from, and is in the documentation.
#[test]
fn each_shipped_family_is_for_drives_and_has_sources() {
    let page = include_str!("../../../docs/canopen.md");
    let texts = TableTexts::embedded();
    assert_eq!(shipped().families().len(), texts.families.len(), "each file is one family");
    for file in &texts.families {
        let head: OverlayHead = toml::from_str(&file.text).unwrap();
        let drives = head.drives.expect("drives that it is for");
        assert!(!drives.get_ref().source.is_empty(), "{}", file.path);
        assert!(
            shipped().families().iter().any(|family| family.name == *head.overlay.get_ref()),
            "{}",
            file.path
        );
        let row = format!("| {} | {:X}", head.overlay.get_ref(), drives.get_ref().vendor_id);
        assert!(page.contains(&row), "docs/canopen.md has no row `{row}`");
    }
}

#[test]
fn every_example_of_a_family_runs_and_those_of_all_drives_hold_for_it() {
    let mut findings = Findings::default();
    let all = shipped().run_examples(&mut findings);
    assert!(findings.is_empty(), "{findings}");
    // An example that does not come out is found, in the file of the family.
    let own = "format = 1\noverlay = \"own\"\ndrives = { vendor_id = 7, source = \"manual\" }\n\
               [[generic-cia402.scaling]]\nunit = \"velocity\"\nmethods = [{ name = \"rpm\", base = [50_000_000, 3], last = true }]\n\
               examples = [{ drive = [], object = \"60FF:00\", generic = 1_000_000_000, bytes = \"3D 00 00 00\", back = 1_000_000_000 }]\n";
    let (mapping, found) = over(&[own.to_owned()]);
    assert!(found.is_empty(), "{found}");
    assert_eq!(mapping.unwrap().run_examples(&mut findings), all + 1);
    let [wrong] = findings.list() else { panic!("{findings}") };
    assert_eq!((&*wrong.file, wrong.line, wrong.code), ("own-0.toml", 7, code::EXAMPLE_FAILS), "{wrong}");
}

/// A machine's own family: of a vendor, and of one of its products on top.
#[test]
fn an_overlay_can_be_for_some_drives_only() {
    let head = |name: &str, products: &str, body: &str| {
        format!(
            "format = 1\noverlay = \"{name}\"\ndrives = {{ vendor_id = 0x77{products}, source = \"manual\" }}\n{body}"
        )
    };
    let voltage = "[generic-cia402.drive]\nvoltage_bit = \"dc-link\"\n";
    let modes = "[generic-cia402.drive]\nmodes = [\"pv\"]\n";
    let (mapping, findings) =
        over(&[head("all of 77", "", voltage), head("model 5", ", product_codes = [5]", modes)]);
    assert!(findings.is_empty(), "{findings}");
    let mapping = mapping.unwrap();
    let name = |vendor, product| {
        mapping.family_of(&DriveIdentity { vendor: Some(vendor), product }).map(|family| family.name.as_str())
    };
    assert_eq!(name(0x77, Some(5)), Some("all of 77, model 5"));
    assert_eq!(name(0x77, Some(6)), Some("all of 77"));
    assert_eq!(name(0x77, None), Some("all of 77"));
    assert_eq!(name(0x78, Some(5)), None);
    assert_eq!(mapping.family_of(&DriveIdentity::default()).map(|family| &family.name), None);
    // Ready without the DC link: not for these drives, unless the configuration says otherwise.
    let power = |vendor, told: Option<bool>| {
        let facts = drive(vendor, 6, &COUNTS);
        let axis = Cia402Axis { tells_voltage: told, ..axis(&[OperatingMode::Position]) };
        let mapping = mapping.of_drive(&facts);
        let rows = mapping.object_status_rows(0x08_0021, &[], &axis);
        rows.iter().any(|row| row.key.contains("power"))
    };
    assert_eq!(
        [power(0x78, None), power(0x77, None), power(0x77, Some(false)), power(0x78, Some(true))],
        [true, false, true, false]
    );
    // 6502 is not asked where the family tells it.
    let mut facts = drive(0x77, 5, &COUNTS);
    let tables = mapping.of_drive(&facts);
    assert_eq!(tables.cia402_modes_untold(&axis(&[OperatingMode::Velocity]), &mut facts), None);
    let error =
        tables.cia402_program(&Cia402Axis { any_mode: false, ..axis(&[OperatingMode::Position]) }, &facts);
    assert_eq!(
        error.unwrap_err().to_string(),
        "position needs one of the modes csp, ip, the drive has none of them: 6502:00 is 0x00000004"
    );
}

/// What a machine says of all drives may be what a family says already, or leave nothing for it to take away.
#[test]
fn a_family_counts_over_what_is_said_of_all_drives_and_does_not_complain_of_it() {
    let all = "format = 1\noverlay = \"all\"\n[generic-cia402.drive]\nvoltage_bit = \"dc-link\"\n\
               [[generic-cia402.scaling]]\nunit = \"velocity\"\n\
               methods = [{ name = \"position per second by the velocity factor\", remove = true }]\n\
               examples = []\n";
    let family = "format = 1\noverlay = \"own\"\ndrives = { vendor_id = 7, source = \"manual\" }\n\
                  [generic-cia402.drive]\nvoltage_bit = \"ignore\"\n\
                  [[generic-cia402.scaling]]\nunit = \"velocity\"\n\
                  methods = [{ name = \"position per second by the velocity factor\", remove = true }]\n";
    for overlays in [[all, family], [family, all]] {
        let (mapping, findings) = over(&overlays.map(str::to_owned));
        assert!(findings.is_empty(), "{findings}");
        let mapping = mapping.unwrap();
        let voltage = |vendor| {
            let facts = drive(vendor, 1, &FACTOR);
            mapping.of_drive(&facts).cia402.drive_tells_voltage()
        };
        assert_eq!([voltage(6), voltage(7), voltage(0x6A)], [true, false, true]);
    }
}

#[test]
fn what_is_wrong_with_a_family_is_found_in_its_file() {
    let head = "format = 1\noverlay = \"own\"\ndrives = { vendor_id = 7, source = \"manual\" }\n";
    let wrong = |body: &str, kind: code::Code, line: usize| {
        let (mapping, findings) = over(&[format!("{head}{body}")]);
        assert!(mapping.is_none(), "{body}");
        let [finding] = findings.list() else { panic!("{findings}") };
        assert_eq!((&*finding.file, finding.line, finding.code), ("own-0.toml", line, kind), "{finding}");
        finding.to_string()
    };
    wrong("[generic-cia402.drive]\nvoltage_bit = \"sometimes\"\n", code::UNKNOWN_WORD, 5);
    wrong("[generic-cia402.drive]\nmodes = [\"pq\"]\n", code::UNKNOWN_NAME, 5);
    let other = wrong(
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmissing = \"reject\"\n",
        code::CONTRADICTION,
        4,
    );
    assert!(
        other.contains("expected rows of generic-cia402: the other tables are the same for all drives"),
        "{other}"
    );
    wrong(
        "[[generic-cia402.signal]]\nsignal = \"torque_actual\"\nmissing = \"refuse\"\nlast = true\n",
        code::CONTRADICTION,
        7,
    );
    let (mapping, findings) =
        over(&["format = 1\noverlay = \"own\"\ndrives = { product_codes = [1] }\n".to_owned()]);
    assert!(mapping.is_none() && findings.to_string().contains("vendor_id"), "{findings}");
}
