//! How one drive is, and how it is odd. Every field is plain data; a test changes what it wants.

/// What bit 4 of the statusword (voltage enabled) means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoltageBit {
    /// Always 0.
    Zero,
    /// Always 1.
    One,
    /// 1 only while the stage controls the motor.
    Enabled,
    /// 1 from "switched on" on.
    SwitchedOn,
    /// 1 while the mains are there.
    DcLink,
}

/// What bit 9 of the statusword (remote) shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RemoteBit {
    /// Always 1.
    One,
    /// Always 0.
    Zero,
    /// 1 while the node is operational.
    Operational,
}

/// What bit 10 of the statusword shows in csp, csv and cst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CyclicBit {
    /// Always 0.
    Zero,
    /// Always 1.
    One,
    /// Changes at every SYNC.
    Toggle,
}

/// Where the safety input takes the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SafetyReaction {
    /// To "switch on disabled".
    SwitchOnDisabled,
    /// To "switched on", where enabling has no effect.
    SwitchedOn,
    /// To "fault" with this code.
    Fault(u16),
}

/// What the SDO server makes of block transfers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// Aborts with 05040001.
    Refused,
    /// Does them.
    Works,
    /// Answers a block upload as if it were a plain upload.
    PlainAnswer,
    /// Says nothing.
    Silent,
}

/// What an RPDO with too few bytes leads to. It is never used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShortPdo {
    /// Nothing.
    Ignored,
    /// An emergency message 8210 and no fault.
    Emergency,
    /// The drive goes to "fault" with 8210.
    Fault,
}

/// What makes a TPDO of type 254 or 255 go out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Events {
    /// A change of any mapped byte.
    AnyChange,
    /// A change of 6041, 6061, 603F or 1001 in it.
    StatusChange,
    /// Nothing but the event timer.
    TimerOnly,
}

/// How 60C2 (interpolation period) behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Period {
    /// Can be written.
    Writable,
    /// Read-only, with this value and exponent.
    ReadOnly(u8, i8),
    /// A write is accepted, but this value and exponent are read back.
    Sticks(u8, i8),
    /// The object is not there.
    Absent,
}

/// A PDO at delivery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PdoDefault {
    /// The identifier without the node-id; 0 for none.
    pub base: u16,
    /// Whether the PDO is valid (bit 31 clear).
    pub valid: bool,
    /// Bit 30 of the COB-ID.
    pub bit_30: bool,
    /// The transmission type.
    pub kind: u8,
    /// The inhibit time in 100 us.
    pub inhibit: u16,
    /// The event timer in ms.
    pub event_ms: u16,
    /// Index, sub-index and bits of each entry, as in the object.
    pub map: Vec<u32>,
}

impl PdoDefault {
    /// A valid PDO of type 255.
    #[must_use]
    pub fn new(base: u16, map: &[u32]) -> Self {
        Self { base, valid: true, bit_30: false, kind: 255, inhibit: 0, event_ms: 0, map: map.to_vec() }
    }
}

