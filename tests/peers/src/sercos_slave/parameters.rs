//! The parameters of the simulated drive as they are at power-up.
//!
//! Lists of identification numbers have four bytes each: the sheet says so for S-0-1050.x.6, and it is assumed for S-0-0017,
//! 0021, 0022, 0025, 0187, 0188 too. S-0-1051 holds a word for each connection, its setup. S-0-1302.0.2 is assumed to be a
//! list of double words. S-0-1040 takes effect at the next CP0.

use super::idn::{
    BIN2, COMMAND, CP2_ONLY, CP23, HEX2, HEX4, IDN_LIST, INT2, INT4, Idn, LIST2, LIST4, NOT_CP2, NOT_CP3,
    NOT_CP4, Parameter, READ_ONLY, TEXT, Table, UINT2, UINT4,
};
use super::scaling::{Scaling, whole};
use super::settings::Settings;

/// Every parameter with these settings.
#[must_use]
pub fn table(settings: &Settings) -> Table {
    let mut table = Table::default();
    communication(&mut table, settings);
    connections(&mut table, settings);
    scaling(&mut table, settings);
    drive(&mut table, settings);
    commands(&mut table);
    limits(&mut table, settings);
    for parameter in &settings.extra {
        table.add(parameter.clone());
    }
    for idn in &settings.absent {
        table.remove(*idn);
    }
    for (idn, name) in &settings.names {
        if let Some(parameter) = table.get_mut(*idn) {
            parameter.name = Some(name.clone());
        }
    }
    for (idn, unit) in &settings.units {
        if let Some(parameter) = table.get_mut(*idn) {
            parameter.unit = Some(unit.clone());
        }
    }
    lists(&mut table, settings);
    for idn in &settings.absent {
        table.remove(*idn);
    }
    table
}

fn plain(block: u32, name: &str, attribute: u32, value: i64) -> Parameter {
    let width = Parameter::new(Idn::s(block), "", attribute, &[]).width();
    Parameter::new(Idn::s(block), name, attribute, &value.to_le_bytes()[..width])
}

fn list(idn: Idn, name: &str, attribute: u32, data: &[u8], capacity: u16) -> Parameter {
    Parameter { capacity, ..Parameter::new(idn, name, attribute, data) }
}

fn words(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|word| word.to_le_bytes()).collect()
}

