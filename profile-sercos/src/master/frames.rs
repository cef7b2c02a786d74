//! The frames of one cycle: built, sent one after the other, and taken back.

use super::event::{Port, Refusal};
use crate::wire::header::{
    Channel, DATA_LEN_MAX, FRAME_LEN_MAX, HEADER_LEN, Header, Kind, MacAddress, PhaseField, TELEGRAMS_MAX,
    TelegramType,
};

/// MDTs and ATs of one cycle.
const FRAMES_MAX: usize = 2 * TELEGRAMS_MAX;

#[derive(Debug)]
struct Sent {
    telegram: TelegramType,
    bytes: [u8; FRAME_LEN_MAX],
    len: usize,
    back: bool,
}

#[derive(Debug)]
pub(super) struct Frames {
    mac: MacAddress,
    phase: PhaseField,
    /// Whether the frames of a cycle are out.
    out: bool,
    sent: Vec<Sent>,
    used: usize,
    next: usize,
    /// Data fields of the ATs that have come back.
    received: Vec<[u8; DATA_LEN_MAX]>,
}

impl Frames {
    pub fn new(mac: MacAddress) -> Frames {
        let empty = || Sent { telegram: TelegramType(0), bytes: [0; FRAME_LEN_MAX], len: 0, back: false };
        Frames {
            mac,
            phase: PhaseField(0),
            out: false,
            sent: (0..FRAMES_MAX).map(|_| empty()).collect(),
            used: 0,
            next: 0,
            received: vec![[0; DATA_LEN_MAX]; TELEGRAMS_MAX],
        }
    }

    /// Starts a cycle.
    pub fn begin(&mut self, phase: PhaseField) {
        self.phase = phase;
        self.out = true;
        self.used = 0;
        self.next = 0;
    }

    /// No frames are out: whatever comes is refused.
    pub fn silence(&mut self) {
        self.out = false;
        self.used = 0;
        self.next = 0;
    }

    /// Adds a telegram with `len` bytes of data, at most 1494; `fill` gets them zeroed.
    pub fn add(&mut self, kind: Kind, number: u8, len: usize, fill: impl FnOnce(&mut [u8])) {
        let Some(frame) = self.sent.get_mut(self.used) else {
            return;
        };
        self.used += 1;
        let len = len.min(DATA_LEN_MAX);
        frame.telegram = TelegramType::new(Channel::Primary, kind, number);
        frame.len = HEADER_LEN + len;
        frame.back = false;
        let header = Header { source: self.mac, telegram: frame.telegram, phase: self.phase };
        let (head, data) = frame.bytes.split_at_mut(HEADER_LEN);
        // The head has exactly the header's length.
        let _ = header.emit(head);
        data[..len].fill(0);
        fill(&mut data[..len]);
    }

    /// The next frame to send.
    pub fn next_transmit(&mut self) -> Option<&[u8]> {
        if self.next >= self.used {
            return None;
        }
        self.next += 1;
        self.sent.get(self.next - 1).map(|frame| &frame.bytes[..frame.len])
    }

    pub fn has_transmit(&self) -> bool {
        self.next < self.used
    }

    /// Takes a frame that came back. Each frame comes back once, on the port it was sent from, as the line gives
    /// it back; everything about it but the slaves' data is as it was sent.
    pub fn receive(&mut self, port: Port, frame: &[u8]) -> Result<(), Refusal> {
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
        if port != Port::One || header.telegram.channel() != Channel::Primary {
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
        if sent.back {
            return Err(Refusal::Duplicate);
        }
        sent.back = true;
        if header.telegram.kind() == Kind::At {
            let number = usize::from(header.telegram.number());
            if let Some(received) = self.received.get_mut(number) {
                received[..frame.len() - HEADER_LEN].copy_from_slice(&frame[HEADER_LEN..]);
            }
        }
        Ok(())
    }

    /// Whether every frame of this kind has come back.
    pub fn all_back(&self, kind: Kind) -> bool {
        self.sent[..self.used].iter().all(|sent| sent.back || sent.telegram.kind() != kind)
    }

    /// The data field of an AT that came back in this cycle.
    pub fn at(&self, number: u8) -> Option<&[u8]> {
        let telegram = TelegramType::new(Channel::Primary, Kind::At, number);
        let sent = self.sent[..self.used].iter().find(|sent| sent.telegram == telegram && sent.back)?;
        self.received.get(usize::from(number)).map(|received| &received[..sent.len - HEADER_LEN])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::header::Phase;
    use proptest::prelude::*;

    const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

    fn cycle() -> (Frames, Vec<Vec<u8>>) {
        let mut frames = Frames::new(MAC);
        frames.begin(PhaseField::new(false, 3, Phase::CP2));
        frames.add(Kind::Mdt, 0, 46, |data| data[0] = 7);
        frames.add(Kind::At, 0, 48, |_| {});
        frames.add(Kind::At, 1, 40, |_| {});
        let mut out = Vec::new();
        while let Some(frame) = frames.next_transmit() {
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
        assert!(!frames.all_back(Kind::At));
        assert_eq!(frames.receive(Port::One, &at), Ok(()));
        assert_eq!(frames.at(0).map(|data| (data.len(), data[47])), Some((48, 9)));
        assert_eq!(frames.at(1), None);
        assert_eq!(frames.receive(Port::One, &at), Err(Refusal::Duplicate));
        assert_eq!(frames.receive(Port::One, &out[2]), Ok(()));
        assert!(frames.all_back(Kind::At) && !frames.all_back(Kind::Mdt));
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
            assert_eq!(frames.receive(port, &frame), Err(reason));
            assert_eq!(frames.at(0), None, "{reason}");
        }
        frames.silence();
        assert_eq!(frames.receive(Port::One, &out[1]), Err(Refusal::Silence));
        assert!(!frames.has_transmit());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..120)) {
            let (mut frames, _) = cycle();
            prop_assert!(frames.receive(Port::One, &bytes).is_err());
        }
    }
}
