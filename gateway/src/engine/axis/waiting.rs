//! What an axis waits for, so that people learn it who stand before a machine that does nothing.

use std::fmt;

use profile_generic::inhibit::Inhibits;
use profile_generic::program::BitPattern;
use profile_generic::sequence::SequenceStep;
use profile_generic::state::{DriveState, Report};

use super::AxisChannel;
use crate::mapping::{Item, MODE_SHIFT};

/// Bits of a status word that are named at most: more would say nothing.
const BITS_MAX: usize = 4;

/// What an axis waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Awaited {
    /// A drive that is on the bus and commissioned.
    Drive,
    /// The drive is heard again.
    Hearing,
    /// The end of the drive's own initialisation.
    Initialisation,
    /// The supply of the power stage, or a drive that is ready to be switched on.
    Power,
    /// The drive follows set-points.
    Following,
    /// The axis has come to rest, and the torque has ended.
    Stop,
    /// The same, because of a fault.
    FaultReaction,
    /// The drive has cleared its faults.
    Reset,
}

impl Awaited {
    /// Everything that can be waited for.
    pub const ALL: &'static [Self] = &[
        Self::Drive,
        Self::Hearing,
        Self::Initialisation,
        Self::Power,
        Self::Following,
        Self::Stop,
        Self::FaultReaction,
        Self::Reset,
    ];

    /// Its number for programs outside, from 1; never changed, only added to. 0 stands for nothing.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Drive => 1,
            Self::Hearing => 2,
            Self::Initialisation => 3,
            Self::Power => 4,
            Self::Following => 5,
            Self::Stop => 6,
            Self::FaultReaction => 7,
            Self::Reset => 8,
        }
    }

    /// What has this number.
    #[must_use]
    pub fn of_code(code: u8) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.code() == code)
    }

    /// Its name in the register map.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drive => "drive",
            Self::Hearing => "hearing",
            Self::Initialisation => "initialisation",
            Self::Power => "power",
            Self::Following => "following",
            Self::Stop => "stop",
            Self::FaultReaction => "fault_reaction",
            Self::Reset => "reset",
        }
    }

    /// What keeps the axis from being enabled while it waits for this; a start, a stop and a reset end by themselves.
    #[must_use]
    pub const fn inhibits(self) -> Inhibits {
        match self {
            Self::Drive | Self::Hearing => Inhibits::NO_DRIVE,
            Self::Power => Inhibits::NO_POWER,
            Self::Initialisation | Self::Following | Self::Stop | Self::FaultReaction | Self::Reset => {
                Inhibits::empty()
            }
        }
    }

    /// What the drive has to show for it.
    fn wanted(self) -> Option<&'static [Report]> {
        match self {
            Self::Drive | Self::Hearing => None,
            Self::Initialisation | Self::Power | Self::Stop | Self::Reset => Some(&[Report::Ready]),
            Self::Following => Some(&[Report::Operating]),
            Self::FaultReaction => Some(&[Report::Faulted, Report::Ready]),
        }
    }
}

impl fmt::Display for Awaited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drive => "its drive: it is not on the bus, or not commissioned yet",
            Self::Hearing => "its drive to be heard again",
            Self::Initialisation => "its drive to be initialised",
            Self::Power => "its drive to be ready, or for main power",
            Self::Following => "its drive to follow set-points",
            Self::Stop => "the end of its stop",
            Self::FaultReaction => "the end of the reaction to its fault",
            Self::Reset => "its drive to clear its faults",
        })
    }
}

/// What an axis waits for, and what its drive shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Waiting {
    /// What it waits for.
    pub awaited: Awaited,
    /// The status word, and the bits of it that keep the axis waiting with the values that would do.
    pub shown: Option<(Item, u32, BitPattern)>,
}

