//! The parameters of the communication profile that a slave has, and which of their values are possible.

use arrayvec::ArrayVec;

use super::parameter::{Definition, IDN_LIST_READ_ONLY, Store};
use crate::generated::idns::connection;
use crate::wire::connection::ConnectionSetup;
use crate::wire::header::{DATA_LEN_MAX, DATA_LEN_MIN, Phase};
use crate::wire::idn::Idn;
use crate::wire::scp::{ScpClass, ScpEntry};
use crate::wire::svc_error::SvcError;

/// Connections of a slave at most.
pub const CONNECTIONS_MAX: usize = 8;
/// Values in one connection at most.
pub const VALUES_MAX: usize = 32;
/// Longest cycle, ns.
pub const CYCLE_NS_MAX: u32 = 65_000_000;

/// Communication classes of a slave, S-0-1000, where its configuration does not say otherwise.
pub const CLASSES: &[ScpEntry] = &[
    ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
    ScpEntry { class: ScpClass::SYNC, version: 1 },
    ScpEntry { class: ScpClass::NRT, version: 1 },
];

/// The same with hot plug.
pub const CLASSES_WITH_HOT_PLUG: &[ScpEntry] = &[
    ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
    ScpEntry { class: ScpClass::SYNC, version: 1 },
    ScpEntry { class: ScpClass::NRT, version: 1 },
    ScpEntry { class: ScpClass::HOT_PLUG, version: 1 },
];

/// What a slave says about itself: S-0-1300.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Vendor name.
    pub vendor_name: &'static str,
    /// Vendor code.
    pub vendor_code: u16,
    /// Device name.
    pub device_name: &'static str,
    /// Device ID, the ordering code.
    pub device_id: &'static str,
    /// Hardware revision.
    pub hardware: &'static str,
    /// Software revision.
    pub software: &'static str,
}

impl Default for Identity {
    fn default() -> Self {
        Identity {
            vendor_name: "Axisbridge",
            vendor_code: 0,
            device_name: "Simulated drive",
            device_id: "AXB-SIM-1",
            hardware: "1",
            software: env!("CARGO_PKG_VERSION"),
        }
    }
}

/// Element 3 of the parameters here: what it is and when it can be written.
mod attribute {
    pub const U16: u32 = 0x7011_0001;
    pub const BITS: u32 = 0x7001_0001;
    pub const HEX32: u32 = 0x7032_0001;
    pub const U16_LIST: u32 = 0x7015_0001;
    pub const BYTE_LIST: u32 = 0x7034_0001;
    /// ns, shown in microseconds.
    pub const TIME: u32 = 0x7012_0001;
    /// The same, written in CP2 and where the way of the telegrams has changed.
    pub const TIME_ANY: u32 = 0x0012_0001;
    pub const U16_CP2: u32 = 0x6011_0001;
    pub const U32_CP2: u32 = 0x6012_0001;
    pub const BITS_CP2: u32 = 0x6001_0001;
    pub const BITS32_CP2: u32 = 0x6002_0001;
    pub const HEX_CP2: u32 = 0x6031_0001;
    pub const TIME_CP2: u32 = 0x6012_0001;
    pub const U16_LIST_CP2: u32 = 0x6015_0001;
    pub const TIME_LIST_CP2: u32 = 0x6016_0001;
    pub const IDN_LIST_CP2: u32 = 0x6056_0001;
    pub const U16_LIST_ANY: u32 = 0x0015_0001;
    pub const TEXT_ANY: u32 = 0x0044_0001;
    pub const COMMAND_ANY: u32 = 0x0009_0001;
    pub const COMMAND_CP2: u32 = 0x6009_0001;
    pub const COMMAND_CP3: u32 = 0x5009_0001;
}

/// A connection that is as it is: SCP_FixCFG.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedConnection {
    /// The slave produces.
    pub produces: bool,
    /// Its values; they are defined by the application.
    pub idns: &'static [Idn],
}

