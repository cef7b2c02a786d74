//! Event data block of both directions, clauses 6-2.7.1.2.4 and 6-2.7.2.1.7.
//!
//! | C-to-D | D-to-C |
//! |---|---|
//! | event checking control u32 | event checking status u32 |
//! | extended: registration, home, watch data set u8 each, reserved | extended: the same three octets as acks, reserved |
//! | extended: registration, home, watch event data | |
//! | per acknowledgement: event ID u8, status u8; padded to 32 bits | per notification: ID, status, type u8, reserved, position i32, time u64 |
//!
//! In the first word bits 30..28 count the acknowledgements or notifications, bit 31 is the extended format.

use arrayvec::ArrayVec;
use core::fmt;

use super::codes::{EventChecking, EventType};
use super::value::{ReadValue, WriteValue, invalid};
use crate::wire::{Error, Reader, Writer};

/// Most acknowledgements or notifications in one block: the count has three bits.
pub const MAX_EVENTS: usize = 7;
/// Octets of one notification.
pub const NOTIFICATION_LEN: usize = 16;
/// Octets of the longest C-to-D block of the basic format: [`MAX_EVENTS`] acknowledgements, padded.
pub const COMMAND_EVENTS_MAX: usize = 4 + 16;
/// Octets of the longest D-to-C block without notifications.
pub const ACTUAL_EVENTS_BARE: usize = 4 + 4;
const BLOCK: &str = "event block";
const CHECKING_MASK: u32 = 0x0FFF_FFFF;
const COUNT_SHIFT: u32 = 28;
const COUNT_MASK: u32 = 0b111;
const EXTENDED: u32 = 1 << 31;

/// Registration window, Table 6-2.32. Unit: position control units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Upper limit.
    pub max: i32,
    /// Lower limit.
    pub min: i32,
}

/// Parameters of extended event checking; the present ones make up the three data sets.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExtendedEventData {
    /// Windows of registration 1 positive, 1 negative, 2 positive, 2 negative.
    pub windows: [Option<Window>; 4],
    /// Home Torque Threshold, % of rated torque.
    pub home_torque_threshold: Option<f32>,
    /// Home Torque Time, seconds.
    pub home_torque_time: Option<f32>,
    /// Watch 1 and Watch 2 Position, position control units.
    pub watch_positions: [Option<i32>; 2],
}

impl Window {
    /// Whether a position lies within the limits, which belong to the window. Positions roll over, so a window whose
    /// lower limit is above the upper one reaches around the end of the range.
    #[must_use]
    pub const fn contains(self, position: i32) -> bool {
        let above = position.wrapping_sub(self.min).cast_unsigned();
        above <= self.max.wrapping_sub(self.min).cast_unsigned()
    }
}

impl EventChecking {
    /// The four registration edges.
    pub const REGISTRATION: Self = Self::from_bits_retain(0x0000_000F);
    /// The window checks of the registration edges.
    pub const WINDOWS: Self = Self::from_bits_retain(0x0000_00F0);
    /// Auto-rearm of the registration edges.
    pub const REARMS: Self = Self::from_bits_retain(0x0000_0F00);
    /// Both directions of both watch positions.
    pub const WATCHES: Self = Self::from_bits_retain(0x0000_F000);
    /// Everything that stands for an event type of its own.
    pub const EVENTS: Self = Self::from_bits_retain(0x01FF_F00F);
    /// What only the extended format has, and only an axis whose device does the scaling (Table 5-2.36).
    pub const EXTENDED: Self = Self::WINDOWS.union(Self::WATCHES).union(Self::HOME_TORQUE);

    /// The window checks that belong to the registration edges among these bits.
    #[must_use]
    pub const fn windows(self) -> Self {
        Self::from_bits_retain((self.bits() & Self::REGISTRATION.bits()) << 4)
    }

    /// The auto-rearm bits that belong to the registration edges among these bits.
    #[must_use]
    pub const fn rearms(self) -> Self {
        Self::from_bits_retain((self.bits() & Self::REGISTRATION.bits()) << 8)
    }
}

impl EventType {
    /// The bit of Event Checking Control that arms it; `None` for a code that is not of the standard.
    #[must_use]
    pub const fn checking(self) -> Option<EventChecking> {
        Some(EventChecking::from_bits_retain(match self.0 {
            code @ 0..=3 => 1 << code,
            code @ 4..=12 => 1 << (code + 12),
            code @ 13..=16 => 1 << (code - 1),
            _ => return None,
        }))
    }
}

/// Echo of the three data sets in the D-to-C block.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ExtendedAck {
    /// Registration Data Ack.
    pub registration: u8,
    /// Home Data Ack.
    pub home: u8,
    /// Watch Data Ack.
    pub watch: u8,
}

/// Acknowledgement of one event by the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventAck {
    /// Event ID of the notification.
    pub event_id: u8,
    /// 0 if the controller has processed it; otherwise it has to be sent again.
    pub status: u8,
}

