//! The command line: a contract, since scripts depend on it.
//!
//! Data goes to standard output, errors and progress to standard error. Exit status 0 is success, 1 findings or failure, 2 usage.

mod assembly;
mod attributes;
mod bundle;
mod check;
mod contacts;
mod control;
mod decode;
mod demo;
mod dictionary;
mod doctor;
mod eds;
mod faults;
mod gateway_client;
mod init;
mod log;
mod manual;
pub(crate) mod param;
mod plc;
mod progress;
mod record;
mod report;
mod run;
mod scan;
mod scan_can;
mod script;
mod service_manager;
mod signal;
mod simulate;
mod snapshot;
mod status;
mod time;
mod token;
mod translate;

use std::io::{self, IsTerminal, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgGroup, Args, Parser, Subcommand};

use self::time::{ClockArguments, GrandmasterArguments, LeadershipArguments, TimeArguments};

/// Motion protocol gateway: a CIP Motion controller on one side, SERCOS III, CANopen and DeviceNet drives on the other.
#[derive(Debug, Parser)]
#[command(name = "axisbridge", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the whole chain in one process: controller, gateway and simulated drives.
    Demo(DemoArguments),
    /// Run the gateway.
    Run(RunArguments),
    /// Show what a running gateway does now: buses, system time, axes and faults.
    Status(StatusArguments),
    /// Show the last lines of the log of a running gateway.
    Log(LogArguments),
    /// Show the faults that are present, and the history of faults of each axis.
    Faults(FaultsArguments),
    /// Write the last seconds of the frames of all sides of a running gateway to a file (pcapng).
    Record(RecordArguments),
    /// Show how controllers opened their last connections: phases, refused services, and what is awaited.
    Contacts(ContactsArguments),
    /// Write everything that helps to find a fault of a running gateway into one archive (tar).
    Bundle(BundleArguments),
    /// Read, write, back up, restore and compare the parameters of a drive, and execute its commands.
    #[command(subcommand)]
    Param(param::ParamCommand),
    /// Move axes without a controller: enable, jog, move, home, stop, reset.
    Control(ControlArguments),
    /// Make the token that lets people control axes from the page, and write its hash to a file.
    Token(TokenArguments),
    /// Check mapping tables, overlays and a configuration, and explain the findings.
    Check(CheckArguments),
    /// Write the electronic data sheets of the devices for the controller's tool.
    Eds(EdsArguments),
    /// Show the connection points, sizes and offsets of devices with assemblies.
    Assembly(AssemblyArguments),
    /// Show what each attribute of an axis is: live, compared, computed, stored or absent.
    Attributes(AttributesArguments),
    /// Check whether this host is fit for the gateway and its cycles.
    Doctor(DoctorArguments),
    /// List the drives on a bus, and print a first configuration.
    Scan(ScanArguments),
    /// Write a first configuration for the drives on a bus. An existing file is never overwritten.
    Init(InitArguments),
    /// Print the frames of a recording as an indented tree.
    Decode(DecodeArguments),
    /// Show how the mapping tables translate frames, and which row made each value.
    Translate(TranslateArguments),
    /// Compare translated frames with the golden texts next to them.
    Snapshot(SnapshotArguments),
    /// Print the attributes, parameters, codes and services of a profile.
    Dictionary(DictionaryArguments),
    /// Run simulated drives or a simulated controller.
    #[command(subcommand)]
    Simulate(Simulate),
    /// Write manual pages and shell completions, for packages.
    #[command(hide = true)]
    Manual(ManualArguments),
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
    /// Buses of the two axes, separated by commas: the first axis is on the first bus. A third bus has a third axis.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES)]
    drives: Vec<demo::DriveKind>,
    /// How the axes are moved: by CIP Motion, or by a PLC through assemblies.
    #[arg(long, value_name = "NORTH", value_enum, default_value_t)]
    north: demo::DemoNorth,
    /// Time of controller and gateway. "ptp" needs root and `ip`.
    #[arg(long, value_name = "SOURCE", value_enum, default_value_t)]
    time: demo::DemoTime,
    /// Write the recording of both sides to this file.
    #[arg(long, value_name = "FILE", default_value = "axisbridge-demo.pcapng")]
    capture: PathBuf,
    /// Serve the web page while the axes move, and open it in a browser where there is a desktop.
    #[arg(long, value_name = "ADDR:PORT", num_args = 0..=1, require_equals = true, default_missing_value = demo::PAGE)]
    page: Option<std::net::SocketAddr>,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
