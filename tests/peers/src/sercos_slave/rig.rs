//! A small master for the tests: it knows the layout it has chosen and nothing of the slaves' insides.

use super::telegram::{build, get_u16, get_u32, put};
use super::{Idn, SercosSlave, Settings};

/// Bytes before the data field.
const H: usize = 20;

/// What the master has for one slave.
#[derive(Debug, Clone, Default)]
pub struct Station {
    pub mhs: bool,
    pub control: u16,
    pub info: u32,
    pub c_dev: u16,
    /// C-CON and the values of the consumer connection.
    pub c_con: u16,
    pub command: Vec<u8>,
}

/// A line or ring of slaves and the master's side of it.
pub struct Rig {
    pub slaves: Vec<SercosSlave>,
    pub stations: Vec<Station>,
    pub now: u64,
    pub cycle_ns: u64,
    pub phase: u8,
    pub cps: bool,
    pub count: u8,
    pub version: u32,
    /// The ATs of the last cycle as they came back; empty when one did not.
    pub ats: Vec<Vec<u8>>,
    /// The S telegrams as well, from the other end.
    pub ring: bool,
    pub secondary: Vec<Vec<u8>>,
    /// Send no MDT0 in this cycle.
    pub drop_mdt: bool,
    /// C-CON stays as it is.
    pub freeze: bool,
}

impl Rig {
    pub fn new(settings: Vec<Settings>) -> Self {
        let count = settings.len();
        let mut slaves = Vec::new();
        for (i, mut s) in settings.into_iter().enumerate() {
            s.neighbour = [true, i + 1 < count];
            slaves.push(SercosSlave::new(s));
        }
        Self {
            slaves,
            stations: vec![Station { c_dev: 0x0100, command: vec![0; 6], ..Station::default() }; count],
            now: 0,
            cycle_ns: 1_000_000,
            phase: 0,
            cps: false,
            count: 0,
            version: 1,
            ats: vec![Vec::new(); 4],
            ring: false,
            secondary: vec![Vec::new(); 4],
            drop_mdt: false,
            freeze: false,
        }
    }

    pub fn one(settings: Settings) -> Self {
        Self::new(vec![settings])
    }

    /// Sends a frame in at the first slave (or at the last, port 2) and follows it until it leaves the line.
    pub fn send(&mut self, mut frame: Vec<u8>, from_end: bool) -> Option<(Vec<u8>, bool)> {
        let last = self.slaves.len() - 1;
        let (mut at, mut port) = if from_end { (last, 2) } else { (0, 1) };
        for _ in 0..100 {
            let out = self.slaves[at].pass(self.now, port, &mut frame)?;
            match out {
                1 if at == 0 => return Some((frame, false)),
                1 => (at, port) = (at - 1, 2),
                _ if at == last => return Some((frame, true)),
                _ => (at, port) = (at + 1, 1),
            }
        }
        panic!("a frame goes round and round");
    }

    fn telegram(&self, type_byte: u8, data: &[u8]) -> Vec<u8> {
        let count = if self.phase == 0 { 0 } else { self.count };
        let byte = u8::from(self.cps) << 7 | count << 4 | self.target();
        build([0x02, 0, 0, 0, 0, 9], type_byte, byte, data)
    }

    /// With CPS the phase field has the new phase.
    fn target(&self) -> u8 {
        if self.cps { self.phase_after() } else { self.phase }
    }

    fn phase_after(&self) -> u8 {
        if self.phase >= 4 { 0 } else { self.phase + 1 }
    }

    /// The layout of CP3 and CP4: SVC, C-DEV and a connection of 8 bytes for each in MDT0; SVC, S-DEV and 12 bytes in AT0.
    pub fn mdt_length(&self) -> usize {
        (14 + 16 * self.slaves.len()).max(40)
    }

    pub fn at_length(&self) -> usize {
        (8 + 20 * self.slaves.len()).max(40)
    }

    pub fn offsets(&self, i: usize) -> [usize; 6] {
        let n = self.slaves.len();
        [14 + 6 * i, 14 + 6 * n + 2 * i, 14 + 8 * n + 8 * i, 8 + 6 * i, 8 + 6 * n + 2 * i, 8 + 8 * n + 12 * i]
    }

    fn mdt(&self, number: u8) -> Vec<u8> {
        let mut data = match self.phase {
            0 => vec![0; 40],
            1 | 2 => vec![0; 1280],
            _ => vec![0; self.mdt_length()],
        };
        if self.phase == 0 {
            put(&mut data, 0, &self.version.to_le_bytes());
            return data;
        }
        for (i, s) in self.stations.iter().enumerate() {
            let slot = i + 1;
            let [svc, dev, con, ..] = self.offsets(i);
            let (svc, dev) = if self.phase < 3 { (6 * slot, 768 + 4 * slot) } else { (svc, dev) };
            if number == 0 {
                put(&mut data, svc, &(s.control | u16::from(s.mhs)).to_le_bytes());
                put(&mut data, svc + 2, &s.info.to_le_bytes());
                put(&mut data, dev, &s.c_dev.to_le_bytes());
                if self.phase >= 3 {
                    put(&mut data, con, &s.c_con.to_le_bytes());
                    put(&mut data, con + 2, &s.command);
                }
            }
        }
        data
    }

