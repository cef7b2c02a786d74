//! The law of the box: no drive is switched on that its controller has not just enabled, whatever happens.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge_tests::rig::motion::{both, millis, moves};
use axisbridge_tests::rig::network::Knobs;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::Step;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::CommandFrame;
use profile_cip::wire::motion::codes::AxisControl;
use profile_generic::fault::FaultCause;
use profile_generic::time::MonotonicTime;
use proptest::prelude::*;

/// Something that happens to the machine.
#[derive(Debug, Clone, Copy)]
enum Happening {
    /// A controller connects that enables and moves, or one that only looks.
    Connect { enables: bool },
    /// The controller is gone from one moment to the next.
    Vanish,
    /// Its stream breaks.
    BreakStream,
    /// No datagram of it arrives for so many milliseconds.
    Gap(u16),
    /// A drive faults, or the cause of its faults ends.
    Fault { drive: usize, there: bool },
    /// Main power of a drive goes or comes.
    Power { drive: usize, on: bool },
    /// The line is cut before the first or the second drive, or mended.
    Cut(Option<usize>),
    /// The box is restarted.
    Restart,
    /// The network becomes bad, or good again.
    Network { bad: bool },
    /// Nothing for a while.
    Wait(u16),
}

fn happening() -> impl Strategy<Value = Happening> {
    let drive = 0..2_usize;
    prop_oneof![
        4 => Just(Happening::Connect { enables: true }),
        1 => Just(Happening::Connect { enables: false }),
        1 => Just(Happening::Vanish),
        1 => Just(Happening::BreakStream),
        2 => (4..120_u16).prop_map(Happening::Gap),
        2 => (drive.clone(), any::<bool>()).prop_map(|(drive, there)| Happening::Fault { drive, there }),
        1 => (drive, any::<bool>()).prop_map(|(drive, on)| Happening::Power { drive, on }),
        2 => prop_oneof![Just(None), (0..2_usize).prop_map(Some)].prop_map(Happening::Cut),
        1 => Just(Happening::Restart),
        1 => any::<bool>().prop_map(|bad| Happening::Network { bad }),
        4 => (20..600_u16).prop_map(Happening::Wait),
    ]
}

/// When each axis was asked to start: changes of its Axis Control to Enable, as they left the controller.
type Enables = Rc<RefCell<[(AxisControl, Vec<MonotonicTime>); 2]>>;

/// Notes the requests in a datagram.
fn note(datagram: &[u8], now: MonotonicTime, enables: &Enables) {
    let Ok(datagram) = Class1Datagram::parse(datagram) else { return };
    let Ok(frame) = CommandFrame::parse(datagram.data) else { return };
    for instance in frame.instances() {
        let place = usize::from(instance.number).checked_sub(1);
        let mut axes = enables.borrow_mut();
        if let (Some(block), Some((last, times))) =
            (instance.cyclic, place.and_then(|place| axes.get_mut(place)))
        {
            if block.axis_control == AxisControl::ENABLE && *last != AxisControl::ENABLE {
                times.push(now);
            }
            *last = block.axis_control;
        }
    }
}

fn happen(rig: &mut Rig, what: Happening) {
    match what {
        Happening::Connect { enables } => {
            let mut program = vec![Step::Dwell { seconds: 0.1 }];
            if enables {
                program.extend([Step::FaultReset(both()), Step::Enable(both()), moves(10.0, 300.0)]);
            }
            rig.kill_controller();
            rig.connect(program);
        }
        Happening::Vanish => {
            rig.kill_controller();
        }
        Happening::BreakStream => rig.drop_stream(),
        Happening::Gap(span) => {
            let knobs = std::mem::replace(&mut rig.knobs, Knobs { loss: 1_000, ..Knobs::GOOD });
            rig.run_for(millis(i64::from(span)));
            rig.knobs = knobs;
        }
        Happening::Fault { drive, there: true } => rig.drive_mut(drive).raise_fault(FaultCause::OVER_CURRENT),
        Happening::Fault { drive, there: false } => {
            rig.drive_mut(drive).clear_fault(FaultCause::OVER_CURRENT)
        }
        Happening::Power { drive, on } => rig.drive_mut(drive).set_main_power(on),
        Happening::Cut(behind) => {
            rig.cable = behind != Some(0);
            if behind == Some(1) { rig.line.cut(1) } else { rig.line.mend(1) }
        }
        Happening::Restart => rig.restart_box(),
        Happening::Network { bad } => {
            let loss = if bad { 300 } else { 0 };
            rig.knobs = Knobs { loss, duplication: loss / 3, reordering: loss / 2, ..Knobs::GOOD };
        }
        Happening::Wait(span) => rig.run_for(millis(i64::from(span))),
    }
    rig.run_for(millis(60));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, max_shrink_iters: 60, ..ProptestConfig::default() })]

    #[test]
    fn a_drive_is_switched_on_only_by_an_enable_of_its_own(
        seed in any::<u64>(),
        story in proptest::collection::vec(happening(), 4..14),
    ) {
        let mut rig = Rig::ready(Settings { seed, ..Settings::default() });
        let enables = Enables::default();
        let seen = Rc::clone(&enables);
        let clock = rig.clock();
        rig.tamper_command = Some(Box::new(move |datagram| {
            note(datagram.as_slice(), clock.get(), &seen);
            true
        }));
        for what in &story {
            happen(&mut rig, *what);
        }
        for (drive, watched) in rig.watched.iter().enumerate() {
            let requests = &enables.borrow()[drive].1;
            let mut off_since = MonotonicTime::ZERO;
            for (at, on) in &watched.changes {
                if *on {
                    let asked = requests.iter().any(|request| (off_since..=*at).contains(request));
                    prop_assert!(
                        asked,
                        "drive {} was switched on at {} ns, off since {} ns, enables at {:?}\n{}",
                        drive, at.0, off_since.0, requests, rig.told()
                    );
                } else {
                    off_since = *at;
                }
            }
        }
        // And what is left alone comes to rest without torque.
        rig.kill_controller();
        rig.knobs = Knobs::GOOD;
        rig.run_for(millis(1_500));
        prop_assert!(rig.torque_free(), "{}", rig.told());
    }
}
