//! The fixed format of the connection: the controller's block in, the drive's block out.

use std::collections::BTreeMap;

use super::super::settings::{CommandPosition, Settings, UpdateId};
use super::{
    ABORTING, DATA_FORMAT_ERROR, ILLEGAL_CONTROL_MODE, INITIALIZING, MotionDrive, PRE_CHARGE, STOPPING,
    UPDATE_FAULT, dint, dint_bytes, real, real_bytes,
};

impl MotionDrive {
    /// Takes a controller's block.
    pub fn consume(&mut self, settings: &Settings, data: &[u8]) {
        let Some(&[format, revision, update_id, node_control]) = data.get(..4) else { return };
        self.update_id = update_id;
        if format & 0x0F != 2 || revision != 2 {
            self.node_fault = DATA_FORMAT_ERROR;
            self.fall();
            return;
        }
        if !self.fresh(settings, update_id) {
            return;
        }
        let reset = node_control & 0x08 != 0 && self.node_control & 0x08 == 0;
        self.node_control = node_control;
        if reset && self.node_fault != 0 {
            self.node_fault = 0;
            if self.fault.is_none() {
                self.recover();
            }
        }
        if node_control & 0x05 != 0x05 {
            return;
        }
        let Some(&[mode, feedback, control, control_status, commands, actual, status, how]) = data.get(4..12)
        else {
            return;
        };
        self.class_values.insert(14, vec![node_control]);
        for (attribute, value) in [
            (40, mode),
            (42, feedback),
            (89, control_status),
            (91, commands),
            (90, actual),
            (94, status),
            (92, how),
        ] {
            self.values.insert(attribute, vec![value]);
        }
        self.feedback_mode = feedback;
        (self.actual_set, self.status_set) = (actual, status);
        if control_status & 1 != 0 {
            self.configured = true;
        }
        if self.mode != mode & 0x0F {
            self.mode = mode & 0x0F;
            self.command_acceleration = 0.0;
            self.command_torque = 0.0;
        }
        if settings.control_modes & (1 << self.mode) == 0 {
            self.trip(ILLEGAL_CONTROL_MODE, false);
        }
        self.commands(settings, commands, how, data.get(12..).unwrap_or(&[]));
        if self.state == INITIALIZING && (self.configured || !settings.waits_for_complete) {
            self.enter(PRE_CHARGE);
            if let Some(code) = self.cause {
                self.trip(code, false);
            }
        }
        self.control(settings, control);
    }

    /// Whether the block is another than the one before. Skipped ones are counted as lost.
    fn fresh(&mut self, settings: &Settings, update_id: u8) -> bool {
        let Some(last) = self.last_update.replace(update_id) else { return true };
        if last == update_id {
            return settings.takes_stale_updates;
        }
        let lost = update_id.wrapping_sub(last).wrapping_sub(1);
        let byte = |values: &BTreeMap<u16, Vec<u8>>, attribute: u16| {
            values.get(&attribute).and_then(|bytes| bytes.first().copied()).unwrap_or(0)
        };
        let sum = byte(&self.class_values, 32).wrapping_add(lost);
        self.class_values.insert(32, vec![sum]);
        let limit = byte(&self.class_values, 21);
        if limit > 0 && lost > limit {
            self.node_fault = UPDATE_FAULT;
            self.fall();
        }
        true
    }

    /// Takes the cyclic command data.
    fn commands(&mut self, settings: &Settings, set: u8, how: u8, data: &[u8]) {
        let mut at = 0;
        if set & 0x01 != 0 {
            let others = 4 * usize::try_from((set & 0xCE).count_ones()).unwrap_or(0);
            let wide = match settings.command_position {
                CommandPosition::Auto => (how >> 2) & 3 == 0 && data.len() >= 8 + others,
                CommandPosition::Dint => false,
                CommandPosition::Lreal => true,
            };
            if wide {
                if let Some(bytes) = data.get(..8).and_then(|bytes| <[u8; 8]>::try_from(bytes).ok()) {
                    let value = f64::from_le_bytes(bytes);
                    if value.is_finite() {
                        self.command_position = value;
                    }
                }
                at = 8;
            } else {
                if let Some(value) = dint(data, 0) {
                    // The DINT nearest to where the axis is: it counts on after its highest value.
                    let turn = 2_f64.powi(32);
                    self.command_position =
                        f64::from(value) + ((self.position - f64::from(value)) / turn).round() * turn;
                }
                at = 4;
            }
        }
        for (bit, attribute) in [(1, 362), (2, 363), (3, 364)] {
            if set & (1 << bit) == 0 {
                continue;
            }
            if let Some(value) = real(data, at) {
                self.values.insert(attribute, real_bytes(value).to_vec());
                match bit {
                    1 => self.command_velocity = value,
                    2 => self.command_acceleration = value,
                    _ => self.command_torque = value,
                }
            }
            at += 4;
        }
        at += if set & 0x40 != 0 { 4 } else { 0 };
        if set & 0x80 != 0 {
            self.displacement = dint(data, at).unwrap_or(0);
        }
    }

    /// The drive's block of this size.
    pub fn produce(&mut self, settings: &Settings, size: usize) -> Vec<u8> {
        let update_id = match settings.update_id {
            UpdateId::Echo => self.update_id,
            UpdateId::Fixed(id) => id,
            UpdateId::OwnCount => u8::try_from(self.polls & 0xFF).unwrap_or(0),
        };
        let mut block =
            vec![settings.connection_format, settings.format_revision, update_id, self.node_status()];
        if self.node_control & 0x05 == 0x05 {
            let (mode, feedback) = (self.byte(40), self.feedback_mode);
            block.extend([mode, feedback, self.response, self.response_status, 0, 0, 0, self.state]);
            self.actuals(settings, size, &mut block);
            self.statuses(settings, size, &mut block);
        }
        if self.fault.is_some_and(|fault| fault.one_poll) {
            self.fault = None;
            self.reset_source = 2;
            if self.state == ABORTING {
                self.enter(STOPPING);
            } else {
                self.recover();
            }
        }
        block
    }

    fn actuals(&self, _settings: &Settings, size: usize, block: &mut Vec<u8>) {
        for bit in [0, 1, 2, 6, 7] {
            let value = match bit {
                0 => dint_bytes(self.position),
                1 => real_bytes(self.velocity),
                2 => real_bytes(self.acceleration),
                6 => [0; 4],
                _ => self.displacement.to_le_bytes(),
            };
            if self.actual_set & (1 << bit) != 0 && block.len() + value.len() <= size {
                block[9] |= 1 << bit;
                block.extend(value);
            }
        }
    }

    fn statuses(&mut self, settings: &Settings, size: usize, block: &mut Vec<u8>) {
        for bit in 0..=4_u8 {
            let value = match bit {
                0 => {
                    let mut record = self.fault_record().to_vec();
                    record.extend(self.fault.map_or(0, |fault| fault.since_us * 1000).to_le_bytes());
                    record
                }
                1 | 4 => vec![0; 12],
                2 => [self.status().to_le_bytes(), [0; 4]].concat(),
                _ => vec![0; 8],
            };
            let asked = self.status_set & (1 << bit) != 0;
            let fresh = settings.status_always || self.told.get(&bit) != Some(&value);
            if asked && fresh && block.len() + value.len() <= size {
                block[10] |= 1 << bit;
                block.extend(&value);
                self.told.insert(bit, value);
            }
        }
    }
}
