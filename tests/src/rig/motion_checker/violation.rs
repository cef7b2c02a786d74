//! What the checker finds.

use std::fmt;

use profile_generic::time::DurationNs;

/// What is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The velocity that the change since the last set-point means is one of the controller's curve.
    Velocity,
    /// So is its acceleration; without a curve it is within the limit of the axis.
    Acceleration,
    /// So is its torque.
    Torque,
    /// A drive begins to follow where it is.
    Begin,
    /// An axis that the gateway holds stands.
    Hold,
    /// The gateway stops an axis by the configured deceleration at most, and never makes it faster.
    Stop,
    /// No set-point is faster than the limit that the configuration sets, with a tenth to spare.
    Limit,
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Torque => "torque",
            Self::Begin => "distance at the begin",
            Self::Hold => "velocity of a held axis",
            Self::Stop => "deceleration of a stop",
            Self::Limit => "velocity against the limit",
        })
    }
}

/// The kind of bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusKind {
    /// SERCOS III.
    Sercos,
    /// CANopen.
    Canopen,
    /// DeviceNet.
    Devicenet,
}

impl fmt::Display for BusKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sercos => "SERCOS",
            Self::Canopen => "CANopen",
            Self::Devicenet => "DeviceNet",
        })
    }
}

/// In which circumstances a set-point came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Circumstances {
    /// The device runs synchronously to the controller.
    pub synchronous: bool,
    /// The longest lateness of the engine in the cycles that the set-point can depend on.
    pub late: DurationNs,
    /// How far the controller's system time is ahead of the gateway's.
    pub offset: DurationNs,
    /// Whether one of the clocks has stepped since the connection was opened.
    pub stepped: bool,
    /// Whether the clocks drift apart.
    pub drifts: bool,
}

/// A set-point that should not have been sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// The rule.
    pub rule: Rule,
    /// The axis, from 0.
    pub axis: usize,
    /// Its bus.
    pub bus: BusKind,
    /// Time since the start of the rig.
    pub at: DurationNs,
    /// Cycle of the bus, since the first one that was seen.
    pub cycle: i64,
    /// The value: units, units per second, units per second squared, or % of the rated torque.
    pub value: f64,
    /// What is allowed.
    pub low: f64,
    /// What is allowed.
    pub high: f64,
    /// How it came.
    pub circumstances: Circumstances,
}

impl Violation {
    const fn unit(&self) -> &'static str {
        match self.rule {
            Rule::Velocity | Rule::Hold | Rule::Limit => "units/s",
            Rule::Acceleration | Rule::Stop => "units/s²",
            Rule::Torque => "%",
            Rule::Begin => "units",
        }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rule, axis, bus, at, cycle, value, low, high, circumstances: c } = self;
        let unit = self.unit();
        write!(f, "{at}: axis {} on {bus}, cycle {cycle}: {rule}: ", axis + 1)?;
        write!(f, "expected {low:.6} to {high:.6} {unit}, got {value:.6}")?;
        let operation = if c.synchronous { "synchronous" } else { "asynchronous" };
        write!(f, " ({operation}, engine late by {}, clocks {} apart)", c.late, c.offset)
    }
}
