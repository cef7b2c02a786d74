//! The files that can be downloaded: electronic data sheets and the configuration.

use std::sync::Arc;

/// Files that do not change while the gateway runs.
#[derive(Debug, Clone, Default)]
pub struct Files {
    /// The electronic data sheet of each device, by its name.
    pub sheets: Vec<(String, Arc<[u8]>)>,
    /// The configuration without its comments; `None` where its text is not known.
    pub configuration: Option<String>,
}

impl Files {
    /// The sheet of a device.
    #[must_use]
    pub fn sheet(&self, device: &str) -> Option<&[u8]> {
        self.sheets.iter().find(|(name, _)| name == device).map(|(_, sheet)| &**sheet)
    }
}

/// The keys and values of a configuration without its comments: people write things there that are not for all who see the page.
/// `None` for what is no TOML.
#[must_use]
pub fn without_comments(text: &str) -> Option<String> {
    let table: toml::Table = toml::from_str(text).ok()?;
    toml::to_string(&table).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    #[test]
    fn configuration_keeps_its_meaning_and_loses_its_comments() {
        let text = "# ask Ann, password swordfish\n[box]\nname = \"cell # 4\" # behind the press\n";
        assert_eq!(without_comments(text).as_deref(), Some("[box]\nname = \"cell # 4\"\n"));
        assert_eq!(without_comments("[box\n"), None);
        let example = include_str!("../../../examples/two-axes-in-process.toml");
        let plain = without_comments(example).unwrap();
        assert!(example.contains("\n# ") && !plain.lines().any(|line| line.starts_with('#')), "{plain}");
        assert_eq!(Config::parse(&plain, "").unwrap(), Config::parse(example, "").unwrap());
    }
}
