//! The command line: a contract, since scripts depend on it.
//!
//! Data goes to standard output, errors and progress to standard error. Exit status 0 is good, 1 findings or failure, 2 usage.

mod check;
mod decode;
mod demo;
mod dictionary;
mod doctor;
mod eds;
mod progress;
mod report;
mod run;
mod scan;
mod scan_can;
mod script;
mod signal;
mod simulate;
mod snapshot;
mod translate;

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgGroup, Args, Parser, Subcommand};
use profile_generic::time::DurationNs;

use crate::simulate::clock::{ClockPlan, ClockStep};

/// Motion protocol gateway: to a controller it is CIP Motion drives; behind it, it masters the real ones.
#[derive(Debug, Parser)]
#[command(name = "axisbridge", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the whole chain in one process: controller, gateway and two simulated SERCOS III drives.
    Demo(DemoArguments),
    /// Run the gateway box.
    Run(RunArguments),
    /// Check mapping tables, overlays and a configuration, and explain what is found.
    Check(CheckArguments),
    /// Write the electronic data sheets of the devices for the controller's tool.
    Eds(EdsArguments),
    /// Look at this host: is it fit for the box, and for its cycles.
    Doctor(DoctorArguments),
    /// Look at the south bus: who is there, and a configuration to begin with.
    Scan(ScanArguments),
    /// Print the frames of a capture file as an indented tree.
    Decode(DecodeArguments),
    /// Print what the mapping tables make of frames, and which row made each value.
    Translate(TranslateArguments),
    /// Compare translated frames with the golden texts next to them.
    Snapshot(SnapshotArguments),
    /// Print what a profile has: attributes, parameters, codes, services.
    Dictionary(DictionaryArguments),
    /// Run the other side of a protocol as a process of its own.
    #[command(subcommand)]
    Simulate(Simulate),
}

/// Arguments of `demo`.
#[derive(Debug, Args)]
struct DemoArguments {
    /// How long the axes move, in seconds (1 to 3600).
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// Print the result as one JSON object on standard output.
    #[arg(long)]
    json: bool,
    /// Address on which the gateway's EtherNet/IP side listens (TCP and UDP 44818, UDP 2222).
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.2")]
    listen: std::net::Ipv4Addr,
    /// What is behind the box, one axis on each; the last kind has the rest of the two axes, a third kind has a third axis.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES)]
    drives: Vec<demo::DriveKind>,
    /// Where to write the recording of both sides.
    #[arg(long, value_name = "FILE", default_value = "axisbridge-demo.pcapng")]
    capture: PathBuf,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
struct RunArguments {
    /// The configuration of the box (TOML).
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Record both sides into this file (pcapng).
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
struct CheckArguments {
    /// The configuration of a box (TOML), with the tables and overlays that it names.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A folder of tables in place of the built-in ones, an overlay, or a folder of overlays; may be given several times, and
    /// comes after those of the configuration.
    #[arg(long, value_name = "PATH")]
    mappings: Vec<PathBuf>,
    /// How to print it.
    #[arg(long, value_enum, default_value_t = CheckFormat::Text)]
    format: CheckFormat,
    /// Show notes as well (JSON has them anyway).
    #[arg(long)]
    notes: bool,
    /// Write the tables and what was found as a page for a browser.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Print the JSON Schema of a kind of file and check nothing; without NAME, the names of all.
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = "", conflicts_with_all = ["config", "mappings", "notes", "list", "explain"])]
    schema: Option<String>,
    /// Explain a code, such as AX0012, and check nothing.
    #[arg(long, value_name = "CODE", conflicts_with_all = ["config", "mappings", "notes", "list"])]
    explain: Option<String>,
    /// List all codes, and check nothing.
    #[arg(long, conflicts_with_all = ["config", "mappings", "notes"])]
    list: bool,
}

/// How `check` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum CheckFormat {
    /// Each finding with its line.
    #[value(alias = "human")]
    Text,
    /// One object, for programs.
    Json,
    /// Of `--list` only: the page of the documentation.
    Markdown,
}

