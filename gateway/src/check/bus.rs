//! Whether the telegrams of all drives fit the bus and its cycle.

use profile_sercos::master::config::{CONNECTION_IDNS_MAX, CONNECTION_LEN_MAX};
use profile_sercos::master::layout::{ConnectionNeed, CyclicLayout, LayoutError, SlaveNeed, Timing};

use crate::config::{DriveAt, Written};
use crate::engine::build::Host;
use crate::engine::build::sercos::{master_config, needs};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem};
use crate::mapping::{DriveFacts, Mapping};

/// Bytes of the connection control word.
const CONTROL_BYTES: u16 = 2;

/// Lays out the telegrams as the master would with drives that need no time of their own.
pub(super) fn check(mapping: &Mapping, written: &Written, findings: &mut Findings) {
    let config = &written.config;
    let (Some(bus), Some(file)) = (&config.sercos, &written.file.south.get_ref().sercos) else { return };
    let mut slaves = vec![SlaveNeed::default(); bus.drives.len()];
    for (axis, table) in config.axes.iter().zip(&written.file.axis) {
        let table = table.get_ref();
        let DriveAt::Sercos { drive: place } = axis.drive else { continue };
        let drive = &bus.drives[place];
        // An axis that has no telegram is told of where its program is made.
        let Ok(telegram) = mapping.telegram(&needs(axis, drive), &DriveFacts::new()) else { continue };
        let both = [
            (0, false, &telegram.command, telegram.command_bytes, "the master's"),
            (1, true, &telegram.feedback, telegram.feedback_bytes, "the drive's"),
        ];
        for (instance, slave_produces, idns, bytes, whose) in both {
            let len = (bytes + CONTROL_BYTES).next_multiple_of(2);
            if idns.len() > CONNECTION_IDNS_MAX || usize::from(len) > CONNECTION_LEN_MAX {
                let title = format!(
                    "{whose} telegram of the axis `{}` has {} values of {len} bytes",
                    axis.name,
                    idns.len()
                );
                let message =
                    format!("expected at most {CONNECTION_IDNS_MAX} values and {CONNECTION_LEN_MAX} bytes");
                let problem =
                    Problem::new(code::CYCLE_FULL, table.name.span()).title(title).expected(message);
                findings.push(&written.text, problem);
                continue;
            }
            let need = ConnectionNeed { instance, slave_produces, len };
            // Two of eight.
            let _ = slaves[place].connections.try_push(need);
        }
    }
    // The address of the master does not matter here.
    let master = master_config(bus, Host { mac: [2, 0, 0, 0, 0, 1], incarnation: 0 });
    let timing = Timing {
        cycle_ns: master.cycle_ns,
        mst_jitter_ns: master.mst_jitter_ns,
        slave_jitter_ns: master.slave_jitter_ns,
        slave_delay_ns: master.slave_delay_ns,
        // The shorter gap: what does not fit with it does not fit at all.
        gap_adjustable: false,
        hot_plug_in_all: master.hot_plug_in_all,
    };
    let sercos = file.get_ref();
    let problem = match CyclicLayout::default().compute(&timing, slaves.iter().map(Some)) {
        Ok(()) => return,
        Err(error @ LayoutError::Cycle { .. }) => {
            let title = format!("the cycle cannot hold the telegrams of {} drives", slaves.len());
            Problem::new(code::CYCLE_FULL, sercos.cycle_time.span())
                .key("cycle_time")
                .title(title)
                .expected(error.to_string())
        }
        Err(error @ (LayoutError::Telegrams { slave, .. } | LayoutError::Connection { slave, .. })) => {
            let drive = sercos
                .drive
                .get(slave)
                .map_or_else(|| sercos.cycle_time.span(), |drive| drive.get_ref().name.span());
            Problem::new(code::CYCLE_FULL, drive).expected(error.to_string())
        }
    };
    findings.push(&written.text, problem);
}
