//! The CiA 402 dictionary: what it says, and that it contradicts nobody.

use std::sync::OnceLock;

use crate::{
    Cia402Access, Cia402Dictionary, Cia402Kind, Cia402Pdo, Cia402SetKind, Cia402Type, Confidence, Mapping,
};

fn cia402() -> &'static Cia402Dictionary {
    static DICTIONARY: OnceLock<Cia402Dictionary> = OnceLock::new();
    DICTIONARY
        .get_or_init(|| Mapping::embedded().expect("the shipped tables are good").dictionaries.cia402.clone())
}

/// Objects and types of which the facts say that two sources agree.
#[rustfmt::skip]
const TYPES: &[(u16, &str)] = &[
    (0x603F, "u16"), (0x6007, "i16"), (0x6040, "u16"), (0x6041, "u16"), (0x6042, "i16"), (0x605A, "i16"), (0x605B, "i16"),
    (0x605C, "i16"), (0x605D, "i16"), (0x605E, "i16"), (0x6060, "i8"), (0x6061, "i8"), (0x6062, "i32"), (0x6063, "i32"),
    (0x6064, "i32"), (0x6065, "u32"), (0x6066, "u16"), (0x6067, "u32"), (0x6068, "u16"), (0x6069, "i32"), (0x606B, "i32"),
    (0x606C, "i32"), (0x606D, "u16"), (0x606E, "u16"), (0x606F, "u16"), (0x6070, "u16"), (0x6071, "i16"), (0x6072, "u16"),
    (0x6073, "u16"), (0x6074, "i16"), (0x6075, "u32"), (0x6076, "u32"), (0x6077, "i16"), (0x6078, "i16"), (0x6079, "u32"),
    (0x607A, "i32"), (0x607C, "i32"), (0x607E, "u8"), (0x607F, "u32"), (0x6080, "u32"), (0x6081, "u32"), (0x6082, "u32"),
    (0x6083, "u32"), (0x6084, "u32"), (0x6085, "u32"), (0x6086, "i16"), (0x6087, "u32"), (0x6098, "i8"), (0x60B0, "i32"),
    (0x60B1, "i32"), (0x60B2, "i16"), (0x60B8, "u16"), (0x60B9, "u16"), (0x60BA, "i32"), (0x60BB, "i32"), (0x60BC, "i32"),
    (0x60BD, "i32"), (0x60C0, "i16"), (0x60C5, "u32"), (0x60C6, "u32"), (0x60D5, "u16"), (0x60D8, "u16"), (0x60E0, "u16"),
    (0x60E1, "u16"), (0x60F4, "i32"), (0x60FD, "u32"), (0x60FF, "i32"), (0x6502, "u32"),
];

#[test]
fn has_the_types_on_which_sources_agree() {
    for (index, data_type) in TYPES {
        let object = cia402().object(*index).unwrap_or_else(|| panic!("{index:04X}"));
        let value = object.sub(0).unwrap();
        assert_eq!(value.data_type.map(Cia402Type::name), Some(*data_type), "{index:04X}");
        assert_eq!(
            (object.kind, object.trust.confidence),
            (Cia402Kind::Var, Confidence::High),
            "{index:04X}"
        );
    }
    let period = cia402().object(0x60C2).unwrap();
    assert_eq!(period.sub(1).unwrap().data_type, Some(Cia402Type::U8));
    assert_eq!(period.sub(2).unwrap().data_type, Some(Cia402Type::I8));
}

#[test]
fn has_every_object_of_the_profile_that_is_known() {
    let subs: usize = cia402().objects().iter().map(|object| object.subs.len()).sum();
    assert_eq!((cia402().objects().len(), subs), (194, 249));
    let unknown: Vec<u16> = cia402()
        .objects()
        .iter()
        .filter(|object| object.trust.confidence == Confidence::Unknown)
        .map(|object| object.index)
        .collect();
    assert_eq!(unknown, [0x604D, 0x604E, 0x604F]);
    assert!(cia402().objects().windows(2).all(|pair| pair[0].last < pair[1].index));
}

/// What a cyclic synchronous drive takes and gives can be mapped the way it flows.
#[test]
fn set_points_are_received_and_actual_values_transmitted() {
    for (index, access, pdo) in [
        (0x6040, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x6060, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x607A, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x60FF, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x6071, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x60B2, Cia402Access::Rw, Cia402Pdo::Rx),
        (0x6041, Cia402Access::Ro, Cia402Pdo::Tx),
        (0x6061, Cia402Access::Ro, Cia402Pdo::Tx),
        (0x6064, Cia402Access::Ro, Cia402Pdo::Tx),
        (0x606C, Cia402Access::Ro, Cia402Pdo::Tx),
        (0x6077, Cia402Access::Ro, Cia402Pdo::Tx),
        (0x60FD, Cia402Access::Ro, Cia402Pdo::Tx),
    ] {
        let value = cia402().sub(index, 0).unwrap();
        assert_eq!((value.access, value.pdo), (Some(access), Some(pdo)), "{index:04X}");
    }
}