/// Fills a store with the parameters of the communication profile.
pub fn define(store: &mut Store, config: &super::Config) {
    use attribute as a;
    let super::Config { mac, serial, identity, .. } = config;
    let address = config.address.min(511);
    let classes: Vec<u8> = config.classes.iter().flat_map(|entry| entry.to_word().to_le_bytes()).collect();
    let s = Idn::standard;
    let number = Definition::value;
    let cycle_max = i64::from(CYCLE_NS_MAX);
    let time = |idn, attribute, name, value| number(idn, attribute, name, value).unit("ns");
    let definitions = [
        number(Idn::CLASS_1_DIAGNOSTIC, a::BITS, "Class 1 diagnostics", 0),
        number(Idn::CLASS_2_DIAGNOSTIC, a::BITS, "Class 2 diagnostics", 0),
        number(Idn::INTERFACE_STATUS, a::BITS, "Interface status", 0),
        Definition::list(Idn::INVALID_CP2, IDN_LIST_READ_ONLY, "IDNs invalid in CP2", &[], 256),
        Definition::list(Idn::INVALID_CP3, IDN_LIST_READ_ONLY, "IDNs invalid in CP3", &[], 256),
        Definition::text(Idn::DIAGNOSTIC_MESSAGE, "Diagnostic message", "", 80),
        Definition::command(Idn::RESET_C1D, a::COMMAND_ANY, "Reset class 1 diagnostics"),
        Definition::command(Idn::CP3_CHECK, a::COMMAND_CP2, "CP3 transition check"),
        Definition::command(Idn::CP4_CHECK, a::COMMAND_CP3, "CP4 transition check"),
        Definition::text(s(140), "Controller type", identity.device_name, 40),
        Definition::list(s(142), a::TEXT_ANY, "Application type", &[], 40),
        number(Idn::DIAGNOSTIC_NUMBER, a::HEX32, "Diagnostic number", 0),
        Definition::list(Idn::SCP_CLASSES, a::U16_LIST, "SCP classes and versions", &classes, 64),
        Definition::list(Idn::SCP_ACTIVE, a::U16_LIST_CP2, "Active SCP classes and versions", &classes, 64),
        time(Idn::CYCLE_TIME, a::TIME_CP2, "Communication cycle time", 1_000_000).range(31_250, cycle_max),
        number(Idn::MST_LOSSES, a::U32_CP2, "Permitted MST losses", 10).range(0, 0xFFFF),
        time(Idn::FEEDBACK_TIME, a::TIME, "Minimum feedback processing time", 0),
        time(Idn::AT_START, a::TIME_CP2, "AT0 transmission starting time (t1)", 0).range(0, cycle_max),
        time(Idn::SYNC_TIME, a::TIME_CP2, "Feedback acquisition time", 0).range(0, cycle_max),
        time(Idn::COMMAND_VALID, a::TIME_CP2, "Command value valid time (t3)", 0).range(0, cycle_max),
        number(Idn::CONTROL_OFFSET, a::HEX_CP2, "Device control offset in MDT", 0),
        Definition::list(Idn::MDT_LENGTHS, a::U16_LIST_CP2, "Lengths of MDTs", &[0; 8], 8),
        number(Idn::STATUS_OFFSET, a::HEX_CP2, "Device status offset in AT", 0),
        Definition::list(Idn::AT_LENGTHS, a::U16_LIST_CP2, "Lengths of ATs", &[0; 8], 8),
        number(Idn::SVC_MDT_OFFSET, a::HEX_CP2, "Service channel offset in MDT", 0),
        number(Idn::SVC_AT_OFFSET, a::HEX_CP2, "Service channel offset in AT", 0),
        time(Idn::RING_DELAY, a::TIME_ANY, "Ring delay", 0),
        time(s(1016), a::TIME, "Slave delay", 600),
        Definition::list(Idn::UC_TIMES, a::TIME_LIST_CP2, "Unified channel times (t6, t7)", &[0; 8], 8)
            .unit("ns"),
        Definition::list(s(1019), a::BYTE_LIST, "MAC address", mac, 6),
        time(Idn::SYNC_JITTER, a::TIME_CP2, "Synchronization jitter", 0),
        Definition::command(Idn::DELAY_MEASURING, a::COMMAND_ANY, "Ring delay measurement"),
        Definition::text(s(1026), "Communication hardware version", "Axisbridge sans-IO", 40),
        number(Idn::MTU_REQUESTED, a::U16_CP2, "Requested MTU", 1500).range(46, 1500),
        number(Idn::MTU_EFFECTIVE, a::U16, "Effective MTU", 1500),
        number(Idn::MST_ERROR_COUNTER, a::U16, "MST error counter", 0),
        number(Idn::COMMUNICATION_CONTROL, a::BITS32_CP2, "Communication control", 0),
        Definition::list(
            Idn::ERROR_COUNTER_PORT_1_AND_PORT_2,
            a::U16_LIST_ANY,
            "Error counters of ports 1 and 2",
            &[0; 4],
            4,
        ),
        number(Idn::INTER_FRAME_GAP, a::U16_CP2, "Inter-frame gap", 37).unit("bytes").range(12, 0xFFFF),
        time(Idn::SLAVE_JITTER, 0x7011_0001, "Slave jitter", 80),
        number(Idn::ADDRESS, a::U16_CP2, "SERCOS address", i64::from(address)).range(0, 511),
        number(Idn::DEVICE_CONTROL, a::BITS, "Device control", 0),
        Definition::list(
            Idn::LIST_OF_SERCOS_ADDRESSES_IN_DEVICE,
            a::U16_LIST,
            "SERCOS addresses of the device",
            &address.to_le_bytes(),
            2,
        ),
        number(Idn::DEVICE_STATUS, a::BITS, "Device status", 0),
        time(Idn::CONSUMER_TIME, a::TIME, "Maximum consumer activation time (t11)", 0),
        Definition::text(s(1300).with_structure(0, 1), "Component name", identity.device_name, 64),
        Definition::text(s(1300).with_structure(0, 2), "Vendor name", identity.vendor_name, 64),
        number(s(1300).with_structure(0, 3), a::U16, "Vendor code", i64::from(identity.vendor_code)),
        Definition::text(s(1300).with_structure(0, 4), "Device name", identity.device_name, 64),
        Definition::text(s(1300).with_structure(0, 5), "Device ID", identity.device_id, 64),
        Definition::text(s(1300).with_structure(0, 8), "Hardware revision", identity.hardware, 64),
        Definition::text(s(1300).with_structure(0, 9), "Software revision", identity.software, 64),
        Definition::text(s(1300).with_structure(0, 12), "Serial number", &format!("{serial:08}"), 64),
        Definition::list(s(1301), a::U16_LIST, "GDP classes and versions", &[1, 1], 16),
    ];
    for definition in definitions {
        store.define(definition);
    }
    if !config.fixed.is_empty() {
        for (index, fixed) in (0u8..).zip(config.fixed.iter().take(CONNECTIONS_MAX)) {
            define_connection(store, index, Some(fixed));
        }
        return;
    }
    let connections = config.connections.clamp(1, 8);
    let image = vec![0; 2 * usize::from(connections)];
    store.define(Definition::list(
        Idn::CONNECTION_IMAGE,
        a::U16_LIST,
        "Image of connection setups",
        &image,
        16,
    ));
    for index in 0..connections {
        define_connection(store, index, None);
    }
}

