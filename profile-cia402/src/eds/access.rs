//! What a device answers to an SDO, as far as its data sheet says it.

use super::data_type::{DataType, Shape};
use super::description::{DeviceDescription, SubObject};
use super::drive::{Direction, MappingEntry};
use super::value::Setting;
use crate::wire::{AbortCode, Mux};

/// Objects below this number are data types, which stand for gaps.
const DUMMIES_END: u16 = 0x20;

impl DataType {
    /// The whole number that these bytes are; `None` when there are not as many as the type has, or its values are no whole
    /// numbers.
    #[must_use]
    pub fn integer(self, bytes: &[u8]) -> Option<i128> {
        let size = usize::from(self.bits()?).div_ceil(8);
        let signed = match self.shape() {
            Shape::Unsigned => false,
            Shape::Signed => true,
            _ => return None,
        };
        let negative = signed && bytes.last().is_some_and(|last| last & 0x80 != 0);
        let mut wide = [if negative { 0xFF } else { 0 }; 16];
        wide.get_mut(..size).filter(|_| bytes.len() == size)?.copy_from_slice(bytes);
        Some(i128::from_le_bytes(wide))
    }
}

impl DeviceDescription {
    /// The value that a client asks for.
    ///
    /// # Errors
    /// The abort code of a device without it.
    pub fn look_up(&self, object: Mux) -> Result<&SubObject, AbortCode> {
        let known = self.object(object.index).ok_or(AbortCode::NO_OBJECT)?;
        known.sub(object.sub).ok_or(AbortCode::NO_SUB_INDEX)
    }

    /// The bytes that a node with this node-ID gives for an object after a reset; `None` when the description has no value for
    /// it, or one that is not of its type.
    ///
    /// # Errors
    /// The abort code with which it is refused.
    pub fn reads(&self, object: Mux, node: u8) -> Result<Option<Vec<u8>>, AbortCode> {
        let known = self.look_up(object)?;
        if !known.access.reads() {
            return Err(AbortCode::WRITE_ONLY);
        }
        let value = known.setting().and_then(|setting| setting.at(node));
        Ok(value.and_then(|value| value.to_bytes(known.data_type)))
    }

    /// Whether a node with this node-ID takes bytes for an object: it can be written, they are as many as its type has, and the
    /// number is within its limits.
    ///
    /// # Errors
    /// The abort code with which they are refused.
    pub fn takes(&self, object: Mux, bytes: &[u8], node: u8) -> Result<(), AbortCode> {
        let known = self.look_up(object)?;
        if !known.access.writes() {
            return Err(AbortCode::READ_ONLY);
        }
        let size = known.data_type.bits().map(|bits| usize::from(bits).div_ceil(8));
        match size {
            Some(size) if bytes.len() > size => return Err(AbortCode::TOO_LONG),
            Some(size) if bytes.len() < size => return Err(AbortCode::TOO_SHORT),
            _ => {}
        }
        let limit = |setting: &Option<Setting>| setting.as_ref()?.at(node)?.as_integer();
        let Some(number) = known.data_type.integer(bytes) else { return Ok(()) };
        if limit(&known.high).is_some_and(|high| number > high) {
            return Err(AbortCode::TOO_HIGH);
        }
        if limit(&known.low).is_some_and(|low| number < low) {
            return Err(AbortCode::TOO_LOW);
        }
        Ok(())
    }

