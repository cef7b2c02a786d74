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
    /// For a position that wraps: the number of counts, in units of the telegram, after which it begins again.
    /// Encoding folds into `0..modulo`, or around zero when that does not fit the width; decoding unrolls.
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

/// What happened while a program ran; the counts go on until the report is replaced. They hold at their maximum.
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
            let begin = usize::from(field.offset);
            let Some(bytes) = telegram.get_mut(begin..begin + field.width.bytes()) else {
                report.out_of_bounds = report.out_of_bounds.saturating_add(1);
                continue;
            };
            match image.get(field.signal) {
                Some(value) => field.write(value, bytes, report),
                None => report.missing = report.missing.saturating_add(1),
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
            let begin = usize::from(field.offset);
            let Some(bytes) = telegram.get(begin..begin + field.width.bytes()) else {
                report.out_of_bounds = report.out_of_bounds.saturating_add(1);
                continue;
            };
            let Some(outcome) = field.read(bytes, tracker.as_mut()) else {
                report.not_finite = report.not_finite.saturating_add(1);
                continue;
            };
            let taken = image.set(field.signal, outcome.value);
            report.note(field.signal, outcome.saturated || !taken, outcome.inexact);
        }
    }
}

/// Whether every value of `0..modulo`, folded as [`Field::modulo`] says, can be told apart in the width.
fn modulo_fits(modulo: i64, width: Width) -> bool {
    let (min, max) = width.range();
    modulo >= 2 && i128::from(modulo) <= i128::from(max) - i128::from(min) + 1
}

impl Field {
    fn write(&self, value: i64, bytes: &mut [u8], report: &mut ConversionReport) {
        match self.width {
            Width::F32 => {
                let (FloatOutcome { value, inexact }, saturated) = self.conversion.convert_to_f32(value);
                bytes.copy_from_slice(&value.to_le_bytes());
                report.note(self.signal, saturated, inexact);
            }
            Width::F64 => {
                let (FloatOutcome { value, inexact }, saturated) = self.conversion.convert_to_f64(value);
                bytes.copy_from_slice(&value.to_le_bytes());
                report.note(self.signal, saturated, inexact);
            }
            _ => {
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
                bytes.copy_from_slice(&held.to_le_bytes()[..bytes.len()]);
                report.note(self.signal, outcome.saturated || held != value, outcome.inexact);
            }
        }
    }

