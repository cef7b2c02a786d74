//! When a control word enables, stops, starts and resets: the state of the handshake with a controller, for one axis.
//!
//! ```text
//!                 ENABLE is 0                      ENABLE becomes 1, no fault
//!   +--------+ ----------------------> +-------+ ----------------------------> +---------+
//!   | Locked |                         | Armed |                               | Enabled |
//!   +--------+ <---------------------- +-------+ <---------------------------- +---------+
//!       ^       idle, lost, reserved               ENABLE is 0: stop, torque off    |
//!       |       bits, RESET with ENABLE                                             |
//!       +---------------------------------------------------------------------------+
//!           idle, lost: stop as configured for a lost command
//!           fault: the axis stops by itself; reserved bits: stop, torque off
//! ```
//!
//! - Nothing is enabled by a level: after a connection was opened, after idle, and after a fault, ENABLE has to be 0 in run
//!   before it counts. So nothing moves on a reconnection.
//! - START and RESET count when they become 1; both have to be 0 in run first.
//! - STOP wins over START. ENABLE with RESET only resets.

use bitflags::bitflags;

bitflags! {
    /// The control word.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Control: u16 {
        /// Torque, from a rising edge on.
        const ENABLE = 1 << 0;
        /// Brake to standstill with torque; no movement starts.
        const STOP = 1 << 1;
        /// A rising edge starts a movement to the target.
        const START = 1 << 2;
        /// A rising edge resets faults.
        const RESET = 1 << 3;
        /// The target counts from the position set-point at the start.
        const RELATIVE = 1 << 4;
        // Bits above are reserved.
        const _ = !0;
    }
}

impl Control {
    const KNOWN: u16 = 0x1F;

    /// Whether a reserved bit is set.
    #[must_use]
    pub const fn has_reserved(self) -> bool {
        self.bits() & !Self::KNOWN != 0
    }
}

bitflags! {
    /// The status word.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Status: u16 {
        /// The axis can be enabled.
        const READY = 1 << 0;
        /// The axis is in operation and follows.
        const ENABLED = 1 << 1;
        /// The axis has a fault.
        const FAULT = 1 << 2;
        /// A movement goes on.
        const MOVING = 1 << 3;
        /// The last movement that was started has reached its target.
        const DONE = 1 << 4;
        /// The last START was taken; it ends when START is 0.
        const START_TAKEN = 1 << 5;
        /// The last order was refused.
        const REFUSED = 1 << 6;
        /// ENABLE has to be 0 before it counts.
        const LOCKED = 1 << 7;
        /// A controller owns the axis and is in run.
        const RUN = 1 << 8;
        /// Somebody else controls the axis.
        const HELD = 1 << 9;
        /// The axis stands.
        const STANDSTILL = 1 << 10;
        /// A value does not fit its field, which holds the nearest one.
        const SATURATED = 1 << 11;
        /// System time is synchronized: stamps count.
        const SYNCHRONIZED = 1 << 12;
        /// The drive warns.
        const WARNING = 1 << 13;
        /// The drive may have torque.
        const TORQUE = 1 << 14;
        /// Changes with every set of actual values.
        const TOGGLE = 1 << 15;
    }
}

/// The connection of the owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Link {
    /// There is none.
    Lost,
    /// The controller is idle: its data do not count.
    Idle,
    /// The controller runs.
    Run,
}

/// State of the handshake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, PartialOrd, Ord)]
pub enum State {
    /// ENABLE has to be 0 in run before it counts.
    #[default]
    Locked,
    /// A rising edge of ENABLE enables.
    Armed,
    /// Torque is wanted.
    Enabled,
}

bitflags! {
    /// What follows from a control word. At most one of ENABLE, DISABLE and LOSE.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Reaction: u8 {
        /// Enable the axis.
        const ENABLE = 1 << 0;
        /// Stop as configured for a disable, and take the torque away.
        const DISABLE = 1 << 1;
        /// Stop as configured for a lost command.
        const LOSE = 1 << 2;
        /// Reset faults.
        const RESET = 1 << 3;
        /// Start a movement.
        const START = 1 << 4;
        /// Brake to standstill, and stay there.
        const HALT = 1 << 5;
    }
}