struct RunArguments {
    /// The configuration of the gateway (TOML).
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Record both sides to this file (pcapng).
    #[arg(long, value_name = "FILE")]
    capture: Option<PathBuf>,
    /// Offer local control of the axes on this Unix socket (docs/local-control.md).
    #[arg(long, value_name = "SOCKET")]
    local: Option<PathBuf>,
}

/// Arguments of `status`.
#[derive(Debug, Args)]
struct StatusArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Show it again each second, until Ctrl-C.
    #[arg(long)]
    watch: bool,
    /// Print one JSON object; with `--watch` one a line.
    #[arg(long)]
    json: bool,
}

/// Arguments of `log`.
#[derive(Debug, Args)]
struct LogArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// How many of the newest lines (1 to 10000).
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    lines: u64,
    /// Go on with new lines as they come, until Ctrl-C.
    #[arg(long)]
    follow: bool,
    /// Only lines of this level, and of levels that matter more.
    #[arg(long, value_name = "LEVEL", value_parser = ["error", "warn", "info", "debug", "trace"], default_value = "trace")]
    level: String,
    /// Only lines about this axis.
    #[arg(long, value_name = "NAME")]
    axis: Option<String>,
    /// Print one JSON object a line.
    #[arg(long)]
    json: bool,
}

/// Arguments of `faults`.
#[derive(Debug, Args)]
struct FaultsArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Only the axis with this name.
    #[arg(long, value_name = "NAME")]
    axis: Option<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Arguments of `record`.
#[derive(Debug, Args)]
struct RecordArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Only the last seconds. Without it, as many as the gateway keeps (1 to 600).
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..=600))]
    last: Option<u32>,
    /// The file to write. An existing file is replaced.
    #[arg(long, value_name = "FILE")]
    output: PathBuf,
}

/// Arguments of `contacts`.
#[derive(Debug, Args)]
struct ContactsArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Only the contact with this number.
    #[arg(value_name = "N")]
    number: Option<u64>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Write the frames of the contact to this file as well. An existing file is replaced.
    #[arg(long, value_name = "FILE", requires = "number")]
    pcapng: Option<PathBuf>,
}

/// Arguments of `control`.
#[derive(Debug, Args)]
struct ControlArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Jog this axis with the keys of the terminal: it moves while a key is held.
    #[arg(long, value_name = "AXIS", requires = "velocity", conflicts_with = "requests")]
    jog: Option<String>,
    /// Velocity of the jog, in axis units per second.
    #[arg(long, value_name = "V", requires = "jog")]
    velocity: Option<String>,
    /// Acceleration of the jog, in axis units per second squared. Default: the limit of the axis.
    #[arg(long, value_name = "A", requires = "jog")]
    acceleration: Option<String>,
    /// Requests of local control, such as "move turntable 0.75 velocity=1", one after the other. Default: the lines of standard input.
    #[arg(value_name = "REQUEST")]
    requests: Vec<String>,
}

/// Arguments of `token`.
#[derive(Debug, Args)]
struct TokenArguments {
    /// The file to write, with mode 0600: the hash of the token, for `token` in the `[http]` table of the configuration.
    #[arg(long, value_name = "FILE")]
    output: PathBuf,
    /// Take a token of your own: from the terminal, which does not show it, or the first line of standard input. At least 16 characters.
    #[arg(long)]
    own: bool,
    /// Replace an existing file.
    #[arg(long)]
    replace: bool,
}

