//! Why an SDO transfer ends: abort codes.

pub use crate::generated::codes::AbortCode;

impl AbortCode {
    /// Whether the device does not have the object or the sub-index.
    #[must_use]
    pub const fn is_absent(self) -> bool {
        matches!(self, Self::NO_OBJECT | Self::NO_SUB_INDEX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_ascend_and_print_their_names() {
        assert_eq!(AbortCode::NAMED.len(), 31);
        assert!(AbortCode::NAMED.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(AbortCode(0x0602_0000).to_string(), "object does not exist");
        // Only devices on EtherCAT send it.
        assert_eq!(AbortCode(0x0601_0003).to_string(), "0x06010003");
        let absent = AbortCode::NAMED.iter().filter(|(code, _)| code.is_absent()).count();
        assert_eq!(absent, 2);
    }
}