/// Everything about one drive. `Settings::default()` is a drive without oddities.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    // ---- identity and objects
    /// The node-id.
    pub node_id: u8,
    /// 1018:1.
    pub vendor: u32,
    /// 1018:2.
    pub product: u32,
    /// 1018:3.
    pub revision: u32,
    /// 1018:4.
    pub serial: u32,
    /// 1000h.
    pub device_type: u32,
    /// 1008h.
    pub name: String,
    /// 1008, 1009 and 100A hold no byte.
    pub empty_text: bool,
    /// The modes the drive can do.
    pub modes: Vec<i8>,
    /// 6502 if it is not what `modes` says.
    pub modes_shown: Option<u32>,
    /// Objects that are not there: whole, or one sub-index.
    pub missing: Vec<(u16, Option<u8>)>,
    /// Objects that a download does not change: abort 06010002.
    pub read_only: Vec<(u16, u8)>,
    /// Objects that cannot be read: abort 06010001.
    pub write_only: Vec<(u16, u8)>,
    /// Objects that no PDO takes.
    pub not_mappable: Vec<u16>,
    /// Objects with another value at delivery.
    pub values: Vec<(u16, u8, i64)>,
    /// Where the 6xxx objects are: 800h times the axis.
    pub axis_offset: u16,

    // ---- start and error control
    /// Time from power on or a reset to the boot-up message.
    pub boot_ms: u64,
    /// No boot-up message.
    pub silent_boot: bool,
    /// Goes to operational on its own after the boot-up.
    pub self_starting: bool,
    /// Restarts this long after each boot-up; all state is lost.
    pub restarts_every_ms: Option<u64>,
    /// 6064 begins at `start_position` again after a reset.
    pub forgets_position: bool,
    /// 1017 at delivery.
    pub heartbeat_ms: u16,
    /// 1017 is not there; node guarding alone.
    pub guarding_only: bool,
    /// 1017 cannot be set while 100C and 100D are, and the other way round: abort 06040043.
    pub heartbeat_or_guarding: bool,

    // ---- SDO
    /// Time until each answer of the SDO server.
    pub sdo_delay_ms: u64,
    /// Every n-th request gets no answer; 0 for never.
    pub sdo_drops_every: u32,
    /// Block transfers.
    pub block: Block,
    /// Expedited answers do not tell their size.
    pub upload_without_size: bool,
    /// Even short values come in segments.
    pub upload_in_segments: bool,
    /// 1010 aborts with 06060000.
    pub store_fails: bool,
    /// An empty entry of 1003 reads as 0; else it aborts with 08000024.
    pub empty_history_reads: bool,

    // ---- PDO
    /// The RPDOs.
    pub rpdos: Vec<PdoDefault>,
    /// The TPDOs.
    pub tpdos: Vec<PdoDefault>,
    /// Transmission types an RPDO takes, first and last of each range; others abort with 06090030.
    pub rpdo_types: Vec<(u8, u8)>,
    /// The same for a TPDO.
    pub tpdo_types: Vec<(u8, u8)>,
    /// 1600 and 1A00 are read-only.
    pub mapping_fixed: bool,
    /// 1400:1 and 1800:1 are read-only.
    pub cob_id_fixed: bool,
    /// Clearing bit 30 of a COB-ID that has it aborts with 06090030.
    pub bit_30_fixed: bool,
    /// A mapping or COB-ID changes in pre-operational only: else 08000022.
    pub remap_only_preoperational: bool,
    /// A mapping changes only while the PDO is not valid.
    pub remap_needs_disabled: bool,
    /// An entry changes only while sub-index 0 is 0.
    pub remap_needs_zero_count: bool,
    /// The abort code for a mapping changed in the wrong order.
    pub remap_code: u32,
    /// The inhibit time changes only while the TPDO is not valid: else 06090030.
    pub inhibit_locked: bool,
    /// Entries a PDO can have.
    pub max_entries: u8,
    /// An RPDO with too few bytes.
    pub short_pdo: ShortPdo,
    /// An RPDO with too many bytes gives an emergency 8220.
    pub long_pdo_emergency: bool,
    /// What makes an event-driven TPDO go out.
    pub events: Events,
    /// Event-driven TPDOs go out once at the start of the node.
    pub sends_at_start: bool,

    // ---- statusword
    /// Bit 4.
    pub voltage_bit: VoltageBit,
    /// Bit 9.
    pub remote_bit: RemoteBit,
    /// The controlword is obeyed; else only quick stop, fault reset and halt work.
    pub remote_obeys: bool,
    /// Bits that are always 1.
    pub bits_always: u16,
    /// Bits that are always 0; stronger than `bits_always`.
    pub bits_never: u16,
    /// Bits that change on their own.
    pub noise: u16,
    /// How often they do.
    pub noise_ms: u64,
    /// Bit 12 stays 0 in csp, csv and cst.
    pub never_follows: bool,
    /// Bit 10 in csp, csv and cst.
    pub cyclic_bit_10: CyclicBit,
    /// Bit 10 stays 0 in homing.
    pub homing_without_bit_10: bool,

    // ---- power state machine
    /// Time in "not ready to switch on" after the boot-up.
    pub not_ready_ms: u64,
    /// Bit 6 is 1 in "not ready to switch on".
    pub not_ready_bit_6: bool,
    /// "Not ready" lasts until this object is written.
    pub ready_after: Option<(u16, u8)>,
    /// Time each transition takes.
    pub transition_ms: u64,
    /// Time more to "operation enabled".
    pub enable_ms: u64,
    /// "Enable operation" in "ready to switch on" goes through both states.
    pub switch_on_and_enable: bool,
    /// A controlword sooner than this after the last one is missed.
    pub control_gap_us: u64,
    /// 605A at delivery.
    pub quick_stop_option: i16,
    /// "Quick stop active" ends after this time, standing or not.
    pub quick_stop_passes_ms: Option<u64>,
    /// Transition 16 exists.
    pub resumes_from_quick_stop: bool,
    /// The safety input.
    pub safety: SafetyReaction,
    /// Without mains "switched on" is not reached, and "operation enabled" ends in a fault 3220.
    pub needs_mains: bool,
    /// "Switched on" is reached without mains, and left to "switch on disabled" after this time.
    pub mains_wait_ms: Option<u64>,
    /// A fault reset is refused until `mend` is called.
    pub reset_needs_mend: bool,
    /// A fault reset is refused this long after the fault.
    pub reset_blocked_ms: u64,
    /// A fault reset needs no edge: the level of bit 7 is enough.
    pub reset_by_level: bool,
    /// 603F keeps its value after a fault reset.
    pub keeps_error_code: bool,
    /// A fault with this code so many ms after each boot-up.
    pub fault_after: Option<(u64, u16)>,
    /// Targets are set to 0 at enabling.
    pub clears_targets: bool,

    // ---- modes
    /// 6060 and 6061 at the start.
    pub mode_at_start: i8,
    /// 6060 does not change in "operation enabled": 08000022, and nothing by PDO.
    pub mode_refused_enabled: bool,
    /// 6060 does not change while halt is set.
    pub mode_refused_halted: bool,
    /// 6060 = 0 is refused with 06090030.
    pub mode_zero_refused: bool,
    /// Time from 6060 to 6061.
    pub mode_delay_ms: u64,
    /// 6061 meanwhile; none: the old mode.
    pub mode_meanwhile: Option<i8>,
    /// 6060 = 0 in a PDO clears 6061; else 0 changes nothing.
    pub mode_zero_clears: bool,
    /// "Operation enabled" is refused while 6060 is 0.
    pub enable_needs_mode: bool,
    /// This mode is left only for that one; any other change does nothing.
    pub mode_detour: Option<(i8, i8)>,
    /// SYNCs needed after enabling until csp, csv, cst and ip follow.
    pub sync_warmup: u32,
    /// Controlword bits that must be 1 in csp, csv and cst, or the axis stands.
    pub cyclic_needs_bits: u16,
    /// Fault 8700 in csp, csv, cst and ip after so many periods of 1006 without SYNC.
    pub sync_lost_periods: Option<u32>,
    /// Fault 8700 at enabling in csp while 60C2 is not 1006.
    pub sync_needs_period: bool,
    /// 60C2.
    pub period: Period,

    // ---- units and the axis
    /// Counts per motor turn, 608F:1.
    pub counts_per_turn: u32,
    /// Counts per second in a unit of 60FF and 606C: a fraction.
    pub velocity_unit: (i64, i64),
    /// Counts per second squared in a unit of 6083: a fraction.
    pub acceleration_unit: (i64, i64),
    /// The value of 6071 and 6077 at rated torque.
    pub torque_rated: i64,
    /// Fastest the axis can go, counts/s.
    pub max_velocity: i64,
    /// Fastest its velocity can change, counts/s^2. Rated torque gives a third of it.
    pub max_acceleration: i64,
    /// Gain of the position controller, 1/s.
    pub position_gain: i64,
    /// Velocity feed-forward in percent: below 100 the axis lags behind.
    pub feed_forward: i64,
    /// Friction at full speed, in thousandths of rated torque.
    pub friction: i64,
    /// Position at power on, counts.
    pub start_position: i64,
    /// A following error above 6065 for 6066 ms is a fault 8611.
    pub follow_fault: bool,
    /// Where the home switch is, counts of the encoder at power on.
    pub home_at: i64,
    /// Values 6098 takes.
    pub homing_methods: (i8, i8),
    /// Homing ends with an error.
    pub homing_fails: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            node_id: 5,
            vendor: 0x0000_0999,
            product: 0x0000_0402,
            revision: 0x0001_0000,
            serial: 4711,
            device_type: 0x0002_0192,
            name: "Plain drive".into(),
            empty_text: false,
            modes: vec![1, 3, 4, 6, 8, 9, 10],
            modes_shown: None,
            missing: Vec::new(),
            read_only: Vec::new(),
            write_only: Vec::new(),
            not_mappable: Vec::new(),
            values: Vec::new(),
            axis_offset: 0,
            boot_ms: 0,
            silent_boot: false,
            self_starting: false,
            restarts_every_ms: None,
            forgets_position: false,
            heartbeat_ms: 0,
            guarding_only: false,
            heartbeat_or_guarding: false,
            sdo_delay_ms: 0,
            sdo_drops_every: 0,
            block: Block::Refused,
            upload_without_size: false,
            upload_in_segments: false,
            store_fails: false,
            empty_history_reads: false,
            rpdos: Self::usual_rpdos(),
            tpdos: Self::usual_tpdos(),
            rpdo_types: vec![(0, 240), (254, 255)],
            tpdo_types: vec![(0, 240), (252, 255)],
            mapping_fixed: false,
            cob_id_fixed: false,
            bit_30_fixed: false,
            remap_only_preoperational: false,
            remap_needs_disabled: true,
            remap_needs_zero_count: true,
            remap_code: 0x0601_0000,
            inhibit_locked: true,
            max_entries: 8,
            short_pdo: ShortPdo::Emergency,
            long_pdo_emergency: false,
            events: Events::AnyChange,
            sends_at_start: true,
            voltage_bit: VoltageBit::DcLink,
            remote_bit: RemoteBit::One,
            remote_obeys: true,
            bits_always: 0,
            bits_never: 0,
            noise: 0,
            noise_ms: 10,
            never_follows: false,
            cyclic_bit_10: CyclicBit::Zero,
            homing_without_bit_10: false,
            not_ready_ms: 0,
            not_ready_bit_6: false,
            ready_after: None,
            transition_ms: 0,
            enable_ms: 0,
            switch_on_and_enable: true,
            control_gap_us: 0,
            quick_stop_option: 2,
            quick_stop_passes_ms: None,
            resumes_from_quick_stop: true,
            safety: SafetyReaction::SwitchOnDisabled,
            needs_mains: true,
            mains_wait_ms: None,
            reset_needs_mend: false,
            reset_blocked_ms: 0,
            reset_by_level: false,
            keeps_error_code: false,
            fault_after: None,
            clears_targets: false,
            mode_at_start: 0,
            mode_refused_enabled: false,
            mode_refused_halted: false,
            mode_zero_refused: false,
            mode_delay_ms: 0,
            mode_meanwhile: None,
            mode_zero_clears: false,
            enable_needs_mode: false,
            mode_detour: None,
            sync_warmup: 0,
            cyclic_needs_bits: 0,
            sync_lost_periods: None,
            sync_needs_period: false,
            period: Period::Writable,
            counts_per_turn: 10_000,
            velocity_unit: (1, 1),
            acceleration_unit: (1, 1),
            torque_rated: 1000,
            max_velocity: 1_000_000,
            max_acceleration: 30_000_000,
            position_gain: 200,
            feed_forward: 95,
            friction: 100,
            start_position: 0,
            follow_fault: true,
            home_at: 5_000,
            homing_methods: (-4, 37),
            homing_fails: false,
        }
    }
}

