//! What a drive is built with.

use profile_generic::quantity::TorqueAbsolute;
use profile_generic::servo::ServoParameters;

/// A property that a drive has from the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Property {
    /// Counts of the encoder in an axis unit.
    Resolution(u32),
    /// Rated torque or force.
    RatedTorque(TorqueAbsolute),
    /// Turns of the motor, and those of the load that they make.
    Gear(u32, u32),
}

/// The properties that a script sets, in its order: the last one counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Setup(Vec<(Option<u16>, Property)>);

impl Setup {
    /// Sets a property of a drive, or of all.
    pub fn set(&mut self, drive: Option<u16>, property: Property) {
        self.0.push((drive, property));
    }

    fn of(&self, drive: u16) -> impl Iterator<Item = Property> {
        let concerned = move |to: &Option<u16>| to.is_none_or(|to| to == drive);
        self.0.iter().filter(move |(to, _)| concerned(to)).map(|(_, property)| *property)
    }

    /// The servo of a drive. With another rated torque it has a motor that is as fast: the inertia grows with the torque.
    #[must_use]
    pub fn servo(&self, drive: u16, base: ServoParameters) -> ServoParameters {
        self.of(drive).fold(base, |servo, property| match property {
            Property::Resolution(encoder_counts) => ServoParameters { encoder_counts, ..servo },
            Property::RatedTorque(rated_torque) => {
                let grown = i128::from(base.inertia) * i128::from(rated_torque.0);
                let inertia = i64::try_from(grown / i128::from(base.rated_torque.0.max(1)));
                ServoParameters { rated_torque, inertia: inertia.unwrap_or(i64::MAX).max(1), ..servo }
            }
            Property::Gear(..) => servo,
        })
    }

    /// The gear of a drive.
    #[must_use]
    pub fn gear(&self, drive: u16) -> Option<(u32, u32)> {
        let gears = self.of(drive).filter_map(|property| match property {
            Property::Gear(motor, load) => Some((motor, load)),
            _ => None,
        });
        gears.last()
    }
}
