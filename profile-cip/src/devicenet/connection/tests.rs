use core::fmt::Write as _;

use super::*;

const STATES: [ConnectionState; 5] = [
    ConnectionState::NON_EXISTENT,
    ConnectionState::CONFIGURING,
    ConnectionState::ESTABLISHED,
    ConnectionState::TIMED_OUT,
    ConnectionState::DEFERRED_DELETE,
];

const EVENTS: [ConnectionEvent; 13] = [
    ConnectionEvent::Allocate,
    ConnectionEvent::Release,
    ConnectionEvent::SetRate,
    ConnectionEvent::SetOther,
    ConnectionEvent::Apply,
    ConnectionEvent::Reset,
    ConnectionEvent::Get,
    ConnectionEvent::Message,
    ConnectionEvent::Watchdog(WatchdogAction::TIME_OUT),
    ConnectionEvent::Watchdog(WatchdogAction::AUTO_DELETE),
    ConnectionEvent::Watchdog(WatchdogAction::AUTO_RESET),
    ConnectionEvent::Watchdog(WatchdogAction::DEFERRED_DELETE),
    ConnectionEvent::LastIoGone,
];

fn table(io: bool, io_established: bool) -> String {
    let mut text = String::new();
    for state in STATES {
        writeln!(text, "{state}").unwrap();
        for event in EVENTS {
            let transition = state.next(io, event, io_established);
            let refused = transition.refused.map_or(String::new(), |status| format!(" refused: {status}"));
            let restart = if transition.restart { " (timer anew)" } else { "" };
            writeln!(text, "  {event:?} -> {}{restart}{refused}", transition.next).unwrap();
        }
    }
    text
}

#[test]
fn every_state_and_event_of_an_io_connection() {
    insta::assert_snapshot!(table(true, false));
    assert_eq!(table(true, false), table(true, true), "that is for the explicit connection only");
}

#[test]
fn every_state_and_event_of_the_explicit_connection() {
    insta::assert_snapshot!("explicit_alone", table(false, false));
    insta::assert_snapshot!("explicit_beside_io", table(false, true));
}

fn ms(millis: u64) -> MonotonicTime {
    MonotonicTime(millis * 1_000_000)
}

fn mac(number: u8) -> MacId {
    MacId::new(number).unwrap()
}

fn setup() -> ConnectionSetup {
    ConnectionSetup { transport: 0x82, produced_size: 16, consumed_size: 16, supervised: true }
}

fn allocated(kind: ConnectionKind) -> Connection {
    let mut connection = Connection::new(kind, mac(9), 1);
    connection.allocate(ms(0), mac(1), setup(), true).unwrap();
    connection
}

#[test]
fn the_watchdog_is_four_times_the_rate_and_ten_seconds_at_first() {
    let mut poll = allocated(ConnectionKind::Poll);
    assert_eq!((poll.state(), poll.deadline()), (ConnectionState::CONFIGURING, None));
    let change = poll.set(ms(5), 9, &[50, 0]).unwrap();
    assert_eq!((change.before, change.after), (ConnectionState::CONFIGURING, ConnectionState::ESTABLISHED));
    assert_eq!(poll.deadline(), Some(ms(10_005)));
    poll.event(ms(20), ConnectionEvent::Message, false).unwrap();
    assert_eq!(poll.deadline(), Some(ms(220)));
    assert_eq!(poll.handle_time(MonotonicTime(ms(220).0 - 1), false), None);
    assert_eq!(poll.handle_time(ms(220), false).map(|change| change.after), Some(ConnectionState::TIMED_OUT));
    assert_eq!((poll.deadline(), poll.handle_time(ms(9_999), false)), (None, None));
    let message = poll.event(ms(300), ConnectionEvent::Message, false);
    assert_eq!(message, Err(GeneralStatus::OBJECT_STATE_CONFLICT), "nothing is consumed behind a time-out");
    poll.event(ms(400), ConnectionEvent::Reset, false).unwrap();
    assert_eq!((poll.state(), poll.deadline()), (ConnectionState::ESTABLISHED, Some(ms(10_400))));
    // A slow connection waits longer for its first message, too.
    poll.set(ms(500), 9, &5000_u16.to_le_bytes()).unwrap();
    assert_eq!(poll.deadline(), Some(ms(20_500)));
}

