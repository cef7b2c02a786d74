//! Writes pcapng files with one interface for each side, SERCOS port and CAN bus of the box and nanosecond time stamps.

use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::time::Duration;

use pcap_file::pcapng::blocks::enhanced_packet::{EnhancedPacketBlock, EnhancedPacketOption};
use pcap_file::pcapng::blocks::interface_description::{
    InterfaceDescriptionBlock, InterfaceDescriptionOption,
};
use pcap_file::pcapng::blocks::interface_statistics::{InterfaceStatisticsBlock, InterfaceStatisticsOption};
use pcap_file::pcapng::blocks::section_header::{SectionHeaderBlock, SectionHeaderOption};
use pcap_file::pcapng::{PcapNgBlock, PcapNgWriter};
use pcap_file::{DataLink, Endianness, PcapError};
use profile_generic::can::Frame;

use super::can::{self, RECORD_LEN_MAX};
use super::{CAN_BUSES_MAX, FRAME_LEN_MAX, Side};
use crate::sys::clock::KernelTime;

/// Time stamps count units of 10^-9 s (`if_tsresol`).
const RESOLUTION_NS: u8 = 9;

/// A pcapng file being written.
pub struct Writer<W: Write> {
    inner: PcapNgWriter<BufWriter<W>>,
    bytes: u64,
    /// CAN buses it has.
    can: usize,
}

impl<W: Write> Writer<W> {
    /// Writes the headers: the program, the interfaces of [`Side::ETHERNET`] and one for each CAN bus, each described as given.
    ///
    /// # Errors
    /// What the destination says.
    pub fn new(destination: W, descriptions: [&str; Side::ETHERNET.len()], can: &[&str]) -> io::Result<Self> {
        let program = concat!("axisbridge ", env!("CARGO_PKG_VERSION"));
        let section = SectionHeaderBlock {
            endianness: Endianness::Little,
            options: vec![SectionHeaderOption::UserApplication(Cow::Borrowed(program))],
            ..SectionHeaderBlock::default()
        };
        let inner = PcapNgWriter::with_section_header(BufWriter::new(destination), section).map_err(to_io)?;
        let mut writer = Self { inner, bytes: 0, can: can.len().min(CAN_BUSES_MAX) };
        let all = Side::all(can.len()).zip(descriptions.into_iter().chain(can.iter().copied()));
        for (side, description) in all {
            let (linktype, snaplen) = match side {
                Side::Can(_) => (DataLink::CAN_SOCKETCAN, RECORD_LEN_MAX),
                _ => (DataLink::ETHERNET, FRAME_LEN_MAX),
            };
            let interface = InterfaceDescriptionBlock {
                linktype,
                snaplen: u32::try_from(snaplen).unwrap_or(0),
                options: vec![
                    InterfaceDescriptionOption::IfName(Cow::Borrowed(side.name())),
                    InterfaceDescriptionOption::IfDescription(Cow::Borrowed(description)),
                    InterfaceDescriptionOption::IfTsResol(RESOLUTION_NS),
                ],
            };
            writer.block(interface)?;
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
        let options =
            comment.map(|text| EnhancedPacketOption::Comment(Cow::Borrowed(text))).into_iter().collect();
        self.block(EnhancedPacketBlock {
            interface_id: side.number(),
            timestamp: Duration::from_nanos(at.0),
            original_len: u32::try_from(frame.len()).unwrap_or(u32::MAX),
            data: Cow::Borrowed(kept),
            options,
        })
    }

    /// Writes how many frames of a side were seen and how many could not be recorded.
    ///
    /// # Errors
    /// What the destination says.
    pub fn statistics(&mut self, side: Side, at: KernelTime, seen: u64, dropped: u64) -> io::Result<()> {
        // The format has the high half first whatever the byte order; the library writes one 64-bit number,
        // which in a little endian file is the low half first.
        let timestamp = at.0.rotate_left(32);
        self.block(InterfaceStatisticsBlock {
            interface_id: side.number(),
            timestamp,
            options: vec![
                InterfaceStatisticsOption::IsbIfRecv(seen),
                InterfaceStatisticsOption::IsbIfDrop(dropped),
            ],
        })
    }

    /// Bytes of the blocks written so far, beside the section header.
    #[must_use]
    pub const fn bytes_written(&self) -> u64 {
        self.bytes
    }

    /// Hands what is buffered to the destination.
    ///
    /// # Errors
    /// What the destination says.
    pub fn flush(&mut self) -> io::Result<()> {
        self.inner.get_mut().flush()
    }

    /// Flushes and returns the destination.
    ///
    /// # Errors
    /// What the destination says.
    pub fn finish(self) -> io::Result<W> {
        self.inner.into_inner().into_inner().map_err(io::IntoInnerError::into_error)
    }

    fn block<'a, B: PcapNgBlock<'a>>(&mut self, block: B) -> io::Result<()> {
        let written = self.inner.write_pcapng_block(block).map_err(to_io)?;
        self.bytes = self.bytes.saturating_add(u64::try_from(written).unwrap_or(0));
        Ok(())
    }
}

fn to_io(error: PcapError) -> io::Error {
    match error {
        PcapError::IoError(source) => source,
        other => io::Error::other(other),
    }
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
