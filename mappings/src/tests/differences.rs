//! What two sets of tables say differently, and whether that is dangerous.

use std::collections::BTreeSet;

use toml::de::{DeTable, DeValue};

use super::*;
use crate::check::diff::{self, Changes};
use crate::load::table_name;
use crate::overlay::canonical;

/// What overlays change against the shipped tables.
fn changes(overlays: &[&str]) -> Changes {
    let mut texts = TableTexts::embedded();
    for (at, rows) in overlays.iter().enumerate() {
        let text = format!("format = 1\noverlay = \"own\"\n\n{rows}");
        texts.overlays.push(Overlay::new(&format!("own-{at}.toml"), &text));
    }
    let new = Mapping::from_texts(&texts).unwrap_or_else(|findings| panic!("{findings}"));
    diff::changes(shipped(), &new)
}

/// The dangerous changes, each as aspect, row and values.
fn dangerous(rows: &str) -> Vec<String> {
    let changes = changes(&[rows]);
    let word = |side: &Option<String>| side.clone().unwrap_or_else(|| "-".to_owned());
    let dangerous = changes.list.iter().filter(|change| change.dangerous);
    dangerous
        .map(|one| {
            format!("{} {}: {} -> {}", one.aspect.name(), one.row, word(&one.before), word(&one.after))
        })
        .collect()
}

/// Two rows that begin with the same word, each with a reason of its own or none.
#[test]
fn a_reason_acknowledges_the_row_at_which_it_stands_and_no_other() {
    let fault = |bit: &str, reason: &str| {
        format!(
            "[[generic-sercos.fault]]\nword = \"Class 1 diagnostic\"\npattern = [{{ field = \"{bit}\", is = 1 }}]\nremove = true{reason}\n\n"
        )
    };
    let both = fault("Overcurrent error", " # accept: a") + &fault("Feedback error", "");
    let changes_of = |overlays: &[&str]| -> Vec<(String, Option<String>)> {
        changes(overlays).list.into_iter().map(|change| (change.row, change.accepted)).collect()
    };
    let overcurrent = "[[fault]] Class 1 diagnostic, Overcurrent error = 1".to_owned();
    let feedback = "[[fault]] Class 1 diagnostic, Feedback error = 1".to_owned();
    let mut found = changes_of(&[&both]);
    found.sort();
    assert_eq!(found, [(feedback.clone(), None), (overcurrent.clone(), Some("a".to_owned()))]);
    // In overlays of their own.
    let (one, other) = (fault("Overcurrent error", " # accept: a"), fault("Feedback error", ""));
    let mut found = changes_of(&[&other, &one]);
    found.sort();
    assert_eq!(found, [(feedback, None), (overcurrent, Some("a".to_owned()))]);
    let status = |state: &str, status: &str, reason: &str| {
        format!(
            "[[generic-cia402.status]]\nobject = \"6041:00\"\nstate = \"{state}\"\nstatus = \"{status}\"\nremove = true{reason}\n\n"
        )
    };
    let both = status("Switched on", "ready", " # accept: b") + &status("Operation enabled", "enabled", "");
    let accepted: Vec<_> = changes_of(&[&both]).into_iter().map(|(_, accepted)| accepted).collect();
    assert_eq!(accepted.iter().flatten().collect::<Vec<_>>(), ["b"]);
    assert_eq!(accepted.len(), 2);
    // A key that is taken away is acknowledged in the row that takes it.
    let key = "[[generic-cia402.parameter]]\nparameter = \"torque_limit_positive\"\nremove = [\"common\"]";
    assert_eq!(changes(&[key]).open(), 1);
    assert_eq!(changes(&[&format!("{key} # accept: it has both\n")]).open(), 0);
}

