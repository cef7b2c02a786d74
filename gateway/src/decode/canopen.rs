//! CANopen: frames by the default connection set, SDO transfers with their blocks, PDOs by the mapping that was written.

use profile_cia402::wire::emcy::Emcy;
use profile_cia402::wire::error_control::Heartbeat;
use profile_cia402::wire::lss::{LssRequest, LssResponse};
use profile_cia402::wire::nmt::Nmt;
use profile_cia402::wire::sdo::{Abort, BlockSegment, SdoRequest, SdoResponse, Transfer};
use profile_cia402::wire::sync::Sync;
use profile_cia402::wire::time::TimeOfDay;
use profile_cia402::wire::{Error, Function, Mux, NodeId};
use profile_generic::can::Frame;

use super::text::Text;

/// PDOs with default identifiers that a node has in each direction.
const PDOS: usize = 4;

/// Objects in a PDO of eight bytes.
const FIELDS_MAX: usize = 8;

/// Node-ids.
const NODES: usize = 128;

/// What is known of a bus.
#[derive(Debug)]
pub(super) struct Canopen {
    nodes: Vec<Node>,
}

/// What is known of a node.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    /// Segments of a block go to the server, or come from it.
    down: Blocks,
    up: Blocks,
    rpdos: [Mapping; PDOS],
    tpdos: [Mapping; PDOS],
}

/// A block transfer: whether frames are segments now, and the last segment that was sent as the last one.
#[derive(Debug, Clone, Copy, Default)]
struct Blocks {
    open: bool,
    ended: Option<u8>,
}

impl Blocks {
    fn begin(&mut self) {
        *self = Self { open: true, ended: None };
    }

    /// A segment, which the receiver has yet to confirm.
    fn segment(&mut self, segment: &BlockSegment) {
        if segment.last {
            self.ended = Some(segment.sequence);
        }
    }

    /// The receiver has so many segments: if the last one is among them, all of them have gone.
    fn received(&mut self, acknowledged: u8) {
        self.open &= self.ended != Some(acknowledged);
        self.ended = None;
    }
}

/// Objects of a PDO, as far as they were written.
#[derive(Debug, Clone, Copy, Default)]
struct Mapping {
    words: [u32; FIELDS_MAX],
    count: u8,
}

impl Default for Canopen {
    fn default() -> Self {
        Self { nodes: vec![Node::default(); NODES] }
    }
}

impl Canopen {
    /// Prints what a frame means.
    pub(super) fn frame(&mut self, frame: &Frame, text: &mut Text) {
        let Some(function) = Function::of(frame.id()).filter(|_| !frame.is_fd()) else {
            text.line(1, format_args!("no identifier of the default connection set"));
            return;
        };
        text.line(1, format_args!("{function}"));
        if frame.is_remote() {
            text.line(2, format_args!("asked for"));
            return;
        }
        if let Err(error) = self.content(function, frame.data(), text) {
            text.line(2, format_args!("not readable: {error}"));
        }
    }

    fn content(&mut self, function: Function, data: &[u8], text: &mut Text) -> Result<(), Error> {
        match function {
            Function::Nmt => {
                let command = Nmt::parse(data)?;
                text.line(2, format_args!("{command}"));
            }
            Function::Sync => text.line(2, format_args!("{}", Sync::parse(data)?)),
            Function::Time => text.line(2, format_args!("{}", TimeOfDay::parse(data)?)),
            Function::Emcy(_) => text.line(2, format_args!("{}", Emcy::parse(data)?)),
            Function::ErrorControl(node) => {
                let heartbeat = Heartbeat::parse(data)?;
                if heartbeat.is_boot_up() {
                    // Everything of the communication is as it was at the start.
                    *self.node(node) = Node::default();
                }
                text.line(2, format_args!("{heartbeat}"));
            }
            Function::LssRequest => text.line(2, format_args!("{}", LssRequest::parse(data)?)),
            Function::LssResponse => text.line(2, format_args!("{}", LssResponse::parse(data)?)),
            Function::SdoRequest(node) => self.node(node).request(data, text)?,
            Function::SdoResponse(node) => self.node(node).response(data, text)?,
            Function::Rpdo(number, node) => {
                let node = self.node(node);
                pdo(node.rpdos.get(usize::from(number).saturating_sub(1)), data, text);
            }
            Function::Tpdo(number, node) => {
                let node = self.node(node);
                pdo(node.tpdos.get(usize::from(number).saturating_sub(1)), data, text);
            }
        }
        Ok(())
    }

    fn node(&mut self, node: NodeId) -> &mut Node {
        &mut self.nodes[usize::from(node.get())]
    }
}

impl Node {
    fn request(&mut self, data: &[u8], text: &mut Text) -> Result<(), Error> {
        if self.down.open && Abort::parse(data).is_none() {
            let segment = BlockSegment::parse(data)?;
            self.down.segment(&segment);
            text.line(2, format_args!("{segment}"));
            return Ok(());
        }
        let request = SdoRequest::parse(data)?;
        match request {
            SdoRequest::Abort(_) => (self.down, self.up) = Default::default(),
            SdoRequest::StartBlockUpload => self.up.begin(),
            SdoRequest::BlockReceived { acknowledged, .. } => self.up.received(acknowledged),
            SdoRequest::Download(mux, Transfer::Expedited { data, .. }) => self.learn(mux, &data),
            _ => {}
        }
        text.line(2, format_args!("{request}"));
        Ok(())
    }