impl Settings {
    /// The four RPDOs most drives have.
    #[must_use]
    pub fn usual_rpdos() -> Vec<PdoDefault> {
        vec![
            PdoDefault::new(0x200, &[0x6040_0010]),
            PdoDefault::new(0x300, &[0x6040_0010, 0x6060_0008]),
            PdoDefault::new(0x400, &[0x6040_0010, 0x607A_0020]),
            PdoDefault::new(0x500, &[0x6040_0010, 0x60FF_0020]),
        ]
    }

    /// The four TPDOs most drives have.
    #[must_use]
    pub fn usual_tpdos() -> Vec<PdoDefault> {
        vec![
            PdoDefault::new(0x180, &[0x6041_0010]),
            PdoDefault::new(0x280, &[0x6041_0010, 0x6061_0008]),
            PdoDefault::new(0x380, &[0x6041_0010, 0x6064_0020]),
            PdoDefault::new(0x480, &[0x6041_0010, 0x606C_0020]),
        ]
    }

    /// The value 6502 shows.
    #[must_use]
    pub fn mode_bits(&self) -> u32 {
        self.modes_shown.unwrap_or_else(|| {
            let of =
                |mode: i8| u32::try_from(mode - 1).ok().and_then(|bit| 1_u32.checked_shl(bit)).unwrap_or(0);
            self.modes.iter().filter(|mode| **mode > 0).fold(0, |bits, mode| bits | of(*mode))
        })
    }

    /// Takes an object away.
    #[must_use]
    pub fn without(mut self, index: u16) -> Self {
        self.missing.push((index, None));
        self
    }
}
