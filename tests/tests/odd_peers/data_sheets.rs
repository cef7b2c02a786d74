//! Drives by their data sheets (`tests/data-sheets`, written for this test in the manners of several makers): what `check` says of each
//! before it is there, and what becomes of a simulated drive like it under the box. Both must agree: what `check` finds an error in
//! is refused for the same reason, and everything else is commissioned and moved.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use axisbridge::check::{Request, check};
use axisbridge::finding::Severity;
use axisbridge::simulate::can_bus::InProcessCan;
use axisbridge::simulate::can_drive::DriveNode;
use axisbridge::simulate::can_twin::Sheet;
use axisbridge::simulate::drive_events::setup::Setup;
use axisbridge::status::BoxState;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::motion_checker::MotionChecker;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::sdo::request::SdoFailure;
use profile_cia402::wire::NodeId;
use profile_cip::controller::{Condition, Limits, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::can::bus::Bus;

use super::{AXIS, does, said};

const NODE: u8 = 3;

/// The box before its drive.
const HEAD: &str = r#"
[box]
name = "sheets"

[[device]]
name = "front"
listen = "10.0.0.2"
axes = ["axis"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 65_000
product_code = 1001
serial_number = 0x0041_4201
product_name = "Axisbridge sheets"

[[axis]]
name = "axis"
instance = 1
drive = "drive"
unit = "revolution"
motion_resolution = 1_000_000

[axis.limits]
velocity = 40.0
torque_percent = 150.0

[[south.can]]
interface = "in-process"
cycle_time = "4 ms"
BUS

[[south.can.drive]]
name = "drive"
node = 3
DRIVE

[[south.can.device]]
node = 3
eds = "FILE"
DEVICE
"#;

/// A row: a data sheet, and what the configuration asks of a drive like it.
struct Row {
    name: &'static str,
    file: &'static str,
    /// Keys of the bus, of the drive and of the device.
    keys: [&'static str; 3],
    mode: ControlMode,
    /// Turns of the motor in one of the axis.
    turns: f64,
}

const fn row(name: &'static str, file: &'static str, drive: &'static str) -> Row {
    Row { name, file, keys: ["", drive, ""], mode: ControlMode::POSITION, turns: 1.0 }
}

fn rows() -> Vec<Row> {
    let velocity = ControlMode::VELOCITY;
    vec![
        row("servo drive with everything", "nordwind-sd5.eds", ""),
        Row {
            mode: velocity,
            ..row("the same in velocity control", "nordwind-sd5.eds", "modes = [\"velocity\"]")
        },
        Row {
            keys: ["", "", "identity = { vendor_id = 0x7F00_0001, product_code = 0x5D06 }"],
            ..row("the same, and another product is expected", "nordwind-sd5.eds", "")
        },
        row("frequency converter as a position axis", "kessel-fc3.eds", "modes = [\"position\"]"),
        Row {
            mode: velocity,
            ..row("frequency converter as a velocity axis", "kessel-fc3.eds", "modes = [\"velocity\"]")
        },
        row("stepper drive with fixed PDOs", "tern-st42.eds", "modes = [\"position\"]"),
        row("the same with velocity as well", "tern-st42.eds", "modes = [\"position\", \"velocity\"]"),
        row("csp without interpolation time", "halden-x1.eds", ""),
        row("csp only, and torque is asked for", "halden-x1.eds", "modes = [\"position\", \"torque\"]"),
        row("6502 is not there", "brook-m20.eds", ""),
        row("homing only", "pilgrim-h.eds", "modes = [\"position\", \"homing\"]"),
        Row {
            turns: 5.0,
            ..row("device configuration with formulas", "estrella-k7.dcf", "modes = [\"position\"]")
        },
        row("written by hand", "motmot-7.eds", ""),
        row("first axis of two", "gemella-902.eds", ""),
        row("second axis of two", "gemella-902.eds", "axis = 1"),
        row("third axis of two", "gemella-902.eds", "axis = 2"),
        row("many objects of its own", "colossus-b16.eds", ""),
        row("two entries in a PDO", "duo-2e.eds", ""),
        Row {
            keys: ["bit_rate = 500_000", "", ""],
            ..row("transmission types 254 and 255 only", "arrhythmia-aa.eds", "")
        },
        row("a bit rate that it does not have", "arrhythmia-aa.eds", ""),
        Row {
            keys: ["bit_rate = 500_000", "", "rpdo_type = 1"],
            ..row("a transmission type that it does not have", "arrhythmia-aa.eds", "")
        },
    ]
}

fn sheets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data-sheets")
}

fn configuration(row: &Row) -> String {
    let [bus, drive, device] = row.keys;
    let text = HEAD.replace("BUS", bus).replace("DRIVE", drive).replace("DEVICE", device);
    text.replace("FILE", &sheets().join(row.file).display().to_string())
}

/// What `check` says of a row: whether it finds an error, and the findings without those of every configuration.
fn checked(row: &Row, number: usize) -> (bool, String) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("data-sheets");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(format!("{number}.toml"));
    std::fs::write(&path, configuration(row)).expect("a file");
    let outcome = check(&Request { config: Some(&path), ..Request::default() });
    let own = ["AX0093", "AX0094", "AX0096", "AX0097", "AX0098", "AX0087", "AX0088", "AX0001"];
    let mut text = String::new();
    let mut has_error = false;
    for finding in outcome.tables.findings.list() {
        let is_own = own.contains(&finding.code.to_string().as_str());
        assert!(is_own || finding.severity() != Severity::Error, "{}: {}", row.name, finding.title);
        if !is_own {
            continue;
        }
        has_error |= finding.severity() == Severity::Error;
        let _ = writeln!(text, "    {}[{}]: {}", finding.severity(), finding.code, finding.title);
        for more in [&finding.expected, &finding.help].into_iter().filter(|more| !more.is_empty()) {
            let _ = writeln!(text, "        {more}");
        }
        if let Some(related) = &finding.related {
            let file = related.file.rsplit('/').next().unwrap_or_default();
            let _ = writeln!(text, "        {file}:{}", related.line);
        }
    }
    (has_error, text)
}

fn twin(row: &Row) -> DriveNode {
    let sheet = Sheet::load(&sheets().join(row.file)).expect("a data sheet of a drive");
    sheet.drive(NodeId::new(NODE).ok(), 1, &Setup::default()).expect("a drive that works")
}

/// What becomes of a drive like that of the row: whether it is commissioned, moved as far as it has to, and what the box says of it.
fn driven(row: &Row) -> (bool, Vec<String>) {
    let configuration = configuration(row);
    let settings = Settings::without_line(configuration);
    let mut rig = Rig::new(settings);
    // It takes the counts of the drives that the rig makes, and these have those of their files.
    rig.motion_checker = MotionChecker::default();
    let rate = rig.can[0].bus.bus().rate();
    rig.can[0].bus = InProcessCan::new(Bus::new(rate), vec![twin(row)], None);
    let axis = if row.keys[1].starts_with("axis = ") { 1 } else { 0 };
    let mut left = 30;
    while left > 0 && rig.status().state != BoxState::READY {
        rig.run_for(millis(500));
        left -= 1;
    }
    let at = |rig: &Rig| {
        let node = rig.can[0].bus.nodes().next().expect("one drive");
        let axes = node.application().axes();
        axes.get(axis).map_or((0.0, 0.0), |axis| {
            let actual = axis.actual();
            #[allow(clippy::cast_precision_loss, reason = "turns of some thousand")]
            (actual.position.0 as f64 / 1e9, actual.velocity.0 as f64 / 1e9)
        })
    };
    let start = at(&rig).0;
    let (mut fastest, mut done) = (0.0_f64, false);
    if rig.status().state == BoxState::READY {
        let steps = match row.mode {
            ControlMode::VELOCITY => vec![
                Step::Enable(AXIS),
                Step::RunAt { axis: 1, velocity: 2.0, acceleration: 4.0, jerk: 400.0 },
                Step::Expect {
                    condition: Condition::Velocity { axis: 1, velocity: 2.0, tolerance: 0.1 },
                    within: millis(3_000),
                },
            ],
            _ => vec![
                Step::Enable(AXIS),
                Step::MoveAbsolute {
                    axis: 1,
                    position: 1.0,
                    limits: Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 },
                },
                Step::Dwell { seconds: 0.5 },
            ],
        };
        done = does(&mut rig, row.mode, steps, 20_000, |rig| fastest = fastest.max(at(rig).1));
    }
    let went = match row.mode {
        ControlMode::VELOCITY => (fastest - 2.0).abs() < 0.05,
        _ => (at(&rig).0 - start - row.turns).abs() < 0.02,
    };
    if super::is_wordy() {
        println!("start {start} at {:?} fastest {fastest}\n{}\n{}", at(&rig), rig.told(), rig.log());
    }
    let of_drive = ["node 3", "cannot be used", "Axis Fault", "was refused", "commissioning"];
    (done && went, said(&rig, &of_drive))
}

