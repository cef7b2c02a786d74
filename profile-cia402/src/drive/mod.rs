//! The drive profile CiA 402: what stands in its words, for the master and for the simulated drive.
//!
//! * [`controlword`], [`statusword`], [`states`]: 6040h, 6041h and the state machine between them.
//! * [`modes`], [`options`], [`homing`], [`probe`], [`polarity`], [`period`]: the other coded objects.
//! * [`errors`]: error codes, 603Fh and emergency messages.
//! * [`index`]: numbers of the objects.
//!
//! CiA 402 and IEC 61800-7-201 are not public. Where implementations and vendor manuals disagree the file says so.

pub mod controlword;
pub mod errors;
pub mod homing;
pub mod index;
pub mod modes;
pub mod options;
pub mod period;
pub mod polarity;
pub mod probe;
pub mod states;
pub mod statusword;

pub use self::controlword::Controlword;
pub use self::errors::ErrorCode;
pub use self::modes::Mode;
pub use self::states::State;
pub use self::statusword::Statusword;
