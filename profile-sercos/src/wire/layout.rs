//! Where things are in the telegrams of CP3 and CP4. The master chooses it and tells each slave its own part
//! in CP2: S-0-1009 to S-0-1014 and S-0-1050.x.3.

use core::fmt;
use core::ops::Range;

use super::extended::{EXTENDED_LEN, EXTENDED_OFFSET};
use super::header::{DATA_LEN_MAX, Kind, TELEGRAMS_MAX};
use super::hot_plug::HOT_PLUG_LEN;
use super::slot::SLOT_LEN;
use profile_generic::wire::Error;

/// Bytes of a device word.
pub const DEVICE_WORD_LEN: usize = 2;

/// A place in the telegrams of one kind: which of them, and the offset in its data field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Offset {
    /// Telegram number, 0..=3.
    pub telegram: u8,
    /// Offset in bytes from the start of the data field.
    pub offset: u16,
}

impl Offset {
    /// Reads S-0-1009, S-0-1011, S-0-1013 or S-0-1014: bits 15..12 telegram number, 11..0 offset.
    pub const fn from_parameter(word: u16) -> Offset {
        Offset { telegram: word.to_be_bytes()[0] >> 4, offset: word & 0x0FFF }
    }

    /// The value of S-0-1009, S-0-1011, S-0-1013 or S-0-1014.
    pub fn to_parameter(self) -> u16 {
        u16::from(self.telegram) << 12 | self.offset & 0x0FFF
    }

    /// Reads S-0-1050.x.3: bits 13..12 telegram number, bit 11 MDT, bits 10..0 offset.
    pub const fn from_assignment(word: u16) -> (Kind, Offset) {
        let kind = if word & 0x0800 != 0 { Kind::Mdt } else { Kind::At };
        (kind, Offset { telegram: word.to_be_bytes()[0] >> 4 & 3, offset: word & 0x07FF })
    }

    /// The value of S-0-1050.x.3 for a connection in telegrams of `kind`.
    pub fn to_assignment(self, kind: Kind) -> u16 {
        let mdt = if kind == Kind::Mdt { 0x0800 } else { 0 };
        u16::from(self.telegram & 3) << 12 | mdt | self.offset & 0x07FF
    }

    /// The bytes of a part of `len` bytes in the data field.
    pub fn range(self, len: usize) -> Range<usize> {
        let start = usize::from(self.offset);
        start..start + len
    }
}

impl fmt::Display for Offset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.telegram, self.offset)
    }
}

/// One connection in the telegrams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLayout {
    /// Number of the connection at its slave: x of S-0-1050.x.
    pub index: u8,
    /// In an MDT (the slave consumes) or in an AT (the slave produces, or another slave consumes).
    pub kind: Kind,
    /// Where its control word C-CON stands.
    pub at: Offset,
    /// Bytes with C-CON: S-0-1050.x.5.
    pub len: u16,
}

/// What belongs to one slave in the telegrams.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeviceLayout {
    /// Topology address, 1..=511.
    pub address: u16,
    /// S-0-1009, C-DEV in the MDTs.
    pub device_control: Option<Offset>,
    /// S-0-1011, S-DEV in the ATs.
    pub device_status: Option<Offset>,
    /// S-0-1013, service channel in the MDTs.
    pub svc_mdt: Option<Offset>,
    /// S-0-1014, service channel in the ATs.
    pub svc_at: Option<Offset>,
    /// Connections with a place.
    pub connections: Vec<ConnectionLayout>,
}

/// The telegrams of CP3 and CP4.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Layout {
    /// S-0-1010, data field lengths of the MDTs in bytes; 0 = the telegram is not sent.
    pub mdt_len: [u16; TELEGRAMS_MAX],
    /// S-0-1012, data field lengths of the ATs in bytes; 0 = the telegram is not sent.
    pub at_len: [u16; TELEGRAMS_MAX],
    /// The extended field in MDT0 is used: S-0-1032 bit 2.
    pub extended: bool,
    /// Parts of the slaves.
    pub devices: Vec<DeviceLayout>,
}