/// Arguments of `bundle`.
#[derive(Debug, Args)]
struct BundleArguments {
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// The file to write. An existing file is replaced.
    #[arg(long, value_name = "FILE.tar")]
    output: PathBuf,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
struct CheckArguments {
    /// Check this configuration (TOML), with the tables and overlays that it names.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// An overlay, a folder of overlays, or a folder of tables to use instead of the built-in ones. Can be repeated; applied
    /// after those of the configuration.
    #[arg(long, value_name = "PATH")]
    mappings: Vec<PathBuf>,
    /// Output format.
    #[arg(long, value_enum, default_value_t = CheckFormat::Text)]
    format: CheckFormat,
    /// The same as `--format json`.
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// Show what the tables and overlays change against the shipped tables, or against those in OLD (a folder or an overlay).
    /// Exit status 1 with a dangerous change that no `# accept: reason` next to its row acknowledges.
    #[arg(long, value_name = "OLD", num_args = 0..=1, conflicts_with_all = ["report", "list", "explain", "schema"])]
    #[expect(clippy::option_option, reason = "the option without a value asks for the shipped tables")]
    diff: Option<Option<PathBuf>>,
    /// Show notes that ask for nothing as well (JSON and SARIF always have them).
    #[arg(long)]
    notes: bool,
    /// Do not send frames through the gateway with the tables.
    #[arg(long, conflicts_with_all = ["list", "explain"])]
    no_frames: bool,
    /// Write the tables and the findings as a page for a browser.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Print the JSON Schema of a kind of file, and check nothing. Without NAME, list the names.
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
    /// One JSON object, for programs.
    Json,
    /// SARIF 2.1.0, for hosts of repositories that show findings at their lines.
    Sarif,
    /// With `--list` only: the page of the documentation.
    Markdown,
}

/// Arguments of `eds`.
#[derive(Debug, Args)]
struct EdsArguments {
    /// The configuration of the gateway (TOML).
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Only the device with this name.
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Write each sheet into this folder as NAME.eds. Without it, a single sheet goes to standard output.
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Arguments of `assembly`.
#[derive(Debug, Args)]
struct AssemblyArguments {
    /// The configuration of the gateway (TOML).
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Form of the output.
    #[arg(long, value_enum, default_value_t = AssemblyFormat::Text)]
    format: AssemblyFormat,
    /// Only the device with this name.
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// Form of the output of `assembly`.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum AssemblyFormat {
    /// Lines for people.
    Text,
    /// One JSON document.
    Json,
    /// Tables for a page of documentation.
    Markdown,
    /// Types and a function block in Structured Text (IEC 61131-3).
    StructuredText,
    /// Types and a function block as PLCopen XML (TC6).
    Plcopen,
    /// Types and an instruction as an L5X file.
    L5x,
    /// A module for Python, and a program that moves an axis.
    Python,
}

/// Arguments of `attributes`.
#[derive(Debug, Args)]
struct AttributesArguments {
    /// The configuration of the gateway (TOML): what is so with simulated drives of its kinds, or with `--values`.
    #[arg(long, value_name = "FILE", required_unless_present = "local")]
    config: Option<PathBuf>,
    /// The Unix socket of the running gateway (`run --local`): what is so with the drives that it has commissioned.
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, default_missing_value = "/run/axisbridge/local", conflicts_with_all = ["config", "values"])]
    local: Option<PathBuf>,
    /// Only the axis with this name.
    #[arg(long, value_name = "NAME")]
    axis: Option<String>,
    /// Values that the drives of the machine have: a list of `idn` and `object` lines. Without it, the values are those of
    /// simulated drives.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Arguments of `doctor`.
#[derive(Debug, Args)]
struct DoctorArguments {
    /// Try the cycles, interfaces, addresses and real-time settings of this configuration (TOML).
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// How long to try each cycle, in seconds (1 to 3600).
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Which bus `scan` and `init` look at.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("bus").required(true).args(["config", "interface"])))]
struct BusArguments {
    /// Scan the bus of this configuration, and show the differences.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Scan the bus on this network interface.
    #[arg(long, value_name = "IF")]
    interface: Option<String>,
    /// The interface at the other end of the ring, or of a second line.
    #[arg(long, value_name = "IF2", requires = "interface")]
    ring: Option<String>,
}

