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
        assert_eq!((report.saturated, report.last_saturated), (1, Some(Signal::VelocityActual)), "{width}");
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
        let offset = offset % 24;
        let field = Field { offset, conversion, ..field(Signal::PositionActual, width) };
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
            // A float has 24 or 53 bits, and the largest integers round up beyond the range and come back
            // held.
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
        modulo in 3..1_i64 << 32, start in 0..1_i64 << 40,
        steps in prop::collection::vec(any::<i64>(), 1..40),
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
