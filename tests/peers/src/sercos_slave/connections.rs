//! The connections in CP3 and CP4: C-CON and values, produced and consumed.
//!
//! Assumptions. In CP3 a producer writes C-CON 0 and its values. A consumer in error recovers with the next new data. A
//! counter that skips counts as a loss, and its data are taken. S-0-1050.x.5 of an empty list is 0. Where S-0-1050.x.5
//! contradicts the list, the list is what is on the wire.

use super::idn::{Idn, Table};
use super::settings::Settings;
use super::telegram::{Header, Place, get_u16, low_byte, put};

/// C-CON: the producer is ready.
pub const READY: u16 = 1;
/// C-CON: toggles with new data.
pub const NEW_DATA: u16 = 2;
/// C-CON: stopped by flow control.
pub const STOPPED: u16 = 1 << 4;

/// How many connections a device may have.
const MOST: usize = 255;

/// Bytes of a connection with this list, C-CON with it. 0 for an empty list.
#[must_use]
pub fn length(width: impl Fn(Idn) -> usize, list: &[Idn]) -> u16 {
    let values: usize = list.iter().map(|idn| width(*idn)).sum();
    if values == 0 { 0 } else { u16::try_from(2 + values.next_multiple_of(2)).unwrap_or(u16::MAX) }
}

/// Where a consumer stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consumer {
    /// The producer was not ready yet.
    Prepare,
    /// The producer is ready, no data yet.
    Waiting,
    /// Data come.
    Consuming,
    /// Data did not come in time.
    Warning,
    /// More data lost than S-0-1050.x.11 allows.
    Error,
    /// The producer has stopped by flow control.
    Stopped,
}

/// One connection as it runs.
#[derive(Debug, Clone)]
struct Connection {
    number: u32,
    producer: bool,
    in_mdt: bool,
    place: Place,
    items: Vec<(Idn, usize)>,
    every: u32,
    allowed: u32,
    control: u16,
    state: Consumer,
    counts: bool,
    fresh: bool,
    since: u32,
    losses: u32,
    total: u16,
}

/// All active connections, from the parameters as they were at the change to CP3.
#[derive(Debug, Clone, Default)]
pub struct Connections {
    list: Vec<Connection>,
}

impl Connections {
    /// Reads the set-up.
    #[must_use]
    pub fn new(table: &Table, settings: &Settings) -> Self {
        let mut list = Vec::new();
        for number in (0u32..).take(settings.connections.len().min(MOST)) {
            let setup = table.word(Idn::se(1050, number, 1));
            if setup & 0x8000 == 0 {
                continue;
            }
            let (in_mdt, place) = Place::from_assignment(table.word(Idn::se(1050, number, 3)));
            let idns = table.idns(Idn::se(1050, number, 6));
            let items =
                idns.into_iter().map(|idn| (idn, table.get(idn).map_or(0, super::idn::Parameter::width)));
            let cycle = table.unsigned(Idn::s(1002)).max(1);
            let produced = table.unsigned(Idn::se(1050, number, 10));
            list.push(Connection {
                number,
                producer: setup & 0x4000 != 0,
                in_mdt,
                place,
                items: items.collect(),
                every: (produced / cycle).max(1),
                allowed: table.unsigned(Idn::se(1050, number, 11)),
                control: 0,
                state: Consumer::Prepare,
                counts: false,
                fresh: false,
                since: 0,
                losses: 0,
                total: 0,
            });
        }
        Self { list }
    }

    /// A new cycle of CP4: producers count, consumers miss what has not come since `cycles` cycles ago.
    pub fn new_cycle(&mut self, cycles: u32, stuck: bool, no_counter: bool) {
        for c in &mut self.list {
            c.since = c.since.saturating_add(1);
            if c.producer {
                if stuck {
                    continue;
                }
                if c.control == 0 || c.since >= c.every {
                    c.since = 0;
                    let counter = if no_counter { 0 } else { (c.control >> 12).wrapping_add(1) << 12 };
                    c.control = counter | READY | (c.control ^ NEW_DATA) & NEW_DATA;
                }
                continue;
            }
            let running = matches!(c.state, Consumer::Consuming | Consumer::Warning | Consumer::Error);
            if running && !c.fresh && c.since > c.every {
                c.lose(cycles);
            }
            c.fresh = false;
        }
    }

