//! The frames of one cycle: built, sent one after the other, and taken back.

use super::config::Ports;
use super::event::{Port, Refusal};
use super::topology::Route;
use crate::wire::header::{
    Channel, DATA_LEN_MAX, FRAME_LEN_MAX, HEADER_LEN, Header, Kind, MacAddress, PhaseField, TELEGRAMS_MAX,
    TelegramType,
};

/// MDTs and ATs of one cycle, on both ports.
const FRAMES_MAX: usize = 2 * 2 * TELEGRAMS_MAX;

/// The port from which a channel is sent.
const fn port_of(channel: Channel) -> Port {
    match channel {
        Channel::Primary => Port::One,
        Channel::Secondary => Port::Two,
    }
}

#[derive(Debug)]
struct Sent {
    telegram: TelegramType,
    bytes: [u8; FRAME_LEN_MAX],
    len: usize,
    /// The ports at which it has come back.
    back: [bool; 2],
}

#[derive(Debug)]
pub(super) struct Frames {
    mac: MacAddress,
    ports: Ports,
    phase: PhaseField,
    /// Whether the frames of a cycle are out.
    out: bool,
    sent: Vec<Sent>,
    used: usize,
    next: usize,
    /// Data fields of the ATs that have come back, four for each route.
    received: Vec<[u8; DATA_LEN_MAX]>,
    /// Their lengths; 0 for one that has not come back in this cycle.
    arrived: [usize; TELEGRAMS_MAX * Route::ALL.len()],
}

impl Frames {
    pub fn new(mac: MacAddress, ports: Ports) -> Frames {
        let empty =
            || Sent { telegram: TelegramType(0), bytes: [0; FRAME_LEN_MAX], len: 0, back: [false; 2] };
        Frames {
            mac,
            ports,
            phase: PhaseField(0),
            out: false,
            sent: (0..FRAMES_MAX).map(|_| empty()).collect(),
            used: 0,
            next: 0,
            received: vec![[0; DATA_LEN_MAX]; TELEGRAMS_MAX * Route::ALL.len()],
            arrived: [0; TELEGRAMS_MAX * Route::ALL.len()],
        }
    }

    /// Starts a cycle.
    pub fn begin(&mut self, phase: PhaseField) {
        self.phase = phase;
        self.out = true;
        self.used = 0;
        self.next = 0;
        self.arrived.fill(0);
    }

    /// No frames are out: whatever comes is refused.
    pub fn silence(&mut self) {
        self.out = false;
        self.used = 0;
        self.next = 0;
        self.arrived.fill(0);
    }

    /// Adds a telegram with `len` bytes of data, at most 1494, on each port that there is. `fill` gets them zeroed;
    /// `secondary` makes the data of the S telegram out of that of the P telegram.
    pub fn add(
        &mut self,
        kind: Kind,
        number: u8,
        len: usize,
        fill: impl FnOnce(&mut [u8]),
        secondary: impl FnOnce(&mut [u8]),
    ) {
        let len = len.min(DATA_LEN_MAX);
        let count = if self.ports == Ports::Both { 2 } else { 1 };
        let Some(frames) = self.sent.get_mut(self.used..self.used + count) else { return };
        self.used += count;
        let channels = match self.ports {
            Ports::One | Ports::Both => [Channel::Primary, Channel::Secondary],
            Ports::Two => [Channel::Secondary, Channel::Primary],
        };
        for (frame, channel) in frames.iter_mut().zip(channels) {
            frame.telegram = TelegramType::new(channel, kind, number);
            frame.len = HEADER_LEN + len;
            frame.back = [false; 2];
            let header = Header { source: self.mac, telegram: frame.telegram, phase: self.phase };
            // The frame is longer than the header.
            let _ = header.emit(&mut frame.bytes);
        }
        let Some((first, rest)) = frames.split_first_mut() else { return };
        let data = &mut first.bytes[HEADER_LEN..HEADER_LEN + len];
        data.fill(0);
        fill(data);
        match rest.first_mut() {
            Some(copy) => {
                let bytes = &mut copy.bytes[HEADER_LEN..HEADER_LEN + len];
                bytes.copy_from_slice(data);
                secondary(bytes);
            }
            None if self.ports == Ports::Two => secondary(data),
            None => {}
        }
    }

