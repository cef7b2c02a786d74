//! Error codes of the service channel: the info's low word when S-SVC has its error bit set.

pub use crate::generated::codes::SvcError;

impl SvcError {
    /// The error `x001`..`x005` of an element: `base` is one of the low digits 1..=5.
    #[must_use]
    pub const fn of_element(element: super::svc::Element, base: u8) -> SvcError {
        SvcError((element.number() as u16) << 12 | (base & 0xF) as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::super::svc::Element;
    use super::*;

    #[test]
    fn names() {
        assert_eq!(SvcError(0x7007).to_string(), "operation data is above the maximum");
        assert_eq!(SvcError(0x8000).to_string(), "0x8000");
        assert_eq!(SvcError::of_element(Element::Data, 4), SvcError::DATA_READ_ONLY);
        assert_eq!(SvcError::of_element(Element::Name, 1), SvcError::NO_NAME);
        assert_eq!(SvcError::of_element(Element::Idn, 1), SvcError::NO_IDN);
    }

    #[test]
    fn codes_ascend_and_unused_ones_have_no_name() {
        assert!(SvcError::NAMED.windows(2).all(|pair| pair[0].0 < pair[1].0));
        // Attribute and operation data always exist: 3001 and 7001 are not used.
        assert_eq!((SvcError(0x3001).name(), SvcError(0x7001).name()), (None, None));
    }
}
