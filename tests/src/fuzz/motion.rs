//! The CIP Motion connection in both formats, and the bodies of its services.

use profile_cip::wire::Writer;
use profile_cip::wire::motion::attribute_list::{
    GetItem, GetRequest, GetResponse, ListWriter, SetRequest, SetResponse,
};
use profile_cip::wire::motion::fixed::{self as format, FixedActual, FixedCommand};
use profile_cip::wire::motion::id_list::{IdList, IdStatusList, parse_group_sync};
use profile_cip::wire::motion::test_service::{
    HookupTestData, InertiaTestData, MotorTestData, RunHookupTest, RunInertiaTest, RunMotorTest,
};
use profile_cip::wire::motion::{ActualFrame, ActualWriter, CommandFrame, CommandWriter};

use super::assert_printed;

/// Update that is written once more; NaN is not equal to itself, so octets are compared.
macro_rules! update {
    ($frame:ident, $writer:ident, $data:expr) => {
        if let Ok(frame) = $frame::parse($data) {
            let text = frame.to_string();
            assert_printed(&text, $data.len());
            let rewrite = |frame: &$frame<'_>| {
                let mut buffer = vec![0xA5; $data.len() + 64];
                let mut writer = $writer::new(&mut buffer, frame.header()).expect("room for the header");
                for instance in frame.instances() {
                    writer.instance(&instance).expect("room for what was read");
                }
                let len = writer.finish();
                buffer.truncate(len);
                buffer
            };
            let once = rewrite(&frame);
            assert!(once.len() <= $data.len(), "what is written has no octets that nobody reads");
            let again = $frame::parse(&once).expect("what was written");
            if frame.instances().next().is_some() {
                assert_eq!(again.to_string(), text);
            }
            assert_eq!(rewrite(&again), once);
        }
    };
}

/// C-to-D updates of the variable format.
pub fn command(data: &[u8]) {
    update!(CommandFrame, CommandWriter, data);
}

/// D-to-C updates of the variable format.
pub fn actual(data: &[u8]) {
    update!(ActualFrame, ActualWriter, data);
}

/// A value with a writer of its own and no length of its own: written, read and written again it is the same octets.
macro_rules! body {
    ($type:ty, $data:expr) => {
        if let Ok(value) = <$type>::parse($data) {
            let write = |value: &$type| {
                let mut buffer = [0xA5; 64];
                let mut writer = Writer::new(&mut buffer);
                value.emit(&mut writer).expect("room for what was read");
                let len = writer.written();
                buffer[..len].to_vec()
            };
            let once = write(&value);
            assert_eq!(write(&<$type>::parse(&once).expect("what was written")), once, "{value:?}");
        }
    };
}

/// Updates of the fixed format.
pub fn fixed(data: &[u8]) {
    body!(FixedCommand, data);
    body!(FixedActual, data);
    if let Ok(update) = FixedCommand::parse(data) {
        assert_eq!(data.len(), format::LEN);
        assert_printed(&update.to_string(), data.len());
    }
    if let Ok(update) = FixedActual::parse(data) {
        assert_eq!(data.len(), format::LEN);
        assert_printed(&update.to_string(), data.len());
    }
}

/// Bodies of services: lists of attributes, of their numbers, Group_Sync, and the tests.
pub fn services(data: &[u8]) {
    body!(RunMotorTest, data);
    body!(MotorTestData, data);
    body!(RunInertiaTest, data);
    body!(InertiaTestData, data);
    body!(RunHookupTest, data);
    body!(HookupTestData, data);
    let _ = parse_group_sync(data);
    if let Ok(list) = IdList::parse(data) {
        let ids: Vec<_> = list.iter().collect();
        assert!(2 * ids.len() <= data.len());
        let mut buffer = vec![0xA5; data.len() + 8];
        let len = IdList::emit(&mut buffer, &ids).expect("room for what was read");
        assert!(IdList::parse(&buffer[..len]).expect("what was written").iter().eq(ids));
    }
    if let Ok(list) = IdStatusList::parse(data) {
        assert!(4 * list.iter().count() <= data.len());
    }
    lists(data);
}

/// The four lists of attributes. The announced count never makes a list longer than its octets.
fn lists(data: &[u8]) {
    let most = data.len() / 4 + 1;
    let mut buffer = vec![0xA5; 2 * data.len() + 64];
    if let Ok(list) = GetRequest::new(data) {
        let items: Vec<_> = list.map_while(Result::ok).collect();
        assert!(items.len() <= most);
        let mut writer = ListWriter::new(&mut buffer).expect("room for the head");
        items.iter().for_each(|item| writer.select(item).expect("room for what was read"));
        let len = writer.finish();
        let again: Vec<_> = GetRequest::new(&buffer[..len]).expect("a head").map_while(Result::ok).collect();
        assert_eq!(again, items);
    }
    if let Ok(list) = GetResponse::new(data) {
        let items: Vec<_> = list.map_while(Result::ok).collect();
        assert!(items.len() <= most);
        let mut writer = ListWriter::new(&mut buffer).expect("room for the head");
        for item in &items {
            match item {
                GetItem::Value(selector, value) => writer.value(selector, value),
                GetItem::Error(id, status) => writer.error(*id, *status),
            }
            .expect("room for what was read");
        }
        let len = writer.finish();
        let again: Vec<_> = GetResponse::new(&buffer[..len]).expect("a head").map_while(Result::ok).collect();
        assert_eq!(again, items);
    }
    if let Ok(list) = SetRequest::new(data) {
        assert!(list.count() <= most);
    }
    if let Ok(list) = SetResponse::new(data) {
        let items: Vec<_> = list.map_while(Result::ok).collect();
        assert!(items.len() <= most);
        let mut writer = ListWriter::new(&mut buffer).expect("room for the head");
        items.iter().for_each(|item| writer.status(*item).expect("room for what was read"));
        let len = writer.finish();
        let again: Vec<_> = SetResponse::new(&buffer[..len]).expect("a head").map_while(Result::ok).collect();
        assert_eq!(again, items);
    }
}