    /// The data fields of the MDTs on the first port, by number, to be filled.
    pub fn mdts(&mut self) -> [Option<&mut [u8]>; TELEGRAMS_MAX] {
        let mut mdts = [const { None }; TELEGRAMS_MAX];
        let step = if self.ports == Ports::Both { 2 } else { 1 };
        for frame in self.sent[..self.used].iter_mut().step_by(step) {
            if frame.telegram.kind() == Kind::Mdt
                && let Some(mdt) = mdts.get_mut(usize::from(frame.telegram.number()))
            {
                *mdt = Some(&mut frame.bytes[HEADER_LEN..frame.len]);
            }
        }
        mdts
    }

    /// Gives the MDTs on the second port the data of those on the first.
    pub fn copy_mdts(&mut self) {
        if self.ports != Ports::Both {
            return;
        }
        for pair in self.sent[..self.used].chunks_exact_mut(2) {
            let (first, second) = pair.split_at_mut(1);
            if first[0].telegram.kind() == Kind::Mdt {
                second[0].bytes[HEADER_LEN..second[0].len]
                    .copy_from_slice(&first[0].bytes[HEADER_LEN..first[0].len]);
            }
        }
    }

    /// Changes an MDT of one channel, once it is complete; nothing where that channel or that MDT is not sent.
    pub fn edit_mdt(&mut self, channel: Channel, number: u8, edit: impl FnOnce(&mut [u8])) {
        let mdt = TelegramType::new(channel, Kind::Mdt, number);
        if let Some(frame) = self.sent[..self.used].iter_mut().find(|sent| sent.telegram == mdt) {
            edit(&mut frame.bytes[HEADER_LEN..frame.len]);
        }
    }

    /// The next frame to send, and the port to send it on.
    pub fn next_transmit(&mut self) -> Option<(Port, &[u8])> {
        if self.next >= self.used {
            return None;
        }
        self.next += 1;
        let frame = self.sent.get(self.next - 1)?;
        Some((port_of(frame.telegram.channel()), &frame.bytes[..frame.len]))
    }

    /// The frames of this cycle are not sent: whatever comes is refused.
    pub fn discard(&mut self) {
        self.out = false;
        self.next = self.used;
    }

    pub fn has_transmit(&self) -> bool {
        self.next < self.used
    }

    /// Takes a frame that came back on `port`. It comes back once on a port at which the topology `admits` it;
    /// everything about it but the slaves' data is as it was sent.
    // Flat: one line per reason to refuse, in the order in which they count.
    pub fn receive(
        &mut self,
        port: Port,
        frame: &[u8],
        admits: impl FnOnce(Route) -> bool,
    ) -> Result<Kind, Refusal> {
        let header = Header::parse_unchecked(frame).map_err(|_| Refusal::NotSercos)?;
        if Header::parse(frame).is_err() {
            return Err(Refusal::Crc);
        }
        if header.source != self.mac {
            return Err(Refusal::Foreign);
        }
        if !self.out {
            return Err(Refusal::Silence);
        }
        let route = Route { channel: header.telegram.channel(), port };
        if !self.ports.contains(port) || !self.ports.contains(port_of(route.channel)) || !admits(route) {
            return Err(Refusal::Port);
        }
        let sent = &mut self.sent[..self.used];
        let index = sent.iter().position(|sent| sent.telegram == header.telegram).ok_or(Refusal::Number)?;
        let sent = &mut sent[index];
        let (found, wanted) = (header.phase, self.phase);
        if found.phase() != wanted.phase() || found.switching() != wanted.switching() {
            return Err(Refusal::Phase);
        }
        if found.cycle_count() != wanted.cycle_count() {
            return Err(Refusal::CycleCount);
        }
        if frame.len() != sent.len {
            return Err(Refusal::Length);
        }
        if core::mem::replace(&mut sent.back[port.index()], true) {
            return Err(Refusal::Duplicate);
        }
        if header.telegram.kind() == Kind::At {
            let place = route.index() * TELEGRAMS_MAX + usize::from(header.telegram.number());
            if let Some(received) = self.received.get_mut(place) {
                received[..frame.len() - HEADER_LEN].copy_from_slice(&frame[HEADER_LEN..]);
                self.arrived[place] = frame.len() - HEADER_LEN;
            }
        }
        Ok(header.telegram.kind())
    }

