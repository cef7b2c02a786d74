//! Where the values of the generic model are: in the controller's profile, and in those of the drives.

use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;

use crate::Mapping;
use crate::cip_tables::Served;

/// The places of one value; a side that has none is empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Places {
    /// Attributes of the axis, `461 Kvp`, and values of the updates, `Command Data Set: Position`.
    pub cip: Vec<String>,
    /// IDNs.
    pub sercos: Vec<String>,
    /// Objects.
    pub cia402: Vec<String>,
}

impl Mapping {
    /// Where a parameter of the generic model is.
    #[must_use]
    pub fn places_of_parameter(&self, parameter: Parameter) -> Places {
        let cip = self.attributes_served(|served| {
            matches!(served, Served::Parameter { parameter: known, .. } if *known == parameter)
                || matches!(served, Served::Signal { otherwise: Some(known), .. } if *known == parameter)
        });
        let sercos = self.sercos.parameters.iter().filter(|rule| rule.parameter == parameter);
        let cia402 = self.cia402.parameters.iter().filter(|rule| rule.parameter == parameter);
        Places {
            cip,
            sercos: once(sercos.map(|rule| rule.at.idn.to_string())),
            cia402: once(cia402.map(|rule| rule.at.value.object.to_string())),
        }
    }

    /// Where a signal is.
    #[must_use]
    pub fn places_of_signal(&self, signal: Signal) -> Places {
        let cyclic = self.tables().cip_generic.rows.cyclic.iter();
        let cyclic = cyclic.filter(|row| row.signal.get_ref() == signal.name());
        let cyclic = cyclic.map(|row| format!("{}: {}", row.set.get_ref(), row.element.get_ref()));
        let attributes = self.attributes_served(
            |served| matches!(served, Served::Signal { signal: known, .. } if *known == signal),
        );
        let sercos = self.sercos.signals.iter().filter(|rule| rule.signal == signal);
        let cia402 = self.cia402.signals.iter().filter(|rule| rule.signal == signal);
        Places {
            cip: cyclic.chain(attributes).collect(),
            sercos: once(sercos.map(|rule| rule.idn.to_string())),
            cia402: once(cia402.map(|rule| rule.value.object.to_string())),
        }
    }

    fn attributes_served(&self, is: impl Fn(&Served) -> bool) -> Vec<String> {
        let rows = self.cip.attributes.iter().filter(|row| is(&row.served));
        rows.map(|row| format!("{} {}", row.attribute.id, row.attribute.name)).collect()
    }
}

/// Each of them once: modes of a drive may have rows of their own.
fn once(places: impl Iterator<Item = String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for place in places {
        if !all.contains(&place) {
            all.push(place);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_found_on_each_side() {
        let mapping = Mapping::embedded().unwrap();
        let position = mapping.places_of_signal(Signal::PositionCommand);
        assert_eq!(position.sercos, ["S-0-0047"]);
        assert_eq!(position.cia402, ["607A:00", "60C1:01"], "csp and ip");
        assert!(position.cip.iter().any(|place| place.contains("Position")), "{position:?}");
        let limit = mapping.places_of_parameter(Parameter::ACCELERATION_LIMIT);
        assert_eq!(limit.cip, ["485 Acceleration Limit"]);
        assert_eq!(limit.sercos, ["S-0-0136"]);
        assert_eq!(mapping.places_of_parameter(Parameter::SERIAL_NUMBER), Places::default());
    }
}
