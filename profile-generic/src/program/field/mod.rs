//! Fields: one signal at one place in a telegram, and the programs made of them.

use super::conversion::Conversion;
use crate::code::named_enum;
use crate::image::{AxisCommand, AxisFeedback, Signal, SignalImage};
use crate::ratio::{FloatOutcome, Outcome};
use crate::scaling::{WrapTracker, fold};
use core::marker::PhantomData;

/// The most fields in one program: every signal of an image, and some of them twice.
pub const MAX_FIELDS: usize = 16;

named_enum! {
    /// How a number stands in a telegram, little endian.
    pub enum Width {
        /// Unsigned, 8 bits.
        U8 = "u8",
        /// Signed, 8 bits.
        I8 = "i8",
        /// Unsigned, 16 bits.
        U16 = "u16",
        /// Signed, 16 bits.
        I16 = "i16",
        /// Unsigned, 32 bits.
        U32 = "u32",
        /// Signed, 32 bits.
        I32 = "i32",
        /// Unsigned, 64 bits; values from 2^63 up are held at 2^63 - 1.
        U64 = "u64",
        /// Signed, 64 bits.
        I64 = "i64",
        /// IEEE 754 single.
        F32 = "f32",
        /// IEEE 754 double.
        F64 = "f64",
    }
}

impl Width {
    /// The length in bytes.
    #[inline]
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The length in bits.
    pub const fn bits(self) -> u32 {
        match self {
            Self::U8 | Self::I8 => 8,
            Self::U16 | Self::I16 => 16,
            Self::U32 | Self::I32 | Self::F32 => 32,
            Self::U64 | Self::I64 | Self::F64 => 64,
        }
    }

    /// Whether it is a floating point number.
    pub const fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The lowest and highest integer that it holds; all of 64 bits for floating point.
    #[inline]
    pub const fn range(self) -> (i64, i64) {
        match self {
            Self::U8 => (0, u8::MAX as i64),
            Self::I8 => (i8::MIN as i64, i8::MAX as i64),
            Self::U16 => (0, u16::MAX as i64),
            Self::I16 => (i16::MIN as i64, i16::MAX as i64),
            Self::U32 => (0, u32::MAX as i64),
            Self::I32 => (i32::MIN as i64, i32::MAX as i64),
            Self::U64 => (0, i64::MAX),
            Self::I64 | Self::F32 | Self::F64 => (i64::MIN, i64::MAX),
        }
    }

    /// The integer in these bytes, with its sign where the width has one; the bits of a floating point number, or of an
    /// unsigned one of 64 bits, as they are. `None` for another number of bytes.
    pub fn integer(self, bytes: &[u8]) -> Option<i64> {
        if bytes.len() == self.bytes() { self.load(bytes) } else { None }
    }

    /// The same where the bytes begin. Each length is one that the compiler knows: a load.
    #[inline]
    fn load(self, bytes: &[u8]) -> Option<i64> {
        Some(match self {
            Self::U8 => i64::from(u8::from_le_bytes(*bytes.first_chunk()?)),
            Self::I8 => i64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Self::U16 => i64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Self::I16 => i64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U32 => i64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::I32 | Self::F32 => i64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            Self::U64 | Self::I64 | Self::F64 => i64::from_le_bytes(*bytes.first_chunk()?),
        })
    }

    /// Puts the low bytes of an integer where the bytes begin. `None` when they are too few.
    #[inline]
    fn store(self, value: i64, bytes: &mut [u8]) -> Option<()> {
        let all @ [a, b, c, d, ..] = value.to_le_bytes();
        match self.bytes() {
            1 => *bytes.first_chunk_mut()? = [a],
            2 => *bytes.first_chunk_mut()? = [a, b],
            4 => *bytes.first_chunk_mut()? = [a, b, c, d],
            _ => *bytes.first_chunk_mut()? = all,
        }
        Some(())
    }
}

/// One signal at one place in a telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Which signal.
    pub signal: Signal,
    /// Where it begins, in bytes from the start of the connection or process data object.
    pub offset: u16,
    /// How it is written there.
    pub width: Width,
    /// From the signal to the telegram when the program encodes, the other way when it decodes.
    pub conversion: Conversion,
    /// For a position that wraps: the number of counts, in units of the telegram, after which it begins
    /// again. Encoding folds into `0..modulo`, or around zero when that does not fit the width; decoding
    /// unrolls.
    pub modulo: Option<i64>,
}