fn communication(table: &mut Table, settings: &Settings) {
    let classes = words(&settings.classes);
    table.add(list(Idn::s(1000), "List of SCP classes & version", LIST2 | READ_ONLY, &classes, 64));
    let active = Idn::se(1000, 0, 1);
    table.add(list(active, "List of active SCP classes & version", LIST2 | CP2_ONLY, &classes, 64));
    // What the master has to write in CP2 before S-0-0127 can succeed.
    for (block, name, attribute) in [
        (1002, "Communication cycle time (tScyc)", UINT4),
        (1003, "Allowed MST losses in CP3/CP4", UINT2),
        (1009, "Device control (C-DEV) offset in MDT", HEX2),
        (1011, "Device status (S-DEV) offset in AT", HEX2),
        (1013, "SVC offset in MDT", HEX2),
        (1014, "SVC offset in AT", HEX2),
    ] {
        table.add(Parameter { valid: false, ..plain(block, name, attribute | CP2_ONLY, 0) });
    }
    for (block, name) in [(1010, "Lengths of MDTs"), (1012, "Lengths of ATs")] {
        let parameter = list(Idn::s(block), name, 0x0015_0001 | CP2_ONLY, &[0; 8], 8);
        table.add(Parameter { valid: false, ..parameter });
    }
    table.add(plain(1005, "Minimum feedback processing time (t5)", UINT4 | READ_ONLY, 100_000).unit(b"ns"));
    let t1 = settings.shortest_t1_ns.to_le_bytes();
    let longest = 65_000_000u32.to_le_bytes();
    table.add(
        plain(1006, "AT0 transmission starting time (t1)", UINT4 | CP2_ONLY, 0)
            .unit(b"ns")
            .range(&t1, &longest),
    );
    for (block, name) in [
        (1007, "Feedback acquisition capture point (t4)"),
        (1008, "Command value valid time (t3)"),
        (1015, "Ring delay"),
        (1023, "SYNC jitter"),
        (1032, "Communication control"),
    ] {
        table.add(plain(block, name, UINT4 | CP2_ONLY, 0));
    }
    table.add(list(Idn::s(1017), "NRT transmission time", LIST4 | CP2_ONLY, &[0; 8], 8));
    table.add(plain(1036, "Inter Frame Gap", UINT2 | CP2_ONLY, 37));
    table.add(plain(1037, "Slave jitter", UINT2 | READ_ONLY, 80));
    table.add(plain(1047, "Maximum consumer activation time (t11)", UINT4 | READ_ONLY, 50_000));
    table.add(plain(1061, "Maximum TSref-Counter", UINT2 | CP2_ONLY, 0));
    table.add(plain(1028, "Error counter MST", UINT2 | READ_ONLY, 0));
    table.add(list(Idn::s(1035), "Error counter port 1 and port 2", 0x0015_0001 | READ_ONLY, &[0; 4], 4));
    let address = plain(1040, "SERCOS address", UINT2 | CP2_ONLY, i64::from(settings.address));
    table.add(address.range(&[0, 0], &511u16.to_le_bytes()));
    table.add(plain(1044, "Device control (C-DEV)", BIN2 | READ_ONLY, 0));
    table.add(plain(1045, "Device status (S-DEV)", BIN2 | READ_ONLY, 0));
    let own = words(&[settings.address]);
    table.add(list(Idn::s(1046), "List of SERCOS addresses in device", 0x0015_0001 | READ_ONLY, &own, 4));
    let mut mtu = plain(1027, "Requested MTU", UINT2 | CP2_ONLY, 1500);
    mtu.idn = Idn::se(1027, 0, 1);
    table.add(mtu.clone());
    table.add(Parameter {
        idn: Idn::se(1027, 0, 2),
        name: Some(b"Effective MTU".to_vec()),
        attribute: UINT2 | READ_ONLY,
        ..mtu
    });
    let profile = settings.profile.to_le_bytes();
    table.add(Parameter::new(Idn::se(1302, 0, 1), "FSP type & version", BIN2 | READ_ONLY, &profile));
    table.add(list(Idn::se(1302, 0, 2), "Function groups", 0x0036_0001 | READ_ONLY, &[], 64));
    for (element, name, text) in [
        (1, "Component name", "peer drive"),
        (2, "Vendor name", "peer works"),
        (4, "Device name", "PD-1"),
        (5, "Device ID", "PD-1-0001"),
        (8, "Hardware revision", "A01"),
        (9, "Software revision", "0.1"),
        (12, "Serial number", "0000001"),
    ] {
        table.add(list(Idn::se(1300, 0, element), name, TEXT | READ_ONLY, text.as_bytes(), 64));
    }
    table.add(Parameter::new(Idn::se(1300, 0, 3), "Vendor code", HEX2 | READ_ONLY, &[0xFF, 0x00]));
    if settings.long_list > 0 {
        let data: Vec<u8> = (0..u32::from(settings.long_list)).flat_map(u32::to_le_bytes).collect();
        let data = &data[..data.len().min(65532)];
        table.add(list(Idn::p(100), "Long list", LIST4, data, 65532));
    }
}

fn connections(table: &mut Table, settings: &Settings) {
    let fixed = settings.is_fixed();
    let mut image = Vec::new();
    for (number, connection) in (0u32..).zip(settings.connections.iter().take(255)) {
        let idn = |element| Idn::se(1050, number, element);
        let direction: u16 = if connection.producer { 0x4000 } else { 0 };
        let setup = if settings.fixed_setup { 0x8000 | direction } else { direction };
        image.push(setup);
        let locked = if settings.fixed_setup { READ_ONLY } else { CP2_ONLY };
        table.add(Parameter::new(idn(1), "Connection setup", BIN2 | locked, &setup.to_le_bytes()));
        if !fixed {
            table.add(Parameter::new(idn(2), "Connection number", UINT2 | CP2_ONLY, &[0, 0]));
        }
        let place = Parameter::new(idn(3), "Telegram assignment", HEX2 | CP2_ONLY, &[0, 0]);
        table.add(Parameter { valid: false, ..place });
        let length = super::connections::length(table_width, &connection.list);
        let length = connection.declared_length.unwrap_or(length).to_le_bytes();
        table.add(Parameter::new(idn(4), "Max. length of connection", UINT2 | READ_ONLY, &[128, 0]));
        table.add(Parameter::new(idn(5), "Current length of connection", UINT2 | READ_ONLY, &length));
        let data: Vec<u8> = connection.list.iter().flat_map(|i| i.0.to_le_bytes()).collect();
        let access = if fixed { READ_ONLY } else { CP2_ONLY };
        table.add(list(idn(6), "Configuration list", IDN_LIST | access, &data, 64));
        table.add(Parameter::new(idn(8), "Connection control (C-CON)", BIN2 | READ_ONLY, &[0, 0]));
        table.add(Parameter::new(idn(10), "Producer cycle time", UINT4 | CP2_ONLY, &[0; 4]).unit(b"ns"));
        table.add(Parameter::new(idn(11), "Allowed data losses", UINT2 | CP2_ONLY, &[10, 0]));
        table.add(Parameter::new(idn(12), "Error counter data losses", UINT2 | READ_ONLY, &[0, 0]));
        table.add(list(idn(20), "IDN allocation of real-time bit", IDN_LIST | CP2_ONLY, &[], 8));
        table.add(list(idn(21), "Bit allocation of real-time bit", 0x0015_0001 | CP2_ONLY, &[], 4));
    }
    if !fixed {
        let image = words(&image);
        table.add(list(Idn::s(1051), "Image of connection setups", LIST2 | READ_ONLY, &image, 512));
    }
}

