//! Both ends, alone and with each other.

mod client_table;
mod pair;
mod recorded;
mod server_table;

use std::collections::BTreeMap;

use profile_generic::time::MonotonicTime;

use super::client::{Client, ClientConfig, ClientState};
use super::request::{Method, SdoData, SdoFailure, SdoOutcome, SdoRequest};
use super::server::{ObjectAccess, Server, ServerConfig, ServerState};
use crate::wire::sdo::SDO_LEN;
use crate::wire::{AbortCode, Mux};

/// A number of four bytes.
const NUMBER: Mux = Mux::new(0x2000, 1);
/// A text of up to 2000 bytes.
const TEXT: Mux = Mux::new(0x2000, 0);
/// A name that can only be read.
const NAME: Mux = Mux::new(0x1008, 0);
/// What can only be written.
const COMMAND: Mux = Mux::new(0x1010, 1);
/// An empty text.
const EMPTY: Mux = Mux::new(0x2002, 0);

/// A small object dictionary.
struct Store {
    values: BTreeMap<Mux, Vec<u8>>,
    /// Values up to this many bytes can be written.
    max: usize,
    writes: usize,
}

impl Default for Store {
    fn default() -> Self {
        let values = [
            (NUMBER, vec![1, 2, 3, 4]),
            (TEXT, b"A really really long string...".to_vec()),
            (NAME, b"Tiny Node - Mega Domains !".to_vec()),
            (COMMAND, vec![0; 4]),
            (EMPTY, vec![]),
        ];
        Self { values: values.into_iter().collect(), max: 2000, writes: 0 }
    }
}

impl ObjectAccess for Store {
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode> {
        let value = self.values.get(&object).ok_or(AbortCode::NO_OBJECT)?;
        if object == COMMAND {
            return Err(AbortCode::WRITE_ONLY);
        }
        into.get_mut(..value.len()).ok_or(AbortCode::OUT_OF_MEMORY)?.copy_from_slice(value);
        Ok(value.len())
    }

    fn write_begins(&mut self, object: Mux, size: Option<u32>) -> Result<usize, AbortCode> {
        let max = match object {
            NAME => return Err(AbortCode::READ_ONLY),
            NUMBER | COMMAND => 4,
            _ => self.max,
        };
        self.values.get(&object).ok_or(AbortCode::NO_OBJECT)?;
        if size.is_some_and(|size| size as usize > max) {
            return Err(AbortCode::TOO_LONG);
        }
        Ok(max)
    }

    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode> {
        if object == NUMBER && data.len() != 4 {
            return Err(AbortCode::TOO_SHORT);
        }
        self.writes += 1;
        self.values.insert(object, data.to_vec());
        Ok(())
    }
}

fn ms(milliseconds: u64) -> MonotonicTime {
    MonotonicTime(milliseconds * 1_000_000)
}

/// The eight bytes of a frame from their hexadecimal digits.
fn hex(text: &str) -> [u8; SDO_LEN] {
    let digits: String = text.split_whitespace().collect();
    let bytes = (0..SDO_LEN).map(|place| u8::from_str_radix(&digits[2 * place..2 * place + 2], 16).unwrap());
    bytes.collect::<Vec<_>>().try_into().unwrap()
}

fn text(value: &[u8]) -> SdoData {
    SdoData::Buffer(value.to_vec())
}

fn room(len: usize) -> Vec<u8> {
    Vec::with_capacity(len)
}
