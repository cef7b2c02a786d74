//! NRT and the communication phases 0 to 4.
//!
//! Assumptions where the sheet is silent. In CP0 to CP2 the slave falls back to NRT after `mst_timeout_ms` without an MST. A
//! plain CP0 is followed from every phase, so that a master can begin again. A phase without a switch before it, a switch to
//! another phase than the next or 0, and a switch without S-0-0127 or S-0-0128 are errors: the slave goes to NRT with the
//! reason in S-0-0014. A telegram of the old phase after a switch cancels the switch. The ATs of the switch from CP3 to CP4
//! carry the service channel and S-DEV without their valid bits, as in the recording; in the others nothing is written.

use super::settings::Settings;
use super::telegram::Header;

/// S-0-0014: MST missing.
pub const MST_ERROR: u16 = 1 << 3;
/// S-0-0014: connection data missing.
pub const MDT_ERROR: u16 = 1 << 4;
/// S-0-0014: a phase above 4.
pub const INVALID_PHASE: u16 = 1 << 5;
/// S-0-0014: error in the upshift.
pub const UPSHIFT: u16 = 1 << 6;
/// S-0-0014: error in the downshift.
pub const DOWNSHIFT: u16 = 1 << 7;
/// S-0-0014: switch without ready acknowledge.
pub const NOT_READY: u16 = 1 << 8;
/// S-0-0014: an operation mode without definition.
pub const NO_MODE: u16 = 1 << 9;

/// What an MST or the time has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Nothing.
    None,
    /// A switch to this phase is pending.
    Pending(u8),
    /// This phase has begun.
    Entered(u8),
    /// Fallen to NRT, with the reason in the form of S-0-0014.
    Fault(u16),
    /// Fallen to NRT from CP0 to CP2 after a long silence.
    Silent,
}

/// The phase machine.
#[derive(Debug, Clone, Default)]
pub struct Phases {
    phase: Option<u8>,
    pending: Option<u8>,
    heard: Option<u64>,
    lost: u32,
    /// S-0-0127 was carried out.
    pub ready_for_3: bool,
    /// S-0-0128 was carried out.
    pub ready_for_4: bool,
}

impl Phases {
    /// The phase; none in NRT.
    #[must_use]
    pub fn phase(&self) -> Option<u8> {
        self.phase
    }

    /// The phase to which a switch is pending.
    #[must_use]
    pub fn pending(&self) -> Option<u8> {
        self.pending
    }

