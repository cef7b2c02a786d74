//! One data or remote frame of ISO 11898-1, classic or FD.

use core::fmt;

/// Longest data field of a classic frame, bytes.
const CLASSIC_MAX: usize = 8;

/// Longest data field of an FD frame, bytes.
const FD_MAX: usize = 64;

/// Lengths that an FD frame can have beyond those of a classic one (ISO 11898-1, data length codes 9 to 15).
const FD_LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];

/// Identifier of a frame. The lower one wins the bus; of equal leading bits the standard one does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Id {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

impl Id {
    /// Largest identifier of 11 bits.
    pub const STANDARD_MAX: u16 = 0x7FF;

    /// Largest identifier of 29 bits.
    pub const EXTENDED_MAX: u32 = 0x1FFF_FFFF;

    /// Whether the number fits its kind.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        match self {
            Self::Standard(id) => id <= Self::STANDARD_MAX,
            Self::Extended(id) => id <= Self::EXTENDED_MAX,
        }
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard(id) => write!(f, "{id:03X}"),
            Self::Extended(id) => write!(f, "{id:08X}"),
        }
    }
}

/// Why bytes are no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The identifier has too many bits.
    #[error("expected an identifier of 11 or 29 bits, got {0}")]
    Id(Id),
    /// No frame of this kind has so many bytes.
    #[error("expected 0 to 8 bytes, or 12, 16, 20, 24, 32, 48 or 64 in an FD frame; got {0}")]
    Length(usize),
}

/// A data or remote frame, classic or FD.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    id: Id,
    len: u8,
    kind: Kind,
    data: [u8; FD_MAX],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Classic,
    Remote,
    Fd { fast: bool },
}

impl Frame {
    /// A classic data frame of 0 to 8 bytes.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn new(id: Id, data: &[u8]) -> Result<Self, FrameError> {
        if data.len() > CLASSIC_MAX {
            return Err(FrameError::Length(data.len()));
        }
        Self::build(id, Kind::Classic, data, data.len())
    }

    /// An FD data frame; `fast` switches to the higher bit rate for the data (bit rate switch).
    ///
    /// # Errors
    /// [`FrameError`]; FD has no frames of, say, 9 bytes.
    pub fn fd(id: Id, data: &[u8], fast: bool) -> Result<Self, FrameError> {
        if data.len() > CLASSIC_MAX && !FD_LENGTHS.contains(&data.len()) {
            return Err(FrameError::Length(data.len()));
        }
        Self::build(id, Kind::Fd { fast }, data, data.len())
    }

    /// A remote frame, which asks for `len` bytes, 0 to 8.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn remote(id: Id, len: usize) -> Result<Self, FrameError> {
        if len > CLASSIC_MAX {
            return Err(FrameError::Length(len));
        }
        Self::build(id, Kind::Remote, &[], len)
    }

    fn build(id: Id, kind: Kind, data: &[u8], len: usize) -> Result<Self, FrameError> {
        if !id.is_valid() {
            return Err(FrameError::Id(id));
        }
        let mut bytes = [0; FD_MAX];
        bytes[..data.len()].copy_from_slice(data);
        Ok(Self { id, len: u8::try_from(len).map_err(|_| FrameError::Length(len))?, kind, data: bytes })
    }

    /// Its identifier.
    #[must_use]
    pub const fn id(&self) -> Id {
        self.id
    }

    /// Its data; a remote frame has none.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.is_remote() { &[] } else { &self.data[..usize::from(self.len)] }
    }

    /// Bytes of the data field; of a remote frame, those it asks for.
    #[must_use]
    pub fn len(&self) -> usize {
        usize::from(self.len)
    }

    /// Its data length code, 0 to 15: the length up to 8 bytes, behind that the place in the list of FD lengths.
    #[must_use]
    pub fn length_code(&self) -> u8 {
        let longer = FD_LENGTHS.iter().position(|&len| len == self.len());
        longer.and_then(|place| u8::try_from(place).ok()).map_or(self.len, |place| place + 9)
    }

    /// Whether it has no data.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether it is a remote frame.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        matches!(self.kind, Kind::Remote)
    }

    /// Whether it is an FD frame.
    #[must_use]
    pub const fn is_fd(&self) -> bool {
        matches!(self.kind, Kind::Fd { .. })
    }

    /// Whether it is an FD frame whose data go at the higher bit rate.
    #[must_use]
    pub const fn is_fast(&self) -> bool {
        matches!(self.kind, Kind::Fd { fast: true })
    }
}

/// As `candump` prints it: `181#27 06 00`, `##` for FD, `#R2` for a remote frame.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#", self.id)?;
        match self.kind {
            Kind::Remote => return write!(f, "R{}", self.len),
            Kind::Fd { fast } => write!(f, "#{}", u8::from(fast))?,
            Kind::Classic => {}
        }
        for (place, byte) in self.data().iter().enumerate() {
            let separator = if place == 0 { "" } else { " " };
            write!(f, "{separator}{byte:02X}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Frame({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_lengths_of_iso_11898() {
        let id = Id::Standard(0x181);
        let classic = (0..=64).filter(|&len| Frame::new(id, &[0; 64][..len]).is_ok());
        assert_eq!(classic.collect::<Vec<_>>(), (0..=8).collect::<Vec<_>>());
        let fd = (0..=64).filter(|&len| Frame::fd(id, &[0; 64][..len], true).is_ok());
        assert_eq!(fd.collect::<Vec<_>>(), (0..=8).chain(FD_LENGTHS).collect::<Vec<_>>());
        let codes = [8, 12, 16, 20, 24, 32, 48, 64]
            .map(|len| Frame::fd(id, &[0; 64][..len], true).unwrap().length_code());
        assert_eq!(codes, [8, 9, 10, 11, 12, 13, 14, 15]);
        assert_eq!(Frame::remote(id, 5).unwrap().length_code(), 5);
        assert_eq!(Frame::new(id, &[0; 9]), Err(FrameError::Length(9)));
        assert_eq!(Frame::remote(id, 9), Err(FrameError::Length(9)));
    }

    #[test]
    fn identifiers_have_eleven_or_twenty_nine_bits() {
        let ok = |id| Frame::new(id, &[]).map(|frame| frame.id());
        for id in [Id::Standard(0x7FF), Id::Extended(0), Id::Extended(0x1FFF_FFFF)] {
            assert_eq!(ok(id), Ok(id));
        }
        for id in [Id::Standard(0x800), Id::Extended(0x2000_0000)] {
            assert_eq!(ok(id), Err(FrameError::Id(id)));
        }
    }

    #[test]
    fn frames_print_as_candump_does() {
        let id = Id::Standard(0x81);
        let all = [
            Frame::new(id, &[0x27, 6, 0]),
            Frame::new(Id::Extended(0x1234), &[]),
            Frame::remote(id, 2),
            Frame::fd(id, &[1; 12], true),
        ];
        let all = all.map(|frame| frame.unwrap().to_string());
        assert_eq!(all, ["081#27 06 00", "00001234#", "081#R2", "081##101 01 01 01 01 01 01 01 01 01 01 01"]);
        let remote = Frame::remote(id, 2).unwrap();
        assert_eq!((remote.data(), remote.len(), remote.is_remote()), (&[][..], 2, true));
    }
}
