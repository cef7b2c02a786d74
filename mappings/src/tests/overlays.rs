//! What is laid over the shipped tables.

use std::collections::BTreeSet;

use toml::de::{DeTable, DeValue};

use super::*;
use crate::finding::registry as code;
use crate::load::{FILES, table_name};

const EXAMPLE: &str = include_str!("../../../examples/overlays/line-4.toml");

fn over(overlays: &[&str]) -> (Option<Mapping>, Findings) {
    let mut texts = TableTexts::embedded();
    texts.overlays = overlays.iter().map(|text| Overlay::new("own.toml", text)).collect();
    let mut findings = Findings::default();
    (Mapping::resolve(&texts, &mut findings), findings)
}

fn good(body: &str) -> Mapping {
    let (mapping, findings) = over(&[&format!("format = 1\noverlay = \"test\"\n{body}")]);
    assert!(findings.is_empty(), "{findings}");
    mapping.unwrap()
}

#[test]
fn the_example_of_the_documentation_does_what_it_says() {
    let guide = include_str!("../../../docs/mapping.md");
    for line in EXAMPLE.lines().filter(|line| !line.is_empty()) {
        assert!(guide.contains(&format!("    {line}\n")), "docs/mapping.md lacks: {line}");
    }
    let (mapping, findings) = over(&[EXAMPLE]);
    assert!(findings.is_empty(), "{findings}");
    let mapping = mapping.unwrap();
    let brake = mapping.sercos.faults().iter().find(|row| row.pattern.mask == 1 << 4).unwrap();
    assert_eq!((brake.word, brake.reaction), (Idn::standard(12).into(), Reaction::Alarm));
    assert_eq!(brake.cause.to_string(), "drive_warning");
    // The row stands in front of those that are there: the first that fits wins.
    assert_eq!(mapping.sercos.faults().first(), Some(brake));
    let jerk = |mapping: &Mapping| {
        let rows = mapping.tables().generic_sercos.rows.parameter.iter();
        let row = rows.clone().find(|row| row.parameter.get_ref() == "jerk_limit").unwrap();
        (row.missing.as_ref().map(|word| word.get_ref().clone()), row.idn.get_ref().clone(), rows.count())
    };
    let (_, idn, rows) = jerk(shipped());
    assert_eq!(jerk(&mapping), (Some("reject".to_owned()), idn, rows), "only one key has changed");
    let kvp = mapping.dictionaries.cip.attribute("Kvp").unwrap().id;
    assert!(mapping.cip.rejected.iter().any(|(id, _)| *id == kvp));
    assert!(!mapping.cip.attributes.iter().any(|row| row.attribute.id == kvp));
    // A row that an overlay has changed is found in the overlay.
    assert_eq!(mapping.parameter_row(Parameter::JERK_LIMIT).unwrap().file, "own.toml");
    // Examples come out as before.
    let mut findings = Findings::default();
    assert_eq!(mapping.run_examples(&mut findings), shipped().run_examples(&mut Findings::default()));
    assert!(findings.is_empty(), "{findings}");
}

#[test]
fn an_attribute_that_is_served_is_rejected_no_more() {
    let name = "Acceleration Reference";
    let id = shipped().dictionaries.cip.attribute(name).unwrap().id;
    assert!(shipped().cip.rejected.iter().any(|(known, _)| *known == id));
    let row = format!(
        "[[cip-generic.attribute]]\nattribute = \"{name}\"\nserved_by = \"device\"\nsource = \"test\"\n"
    );
    let mapping = good(&row);
    assert!(!mapping.cip.rejected.iter().any(|(known, _)| *known == id));
    assert!(mapping.cip.attributes.iter().any(|row| row.attribute.id == id));
    assert_eq!(
        mapping.cip.attributes.len() + mapping.cip.rejected.len(),
        shipped().cip.attributes.len() + shipped().cip.rejected.len()
    );
}

#[test]
fn rows_go_and_keys_of_rows_go() {
    let rows = |mapping: &Mapping| mapping.sercos.faults().len();
    let head = "[[generic-sercos.fault]]\nword = \"Class 2 diagnostic\"\npattern = [{ field = \"Cooling error warning\", is = 1 }]\n";
    let gone = good(&format!("{head}remove = true\n"));
    assert_eq!(rows(&gone), rows(shipped()) - 1);
    let changed = good(&format!("{head}cause = \"cooling\"\nremove = [\"reaction\"]\n"));
    assert_eq!(rows(&changed), rows(shipped()));
    let row = changed
        .sercos
        .faults()
        .iter()
        .find(|row| row.word == Idn::standard(12).into() && row.pattern.mask == 8)
        .unwrap();
    assert!(row.reaction.stops(), "the usual reaction of the cause");
}

#[test]
fn the_last_overlay_counts_and_single_tables_change_by_key() {
    let one = "format = 1\noverlay = \"a\"\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\ndirection = \"from_drive\"\n";
    let two = "format = 1\noverlay = \"b\"\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\ndirection = \"both\"\n\
               [generic-sercos.configurable_data]\nproducer = \"S-0-0188\"\n";
    let (mapping, findings) = over(&[one, two]);
    assert!(findings.is_empty(), "{findings}");
    let mapping = mapping.unwrap();
    assert_eq!(mapping.sercos.configurable, [Idn::standard(188); 2]);
    let jerk = mapping.sercos.parameters.iter().find(|row| row.parameter == Parameter::JERK_LIMIT).unwrap();
    assert!(jerk.to_drive && jerk.from_drive, "as shipped again");
}

