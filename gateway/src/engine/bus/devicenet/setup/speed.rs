//! The set-up of a velocity drive.

use super::{Answer, SetupStep, set};
use crate::engine::bus::devicenet::access::read;
use crate::mapping::Attribute;
use crate::mapping::devicenet::speed;

/// `NetCtrl` of the Control Supervisor.
const NET_CONTROL: u16 = 5;

/// `NetRef` of the AC/DC Drive object.
const NET_REFERENCE: u16 = 4;

/// The steps of a velocity drive with this SpeedScale; `extended` is whether its output assembly has bits for control and
/// reference from the network.
#[must_use]
pub fn speed_steps(scale: i8, extended: bool) -> Vec<SetupStep> {
    let attribute = Attribute { class: speed::CLASS_DRIVE, id: speed::SPEED_SCALE };
    let ask = read(attribute).map(|request| SetupStep { attribute, request, answer: Answer::Equals(scale) });
    let mut steps: Vec<_> = ask.into_iter().collect();
    if !extended {
        steps.extend(set(speed::CLASS_SUPERVISOR, NET_CONTROL, &[1]));
        steps.extend(set(speed::CLASS_DRIVE, NET_REFERENCE, &[1]));
    }
    steps
}
