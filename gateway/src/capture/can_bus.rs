//! Which protocol runs on a CAN bus of a recording: CANopen and DeviceNet have the same identifiers for other things, so the
//! frames do not report.
//!
//! | asked in this order | says |
//! |---|---|
//! | the recording, of its own buses | which protocol, in the description of the interface |
//! | the configuration | protocol and number of the bus, by the interface's name, or by the number of an own bus |
//! | the user | which protocol all others have |
//! | a configuration whose buses are all of one kind | protocol, and the number of a single one |

use super::Side;
use super::reader::Frame;
use crate::config::{CanLink, Config};

/// What runs on a CAN bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CanProtocol {
    /// CANopen.
    Canopen,
    /// DeviceNet.
    Devicenet,
}

impl CanProtocol {
    /// Both.
    const ALL: [Self; 2] = [Self::Canopen, Self::Devicenet];

    /// `CANopen` or `DeviceNet`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Canopen => "CANopen",
            Self::Devicenet => "DeviceNet",
        }
    }

    /// How a bus of a recording is described: `can0, DeviceNet`.
    #[must_use]
    pub fn describe(self, link: &CanLink) -> String {
        format!("{}, {}", link.interface().unwrap_or("simulated"), self.name())
    }

    /// What a description made by [`Self::describe`] says.
    #[must_use]
    pub fn described(text: &str) -> Option<Self> {
        let (_, name) = text.rsplit_once(", ")?;
        Self::ALL.into_iter().find(|protocol| protocol.name() == name)
    }
}

/// A bus of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundBus {
    /// What runs on it.
    pub protocol: CanProtocol,
    /// Its number among the CAN buses of the configuration, which has those of CANopen first; `None` where that is not known.
    pub number: Option<usize>,
}

/// What is known of the CAN buses of a recording without looking at their frames.
#[derive(Debug, Clone, Default)]
pub struct CanBuses {
    /// Interface and protocol of those of the configuration.
    configured: Vec<(Option<String>, CanProtocol)>,
    /// What all others have.
    rest: Option<CanProtocol>,
}

impl CanBuses {
    /// The buses of a configuration.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        let name = |link: &CanLink| link.interface().map(str::to_owned);
        let canopen = config.can.iter().map(|bus| (name(&bus.link), CanProtocol::Canopen));
        let devicenet = config.devicenet.iter().map(|network| (name(&network.link), CanProtocol::Devicenet));
        Self { configured: canopen.chain(devicenet).collect(), rest: None }
    }

    /// The same, where all that nothing else tells of have this protocol.
    #[must_use]
    pub fn with_rest(self, rest: Option<CanProtocol>) -> Self {
        Self { rest, ..self }
    }

    /// The bus that a frame was on; `None` where nothing reports what runs there.
    #[must_use]
    pub fn find(&self, frame: &Frame<'_>) -> Option<FoundBus> {
        let known = |number: usize| {
            self.configured
                .get(number)
                .map(|(_, protocol)| FoundBus { protocol: *protocol, number: Some(number) })
        };
        if let Some(Side::Can(bus)) = frame.interface_name.and_then(Side::of_name) {
            let configured = known(bus.into());
            let described = frame.interface_description.and_then(CanProtocol::described);
            let Some(protocol) = described else { return configured.or(self.of_rest()) };
            // A recording that was made with another configuration is read as it says itself.
            let same = configured.filter(|configured| configured.protocol == protocol);
            return same.or(Some(FoundBus { protocol, number: None }));
        }
        let named = frame.interface_name.and_then(|name| {
            self.configured.iter().position(|(interface, _)| interface.as_deref() == Some(name))
        });
        named.and_then(known).or(self.of_rest())
    }

    /// What an interface has that nothing is known of.
    fn of_rest(&self) -> Option<FoundBus> {
        if let Some(protocol) = self.rest {
            return Some(FoundBus { protocol, number: None });
        }
        let (_, first) = self.configured.first()?;
        let same = self.configured.iter().all(|(_, protocol)| protocol == first);
        same.then_some(FoundBus { protocol: *first, number: (self.configured.len() == 1).then_some(0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::can::LINK_TYPE_CAN;

    const fn frame<'t>(name: Option<&'t str>, description: Option<&'t str>) -> Frame<'t> {
        Frame {
            number: 1,
            at: None,
            section: 0,
            interface: 0,
            interface_name: name,
            interface_description: description,
            link_type: LINK_TYPE_CAN,
            original_len: 0,
            data: &[],
            comment: None,
        }
    }

    #[test]
    fn descriptions_both_ways() {
        let can0 = CanLink::Interface { name: "can0".to_owned(), set_bit_rate: false };
        assert_eq!(CanProtocol::Devicenet.describe(&can0), "can0, DeviceNet");
        assert_eq!(CanProtocol::Canopen.describe(&CanLink::InProcess), "simulated, CANopen");
        for protocol in CanProtocol::ALL {
            assert_eq!(CanProtocol::described(&protocol.describe(&can0)), Some(protocol));
        }
        for text in ["can0", "DeviceNet", "a DeviceNet", "can0, DeviceNet of ours", ""] {
            assert_eq!(CanProtocol::described(text), None, "{text}");
        }
    }

    #[test]
    fn a_bus_is_told_by_the_recording_the_configuration_or_the_user_and_never_by_its_frames() {
        use CanProtocol::{Canopen, Devicenet};
        let own =
            |number, description| frame(Some(["can bus 1", "can bus 2", "can bus 3"][number]), description);
        let bus = |protocol, number| Some(FoundBus { protocol, number });
        let nothing = CanBuses::default();
        let both = CanBuses {
            configured: vec![(Some("can0".to_owned()), Canopen), (Some("can1".to_owned()), Devicenet)],
            rest: None,
        };
        let one = CanBuses { configured: vec![(None, Devicenet)], rest: None };
        let asked = nothing.clone().with_rest(Some(Devicenet));
        let cases = [
            (&nothing, own(1, Some("can1, DeviceNet")), bus(Devicenet, None)),
            (&nothing, own(1, Some("can1, CANopen")), bus(Canopen, None)),
            (&nothing, own(1, Some("can1")), None),
            (&nothing, frame(Some("can1"), None), None),
            (&both, own(1, Some("can1, DeviceNet")), bus(Devicenet, Some(1))),
            (&both, own(1, Some("can1")), bus(Devicenet, Some(1))),
            (&both, own(0, Some("can1, DeviceNet")), bus(Devicenet, None)),
            (&both, own(2, Some("simulated, DeviceNet")), bus(Devicenet, None)),
            (&both, own(2, None), None),
            (&both, frame(Some("can0"), None), bus(Canopen, Some(0))),
            (&both, frame(Some("can1"), Some("adapter, CANopen")), bus(Devicenet, Some(1))),
            (&both, frame(Some("can7"), None), None),
            (&both, frame(None, None), None),
            (&one, frame(None, None), bus(Devicenet, Some(0))),
            (&asked, frame(Some("can7"), None), bus(Devicenet, None)),
            (&asked, own(0, Some("can0, CANopen")), bus(Canopen, None)),
        ];
        for (number, (buses, frame, expected)) in cases.into_iter().enumerate() {
            assert_eq!(buses.find(&frame), expected, "case {number}");
        }
    }
}