fn define_connection(store: &mut Store, index: u8, fixed: Option<&FixedConnection>) {
    use attribute as a;
    let x = |element| Idn::connection(index, element);
    let number = Definition::value;
    let longest = 2 + 8 * i64::try_from(VALUES_MAX).unwrap_or(i64::MAX);
    let setup = fixed.map_or(ConnectionSetup::empty(), |fixed| ConnectionSetup::synchronous(fixed.produces));
    let idns = fixed.map(|fixed| fixed.idns).unwrap_or_default();
    let list: Vec<u8> = idns.iter().flat_map(|idn| idn.0.to_le_bytes()).collect();
    let list_attribute = if fixed.is_some() { IDN_LIST_READ_ONLY } else { a::IDN_LIST_CP2 };
    if fixed.is_none() {
        store.define(number(x(connection::NUMBER), a::U16_CP2, "Connection number", 0));
    }
    let definitions = [
        number(x(connection::SETUP), a::BITS_CP2, "Connection setup", i64::from(setup.bits())),
        number(x(connection::ASSIGNMENT), a::HEX_CP2, "Telegram assignment", 0),
        number(x(connection::LENGTH_MAX), a::U16, "Longest connection", longest).unit("bytes"),
        number(x(connection::LENGTH), a::U16, "Length of connection", 2).unit("bytes"),
        Definition::list(x(connection::LIST), list_attribute, "Configuration list", &list, 4 * VALUES_MAX),
        number(x(connection::CONTROL), a::BITS, "Connection control", 0),
        number(x(connection::CYCLE), a::U32_CP2, "Producer cycle time", 0).unit("ns"),
        number(x(connection::LOSSES_MAX), a::U16_CP2, "Permitted data losses", 0),
        number(x(connection::LOSSES), a::U16, "Data loss counter", 0),
    ];
    for definition in definitions {
        store.define(definition);
    }
}

