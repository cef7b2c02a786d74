//! Telegrams of CP3 and CP4, cut into parts by a [`Layout`].
//!
//! This is the form for tools that look at whole telegrams. Master and slave know their own offsets and read
//! and write at them in place.

use super::extended::Extended;
use super::header::Kind;
use super::hot_plug::HotPlug;
use super::layout::{Layout, Region};
use super::slot::SvcSlot;
use profile_generic::wire::{Error, need, put_u16, u16_at};

/// One part of a telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part<'a> {
    /// Hot-plug field.
    HotPlug(HotPlug),
    /// Extended field.
    Extended(Extended),
    /// Service channel slot of a slave.
    Svc {
        /// Topology address.
        address: u16,
        /// The slot.
        slot: SvcSlot,
    },
    /// C-DEV (MDT) or S-DEV (AT) of a slave.
    DeviceWord {
        /// Topology address.
        address: u16,
        /// The word.
        word: u16,
    },
    /// A connection of a slave.
    Connection {
        /// Topology address.
        address: u16,
        /// x of S-0-1050.x.
        index: u8,
        /// C-CON.
        control: u16,
        /// Values in order of S-0-1050.x.6, back to back.
        data: &'a [u8],
    },
    /// Bytes without meaning in this layout.
    Gap(&'a [u8]),
}

impl Part<'_> {
    /// Bytes of the part.
    pub fn len(&self) -> usize {
        match self {
            Part::HotPlug(field) => field.buffer_len(),
            Part::Extended(field) => field.buffer_len(),
            Part::Svc { slot, .. } => slot.buffer_len(),
            Part::DeviceWord { .. } => 2,
            Part::Connection { data, .. } => 2 + data.len(),
            Part::Gap(data) => data.len(),
        }
    }

    /// Whether the part has no bytes; only a gap can.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        match *self {
            Part::HotPlug(field) => field.emit(bytes)?,
            Part::Extended(field) => field.emit(bytes)?,
            Part::Svc { slot, .. } => slot.emit(bytes)?,
            Part::DeviceWord { word, .. } => put_u16(bytes, 0, word),
            Part::Connection { control, data, .. } => {
                put_u16(bytes, 0, control);
                bytes[2..2 + data.len()].copy_from_slice(data);
            }
            Part::Gap(data) => bytes[..data.len()].copy_from_slice(data),
        }
        Ok(())
    }
}

/// Data field of an MDT or AT in CP3 and CP4.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repr<'a> {
    /// The parts in order, without holes.
    pub parts: Vec<Part<'a>>,
}

impl<'a> Repr<'a> {
    /// Cuts the data field of telegram `number` of `kind` into its parts.
    ///
    /// Fails if the layout does not fit the data field or contradicts itself.
    pub fn parse(kind: Kind, number: u8, data: &'a [u8], layout: &Layout) -> Result<Repr<'a>, Error> {
        let mut parts = Vec::new();
        for (range, region) in layout.regions(kind, number, data.len())? {
            let bytes = &data[range];
            parts.push(match region {
                Region::HotPlug => Part::HotPlug(HotPlug::parse(bytes)?),
                Region::Extended => Part::Extended(Extended::parse(bytes)?),
                Region::Svc { address } => Part::Svc { address, slot: SvcSlot::parse(bytes)? },
                Region::DeviceWord { address } => Part::DeviceWord { address, word: u16_at(bytes, 0) },
                Region::Connection { address, index } => {
                    need("connection", 2, bytes.len())?;
                    Part::Connection { address, index, control: u16_at(bytes, 0), data: &bytes[2..] }
                }
                Region::Gap => Part::Gap(bytes),
            });
        }
        Ok(Repr { parts })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub fn buffer_len(&self) -> usize {
        self.parts.iter().map(Part::len).sum()
    }

    /// Writes the data field.
    pub fn emit(&self, data: &mut [u8]) -> Result<(), Error> {
        need("telegram of CP3 or CP4", self.buffer_len(), data.len())?;
        let mut at = 0;
        for part in &self.parts {
            part.emit(&mut data[at..])?;
            at += part.len();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::tests::recording;
    use super::*;
    use proptest::prelude::*;

    /// Recording sercos3_startup_line2, frame 5940: data field of AT0 as it comes back in CP4.
    const AT: [u8; 48] = [
        0, 0, 0, 0, 0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0x20, 0x01, 0x20, 0x11, 0x03, 0x70, 0x00,
        0x80, 0, 0, 0, 0, 0x78, 0, 0, 0, 0x03, 0x70, 0x00, 0x80, 0, 0, 0, 0, 0xF0, 0, 0, 0,
    ];

    #[test]
    fn at_of_the_recording() {
        let repr = Repr::parse(Kind::At, 0, &AT, &recording()).unwrap();
        let svc = SvcSlot { word: 8, info: 0 };
        let wanted = [
            Part::HotPlug(HotPlug::default()),
            Part::Svc { address: 1, slot: svc },
            Part::Svc { address: 2, slot: svc },
            Part::DeviceWord { address: 1, word: 0x0120 },
            Part::DeviceWord { address: 2, word: 0x1120 },
            Part::Connection { address: 1, index: 1, control: 0x7003, data: &AT[26..36] },
            Part::Connection { address: 2, index: 1, control: 0x7003, data: &AT[38..48] },
        ];
        assert_eq!(repr.parts, wanted);
        let mut again = [0xA5; 48];
        repr.emit(&mut again).unwrap();
        assert_eq!(again, AT);
        assert_eq!(repr.buffer_len(), AT.len());
    }

    #[test]
    fn truncation_is_an_error_at_every_byte() {
        let repr = Repr::parse(Kind::At, 0, &AT, &recording()).unwrap();
        for len in 0..AT.len() {
            assert!(Repr::parse(Kind::At, 0, &AT[..len], &recording()).is_err(), "{len}");
            assert!(repr.emit(&mut [0; 48][..len]).is_err(), "{len}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_come_back(bytes in proptest::collection::vec(any::<u8>(), 0..64), number in 0u8..4, at: bool) {
            let kind = if at { Kind::At } else { Kind::Mdt };
            for layout in [recording(), Layout::unknown()] {
                if let Ok(repr) = Repr::parse(kind, number, &bytes, &layout) {
                    let mut again = vec![0xA5; bytes.len()];
                    repr.emit(&mut again).unwrap();
                    prop_assert_eq!(&again, &bytes);
                }
            }
        }
    }
}
