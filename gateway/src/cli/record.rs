//! `axisbridge record`: the rolling recording of a running gateway, over its local socket.

use std::process::ExitCode;

use super::gateway_client::GatewayClient;
use super::status::PATIENCE;
use super::{CliError, RecordArguments, write_file};

/// Writes the recording.
pub fn run(arguments: &RecordArguments) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    let last = arguments.last.map(|seconds| format!(" last={seconds}")).unwrap_or_default();
    let file = client.file(&format!("record{last}"))?;
    write_file(&arguments.output, &file)
}
