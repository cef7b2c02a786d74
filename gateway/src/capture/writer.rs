//! Writes pcapng files with one interface for each side, SERCOS port and CAN bus of the box and nanosecond time stamps.

use std::io::{self, BufWriter, Write};

use profile_generic::can::Frame;

use super::blocks::{self, BlockBuilder};
use super::can::{self, LINK_TYPE_CAN, RECORD_LEN_MAX};
use super::reader::LINK_TYPE_ETHERNET;
use super::{CAN_BUSES_MAX, FRAME_LEN_MAX, Side};
use crate::sys::clock::KernelTime;

/// Time stamps count units of 10^-9 s (`if_tsresol`).
const RESOLUTION_NS: u8 = 9;

/// Version 1.0 of the format: major number low, minor number high.
const VERSION: u32 = 1;

/// A pcapng file being written.
pub struct Writer<W: Write> {
    destination: BufWriter<W>,
    block: BlockBuilder,
    /// Bytes after the section header.
    bytes: u64,
    /// CAN buses that the file has.
    can: usize,
}

impl<W: Write> Writer<W> {
    /// Writes the headers: the program, the interfaces of [`Side::ETHERNET`] and one for each CAN bus, each described as given.
    ///
    /// # Errors
    /// What the destination says.
    pub fn new(destination: W, descriptions: [&str; Side::ETHERNET.len()], can: &[&str]) -> io::Result<Self> {
        let (destination, block) = (BufWriter::new(destination), BlockBuilder::default());
        let mut writer = Self { destination, block, bytes: 0, can: can.len().min(CAN_BUSES_MAX) };
        // The length of the section is unknown: -1.
        writer.block.begin(blocks::SECTION, &[blocks::BYTE_ORDER, VERSION, u32::MAX, u32::MAX]);
        let program = concat!("axisbridge ", env!("CARGO_PKG_VERSION"));
        writer.block.option(blocks::OPTION_SHB_USERAPPL, program.as_bytes());
        writer.destination.write_all(writer.block.end())?;
        let all = Side::all(can.len()).zip(descriptions.into_iter().chain(can.iter().copied()));
        for (side, description) in all {
            let (link_type, snap_len) = match side {
                Side::Can(_) => (LINK_TYPE_CAN, RECORD_LEN_MAX),
                _ => (LINK_TYPE_ETHERNET, FRAME_LEN_MAX),
            };
            let snap_len = u32::try_from(snap_len).unwrap_or(0);
            writer.block.begin(blocks::INTERFACE, &[u32::from(link_type), snap_len]);
            writer.block.option(blocks::OPTION_IF_NAME, side.name().as_bytes());
            writer.block.option(blocks::OPTION_IF_DESCRIPTION, description.as_bytes());
            writer.block.option(blocks::OPTION_IF_TSRESOL, &[RESOLUTION_NS]);
            writer.end_block()?;
        }
        Ok(writer)
    }

    /// CAN buses that the file has.
    #[must_use]
    pub const fn can_buses(&self) -> usize {
        self.can
    }

    /// Writes one frame of a CAN bus.
    ///
    /// # Errors
    /// What the destination says; a bus that the file has not.
    pub fn can_frame(
        &mut self,
        bus: u8,
        at: KernelTime,
        frame: &Frame,
        comment: Option<&str>,
    ) -> io::Result<()> {
        let mut record = [0; RECORD_LEN_MAX];
        let len = can::emit(frame, &mut record);
        self.frame(Side::Can(bus), at, &record[..len], comment)
    }

