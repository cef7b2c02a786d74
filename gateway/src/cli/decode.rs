//! `axisbridge decode`: prints the frames of a recording.

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

use profile_sercos::wire::describe::Names;
use profile_sercos::wire::idn::Idn;

use super::{CanKind, CliError, DecodeArguments, Side};
use crate::capture::can_bus::{CanBuses, CanProtocol};
use crate::capture::reader::Reader;
use crate::config::Config;
use crate::decode::{DecodeError, Options, Protocol, decode};
use crate::mapping::{Mapping, SercosDictionary, SercosIdn};

/// Prints to standard output. A recording that is damaged is printed as far as it can be read.
///
/// # Errors
/// The file cannot be read, or not to its end; the output cannot be written.
pub fn run(arguments: &DecodeArguments) -> Result<ExitCode, CliError> {
    print(arguments, &mut BufWriter::new(io::stdout().lock()))
}

fn print(arguments: &DecodeArguments, out: &mut dyn Write) -> Result<ExitCode, CliError> {
    let file = arguments.file.display();
    let reader = Reader::open(&arguments.file).map_err(|error| format!("{file}: {error}"))?;
    let mapping = Mapping::embedded().map_err(|errors| errors.to_string())?;
    let names = DictionaryNames(&mapping.dictionaries.sercos);
    let configured = match &arguments.config {
        Some(path) => CanBuses::of(&Config::load(path)?),
        None => CanBuses::default(),
    };
    let can = configured.with_rest(arguments.can.map(|protocol| match protocol {
        CanKind::Canopen => CanProtocol::Canopen,
        CanKind::Devicenet => CanProtocol::Devicenet,
    }));
    let outcome = decode(reader, &options(arguments, can), &names, out);
    // What was read before an error has to be seen before the error is.
    let outcome = match (outcome, out.flush()) {
        (Ok(_), Err(error)) => Err(DecodeError::Write(error)),
        (outcome, _) => outcome.map(|_| ()),
    };
    match outcome {
        // The reader has closed the pipe, as `head` does: it has seen enough.
        Err(DecodeError::Write(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ExitCode::SUCCESS),
        Err(DecodeError::Read(error)) => Err(format!("{file}: {error}").into()),
        Err(error @ DecodeError::Write(_)) => Err(error.into()),
        Ok(()) => Ok(ExitCode::SUCCESS),
    }
}

fn options(arguments: &DecodeArguments, can: CanBuses) -> Options {
    let first = arguments.from.max(1);
    let last = arguments.count.map_or(u64::MAX, |count| first.saturating_add(count).saturating_sub(1));
    let only = arguments.only.map(|side| match side {
        Side::Sercos => Protocol::Sercos,
        Side::Cip => Protocol::EtherNetIp,
        Side::Can => Protocol::Can,
    });
    Options { first, last, only, can, format: arguments.format, ..Options::default() }
}

/// Names and lengths of the SERCOS dictionary.
pub(super) struct DictionaryNames<'a>(pub &'a SercosDictionary);

impl DictionaryNames<'_> {
    /// The row of a parameter. Those of other parameter sets and structure instances are like those of the
    /// first.
    fn row(&self, idn: Idn) -> Option<&SercosIdn> {
        let first_set = idn.with_set(0);
        let first_instance = first_set.with_structure(0, first_set.element());
        [idn, first_set, first_instance].into_iter().find_map(|idn| self.0.idn(idn))
    }
}

