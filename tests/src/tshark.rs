//! tshark as an independent reader of our frames.
//!
//! Judged are values and byte offsets, never labels: tshark 4.0 prints some labels of SERCOS III the wrong way round, and
//! names several fields after an older revision. It raises one warning on good frames, "CP is unknown" on telegrams with
//! the phase-switch bit, those of a foreign master included. It checks neither the SERCOS header CRC nor anything behind
//! the hot-plug field in CP3 and CP4.

use std::path::Path;
use std::process::Command;

/// One dissected field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its filter name, such as `cipm.update`.
    pub name: String,
    /// Byte offset in the frame.
    pub position: usize,
    /// Length in bytes.
    pub size: usize,
    /// The value as shown.
    pub show: String,
    /// The raw bytes in hexadecimal; of a field of some bits the whole bytes.
    pub value: String,
}

/// One dissected frame.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Its number in the file, from 1.
    pub number: usize,
    /// Names of its protocols in order, as PDML has them.
    pub protocols: Vec<String>,
    /// All fields in order.
    pub fields: Vec<Field>,
}

impl Frame {
    /// The first field of that name.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// All fields of that name in order.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Field> {
        self.fields.iter().filter(move |field| field.name == name)
    }

    /// Whether that protocol was dissected in it.
    #[must_use]
    pub fn has(&self, protocol: &str) -> bool {
        self.protocols.iter().any(|name| name == protocol)
    }
}

/// openSAFETY has no mark in a frame: its dissector guesses, now and then in the payload of a SERCOS telegram, and then
/// calls it malformed. None of our frames carry it.
/// Neither has CANopen: of all that may be on a CAN bus it is what ours carry.
const NO_GUESSING: [&str; 4] = ["--disable-protocol", "opensafety", "-d", "can.subdissector,canopen"];

/// Dissects a capture file with the display `filter` and further `arguments`.
///
/// # Panics
/// When tshark fails or prints no PDML.
#[must_use]
pub fn dissect(file: &Path, filter: &str, arguments: &[&str]) -> Vec<Frame> {
    let output = Command::new("tshark")
        .args(NO_GUESSING)
        .args(["-n", "-T", "pdml", "-r"])
        .arg(file)
        .args(["-Y", filter])
        .args([
            "-o",
            "ip.check_checksum:TRUE",
            "-o",
            "udp.check_checksum:TRUE",
            "-o",
            "tcp.check_checksum:TRUE",
        ])
        .args(arguments)
        .output()
        .expect("tshark can be started");
    assert!(output.status.success(), "tshark failed: {}", String::from_utf8_lossy(&output.stderr));
    parse_pdml(&String::from_utf8_lossy(&output.stdout))
}

/// Expert messages of at least warning severity: (frame number, message).
///
/// # Panics
/// When tshark fails.
#[must_use]
pub fn warnings(file: &Path) -> Vec<(usize, String)> {
    let output = Command::new("tshark")
        .args(NO_GUESSING)
        .args(["-n", "-r"])
        .arg(file)
        .args(["-Y", "_ws.expert.severity >= \"Warning\" || _ws.malformed", "-T", "fields"])
        .args(["-e", "frame.number", "-e", "_ws.expert.message", "-e", "_ws.malformed"])
        .output()
        .expect("tshark can be started");
    assert!(output.status.success(), "tshark failed: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| {
            let (number, message) = line.split_once('\t')?;
            Some((number.parse().ok()?, message.trim().to_owned()))
        })
        .collect()
}

/// Reads the PDML that tshark writes: one element a line, attributes in double quotes.
fn parse_pdml(text: &str) -> Vec<Frame> {
    let mut frames = Vec::new();
    let mut current: Option<Frame> = None;
    for line in text.lines().map(str::trim_start) {
        if line.starts_with("<packet") {
            current = Some(Frame::default());
        } else if line.starts_with("</packet") {
            frames.extend(current.take());
        } else if let Some(frame) = current.as_mut() {
            if line.starts_with("<proto ") {
                frame.protocols.extend(attribute(line, "name"));
            } else if line.starts_with("<field ") {
                let number = |name| attribute(line, name).and_then(|text| text.parse().ok()).unwrap_or(0);
                let field = Field {
                    name: attribute(line, "name").unwrap_or_default(),
                    position: number("pos"),
                    size: number("size"),
                    show: attribute(line, "show").unwrap_or_default(),
                    // Of a field of some bits the bytes it stands in.
                    value: attribute(line, "unmaskedvalue")
                        .or_else(|| attribute(line, "value"))
                        .unwrap_or_default(),
                };
                if field.name == "num" || field.name == "frame.number" {
                    frame.number = field.show.parse().unwrap_or(frame.number);
                }
                frame.fields.push(field);
            }
        }
    }
    frames
}

fn attribute(line: &str, name: &str) -> Option<String> {
    let start = line.find(&format!(" {name}=\""))? + name.len() + 3;
    let end = line[start..].find('"')? + start;
    Some(
        line[start..end]
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&quot;", "\"")
            .replace("&amp;", "&"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pdml_fields_keep_offset_size_and_value() {
        let frames = parse_pdml(
            "<packet>\n<proto name=\"siii\" pos=\"14\">\n<field name=\"frame.number\" show=\"7\"/>\n\
             <field name=\"siii.type\" showname=\"a &quot;b&quot;\" size=\"1\" pos=\"14\" show=\"0x60\" value=\"60\"/>\n</packet>\n",
        );
        assert_eq!(frames.len(), 1);
        assert_eq!(frames[0].number, 7);
        assert!(frames[0].has("siii"));
        let field = frames[0].field("siii.type").unwrap();
        assert_eq!((field.position, field.size, field.value.as_str()), (14, 1, "60"));
    }
}
