//! The Ethernet frame, the SERCOS header with its CRC, and reading and writing at offsets of the data field.
//!
//! Nothing here can panic: each access names its place and comes back empty when the frame is too short.

/// Bytes before the data field: two addresses, the type of the frame, and the SERCOS header.
pub const DATA_START: usize = 20;
/// The Ethernet type of SERCOS III.
pub const ETHER_TYPE: u16 = 0x88CD;
/// The shortest data field a frame may carry.
pub const DATA_MIN: usize = 40;
/// The longest data field a frame may carry.
pub const DATA_MAX: usize = 1494;
/// The data field of each telegram in CP1 and CP2.
pub const DATA_CP12: usize = 1280;

/// C-DEV: the topology change toggle.
pub const C_DEV_TOPOLOGY_TOGGLE: u16 = 1 << 14;
/// C-DEV: the master is valid.
pub const C_DEV_MASTER_VALID: u16 = 1 << 8;
/// S-DEV: more than half of the allowed MST were lost.
pub const S_DEV_WARNING: u16 = 1 << 15;
/// S-DEV: the acknowledgement of the topology change.
pub const S_DEV_TOPOLOGY_TOGGLE: u16 = 1 << 14;
/// S-DEV: a connection is in error.
pub const S_DEV_CONNECTION: u16 = 1 << 9;
/// S-DEV: the slave is valid.
pub const S_DEV_VALID: u16 = 1 << 8;
/// S-DEV: class 1 diagnostic.
pub const S_DEV_C1D: u16 = 1 << 7;
/// S-DEV: class 2 diagnostic.
pub const S_DEV_C2D: u16 = 1 << 6;
/// S-DEV: a procedure command has changed.
pub const S_DEV_COMMAND: u16 = 1 << 5;
/// S-DEV: the parameterization level is active.
pub const S_DEV_PARAMETERIZATION: u16 = 1 << 4;

/// Primary or secondary: which way round the master sent the telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The telegrams the master sends on its first port.
    Primary,
    /// The telegrams the master sends on its second port.
    Secondary,
}

impl Channel {
    /// 0 for primary, 1 for secondary.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::Primary => 0,
            Self::Secondary => 1,
        }
    }
}

/// The header of a telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// P or S.
    pub channel: Channel,
    /// An AT, else an MDT.
    pub at: bool,
    /// The number of the telegram, 0 to 3.
    pub number: u8,
    /// A phase switch is pending.
    pub cps: bool,
    /// The cycle counter, 0 to 7.
    pub cycle: u8,
    /// The field of the phase as it stands, 0 to 15. Phases above 4 do not exist.
    pub phase: u8,
    /// The type byte as it stands.
    pub type_byte: u8,
    /// The phase byte as it stands.
    pub phase_byte: u8,
}

/// Why a frame has no header that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reject {
    /// The Ethernet type is another one, or there is none.
    NotSercos,
    /// The frame ends within the header.
    Short,
    /// The CRC over the first sixteen bytes is wrong.
    Crc,
}

/// The ordinary CRC-32 of Ethernet over these bytes.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// Reads the header of a frame.
///
/// # Errors
/// The reason why these bytes are no telegram.
pub fn header(frame: &[u8], check_crc: bool) -> Result<Header, Reject> {
    let ether = frame.get(12..14).ok_or(Reject::NotSercos)?;
    if ether != ETHER_TYPE.to_be_bytes() {
        return Err(Reject::NotSercos);
    }
    let (Some(type_byte), Some(phase_byte)) = (frame.get(14), frame.get(15)) else {
        return Err(Reject::Short);
    };
    let crc =
        frame.get(16..20).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes).ok_or(Reject::Short)?;
    let covered = frame.get(..16).ok_or(Reject::Short)?;
    if check_crc && crc != crc32(covered) {
        return Err(Reject::Crc);
    }
    Ok(Header {
        channel: if type_byte & 0x80 == 0 { Channel::Primary } else { Channel::Secondary },
        at: type_byte & 0x40 != 0,
        number: type_byte & 0x03,
        cps: phase_byte & 0x80 != 0,
        cycle: phase_byte >> 4 & 7,
        phase: phase_byte & 0x0F,
        type_byte: *type_byte,
        phase_byte: *phase_byte,
    })
}

