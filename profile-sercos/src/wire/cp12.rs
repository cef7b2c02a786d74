//! Telegrams of CP1 and CP2: 128 service channel slots, then 128 device words, in every MDT and AT.
//!
//! | byte | size | field |
//! |---|---|---|
//! | 0 | 128 x 6 | service channel slots |
//! | 768 | 128 x 4 | C-DEV (MDT) or S-DEV (AT), 2 bytes reserved |
//!
//! The slot of a slave follows from its topology address: telegram address / 128, place address % 128.
//! Place 0 of telegram 0 stays empty. There are two MDTs and two ATs (up to 255 slaves) or four and four
//! (up to 511).

use super::slot::{SLOT_LEN, SvcSlot};
use profile_generic::wire::{Error, need, put_u16, u16_at};

/// Slots in one telegram.
pub const SLOTS: usize = 128;
/// Bytes of the data field.
pub const LEN: usize = DEVICE_WORDS + SLOTS * DEVICE_LEN;

/// Offset of the first device word.
const DEVICE_WORDS: usize = SLOTS * SLOT_LEN;
/// Bytes of a device word and what is reserved behind it.
const DEVICE_LEN: usize = 4;

/// Where a slave finds its data in CP1 and CP2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Number of the MDT and of the AT, 0..=3.
    pub telegram: u8,
    /// Offset of the service channel slot in the data field.
    pub svc: usize,
    /// Offset of C-DEV (MDT) and S-DEV (AT) in the data field.
    pub device: usize,
}

/// The place of topology address `address`, or `None` outside 1..=511.
pub fn place(address: u16) -> Option<Place> {
    let address = usize::from(address);
    if address == 0 || address > super::cp0::SLAVES_MAX {
        return None;
    }
    let slot = address % SLOTS;
    let telegram = u8::try_from(address / SLOTS).ok()?;
    Some(Place { telegram, svc: slot * SLOT_LEN, device: DEVICE_WORDS + slot * DEVICE_LEN })
}

/// What belongs to one slave in a telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Slot {
    /// Service channel.
    pub svc: SvcSlot,
    /// C-DEV in an MDT, S-DEV in an AT.
    pub device: u16,
    /// Reserved word, as received.
    pub reserved: u16,
}

/// Data field of an MDT or AT in CP1 and CP2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repr {
    /// The slots in order of topology address.
    pub slots: [Slot; SLOTS],
}

impl Default for Repr {
    fn default() -> Self {
        Repr { slots: [Slot::default(); SLOTS] }
    }
}

impl Repr {
    /// Reads the data field. Fails unless there are at least 1280 bytes.
    pub fn parse(data: &[u8]) -> Result<Repr, Error> {
        need("telegram of CP1 or CP2", LEN, data.len())?;
        let mut repr = Repr::default();
        for (index, slot) in repr.slots.iter_mut().enumerate() {
            let device = DEVICE_WORDS + index * DEVICE_LEN;
            *slot = Slot {
                svc: SvcSlot::parse(&data[index * SLOT_LEN..])?,
                device: u16_at(data, device),
                reserved: u16_at(data, device + 2),
            };
        }
        Ok(repr)
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        LEN
    }

    /// Writes the data field.
    pub fn emit(&self, data: &mut [u8]) -> Result<(), Error> {
        need("telegram of CP1 or CP2", LEN, data.len())?;
        for (index, slot) in self.slots.iter().enumerate() {
            let device = DEVICE_WORDS + index * DEVICE_LEN;
            slot.svc.emit(&mut data[index * SLOT_LEN..])?;
            put_u16(data, device, slot.device);
            put_u16(data, device + 2, slot.reserved);
        }
        Ok(())
    }

    /// The slots that hold anything, with the topology addresses they have in telegram `number`.
    pub fn active(&self, number: u8) -> impl Iterator<Item = (u16, &Slot)> {
        let first = u16::from(number) * 128;
        (first..).zip(&self.slots).filter(|(_, slot)| **slot != Slot::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn places() {
        assert_eq!(place(0), None);
        assert_eq!(place(1), Some(Place { telegram: 0, svc: 6, device: 772 }));
        assert_eq!(place(127), Some(Place { telegram: 0, svc: 762, device: 1276 }));
        assert_eq!(place(128), Some(Place { telegram: 1, svc: 0, device: 768 }));
        assert_eq!(place(511), Some(Place { telegram: 3, svc: 762, device: 1276 }));
        assert_eq!(place(512), None);
        assert_eq!(LEN, 1280);
    }

    #[test]
    fn at_of_the_recording() {
        // Recording sercos3_startup_line2, frame 1431: attribute of S-0-1302.0.1 from both slaves.
        let mut bytes = [0; LEN];
        let svc = [9, 0, 1, 0, 1, 0];
        bytes[6..12].copy_from_slice(&svc);
        bytes[12..18].copy_from_slice(&svc);
        bytes[772..780].copy_from_slice(&[0x00, 0x01, 0, 0, 0x00, 0x11, 0, 0]);
        let repr = Repr::parse(&bytes).unwrap();
        let slot = Slot { svc: SvcSlot { word: 9, info: 0x0001_0001 }, device: 0x0100, reserved: 0 };
        let found: Vec<_> = repr.active(0).map(|(address, slot)| (address, *slot)).collect();
        assert_eq!(found, [(1, slot), (2, Slot { device: 0x1100, ..slot })]);
        assert_eq!(repr.active(1).next().unwrap().0, 129);
        let mut again = [0xA5; LEN];
        repr.emit(&mut again).unwrap();
        assert_eq!(again, bytes);
    }

    #[test]
    fn truncation_is_an_error_at_every_byte() {
        let mut bytes = [0; LEN];
        for len in 0..LEN {
            assert!(Repr::parse(&bytes[..len]).is_err());
            assert!(Repr::default().emit(&mut bytes[..len]).is_err());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn any_bytes_come_back(bytes in proptest::collection::vec(any::<u8>(), LEN)) {
            let mut again = [0xA5; LEN];
            Repr::parse(&bytes).unwrap().emit(&mut again).unwrap();
            prop_assert_eq!(&again[..], &bytes[..]);
        }
    }
}
