//! `axisbridge bundle`: the diagnostics bundle of a running gateway, over its local socket.

use std::process::ExitCode;

use super::gateway_client::GatewayClient;
use super::status::PATIENCE;
use super::{BundleArguments, CliError, write_file};

/// Writes the bundle.
pub fn run(arguments: &BundleArguments) -> Result<ExitCode, CliError> {
    let file = GatewayClient::connect(&arguments.local, PATIENCE)?.file("bundle")?;
    write_file(&arguments.output, &file)
}
