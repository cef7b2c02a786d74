//! The server's end of a channel.
//!
//! ```text
//!                  initiate download                     last segment
//! Idle ---------------------------------> Download ----------------------> Idle
//!      ---------------------------------> Upload ------------------------> Idle
//!                  initiate upload                       last segment sent
//!
//!      ---> BlockDownload --last segment--> BlockDownloadEnd --end, CRC good--> Idle
//!      ---> BlockUploadReady --start--> BlockUpload <--block acknowledged--> BlockUploadEnd --end--> Idle
//!
//! every state --abort, time-out, error--> Idle
//! ```
//!
//! A new transfer that is begun while another one is under way takes its place: the client has given that up. Only within a block
//! download it cannot be told from a segment.

use core::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use crate::wire::sdo::{
    Abort, BLOCK_MAX, BlockSegment, EXPEDITED_MAX, SDO_LEN, SEGMENT_LEN, SdoRequest, SdoResponse, Segment,
    Transfer, crc16,
};
use crate::wire::{AbortCode, Bytes, Error, Mux};

/// What a server gives access to: an object dictionary.
///
/// Values go in and out as a whole: what comes in segments or blocks is collected by the server, so that no object ever has
/// half of a value.
pub trait ObjectAccess {
    /// Copies the value of an object to the start of `into`, and returns how many bytes it has.
    ///
    /// # Errors
    /// The abort code that the client shall have; [`AbortCode::OUT_OF_MEMORY`] when `into` is too short.
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode>;

    /// Whether an object may be written now, `size` bytes if that is told. It is asked when a transfer begins, so that nobody
    /// sends what is refused in the end. Returns the most bytes that the object takes; of four bytes whose number is not told,
    /// no more than these are taken.
    ///
    /// # Errors
    /// The abort code that the client shall have.
    fn write_begins(&mut self, object: Mux, size: Option<u32>) -> Result<usize, AbortCode>;

    /// Writes a value. The object may refuse it by what it is.
    ///
    /// # Errors
    /// The abort code that the client shall have; the object is as before.
    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode>;
}

/// What a server can.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServerConfig {
    /// Bytes of the longest value, either way.
    pub capacity: usize,
    /// Segments per block that it takes, 1 to 127; 0 when it has no block transfers.
    pub block_size: u8,
    /// Longest time between two frames of a transfer.
    pub timeout: DurationNs,
}

impl Default for ServerConfig {
    fn default() -> Self {
        Self { capacity: 1024, block_size: BLOCK_MAX, timeout: DurationNs::from_millis(1000) }
    }
}

/// Where a transfer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServerState {
    /// There is none.
    Idle,
    /// Waits for a segment of a download.
    Download,
    /// Waits to be asked for a segment of an upload.
    Upload,
    /// Waits for segments of a block.
    BlockDownload,
    /// All segments are there: waits for the end of a block download.
    BlockDownloadEnd,
    /// Waits for the start of a block upload.
    BlockUploadReady,
    /// Sends a block, or waits for its acknowledgement.
    BlockUpload,
    /// Waits for the end of a block upload.
    BlockUploadEnd,
}

/// A server. One transfer at a time.
#[derive(Debug)]
pub struct Server {
    config: ServerConfig,
    state: ServerState,
    object: Mux,
    /// Of the present value: `len` bytes are there, `done` of them sent.
    buffer: Vec<u8>,
    len: usize,
    done: usize,
    /// Most bytes that the object takes.
    room: usize,
    size: Option<u32>,
    toggle: bool,
    crc: bool,
    /// The last segment of a block download that came: how much of it counts is not known yet.
    tail: Option<[u8; SEGMENT_LEN]>,
    /// Segments that came in order, or were sent, in this block.
    sequence: u8,
    block_size: u8,
    deadline: MonotonicTime,
    answer: Option<[u8; SDO_LEN]>,
}

type Handled = Result<SdoResponse, AbortCode>;

impl Server {
    /// A server without a transfer. A block size above 127 means 127.
    #[must_use]
    pub fn new(config: ServerConfig) -> Self {
        let config = ServerConfig { block_size: config.block_size.min(BLOCK_MAX), ..config };
        Self {
            state: ServerState::Idle,
            object: Mux::default(),
            buffer: vec![0; config.capacity],
            len: 0,
            done: 0,
            room: 0,
            size: None,
            toggle: false,
            crc: false,
            tail: None,
            sequence: 0,
            block_size: 0,
            deadline: MonotonicTime::ZERO,
            answer: None,
            config,
        }
    }