/// Notification of one event by the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventNotification {
    /// Event ID, incremented per event.
    pub event_id: u8,
    /// 0 if the event was detected, otherwise an error that prevents it.
    pub status: u8,
    /// What happened.
    pub event_type: EventType,
    /// Position at the event, position control units; 0 with an error.
    pub position: i32,
    /// System time of the event, ns; 0 with an error.
    pub time_stamp: u64,
}

/// Event data block of the C-to-D connection.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CommandEvents {
    /// Events to check for.
    pub checking: EventChecking,
    /// Parameters, in the extended format only.
    pub extended: Option<ExtendedEventData>,
    /// Acknowledgements.
    pub acks: ArrayVec<EventAck, MAX_EVENTS>,
}

/// Event data block of the D-to-C connection.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ActualEvents {
    /// Events that are being checked for.
    pub checking: EventChecking,
    /// Acknowledged parameters, in the extended format only.
    pub extended: Option<ExtendedAck>,
    /// Notifications.
    pub notifications: ArrayVec<EventNotification, MAX_EVENTS>,
}

/// Splits the first word into checking bits, count and extended bit.
fn split(word: u32) -> (EventChecking, u32, bool) {
    let count = (word >> COUNT_SHIFT) & COUNT_MASK;
    (EventChecking::from_bits_retain(word & CHECKING_MASK), count, word & EXTENDED != 0)
}

fn join(checking: EventChecking, count: usize, extended: bool) -> u32 {
    let count = u32::try_from(count).unwrap_or(COUNT_MASK) & COUNT_MASK;
    (checking.bits() & CHECKING_MASK) | (count << COUNT_SHIFT) | if extended { EXTENDED } else { 0 }
}

fn bits<const N: usize>(present: [bool; N]) -> u8 {
    present.iter().enumerate().fold(0, |set, (bit, is)| set | (u8::from(*is) << bit))
}

impl ExtendedEventData {
    /// Whether threshold and time are finite numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        [self.home_torque_threshold, self.home_torque_time].iter().flatten().all(|value| value.is_finite())
    }

    /// The Registration, Home and Watch Data Set octets that the present values give.
    #[must_use]
    pub fn data_sets(&self) -> ExtendedAck {
        ExtendedAck {
            registration: bits(self.windows.map(|w| w.is_some())),
            home: bits([self.home_torque_threshold.is_some(), self.home_torque_time.is_some()]),
            watch: bits(self.watch_positions.map(|p| p.is_some())),
        }
    }

    /// Takes over the values that an update brings; the others stay.
    pub fn update(&mut self, new: &Self) {
        for (held, new) in self.windows.iter_mut().zip(new.windows) {
            *held = new.or(*held);
        }
        self.home_torque_threshold = new.home_torque_threshold.or(self.home_torque_threshold);
        self.home_torque_time = new.home_torque_time.or(self.home_torque_time);
        for (held, new) in self.watch_positions.iter_mut().zip(new.watch_positions) {
            *held = new.or(*held);
        }
    }

    fn len(&self) -> usize {
        let sets = self.data_sets();
        let ones = |set: u8| usize::try_from(set.count_ones()).unwrap_or(0);
        4 + 8 * ones(sets.registration) + 4 * ones(sets.home) + 4 * ones(sets.watch)
    }

    fn parse(reader: &mut Reader<'_>) -> Result<Self, Error> {
        let offset = reader.offset();
        let [registration, home, watch, _] = reader.array(BLOCK)?;
        for (what, at, set, known) in [
            ("registration data set", offset, registration, 0b1111),
            ("home data set", offset + 1, home, 0b11),
            ("watch data set", offset + 2, watch, 0b11),
        ] {
            if set & !known != 0 {
                return Err(invalid(what, at, set, set & known));
            }
        }
        let mut data = Self::default();
        for (bit, window) in data.windows.iter_mut().enumerate() {
            if registration & (1 << bit) != 0 {
                *window = Some(Window { max: reader.i32(BLOCK)?, min: reader.i32(BLOCK)? });
            }
        }
        data.home_torque_threshold = (home & 1 != 0).then(|| reader.f32(BLOCK)).transpose()?;
        data.home_torque_time = (home & 2 != 0).then(|| reader.f32(BLOCK)).transpose()?;
        for (bit, position) in data.watch_positions.iter_mut().enumerate() {
            if watch & (1 << bit) != 0 {
                *position = Some(reader.i32(BLOCK)?);
            }
        }
        Ok(data)
    }

    fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let sets = self.data_sets();
        writer.slice(BLOCK, &[sets.registration, sets.home, sets.watch, 0])?;
        for window in self.windows.iter().flatten() {
            writer.i32(BLOCK, window.max)?;
            writer.i32(BLOCK, window.min)?;
        }
        for value in [self.home_torque_threshold, self.home_torque_time].into_iter().flatten() {
            writer.f32(BLOCK, value)?;
        }
        for position in self.watch_positions.iter().flatten() {
            writer.i32(BLOCK, *position)?;
        }
        Ok(())
    }
}

