//! The CAN socket and the settings of CAN interfaces, in a kernel that has CAN; and what else that kernel has and the host may not.

use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use axisbridge::sys::can_error::BusState;
use axisbridge::sys::can_interface::{self, ConfigureError, Settings, State};
use axisbridge::sys::can_socket::{CanSocket, Content, Filter, OpenError, Options, Received};
use axisbridge::sys::clock::monotonic_now;
use axisbridge::sys::clock::realtime_now;
use axisbridge::sys::link::{LinkError, LinkState};
use axisbridge::sys::packet_socket::{ETHER_TYPE_SERCOS, PacketSocket};
use axisbridge_tests::can_kernel::Kernel;
use axisbridge_tests::peer::{can_kernel_or_skip, python_or_skip};
use axisbridge_tests::slcan::{self, Adapters};
use profile_generic::can::timing::BitRate;
use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;

/// Whether to go on with `test`: only inside a guest.
fn inside(test: &str, kernel: &Kernel) -> bool {
    can_kernel_or_skip(test) && kernel.inside(test)
}

fn ip(words: &str) {
    run("ip", words);
}

fn run(program: &str, words: &str) {
    let status =
        Command::new(program).args(words.split_whitespace()).status().expect("the program is installed");
    assert!(status.success(), "{program} {words}: {status}");
}

fn open(name: &str) -> CanSocket {
    CanSocket::open(name, &Options::default()).unwrap()
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), data).unwrap()
}

/// The next thing that comes, within five seconds.
fn next(socket: &mut CanSocket) -> Received {
    assert!(socket.wait(Duration::from_secs(5)).unwrap(), "nothing came");
    socket.recv().unwrap().expect("poll said that there is one")
}

/// The next `count` things that come, as text; nothing is there behind them.
fn come(socket: &mut CanSocket, count: usize) -> Vec<String> {
    let lines = (0..count).map(|_| text(next(socket))).collect();
    assert_eq!(socket.recv().unwrap().map(text), None);
    lines
}

/// Everything that is there.
fn all(socket: &mut CanSocket) -> Vec<String> {
    std::iter::from_fn(|| socket.recv().unwrap().map(text)).collect()
}

fn text(received: Received) -> String {
    let own = if received.own { " own" } else { "" };
    match received.content {
        Content::Frame(frame) => format!("{frame}{own}"),
        Content::Error(error) => error.to_string(),
    }
}

