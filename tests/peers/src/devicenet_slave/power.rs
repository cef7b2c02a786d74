//! Power-on and the duplicate MAC ID check.

use super::DevicenetSlave;
use super::connection::Connection;
use super::drive::Drive;
use super::messages::{self, ExplicitIn};
use crate::can::Frame;

/// Where the slave is between power-on and being on line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Power {
    /// Nothing has been heard or ticked yet.
    Off,
    /// The first check is sent.
    First,
    /// The second check is sent.
    Second,
    /// On line.
    OnLine,
    /// Another station has the same MAC ID: it is silent for good.
    Conflict,
}

impl DevicenetSlave {
    fn switch_on(&mut self) {
        self.power = Power::First;
        self.power_us = self.now_us;
        self.restart_us = self.now_us;
        self.master = None;
        self.foreign = self.settings.foreign_master.is_some();
        self.explicit = Connection::none(1);
        self.explicit_in = ExplicitIn::default();
        self.explicit_out = None;
        self.poll = Connection::none(2);
        self.io_in.clear();
        self.later.clear();
        self.requests = 0;
        self.polls = 0;
        self.restart_asked = false;
        self.drive = Drive::new(&self.settings, self.now_us);
        if let Some(code) = self.failing {
            self.drive.fail(code);
        }
        self.write_log("power on");
    }

    fn dup_check(&self, mac: u8, answer: bool) -> Frame {
        let [vendor_low, vendor_high] = self.settings.vendor.to_le_bytes();
        let [a, b, c, d] = self.settings.serial.to_le_bytes();
        let first = if answer { 0x80 } else { 0 };
        Frame::new(messages::group2(mac, messages::DUP_CHECK), &[first, vendor_low, vendor_high, a, b, c, d])
    }

    /// Goes through power-on.
    pub(super) fn power_up(&mut self, out: &mut Vec<Frame>) {
        let wait = u64::from(self.settings.dup_check_ms) * 1000;
        if self.power == Power::Off {
            self.switch_on();
            if self.settings.skips_dup_check {
                self.power = Power::OnLine;
            } else {
                out.push(self.dup_check(self.settings.mac, false));
            }
        }
        if self.power == Power::First && self.now_us >= self.power_us + wait {
            self.power = Power::Second;
            self.power_us += wait;
            out.push(self.dup_check(self.settings.mac, false));
        }
        if self.power == Power::Second && self.now_us >= self.power_us + wait {
            self.power = Power::OnLine;
            self.write_log("on line");
        }
    }

    /// Takes a duplicate MAC ID check or an answer to one.
    pub(super) fn hear_dup_check(&mut self, mac: u8, data: &[u8], out: &mut Vec<Frame>) {
        let Some(&first) = data.first() else { return };
        let asks = first & 0x80 == 0;
        if self.settings.conflict_with == Some(mac) && asks {
            out.push(self.dup_check(mac, true));
        }
        if mac != self.settings.mac {
            return;
        }
        match self.power {
            Power::First | Power::Second => {
                self.power = Power::Conflict;
                self.write_log("another station has this MAC ID");
            }
            Power::OnLine if asks && !self.settings.ignores_dup_check => out.push(self.dup_check(mac, true)),
            _ => {}
        }
    }
}