/// Arguments of `scan`.
#[derive(Debug, Args)]
struct ScanArguments {
    #[command(flatten)]
    bus: BusArguments,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Arguments of `init`.
#[derive(Debug, Args)]
struct InitArguments {
    #[command(flatten)]
    bus: BusArguments,
    /// The file to write. It must not exist.
    #[arg(long, value_name = "FILE", default_value = "gateway.toml")]
    output: PathBuf,
}

/// Arguments of `manual`.
#[derive(Debug, Args)]
struct ManualArguments {
    /// The folder that stands for /usr. It is created if it is not there.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Arguments of `translate`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("frames").required(true).args(["file", "hex"])))]
struct TranslateArguments {
    /// A recording (pcapng or pcap), or a text file with one frame a line, in hexadecimal.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// One frame: an Ethernet frame, a class 1 datagram, a CIP Motion update, or a line of a list.
    #[arg(long, value_name = "BYTES")]
    hex: Option<String>,
    /// Use axes, drives and tables of this configuration instead of those of the demonstration.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Drives of the demonstration, as for `demo`.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES, conflicts_with = "config")]
    drives: Vec<demo::DriveKind>,
    /// Values that the drives of the machine have, above all their scaling: a list of `idn` and `object` lines. Without it, the
    /// values are those of simulated drives.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,
    /// First frame to print, counted from 1. The frames before it are translated as well: what follows depends on them.
    #[arg(long, value_name = "N", default_value_t = 1)]
    from: u64,
    /// Print at most this many frames of the recording or lines of the list, from the first one on.
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Print only frames that go one of these ways.
    #[arg(long, value_enum, value_name = "WAYS", value_delimiter = ',')]
    only: Vec<crate::translate::Direction>,
    /// Print only what is about this axis.
    #[arg(long, value_name = "NAME")]
    axis: Option<String>,
    /// Print only values that are not what they were in the frame before.
    #[arg(long)]
    changes: bool,
    /// Output format: text for people, one JSON document, or one JSON object a value and line.
    #[arg(long, value_enum, default_value_t)]
    format: crate::decode::Format,
    /// The same as `--format json`.
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// Draw command and feedback of each axis over time into this file, and print nothing.
    #[arg(long, value_name = "FILE.svg", conflicts_with_all = ["format", "json", "changes"])]
    plot: Option<PathBuf>,
}

/// Arguments of `snapshot`.
#[derive(Debug, Args)]
struct SnapshotArguments {
    /// The folder with the frames: lists (*.hex), recordings (*.pcapng, *.pcap) and scenes (*.toml).
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Use axes, drives and tables of this configuration instead of those of DIR/config.toml or of the demonstration.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Drives of the demonstration, as for `demo`.
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_value = demo::DRIVES, conflicts_with = "config")]
    drives: Vec<demo::DriveKind>,
    /// Values that the drives of the machine have, above all their scaling: a list of `idn` and `object` lines. Without it, the
    /// values are those of simulated drives.
    #[arg(long, value_name = "FILE")]
    values: Option<PathBuf>,
    /// Make the present translation the golden texts: write those that have changed, and remove those without frames. What could
    /// not be translated is not accepted.
    #[arg(long, visible_alias = "update")]
    accept: bool,
    /// Accept errors as well: of frames that are meant to be faulty.
    #[arg(long, requires = "accept")]
    with_errors: bool,
    /// Output format.
    #[arg(long, value_enum, default_value_t)]
    format: snapshot::Format,
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
    /// Tell CANopen and DeviceNet apart by the interfaces of this configuration. Recordings of Axisbridge need none.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Protocol of CAN interfaces that nothing else describes. Without it, they are read as CANopen, and the tree says so.
    #[arg(long, value_enum)]
    can: Option<CanKind>,
    /// Output format: text for people, one JSON document, or one JSON object a frame and line.
    #[arg(long, value_enum, default_value_t)]
    format: crate::decode::Format,
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
    /// Which dictionary.
    #[arg(value_enum)]
    profile: DictionaryProfile,
    /// Output format.
    #[arg(long, value_enum, default_value_t = DictionaryFormat::Csv)]
    format: DictionaryFormat,
    /// Part of the dictionary. cip: instance (default), class, enums, services, networks, faults. sercos: idns and communication
    /// (default: both), bits, codes. cia402: objects (default), codes. generic: instance.
    #[arg(long, value_enum)]
    part: Option<DictionaryPart>,
    /// A folder of mapping tables. A file that is missing there comes from the binary.
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
    /// Comma separated values; the first line has the names of the columns.
    Csv,
    /// An array of objects whose keys are the names of the columns.
    Json,
}

