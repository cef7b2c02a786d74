//! What stands behind the communication of a slave.

use profile_generic::time::MonotonicTime;

use super::super::connection::{Change, Connection, ConnectionKind, ConnectionSetup};
use super::super::fragmentation::{Body, IoData};
use super::super::wire::explicit::NO_ADDITIONAL_CODE;
use super::super::wire::{MacId, Request};
use crate::device::event::ResetKind;
use crate::device::objects::identity::Health;
use crate::wire::status::GeneralStatus;

/// Why a service is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceError {
    /// General status, not success.
    pub status: GeneralStatus,
    /// Additional code; [`NO_ADDITIONAL_CODE`] for nothing more.
    pub additional: u8,
}

impl From<GeneralStatus> for ServiceError {
    fn from(status: GeneralStatus) -> Self {
        Self { status, additional: NO_ADDITIONAL_CODE }
    }
}

/// The device profile of a slave: its objects and the data of its I/O connections.
///
/// No method may block.
pub trait Application {
    /// What a connection of this kind carries; `None` where there is none. The answer does not change.
    fn setup(&self, kind: ConnectionKind) -> Option<ConnectionSetup>;

    /// Paths to what a connection produces and consumes, attributes 14 and 16.
    fn paths(&self, kind: ConnectionKind) -> (&[u8], &[u8]);

    /// Class codes of the objects here.
    fn classes(&self) -> &[u16];

    /// Carries out a service of one of those objects; data of the response are appended to `reply`.
    ///
    /// # Errors
    /// It is refused; what is in `reply` does not count.
    fn serve(
        &mut self,
        now: MonotonicTime,
        originator: MacId,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError>;

    /// A whole message of an established connection. Without data it says that the master is idle and commands nothing.
    fn consume(&mut self, now: MonotonicTime, kind: ConnectionKind, data: &[u8]);

    /// Fills in what a connection produces; `data` comes empty.
    fn produce(&mut self, now: MonotonicTime, kind: ConnectionKind, data: &mut IoData);

    /// Whether something has changed that a change of state connection has to tell; once for every change.
    fn take_change(&mut self) -> bool;

    /// The state of a connection has changed, or its expected packet rate; then `change` has the same state twice. Whatever
    /// it commanded does not stand any more unless it is established.
    fn connection_changed(
        &mut self,
        now: MonotonicTime,
        connection: &Connection,
        change: Change,
        master: MacId,
    );

    /// Lets time pass.
    fn handle_time(&mut self, now: MonotonicTime);

    /// When [`Application::handle_time`] has something to do.
    fn wake_at(&self) -> Option<MonotonicTime>;

    /// How the device is, for the Identity object.
    fn health(&self) -> Health;

    /// Whether the device may be started anew now, by the Reset service of the Identity object.
    fn permits_reset(&mut self, now: MonotonicTime) -> bool;

    /// The device starts anew, with what it keeps or with the values of its maker.
    fn reset(&mut self, kind: ResetKind);
}
