//! Cyclic write and read data of one axis: attribute lists agreed by service, then carried in every update, clauses
//! 6-2.7.1.2.3 and 6-2.7.2.1.6.
//!
//! A new list has a new block ID; until the device has answered with it the old one goes on.

use super::program::{CyclicAttribute, CyclicDirection};
use crate::wire::motion::read_write::HEADER_LEN;
use crate::wire::motion::{ReadBlock, WriteBlock};

/// Alignment that elements of any size keep to, in bytes.
const ALIGNMENT_MAX: usize = 4;

/// A list with its values.
#[derive(Debug, Clone, Default)]
struct List {
    id: u8,
    attributes: Vec<CyclicAttribute>,
    data: Vec<u8>,
}

/// What the device said of a list last.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Told {
    id: u8,
    status: u8,
}

/// The lists of both directions.
#[derive(Debug, Clone, Default)]
pub(super) struct CyclicLists {
    write: List,
    read: List,
    write_told: Option<Told>,
    read_told: Option<Told>,
    /// Read data came for the list in use.
    fresh: bool,
}

impl List {
    fn new(id: u8, attributes: Vec<CyclicAttribute>) -> Self {
        let mut list = Self { id, attributes, data: Vec::new() };
        list.fill();
        list
    }

    /// Places of the values, each element aligned to its size.
    fn places(&self) -> impl Iterator<Item = (&CyclicAttribute, usize)> {
        let mut at: usize = 0;
        self.attributes.iter().map(move |attribute| {
            let size = usize::from(attribute.element_size).clamp(1, ALIGNMENT_MAX);
            let start = at.next_multiple_of(size);
            at = start + attribute.value.len();
            (attribute, start)
        })
    }

    fn len(&self) -> usize {
        let end = self.places().map(|(attribute, at)| at + attribute.value.len()).last();
        end.unwrap_or(0).next_multiple_of(ALIGNMENT_MAX)
    }

    fn fill(&mut self) {
        let mut data = vec![0; self.len()];
        for (attribute, at) in self.places() {
            data[at..at + attribute.value.len()].copy_from_slice(&attribute.value);
        }
        self.data = data;
    }
}

impl CyclicLists {
    /// Takes a list that the device has agreed to under this block ID.
    pub fn adopt(&mut self, direction: CyclicDirection, id: u8, attributes: Vec<CyclicAttribute>) {
        let list = List::new(id, attributes);
        match direction {
            CyclicDirection::Write => {
                self.write = list;
                self.write_told = None;
            }
            CyclicDirection::Read => {
                self.read = list;
                self.read_told = None;
                self.fresh = false;
            }
        }
    }

    /// Changes a value of the write data; false when it is not in the list or not as long.
    pub fn write(&mut self, id: u16, value: &[u8]) -> bool {
        let found = self.write.attributes.iter_mut().find(|attribute| attribute.id == id);
        let Some(attribute) = found.filter(|attribute| attribute.value.len() == value.len()) else {
            return false;
        };
        attribute.value.copy_from_slice(value);
        self.write.fill();
        true
    }

    /// The value of an attribute in the write data.
    pub fn written(&self, id: u16) -> Option<&[u8]> {
        self.write
            .attributes
            .iter()
            .find(|attribute| attribute.id == id)
            .map(|attribute| &attribute.value[..])
    }

    /// What the device said of the list in use: its status once it has used it, `None` before.
    pub fn status(&self, direction: CyclicDirection) -> Option<u8> {
        let (list, told) = match direction {
            CyclicDirection::Write => (&self.write, self.write_told),
            CyclicDirection::Read => (&self.read, self.read_told),
        };
        told.filter(|told| told.id == list.id).map(|told| told.status)
    }

    /// The value of an attribute in the read data that came last.
    pub fn value(&self, id: u16) -> Option<&[u8]> {
        if !self.fresh {
            return None;
        }
        let (attribute, at) = self.read.places().find(|(attribute, _)| attribute.id == id)?;
        self.read.data.get(at..at + attribute.value.len())
    }

