//! Where the values of the generic model are: in the controller's profile, and in those of the drives.

use crate::own_values::{OF_CONFIGURATION, OF_GATEWAY};
use profile_generic::image::Signal;
use profile_generic::parameter::Parameter;

use crate::Mapping;
use crate::cip_tables::{Missing, Served};

/// The places of one value; a side that has none is empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Places {
    /// Attributes of the axis, `461 Kvp`, and values of the updates, `Command Data Set: Position`.
    pub cip: Vec<String>,
    /// IDNs.
    pub sercos: Vec<String>,
    /// Objects.
    pub cia402: Vec<String>,
    /// What the gateway does with it; empty where it only passes it.
    pub gateway: &'static str,
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
            gateway: self.use_of(parameter),
        }
    }

    /// What the gateway does with a parameter itself.
    fn use_of(&self, parameter: Parameter) -> &'static str {
        if parameter == Parameter::MOTOR_TURNS_PER_UNIT {
            return "computes it from the scaling of the drive";
        }
        if [Parameter::POWER_STRUCTURE_AXIS_ID, Parameter::FEEDBACK_MASTER, Parameter::MOTOR_ENCODER_SHOWN]
            .contains(&parameter)
        {
            return "has it from the configuration of the axis";
        }
        if OF_GATEWAY.contains(&parameter) {
            return "has it from what it sees of the drive";
        }
        if parameter == Parameter::OWN_ACCELERATION_FEED_FORWARD {
            return "feeds no acceleration forward to a drive that does it itself";
        }
        if self.dictionaries.generic.computation(parameter).is_some() {
            return "computes it where the drive has none";
        }
        let missing = self.cip.attributes.iter().find_map(|row| match row.served {
            Served::Parameter { parameter: known, missing, .. } if known == parameter => Some(missing),
            _ => None,
        });
        match missing {
            _ if OF_CONFIGURATION.contains(&parameter) => {
                "has it from the configuration where the drive has none"
            }
            Some(Missing::Device | Missing::DeviceOrZero) => "goes by it where the drive has none",
            Some(Missing::Zero) => "takes 0 only where the drive has none",
            Some(Missing::Stored) => "stores it where the drive has none",
            Some(Missing::Absent) | None => "",
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
            gateway: match signal {
                Signal::AccelerationCommand => "interpolates it",
                Signal::PositionOffset => "adds it to the set-point",
                _ => "",
            },
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
        let ramp = mapping.places_of_parameter(Parameter::RAMP_ACCELERATION);
        assert_eq!((ramp.sercos.len(), ramp.gateway), (0, "goes by it where the drive has none"));
    }

    /// A value that nobody writes and nobody reads is none. One without a place in a drive is for the gateway, or for the overlays of drives
    /// that have one.
    #[test]
    fn each_value_of_the_model_is_somewhere() {
        let mapping = Mapping::embedded().unwrap();
        let generic = &mapping.dictionaries.generic;
        let parameters = generic
            .parameters()
            .iter()
            .map(|row| (row.name.clone(), mapping.places_of_parameter(row.parameter)));
        let signals = generic
            .signals()
            .iter()
            .map(|signal| (signal.name().to_owned(), mapping.places_of_signal(*signal)));
        let (mut of_overlays, mut nowhere) = (Vec::new(), Vec::new());
        for (name, places) in parameters.chain(signals) {
            let in_drives = !places.sercos.is_empty() || !places.cia402.is_empty();
            if !in_drives && places.cip.is_empty() && places.gateway.is_empty() {
                nowhere.push(name);
            } else if !in_drives && places.gateway.is_empty() {
                of_overlays.push(name);
            }
        }
        // A text, which no row takes yet, and what the overlays of docs/mapping.md bind to a number of the vendor.
        assert_eq!(nowhere, ["motor_name", "power_loss_action"]);
        insta::assert_snapshot!(of_overlays.join("\n"));
    }
}
