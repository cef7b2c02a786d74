//! A drive is not heard for a while: how soon its axis is stopped for it, and how soon it is usable when it is heard again, on each
//! bus. The turntable turns in velocity control; the slide is on a long way beside it and is not to notice anything.

use std::cell::Cell;
use std::fmt::Write as _;
use std::rc::Rc;

use axisbridge::engine::axis::SILENCE_TIME_OUT;
use axisbridge::simulate::drives::hot_plug_drives;
use axisbridge_tests::rig::motion::{NANO, both, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_cip::wire::class1::CLASS1_HEADER_LEN;
use profile_cip::wire::motion::codes::{AxisControl, AxisStateCode};
use profile_cip::wire::motion::{ActualFrame, CommandFrame, CommandInstance};
use profile_generic::can::Id;
use profile_generic::fault::FaultCause;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{DriveState, Report};
use profile_generic::time::MonotonicTime;
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, Phase};

use super::beside::connect;

const CAN: &str = include_str!("can.toml");
const DEVICENET: &str = include_str!("devicenet.toml");

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Loss {
    /// Its part of the ATs comes back empty; it hears every MDT.
    SercosData,
    /// The cable in front of it is cut; it can come back by hot plug.
    SercosCable,
    /// Its TPDO does not arrive; it hears every RPDO.
    CanopenTpdo,
    /// Its plug is pulled.
    CanopenPlug,
    /// Its answers to polls do not arrive; it hears every poll.
    DevicenetAnswers,
    /// Its plug is pulled.
    DevicenetPlug,
}

const LOSSES: [Loss; 6] = [
    Loss::SercosData,
    Loss::SercosCable,
    Loss::CanopenTpdo,
    Loss::CanopenPlug,
    Loss::DevicenetAnswers,
    Loss::DevicenetPlug,
];

impl Loss {
    /// The turntable is at the end of the line, where it can be cut off.
    fn rig(self) -> Rig {
        let line = vec![(2, UnitKind::Linear), (1, UnitKind::Rotary)];
        let sercos = Settings { drives: line.clone(), ..Settings::default() };
        let on =
            |text: &str| Settings { configuration: text.to_owned(), drives: vec![], ..Settings::default() };
        match self {
            Self::SercosData => Rig::ready(sercos),
            Self::SercosCable => {
                let configuration = BOX.replace("address = 1", "address = 1\nhot_plug = true");
                let mut rig = Rig::new(Settings { configuration, ..sercos });
                rig.line = hot_plug_drives(line, false);
                rig.until_ready();
                rig
            }
            Self::CanopenTpdo | Self::CanopenPlug => Rig::ready(on(CAN)),
            Self::DevicenetAnswers | Self::DevicenetPlug => Rig::ready(on(DEVICENET)),
        }
    }

    fn set(self, rig: &mut Rig, lost: bool) {
        let now = rig.now();
        match self {
            Self::SercosData => {
                let layout = rig.sercos().master().layout();
                let places = layout.slaves[1].clone().expect("the turntable's places");
                let mut blanks = vec![(places.status.telegram, places.status.range(2))];
                blanks.push((places.svc_at.telegram, places.svc_at.range(6)));
                let produced = places.connections.iter().filter(|place| place.kind == Kind::At);
                blanks.extend(
                    produced.map(|place| (place.at.telegram, place.at.range(usize::from(place.len)))),
                );
                rig.tamper_frame = lost.then_some(Box::new(move |frame| {
                    let header = Header::parse(frame.as_slice()).expect("a telegram of the line");
                    if header.telegram.kind() == Kind::At && header.phase.phase() == Phase::CP4 {
                        let data = &mut frame.as_mut_slice()[HEADER_LEN..];
                        for (telegram, range) in &blanks {
                            if *telegram == header.telegram.number() {
                                data[range.clone()].fill(0);
                            }
                        }
                    }
                    true
                }));
            }
            Self::SercosCable if lost => rig.line.cut(1),
            Self::SercosCable => rig.line.mend(1),
            Self::CanopenTpdo => {
                let tpdo = Id::Standard(0x181);
                rig.can[0].tamper = lost.then_some(Box::new(move |_, frame| frame.id() != tpdo));
            }
            Self::CanopenPlug => rig.can[0].bus.connect(now, 0, !lost),
            Self::DevicenetAnswers => {
                let answer = Identifier::PollResponse(MacId::new(5).expect("a MAC ID")).can();
                rig.devicenet[0].tamper = lost.then_some(Box::new(move |_, frame| frame.id() != answer));
            }
            Self::DevicenetPlug => rig.devicenet[0].bus.connect(now, 0, !lost),
        }
    }
}

/// Axis Control, or Axis Response, in a cyclic block, and Axis State in that of the device.
const REQUEST_AT: usize = 2;
const STATE_AT: usize = 7;

/// Octets of the instance header in front of a cyclic block.
const INSTANCE_LEN: usize = 8;

/// The turntable's instance, which is the first one, with a cyclic block.
fn first(instance: CommandInstance<'_>) -> bool {
    instance.number == 1 && instance.cyclic.is_some()
}