#[test]
fn an_explicit_connection_deletes_itself_or_waits_for_the_io() {
    let mut explicit = allocated(ConnectionKind::Explicit);
    assert_eq!((explicit.state(), explicit.deadline()), (ConnectionState::ESTABLISHED, Some(ms(10_000))));
    assert_eq!(
        explicit.handle_time(ms(10_000), true).map(|change| change.after),
        Some(ConnectionState::NON_EXISTENT)
    );
    let mut explicit = allocated(ConnectionKind::Explicit);
    explicit.set(ms(0), 12, &[3]).unwrap();
    assert_eq!(
        explicit.handle_time(ms(10_000), true).map(|c| c.after),
        Some(ConnectionState::DEFERRED_DELETE)
    );
    explicit.event(ms(10_500), ConnectionEvent::Message, true).unwrap();
    assert_eq!(explicit.deadline(), Some(ms(20_500)));
    assert_eq!(explicit.handle_time(ms(20_500), false).map(|c| c.after), Some(ConnectionState::NON_EXISTENT));
}

#[test]
fn attributes_of_every_kind() {
    let mut text = String::new();
    for kind in ConnectionKind::ALL {
        let connection = allocated(kind);
        writeln!(text, "{kind}, instance {}", kind.instance()).unwrap();
        for attribute in 0..=18 {
            let mut out = Vec::new();
            match connection.get(attribute, (&[0x20, 4], &[]), &mut out) {
                Ok(()) => writeln!(text, "  {attribute:2} {out:02x?}").unwrap(),
                Err(status) => writeln!(text, "  {attribute:2} {status}").unwrap(),
            }
        }
    }
    insta::assert_snapshot!(text);
    let absent = Connection::new(ConnectionKind::Poll, mac(9), 1);
    let refused = absent.get(1, (&[], &[]), &mut Vec::new());
    assert_eq!(refused, Err(GeneralStatus::OBJECT_DOES_NOT_EXIST));
}

#[test]
fn what_may_not_be_set() {
    use GeneralStatus as S;
    let cases = [
        (ConnectionKind::Poll, 9, &[1][..], S::NOT_ENOUGH_DATA),
        (ConnectionKind::Poll, 9, &[1, 0, 0], S::TOO_MUCH_DATA),
        (ConnectionKind::Poll, 9, &[0, 0], S::INVALID_ATTRIBUTE_VALUE),
        (ConnectionKind::Poll, 12, &[2], S::INVALID_ATTRIBUTE_VALUE),
        (ConnectionKind::Poll, 12, &[3], S::INVALID_ATTRIBUTE_VALUE),
        (ConnectionKind::Poll, 12, &[], S::NOT_ENOUGH_DATA),
        (ConnectionKind::Poll, 12, &[1, 1], S::TOO_MUCH_DATA),
        (ConnectionKind::Poll, 17, &[1, 0], S::ATTRIBUTE_NOT_SETTABLE),
        (ConnectionKind::Poll, 1, &[3], S::ATTRIBUTE_NOT_SETTABLE),
        (ConnectionKind::Poll, 99, &[3], S::ATTRIBUTE_NOT_SUPPORTED),
        (ConnectionKind::Explicit, 12, &[0], S::INVALID_ATTRIBUTE_VALUE),
        (ConnectionKind::Explicit, 12, &[2], S::INVALID_ATTRIBUTE_VALUE),
    ];
    for (kind, attribute, value, status) in cases {
        let mut connection = allocated(kind);
        let before = connection.clone();
        assert_eq!(connection.set(ms(1), attribute, value), Err(status), "{kind} {attribute} {value:?}");
        assert_eq!(connection, before, "{kind} {attribute} {value:?}");
    }
    let mut cos = allocated(ConnectionKind::ChangeOfState);
    cos.set(ms(0), 9, &[100, 0]).unwrap();
    assert_eq!(cos.set(ms(0), 17, &[101, 0]), Err(S::INVALID_ATTRIBUTE_VALUE), "longer than the rate");
    assert!(cos.set(ms(0), 17, &[100, 0]).is_ok());
    assert_eq!((cos.inhibit_ms(), cos.deadline()), (100, None), "what it produces has no watchdog");
}

#[test]
fn the_rate_is_rounded_up_to_what_the_slave_can_do() {
    let mut poll = Connection::new(ConnectionKind::Poll, mac(9), 10);
    poll.allocate(ms(0), mac(1), setup(), true).unwrap();
    // As the I-7242D does: 0E0A is answered with 0E10.
    poll.set(ms(0), 9, &[0x0A, 0x0E]).unwrap();
    assert_eq!(poll.rate_ms(), 0x0E10);
    assert_eq!(poll.set(ms(0), 9, &[0xFF, 0xFF]), Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
    assert_eq!(poll.rate_ms(), 0x0E10);
}
