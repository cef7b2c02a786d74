//! A simulated SERCOS drive that is like a real one, by a backup of its parameters.

use std::path::Path;

use profile_sercos::slave::drive::Given;
use profile_sercos::slave::parameter::Store;
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;

use crate::parameter::backup::{Backup, Kept, questions};
use crate::parameter::value::{Kind, unhex};

/// Why there is no drive like that of a file.
type TwinError = Box<dyn std::error::Error + Send + Sync>;

/// Settings of a drive: fewer than a slave can have parameters.
const PARAMETERS_MAX: usize = 3_500;

/// The number of its maker: the only answer that is not a text.
const VENDOR_CODE: Idn = Idn::structured(1300, 0, 3);

/// A twin keeps its own: each drive has another one.
const SERIAL_NUMBER: Idn = Idn::structured(1300, 0, 12);

/// What a drive is like.
#[derive(Debug, Clone)]
pub struct Twin {
    given: Vec<Given>,
    answers: Vec<(Idn, String)>,
}

impl Twin {
    /// Reads a file that `axisbridge param backup` has written.
    ///
    /// # Errors
    /// It cannot be read, is no backup, or not one of a SERCOS drive.
    pub fn load(path: &Path) -> Result<Self, TwinError> {
        let backup = Backup::load(path)?;
        Self::of(&backup).map_err(|error| format!("{}: {error}", path.display()).into())
    }

    /// The same from the text of a file.
    ///
    /// # Errors
    /// As [`Twin::load`].
    pub fn parse(text: &str) -> Result<Self, TwinError> {
        Ok(Self::of(&Backup::parse(text)?)?)
    }

    fn of(backup: &Backup) -> Result<Self, String> {
        if backup.bus != "sercos" {
            return Err(format!("expected a backup of a SERCOS drive, got one of a drive on {}", backup.bus));
        }
        if backup.parameter.len() > PARAMETERS_MAX {
            let count = backup.parameter.len();
            return Err(format!("expected at most {PARAMETERS_MAX} parameters, got {count}"));
        }
        let given = backup.parameter.iter().map(given).collect::<Result<_, _>>()?;
        let answers = questions("sercos")
            .iter()
            .filter_map(|question| {
                Some((question.id.parse().ok()?, backup.drive.0.get(question.key)?.clone()))
            })
            .filter(|(idn, _)| *idn != SERIAL_NUMBER)
            .collect();
        Ok(Self { given, answers })
    }

    /// The parameters of the drive.
    #[must_use]
    pub fn given(&self) -> &[Given] {
        &self.given
    }

    /// Gives a slave what the drive says about itself.
    pub fn name(&self, store: &mut Store) {
        for (idn, text) in &self.answers {
            if *idn != VENDOR_CODE {
                store.set_data_of(*idn, text.as_bytes());
            } else if let Some(code) = number(text) {
                store.set_number_of(VENDOR_CODE, code);
            }
        }
    }
}

/// A parameter of the backup.
fn given(kept: &Kept) -> Result<Given, String> {
    let idn: Idn = kept.id.parse().map_err(|error| format!("{}: {error}", kept.id))?;
    let data = unhex(&kept.data).ok_or_else(|| format!("{idn}: expected bytes of two hexadecimal digits"))?;
    if data.len() > usize::from(u16::MAX) - 4 {
        return Err(format!("{idn}: expected at most 65531 bytes, got {}", data.len()));
    }
    let attribute = match kept.attribute.as_str() {
        "" => None,
        text => {
            let word = text.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
            let word =
                word.ok_or_else(|| format!("{idn}: expected an attribute such as 0x01110001, got `{text}`"))?;
            Some(Attribute(word))
        }
    };
    // Limits are written as values are.
    let limit = |text: &str| -> Result<Option<i64>, String> {
        let Some(attribute) = attribute.filter(|attribute| !attribute.is_list() && !text.is_empty()) else {
            return Ok(None);
        };
        let bytes = Kind::Sercos(attribute).encode(text).map_err(|error| format!("{idn}: {error}"))?;
        let signed = attribute.format() == profile_sercos::wire::attribute::Format::Signed;
        let negative = signed && bytes.last().is_some_and(|last| last & 0x80 != 0);
        let mut wide = [if negative { 0xFF } else { 0 }; 8];
        let place = wide.get_mut(..bytes.len()).ok_or_else(|| format!("{idn}: expected at most 8 bytes"))?;
        place.copy_from_slice(&bytes);
        Ok(Some(i64::from_le_bytes(wide)))
    };
    let limits = limit(&kept.minimum)?.zip(limit(&kept.maximum)?);
    let (name, unit) = (kept.name.clone(), kept.unit.clone());
    Ok(Given { idn, name, attribute, unit, limits, data })
}

