//! A connection to the local socket of a running gateway, for the commands that are its clients.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use serde::de::DeserializeOwned;

use super::CliError;

/// Longest line of a reply, bytes: a value of 64 KiB is shown as text and as hexadecimal digits.
const LINE_MAX: u64 = 2 * 1_024 * 1_024;

/// Most lines of a reply: a drive has a list of up to 16384 IDNs.
const LINES_MAX: usize = 65_536;

/// Most bytes of a file: what the memory of a recording can have, and the heads of its blocks.
const FILE_MAX: u64 = 4_000_000_000;

/// A connection to the socket.
pub struct GatewayClient {
    stream: BufReader<UnixStream>,
}

/// A reply.
pub struct Reply {
    /// The lines of a list; mostly there are none.
    pub lines: Vec<String>,
    /// The last line, which says whether it is `ok` or an `error`.
    pub last: String,
}

impl Reply {
    /// Takes the text of a reply apart.
    pub fn of(text: &str) -> Self {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let last = lines.pop().unwrap_or_default();
        Self { lines, last }
    }

    /// What the last line says after `ok` and this word. `form` is the reply that is expected.
    pub fn end(&self, word: &str, form: &str) -> Result<&str, CliError> {
        let end = self.last.strip_prefix("ok ").and_then(|rest| rest.strip_prefix(word));
        end.and_then(|rest| rest.strip_prefix(' ')).ok_or_else(|| self.unexpected(form))
    }

    /// The error that this reply is where another form was expected: the gateway's own text, or what came.
    pub fn unexpected(&self, form: &str) -> CliError {
        match self.last.split_once(": ") {
            Some((head, text)) if head.starts_with("error ") => text.into(),
            _ => format!("expected a reply `{form}`, got `{}`", self.last).into(),
        }
    }

    /// The objects of the lines, each behind this word, with their texts.
    pub fn rows<T: DeserializeOwned>(&self, word: &str) -> Result<Vec<(&str, T)>, CliError> {
        let mut rows = Vec::with_capacity(self.lines.len());
        for line in &self.lines {
            let json = line.strip_prefix(word).and_then(|rest| rest.strip_prefix(' '));
            let json = json.ok_or_else(|| format!("expected a line `{word} {{...}}`, got `{line}`"))?;
            let row = serde_json::from_str(json).map_err(|error| format!("unexpected `{line}`: {error}"))?;
            rows.push((json, row));
        }
        Ok(rows)
    }
}

impl GatewayClient {
    /// Connects. The gateway may take `patience` for each line of an answer.
    pub fn connect(path: &Path, patience: Duration) -> Result<Self, CliError> {
        let shown = path.display();
        let stream = UnixStream::connect(path).map_err(|error| {
            format!("no gateway answers at {shown}: {error}\nstart it with `axisbridge run --config FILE --local {shown}`")
        })?;
        stream.set_read_timeout(Some(patience))?;
        stream.set_write_timeout(Some(patience))?;
        Ok(Self { stream: BufReader::new(stream) })
    }

    /// The connection itself.
    pub fn into_stream(self) -> UnixStream {
        self.stream.into_inner()
    }

    /// Asks for a file, and waits for all its bytes.
    pub fn file(&mut self, request: &str) -> Result<Vec<u8>, CliError> {
        let reply = self.ask(request)?;
        let word = request.split(' ').next().unwrap_or_default();
        let form = format!("ok {word} bytes=N");
        let length = reply.end(word, &form)?.strip_prefix("bytes=").and_then(|text| text.parse().ok());
        let length = length.filter(|length| *length <= FILE_MAX).ok_or_else(|| reply.unexpected(&form))?;
        let mut file = Vec::new();
        let read = self.stream.by_ref().take(length).read_to_end(&mut file);
        read.map_err(|error| format!("the gateway does not send the whole file: {error}"))?;
        let found = u64::try_from(file.len())?;
        if found != length {
            return Err(format!("the file ends after {found} of {length} bytes").into());
        }
        Ok(file)
    }

    /// Sends a request and waits for its reply.
    pub fn ask(&mut self, request: &str) -> Result<Reply, CliError> {
        let sent = self.stream.get_mut().write_all(format!("{request}\n").as_bytes());
        sent.map_err(|error| format!("the gateway is gone: {error}"))?;
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            let read = self.stream.by_ref().take(LINE_MAX).read_line(&mut line);
            let read = read.map_err(|error| format!("the gateway does not answer: {error}"))?;
            if read == 0 {
                return Err("the gateway has closed the connection: at most four clients are let in".into());
            }
            let Some(text) = line.strip_suffix('\n') else {
                return Err("the gateway sends a line without an end".into());
            };
            if text.starts_with("ok ") || text.starts_with("error ") {
                return Ok(Reply { lines, last: text.to_owned() });
            }
            if lines.len() == LINES_MAX {
                return Err("the gateway sends a list without an end".into());
            }
            lines.push(text.to_owned());
        }
    }
}