/// A field cannot be part of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// There are [`MAX_FIELDS`] fields already.
    #[error("expected at most {MAX_FIELDS} fields, {0} is one more")]
    Full(Signal),
    /// The signal belongs to the other image.
    #[error("signal {0} does not belong to this direction")]
    WrongImage(Signal),
    /// The modulo is below two, beyond what the width can tell apart, or given for a floating point number.
    #[error("modulo {modulo} of signal {signal} does not fit a {width}")]
    Modulo {
        /// The signal of the field.
        signal: Signal,
        /// The modulo that does not fit.
        modulo: i64,
        /// The width it does not fit.
        width: Width,
    },
}

/// What happened while a program ran; the counts go on until the report is replaced. They hold at their
/// maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConversionReport {
    /// Values that were clamped.
    pub saturated: u32,
    /// Values that were rounded.
    pub inexact: u32,
    /// Floating point values that were infinite or not a number; their signals were left alone.
    pub not_finite: u32,
    /// Signals that were not present when they should have been encoded; their bytes were left alone.
    pub missing: u32,
    /// Fields that reach beyond the telegram; nothing was read or written.
    pub out_of_bounds: u32,
    /// The signal that was clamped last.
    pub last_saturated: Option<Signal>,
}

impl ConversionReport {
    /// Whether everything arrived, unclamped. Rounding is no fault.
    pub const fn is_clean(&self) -> bool {
        self.saturated == 0 && self.not_finite == 0 && self.missing == 0 && self.out_of_bounds == 0
    }

    #[inline]
    fn note(&mut self, signal: Signal, saturated: bool, inexact: bool) {
        self.inexact = self.inexact.saturating_add(u32::from(inexact));
        if saturated {
            self.saturated = self.saturated.saturating_add(1);
            self.last_saturated = Some(signal);
        }
    }
}

/// The unrolling state of the wrapping fields of one program for one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trackers {
    fields: [Option<WrapTracker>; MAX_FIELDS],
}

impl Trackers {
    /// Forgets where all counters were, see [`WrapTracker::restart`].
    pub fn restart(&mut self) {
        for tracker in self.fields.iter_mut().flatten() {
            tracker.restart();
        }
    }

    /// The tracker of the field with this number, if the field wraps.
    pub fn get_mut(&mut self, field: usize) -> Option<&mut WrapTracker> {
        self.fields.get_mut(field)?.as_mut()
    }
}

/// The fields of one telegram for one axis; `I` is the image they belong to.
#[derive(Clone, Copy, Debug)]
pub struct Program<I> {
    fields: [Option<Field>; MAX_FIELDS],
    image: PhantomData<I>,
}

/// Moves set-points: encodes them for a drive, decodes them from a controller.
pub type CommandProgram = Program<AxisCommand>;

/// Moves actual values: decodes them from a drive, encodes them for a controller.
pub type FeedbackProgram = Program<AxisFeedback>;

impl<I: SignalImage> Default for Program<I> {
    fn default() -> Self {
        Self::new()
    }
}

impl<I: SignalImage> Program<I> {
    /// A program without fields.
    pub const fn new() -> Self {
        Self { fields: [None; MAX_FIELDS], image: PhantomData }
    }

    /// Adds a field after the others; a later field wins where two overlap.
    ///
    /// # Errors
    /// See [`FieldError`].
    pub fn push(&mut self, field: Field) -> Result<(), FieldError> {
        if !I::owns(field.signal) {
            return Err(FieldError::WrongImage(field.signal));
        }
        if let Some(modulo) = field.modulo
            && (field.width.is_float() || !modulo_fits(modulo, field.width))
        {
            return Err(FieldError::Modulo { signal: field.signal, modulo, width: field.width });
        }
        let free = self.fields.iter_mut().find(|slot| slot.is_none());
        *free.ok_or(FieldError::Full(field.signal))? = Some(field);
        Ok(())
    }