/// Arguments of `eds`.
#[derive(Debug, Args)]
struct EdsArguments {
    /// The configuration of the box (TOML).
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Only the device with this name.
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Write each sheet into this folder as NAME.eds; without it the one sheet goes to standard output.
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Arguments of `doctor`.
#[derive(Debug, Args)]
struct DoctorArguments {
    /// The configuration of the box (TOML): its cycles, interfaces, addresses and real-time settings are tried.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// How long each cycle is tried, in seconds (1 to 3600).
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Arguments of `scan`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("bus").required(true).args(["config", "interface"])))]
struct ScanArguments {
    /// Look at the bus of this configuration, and say where it is another one.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Look at what hangs on this network interface.
    #[arg(long, value_name = "IF")]
    interface: Option<String>,
    /// The interface at the other end of the ring, or of a second line.
    #[arg(long, value_name = "IF2", requires = "interface")]
    ring: Option<String>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Arguments of `translate`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("frames").required(true).args(["file", "hex"])))]
struct TranslateArguments {
    /// A recording (pcapng or pcap), or a list of frames as text: one a line, in hexadecimal.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// One frame: an Ethernet frame, a class 1 datagram, a CIP Motion update, or a line of a list.
    #[arg(long, value_name = "BYTES")]
    hex: Option<String>,
    /// Axes, drives and tables of this configuration; without it, those of the demonstration.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The drives of the demonstration, as `demo` takes them.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES, conflicts_with = "config")]
    drives: Vec<demo::DriveKind>,
    /// What the drives of the machine hold, their scaling before all: a list of `idn` and `object` lines. Without it simulated
    /// drives stand in for them.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Arguments of `snapshot`.
#[derive(Debug, Args)]
struct SnapshotArguments {
    /// The folder with the frames: lists (*.hex) and recordings (*.pcapng, *.pcap).
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Axes, drives and tables of this configuration; without it, those of DIR/config.toml, or of the demonstration.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The drives of the demonstration, as `demo` takes them.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES, conflicts_with = "config")]
    drives: Vec<demo::DriveKind>,
    /// What the drives of the machine hold, their scaling before all: a list of `idn` and `object` lines. Without it simulated
    /// drives stand in for them.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,
    /// Make what is found now the golden texts.
    #[arg(long)]
    accept: bool,
}

/// Arguments of `decode`.
#[derive(Debug, Args)]
struct DecodeArguments {
    /// A pcap or pcapng file.
    file: PathBuf,
    /// First frame to print, counted from 1.
    #[arg(long, value_name = "N", default_value_t = 1)]
    from: u64,
    /// Print at most this many frames.
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Print frames of this side only.
    #[arg(long, value_enum)]
    only: Option<Side>,
    /// Tells CANopen and DeviceNet apart by the interfaces of this configuration. Recordings of the box tell it themselves.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// What CAN interfaces have that nothing else tells of; without it they are read as CANopen, and the tree says so.
    #[arg(long, value_enum)]
    can: Option<CanKind>,
}

/// What runs on a CAN interface of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum CanKind {
    /// CANopen.
    Canopen,
    /// DeviceNet.
    Devicenet,
}

/// Which protocol `decode` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Side {
    /// SERCOS III.
    Sercos,
    /// EtherNet/IP, CIP and CIP Motion.
    Cip,
    /// CAN with CANopen or DeviceNet.
    Can,
}

/// Arguments of `dictionary`.
#[derive(Debug, Args)]
struct DictionaryArguments {
    /// Whose dictionary.
    #[arg(value_enum)]
    profile: DictionaryProfile,
    /// How to print it.
    #[arg(long, value_enum, default_value_t = DictionaryFormat::Csv)]
    format: DictionaryFormat,
    /// What of it. cip has instance (when it is not given), class, enums, services, networks, faults; sercos has idns and
    /// communication (both when it is not given), bits, codes; cia402 has objects (when it is not given), codes; generic has
    /// instance.
    #[arg(long, value_enum)]
    part: Option<DictionaryPart>,
    /// A folder of mapping tables; a file that is not there is taken from the binary.
    #[arg(long, value_name = "DIR")]
    mappings: Option<PathBuf>,
}

/// Whose dictionary `dictionary` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DictionaryProfile {
    /// CIP Motion: the Motion Device Axis Object.
    Cip,
    /// SERCOS: the parameters of a drive.
    Sercos,
    /// CANopen with the drive profile CiA 402: objects of a device and its axes.
    Cia402,
    /// The generic drive model between them.
    Generic,
}

/// How `dictionary` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DictionaryFormat {
    /// Comma separated values, with the names of the columns first.
    Csv,
    /// An array of objects with the names of the columns as keys.
    Json,
}

