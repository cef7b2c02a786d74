//! Scans of simulated drives in virtual time.

use profile_generic::can::bus::Bus;
use profile_generic::can::timing::BitRate;

use super::*;
use crate::config::Config;
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::can_drive::drive;

/// Who is found on a bus with these devices, each with so many axes, and how long it takes.
fn scan(devices: &[(u8, u8)]) -> (Vec<Found>, DurationNs) {
    let rate = BitRate::classic(500_000).expect("a rate of CAN");
    let node = |number| NodeId::new(number).ok();
    let devices =
        devices.iter().map(|(number, axes)| drive(node(*number), *axes).expect("a drive")).collect();
    let mut bus = InProcessCan::new(Bus::new(rate), devices, None);
    let start = MonotonicTime(1_000_000_000);
    bus.advance(start);
    // They boot.
    let mut now = start + DurationNs::from_millis(200);
    bus.advance(now);
    let begin = now;
    let mut scanner = Scanner::new();
    while !scanner.step(now, &mut bus) {
        let latest = now + DurationNs::from_millis(1);
        now = scanner.wake_at().map_or(latest, |at| at.clamp(now, latest));
        now = now + DurationNs::from_micros(50);
    }
    bus.bus_mut().judge();
    (scanner.finish(), now.since(begin))
}

#[test]
fn drives_tell_who_they_are_and_the_rest_is_asked_in_vain() {
    let (found, took) = scan(&[(9, 1), (127, 1), (3, 2)]);
    let nodes: Vec<_> = found.iter().map(|device| device.node.get()).collect();
    assert_eq!(nodes, [3, 9, 127]);
    assert_eq!(found[1].number(DEVICE_TYPE), Some(0x0002_0192));
    assert_eq!(found[1].number(IDENTITY[3]), Some(9), "the serial number");
    assert_eq!(found[0].axes().count(), 2);
    assert_eq!(found[2].axes().count(), 1);
    // 124 who are not there, eight at a time.
    assert!(took < DurationNs::from_millis(2_500), "{took}");
    insta::assert_snapshot!(text(&found[..2]));
    insta::assert_snapshot!(format!("{:#}", json(&found[1..2])));
}

#[test]
fn nobody_is_nobody() {
    // Not even somebody who acknowledges: the first frames stay in the queue.
    let (found, took) = scan(&[]);
    assert!(took < DurationNs::from_secs(6), "{took}");
    assert_eq!(text(&found), "0 nodes\n");
    assert_eq!(starter(&found, "can0", None), None);
}

#[test]
fn the_configuration_is_one_that_the_box_takes() {
    let (found, _) = scan(&[(3, 2), (127, 1)]);
    let text = starter(&found, "can0", Some(500_000)).expect("there are drives");
    let config = Config::parse(&text, "box.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let bus = &config.can[0];
    let drives: Vec<_> = bus.drives.iter().map(|drive| (drive.node.get(), drive.axis)).collect();
    assert_eq!(drives, [(3, 0), (3, 1), (127, 0)]);
    assert_eq!((bus.bit_rate.nominal(), bus.node.get()), (500_000, 126));
    assert_eq!(config.axes.len(), 3);
    insta::assert_snapshot!(text);
}
