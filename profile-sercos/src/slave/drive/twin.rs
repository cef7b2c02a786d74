//! The settings of another drive.
//!
//! What somebody sets and a drive keeps, is what a backup holds. A drive that is like another one has these settings and no others;
//! with those that it does not have it goes on inside, as it was made.

use profile_generic::servo::ServoParameters;

use super::super::parameter::{Cyclic, Definition, PARAMETERS_MAX, Parameter, Store};
use super::parameters;
use crate::wire::attribute::Attribute;
use crate::wire::header::Phase;
use crate::wire::idn::Idn;

/// A parameter of the drive that another one is like, as far as it is known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Given {
    /// Its number.
    pub idn: Idn,
    /// Element 2; empty when nobody says.
    pub name: String,
    /// Element 3; without it the length of the data says how long a value is.
    pub attribute: Option<Attribute>,
    /// Element 4; empty without.
    pub unit: String,
    /// Elements 5 and 6.
    pub limits: Option<(i64, i64)>,
    /// Element 7, of a list without its head.
    pub data: Vec<u8>,
}

impl Given {
    /// The attribute, if it fits the data, or one that does: bits of two, four or eight bytes, or a list of bytes.
    fn attribute(&self, known: Option<Attribute>) -> Attribute {
        let fits = |attribute: &Attribute| {
            let item = usize::from(attribute.item_length().bytes()).max(1);
            if attribute.is_list() { self.data.len().is_multiple_of(item) } else { self.data.len() == item }
        };
        let by_length = match self.data.len() {
            2 => 0x0001_0001,
            4 => 0x0002_0001,
            8 => 0x0003_0001,
            _ => 0x0004_0001,
        };
        self.attribute.filter(fits).or(known.filter(fits)).unwrap_or(Attribute(by_length))
    }
}

/// Whether a parameter is set by somebody and kept by the drive.
fn is_setting(parameter: &Parameter) -> bool {
    let writable = parameter.write_protection(Phase::CP2).is_none();
    writable && !parameter.attribute().is_command() && parameter.cyclic() == Cyclic::No
}

/// Gives a store the settings of another drive. The parameters of the communication stay as they are.
pub(super) fn shape(store: &mut Store, communication: &[Idn], given: &[Given], servo: &ServoParameters) {
    let is_own = |idn: &Idn| communication.contains(idn);
    let settings: Vec<Idn> = store.iter().filter(|known| is_setting(known)).map(Parameter::idn).collect();
    let others: Vec<&Given> = given.iter().filter(|given| !is_own(&given.idn)).collect();
    for given in &others {
        take(store, given);
    }
    // Limits and windows that the other drive does not say are those of the motor, in its scaling.
    parameters::preset(store, servo);
    for given in &others {
        store.set_data_of(given.idn, &given.data);
    }
    for idn in settings.into_iter().filter(|idn| !is_own(idn)) {
        if !others.iter().any(|given| given.idn == idn) {
            store.hide(idn);
        }
    }
}

/// Defines a parameter as it is given. Beyond [`PARAMETERS_MAX`] there are no further ones.
fn take(store: &mut Store, given: &Given) {
    let known = store.find(given.idn).map(|handle| store.get(handle));
    if known.is_none() && store.iter().count() >= PARAMETERS_MAX - 1 {
        return;
    }
    let attribute = given.attribute(known.map(Parameter::attribute));
    let name = match known {
        Some(known) if given.name.is_empty() => known.name().to_owned(),
        _ => given.name.clone(),
    };
    let (capacity, cyclic) = known.map_or((0, Cyclic::No), |known| (known.capacity(), known.cyclic()));
    let unit = match known {
        Some(known) if given.unit.is_empty() => known.unit().to_owned(),
        _ => given.unit.clone(),
    };
    let definition = Definition::data(given.idn, attribute, name, &given.data, capacity);
    let definition = definition.unit(unit).cyclic(cyclic);
    store.define(match given.limits.filter(|_| !attribute.is_list()) {
        Some((least, most)) => definition.range(least, most),
        None => definition,
    });
}

#[cfg(test)]
mod tests {
    use super::super::super::{Config, Slave};
    use super::super::Drive;
    use super::*;

    fn given(idn: Idn, data: &[u8]) -> Given {
        Given { idn, data: data.to_vec(), ..Given::default() }
    }

    fn drive(given: Vec<Given>) -> Slave<Drive> {
        let drive = Drive::like(ServoParameters::default(), given).expect("a servo that works");
        Slave::new(&Config::default(), drive)
    }

    #[test]
    fn a_drive_has_the_settings_that_are_given_and_no_others() {
        let vendor = Idn::product(4000);
        let slave = drive(vec![
            given(Idn::POSITION_LOOP_KV, &900_u16.to_le_bytes()),
            Given {
                name: "Notch frequency".into(),
                limits: Some((10, 4_000)),
                ..given(vendor, &250_u16.to_le_bytes())
            },
        ]);
        let store = slave.store();
        assert_eq!(store.number_of(Idn::POSITION_LOOP_KV), 900);
        let notch = store.get(store.find(vendor).expect("it was given"));
        assert_eq!(
            (notch.name(), notch.number(), notch.minimum(), notch.maximum()),
            ("Notch frequency", 250, Some(10), Some(4_000))
        );
        // Not given, so it has none; nor does it say so in its lists.
        assert!(store.find(Idn::MONITORING_WINDOW).is_none());
        let list =
            store.get(store.find(Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA).expect("every slave has it"));
        let idns: Vec<u32> =
            list.data().chunks(4).map(|idn| u32::from_le_bytes([idn[0], idn[1], idn[2], idn[3]])).collect();
        // S-0-0142, the application type, is one that every slave has.
        assert_eq!(idns, [Idn::POSITION_LOOP_KV.0, Idn::standard(142).0, vendor.0]);
        // What the protocol needs it has.
        for idn in
            [Idn::DRIVE_CONTROL, Idn::DRIVE_STATUS, Idn::POSITION_COMMAND, Idn::POSITION_FEEDBACK_VALUE_1]
        {
            assert!(store.find(idn).is_some(), "{idn}");
        }
    }

    #[test]
    fn scaling_that_is_given_is_that_of_the_motor() {
        let per_turn = |counts: u32| given(Idn::ROTATIONAL_POSITION_RESOLUTION, &counts.to_le_bytes());
        let window = |slave: &Slave<Drive>| slave.store().number_of(Idn::MONITORING_WINDOW);
        let (fine, coarse) = (drive(vec![per_turn(3_600_000)]), drive(vec![per_turn(360_000)]));
        assert!(window(&fine) > 0);
        assert_eq!(window(&fine), 10 * window(&coarse), "what is not given inside follows the scaling");
    }

    #[test]
    fn data_that_do_not_fit_their_attribute_are_taken_by_their_length() {
        let vendor = Idn::product(1);
        for (len, is_list) in [(2, false), (4, false), (8, false), (3, true), (0, true)] {
            let wrong = Some(Attribute(0x0002_0001)).filter(|_| len != 4);
            let slave = drive(vec![Given { attribute: wrong, ..given(vendor, &vec![1; len]) }]);
            let store = slave.store();
            let parameter = store.get(store.find(vendor).expect("it was given"));
            assert_eq!((parameter.attribute().is_list(), parameter.data().len()), (is_list, len));
        }
    }
}
