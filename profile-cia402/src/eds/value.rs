//! Values of objects as data sheets give them.

use core::fmt;

use super::data_type::{DataType, Shape};
use super::number::{self, Number};

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A whole number without sign, of the types without sign and of the boolean.
    Unsigned(u64),
    /// A whole number.
    Signed(i64),
    /// A floating point number.
    Real(f64),
    /// Characters.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
}

impl Value {
    /// As a whole number, when it is one.
    #[must_use]
    pub fn as_integer(&self) -> Option<i128> {
        match self {
            Self::Unsigned(value) => Some((*value).into()),
            Self::Signed(value) => Some((*value).into()),
            Self::Real(_) | Self::Text(_) | Self::Bytes(_) => None,
        }
    }

    /// As a number of 32 bits without sign, when it is one.
    #[must_use]
    pub fn as_u32(&self) -> Option<u32> {
        self.as_integer().and_then(|value| u32::try_from(value).ok())
    }

    /// The bytes that an SDO transfers, little endian; `None` when the value is not of this type.
    #[must_use]
    pub fn to_bytes(&self, data_type: DataType) -> Option<Vec<u8>> {
        let length = data_type.bits().map(|bits| usize::from(bits).div_ceil(8));
        match (self, data_type.shape()) {
            (Self::Unsigned(value), Shape::Unsigned) => Some(value.to_le_bytes().get(..length?)?.to_vec()),
            (Self::Signed(value), Shape::Signed) => Some(value.to_le_bytes().get(..length?)?.to_vec()),
            #[expect(
                clippy::cast_possible_truncation,
                reason = "to the nearest of 32 bits is what the type asks for"
            )]
            (Self::Real(value), Shape::Real) if length == Some(4) => {
                Some((*value as f32).to_le_bytes().to_vec())
            }
            (Self::Real(value), Shape::Real) => Some(value.to_le_bytes().to_vec()),
            (Self::Text(text), Shape::Text) if data_type == DataType::UNICODE_STRING => {
                Some(text.encode_utf16().flat_map(u16::to_le_bytes).collect())
            }
            (Self::Text(text), Shape::Text) => Some(text.as_bytes().to_vec()),
            (Self::Bytes(bytes), Shape::Bytes) => Some(bytes.clone()),
            _ => None,
        }
    }
}

/// Hexadecimal without sign, decimal with sign, bytes as digits.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsigned(value) if *value < 10 => write!(f, "{value}"),
            Self::Unsigned(value) => write!(f, "0x{value:X}"),
            Self::Signed(value) => write!(f, "{value}"),
            Self::Real(value) => write!(f, "{value}"),
            Self::Text(text) => f.write_str(text),
            Self::Bytes(bytes) => bytes.iter().try_for_each(|byte| write!(f, "{byte:02X}")),
        }
    }
}

/// A value of an object, to which the node-ID may have to be added.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The value, without the node-ID.
    pub value: Value,
    /// Whether the node-ID is added to it.
    pub plus_node: bool,
}

impl Setting {
    /// A value that is the same for every node.
    #[must_use]
    pub const fn plain(value: Value) -> Self {
        Self { value, plus_node: false }
    }

    /// The value for a node with this node-ID; `None` where a sum exceeds 64 bits.
    #[must_use]
    pub fn at(&self, node: u8) -> Option<Value> {
        Some(match (&self.value, self.plus_node) {
            (Value::Unsigned(value), true) => Value::Unsigned(value.checked_add(node.into())?),
            (Value::Signed(value), true) => Value::Signed(value.checked_add(node.into())?),
            (value, _) => value.clone(),
        })
    }
}

/// As data sheets write it.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.plus_node {
            f.write_str("$NODEID+")?;
        }
        self.value.fmt(f)
    }
}

/// What is wrong with the text of a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// It is no value of the type.
    Form(&'static str),
    /// It is a number that the type cannot hold: the smallest and the largest one.
    Range(i128, i128),
}

/// A value read from a text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parsed {
    pub setting: Setting,
    /// Whether a bit pattern was taken for a negative number.
    pub twos_complement: bool,
}

