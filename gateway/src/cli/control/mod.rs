//! `axisbridge control`: local control from the command line.
//!
//! | how | what |
//! |---|---|
//! | requests as arguments, or lines of a file or pipe | one after the other, each when the one before is done; the first error ends it |
//! | lines of a terminal | each is sent when it is typed, and its reply is shown when it comes |
//! | `--jog AXIS` | keys of the terminal, see `jog` |
//!
//! When the command ends, its connection ends, and with that its axes stop and lose their torque.

mod jog;
mod keys;
mod terminal;

use std::io::{BufRead as _, BufReader, IsTerminal as _, Write as _};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use super::gateway_client::GatewayClient;
use super::{CliError, ControlArguments, print, written_to_end};
use crate::local::protocol::printable;

/// How long an order may take: a long move at a low velocity.
const PATIENCE: Duration = Duration::from_secs(3_600);

/// The same of what is asked while keys are read: disabling an axis that stops and coasts for as long as it may. The keys are not
/// read meanwhile, not even Ctrl-C.
const JOG_PATIENCE: Duration = Duration::from_secs(65);

/// Carries out requests of the command line, of standard input, or of keys.
pub fn run(arguments: &ControlArguments) -> Result<ExitCode, CliError> {
    if let (Some(axis), Some(velocity)) = (&arguments.jog, &arguments.velocity) {
        let client = GatewayClient::connect(&arguments.local, JOG_PATIENCE)?;
        return jog::run(client, axis, velocity, arguments.acceleration.as_deref());
    }
    if !arguments.requests.is_empty() {
        return given(arguments, arguments.requests.iter().cloned().map(Ok));
    }
    let stdin = std::io::stdin();
    if stdin.is_terminal() { typed(arguments) } else { given(arguments, stdin.lock().lines()) }
}

/// Requests, one after the other.
fn given(
    arguments: &ControlArguments,
    requests: impl Iterator<Item = std::io::Result<String>>,
) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    for request in requests {
        let request = request?;
        let Some(request) = meant(&request) else { continue };
        if request.contains(['\n', '\r']) {
            return Err("a request is one line".into());
        }
        let reply = client.ask(request)?;
        let text: String =
            reply.lines.iter().chain([&reply.last]).map(|line| format!("{}\n", printable(line))).collect();
        let code = if reply.last.starts_with("ok ") { ExitCode::SUCCESS } else { ExitCode::FAILURE };
        print(text, code)?;
        if code != ExitCode::SUCCESS {
            return Ok(code);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A line without the space around it; nothing for one that is empty or a comment.
fn meant(line: &str) -> Option<&str> {
    Some(line.trim()).filter(|line| !line.is_empty() && !line.starts_with('#'))
}

/// The requests of a terminal. Replies come in the order in which orders are done, as they do on the socket.
fn typed(arguments: &ControlArguments) -> Result<ExitCode, CliError> {
    let stream = GatewayClient::connect(&arguments.local, PATIENCE)?.into_stream();
    let (sender, replies) = channel();
    let reader = stream.try_clone()?;
    let shown = std::thread::spawn(move || -> std::io::Result<()> {
        for line in BufReader::new(reader).lines() {
            let line = line?;
            // Whoever waits has gone when this fails.
            let _ = sender.send(line.split(' ').next().map(str::to_owned).unwrap_or_default());
            let mut out = std::io::stdout().lock();
            writeln!(out, "{}", printable(&line)).and_then(|()| out.flush())?;
        }
        Ok(())
    });
    let asked = send_lines(&stream)?;
    let failed = wait(&replies, asked);
    // The axes of this client stop now.
    let _ = stream.shutdown(Shutdown::Both);
    drop(replies);
    let written = shown.join().unwrap_or(Ok(()));
    match failed {
        Some(failed) if failed => Ok(ExitCode::FAILURE),
        Some(_) => written_to_end(written, ExitCode::SUCCESS),
        None => Err("the gateway has closed the connection: at most four clients are let in".into()),
    }
}

/// Sends each line that is a request, and returns how many there were.
fn send_lines(mut stream: &UnixStream) -> Result<usize, CliError> {
    let mut asked = 0;
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let Some(request) = meant(&line) else { continue };
        // A gateway that has gone is noticed by its missing replies.
        if stream.write_all(format!("{request}\n").as_bytes()).is_err() {
            break;
        }
        asked += 1;
    }
    Ok(asked)
}

/// Waits for the replies to so many requests: whether one of them was an error; `None` if the gateway goes before.
fn wait(replies: &Receiver<String>, asked: usize) -> Option<bool> {
    let (mut done, mut failed) = (0, false);
    while done < asked {
        let word = replies.recv().ok()?;
        done += usize::from(word == "ok" || word == "error");
        failed |= word == "error";
    }
    Some(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_counted_and_lists_are_not() {
        let (sender, replies) = channel();
        for word in ["parameter", "parameter", "ok", "error", "ok"] {
            sender.send(word.to_owned()).unwrap();
        }
        assert_eq!(wait(&replies, 1), Some(false));
        assert_eq!(wait(&replies, 2), Some(true));
        drop(sender);
        assert_eq!((wait(&replies, 0), wait(&replies, 1)), (Some(false), None));
    }
}
