//! What goes wrong with a drive: on each kind of bus, for as long as a row says.

use std::collections::BTreeMap;

use axisbridge_tests::rig::ports::TamperCan;
use axisbridge_tests::rig::{Rig, Tamper};
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_generic::can::{Frame, Id};
use profile_generic::fault::FaultCause;
use profile_generic::quantity::Position;
use profile_sercos::master::layout::ConnectionPlace;
use profile_sercos::wire::header::Kind;

use crate::chain::Bus;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// The drive finds a fault.
    Fault(FaultCause),
    /// Main power is gone.
    MainPower,
    /// The drive is not heard.
    Silence,
    /// Its torque is gone without a word.
    TorqueLost,
    /// Its telegrams arrive, and bring what they brought before: nothing else about them is wrong.
    StaleData,
    /// Its position is another one from one value to the next.
    PositionJump,
    /// The same of an axis with a velocity limit: it cannot have gone there.
    PositionJumpWithLimit,
}

impl Trouble {
    /// Its name in a table.
    pub fn name(self) -> String {
        match self {
            Self::Fault(cause) => cause.to_string(),
            Self::MainPower => "main power off".to_owned(),
            Self::Silence => "silence".to_owned(),
            Self::TorqueLost => "torque lost".to_owned(),
            Self::StaleData => "stale data".to_owned(),
            Self::PositionJump => "position jump".to_owned(),
            Self::PositionJumpWithLimit => "position jump, with a limit".to_owned(),
        }
    }

    /// It begins.
    pub fn begin(self, rig: &mut Rig, bus: Bus) {
        match self {
            Self::Silence => silence(rig, bus, true),
            Self::StaleData => stale_data(rig, bus, true),
            Self::MainPower => main_power(rig, bus, false),
            Self::Fault(cause) => servo(rig, bus).raise_fault(cause),
            Self::TorqueLost => servo(rig, bus).lose_torque(),
            Self::PositionJump | Self::PositionJumpWithLimit => {
                let servo = servo(rig, bus);
                let there = servo.position();
                servo.set_position(Position(there.get() + 2_000_000_000));
            }
        }
    }

    /// It is over, if it can be.
    pub fn end(self, rig: &mut Rig, bus: Bus) {
        match self {
            Self::Silence => silence(rig, bus, false),
            Self::StaleData => stale_data(rig, bus, false),
            Self::MainPower => main_power(rig, bus, true),
            Self::Fault(cause) if bus == Bus::Canopen => can_axis(rig).recover(cause),
            Self::Fault(cause) => servo(rig, bus).recover(cause),
            Self::TorqueLost | Self::PositionJump | Self::PositionJumpWithLimit => {}
        }
    }
}

fn main_power(rig: &mut Rig, bus: Bus, on: bool) {
    match bus {
        Bus::Sercos => rig.drive_mut(0).set_main_power(on),
        Bus::Canopen => can_axis(rig).set_main_power(on),
        Bus::Devicenet => devicenet(rig).set_main_power(on),
    }
}

fn can_axis(rig: &mut Rig) -> &mut profile_cia402::node::drive::Axis {
    let node = rig.can[0].bus.nodes_mut().next().expect("the drive");
    &mut node.application_mut().axes_mut()[0]
}

fn devicenet(rig: &mut Rig) -> &mut axisbridge::simulate::devicenet_drive::DevicenetNode {
    rig.devicenet[0].bus.nodes_mut().next().expect("the drive")
}

fn servo(rig: &mut Rig, bus: Bus) -> &mut profile_generic::servo::Servo {
    match bus {
        Bus::Sercos => rig.drive_mut(0).servo_mut(),
        Bus::Canopen => can_axis(rig).servo_mut(),
        Bus::Devicenet => devicenet(rig).servo_mut(),
    }
}

fn silence(rig: &mut Rig, bus: Bus, begins: bool) {
    let now = rig.now();
    match bus {
        Bus::Sercos => rig.cable = !begins,
        Bus::Canopen => rig.can[0].bus.connect(now, 0, !begins),
        Bus::Devicenet => rig.devicenet[0].bus.connect(now, 0, !begins),
    }
}

/// SERCOS: C-CON and the values of its connection stand still, while the drive's service channel and device status go on. CANopen:
/// its TPDO stays away, while heartbeats and SDO go on. DeviceNet: it answers each poll with the update of before.
fn stale_data(rig: &mut Rig, bus: Bus, begins: bool) {
    match bus {
        Bus::Sercos => {
            let place = produced(rig);
            rig.tamper_frame = begins.then(|| standing_still(place));
        }
        Bus::Canopen => {
            let tpdo = Id::Standard(0x181);
            rig.can[0].tamper = begins.then(|| -> TamperCan { Box::new(move |_, frame| frame.id() != tpdo) });
        }
        Bus::Devicenet => rig.devicenet[0].tamper = begins.then(repeating),
    }
}

/// Where the drive's connection is in its AT.
fn produced(rig: &Rig) -> ConnectionPlace {
    let slave = rig.sercos().master().layout().slaves[0].as_ref().expect("it takes part");
    *slave.connections.iter().find(|place| place.kind == Kind::At).expect("it produces")
}

fn standing_still(place: ConnectionPlace) -> Tamper {
    /// Ethernet header and the header of the telegram, whose first byte has its type and number.
    const DATA: usize = 20;
    const TYPE: usize = 14;
    let at = DATA + usize::from(place.at.offset);
    let mut first = None;
    Box::new(move |frame| {
        let bytes = frame.as_mut_slice();
        let is_at = bytes[TYPE] & 0x40 != 0 && bytes[TYPE] & 0x0F == place.at.telegram;
        if let Some(values) = bytes.get_mut(at..at + usize::from(place.len)).filter(|_| is_at) {
            let first = first.get_or_insert_with(|| values.to_vec());
            values.copy_from_slice(first);
        }
        true
    })
}

/// Every fragment of an answer is the one of the first answer that has its number.
fn repeating() -> TamperCan {
    let of = Identifier::PollResponse(MacId::new(5).expect("a MAC ID")).can();
    let mut first = BTreeMap::<u8, Vec<u8>>::new();
    Box::new(move |_, frame| {
        if frame.id() == of
            && let Some(fragment) = frame.data().first()
        {
            let kept = first.entry(*fragment).or_insert_with(|| frame.data().to_vec());
            *frame = Frame::new(of, kept).expect("as long as it was");
        }
        true
    })
}
