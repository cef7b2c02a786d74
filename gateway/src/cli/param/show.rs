//! Parameters for people, and as JSON.

use std::fmt::Write as _;

use super::drive::List;
use crate::cli::CliError;
use crate::local::drive::job::ParameterReport;
use crate::local::protocol::printable;

/// A parameter as one JSON object in a line.
pub fn json(report: &ParameterReport) -> Result<String, CliError> {
    Ok(serde_json::to_string(report)? + "\n")
}

/// A parameter with everything that is known of it.
pub fn parameter(report: &ParameterReport) -> String {
    let ParameterReport {
        id,
        name,
        kind,
        unit,
        minimum,
        maximum,
        attribute,
        access,
        writable,
        value,
        data,
        ..
    } = report;
    let mut text = id.clone();
    if let Some(name) = name {
        let _ = write!(text, " {}", printable(name));
    }
    text.push('\n');
    let with_unit = |value: &str| match unit {
        Some(unit) => format!("{} {}", printable(value), printable(unit)),
        None => printable(value),
    };
    let rows = [
        ("value", Some(with_unit(value))),
        ("minimum", minimum.as_deref().map(with_unit)),
        ("maximum", maximum.as_deref().map(with_unit)),
        ("type", kind.clone()),
        ("attribute", attribute.clone()),
        ("access", access.clone()),
        ("writable", writable.clone()),
        ("data", Some(data.clone()).filter(|data| !data.is_empty())),
    ];
    for (key, value) in rows {
        if let Some(value) = value {
            let _ = writeln!(text, "  {key:<9}  {value}");
        }
    }
    text
}

/// What was written.
pub fn written(report: &ParameterReport) -> String {
    let unit = report.unit.as_ref().map(|unit| format!(" {}", printable(unit))).unwrap_or_default();
    let before =
        report.before.as_ref().map(|before| format!(" (was {})", printable(before))).unwrap_or_default();
    let mut text = format!("{} = {}{unit}{before}\n", report.id, printable(&report.value));
    if report.recommission {
        text += RECOMMISSION;
    }
    text
}

/// What has to be done after a parameter was written that decides what the values of a drive mean.
pub const RECOMMISSION: &str = "\
    The axis cannot be enabled before its drive was commissioned again: restart the gateway, or switch the drive off and on.\n";

/// A list of parameters, and where it is from.
pub fn list(list: &List) -> String {
    let head = ["parameter", "access", "type", "unit", "name"].map(str::to_owned);
    let row = |listed: &super::drive::Listed| {
        let detail = |key| printable(listed.detail(key));
        [listed.id.clone(), detail("access"), detail("type"), detail("unit"), detail("name")]
    };
    let mut rows = vec![head];
    rows.extend(list.parameters.iter().map(row));
    let mut text = table(&rows);
    let source = match list.source.as_str() {
        "dictionary" => "the dictionary of the gateway; the drive may have others, and lack some".to_owned(),
        "file" => "the device file of the configuration".to_owned(),
        idn => format!("{idn} of the drive"),
    };
    let _ = writeln!(text, "\n{} parameters, from {source}", list.parameters.len());
    text
}

/// The same as a JSON object.
pub fn list_json(list: &List) -> Result<String, CliError> {
    Ok(serde_json::to_string(list)? + "\n")
}

/// Rows whose columns begin below each other. Columns without anything in them below the head are left out.
pub fn table<const N: usize>(rows: &[[String; N]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let used: [bool; N] =
        std::array::from_fn(|column| rows.iter().skip(1).any(|row| !row[column].is_empty()));
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(widths).zip(used).filter(|(_, used)| *used);
        let cells: Vec<_> = cells.map(|((cell, width), _)| format!("{cell:<width$}")).collect();
        let _ = writeln!(text, "{}", cells.join("  ").trim_end());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::param::drive::Listed;

    fn gain() -> ParameterReport {
        let text = |text: &str| Some(text.to_owned());
        ParameterReport {
            id: "S-0-0104".to_owned(),
            name: text("Position loop Kv-factor"),
            kind: text("2 byte unsigned, 2 decimals"),
            unit: text("1000/min"),
            minimum: text("0.01"),
            maximum: text("655.35"),
            attribute: text("0x02110001"),
            access: None,
            writable: text("without torque"),
            value: "1.50".to_owned(),
            before: text("1.00"),
            recommission: false,
            data: "9600".to_owned(),
        }
    }

    #[test]
    fn a_parameter_is_shown_with_what_is_known_of_it() {
        insta::assert_snapshot!(parameter(&gain()));
        assert_eq!(written(&gain()), "S-0-0104 = 1.50 1000/min (was 1.00)\n");
        let scaling = ParameterReport { recommission: true, ..gain() };
        assert!(written(&scaling).ends_with(RECOMMISSION));
        let named = ParameterReport {
            id: "notch".to_owned(),
            value: "5\u{1b}[2J".to_owned(),
            ..ParameterReport::default()
        };
        assert_eq!(parameter(&named), "notch\n  value      5?[2J\n");
        assert_eq!(json(&named).unwrap(), "{\"id\":\"notch\",\"value\":\"5\\u001b[2J\"}\n");
    }

    #[test]
    fn a_list_says_where_it_is_from() {
        let listed = |id: &str, name: &str| Listed {
            id: id.to_owned(),
            details: std::iter::once(("name".to_owned(), name.to_owned())).collect(),
        };
        let list = List {
            axis: "x".to_owned(),
            bus: "sercos".to_owned(),
            source: "S-0-0192".to_owned(),
            parameters: vec![listed("S-0-0104", "Position loop Kv-factor"), listed("P-0-0001", "")],
        };
        let expected = "parameter  name\nS-0-0104   Position loop Kv-factor\nP-0-0001\n\n2 parameters, from S-0-0192 of the drive\n";
        assert_eq!(super::list(&list), expected);
        let json = list_json(&list).unwrap();
        assert!(
            json.starts_with(
                r#"{"axis":"x","bus":"sercos","source":"S-0-0192","parameters":[{"id":"S-0-0104","name":"#
            ),
            "{json}"
        );
    }
}
