//! What is odd about a slave. Each field stands alone; the default is a plain drive with nothing odd in it.

use super::idn::{Idn, Parameter};

/// One of the connections the device has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Connection {
    /// The device produces it, else consumes it.
    pub producer: bool,
    /// The list in S-0-1050.x.6 at power-up. With class SCP_FixCFG it stays.
    pub list: Vec<Idn>,
    /// What S-0-1050.x.5 says, if not the length of the list. A wrong number contradicts the list.
    pub declared_length: Option<u16>,
}

/// An error code for the service channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SvcError {
    /// On which parameter.
    pub idn: Idn,
    /// On which element; 1 is the opening.
    pub element: u8,
    /// When written (true) or when read (false). Opening counts as a write.
    pub write: bool,
    /// What is answered.
    pub code: u16,
}

/// Raw values of the scaling parameters as they are at power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScalingValues {
    /// S-0-0076.
    pub position_type: u16,
    /// S-0-0077.
    pub position_factor: u16,
    /// S-0-0078.
    pub position_exponent: i16,
    /// S-0-0079.
    pub resolution: u32,
    /// S-0-0044.
    pub velocity_type: u16,
    /// S-0-0045.
    pub velocity_factor: u16,
    /// S-0-0046.
    pub velocity_exponent: i16,
    /// S-0-0160.
    pub acceleration_type: u16,
    /// S-0-0161.
    pub acceleration_factor: u16,
    /// S-0-0162.
    pub acceleration_exponent: i16,
    /// S-0-0086.
    pub torque_type: u16,
    /// S-0-0093.
    pub torque_factor: u16,
    /// S-0-0094.
    pub torque_exponent: i16,
    /// S-0-0121.
    pub gear_input: u32,
    /// S-0-0122.
    pub gear_output: u32,
    /// S-0-0123, a tenth of a micrometre a revolution.
    pub feed_constant: i32,
    /// S-0-0103.
    pub modulo: i32,
    /// S-0-0043.
    pub velocity_polarity: u16,
    /// S-0-0055.
    pub position_polarity: u16,
    /// S-0-0085.
    pub torque_polarity: u16,
    /// The scaling parameters cannot be written in any phase.
    pub read_only: bool,
}

impl Default for ScalingValues {
    fn default() -> Self {
        Self {
            position_type: 0x02,
            position_factor: 1,
            position_exponent: -7,
            resolution: 3_600_000,
            velocity_type: 0x02,
            velocity_factor: 1,
            velocity_exponent: -4,
            acceleration_type: 0x02,
            acceleration_factor: 1,
            acceleration_exponent: -3,
            torque_type: 0,
            torque_factor: 1,
            torque_exponent: -1,
            gear_input: 1,
            gear_output: 1,
            feed_constant: 100_000,
            modulo: 3_600_000,
            velocity_polarity: 0,
            position_polarity: 0,
            torque_polarity: 0,
            read_only: false,
        }
    }
}