/// What stands in a region of a telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// Hot-plug field.
    HotPlug,
    /// Extended field.
    Extended,
    /// Service channel slot of the slave with this topology address.
    Svc {
        /// Topology address.
        address: u16,
    },
    /// C-DEV or S-DEV of the slave with this topology address.
    DeviceWord {
        /// Topology address.
        address: u16,
    },
    /// A connection, C-CON included.
    Connection {
        /// Topology address.
        address: u16,
        /// x of S-0-1050.x.
        index: u8,
    },
    /// Bytes to which the layout gives no meaning.
    Gap,
}

impl Layout {
    /// The telegrams of a master which sends nothing but hot-plug fields: nothing is known about the rest.
    pub fn unknown() -> Layout {
        Layout::default()
    }

    /// The regions of telegram `number` of `kind`, sorted and without holes, for a data field of `len` bytes.
    ///
    /// A connection that several slaves use in the same place (slave to slave) appears once.
    /// Fails when a region leaves the data field or when regions overlap.
    pub fn regions(&self, kind: Kind, number: u8, len: usize) -> Result<Vec<(Range<usize>, Region)>, Error> {
        let len = len.min(DATA_LEN_MAX);
        let mut regions = Vec::new();
        if number == 0 && len >= HOT_PLUG_LEN {
            regions.push((0..HOT_PLUG_LEN, Region::HotPlug));
        }
        if number == 0 && kind == Kind::Mdt && self.extended {
            regions.push((EXTENDED_OFFSET..EXTENDED_OFFSET + EXTENDED_LEN, Region::Extended));
        }
        for device in &self.devices {
            let address = device.address;
            let (svc, word) = match kind {
                Kind::Mdt => (device.svc_mdt, device.device_control),
                Kind::At => (device.svc_at, device.device_status),
            };
            let mut add = |place: Option<Offset>, len: usize, region: Region| {
                if let Some(place) = place.filter(|place| place.telegram == number) {
                    regions.push((place.range(len), region));
                }
            };
            add(svc, SLOT_LEN, Region::Svc { address });
            add(word, DEVICE_WORD_LEN, Region::DeviceWord { address });
            for connection in device.connections.iter().filter(|connection| connection.kind == kind) {
                let region = Region::Connection { address, index: connection.index };
                add(Some(connection.at), usize::from(connection.len), region);
            }
        }
        regions.sort_by_key(|(range, _)| (range.start, range.end));
        regions.dedup_by(|later, first| {
            later.0 == first.0
                && matches!((later.1, first.1), (Region::Connection { .. }, Region::Connection { .. }))
        });
        close_gaps(regions, len)
    }
}