#[test]
fn finds_objects_by_number_family_and_axis() {
    let name = |index| cia402().object(index).map(|object| object.name.as_str());
    assert_eq!(name(0x1400), Some("RPDO communication parameter"));
    assert_eq!(name(0x15FF), Some("RPDO communication parameter"));
    assert_eq!((name(0x13FF), name(0x6039), name(0)), (None, None, None));
    let of_axis = |index| cia402().object_of_axis(index).map(|(object, axis)| (object.index, axis));
    assert_eq!(of_axis(0x6040), Some((0x6040, 0)));
    assert_eq!(of_axis(0x6840), Some((0x6040, 1)));
    assert_eq!(of_axis(0x9840), Some((0x6040, 7)));
    assert_eq!((of_axis(0xA040), of_axis(0xFFFF)), (None, None));
    assert_eq!(of_axis(0x1018), Some((0x1018, 0)));
    assert_eq!(Cia402Dictionary::on_axis(0x607A, 3), Some(0x787A));
    assert_eq!(Cia402Dictionary::on_axis(0x607A, 8), None);
    assert_eq!(Cia402Dictionary::on_axis(0x1400, 3), Some(0x1400));
    let mapping = cia402().object(0x1A03).unwrap();
    assert_eq!((mapping.sub(0).unwrap().data_type, mapping.sub(64).unwrap().sub), (Some(Cia402Type::U8), 1));
    assert_eq!(mapping.sub(65), None);
}

#[test]
fn knows_states_by_their_mask() {
    let states = cia402().codes("State").unwrap();
    assert_eq!(states.kind, Cia402SetKind::States);
    let named = |word: i64| states.name_of(word);
    assert_eq!(named(0x0250), Some("Switch on disabled"));
    assert_eq!(named(0x0231), Some("Ready to switch on"));
    assert_eq!(named(0x0233), Some("Switched on"));
    assert_eq!(named(0x1637), Some("Operation enabled"));
    assert_eq!(named(0x0217), Some("Quick stop active"));
    assert_eq!(named(0x021F), Some("Fault reaction active"));
    assert_eq!(named(0x0238), Some("Fault"));
    assert_eq!(named(0x0200), Some("Not ready to switch on"));
    assert_eq!(named(0x0201), None);
    // No word is in two states.
    for word in 0..0x80 {
        let fits = states.codes.iter().filter(|state| word & i64::from(state.mask.unwrap()) == state.code);
        assert!(fits.count() <= 1, "{word:#x}");
    }
}

#[test]
fn unknown_error_codes_have_a_class() {
    let errors = cia402().codes("Error code").unwrap();
    assert_eq!(errors.codes.len(), 190);
    assert_eq!(errors.name_of(0x8611), Some("Following error"));
    assert_eq!(errors.class_of(0x8611), Some("Positioning"));
    assert_eq!((errors.name_of(0x2399), errors.class_of(0x2399)), (None, Some("Current, output side")));
    assert_eq!(errors.class_of(0x2FFF), Some("Current"));
    assert_eq!(errors.class_of(0xFF42), Some("Device specific"));
    assert_eq!(errors.class_of(0x0000), None);
    let unclassed: Vec<_> = errors.codes.iter().filter(|code| errors.class_of(code.code).is_none()).collect();
    assert_eq!(unclassed.len(), 1, "no error but `No error` is without a class: {unclassed:?}");
}

/// Bits that mean something else in each mode.
#[test]
fn bits_of_a_mode_are_told_apart() {
    let word = cia402().codes("Statusword").unwrap();
    let bit12 = |mode: &str| {
        let of_mode = |modes: &[&str]| modes.is_empty() || modes.contains(&mode);
        let mut found = word.codes.iter().filter(|code| code.code == 12 && of_mode(&code.modes));
        let name = found.next().map(|code| code.name.as_str());
        assert_eq!(found.next(), None, "{mode}");
        name
    };
    assert_eq!(bit12("pp"), Some("Set-point acknowledge"));
    assert_eq!(bit12("hm"), Some("Homing attained"));
    assert_eq!(bit12("csp"), Some("Drive follows the command value"));
    assert_eq!(bit12("vl"), None);
}