/// What `dictionary` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DictionaryPart {
    /// cip: attributes of an axis; generic: parameters and signals.
    Instance,
    /// Attributes of instance 0.
    Class,
    /// Codes and bits.
    Enums,
    /// Services.
    Services,
    /// Object classes and I/O connection on each CIP network.
    Networks,
    /// Conditions of faults, alarms and inhibits, and what they do.
    Faults,
    /// IDNs of the drive profile.
    Idns,
    /// IDNs of communication and generic device profile.
    Communication,
    /// Words and their bits.
    Bits,
    /// sercos: codes; cia402: codes, bits and states.
    Codes,
    /// Objects.
    Objects,
}

impl DictionaryPart {
    /// As the command line has it.
    const fn name(self) -> &'static str {
        match self {
            Self::Instance => "instance",
            Self::Class => "class",
            Self::Enums => "enums",
            Self::Services => "services",
            Self::Networks => "networks",
            Self::Faults => "faults",
            Self::Idns => "idns",
            Self::Communication => "communication",
            Self::Bits => "bits",
            Self::Codes => "codes",
            Self::Objects => "objects",
        }
    }
}

#[derive(Debug, Subcommand)]
enum Simulate {
    /// A line of simulated SERCOS III drives on a network interface.
    SercosDrive(SercosDriveArguments),
    /// A simulated CiA 402 drive on a CAN interface.
    CanDrive(CanDriveArguments),
    /// A drive on a CAN interface that speaks DeviceNet.
    DevicenetDrive(DevicenetDriveArguments),
    /// A CIP Motion controller that configures, enables and moves the axes of a device.
    Controller(ControllerArguments),
}

/// Arguments of `simulate sercos-drive`.
#[derive(Debug, Args)]
struct SercosDriveArguments {
    /// The network interface, such as eth1; it leads to the master's port 1.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// A second interface, where the line goes on to other drives or the ring closes.
    #[arg(long, value_name = "IF2")]
    ring: Option<String>,
    /// How many drives hang on the line.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=511))]
    slaves: u16,
    /// SERCOS address of the first drive; the others count up from it.
    #[arg(long, value_name = "ADDRESS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=511))]
    address: u16,
    /// Addresses of the drives that slide instead of turning, separated by commas.
    #[arg(long, value_name = "ADDRESSES", value_delimiter = ',')]
    linear: Vec<u16>,
    /// They can be plugged in while the bus runs (SCP_HP).
    #[arg(long)]
    hot_plug: bool,
    /// Their telegrams are fixed (SCP_FixCFG): parameters that are sent to each of them, and that each sends, separated by commas, such as
    /// S-0-0134,S-0-0036 S-0-0135,S-0-0051,S-0-0040
    #[arg(long, value_names = ["TO", "FROM"], num_args = 2, conflicts_with = "hot_plug")]
    fixed_lists: Vec<String>,
    /// Events to play, one a line; the same can be typed while the drives run ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End by itself after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// Arguments of `simulate can-drive`.
#[derive(Debug, Args)]
struct CanDriveArguments {
    /// The CAN interface, such as can0; its bit rate is set already.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// Node-id; without one the drive waits until LSS gives it one.
    #[arg(long, value_name = "NODE", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// Serial number, by which LSS tells drives without a node-id apart [default: the node-id, or the number of the process]
    #[arg(long, value_name = "N")]
    serial: Option<u32>,
    /// How many axes the drive has.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=8))]
    axes: u8,
    /// How many cycles may pass without a SYNC until the drive stops.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    sync_losses: u16,
    /// Where to write the drive's electronic data sheet.
    #[arg(long, value_name = "FILE")]
    eds: Option<PathBuf>,
    /// Events to play, one a line; the same can be typed while the drive runs ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End by itself after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// Arguments of `simulate devicenet-drive`.
#[derive(Debug, Args)]
struct DevicenetDriveArguments {
    /// The CAN interface, such as can0; its bit rate is set already.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// MAC ID of the drive.
    #[arg(long, value_name = "MAC", value_parser = clap::value_parser!(u8).range(0..=63))]
    mac: u8,
    /// What it is.
    #[arg(long, value_enum, default_value_t = DevicenetDriveKind::Motion)]
    kind: DevicenetDriveKind,
    /// Position counts of a CIP Motion drive in a revolution.
    #[arg(long, value_name = "COUNTS", default_value_t = 1_048_576, value_parser = clap::value_parser!(u32).range(1..=0x7FFF_FFFF))]
    resolution: u32,
    /// Output assembly of a velocity drive: 20, 21, 22 or 23.
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = clap::value_parser!(u8).range(20..=23))]
    assembly: u8,
    /// Events to play, one a line; the same can be typed while the drive runs ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End by itself after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// What a simulated drive on DeviceNet is, by the names of the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DevicenetDriveKind {
    /// A CIP Motion drive with the fixed connection format.
    Motion,
    /// A velocity drive of the AC/DC drive profile.
    AcDc,
}

