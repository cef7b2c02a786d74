//! Which encoders the loops of a drive are closed over.

/// Whose encoder is which for an axis (CIP Volume 9, Table 5-2.34). The drive is set up so by its maker's tool or by the operation mode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum FeedbackUse {
    /// Position and velocity are those of the encoder of the motor.
    #[default]
    Motor,
    /// Both are those of the encoder of the load.
    Load,
    /// The position is that of the encoder of the load, the velocity that of the motor's.
    Dual,
}

impl FeedbackUse {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Motor, Self::Load, Self::Dual];

    /// The name in tables and configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Load => "load",
            Self::Dual => "dual",
        }
    }
}
