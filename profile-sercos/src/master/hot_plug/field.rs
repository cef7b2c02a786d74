//! What the master says in the hot-plug field of MDT0.

use crate::master::config::MasterConfig;
use crate::master::layout::CyclicLayout;
use crate::wire::hot_plug::{BROADCAST_ADDRESS, HotPlug, HotPlugCode};

/// Control bits while hot plug is going on.
const ENABLED: u16 = HotPlug::SUPPORTED | HotPlug::ENABLED;

/// Parameters of HP0.
pub(super) const PARAMETERS: u8 = 13;

/// Nothing is going on.
pub(super) const fn quiet(supported: bool) -> HotPlug {
    HotPlug { selection: 0, word: if supported { HotPlug::SUPPORTED } else { 0 }, info: 0 }
}

/// Parameter number `step` of HP0, for all slaves that are there.
pub(super) fn parameter(step: u8, config: &MasterConfig, layout: &CyclicLayout) -> HotPlug {
    let (t6, t7) = layout.times.uc_ns.unwrap_or((0, 0));
    let place = usize::from(step) % 4;
    let (code, info) = match step {
        0..=3 => (HotPlugCode(HotPlugCode::MDT_LENGTH.0 + step), u32::from(layout.mdt_len[place])),
        4..=7 => (HotPlugCode(HotPlugCode::AT_LENGTH.0 + step - 4), u32::from(layout.at_len[place])),
        8 => (HotPlugCode::CYCLE_TIME, config.cycle_ns),
        9 => (HotPlugCode::T6, t6),
        10 => (HotPlugCode::T7, t7),
        11 => (HotPlugCode::REQUESTED_MTU, u32::from(config.mtu)),
        _ => (HotPlugCode::COMMUNICATION_VERSION, config.communication_version().bits()),
    };
    HotPlug { selection: BROADCAST_ADDRESS, word: ENABLED | u16::from(code.0), info }
}

/// The question for the address of the slave with this index in the device.
pub(super) const fn scan(index: u16) -> HotPlug {
    HotPlug { selection: index << 12, word: ENABLED, info: 0 }
}

/// The place of a slave's service channel in the MDTs or in the ATs.
pub(super) fn offset(address: u16, code: HotPlugCode, parameter: u16) -> HotPlug {
    HotPlug { selection: address, word: ENABLED | u16::from(code.0), info: u32::from(parameter) }
}

/// The service channel takes over.
pub(super) const SWITCH: HotPlug = HotPlug { selection: 0, word: ENABLED | HotPlug::SWITCH_TO_SVC, info: 0 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameters_of_hp0() {
        let config = MasterConfig::new([2, 0, 0, 0, 0, 1], 1_000_000);
        let mut layout =
            CyclicLayout { mdt_len: [46, 40, 0, 0], at_len: [48, 0, 0, 0], ..CyclicLayout::default() };
        layout.times.uc_ns = Some((100_000, 900_000));
        let told: Vec<_> = (0..PARAMETERS)
            .map(|step| parameter(step, &config, &layout))
            .map(|field| (field.selection, field.code().0, field.info))
            .collect();
        let wanted = [
            (0x10, 46),
            (0x11, 40),
            (0x12, 0),
            (0x13, 0),
            (0x20, 48),
            (0x21, 0),
            (0x22, 0),
            (0x23, 0),
            (1, 1_000_000),
            (2, 100_000),
            (3, 900_000),
            (4, 1500),
            (5, 1),
        ]
        .map(|(code, info)| (0xFFF, code, info));
        assert_eq!(told, wanted);
    }
}