/// Everything about a slave that a test may want to be otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The SERCOS address, 0 for none. It need not be the place in the line.
    pub address: u16,
    /// Links: is there a neighbour at port 1 and at port 2? The slave without one at the other port loops back.
    pub neighbour: [bool; 2],
    /// S-0-1000: the SCP classes, class and version in each word.
    pub classes: Vec<u16>,
    /// S-0-1302.0.1: the type of the function profile.
    pub profile: u16,
    /// The connections. Their number is what S-0-1051 tells.
    pub connections: Vec<Connection>,
    /// With SCP_FixCFG: S-0-1050.x.1 cannot be written either.
    pub fixed_setup: bool,
    /// Parameters a consumer connection may carry.
    pub consumable: Vec<Idn>,
    /// Parameters a producer connection may carry.
    pub producible: Vec<Idn>,
    /// Parameters that are not there at all.
    pub absent: Vec<Idn>,
    /// Parameters in addition, or instead of those with the same number.
    pub extra: Vec<Parameter>,
    /// Names in place of the usual ones, bytes of Latin-1.
    pub names: Vec<(Idn, Vec<u8>)>,
    /// Units in place of the usual ones, bytes of Latin-1.
    pub units: Vec<(Idn, Vec<u8>)>,
    /// P-0-0100 is a list of this many double words; 0: it is not there.
    pub long_list: u16,
    /// S-0-0292: the modes the drive knows.
    pub modes: Vec<u16>,
    /// S-0-0032 to S-0-0035 at power-up.
    pub selected_modes: [u16; 4],
    /// The mode in S-0-0134 is in bits 11, 9, 8 as in SERCOS I/II, else in bits 10..8.
    pub old_mode_bits: bool,

    /// Each step of the service channel is busy for so many cycles.
    pub busy_cycles: u32,
    /// Steps on these parameters are busy for so many cycles more.
    pub busy_on: Vec<(Idn, u32)>,
    /// AHS follows MHS so many cycles late.
    pub handshake_delay: u32,
    /// Error codes on chosen elements.
    pub svc_errors: Vec<SvcError>,
    /// Milliseconds a procedure command takes; one that is not here is done at once.
    pub command_ms: Vec<(Idn, u32)>,
    /// Procedure commands that end in error.
    pub failing_commands: Vec<Idn>,
    /// A failed command shows Bh, busy reset, and not Fh.
    pub error_without_busy: bool,

    /// S-0-0127 fails, and S-0-0021 lists these.
    pub refuse_cp3: Vec<Idn>,
    /// S-0-0128 fails, and S-0-0022 lists these.
    pub refuse_cp4: Vec<Idn>,
    /// A failed S-0-0127 or S-0-0128 leaves its list empty.
    pub empty_invalid_lists: bool,
    /// Never acknowledges the switch to this phase: it keeps inserting.
    pub ignore_switch_to: Option<u8>,
    /// After a switch with a pause, telegrams earlier than this many milliseconds are not heard.
    pub switch_pause_ms: u32,
    /// Milliseconds without an MST after which CP0, CP1 and CP2 fall back to NRT.
    pub mst_timeout_ms: u32,
    /// The shortest cycle the slave can do, in ns.
    pub shortest_cycle_ns: u32,
    /// The smallest t1 (S-0-1006, element 5), in ns.
    pub shortest_t1_ns: u32,
    /// Looks at the CRC of a header.
    pub check_crc: bool,
    /// Acknowledges bits 20 to 22 of the communication version.
    pub acknowledge_version: bool,

    /// From this time on nothing is read and nothing written; frames still pass.
    pub hung_from_ns: Option<u64>,
    /// From this time on frames vanish.
    pub dead_from_ns: Option<u64>,
    /// From this time on AHS does not follow MHS.
    pub stuck_handshake_from_ns: Option<u64>,
    /// From this time on the new-data bit and the counter of the producer connections stand still.
    pub stuck_new_data_from_ns: Option<u64>,
    /// S-DEV bit 14 never follows C-DEV bit 14.
    pub stuck_topology: bool,
    /// The producer counter in C-CON stays 0: only the new-data bit moves.
    pub no_counter: bool,
    /// At this time an AT carries these bits of S-0-0011 and the error bits; the next one does not.
    pub flash_error: Option<(u64, u16)>,
    /// At this time these bits of S-0-0011 are raised and stay until reset.
    pub error_at: Option<(u64, u16)>,
    /// Bits of S-0-0011 whose cause does not go: S-0-0099 fails.
    pub lasting_errors: u16,
    /// An error is flagged, and S-0-0390 shows none.
    pub no_diagnostic_number: bool,
    /// S-0-0390 on an error; else C00F00xxh with the number of the bit.
    pub diagnostic_number: Option<u32>,
    /// S-0-0014 always reads as this.
    pub interface_status: Option<u16>,

    /// Main power is there.
    pub mains: bool,
    /// Milliseconds from CP4 until 01, ready for main power on.
    pub ready_ms: u32,
    /// Milliseconds from 01 until 10, main power applied.
    pub mains_ms: u32,
    /// Milliseconds from enable until 11, torque on.
    pub power_up_ms: u32,
    /// Milliseconds from torque on until command values are followed (bit 3).
    pub follow_ms: u32,
    /// Milliseconds from standstill until torque off.
    pub off_ms: u32,
    /// The drive turns on at an edge of bit 15 only.
    pub enable_needs_edge: bool,
    /// Bit 3 of S-0-0135 is never set.
    pub no_follow_bit: bool,
    /// Bits 15-14 in error are 00, else 10.
    pub error_shows_not_ready: bool,

    /// Raw values of scaling, gear, modulo and polarity.
    pub scaling: ScalingValues,
    /// Increments of the motor encoder a revolution: a position without scaling.
    pub encoder: u32,
    /// Continuous stall torque in newton metres, the base of a torque in percent.
    pub stall_torque: f64,
    /// Inertia in kg m^2.
    pub inertia: f64,
    /// Friction in newton metres for one revolution a second.
    pub friction: f64,
    /// Torque the load takes, in newton metres.
    pub load_torque: f64,
    /// Largest velocity, revolutions a second of the motor: the value of S-0-0091.
    pub max_velocity: f64,
    /// Largest acceleration, revolutions a second squared of the motor: the value of S-0-0138.
    pub max_acceleration: f64,
    /// Where the motor stands at power-up, in revolutions.
    pub start_position: f64,
    /// The shaft cannot turn.
    pub blocked: bool,
    /// S-0-0159 in counts; 0: no watch over the following error.
    pub monitoring_window: i32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            address: 1,
            neighbour: [true, true],
            classes: vec![0x0201, 0x0301, 0x0A01],
            profile: 2,
            connections: vec![Connection::default(), Connection { producer: true, ..Connection::default() }],
            fixed_setup: false,
            consumable: [134, 36, 37, 47, 48, 80, 81, 258, 259, 260].map(Idn::s).to_vec(),
            producible: [135, 11, 12, 13, 14, 40, 51, 53, 84, 189, 390, 403].map(Idn::s).to_vec(),
            absent: Vec::new(),
            extra: Vec::new(),
            names: Vec::new(),
            units: Vec::new(),
            long_list: 0,
            modes: vec![1, 2, 3, 0x0B],
            selected_modes: [2, 3, 1, 0x0B],
            old_mode_bits: false,
            busy_cycles: 0,
            busy_on: Vec::new(),
            handshake_delay: 0,
            svc_errors: Vec::new(),
            command_ms: Vec::new(),
            failing_commands: Vec::new(),
            error_without_busy: false,
            refuse_cp3: Vec::new(),
            refuse_cp4: Vec::new(),
            empty_invalid_lists: false,
            ignore_switch_to: None,
            switch_pause_ms: 0,
            mst_timeout_ms: 1000,
            shortest_cycle_ns: 250_000,
            shortest_t1_ns: 0,
            check_crc: true,
            acknowledge_version: true,
            hung_from_ns: None,
            dead_from_ns: None,
            stuck_handshake_from_ns: None,
            stuck_new_data_from_ns: None,
            stuck_topology: false,
            no_counter: false,
            flash_error: None,
            error_at: None,
            lasting_errors: 0,
            no_diagnostic_number: false,
            diagnostic_number: None,
            interface_status: None,
            mains: true,
            ready_ms: 0,
            mains_ms: 0,
            power_up_ms: 0,
            follow_ms: 0,
            off_ms: 0,
            enable_needs_edge: false,
            no_follow_bit: false,
            error_shows_not_ready: false,
            scaling: ScalingValues::default(),
            encoder: 1 << 20,
            stall_torque: 2.0,
            inertia: 0.001,
            friction: 0.01,
            load_torque: 0.0,
            max_velocity: 100.0,
            max_acceleration: 500.0,
            start_position: 0.0,
            blocked: false,
            monitoring_window: 0,
        }
    }
}