/// Reads a value of a type.
pub(super) fn parse(text: &str, data_type: DataType) -> Result<Parsed, Fault> {
    let plain = |value| Ok(Parsed { setting: Setting::plain(value), twos_complement: false });
    match data_type.shape() {
        Shape::Unsigned | Shape::Signed => {
            let number = number::parse(text).map_err(|_| Fault::Form(number::EXPECTED))?;
            integer(number, data_type)
        }
        Shape::Real => plain(Value::Real(real(text, data_type)?)),
        Shape::Text => plain(Value::Text(text.to_owned())),
        Shape::Bytes => plain(Value::Bytes(bytes(text)?)),
        // Nobody knows its length: a number is kept as it stands, anything else as text.
        Shape::Other => match number::parse(text).ok().and_then(|number| wide(number).ok()) {
            Some(parsed) => Ok(parsed),
            None => plain(Value::Text(text.to_owned())),
        },
    }
}

fn wide(number: Number) -> Result<Parsed, Fault> {
    let data_type = if number.value < 0 { DataType::INTEGER64 } else { DataType::UNSIGNED64 };
    integer(number, data_type)
}

/// The smallest and the largest whole number of a type.
pub(super) fn range(data_type: DataType) -> Option<(i128, i128)> {
    let bits = u32::from(data_type.bits()?);
    match data_type.shape() {
        Shape::Unsigned => Some((0, (1 << bits) - 1)),
        Shape::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
        _ => None,
    }
}

fn integer(number: Number, data_type: DataType) -> Result<Parsed, Fault> {
    let Some((low, high)) = range(data_type) else { return Err(Fault::Form(number::EXPECTED)) };
    let mut value = number.value;
    let patterns = 2 * (high + 1);
    let twos_complement = low < 0 && number.pattern && (high + 1..patterns).contains(&value);
    if twos_complement {
        value -= patterns;
    }
    // With any node-ID it must fit too.
    let most = if number.plus_node { value + i128::from(NODE_MAX) } else { value };
    if value < low || most > high {
        return Err(Fault::Range(low, high));
    }
    let value = match (u64::try_from(value), i64::try_from(value)) {
        (Ok(value), _) if low == 0 => Value::Unsigned(value),
        (_, Ok(value)) if low < 0 => Value::Signed(value),
        _ => return Err(Fault::Range(low, high)),
    };
    Ok(Parsed { setting: Setting { value, plus_node: number.plus_node }, twos_complement })
}

/// The largest node-ID.
const NODE_MAX: u8 = 127;

/// A floating point number in decimal, or its bits in hexadecimal.
fn real(text: &str, data_type: DataType) -> Result<f64, Fault> {
    const EXPECTED: &str = "a floating point number, or its bits in hexadecimal";
    if text.starts_with("0x") || text.starts_with("0X") {
        let (bits, _) = number::plain(text).map_err(|_| Fault::Form(EXPECTED))?;
        let value = match data_type {
            DataType::REAL32 => u32::try_from(bits).map(|bits| f64::from(f32::from_bits(bits))),
            _ => u64::try_from(bits).map(f64::from_bits),
        };
        return value.map_err(|_| Fault::Form(EXPECTED));
    }
    text.parse().map_err(|_| Fault::Form(EXPECTED))
}