/// A telegram as a master would send it: for tests and small masters.
#[must_use]
pub fn build(source: [u8; 6], type_byte: u8, phase_byte: u8, data: &[u8]) -> Vec<u8> {
    let mut frame = vec![0xFF; 6];
    frame.extend_from_slice(&source);
    frame.extend_from_slice(&ETHER_TYPE.to_be_bytes());
    frame.extend_from_slice(&[type_byte, phase_byte]);
    let crc = crc32(&frame);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame.extend_from_slice(data);
    frame
}

/// A place in the data field: the number of the telegram and the offset in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// The telegram, 0 to 3 for what exists.
    pub telegram: u8,
    /// The offset, from byte 20 of the frame on.
    pub offset: u16,
}

impl Place {
    /// From S-0-1009, 1011, 1013 and 1014: bits 15..12 the telegram, the rest the offset.
    #[must_use]
    pub fn from_offset_word(word: u16) -> Self {
        Self { telegram: low_byte(word >> 12), offset: word & 0x07FF }
    }

    /// From S-0-1050.x.3: bits 13..12 the telegram, bit 11 tells an MDT, the rest the offset.
    #[must_use]
    pub fn from_assignment(word: u16) -> (bool, Self) {
        (word & 0x0800 != 0, Self { telegram: low_byte(word >> 12 & 3), offset: word & 0x07FF })
    }

    /// The index of its first byte in the frame.
    #[must_use]
    pub fn index(self) -> usize {
        DATA_START + usize::from(self.offset)
    }
}

/// The low byte of a word.
#[must_use]
pub fn low_byte(word: u16) -> u8 {
    word.to_le_bytes()[0]
}

/// Reads a word at an index of the frame.
#[must_use]
pub fn get_u16(frame: &[u8], index: usize) -> Option<u16> {
    frame.get(index..index.checked_add(2)?)?.try_into().ok().map(u16::from_le_bytes)
}

/// Reads four bytes at an index of the frame.
#[must_use]
pub fn get_u32(frame: &[u8], index: usize) -> Option<u32> {
    frame.get(index..index.checked_add(4)?)?.try_into().ok().map(u32::from_le_bytes)
}

/// Writes bytes at an index of the frame. False, and nothing written, when they do not fit.
pub fn put(frame: &mut [u8], index: usize, bytes: &[u8]) -> bool {
    let Some(end) = index.checked_add(bytes.len()) else { return false };
    match frame.get_mut(index..end) {
        Some(field) => {
            field.copy_from_slice(bytes);
            true
        }
        None => false,
    }
}

/// Where a slave's fields are in CP1 and CP2: by its topology address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedSlot {
    /// The telegram with this slot.
    pub telegram: u8,
    /// The index of the service channel in the frame.
    pub svc: usize,
    /// The index of the device word in the frame.
    pub dev: usize,
}

impl FixedSlot {
    /// The slot of a topology address. Slot 0 of telegram 0 belongs to nobody.
    #[must_use]
    pub fn new(topology: u16) -> Option<Self> {
        if topology == 0 || topology > 511 {
            return None;
        }
        let k = usize::from(topology % 128);
        Some(Self {
            telegram: low_byte(topology / 128),
            svc: DATA_START + 6 * k,
            dev: DATA_START + 768 + 4 * k,
        })
    }
}

/// The hot-plug field in front of MDT0 in CP3 and CP4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HotPlug {
    /// Whom the master means: bits 11..0 the address, FFFh all.
    pub selection: u16,
    /// Bits 15, 9, 8 and the code of the parameter.
    pub control: u16,
    /// The value of the parameter.
    pub info: u32,
}

impl HotPlug {
    /// Reads it from a whole frame.
    #[must_use]
    pub fn read(frame: &[u8]) -> Option<Self> {
        Some(Self {
            selection: get_u16(frame, DATA_START)?,
            control: get_u16(frame, DATA_START + 2)?,
            info: get_u32(frame, DATA_START + 4)?,
        })
    }