/// What `dictionary` prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DictionaryPart {
    /// cip: attributes of an axis. generic: parameters and signals.
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
    /// sercos: codes. cia402: codes, bits and states.
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
    /// Simulate a line of SERCOS III drives on a network interface.
    SercosDrive(SercosDriveArguments),
    /// Simulate a CANopen drive (CiA 402) on a CAN interface.
    CanDrive(CanDriveArguments),
    /// Simulate a DeviceNet drive on a CAN interface.
    DevicenetDrive(DevicenetDriveArguments),
    /// Simulate a CIP Motion controller that configures, enables and moves the axes of a device, or runs a script.
    Controller(ControllerArguments),
    /// Simulate a PLC that moves axes through the assemblies of a device.
    Plc(PlcArguments),
    /// Simulate a PTP grandmaster with a clock of its own. No clock of the host is set.
    Grandmaster(GrandmasterArguments),
}

/// Arguments of `simulate plc`.
#[derive(Debug, Args)]
struct PlcArguments {
    /// The configuration of the gateway (TOML): address, layout and counts are taken from it.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Carry out this script (TOML) instead of one movement.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["axis", "to", "velocity", "acceleration", "interval_us", "seconds"])]
    script: Option<PathBuf>,
    /// Only check the script and print its steps.
    #[arg(long, requires = "script")]
    check: bool,
    /// The axis to move.
    #[arg(long, value_name = "NAME", required_unless_present = "script")]
    axis: Option<String>,
    /// Where to, in revolutions or millimetres.
    #[arg(long, value_name = "POSITION", allow_negative_numbers = true, required_unless_present = "script")]
    to: Option<f64>,
    /// Velocity, in these units per second.
    #[arg(long, value_name = "V", value_parser = positive, required_unless_present = "script")]
    velocity: Option<f64>,
    /// Acceleration, in these units per second squared. Without it, the limit of the axis is used.
    #[arg(long, value_name = "A", value_parser = positive)]
    acceleration: Option<f64>,
    /// Packet interval of both directions in microseconds.
    #[arg(long, value_name = "US", default_value_t = 8000, value_parser = clap::value_parser!(u32).range(1000..=100_000))]
    interval_us: u32,
    /// Longest movement in seconds.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
}