/// The width of what a connection may carry, known before the table is complete.
fn table_width(idn: Idn) -> usize {
    match idn.block() {
        134 | 135 | 11 | 12 | 13 | 14 | 80 | 81 | 84 | 403 => 2,
        _ => 4,
    }
}

fn scaling(table: &mut Table, settings: &Settings) {
    let values = &settings.scaling;
    let access = if values.read_only { READ_ONLY } else { CP23 };
    for (block, name, kind, value) in [
        (43, "Velocity polarity parameter", BIN2, i64::from(values.velocity_polarity)),
        (44, "Velocity data scaling type", BIN2, i64::from(values.velocity_type)),
        (45, "Velocity data scaling factor", UINT2, i64::from(values.velocity_factor)),
        (46, "Velocity data scaling exponent", INT2, i64::from(values.velocity_exponent)),
        (55, "Position polarity parameters", BIN2, i64::from(values.position_polarity)),
        (76, "Position data scaling type", BIN2, i64::from(values.position_type)),
        (77, "Linear position data scaling factor", UINT2, i64::from(values.position_factor)),
        (78, "Linear position data scaling exponent", INT2, i64::from(values.position_exponent)),
        (79, "Rotational position resolution", UINT4, i64::from(values.resolution)),
        (85, "Torque polarity parameter", BIN2, i64::from(values.torque_polarity)),
        (86, "Torque/force data scaling type", BIN2, i64::from(values.torque_type)),
        (93, "Torque/force data scaling factor", UINT2, i64::from(values.torque_factor)),
        (94, "Torque/force data scaling exponent", INT2, i64::from(values.torque_exponent)),
        (103, "Modulo value", INT4, i64::from(values.modulo)),
        (121, "Input revolutions of load gear", UINT4, i64::from(values.gear_input)),
        (122, "Output revolutions of load gear", UINT4, i64::from(values.gear_output)),
        (123, "Feed constant", INT4, i64::from(values.feed_constant)),
        (160, "Acceleration data scaling type", BIN2, i64::from(values.acceleration_type)),
        (161, "Acceleration data scaling factor", UINT2, i64::from(values.acceleration_factor)),
        (162, "Acceleration data scaling exponent", INT2, i64::from(values.acceleration_exponent)),
    ] {
        table.add(plain(block, name, kind | access, value));
    }
}

