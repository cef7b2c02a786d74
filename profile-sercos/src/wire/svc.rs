//! The service channel (SVC): six bytes per slave in the MDT and in the AT.
//!
//! | offset | size | MDT | AT |
//! |---|---|---|---|
//! | 0 | 2 | SVC control word (C-SVC) | SVC status word (S-SVC) |
//! | 2 | 4 | master info | slave info |
//!
//! C-SVC: bit 0 MHS (toggle), bit 1 write, bit 2 last part of the element, bits 5..3 element.
//! S-SVC: bit 0 AHS (follows MHS), bit 1 busy, bit 2 error, bit 3 SVC valid.

use crate::generated::bits::svc_status;
use core::fmt;

use bitflags::bitflags;

use super::Error;
use profile_generic::wire::{need, put_u16, put_u32, u16_at, u32_at};

mod field {
    pub const WORD: usize = 0;
    pub const INFO: usize = WORD + 2;
    pub const END: usize = INFO + 4;

    pub use crate::generated::bits::svc_control::{
        ELEMENT as ELEMENT_MASK, END_OF_ELEMENT as LAST, MASTER_HANDSHAKE_MHS as MHS, READ_OR_WRITE as WRITE,
    };
    pub const ELEMENT_SHIFT: u32 = ELEMENT_MASK.trailing_zeros();
}

/// Length of one service channel in MDT and AT, bytes.
pub const SVC_LEN: usize = field::END;

/// Length of the head of a list or text: current length and maximum length, bytes.
pub const LIST_HEAD_LEN: usize = 4;

/// The part of a data block which a step addresses. All eight values have a meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Element {
    /// No element: the step closes the data block.
    Close = 0,
    /// Element 1: the IDN; writing it opens the data block, the answer carries the data status.
    Idn = 1,
    /// Element 2: name, text.
    Name = 2,
    /// Element 3: attribute.
    Attribute = 3,
    /// Element 4: unit, text.
    Unit = 4,
    /// Element 5: minimum input value.
    Minimum = 5,
    /// Element 6: maximum input value.
    Maximum = 6,
    /// Element 7: operation data.
    Data = 7,
}

impl Element {
    /// All elements by number.
    pub const ALL: [Element; 8] = [
        Element::Close,
        Element::Idn,
        Element::Name,
        Element::Attribute,
        Element::Unit,
        Element::Minimum,
        Element::Maximum,
        Element::Data,
    ];

    /// The element with this number, taken modulo 8.
    #[must_use]
    pub const fn from_number(number: u8) -> Element {
        Element::ALL[(number & 7) as usize]
    }

    /// The element's number, 0..=7.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Name as the standard has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Element::Close => "close",
            Element::Idn => "IDN",
            Element::Name => "name",
            Element::Attribute => "attribute",
            Element::Unit => "unit",
            Element::Minimum => "minimum",
            Element::Maximum => "maximum",
            Element::Data => "operation data",
        }
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// SVC control word (C-SVC). Bits 15..6 are kept as they came; masters send 0.
#[derive(Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct SvcControl(pub u16);

impl SvcControl {
    /// A word for a step of `element`.
    #[must_use]
    pub const fn new(mhs: bool, element: Element, write: bool, last: bool) -> SvcControl {
        let mut word = (element.number() as u16) << field::ELEMENT_SHIFT;
        if mhs {
            word |= field::MHS;
        }
        if write {
            word |= field::WRITE;
        }
        if last {
            word |= field::LAST;
        }
        SvcControl(word)
    }

    /// Handshake bit of the master; it toggles with every step.
    #[must_use]
    pub const fn mhs(self) -> bool {
        self.0 & field::MHS != 0
    }

    /// Whether the step writes the element.
    #[must_use]
    pub const fn write(self) -> bool {
        self.0 & field::WRITE != 0
    }

    /// Whether the step carries the last part of the element.
    #[must_use]
    pub const fn last(self) -> bool {
        self.0 & field::LAST != 0
    }

    /// The element addressed.
    #[must_use]
    pub const fn element(self) -> Element {
        Element::from_number(((self.0 & field::ELEMENT_MASK) >> field::ELEMENT_SHIFT).to_le_bytes()[0])
    }
}

