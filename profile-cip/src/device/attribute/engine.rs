//! The attributes that the protocol engine itself works with: the rows are generated from the dictionary.

use profile_generic::interpolation::MAX_EXTRAPOLATION;

pub use crate::generated::attributes::{ENGINE, id};

/// Revision of the Motion Device Axis Object that the device speaks (clause 5-2.2).
pub const OBJECT_REVISION: u16 = 4;

/// Default and range of an attribute of instance 0 where the standard has none.
pub(super) struct Rule {
    pub id: u16,
    pub default: i64,
    pub range: (f64, f64),
}

/// Missed updates that are an alarm and a fault, in update periods: as many as the interpolator can go on for at most.
pub(super) const RULES: [Rule; 2] = [
    Rule { id: id::UPDATE_DELAY_HIGH_LIMIT, default: 4, range: DELAY_LIMITS },
    Rule { id: id::UPDATE_DELAY_LOW_LIMIT, default: 2, range: DELAY_LIMITS },
];

const DELAY_LIMITS: (f64, f64) = (0.0, MAX_EXTRAPOLATION as f64);

/// Numbers of attributes, and the table of those that every device has.
macro_rules! attributes {
    (
        always {
            $($scope:ident $name:ident = $id:literal, $type:ident, $access:ident, $default:expr,
            $text:literal $([$unit:literal])?;)*
        }
        else { $($other_scope:ident $other:ident = $other_id:literal, $other_text:literal $([$other_unit:literal])?;)* }
    ) => {
        /// Numbers of the attributes that the protocol engine itself works with.
        pub mod id {
            $(#[doc = concat!(stringify!($scope), ": ", $text $(, ", ", $unit)?, ".")] pub const $name: u16 = $id;)*
            $(#[doc = concat!(stringify!($other_scope), ": ", $other_text $(, ", ", $other_unit)?, ".")]
            pub const $other: u16 = $other_id;)*
        }

        /// Attributes that every device has: scope, number, type, access, default, name.
        pub const ENGINE: &[(
            crate::device::attribute::Scope,
            u16,
            crate::device::attribute::DataType,
            crate::device::attribute::Access,
            i64,
            &str,
        )] = {
            use crate::device::attribute::{Access, DataType, Scope};
            &[$((Scope::$scope, $id, DataType::$type, Access::$access, $default, $text)),*]
        };
    };
}
pub(crate) use attributes;
