//! Tests over the shipped tables and over tables that are broken on purpose.

mod broken_tables;
mod cia402_dictionary;
mod cip_codes;
mod cip_dictionary;
mod cip_program;
mod completeness;
mod computed;
mod cyclic_axis;
mod dangerous;
mod differences;
mod families;
mod overlays;
mod sercos_dictionary;
mod sercos_program;
mod sercos_scaling;
mod shipped_tables;
mod vendor_parameters;

use std::fmt::Write as _;
use std::sync::LazyLock;

use profile_cip::device::attribute::{AttributeTable as DeviceTable, Backing as DeviceBacking, Scope};
use profile_cip::device::drive_link::{DriveAction, DriveCondition, DriveImage};
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::fault_set::{FaultSet, Origin};
use profile_generic::image::{AxisCommand, AxisFeedback, Signal, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::{CATALOGUE, Parameter};
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::{MonotonicTime, SystemTime};
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;
use proptest::prelude::*;

use super::*;

pub(super) fn shipped() -> &'static Mapping {
    static SHIPPED: LazyLock<Mapping> = LazyLock::new(|| match Mapping::embedded() {
        Ok(mapping) => mapping,
        Err(errors) => panic!("{errors}"),
    });
    &SHIPPED
}

/// One turn of a million counts.
fn rotary_counts() -> CipScaling {
    CipScaling {
        kind: UnitKind::Rotary,
        nanounits_per_unit: 1_000_000_000,
        counts_per_unit: 1_000_000,
        inverted: false,
        unwind: None,
    }
}

fn rotary_axis(modulo: bool) -> SercosAxis {
    SercosAxis {
        units: AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() },
        modes: [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque]
            .into_iter()
            .map(ModeSelection::from)
            .collect(),
        modulo,
        any_mode: false,
        bare: false,
        set_scaling: true,
        parameters: Vec::new(),
        captures: CaptureMode::Off,
        silent: false,
        feedback: FeedbackUse::Motor,
    }
}

/// What a drive tells that has taken every value of the plan for CP2.
fn obedient(mapping: &Mapping, axis: &SercosAxis) -> DriveFacts {
    mapping.facts_of_obedient(axis).unwrap()
}
