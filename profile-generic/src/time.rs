//! Points in time and spans of time, in nanoseconds.
//!
//! Two clocks meet in a gateway: the monotonic clock of the host, which engines are driven by, and the system
//! time of CIP Sync and IEEE 1588, which commands and captures are stamped with. They are different types and
//! do not subtract from each other.

use core::fmt;
use core::ops::{Add, Mul, Neg, Sub};

/// A span of time in nanoseconds; may be negative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DurationNs(pub i64);

impl DurationNs {
    /// No time at all.
    pub const ZERO: Self = Self(0);
    /// The longest span that can be told, some 292 years.
    pub const MAX: Self = Self(i64::MAX);

    /// A span of whole microseconds; saturates.
    pub const fn from_micros(micros: i64) -> Self {
        Self(micros.saturating_mul(1_000))
    }

    /// A span of whole milliseconds; saturates.
    pub const fn from_millis(millis: i64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// A span of whole seconds; saturates.
    pub const fn from_secs(secs: i64) -> Self {
        Self(secs.saturating_mul(1_000_000_000))
    }

    /// The span in nanoseconds.
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// The magnitude in nanoseconds.
    pub const fn magnitude(self) -> u64 {
        self.0.unsigned_abs()
    }
}

impl Add for DurationNs {
    type Output = Self;
    /// Saturates.
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for DurationNs {
    type Output = Self;
    /// Saturates.
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Mul<i64> for DurationNs {
    type Output = Self;
    /// Saturates.
    fn mul(self, times: i64) -> Self {
        Self(self.0.saturating_mul(times))
    }
}

impl Neg for DurationNs {
    type Output = Self;
    /// Saturates.
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Display for DurationNs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.unsigned_abs();
        let sign = if self.0 < 0 { "-" } else { "" };
        let (unit, name) = match magnitude {
            0..1_000 => (1, "ns"),
            1_000..1_000_000 => (1_000, "us"),
            1_000_000..1_000_000_000 => (1_000_000, "ms"),
            _ => (1_000_000_000, "s"),
        };
        let (whole, rest) = (magnitude / unit, magnitude % unit);
        if rest == 0 {
            return write!(f, "{sign}{whole} {name}");
        }
        let digits = match unit {
            1_000 => 3,
            1_000_000 => 6,
            _ => 9,
        };
        write!(f, "{sign}{whole}.{rest:0digits$} {name}")
    }
}

macro_rules! point_in_time {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u64);

        impl $name {
            /// The origin of this clock.
            pub const ZERO: Self = Self(0);
            /// The last instant that can be told.
            pub const MAX: Self = Self(u64::MAX);

            /// Nanoseconds since the origin of the clock.
            pub const fn as_nanos(self) -> u64 {
                self.0
            }

            /// This instant moved by `span`, or `None` beyond either end of the clock.
            pub const fn checked_add(self, span: DurationNs) -> Option<Self> {
                match self.0.checked_add_signed(span.0) {
                    Some(nanos) => Some(Self(nanos)),
                    None => None,
                }
            }

            /// The span from `earlier` to this instant; negative when `earlier` is later; saturates.
            pub const fn since(self, earlier: Self) -> DurationNs {
                let nanos = self.0.wrapping_sub(earlier.0).cast_signed();
                match (self.0 >= earlier.0, nanos >= 0) {
                    (true, false) => DurationNs(i64::MAX),
                    (false, true) => DurationNs(i64::MIN),
                    _ => DurationNs(nanos),
                }
            }
        }

        impl Add<DurationNs> for $name {
            type Output = Self;
            /// Saturates at both ends of the clock.
            fn add(self, span: DurationNs) -> Self {
                Self(self.0.saturating_add_signed(span.0))
            }
        }

        impl Sub<DurationNs> for $name {
            type Output = Self;
            /// Saturates at both ends of the clock.
            fn sub(self, span: DurationNs) -> Self {
                if span.0 >= 0 {
                    Self(self.0.saturating_sub(span.0.unsigned_abs()))
                } else {
                    Self(self.0.saturating_add(span.0.unsigned_abs()))
                }
            }
        }

        impl Sub for $name {
            type Output = DurationNs;
            /// Saturates.
            fn sub(self, earlier: Self) -> DurationNs {
                self.since(earlier)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}.{:09} s", self.0 / 1_000_000_000, self.0 % 1_000_000_000)
            }
        }
    };
}

point_in_time! {
    /// An instant of the host's monotonic clock, in nanoseconds since an origin that has no meaning of its
    /// own.
    MonotonicTime
}

point_in_time! {
    /// An instant of the system time of CIP Sync (IEC 61800-7-202, 3.1.46) and IEEE 1588, in nanoseconds
    /// since 1970-01-01.
    SystemTime
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_and_spans_add_up() {
        let start = MonotonicTime(1_000);
        assert_eq!(start + DurationNs::from_micros(2), MonotonicTime(3_000));
        assert_eq!(start - DurationNs(400), MonotonicTime(600));
        assert_eq!(start - DurationNs(-400), MonotonicTime(1_400));
        assert_eq!(MonotonicTime(3_000) - start, DurationNs(2_000));
        assert_eq!(start - MonotonicTime(3_000), DurationNs(-2_000));
    }

    #[test]
    fn the_ends_of_the_clock_saturate() {
        assert_eq!(SystemTime(5) - DurationNs(9), SystemTime::ZERO);
        assert_eq!(SystemTime(5) + DurationNs(-9), SystemTime::ZERO);
        assert_eq!(SystemTime::MAX + DurationNs(1), SystemTime::MAX);
        assert_eq!(SystemTime::MAX.checked_add(DurationNs(1)), None);
        assert_eq!(SystemTime::MAX.since(SystemTime::ZERO), DurationNs::MAX);
        assert_eq!(SystemTime::ZERO.since(SystemTime::MAX), DurationNs(i64::MIN));
    }

    #[test]
    fn spans_print_in_the_unit_that_suits() {
        let cases = [(0, "0 ns"), (999, "999 ns"), (31_250, "31.250 us"), (-2_000_000, "-2 ms")];
        for (nanos, text) in cases {
            assert_eq!(DurationNs(nanos).to_string(), text);
        }
        assert_eq!(DurationNs(1_500_000_000).to_string(), "1.500000000 s");
        assert_eq!(SystemTime(1_000_000_007).to_string(), "1.000000007 s");
    }
}
