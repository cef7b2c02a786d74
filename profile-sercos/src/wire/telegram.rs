//! A whole SERCOS frame.

use core::fmt;

use super::cp0;
use super::cp12;
use super::cyclic;
use super::header::{HEADER_LEN, Header, Kind, Phase};
use super::layout::Layout;
use profile_generic::wire::{Error, need};

/// The data field of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(clippy::large_enum_variant, reason = "a telegram is a value; none is kept in bulk")]
pub enum Body<'a> {
    /// MDT0 of CP0.
    Cp0Mdt(cp0::MdtRepr),
    /// AT0 of CP0.
    Cp0At(cp0::AtRepr),
    /// MDT or AT of CP1 and CP2.
    Cp12(cp12::Repr),
    /// MDT or AT of CP3 and CP4.
    Cyclic(cyclic::Repr<'a>),
}

/// A SERCOS frame: header, data field, and what Ethernet has appended to fill up the frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Header.
    pub header: Header,
    /// Data field.
    pub body: Body<'a>,
    /// Bytes behind the data field.
    pub trailer: &'a [u8],
}

/// Follows the phase of a network, frame by frame.
///
/// With CPS set a header shows the phase to come while the data field has the layout of the phase before; only
/// the frames before tell which one that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PhaseTracker {
    phase: Option<Phase>,
}

impl PhaseTracker {
    /// The phase whose layout the frame with `header` has.
    ///
    /// Before the first frame without CPS the phase below the announced one is taken.
    pub fn layout_phase(&mut self, header: &Header) -> Phase {
        let phase = header.phase.phase();
        if !header.phase.switching() {
            self.phase = Some(phase);
            return phase;
        }
        self.phase.unwrap_or(Phase(phase.0.saturating_sub(1)))
    }
}

impl<'a> Frame<'a> {
    /// Reads a frame whose data field has the layout of `phase`; `layout` is used in CP3 and CP4.
    ///
    /// Fails where [`Header::parse`] does, on a telegram that the phase does not have, and on a short or
    /// contradictory data field.
    pub fn parse(frame: &'a [u8], phase: Phase, layout: &Layout) -> Result<Frame<'a>, Error> {
        let header = Header::parse(frame)?;
        Frame::parse_body(header, frame, phase, layout)
    }

    /// Reads the data field of a frame whose header is known already.
    // Flat: one arm per phase and kind.
    pub fn parse_body(
        header: Header,
        frame: &'a [u8],
        phase: Phase,
        layout: &Layout,
    ) -> Result<Frame<'a>, Error> {
        need("SERCOS header", HEADER_LEN, frame.len())?;
        let data = &frame[HEADER_LEN..];
        let (kind, number) = (header.telegram.kind(), header.telegram.number());
        let body = match (phase, kind) {
            (Phase::CP0, _) if number > 0 => return Err(not_in_phase(number, 0)),
            (Phase::CP0, Kind::Mdt) => Body::Cp0Mdt(cp0::MdtRepr::parse(data)?),
            (Phase::CP0, Kind::At) => Body::Cp0At(cp0::AtRepr::parse(data)?),
            _ if number > 3 => return Err(not_in_phase(number, 3)),
            (Phase::CP1 | Phase::CP2, _) => Body::Cp12(cp12::Repr::parse(data)?),
            (Phase::CP3 | Phase::CP4, _) => {
                let lengths = match kind {
                    Kind::Mdt => layout.mdt_len,
                    Kind::At => layout.at_len,
                };
                let len = match usize::from(lengths[usize::from(number)]) {
                    0 => data.len(),
                    len => len,
                };
                need("telegram of CP3 or CP4", len, data.len())?;
                Body::Cyclic(cyclic::Repr::parse(kind, number, &data[..len], layout)?)
            }
            (Phase(found), _) => {
                let (found, expected) = (u32::from(found), u32::from(Phase::CP4.0));
                return Err(Error::invalid("communication phase", 15, expected, found));
            }
        };
        let trailer = &data[body.buffer_len().min(data.len())..];
        Ok(Frame { header, body, trailer })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + self.body.buffer_len() + self.trailer.len()
    }

    /// Writes the frame.
    pub fn emit(&self, frame: &mut [u8]) -> Result<(), Error> {
        need("SERCOS frame", self.buffer_len(), frame.len())?;
        self.header.emit(frame)?;
        let end = HEADER_LEN + self.body.buffer_len();
        self.body.emit(&mut frame[HEADER_LEN..end])?;
        frame[end..end + self.trailer.len()].copy_from_slice(self.trailer);
        Ok(())
    }
}

