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

    /// Binds a socket beside that of the daemon, so that one with a `/tmp` of its own can answer; else in `/tmp`.
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
    let left = || end.checked_duration_since(Instant::now()).filter(|left| !left.is_zero());
    // A daemon that stands lets its queue fill.
    socket.set_write_timeout(Some(left()?)).ok()?;
    socket.send(&question.emit(domain, sequence)).ok()?;
    let mut buffer = [0; ANSWER_MAX];
    loop {
        socket.set_read_timeout(Some(left()?)).ok()?;
        let length = socket.recv(&mut buffer).ok()?;
        match Answer::parse(buffer.get(..length)?) {
            Some((number, answer)) if number == sequence => return Some(answer),
            // Of an earlier question, or an error.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More questions than any queue of the kernel holds.
    const QUESTIONS: usize = 600;

    #[test]
    fn a_daemon_that_takes_nothing_holds_nobody_up() {
        let folder = std::env::temp_dir().join(format!("axisbridge-ptp-test-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("ptp4l");
        let daemon = UnixDatagram::bind(&path).unwrap();
        let (socket, own) = Client::new(&path, 0).connect().unwrap();
        let mut refused = 0;
        for sequence in 0..QUESTIONS {
            let end = Instant::now() + Duration::from_millis(1);
            let sequence = u16::try_from(sequence).unwrap();
            assert_eq!(ask(&socket, Question::Current, 0, sequence, end), None);
            refused += 1;
        }
        assert_eq!(refused, QUESTIONS);
        drop((daemon, socket, own));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
