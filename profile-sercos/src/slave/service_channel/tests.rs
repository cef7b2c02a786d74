use super::super::parameter::Definition;
use super::*;

const FIXED: Idn = Idn::standard(100);
const LIST: Idn = Idn::standard(101);
const COMMAND: Idn = Idn::standard(102);
const SLOW: Idn = Idn::standard(103);
const WIDE: Idn = Idn::standard(104);
const READ_ONLY: Idn = Idn::standard(105);

struct Bench {
    store: Store,
    phase: Phase,
    refuse: Option<SvcError>,
    controls: Vec<u16>,
    refreshed: u32,
}

impl Host for Bench {
    fn store(&mut self) -> &mut Store {
        &mut self.store
    }

    fn phase(&self) -> Phase {
        self.phase
    }

    fn refresh(&mut self, _: Handle) {
        self.refreshed += 1;
    }

    fn write(&mut self, handle: Handle, data: &[u8]) -> Result<(), SvcError> {
        match self.refuse {
            Some(code) => Err(code),
            None => {
                self.store.set_data(handle, data);
                Ok(())
            }
        }
    }

    fn control(&mut self, _: Handle, word: u16) -> Result<(), SvcError> {
        self.controls.push(word);
        Ok(())
    }
}

struct Pair {
    server: Server,
    host: Bench,
    mhs: bool,
}

impl Pair {
    fn new() -> Self {
        let mut store = Store::new();
        let value = Definition::value;
        store.define(value(FIXED, 0x4022_0001, "Fixed", -2).unit("mm").range(-10, 10));
        store.define(Definition::list(LIST, 0x6015_0001, "List", &[1, 0, 2, 0, 3, 0], 10));
        store.define(Definition::command(COMMAND, 0x0009_0001, "Command"));
        store.define(value(SLOW, 0x0011_0001, "Slow", 7).busy(2));
        store.define(value(WIDE, 0x0023_0001, "Wide", 0x0102_0304_0506_0708));
        store.define(value(READ_ONLY, 0x7011_0001, "Read only", 1).invalid());
        let mut server = Server::new(&store);
        server.set_valid();
        let host = Bench { store, phase: Phase::CP2, refuse: None, controls: Vec::new(), refreshed: 0 };
        Pair { server, host, mhs: false }
    }

    /// One step, waiting out busy. Gives INFO or the error code.
    fn step(&mut self, element: Element, write: bool, last: bool, info: u32) -> Result<u32, SvcError> {
        self.mhs = !self.mhs;
        let slot = MdtSvc { control: SvcControl::new(self.mhs, element, write, last), info };
        loop {
            self.server.handle(slot, &mut self.host);
            let answer = self.server.answer();
            assert!(answer.status.contains(SvcStatus::VALID));
            assert_eq!(answer.status.contains(SvcStatus::AHS), self.mhs);
            if answer.status.contains(SvcStatus::BUSY) {
                continue;
            }
            return match answer.status.contains(SvcStatus::ERROR) {
                true => Err(SvcError(answer.info_word())),
                false => Ok(answer.info),
            };
        }
    }

    fn open(&mut self, idn: Idn) -> Result<u32, SvcError> {
        self.step(Element::Idn, true, true, idn.0)
    }

    fn read(&mut self, element: Element, last: bool) -> Result<u32, SvcError> {
        self.step(element, false, last, 0)
    }

    fn write(&mut self, last: bool, info: u32) -> Result<u32, SvcError> {
        self.step(Element::Data, true, last, info)
    }
}

#[test]
fn elements_of_a_value() {
    let mut pair = Pair::new();
    assert_eq!(pair.open(FIXED), Ok(0));
    assert_eq!(pair.read(Element::Name, false), Ok(0x0005_0005));
    assert_eq!(pair.read(Element::Name, false), Ok(u32::from_le_bytes(*b"Fixe")));
    assert_eq!(pair.read(Element::Name, true), Ok(u32::from_le_bytes(*b"d\0\0\0")));
    assert_eq!(pair.read(Element::Attribute, true), Ok(0x4022_0001));
    assert_eq!(pair.read(Element::Unit, false), Ok(0x0002_0002));
    assert_eq!(pair.read(Element::Unit, true), Ok(u32::from_le_bytes(*b"mm\0\0")));
    assert_eq!(pair.read(Element::Minimum, true), Ok(0xFFFF_FFF6));
    assert_eq!(pair.read(Element::Maximum, true), Ok(10));
    assert_eq!(pair.read(Element::Data, true), Ok(0xFFFF_FFFE));
    assert_eq!(pair.host.refreshed, 1);
    assert_eq!(pair.write(true, 5), Ok(0));
    assert_eq!(pair.read(Element::Data, true), Ok(5));
    assert_eq!(pair.step(Element::Close, true, true, 0), Ok(0));
    assert_eq!(pair.read(Element::Data, true), Err(SvcError::NOT_OPEN));
}

