//! Tests of the CIP Motion connection: the standard's examples, round trips, broken updates, the printed tree.

mod broken;
mod fixed;
mod properties;
mod tree;
mod vectors;

use super::codes::{NodeControl, TimeDataSet};
use super::{CommandHeader, CommandInstance, CommandWriter};

/// Header of a C-to-D update with data valid and remote control, clause 7-1.2.
pub(super) fn header(update_id: u8, last_received_id: u8) -> CommandHeader {
    CommandHeader {
        update_id,
        node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
        instance_count: 0,
        last_received_id,
        time_stamp: None,
        time_offset: None,
        diagnostics: TimeDataSet::empty(),
    }
}

/// Emits a C-to-D update into a buffer pre-filled with 0xA5, so that an unwritten octet shows.
pub(super) fn emit(header: &CommandHeader, instances: &[CommandInstance<'_>]) -> Vec<u8> {
    let mut buffer = vec![0xA5; 4096];
    let mut writer = CommandWriter::new(&mut buffer, header).expect("room for the header");
    for instance in instances {
        writer.instance(instance).expect("room for the instance");
    }
    let len = writer.finish();
    assert_eq!(buffer[len], 0xA5, "nothing is written behind the update");
    buffer.truncate(len);
    buffer
}
