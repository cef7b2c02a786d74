//! `axisbridge attributes`: what success means for each attribute of the axes of a configuration, or of a running gateway.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use serde::Serialize;

use super::gateway_client::GatewayClient;
use super::status::PATIENCE;
use super::{AttributesArguments, CliError, print, translate, usage};
use crate::config::Config;
use crate::local::attributes::AttributeLine;
use crate::local::overview::Overview;
use crate::mapping::Truth;

/// One axis.
struct AxisRows {
    name: String,
    drive: String,
    /// The drive is a simulated one of its kind: the real one may have more or less.
    is_simulated: bool,
    rows: Vec<AttributeLine>,
}

/// What is printed of one axis as JSON.
#[derive(Debug, Serialize)]
struct AxisObject<'a> {
    name: &'a str,
    drive: &'a str,
    simulated: bool,
    counts: BTreeMap<&'static str, usize>,
    attributes: &'a [AttributeLine],
}

/// Everything that is printed as JSON.
#[derive(Debug, Serialize)]
struct Object<'a> {
    format: u8,
    axes: Vec<AxisObject<'a>>,
}

/// Prints the table.
///
/// # Errors
/// The configuration is faulty, or its drives are not commissioned with it; no gateway answers, or a drive is not commissioned there; the
/// output cannot be written.
pub fn run(arguments: &AttributesArguments) -> Result<ExitCode, CliError> {
    let wanted = |name: &str| arguments.axis.as_deref().is_none_or(|axis| axis == name);
    let (names, axes) = match (&arguments.config, &arguments.local) {
        (Some(config), None) => of_configuration(config, arguments.values.as_deref(), wanted)?,
        (None, Some(socket)) => of_gateway(socket, wanted)?,
        _ => return Ok(usage("expected `--config FILE` or `--local SOCKET`")),
    };
    if let (Some(name), []) = (&arguments.axis, axes.as_slice()) {
        return Ok(usage(&format!("there is no axis `{name}`; expected one of: {}", names.join(", "))));
    }
    let text = if arguments.json { json(&axes)? } else { text(&axes) };
    print(text, ExitCode::SUCCESS)
}

/// The names of all axes and those that are wanted, with drives of the configuration.
fn of_configuration(
    path: &Path,
    values: Option<&Path>,
    wanted: impl Fn(&str) -> bool,
) -> Result<(Vec<String>, Vec<AxisRows>), CliError> {
    let config = Config::load(path)?;
    let stage = translate::stage(&config, values)?;
    let names = stage.axes.iter().map(|axis| axis.name.clone()).collect();
    let axes = stage.axes.iter().filter(|axis| wanted(&axis.name)).map(|axis| AxisRows {
        name: axis.name.clone(),
        drive: axis.drive.clone(),
        is_simulated: values.is_none(),
        rows: stage.mapping.truths(&axis.attributes, &axis.south).iter().map(AttributeLine::from).collect(),
    });
    Ok((names, axes.collect()))
}

/// The names of all axes and those that are wanted, with the drives of a running gateway.
fn of_gateway(
    socket: &Path,
    wanted: impl Fn(&str) -> bool,
) -> Result<(Vec<String>, Vec<AxisRows>), CliError> {
    let mut client = GatewayClient::connect(socket, PATIENCE)?;
    let reply = client.ask("box")?;
    let overview: Overview = serde_json::from_str(reply.end("box", "ok box {...}")?)
        .map_err(|error| format!("unexpected reply of the gateway: {error}"))?;
    let names = overview.axes.iter().map(|axis| axis.name.clone()).collect();
    let mut axes = Vec::new();
    for axis in overview.axes.into_iter().filter(|axis| wanted(&axis.name)) {
        let reply = client.ask(&format!("attributes {}", axis.name))?;
        reply.end("attributes", "ok attributes N")?;
        let rows = reply.rows("attribute")?.into_iter().map(|(_, row)| row).collect();
        axes.push(AxisRows { name: axis.name, drive: axis.drive, is_simulated: false, rows });
    }
    Ok((names, axes))
}

fn json(axes: &[AxisRows]) -> Result<String, CliError> {
    let axes = axes.iter().map(|axis| AxisObject {
        name: &axis.name,
        drive: &axis.drive,
        simulated: axis.is_simulated,
        counts: Truth::ALL.iter().map(|truth| (truth.name(), axis.count(*truth))).collect(),
        attributes: &axis.rows,
    });
    let mut text = serde_json::to_string(&Object { format: 1, axes: axes.collect() })
        .map_err(|error| error.to_string())?;
    text.push('\n');
    Ok(text)
}

fn text(axes: &[AxisRows]) -> String {
    let mut text = String::new();
    for axis in axes {
        let counts: Vec<_> =
            Truth::ALL.iter().map(|truth| format!("{} {truth}", axis.count(*truth))).collect();
        let gap = if text.is_empty() { "" } else { "\n" };
        let simulated = if axis.is_simulated { " (a simulated one)" } else { "" };
        let AxisRows { name, drive, .. } = axis;
        // A string takes everything.
        let _ = writeln!(text, "{gap}axis {name}, drive {drive}{simulated}: {}", counts.join(", "));
        for AttributeLine { id, name, access, truth, by } in &axis.rows {
            let _ = writeln!(text, "{id:>5}  {truth:<8}  {access:<10}  {name:<44}  {by}");
        }
    }
    text
}

impl AxisRows {
    fn count(&self, truth: Truth) -> usize {
        self.rows.iter().filter(|row| row.truth == truth.name()).count()
    }
}