    /// One cycle: the telegrams, then the time.
    pub fn cycle(&mut self) {
        let telegrams: u8 = if matches!(self.phase, 1 | 2) { 2 } else { 1 };
        if self.phase == 4 && !self.freeze {
            for s in &mut self.stations {
                s.c_con = (s.c_con >> 12).wrapping_add(1) << 12 | 1 | (s.c_con ^ 2) & 2;
            }
        }
        for at in [false, true] {
            for number in 0..telegrams {
                for secondary in [false, true] {
                    if secondary && !self.ring || !at && self.drop_mdt {
                        continue;
                    }
                    let base = if at { 0x60 } else { 0x20 } | if secondary { 0x80 } else { 0 };
                    let data = if at { self.empty_at(secondary) } else { self.mdt(number) };
                    let frame = self.telegram(base | number, &data);
                    let back = self.send(frame, secondary).map(|(frame, _)| frame).unwrap_or_default();
                    if at {
                        let to = if secondary { &mut self.secondary } else { &mut self.ats };
                        to[usize::from(number)] = back;
                    }
                }
            }
        }
        self.count = (self.count + 1) & 7;
        self.wait(self.cycle_ns);
    }

    fn empty_at(&self, secondary: bool) -> Vec<u8> {
        match self.phase {
            0 => {
                let mut data = vec![0xFF; 1024];
                data[0..2].copy_from_slice(&[1, if secondary { 0x80 } else { 0 }]);
                data
            }
            1 | 2 => vec![0; 1280],
            _ => vec![0; self.at_length()],
        }
    }

    pub fn cycles(&mut self, n: usize) {
        for _ in 0..n {
            self.cycle();
        }
    }

    pub fn wait(&mut self, ns: u64) {
        let end = self.now + ns;
        while self.now < end {
            self.now = (self.now + 1_000_000).min(end);
            for slave in &mut self.slaves {
                slave.tick(self.now);
            }
        }
    }

    /// CPS, the pause, and the next phase.
    pub fn switch(&mut self) {
        self.cps = true;
        self.cycles(3);
        let next = self.phase_after();
        self.cps = false;
        if next != 4 {
            self.wait(120_000_000);
        }
        self.phase = next;
        self.cycles(3);
    }

    pub fn s_svc(&self, i: usize) -> (u16, u32) {
        let svc = if self.phase < 3 { 6 * (i + 1) } else { self.offsets(i)[3] };
        let at = &self.ats[0];
        (get_u16(at, H + svc).unwrap_or(0), get_u32(at, H + svc + 2).unwrap_or(0))
    }

    pub fn s_dev(&self, i: usize) -> u16 {
        let dev = if self.phase < 3 { 768 + 4 * (i + 1) } else { self.offsets(i)[4] };
        get_u16(&self.ats[0], H + dev).unwrap_or(0)
    }

    /// The bytes of the producer connection: C-CON, then three values.
    pub fn produced(&self, i: usize) -> Vec<u8> {
        let from = H + self.offsets(i)[5];
        self.ats[0].get(from..from + 12).unwrap_or(&[]).to_vec()
    }

    /// One step of the service channel: INFO, or the error code.
    pub fn step(&mut self, i: usize, control: u16, info: u32) -> Result<u32, u16> {
        let s = &mut self.stations[i];
        (s.mhs, s.control, s.info) = (!s.mhs, control, info);
        for _ in 0..50 {
            self.cycle();
            let (status, info) = self.s_svc(i);
            if status & 8 != 0 && status & 1 == u16::from(self.stations[i].mhs) && status & 2 == 0 {
                let [low, high, ..] = info.to_le_bytes();
                return if status & 4 == 0 { Ok(info) } else { Err(u16::from_le_bytes([low, high])) };
            }
        }
        Err(0)
    }

    pub fn open(&mut self, i: usize, idn: Idn) -> Result<u32, u16> {
        self.step(i, 0x0E, idn.0)
    }

    /// Reads an element of at most four bytes.
    pub fn read(&mut self, i: usize, idn: Idn, element: u16) -> Result<u32, u16> {
        self.open(i, idn)?;
        self.step(i, element << 3 | 4, 0)
    }

