//! A line that loses and damages frames at random: the master neither panics nor takes what is damaged.

use super::*;
use crate::checker::bus::Cable;
use proptest::prelude::*;

/// A small generator, so that a case is told by its seed.
fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

/// Loses frames and flips single bits, each in `per_mille` of the frames.
fn noise(seed: u64, per_mille: u64, header_only: bool) -> Cable {
    let mut state = seed | 1;
    Box::new(move |frame| {
        if random(&mut state) % 1000 < per_mille {
            let bits = if header_only { HEADER_LEN } else { frame.len() } * 8;
            let bit = usize::try_from(random(&mut state)).unwrap() % bits;
            frame[bit / 8] ^= 1 << (bit % 8);
        }
        random(&mut state) % 1000 >= per_mille
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Losses and header damage up to one in a hundred frames do not keep the master from CP4.
    #[test]
    fn the_way_up_stands_noise(seed: u64, per_mille in 0u64..10) {
        let mut rig = Rig::of(&[1, 2, 3]);
        rig.master.set_target_phase(Phase::CP0);
        rig.state(State::Cp0);
        rig.cable = noise(seed, per_mille, true);
        rig.master.set_target_phase(Phase::CP4);
        rig.run_until("up or given up", |rig| {
            rig.master.state() == State::Cp4 || rig.master.target_phase() == Some(Phase::CP0)
        });
        prop_assert_eq!(rig.master.state(), State::Cp4, "{:?}", rig.log);
    }

    /// Anything may happen to the frames: no panic, and the master is somewhere sensible afterwards.
    #[test]
    fn any_damage_is_survived(seed: u64, per_mille in 0u64..300, target in 0u8..6) {
        let mut rig = Rig::of(&[1, 2, 3]);
        rig.cable = noise(seed, per_mille, false);
        rig.auto_proceed = false;
        rig.master.set_target_phase(Phase(target));
        let mut state = seed | 1;
        for _ in 0..2000 {
            rig.step();
            let _ = rig.master.proceed();
            let slave = SlaveId(u16::try_from(random(&mut state) % 4).unwrap());
            let _ = rig.master.svc_submit(slave, SvcRequest::read(Idn::SCP_CLASSES));
            if random(&mut state).is_multiple_of(500) {
                rig.master.set_target_phase(Phase(u8::try_from(random(&mut state) % 5).unwrap()));
            }
        }
        // With the cable mended the network comes up.
        rig.cable = Box::new(|_| true);
        rig.auto_proceed = true;
        rig.master.set_target_phase(Phase::CP0);
        rig.state(State::Cp0);
        rig.log.clear();
        rig.up_to(Phase::CP4);
    }
}