    /// Gives up the transfer without a word, as a reset of the communication does.
    pub fn reset(&mut self) {
        self.state = ServerState::Idle;
        self.answer = None;
    }

    /// Where the transfer is.
    #[must_use]
    pub fn state(&self) -> ServerState {
        self.state
    }

    /// When to call [`Server::poll`]: at once while there is something to send, or when the client is late.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.answer.is_some() || self.has_segment() {
            return Some(MonotonicTime::ZERO);
        }
        (self.state != ServerState::Idle).then_some(self.deadline)
    }

    /// The next frame to send.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<[u8; SDO_LEN]> {
        if let Some(answer) = self.answer.take() {
            self.deadline = now + self.config.timeout;
            return Some(answer);
        }
        if self.has_segment() {
            self.deadline = now + self.config.timeout;
            return Some(self.next_segment().emit());
        }
        if self.state != ServerState::Idle && now >= self.deadline {
            self.state = ServerState::Idle;
            return Some(Abort { mux: self.object, code: AbortCode::TIMEOUT }.emit());
        }
        None
    }

    /// Takes a frame from the client.
    ///
    /// # Errors
    /// [`Error::length`] when it has not eight bytes: it is ignored, and the transfer goes on.
    pub fn handle(
        &mut self,
        now: MonotonicTime,
        data: &[u8],
        objects: &mut impl ObjectAccess,
    ) -> Result<(), Error> {
        let handled = if self.state == ServerState::BlockDownload && Abort::parse(data).is_none() {
            match BlockSegment::parse(data) {
                Ok(segment) => self.take_block_segment(segment).transpose(),
                Err(error) if error.is_length() => return Err(error),
                Err(_) => Some(Err(AbortCode::SEQUENCE)),
            }
        } else {
            match SdoRequest::parse(data) {
                Ok(request) => self.take(request, objects),
                Err(error) if error.is_length() => return Err(error),
                Err(_) => Some(Err(AbortCode::COMMAND)),
            }
        };
        self.deadline = now + self.config.timeout;
        match handled {
            None => {}
            Some(Ok(response)) => self.answer = Some(response.emit()),
            Some(Err(code)) => {
                // Outside of a transfer no object is meant.
                let object = if self.state == ServerState::Idle { Mux::default() } else { self.object };
                self.state = ServerState::Idle;
                self.answer = Some(Abort { mux: object, code }.emit());
            }
        }
        Ok(())
    }

    /// Takes a frame that is no segment of a block.
    fn take(&mut self, request: SdoRequest, objects: &mut impl ObjectAccess) -> Option<Handled> {
        use SdoRequest as R;
        use ServerState as S;
        Some(match (self.state, request) {
            (_, R::Abort(_)) => {
                self.reset();
                return None;
            }
            (_, R::Download(object, transfer)) => {
                self.begin(object, |server| server.download(transfer, objects))
            }
            (_, R::Upload(object)) => self.begin(object, |server| server.upload(objects)),
            (_, R::BlockDownload { mux, crc, size }) => {
                self.begin(mux, |server| server.block_download(crc, size, objects))
            }
            (_, R::BlockUpload { mux, crc, block_size, switch_threshold }) => {
                self.begin(mux, |server| server.block_upload(crc, block_size, switch_threshold, objects))
            }
            (S::Download, R::DownloadSegment(segment)) => self.download_segment(segment, objects),
            (S::Upload, R::UploadSegment { toggle }) => self.upload_segment(toggle),
            (S::BlockDownloadEnd, R::EndBlockDownload { unused, crc }) => {
                self.end_block_download(unused, crc, objects)
            }
            (S::BlockUploadReady, R::StartBlockUpload) => {
                self.state = S::BlockUpload;
                self.sequence = 0;
                return None;
            }
            (S::BlockUpload, R::BlockReceived { acknowledged, block_size }) => {
                return self.block_received(acknowledged, block_size).transpose();
            }
            (S::BlockUploadEnd, R::EndBlockUpload) => {
                self.reset();
                return None;
            }
            _ => Err(AbortCode::COMMAND),
        })
    }

    /// Begins a transfer in the place of any other one.
    fn begin(&mut self, object: Mux, initiate: impl FnOnce(&mut Self) -> Handled) -> Handled {
        self.object = object;
        (self.len, self.done, self.toggle, self.tail, self.sequence) = (0, 0, false, None, 0);
        // Not idle: a refusal names the object.
        self.state = ServerState::Upload;
        initiate(self)
    }

    fn download(&mut self, transfer: Transfer, objects: &mut impl ObjectAccess) -> Handled {
        match transfer {
            Transfer::Expedited { data, sized } => {
                let size = sized.then(|| u32::try_from(data.len()).unwrap_or_default());
                let room = objects.write_begins(self.object, size)?;
                let len = if sized { data.len() } else { data.len().min(room) };
                objects.write(self.object, &data[..len])?;
                self.state = ServerState::Idle;
            }
            Transfer::Segmented { size } => {
                self.make_room(size, objects)?;
                self.state = ServerState::Download;
            }
        }
        Ok(SdoResponse::Download(self.object))
    }

    /// Asks the object whether it can be written.
    fn make_room(&mut self, size: Option<u32>, objects: &mut impl ObjectAccess) -> Result<(), AbortCode> {
        let room = objects.write_begins(self.object, size)?;
        let told = size.map_or(0, |size| usize::try_from(size).unwrap_or(usize::MAX));
        if told > room {
            return Err(AbortCode::TOO_LONG);
        }
        if told > self.buffer.len() {
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        (self.room, self.size) = (room, size);
        Ok(())
    }

    /// Keeps bytes of a download.
    fn append(&mut self, data: &[u8]) -> Result<(), AbortCode> {
        let end = self.len + data.len();
        if end > self.room {
            return Err(AbortCode::TOO_LONG);
        }
        let into = self.buffer.get_mut(self.len..end).ok_or(AbortCode::OUT_OF_MEMORY)?;
        into.copy_from_slice(data);
        self.len = end;
        Ok(())
    }

    /// Writes what has been collected.
    fn write(&mut self, objects: &mut impl ObjectAccess) -> Result<(), AbortCode> {
        if self.size.is_some_and(|size| usize::try_from(size) != Ok(self.len)) {
            return Err(AbortCode::LENGTH);
        }
        objects.write(self.object, &self.buffer[..self.len])
    }

    fn download_segment(&mut self, segment: Segment, objects: &mut impl ObjectAccess) -> Handled {
        self.check_toggle(segment.toggle)?;
        self.append(&segment.data)?;
        if segment.last {
            self.write(objects)?;
            self.state = ServerState::Idle;
        }
        Ok(SdoResponse::DownloadSegment { toggle: segment.toggle })
    }

    fn check_toggle(&mut self, toggle: bool) -> Result<(), AbortCode> {
        if toggle != self.toggle {
            return Err(AbortCode::TOGGLE);
        }
        self.toggle = !toggle;
        Ok(())
    }

    fn read(&mut self, objects: &mut impl ObjectAccess) -> Result<u32, AbortCode> {
        let len = objects.read(self.object, &mut self.buffer)?;
        if len > self.buffer.len() {
            return Err(AbortCode::OUT_OF_MEMORY);
        }
        self.len = len;
        u32::try_from(len).map_err(|_| AbortCode::OUT_OF_MEMORY)
    }

    fn upload(&mut self, objects: &mut impl ObjectAccess) -> Handled {
        let size = self.read(objects)?;
        Ok(self.initiate_upload(size))
    }

    fn initiate_upload(&mut self, size: u32) -> SdoResponse {
        let transfer = Transfer::expedited(&self.buffer[..self.len.min(EXPEDITED_MAX + 1)]);
        self.state = if transfer.is_some() { ServerState::Idle } else { ServerState::Upload };
        SdoResponse::Upload(self.object, transfer.unwrap_or(Transfer::Segmented { size: Some(size) }))
    }

    fn upload_segment(&mut self, toggle: bool) -> Handled {
        self.check_toggle(toggle)?;
        let data = Bytes::truncated(&self.buffer[self.done..self.len]);
        self.done += data.len();
        let last = self.done == self.len;
        if last {
            self.state = ServerState::Idle;
        }
        Ok(SdoResponse::UploadSegment(Segment { toggle, data, last }))
    }

    fn block_download(&mut self, crc: bool, size: Option<u32>, objects: &mut impl ObjectAccess) -> Handled {
        if self.config.block_size == 0 {
            return Err(AbortCode::COMMAND);
        }
        self.make_room(size, objects)?;
        (self.crc, self.block_size) = (crc, self.config.block_size);
        self.state = ServerState::BlockDownload;
        Ok(SdoResponse::BlockDownload { mux: self.object, crc: true, block_size: self.block_size })
    }

    /// Segments out of order are not taken. The last one of a block is answered with how far the good ones go.
    fn take_block_segment(&mut self, segment: BlockSegment) -> Result<Option<SdoResponse>, AbortCode> {
        if segment.sequence > self.block_size {
            return Err(AbortCode::SEQUENCE);
        }
        let in_order = segment.sequence == self.sequence + 1;
        if in_order {
            if let Some(tail) = self.tail.take() {
                self.append(&tail)?;
            }
            (self.tail, self.sequence) = (Some(segment.data), segment.sequence);
        }
        if !segment.last && segment.sequence < self.block_size {
            return Ok(None);
        }
        if in_order && segment.last {
            self.state = ServerState::BlockDownloadEnd;
        }
        let acknowledged = core::mem::take(&mut self.sequence);
        Ok(Some(SdoResponse::BlockReceived { acknowledged, block_size: self.block_size }))
    }

    fn end_block_download(&mut self, unused: u8, crc: u16, objects: &mut impl ObjectAccess) -> Handled {
        let tail = self.tail.take().unwrap_or_default();
        self.append(&tail[..SEGMENT_LEN - usize::from(unused.min(7))])?;
        if self.crc && crc16(0, &self.buffer[..self.len]) != crc {
            return Err(AbortCode::CRC);
        }
        self.write(objects)?;
        self.state = ServerState::Idle;
        Ok(SdoResponse::EndBlockDownload)
    }

    fn block_upload(
        &mut self,
        crc: bool,
        block_size: u8,
        threshold: u8,
        objects: &mut impl ObjectAccess,
    ) -> Handled {
        if self.config.block_size == 0 {
            return Err(AbortCode::COMMAND);
        }
        self.take_block_size(block_size)?;
        let size = self.read(objects)?;
        if self.len <= usize::from(threshold) {
            return Ok(self.initiate_upload(size));
        }
        self.crc = crc;
        self.state = ServerState::BlockUploadReady;
        Ok(SdoResponse::BlockUpload { mux: self.object, crc: true, size: Some(size) })
    }

    fn take_block_size(&mut self, block_size: u8) -> Result<(), AbortCode> {
        if !(1..=BLOCK_MAX).contains(&block_size) {
            return Err(AbortCode::BLOCK_SIZE);
        }
        self.block_size = block_size;
        Ok(())
    }

    /// First byte of the next segment of a block. An empty value has one segment.
    fn segment_at(&self) -> usize {
        self.done + usize::from(self.sequence) * SEGMENT_LEN
    }

    /// Whether a segment of a block can be sent.
    fn has_segment(&self) -> bool {
        let at = self.segment_at();
        self.state == ServerState::BlockUpload
            && self.sequence < self.block_size
            && (at < self.len || at == 0)
    }

    fn next_segment(&mut self) -> BlockSegment {
        let at = self.segment_at();
        let data = Bytes::<SEGMENT_LEN>::truncated(&self.buffer[at..self.len]);
        self.sequence += 1;
        BlockSegment { sequence: self.sequence, last: at + SEGMENT_LEN >= self.len, data: *data.padded() }
    }

    /// The client has taken a block up to a segment, and wants the rest again.
    fn block_received(&mut self, acknowledged: u8, block_size: u8) -> Result<Option<SdoResponse>, AbortCode> {
        if acknowledged > self.sequence {
            return Err(AbortCode::SEQUENCE);
        }
        self.take_block_size(block_size)?;
        self.done += usize::from(acknowledged) * SEGMENT_LEN;
        self.sequence = 0;
        if self.done == 0 || self.done < self.len {
            return Ok(None);
        }
        self.state = ServerState::BlockUploadEnd;
        let unused = u8::try_from(self.done - self.len).unwrap_or_default();
        let crc = if self.crc { crc16(0, &self.buffer[..self.len]) } else { 0 };
        Ok(Some(SdoResponse::EndBlockUpload { unused, crc }))
    }
}

impl fmt::Display for ServerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Idle => "idle",
            Self::Download => "download",
            Self::Upload => "upload",
            Self::BlockDownload => "block download",
            Self::BlockDownloadEnd => "block download end",
            Self::BlockUploadReady => "block upload ready",
            Self::BlockUpload => "block upload",
            Self::BlockUploadEnd => "block upload end",
        })
    }
}
