//! `axisbridge simulate plc`: a programmable controller that moves one axis through assemblies.

use std::process::ExitCode;
use std::time::Duration;

use profile_generic::cast::{f64_from_i64, i64_from_f64};

use super::{CliError, PlcArguments, signal, usage};
use crate::config::Config;
use crate::simulate::plc::{self, Plan};

/// Moves the axis.
///
/// # Errors
/// The configuration is faulty, or the axis is not at its target and without torque at the end.
pub fn run(arguments: &PlcArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    let Some(axis) = config.axes.iter().find(|axis| axis.name == arguments.axis) else {
        let names: Vec<_> = config.axes.iter().map(|axis| axis.name.as_str()).collect();
        let names = names.join(", ");
        return Ok(usage(&format!("there is no axis `{}`; expected one of: {names}", arguments.axis)));
    };
    let device = &config.devices[axis.device];
    let Some(assemblies) = &device.assembly else {
        let (axis, device) = (&axis.name, &device.name);
        let message =
            format!("the axis `{axis}` is on the CIP Motion device `{device}`; expected one with assemblies");
        return Ok(usage(&message));
    };
    let mut instances: Vec<_> = config.axes_of(axis.device).map(|(_, axis)| axis.instance).collect();
    instances.sort_unstable();
    let place = instances.iter().position(|instance| *instance == axis.instance).unwrap_or(0);
    let counts = |units: f64| i64_from_f64((units * f64::from(axis.motion_resolution)).round());
    let plan = Plan {
        address: device.listen,
        assemblies,
        axis: place,
        target: counts(arguments.to),
        velocity: counts(arguments.velocity),
        acceleration: arguments.acceleration.map_or(0, counts),
        interval: Duration::from_micros(u64::from(arguments.interval_us)),
        limit: Duration::from_secs(u64::from(arguments.seconds)),
    };
    let stop = signal::stop_on_signals()?;
    let position = plc::run(&plan, &stop, &mut |line| println!("{line}"))?;
    println!("{} at {:.6}", axis.name, f64_from_i64(position) / f64::from(axis.motion_resolution));
    Ok(ExitCode::SUCCESS)
}