fn number(text: &str) -> Option<i64> {
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::scaling::UnitKind;

    use super::*;
    use crate::simulate::drive_events::setup::Setup;
    use crate::simulate::drives::{DriveLine, LineKind};

    const BACKUP: &str = "format = 1\naxis = \"turntable\"\nbus = \"sercos\"\nsource = \"S-0-0192\"\n\n\
        [drive]\ndevice_id = \"HX-9\"\nvendor_code = \"0x0539\"\nfirmware = \"HX-9 V2\"\n\n\
        [[parameter]]\nid = \"S-0-0104\"\nname = \"Kv\"\nvalue = \"2.50\"\nunit = \"1000/min\"\nattribute = \"0x02110001\"\n\
        minimum = \"0.10\"\nmaximum = \"30.00\"\ndata = \"fa00\"\n\n\
        [[parameter]]\nid = \"P-0-4011\"\nname = \"Brake delay\"\nvalue = \"-7\"\nattribute = \"0x00210001\"\n\
        minimum = \"-10\"\nmaximum = \"10\"\ndata = \"f9ff\"\n\n\
        [[parameter]]\nid = \"P-0-0003\"\nvalue = \"hex:010203\"\ndata = \"010203\"\n";

    #[test]
    fn a_drive_is_like_the_one_of_a_backup() {
        let twin = Twin::parse(BACKUP).expect("a backup of a SERCOS drive");
        let mut line =
            DriveLine::like([(7, UnitKind::Rotary)], false, &LineKind::Plain, &Setup::default(), Some(&twin))
                .expect("a drive that works");
        let store = line.network_mut().slaves()[0].store();
        let get = |idn: Idn| store.get(store.find(idn).unwrap_or_else(|| panic!("no {idn}")));
        let gain = get(Idn::POSITION_LOOP_KV);
        assert_eq!(
            (gain.number(), gain.minimum(), gain.maximum(), gain.unit()),
            (250, Some(10), Some(3_000), "1000/min")
        );
        let brake = get("P-0-4011".parse().expect("an IDN"));
        assert_eq!(
            (brake.number(), brake.minimum(), brake.maximum(), brake.name()),
            (-7, Some(-10), Some(10), "Brake delay")
        );
        assert_eq!(get("P-0-0003".parse().expect("an IDN")).data(), [1, 2, 3]);
        assert_eq!(get(Idn::structured(1300, 0, 5)).data(), b"HX-9");
        assert_eq!(get(VENDOR_CODE).number(), 0x539);
        assert!(store.find(Idn::POSITION_WINDOW).is_none(), "it is a setting that the backup does not have");
    }

    #[test]
    fn what_is_no_backup_of_a_sercos_drive_is_refused_with_the_reason() {
        let refused = |from: &str, to: &str| {
            assert!(BACKUP.contains(from), "{from}");
            Twin::parse(&BACKUP.replacen(from, to, 1)).expect_err(to).to_string()
        };
        assert_eq!(
            refused("\"sercos\"", "\"canopen\""),
            "expected a backup of a SERCOS drive, got one of a drive on canopen"
        );
        assert_eq!(
            refused("0x02110001", "2110001"),
            "S-0-0104: expected an attribute such as 0x01110001, got `2110001`"
        );
        assert!(refused("\"0.10\"", "\"little\"").starts_with("S-0-0104: `little` is not "));
        assert!(refused("\"P-0-4011\"", "\"6040:00\"").starts_with("6040:00: "));
    }
}