    /// The fields in order.
    pub fn fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().map_while(Option::as_ref)
    }

    /// The bytes a telegram must have to hold every field.
    pub fn required_len(&self) -> usize {
        self.fields().map(|field| usize::from(field.offset) + field.width.bytes()).max().unwrap_or(0)
    }

    /// The unrolling state that [`Program::decode`] needs.
    pub fn trackers(&self) -> Trackers {
        let modulus = |field: &Field| field.modulo.and_then(WrapTracker::new);
        Trackers { fields: self.fields.map(|field| field.as_ref().and_then(modulus)) }
    }

    /// Writes the signals of the image into the telegram. What cannot be written is counted and left alone.
    pub fn encode(&self, image: &I, telegram: &mut [u8], report: &mut ConversionReport) {
        for field in self.fields() {
            let place = telegram.get_mut(usize::from(field.offset)..).unwrap_or_default();
            let written = match image.get(field.signal) {
                Some(value) => field.write(value, place, report),
                None => (place.len() >= field.width.bytes()).then(|| {
                    report.missing = report.missing.saturating_add(1);
                }),
            };
            if written.is_none() {
                report.out_of_bounds = report.out_of_bounds.saturating_add(1);
            }
        }
    }

    /// Reads the signals of the image from the telegram. What cannot be read is counted and left alone.
    pub fn decode(
        &self,
        telegram: &[u8],
        image: &mut I,
        trackers: &mut Trackers,
        report: &mut ConversionReport,
    ) {
        for (field, tracker) in self.fields().zip(&mut trackers.fields) {
            let place = telegram.get(usize::from(field.offset)..).unwrap_or_default();
            let Some(raw) = field.width.load(place) else {
                report.out_of_bounds = report.out_of_bounds.saturating_add(1);
                continue;
            };
            let Some(outcome) = field.read(raw, tracker.as_mut()) else {
                report.not_finite = report.not_finite.saturating_add(1);
                continue;
            };
            let taken = image.set(field.signal, outcome.value);
            report.note(field.signal, outcome.saturated || !taken, outcome.inexact);
        }
    }
}

/// Whether every value of `0..modulo`, folded as [`Field::modulo`] says, can be distinguished in the width.
fn modulo_fits(modulo: i64, width: Width) -> bool {
    let (min, max) = width.range();
    modulo >= 2 && i128::from(modulo) <= i128::from(max) - i128::from(min) + 1
}

impl Field {
    /// Writes a value where the bytes begin. `None` when they are too few.
    #[inline]
    fn write(&self, value: i64, bytes: &mut [u8], report: &mut ConversionReport) -> Option<()> {
        if self.width.is_float() {
            return self.write_float(value, bytes, report);
        }
        let outcome = self.conversion.convert(value);
        let (min, max) = self.width.range();
        let value = match self.modulo {
            Some(modulo) => {
                let folded = fold(outcome.value, modulo);
                if folded > max { folded - modulo } else { folded }
            }
            None => outcome.value,
        };
        let held = value.clamp(min, max);
        self.width.store(held, bytes)?;
        report.note(self.signal, outcome.saturated || held != value, outcome.inexact);
        Some(())
    }

    #[inline(never)]
    fn write_float(&self, value: i64, bytes: &mut [u8], report: &mut ConversionReport) -> Option<()> {
        let (saturated, inexact) = if self.width == Width::F32 {
            let (FloatOutcome { value, inexact }, saturated) = self.conversion.convert_to_f32(value);
            *bytes.first_chunk_mut()? = value.to_le_bytes();
            (saturated, inexact)
        } else {
            let (FloatOutcome { value, inexact }, saturated) = self.conversion.convert_to_f64(value);
            *bytes.first_chunk_mut()? = value.to_le_bytes();
            (saturated, inexact)
        };
        report.note(self.signal, saturated, inexact);
        Some(())
    }

    /// What a raw value of the width says; `None` when it is a floating point number that is not finite.
    #[inline]
    fn read(&self, raw: i64, tracker: Option<&mut WrapTracker>) -> Option<Outcome> {
        if self.width.is_float() {
            return self.read_float(raw);
        }
        if self.width == Width::U64 && raw < 0 {
            let outcome = self.conversion.convert(i64::MAX);
            return Some(Outcome { saturated: true, ..outcome });
        }
        Some(self.conversion.convert(match tracker {
            Some(tracker) => tracker.update(raw),
            None => raw,
        }))
    }

    #[inline(never)]
    fn read_float(&self, raw: i64) -> Option<Outcome> {
        let [a, b, c, d, ..] = raw.to_le_bytes();
        self.conversion.convert_f64(match self.width {
            Width::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => f64::from_bits(raw.cast_unsigned()),
        })
    }
}

#[cfg(test)]
mod tests;