    const fn is_used(&self) -> bool {
        self.write.id != 0 || self.read.id != 0
    }

    /// Bytes in a C-to-D update.
    pub fn command_len(&self) -> usize {
        if self.is_used() { HEADER_LEN + self.write.data.len() } else { 0 }
    }

    /// Bytes in a D-to-C update.
    pub fn actual_len(&self) -> usize {
        if self.is_used() { HEADER_LEN + self.read.data.len() } else { 0 }
    }

    /// The block for the next update.
    pub fn block(&self) -> Option<WriteBlock<'_>> {
        self.is_used().then(|| WriteBlock {
            write_block_id: self.write.id,
            read_block_id: self.read.id,
            data: &self.write.data,
        })
    }

    /// Takes the block of a D-to-C update.
    pub fn handle(&mut self, block: &ReadBlock<'_>) {
        self.write_told = Some(Told { id: block.write_block_id, status: block.write_status });
        self.read_told = Some(Told { id: block.read_block_id, status: block.read_status });
        if block.read_block_id == self.read.id && block.read_status == 0 && self.read.id != 0 {
            self.fresh = block.data.len() == self.read.data.len();
            if self.fresh {
                self.read.data.copy_from_slice(block.data);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(id: u16, element_size: u8, value: &[u8]) -> CyclicAttribute {
        CyclicAttribute { id, element_size, value: value.to_vec() }
    }

    #[test]
    fn values_are_aligned_to_their_size_and_the_block_to_words() {
        let mut lists = CyclicLists::default();
        assert!(lists.block().is_none());
        let attributes =
            vec![attribute(1, 1, &[7]), attribute(2, 4, &[1, 2, 3, 4]), attribute(3, 2, &[8, 9])];
        lists.adopt(CyclicDirection::Write, 5, attributes);
        assert_eq!((lists.command_len(), lists.actual_len()), (4 + 12, 4));
        let block = lists.block().unwrap();
        assert_eq!((block.write_block_id, block.read_block_id), (5, 0));
        assert_eq!(block.data, [7, 0, 0, 0, 1, 2, 3, 4, 8, 9, 0, 0]);
        assert!(lists.write(3, &[6, 6]) && !lists.write(3, &[6]) && !lists.write(4, &[6]));
        assert_eq!(lists.block().unwrap().data[8..], [6, 6, 0, 0]);
    }

    #[test]
    fn read_values_count_for_their_list_only() {
        let mut lists = CyclicLists::default();
        lists.adopt(CyclicDirection::Read, 2, vec![attribute(1, 1, &[0]), attribute(2, 4, &[0; 4])]);
        let block = |id, status, data| ReadBlock {
            write_block_id: 0,
            write_status: 0,
            read_block_id: id,
            read_status: status,
            data,
        };
        assert_eq!(lists.status(CyclicDirection::Read), None);
        lists.handle(&block(1, 0, &[1, 0, 0, 0]));
        assert_eq!((lists.status(CyclicDirection::Read), lists.value(2)), (None, None), "the old list");
        lists.handle(&block(1, 0, &[5; 8]));
        assert_eq!(lists.value(1), None, "the old list, though it is as long");
        lists.handle(&block(2, 0, &[1, 0, 0, 0, 9, 8, 7, 6]));
        assert_eq!(lists.status(CyclicDirection::Read), Some(0));
        assert_eq!((lists.value(1), lists.value(2)), (Some(&[1][..]), Some(&[9, 8, 7, 6][..])));
        lists.handle(&block(2, 0x20, &[]));
        assert_eq!(lists.status(CyclicDirection::Read), Some(0x20));
        lists.handle(&block(2, 0, &[1]));
        assert_eq!(lists.value(1), None, "not as long as agreed");
    }
}