impl fmt::Display for SvcControl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "MHS={} {} {}{}",
            u8::from(self.mhs()),
            if self.write() { "write" } else { "read" },
            self.element(),
            if self.last() { " last" } else { "" }
        )
    }
}

impl fmt::Debug for SvcControl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SvcControl({:#06x}: {self})", self.0)
    }
}

bitflags! {
    /// SVC status word (S-SVC). Reserved bits are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct SvcStatus: u16 {
        /// Handshake bit of the slave; equals MHS when the step has been taken over.
        const AHS = svc_status::SLAVE_HANDSHAKE_AHS;
        /// The step is still being worked on.
        const BUSY = svc_status::BUSY;
        /// The step failed; the info's low word is the error code.
        const ERROR = svc_status::ERROR;
        /// The service channel is alive.
        const VALID = svc_status::VALID;
        /// Reserved bits, transmitted as 0.
        const RESERVED = svc_status::RESERVED;
    }
}

/// Six bytes of the service channel in the MDT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct MdtSvc {
    /// Control word.
    pub control: SvcControl,
    /// Master info: IDN or up to four bytes of the element.
    pub info: u32,
}

impl MdtSvc {
    /// Reads the six bytes at the start of `bytes`; fails when there are fewer.
    pub fn parse(bytes: &[u8]) -> Result<MdtSvc, Error> {
        need("MDT service channel", SVC_LEN, bytes.len())?;
        Ok(MdtSvc { control: SvcControl(u16_at(bytes, field::WORD)), info: u32_at(bytes, field::INFO) })
    }

    /// Bytes written by [`MdtSvc::emit`].
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        SVC_LEN
    }

    /// Writes six bytes at the start of `bytes`; fails when there are fewer.
    pub fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        need("MDT service channel", SVC_LEN, bytes.len())?;
        put_u16(bytes, field::WORD, self.control.0);
        put_u32(bytes, field::INFO, self.info);
        Ok(())
    }
}

impl fmt::Display for MdtSvc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "C-SVC {} info {:#010x}", self.control, self.info)
    }
}

/// Six bytes of the service channel in the AT.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct AtSvc {
    /// Status word.
    pub status: SvcStatus,
    /// Slave info: data status, up to four bytes of the element, or an error code.
    pub info: u32,
}

impl AtSvc {
    /// Reads the six bytes at the start of `bytes`; fails when there are fewer.
    pub fn parse(bytes: &[u8]) -> Result<AtSvc, Error> {
        need("AT service channel", SVC_LEN, bytes.len())?;
        Ok(AtSvc {
            status: SvcStatus::from_bits_retain(u16_at(bytes, field::WORD)),
            info: u32_at(bytes, field::INFO),
        })
    }

    /// Bytes written by [`AtSvc::emit`].
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        SVC_LEN
    }

    /// Writes six bytes at the start of `bytes`; fails when there are fewer.
    pub fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        need("AT service channel", SVC_LEN, bytes.len())?;
        put_u16(bytes, field::WORD, self.status.bits());
        put_u32(bytes, field::INFO, self.info);
        Ok(())
    }

    /// The info's low word: data status, two-byte value or error code.
    #[must_use]
    pub const fn info_word(&self) -> u16 {
        let bytes = self.info.to_le_bytes();
        u16::from_le_bytes([bytes[0], bytes[1]])
    }
}

impl fmt::Display for AtSvc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "S-SVC AHS={}{}{}{} info {:#010x}",
            u8::from(self.status.contains(SvcStatus::AHS)),
            if self.status.contains(SvcStatus::BUSY) { " busy" } else { "" },
            if self.status.contains(SvcStatus::ERROR) { " error" } else { "" },
            if self.status.contains(SvcStatus::VALID) { " valid" } else { "" },
            self.info
        )
    }
}

/// The first four bytes of a list or text: lengths in bytes, this head not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct ListHead {
    /// Bytes which the list has now.
    pub current: u16,
    /// Bytes which the list can have.
    pub max: u16,
}

impl ListHead {
    /// The head as it stands in the info field.
    #[must_use]
    pub const fn from_info(info: u32) -> ListHead {
        let bytes = info.to_le_bytes();
        ListHead {
            current: u16::from_le_bytes([bytes[0], bytes[1]]),
            max: u16::from_le_bytes([bytes[2], bytes[3]]),
        }
    }