#[test]
fn the_kernel_gives_back_what_a_command_says_and_how_it_ended() {
    if !can_kernel_or_skip("the_kernel_gives_back_what_a_command_says") {
        return;
    }
    let kernel = Kernel::new().interfaces(&["vcan0", "vcan1"]).limit(Duration::from_secs(5));
    let shell = |script: &str| {
        let finished = kernel.run(Command::new("sh").args(["-c", script]).env("AXB_WORD", "a  b\"c"));
        (finished.status, finished.stdout, finished.stderr)
    };
    let text = |text: &str| text.to_owned();
    assert_eq!(shell("printf '%s' \"$AXB_WORD\"; echo two >&2; exit 7"), (7, text("a  b\"c"), text("two\n")));
    assert_eq!(shell("cd /sys/class/net; echo *"), (0, text("lo vcan0 vcan1\n"), text("")));
    assert_eq!(shell("kill -9 $$").0, 137);
    assert_eq!(
        shell("touch /usr/axb-probe"),
        (1, text(""), text("touch: cannot touch '/usr/axb-probe': Read-only file system\n"))
    );
    assert_eq!(shell("sleep 60 & sleep 60"), (124, text(""), text("can kernel: stopped after 5 s\n")));
    assert_eq!(kernel.run(&Command::new("/no/such/program")).status, 127);
    let folder = std::env::temp_dir().join(format!("axb-can-kernel-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let script = "echo written > file; [ -w \"$TMPDIR\" ] && pwd";
    let finished =
        kernel.clone().writable(&folder).run(Command::new("sh").args(["-c", script]).current_dir(&folder));
    let written = std::fs::read_to_string(folder.join("file"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(finished.good(), format!("{}\n", folder.display()));
    assert_eq!(written.unwrap(), "written\n");
}

#[test]
fn frames_of_every_kind_cross_with_time_stamps_and_without_our_own() {
    if !inside("frames_of_every_kind_cross_with_time_stamps_and_without_our_own", &Kernel::new()) {
        return;
    }
    let (mut a, mut b) = (open("vcan0"), open("vcan0"));
    assert_eq!((a.name(), a.link_state()), ("vcan0", LinkState::Up));
    assert!(b.has_time_stamps());
    let frames = [
        frame(0x181, &[0x27, 6, 0, 0, 0, 0, 0, 0x80]),
        frame(0x80, &[]),
        Frame::remote(Id::Standard(0x701), 1).unwrap(),
        Frame::new(Id::Extended(0x1234_5678), &[1, 2, 3]).unwrap(),
        Frame::remote(Id::Extended(5), 8).unwrap(),
        Frame::fd(Id::Standard(0x182), &[0xA5; 64], true).unwrap(),
        Frame::fd(Id::Extended(6), &[1], false).unwrap(),
    ];
    for sent in &frames {
        let before = realtime_now();
        a.send(sent).unwrap();
        let received = next(&mut b);
        assert_eq!((received.content, received.own), (Content::Frame(*sent), false));
        let at = received.at.unwrap();
        assert!(before <= at && at <= realtime_now(), "{before:?} {at:?}");
    }
    assert_eq!(all(&mut a), Vec::<String>::new(), "a socket sees its own frames");
    let own = Options { own: true, ..Options::default() };
    let mut c = CanSocket::open("vcan0", &own).unwrap();
    c.send(&frames[0]).unwrap();
    a.send(&frames[1]).unwrap();
    assert_eq!(come(&mut c, 2), ["181#27 06 00 00 00 00 00 80 own", "080#"]);
    assert_eq!(come(&mut b, 2), ["181#27 06 00 00 00 00 00 80", "080#"]);
    assert!(!b.wait(Duration::ZERO).unwrap());
    assert_eq!(come(&mut a, 1), ["181#27 06 00 00 00 00 00 80"]);
    assert_eq!((a.take_dropped(), b.take_dropped()), (0, 0));
}

#[test]
fn filters_let_through_what_they_name() {
    if !inside("filters_let_through_what_they_name", &Kernel::new()) {
        return;
    }
    let filters = vec![
        Filter::exactly(Id::Standard(0x581)),
        Filter { id: Id::Standard(0x180), mask: 0x780 },
        Filter::exactly(Id::Extended(0x80)),
    ];
    let mut some = CanSocket::open("vcan0", &Options { filters, own: false }).unwrap();
    let other = open("vcan0");
    for id in [0x80, 0x180, 0x1FF, 0x200, 0x581, 0x582] {
        other.send(&frame(id, &[])).unwrap();
    }
    for id in [0x80, 0x581, 0x180] {
        other.send(&Frame::new(Id::Extended(id), &[]).unwrap()).unwrap();
    }
    assert_eq!(come(&mut some, 4), ["180#", "1FF#", "581#", "00000080#"]);
}

#[test]
fn an_interface_that_goes_down_or_away_is_told() {
    if !inside("an_interface_that_goes_down_or_away_is_told", &Kernel::new()) {
        return;
    }
    let (mut a, mut b) = (open("vcan0"), open("vcan0"));
    ip("link set vcan0 down");
    assert_eq!(a.link_state(), LinkState::Down);
    assert_eq!(a.recv(), Err(LinkError::Down));
    assert_eq!(a.recv(), Ok(None), "the error is told once");
    assert_eq!(a.send(&frame(1, &[])), Err(LinkError::Down));
    let refused = CanSocket::open("vcan0", &Options::default());
    assert!(matches!(refused, Err(OpenError::InterfaceDown { name }) if name == "vcan0"));
    ip("link set vcan0 up");
    assert_eq!(a.link_state(), LinkState::Up);
    a.send(&frame(1, &[7])).unwrap();
    assert_eq!(b.recv(), Err(LinkError::Down));
    assert_eq!(come(&mut b, 1), ["001#07"]);
    ip("link del vcan0");
    assert_eq!(a.link_state(), LinkState::Gone);
    assert_eq!(a.send(&frame(1, &[])), Err(LinkError::Gone));
    let gone = CanSocket::open("vcan0", &Options::default()).unwrap_err();
    assert_eq!(gone.to_string(), "there is no network interface `vcan0`");
}

#[test]
fn a_classic_interface_takes_no_frames_of_fd() {
    if !inside("a_classic_interface_takes_no_frames_of_fd", &Kernel::new()) {
        return;
    }
    ip("link set vcan0 down");
    ip("link set vcan0 mtu 16");
    ip("link set vcan0 up");
    let (a, mut b) = (open("vcan0"), open("vcan0"));
    let fd = Frame::fd(Id::Standard(0x181), &[0; 12], true).unwrap();
    assert_eq!(a.send(&fd), Err(LinkError::Length));
    a.send(&frame(0x181, &[1])).unwrap();
    assert_eq!(come(&mut b, 1), ["181#01"]);
}

#[test]
fn a_full_transmit_queue_refuses_and_empties() {
    let kernel = Kernel::new().interfaces(&["vxcan0:vxcan1"]).module("net/sched/sch_netem");
    if !inside("a_full_transmit_queue_refuses_and_empties", &kernel) {
        return;
    }
    // The frames wait in the queue of the interface as they would for a slow bus.
    run("tc", "qdisc add dev vxcan0 root netem delay 300ms limit 4");
    let (a, mut b) = (open("vxcan0"), open("vxcan1"));
    let sent: Vec<_> = (0..6).map(|n| a.send(&frame(0x181, &[n]))).collect();
    assert_eq!(sent, [Ok(()), Ok(()), Ok(()), Ok(()), Err(LinkError::Full), Err(LinkError::Full)]);
    let first = next(&mut b);
    assert_eq!(first.content, Content::Frame(frame(0x181, &[0])));
    // A full queue empties at the pace of the bus.
    let end = Instant::now() + Duration::from_secs(5);
    while a.send(&frame(0x181, &[9])).is_err() {
        assert!(Instant::now() < end, "the queue stays full");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn frames_that_are_not_fetched_in_time_are_counted() {
    if !inside("frames_that_are_not_fetched_in_time_are_counted", &Kernel::new()) {
        return;
    }
    let (a, mut b) = (open("vcan0"), open("vcan0"));
    let count = 4000_u16;
    for n in 0..count {
        a.send(&frame(0x181, &n.to_le_bytes())).unwrap();
    }
    let first = text(next(&mut b));
    let held = u32::try_from(all(&mut b).len()).unwrap() + 1;
    assert_eq!(first, "181#00 00");
    assert!(held < u32::from(count), "the buffer holds everything");
    // The kernel tells of the loss with the first frame behind it.
    a.send(&frame(0x181, &[])).unwrap();
    assert_eq!(come(&mut b, 1), ["181#"]);
    assert_eq!(b.take_dropped(), u32::from(count) - held);
    assert_eq!(b.take_dropped(), 0);
}

#[test]
fn a_virtual_interface_has_a_queue_and_no_bit_rate() {
    if !inside("a_virtual_interface_has_a_queue_and_no_bit_rate", &Kernel::new()) {
        return;
    }
    let state = can_interface::state("vcan0").unwrap();
    assert_eq!((state.has_bit_rate, state.nominal, state.state), (false, None, None));
    assert_eq!(state.link, LinkState::Up);
    let settings = Settings { queue: Some(200), ..Settings::default() };
    assert_eq!(can_interface::configure("vcan0", &settings).unwrap().queue, 200);
    let rate = Settings { bit_rate: BitRate::classic(500_000), ..Settings::default() };
    let text = |settings: &Settings| can_interface::configure("vcan0", settings).unwrap_err().to_string();
    assert_eq!(text(&rate), "`vcan0` has no bit rate to set: it is a virtual interface");
    let restart = Settings { restart_ms: Some(100), ..Settings::default() };
    assert_eq!(text(&restart), "`vcan0` has no restart time to set: it is a virtual interface");
    // One that is down is switched on.
    ip("link set vcan0 down");
    assert_eq!(can_interface::configure("vcan0", &Settings::default()).unwrap().link, LinkState::Up);
    // Loopback is an interface, and none of CAN.
    let lo = CanSocket::open("lo", &Options::default()).unwrap_err();
    assert_eq!(lo.to_string(), "the network interface `lo` is not CAN (hardware type 772)");
}

#[test]
fn without_privilege_frames_go_and_settings_do_not() {
    if !inside("without_privilege_frames_go_and_settings_do_not", &Kernel::new().user(65_534)) {
        return;
    }
    let (a, mut b) = (open("vcan0"), open("vcan0"));
    a.send(&frame(1, &[])).unwrap();
    assert_eq!(come(&mut b, 1), ["001#"]);
    let queue = Settings { queue: Some(200), ..Settings::default() };
    let error = can_interface::configure("vcan0", &queue).unwrap_err();
    assert!(matches!(error, ConfigureError::NotPermitted { .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "not allowed to set up `vcan0`: the process needs CAP_NET_ADMIN (run as root, or set the transmit queue beforehand: \
         `ip link set vcan0 txqueuelen 200`)"
    );
}

/// A kernel with the driver, and a Python for the adapters.
fn with_adapters(test: &str) -> Option<PathBuf> {
    let python = python_or_skip(test, "fcntl")?;
    inside(test, &Kernel::new().interfaces(&[]).module(slcan::MODULE)).then_some(python)
}

#[test]
fn a_controller_gets_its_bit_rate_and_one_that_has_it_is_left_alone() {
    let Some(python) = with_adapters("a_controller_gets_its_bit_rate_and_one_that_has_it_is_left_alone")
    else {
        return;
    };
    let adapters = Adapters::start(&python, 1);
    let state = can_interface::state("can0").unwrap();
    assert_eq!((state.link, state.has_bit_rate, state.nominal), (LinkState::Down, true, None));
    assert_eq!((state.state, state.queue), (None, 10));
    // The rates of the driver are a list; it cannot restart by itself.
    let refused = Settings { bit_rate: BitRate::classic(333_000), ..Settings::default() };
    let refused = can_interface::configure("can0", &refused).unwrap_err().to_string();
    assert_eq!(refused, "the driver of `can0` refuses 333 kbit/s: Invalid argument (os error 22)");
    let settings = Settings {
        bit_rate: BitRate::classic(500_000),
        restart_ms: Some(100),
        queue: Some(128),
        ..Settings::default()
    };
    let state = can_interface::configure("can0", &settings).unwrap();
    assert!(
        matches!(state.link, LinkState::Up | LinkState::NoCarrier),
        "the carrier is told later: {state:?}"
    );
    assert_eq!((state.nominal, state.queue), (Some(500_000), 128));
    assert_eq!((state.state, state.restart_ms), (Some(BusState::Active), Some(0)));
    let opened = ["up", "0 C", "0 S6", "0 O"];
    adapters.have_said(&opened);
    // Once more: nothing is done to an interface that has what is asked for.
    let again = can_interface::configure("can0", &settings).unwrap();
    assert_eq!(State { link: state.link, ..again }, state);
    adapters.have_said(&opened);
    let other = Settings { bit_rate: BitRate::classic(250_000), ..settings };
    assert_eq!(
        can_interface::configure("can0", &other).unwrap_err().to_string(),
        "`can0` is up with 500 kbit/s, restart 0 ms, expected 250 kbit/s, restart 100 ms: set it down first (`ip link set can0 \
         down`)"
    );
}

#[test]
fn what_a_controller_says_of_its_bus_is_told_and_it_comes_back_after_bus_off() {
    let test = "what_a_controller_says_of_its_bus_is_told_and_it_comes_back_after_bus_off";
    let Some(python) = with_adapters(test) else { return };
    let adapters = Adapters::start(&python, 2);
    let settings = Settings { bit_rate: BitRate::classic(1_000_000), ..Settings::default() };
    for interface in ["can0", "can1"] {
        can_interface::configure(interface, &settings).unwrap();
    }
    adapters.have_said(&["up", "0 C", "0 S8", "0 O", "1 C", "1 S8", "1 O"]);
    let (mut a, mut b) = (open("can0"), open("can1"));
    b.send(&frame(0x181, &[0x27, 6])).unwrap();
    assert_eq!(text(next(&mut a)), "181#27 06");
    for (said, told) in [
        ("sw100020", "controller: receive warning; error counters 20 transmit, 100 receive"),
        ("sp020130", "controller: transmit passive; error counters 130 transmit, 20 receive"),
        ("sa000000", "controller: active; error counters 0 transmit, 0 receive"),
        ("e1a", "protocol violation: unspecified at ACK slot; no acknowledge; bus error"),
        ("sb000256", "bus off"),
    ] {
        adapters.say(said);
        assert_eq!(text(next(&mut a)), told);
    }
    let state = can_interface::state("can0").unwrap();
    assert_eq!((state.state, state.restart_ms), (Some(BusState::Off), Some(0)));
    b.send(&frame(0x181, &[1])).unwrap();
    // The driver has no restart: the interface goes down and up.
    can_interface::restart("can0").unwrap();
    let begun = ["up", "0 C", "0 S8", "0 O", "1 C", "1 S8", "1 O"];
    adapters.have_said(&[&begun[..], &["0 C", "0 C", "0 S8", "0 O"]].concat());
    assert_eq!(can_interface::state("can0").unwrap().state, Some(BusState::Active));
    // The socket is told that its interface was down, and goes on.
    assert!(a.wait(Duration::from_secs(5)).unwrap());
    assert_eq!(a.recv(), Err(LinkError::Down));
    b.send(&frame(0x181, &[2])).unwrap();
    assert_eq!(text(next(&mut a)), "181#02");
    a.send(&frame(0x201, &[3])).unwrap();
    assert_eq!(text(next(&mut b)), "201#03");
}

/// A telegram that is told from others by its last byte.
fn telegram(last: u8) -> [u8; 60] {
    let mut telegram = [last; 60];
    telegram[..6].fill(0xFF);
    telegram[6..12].copy_from_slice(&[2, 0, 0, 0, 0, 1]);
    telegram[12..14].copy_from_slice(&ETHER_TYPE_SERCOS.to_be_bytes());
    telegram
}

/// The telegrams that come within a time, by their last bytes, each with the kernel's stamp.
fn telegrams(socket: &PacketSocket, within: Duration) -> Vec<(u8, u64)> {
    let (end, mut buffer, mut come) = (Instant::now() + within, [0; 100], Vec::new());
    while Instant::now() < end {
        match socket.recv(&mut buffer).unwrap() {
            Some(received) => {
                come.push((buffer[received.len - 1], received.at.expect("the kernel stamps what comes").0));
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    come
}

/// The kernel's own discipline holds the telegrams of SERCOS III until their instant, whatever order they are handed over in.
#[test]
fn telegrams_leave_at_their_instant_where_the_interface_has_etf() {
    let test = "telegrams_leave_at_their_instant_where_the_interface_has_etf";
    let kernel = Kernel::new().interfaces(&[]).module("net/sched/sch_etf").module("drivers/net/veth");
    if !inside(test, &kernel) {
        return;
    }
    ip("link add south0 type veth peer name south1");
    ip("link set south0 up");
    ip("link set south1 up");
    let open = |name| PacketSocket::open(name, ETHER_TYPE_SERCOS).unwrap();
    let (plain, far) = (open("south0"), open("south1"));
    assert!(!plain.launches(), "nobody has set a discipline");
    plain.send(&telegram(1)).unwrap();
    let come = telegrams(&far, Duration::from_millis(300));
    assert_eq!(come.iter().map(|(last, _)| *last).collect::<Vec<_>>(), [1]);

    // So long before the instant the kernel takes the frame in hand, and sends it. One that it takes in hand behind its instant it
    // throws away: a machine inside another one does not always come in time for less.
    const DELTA: u64 = 50_000_000;
    run("tc", &format!("qdisc replace dev south0 root etf clockid CLOCK_TAI delta {DELTA}"));
    let near = open("south0");
    assert!(near.launches());
    let (now, wall) = (monotonic_now(), realtime_now().0);
    for (last, millis) in [(2, 900), (3, 300), (4, 600)] {
        near.send_at(&telegram(last), now + DurationNs::from_millis(millis)).unwrap();
    }
    let come = telegrams(&far, Duration::from_millis(1_500));
    assert_eq!(
        come.iter().map(|(last, _)| *last).collect::<Vec<_>>(),
        [3, 4, 2],
        "in the order of their instants"
    );
    for ((_, at), millis) in come.iter().zip([300, 600, 900]) {
        let after = at.saturating_sub(wall);
        assert!(
            after + DELTA >= millis * 1_000_000,
            "{after} ns after they were handed over, and not {millis} ms"
        );
    }
    // What would be late is sent nevertheless, at once: with an instant so near that the kernel throws it away when the machine pauses.
    let come = (0..20).map(|_| {
        // It refuses one whose instant is over already.
        let _ = near.send_at(&telegram(5), now);
        telegrams(&far, Duration::from_millis(100))
    });
    let come = come.map(|come| come.iter().map(|(last, _)| *last).collect::<Vec<_>>());
    assert!(come.collect::<Vec<_>>().contains(&vec![5]), "not one of twenty was sent");
    // A frame without an instant is thrown away.
    let _ = near.send(&telegram(6));
    assert_eq!(telegrams(&far, Duration::from_millis(300)), []);
}
