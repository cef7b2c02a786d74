//! What was set over the network and has to outlive the box: code points of the QoS object, and the inactivity time-out of
//! sessions. Kept in one TOML file, or for as long as the process runs where there is none.
//!
//! ```toml
//! [device.press.qos]
//! ptp_event = 59
//! ptp_general = 47
//! urgent = 55
//! scheduled = 47
//! high = 43
//! low = 31
//! explicit = 27
//!
//! [device.press]
//! inactivity_timeout_s = 120
//! ```

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use profile_cip::device::config::{AdapterConfig, QosConfig};
use profile_cip::device::event::{Event, ResetKind};
use profile_cip::device::qos::DSCP_MAX;
use profile_cip::device::tcp_ip::INACTIVITY_TIMEOUT_MAX_S;
use serde::{Deserialize, Serialize};

use crate::replace_file::replace_file;

/// Bytes of a settings file; a real one has a few hundred for each device.
const FILE_LEN_MAX: u64 = 1 << 16;

/// Why the settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file is there and cannot be read.
    #[error("cannot read the settings {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
    /// The file is none of ours, or was changed by hand and wrongly.
    #[error("the settings {path} are not usable: {what}; without the file the defaults count")]
    Content {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    #[serde(default)]
    device: BTreeMap<String, DeviceSettings>,
}

/// What was set at one device; what was not is left at its default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DeviceSettings {
    #[serde(skip_serializing_if = "Option::is_none")]
    inactivity_timeout_s: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    qos: Option<CodePoints>,
}

/// The code points of [`QosConfig`] as they stand in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CodePoints {
    ptp_event: u8,
    ptp_general: u8,
    urgent: u8,
    scheduled: u8,
    high: u8,
    low: u8,
    explicit: u8,
}

impl From<QosConfig> for CodePoints {
    fn from(qos: QosConfig) -> Self {
        let QosConfig { ptp_event, ptp_general, urgent, scheduled, high, low, explicit } = qos;
        Self { ptp_event, ptp_general, urgent, scheduled, high, low, explicit }
    }
}

impl From<CodePoints> for QosConfig {
    fn from(points: CodePoints) -> Self {
        let CodePoints { ptp_event, ptp_general, urgent, scheduled, high, low, explicit } = points;
        Self { ptp_event, ptp_general, urgent, scheduled, high, low, explicit }
    }
}

impl DeviceSettings {
    fn check(&self, device: &str) -> Result<(), String> {
        if let Some(seconds) = self.inactivity_timeout_s.filter(|seconds| *seconds > INACTIVITY_TIMEOUT_MAX_S)
        {
            return Err(format!(
                "device {device}: inactivity_timeout_s: expected 0..={INACTIVITY_TIMEOUT_MAX_S}, found {seconds}"
            ));
        }
        let Some(points) = self.qos else { return Ok(()) };
        let CodePoints { ptp_event, ptp_general, urgent, scheduled, high, low, explicit } = points;
        match [ptp_event, ptp_general, urgent, scheduled, high, low, explicit]
            .iter()
            .find(|one| **one > DSCP_MAX)
        {
            Some(found) => Err(format!("device {device}: qos: expected 0..={DSCP_MAX}, found {found}")),
            None => Ok(()),
        }
    }
}

/// The settings of all devices of the box.
#[derive(Debug)]
pub struct Store {
    path: Option<PathBuf>,
    settings: Mutex<Settings>,
    unsaved: AtomicBool,
}

impl Store {
    /// Reads the settings of an earlier run. A file that is not there yet is none of them.
    ///
    /// # Errors
    /// [`SettingsError`]: a file that is there and cannot be used is not overwritten.
    pub fn open(path: Option<&Path>) -> Result<Self, SettingsError> {
        let settings = match path {
            Some(path) => read(path)?,
            None => Settings::default(),
        };
        Ok(Self {
            path: path.map(Path::to_owned),
            settings: Mutex::new(settings),
            unsaved: AtomicBool::new(false),
        })
    }

