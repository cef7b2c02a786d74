//! Reset of the Identity object: who asked, and what became of it.
//!
//! A restart takes power and command from every axis, so the motion device is asked first. It refuses while a
//! connection is open or an axis is energized. From the question on nothing is opened any more: what was granted for
//! axes at rest must not happen to axes that were enabled in between.
//!
//! | state | Reset | Forward_Open of the motion connection | granted | refused | device silent |
//! |---|---|---|---|---|---|
//! | None | Asked | | | | |
//! | Asked | refused 0x10 | refused 0x10 | Granted, the application is told | None | None |
//! | Granted | refused 0x0B | refused 0x10 | | | |

use core::net::SocketAddrV4;

use profile_generic::time::MonotonicTime;

use super::adapter::DEVICE_TIMEOUT;
use super::node::{Await, AwaitKind, Node, Origin, Step};
use crate::device::connection::manager::Asked;
use crate::device::connection::refusal::Refusal;
use crate::device::event::{Event, ResetKind};
use crate::device::motion_link::{MotionReply, MotionRequest};
use crate::device::objects::identity;
use crate::device::objects::object::Answer;
use crate::wire::status::{GeneralStatus, Service};

/// A reset on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Reset {
    #[default]
    None,
    Asked {
        asked: Asked,
        kind: ResetKind,
        originator: SocketAddrV4,
    },
    Granted,
}

impl Node {
    /// Runs the service.
    pub fn reset(&mut self, origin: &Origin, data: &[u8]) -> Step {
        match self.ask_for_reset(origin, data) {
            Ok(awaited) => Step::Await(awaited),
            Err(status) => self.refuse(Service::RESET, status),
        }
    }

    fn ask_for_reset(&mut self, origin: &Origin, data: &[u8]) -> Result<Await, GeneralStatus> {
        let kind = identity::reset_kind(data)?;
        match self.reset {
            Reset::None => {}
            Reset::Asked { .. } => return Err(GeneralStatus::DEVICE_STATE_CONFLICT),
            Reset::Granted => return Err(GeneralStatus::ALREADY_IN_STATE),
        }
        if self.connections.motion.parameters().is_some() {
            return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
        }
        let token = self.new_token();
        self.ask(MotionRequest::PrepareReset(token))?;
        let asked = Asked { token, deadline: origin.now + DEVICE_TIMEOUT };
        self.reset = Reset::Asked { asked, kind, originator: origin.peer };
        Ok(Await { token, service: Service::RESET, kind: AwaitKind::Reset })
    }

    /// Takes note of the device's answer, whether or not the requester still waits for it.
    pub fn note_reset(&mut self, reply: &MotionReply) {
        let (MotionReply::ResetPrepared { token, granted }, Reset::Asked { asked, kind, originator }) =
            (reply, self.reset)
        else {
            return;
        };
        if *token != asked.token {
            return;
        }
        self.reset = if *granted { Reset::Granted } else { Reset::None };
        if *granted {
            self.tell(Event::Reset { kind, originator });
        }
    }

    /// Gives up waiting for the device. It never grants later what nobody waits for.
    pub fn expire_reset(&mut self, now: MonotonicTime) {
        if self.reset_deadline().is_some_and(|deadline| deadline <= now) {
            self.reset = Reset::None;
        }
    }

    pub fn reset_deadline(&self) -> Option<MonotonicTime> {
        match self.reset {
            Reset::Asked { asked, .. } => Some(asked.deadline),
            Reset::None | Reset::Granted => None,
        }
    }

    /// Fails while a reset is on its way.
    pub fn check_reset(&self) -> Result<(), Refusal> {
        match self.reset {
            Reset::None => Ok(()),
            Reset::Asked { .. } | Reset::Granted => {
                Err(Refusal::new(GeneralStatus::DEVICE_STATE_CONFLICT, 0))
            }
        }
    }
}

/// The answer once the device has decided.
pub(crate) fn prepared(granted: bool) -> Answer {
    if granted { Answer::done(Vec::new()) } else { Answer::status(GeneralStatus::DEVICE_STATE_CONFLICT) }
}
