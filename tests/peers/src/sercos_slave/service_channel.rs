//! The service channel: the handshake, the elements 0 to 7, lists in pieces of four bytes, busy and error codes.
//!
//! A write takes effect at its last step and not before: a list that is cut off leaves the old one as it was.
//! What the sheet leaves open is decided here. A read of element 1 is error 1009h. A step after the last bytes of an element
//! is error x003h. A close is taken with the write bit and without it: the foreign master of the recording sets it.
//! In CP1 each step is acknowledged, and only a close is no error.

use super::idn::Idn;

/// S-SVC: busy.
pub const BUSY: u16 = 2;
/// S-SVC: error.
pub const ERROR: u16 = 4;
/// S-SVC: the channel works.
pub const VALID: u16 = 8;

/// Who keeps the parameters.
pub trait Store {
    /// Opens a parameter. The answer is its data status.
    ///
    /// # Errors
    /// The error code of the service channel.
    fn open(&mut self, idn: Idn) -> Result<u16, u16>;

    /// Reads an element: 2 to 7. Lists and texts come without their head.
    ///
    /// # Errors
    /// The error code of the service channel.
    fn read(&mut self, idn: Idn, element: u8) -> Result<Element, u16>;

    /// Writes an element: 2 to 7. Lists and texts come without their head.
    ///
    /// # Errors
    /// The error code of the service channel.
    fn write(&mut self, idn: Idn, element: u8, data: &[u8]) -> Result<(), u16>;

    /// Is the element sent with a head of two lengths?
    fn is_list(&self, idn: Idn, element: u8) -> bool;

    /// Cycles in which a step on this parameter is still busy.
    fn busy_cycles(&self, idn: Idn) -> u32;
}

/// An element as it is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// Its bytes without a head.
    pub data: Vec<u8>,
    /// The longest it may become; only a list says so.
    pub capacity: u16,
    /// With a head.
    pub list: bool,
}

impl Element {
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.data.len() + 4);
        if self.list {
            let length = u16::try_from(self.data.len()).unwrap_or(u16::MAX);
            bytes.extend_from_slice(&length.to_le_bytes());
            bytes.extend_from_slice(&self.capacity.to_le_bytes());
        }
        bytes.extend_from_slice(&self.data);
        bytes
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Transfer {
    None,
    Reading { element: u8, bytes: Vec<u8>, at: usize },
    Writing { element: u8, bytes: Vec<u8> },
}

/// The state of one service channel.
#[derive(Debug, Clone)]
pub struct ServiceChannel {
    ahs: bool,
    open: Option<Idn>,
    transfer: Transfer,
    status: u16,
    info: [u8; 4],
    busy: u32,
    delay: u32,
    delayed: u32,
}

impl Default for ServiceChannel {
    fn default() -> Self {
        Self {
            ahs: false,
            open: None,
            transfer: Transfer::None,
            status: 0,
            info: [0; 4],
            busy: 0,
            delay: 0,
            delayed: 0,
        }
    }
}

impl ServiceChannel {
    /// A channel that acknowledges each step this many cycles late.
    #[must_use]
    pub fn new(delay: u32) -> Self {
        Self { delay, ..Self::default() }
    }

    /// Begins anew, as in CP0.
    pub fn reset(&mut self) {
        *self = Self::new(self.delay);
    }

    /// Closes what is open; the handshake bit stays. For a change of phase.
    pub fn close(&mut self) {
        self.open = None;
        self.transfer = Transfer::None;
        self.status = 0;
        self.info = [0; 4];
        self.busy = 0;
    }

    /// The handshake bit of the slave.
    #[must_use]
    pub fn ahs(&self) -> bool {
        self.ahs
    }

    /// What the AT carries: S-SVC and INFO.
    #[must_use]
    pub fn answer(&self) -> (u16, [u8; 4]) {
        if self.busy > 0 {
            return (VALID | BUSY | u16::from(self.ahs), [0; 4]);
        }
        (VALID | self.status | u16::from(self.ahs), self.info)
    }

    /// Takes C-SVC and INFO of one cycle. `stuck` keeps the handshake bit from following.
    pub fn cycle(&mut self, control: u16, info: [u8; 4], usable: bool, stuck: bool, store: &mut dyn Store) {
        if self.busy > 0 {
            self.busy -= 1;
            return;
        }
        let mhs = control & 1 == 1;
        if mhs == self.ahs || stuck {
            return;
        }
        if self.delayed < self.delay {
            self.delayed += 1;
            return;
        }
        self.delayed = 0;
        self.ahs = mhs;
        let result = self.step(control, info, usable, store);
        let told = result.as_ref().err().map(|code| u32::from(*code).to_le_bytes());
        self.status = if told.is_some() { ERROR } else { 0 };
        self.info = told.or(result.ok()).unwrap_or_default();
        if usable && control >> 3 & 7 != 0 {
            self.busy = self.open.map_or(0, |idn| store.busy_cycles(idn));
        }
    }

