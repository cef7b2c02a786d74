//! The client's end of a channel.
//!
//! ```text
//! Idle --start--> Download ------> DownloadSegments ----------------------------------> Idle
//!            \--> Upload --------> UploadSegments ------------------------------------> Idle
//!            \--> BlockDownload -> BlockDownloadSegments -> BlockDownloadEnd ---------> Idle
//!            \--> BlockUpload ---> BlockUploadSegments ---> BlockUploadEnd -----------> Idle
//!
//! every state --abort, time-out, error--> Idle
//! BlockDownload, BlockUpload --command specifier unknown--> Download, Upload (automatic method)
//! ```
//!
//! Nothing is tried again by itself. An answer about another object is one that came too late, after a time-out: it is ignored.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::request::{Method, SdoFailure, SdoOperation, SdoOutcome, SdoRequest};
use crate::wire::sdo::{
    Abort, BLOCK_MAX, BlockSegment, EXPEDITED_MAX, SDO_LEN, SEGMENT_LEN, SdoRequest as Wire, SdoResponse,
    Segment, Transfer, crc16,
};
use crate::wire::{AbortCode, Bytes, Error, Mux};

/// From so many bytes on, blocks are quicker than segments.
const BLOCKS_FROM: usize = 100;

/// What a client does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClientConfig {
    /// Longest time that the server may take for an answer.
    pub timeout: DurationNs,
    /// Segments per block that it asks for, 1 to 127.
    pub block_size: u8,
}

impl Default for ClientConfig {
    fn default() -> Self {
        Self { timeout: DurationNs::from_millis(500), block_size: BLOCK_MAX }
    }
}

/// Where a transfer is: what is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClientState {
    /// There is none.
    Idle,
    /// The answer to the first frame of a download.
    Download,
    /// The answer to a segment.
    DownloadSegments,
    /// The answer to the first frame of an upload.
    Upload,
    /// A segment.
    UploadSegments,
    /// The answer to the first frame of a block download.
    BlockDownload,
    /// The answer to a block, which may not be complete yet.
    BlockDownloadSegments,
    /// The answer to the end of a block download.
    BlockDownloadEnd,
    /// The answer to the first frame of a block upload.
    BlockUpload,
    /// Segments of a block.
    BlockUploadSegments,
    /// The end of a block upload.
    BlockUploadEnd,
}

/// A client. One transfer at a time.
#[derive(Debug)]
pub struct Client {
    config: ClientConfig,
    state: ClientState,
    request: Option<SdoRequest>,
    outcome: Option<SdoOutcome>,
    /// The server has refused a block transfer as something unknown.
    no_blocks: bool,
    toggle: bool,
    crc: bool,
    size: Option<u32>,
    /// Bytes that the server has.
    done: usize,
    /// Bytes of the segment that is out.
    segment: usize,
    /// The last segment of a block upload that came: how much of it counts is not known yet.
    tail: Option<[u8; SEGMENT_LEN]>,
    /// Segments that came in order, or were sent, in this block.
    sequence: u8,
    block_size: u8,
    deadline: MonotonicTime,
    frame: Option<[u8; SDO_LEN]>,
}

/// What an answer leads to: a frame, silence, or the end.
type Step = Result<Option<Wire>, SdoFailure>;

const fn protocol(code: AbortCode) -> SdoFailure {
    SdoFailure::Protocol(code)
}

impl Client {
    /// A client without a transfer. The block size is taken into its range.
    #[must_use]
    pub fn new(config: ClientConfig) -> Self {
        Self {
            config: ClientConfig { block_size: config.block_size.clamp(1, BLOCK_MAX), ..config },
            state: ClientState::Idle,
            request: None,
            outcome: None,
            no_blocks: false,
            toggle: false,
            crc: false,
            size: None,
            done: 0,
            segment: 0,
            tail: None,
            sequence: 0,
            block_size: 0,
            deadline: MonotonicTime::ZERO,
            frame: None,
        }
    }

    /// Where the transfer is.
    #[must_use]
    pub fn state(&self) -> ClientState {
        self.state
    }

    /// Longest time for an answer to what is under way.
    fn timeout(&self) -> DurationNs {
        self.request.as_ref().and_then(|request| request.timeout).unwrap_or(self.config.timeout)
    }

