//! Why a slave does not come in.

use super::fit::Misfit;

/// Why a slave does not come in by hot plug. The others go on, and except for a closed ring it is tried again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum HotPlugRefusal {
    /// There is no hot plug in a closed ring. It goes on where the ring is open.
    #[error("the ring is closed; it can be plugged in only at the end of a line")]
    RingClosed,
    /// The master has storage for so many slaves, and they are all there.
    #[error("the master has no room for another slave")]
    NoPlace,
    /// Something is plugged in at the end of a line, and no telegram comes back from it.
    #[error(
        "something is plugged in at the end of the line and does not turn telegrams round: it hangs or has no SCP_HP, and \
         stays out until the next scan (CP0)"
    )]
    NoTelegram,
    /// The slave in front of it does not pass telegrams on.
    #[error("the slave upstream of it does not follow the command")]
    Opening,
    /// It does not answer in the hot-plug field.
    #[error("it does not answer in HP1")]
    Silent,
    /// It has no SERCOS address.
    #[error("it has no SERCOS address")]
    NoAddress,
    /// The scan failed in the slave.
    #[error("it answers the scan of HP1 with error {code}")]
    Scan {
        /// The code in the answer of the slave.
        code: u8,
    },
    /// Its address is not one of those for which a place is kept.
    #[error("its address is not configured for hot plug")]
    Unknown,
    /// Another slave with this address takes part.
    #[error("another slave with its address takes part")]
    Duplicate,
    /// It is a device with several slaves.
    #[error("it is a device with several slaves; such devices come in with the next scan (CP0) only")]
    Several,
    /// It does not take the place of its service channel.
    #[error("it does not accept the place of its service channel ({code:#04x})")]
    Offset {
        /// The parameter: 0x80 in the MDT, 0x81 in the AT.
        code: u8,
    },
    /// The service channel does not take over.
    #[error("its service channel does not begin")]
    Switch,
    /// A step of HP2 failed; an event before names it.
    #[error("it cannot be set up")]
    SetUp,
    /// It needs more than was kept for it.
    #[error(transparent)]
    Misfit(#[from] Misfit),
    /// The application does not want it.
    #[error("the application left it out")]
    Application,
    /// It does not become valid after S-0-0128.
    #[error("it does not become valid in CP4")]
    NotValid,
    /// It has gone again, or the line in front of it has.
    #[error("it has gone again")]
    Gone,
    /// Since it is let in, slaves in front of it are not seen.
    #[error("telegrams do not come back past it")]
    Blind,
    /// Behind it telegrams are turned round though hot plug is off: another slave has come in on its telegrams.
    #[error("another slave downstream of it has taken over its address or its telegrams")]
    Shadow,
    /// At the end of a line telegrams are turned round though hot plug is off.
    #[error("a slave at the end of the line turns telegrams round though hot plug is off; unplug it")]
    Occupied,
}