    /// An MDT or AT of CP4 has come: consumers take their values.
    pub fn consume(&mut self, header: Header, frame: &[u8], table: &mut Table) {
        for c in &mut self.list {
            if c.producer || c.in_mdt == header.at || c.place.telegram != header.number {
                continue;
            }
            let Some(word) = get_u16(frame, c.place.index()) else { continue };
            c.take(word, frame, table);
            table.set(Idn::se(1050, c.number, 8), &word.to_le_bytes());
            table.set(Idn::se(1050, c.number, 12), &c.total.to_le_bytes());
        }
    }

    /// An AT of CP3 or CP4 passes: producers put their values in.
    pub fn produce(&self, header: Header, frame: &mut [u8], table: &mut Table, cp4: bool) {
        for c in &self.list {
            if !c.producer || c.in_mdt == header.at || c.place.telegram != header.number {
                continue;
            }
            let control = if cp4 { c.control } else { 0 };
            let mut index = c.place.index();
            put(frame, index, &control.to_le_bytes());
            index += 2;
            for (idn, width) in &c.items {
                if let Some(parameter) = table.get(*idn) {
                    put(frame, index, &parameter.data);
                }
                index += width;
            }
            table.set(Idn::se(1050, c.number, 8), &control.to_le_bytes());
        }
    }

    /// Does a consumer stand in error?
    #[must_use]
    pub fn in_error(&self) -> bool {
        self.list.iter().any(|c| c.state == Consumer::Error)
    }

    /// Is this parameter written by a consumer connection?
    #[must_use]
    pub fn writes(&self, idn: Idn) -> bool {
        self.list.iter().any(|c| !c.producer && c.items.iter().any(|(item, _)| *item == idn))
    }

    /// The state of a consumer connection.
    #[must_use]
    pub fn state(&self, number: u32) -> Option<Consumer> {
        self.list.iter().find(|c| c.number == number && !c.producer).map(|c| c.state)
    }
}

impl Connection {
    fn lose(&mut self, cycles: u32) {
        self.losses = self.losses.saturating_add(cycles);
        self.total = self.total.saturating_add(u16::from(low_byte(u16::try_from(cycles).unwrap_or(255))));
        self.state = if self.losses > self.allowed { Consumer::Error } else { Consumer::Warning };
    }