#[test]
fn what_check_says_of_a_data_sheet_is_what_becomes_of_a_drive_like_it() {
    let (mut text, mut differ) = (String::new(), Vec::new());
    for (number, row) in rows().into_iter().enumerate() {
        if super::left_out(row.name) {
            continue;
        }
        let (has_error, found) = checked(&row, number);
        // A simulated bus has every bit rate, and only its drives do not.
        let (works, log) =
            if row.name.starts_with("a bit rate") { (false, Vec::new()) } else { driven(&row) };
        let _ = writeln!(
            text,
            "{} ({}): {}\n  check:\n{found}  box:",
            row.name,
            row.file,
            if works { "works" } else { "refused" }
        );
        for line in log {
            let _ = writeln!(text, "    {line}");
        }
        if works == has_error {
            differ.push(row.name);
        }
    }
    assert!(
        differ.is_empty(),
        "{differ:?}
{text}"
    );
    insta::assert_snapshot!(text);
}

/// What a drive like that of a data sheet answers, object by object, is what the file says.
#[test]
fn a_drive_like_that_of_a_data_sheet_has_its_objects_and_no_others() {
    use profile_cia402::eds::{Access, read};
    use profile_cia402::wire::{AbortCode, Mux};
    for entry in std::fs::read_dir(sheets()).expect("the folder is there") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|extension| extension == "md") {
            continue;
        }
        let name = path.file_name().and_then(|name| name.to_str()).expect("a plain name").to_owned();
        let description = read(&std::fs::read(&path).expect("readable")).expect("a data sheet").description;
        let sheet = Sheet::load(&path).expect("a data sheet of a drive");
        let mut drive =
            ask::Asked::new(sheet.drive(NodeId::new(NODE).ok(), 77, &Setup::default()).expect("a drive"));
        let mut compared = 0;
        for index in 0x1000..=0x9FFF_u16 {
            let Some(object) = description.object(index) else {
                if index % 16 == 0 || (0x6000..0x6900).contains(&index) || (0x1000..0x1030).contains(&index) {
                    assert_eq!(
                        drive.read(index, 0),
                        Err(SdoFailure::Refused(AbortCode::NO_OBJECT)),
                        "{name} {index:04X}"
                    );
                }
                continue;
            };
            for sub in &object.subs {
                let place = format!("{name} {index:04X}:{:02X}", sub.sub);
                let answer = drive.read(index, sub.sub);
                if sub.access == Access::WriteOnly {
                    assert_eq!(answer, Err(SdoFailure::Refused(AbortCode::WRITE_ONLY)), "{place}");
                    continue;
                }
                let said = description.reads(Mux::new(index, sub.sub), NODE).expect("it is there");
                let answer = answer.unwrap_or_else(|failure| panic!("{place}: {failure}"));
                if let Some(bits) = sub.data_type.bits() {
                    assert_eq!(answer.len(), usize::from(bits).div_ceil(8), "{place}");
                }
                // What moves changes, and 0 is not taken where an axis could not move with it.
                let lives =
                    [0x6041, 0x6061, 0x6064, 0x606C, 0x6077, 0x603F, 0x6044, 0x6043, 0x60F4, 0x60FD, 0x1001];
                if let Some(said) = said.filter(|said| said.iter().any(|byte| *byte != 0))
                    && !lives.contains(&index)
                {
                    assert_eq!(answer, said, "{place}");
                    compared += 1;
                }
                if !sub.access.writes() {
                    let refused = drive.write(index, sub.sub, &answer);
                    assert_eq!(refused, Err(SdoFailure::Refused(AbortCode::READ_ONLY)), "{place}");
                }
            }
        }
        assert!(compared > 20, "{name}: {compared}");
    }
}