    fn step(
        &mut self,
        control: u16,
        info: [u8; 4],
        usable: bool,
        store: &mut dyn Store,
    ) -> Result<[u8; 4], u16> {
        let element = super::telegram::low_byte(control >> 3 & 7);
        let (write, end) = (control & 2 != 0, control & 4 != 0);
        if element == 0 {
            self.open = None;
            self.transfer = Transfer::None;
            return Ok([0; 4]);
        }
        if !usable {
            return Err(0x0001);
        }
        if element == 1 {
            self.open = None;
            self.transfer = Transfer::None;
            if !write {
                return Err(0x1009);
            }
            let idn = Idn(u32::from_le_bytes(info));
            let status = store.open(idn)?;
            self.open = Some(idn);
            return Ok(u32::from(status).to_le_bytes());
        }
        let idn = self.open.ok_or(0x0001u16)?;
        if write { self.write(idn, element, end, info, store) } else { self.read(idn, element, end, store) }
    }

    fn read(&mut self, idn: Idn, element: u8, end: bool, store: &mut dyn Store) -> Result<[u8; 4], u16> {
        let running = matches!(&self.transfer, Transfer::Reading { element: e, .. } if *e == element);
        if !running {
            self.transfer = Transfer::None;
            let bytes = store.read(idn, element)?.bytes();
            self.transfer = Transfer::Reading { element, bytes, at: 0 };
        }
        let Transfer::Reading { bytes, at, .. } = &mut self.transfer else { return Err(0x7008) };
        if *at > 0 && *at >= bytes.len() {
            self.transfer = Transfer::None;
            return Err(code(element, 3));
        }
        let mut out = [0; 4];
        for (to, from) in out.iter_mut().zip(bytes.iter().skip(*at)) {
            *to = *from;
        }
        *at += 4;
        if end {
            self.transfer = Transfer::None;
        }
        Ok(out)
    }

    fn write(
        &mut self,
        idn: Idn,
        element: u8,
        end: bool,
        info: [u8; 4],
        store: &mut dyn Store,
    ) -> Result<[u8; 4], u16> {
        let mut bytes = match std::mem::replace(&mut self.transfer, Transfer::None) {
            Transfer::Writing { element: e, bytes } if e == element => bytes,
            _ => Vec::new(),
        };
        if bytes.len() > 70_000 {
            return Err(code(element, 3));
        }
        bytes.extend_from_slice(&info);
        if !end {
            self.transfer = Transfer::Writing { element, bytes };
            return Ok([0; 4]);
        }
        if store.is_list(idn, element) {
            let length = super::telegram::get_u16(&bytes, 0).map_or(0, usize::from);
            let sent = bytes.len() - 4;
            if length > sent {
                return Err(code(element, 2));
            }
            if sent - length > 3 {
                return Err(code(element, 3));
            }
            store.write(idn, element, bytes.get(4..4 + length).unwrap_or(&[]))?;
        } else {
            store.write(idn, element, &bytes)?;
        }
        Ok([0; 4])
    }
}