    /// `None` when the value is a floating point number that is not finite. `bytes` has the length of the width.
    fn read(&self, bytes: &[u8], tracker: Option<&mut WrapTracker>) -> Option<Outcome> {
        let mut raw = [0; 8];
        raw[..bytes.len()].copy_from_slice(bytes);
        let bits = u64::from_le_bytes(raw);
        let value = match self.width {
            Width::F32 => {
                let [a, b, c, d, ..] = raw;
                return self.conversion.convert_f64(f64::from(f32::from_le_bytes([a, b, c, d])));
            }
            Width::F64 => return self.conversion.convert_f64(f64::from_bits(bits)),
            Width::I8 | Width::I16 | Width::I32 | Width::I64 => {
                // Shifted to the top and back to extend the sign.
                let unused = u64::BITS - self.width.bits();
                (bits << unused).cast_signed() >> unused
            }
            Width::U8 | Width::U16 | Width::U32 | Width::U64 => match i64::try_from(bits) {
                Ok(value) => value,
                Err(_) => {
                    let outcome = self.conversion.convert(i64::MAX);
                    return Some(Outcome { saturated: true, ..outcome });
                }
            },
        };
        Some(self.conversion.convert(match tracker {
            Some(tracker) => tracker.update(value),
            None => value,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ratio::Ratio;
    use proptest::prelude::*;

    fn field(signal: Signal, width: Width) -> Field {
        Field { signal, offset: 0, width, conversion: Conversion::IDENTITY, modulo: None }
    }

    fn program<I: SignalImage>(fields: &[Field]) -> Program<I> {
        let mut program = Program::new();
        for field in fields {
            program.push(*field).unwrap();
        }
        program
    }

    fn ratio(num: i64, den: i64) -> Ratio {
        Ratio::new(num, den).unwrap()
    }

    /// Encodes one feedback value into a telegram pre-filled with 0xA5.
    fn encode_one(field: Field, value: i64) -> (Vec<u8>, ConversionReport) {
        let mut image = AxisFeedback::default();
        image.set(field.signal, value);
        let mut telegram = vec![0xA5; usize::from(field.offset) + field.width.bytes() + 1];
        let mut report = ConversionReport::default();
        program(&[field]).encode(&image, &mut telegram, &mut report);
        (telegram, report)
    }

    /// Decodes one feedback value.
    fn decode_one(field: Field, telegram: &[u8]) -> (Option<i64>, ConversionReport) {
        let program: FeedbackProgram = program(&[field]);
        let (mut image, mut report) = (AxisFeedback::default(), ConversionReport::default());
        program.decode(telegram, &mut image, &mut program.trackers(), &mut report);
        (image.get(field.signal), report)
    }

    #[test]
    fn every_width_is_little_endian_and_touches_its_bytes_only() {
        let rows: [(Width, i64, &[u8]); 10] = [
            (Width::U8, 0xFE, &[0xFE]),
            (Width::I8, -2, &[0xFE]),
            (Width::U16, 0x1234, &[0x34, 0x12]),
            (Width::I16, -2, &[0xFE, 0xFF]),
            (Width::U32, 0xDEAD_BEEF, &[0xEF, 0xBE, 0xAD, 0xDE]),
            (Width::I32, -2, &[0xFE, 0xFF, 0xFF, 0xFF]),
            (Width::U64, 1 << 40, &[0, 0, 0, 0, 0, 1, 0, 0]),
            (Width::I64, -2, &[0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]),
            (Width::F32, -3, &[0x00, 0x00, 0x40, 0xC0]),
            (Width::F64, -3, &[0, 0, 0, 0, 0, 0, 0x08, 0xC0]),
        ];
        for (width, value, bytes) in rows {
            let field = Field { offset: 3, ..field(Signal::PositionActual, width) };
            let (telegram, report) = encode_one(field, value);
            assert_eq!(telegram[..3], [0xA5; 3], "{width}");
            assert_eq!(telegram[3..3 + bytes.len()], *bytes, "{width}");
            assert_eq!(telegram[3 + bytes.len()..], [0xA5], "{width}");
            assert_eq!(report, ConversionReport::default(), "{width}");
            assert_eq!(decode_one(field, &telegram), (Some(value), ConversionReport::default()), "{width}");
        }
    }

    #[test]
    fn a_value_beyond_the_width_is_held_and_counted() {
        let rows = [
            (Width::U8, -1, 0),
            (Width::U8, 256, 255),
            (Width::I16, 40_000, 32_767),
            (Width::I16, -40_000, -32_768),
            (Width::I32, i64::MAX, i64::from(i32::MAX)),
            (Width::U64, -1, 0),
        ];
        for (width, value, held) in rows {
            let field = field(Signal::VelocityActual, width);
            let (telegram, report) = encode_one(field, value);
            assert_eq!(
                (report.saturated, report.last_saturated),
                (1, Some(Signal::VelocityActual)),
                "{width}"
            );
            assert!(!report.is_clean());
            assert_eq!(decode_one(field, &telegram).0, Some(held), "{width}");
        }
        let (value, report) = decode_one(field(Signal::VelocityActual, Width::U64), &[0xFF; 8]);
        assert_eq!((value, report.saturated), (Some(i64::MAX), 1));
        let (value, report) = decode_one(field(Signal::DigitalInputs, Width::I8), &[0xFF]);
        assert_eq!((value, report.saturated), (None, 1), "-1 is no set of 32 inputs");
    }

    #[test]
    fn a_float_that_is_no_number_leaves_the_signal_absent() {
        let field = field(Signal::TorqueActual, Width::F32);
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (value, report) = decode_one(field, &value.to_le_bytes());
            assert_eq!((value, report.not_finite), (None, 1));
        }
    }

    #[test]
    fn a_telegram_that_is_too_short_is_counted_at_every_length() {
        let fields = [
            Field { offset: 0, ..field(Signal::PositionActual, Width::I32) },
            Field { offset: 4, ..field(Signal::VelocityActual, Width::I16) },
            Field { offset: 6, ..field(Signal::TorqueActual, Width::F64) },
        ];
        let program: FeedbackProgram = program(&fields);
        assert_eq!(program.required_len(), 14);
        for length in 0..=14 {
            let (mut image, mut report) = (AxisFeedback::default(), ConversionReport::default());
            program.decode(&[0; 14][..length], &mut image, &mut program.trackers(), &mut report);
            let missing = u32::from(length < 4) + u32::from(length < 6) + u32::from(length < 14);
            assert_eq!(report.out_of_bounds, missing, "{length}");
            let present = fields.map(|field| image.get(field.signal).is_some());
            assert_eq!(present, [length >= 4, length >= 6, length >= 14], "{length}");

            for signal in fields.map(|field| field.signal) {
                image.set(signal, 1);
            }
            let (mut telegram, mut report) = ([0xA5; 14], ConversionReport::default());
            program.encode(&image, &mut telegram[..length], &mut report);
            assert_eq!(report.out_of_bounds, missing, "{length}");
            assert_eq!(telegram[length..], [0xA5; 14][length..], "{length}");
        }
    }

    #[test]
    fn an_absent_signal_leaves_its_bytes_alone() {
        let program: CommandProgram = program(&[field(Signal::PositionCommand, Width::I32)]);
        let (mut telegram, mut report) = ([0xA5; 4], ConversionReport::default());
        program.encode(&AxisCommand::default(), &mut telegram, &mut report);
        assert_eq!((telegram, report.missing, report.is_clean()), ([0xA5; 4], 1, false));
    }

    #[test]
    fn a_position_folds_and_unrolls() {
        let modulo = Field { modulo: Some(360), ..field(Signal::PositionActual, Width::I32) };
        for (value, folded) in [(-1, 359), (360, 0), (725, 5)] {
            let (telegram, report) = encode_one(modulo, value);
            assert_eq!(i32::from_le_bytes(telegram[..4].try_into().unwrap()), folded, "{value}");
            assert!(report.is_clean());
        }
        // A counter that uses all of its width folds around zero.
        let full = Field { modulo: Some(1 << 32), ..field(Signal::PositionActual, Width::I32) };
        let (telegram, report) = encode_one(full, (1 << 31) + 5);
        assert_eq!(i32::from_le_bytes(telegram[..4].try_into().unwrap()), i32::MIN + 5);
        assert!(report.is_clean());
    }

    #[test]
    fn decoding_unrolls_before_it_converts() {
        // 2^20 counts a revolution on a 32-bit counter: nanounits are never folded.
        let conversion = Conversion::new(ratio(1_000_000_000, 1 << 20));
        let field = Field { conversion, modulo: Some(1 << 32), ..field(Signal::PositionActual, Width::I32) };
        let program: FeedbackProgram = program(&[field]);
        let (mut image, mut report) = (AxisFeedback::default(), ConversionReport::default());
        let mut trackers = program.trackers();
        let step = 1_i64 << 30;
        for turn in 0..100_000_i64 {
            let bytes = (turn * step).to_le_bytes();
            program.decode(&bytes[..4], &mut image, &mut trackers, &mut report);
            assert_eq!(image.position.0, turn * 1024 * 1_000_000_000, "step {turn}");
        }
        assert!(report.is_clean());
        trackers.restart();
        program.decode(&[1, 0, 0, 0], &mut image, &mut trackers, &mut report);
        assert_eq!(image.position.0, 954, "after a restart the counter stands as it is");
    }

    #[test]
    fn programs_refuse_what_they_cannot_do() {
        let mut program = FeedbackProgram::new();
        let wrong = field(Signal::PositionCommand, Width::I32);
        assert_eq!(program.push(wrong), Err(FieldError::WrongImage(Signal::PositionCommand)));
        for (width, modulo) in
            [(Width::I8, 257), (Width::U8, 257), (Width::I32, 1), (Width::I32, -5), (Width::F32, 360)]
        {
            let bad = Field { modulo: Some(modulo), ..field(Signal::PositionActual, width) };
            let error = FieldError::Modulo { signal: Signal::PositionActual, modulo, width };
            assert_eq!(program.push(bad), Err(error));
        }
        for _ in 0..MAX_FIELDS {
            program.push(field(Signal::PositionActual, Width::I32)).unwrap();
        }
        let one_more = program.push(field(Signal::TorqueActual, Width::I32));
        assert_eq!(one_more, Err(FieldError::Full(Signal::TorqueActual)));
        assert_eq!(program.fields().count(), MAX_FIELDS);
    }

    #[test]
    fn widths_have_names_that_lead_back() {
        for width in Width::ALL.iter().copied() {
            assert_eq!(Width::parse(width.name()), Some(width));
            assert_eq!(usize::try_from(width.bits()).unwrap(), 8 * width.bytes());
        }
    }

    fn any_width() -> impl Strategy<Value = Width> {
        prop::sample::select(Width::ALL)
    }

    proptest! {
        /// Any bytes decode without panic, and what is inside the range says so.
        #[test]
        fn decoding_never_panics(
            width in any_width(), offset in any::<u16>(), num in any::<i64>(), den in 1..i64::MAX,
            add in any::<i64>(), telegram in prop::collection::vec(any::<u8>(), 0..24),
        ) {
            let Some(ratio) = Ratio::new(num, den) else { return Ok(()) };
            let conversion = Conversion::new(ratio).with_offset(add);
            let field = Field { signal: Signal::PositionActual, offset: offset % 24, width, conversion, modulo: None };
            let fits = usize::from(field.offset) + width.bytes() <= telegram.len();
            let (value, report) = decode_one(field, &telegram);
            prop_assert_eq!(report.out_of_bounds, u32::from(!fits));
            prop_assert_eq!(value.is_some(), fits && report.not_finite == 0);
        }

        /// What fits the width comes back; what does not is held at the nearer end and counted.
        #[test]
        fn encode_then_decode(width in any_width(), value in any::<i64>()) {
            let field = field(Signal::PositionActual, width);
            let (telegram, report) = encode_one(field, value);
            let (back, _) = decode_one(field, &telegram);
            if width.is_float() {
                // A float has 24 or 53 bits, and the largest integers round up beyond the range and come back held.
                let bits = if width == Width::F32 { 24 } else { 53 };
                prop_assert!(back.unwrap().abs_diff(value) <= value.unsigned_abs() >> bits);
                prop_assert_eq!(report.inexact == 0, back == Some(value) || value == i64::MAX);
            } else {
                let (min, max) = width.range();
                prop_assert_eq!(back, Some(value.clamp(min, max)));
                prop_assert_eq!(report.saturated, u32::from(!(min..=max).contains(&value)));
            }
        }

        /// A position that goes through a folding telegram in steps comes out unrolled, to the count.
        #[test]
        fn folding_and_unrolling_agree(
            modulo in 3..1_i64 << 32, start in 0..1_i64 << 40, steps in prop::collection::vec(any::<i64>(), 1..40),
        ) {
            let field = Field { modulo: Some(modulo), ..field(Signal::PositionActual, Width::U32) };
            let program: FeedbackProgram = program(&[field]);
            let (mut source, mut target) = (AxisFeedback::default(), AxisFeedback::default());
            let (mut trackers, mut report) = (program.trackers(), ConversionReport::default());
            let mut truth = start;
            let mut telegram = [0; 4];
            for step in steps {
                source.set(Signal::PositionActual, truth);
                program.encode(&source, &mut telegram, &mut report);
                program.decode(&telegram, &mut target, &mut trackers, &mut report);
                prop_assert_eq!(target.position.0 - truth, fold(start, modulo) - start);
                truth += step % ((modulo + 1) / 2);
            }
            prop_assert!(report.is_clean());
        }
    }
}
