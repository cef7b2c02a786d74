//! The readable form of a foreign master's start-up.

mod support;

use profile_sercos::wire::describe::{DecodeContext, Names, describe};
use profile_sercos::wire::header::{Kind, Phase};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::layout::Offset;

/// The few names and lengths this test needs.
struct Few;

impl Names for Few {
    fn name(&self, idn: Idn) -> Option<&str> {
        match idn.to_string().as_str() {
            "S-0-0127" => Some("CP3 transition check"),
            "S-0-1010" => Some("Lengths of MDTs"),
            "S-0-0036" => Some("Velocity command value"),
            "S-0-0040" => Some("Velocity feedback value 1"),
            _ => None,
        }
    }

    fn length(&self, idn: Idn) -> Option<usize> {
        (idn == Idn::standard(40)).then_some(4)
    }
}

#[test]
fn the_start_up_can_be_read() {
    let frames = support::part();
    let mut context = DecodeContext::new(&Few);
    let mut text = String::new();
    let mut lines = std::collections::BTreeSet::new();
    for bytes in &frames {
        let tree = describe(bytes, &mut context);
        assert!(tree.contains("CRC ok") && !tree.contains("not readable"), "{tree}");
        // In CP2 the second slave does the same as the first. Then one tree of each shape.
        let tree = match tree.find("  slave 2\n") {
            Some(end) if tree.contains(" CP2 ") => &tree[..end],
            _ => &tree,
        };
        let shape: String = tree.chars().map(|c| if c.is_ascii_hexdigit() { '0' } else { c }).collect();
        if lines.insert(shape) {
            text.push_str(tree);
        }
    }
    let layout = context.layout();
    assert_eq!((layout.mdt_len, layout.at_len), ([46, 0, 0, 0], [48, 0, 0, 0]));
    let device = &layout.devices[1];
    assert_eq!((device.address, device.svc_mdt), (2, Some(Offset { telegram: 0, offset: 20 })));
    assert_eq!(device.connections.len(), 2);
    assert_eq!((device.connections[1].kind, device.connections[1].len), (Kind::At, 12));
    assert_eq!(context.connection_idns(1, 0), [Idn::DRIVE_CONTROL, Idn::standard(36)]);
    insta::assert_snapshot!(text);
}

#[test]
fn broken_frames_are_shown_not_refused() {
    let mut bytes = support::part()[0].clone();
    let mut context = DecodeContext::default();
    bytes[19] ^= 1;
    assert!(describe(&bytes, &mut context).contains("CRC BAD"));
    assert!(
        describe(&bytes[..19], &mut context)
            .starts_with("no SERCOS frame: SERCOS header at byte 0: expected 20 bytes")
    );
    bytes[19] ^= 1;
    let text = describe(&bytes[..40], &mut context);
    assert!(text.contains("not readable: MDT0 of CP0 at byte 0: expected 40 bytes, found 20"), "{text}");
    assert_eq!(Phase::CP0.to_string(), "CP0");
}
