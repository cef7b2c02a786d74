//! The blocks and options of pcapng files: the numbers that reader and writer share, and how a block is built.

pub(super) const SECTION: u32 = 0x0A0D_0D0A;
pub(super) const INTERFACE: u32 = 1;
pub(super) const PACKET_OBSOLETE: u32 = 2;
pub(super) const SIMPLE: u32 = 3;
pub(super) const STATISTICS: u32 = 5;
pub(super) const ENHANCED: u32 = 6;

/// Byte-order magic of a section header.
pub(super) const BYTE_ORDER: u32 = 0x1A2B_3C4D;

pub(super) const OPTION_END: u16 = 0;
pub(super) const OPTION_COMMENT: u16 = 1;
pub(super) const OPTION_SHB_USERAPPL: u16 = 4;
pub(super) const OPTION_IF_NAME: u16 = 2;
pub(super) const OPTION_IF_DESCRIPTION: u16 = 3;
pub(super) const OPTION_IF_TSRESOL: u16 = 9;
pub(super) const OPTION_IF_TSOFFSET: u16 = 14;
pub(super) const OPTION_ISB_IFRECV: u16 = 4;
pub(super) const OPTION_ISB_IFDROP: u16 = 5;

/// Type and length before the body.
const HEADER_LEN: usize = 8;

/// Builds one little endian block after the other in the same buffer.
#[derive(Debug, Default)]
pub(super) struct BlockBuilder {
    bytes: Vec<u8>,
    has_options: bool,
}

impl BlockBuilder {
    /// Begins a block with the fields that have a fixed length, 32 bits each.
    pub(super) fn begin(&mut self, kind: u32, fields: &[u32]) {
        self.bytes.clear();
        self.has_options = false;
        self.bytes.extend(kind.to_le_bytes());
        // The length, set by `end`.
        self.bytes.extend([0; 4]);
        self.bytes.extend(fields.iter().flat_map(|field| field.to_le_bytes()));
    }

    /// Appends bytes and pads them to 32 bits.
    pub(super) fn data(&mut self, data: &[u8]) {
        self.bytes.extend(data);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    /// Appends an option, cut to the 65535 bytes that it can have.
    pub(super) fn option(&mut self, code: u16, value: &[u8]) {
        let length = u16::try_from(value.len()).unwrap_or(u16::MAX);
        self.has_options = true;
        self.bytes.extend(code.to_le_bytes());
        self.bytes.extend(length.to_le_bytes());
        self.data(&value[..usize::from(length)]);
    }

    /// Ends the block; its bytes.
    pub(super) fn end(&mut self) -> &[u8] {
        if self.has_options {
            self.bytes.extend([0; 4]);
        }
        let length = u32::try_from(self.bytes.len() + 4).unwrap_or(u32::MAX).to_le_bytes();
        self.bytes[HEADER_LEN - 4..HEADER_LEN].copy_from_slice(&length);
        self.bytes.extend(length);
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_has_its_length_twice_and_options_end_where_there_are_any() {
        let mut block = BlockBuilder::default();
        block.begin(ENHANCED, &[0x0102_0304]);
        block.data(&[9]);
        assert_eq!(block.end(), [6, 0, 0, 0, 20, 0, 0, 0, 4, 3, 2, 1, 9, 0, 0, 0, 20, 0, 0, 0]);
        block.begin(INTERFACE, &[]);
        block.option(OPTION_IF_NAME, b"abcde");
        let expected =
            [1, 0, 0, 0, 28, 0, 0, 0, 2, 0, 5, 0, 97, 98, 99, 100, 101, 0, 0, 0, 0, 0, 0, 0, 28, 0, 0, 0];
        assert_eq!(block.end(), expected);
    }

    #[test]
    fn an_option_is_cut_to_what_its_length_can_say() {
        let mut block = BlockBuilder::default();
        block.begin(INTERFACE, &[]);
        block.option(OPTION_COMMENT, &[7; 70_000]);
        let bytes = block.end();
        assert_eq!(bytes.len(), 8 + 4 + 65_536 + 4 + 4);
        assert_eq!(bytes[8..13], [1, 0, 255, 255, 7]);
    }
}
