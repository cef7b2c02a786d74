//! What is kept of one start-up of a controller's connection.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The start-up of a connection, or a refused attempt to open one.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Its number, from 1; it goes on after a restart where contacts are kept in files.
    pub number: u64,
    /// When the connection was opened or refused: UTC, RFC 3339. Of several attempts, the first one.
    pub time: String,
    /// The device of the gateway.
    pub device: String,
    /// Address and port of the controller.
    pub peer: String,
    /// `motion`, the role of a connection to assemblies, or `refused`.
    pub kind: String,
    /// The connection by the numbers of its Forward_Open, and what is known of it.
    pub connection: String,
    /// Attempts of this controller that were refused for the same reason; 1 for a connection that was opened.
    pub attempts: u32,
    /// When the last of them was: UTC, RFC 3339.
    pub last: String,
    /// The phases that were reached, in the order in which that happened.
    pub phases: Vec<PhaseReached>,
    /// Requests that were refused, in the order of their first time.
    pub refused: Vec<RefusedService>,
    /// Refused requests that are not in the list, which is full.
    pub refused_left_out: u32,
    /// What is awaited now; empty once an axis runs, and after the end.
    pub awaited: Vec<String>,
    /// How the connection ended; without it the connection is open.
    pub end: Option<ContactEnd>,
    /// Frames of its first ten seconds that are kept.
    pub frames: u64,
    /// Frames of its first ten seconds for which there was no room.
    pub frames_left_out: u64,
}

/// A phase of a start-up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseReached {
    /// Which one.
    pub phase: Phase,
    /// Time since the connection was opened, milliseconds.
    pub after_ms: u64,
}

/// The phases of a start-up in their usual order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The Forward_Open was accepted.
    ForwardOpen,
    /// A first service that configures an axis was answered with success.
    Configuration,
    /// Group_Sync was answered: the device is synchronized.
    GroupSync,
    /// Updates are exchanged synchronously.
    Synchronous,
    /// An axis runs for the first time.
    FirstEnable,
}

impl Phase {
    /// All of a CIP Motion connection.
    pub const ALL: [Self; 5] =
        [Self::ForwardOpen, Self::Configuration, Self::GroupSync, Self::Synchronous, Self::FirstEnable];

    /// As people read it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ForwardOpen => "Forward_Open",
            Self::Configuration => "configuration services",
            Self::GroupSync => "group sync",
            Self::Synchronous => "synchronous operation",
            Self::FirstEnable => "first enable",
        }
    }

    /// What is awaited until it is reached.
    #[must_use]
    pub const fn awaited(self) -> &'static str {
        match self {
            Self::ForwardOpen => "the Forward_Open of the controller",
            Self::Configuration => "the first service of the controller that configures an axis",
            Self::GroupSync => "a Group_Sync of the controller that finds the device synchronized",
            Self::Synchronous => "synchronous operation, which the controller requests in its updates",
            Self::FirstEnable => "a request of the controller to enable an axis",
        }
    }
}

/// A request that was refused.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RefusedService {
    /// Time of the first one since the connection was opened, milliseconds.
    pub after_ms: u64,
    /// The service, with the axis or attribute where it is about one.
    pub service: String,
    /// Status and reason.
    pub reason: String,
    /// How often it was refused for this reason.
    pub count: u32,
}

/// How a connection ended.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactEnd {
    /// Time since it was opened, milliseconds; unknown if the gateway ended first.
    pub after_ms: Option<u64>,
    /// By what.
    pub by: String,
}