    /// The settings for another run of the gateway in this process. Without a file, and while the last one could not be written to it,
    /// they are these: what was set lasts as long as the process. Else the file counts, which somebody may have changed.
    ///
    /// # Errors
    /// As of [`Store::open`].
    pub fn reopen(self: &Arc<Self>, path: Option<&Path>) -> Result<Arc<Self>, SettingsError> {
        let is_kept = self.path.as_deref() == path && (path.is_none() || self.is_unsaved());
        if is_kept { Ok(Arc::clone(self)) } else { Self::open(path).map(Arc::new) }
    }

    /// Puts what was set at a device into its configuration.
    pub fn apply(&self, device: &str, config: &mut AdapterConfig) {
        let settings = self.lock();
        let Some(of_device) = settings.device.get(device) else { return };
        if let Some(points) = of_device.qos {
            config.qos = points.into();
        }
        if let Some(seconds) = of_device.inactivity_timeout_s {
            config.interface.inactivity_timeout_s = seconds;
        }
    }

    /// Keeps what an event of a device says was set, or forgets all of it with a reset to the values of the factory.
    ///
    /// # Errors
    /// The file cannot be written. The setting counts until the process ends.
    pub fn note(&self, device: &str, event: &Event) -> io::Result<()> {
        let mut settings = self.lock();
        match event {
            Event::QosChanged(qos) => entry(&mut settings, device).qos = Some((*qos).into()),
            Event::InactivityTimeoutChanged { seconds } => {
                entry(&mut settings, device).inactivity_timeout_s = Some(*seconds);
            }
            Event::Reset { kind: ResetKind::FactoryDefaults, .. } => {
                settings.device.remove(device);
            }
            _ => return Ok(()),
        }
        let Some(path) = &self.path else { return Ok(()) };
        let written = write(path, &settings);
        self.unsaved.store(written.is_err(), Ordering::Relaxed);
        written
    }

    /// Whether the last setting could not be written, which the Identity object tells as a minor fault.
    #[must_use]
    pub fn is_unsaved(&self) -> bool {
        self.unsaved.load(Ordering::Relaxed)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Settings> {
        self.settings.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

fn entry<'a>(settings: &'a mut Settings, device: &str) -> &'a mut DeviceSettings {
    settings.device.entry(device.to_owned()).or_default()
}

fn read(path: &Path) -> Result<Settings, SettingsError> {
    let name = || path.display().to_string();
    let unreadable = |source| SettingsError::Read { path: name(), source };
    let unusable = |what: String| SettingsError::Content { path: name(), what };
    let length = match std::fs::metadata(path) {
        Ok(metadata) => metadata.len(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Settings::default()),
        Err(error) => return Err(unreadable(error)),
    };
    if length > FILE_LEN_MAX {
        return Err(unusable(format!("it has {length} bytes, expected at most {FILE_LEN_MAX}")));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    let settings: Settings = toml::from_str(&text).map_err(|error| unusable(error.to_string()))?;
    settings.device.iter().try_for_each(|(name, one)| one.check(name)).map_err(unusable)?;
    Ok(settings)
}

fn write(path: &Path, settings: &Settings) -> io::Result<()> {
    replace_file(path, &toml::to_string(settings).map_err(io::Error::other)?)
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, SocketAddrV4};

    use super::*;
    use crate::north::test_adapter_config;

    const QOS: QosConfig =
        QosConfig { ptp_event: 1, ptp_general: 2, urgent: 3, scheduled: 4, high: 5, low: 6, explicit: 7 };

    fn path(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("axisbridge-settings-{}-{name}.toml", std::process::id()))
    }

    fn applied(store: &Store, device: &str) -> (QosConfig, u16) {
        let mut config = test_adapter_config(Ipv4Addr::LOCALHOST);
        store.apply(device, &mut config);
        (config.qos, config.interface.inactivity_timeout_s)
    }