/// Puts gaps between sorted regions; fails where they overlap or leave the data field.
fn close_gaps(
    regions: Vec<(Range<usize>, Region)>,
    len: usize,
) -> Result<Vec<(Range<usize>, Region)>, Error> {
    let mut whole = Vec::with_capacity(regions.len() * 2 + 1);
    let mut at = 0;
    for (range, region) in regions {
        if range.end > len {
            return Err(Error::truncated("telegram layout", 0, range.end, len));
        }
        if range.start < at {
            let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
            return Err(Error::invalid(
                "telegram layout: overlapping part",
                range.start,
                number(at),
                number(range.start),
            ));
        }
        if at < range.start {
            whole.push((at..range.start, Region::Gap));
        }
        at = range.end;
        whole.push((range, region));
    }
    if at < len {
        whole.push((at..len, Region::Gap));
    }
    Ok(whole)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use profile_generic::wire::Expected;

    /// The layout of recording sercos3_startup_line2, from the CP2 writes (frames 3209 to 3825).
    pub(crate) fn recording() -> Layout {
        let at = |offset| Some(Offset { telegram: 0, offset });
        let device = |address: u16| {
            let step = address - 1;
            DeviceLayout {
                address,
                device_control: at(26 + 2 * step),
                device_status: at(20 + 2 * step),
                svc_mdt: at(14 + 6 * step),
                svc_at: at(8 + 6 * step),
                connections: vec![
                    ConnectionLayout {
                        index: 0,
                        kind: Kind::Mdt,
                        at: Offset { telegram: 0, offset: 30 + 8 * step },
                        len: 8,
                    },
                    ConnectionLayout {
                        index: 1,
                        kind: Kind::At,
                        at: Offset { telegram: 0, offset: 24 + 12 * step },
                        len: 12,
                    },
                ],
            }
        };
        Layout {
            mdt_len: [46, 0, 0, 0],
            at_len: [48, 0, 0, 0],
            extended: false,
            devices: vec![device(1), device(2)],
        }
    }

    #[test]
    fn parameter_words() {
        // Recording sercos3_startup_line2: frame 3257 S-0-1009, frames 3657 and 3713 S-0-1050.0.3 and .1.3.
        let words = [(26, 0, 26), (0x3014, 3, 20)];
        for (word, telegram, offset) in words {
            assert_eq!(Offset::from_parameter(word), Offset { telegram, offset });
            assert_eq!(Offset { telegram, offset }.to_parameter(), word);
        }
        let words = [(0x081E, Kind::Mdt, 0, 30), (0x0018, Kind::At, 0, 24), (0x3801, Kind::Mdt, 3, 1)];
        for (word, kind, telegram, offset) in words {
            assert_eq!(Offset::from_assignment(word), (kind, Offset { telegram, offset }));
            assert_eq!(Offset { telegram, offset }.to_assignment(kind), word);
        }
    }

    #[test]
    fn regions_of_the_recording() {
        let regions = recording().regions(Kind::Mdt, 0, 46).unwrap();
        let wanted = [
            (0..8, Region::HotPlug),
            (8..14, Region::Gap),
            (14..20, Region::Svc { address: 1 }),
            (20..26, Region::Svc { address: 2 }),
            (26..28, Region::DeviceWord { address: 1 }),
            (28..30, Region::DeviceWord { address: 2 }),
            (30..38, Region::Connection { address: 1, index: 0 }),
            (38..46, Region::Connection { address: 2, index: 0 }),
        ];
        assert_eq!(regions, wanted);
        assert_eq!(recording().regions(Kind::At, 0, 48).unwrap().last().unwrap().0, 36..48);
        assert_eq!(recording().regions(Kind::At, 1, 48), Ok(vec![(0..48, Region::Gap)]));
        assert_eq!(Layout::unknown().regions(Kind::At, 0, 4), Ok(vec![(0..4, Region::Gap)]));
    }

    #[test]
    fn bad_layouts_are_refused() {
        assert_eq!(
            recording().regions(Kind::Mdt, 0, 45),
            Err(Error::truncated("telegram layout", 0, 46, 45))
        );
        let mut overlap = recording();
        overlap.devices[1].device_control = Some(Offset { telegram: 0, offset: 27 });
        assert!(matches!(
            overlap.regions(Kind::Mdt, 0, 46),
            Err(Error { offset: Some(27), expected: Expected::Value(28), found: 27, .. })
        ));
        overlap.devices[1].device_control = None;
        overlap.extended = true;
        overlap.devices[0].svc_mdt = Some(Offset { telegram: 0, offset: 10 });
        assert!(overlap.regions(Kind::Mdt, 0, 46).is_err());
    }

    #[test]
    fn a_connection_between_slaves_appears_once() {
        let mut layout = recording();
        let shared = layout.devices[0].connections[1];
        layout.devices[1].connections.push(ConnectionLayout { index: 2, ..shared });
        let regions = layout.regions(Kind::At, 0, 48).unwrap();
        assert_eq!(regions.iter().filter(|(range, _)| *range == (24..36)).count(), 1);
    }
}