profile_generic::open_code! {
    /// Why an order was refused.
    pub struct Refusal(u8) {
        /// It was not.
        NONE = 0 => "none",
        /// A reserved bit of the control word is set.
        RESERVED_BITS = 1 => "reserved bits",
        /// START without ENABLE, or before the axis is in operation.
        NOT_ENABLED = 2 => "not enabled",
        /// START with STOP.
        STOP_WINS = 3 => "stop wins",
        /// ENABLE with RESET.
        RESET_WINS = 4 => "reset wins",
        /// ENABLE while the axis has a fault.
        FAULT = 5 => "fault",
        /// Run forward with run reverse.
        BOTH_DIRECTIONS = 6 => "both directions",
        /// The mode is not known, or the drive is not set up for it.
        MODE = 7 => "mode",
        /// The target is beyond a limit of the axis.
        BEYOND_LIMIT = 8 => "beyond limit",
        /// The velocity is above the limit of the axis.
        TOO_FAST = 9 => "too fast",
        /// The acceleration is above the limit of the axis.
        TOO_STEEP = 10 => "too steep",
        /// Velocity is zero or negative, or there is no acceleration.
        NOT_POSITIVE = 11 => "not positive",
        /// Somebody else controls the axis, or the gateway ends.
        HELD = 12 => "held",
        /// The data have the wrong number of bytes.
        SIZE = 13 => "wrong size",
        /// A value cannot be expressed in the units of the axis.
        VALUE = 14 => "value out of range",
        /// The axis did not become ready in time.
        NOT_READY = 15 => "not ready",
    }
}

/// What is known of the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Axis {
    /// It has a fault.
    pub faulted: bool,
    /// It is in operation and follows.
    pub operating: bool,
}

/// The handshake of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Handshake {
    state: State,
    /// Bits that have to be 0 before they count again.
    spent: Control,
}

impl Default for Handshake {
    fn default() -> Self {
        Self { state: State::Locked, spent: Control::all() }
    }
}

impl Handshake {
    /// Its state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Takes the state of the connection, the control word of the controller, and how the axis is. Call it in every cycle:
    /// the same values twice have no second effect.
    ///
    /// Returns what is to be done, and why an order was refused. A refusal is reported once, when it happens.
    pub fn step(&mut self, link: Link, word: Control, axis: Axis) -> (Reaction, Refusal) {
        if link != Link::Run {
            return (self.fall(Reaction::LOSE), Refusal::NONE);
        }
        if word.has_reserved() {
            let news = self.spent != Control::all();
            let refusal = if news { Refusal::RESERVED_BITS } else { Refusal::NONE };
            return (self.fall(Reaction::DISABLE), refusal);
        }
        let rising = word - self.spent;
        self.spent = word;
        let (mut reaction, refusal) = self.enable(word, axis.faulted);
        reaction.set(Reaction::RESET, rising.contains(Control::RESET) && self.state != State::Enabled);
        reaction.set(Reaction::HALT, word.contains(Control::STOP) && self.state == State::Enabled);
        if refusal != Refusal::NONE || !rising.contains(Control::START) {
            return (reaction, refusal);
        }
        let refusal = self.refusal_of_start(word, axis.operating);
        reaction.set(Reaction::START, refusal == Refusal::NONE);
        (reaction, refusal)
    }

    /// Everything has to be 0 before it counts again; `reaction` if the axis was enabled.
    fn fall(&mut self, reaction: Reaction) -> Reaction {
        let before = core::mem::take(self);
        if before.state == State::Enabled { reaction } else { Reaction::empty() }
    }

    /// What ENABLE does, and ends.
    fn enable(&mut self, word: Control, faulted: bool) -> (Reaction, Refusal) {
        if self.state == State::Enabled && faulted {
            self.state = State::Locked;
        }
        let (next, reaction, refusal) = match (self.state, word.contains(Control::ENABLE)) {
            (State::Enabled, false) => (State::Armed, Reaction::DISABLE, Refusal::NONE),
            (State::Locked, false) => (State::Armed, Reaction::empty(), Refusal::NONE),
            (State::Armed, true) if word.contains(Control::RESET) => {
                (State::Locked, Reaction::empty(), Refusal::RESET_WINS)
            }
            (State::Armed, true) if faulted => (State::Locked, Reaction::empty(), Refusal::FAULT),
            (State::Armed, true) => (State::Enabled, Reaction::ENABLE, Refusal::NONE),
            (state @ (State::Enabled | State::Locked), true) | (state @ State::Armed, false) => {
                (state, Reaction::empty(), Refusal::NONE)
            }
        };
        self.state = next;
        (reaction, refusal)
    }

    /// Why a START that became 1 starts nothing.
    fn refusal_of_start(&self, word: Control, operating: bool) -> Refusal {
        if self.state != State::Enabled || !operating {
            Refusal::NOT_ENABLED
        } else if word.contains(Control::STOP) {
            Refusal::STOP_WINS
        } else {
            Refusal::NONE
        }
    }

    /// The axis could not be enabled: ENABLE has to be 0 before it counts again.
    pub fn lock(&mut self) {
        self.state = State::Locked;
    }
}