impl Body<'_> {
    /// Bytes of the data field.
    pub fn buffer_len(&self) -> usize {
        match self {
            Body::Cp0Mdt(repr) => repr.buffer_len(),
            Body::Cp0At(repr) => repr.buffer_len(),
            Body::Cp12(repr) => repr.buffer_len(),
            Body::Cyclic(repr) => repr.buffer_len(),
        }
    }

    fn emit(&self, data: &mut [u8]) -> Result<(), Error> {
        match self {
            Body::Cp0Mdt(repr) => repr.emit(data),
            Body::Cp0At(repr) => repr.emit(data),
            Body::Cp12(repr) => repr.emit(data),
            Body::Cyclic(repr) => repr.emit(data),
        }
    }
}

fn not_in_phase(number: u8, max: u32) -> Error {
    Error::invalid("telegram number", 14, max, u32::from(number))
}

impl fmt::Display for Frame<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} data bytes", self.header, self.body.buffer_len())
    }
}

#[cfg(test)]
mod tests {
    use super::super::header::{Channel, PhaseField, TelegramType};
    use super::*;
    use profile_generic::wire::Expected;
    use proptest::prelude::*;

    fn frame(kind: Kind, number: u8, phase: u8, len: usize) -> Vec<u8> {
        let mut bytes = vec![0; HEADER_LEN + len];
        let telegram = TelegramType::new(Channel::Primary, kind, number);
        Header { source: [2; 6], telegram, phase: PhaseField(phase) }.emit(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn the_phase_before_a_switch_gives_the_layout() {
        let header =
            |phase| Header { source: [0; 6], telegram: TelegramType(0x20), phase: PhaseField(phase) };
        let mut tracker = PhaseTracker::default();
        assert_eq!(tracker.layout_phase(&header(0x82)), Phase::CP1);
        assert_eq!(tracker.layout_phase(&header(0x03)), Phase::CP3);
        assert_eq!(tracker.layout_phase(&header(0x84)), Phase::CP3);
        assert_eq!(tracker.layout_phase(&header(0x04)), Phase::CP4);
        assert_eq!(tracker.layout_phase(&header(0x80)), Phase::CP4);
    }

    #[test]
    fn telegrams_outside_their_phase_are_refused() {
        let layout = Layout::unknown();
        let parse = |bytes: &[u8], phase| Frame::parse(bytes, Phase(phase), &layout).err();
        assert_eq!(parse(&frame(Kind::Mdt, 1, 0, 40), 0), Some(not_in_phase(1, 0)));
        assert_eq!(parse(&frame(Kind::At, 4, 2, 1280), 2), Some(not_in_phase(4, 3)));
        assert!(matches!(
            parse(&frame(Kind::At, 0, 5, 1280), 5),
            Some(Error { what: "communication phase", expected: Expected::Value(_), found: 5, .. })
        ));
        assert!(matches!(
            parse(&frame(Kind::At, 0, 2, 1279), 2),
            Some(Error { expected: Expected::Bytes(_), .. })
        ));
        assert_eq!(parse(&frame(Kind::At, 3, 2, 1280), 2), None);
    }

    #[test]
    fn bytes_behind_the_data_field_are_kept() {
        let mut bytes = frame(Kind::Mdt, 0, 0, 60);
        bytes[79] = 7;
        let parsed = Frame::parse(&bytes, Phase::CP0, &Layout::unknown()).unwrap();
        assert_eq!(parsed.trailer.len(), 20);
        let mut again = vec![0xA5; parsed.buffer_len()];
        parsed.emit(&mut again).unwrap();
        assert_eq!(again, bytes);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_bytes_do_not_panic(mut bytes in proptest::collection::vec(any::<u8>(), 20..1600), phase in 0u8..6) {
            let header = Header { source: [1; 6], telegram: TelegramType(bytes[14]), phase: PhaseField(bytes[15]) };
            header.emit(&mut bytes).unwrap();
            let layout = super::super::layout::tests::recording();
            if let Ok(frame) = Frame::parse(&bytes, Phase(phase), &layout) {
                let mut again = vec![0xA5; frame.buffer_len()];
                frame.emit(&mut again).unwrap();
                prop_assert_eq!(&again, &bytes);
            }
        }
    }
}
