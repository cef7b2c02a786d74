//! How a device comes up (CiA 302-2), and what can be wrong with it.
//!
//! ```text
//! Off --> Resetting --> Identify --> Program --> Configure --> Await --> Map --> Control --> Ready --> Starting --> Operational
//!                        |  ^   \________________________________^        |        |                      |            |
//!              no answer |  |      operational already                     +--------+------- Failed <------+            |
//!                        v  |                                                                 ^                        |
//!                       Retry -------- boot time over -----------------------------------------+        Lost <---------+
//!
//! Program --another program was downloaded and started--> Identify
//!
//! every state but Off and Resetting --boot-up--> Identify       Lost --after a while--> Resetting       every state --> Off
//! ```
//!
//! `Await` is where the application works. `Map` configures the PDOs, `Control` the heartbeats, and `Ready` waits for the others
//! if all shall start together.

pub use crate::generated::codes::BootStatus;
use core::fmt;

/// Where a device is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BootState {
    /// The master does not run, or has stopped the device.
    Off,
    /// Reset communication was sent; its boot-up message is awaited.
    Resetting,
    /// Device type and identity are read.
    Identify,
    /// It did not answer; it is asked again after a while.
    Retry,
    /// The program is compared, and downloaded where that is permitted.
    Program,
    /// The configuration is compared and written.
    Configure,
    /// The application works.
    Await,
    /// SYNC and PDO parameters are written and read back.
    Map,
    /// Heartbeats are set up.
    Control,
    /// All is set up.
    Ready,
    /// NMT start was sent.
    Starting,
    /// In operation.
    Operational,
    /// It was in operation, and its heartbeat is gone or tells another state.
    Lost,
    /// It does not come up, for a reason that was told. A boot-up message starts it again.
    Failed,
}

/// What moves a device on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BootEvent {
    /// The master starts, or the application wants another try.
    Start,
    /// The master or the application stops the device.
    Stop,
    /// The device's boot-up message.
    BootUp,
    /// The time of the state has run out.
    Elapsed,
    /// The steps of the state are done.
    Done,
    /// The device is the right one and in operation, which it may keep.
    Kept,
    /// The device does not answer.
    NoAnswer,
    /// A step failed.
    Failed,
    /// The application is through, the start is permitted, or a new program runs.
    Proceed,
    /// The heartbeat is gone or tells another state, or the bus is off.
    Lost,
}

impl BootState {
    /// All states.
    pub const ALL: [Self; 14] = [
        Self::Off,
        Self::Resetting,
        Self::Identify,
        Self::Retry,
        Self::Program,
        Self::Configure,
        Self::Await,
        Self::Map,
        Self::Control,
        Self::Ready,
        Self::Starting,
        Self::Operational,
        Self::Lost,
        Self::Failed,
    ];

    /// The state after `event`; `None` when it means nothing here.
    #[must_use]
    // Flat: the table above, one arm per row.
    pub const fn next(self, event: BootEvent) -> Option<Self> {
        use BootEvent as E;
        use BootState as S;
        Some(match (self, event) {
            (S::Off, E::Stop) => return None,
            (_, E::Stop) => S::Off,
            (S::Off | S::Failed | S::Lost | S::Retry, E::Start) => S::Resetting,
            (S::Off, _) => return None,
            (_, E::BootUp) => S::Identify,
            (S::Resetting | S::Retry, E::Elapsed) => S::Identify,
            (S::Identify, E::NoAnswer) => S::Retry,
            (S::Identify, E::Done) => S::Program,
            (S::Program, E::Done) => S::Configure,
            (S::Program, E::Proceed) => S::Identify,
            (S::Identify, E::Kept) => S::Await,
            (S::Configure, E::Done) => S::Await,
            (S::Await, E::Proceed) => S::Map,
            (S::Map, E::Done) => S::Control,
            (S::Control, E::Done) => S::Ready,
            (S::Ready, E::Proceed) => S::Starting,
            (S::Starting, E::Done) => S::Operational,
            (S::Ready | S::Starting | S::Operational, E::Lost) => S::Lost,
            (S::Lost, E::Elapsed) => S::Resetting,
            (S::Lost | S::Failed, E::Failed) => return None,
            (_, E::Failed) => S::Failed,
            _ => return None,
        })
    }

    /// Whether the application's requests are carried.
    #[must_use]
    pub const fn serves(self) -> bool {
        matches!(
            self,
            Self::Await | Self::Map | Self::Control | Self::Ready | Self::Starting | Self::Operational
        )
    }

    /// Whether nothing is asked of the device.
    #[must_use]
    pub const fn is_out(self) -> bool {
        matches!(self, Self::Off | Self::Lost | Self::Failed)
    }

    /// Whether the heartbeat is watched.
    #[must_use]
    pub const fn supervises(self) -> bool {
        matches!(self, Self::Ready | Self::Starting | Self::Operational)
    }
}

impl fmt::Display for BootState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Off => "off",
            Self::Resetting => "resetting",
            Self::Identify => "identify",
            Self::Retry => "retry",
            Self::Program => "program",
            Self::Configure => "configure",
            Self::Await => "await",
            Self::Map => "map",
            Self::Control => "control",
            Self::Ready => "ready",
            Self::Starting => "starting",
            Self::Operational => "operational",
            Self::Lost => "lost",
            Self::Failed => "failed",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_table() {
        use BootEvent::*;
        let events = [Start, Stop, BootUp, Elapsed, Done, Kept, NoAnswer, Failed, Proceed, Lost];
        let mut table = String::new();
        for state in BootState::ALL {
            for event in events {
                let next = state.next(event).map_or("-".to_string(), |next| next.to_string());
                table += &format!("{state:<11} {:<8} {next}\n", format!("{event:?}"));
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn statuses_are_the_letters_a_to_o() {
        let letters: String = BootStatus::NAMED.iter().map(|(status, _)| char::from(status.0)).collect();
        assert_eq!(letters, "ABCDEFGHIJKLMNO");
        for (status, name) in BootStatus::NAMED {
            assert!(name.starts_with(&format!("{}: ", char::from(status.0))));
        }
    }
}