    /// The info field with this head.
    #[must_use]
    pub const fn to_info(self) -> u32 {
        let (current, max) = (self.current.to_le_bytes(), self.max.to_le_bytes());
        u32::from_le_bytes([current[0], current[1], max[0], max[1]])
    }
}

impl fmt::Display for ListHead {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} bytes", self.current, self.max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn control_vectors() {
        // Frame of the startup recording, bytes, value.
        let vectors: &[(u32, [u8; 6], MdtSvc)] = &[
            (
                1401,
                [0x0E, 0x00, 0x16, 0x05, 0x01, 0x00],
                MdtSvc { control: SvcControl::new(false, Element::Idn, true, true), info: 0x0001_0516 },
            ),
            (
                1425,
                [0x1D, 0x00, 0x16, 0x05, 0x01, 0x00],
                MdtSvc { control: SvcControl::new(true, Element::Attribute, false, true), info: 0x0001_0516 },
            ),
            (
                2777,
                [0x3A, 0x00, 0x08, 0x00, 0x40, 0x00],
                MdtSvc { control: SvcControl::new(false, Element::Data, true, false), info: 0x0040_0008 },
            ),
            (
                2257,
                [0x07, 0x00, 0xE8, 0x03, 0x00, 0x00],
                MdtSvc { control: SvcControl::new(true, Element::Close, true, true), info: 0x3E8 },
            ),
            (
                3137,
                [0x2D, 0x00, 0xEE, 0x03, 0x00, 0x00],
                MdtSvc { control: SvcControl::new(true, Element::Minimum, false, true), info: 0x3EE },
            ),
        ];
        check_vectors!(vectors, MdtSvc, fixed);
    }

    #[test]
    fn status_vectors() {
        let vectors: &[(u32, [u8; 6], AtSvc)] = &[
            (
                1431,
                [0x09, 0x00, 0x01, 0x00, 0x01, 0x00],
                AtSvc { status: SvcStatus::VALID | SvcStatus::AHS, info: 0x0001_0001 },
            ),
            (1639, [0x08, 0x00, 0x03, 0x00, 0x00, 0x00], AtSvc { status: SvcStatus::VALID, info: 3 }),
        ];
        check_vectors!(vectors, AtSvc, fixed);
        // Bits by the S-SVC layout: AHS, busy, error, valid.
        let all = AtSvc::parse(&[0x0F, 0, 0x07, 0x70, 0, 0]).unwrap();
        assert_eq!(all.status, SvcStatus::AHS | SvcStatus::BUSY | SvcStatus::ERROR | SvcStatus::VALID,);
        assert_eq!(all.info_word(), 0x7007);
        assert_eq!(all.to_string(), "S-SVC AHS=1 busy error valid info 0x00007007");
    }

    #[test]
    fn list_head() {
        // Startup recording, frame 2239: six of 64 bytes.
        assert_eq!(ListHead::from_info(0x0040_0006), ListHead { current: 6, max: 64 });
        assert_eq!(ListHead { current: 6, max: 64 }.to_info(), 0x0040_0006);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn round_trips(bytes: [u8; SVC_LEN], word: u32) {
            let mut out = [0xA5; SVC_LEN];
            let mdt = MdtSvc::parse(&bytes).unwrap();
            mdt.emit(&mut out).unwrap();
            prop_assert_eq!(out, bytes);
            let at = AtSvc::parse(&bytes).unwrap();
            at.emit(&mut out).unwrap();
            prop_assert_eq!(out, bytes);
            prop_assert_eq!(ListHead::from_info(word).to_info(), word);
        }

        #[test]
        fn control_parts(mhs: bool, element in 0u8..8, write: bool, last: bool) {
            let word = SvcControl::new(mhs, Element::from_number(element), write, last);
            prop_assert_eq!(word.mhs(), mhs);
            prop_assert_eq!(word.element().number(), element);
            prop_assert_eq!(word.write(), write);
            prop_assert_eq!(word.last(), last);
            prop_assert_eq!(word.0 & !0x3F, 0);
        }
    }
}
