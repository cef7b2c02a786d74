//! What the file of a backup says besides the parameters: its format, and by what a drive is known to be of the same type.

/// The format of the files that are written, and the only one that is read.
pub const FORMAT: u32 = 1;

/// Longest file, bytes.
pub const BYTES_MAX: u64 = 64 * 1_024 * 1_024;

/// What a drive is asked about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Question {
    /// What it is called in the file.
    pub key: &'static str,
    /// The number of the parameter that answers it.
    pub id: &'static str,
    /// Whether drives of one type agree in it.
    pub of_type: bool,
}

const fn question(key: &'static str, id: &'static str, of_type: bool) -> Question {
    Question { key, id, of_type }
}

const SERCOS: &[Question] = &[
    question("vendor_name", "S-0-1300.0.2", false),
    question("vendor_code", "S-0-1300.0.3", true),
    question("device_name", "S-0-1300.0.4", false),
    question("device_id", "S-0-1300.0.5", true),
    question("hardware_revision", "S-0-1300.0.8", false),
    question("software_revision", "S-0-1300.0.9", false),
    question("serial_number", "S-0-1300.0.12", false),
    question("firmware", "S-0-0030", false),
    question("controller_type", "S-0-0140", true),
];
const CANOPEN: &[Question] = &[
    question("device_type", "1000:00", true),
    question("device_name", "1008:00", false),
    question("hardware_version", "1009:00", false),
    question("software_version", "100A:00", false),
    question("vendor", "1018:01", true),
    question("product", "1018:02", true),
    question("revision", "1018:03", false),
    question("serial_number", "1018:04", false),
];
const DEVICENET: &[Question] = &[
    question("vendor", "1.1.1", true),
    question("device_type", "1.1.2", true),
    question("product_code", "1.1.3", true),
    question("revision", "1.1.4", false),
    question("serial_number", "1.1.6", false),
    question("product_name", "1.1.7", false),
];

/// What the drives of a bus are asked, by the word for the bus in the file.
#[must_use]
pub fn questions(bus: &str) -> &'static [Question] {
    match bus {
        "sercos" => SERCOS,
        "canopen" => CANOPEN,
        _ => DEVICENET,
    }
}
