//! Whatever a drive can say is wrong leads to an exception, and every exception has a source or a reason.

use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;

use super::*;
use crate::CipFault;

/// The CIP side of what a drive shows: kind and number of the fault.
fn told(south: &DriveProgram, item: Item, word: u32) -> Vec<String> {
    let north = shipped().cip_program(&rotary_counts()).unwrap();
    let causes = south.faults(item, word);
    let told = causes.map(|(cause, _)| match north.fault(cause) {
        Some(CipFault::Axis { fault_type, code, .. }) => format!("{cause}: axis {fault_type}, {code}"),
        Some(CipFault::Node(code)) => format!("{cause}: node {code}"),
        None => panic!("{cause} has no exception"),
    });
    told.collect()
}

/// Every bit of the diagnostic words that a source knows, of SERCOS I/II and of SERCOS III.
#[test]
fn every_diagnostic_bit_of_sercos_has_an_exception() {
    let mapping = shipped();
    let axis = rotary_axis(false);
    let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
    let mut text = String::new();
    for (idn, name) in [(11, "Class 1 diagnostic"), (12, "Class 2 diagnostic")] {
        let word = mapping.dictionaries.sercos.word(name).unwrap();
        for field in word.fields.iter().filter(|field| field.name.is_some()) {
            let [(low, high)] = field.parts[..] else { panic!("{name}: {:?}", field.name) };
            assert_eq!(low, high, "{name}: {:?}", field.name);
            let told = told(&program, Idn::standard(idn).into(), 1 << low);
            assert!(!told.is_empty(), "{name}, bit {low}: {:?}", field.name);
            writeln!(text, "{name} {low} {}: {}", field.name.as_deref().unwrap_or(""), told.join(", "))
                .unwrap();
        }
    }
    insta::assert_snapshot!(text);
}

#[test]
fn every_error_code_of_cia_402_has_an_exception() {
    let mapping = shipped();
    let axis =
        Cia402Axis { modes: [OperatingMode::Position.into()].into_iter().collect(), ..Cia402Axis::default() };
    let counts = [Quantity::Position, Quantity::Velocity].map(|of| (of, Ratio::ONE)).to_vec();
    let program = mapping.cia402_program(&Cia402Axis { counts, ..axis }, &ObjectFacts::new()).unwrap();
    let word = program.diagnostic_words(true).next().unwrap();
    let set = mapping.dictionaries.cia402.codes("Error code").unwrap();
    let known: Vec<u32> =
        set.codes.iter().map(|code| u32::try_from(code.code).unwrap()).filter(|code| *code != 0).collect();
    assert!(known.len() > 140, "{}", known.len());
    for code in known {
        assert_eq!(told(&program, word, code).len(), 1, "{code:04X}");
    }
}

/// Each of the standard exceptions is found by the box, the device or a drive, or has a reason why nobody does; not both.
#[test]
fn every_standard_exception_has_a_source_or_a_reason() {
    let mapping = shipped();
    let set = mapping.dictionaries.cip.bits("Axis Exceptions").unwrap();
    assert_eq!(set.codes.len(), 58);
    let mut wrong = Vec::new();
    for named in &set.codes {
        let is = |bit: u8| u32::from(bit) == named.code;
        let raised = mapping.raised_exceptions().any(is);
        let reason = mapping.cip.unraised.iter().any(|(bit, _)| is(*bit));
        if raised == reason {
            wrong.push(format!("{} {}: raised {raised}, reason {reason}", named.code, named.name));
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
    assert_eq!(mapping.cip.unraised.len(), 20);
}