#[test]
fn limits_lengths_and_formulas_of_a_data_sheet_are_kept() {
    use profile_cia402::wire::AbortCode;
    let drive = |file: &str| {
        let sheet = Sheet::load(&sheets().join(file)).expect("a data sheet of a drive");
        ask::Asked::new(sheet.drive(NodeId::new(NODE).ok(), 77, &Setup::default()).expect("a drive"))
    };
    let refused = |code| Err(SdoFailure::Refused(code));
    let unread = |code| Err::<Vec<u8>, _>(SdoFailure::Refused(code));
    let mut servo = drive("nordwind-sd5.eds");
    // 60C2:01 from 1 to 250, 605D from 1 to 2, 6098 from -4 to 37.
    assert_eq!(servo.write(0x60C2, 1, &[250]), Ok(()));
    assert_eq!(servo.write(0x60C2, 1, &[251]), refused(AbortCode::TOO_HIGH));
    assert_eq!(servo.write(0x60C2, 1, &[0]), refused(AbortCode::TOO_LOW));
    assert_eq!(servo.write(0x60C2, 1, &[1, 0]), refused(AbortCode::TOO_LONG));
    assert_eq!(servo.write(0x605D, 0, &3_i16.to_le_bytes()), refused(AbortCode::TOO_HIGH));
    assert_eq!(servo.write(0x6098, 0, &[0xFB]), refused(AbortCode::TOO_LOW));
    assert_eq!(servo.write(0x6040, 1, &[0]), refused(AbortCode::NO_SUB_INDEX));
    assert_eq!(servo.write(0x6064, 0, &[0; 4]), refused(AbortCode::READ_ONLY));
    assert_eq!(servo.write(0x6060, 0, &[7]), refused(AbortCode::VALUE), "ip is not in its 6502");
    // What is not in the file is not there, though the simulated drive works with it.
    assert_eq!(servo.read(0x60C1, 1), unread(AbortCode::NO_OBJECT));
    assert_eq!(servo.read(0x2FFF, 1), unread(AbortCode::NO_OBJECT));
    // Its identity, and the serial number that the file does not say.
    assert_eq!(servo.read(0x1018, 2), Ok(0x5D05_u32.to_le_bytes().to_vec()));
    assert_eq!(servo.read(0x1018, 4), Ok(77_u32.to_le_bytes().to_vec()));
    assert_eq!(servo.read(0x1008, 0), Ok(b"SD5-400".to_vec()));
    // A mapping: as many entries as the file has places, and only what can be mapped.
    assert_eq!(servo.write(0x1400, 1, &0x8000_0203_u32.to_le_bytes()), Ok(()));
    assert_eq!(servo.write(0x1600, 0, &[0]), Ok(()));
    assert_eq!(servo.write(0x1600, 1, &0x6041_0010_u32.to_le_bytes()), refused(AbortCode::NOT_MAPPABLE));
    assert_eq!(servo.write(0x1600, 1, &0x607A_0020_u32.to_le_bytes()), Ok(()));
    assert_eq!(servo.write(0x1600, 9, &0x6040_0010_u32.to_le_bytes()), refused(AbortCode::NO_SUB_INDEX));
    // A device configuration: its values before the defaults, formulas with the node-id, in limits as well.
    let mut configured = drive("estrella-k7.dcf");
    assert_eq!(configured.read(0x608F, 1), Ok(20_000_u32.to_le_bytes().to_vec()));
    assert_eq!(configured.read(0x1017, 0), Ok(500_u16.to_le_bytes().to_vec()));
    assert_eq!(configured.read(0x1014, 0), Ok(0x83_u32.to_le_bytes().to_vec()));
    assert_eq!(configured.read(0x1800, 1), Ok(0x4000_0183_u32.to_le_bytes().to_vec()));
    assert_eq!(configured.read(0x2201, 0), Ok(vec![4]));
    assert_eq!([configured.write(0x2201, 0, &[3]), configured.write(0x2201, 0, &[13])], [Ok(()), Ok(())]);
    assert_eq!(configured.write(0x2201, 0, &[14]), refused(AbortCode::TOO_HIGH));
    assert_eq!(configured.write(0x2201, 0, &[2]), refused(AbortCode::TOO_LOW));
    // Types that no object of the simulated drive has.
    let mut big = drive("colossus-b16.eds");
    let text = std::fs::read(sheets().join("colossus-b16.eds")).expect("readable");
    let description = profile_cia402::eds::read(&text).expect("a data sheet").description;
    for (data_type, bytes) in [
        (0x1B, 0x0123_4567_89AB_CDEF_u64.to_le_bytes().to_vec()),
        (0x08, 1.5_f32.to_le_bytes().to_vec()),
        (0x15, (-5_i64).to_le_bytes().to_vec()),
        (0x16, vec![0x56, 0x34, 0x12]),
        (0x10, vec![0xFD, 0xFF, 0xFF]),
    ] {
        let readable = description.objects.iter().find(|object| {
            (0x2000..0x3000).contains(&object.index)
                && object.subs[0].data_type.0 == data_type
                && object.subs[0].access.reads()
        });
        let index = readable.expect("one of this type").index;
        assert_eq!(big.read(index, 0), Ok(bytes), "{index:04X}");
    }
    assert_eq!(big.write(0x3000, 40, &[7, 0]), Ok(()));
    assert_eq!(big.read(0x3000, 40), Ok(vec![7, 0]));
    assert_eq!(big.read(0x3000, 41), unread(AbortCode::NO_SUB_INDEX));
}

