//! What kind of slave it is, and everything that is odd about it.

/// The device profile the slave plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// A CIP Motion drive with one axis and the fixed connection format on the poll connection.
    Motion,
    /// An AC/DC drive with the speed control assemblies.
    Speed,
}

/// How the two bytes of class and instance are laid out in explicit messages after the allocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyFormat {
    /// Format 0: class and instance are one byte each.
    EightEight,
    /// Format 1: class is one byte, instance two.
    EightSixteen,
    /// Format 2: both are two bytes.
    SixteenSixteen,
    /// Format 3: class is two bytes, instance one.
    SixteenEight,
    /// Format 4: the number of words of a padded path, then the path.
    Path,
}

/// The data type of Command Position in a controller's block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandPosition {
    /// Command Control says DINT, or the block has no room for an LREAL: DINT. Else LREAL.
    Auto,
    /// Always DINT.
    Dint,
    /// Always LREAL.
    Lreal,
}

/// The Update ID of the drive's answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UpdateId {
    /// The controller's, as it should be.
    Echo,
    /// Always this one.
    Fixed(u8),
    /// The drive's own count of answers.
    OwnCount,
}

/// How long a planned fault lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lasts {
    /// It is told in one answer only, then it is gone as if never been.
    OnePoll,
    /// The cause is over at once; a fault reset clears it.
    UntilReset,
    /// The cause stays: every reset is followed by the same fault.
    ForGood,
}

/// A fault that comes of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedFault {
    /// It comes with the poll of this number; the first one is 1.
    pub poll: u32,
    /// Motion: the bit number in Axis Faults. Speed: the fault code.
    pub code: u16,
    /// How long it lasts.
    pub lasts: Lasts,
}

/// An attribute whose setting is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefusedSet {
    /// The class.
    pub class: u16,
    /// The attribute.
    pub attribute: u16,
    /// The general status code of the answer.
    pub status: u8,
}

