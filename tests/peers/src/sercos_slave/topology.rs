//! Where a frame leaves: forwarded, looped back, or dropped.
//!
//! A frame that has been forwarded and then comes in at the other port is on its way back: it is not worked on again. A slave
//! without a link at its other port loops back. Assumptions: once looped back in CP1 to CP4 a slave stays so until the master
//! commands fast forward; what comes in at the inactive port is noted for S-DEV and dropped; S-DEV shows the loop of the
//! telegrams that come in at the active port. A telegram that leaves by a second port as well is told by `copy`.

use super::telegram::{C_DEV_TOPOLOGY_TOGGLE, Header, S_DEV_TOPOLOGY_TOGGLE};

/// What the slave does with frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// From one port to the other.
    FastForward,
    /// Back where they came from; P telegrams are forwarded as well.
    LoopPrimary,
    /// Back where they came from; S telegrams are forwarded as well.
    LoopSecondary,
}

/// How a frame has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the master: to be worked on.
    Out,
    /// From the end of the line: only counted in CP0.
    Back,
    /// At the inactive port: dropped.
    Drop,
}

/// The ports of a slave.
#[derive(Debug, Clone)]
pub struct Topology {
    link: [bool; 2],
    mode: Mode,
    inactive: u8,
    noted: u16,
    age: u8,
    sent: [[[Option<u8>; 4]; 2]; 2],
    entered: [u8; 2],
    taken: bool,
    shown: bool,
    copy: Option<u8>,
    /// Bit 22 of the communication version: nothing is forwarded at the end of the line.
    pub quiet_end: bool,
}

/// The other port.
#[must_use]
pub fn other(port: u8) -> u8 {
    if port == 1 { 2 } else { 1 }
}

fn at(port: u8) -> usize {
    usize::from(port != 1)
}

impl Topology {
    /// With the links of the settings.
    #[must_use]
    pub fn new(link: [bool; 2]) -> Self {
        Self {
            link,
            mode: Mode::FastForward,
            inactive: 2,
            noted: 0,
            age: 0,
            sent: [[[None; 4]; 2]; 2],
            entered: [1, 2],
            taken: false,
            shown: false,
            copy: None,
            quiet_end: false,
        }
    }

    /// CP0 begins: everything anew.
    pub fn reset(&mut self) {
        let (quiet, link) = (self.quiet_end, self.link);
        *self = Self { quiet_end: quiet, sent: self.sent, entered: self.entered, ..Self::new(link) };
    }

    /// A phase begins: the toggle goes back to 0.
    pub fn new_phase(&mut self) {
        (self.taken, self.shown) = (false, false);
    }

    /// Plugs or unplugs a neighbour.
    pub fn set_link(&mut self, port: u8, up: bool) {
        self.link[at(port)] = up;
    }

    /// The mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// A new cycle: what was noted at the inactive port grows old.
    pub fn new_cycle(&mut self) {
        self.age = self.age.saturating_sub(1);
        if self.age == 0 {
            self.noted = 0;
        }
    }

    /// A frame has come in.
    pub fn arrive(&mut self, port: u8, header: Header) -> Way {
        self.copy = None;
        let channel = header.channel.index();
        if self.mode != Mode::FastForward {
            if port == self.inactive {
                self.noted = if channel == 0 { 2 } else { 3 };
                self.age = 2;
                return Way::Drop;
            }
            self.entered[channel] = port;
            return Way::Out;
        }
        let sent = &mut self.sent[channel][usize::from(header.at)][usize::from(header.number & 3)];
        if *sent == Some(other(port)) {
            *sent = None;
            return Way::Back;
        }
        self.entered[channel] = port;
        Way::Out
    }

    /// A frame goes out. `listening`: in NRT nothing is looped back, and before CP1 nothing stays looped back.
    pub fn leave(&mut self, port: u8, header: Header, way: Way, phase: Option<u8>) -> Option<u8> {
        let channel = header.channel.index();
        if way == Way::Drop {
            return None;
        }
        let next = other(port);
        if phase.is_none() {
            return self.link[at(next)].then_some(next);
        }
        let sent = &mut self.sent[channel][usize::from(header.at)][usize::from(header.number & 3)];
        if self.mode == Mode::FastForward {
            if way == Way::Back {
                return Some(next);
            }
            if self.link[at(next)] {
                *sent = Some(port);
                return Some(next);
            }
            *sent = None;
            if phase >= Some(1) {
                self.mode = if channel == 0 { Mode::LoopPrimary } else { Mode::LoopSecondary };
                self.inactive = next;
            }
            return Some(port);
        }
        let forwards = matches!((self.mode, channel), (Mode::LoopPrimary, 0) | (Mode::LoopSecondary, 1));
        if forwards && self.link[at(next)] && !self.quiet_end {
            self.copy = Some(next);
        }
        Some(port)
    }

    /// The port by which the last frame has left as well.
    #[must_use]
    pub fn copy(&self) -> Option<u8> {
        self.copy
    }