/// Arguments of `simulate sercos-drive`.
#[derive(Debug, Args)]
struct SercosDriveArguments {
    /// Network interface, such as eth1, connected to port 1 of the master.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// Second interface, connected to further drives, or to the master to close the ring.
    #[arg(long, value_name = "IF2")]
    ring: Option<String>,
    /// Number of drives on the line.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=511))]
    slaves: u16,
    /// SERCOS address of the first drive. The others count up from it.
    #[arg(long, value_name = "ADDRESS", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=511))]
    address: u16,
    /// Addresses of the linear drives, separated by commas. The others are rotary.
    #[arg(long, value_name = "ADDRESSES", value_delimiter = ',')]
    linear: Vec<u16>,
    /// Behave like the drive of this file, written by `axisbridge param backup`: with its settings, and with no others.
    #[arg(long, value_name = "BACKUP")]
    like: Option<PathBuf>,
    /// The drives can be plugged in while the bus runs (SCP_HP).
    #[arg(long)]
    hot_plug: bool,
    /// The telegrams of the drives are fixed (SCP_FixCFG): parameters sent to each drive, and parameters that each drive sends,
    /// separated by commas, such as S-0-0134,S-0-0036 S-0-0135,S-0-0051,S-0-0040
    #[arg(long, value_names = ["TO", "FROM"], num_args = 2, conflicts_with = "hot_plug")]
    fixed_lists: Vec<String>,
    /// File of events, one a line. You can also type them while the drives run ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// Arguments of `simulate can-drive`.
#[derive(Debug, Args)]
struct CanDriveArguments {
    /// CAN interface, such as can0. Its bit rate has to be set already.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// Node-id. Without it, the drive waits until LSS assigns one.
    #[arg(long, value_name = "NODE", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: Option<u8>,
    /// Serial number, by which LSS distinguishes drives without a node-id [default: the node-id, or the process number]
    #[arg(long, value_name = "N")]
    serial: Option<u32>,
    /// Number of axes [default: 1, or those of the data sheet]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=8), conflicts_with = "like")]
    axes: Option<u8>,
    /// Behave like the drive of this data sheet (EDS) or device configuration (DCF): with its objects, types, accesses, limits, values,
    /// identity and PDOs, and with no others.
    #[arg(long, value_name = "FILE")]
    like: Option<PathBuf>,
    /// Number of cycles without a SYNC after which the drive stops.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    sync_losses: u16,
    /// Write the electronic data sheet of the drive to this file.
    #[arg(long, value_name = "FILE")]
    eds: Option<PathBuf>,
    /// File of events, one a line. You can also type them while the drive runs ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End after this many seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// Arguments of `simulate devicenet-drive`.
#[derive(Debug, Args)]
struct DevicenetDriveArguments {
    /// CAN interface, such as can0. Its bit rate has to be set already.
    #[arg(long, value_name = "IF")]
    interface: String,
    /// MAC ID of the drive.
    #[arg(long, value_name = "MAC", value_parser = clap::value_parser!(u8).range(0..=63))]
    mac: u8,
    /// Kind of drive.
    #[arg(long, value_enum, default_value_t = DevicenetDriveKind::Motion)]
    kind: DevicenetDriveKind,
    /// Position counts of a CIP Motion drive in a revolution.
    #[arg(long, value_name = "COUNTS", default_value_t = 1_048_576, value_parser = clap::value_parser!(u32).range(1..=0x7FFF_FFFF))]
    resolution: u32,
    /// Output assembly of a velocity drive: 20, 21, 22 or 23.
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = clap::value_parser!(u8).range(20..=23))]
    assembly: u8,
    /// File of events, one a line. You can also type them while the drive runs ("help" lists them).
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// End after this many seconds.
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
    /// Address of the device.
    #[arg(long, value_name = "ADDR", required_unless_present = "script")]
    target: Option<std::net::Ipv4Addr>,
    /// Address of this controller. It uses UDP port 2222 of it.
    #[arg(long, value_name = "ADDR")]
    bind: Option<std::net::Ipv4Addr>,
    /// Run this script instead of the usual motion. It describes connection, axes and steps.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["axes", "update_period_us", "counts_per_unit", "speed", "seconds"])]
    script: Option<PathBuf>,
    /// Only check the script and print what it would do. Nothing is sent.
    #[arg(long, requires = "script")]
    check: bool,
    /// Number of axes of the device.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=16))]
    axes: u8,
    /// Controller update period (the connection's RPI) in microseconds.
    #[arg(long, value_name = "US", default_value_t = 8000, value_parser = clap::value_parser!(u32).range(250..=1_000_000))]
    update_period_us: u32,
    /// Counts in a unit of each axis, separated by commas. The last one is used for all further axes.
    #[arg(long, value_name = "COUNTS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    counts_per_unit: Vec<u32>,
    /// Approximate speed of each axis, in units per second, separated by commas. The last one is used for all further axes.
    #[arg(long, value_name = "SPEED", value_delimiter = ',', value_parser = positive)]
    speed: Vec<f64>,
    /// How long the axes move, in seconds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: u32,
    #[command(flatten)]
    time: TimeArguments,
    #[command(flatten)]
    leadership: LeadershipArguments,
    #[command(flatten)]
    clock: ClockArguments,
    /// Print the result as one JSON object on standard output.
    #[arg(long)]
    json: bool,
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
        Command::Status(arguments) => status::run(&arguments),
        Command::Log(arguments) => log::run(&arguments),
        Command::Faults(arguments) => faults::run(&arguments),
        Command::Record(arguments) => record::run(&arguments),
        Command::Contacts(arguments) => contacts::run(&arguments),
        Command::Control(arguments) => control::run(&arguments),
        Command::Token(arguments) => token::run(&arguments),
        Command::Bundle(arguments) => bundle::run(&arguments),
        Command::Param(command) => param::run(&command),
        Command::Check(arguments) => check::run(&arguments),
        Command::Eds(arguments) => eds::run(&arguments),
        Command::Assembly(arguments) => assembly::run(&arguments),
        Command::Attributes(arguments) => attributes::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Scan(arguments) => scan::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Manual(arguments) => manual::run(&arguments),
        Command::Decode(arguments) => decode::run(&arguments),
        Command::Translate(arguments) => translate::run(&arguments),
        Command::Snapshot(arguments) => snapshot::run(&arguments),
        Command::Dictionary(arguments) => dictionary::run(&arguments),
        Command::Simulate(Simulate::SercosDrive(arguments)) => simulate::sercos_drive(&arguments),
        Command::Simulate(Simulate::Plc(arguments)) => plc::run(&arguments),
        Command::Simulate(Simulate::CanDrive(arguments)) => simulate::can_drive(&arguments),
        Command::Simulate(Simulate::DevicenetDrive(arguments)) => simulate::devicenet_drive(&arguments),
        Command::Simulate(Simulate::Controller(arguments)) => simulate::controller(&arguments),
        Command::Simulate(Simulate::Grandmaster(arguments)) => time::grandmaster(&arguments),
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

/// Exit status of a wrong command line, as clap has it.
const USAGE: u8 = 2;

/// Says what is wrong with the command line.
fn usage(message: &str) -> ExitCode {
    eprintln!("error: {message}");
    ExitCode::from(USAGE)
}

/// Whether output has colours: on a terminal, unless the person there wants none.
fn has_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Prints data; the command then ends with `code`.
fn print(data: impl AsRef<[u8]>, code: ExitCode) -> Result<ExitCode, CliError> {
    let mut out = io::stdout().lock();
    written_to_end(out.write_all(data.as_ref()).and_then(|()| out.flush()), code)
}

/// Writes a file that the user has named.
fn write_file(path: &std::path::Path, content: &[u8]) -> Result<ExitCode, CliError> {
    std::fs::write(path, content).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// The exit status when output was written, or why it was not.
fn written_to_end(written: io::Result<()>, code: ExitCode) -> Result<ExitCode, CliError> {
    match written {
        Ok(()) => Ok(code),
        // The reader has closed the pipe, as `head` does: it has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(code),
        Err(error) => Err(format!("cannot write: {error}").into()),
    }
}