#[test]
fn a_new_row_that_wins_over_those_that_are_there_is_dangerous() {
    let method = "[[generic-cia402.scaling]]\nunit = \"velocity\"\nmethods = [{ name = \"ours\", base = [1_000_000_000, 1] }]\n";
    assert_eq!(
        dangerous(method),
        ["scale [[scaling]] velocity, ours: - -> 1000000000/1, times , over , like none"]
    );
    let method = "[[generic-sercos.scaling]]\nscaling = \"velocity\"\nmethods = [{ pattern = [0x00, 0x00], name = \"ours\", kind = \"rotary\", quantity = \"velocity\", base = [1, 1] }]\n";
    assert_eq!(
        dangerous(method),
        ["scale [[scaling]] velocity, ours: - -> 1/1, by none none none, type 0x00/0x00, rotary velocity"]
    );
    let mode = "[[generic-cia402.mode]]\nmode = \"position\"\nmissing = \"refuse\"\nmodes = [\"csv\"]\ncommand = [\"position_command\"]\nactual = [\"position_actual\"]\nsource = \"own\"\n";
    assert_eq!(
        dangerous(mode),
        ["mode [[mode]] position, by the controller, csv: - -> ; position_command; position_actual"]
    );
    let signal = "[[generic-cia402.signal]]\nsignal = \"position_command\"\nobject = \"60C1:01\"\nmodes = [\"csp\"]\ndirection = \"to_drive\"\nmissing = \"refuse\"\nsource = \"own\"\n";
    assert_eq!(
        dangerous(signal),
        [
            "sign [[signal]] position_command in csp: - -> never inverted",
            "binding [[signal]] position_command in csp: - -> 60C1:01",
            "binding [[signal]] position_command in csp, direction: - -> to_drive",
        ]
    );
    // A parameter that had no row took nothing from another one.
    let parameter = "[[generic-cia402.parameter]]\nparameter = \"velocity_limit_bipolar\"\nobject = \"607F:00\"\ndirection = \"from_drive\"\nsource = \"own\"\n";
    assert_eq!(dangerous(parameter), [""; 0]);
}

#[test]
fn a_step_of_commissioning_that_goes_is_a_dangerous_change() {
    let step = "[[generic-sercos.commission]]\ndo = \"write\"\nphase = 3\nparameter = \"torque_limit_positive\"\nremove = true\n";
    assert_eq!(
        dangerous(step),
        ["step [[commission]] write torque_limit_positive in phase 3: refused fail -> -"]
    );
}

/// An overlay that takes a row, or one key of it, away.
struct Removal {
    /// Table, list and key, `-` for the whole row.
    what: (String, String, String),
    rows: String,
}

/// Every row and every key of the tables that an overlay can take away.
fn removals() -> Vec<Removal> {
    let texts = TableTexts::embedded();
    let mut all = Vec::new();
    for table in [&texts.cip_generic, &texts.generic_sercos, &texts.generic_cia402] {
        let name = table_name(&table.path);
        let mut tree = DeTable::parse(&table.text).unwrap();
        groups::spread(tree.get_mut());
        for section in sections(name) {
            let DeValue::Array(rows) = tree.get_ref()[section.name].get_ref() else { continue };
            for row in rows {
                let row = row.get_ref().as_table().unwrap();
                let mut head = format!("[[{name}.{}]]\n", section.name);
                for key in section.key.iter().filter(|key| row.contains_key(**key)) {
                    writeln!(head, "{key} = {}", written(row[*key].get_ref())).unwrap();
                }
                let mut add = |key: &str, remove: &str| {
                    let what = (name.to_owned(), section.name.to_owned(), key.to_owned());
                    all.push(Removal { what, rows: format!("{head}remove = {remove}\n") });
                };
                add("-", "true");
                // Where a row comes from, and its worked examples, mean nothing to an axis.
                let keys = row.keys().map(|key| key.get_ref().as_ref());
                let keys = keys.filter(|key| !["source", "examples"].contains(key));
                keys.filter(|key| !section.key.contains(key))
                    .for_each(|key| add(key, &format!("[\"{key}\"]")));
            }
        }
    }
    all
}

/// A value as it is written in TOML.
fn written(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Array(values) => {
            let values: Vec<String> = values.iter().map(|value| written(value.get_ref())).collect();
            format!("[{}]", values.join(", "))
        }
        DeValue::Table(table) => {
            let keys: Vec<String> = table
                .iter()
                .map(|(key, value)| format!("{} = {}", key.get_ref(), written(value.get_ref())))
                .collect();
            format!("{{ {} }}", keys.join(", "))
        }
        other => canonical(other),
    }
}

