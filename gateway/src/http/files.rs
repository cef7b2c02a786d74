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