    /// Reads a list or text.
    pub fn read_list(&mut self, i: usize, idn: Idn, element: u16) -> Result<Vec<u8>, u16> {
        self.open(i, idn)?;
        let head = self.step(i, element << 3, 0)?;
        let length = usize::try_from(head & 0xFFFF).unwrap_or(0);
        let mut bytes = Vec::new();
        while bytes.len() < length {
            let end = u16::from(bytes.len() + 4 >= length) << 2;
            let info = self.step(i, element << 3 | end, 0)?;
            bytes.extend_from_slice(&info.to_le_bytes());
        }
        bytes.truncate(length);
        Ok(bytes)
    }

    pub fn write(&mut self, i: usize, idn: Idn, value: u32) -> Result<(), u16> {
        self.open(i, idn)?;
        self.step(i, 0x3E, value).map(|_| ())
    }

    pub fn write_list(&mut self, i: usize, idn: Idn, data: &[u8]) -> Result<(), u16> {
        self.open(i, idn)?;
        let length = u32::try_from(data.len()).unwrap_or(0);
        let only = u16::from(data.is_empty()) << 2;
        self.step(i, 0x3A | only, length << 16 | length)?;
        let mut rest = data.chunks(4).peekable();
        while let Some(chunk) = rest.next() {
            let mut four = [0; 4];
            four[..chunk.len()].copy_from_slice(chunk);
            let end = u16::from(rest.peek().is_none()) << 2;
            self.step(i, 0x3A | end, u32::from_le_bytes(four))?;
        }
        Ok(())
    }

    /// Sets a command, waits for its end and cancels it. The answer is the status it ended with.
    pub fn command(&mut self, i: usize, idn: Idn) -> Result<u32, u16> {
        self.write(i, idn, 3)?;
        let mut status = 7;
        for _ in 0..2000 {
            status = self.open(i, idn)?;
            if status != 7 {
                break;
            }
        }
        self.write(i, idn, 0)?;
        Ok(status)
    }

    /// NRT to CP2 with the handshake of CP1.
    pub fn up_to_cp2(&mut self) {
        self.cycles(5);
        self.switch();
        for s in &mut self.stations {
            (s.mhs, s.control) = (true, 0);
        }
        self.cycles(3);
        self.switch();
    }

    /// What a master writes in CP2, for a MDT {134, 36} and an AT {135, 51, 40}.
    pub fn configure(&mut self, i: usize, variable: bool, producer_first: bool) {
        let s = Idn::s;
        let (consumer, producer) = if producer_first { (1, 0) } else { (0, 1) };
        let c = |element| Idn::se(1050, consumer, element);
        let p = |element| Idn::se(1050, producer, element);
        let [svc, dev, con, at_svc, at_dev, at_con] = self.offsets(i).map(|o| u32::try_from(o).unwrap());
        self.write(i, c(1), 0x8000).unwrap();
        self.write(i, p(1), 0xC000).unwrap();
        if variable {
            let list = |idns: &[u32]| idns.iter().flat_map(|n| s(*n).0.to_le_bytes()).collect::<Vec<u8>>();
            self.write_list(i, c(6), &list(&[134, 36])).unwrap();
            self.write_list(i, p(6), &list(&[135, 51, 40])).unwrap();
        }
        let cycle = u32::try_from(self.cycle_ns).unwrap();
        for (idn, value) in [
            (s(1002), cycle),
            (s(1009), dev),
            (s(1011), at_dev),
            (s(1013), svc),
            (s(1014), at_svc),
            (s(1003), 3),
            (c(3), 0x0800 | con),
            (p(3), at_con),
            (s(1006), 31_020),
            (c(10), cycle),
            (p(10), cycle),
            (c(11), 2),
        ] {
            self.write(i, idn, value).unwrap_or_else(|code| panic!("{idn}: {code:x}"));
        }
        for (block, length) in [(1010, self.mdt_length()), (1012, self.at_length())] {
            let mut bytes = [0u8; 8];
            bytes[..2].copy_from_slice(&u16::try_from(length).unwrap().to_le_bytes());
            self.write_list(i, s(block), &bytes).unwrap();
        }
    }

    /// All the way to CP4.
    pub fn up_to_cp4(&mut self, variable: bool) {
        self.up_to_cp2();
        for i in 0..self.slaves.len() {
            self.configure(i, variable, false);
            assert_eq!(self.command(i, Idn::s(127)), Ok(3));
        }
        self.switch();
        for i in 0..self.slaves.len() {
            assert_eq!(self.command(i, Idn::s(128)), Ok(3));
        }
        self.switch();
    }

    /// Puts a control word and a velocity command into the connection.
    pub fn drive(&mut self, i: usize, control: u16, value: i32) {
        self.stations[i].command = [control.to_le_bytes().to_vec(), value.to_le_bytes().to_vec()].concat();
    }
}