impl CommandEvents {
    /// Reads a block; `block` must hold exactly the block.
    ///
    /// # Errors
    /// The octets are too few or too many, or an extended data set has reserved bits.
    pub fn parse(block: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(block);
        let (checking, count, extended) = split(reader.u32(BLOCK)?);
        let extended = extended.then(|| ExtendedEventData::parse(reader)).transpose()?;
        let mut acks = ArrayVec::new();
        for _ in 0..count {
            acks.push(EventAck { event_id: reader.u8(BLOCK)?, status: reader.u8(BLOCK)? });
        }
        if count % 2 == 1 {
            reader.u16(BLOCK)?;
        }
        reader.finish(BLOCK)?;
        Ok(Self { checking, extended, acks })
    }

    /// The first word of the block: Event Checking Control with count and format, attribute 60.
    #[must_use]
    pub fn word(&self) -> u32 {
        join(self.checking, self.acks.len(), self.extended.is_some())
    }

    /// Octets that [`CommandEvents::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        4 + self.extended.map_or(0, |e| e.len()) + (2 * self.acks.len()).next_multiple_of(4)
    }

    /// Writes the block.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u32(BLOCK, self.word())?;
        self.extended.map_or(Ok(()), |e| e.emit(writer))?;
        for ack in &self.acks {
            writer.slice(BLOCK, &[ack.event_id, ack.status])?;
        }
        writer.zeros(BLOCK, 2 * (self.acks.len() % 2))
    }
}

impl ActualEvents {
    /// Reads a block; `block` must hold exactly the block.
    ///
    /// # Errors
    /// The octets are too few or too many.
    pub fn parse(block: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(block);
        let (checking, count, extended) = split(reader.u32(BLOCK)?);
        let extended = if extended {
            let [registration, home, watch, _] = reader.array(BLOCK)?;
            Some(ExtendedAck { registration, home, watch })
        } else {
            None
        };
        let mut notifications = ArrayVec::new();
        for _ in 0..count {
            let [event_id, status, event_type, _] = reader.array(BLOCK)?;
            notifications.push(EventNotification {
                event_id,
                status,
                event_type: EventType(event_type),
                position: reader.i32(BLOCK)?,
                time_stamp: reader.u64(BLOCK)?,
            });
        }
        reader.finish(BLOCK)?;
        Ok(Self { checking, extended, notifications })
    }

    /// The first word of the block: Event Checking Status with count and format, attribute 61.
    #[must_use]
    pub fn word(&self) -> u32 {
        join(self.checking, self.notifications.len(), self.extended.is_some())
    }

    /// Octets that [`ActualEvents::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        4 + 4 * usize::from(self.extended.is_some()) + NOTIFICATION_LEN * self.notifications.len()
    }

    /// Writes the block.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u32(BLOCK, self.word())?;
        if let Some(ack) = self.extended {
            writer.slice(BLOCK, &[ack.registration, ack.home, ack.watch, 0])?;
        }
        for n in &self.notifications {
            writer.slice(BLOCK, &[n.event_id, n.status, n.event_type.0, 0])?;
            writer.i32(BLOCK, n.position)?;
            writer.u64(BLOCK, n.time_stamp)?;
        }
        Ok(())
    }
}

impl fmt::Display for CommandEvents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Event Checking Control: {}", self.checking)?;
        if let Some(e) = &self.extended {
            for (name, window) in ["1 Pos", "1 Neg", "2 Pos", "2 Neg"].iter().zip(e.windows) {
                if let Some(w) = window {
                    writeln!(f, "      Reg {name} Window: {} to {}", w.min, w.max)?;
                }
            }
            for (name, value) in [("Threshold", e.home_torque_threshold), ("Time", e.home_torque_time)] {
                if let Some(value) = value {
                    writeln!(f, "      Home Torque {name}: {value}")?;
                }
            }
            for (number, position) in (1..).zip(e.watch_positions) {
                if let Some(position) = position {
                    writeln!(f, "      Watch {number} Position: {position}")?;
                }
            }
        }
        for ack in &self.acks {
            writeln!(f, "      Event {} acknowledged, status {}", ack.event_id, ack.status)?;
        }
        Ok(())
    }
}

impl fmt::Display for ActualEvents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Event Checking Status: {}", self.checking)?;
        if let Some(a) = self.extended {
            writeln!(
                f,
                "      Data Acks: registration 0x{:02X}, home 0x{:02X}, watch 0x{:02X}",
                a.registration, a.home, a.watch
            )?;
        }
        for n in &self.notifications {
            writeln!(
                f,
                "      Event {}: {}, status {}, position {}, at {} ns",
                n.event_id, n.event_type, n.status, n.position, n.time_stamp
            )?;
        }
        Ok(())
    }
}
