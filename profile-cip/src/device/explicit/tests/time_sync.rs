//! The Time Sync object over explicit messages, and the path that the electronic data sheet gives.

use super::rig::*;
use crate::device::connection::motion::application_path;
use crate::device::motion::device::SyncState;
use crate::device::objects::list::OBJECT_CLASSES;
use crate::device::objects::time_sync::{ClockInfo, TimeSyncState};
use crate::wire::status::Service;

const TIME_SYNC: &[u8] = &[0x20, 0x43, 0x24, 1];

#[test]
fn the_time_sync_object_answers_as_the_device_was_told() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    assert_eq!(rig.get(client, TIME_SYNC, 2).data, [0], "nobody has told anything yet");
    assert_eq!(rig.get(client, TIME_SYNC, 4).outcome(), (0x14, 0));
    let sync = SyncState { grandmaster: Some([7; 8]), synchronized: true, offset: 0 };
    rig.adapter.set_time_sync(TimeSyncState {
        sync,
        system_less_monotonic: Some(0),
        local: Some(ClockInfo::host([7; 8], None)),
        ..TimeSyncState::default()
    });
    assert_eq!(rig.get(client, TIME_SYNC, 2).data, [1]);
    assert_eq!(rig.get(client, TIME_SYNC, 4).data, rig.now.0.to_le_bytes());
    assert_eq!(rig.get(client, TIME_SYNC, 8).data[..8], [7; 8]);
    // What a controller reads when it looks at the clock; the offset is refused, the others are there.
    let ids = [4, 0, 2, 0, 5, 0, 11, 0, 27, 0];
    let answer = rig.ask(client, &message(Service::GET_ATTRIBUTE_LIST, TIME_SYNC, &ids));
    assert_eq!(answer.status, 0x0A);
    let rows = [4, 0, 2, 0, 0, 0, 1, 5, 0, 0x14, 0, 11, 0, 0, 0, 1, 0, 27, 0, 0, 0, 0, 0];
    assert_eq!(answer.data, rows);
    // PTP is off: to switch it off changes nothing, to switch it on cannot be done.
    let set = |value| message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 0x43, 0x24, 1, 0x30, 1], &[value]);
    assert_eq!(rig.ask(client, &set(0)).outcome(), (0, 0));
    assert_eq!(rig.ask(client, &set(1)).outcome(), (0x09, 0));
    assert_eq!(rig.get(client, TIME_SYNC, 1).data, [0]);
    let all = message(Service::GET_ATTRIBUTES_ALL, TIME_SYNC, &[]);
    let all = rig.ask(client, &all);
    assert_eq!((all.outcome(), &all.data[..2]), ((0, 0), &[0, 1][..]), "PTP off, synchronized");
    assert_eq!(
        all.data[2 + 16 + 24..][..8],
        [7; 8],
        "the grandmaster behind offsets and delay that nobody measures"
    );
    assert_eq!(rig.get(client, &[0x20, 0x43], 1).data, [3, 0]);
}

#[test]
fn every_class_of_the_list_answers_with_the_revision_it_lists() {
    let mut rig = Rig::with(|config| config.eds = b"sheet".as_slice().into());
    let client = rig.client(1);
    for class in OBJECT_CLASSES {
        let Some(instance) = class.instance else { continue };
        let path = [0x20, u8::try_from(class.class).expect("one byte")];
        assert_eq!(rig.get(client, &path, 1).data, class.revision.to_le_bytes(), "{}", class.name);
        assert_eq!(rig.get(client, &path, 2).data, instance.to_le_bytes(), "{}", class.name);
    }
}

#[test]
fn the_path_of_the_sheet_opens_the_motion_connection() {
    for class_id in [0, 0x0A0B_0C0D] {
        let mut rig = Rig::with(|config| config.motion.power_structure_class_id = class_id);
        let client = rig.client(1);
        let path = application_path(&rig.adapter.config().motion);
        assert_eq!(path[..8], [0x20, 0x42, 0x2C, 0x51, 0x2C, 0x02, 0x80, 0x04]);
        assert_eq!(path[8..12], [1, u8::from(class_id != 0), 0, 0]);
        assert_eq!(path[12..], class_id.to_le_bytes());
        let open = crate::wire::forward_open::ForwardOpen { path: &path, ..motion_open(1) };
        rig.send_unconnected(client, &open_message(&open));
        rig.device_opens();
        assert_eq!(rig.unconnected_reply(client).0.status, 0, "class ID {class_id:#x}");
    }
}