/// Whatever of the tables an overlay takes away, the comparison names it if an axis could be another one without it. Of each key, rows
/// are tried until one is found whose loss changes the meaning.
#[test]
fn nothing_that_changes_the_meaning_of_the_tables_is_passed_over() {
    let before = shipped().meaning();
    let (mut shown, mut unnamed) = (BTreeSet::new(), Vec::new());
    let mut tried: std::collections::BTreeMap<(String, String, String), usize> = Default::default();
    for Removal { what, rows } in removals() {
        let tries = tried.entry(what.clone()).or_default();
        if *tries >= 3 || shown.contains(&what) {
            continue;
        }
        *tries += 1;
        let mut texts = TableTexts::embedded();
        texts.overlays.push(Overlay::new("own.toml", &format!("format = 1\noverlay = \"own\"\n\n{rows}")));
        // What cannot be read without the row or key is an error, and no change.
        let Ok(new) = Mapping::from_texts(&texts) else { continue };
        if new.meaning() == before {
            continue;
        }
        let changes = diff::changes(shipped(), &new);
        if changes.list.is_empty() || changes.list.iter().any(|change| change.aspect.name() == "other") {
            unnamed.push(format!("{what:?}: {rows}"));
        }
        shown.insert(what);
    }
    assert!(unnamed.is_empty(), "{}", unnamed.join("\n"));
    assert!(shown.len() >= 60, "{}: {shown:?}", shown.len());
}

#[test]
fn changes_are_told_by_meaning_and_acknowledged_with_a_reason() {
    let mut texts = TableTexts::embedded();
    let own = include_str!("../../../gateway/tests/diff/line-4.toml");
    texts.overlays.push(Overlay::new("line-4.toml", own));
    let new = Mapping::from_texts(&texts).unwrap();
    let changes = diff::changes(shipped(), &new);
    insta::assert_snapshot!(changes.to_string());
    assert_eq!(changes.open(), 5, "{changes}");
    assert!(diff::changes(shipped(), shipped()).list.is_empty());
}

/// The reason has to stand at the row that takes the other one away, whatever its name.
#[test]
fn a_row_that_is_taken_away_is_acknowledged_at_its_own_row_only() {
    let open = |rows: &str| {
        let mut texts = TableTexts::embedded();
        let text = format!("format = 1\noverlay = \"own\"\n\n{rows}");
        texts.overlays.push(Overlay::new("own.toml", &text));
        let new = Mapping::from_texts(&texts).unwrap_or_else(|findings| panic!("{findings}"));
        diff::changes(shipped(), &new).open()
    };
    let gone = "[[generic-cia402.status]]\nobject = \"6041:00\"\nstate = \"Switched on\"\nstatus = \"ready\"\nremove = true\n";
    let accepted = |rows: &str| rows.replace("remove = true", "remove = true # accept: no such bit");
    assert_eq!((open(gone), open(&accepted(gone))), (1, 0));
    // `ready` is named in another list, with a reason of its own.
    let elsewhere = "[[cip-generic.state]]\nstate = \"ready\" # accept: of another row\naxis_state = \"Stopped\"\nsource = \"own\"\n\n";
    assert_eq!(open(&format!("{elsewhere}{gone}")), 1);
}

/// The tables with an overlay in which `from` is replaced by `to` at its first place.
fn with_replaced(overlay: &str, from: &str, to: &str) -> Mapping {
    assert!(overlay.contains(from), "{from}");
    let mut texts = TableTexts::embedded();
    texts.overlays.push(Overlay::new("own.toml", &overlay.replacen(from, to, 1)));
    Mapping::from_texts(&texts).unwrap_or_else(|findings| panic!("{findings}"))
}