    fn factory_reset() -> Event {
        let originator = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 1);
        Event::Reset { kind: ResetKind::FactoryDefaults, originator }
    }

    #[test]
    fn what_was_set_outlives_the_process_until_the_factory_reset() {
        let path = path("outlives");
        let store = Store::open(Some(&path)).unwrap();
        assert_eq!(applied(&store, "press"), (QosConfig::default(), 120));
        store.note("press", &Event::QosChanged(QOS)).unwrap();
        store.note("press", &Event::InactivityTimeoutChanged { seconds: 7 }).unwrap();
        store.note("saw", &Event::InactivityTimeoutChanged { seconds: 8 }).unwrap();
        let originator = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 1);
        store.note("press", &Event::Reset { kind: ResetKind::PowerCycle, originator }).unwrap();

        let later = Store::open(Some(&path)).unwrap();
        assert_eq!(applied(&later, "press"), (QOS, 7));
        assert_eq!(applied(&later, "saw"), (QosConfig::default(), 8));
        later.note("press", &factory_reset()).unwrap();
        let last = Store::open(Some(&path)).unwrap();
        assert_eq!(applied(&last, "press"), (QosConfig::default(), 120));
        assert_eq!(applied(&last, "saw").1, 8, "of the other device nothing is forgotten");
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn without_a_file_they_last_as_long_as_the_store() {
        let store = Store::open(None).unwrap();
        store.note("press", &Event::QosChanged(QOS)).unwrap();
        assert_eq!(applied(&store, "press").0, QOS);
        assert!(!store.is_unsaved());
    }

    #[test]
    fn another_run_has_what_was_set_or_what_the_file_says() {
        let first = Store::open(None).map(Arc::new).unwrap();
        first.note("press", &Event::InactivityTimeoutChanged { seconds: 7 }).unwrap();
        let second = first.reopen(None).unwrap();
        assert_eq!(applied(&second, "press").1, 7);
        let path = path("reopened");
        let third = second.reopen(Some(&path)).unwrap();
        assert_eq!(applied(&third, "press").1, 120);
        third.note("press", &Event::InactivityTimeoutChanged { seconds: 8 }).unwrap();
        assert_eq!(applied(&third.reopen(Some(&path)).unwrap(), "press").1, 8);
        assert_eq!(applied(&third.reopen(None).unwrap(), "press").1, 120);
        // Somebody has removed the file.
        std::fs::remove_file(&path).unwrap();
        assert_eq!(applied(&third.reopen(Some(&path)).unwrap(), "press").1, 120);
        // It could not be written: what was set is here alone.
        third.unsaved.store(true, Ordering::Relaxed);
        assert_eq!(applied(&third.reopen(Some(&path)).unwrap(), "press").1, 8);
    }

    #[test]
    fn a_file_that_cannot_be_used_is_named_and_left_alone() {
        for (text, what) in [
            ("[device.a]\ninactivity_timeout_s = 3601\n", "expected 0..=3600, found 3601"),
            (
                "[device.a.qos]\nptp_event = 64\nptp_general = 0\nurgent = 0\nscheduled = 0\nhigh = 0\nlow = 0\nexplicit = 0\n",
                "expected 0..=63, found 64",
            ),
            ("[device.a]\nspeed = 1\n", "unknown field `speed`"),
            ("no toml", "TOML parse error"),
        ] {
            let path = path("faulty");
            std::fs::write(&path, text).unwrap();
            let error = Store::open(Some(&path)).unwrap_err().to_string();
            assert!(error.contains(what) && error.contains(&path.display().to_string()), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
            std::fs::remove_file(&path).unwrap();
        }
        let folder = std::env::temp_dir();
        assert!(matches!(Store::open(Some(&folder)), Err(SettingsError::Read { .. })), "a folder is no file");
    }

    #[test]
    fn a_file_that_cannot_be_written_is_told_and_the_setting_counts() {
        let path = std::env::temp_dir()
            .join(format!("axisbridge-no-such-{}", std::process::id()))
            .join("settings.toml");
        let store = Store::open(Some(&path)).unwrap();
        assert!(store.note("press", &Event::QosChanged(QOS)).is_err());
        assert!(store.is_unsaved());
        assert_eq!(applied(&store, "press").0, QOS);
    }
}