    /// The code of the parameter that is told.
    #[must_use]
    pub fn code(self) -> u8 {
        low_byte(self.control)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first MDT0 of the recording of a foreign master, CP0.
    const MDT0_CP0: [u8; 24] = [
        0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F, 0x88, 0xCD, 0x20, 0x00, 0xF0,
        0x5E, 0xB0, 0x3A, 0x01, 0x00, 0x00, 0x00,
    ];

    #[test]
    fn the_header_of_a_recorded_mdt0_is_read() {
        let head = header(&MDT0_CP0, true).unwrap();
        assert_eq!(head.channel, Channel::Primary);
        assert!(!head.at && !head.cps);
        assert_eq!((head.number, head.phase, head.cycle), (0, 0, 0));
    }

    #[test]
    fn the_header_of_a_recorded_at_with_cps_is_read() {
        let bytes = [
            0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F, 0x88, 0xCD, 0x60, 0xD4,
            0x38, 0x07, 0x77, 0x4B,
        ];
        let head = header(&bytes, true).unwrap();
        assert!(head.at && head.cps);
        assert_eq!((head.phase, head.cycle, head.number), (4, 5, 0));
    }

    #[test]
    fn a_wrong_crc_is_refused_unless_nobody_checks_it() {
        for bit in 0..160 {
            let mut bytes = MDT0_CP0;
            bytes[bit / 8] ^= 1 << (bit % 8);
            let expected = if (96..112).contains(&bit) { Reject::NotSercos } else { Reject::Crc };
            assert_eq!(header(&bytes, true), Err(expected), "bit {bit}");
        }
        let mut bytes = MDT0_CP0;
        bytes[16] = 0;
        assert_eq!(header(&bytes, false).unwrap().phase, 0);
    }

    #[test]
    fn a_frame_cut_at_any_byte_of_its_header_is_refused() {
        for length in 0..20 {
            let expected = if length < 14 { Reject::NotSercos } else { Reject::Short };
            assert_eq!(header(&MDT0_CP0[..length], true), Err(expected), "{length} bytes");
        }
        assert!(header(&MDT0_CP0[..20], true).is_ok());
    }

    #[test]
    fn a_built_telegram_has_the_recorded_crc() {
        let frame = build([0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F], 0x60, 0x03, &[]);
        assert_eq!(frame[16..20], [0x4F, 0x40, 0xC0, 0x53]);
    }

    #[test]
    fn the_slots_of_cp1_follow_the_topology_address() {
        assert_eq!(FixedSlot::new(0), None);
        assert_eq!(FixedSlot::new(512), None);
        assert_eq!(FixedSlot::new(1), Some(FixedSlot { telegram: 0, svc: 26, dev: 792 }));
        assert_eq!(FixedSlot::new(128), Some(FixedSlot { telegram: 1, svc: 20, dev: 788 }));
        assert_eq!(FixedSlot::new(511).unwrap().telegram, 3);
        assert_eq!(FixedSlot::new(511).unwrap().dev + 4, DATA_START + DATA_CP12);
    }

    #[test]
    fn places_are_read_from_their_words() {
        assert_eq!(Place::from_offset_word(0x101A), Place { telegram: 1, offset: 26 });
        assert_eq!(Place::from_assignment(0x081E), (true, Place { telegram: 0, offset: 30 }));
        assert_eq!(Place::from_assignment(0x2018), (false, Place { telegram: 2, offset: 24 }));
    }

    #[test]
    fn nothing_is_written_where_it_does_not_fit() {
        let mut bytes = [0u8; 4];
        assert!(!put(&mut bytes, 3, &[1, 2]));
        assert!(!put(&mut bytes, usize::MAX, &[1, 2]));
        assert_eq!(bytes, [0; 4]);
        assert!(put(&mut bytes, 2, &[1, 2]));
        assert_eq!(get_u16(&bytes, 2), Some(0x0201));
        assert_eq!(get_u16(&bytes, 3), None);
        assert_eq!(get_u32(&bytes, usize::MAX), None);
    }

    #[test]
    fn the_recorded_hot_plug_field_is_read() {
        let data = [0xFF, 0x0F, 0x02, 0x80, 0xF8, 0xF2, 0x00, 0x00];
        let frame = build([0; 6], 0x20, 0x03, &data);
        let field = HotPlug::read(&frame).unwrap();
        assert_eq!((field.selection, field.code(), field.info), (0x0FFF, 2, 62_200));
        assert_eq!(HotPlug::read(&frame[..27]), None);
    }
}