    /// MST lost one after the other until now.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    fn fault(&mut self, reason: u16) -> Event {
        let phase = u16::from(self.phase.unwrap_or(0));
        self.leave();
        Event::Fault(reason | phase & 7)
    }

    fn leave(&mut self) {
        *self = Self::default();
    }

    fn enter(&mut self, phase: u8, now: u64) -> Event {
        self.phase = Some(phase);
        self.pending = None;
        self.heard = Some(now);
        self.lost = 0;
        match phase {
            0 => (self.ready_for_3, self.ready_for_4) = (false, false),
            2 => self.ready_for_3 = false,
            3 => self.ready_for_4 = false,
            _ => {}
        }
        Event::Entered(phase)
    }

    /// The header of MDT0 has come.
    pub fn mst(&mut self, now: u64, header: Header, settings: &Settings) -> Event {
        let told = header.phase;
        let Some(current) = self.phase else {
            return if told == 0 && !header.cps { self.enter(0, now) } else { Event::None };
        };
        if told > 4 {
            return self.fault(INVALID_PHASE);
        }
        if header.cps {
            if settings.ignore_switch_to == Some(told) {
                self.hear(now);
                return Event::None;
            }
            return self.switch(now, current, told);
        }
        if let Some(pending) = self.pending
            && pending == told
        {
            let pause = u64::from(settings.switch_pause_ms) * 1_000_000;
            let needed = if told == 4 { 0 } else { pause };
            let silent = self.heard.map_or(u64::MAX, |heard| now.saturating_sub(heard));
            return if silent >= needed { self.enter(told, now) } else { Event::None };
        }
        if told == current {
            self.pending = None;
            self.hear(now);
            return Event::None;
        }
        match told {
            0 => self.enter(0, now),
            _ if told > current => self.fault(UPSHIFT),
            _ => self.fault(DOWNSHIFT),
        }
    }

    fn switch(&mut self, now: u64, current: u8, told: u8) -> Event {
        self.hear(now);
        if self.pending == Some(told) {
            return Event::None;
        }
        match told {
            0 => {}
            3 if current == 2 && !self.ready_for_3 => return self.fault(NOT_READY),
            4 if current == 3 && !self.ready_for_4 => return self.fault(NOT_READY),
            _ if told == current + 1 => {}
            _ if told > current => return self.fault(UPSHIFT),
            _ => return self.fault(DOWNSHIFT),
        }
        self.pending = Some(told);
        Event::Pending(told)
    }

    fn hear(&mut self, now: u64) {
        self.heard = Some(now);
        self.lost = 0;
    }

    /// Time has passed. `cycle` and `allowed` are S-0-1002 and S-0-1003. The answer has the MST that were lost since.
    pub fn tick(&mut self, now: u64, settings: &Settings, cycle: u64, allowed: u32) -> (u32, Event) {
        let (Some(phase), Some(heard)) = (self.phase, self.heard) else { return (0, Event::None) };
        let silence = now.saturating_sub(heard);
        let running = phase >= 3 && matches!(self.pending, None | Some(4));
        if !running {
            if silence > u64::from(settings.mst_timeout_ms) * 1_000_000 {
                self.leave();
                return (0, Event::Silent);
            }
            return (0, Event::None);
        }
        let cycle = cycle.max(1);
        // Half a cycle late is lost.
        let lost = (silence.saturating_add(cycle / 2) / cycle).saturating_sub(1);
        let lost = u32::try_from(lost).unwrap_or(u32::MAX);
        let more = lost.saturating_sub(self.lost);
        self.lost = lost;
        if lost > allowed { (more, self.fault(MST_ERROR)) } else { (more, Event::None) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::telegram::{build, header};
    use super::*;

    fn head(phase_byte: u8) -> Header {
        header(&build([2; 6], 0x20, phase_byte, &[]), true).unwrap()
    }

    fn up(phase: u8) -> Phases {
        let settings = Settings::default();
        let mut p = Phases::default();
        p.mst(0, head(0), &settings);
        for next in 1..=phase {
            (p.ready_for_3, p.ready_for_4) = (true, true);
            assert_eq!(p.mst(0, head(0x80 | next), &settings), Event::Pending(next));
            assert_eq!(p.mst(0, head(next), &settings), Event::Entered(next));
        }
        p
    }

    #[test]
    fn nrt_ends_with_cp0_only() {
        let settings = Settings::default();
        let mut p = Phases::default();
        for byte in [1, 2, 3, 4, 5, 0x80, 0x81, 0x84] {
            assert_eq!(p.mst(0, head(byte), &settings), Event::None);
        }
        assert_eq!(p.phase(), None);
        assert_eq!(p.mst(0, head(0x30), &settings), Event::Entered(0));
    }

    #[test]
    fn a_jump_is_an_error_with_its_reason() {
        let settings = Settings::default();
        assert_eq!(up(1).mst(0, head(2), &settings), Event::Fault(UPSHIFT | 1));
        assert_eq!(up(1).mst(0, head(0x83), &settings), Event::Fault(UPSHIFT | 1));
        assert_eq!(up(2).mst(0, head(0x83), &settings), Event::Fault(NOT_READY | 2));
        assert_eq!(up(3).mst(0, head(0x84), &settings), Event::Fault(NOT_READY | 3));
        assert_eq!(up(4).mst(0, head(0x83), &settings), Event::Fault(DOWNSHIFT | 4));
        assert_eq!(up(4).mst(0, head(3), &settings), Event::Fault(DOWNSHIFT | 4));
        assert_eq!(up(2).mst(0, head(7), &settings), Event::Fault(INVALID_PHASE | 2));
        assert_eq!(up(4).mst(0, head(0x80), &settings), Event::Pending(0));
        assert_eq!(up(2).mst(0, head(0), &settings), Event::Entered(0));
    }

    #[test]
    fn more_lost_mst_than_allowed_are_a_fault() {
        let settings = Settings::default();
        let mut p = up(4);
        assert_eq!(p.tick(1_400_000, &settings, 1_000_000, 3), (0, Event::None));
        assert_eq!(p.tick(1_600_000, &settings, 1_000_000, 3), (1, Event::None));
        assert_eq!(p.tick(4_400_000, &settings, 1_000_000, 3), (2, Event::None));
        assert_eq!(p.lost(), 3);
        assert_eq!(p.tick(4_600_000, &settings, 1_000_000, 3), (1, Event::Fault(MST_ERROR | 4)));
        assert_eq!(p.phase(), None);
    }

    #[test]
    fn a_switch_needs_its_pause_where_the_slave_wants_one() {
        let settings = Settings { switch_pause_ms: 120, ..Settings::default() };
        let mut p = Phases::default();
        p.mst(0, head(0), &settings);
        p.mst(1_000_000, head(0x81), &settings);
        assert_eq!(p.mst(100_000_000, head(1), &settings), Event::None);
        assert_eq!(p.phase(), Some(0));
        assert_eq!(p.mst(121_000_000, head(1), &settings), Event::Entered(1));
        assert_eq!(p.tick(1_200_000_000, &settings, 1, 0), (0, Event::Silent));
    }

    #[test]
    fn a_switch_may_be_ignored_or_cancelled() {
        let settings = Settings { ignore_switch_to: Some(1), ..Settings::default() };
        let mut p = Phases::default();
        p.mst(0, head(0), &settings);
        assert_eq!(p.mst(0, head(0x81), &settings), Event::None);
        assert_eq!(p.pending(), None);
        assert_eq!(p.mst(0, head(1), &settings), Event::Fault(UPSHIFT));
        let mut p = up(2);
        p.ready_for_3 = true;
        p.mst(0, head(0x83), &settings);
        assert_eq!(p.mst(0, head(2), &settings), Event::None);
        assert_eq!(p.pending(), None);
    }
}
