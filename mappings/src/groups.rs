//! Rows in groups: what rows of a list have in common stands once.
//!
//! ```toml
//! [[mode]]
//! source = "Table 5-2.10"
//! rows = [
//!   { control_mode = "No Control", mode = "none" },
//!   { control_mode = "Position Control", mode = "position" },
//! ]
//! ```
//!
//! is the same as a `[[mode]]` for each of the rows with the source in each of them. What a row says itself counts. Every key keeps
//! its place in the text, so that a finding points at where it stands.

use toml::de::{DeArray, DeTable, DeValue};

/// The key of the rows of a group.
pub(crate) const ROWS: &str = "rows";

/// Replaces the groups in the lists of a table by their rows.
pub(crate) fn spread(table: &mut DeTable<'_>) {
    for (_, value) in table.iter_mut() {
        if let DeValue::Array(list) = value.get_mut()
            && list.iter().any(|row| is_group(row.get_ref()))
        {
            *list = rows(std::mem::replace(list, DeArray::new()));
        }
    }
}

/// Whether a row of a list stands for several.
pub(crate) fn is_group(row: &DeValue<'_>) -> bool {
    let DeValue::Table(row) = row else { return false };
    row.get(ROWS).is_some_and(|rows| match rows.get_ref() {
        DeValue::Array(rows) => rows.iter().all(|row| matches!(row.get_ref(), DeValue::Table(_))),
        _ => false,
    })
}

fn rows<'t>(list: DeArray<'t>) -> DeArray<'t> {
    let mut all = Vec::new();
    for mut item in list {
        if !is_group(item.get_ref()) {
            all.push(item);
            continue;
        }
        let DeValue::Table(common) = item.get_mut() else { continue };
        let Some(DeValue::Array(rows)) = common.remove(ROWS).map(toml::Spanned::into_inner) else { continue };
        for mut row in rows {
            if let DeValue::Table(row) = row.get_mut() {
                for (key, value) in common.iter() {
                    if !row.contains_key(key.get_ref().as_ref()) {
                        row.insert(key.clone(), value.clone());
                    }
                }
            }
            all.push(row);
        }
    }
    all.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_what_their_group_has_unless_they_say_it_themselves() {
        let grouped = "unit = [{ source = \"A\", rows = [{ unit = \"s\" }, { unit = \"m\", source = \"B\" }] }, { unit = \"V\" }]";
        let mut tree = DeTable::parse(grouped).unwrap().into_inner();
        spread(&mut tree);
        let single = "[[unit]]\nunit = \"s\"\nsource = \"A\"\n[[unit]]\nunit = \"m\"\nsource = \"B\"\n[[unit]]\nunit = \"V\"\n";
        assert_eq!(values(&tree), values(DeTable::parse(single).unwrap().get_ref()));
        let DeValue::Array(rows) = tree["unit"].get_ref() else { panic!("no list") };
        let DeValue::Table(first) = rows[0].get_ref() else { panic!("no row") };
        assert_eq!(&grouped[first["source"].span()], "\"A\"");
    }

    #[test]
    fn rows_that_are_none_stay_to_be_found() {
        for text in ["unit = [{ rows = 1 }]", "unit = [{ rows = [1] }]"] {
            let mut tree = DeTable::parse(text).unwrap().into_inner();
            spread(&mut tree);
            assert_eq!(values(&tree), values(DeTable::parse(text).unwrap().get_ref()), "{text}");
        }
    }

    /// Keys and values without their places.
    fn values(tree: &DeTable<'_>) -> toml::Table {
        use serde::Deserialize as _;
        let tree = toml::Spanned::new(0..0, tree.clone());
        toml::Table::deserialize(toml::de::Deserializer::from(tree)).unwrap()
    }
}
