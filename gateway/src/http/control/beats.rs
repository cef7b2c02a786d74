//! The beats of the gateway, and how old the messages are that answer them.

use std::time::Duration;

use tokio::time::Instant;

/// A message whose beat was sent longer ago is late.
const FRESH: Duration = Duration::from_millis(300);

/// Beats that are kept: those of more than [`FRESH`].
const KEPT: usize = 8;

/// How old a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Age {
    /// Its beat was sent lately.
    Fresh,
    /// Its beat was sent too long ago, or never.
    Late,
}

/// The last beats.
#[derive(Debug, Default)]
pub struct Beats {
    last: u64,
    sent: [Option<(u64, Instant)>; KEPT],
}

impl Beats {
    /// The next beat, as it is sent.
    pub fn next(&mut self, now: Instant) -> String {
        self.last += 1;
        self.sent.rotate_right(1);
        self.sent[0] = Some((self.last, now));
        format!("beat {}", self.last)
    }

    /// Takes a message apart: how old it is, and its line.
    pub fn age<'m>(&self, now: Instant, message: &'m str) -> (Age, &'m str) {
        let (number, line) = message.split_once(' ').unwrap_or((message, ""));
        // Without a number all of it is the line.
        let is_number = !number.is_empty() && number.bytes().all(|digit| digit.is_ascii_digit());
        let Some(number) = Some(number).filter(|_| is_number).and_then(|number| number.parse::<u64>().ok())
        else {
            return (Age::Late, message);
        };
        let sent = self.sent.iter().flatten().find(|(known, _)| *known == number);
        match sent {
            Some((_, at)) if now.duration_since(*at) <= FRESH => (Age::Fresh, line),
            _ => (Age::Late, line),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_is_fresh_while_its_beat_was_sent_lately() {
        let (mut beats, now) = (Beats::default(), Instant::now());
        let at = |millis| now + Duration::from_millis(millis);
        assert_eq!(beats.age(now, "1 stop x"), (Age::Late, "stop x"), "no beat was sent");
        assert_eq!(beats.next(now), "beat 1");
        assert_eq!(beats.age(at(300), "1 jog x 1"), (Age::Fresh, "jog x 1"));
        assert_eq!(beats.age(at(301), "1 jog x 1"), (Age::Late, "jog x 1"));
        assert_eq!(beats.age(now, "2 jog x 1"), (Age::Late, "jog x 1"), "not sent yet");
        for number in 2..=9 {
            assert_eq!(beats.next(at(number)), format!("beat {number}"));
        }
        assert_eq!(beats.age(at(9), "9 jog x 1").0, Age::Fresh);
        assert_eq!(beats.age(at(9), "2 jog x 1").0, Age::Fresh);
        assert_eq!(beats.age(at(9), "1 jog x 1").0, Age::Late, "forgotten");
        for message in ["jog x 1", "", "-1 jog x 1", "+9 jog x 1", "99999999999999999999999 jog x 1"] {
            assert_eq!(beats.age(at(9), message).0, Age::Late, "{message}");
        }
        assert_eq!(beats.age(at(9), "stop x"), (Age::Late, "stop x"));
        assert_eq!(beats.age(at(9), "9"), (Age::Fresh, ""));
    }
}