impl Settings {
    /// Class SCP_FixCFG: MDT {S-0-0134, S-0-0036}, AT {S-0-0135, S-0-0051, S-0-0040}.
    #[must_use]
    pub fn fixcfg() -> Self {
        Self {
            classes: vec![0x0101, 0x0301],
            connections: vec![
                Connection { list: [134, 36].map(Idn::s).to_vec(), ..Connection::default() },
                Connection {
                    producer: true,
                    list: [135, 51, 40].map(Idn::s).to_vec(),
                    ..Connection::default()
                },
            ],
            ..Self::default()
        }
    }

    /// The same with the producer first and a third connection nobody needs.
    #[must_use]
    pub fn odd_order() -> Self {
        let mut settings = Self::fixcfg();
        settings.connections.reverse();
        settings.connections.push(Connection {
            producer: true,
            list: [390].map(Idn::s).to_vec(),
            ..Connection::default()
        });
        settings
    }

    /// A small drive: velocity only, no secondary modes, no optional parameters.
    #[must_use]
    pub fn sparse() -> Self {
        Self {
            modes: vec![2],
            selected_modes: [2, 0, 0, 0],
            absent: vec![
                Idn::s(33),
                Idn::s(34),
                Idn::s(35),
                Idn::s(292),
                Idn::s(95),
                Idn::s(103),
                Idn::s(159),
                Idn::s(138),
                Idn::s(216),
                Idn::se(1000, 0, 1),
                Idn::s(1036),
                Idn::s(14),
            ],
            ..Self::default()
        }
    }

    /// Names that are hard to show: one of Latin-1, one empty, one very long; and a unit of Latin-1.
    #[must_use]
    pub fn odd_names() -> Self {
        Self {
            names: vec![
                (Idn::s(36), b"Geschwindigkeits-Sollwert \xF6\xE4\xFC\xDF \xB5".to_vec()),
                (Idn::s(40), Vec::new()),
                (Idn::s(51), vec![b'n'; 4000]),
            ],
            units: vec![(Idn::s(51), b"\xB0".to_vec()), (Idn::s(40), Vec::new())],
            ..Self::default()
        }
    }

    /// Does the device have a class of the FixCFG family?
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.classes.iter().any(|class| class >> 8 == 1)
    }
}
