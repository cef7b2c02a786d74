//! Service data block of both directions, clauses 6-2.7.1.2.5 and 6-2.7.2.1.8.
//!
//! | offset | C-to-D | D-to-C |
//! |---|---|---|
//! | 0 | transaction ID | transaction ID |
//! | 1 | service code | service code, without a reply bit |
//! | 2 | reserved | general status |
//! | 3 | reserved | extended status |
//! | 4 | request data | response data |
//!
//! The data is padded to 32 bits; the service itself says where it ends. The bodies are in
//! [`attribute_list`](super::attribute_list), [`id_list`](super::id_list) and [`test_service`](super::test_service).

use core::fmt;

use super::body::write_body;
use super::codes::MotionService;
use crate::wire::status::GeneralStatus;
use crate::wire::{Error, Reader, Writer};

/// Octets of either block without data.
pub const HEADER_LEN: usize = 4;
const BLOCK: &str = "service block";

/// Service request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceRequest<'a> {
    /// Transaction ID, incremented by the controller per request of this instance.
    pub transaction_id: u8,
    /// Service.
    pub service: MotionService,
    /// Service specific request data.
    pub data: &'a [u8],
}

/// Service response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServiceResponse<'a> {
    /// Transaction ID of the request.
    pub transaction_id: u8,
    /// Service of the request.
    pub service: MotionService,
    /// CIP general status; 0 is success.
    pub general_status: u8,
    /// Extended status; not defined by the standard.
    pub extended_status: u8,
    /// Service specific response data.
    pub data: &'a [u8],
}

impl<'a> ServiceRequest<'a> {
    /// Reads a block; all that follows the header is data.
    ///
    /// # Errors
    /// There are fewer than four octets.
    pub fn parse(block: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(block);
        let [transaction_id, service, _, _] = reader.array(BLOCK)?;
        Ok(Self { transaction_id, service: MotionService(service), data: reader.rest() })
    }

    /// Octets that [`ServiceRequest::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + self.data.len().next_multiple_of(4)
    }

    /// Writes the block and pads it to 32 bits.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BLOCK, &[self.transaction_id, self.service.0, 0, 0])?;
        writer.slice(BLOCK, self.data)?;
        writer.zeros(BLOCK, self.buffer_len() - HEADER_LEN - self.data.len())
    }
}

impl<'a> ServiceResponse<'a> {
    /// Reads a block; all that follows the header is data.
    ///
    /// # Errors
    /// There are fewer than four octets.
    pub fn parse(block: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(block);
        let [transaction_id, service, general_status, extended_status] = reader.array(BLOCK)?;
        let service = MotionService(service);
        Ok(Self { transaction_id, service, general_status, extended_status, data: reader.rest() })
    }

    /// Octets that [`ServiceResponse::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + self.data.len().next_multiple_of(4)
    }

    /// Writes the block and pads it to 32 bits.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let head = [self.transaction_id, self.service.0, self.general_status, self.extended_status];
        writer.slice(BLOCK, &head)?;
        writer.slice(BLOCK, self.data)?;
        writer.zeros(BLOCK, self.buffer_len() - HEADER_LEN - self.data.len())
    }
}

impl fmt::Display for ServiceRequest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Service Request {}: {}", self.transaction_id, self.service)?;
        write_body(f, self.service, false, self.data)
    }
}

impl fmt::Display for ServiceResponse<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "    Service Response {}: {}, {}, extended status 0x{:02X}",
            self.transaction_id,
            self.service,
            GeneralStatus(self.general_status),
            self.extended_status
        )?;
        write_body(f, self.service, true, self.data)
    }
}