impl Names for DictionaryNames<'_> {
    fn name(&self, idn: Idn) -> Option<&str> {
        self.row(idn).map(|row| row.name.as_str()).filter(|name| !name.is_empty())
    }

    fn length(&self, idn: Idn) -> Option<usize> {
        let row = self.row(idn).filter(|row| !row.list)?;
        row.length.map(usize::from)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::decode::Format;

    const RECORDING: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/captures/sercos3_startup_line2_part.pcap");

    fn arguments(file: impl Into<PathBuf>) -> DecodeArguments {
        DecodeArguments {
            file: file.into(),
            from: 1,
            count: None,
            only: None,
            config: None,
            can: None,
            format: Format::Text,
        }
    }

    /// The outcome, and the numbers of the frames printed.
    fn printed(arguments: &DecodeArguments) -> (Result<ExitCode, String>, Vec<u64>, String) {
        let mut out = Vec::new();
        let outcome = print(arguments, &mut out).map_err(|error| error.to_string());
        let text = String::from_utf8(out).unwrap();
        let heads = text.lines().filter_map(|line| line.strip_prefix("frame "));
        let numbers = heads.map(|head| head.split_whitespace().next().unwrap().parse().unwrap()).collect();
        (outcome, numbers, text)
    }

    #[test]
    fn a_range_is_printed_with_the_names_of_parameters() {
        let (outcome, numbers, text) = printed(&arguments(RECORDING));
        assert_eq!((outcome, numbers), (Ok(ExitCode::SUCCESS), (1..=674).collect()));
        for name in ["S-0-1002 Communication cycle time", "S-0-1050.1.6 Configuration list"] {
            assert!(text.contains(name), "{name}");
        }
        let some = DecodeArguments { from: 10, count: Some(3), ..arguments(RECORDING) };
        assert_eq!(printed(&some).1, [10, 11, 12]);
        let none = DecodeArguments { count: Some(0), ..arguments(RECORDING) };
        assert_eq!(printed(&none).1, [0; 0]);
    }

    #[test]
    fn one_side_is_printed_when_asked_for() {
        let sercos = DecodeArguments { only: Some(Side::Sercos), ..arguments(RECORDING) };
        assert_eq!(printed(&sercos).1.len(), 674);
        let cip = DecodeArguments { only: Some(Side::Cip), ..arguments(RECORDING) };
        assert_eq!(printed(&cip), (Ok(ExitCode::SUCCESS), Vec::new(), String::new()));
    }

    #[test]
    fn a_damaged_file_is_printed_up_to_the_damage_and_then_an_error() {
        let bytes = std::fs::read(RECORDING).unwrap();
        let path = std::env::temp_dir().join(format!("axisbridge-decode-{}.pcap", std::process::id()));
        // Within the second record: 24 bytes of file header, 16 of record header and the first frame before
        // it.
        let first_len = usize::try_from(u32::from_le_bytes(bytes[32..36].try_into().unwrap())).unwrap();
        std::fs::write(&path, &bytes[..24 + 16 + first_len + 20]).unwrap();
        let (outcome, numbers, _) = printed(&arguments(&path));
        std::fs::remove_file(&path).unwrap();
        let error = outcome.unwrap_err();
        assert!(error.starts_with(&format!("{}: offset ", path.display())), "{error}");
        assert_eq!(numbers, [1]);

        let (outcome, _, text) = printed(&arguments("/nonexistent/file.pcapng"));
        let error = outcome.unwrap_err();
        assert!(error.starts_with("/nonexistent/file.pcapng: ") && error.contains("No such file"), "{error}");
        assert_eq!(text, "");
    }

    #[test]
    fn a_reader_that_has_seen_enough_is_no_error_and_a_full_disk_is() {
        struct Broken(io::ErrorKind);
        impl Write for Broken {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(self.0.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Err(self.0.into())
            }
        }
        let few = DecodeArguments { count: Some(2), ..arguments(RECORDING) };
        for arguments in [few, arguments(RECORDING)] {
            let mut pipe = BufWriter::new(Broken(io::ErrorKind::BrokenPipe));
            assert_eq!(print(&arguments, &mut pipe).unwrap(), ExitCode::SUCCESS);
            let mut disk = BufWriter::new(Broken(io::ErrorKind::StorageFull));
            assert!(print(&arguments, &mut disk).unwrap_err().to_string().starts_with("cannot write: "));
        }
    }
}