    fn response(&mut self, data: &[u8], text: &mut Text) -> Result<(), Error> {
        if self.up.open && Abort::parse(data).is_none() {
            let segment = BlockSegment::parse(data)?;
            self.up.segment(&segment);
            // The client says with the next frame whether it has them all.
            text.line(2, format_args!("{segment}"));
            return Ok(());
        }
        let response = SdoResponse::parse(data)?;
        match response {
            SdoResponse::Abort(_) => (self.down, self.up) = Default::default(),
            SdoResponse::BlockDownload { .. } => self.down.begin(),
            SdoResponse::BlockReceived { acknowledged, .. } => self.down.received(acknowledged),
            _ => {}
        }
        text.line(2, format_args!("{response}"));
        Ok(())
    }

    /// Remembers a mapping that is being written.
    fn learn(&mut self, mux: Mux, data: &[u8]) {
        let place = |first: u16| usize::from(mux.index.wrapping_sub(first));
        let mapping = match mux.index {
            0x1600..0x1604 => self.rpdos.get_mut(place(0x1600)),
            0x1A00..0x1A04 => self.tpdos.get_mut(place(0x1A00)),
            _ => None,
        };
        let Some(mapping) = mapping else { return };
        match (usize::from(mux.sub), data) {
            (0, [count, ..]) => mapping.count = *count,
            (sub, &[a, b, c, d]) => {
                if let Some(word) = mapping.words.get_mut(sub.wrapping_sub(1)) {
                    *word = u32::from_le_bytes([a, b, c, d]);
                }
            }
            _ => {}
        }
    }
}

/// Prints the objects of a PDO; without a mapping its bytes stand in the heading already.
fn pdo(mapping: Option<&Mapping>, data: &[u8], text: &mut Text) {
    let Some(mapping) = mapping.filter(|mapping| mapping.count > 0) else { return };
    let mut bit = 0_usize;
    for word in mapping.words.iter().take(usize::from(mapping.count)) {
        let (index, sub, bits) = (word >> 16, word >> 8 & 0xFF, usize::try_from(word & 0xFF).unwrap_or(0));
        let value = number(data, bit, bits);
        bit += bits;
        match value {
            Some(value) => {
                let digits = bits.div_ceil(4);
                text.line(2, format_args!("{index:04X}:{sub:02X} = {value} ({value:0digits$X}h)"));
            }
            None => text.line(2, format_args!("{index:04X}:{sub:02X} is missing")),
        }
    }
}

/// A field of up to 64 bits, the lowest first.
fn number(data: &[u8], from: usize, bits: usize) -> Option<u64> {
    if bits > 64 || from + bits > 8 * data.len() {
        return None;
    }
    let bit = |place: usize| u64::from(data[place / 8] >> (place % 8) & 1);
    Some((0..bits).fold(0, |value, place| value | bit(from + place) << place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::can::Id;
    use proptest::prelude::*;

    fn tree(canopen: &mut Canopen, id: u16, data: &[u8]) -> String {
        let mut text = Text::default();
        canopen.frame(&Frame::new(Id::Standard(id), data).unwrap(), &mut text);
        text.as_str().to_owned()
    }

    #[test]
    fn frames_are_told_with_what_came_before_them() {
        let mut canopen = Canopen::default();
        let frames: [(u16, &[u8]); 28] = [
            (0x000, &[0x82, 5]),
            (0x705, &[0]),
            (0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]),
            (0x585, &[0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0]),
            (0x605, &[0x23, 0x00, 0x1A, 1, 0x10, 0, 0x41, 0x60]),
            (0x585, &[0x60, 0x00, 0x1A, 1, 0, 0, 0, 0]),
            (0x605, &[0x23, 0x00, 0x1A, 2, 0x20, 0, 0x64, 0x60]),
            (0x605, &[0x2F, 0x00, 0x1A, 0, 2, 0, 0, 0]),
            (0x080, &[]),
            (0x080, &[7]),
            (0x185, &[0x27, 0x06, 0x01, 0, 0, 0]),
            (0x185, &[0x27, 0x06, 0x01]),
            (0x205, &[0x0F, 0]),
            (0x085, &[0x11, 0x86, 0x21, 1, 2, 3, 4, 5]),
            (0x100, &[0, 0, 0, 0, 1, 0]),
            (0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]),
            (0x7E4, &[0x44, 0, 0, 0, 0, 0, 0, 0]),
            // A block download of 8 bytes, whose second segment is lost at first.
            (0x605, &[0xC6, 0x00, 0x20, 0, 8, 0, 0, 0]),
            (0x585, &[0xA4, 0x00, 0x20, 0, 127, 0, 0, 0]),
            (0x605, &[0x01, 1, 2, 3, 4, 5, 6, 7]),
            (0x605, &[0x82, 8, 0, 0, 0, 0, 0, 0]),
            (0x585, &[0xA2, 1, 127, 0, 0, 0, 0, 0]),
            (0x605, &[0x81, 8, 0, 0, 0, 0, 0, 0]),
            (0x585, &[0xA2, 1, 127, 0, 0, 0, 0, 0]),
            (0x605, &[0xD9, 0x34, 0x12, 0, 0, 0, 0, 0]),
            (0x585, &[0xA1, 0, 0, 0, 0, 0, 0, 0]),
            (0x605, &[0x80, 0x00, 0x20, 0, 0, 0, 4, 5]),
            (0x7FF, &[1]),
        ];
        let mut text = String::new();
        for (id, data) in frames {
            text += &format!("{id:03X}{}\n", tree(&mut canopen, id, data));
        }
        insta::assert_snapshot!(text);
    }

    proptest! {
        #[test]
        fn no_frames_make_it_panic(frames in proptest::collection::vec((0..0x800_u16, proptest::collection::vec(any::<u8>(), 0..=8)), 0..40)) {
            let mut canopen = Canopen::default();
            for (id, data) in frames {
                tree(&mut canopen, id, &data);
            }
        }
    }
}
