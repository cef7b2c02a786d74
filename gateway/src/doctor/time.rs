//! System time: whether its source is there.

use std::time::{Duration, Instant};

use profile_cip::device::config::QosConfig;

use super::Check;
use super::kernel::CLOCK;
use crate::config::{Config, TimeSource};
use crate::host::HostPort;
use crate::sys::ptp_socket::OpenError;
use crate::time::source::{Place, SourceError, TimeService};
use crate::time::status::Identity;

/// How long a master is listened for: two Announces of CIP Sync, and two that a follower needs.
const LISTEN: Duration = Duration::from_secs(6);

/// How often it is looked for.
const LOOK: Duration = Duration::from_millis(100);

/// What of the configured source is there; nothing without a configuration.
pub(super) fn checks(config: Option<&Config>) -> Vec<Check> {
    let Some(config) = config else { return Vec::new() };
    let name = config.time.source.name();
    let check = match config.time.source {
        TimeSource::Ptp | TimeSource::Daemon => ptp(config, name),
        TimeSource::Host => {
            Check::good(CLOCK, "source", format!("`{name}`: the host's clock, while a daemon keeps it"))
        }
        TimeSource::Shared => Check::doubtful(
            CLOCK,
            "source",
            format!("`{name}`: the host's clock is called everybody's, and nothing is measured"),
            "right for controllers on this host; for others, [time] source = \"ptp\"",
        ),
        TimeSource::None => Check::doubtful(
            CLOCK,
            "source",
            format!("`{name}`: there is no common time"),
            "controllers can work asynchronously only; [time] source = \"ptp\" follows their clock",
        ),
    };
    vec![check]
}

/// Whether a master is followed, by the gateway or by `ptp4l`.
fn ptp(config: &Config, name: &str) -> Check {
    let port = config.devices.first().and_then(|device| HostPort::find(device.listen));
    let place = Place {
        interface: port.map(|port| port.interface().to_owned()),
        mac: [0; 6],
        event_dscp: QosConfig::default().ptp_event,
    };
    let service = match TimeService::start(&config.time, &place) {
        Ok((service, _)) => service,
        Err(error) => {
            let advice = match &error {
                SourceError::NoInterface => "give [time] an `interface`",
                SourceError::Open(OpenError::InUse { .. }) => {
                    "end the other program, or choose source = \"host\""
                }
                SourceError::Open(OpenError::NoPrivilege { .. }) => {
                    "run it with the capability CAP_NET_BIND_SERVICE, or as root"
                }
                SourceError::Phc { .. } => "see `phc` of [time]; its file needs to be readable",
                SourceError::Open(_) | SourceError::Thread(_) => "see `interface` of [time]",
            };
            return Check::unfit(CLOCK, "source", format!("`{name}`: {error}"), advice);
        }
    };
    let interface = config.time.interface.clone().or(place.interface).unwrap_or_default();
    let end = Instant::now() + LISTEN;
    while Instant::now() < end {
        let status = service.view().read();
        if let Some(master) = status.master {
            let [first, second] = master.priorities;
            return Check::good(
                CLOCK,
                "source",
                format!(
                    "`{name}`: grandmaster {} (priorities {first}, {second}) on {interface}, domain {}",
                    Identity(master.grandmaster),
                    status.domain
                ),
            );
        }
        std::thread::sleep(LOOK);
    }
    Check::doubtful(
        CLOCK,
        "source",
        format!(
            "`ptp`: no master in domain {} is heard on {interface} for {} s",
            config.time.domain,
            LISTEN.as_secs()
        ),
        "a controller or another clock has to be grandmaster; look with tshark -f \"udp port 320\"",
    )
}