/// Fills what follows from other parameters: S-0-0017, S-0-0025, S-0-0187, S-0-0188, S-0-0192 and the lengths of connections.
/// Call when all are defined.
pub fn define_lists(store: &mut Store) {
    use super::parameter::{Cyclic, Parameter};
    for index in 0..u8::try_from(CONNECTIONS_MAX).unwrap_or(u8::MAX) {
        set_length(store, index);
    }
    let list = |filter: &dyn Fn(&Parameter) -> bool, own: &[Idn]| -> Vec<u8> {
        let mut idns: Vec<Idn> = store.iter().filter(|p| filter(p)).map(|p| p.idn()).collect();
        idns.extend(own);
        idns.sort_unstable();
        idns.iter().flat_map(|idn| idn.0.to_le_bytes()).collect()
    };
    let lists = [
        Idn::IDN_LIST_OF_ALL_OPERATION_DATA,
        Idn::IDN_LIST_OF_ALL_PROCEDURE_COMMANDS,
        Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_AT,
        Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_MDT,
        Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA,
    ];
    let all = list(&|_| true, &lists);
    let producible = list(&|p| matches!(p.cyclic(), Cyclic::Feedback | Cyclic::Both), &[]);
    let consumable = list(&|p| matches!(p.cyclic(), Cyclic::Command | Cyclic::Both), &[]);
    let commands = list(&|p| p.attribute().is_command(), &[]);
    // What somebody sets and the drive keeps: not what a master writes for its telegrams, nor what comes in them.
    let kept = |p: &Parameter| {
        let set = p.write_protection(Phase::CP2).is_none() && !p.attribute().is_command();
        // Standard parameters from 1000 on are those of the communication.
        set && p.cyclic() == Cyclic::No && (p.idn().is_product() || p.idn().block() < 1000)
    };
    let backup = list(&kept, &[]);
    for (idn, name, data) in [
        (Idn::IDN_LIST_OF_ALL_OPERATION_DATA, "IDN list of all operation data", all),
        (Idn::IDN_LIST_OF_ALL_PROCEDURE_COMMANDS, "IDN list of all procedure commands", commands),
        (Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA, "IDN list of all backup operation data", backup),
        (
            Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_AT,
            "IDN list of configurable data in the producer",
            producible,
        ),
        (
            Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_MDT,
            "IDN list of configurable data in the consumer",
            consumable,
        ),
    ] {
        store.define(Definition::list(idn, IDN_LIST_READ_ONLY, name, &data, data.len()));
    }
}

/// Whether a communication cycle of `ns` is possible.
pub fn is_cycle_time(ns: u32) -> bool {
    matches!(ns, 31_250 | 62_500 | 125_000) || (ns != 0 && ns.is_multiple_of(250_000) && ns <= CYCLE_NS_MAX)
}