/// The request of the turntable in everything that the controller sends from now on. The controller is shown a Running axis that
/// answers nothing, so that it goes on with what it does.
fn take_over(rig: &mut Rig) -> Rc<Cell<AxisControl>> {
    let request = Rc::new(Cell::new(AxisControl::NONE));
    let wanted = Rc::clone(&request);
    rig.tamper_command = Some(Box::new(move |bytes| {
        let data = &bytes.as_slice()[CLASS1_HEADER_LEN..];
        let frame = CommandFrame::parse(data).ok();
        let header = frame.map(|frame| (frame.header().buffer_len(), frame.instances().any(first)));
        if let Some((header, true)) = header {
            bytes.as_mut_slice()[CLASS1_HEADER_LEN + header + INSTANCE_LEN + REQUEST_AT] = wanted.get().0;
        }
        true
    }));
    rig.tamper_actual = Some(Box::new(|bytes| {
        let data = &bytes.as_slice()[CLASS1_HEADER_LEN..];
        let header = ActualFrame::parse(data).ok().map(|frame| frame.header().buffer_len());
        if let Some(header) = header {
            let block = &mut bytes.as_mut_slice()[CLASS1_HEADER_LEN + header + INSTANCE_LEN..];
            block[REQUEST_AT..REQUEST_AT + 2].fill(0);
            block[STATE_AT] = AxisStateCode::RUNNING.0;
        }
        true
    }));
    request
}

fn state(rig: &Rig, axis: usize) -> AxisState {
    rig.engine.devices()[0].axis_states().nth(axis).map_or(AxisState::Off, |(_, state)| state)
}

/// Both axes in motion.
fn in_motion(loss: Loss) -> Rig {
    const SLIDE: Limits = Limits { velocity: 24.0, acceleration: 240.0, jerk: 4_800.0 };
    let mut rig = loss.rig();
    let turn = Step::RunAt { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0 };
    let far = Step::MoveAbsolute { axis: 2, position: 900.0, limits: SLIDE };
    connect(&mut rig, vec![Step::Enable(both()), turn, far]);
    rig.run_until(millis(10_000), "both in motion", |rig| rig.report().steps_finished == 2);
    rig.run_for(millis(300));
    assert!(turns(&rig), "{}", rig.told());
    rig
}

/// The turntable is at its speed, as the box sees it.
fn turns(rig: &Rig) -> bool {
    (rig.engine.axes()[0].feedback().velocity.get() - 2 * NANO).abs() < NANO / 5
}

/// Time since the beginning of the loss in milliseconds.
fn since(rig: &Rig, begin: MonotonicTime) -> i64 {
    rig.now().since(begin).as_nanos() / 1_000_000
}

/// How often the controller asks again.
const ASK_MS: i64 = 60;

#[test]
fn a_drive_that_is_heard_again_can_be_reset_and_enabled_at_once() {
    let mut table = String::from(
        "ms from the beginning of the loss: fault, Major Faulted, reset, Running again (`-`: no fault)\n",
    );
    for loss in LOSSES {
        // None: until the fault, which is one cycle more than is permitted.
        for lost_ms in [None, Some(20), Some(200), Some(1_000), Some(5_000)] {
            let mut rig = in_motion(loss);
            let slide = rig.engine.axes()[1].counters().faults;
            let (updates, begin) = (take_over(&mut rig), rig.now());
            let mut lost = true;
            loss.set(&mut rig, true);
            let [mut fault, mut major, mut reset, mut running] = [None; 4];
            let mut heard = None;
            let mut beside = "";
            while running.is_none() {
                rig.step();
                let ms = since(&rig, begin);
                assert!(ms < 60_000, "{loss:?} {lost_ms:?}: {}", rig.told());
                let axis = &rig.engine.axes()[0];
                if fault.is_none() && axis.fault().is_some() {
                    fault = Some(ms);
                    assert_eq!(axis.fault().map(|fault| fault.cause), Some(FaultCause::SOUTH_SILENCE));
                }
                if lost && lost_ms.map_or(fault.is_some(), |end| ms >= end) {
                    lost = false;
                    heard = Some(ms);
                    loss.set(&mut rig, false);
                }
                if heard.is_some_and(|heard| ms > heard + 500) && fault.is_none() {
                    break;
                }
                let asks = ms / ASK_MS % 2 == 1;
                let wants = match state(&rig, 0) {
                    AxisState::MajorFaulted => {
                        major.get_or_insert(ms);
                        AxisControl::FAULT_RESET
                    }
                    AxisState::Stopped if major.is_some() => {
                        reset.get_or_insert(ms);
                        AxisControl::ENABLE
                    }
                    AxisState::Running if reset.is_some() => {
                        running = Some(ms);
                        AxisControl::NONE
                    }
                    _ => AxisControl::NONE,
                };
                updates.set(if asks { wants } else { AxisControl::NONE });
                let untouched = rig.engine.axes()[1].counters().faults == slide
                    && rig.engine.axes()[1].state() == DriveState::Operating;
                if !untouched {
                    // A drive that restarts shows what it has missed, which may be a fault of the node.
                    assert!(matches!(loss, Loss::CanopenPlug | Loss::DevicenetPlug), "{}", rig.told());
                    beside = " the slide is stopped as well";
                    break;
                }
            }
            let cell = |at: Option<i64>| at.map_or("-".to_owned(), |at| at.to_string());
            writeln!(
                table,
                "{:<17} {:>8}: {:>6} {:>6} {:>6} {:>6}{beside}",
                format!("{loss:?}"),
                lost_ms.map_or("limit".to_owned(), |ms| format!("{ms} ms")),
                cell(fault),
                cell(major),
                cell(reset),
                cell(running),
            )
            .expect("a string");
            // Nobody waits longer for a stop that cannot be seen.
            if let (Some(fault), Some(major)) = (fault, major) {
                assert!(major - fault <= SILENCE_TIME_OUT.as_nanos() / 1_000_000 + 200, "{table}");
            }
            if running.is_some() {
                assert_eq!(rig.engine.axes()[0].state(), DriveState::Operating);
                assert_eq!(rig.engine.axes()[0].feedback().report, Report::Operating);
            }
        }
    }
    insta::assert_snapshot!(table);
}