    /// Whether a request can be started: nothing is under way, and the last outcome has been taken.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.request.is_none() && self.outcome.is_none()
    }

    /// Starts a request.
    ///
    /// # Errors
    /// The request, when another one is under way or its outcome has not been taken.
    #[allow(clippy::result_large_err, reason = "the request goes back with the caller's buffer")]
    pub fn start(&mut self, now: MonotonicTime, request: SdoRequest) -> Result<(), SdoRequest> {
        if !self.is_free() {
            return Err(request);
        }
        let much = match request.operation {
            SdoOperation::Upload => request.data.capacity(),
            SdoOperation::Download => request.data.as_slice().len(),
        };
        let blocks = match request.method {
            Method::Auto => much >= BLOCKS_FROM && !self.no_blocks,
            Method::Segments => false,
            Method::Blocks => true,
        };
        self.request = Some(request);
        self.begin(now, blocks);
        Ok(())
    }

    /// Ends the transfer: the server is told, and the outcome has this failure.
    pub fn cancel(&mut self, failure: SdoFailure) {
        if self.request.is_some() {
            self.abort(AbortCode::GENERAL);
            self.finish(Err(failure));
        }
    }

    /// Ends the transfer without a word to the server, which is not there any more. What it could do is forgotten.
    pub fn drop_server(&mut self) {
        self.frame = None;
        self.no_blocks = false;
        if self.request.is_some() {
            self.finish(Err(SdoFailure::NodeLost));
        }
    }

    /// Whether a request has ended whose outcome has not been taken.
    #[must_use]
    pub fn has_outcome(&self) -> bool {
        self.outcome.is_some()
    }

    /// The outcome of the request, once.
    pub fn take_outcome(&mut self) -> Option<SdoOutcome> {
        self.outcome.take()
    }

    /// When to call [`Client::poll`]: at once while there is something to send, or when the server is late.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.frame.is_some() || self.has_segment() {
            return Some(MonotonicTime::ZERO);
        }
        (self.state != ClientState::Idle).then_some(self.deadline)
    }

    /// The next frame to send.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<[u8; SDO_LEN]> {
        if let Some(frame) = self.frame.take() {
            self.deadline = now + self.timeout();
            return Some(frame);
        }
        if self.has_segment() {
            self.deadline = now + self.timeout();
            return Some(self.next_block_segment().emit());
        }
        if self.state != ClientState::Idle && now >= self.deadline {
            let milliseconds = u32::try_from(self.timeout().0 / 1_000_000).unwrap_or(u32::MAX);
            self.abort(AbortCode::TIMEOUT);
            self.finish(Err(SdoFailure::Timeout { milliseconds }));
            return self.frame.take();
        }
        None
    }

    /// Takes a frame from the server. `Ok(false)` when nobody has asked for it.
    ///
    /// # Errors
    /// [`Error::length`] when it has not eight bytes: it is ignored, and the transfer goes on.
    pub fn handle(&mut self, now: MonotonicTime, data: &[u8]) -> Result<bool, Error> {
        let segments = self.state == ClientState::BlockUploadSegments;
        let step = if segments && Abort::parse(data).is_none() {
            match BlockSegment::parse(data) {
                Ok(segment) => self.take_block_segment(segment),
                Err(error) if error.is_length() => return Err(error),
                Err(_) => Err(protocol(AbortCode::SEQUENCE)),
            }
        } else {
            let response = match SdoResponse::parse(data) {
                Err(error) if error.is_length() => return Err(error),
                response => response.ok(),
            };
            if self.is_stray(response) {
                return Ok(false);
            }
            match response {
                Some(response) => self.take(now, response),
                None => Err(protocol(AbortCode::COMMAND)),
            }
        };
        self.deadline = now + self.timeout();
        match step {
            Ok(Some(frame)) => self.frame = Some(frame.emit()),
            Ok(None) => {}
            Err(failure) => {
                match failure {
                    SdoFailure::Protocol(code) => self.abort(code),
                    SdoFailure::TooLong { .. } => self.abort(AbortCode::OUT_OF_MEMORY),
                    _ => self.frame = None,
                }
                self.finish(Err(failure));
            }
        }
        Ok(true)
    }

    fn object(&self) -> Mux {
        self.request.as_ref().map(|request| request.object).unwrap_or_default()
    }

    fn bytes(&self) -> &[u8] {
        self.request.as_ref().map(|request| request.data.as_slice()).unwrap_or_default()
    }

    /// Whether an answer belongs to no transfer, or to one that has been given up.
    fn is_stray(&self, response: Option<SdoResponse>) -> bool {
        use SdoResponse as R;
        let about = match response {
            Some(
                R::Upload(mux, _)
                | R::Download(mux)
                | R::BlockDownload { mux, .. }
                | R::BlockUpload { mux, .. }
                | R::Abort(Abort { mux, .. }),
            ) => mux,
            _ => self.object(),
        };
        // Some devices abort what they do not know with no object at all.
        let nameless = matches!(response, Some(R::Abort(_))) && about == Mux::default();
        self.state == ClientState::Idle || (about != self.object() && !nameless)
    }

    fn begin(&mut self, now: MonotonicTime, blocks: bool) {
        let Some(request) = &mut self.request else { return };
        (self.toggle, self.done, self.segment, self.tail, self.sequence) = (false, 0, 0, None, 0);
        let (mux, len) = (request.object, request.data.as_slice().len());
        let size = u32::try_from(len).ok();
        // An empty value has a segment, but no block has.
        let blocks = blocks && (request.operation == SdoOperation::Upload || len > 0);
        let (state, frame) = match (request.operation, blocks) {
            (SdoOperation::Upload, false) => (ClientState::Upload, Wire::Upload(mux)),
            (SdoOperation::Upload, true) => (
                ClientState::BlockUpload,
                Wire::BlockUpload { mux, crc: true, block_size: self.config.block_size, switch_threshold: 0 },
            ),
            (SdoOperation::Download, false) => {
                let transfer = Transfer::expedited(&request.data.as_slice()[..len.min(EXPEDITED_MAX + 1)]);
                let transfer = transfer.unwrap_or(Transfer::Segmented { size });
                (ClientState::Download, Wire::Download(mux, transfer))
            }
            (SdoOperation::Download, true) => {
                (ClientState::BlockDownload, Wire::BlockDownload { mux, crc: true, size })
            }
        };
        if request.operation == SdoOperation::Upload {
            request.data.clear();
        }
        self.state = state;
        self.frame = Some(frame.emit());
        self.deadline = now + self.timeout();
    }

    /// Tells the server that the transfer has ended.
    fn abort(&mut self, code: AbortCode) {
        self.frame = Some(Abort { mux: self.object(), code }.emit());
    }

    fn finish(&mut self, result: Result<(), SdoFailure>) {
        self.state = ClientState::Idle;
        if let Some(SdoRequest { object, operation, data, .. }) = self.request.take() {
            self.outcome = Some(SdoOutcome { object, operation, result, data });
        }
    }

    fn done(&mut self) -> Step {
        self.finish(Ok(()));
        Ok(None)
    }

    // Flat: one arm per state and response.
    fn take(&mut self, now: MonotonicTime, response: SdoResponse) -> Step {
        use ClientState as S;
        use SdoResponse as R;
        match (self.state, response) {
            (S::BlockDownload | S::BlockUpload, R::Abort(Abort { code: AbortCode::COMMAND, .. }))
                if self.automatic() =>
            {
                self.no_blocks = true;
                self.begin(now, false);
                Ok(None)
            }
            (_, R::Abort(abort)) => Err(SdoFailure::Refused(abort.code)),
            (S::Download, R::Download(_)) => {
                if (1..=EXPEDITED_MAX).contains(&self.bytes().len()) {
                    return self.done();
                }
                self.state = S::DownloadSegments;
                Ok(Some(self.next_segment()))
            }
            (S::DownloadSegments, R::DownloadSegment { toggle }) => {
                if toggle != self.toggle {
                    return Err(protocol(AbortCode::TOGGLE));
                }
                self.done += self.segment;
                if self.done == self.bytes().len() {
                    return self.done();
                }
                self.toggle = !toggle;
                Ok(Some(self.next_segment()))
            }
            (S::Upload, R::Upload(_, transfer)) => self.uploaded(transfer),
            // A server may answer so to a block upload of few bytes.
            (S::BlockUpload, R::Upload(_, transfer)) => self.uploaded(transfer),
            (S::UploadSegments, R::UploadSegment(segment)) => self.take_segment(segment),
            (S::BlockDownload, R::BlockDownload { crc, block_size, .. }) => {
                self.take_block_size(block_size)?;
                self.crc = crc;
                self.state = S::BlockDownloadSegments;
                Ok(None)
            }
            (S::BlockDownloadSegments, R::BlockReceived { acknowledged, block_size }) => {
                self.block_received(acknowledged, block_size)
            }
            (S::BlockDownloadEnd, R::EndBlockDownload) => self.done(),
            (S::BlockUpload, R::BlockUpload { crc, size, .. }) => {
                self.take_size(size)?;
                (self.crc, self.block_size) = (crc, self.config.block_size);
                self.state = S::BlockUploadSegments;
                Ok(Some(Wire::StartBlockUpload))
            }
            (S::BlockUploadEnd, R::EndBlockUpload { unused, crc }) => self.end_block_upload(unused, crc),
            _ => Err(protocol(AbortCode::COMMAND)),
        }
    }

    fn automatic(&self) -> bool {
        self.request.as_ref().is_some_and(|request| request.method == Method::Auto)
    }

    fn next_segment(&mut self) -> Wire {
        let data = Bytes::truncated(&self.bytes()[self.done..]);
        self.segment = data.len();
        let last = self.done + data.len() == self.bytes().len();
        Wire::DownloadSegment(Segment { toggle: self.toggle, data, last })
    }

    fn append(&mut self, bytes: &[u8]) -> Result<(), SdoFailure> {
        let Some(request) = &mut self.request else { return Ok(()) };
        let capacity = request.data.capacity();
        if request.data.append(bytes) { Ok(()) } else { Err(SdoFailure::TooLong { capacity }) }
    }

    fn take_size(&mut self, size: Option<u32>) -> Result<(), SdoFailure> {
        let capacity = self.request.as_ref().map_or(0, |request| request.data.capacity());
        if size.is_some_and(|size| usize::try_from(size).is_ok_and(|size| size > capacity)) {
            return Err(SdoFailure::TooLong { capacity });
        }
        self.size = size;
        Ok(())
    }

    fn check_size(&self) -> Result<(), SdoFailure> {
        match self.size {
            Some(size) if usize::try_from(size) != Ok(self.bytes().len()) => Err(protocol(AbortCode::LENGTH)),
            _ => Ok(()),
        }
    }

    fn uploaded(&mut self, transfer: Transfer) -> Step {
        match transfer {
            Transfer::Expedited { data, .. } => {
                self.append(&data)?;
                self.done()
            }
            Transfer::Segmented { size } => {
                self.take_size(size)?;
                self.state = ClientState::UploadSegments;
                Ok(Some(Wire::UploadSegment { toggle: false }))
            }
        }
    }

    fn take_segment(&mut self, segment: Segment) -> Step {
        if segment.toggle != self.toggle {
            return Err(protocol(AbortCode::TOGGLE));
        }
        self.append(&segment.data)?;
        if segment.last {
            self.check_size()?;
            return self.done();
        }
        self.toggle = !segment.toggle;
        Ok(Some(Wire::UploadSegment { toggle: self.toggle }))
    }

    fn take_block_size(&mut self, block_size: u8) -> Result<(), SdoFailure> {
        if !(1..=BLOCK_MAX).contains(&block_size) {
            return Err(protocol(AbortCode::BLOCK_SIZE));
        }
        self.block_size = block_size;
        Ok(())
    }

    fn segment_at(&self) -> usize {
        self.done + usize::from(self.sequence) * SEGMENT_LEN
    }

    /// Whether a segment of a block can be sent.
    fn has_segment(&self) -> bool {
        self.state == ClientState::BlockDownloadSegments
            && self.sequence < self.block_size
            && self.segment_at() < self.bytes().len()
    }

    fn next_block_segment(&mut self) -> BlockSegment {
        let at = self.segment_at();
        let rest = &self.bytes()[at..];
        let (data, last) = (Bytes::<SEGMENT_LEN>::truncated(rest), rest.len() <= SEGMENT_LEN);
        self.sequence += 1;
        BlockSegment { sequence: self.sequence, last, data: *data.padded() }
    }

    /// The server has taken a block up to a segment, and wants the rest again.
    fn block_received(&mut self, acknowledged: u8, block_size: u8) -> Step {
        if acknowledged > self.sequence {
            return Err(protocol(AbortCode::SEQUENCE));
        }
        self.take_block_size(block_size)?;
        self.done += usize::from(acknowledged) * SEGMENT_LEN;
        self.sequence = 0;
        let len = self.bytes().len();
        if self.done < len {
            return Ok(None);
        }
        self.state = ClientState::BlockDownloadEnd;
        let unused = u8::try_from(self.done - len).unwrap_or_default();
        let crc = if self.crc { crc16(0, self.bytes()) } else { 0 };
        Ok(Some(Wire::EndBlockDownload { unused, crc }))
    }

    /// Segments out of order are not taken. The last one of a block is answered with how far the good ones go.
    fn take_block_segment(&mut self, segment: BlockSegment) -> Step {
        if segment.sequence > self.block_size {
            return Err(protocol(AbortCode::SEQUENCE));
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
            self.state = ClientState::BlockUploadEnd;
        }
        let acknowledged = core::mem::take(&mut self.sequence);
        Ok(Some(Wire::BlockReceived { acknowledged, block_size: self.block_size }))
    }

    fn end_block_upload(&mut self, unused: u8, crc: u16) -> Step {
        let tail = self.tail.take().unwrap_or_default();
        // A last segment of which nothing counts would not have been sent: some servers (durand 0.5) say so of one that is full.
        // The size that was told decides; the CRC judges it.
        let full = u32::try_from(self.bytes().len() + SEGMENT_LEN).is_ok_and(|size| self.size == Some(size));
        let unused = if full { 0 } else { usize::from(unused.min(7)) };
        self.append(&tail[..SEGMENT_LEN - unused])?;
        if self.crc && crc16(0, self.bytes()) != crc {
            return Err(protocol(AbortCode::CRC));
        }
        self.check_size()?;
        self.finish(Ok(()));
        Ok(Some(Wire::EndBlockUpload))
    }
}