/// Judges the new value of a communication parameter beyond its limits.
pub fn check(store: &Store, idn: Idn, data: &[u8]) -> Result<(), SvcError> {
    let words = || data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let doubles = || data.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let good = match idn {
        Idn::CYCLE_TIME => doubles().all(is_cycle_time),
        Idn::SCP_ACTIVE => {
            let own = store.find(Idn::SCP_CLASSES).map_or(&[][..], |handle| store.get(handle).data());
            words().all(|word| own.chunks_exact(2).any(|own| own == word.to_le_bytes()))
        }
        Idn::MDT_LENGTHS | Idn::AT_LENGTHS => {
            data.len() == 8
                && words().all(|len| len == 0 || (DATA_LEN_MIN..=DATA_LEN_MAX).contains(&usize::from(len)))
        }
        Idn::UC_TIMES => data.len() == 8,
        Idn::ERROR_COUNTER_PORT_1_AND_PORT_2 => data.len() == 4 && words().all(|count| count == 0),
        _ if idn.block() == Idn::CONNECTION_BLOCK && !idn.is_product() => {
            idn.element() != connection::LIST || doubles().all(|word| value_len(store, Idn(word)).is_some())
        }
        _ => true,
    };
    if good { Ok(()) } else { Err(SvcError::INVALID_DATA) }
}

/// Bytes of a parameter in a connection, or `None` if it cannot be in one.
pub fn value_len(store: &Store, idn: Idn) -> Option<usize> {
    use super::parameter::Cyclic;
    let parameter = store.get(store.find(idn)?);
    let fixed = !parameter.attribute().is_list();
    (fixed && parameter.cyclic() != Cyclic::No).then_some(parameter.capacity())
}

/// S-0-1050.x.5 follows from the list.
fn set_length(store: &mut Store, index: u8) {
    let list = Idn::connection(index, connection::LIST);
    if store.find(list).is_some() {
        let sum: usize = store.idns(list).filter_map(|value| value_len(store, value)).sum();
        let len = i64::try_from(2 + sum).unwrap_or(i64::MAX);
        store.set_number_of(Idn::connection(index, connection::LENGTH), len);
    }
}