    fn of(&self, kind: Kind, channel: Channel) -> impl Iterator<Item = &Sent> {
        let wanted = move |sent: &&Sent| sent.telegram.kind() == kind && sent.telegram.channel() == channel;
        self.sent[..self.used].iter().filter(wanted)
    }

    /// Frames of this kind that have not come back on this route.
    pub fn missing(&self, kind: Kind, route: Route) -> usize {
        self.of(kind, route.channel).filter(|sent| !sent.back[route.port.index()]).count()
    }

    /// Whether every frame of this kind has come back on this route.
    pub fn all_back(&self, kind: Kind, route: Route) -> bool {
        self.missing(kind, route) == 0
    }

    /// Whether an AT has come back on this route.
    pub fn came(&self, route: Route) -> bool {
        self.of(Kind::At, route.channel).any(|sent| sent.back[route.port.index()])
    }

    /// The data field of an AT that came back in this cycle.
    pub fn at(&self, route: Route, number: u8) -> Option<&[u8]> {
        let place = route.index() * TELEGRAMS_MAX + usize::from(number);
        let len = *self.arrived.get(place).filter(|&&len| len > 0)?;
        self.received.get(place).map(|received| &received[..len])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::header::Phase;
    use proptest::prelude::*;

    const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

    fn cycle() -> (Frames, Vec<Vec<u8>>) {
        let mut frames = Frames::new(MAC, Ports::One);
        frames.begin(PhaseField::new(false, 3, Phase::CP2));
        frames.add(Kind::Mdt, 0, 46, |data| data[0] = 7, |_| {});
        frames.add(Kind::At, 0, 48, |_| {}, |_| {});
        frames.add(Kind::At, 1, 40, |_| {}, |_| {});
        let mut out = Vec::new();
        while let Some((port, frame)) = frames.next_transmit() {
            assert_eq!(port, Port::One);
            out.push(frame.to_vec());
        }
        (frames, out)
    }

    #[test]
    fn frames_come_back_once() {
        let (mut frames, out) = cycle();
        assert_eq!(out.iter().map(Vec::len).collect::<Vec<_>>(), [66, 68, 60]);
        assert_eq!(out[0][20], 7);
        let mut at = out[1].clone();
        at[20 + 47] = 9;
        assert!(!frames.all_back(Kind::At, Route::PRIMARY_ONE));
        assert_eq!(frames.receive(Port::One, &at, |_| true), Ok(Kind::At));
        assert_eq!(frames.at(Route::PRIMARY_ONE, 0).map(|data| (data.len(), data[47])), Some((48, 9)));
        assert_eq!(frames.at(Route::PRIMARY_ONE, 1), None);
        assert_eq!(frames.receive(Port::One, &at, |_| true), Err(Refusal::Duplicate));
        assert_eq!(frames.receive(Port::One, &out[2], |_| true), Ok(Kind::At));
        assert!(
            frames.all_back(Kind::At, Route::PRIMARY_ONE) && !frames.all_back(Kind::Mdt, Route::PRIMARY_ONE)
        );
    }

    #[test]
    fn every_refusal() {
        let (mut frames, out) = cycle();
        let with = |edit: &dyn Fn(&mut Vec<u8>), fix_crc: bool| {
            let mut frame = out[1].clone();
            edit(&mut frame);
            if fix_crc {
                let crc = crc32fast::hash(&frame[..16]);
                frame[16..20].copy_from_slice(&crc.to_le_bytes());
            }
            frame
        };
        let cases: Vec<(Port, Vec<u8>, Refusal)> = vec![
            (Port::One, with(&|f| f[12] = 0, false), Refusal::NotSercos),
            (Port::One, out[1][..19].to_vec(), Refusal::NotSercos),
            (Port::One, with(&|f| f[16] ^= 1, false), Refusal::Crc),
            (Port::One, with(&|f| f[6] = 4, true), Refusal::Foreign),
            (Port::Two, out[1].clone(), Refusal::Port),
            (Port::One, with(&|f| f[14] |= 0x80, true), Refusal::Port),
            (Port::One, with(&|f| f[14] = 0x63, true), Refusal::Number),
            (Port::One, with(&|f| f[15] = 0x33, true), Refusal::Phase),
            (Port::One, with(&|f| f[15] |= 0x80, true), Refusal::Phase),
            (Port::One, with(&|f| f[15] = 0x22, true), Refusal::CycleCount),
            (Port::One, with(&|f| f.push(0), true), Refusal::Length),
            (Port::One, with(&|f| f.truncate(67), true), Refusal::Length),
        ];
        for (port, frame, reason) in cases {
            assert_eq!(frames.receive(port, &frame, |_| true), Err(reason));
            assert_eq!(frames.at(Route::PRIMARY_ONE, 0), None, "{reason}");
        }
        frames.silence();
        assert_eq!(frames.receive(Port::One, &out[1], |_| true), Err(Refusal::Silence));
        assert!(!frames.has_transmit());
    }

    #[test]
    fn both_ports_have_the_same_telegrams() {
        let mut frames = Frames::new(MAC, Ports::Both);
        frames.begin(PhaseField::new(false, 3, Phase::CP4));
        frames.add(Kind::Mdt, 0, 46, |data| data[..2].fill(7), |data| data[0] = 8);
        frames.add(Kind::At, 0, 48, |_| {}, |_| {});
        let mut out = Vec::new();
        while let Some((port, frame)) = frames.next_transmit() {
            out.push((port, frame.to_vec()));
        }
        let types: Vec<_> =
            out.iter().map(|(port, frame)| (*port, frame[14], frame[20], frame[21])).collect();
        let wanted = [
            (Port::One, 0x20, 7, 7),
            (Port::Two, 0xA0, 8, 7),
            (Port::One, 0x60, 0, 0),
            (Port::Two, 0xE0, 0, 0),
        ];
        assert_eq!(types, wanted);
        // The P telegram comes back on both ports where only the other way is interrupted.
        let mut first = out[2].1.clone();
        first[20] = 1;
        assert_eq!(frames.receive(Port::One, &first, |_| true), Ok(Kind::At));
        first[20] = 2;
        assert_eq!(frames.receive(Port::Two, &first, |_| true), Ok(Kind::At));
        assert_eq!(frames.receive(Port::Two, &first, |_| true), Err(Refusal::Duplicate));
        assert_eq!(frames.receive(Port::Two, &out[3].1, |route| route.port == Port::One), Err(Refusal::Port));
        let came = Route::ALL.map(|route| frames.at(route, 0).map(|data| data[0]));
        assert_eq!(came, [Some(1), None, Some(2), None]);
        assert_eq!(frames.missing(Kind::At, Route::SECONDARY_TWO), 1);
        assert!(
            frames.all_back(Kind::At, Route::PRIMARY_TWO) && !frames.all_back(Kind::Mdt, Route::PRIMARY_TWO)
        );
    }

    #[test]
    fn a_line_on_port_2_has_s_telegrams_only() {
        let mut frames = Frames::new(MAC, Ports::Two);
        frames.begin(PhaseField::new(false, 0, Phase::CP0));
        frames.add(Kind::At, 0, 40, |data| data[0] = 1, |data| data[1] = 0x80);
        let (port, frame) = frames.next_transmit().unwrap();
        assert_eq!((port, frame[14], frame[20], frame[21]), (Port::Two, 0xE0, 1, 0x80));
        let frame = frame.to_vec();
        assert!(frames.next_transmit().is_none());
        assert_eq!(frames.receive(Port::One, &frame, |_| true), Err(Refusal::Port));
        assert_eq!(frames.receive(Port::Two, &frame, |_| true), Ok(Kind::At));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..120)) {
            let (mut frames, _) = cycle();
            prop_assert!(frames.receive(Port::One, &bytes, |_| true).is_err());
        }
    }
}
