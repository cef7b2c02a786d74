//! The socket address item (0x8000, 0x8001) and the same block inside the identity item.
//!
//! | offset | size | field (big-endian, unlike the rest) |
//! |---|---|---|
//! | 0 | 2 | address family, 2 = IPv4 |
//! | 2 | 2 | port |
//! | 4 | 4 | address |
//! | 8 | 8 | zero |

use super::{Error, Reader, Writer};
use core::net::{Ipv4Addr, SocketAddrV4};

/// Length of the block in bytes.
pub const SOCKADDR_LEN: usize = 16;

/// The only address family there is.
pub const FAMILY_IPV4: u16 = 2;

/// An IPv4 socket address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SockaddrInfo {
    /// Address and port.
    pub address: SocketAddrV4,
}

impl SockaddrInfo {
    /// Reads exactly this block. The last eight bytes are ignored, as some senders leave them unset.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::trailing`], [`Error::invalid`] for another address family.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut r = Reader::new(bytes);
        let value = Self::read(&mut r)?;
        r.finish("sockaddr")?;
        Ok(value)
    }

    /// Reads the block where `r` stands.
    ///
    /// # Errors
    /// [`Error::truncated`], [`Error::invalid`] for another address family.
    pub fn read(r: &mut Reader<'_>) -> Result<Self, Error> {
        let offset = r.offset();
        let family = u16::from_be_bytes(r.array("sockaddr family")?);
        if family != FAMILY_IPV4 {
            let (found, expected) = (u32::from(family), u32::from(FAMILY_IPV4));
            return Err(Error::invalid("sockaddr family", offset, expected, found));
        }
        let port = u16::from_be_bytes(r.array("sockaddr port")?);
        let address = Ipv4Addr::from(r.array::<4>("sockaddr address")?);
        r.take("sockaddr zero", 8)?;
        Ok(Self { address: SocketAddrV4::new(address, port) })
    }

    /// Always [`SOCKADDR_LEN`].
    pub const fn buffer_len(&self) -> usize {
        SOCKADDR_LEN
    }

    /// Writes the block and returns its length.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut w = Writer::new(buffer);
        self.write(&mut w)?;
        Ok(w.written())
    }

    /// Writes the block where `w` stands.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn write(&self, w: &mut Writer<'_>) -> Result<(), Error> {
        w.slice("sockaddr family", &FAMILY_IPV4.to_be_bytes())?;
        w.slice("sockaddr port", &self.address.port().to_be_bytes())?;
        w.slice("sockaddr address", &self.address.ip().octets())?;
        w.zeros("sockaddr zero", 8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    #[test]
    fn vectors_both_ways() {
        let vectors: &[(&str, &[u8], SockaddrInfo)] = &[(
            "port 2222 of 192.168.1.10",
            &[0, 2, 0x08, 0xAE, 192, 168, 1, 10, 0, 0, 0, 0, 0, 0, 0, 0],
            SockaddrInfo { address: SocketAddrV4::new(Ipv4Addr::new(192, 168, 1, 10), 2222) },
        )];
        check_vectors!(vectors, SockaddrInfo);
    }

    #[test]
    fn another_family_is_refused() {
        let mut bytes = [0; 16];
        bytes[0] = 2;
        assert_eq!(SockaddrInfo::parse(&bytes), Err(Error::invalid("sockaddr family", 0, 2, 0x200)));
    }

    proptest! {
        #[test]
        fn round_trip(ip: [u8; 4], port: u16) {
            let value = SockaddrInfo { address: SocketAddrV4::new(Ipv4Addr::from(ip), port) };
            let mut buffer = [0xA5; SOCKADDR_LEN];
            prop_assert_eq!(value.emit(&mut buffer), Ok(SOCKADDR_LEN));
            prop_assert_eq!(SockaddrInfo::parse(&buffer), Ok(value));
        }
    }
}