/// A drive that is asked by SDO, with nobody else on the bus.
mod ask {
    use axisbridge::simulate::can_drive::DriveNode;
    use profile_cia402::sdo::client::{Client, ClientConfig};
    use profile_cia402::sdo::request::{SdoData, SdoFailure, SdoRequest};
    use profile_cia402::wire::{Mux, cob_id, frame};
    use profile_generic::time::{DurationNs, MonotonicTime};

    pub struct Asked {
        drive: DriveNode,
        client: Client,
        now: MonotonicTime,
    }

    impl Asked {
        pub fn new(drive: DriveNode) -> Self {
            let mut asked = Self {
                drive,
                client: Client::new(ClientConfig::default()),
                now: MonotonicTime(1_000_000_000),
            };
            for _ in 0..200 {
                asked.pass();
            }
            while asked.drive.poll(asked.now).is_some() {}
            asked
        }

        fn pass(&mut self) {
            self.now = self.now + DurationNs::from_millis(1);
            self.drive.handle_time(self.now);
        }

        pub fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, SdoFailure> {
            self.ask(SdoRequest::upload_into(Mux::new(index, sub), Vec::with_capacity(4_096)))
        }

        pub fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), SdoFailure> {
            let request = SdoRequest::download(Mux::new(index, sub), SdoData::Buffer(bytes.to_vec()));
            self.ask(request).map(|_| ())
        }

        fn ask(&mut self, request: SdoRequest) -> Result<Vec<u8>, SdoFailure> {
            let node = self.drive.node().expect("a drive with a node-id");
            self.client.start(self.now, request).expect("one at a time");
            loop {
                while let Some(data) = self.client.poll(self.now) {
                    self.drive.handle_frame(self.now, &frame(cob_id::sdo_request(node), &data));
                    while let Some(answer) = self.drive.poll(self.now) {
                        if answer.id() == cob_id::sdo_response(node) {
                            let _ = self.client.handle(self.now, answer.data());
                        }
                    }
                }
                if let Some(outcome) = self.client.take_outcome() {
                    return outcome.result.map(|()| outcome.data.as_slice().to_vec());
                }
                self.pass();
            }
        }
    }
}
