//! What success means for each attribute of an axis, by what its drive has now.

use std::fmt::Write as _;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::protocol;
use crate::config::{Axis, Config};
use crate::engine::Engine;
use crate::engine::build::scaling;
use crate::engine::programs::Programs;
use crate::mapping::{AttributeTruth, CipScaling, Mapping};

/// An attribute, as the line `attribute` has it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttributeLine {
    /// Attribute number.
    pub id: u16,
    /// Name.
    pub name: String,
    /// `Get`, `Set` or `Set*`.
    pub access: String,
    /// `live`, `compared`, `computed`, `stored` or `absent`.
    pub truth: String,
    /// By what: a place in the drive, a signal, a reason.
    pub by: String,
}

impl From<&AttributeTruth<'_>> for AttributeLine {
    fn from(row: &AttributeTruth<'_>) -> Self {
        Self {
            id: row.id,
            name: row.name.to_owned(),
            access: row.access.name().to_owned(),
            truth: row.truth.name().to_owned(),
            by: row.by.clone(),
        }
    }
}

/// The attributes of the axes of a gateway.
#[derive(Debug, Clone)]
pub struct Attributes {
    mapping: Arc<Mapping>,
    /// The scaling of each axis; `None` where no CIP Motion device has it. Tables are made when they are asked for: they would take 47 kB an axis.
    scalings: Vec<Option<CipScaling>>,
    programs: Programs,
}

impl Attributes {
    /// Those of this configuration and its engine.
    #[must_use]
    pub fn of(config: &Config, engine: &Engine) -> Self {
        let mapping = engine.shared_mapping();
        let of_motion = |axis: &Axis| {
            let of_motion = config.devices.get(axis.device).is_some_and(|device| device.assembly.is_none());
            of_motion.then(|| scaling(axis))
        };
        let scalings = config.axes.iter().map(of_motion).collect();
        Self { mapping, scalings, programs: engine.programs() }
    }

    /// Those of axes that no CIP Motion device has.
    #[cfg(test)]
    pub(super) fn of_nobody(axes: usize) -> Self {
        let mapping = Arc::new(Mapping::embedded().expect("the shipped tables are sound"));
        Self { mapping, scalings: vec![None; axes], programs: Programs::default() }
    }

    /// The reply to `attributes`: a line for each, and one that ends the list.
    #[must_use]
    pub fn reply(&self, axis: usize, name: &str) -> String {
        let scaling = self.scalings.get(axis).copied().flatten();
        let Some(table) = scaling.and_then(|scaling| self.mapping.attribute_table(&scaling)) else {
            return format!("error attributes {name} no-attributes: no CIP Motion device has the axis\n");
        };
        let Some(program) = self.programs.get(axis) else {
            return format!("error attributes {name} unanswered: the drive is not commissioned\n");
        };
        let truths = self.mapping.truths(&table, &program);
        let mut text = protocol::rows("attribute", truths.iter().map(AttributeLine::from));
        let _ = writeln!(text, "ok attributes {}", truths.len());
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_the_examples_have_tables() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        for (name, text) in [
            ("sercos", include_str!("../../../examples/two-axes-sercos.toml")),
            ("can", include_str!("../../../examples/two-axes-can.toml")),
            ("devicenet", include_str!("../../../examples/two-axes-devicenet.toml")),
        ] {
            let config = Config::parse(text, name).expect("sound");
            for axis in &config.axes {
                assert!(mapping.attribute_table(&scaling(axis)).is_some(), "{name} {}", axis.name);
            }
        }
    }
}
