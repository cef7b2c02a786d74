//! The catalogue of generic parameters. Its rows are generated from `mappings/tables/dictionary/generic.toml`.

use super::{Access, ParameterType};
use crate::functional_element::FunctionalElement;
pub use crate::generated::parameters::{CATALOGUE, Parameter};
use crate::quantity::Quantity;

/// What the catalogue says about one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterRow {
    /// Which parameter.
    pub parameter: Parameter,
    /// Where it belongs.
    pub element: FunctionalElement,
    /// What it measures; decides the unit.
    pub quantity: Quantity,
    /// How it is held.
    pub kind: ParameterType,
    /// When it may be written.
    pub access: Access,
    /// What it is, in a sentence.
    pub description: &'static str,
}

impl Parameter {
    /// The lowest number of a parameter that an overlay defines; the catalogue keeps below it.
    pub const FIRST_OF_VENDOR: u16 = 0x8000;

    /// Whether an overlay defines the parameter, and the catalogue does not.
    pub const fn is_of_vendor(self) -> bool {
        self.0 >= Self::FIRST_OF_VENDOR
    }

    /// The row of the catalogue for this parameter.
    pub fn row(self) -> Option<&'static ParameterRow> {
        let index = CATALOGUE.binary_search_by_key(&self, |row| row.parameter).ok()?;
        CATALOGUE.get(index)
    }
}

/// One row per parameter: constant, number, name, functional element, quantity, type, access, description.
/// Numbers rise; the high byte groups them.
macro_rules! parameter_rows {
    ($( $constant:ident = $number:literal, $name:literal, $element:ident, $quantity:ident, $kind:ident,
        $access:ident, $description:literal; )*) => {
        $crate::open_code! {
            /// A generic parameter.
            pub struct Parameter(u16) {
                $( #[doc = $description] $constant = $number => $name, )*
            }
        }

        /// The catalogue in the order of the numbers.
        pub const CATALOGUE: &[$crate::parameter::ParameterRow] = &[$( $crate::parameter::ParameterRow {
            parameter: Parameter::$constant,
            element: $crate::functional_element::FunctionalElement::$element,
            quantity: $crate::quantity::Quantity::$quantity,
            kind: $crate::parameter::ParameterType::$kind,
            access: $crate::parameter::Access::$access,
            description: $description,
        } ),*];
    };
}
pub(crate) use parameter_rows;
