//! Reading a data sheet, and where an object stands in it.

use std::ops::Range;
use std::path::Path;

use profile_cia402::eds::{self, DeviceDescription, Severity};
use profile_cia402::wire::{Mux, NodeId};

use crate::config::{CanDevice, Written, device_file};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source, Spanned, read_bytes};

/// A data sheet.
#[derive(Debug)]
pub struct Sheet {
    /// Its path, as it is shown.
    pub path: String,
    /// Its text, as it is shown.
    pub text: String,
    /// What it says.
    pub description: DeviceDescription,
    /// The text by itself.
    source: Source,
}

impl Sheet {
    /// Reads the file of a device; `None` with an error.
    pub fn load(
        written: &Written,
        device: &CanDevice,
        path: &Path,
        key: &Spanned<String>,
        findings: &mut Findings,
    ) -> Option<Self> {
        let problem = |code| Problem::new(code, key.span()).key("eds");
        let most = u64::try_from(eds::BYTES_MAX).unwrap_or(u64::MAX);
        let bytes = match read_bytes(path, most) {
            Ok(bytes) => bytes,
            Err((code, expected)) => {
                let problem = problem(code).expected(expected);
                findings
                    .push(&written.text, problem.help("the path starts at the folder of the configuration"));
                return None;
            }
        };
        let reading = match eds::read(&bytes) {
            Ok(reading) => reading,
            Err(error) => {
                findings.push_file(code::DATA_SHEET, path, error.to_string());
                return None;
            }
        };
        let text = device_file::shown(&bytes);
        if !text.lines().any(device_file::is_of_a_data_sheet) || reading.description.objects.is_empty() {
            let problem = problem(code::DATA_SHEET).title("the file is neither an EDS nor a DCF");
            let expected = "expected a file with sections such as [FileInfo] and [1000]";
            findings.push(&written.text, problem.expected(expected));
            return None;
        }
        let path = path.display().to_string();
        let source = Source::new(&path, &text);
        for diagnostic in reading.diagnostics.list() {
            if diagnostic.severity() != Severity::Note {
                let problem = device_file::problem(&source, code::DEVICE_FILE_ODD, diagnostic);
                findings.push(&source, problem);
            }
        }
        let made_for = reading.description.commissioning.as_ref().and_then(|head| head.node_id);
        if let Some(node) =
            made_for.and_then(|node| NodeId::new(node).ok()).filter(|node| *node != device.node)
        {
            let problem =
                problem(code::DEVICE_FILE_ODD).title(format!("the file was made for node-id {node}"));
            let expected =
                format!("expected {}: values with $NODEID are right, others may not be", device.node);
            findings.push(&written.text, problem.expected(expected));
        }
        Some(Self { path, text, description: reading.description, source })
    }

    /// The section of an object; empty where the file has none.
    pub fn place(&self, object: Mux) -> Range<usize> {
        device_file::place(&self.source, object)
    }
}