/// What follows from a new communication parameter: lengths and images.
pub fn written(store: &mut Store, idn: Idn) {
    if idn.block() != Idn::CONNECTION_BLOCK || idn.is_product() {
        match idn {
            Idn::MTU_REQUESTED => {
                let mtu = store.number_of(idn);
                store.set_number_of(Idn::MTU_EFFECTIVE, mtu);
            }
            Idn::ADDRESS => {
                let [low, high, ..] = store.number_of(idn).to_le_bytes();
                store.set_data_of(Idn::LIST_OF_SERCOS_ADDRESSES_IN_DEVICE, &[low, high]);
            }
            _ => {}
        }
        return;
    }
    match idn.element() {
        connection::LIST => set_length(store, idn.instance()),
        connection::SETUP => {
            let mut image = ArrayVec::<u8, { 2 * CONNECTIONS_MAX }>::new();
            for index in 0..u8::try_from(CONNECTIONS_MAX).unwrap_or(u8::MAX) {
                if let Some(handle) = store.find(Idn::connection(index, connection::SETUP)) {
                    image.extend(store.get(handle).data().iter().copied());
                }
            }
            store.set_data_of(Idn::CONNECTION_IMAGE, &image);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slave::parameter::Cyclic;

    fn store() -> Store {
        let mut store = Store::new();
        let config = crate::slave::Config {
            address: 5,
            connections: 2,
            serial: 77,
            ..crate::slave::Config::default()
        };
        define(&mut store, &config);
        store.define(Definition::value(Idn::standard(36), 0x0322_0001, "command", 0).cyclic(Cyclic::Command));
        store
            .define(Definition::value(Idn::standard(135), 0x7001_0001, "status", 0).cyclic(Cyclic::Feedback));
        define_lists(&mut store);
        store
    }

    #[test]
    fn cycle_times() {
        let good = || [31_250, 62_500, 125_000].into_iter().chain((1..=260).map(|n| n * 250_000));
        for cycle in good() {
            assert_eq!([cycle - 1, cycle, cycle + 1].map(is_cycle_time), [false, true, false], "{cycle}");
        }
        let steps = (0..=2_088).map(|n| n * 31_250);
        assert_eq!(steps.filter(|&cycle| is_cycle_time(cycle)).count(), good().count());
        let bad = [0, 31_251, 93_750, 300_000, 65_250_000, u32::MAX];
        assert!(!bad.into_iter().any(is_cycle_time));
    }

    #[test]
    fn connection_lists_give_the_length() {
        let mut store = store();
        let list = Idn::connection(1, connection::LIST);
        let data: Vec<u8> = [135u32, 36].iter().flat_map(|idn| idn.to_le_bytes()).collect();
        assert_eq!(check(&store, list, &data), Ok(()));
        assert_eq!(check(&store, list, &1002u32.to_le_bytes()), Err(SvcError::INVALID_DATA));
        store.set_data_of(list, &data);
        written(&mut store, list);
        assert_eq!(store.number_of(Idn::connection(1, connection::LENGTH)), 8);
        store.set_number_of(Idn::connection(1, connection::SETUP), 0xC000);
        written(&mut store, Idn::connection(1, connection::SETUP));
        let image = store.find(Idn::CONNECTION_IMAGE).unwrap();
        assert_eq!(store.get(image).data(), [0, 0, 0, 0xC0]);
    }

    #[test]
    fn lists_of_idns_are_sorted_and_complete() {
        let store = store();
        let all: Vec<Idn> = store.idns(Idn::IDN_LIST_OF_ALL_OPERATION_DATA).collect();
        assert_eq!(all.len(), store.iter().count());
        assert!(all.is_sorted());
        assert_eq!(
            store.idns(Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_AT).collect::<Vec<_>>(),
            [Idn::standard(135)]
        );
        assert_eq!(
            store.idns(Idn::LIST_OF_CONFIGURABLE_DATA_IN_THE_MDT).collect::<Vec<_>>(),
            [Idn::standard(36)]
        );
        let commands = [99, 127, 128, 1024].map(Idn::standard);
        assert_eq!(store.idns(Idn::IDN_LIST_OF_ALL_PROCEDURE_COMMANDS).collect::<Vec<_>>(), commands);
        assert_eq!(
            store.idns(Idn::IDN_LIST_OF_ALL_BACKUP_OPERATION_DATA).collect::<Vec<_>>(),
            [Idn::standard(142)]
        );
    }

    #[test]
    fn the_list_of_addresses_follows_the_address() {
        let mut store = store();
        let addresses = |store: &Store| {
            store.get(store.find(Idn::LIST_OF_SERCOS_ADDRESSES_IN_DEVICE).unwrap()).data().to_vec()
        };
        assert_eq!(addresses(&store), [5, 0]);
        store.set_number_of(Idn::ADDRESS, 0x0102);
        written(&mut store, Idn::ADDRESS);
        assert_eq!(addresses(&store), [2, 1]);
    }

    #[test]
    fn impossible_values_are_refused() {
        let store = store();
        let words = |words: &[u16]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let refused = Err(SvcError::INVALID_DATA);
        assert_eq!(check(&store, Idn::CYCLE_TIME, &10_000_000u32.to_le_bytes()), Ok(()));
        assert_eq!(check(&store, Idn::CYCLE_TIME, &10_000_001u32.to_le_bytes()), refused);
        // Recording sercos3_startup_line2, frames 2449 to 2481.
        assert_eq!(check(&store, Idn::SCP_ACTIVE, &words(&[0x0201, 0x0301, 0x0A01])), Ok(()));
        assert_eq!(check(&store, Idn::SCP_ACTIVE, &words(&[0x0202])), refused);
        assert_eq!(check(&store, Idn::MDT_LENGTHS, &words(&[46, 0, 0, 0])), Ok(()));
        assert_eq!(check(&store, Idn::MDT_LENGTHS, &words(&[39, 0, 0, 0])), refused);
        assert_eq!(check(&store, Idn::AT_LENGTHS, &words(&[1495, 0, 0, 0])), refused);
        assert_eq!(check(&store, Idn::AT_LENGTHS, &words(&[48])), refused);
        assert_eq!(check(&store, Idn::ERROR_COUNTER_PORT_1_AND_PORT_2, &words(&[0, 1])), refused);
    }
}
