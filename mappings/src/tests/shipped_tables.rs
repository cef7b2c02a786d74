//! The shipped tables are complete, and their examples come out.

use profile_cip::device::attribute::DefaultValue;
use profile_cip::device::exception::ExceptionAction;

use super::*;

#[test]
fn load_and_their_examples_come_out() {
    let mut findings = Findings::default();
    let examples = shipped().run_examples(&mut findings);
    assert!(findings.is_empty(), "{findings}");
    assert!(examples >= 30, "{examples}");
}

#[test]
fn repeat_the_generic_catalogue_completely() {
    let dictionary = &shipped().dictionaries.generic;
    assert_eq!(dictionary.signals(), Signal::ALL);
    let listed: Vec<_> = dictionary.parameters().iter().map(|row| row.parameter).collect();
    let catalogue: Vec<_> = CATALOGUE.iter().map(|row| row.parameter).collect();
    assert_eq!(listed, catalogue);
}

#[test]
fn leave_no_cause_inhibit_state_mode_or_reaction_without_a_row() {
    let mapping = shipped();
    let program = mapping.cip_program(&rotary_counts()).unwrap();
    for (cause, name) in FaultCause::NAMED {
        assert!(program.fault(*cause).is_some(), "{name}");
    }
    for (inhibit, name) in Inhibits::NAMED {
        assert_ne!(program.start_inhibits(*inhibit), (0, 0), "{name}");
    }
    for reaction in Reaction::ALL.iter().filter(|reaction| reaction.stops()) {
        assert_ne!(program.fault_action(*reaction), 0, "{reaction}");
    }
    assert_eq!((0..16).filter(|code| program.mode(*code).is_some()).count(), 5);
    for request in Request::ALL {
        let by_request =
            (0..=255).any(|code| program.request(code).and_then(|row| row.request) == Some(*request));
        let by_action = [DriveAction::PowerUp, DriveAction::Enable, DriveAction::Test]
            .map(|action| program.drive_request(action));
        // Stop and Coast are what the stopping actions come to.
        let own = matches!(request, Request::Stop | Request::Coast);
        assert!(by_request || by_action.contains(&Some(*request)) || own, "{request}");
    }
}

#[test]
fn give_the_device_a_table_it_accepts() {
    let definitions = shipped().attribute_definitions(&rotary_counts()).unwrap();
    for scope in [Scope::Class, Scope::Instance] {
        DeviceTable::new(scope, &definitions).unwrap();
    }
    let row = |id| definitions.iter().find(|row| row.id == id && row.scope == Scope::Instance);
    let backing = |id| row(id).map(|row| row.backing);
    assert_eq!(backing(504), Some(DeviceBacking::Drive), "Torque Limit - Positive");
    assert_eq!(backing(461), Some(DeviceBacking::Drive), "Kvp");
    assert_eq!(backing(454), Some(DeviceBacking::Signal), "Velocity Feedback");
    assert_eq!(backing(41), Some(DeviceBacking::Stored), "Control Method");
    assert_eq!(row(610).map(|row| row.codes.clone()), Some(vec![0, 1, 2, 3, 4]), "Stopping Action");
    assert_eq!(row(676).and_then(|row| row.bits), Some(0b11_1110), "Start Inhibits");
}

#[test]
fn say_of_every_attribute_who_serves_it_or_why_nobody_does() {
    let mapping = shipped();
    let served = |id| mapping.cip.attributes.iter().any(|row| row.attribute.id == id);
    let rejected = |id| mapping.cip.rejected.iter().find(|(known, _)| *known == id);
    let unsaid: Vec<_> = mapping
        .dictionaries
        .cip
        .attributes()
        .iter()
        .filter(|row| !served(row.id) && rejected(row.id).is_none())
        .map(|row| format!("{} {}", row.id, row.name))
        .collect();
    assert_eq!(unsaid, Vec::<String>::new());
    assert_eq!(mapping.cip.attributes.len() + mapping.cip.rejected.len(), 452);
}