#[test]
fn errors_have_their_codes() {
    let mut pair = Pair::new();
    assert_eq!(pair.read(Element::Name, true), Err(SvcError::NOT_OPEN));
    assert_eq!(pair.open(Idn::standard(1)), Err(SvcError::NO_IDN));
    assert_eq!(pair.read(Element::Attribute, true), Err(SvcError::NOT_OPEN));
    assert_eq!(pair.step(Element::Close, true, false, 0), Err(SvcError::CLOSE_ACCESS));
    assert_eq!(pair.read(Element::Idn, true), Err(SvcError::IDN_ACCESS));
    assert_eq!(pair.step(Element::Idn, true, false, FIXED.0), Err(SvcError::IDN_ACCESS));
    pair.open(FIXED).unwrap();
    assert_eq!(pair.write(true, 11), Err(SvcError::ABOVE_MAXIMUM));
    assert_eq!(pair.write(true, 0xFFFF_FFF5), Err(SvcError::BELOW_MINIMUM));
    assert_eq!(pair.write(false, 1), Err(SvcError::DATA_LONG));
    assert_eq!(pair.step(Element::Name, true, true, 0), Err(SvcError::NAME_READ_ONLY));
    assert_eq!(pair.step(Element::Attribute, true, true, 0), Err(SvcError::ATTRIBUTE_READ_ONLY));
    assert_eq!(pair.step(Element::Maximum, true, true, 0), Err(SvcError::MAXIMUM_READ_ONLY));
    assert_eq!(pair.read(Element::Data, false), Err(SvcError(0x7003)));
    assert_eq!(pair.read(Element::Name, true), Err(SvcError::NAME_SHORT));
    pair.host.phase = Phase::CP4;
    assert_eq!(pair.write(true, 1), Err(SvcError::DATA_PROTECTED));
    pair.host.phase = Phase::CP3;
    pair.host.refuse = Some(SvcError::OTHER_SETTINGS);
    assert_eq!(pair.write(true, 1), Err(SvcError::OTHER_SETTINGS));
    assert_eq!(pair.open(READ_ONLY), Ok(0x0100), "data status: invalid");
    assert_eq!(pair.write(true, 1), Err(SvcError::DATA_READ_ONLY));
    assert_eq!(pair.read(Element::Unit, true), Err(SvcError::NO_UNIT));
    assert_eq!(pair.read(Element::Minimum, true), Err(SvcError::NO_MINIMUM));
    assert_eq!(pair.read(Element::Maximum, true), Err(SvcError::NO_MAXIMUM));
}

/// The shape of recording sercos3_startup_line2, frames 2209 to 2359 (S-0-1000): the head alone, close, then
/// head and data.
#[test]
fn lists_are_read_with_their_head() {
    let mut pair = Pair::new();
    pair.open(LIST).unwrap();
    assert_eq!(pair.read(Element::Data, false), Ok(0x000A_0006));
    assert_eq!(pair.step(Element::Close, true, true, 0), Ok(0));
    pair.open(LIST).unwrap();
    assert_eq!(pair.read(Element::Data, false), Ok(0x000A_0006));
    assert_eq!(pair.read(Element::Data, false), Ok(0x0002_0001));
    assert_eq!(pair.read(Element::Data, true), Ok(0x0000_0003));
    // From the beginning again, and the end bit too early and too late.
    assert_eq!(pair.read(Element::Data, false), Ok(0x000A_0006));
    assert_eq!(pair.read(Element::Data, true), Err(SvcError::DATA_SHORT));
    assert_eq!(pair.read(Element::Data, false), Ok(0x000A_0006));
    assert_eq!(pair.read(Element::Data, false), Ok(0x0002_0001));
    assert_eq!(pair.read(Element::Data, false), Err(SvcError::DATA_LONG));
}

