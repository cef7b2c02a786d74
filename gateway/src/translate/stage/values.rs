//! What the drives of a machine hold, in place of what the simulated ones do.

use super::{Behind, Held, Stage, StageError};
use crate::mapping::{Cia402Dictionary, Item, Object};
use crate::translate::{Line, LineError, ListError};

/// Why values are not taken.
#[derive(Debug, thiserror::Error)]
pub enum ValuesError {
    /// A line is none, or of another kind.
    #[error(transparent)]
    Line(#[from] ListError),
    /// There is no such drive, or it has no such values.
    #[error("{line}: {message}")]
    Drive {
        /// Line, 1 first.
        line: usize,
        /// What was expected and what came.
        message: String,
    },
    /// With these values a drive cannot be led.
    #[error(transparent)]
    Stage(#[from] StageError),
}

/// The values of a list, with their lines.
fn held(text: &str) -> Result<Vec<(usize, Held)>, ListError> {
    let mut values = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let failed = |error| ListError { line, error };
        match Line::parse(content).map_err(failed)? {
            None => {}
            Some(Line::Held { drive, item, bytes }) => {
                values.push((line, Held { drive: drive.to_owned(), item, bytes }));
            }
            Some(_) => {
                let message =
                    "expected `idn DRIVE S-0-0076 BYTES` or `object DRIVE 608F:01 BYTES`".to_owned();
                return Err(failed(LineError { column: 1, message }));
            }
        }
    }
    Ok(values)
}

impl Stage {
    /// The same axes with drives that hold other values: scaling, gear, feed constant and whatever else they tell of themselves.
    /// `text` is a list of `idn` and `object` lines, as lists of frames have them.
    ///
    /// # Errors
    /// [`ValuesError`].
    pub fn with_values(mut self, text: &str) -> Result<Self, ValuesError> {
        for (line, Held { drive, item, bytes }) in held(text)? {
            let known = self.axes.iter().map(|axis| axis.drive.clone()).collect::<Vec<_>>().join(", ");
            let axis = self.axes.iter_mut().find(|axis| axis.drive == drive);
            let Some(axis) = axis else {
                let message = format!("expected the name of a drive, one of {known}, got `{drive}`");
                return Err(ValuesError::Drive { line, message });
            };
            match (&mut axis.behind, item) {
                (Behind::Sercos(drive), Item::Idn(idn)) => drive.facts.note_data(idn, &bytes),
                (Behind::Can(drive), Item::Object(object)) => {
                    let index = Cia402Dictionary::on_first_axis(object.index);
                    drive.facts.note_data(Object { index, ..object }, &bytes);
                }
                (Behind::Sercos(_), Item::Object(_) | Item::Attribute(_)) => {
                    let message = format!("{drive} is a SERCOS drive and has no objects");
                    return Err(ValuesError::Drive { line, message });
                }
                (Behind::Devicenet(_), _) => {
                    let message = format!("{drive} is on DeviceNet: its scaling stands in the configuration");
                    return Err(ValuesError::Drive { line, message });
                }
                (Behind::Can(_), Item::Idn(_) | Item::Attribute(_)) => {
                    let message = format!("{drive} is on CANopen and has no IDNs");
                    return Err(ValuesError::Drive { line, message });
                }
            }
            axis.stands_in = false;
        }
        Ok(self.compiled_anew()?)
    }

    /// Drives that hold these values from the beginning, commissioned anew: with other modes a drive gets other telegrams.
    ///
    /// # Errors
    /// [`ValuesError`].
    pub(in super::super) fn rehearse_with(&self, text: &str) -> Result<Self, ValuesError> {
        let held = held(text)?.into_iter().map(|(_, held)| held).collect();
        Ok(Self::rehearse_holding(&self.config, self.mapping.clone(), held)?)
    }

    /// Drives whose scaling is that of a simulated one: neither does the box set it, nor has anybody said what it is.
    pub fn stand_ins(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().filter(|axis| axis.stands_in).map(|axis| axis.drive.as_str())
    }
}