/// What a parameter of a vendor is and takes, and how its ends hold it; more of range or access is dangerous, less is not.
#[test]
fn changes_of_a_vendors_parameter_are_told_and_what_widens_is_dangerous() {
    const EXAMPLE: &str = include_str!("../../../examples/overlays/vendor-parameter.toml");
    let mapping = |from: &str, to: &str| with_replaced(EXAMPLE, from, to);
    let old = mapping("", "");
    let told = |from: &str, to: &str| {
        let new = mapping(from, to);
        let changes = diff::changes(&old, &new);
        let [change] = changes.list.as_slice() else { panic!("{changes}") };
        let (before, after) = (change.before.clone().unwrap(), change.after.clone().unwrap());
        let said = format!("{} {}: {before} -> {after}", change.aspect.name(), change.row);
        (said, change.dangerous, change.accepted.clone())
    };
    let row = "[[parameter]] notch_frequency";
    let range = |to: &str| told("range = [50_000, 2_000_000]", to);
    let said = |text: &str, dangerous| (text.to_owned(), dangerous, None);
    let before = format!("range {row}: 50000 to 2000000");
    assert_eq!(range("range = [49_999, 2_000_000]"), said(&format!("{before} -> 49999 to 2000000"), true));
    assert_eq!(range("range = [50_000, 2_000_001]"), said(&format!("{before} -> 50000 to 2000001"), true));
    assert_eq!(range("range = [50_001, 1_999_999]"), said(&format!("{before} -> 50001 to 1999999"), false));
    assert_eq!(range(""), said(&format!("{before} -> any value"), true));
    let (_, dangerous, accepted) = range("range = [1_000, 2_000_000] # accept: seen on the machine");
    assert_eq!((dangerous, accepted.as_deref()), (true, Some("seen on the machine")));
    let running = "running = true\nneed = \"------\"\nunit";
    let stopped = "running = false\nneed = \"------\"\nunit";
    let attribute = "[[attribute]] Notch Frequency";
    let less = format!("access {attribute}: set, in Running too -> set");
    assert_eq!(told(running, stopped), said(&less, false));
    assert_eq!(
        told("\"REAL\"\naccess", "\"LREAL\"\naccess"),
        said(&format!("type {attribute}: REAL -> LREAL"), true)
    );
    assert_eq!(
        told("decimals = 1", "decimals = 0"),
        said("type [[idn]] P-0-0702: unsigned, 2 bytes, 1 decimals -> unsigned, 2 bytes, 0 decimals", true)
    );
    assert_eq!(told("type = \"u16\"", "type = \"u32\""), said("type [[object]] 2051:00: u16 -> u32", true));
    assert_eq!(
        told("value = 3", "value = 4"),
        said("binding [[attribute]] Notch Filters: constant 3 -> constant 4", true)
    );
    // The way back: what is allowed again is more.
    let wider = |from: &str, to: &str| {
        let (old, new) = (mapping(from, to), mapping("", ""));
        diff::changes(&old, &new).list
    };
    let [more] = wider(running, stopped).try_into().unwrap();
    assert_eq!((more.aspect.name(), more.dangerous), ("access", true));
}

#[test]
fn changes_of_computed_values_are_told() {
    const EXAMPLE: &str = include_str!("../../../examples/overlays/computed.toml");
    let mapping = |from: &str, to: &str| with_replaced(EXAMPLE, from, to);
    let old = mapping("", "");
    let told = |from: &str, to: &str| {
        let new = mapping(from, to);
        let changes = diff::changes(&old, &new);
        let [change] = changes.list.as_slice() else { panic!("{changes}") };
        let (before, after) = (change.before.clone().unwrap(), change.after.clone().unwrap());
        (format!("{} {}: {before} -> {after}", change.aspect.name(), change.row), change.dangerous)
    };
    assert_eq!(
        told("factor = [100, 1]", "factor = [1_000, 1]"),
        ("scale [[computed]] dc_load: dc_current over dc_current_rated, times 100/1, rounded nearest, saturates -> \
          dc_current over dc_current_rated, times 1000/1, rounded nearest, saturates".to_owned(), true)
    );
    assert_eq!(
        told("value = 40_000_000", "value = 50_000_000"),
        ("scale [[constant]] dc_current_rated: 40000000 -> 50000000".to_owned(), true)
    );
    assert_eq!(
        told("writes = \"gain_a\"", "writes = \"gain_b\""),
        ("binding [[computed]] gain_in_force: writes gain_a -> writes gain_b".to_owned(), true)
    );
}
