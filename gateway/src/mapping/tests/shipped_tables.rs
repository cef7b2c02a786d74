//! The shipped tables are complete, and their examples come out.

use profile_cip::target::attribute::DefaultValue;
use profile_cip::target::exception::ExceptionAction;

use super::*;

#[test]
fn load_and_their_examples_come_out() {
    let examples = shipped().run_examples().unwrap_or_else(|failures| {
        panic!("{}", failures.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    });
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
        let by_action =
            [DriveAction::PowerUp, DriveAction::Enable].map(|action| program.drive_request(action));
        // Stop and Coast are what the stopping actions come to.
        let own = matches!(request, Request::Stop | Request::Coast | Request::Test);
        assert!(by_request || by_action.contains(&Some(*request)) || own, "{request}");
    }
}

#[test]
fn give_the_device_a_table_it_accepts() {
    let mapping = shipped();
    let axis = rotary_axis(true);
    let south = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
    let table = mapping.attribute_table(&rotary_counts()).unwrap();
    let definitions = table.definitions(&mapping.dictionaries.cip, Some(&south));
    DeviceTable::new(Scope::Instance, &definitions).unwrap();
    let backing = |id| definitions.iter().find(|row| row.id == id).map(|row| row.backing);
    assert_eq!(backing(504), Some(DeviceBacking::Drive), "Torque Limit - Positive");
    assert_eq!(backing(461), Some(DeviceBacking::Stored), "Kvp: no row on SERCOS");
    assert_eq!(backing(1319), Some(DeviceBacking::Stored), "rated current: the drive lets it be read only");
    assert_eq!(backing(641), None, "Inverter Temperature: rejected where the drive lacks it");
    assert_eq!(backing(1310), None, "strings are left out");
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