    /// Writes one frame, cut to [`FRAME_LEN_MAX`], with an optional comment that analysers show beside it.
    ///
    /// # Errors
    /// What the destination says; a CAN bus that the file has not.
    pub fn frame(
        &mut self,
        side: Side,
        at: KernelTime,
        frame: &[u8],
        comment: Option<&str>,
    ) -> io::Result<()> {
        if let Side::Can(bus) = side
            && usize::from(bus) >= self.can
        {
            let text = format!("the recording has {} CAN buses, expected one with number {bus}", self.can);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        let kept = frame.get(..FRAME_LEN_MAX).unwrap_or(frame);
        let original_len = u32::try_from(frame.len()).unwrap_or(u32::MAX);
        let kept_len = u32::try_from(kept.len()).unwrap_or(u32::MAX);
        let [high, low] = halves(at.0);
        self.block.begin(blocks::ENHANCED, &[side.number(), high, low, kept_len, original_len]);
        self.block.data(kept);
        if let Some(comment) = comment {
            self.block.option(blocks::OPTION_COMMENT, comment.as_bytes());
        }
        self.end_block()
    }

    /// Writes how many frames of a side were seen and how many could not be recorded.
    ///
    /// # Errors
    /// What the destination says.
    pub fn statistics(&mut self, side: Side, at: KernelTime, seen: u64, dropped: u64) -> io::Result<()> {
        let [high, low] = halves(at.0);
        self.block.begin(blocks::STATISTICS, &[side.number(), high, low]);
        self.block.option(blocks::OPTION_ISB_IFRECV, &seen.to_le_bytes());
        self.block.option(blocks::OPTION_ISB_IFDROP, &dropped.to_le_bytes());
        self.end_block()
    }

    /// Bytes of the blocks written so far, without the section header.
    #[must_use]
    pub const fn bytes_written(&self) -> u64 {
        self.bytes
    }

    /// Hands what is buffered to the destination.
    ///
    /// # Errors
    /// What the destination says.
    pub fn flush(&mut self) -> io::Result<()> {
        self.destination.flush()
    }

    /// Flushes and returns the destination.
    ///
    /// # Errors
    /// What the destination says.
    pub fn finish(self) -> io::Result<W> {
        self.destination.into_inner().map_err(io::IntoInnerError::into_error)
    }

    fn end_block(&mut self) -> io::Result<()> {
        let block = self.block.end();
        self.destination.write_all(block)?;
        self.bytes = self.bytes.saturating_add(u64::try_from(block.len()).unwrap_or(0));
        Ok(())
    }
}

/// A time stamp as the format has it in either byte order: the high half first.
fn halves(time: u64) -> [u32; 2] {
    [time >> 32, time & u64::from(u32::MAX)].map(|half| u32::try_from(half).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use profile_sercos::port::Port;

    use super::*;

    #[test]
    fn statistics_carry_the_time_high_half_first() {
        let mut writer = Writer::new(Vec::new(), ["a", "b", "c"], &[]).unwrap();
        writer.statistics(Side::South(Port::One), KernelTime(0x0102_0304_0506_0708), 9, 2).unwrap();
        let file = writer.finish().unwrap();
        // Block type 5, interface 1, then the time.
        let block = [
            5, 0, 0, 0, 52, 0, 0, 0, 1, 0, 0, 0, 0x04, 0x03, 0x02, 0x01, 0x08, 0x07, 0x06, 0x05, 4, 0, 8, 0,
            9, 0,
        ];
        assert!(file.windows(block.len()).any(|window| window == block), "{file:02x?}");
    }

    #[test]
    fn a_file_begins_with_the_program_and_its_interfaces_and_has_a_block_for_each_frame() {
        let mut writer = Writer::new(Vec::new(), ["a", "bcde", ""], &["can0"]).unwrap();
        let headers = usize::try_from(writer.bytes_written()).unwrap();
        writer.frame(Side::Can(0), KernelTime(0x0102_0304_0506_0708), &[0xA1; 5], Some("why")).unwrap();
        let file = writer.finish().unwrap();
        let section = [
            0x0A, 0x0D, 0x0D, 0x0A, 52, 0, 0, 0, 0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 255, 255, 255, 255, 255,
            255, 255, 255, 4, 0,
        ];
        assert_eq!(file[..section.len()], section);
        // Snap length 1518; name, description, nanoseconds, the end of the options.
        let north = [
            1, 0, 0, 0, 52, 0, 0, 0, 1, 0, 0, 0, 0xEE, 5, 0, 0, 2, 0, 5, 0, b'n', b'o', b'r', b't', b'h', 0,
            0, 0, 3, 0, 1, 0, b'a', 0, 0, 0, 9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0, 52, 0, 0, 0,
        ];
        assert_eq!(file[52..52 + north.len()], north);
        let frame = [
            6, 0, 0, 0, 52, 0, 0, 0, 3, 0, 0, 0, 4, 3, 2, 1, 8, 7, 6, 5, 5, 0, 0, 0, 5, 0, 0, 0, 0xA1, 0xA1,
            0xA1, 0xA1, 0xA1, 0, 0, 0, 1, 0, 3, 0, b'w', b'h', b'y', 0, 0, 0, 0, 0, 52, 0, 0, 0,
        ];
        assert_eq!(file[52 + headers..], frame);
    }

    #[test]
    fn the_bytes_written_are_those_of_the_file() {
        let mut writer = Writer::new(Vec::new(), ["a", "b", "c"], &[]).unwrap();
        writer.frame(Side::North, KernelTime(1), &[7; 61], Some("text")).unwrap();
        let bytes = writer.bytes_written();
        let file = writer.finish().unwrap();
        let section_len = u64::from(u32::from_le_bytes([file[4], file[5], file[6], file[7]]));
        assert_eq!(u64::try_from(file.len()).unwrap(), section_len + bytes);
    }

    #[test]
    fn a_frame_longer_than_the_limit_keeps_its_length_on_record() {
        let mut writer = Writer::new(Vec::new(), ["a", "b", "c"], &[]).unwrap();
        writer.frame(Side::North, KernelTime(1), &[7; 2000], None).unwrap();
        let file = writer.finish().unwrap();
        let mut reader = crate::capture::reader::Reader::new(file.as_slice()).unwrap();
        let frame = reader.next_frame().unwrap().unwrap();
        assert_eq!((frame.data.len(), frame.original_len), (FRAME_LEN_MAX, 2000));
    }
}