/// Every list of the shipped files is known, and its keys tell its rows apart.
#[test]
fn every_list_of_the_tables_has_an_identity() {
    for (path, text) in FILES {
        let name = table_name(path);
        let mut tree = DeTable::parse(text).unwrap();
        groups::spread(tree.get_mut());
        for (key, value) in tree.get_ref() {
            let DeValue::Array(rows) = value.get_ref() else { continue };
            let section = sections(name).iter().find(|section| section.name == *key.get_ref());
            let section = section.unwrap_or_else(|| panic!("{name}.{}", key.get_ref()));
            let mut seen = BTreeSet::new();
            for row in rows {
                let row = row.get_ref().as_table().unwrap();
                assert!(row.contains_key(section.key[0]), "{name}.{}: {row:?}", section.name);
                let id: Vec<String> = section
                    .key
                    .iter()
                    .map(|key| format!("{:?}", row.get(*key).map(|value| value.get_ref())))
                    .collect();
                let place = row.get(section.key[0]).map(toml::Spanned::span);
                // Spans are part of what is printed of lists.
                let id = id.join("|").replace(char::is_whitespace, "");
                assert!(seen.insert(id.clone()), "{name}.{} {place:?}: {id}", section.name);
            }
        }
        for section in sections(name) {
            assert!(tree.get_ref().contains_key(section.name), "{name} has no {}", section.name);
        }
    }
}

/// Overlays written before actions had names say the fields of the control word, and only those count.
#[test]
fn fields_of_an_action_take_the_place_of_its_name() {
    let long = "format = 1\noverlay = \"test\"\n\n[[generic-cia402.action]]\naction = \"torque_off\"\npattern = [{ field = \"Quick stop\", is = 0 }]\n\n[[generic-sercos.action]]\naction = \"enable\"\npattern = [{ field = \"Drive on\", is = 1 }]\n";
    let (mapping, findings) = over(&[long]);
    let mapping = mapping.unwrap_or_else(|| panic!("{findings}"));
    let file = mapping.object_action_row(Action::TorqueOff, 0).map(|origin| origin.file);
    assert_eq!(file.as_deref(), Some("own.toml"));
    let enable = mapping.sercos.actions.iter().find(|(action, _)| *action == Action::Enable);
    assert_eq!(enable.map(|(_, pattern)| (pattern.mask, pattern.value)), Some((0x8000, 0x8000)));
    // Rows that are removed in the long form are found.
    let remove = "format = 1\noverlay = \"test\"\n\n[[generic-sercos.report]]\npattern = [{ field = \"Drive shut-down error\", is = 1 }]\nremove = true\n";
    let (_, findings) = over(&[remove]);
    let nothing = findings.list().iter().filter(|found| found.code == code::OVERLAY_REMOVES_NOTHING);
    assert_eq!(nothing.count(), 0, "{findings}");
}

#[test]
fn a_finding_in_a_row_of_an_overlay_points_into_the_overlay() {
    let text = "format = 1\noverlay = \"test\"\n\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nidn = \"S-0-4047\"\n";
    let (mapping, findings) = over(&[text]);
    assert!(mapping.is_none());
    let [finding] = findings.list() else { panic!("{findings}") };
    assert_eq!(
        (finding.code, finding.file.as_str(), finding.line, finding.column),
        (code::UNKNOWN_NAME, "own.toml", 6, 7)
    );
}

/// Two folders can have overlays of the same name: a row is found in its own.
#[test]
fn a_row_is_found_in_its_own_file_whatever_the_others_are_called() {
    let mut texts = TableTexts::embedded();
    let row = |parameter: &str, reason: &str| {
        format!(
            "format = 1\noverlay = \"test\"\n\n[[generic-sercos.parameter]]\nparameter = \"{parameter}\"\nmissing = \"reject\"{reason}\n"
        )
    };
    texts.overlays = vec![
        Overlay::new("machine/own.toml", &row("jerk_limit", "")),
        Overlay::new("drives/own.toml", &row("torque_limit_positive", " # accept: of another row")),
    ];
    let mapping = Mapping::from_texts(&texts).unwrap_or_else(|findings| panic!("{findings}"));
    let origin = mapping.parameter_row(Parameter::JERK_LIMIT).unwrap();
    assert_eq!((origin.file.as_str(), origin.line), ("own.toml", 5));
    let (source, span) = mapping.place_of(&origin).unwrap();
    assert_eq!(source.place(span.start), ("machine/own.toml", 5, 1));
    assert_eq!(source.accepts(&span), None);
    let origin = mapping.parameter_row(Parameter::TORQUE_LIMIT_POSITIVE).unwrap();
    let (source, span) = mapping.place_of(&origin).unwrap();
    assert_eq!(source.accepts(&span), Some("of another row"));
}

#[test]
fn a_folder_without_overlays_is_an_error() {
    let folder = std::env::temp_dir().join(format!("axisbridge-overlays-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("line-4")).unwrap();
    let load = || TableTexts::load(None, std::slice::from_ref(&folder)).map(|texts| texts.overlays.len());
    std::fs::write(folder.join("line-4/own.toml"), EXAMPLE).unwrap();
    std::fs::write(folder.join("own.toml.bak"), EXAMPLE).unwrap();
    let findings = load().unwrap_err();
    let [finding] = findings.list() else { panic!("{findings}") };
    assert_eq!((finding.code, finding.file.as_str()), (code::UNREADABLE, folder.to_str().unwrap()));
    assert_eq!(finding.expected, "expected overlays in the folder, files whose names end in .toml");
    std::fs::write(folder.join("own.toml"), EXAMPLE).unwrap();
    assert_eq!(load().unwrap(), 1);
    std::fs::remove_dir_all(folder).unwrap();
}