/// The error code of an element: its number in the first digit.
#[must_use]
pub fn code(element: u8, low: u16) -> u16 {
    u16::from(element & 7) << 12 | low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Memory {
        list: Vec<u8>,
        value: [u8; 2],
        busy: u32,
        writes: u32,
    }

    impl Store for Memory {
        fn open(&mut self, idn: Idn) -> Result<u16, u16> {
            if idn.block() < 3 { Ok(0x0100) } else { Err(0x1001) }
        }
        fn read(&mut self, idn: Idn, element: u8) -> Result<Element, u16> {
            match (idn.0, element) {
                (1, 7) => Ok(Element { data: self.list.clone(), capacity: 64, list: true }),
                (2, 7) => Ok(Element { data: self.value.to_vec(), capacity: 0, list: false }),
                (_, 2) => Ok(Element { data: vec![], capacity: 0, list: true }),
                _ => Err(code(element, 1)),
            }
        }
        fn write(&mut self, idn: Idn, element: u8, data: &[u8]) -> Result<(), u16> {
            self.writes += 1;
            match (idn.0, element) {
                (1, 7) => self.list = data.to_vec(),
                (2, 7) => self.value = data.get(..2).unwrap_or(&[]).try_into().map_err(|_| 0x7002u16)?,
                _ => return Err(code(element, 4)),
            }
            Ok(())
        }
        fn is_list(&self, idn: Idn, element: u8) -> bool {
            idn.0 == 1 && element == 7 || element == 2
        }
        fn busy_cycles(&self, _: Idn) -> u32 {
            self.busy
        }
    }

    fn go(channel: &mut ServiceChannel, store: &mut Memory, control: u16, info: u32) -> (u16, u32) {
        channel.cycle(control, info.to_le_bytes(), true, false, store);
        let (status, info) = channel.answer();
        (status, u32::from_le_bytes(info))
    }

    #[test]
    fn the_recorded_steps_of_a_list_get_their_answers() {
        let mut store = Memory { list: vec![1, 2, 1, 3, 1, 10], ..Memory::default() };
        let mut c = ServiceChannel::default();
        assert_eq!(go(&mut c, &mut store, 0x01, 0), (0x09, 0));
        assert_eq!(go(&mut c, &mut store, 0x0E, 1), (0x08, 0x0100));
        assert_eq!(go(&mut c, &mut store, 0x39, 1), (0x09, 0x0040_0006));
        assert_eq!(go(&mut c, &mut store, 0x38, 1), (0x08, 0x0301_0201));
        assert_eq!(go(&mut c, &mut store, 0x3D, 1), (0x09, 0x0A01));
        assert_eq!(go(&mut c, &mut store, 0x06, 1), (0x08, 0));
    }

    #[test]
    fn a_list_is_written_at_its_last_step_only() {
        let mut store = Memory { list: vec![9], ..Memory::default() };
        let mut c = ServiceChannel::default();
        assert_eq!(go(&mut c, &mut store, 0x0F, 1), (0x09, 0x0100));
        assert_eq!(go(&mut c, &mut store, 0x3A, 0x0040_0006), (0x08, 0));
        assert_eq!(go(&mut c, &mut store, 0x3B, 0x0301_0201), (0x09, 0));
        assert_eq!(store.list, [9]);
        assert_eq!(go(&mut c, &mut store, 0x3E, 0x0A01), (0x08, 0));
        assert_eq!(store.list, [1, 2, 1, 3, 1, 10]);
        assert_eq!(store.writes, 1);
    }

    #[test]
    fn lists_of_the_wrong_length_are_refused() {
        let mut store = Memory::default();
        let mut c = ServiceChannel::default();
        go(&mut c, &mut store, 0x0F, 1);
        go(&mut c, &mut store, 0x3A, 9);
        assert_eq!(go(&mut c, &mut store, 0x3F, 0), (0x0D, 0x7002));
        go(&mut c, &mut store, 0x3A, 4);
        go(&mut c, &mut store, 0x3B, 0);
        assert_eq!(go(&mut c, &mut store, 0x3E, 0), (0x0C, 0x7003));
        assert_eq!(store.writes, 0);
    }

    #[test]
    fn errors_are_told_and_cleared_by_the_next_step() {
        let mut store = Memory::default();
        let mut c = ServiceChannel::default();
        assert_eq!(go(&mut c, &mut store, 0x3D, 0), (0x0D, 0x0001));
        assert_eq!(go(&mut c, &mut store, 0x0E, 77), (0x0C, 0x1001));
        assert_eq!(go(&mut c, &mut store, 0x0D, 1), (0x0D, 0x1009));
        assert_eq!(go(&mut c, &mut store, 0x0E, 2), (0x08, 0x0100));
        assert_eq!(go(&mut c, &mut store, 0x25, 0), (0x0D, 0x4001));
        assert_eq!(go(&mut c, &mut store, 0x1E, 0), (0x0C, 0x3004));
        assert_eq!(go(&mut c, &mut store, 0x3F, 0xABCD_1234), (0x09, 0));
        assert_eq!(store.value, [0x34, 0x12]);
    }

    #[test]
    fn reading_past_the_end_is_an_error() {
        let mut store = Memory::default();
        let mut c = ServiceChannel::default();
        go(&mut c, &mut store, 0x0F, 2);
        assert_eq!(go(&mut c, &mut store, 0x10, 0), (0x08, 0));
        assert_eq!(go(&mut c, &mut store, 0x11, 0), (0x0D, 0x2003));
        assert_eq!(go(&mut c, &mut store, 0x38, 0), (0x08, 0));
        assert_eq!(go(&mut c, &mut store, 0x39, 0), (0x0D, 0x7003));
    }

    #[test]
    fn busy_holds_the_answer_back() {
        let mut store = Memory { busy: 2, ..Memory::default() };
        let mut c = ServiceChannel::default();
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x0B, 0));
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x0B, 0));
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x09, 0x0100));
    }

    #[test]
    fn a_late_and_a_stuck_handshake() {
        let mut store = Memory::default();
        let mut c = ServiceChannel::new(2);
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x08, 0));
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x08, 0));
        assert_eq!(go(&mut c, &mut store, 0x0F, 2), (0x09, 0x0100));
        let mut c = ServiceChannel::default();
        for _ in 0..9 {
            c.cycle(0x0F, [2, 0, 0, 0], true, true, &mut store);
        }
        assert_eq!(c.answer(), (8, [0; 4]));
    }

    #[test]
    fn in_cp1_only_the_handshake_works() {
        let mut store = Memory::default();
        let mut c = ServiceChannel::default();
        c.cycle(0x0001, [0; 4], false, false, &mut store);
        assert_eq!(c.answer(), (0x09, [0; 4]));
        c.cycle(0x000E, [1, 0, 0, 0], false, false, &mut store);
        assert_eq!(c.answer(), (0x0C, [1, 0, 0, 0]));
    }
}