#[test]
fn lists_are_written_at_once_when_they_are_complete() {
    let mut pair = Pair::new();
    let data = |pair: &Pair| {
        let handle = pair.host.store.find(LIST).unwrap();
        pair.host.store.get(handle).data().to_vec()
    };
    pair.open(LIST).unwrap();
    assert_eq!(pair.write(false, 0x0080_0008), Ok(0));
    assert_eq!(pair.write(false, 0x0005_0004), Ok(0));
    assert_eq!(data(&pair), [1, 0, 2, 0, 3, 0]);
    assert_eq!(pair.write(true, 0x0007_0006), Ok(0));
    assert_eq!(data(&pair), [4, 0, 5, 0, 6, 0, 7, 0]);
    assert_eq!(pair.write(false, 0x0080_000C), Err(SvcError::DATA_LONG), "beyond the capacity");
    assert_eq!(pair.write(false, 0x0080_0006), Ok(0));
    assert_eq!(pair.write(true, 1), Err(SvcError::DATA_SHORT));
    assert_eq!(pair.write(false, 0x0080_0002), Ok(0));
    assert_eq!(pair.write(false, 9), Err(SvcError::DATA_LONG), "end bit missing");
    assert_eq!(pair.write(false, 0x0080_0003), Ok(0));
    assert_eq!(pair.write(true, 9), Err(SvcError::INVALID_DATA), "half an item");
    assert_eq!(data(&pair), [4, 0, 5, 0, 6, 0, 7, 0]);
    assert_eq!(pair.write(false, 0x0080_0002), Ok(0));
    assert_eq!(pair.write(true, 0xFFFF_0009), Ok(0));
    assert_eq!(data(&pair), [9, 0]);
    assert_eq!(pair.write(true, 0x0080_0000), Ok(0), "an empty list has no part but its head");
    assert_eq!(data(&pair), [0u8; 0]);
    assert_eq!(pair.read(Element::Data, true), Ok(0x000A_0000));
}

#[test]
fn eight_bytes_take_two_steps() {
    let mut pair = Pair::new();
    pair.open(WIDE).unwrap();
    assert_eq!(pair.read(Element::Data, false), Ok(0x0506_0708));
    assert_eq!(pair.read(Element::Data, true), Ok(0x0102_0304));
    assert_eq!(pair.write(false, 1), Ok(0));
    assert_eq!(pair.write(true, 2), Ok(0));
    assert_eq!(pair.read(Element::Data, false), Ok(1));
    assert_eq!(pair.read(Element::Data, true), Ok(2));
    assert_eq!(pair.write(true, 1), Err(SvcError::DATA_SHORT));
}

#[test]
fn a_slow_parameter_is_busy_and_then_answers() {
    let mut pair = Pair::new();
    pair.open(SLOW).unwrap();
    let control = SvcControl::new(!pair.mhs, Element::Data, false, true);
    let mut states = Vec::new();
    for _ in 0..4 {
        pair.server.handle(MdtSvc { control, info: 0 }, &mut pair.host);
        let answer = pair.server.answer();
        states.push((answer.status.contains(SvcStatus::BUSY), answer.info));
    }
    assert_eq!(states, [(true, 0), (true, 0), (false, 7), (false, 7)]);
}

#[test]
fn commands_take_their_control_word() {
    let mut pair = Pair::new();
    assert_eq!(pair.open(COMMAND), Ok(0));
    // The high word of a two-byte value is not looked at.
    assert_eq!(pair.write(true, 0xABCD_0003), Ok(0));
    assert_eq!(pair.host.controls, [3]);
    assert_eq!(pair.write(false, 3), Err(SvcError::DATA_LONG));
}

#[test]
fn nothing_happens_before_the_channel_is_valid_or_without_a_toggle() {
    let mut pair = Pair::new();
    pair.server.reset();
    assert_eq!(pair.server.answer(), AtSvc::default());
    let open = MdtSvc { control: SvcControl::new(true, Element::Idn, true, true), info: FIXED.0 };
    pair.server.handle(open, &mut pair.host);
    assert_eq!(pair.server.answer(), AtSvc::default());
    pair.server.set_valid();
    pair.server.handle(open, &mut pair.host);
    assert_eq!(pair.server.open_idn(&pair.host.store), Some(FIXED));
    let same = MdtSvc { control: SvcControl::new(true, Element::Idn, true, true), info: LIST.0 };
    pair.server.handle(same, &mut pair.host);
    assert_eq!(pair.server.open_idn(&pair.host.store), Some(FIXED));
}

proptest::proptest! {
    /// Whatever a master sends, each step is answered and the parameters stay within their limits.
    #[test]
    fn any_steps_are_answered(steps in proptest::collection::vec(
        (0u8..8, proptest::bool::ANY, proptest::bool::ANY, 0u32..0x12), 1..200
    )) {
        let mut pair = Pair::new();
        for (element, write, last, info) in steps {
            let info = if element == 1 { 95 + info } else { info };
            let _ = pair.step(Element::from_number(element), write, last, info);
            let value = pair.host.store.number_of(FIXED);
            proptest::prop_assert!((-10..=10).contains(&value));
        }
    }
}
