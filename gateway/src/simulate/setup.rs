//! How a simulated controller is set up for a box: connection, attributes, waiting times.

use profile_cip::controller::config::TimeOuts;
use profile_cip::controller::{AttributeSet, AxisSetup, ControllerConfig, Step};
use profile_cip::wire::motion::codes::{ActualDataSet, CommandDataSet};
use profile_generic::time::DurationNs;

use crate::mapping::Mapping;

/// Clock identity (EUI-64) of the host's own clock, which a box with `source = "host"` follows and a controller on the
/// same host takes for its grand master.
pub const HOST_CLOCK: [u8; 8] = [0x02, 0x41, 0x42, 0xFF, 0xFE, 0x00, 0x00, 0x01];

/// Counts in a unit where nothing else is said: the default of the box's `motion_resolution`.
pub const COUNTS_PER_UNIT: u32 = 1_000_000;

/// Usual speed of an axis in units per second.
pub const SPEED: f64 = 2.0;

/// Farthest that an axis is moved, in units.
pub const REACH: f64 = 700.0;

/// How long drives may take from their power-up until they can be enabled: the phase-up of a long line takes seconds.
pub const READY_TIME_OUT: DurationNs = DurationNs::from_secs(30);

/// Connection time-out: 32 update periods, since hosts without real-time kernels miss some now and then.
const TIMEOUT_MULTIPLIER: u8 = 3;

/// Controller Update Delay High Limit and Low Limit, in update periods. With a higher one axes go on for longer without a command, and
/// have more to catch up with when the next one comes.
const DELAY_LIMITS: (u8, u8) = (4, 4);

/// A controller for axes with these counts in a unit. No axis is cyclic, whatever the box has it for: [`make_cyclic`].
#[must_use]
pub fn controller(mapping: &Mapping, counts_per_unit: &[f64], update_period_us: u32) -> ControllerConfig {
    let axes = counts_per_unit.iter().map(|counts| {
        let mut axis = AxisSetup::position(*counts);
        axis.attributes = instance_attributes(mapping);
        axis
    });
    let mut config = ControllerConfig::new(Some(HOST_CLOCK), axes.collect());
    config.list_identity = true;
    config.rpi_us = update_period_us;
    config.timeout_multiplier = TIMEOUT_MULTIPLIER;
    config.update_delay_low_limit = DELAY_LIMITS.1;
    config.class_attributes = class_attributes(mapping);
    config.time_outs = TimeOuts { initialization: READY_TIME_OUT, ..TimeOuts::default() };
    config
}

/// Makes an axis start anew after so many counts: the controller says so to the box, and counts the cycles.
pub fn make_cyclic(mapping: &Mapping, axis: &mut AxisSetup, unwind: i32) {
    let rows = &mapping.cip.scaling;
    axis.unwind = u32::try_from(unwind).ok();
    axis.sets.command |= CommandDataSet::UNWIND_COUNT;
    axis.sets.actual |= ActualDataSet::UNWIND_COUNT;
    axis.attributes.retain(|set| set.selector.id != rows.unwind);
    axis.attributes.push(AttributeSet::dint(rows.unwind_position, unwind));
    axis.attributes.push(AttributeSet::usint(rows.unwind, 1));
}

/// An enable that waits for drives on their way up.
#[must_use]
pub fn patient(step: Step) -> Step {
    Step::Within { time_out: READY_TIME_OUT, step: Box::new(step) }
}

/// Class attributes by the names of the dictionary.
fn class_attributes(mapping: &Mapping) -> Vec<AttributeSet> {
    let rows = mapping.dictionaries.cip.class_attributes();
    let id = |name: &str| rows.iter().find(|row| row.name == name).map(|row| row.id);
    let sets = [
        ("Controller Update Delay High Limit", DELAY_LIMITS.0),
        ("Controller Update Delay Low Limit", DELAY_LIMITS.1),
    ];
    sets.iter()
        .filter_map(|(name, value)| id(name).map(|id| AttributeSet::usint(id, *value).optional()))
        .collect()
}

/// Instance attributes by the names of the dictionary: a closed loop on the motor feedback with stops on the ramp. The
/// scaling stays as the box has it, but for the unwind: the controller counts on.
fn instance_attributes(mapping: &Mapping) -> Vec<AttributeSet> {
    let dictionary = &mapping.dictionaries.cip;
    let id = |name: &str| dictionary.attribute(name).map(|row| row.id);
    let sets = [
        id("Control Method").map(|id| AttributeSet::usint(id, 2)),
        id("Stopping Action").map(|id| AttributeSet::usint(id, 1)),
        id("Position Lock Tolerance").map(|id| AttributeSet::real(id, 1_000.0)),
    ];
    let counts_on = AttributeSet::usint(mapping.cip.scaling.unwind, 0);
    sets.into_iter().flatten().chain([counts_on]).map(AttributeSet::optional).collect()
}
