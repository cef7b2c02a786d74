//! SERCOS III: telegrams, their readable form, and a master with a line of drives.

use axisbridge::simulate::drives::drives;
use profile_generic::scaling::UnitKind;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::master::Master;
use profile_sercos::master::config::{ConnectionConfig, MasterConfig, SlaveConfig};
use profile_sercos::master::event::{Event, Output, SlaveId};
use profile_sercos::master::phase::State;
use profile_sercos::wire::connection::ConnectionControl;
use profile_sercos::wire::data_status::DataStatus;
use profile_sercos::wire::describe::{DecodeContext, describe};
use profile_sercos::wire::extended::Extended;
use profile_sercos::wire::header::{Header, Kind, Phase};
use profile_sercos::wire::hot_plug::HotPlug;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::layout::{ConnectionLayout, DeviceLayout, Layout, Offset};
use profile_sercos::wire::slot::SvcSlot;
use profile_sercos::wire::svc::{AtSvc, ListHead, MdtSvc};
use profile_sercos::wire::telegram::Frame;

use super::assert_printed;
use super::conversation::{BURST_MAX, Bytes, Disturber};

/// The frame with a good CRC, if it has a header: no station takes another one, and nobody guesses a CRC.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut frame = bytes.to_vec();
    if let Ok(header) = Header::parse_unchecked(bytes) {
        header.emit(&mut frame).expect("room for the header that was read");
    }
    frame
}

/// Two slaves, of which the second one has a connection each way.
fn layout() -> Layout {
    let at = |offset| Some(Offset { telegram: 0, offset });
    let connection =
        |index, kind, offset| ConnectionLayout { index, kind, at: Offset { telegram: 0, offset }, len: 8 };
    let device = |address, word, svc, connections| DeviceLayout {
        address,
        device_control: at(word),
        device_status: at(word),
        svc_mdt: at(svc),
        svc_at: at(svc),
        connections,
    };
    let connections = vec![connection(0, Kind::Mdt, 24), connection(1, Kind::At, 24)];
    Layout {
        mdt_len: [40, 0, 0, 0],
        at_len: [40, 0, 0, 0],
        extended: false,
        devices: vec![device(1, 8, 12, vec![]), device(2, 10, 18, connections)],
    }
}

/// One frame in every phase, and the parts of telegrams.
pub fn telegram(data: &[u8]) {
    let frame = sealed(data);
    if let Ok(header) = Header::parse(&frame) {
        assert_printed(&header.to_string(), frame.len());
        for layout in [Layout::unknown(), layout()] {
            for phase in 0..=5 {
                let Ok(parsed) = Frame::parse(&frame, Phase(phase), &layout) else { continue };
                assert_printed(&parsed.to_string(), frame.len());
                let mut again = vec![0xA5; parsed.buffer_len()];
                parsed.emit(&mut again).expect("room for what was read");
                assert_eq!(again, frame);
            }
        }
    }
    macro_rules! part {
        ($type:ty) => {
            if let Ok(value) = <$type>::parse(data) {
                let mut bytes = vec![0xA5; value.buffer_len()];
                value.emit(&mut bytes).expect("room for what was read");
                assert_eq!(<$type>::parse(&bytes).as_ref(), Ok(&value));
                assert_printed(&value.to_string(), data.len());
            }
        };
    }
    part!(HotPlug);
    part!(Extended);
    part!(SvcSlot);
    part!(MdtSvc);
    part!(AtSvc);
    let mut bytes = Bytes::new(data);
    let [word, info] = [u32::from(bytes.word()), u32::from_le_bytes(bytes.array())];
    let head = ListHead::from_info(info);
    assert_eq!(ListHead::from_info(head.to_info()), head);
    let idn = Idn(info);
    assert_eq!(idn.to_string().parse(), Ok(idn), "{idn}");
    let text = format!(
        "{:?} {}",
        DataStatus::from_bits_retain(bytes.word()),
        ConnectionControl::from_bits_retain(bytes.word())
    );
    assert_printed(&text, data.len());
    assert!(word <= u32::from(u16::MAX));
    if let Ok(text) = core::str::from_utf8(data)
        && let Ok(idn) = text.parse::<Idn>()
    {
        assert_eq!(idn.to_string().parse(), Ok(idn));
    }
}

/// Frame after frame in words: a length of two bytes, then the frame. What the frames before have told goes on counting.
pub fn describing(data: &[u8]) {
    let (mut bytes, mut context) = (Bytes::new(data), DecodeContext::default());
    while !bytes.is_over() {
        let len = usize::from(bytes.word() & 0x7FF);
        let frame = sealed(bytes.take(len));
        let text = describe(&frame, &mut context);
        assert_printed(&text, frame.len());
    }
}

const MAC: [u8; 6] = [2, 0, 0, 0, 0, 1];

