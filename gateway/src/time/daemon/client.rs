//! The client of the management socket.

use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::message::{ANSWER_MAX, Answer, Picture, Question};

/// How long all answers together may take.
const PATIENCE: Duration = Duration::from_millis(200);

/// Asks a daemon; opens its socket anew when that has failed.
#[derive(Debug)]
pub(super) struct Client {
    daemon: PathBuf,
    domain: u8,
    sequence: u16,
    open: Option<(UnixDatagram, Own)>,
}

/// Our own end of the socket in the file system, removed at the end.
#[derive(Debug)]
struct Own(PathBuf);

impl Drop for Own {
    fn drop(&mut self) {
        // Nothing depends on it any more.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Client {
    pub fn new(daemon: &Path, domain: u8) -> Self {
        Self { daemon: daemon.to_owned(), domain, sequence: 0, open: None }
    }

    /// All that the daemon says of itself; `None` when it does not say all.
    pub fn ask(&mut self) -> Option<Picture> {
        if self.open.is_none() {
            self.open = self.connect().ok();
        }
        let (socket, _) = self.open.as_ref()?;
        let mut answers = [None; Question::ALL.len()];
        let end = Instant::now() + PATIENCE;
        for (question, slot) in Question::ALL.into_iter().zip(&mut answers) {
            self.sequence = self.sequence.wrapping_add(1);
            *slot = ask(socket, question, self.domain, self.sequence, end);
            if slot.is_none() {
                break;
            }
        }
        let picture = Picture::of(&answers);
        if picture.is_none() {
            // A daemon that was started anew has another socket.
            self.open = None;
        }
        picture
    }

    /// PairedReading the daemon's socket it can be reached by a daemon with its own `/tmp`.
    fn connect(&self) -> std::io::Result<(UnixDatagram, Own)> {
        let name = format!("axisbridge-ptp-{}", std::process::id());
        let beside = self.daemon.parent().map(|folder| folder.join(&name));
        let temporary = Some(std::env::temp_dir().join(&name));
        let mut failure = std::io::Error::from(std::io::ErrorKind::NotFound);
        for path in beside.into_iter().chain(temporary) {
            let own = Own(path);
            let _ = std::fs::remove_file(&own.0);
            match UnixDatagram::bind(&own.0).and_then(|socket| socket.connect(&self.daemon).map(|()| socket))
            {
                Ok(socket) => return Ok((socket, own)),
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }
}

/// One question and its answer.
fn ask(socket: &UnixDatagram, question: Question, domain: u8, sequence: u16, end: Instant) -> Option<Answer> {
    socket.send(&question.emit(domain, sequence)).ok()?;
    let mut buffer = [0; ANSWER_MAX];
    loop {
        let left = end.checked_duration_since(Instant::now()).filter(|left| !left.is_zero())?;
        socket.set_read_timeout(Some(left)).ok()?;
        let length = socket.recv(&mut buffer).ok()?;
        match Answer::parse(buffer.get(..length)?) {
            Some((number, answer)) if number == sequence => return Some(answer),
            // Of an earlier question, or an error.
            _ => {}
        }
    }
}