/// Arguments of `simulate controller`.
#[derive(Debug, Args)]
struct ControllerArguments {
    /// The device's address.
    #[arg(long, value_name = "ADDR", required_unless_present = "script")]
    target: Option<std::net::Ipv4Addr>,
    /// This controller's own address; the class 1 data arrive there on UDP 2222.
    #[arg(long, value_name = "ADDR")]
    bind: Option<std::net::Ipv4Addr>,
    /// Run this script instead of the usual motion; it says everything about connection, axes and steps.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["axes", "update_period_us", "counts_per_unit", "speed", "seconds"])]
    script: Option<PathBuf>,
    /// Only check the script and print what it would do; nothing is sent.
    #[arg(long, requires = "script")]
    check: bool,
    /// How many axes the device has.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=16))]
    axes: u8,
    /// Controller update period (the connection's RPI) in microseconds.
    #[arg(long, value_name = "US", default_value_t = 8000, value_parser = clap::value_parser!(u32).range(250..=1_000_000))]
    update_period_us: u32,
    /// Counts in a unit of each axis, separated by commas; the last one counts for the axes that follow.
    #[arg(long, value_name = "COUNTS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    counts_per_unit: Vec<u32>,
    /// About how fast each axis moves, in units per second, separated by commas; the last one counts for the axes that
    /// follow.
    #[arg(long, value_name = "SPEED", value_delimiter = ',', value_parser = positive)]
    speed: Vec<f64>,
    /// How long the axes move, in seconds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// By how much the controller's clock is ahead of the host's, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 0, allow_negative_numbers = true)]
    clock_offset: i32,
    /// What the controller's clock gains, in parts per million.
    #[arg(long, value_name = "PPM", default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-5_000..=5_000))]
    clock_drift: i32,
    /// Step the controller's clock after so many seconds by so many milliseconds, such as 3:-50; may be given several times.
    #[arg(long, value_name = "S:MS")]
    clock_step: Vec<ClockStep>,
    /// Print the result as one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

impl ControllerArguments {
    fn clock(&self) -> ClockPlan {
        ClockPlan {
            offset: DurationNs::from_millis(self.clock_offset.into()),
            drift_ppb: i64::from(self.clock_drift) * 1_000,
            steps: self.clock_step.clone(),
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}

/// Reads the arguments, runs the command, and says what the process's exit status is.
#[must_use]
pub fn main() -> ExitCode {
    // clap itself ends with status 2 on a usage error, and 0 after help.
    let cli = Cli::parse();
    let result = match cli.command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Eds(arguments) => eds::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Scan(arguments) => scan::run(&arguments),
        Command::Decode(arguments) => decode::run(&arguments),
        Command::Translate(arguments) => translate::run(&arguments),
        Command::Snapshot(arguments) => snapshot::run(&arguments),
        Command::Dictionary(arguments) => dictionary::run(&arguments),
        Command::Simulate(Simulate::SercosDrive(arguments)) => simulate::sercos_drive(&arguments),
        Command::Simulate(Simulate::CanDrive(arguments)) => simulate::can_drive(&arguments),
        Command::Simulate(Simulate::DevicenetDrive(arguments)) => simulate::devicenet_drive(&arguments),
        Command::Simulate(Simulate::Controller(arguments)) => simulate::controller(&arguments),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// An error as the person at the terminal reads it.
type CliError = Box<dyn std::error::Error + Send + Sync>;

/// Prints data; the command then ends with `code`.
fn print(data: impl AsRef<[u8]>, code: ExitCode) -> Result<ExitCode, CliError> {
    let mut out = io::stdout().lock();
    match out.write_all(data.as_ref()).and_then(|()| out.flush()) {
        Ok(()) => Ok(code),
        // Whoever reads has seen enough, as `head` has.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(code),
        Err(error) => Err(format!("cannot write: {error}").into()),
    }
}
