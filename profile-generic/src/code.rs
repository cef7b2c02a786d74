//! Open codes: enumerations that keep the values they do not know.

/// Writes an open code: a newtype over an unsigned integer with named constants.
///
/// A gateway forwards what it does not know and names what it does, so a code read from a wire or a file is
/// never refused for being unknown. The name of a value is the text after `=>`, or the constant's own name
/// without one.
///
/// ```
/// profile_generic::open_code! {
///     /// Colour of a lamp.
///     pub struct Lamp(u8) {
///         /// Steady red.
///         RED = 0x01 => "red",
///         /// Steady green.
///         GREEN = 0x02,
///     }
/// }
/// assert_eq!(Lamp::RED.to_string(), "red");
/// assert_eq!(Lamp(2).name(), Some("GREEN"));
/// assert_eq!(format!("{:?}", Lamp(0x7F)), "Lamp(0x7f)");
/// assert_eq!(Lamp::from_name("red"), Some(Lamp::RED));
/// ```
#[macro_export]
macro_rules! open_code {
    (
        $(#[$doc:meta])*
        $vis:vis struct $code:ident($repr:ty) {
            $( $(#[$row_doc:meta])* $constant:ident = $value:literal $(=> $text:literal)? ),* $(,)?
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis struct $code(pub $repr);

        impl $code {
            $( $(#[$row_doc])* $vis const $constant: Self = Self($value); )*

            /// Every named value with its name, in the order of declaration.
            $vis const NAMED: &'static [(Self, &'static str)] =
                &[$( (Self::$constant, $crate::open_code!(@name $constant $($text)?)) ),*];

            /// The name of this value, or `None` when it has none.
            $vis const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $( $value => Some($crate::open_code!(@name $constant $($text)?)), )*
                    #[allow(unreachable_patterns)]
                    _ => None,
                }
            }

            /// The value with this exact name.
            $vis fn from_name(name: &str) -> Option<Self> {
                Self::NAMED.iter().find(|(_, known)| *known == name).map(|(code, _)| *code)
            }
        }

        impl ::core::fmt::Display for $code {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match self.name() {
                    Some(name) => f.pad(name),
                    None => {
                        let width = 2 + 2 * ::core::mem::size_of::<$repr>();
                        write!(f, "{:#0width$x}", self.0)
                    }
                }
            }
        }

        impl ::core::fmt::Debug for $code {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                write!(f, "{}({self})", stringify!($code))
            }
        }

        impl From<$repr> for $code {
            fn from(value: $repr) -> Self {
                Self(value)
            }
        }

        impl From<$code> for $repr {
            fn from(code: $code) -> Self {
                code.0
            }
        }
    };
    (@name $constant:ident $text:literal) => { $text };
    (@name $constant:ident) => { stringify!($constant) };
}

/// Writes the name tables of a closed enumeration: `ALL`, `name`, `parse` and `Display`.
macro_rules! named_enum {
    (
        $(#[$doc:meta])*
        pub enum $name:ident { $( $(#[$row_doc:meta])* $variant:ident = $text:literal ),* $(,)? }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $( $(#[$row_doc])* $variant ),* }

        impl $name {
            /// Every value, in the order of declaration.
            pub const ALL: &'static [Self] = &[$( Self::$variant ),*];

            /// The name of this value, in snake case.
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $text ),* }
            }

            /// The value with this exact name.
            pub fn parse(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|value| value.name() == name)
            }
        }

        impl ::core::fmt::Display for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                f.pad(self.name())
            }
        }
    };
}
pub(crate) use named_enum;

#[cfg(test)]
mod tests {
    open_code! {
        /// A code for the tests.
        pub struct Word(u16) {
            /// One.
            ONE = 1 => "one",
            /// Two.
            TWO = 0x0002,
        }
    }

    named_enum! {
        /// An enumeration for the tests.
        pub enum Side {
            /// Left.
            Left = "left",
            /// Right.
            Right = "right",
        }
    }

    #[test]
    fn known_values_print_their_name_and_unknown_ones_their_number() {
        assert_eq!(Word::ONE.to_string(), "one");
        assert_eq!(format!("{:?} {:?}", Word::TWO, Word(0x1F)), "Word(TWO) Word(0x001f)");
        assert_eq!(format!("{:>5}", Word::ONE), "  one");
        assert_eq!((Word(3).name(), u16::from(Word::from(3))), (None, 3));
    }

    #[test]
    fn names_lead_back_to_values() {
        for (code, name) in Word::NAMED {
            assert_eq!(Word::from_name(name), Some(*code));
        }
        assert_eq!(Word::from_name("three"), None);
        assert_eq!(
            Side::ALL.iter().map(|side| Side::parse(side.name())).collect::<Vec<_>>(),
            [Some(Side::Left), Some(Side::Right)]
        );
        assert_eq!(Side::parse("LEFT"), None);
    }
}