/// Everything about the slave that a test may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The device profile.
    pub profile: Profile,
    /// The MAC ID, 0 to 63.
    pub mac: u8,
    /// The baud rate attribute: 0 is 125, 1 is 250, 2 is 500 kbit/s.
    pub baud: u8,
    /// The vendor ID.
    pub vendor: u16,
    /// The device type; 25h is a CIP Motion drive, 02h an AC drive.
    pub device_type: u16,
    /// The product code.
    pub product_code: u16,
    /// Major and minor revision.
    pub revision: (u8, u8),
    /// The serial number.
    pub serial: u32,
    /// The product name.
    pub product_name: String,

    /// The time between the two duplicate MAC ID checks and from the second to being on line.
    pub dup_check_ms: u32,
    /// It comes on line without a duplicate MAC ID check of its own.
    pub skips_dup_check: bool,
    /// On line, it does not answer somebody else's check of its MAC ID.
    pub ignores_dup_check: bool,
    /// It also answers checks of this MAC ID, as a second station with that MAC ID would.
    pub conflict_with: Option<u8>,

    /// Allocation choices the slave has, by bit: 0 explicit, 1 polled.
    pub choices: u8,
    /// The poll connection alone is not allocated before there is an explicit one.
    pub io_needs_explicit: bool,
    /// Every allocation is refused with this general and additional status.
    pub refuse_allocation: Option<(u8, u8)>,
    /// The set is allocated to this other master from the start.
    pub foreign_master: Option<u8>,
    /// The other master lets go after this time; 0 is never.
    pub foreign_master_ms: u32,

    /// The format of explicit messages.
    pub body_format: BodyFormat,
    /// The attribute in Get and Set of a single attribute is two bytes for class 42h in the formats without a path.
    pub wide_axis_attribute: bool,
    /// The longest explicit request in bytes, from the service code on.
    pub longest_request: usize,
    /// Answers to explicit requests come this much later.
    pub explicit_delay_ms: u32,
    /// Every N-th explicit request is not answered; 0 is off.
    pub explicit_missing_every: u32,
    /// The service code of explicit answers is one too high.
    pub wrong_service: bool,
    /// The MAC ID in the header of explicit answers is the slave's own.
    pub wrong_mac: bool,
    /// The transaction bit in the header of explicit answers is turned over.
    pub wrong_transaction: bool,
    /// Attributes that cannot be set, with the status code.
    pub refuse_sets: Vec<RefusedSet>,
    /// A list service with a bad attribute answers with error 0Ah and not with the list of states.
    pub list_error_as_error: bool,
    /// Expected packet rates are rounded up to a multiple of this; 0 and 1 keep them as they are.
    pub packet_rate_step_ms: u16,
    /// The answer to the setting of the expected packet rate has no data.
    pub silent_packet_rate: bool,

    /// The assemblies it has. The speed profile only.
    pub assemblies: Vec<u8>,
    /// The assembly consumed by the poll connection after the allocation.
    pub consumed_assembly: u8,
    /// The assembly produced by the poll connection after the allocation.
    pub produced_assembly: u8,
    /// The paths of the connection cannot be set.
    pub fixed_paths: bool,
    /// The number of bytes the poll connection consumes, if not that of the assembly.
    pub consumed_size: Option<u16>,
    /// The number of bytes the poll connection produces, if not that of the assembly.
    pub produced_size: Option<u16>,
    /// What the attribute consumed_connection_size tells, if not the truth.
    pub told_consumed_size: Option<u16>,
    /// What the attribute produced_connection_size tells, if not the truth.
    pub told_produced_size: Option<u16>,
    /// Poll answers come this much later.
    pub poll_delay_ms: u32,
    /// The attribute transportClass_trigger of the poll connection; 82h is a server of class 2.
    pub poll_transport: u8,
    /// Every N-th poll is not answered; 0 is off.
    pub poll_missing_every: u32,
    /// So many bytes are missing at the end of poll answers.
    pub poll_short_by: usize,
    /// So many zero bytes are added at the end of poll answers.
    pub poll_long_by: usize,

    /// A fault that comes of itself.
    pub fault: Option<PlannedFault>,
    /// For so long after a fault, resets of it do nothing.
    pub reset_refused_ms: u32,
    /// Power goes off and on every so often; 0 is off.
    pub restart_every_ms: u32,

    /// Motion: the format revision of the drive's blocks.
    pub format_revision: u8,
    /// Motion: the update ID of the drive's blocks.
    pub update_id: UpdateId,
    /// Motion: the connection format byte of the drive's blocks.
    pub connection_format: u8,
    /// Motion: the number of axes that the class attributes tell.
    pub axes: u16,
    /// Motion: the path of both directions of the poll connection.
    pub motion_path: Vec<u8>,
    /// Motion: the type of Command Position.
    pub command_position: CommandPosition,
    /// Motion: a block with the Update ID of the block before is taken all the same.
    pub takes_stale_updates: bool,
    /// Motion: the axis leaves Initializing only when Configuration Complete is set.
    pub waits_for_complete: bool,
    /// Motion: the time in Pre-Charge.
    pub precharge_ms: u32,
    /// Motion: the time in Starting.
    pub starting_ms: u32,
    /// Motion: axis attributes it does not have.
    pub missing_axis_attributes: Vec<u16>,
    /// Motion: in Running, only the attributes of the standard's table can be set.
    pub locked_while_running: bool,
    /// Motion: the control modes it has, by bit of their numbers.
    pub control_modes: u16,
    /// Motion: asked status data come in every answer, not only when they have changed.
    pub status_always: bool,
    /// Motion: feedback counts per unit, as long as no feedback resolution is set.
    pub counts_per_unit: u32,
    /// Motion: highest speed in units per second.
    pub top_speed: f64,
    /// Motion: acceleration in units per second squared, for the ramps and at rated torque.
    pub acceleration: f64,

    /// Speed: 'at reference' is never told.
    pub never_at_reference: bool,
    /// Speed: the drive never gets ready.
    pub never_ready: bool,
    /// Speed: the fault code is told as 0.
    pub fault_without_code: bool,
    /// Speed: the drive stays in local control, whatever is asked.
    pub local_control: bool,
    /// Speed: the run bits count only as long as NetCtrl asks for network control, as the object says.
    pub run_needs_net_ctrl: bool,
    /// Speed: the reference counts only as long as NetRef asks for the network's reference, as the object says.
    pub reference_needs_net_ref: bool,
    /// Speed: NetCtrl and NetRef at power-on, which stay so with the basic assemblies.
    pub net_at_start: bool,
    /// Speed: the actual speed has no sign.
    pub unsigned_speed: bool,
    /// Speed: SpeedScale; a value is RPM times two to this power.
    pub speed_scale: i8,
    /// Speed: HighSpdLimit in RPM.
    pub top_rpm: u16,
    /// Speed: the time from zero to HighSpdLimit and back.
    pub ramp_ms: u16,
    /// Speed: the time in Startup.
    pub startup_ms: u32,
    /// Speed: the fault code when the connection is lost.
    pub loss_code: u16,
}