fn drive(table: &mut Table, settings: &Settings) {
    for (block, name, attribute, value) in [
        (11, "Class 1 diagnostic (C1D)", BIN2 | READ_ONLY, 0),
        (12, "Class 2 diagnostic (C2D)", BIN2 | READ_ONLY, 0),
        (13, "Class 3 diagnostic (C3D)", BIN2 | READ_ONLY, 0),
        (14, "Interface status", BIN2 | READ_ONLY, 0),
        (36, "Velocity command value", INT4, 0),
        (37, "Additive velocity command value", INT4, 0),
        (40, "Velocity feedback value 1", INT4 | READ_ONLY, 0),
        (41, "Homing velocity", INT4, 600_000),
        (42, "Homing acceleration", INT4, 628_319),
        (47, "Position command value", INT4, 0),
        (48, "Additive position command value", INT4, 0),
        (51, "Position feedback value 1", INT4 | READ_ONLY, 0),
        (52, "Reference distance 1", INT4, 0),
        (53, "Position feedback value 2", INT4 | READ_ONLY, 0),
        (80, "Torque command value", INT2, 0),
        (81, "Additive torque command value", INT2, 0),
        (84, "Torque feedback value", INT2 | READ_ONLY, 0),
        (104, "Position loop Kv factor", UINT2, 600),
        (109, "Motor peak current", UINT4 | CP23, 15_000),
        (111, "Motor continuous stall current", UINT4 | CP23, 5_000),
        (124, "Standstill window", INT4, 600),
        (134, "Drive control", BIN2 | READ_ONLY, 0),
        (135, "Drive status", BIN2 | READ_ONLY, 0),
        (147, "Homing parameter", BIN2, 0),
        (150, "Reference offset 1", INT4, 0),
        (159, "Monitoring window", INT4, i64::from(settings.monitoring_window)),
        (189, "Following distance", INT4 | READ_ONLY, 0),
        (206, "Drive on delay time", UINT2, 0),
        (207, "Drive off delay time", UINT2, 0),
        (217, "Parameter set preselection", UINT2, 0),
        (254, "Actual parameter set", UINT2 | READ_ONLY, 0),
        (258, "Target position", INT4, 0),
        (259, "Positioning velocity", INT4, 0),
        (260, "Positioning acceleration", INT4, 0),
        (390, "Diagnostic number", HEX4 | READ_ONLY, 0xC30A_0008),
        (403, "Position feedback value status", BIN2 | READ_ONLY, 0),
    ] {
        table.add(plain(block, name, attribute, value));
    }
    let modes = [(32, "Primary operation mode"), (33, "Secondary operation mode 1")];
    let more = [(34, "Secondary operation mode 2"), (35, "Secondary operation mode 3")];
    for ((block, name), mode) in modes.into_iter().chain(more).zip(settings.selected_modes) {
        table.add(plain(block, name, BIN2 | CP23, i64::from(mode)));
    }
    let known = words(&settings.modes);
    table.add(list(Idn::s(292), "List of supported operation modes", LIST2 | READ_ONLY, &known, 64));
    for (block, name, text) in [
        (30, "Manufacturer version", "peer 0.1"),
        (95, "Diagnostic message", "NRT"),
        (140, "Controller type", "PD-1"),
        (141, "Motor type", "PM-1"),
    ] {
        table.add(list(Idn::s(block), name, TEXT | READ_ONLY, text.as_bytes(), 128));
    }
    for (block, unit) in [(36, "rpm"), (40, "rpm"), (47, "deg"), (51, "deg"), (80, "%"), (84, "%")] {
        if let Some(parameter) = table.get_mut(Idn::s(block)) {
            parameter.unit = Some(unit.as_bytes().to_vec());
            let point = match block {
                36 | 40 | 47 | 51 => 4,
                _ => 1,
            };
            parameter.attribute |= point << 24;
        }
    }
}

fn commands(table: &mut Table) {
    for (block, name, access) in [
        (99, "Reset class 1 diagnostic", 0),
        (127, "CP3 transition check", CP2_ONLY),
        (128, "CP4 transition check", NOT_CP2 | NOT_CP4),
        (148, "Drive controlled homing procedure command", NOT_CP2 | NOT_CP3),
        (191, "Cancel reference point procedure command", 0),
        (216, "Switch parameter set procedure command", 0),
        (262, "Load defaults procedure command", 0),
        (420, "Activate parameterization level", NOT_CP2),
        (422, "Exit parameterization level", NOT_CP2),
        (1024, "SYNC delay measuring procedure command", CP2_ONLY),
    ] {
        table.add(plain(block, name, COMMAND | access, 0));
    }
}

fn limits(table: &mut Table, settings: &Settings) {
    let scaling = Scaling::new(table, settings.encoder, settings.stall_torque);
    let velocity = whole(settings.max_velocity * scaling.velocity).clamp(0, i64::from(u32::MAX));
    let acceleration = whole(settings.max_acceleration * scaling.acceleration).clamp(0, i64::from(i32::MAX));
    table.add(plain(91, "Bipolar velocity limit value", UINT4, velocity));
    table.add(plain(92, "Bipolar torque limit value", UINT2, 4000));
    table.add(plain(138, "Bipolar acceleration limit value", INT4, acceleration));
    table.add(plain(49, "Positive position limit value", INT4, i64::from(i32::MAX)));
    table.add(plain(50, "Negative position limit value", INT4, i64::from(i32::MIN)));
}

fn lists(table: &mut Table, settings: &Settings) {
    for (block, name) in [
        (17, "IDN-list of all operation data"),
        (21, "IDN-list of invalid operation data for CP2"),
        (22, "IDN-list of invalid operation data for CP3"),
        (25, "IDN-list of all procedure commands"),
        (187, "List of configurable data in the AT"),
        (188, "List of configurable data in the MDT"),
    ] {
        table.add(list(Idn::s(block), name, IDN_LIST | READ_ONLY, &[], 65532));
    }
    let all: Vec<Idn> = table.numbers().collect();
    table.set_idns(Idn::s(17), &all);
    let commands: Vec<Idn> = table.all().filter(|p| p.is_command()).map(|p| p.idn).collect();
    table.set_idns(Idn::s(25), &commands);
    table.set_idns(Idn::s(187), &settings.producible);
    table.set_idns(Idn::s(188), &settings.consumable);
}