    /// Whether a PDO of this direction can carry an entry.
    ///
    /// # Errors
    /// The abort code with which it is refused.
    pub fn maps(&self, direction: Direction, entry: MappingEntry) -> Result<(), AbortCode> {
        if entry.index < DUMMIES_END {
            let known = self.dummies.iter().find(|dummy| dummy.0 == entry.index);
            let fits = known.and_then(|dummy| dummy.bits()).ok_or(AbortCode::NOT_MAPPABLE)?;
            return if fits == entry.bits { Ok(()) } else { Err(AbortCode::PARAMETER) };
        }
        let known = self.look_up(Mux::new(entry.index, entry.sub))?;
        let allowed = match direction {
            Direction::Receive => known.access.receives(),
            Direction::Transmit => known.access.transmits(),
        };
        if !known.pdo_mapping || !allowed {
            return Err(AbortCode::NOT_MAPPABLE);
        }
        match known.data_type.bits() {
            // A boolean may take a bit or a byte.
            Some(1) if entry.bits == 8 => Ok(()),
            Some(bits) if bits == entry.bits => Ok(()),
            Some(_) => Err(AbortCode::PARAMETER),
            None => Err(AbortCode::NOT_MAPPABLE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: u8 = 5;

    fn description() -> DeviceDescription {
        let text = "[DummyUsage]\nDummy0005=1\n\
                    [6040]\nParameterName=Control\nDataType=6\nAccessType=rw\nPDOMapping=1\n\
                    [6041]\nParameterName=Status\nDataType=6\nAccessType=ro\nPDOMapping=1\nDefaultValue=0x40\n\
                    [2000]\nParameterName=Small\nDataType=3\nAccessType=rww\nPDOMapping=1\nLowLimit=-5\nHighLimit=$NODEID+1\n\
                    [2001]\nParameterName=Secret\nDataType=7\nAccessType=wo\n\
                    [2002]\nParameterName=Text\nDataType=9\nAccessType=rw\nDefaultValue=abc\n\
                    [1014]\nParameterName=EMCY\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x80\nParameterValue=$NODEID+0x90\n\
                    [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n\
                    [1018sub0]\nParameterName=Entries\nDataType=5\nAccessType=const\nDefaultValue=1\n\
                    [1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\n";
        crate::eds::read(text.as_bytes()).expect("a short text").description
    }

    #[test]
    fn reading_gives_the_value_of_the_node_or_why_not() {
        let description = description();
        let read = |index, sub| description.reads(Mux::new(index, sub), NODE);
        assert_eq!(
            read(0x1014, 0),
            Ok(Some(vec![0x95, 0, 0, 0])),
            "the configured one counts before the default"
        );
        assert_eq!(read(0x6041, 0), Ok(Some(vec![0x40, 0])));
        assert_eq!(read(0x2002, 0), Ok(Some(b"abc".to_vec())));
        assert_eq!(read(0x1018, 1), Ok(None), "the file does not say it");
        assert_eq!(read(0x2001, 0), Err(AbortCode::WRITE_ONLY));
        assert_eq!(read(0x1018, 2), Err(AbortCode::NO_SUB_INDEX));
        assert_eq!(read(0x6502, 0), Err(AbortCode::NO_OBJECT));
    }

    #[test]
    fn writing_is_refused_by_access_length_and_limits() {
        let description = description();
        let write = |index, bytes: &[u8]| description.takes(Mux::new(index, 0), bytes, NODE);
        assert_eq!(write(0x6040, &[6, 0]), Ok(()));
        assert_eq!(write(0x6041, &[6, 0]), Err(AbortCode::READ_ONLY));
        assert_eq!(write(0x6060, &[6]), Err(AbortCode::NO_OBJECT));
        assert_eq!(write(0x6040, &[6]), Err(AbortCode::TOO_SHORT));
        assert_eq!(write(0x6040, &[6, 0, 0]), Err(AbortCode::TOO_LONG));
        let number = |number: i16| write(0x2000, &number.to_le_bytes());
        assert_eq!([number(-5), number(6)], [Ok(()); 2], "6 is the node-ID and one more");
        assert_eq!([number(-6), number(7)], [Err(AbortCode::TOO_LOW), Err(AbortCode::TOO_HIGH)]);
        assert_eq!(write(0x2002, b"any length"), Ok(()));
    }

    #[test]
    fn mapping_is_refused_by_direction_access_and_length() {
        let description = description();
        let map = |direction, word| description.maps(direction, MappingEntry::of_word(word));
        let (receive, transmit) = (Direction::Receive, Direction::Transmit);
        assert_eq!(map(receive, 0x6040_0010), Ok(()));
        assert_eq!(map(receive, 0x6040_0020), Err(AbortCode::PARAMETER));
        assert_eq!(map(receive, 0x6041_0010), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(map(transmit, 0x6041_0010), Ok(()));
        assert_eq!(map(transmit, 0x2000_0010), Err(AbortCode::NOT_MAPPABLE), "it is only received");
        assert_eq!(
            map(receive, 0x2001_0020),
            Err(AbortCode::NOT_MAPPABLE),
            "the file does not say that it can be"
        );
        assert_eq!(map(receive, 0x607A_0020), Err(AbortCode::NO_OBJECT));
        assert_eq!(
            [map(receive, 0x0005_0008), map(receive, 0x0006_0010)],
            [Ok(()), Err(AbortCode::NOT_MAPPABLE)]
        );
    }

    #[test]
    fn bytes_are_numbers_of_their_type() {
        assert_eq!(DataType::INTEGER24.integer(&[0xFE, 0xFF, 0xFF]), Some(-2));
        assert_eq!(DataType::UNSIGNED64.integer(&[0xFF; 8]), Some(u64::MAX.into()));
        assert_eq!(DataType::INTEGER64.integer(&[0xFF; 8]), Some(-1));
        assert_eq!(DataType::UNSIGNED16.integer(&[1]), None);
        assert_eq!(DataType::REAL32.integer(&[0; 4]), None);
        assert_eq!(DataType::VISIBLE_STRING.integer(b"1"), None);
    }
}