    fn take(&mut self, word: u16, frame: &[u8], table: &mut Table) {
        let (before, counter) = (self.control, word >> 12);
        self.control = word;
        if word & READY == 0 {
            return;
        }
        if self.state == Consumer::Prepare {
            self.state = Consumer::Waiting;
        }
        if word & STOPPED != 0 {
            self.state = Consumer::Stopped;
            return;
        }
        self.counts |= counter != 0;
        let new = if self.counts { counter != before >> 12 } else { word & NEW_DATA != before & NEW_DATA };
        if !new {
            return;
        }
        let started = !matches!(self.state, Consumer::Waiting | Consumer::Stopped);
        let skipped = self.counts && started && counter != (before >> 12).wrapping_add(1) & 0xF;
        (self.state, self.losses) = if skipped {
            self.total = self.total.saturating_add(1);
            (Consumer::Warning, 0)
        } else {
            (Consumer::Consuming, 0)
        };
        self.fresh = true;
        self.since = 0;
        let mut index = self.place.index() + 2;
        for (idn, width) in &self.items {
            if let Some(data) = frame.get(index..index + width) {
                table.set(*idn, data);
            }
            index += width;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters;
    use super::super::telegram::{build, header};
    use super::*;

    fn set_up() -> (Connections, Table) {
        let settings = Settings::fixcfg();
        let mut table = parameters::table(&settings);
        table.set(Idn::se(1050, 0, 1), &[0x00, 0x80]);
        table.set(Idn::se(1050, 1, 1), &[0x00, 0xC0]);
        table.set(Idn::se(1050, 0, 3), &[0x1E, 0x08]);
        table.set(Idn::se(1050, 1, 3), &[0x18, 0x00]);
        table.set(Idn::se(1050, 0, 11), &[2, 0]);
        table.set(Idn::s(1002), &1_000_000u32.to_le_bytes());
        (Connections::new(&table, &settings), table)
    }

    fn mdt(word: u16, value: i32) -> Vec<u8> {
        let mut data = vec![0; 46];
        data[30..32].copy_from_slice(&word.to_le_bytes());
        data[32..34].copy_from_slice(&[0x00, 0xE0]);
        data[34..38].copy_from_slice(&value.to_le_bytes());
        build([2; 6], 0x20, 0x04, &data)
    }

    fn feed(c: &mut Connections, table: &mut Table, word: u16, value: i32) {
        let frame = mdt(word, value);
        c.consume(header(&frame, true).unwrap(), &frame, table);
    }

    #[test]
    fn the_length_counts_the_control_word() {
        assert_eq!(length(|_| 4, &[]), 0);
        assert_eq!(length(|_| 4, &[Idn::s(36)]), 6);
        assert_eq!(length(|_| 1, &[Idn::s(36)]), 4);
        let table = parameters::table(&Settings::fixcfg());
        assert_eq!(table.word(Idn::se(1050, 0, 5)), 8);
        assert_eq!(table.word(Idn::se(1050, 1, 5)), 12);
    }

    #[test]
    fn no_data_are_taken_before_the_producer_is_ready() {
        let (mut c, mut table) = set_up();
        feed(&mut c, &mut table, 0x1002, 5);
        assert_eq!((table.signed(Idn::s(36)), c.state(0)), (0, Some(Consumer::Prepare)));
        feed(&mut c, &mut table, 0x1001, 6);
        assert_eq!(c.state(0), Some(Consumer::Waiting));
        feed(&mut c, &mut table, 0x2003, 7);
        assert_eq!((table.signed(Idn::s(36)), c.state(0)), (7, Some(Consumer::Consuming)));
        assert_eq!(table.word(Idn::s(134)), 0xE000);
    }

    #[test]
    fn a_toggle_is_enough_when_nobody_counts() {
        let (mut c, mut table) = set_up();
        feed(&mut c, &mut table, 0x0003, -5);
        assert_eq!(table.signed(Idn::s(36)), -5);
        feed(&mut c, &mut table, 0x0003, 6);
        assert_eq!(table.signed(Idn::s(36)), -5);
        feed(&mut c, &mut table, 0x0001, 7);
        assert_eq!(table.signed(Idn::s(36)), 7);
    }

    #[test]
    fn losses_lead_to_a_warning_and_then_to_an_error() {
        let (mut c, mut table) = set_up();
        feed(&mut c, &mut table, 0x1003, 5);
        c.new_cycle(1, false, false);
        assert_eq!(c.state(0), Some(Consumer::Consuming));
        for expected in [Consumer::Warning, Consumer::Warning, Consumer::Error] {
            feed(&mut c, &mut table, 0x1003, 6);
            c.new_cycle(1, false, false);
            assert_eq!(c.state(0), Some(expected));
        }
        assert!(c.in_error());
        assert_eq!(table.signed(Idn::s(36)), 5);
        feed(&mut c, &mut table, 0x2001, 8);
        assert_eq!((table.signed(Idn::s(36)), c.in_error()), (8, false));
        assert_eq!(table.word(Idn::se(1050, 0, 12)), 3);
    }

    #[test]
    fn a_producer_counts_as_in_the_recording() {
        let (mut c, mut table) = set_up();
        let mut frame = build([2; 6], 0x60, 0x04, &[0; 48]);
        let head = header(&frame, true).unwrap();
        table.set_signed(Idn::s(51), 0x0102_0304);
        c.produce(head, &mut frame, &mut table, false);
        assert_eq!(frame[44..56], [0, 0, 0, 0, 4, 3, 2, 1, 0, 0, 0, 0]);
        let mut words = Vec::new();
        for _ in 0..3 {
            c.new_cycle(1, false, false);
            c.produce(head, &mut frame, &mut table, true);
            words.push(get_u16(&frame, 44).unwrap());
        }
        assert_eq!(words, [0x1003, 0x2001, 0x3003]);
        c.new_cycle(1, true, false);
        c.produce(head, &mut frame, &mut table, true);
        assert_eq!(get_u16(&frame, 44), Some(0x3003));
    }

    #[test]
    fn frames_cut_at_any_byte_do_no_harm() {
        let whole = mdt(0x1003, 5);
        for length in 20..whole.len() {
            let (mut c, mut table) = set_up();
            let head = header(&whole, true).unwrap();
            c.consume(head, &whole[..length], &mut table);
            let expected = if length >= 58 { 5 } else { 0 };
            assert_eq!(table.signed(Idn::s(36)), expected, "{length} bytes");
            let mut at = build([2; 6], 0x60, 0x04, &[0; 48]);
            at.truncate(length);
            let at_head = Header { at: true, ..head };
            c.produce(at_head, &mut at, &mut table, true);
            assert_eq!(at.len(), length);
        }
    }
}