    /// C-DEV has come: a change of its toggle commands a topology. `stuck` keeps the acknowledgement away.
    pub fn command(&mut self, c_dev: u16, stuck: bool) {
        let toggle = c_dev & C_DEV_TOPOLOGY_TOGGLE != 0;
        if toggle == self.taken {
            return;
        }
        self.taken = toggle;
        if !stuck {
            self.shown = toggle;
        }
        self.sent = [[[None; 4]; 2]; 2];
        match c_dev >> 12 & 3 {
            1 => (self.mode, self.inactive) = (Mode::LoopPrimary, other(self.entered[0])),
            2 => (self.mode, self.inactive) = (Mode::LoopSecondary, other(self.entered[1])),
            _ => self.mode = Mode::FastForward,
        }
    }

    /// Bits 14 to 10 of S-DEV.
    #[must_use]
    pub fn status(&self) -> u16 {
        let toggle = if self.shown { S_DEV_TOPOLOGY_TOGGLE } else { 0 };
        let (mode, inactive) = match self.mode {
            Mode::FastForward => return toggle,
            Mode::LoopPrimary => (1u16, self.inactive),
            Mode::LoopSecondary => (2, self.inactive),
        };
        let seen = if self.noted == 0 { u16::from(self.link[at(inactive)]) } else { self.noted };
        toggle | mode << 12 | seen << 10
    }
}

#[cfg(test)]
mod tests {
    use super::super::telegram::{build, header};
    use super::*;

    fn head(type_byte: u8) -> Header {
        header(&build([2; 6], type_byte, 0, &[]), true).unwrap()
    }

    #[test]
    fn a_line_forwards_and_the_end_loops_back() {
        let mut first = Topology::new([true, true]);
        let mut last = Topology::new([true, false]);
        for _ in 0..3 {
            assert_eq!(first.arrive(1, head(0x60)), Way::Out);
            assert_eq!(first.leave(1, head(0x60), Way::Out, Some(1)), Some(2));
            assert_eq!(last.arrive(1, head(0x60)), Way::Out);
            assert_eq!(last.leave(1, head(0x60), Way::Out, Some(1)), Some(1));
            assert_eq!(first.arrive(2, head(0x60)), Way::Back);
            assert_eq!(first.leave(2, head(0x60), Way::Back, Some(1)), Some(1));
        }
        assert_eq!((first.status(), last.status()), (0, 0x1000));
    }

    #[test]
    fn a_ring_passes_both_telegrams() {
        let mut slave = Topology::new([true, true]);
        for _ in 0..3 {
            assert_eq!(slave.arrive(1, head(0x20)), Way::Out);
            assert_eq!(slave.leave(1, head(0x20), Way::Out, Some(4)), Some(2));
            assert_eq!(slave.arrive(2, head(0xA0)), Way::Out);
            assert_eq!(slave.leave(2, head(0xA0), Way::Out, Some(4)), Some(1));
        }
    }

    #[test]
    fn a_break_and_a_heal_of_the_ring() {
        let mut slave = Topology::new([true, true]);
        slave.arrive(1, head(0x20));
        slave.leave(1, head(0x20), Way::Out, Some(4));
        slave.set_link(2, false);
        assert_eq!(slave.arrive(1, head(0x20)), Way::Out);
        assert_eq!(slave.leave(1, head(0x20), Way::Out, Some(4)), Some(1));
        assert_eq!(slave.status(), 0x1000);
        slave.set_link(2, true);
        slave.arrive(1, head(0x20));
        assert_eq!(slave.leave(1, head(0x20), Way::Out, Some(4)), Some(1));
        assert_eq!((slave.status(), slave.copy()), (0x1400, Some(2)));
        assert_eq!(slave.arrive(2, head(0xA0)), Way::Drop);
        assert_eq!(slave.status(), 0x1C00);
        slave.command(0x4100, false);
        assert_eq!((slave.status(), slave.mode()), (0x4000, Mode::FastForward));
        assert_eq!(slave.arrive(2, head(0xA0)), Way::Out);
        slave.new_phase();
        assert_eq!(slave.status(), 0);
    }

    #[test]
    fn a_commanded_loop_and_a_stuck_acknowledgement() {
        let mut slave = Topology::new([true, true]);
        slave.arrive(2, head(0xA0));
        slave.command(0x6100, true);
        assert_eq!((slave.mode(), slave.status()), (Mode::LoopSecondary, 0x2400));
        assert_eq!(slave.arrive(1, head(0x20)), Way::Drop);
        assert_eq!(slave.status(), 0x2800);
        slave.quiet_end = true;
        slave.arrive(2, head(0xA0));
        assert_eq!(slave.leave(2, head(0xA0), Way::Out, Some(4)), Some(2));
        assert_eq!(slave.copy(), None);
    }

    #[test]
    fn nothing_is_looped_back_in_nrt() {
        let mut slave = Topology::new([true, false]);
        assert_eq!(slave.leave(1, head(0x20), Way::Out, None), None);
        assert_eq!(slave.leave(2, head(0x20), Way::Out, None), Some(1));
    }
}