impl Settings {
    fn base(profile: Profile) -> Self {
        let motion = profile == Profile::Motion;
        Self {
            profile,
            mac: 5,
            baud: 2,
            vendor: 0x0539,
            device_type: if motion { 0x25 } else { 0x02 },
            product_code: if motion { 77 } else { 78 },
            revision: (2, 1),
            serial: if motion { 0x00A1_B2C3 } else { 0x00A1_B2C4 },
            product_name: String::from(if motion { "Odd Motion" } else { "Odd Speed" }),
            dup_check_ms: 1000,
            skips_dup_check: false,
            ignores_dup_check: false,
            conflict_with: None,
            choices: 0x03,
            io_needs_explicit: false,
            refuse_allocation: None,
            foreign_master: None,
            foreign_master_ms: 0,
            body_format: BodyFormat::EightEight,
            wide_axis_attribute: false,
            longest_request: 250,
            explicit_delay_ms: 0,
            explicit_missing_every: 0,
            wrong_service: false,
            wrong_mac: false,
            wrong_transaction: false,
            refuse_sets: Vec::new(),
            list_error_as_error: false,
            packet_rate_step_ms: 1,
            silent_packet_rate: false,
            assemblies: vec![20, 21, 70, 71],
            consumed_assembly: 20,
            produced_assembly: 70,
            fixed_paths: false,
            consumed_size: None,
            produced_size: None,
            told_consumed_size: None,
            told_produced_size: None,
            poll_delay_ms: 0,
            poll_transport: 0x82,
            poll_missing_every: 0,
            poll_short_by: 0,
            poll_long_by: 0,
            fault: None,
            reset_refused_ms: 0,
            restart_every_ms: 0,
            format_revision: 2,
            update_id: UpdateId::Echo,
            connection_format: 3,
            axes: 1,
            motion_path: vec![0x20, 0x42, 0x24, 0x01],
            command_position: CommandPosition::Auto,
            takes_stale_updates: false,
            waits_for_complete: false,
            precharge_ms: 20,
            starting_ms: 10,
            missing_axis_attributes: Vec::new(),
            locked_while_running: false,
            control_modes: 0b1_1111,
            status_always: false,
            counts_per_unit: 10_000,
            top_speed: 100.0,
            acceleration: 500.0,
            never_at_reference: false,
            never_ready: false,
            fault_without_code: false,
            local_control: false,
            run_needs_net_ctrl: true,
            reference_needs_net_ref: true,
            net_at_start: true,
            unsigned_speed: false,
            speed_scale: 0,
            top_rpm: 3000,
            ramp_ms: 300,
            startup_ms: 50,
            loss_code: 0x7500,
        }
    }

    /// A CIP Motion drive with the fixed connection format: blocks of 16 bytes both ways on the poll connection.
    #[must_use]
    pub fn motion() -> Self {
        Self::base(Profile::Motion)
    }

    /// An AC drive with assemblies 20, 70, 21 and 71; the first pair is chosen at the start.
    #[must_use]
    pub fn speed() -> Self {
        Self::base(Profile::Speed)
    }
}
