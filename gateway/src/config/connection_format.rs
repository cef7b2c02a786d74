//! `connection_format` of a `[[device]]`.

use profile_cip::wire::motion::Format;

use super::check::Checker;
use super::file::DeviceTable;
use crate::finding::registry as code;

impl Checker {
    /// The fixed format carries one axis, and not more.
    pub(super) fn connection_format(&mut self, table: &DeviceTable) -> Option<Format> {
        let Some(format) = &table.connection_format else { return Some(Format::Variable) };
        let axes = table.axes.get_ref().len();
        match format.get_ref().as_str() {
            "variable" => Some(Format::Variable),
            "fixed" if axes > 1 => self.report_as(
                code::CONTRADICTION,
                format.span(),
                format_args!("the fixed connection format for a device with {axes} axes"),
                "expected \"variable\", or a single axis in the device",
            ),
            "fixed" => Some(Format::Fixed),
            other => self.report_as(
                code::UNKNOWN_WORD,
                format.span(),
                format_args!("unknown connection format `{other}`"),
                "expected \"variable\" or \"fixed\"",
            ),
        }
    }
}