impl fmt::Display for Waiting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.awaited)?;
        let Some((item, word, missing)) = self.shown else { return Ok(()) };
        write!(f, "; {item} = {:04X}", word & 0xFFFF)?;
        let bits = (0..16_u32).filter(|bit| missing.mask >> bit & 1 != 0);
        for (number, bit) in bits.take(BITS_MAX).enumerate() {
            let before = if number == 0 { ", expected" } else { "," };
            write!(f, "{before} bit {bit} = {}", missing.value >> bit & 1)?;
        }
        if missing.mask >> MODE_SHIFT != 0 {
            write!(f, ", and another operating mode")?;
        }
        Ok(())
    }
}

/// See [`AxisChannel::waiting`].
pub(super) fn waiting(axis: &AxisChannel) -> Option<Waiting> {
    let awaited = awaited(axis)?;
    Some(Waiting { awaited, shown: shown_for(axis, awaited) })
}

/// See [`AxisChannel::awaited`].
pub(super) fn awaited(axis: &AxisChannel) -> Option<Awaited> {
    if axis.south().is_none() {
        return Some(Awaited::Drive);
    }
    if axis.feedback.report == Report::Silent {
        return Some(Awaited::Hearing);
    }
    if axis.orders.resets() {
        return Some(Awaited::Reset);
    }
    match axis.state() {
        DriveState::NotReady => Some(Awaited::Initialisation),
        DriveState::AwaitingPower => Some(Awaited::Power),
        DriveState::Starting => Some(Awaited::Following),
        DriveState::Operating if axis.sequence_step() == SequenceStep::Energizing => Some(Awaited::Following),
        DriveState::Stopping => Some(Awaited::Stop),
        DriveState::FaultReaction if !axis.holds() => Some(Awaited::FaultReaction),
        _ => None,
    }
}

/// The word, and the fewest bits of it that have to change for what is waited for.
fn shown_for(axis: &AxisChannel, awaited: Awaited) -> Option<(Item, u32, BitPattern)> {
    let wanted = awaited.wanted()?;
    let (program, status) = (axis.south()?, axis.link.status());
    let rows = || program.reports.rows();
    let wins = rows().find(|(pattern, _)| pattern.matches(status)).map(|(pattern, _)| pattern);
    let changes = rows().filter(|(_, report)| wanted.contains(report)).filter_map(|(row, _)| {
        let mask = (status ^ row.value) & row.mask;
        if mask != 0 {
            return Some(BitPattern::new(mask, row.value & mask));
        }
        // It fits, and so does one before it: that one must not.
        let hides = wins?;
        let mask = hides.mask & !row.mask;
        Some(BitPattern::new(mask, !hides.value & mask))
    });
    let does = |change: &BitPattern| {
        program.reports.decode(change.apply(status)).is_some_and(|report| wanted.contains(&report))
    };
    let nearest = changes.filter(does).min_by_key(|change| change.mask.count_ones())?;
    Some((program.status_item()?, status, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_that_are_missing_are_named() {
        let line = |awaited, word, mask, value| {
            let shown = Some((Item::object(0x6041, 0), word, BitPattern::new(mask, value)));
            Waiting { awaited, shown }.to_string()
        };
        assert_eq!(
            line(Awaited::Power, 0x0221, 0x10, 0x10),
            "its drive to be ready, or for main power; 6041:00 = 0221, expected bit 4 = 1"
        );
        assert_eq!(
            line(Awaited::Following, 0x8_0233, 0x1004, 0x1004),
            "its drive to follow set-points; 6041:00 = 0233, expected bit 2 = 1, bit 12 = 1"
        );
        assert_eq!(
            line(Awaited::Following, 0x0237, 0x8_0000, 0x8_0000),
            "its drive to follow set-points; 6041:00 = 0237, and another operating mode"
        );
        assert_eq!(
            Waiting { awaited: Awaited::Drive, shown: None }.to_string(),
            "its drive: it is not on the bus, or not commissioned yet"
        );
    }
}