/// The command and the actual values of a drive in position control.
fn slave_of(address: u16) -> SlaveConfig {
    let idns = |blocks: [u16; 2]| blocks.map(Idn::standard);
    let connection =
        |number, produces, blocks| ConnectionConfig::new(number, produces, &idns(blocks)).expect("two IDNs");
    let connections = [connection(0, false, [134, 47]), connection(1, true, [135, 51])];
    SlaveConfig { address, connections: connections.into_iter().collect(), hot_plug: None }
}

/// A master and a line of two drives.
struct Line {
    master: Master,
    drives: axisbridge::simulate::drives::DriveNetwork,
    now: MonotonicTime,
    /// A slave was read as one that cannot take part: only a new scan reads it again.
    misread: bool,
}

impl Line {
    fn new() -> Self {
        let config = MasterConfig {
            slaves: vec![slave_of(1), slave_of(2)],
            slaves_max: 8,
            stable_cycles: 4,
            settle: DurationNs::from_millis(4),
            scan_timeout_cycles: 200,
            ..MasterConfig::new(MAC, 2_000_000)
        };
        let mut master = Master::new(config).expect("a possible network");
        master.set_target_phase(Phase::CP4);
        let drives = drives([(1, UnitKind::Rotary), (2, UnitKind::Linear)], false);
        Self { master, drives, now: MonotonicTime(1_000_000_000), misread: false }
    }

    /// A cycle: `out` is the way to the drives, `back` the way from them.
    fn cycle(&mut self, out: &mut Disturber<'_>, back: &mut Disturber<'_>) {
        let Self { master, drives, now, misread } = self;
        *now = (*now).max(master.wake_at().unwrap_or(*now + DurationNs::from_millis(1)));
        drives.handle_time(*now);
        let mut frames = Vec::new();
        while let Some(Output::Transmit { port, frame }) = master.poll(*now) {
            frames.push((port, frame.to_vec()));
            assert!(frames.len() < BURST_MAX, "the master does not stop sending");
        }
        for (port, frame) in frames {
            out.carry(&frame, &mut |frame| {
                let mut frame = sealed(frame);
                drives.send(*now, port, &mut frame, &mut |port, frame| {
                    back.carry(frame, &mut |frame| {
                        let _ = master.handle_frame(*now, port, &sealed(frame));
                    });
                });
            });
        }
        while let Some(event) = master.poll_event() {
            match event {
                // Refused only when the target has changed meanwhile.
                Event::AwaitingApplication { .. } => drop(master.proceed()),
                Event::ClassMismatch { .. }
                | Event::NoConnection { .. }
                | Event::CheckFailed { .. }
                | Event::AddressConflict { .. } => *misread = true,
                _ => {}
            }
        }
        // What has failed is tried again, as the box does.
        *misread &= master.phase().is_some_and(|phase| phase > Phase::CP0);
        let target = if *misread { Phase::CP0 } else { Phase::CP4 };
        if master.state() != State::Cp4 && master.target_phase() != Some(target) {
            master.set_target_phase(target);
        }
        for slave in [SlaveId(0), SlaveId(1)] {
            master.commit(slave, 0);
        }
    }

    fn is_up(&self) -> bool {
        let fresh = |address| {
            let slave = self.master.slave_by_address(address);
            slave.and_then(|slave| self.master.consumer(slave, 1)).is_some_and(|consumer| consumer.fresh)
        };
        self.master.state() == State::Cp4 && fresh(1) && fresh(2)
    }
}

/// Cycles in which frames are disturbed.
const DISTURBED: usize = 2_500;

/// A line whose drives' answers are disturbed on their way to the master. Left alone, all exchange data soon.
pub fn master(data: &[u8]) {
    let (mut line, mut none, mut back) = (Line::new(), Disturber::new(&[]), Disturber::new(data));
    for _ in 0..DISTURBED {
        if back.is_over() {
            break;
        }
        line.cycle(&mut none, &mut back);
    }
    back.calm();
    let since = line.now;
    while !line.is_up() {
        line.cycle(&mut none, &mut back);
        let waited = line.now.since(since);
        assert!(
            waited < DurationNs::from_secs(30),
            "{:?}, {waited} after all was well again",
            line.master.state()
        );
    }
}

/// A line of drives that hear a disturbed master.
pub fn slave(data: &[u8]) {
    let (mut line, mut out, mut none) = (Line::new(), Disturber::new(data), Disturber::new(&[]));
    for _ in 0..DISTURBED {
        if out.is_over() {
            break;
        }
        line.cycle(&mut out, &mut none);
    }
    // Nobody speaks any more: the drives stop what they do.
    for _ in 0..200 {
        line.now = line.now + DurationNs::from_millis(10);
        line.drives.handle_time(line.now);
    }
    for slave in line.drives.slaves() {
        assert_eq!(slave.application().actual().velocity.get(), 0, "nobody is there any more");
    }
}
