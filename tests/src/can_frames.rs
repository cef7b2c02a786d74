//! The axes of `tests/frames-can`: those of `tests/frames` on simulated CiA 402 drives.

use std::path::PathBuf;

use axisbridge::engine::bus::can::layout::{AxisPdos, SpareIds};
use axisbridge::mapping::{AxisUnits, Cia402Axis, CipScaling, Mapping};
use axisbridge::simulate::can_drive;
use axisbridge::translate::{CanMember, Stage, StageError};
use profile_cia402::eds;
use profile_cia402::wire::NodeId;
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::{NANO, UnitKind};
use profile_generic::time::DurationNs;

/// The folder with the lists.
#[must_use]
pub fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/frames-can"))
}

/// A drive by its factor group; one behind a spindle of 10 mm; one that counts 3600 in a turn and velocities in 0.1 revolutions per
/// minute, which the configuration says, and adds the trims of velocity and torque.
///
/// # Errors
/// The tables make no program for one of them.
///
/// # Panics
/// The simulated drive has no data sheet.
pub fn stage(mapping: Mapping) -> Result<Stage, StageError> {
    let node = can_drive::drive(NodeId::new(1).ok(), 1).expect("one axis");
    let sheet = eds::read(node.eds()).expect("a data sheet").description;
    let modes = [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
    let needs = Cia402Axis {
        modes: modes.into_iter().map(Into::into).collect(),
        cycle: DurationNs::from_millis(2),
        left_out: vec![Signal::FollowingError, Signal::DigitalInputs],
        ..Cia402Axis::default()
    };
    let scaling = |kind, counts, unwind| CipScaling {
        kind,
        nanounits_per_unit: NANO,
        counts_per_unit: counts,
        inverted: false,
        unwind,
    };
    let count = |num, den| Ratio::new(num, den).expect("above zero");
    let counts = vec![
        (Quantity::Position, count(NANO, 3_600)),
        (Quantity::Velocity, count(5_000_000, 3)),
        (Quantity::Acceleration, count(NANO, 3_600)),
    ];
    let spindle = Cia402Axis {
        units: AxisUnits { kind: UnitKind::Linear, ..AxisUnits::default() },
        way_of_a_turn: Ratio::new(10, 1),
        ..needs.clone()
    };
    let members = [
        ("turntable", "drive-a", needs.clone(), scaling(UnitKind::Rotary, 1_000_000, None)),
        ("slide", "drive-b", spindle, scaling(UnitKind::Linear, 10_000, None)),
        (
            "index",
            "drive-c",
            Cia402Axis { counts, offsets: vec![Signal::VelocityOffset, Signal::TorqueOffset], ..needs },
            scaling(UnitKind::Rotary, 360_000, Some(360_000)),
        ),
    ];
    let members = (1_u8..).zip(members).map(|(number, (name, drive, needs, scaling))| {
        let member = CanMember {
            name: name.to_owned(),
            device: 0,
            instance: number,
            drive: drive.to_owned(),
            node: NodeId::new(number).expect("a node-id"),
            pdos: AxisPdos::new(0, 3, &mut SpareIds::new(Vec::new()))
                .expect("the first axis has them by default"),
            found: None,
            needs,
            scaling,
        };
        (member, &sheet)
    });
    Stage::of_sheets(mapping, members)
}