/// Bytes of two digits each, with or without blanks between them.
fn bytes(text: &str) -> Result<Vec<u8>, Fault> {
    const EXPECTED: &str = "bytes of two hexadecimal digits each";
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let digit = |byte: u8| char::from(byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
    let byte = |pair: &[u8]| match pair {
        [high, low] => Some(digit(*high)? << 4 | digit(*low)?),
        _ => None,
    };
    digits.chunks(2).map(byte).collect::<Option<Vec<u8>>>().ok_or(Fault::Form(EXPECTED))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_by_their_type() {
        let read = |text, data_type| parse(text, data_type).map(|parsed| parsed.setting.value);
        for (text, data_type, value) in [
            ("0xFF", DataType::UNSIGNED8, Value::Unsigned(255)),
            ("010", DataType::UNSIGNED8, Value::Unsigned(8)),
            ("1", DataType::BOOLEAN, Value::Unsigned(1)),
            ("-128", DataType::INTEGER8, Value::Signed(-128)),
            ("0xFF", DataType::INTEGER8, Value::Signed(-1)),
            ("0x800000", DataType::INTEGER24, Value::Signed(-8_388_608)),
            ("0xFFFFFFFFFFFFFFFF", DataType::UNSIGNED64, Value::Unsigned(u64::MAX)),
            ("0x8000000000000000", DataType::INTEGER64, Value::Signed(i64::MIN)),
            ("1.5", DataType::REAL32, Value::Real(1.5)),
            ("0x3FC00000", DataType::REAL32, Value::Real(1.5)),
            ("0x3FF8000000000000", DataType::REAL64, Value::Real(1.5)),
            ("servo 1", DataType::VISIBLE_STRING, Value::Text("servo 1".to_owned())),
            ("01 aB", DataType::OCTET_STRING, Value::Bytes(vec![1, 0xAB])),
            ("", DataType::DOMAIN, Value::Bytes(vec![])),
            ("0x10", DataType(0x40), Value::Unsigned(16)),
            ("-1", DataType(0x40), Value::Signed(-1)),
            ("x", DataType(0x40), Value::Text("x".to_owned())),
        ] {
            assert_eq!(read(text, data_type), Ok(value), "{text} {data_type}");
        }
    }

    #[test]
    fn what_a_type_cannot_be_is_told() {
        for (text, data_type, fault) in [
            ("256", DataType::UNSIGNED8, Fault::Range(0, 255)),
            ("-1", DataType::UNSIGNED16, Fault::Range(0, 65_535)),
            ("255", DataType::INTEGER8, Fault::Range(-128, 127)),
            ("0x100", DataType::INTEGER8, Fault::Range(-128, 127)),
            ("2", DataType::BOOLEAN, Fault::Range(0, 1)),
            ("$NODEID+0xFFFFFFFF", DataType::UNSIGNED32, Fault::Range(0, 0xFFFF_FFFF)),
            ("$NODEID+0x90", DataType::UNSIGNED8, Fault::Range(0, 255)),
            ("one", DataType::UNSIGNED8, Fault::Form(number::EXPECTED)),
            ("abc", DataType::OCTET_STRING, Fault::Form("bytes of two hexadecimal digits each")),
            ("0g", DataType::DOMAIN, Fault::Form("bytes of two hexadecimal digits each")),
            ("1,5", DataType::REAL32, Fault::Form("a floating point number, or its bits in hexadecimal")),
            (
                "0x100000000",
                DataType::REAL32,
                Fault::Form("a floating point number, or its bits in hexadecimal"),
            ),
        ] {
            assert_eq!(parse(text, data_type), Err(fault), "{text} {data_type}");
        }
    }

    #[test]
    fn the_node_id_is_added() {
        let parsed = parse("0x80000180 + $NODEID", DataType::UNSIGNED32).unwrap().setting;
        assert_eq!(parsed.at(5), Some(Value::Unsigned(0x8000_0185)));
        assert_eq!(parsed.to_string(), "$NODEID+0x80000180");
        assert_eq!(Setting::plain(Value::Unsigned(5)).at(5), Some(Value::Unsigned(5)));
    }

    #[test]
    fn bytes_are_those_of_the_wire() {
        let bytes = |value: Value, data_type: DataType| value.to_bytes(data_type);
        assert_eq!(bytes(Value::Unsigned(0x0102), DataType::UNSIGNED16), Some(vec![2, 1]));
        assert_eq!(bytes(Value::Signed(-2), DataType::INTEGER24), Some(vec![0xFE, 0xFF, 0xFF]));
        assert_eq!(bytes(Value::Unsigned(1), DataType::BOOLEAN), Some(vec![1]));
        assert_eq!(bytes(Value::Real(1.5), DataType::REAL32), Some(vec![0, 0, 0xC0, 0x3F]));
        assert_eq!(
            bytes(Value::Text("aé".to_owned()), DataType::UNICODE_STRING),
            Some(vec![0x61, 0, 0xE9, 0])
        );
        assert_eq!(bytes(Value::Text("a".to_owned()), DataType::VISIBLE_STRING), Some(vec![0x61]));
        assert_eq!(bytes(Value::Bytes(vec![9]), DataType::DOMAIN), Some(vec![9]));
        assert_eq!(bytes(Value::Signed(1), DataType::UNSIGNED8), None);
        assert_eq!(bytes(Value::Unsigned(1), DataType(0x40)), None);
    }
}