/// What the standard requires of such a device and the box does not have: a list that may only become shorter.
#[test]
fn own_up_to_the_required_attributes_that_nobody_serves() {
    let mapping = shipped();
    let mut list = String::new();
    for (id, reason) in &mapping.cip.rejected {
        let row = mapping.dictionaries.cip.attribute_by_id(*id).unwrap();
        if crate::definitions::requires(&row.need) {
            list.push_str(&format!("{id} {} ({}): {reason}\n", row.name, row.need));
        }
    }
    insta::assert_snapshot!(list);
}

/// What can be set for each exception, from the rows of both tables.
#[test]
fn say_what_the_controller_may_set_for_each_exception() {
    let mapping = shipped();
    let mut text = String::new();
    for (manufacturer, set) in [(false, "Axis Fault"), (true, "Axis Fault - Mfg")] {
        let rules = mapping.exception_rules(manufacturer);
        assert_eq!(rules.len(), 64);
        let program = mapping.cip_program(&rotary_counts()).unwrap();
        for (bit, rule) in (0_u8..).zip(&rules) {
            let DefaultValue::Integer(default) = rule.default else { panic!("an integer") };
            let (least, most) = rule.range;
            if most > 254.0 {
                assert_eq!((least, default), (255.0, 255));
                continue;
            }
            let fault_type = if manufacturer { 4 } else { 3 };
            let cause = program.cause(fault_type, bit).expect("a row");
            let default = ExceptionAction(u8::try_from(default).unwrap());
            let least =
                (0..4).find(|code| f64::from(*code) >= least).map(ExceptionAction).expect("an action");
            writeln!(text, "{set} {bit}: {cause}, {default}, at least {least}").unwrap();
        }
    }
    insta::assert_snapshot!(text);
}

/// A warning is no reason to stop unless the controller says so.
#[test]
fn let_a_drive_that_only_warns_go_on() {
    let mapping = shipped();
    for row in mapping.sercos.faults.iter().filter(|row| !row.reaction.stops()) {
        let exception = mapping.cip.exceptions.iter().find(|known| known.cause == row.cause);
        let exception = exception.unwrap_or_else(|| panic!("{}: no exception", row.cause));
        assert_eq!((exception.least, exception.default), (0, 1), "{}", row.cause);
        let trips =
            mapping.sercos.faults.iter().any(|other| other.cause == row.cause && other.reaction.stops());
        assert!(!trips, "{}: a cause of its own tells a warning from an error", row.cause);
    }
}

/// What is wrong with one drive stops its axis, and no other: a fault of the node is one of all axes of the device, and needs a reset of
/// its own.
#[test]
fn no_fault_of_a_drive_is_one_of_the_node() {
    let mapping = shipped();
    let cip = mapping.cip_program(&rotary_counts()).unwrap();
    let causes = mapping.sercos.faults().iter().chain(mapping.cia402.faults()).map(|row| row.cause);
    let mut tried = 0;
    for cause in causes {
        tried += 1;
        assert!(matches!(cip.fault(cause), Some(CipFault::Axis { .. })), "{cause}");
    }
    assert!(tried > 150, "{tried} rows");
}

/// Every IDN of the drive profile is bound by a row, or by a word of one, or stands among the unbound with a reason.
#[test]
fn every_idn_of_the_profile_is_bound_or_has_a_reason() {
    let mapping = shipped();
    let profile = mapping.dictionaries.sercos.idns().iter().filter(|row| row.part == IdnPart::Profile);
    assert_eq!((profile.count(), mapping.sercos.unbound.len()), (395, 284));
    assert_eq!(mapping.sercos.unanswered, []);
}

/// Every object of the dictionary of CiA 402 is bound by a row, or stands among the unbound with a reason.
#[test]
fn every_object_of_cia_402_is_bound_or_has_a_reason() {
    let mapping = shipped();
    let objects = mapping.dictionaries.cia402.objects().len();
    assert_eq!((objects, mapping.cia402.unbound.len()), (194, 126));
    assert_eq!(mapping.cia402.unanswered, Vec::<u16>::new());
}
