//! Tables that are broken on purpose.

use super::*;
use crate::finding::registry as code;

fn broken(change: impl Fn(&mut TableTexts)) -> String {
    let mut texts = TableTexts::embedded();
    change(&mut texts);
    match Mapping::from_texts(&texts) {
        Ok(_) => "nothing found".to_owned(),
        Err(errors) => errors.to_string(),
    }
}

fn replace(table: &mut TableText, from: &str, to: &str) {
    assert!(table.text.contains(from), "{from:?} is not in {}", table.path);
    table.text = table.text.replacen(from, to, 1);
}

/// One of the files.
type Table = fn(&mut TableTexts) -> &mut TableText;

/// What to break, in which file, from what, to what.
type Case = (&'static str, Table, &'static str, &'static str);

const CASES: &[Case] = &[
    ("no TOML", |t| &mut t.cip_generic, "[scaling]", "[scaling"),
    ("unknown key", |t| &mut t.cip_generic, "wraps = true", "wrap = true"),
    ("wrong type", |t| &mut t.sercos_idns, "length = 2,", "length = \"two\","),
    ("warning that stops", |t| &mut t.generic_sercos, "cause = \"cooling_warning\"", "cause = \"cooling\""),
    ("no such action", |t| &mut t.cip_generic, "least = \"Ignore\"", "least = \"Ignored\""),
    (
        "default below the least",
        |t| &mut t.cip_generic,
        "least = \"Ignore\", default = \"Alarm\"",
        "default = \"Alarm\"",
    ),
    ("unknown signal", |t| &mut t.cip_generic, "\"position_command\"", "\"position_comand\""),
    (
        "unknown IDN",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0047\", direction",
        "idn = \"S-0-4047\", direction",
    ),
    ("diagnosis that is no text", |t| &mut t.generic_sercos, "text = \"S-0-0095\"", "text = \"S-0-0099\""),
    (
        "diagnosis that is no number",
        |t| &mut t.generic_sercos,
        "number = \"S-0-0390\"",
        "number = \"S-0-0375\"",
    ),
    ("no IDN", |t| &mut t.generic_sercos, "idn = \"S-0-0047\", direction", "idn = \"S-47\", direction"),
    (
        "range of an attribute that is a text",
        |t| &mut t.cip_generic,
        "{ attribute = \"Motor Catalog Number\", served_by = \"device\",",
        "{ attribute = \"Motor Catalog Number\", served_by = \"device\", range = [0, 1],",
    ),
    ("unknown attribute", |t| &mut t.cip_generic, "attribute = \"Kpp\"", "attribute = \"Kpq\""),
    ("unit does not convert", |t| &mut t.cip_generic, "\"position_loop_gain\"", "\"jerk_limit\""),
    ("trim that is no offset", |t| &mut t.cip_generic, "\"torque_offset\"", "\"torque_command\""),
    ("unknown exception", |t| &mut t.cip_generic, "exception = \"Brake Slip\"", "exception = \"Brake Slap\""),
    (
        "two answers",
        |t| &mut t.cip_generic,
        "exception = \"Brake Slip\"",
        "exception = \"Brake Slip\", manufacturer = 9",
    ),
    ("manufacturer bit 0", |t| &mut t.cip_generic, "manufacturer = 1 }", "manufacturer = 0 }"),
    (
        "field value too large",
        |t| &mut t.generic_sercos,
        "\"Drive on\", is = \"off\"",
        "\"Drive on\", is = 2",
    ),
    (
        "unknown value of a field",
        |t| &mut t.generic_sercos,
        "\"Drive on\", is = \"off\"",
        "\"Drive on\", is = \"of\"",
    ),
    (
        "unknown value of the control word",
        |t| &mut t.generic_sercos,
        "send = \"Follow command values\"",
        "send = \"Follow command value\"",
    ),
    ("CiA 402: unknown command", |t| &mut t.generic_cia402, "send = \"Shutdown\"", "send = \"Shut down\""),
    (
        "unknown key of a group",
        |t| &mut t.cip_generic,
        "source = \"Table 5-2.10\"\nrows",
        "sauce = \"Table 5-2.10\"\nrows",
    ),
    ("unknown field", |t| &mut t.generic_sercos, "field = \"Drive on\"", "field = \"Drive off\""),
    (
        "who makes the way",
        |t| &mut t.generic_sercos,
        "interpolation = \"drive\"",
        "interpolation = \"drives\"",
    ),
    (
        "neither refused nor omitted",
        |t| &mut t.generic_sercos,
        "missing = \"omit\", codes",
        "missing = \"no\", codes",
    ),
    (
        "procedure without command",
        |t| &mut t.generic_sercos,
        "commands = [\"S-0-0148\"]",
        "commands = [\"S-0-0147\"]",
    ),
    ("procedure led by nobody", |t| &mut t.generic_sercos, "led_in = \"position\", ", ""),
    (
        "procedure led in no mode",
        |t| &mut t.generic_sercos,
        "led_in = \"position\"",
        "led_in = \"acceleration\"",
    ),
    (
        "procedure and mode",
        |t| &mut t.generic_sercos,
        "mode = \"homing\", interpolation = \"drive\"",
        "mode = \"position\", interpolation = \"drive\"",
    ),
    ("bound and unbound", |t| &mut t.generic_sercos, "idns = [\n    ", "idns = [\n    \"S-0-0047\", "),
    ("unbound twice", |t| &mut t.generic_sercos, "idns = [\n    ", "idns = [\n    \"S-0-0026\", "),
    (
        "unbound for no reason",
        |t| &mut t.generic_sercos,
        "reason = \"one bit of S-0-0012 by itself: the word carries it\"",
        "reason = \"\"",
    ),
    ("CiA 402: bound and unbound", |t| &mut t.generic_cia402, "\"60FE\"", "\"60FE\", \"6040\""),
    ("CiA 402: unbound twice", |t| &mut t.generic_cia402, "\"60FE\"", "\"60FE\", \"60E3\""),
    ("CiA 402: unbound and unknown", |t| &mut t.generic_cia402, "\"60FE\"", "\"60FE\", \"5FFF\""),
    ("wrong direction", |t| &mut t.generic_sercos, "direction = \"to_drive\"", "direction = \"from_drive\""),
    (
        "read only",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0111\", direction = \"from_drive\"",
        "idn = \"S-0-0112\", direction = \"both\"",
    ),
    ("phase", |t| &mut t.generic_sercos, "phase = 2, do = \"write\"", "phase = 4, do = \"write\""),
    ("ratio", |t| &mut t.generic_sercos, "generic_per_unit = [1_000, 1]", "generic_per_unit = [1_000, 0]"),
    ("state twice", |t| &mut t.cip_generic, "state = \"shutdown\"", "state = \"faulted\""),
    ("attribute twice", |t| &mut t.cip_attributes, "{ id = 41,", "{ id = 40,"),
    (
        "attribute name twice",
        |t| &mut t.cip_attributes,
        "name = \"Motion Unit\"",
        "name = \"Motion Resolution\"",
    ),
    (
        "attribute without a clause",
        |t| &mut t.cip_attributes,
        "source = \"Table 5-2.9\", clause",
        "source = \"Table 5-2.8\", clause",
    ),
    ("attribute need", |t| &mut t.cip_attributes, "need = \"-O----\"", "need = \"-O---\""),
    ("attribute polarity", |t| &mut t.cip_attributes, "polarity = \"sign\"", "polarity = \"swap\""),
    (
        "limits that do not swap",
        |t| &mut t.cip_attributes,
        "swaps_with = \"Torque Limit - Negative\"",
        "swaps_with = \"Kpp\"",
    ),
    ("range upside down", |t| &mut t.cip_attributes, "min = 0, max = 100", "min = 101, max = 100"),
    (
        "channel without a place in the name",
        |t| &mut t.cip_attributes,
        "\"Feedback n Turns\"",
        "\"Feedback Turns\"",
    ),
    ("channels that overlap", |t| &mut t.cip_attributes, "step = 50", "step = 34"),
    ("channel above the last number", |t| &mut t.cip_attributes, "{ id = 1435,", "{ id = 65535,"),
    ("service code", |t| &mut t.cip_services, "code = 0x4B", "code = 0x9B"),
    ("service twice", |t| &mut t.cip_services, "code = 0x4B", "code = 0x4C"),
    ("service need", |t| &mut t.cip_services, "instance = \"--OOOO\"", "instance = \"--XXXX\""),
    ("service carrier", |t| &mut t.cip_services, "via = [\"explicit\"]", "via = [\"implicit\"]"),
    ("service without a carrier", |t| &mut t.cip_services, "via = [\"explicit\"]", "via = []"),
    ("network twice", |t| &mut t.cip_networks, "name = \"ControlNet\"", "name = \"DeviceNet\""),
    ("network format", |t| &mut t.cip_networks, "formats = [\"fixed\"]", "formats = [\"loose\"]"),
    ("network without a format", |t| &mut t.cip_networks, "formats = [\"fixed\"]", "formats = []"),
    ("network without axes", |t| &mut t.cip_networks, "axes = [1, 16]", "axes = [0, 16]"),
    ("network axes upside down", |t| &mut t.cip_networks, "variable = [1, 4]", "variable = [5, 4]"),
    ("network class twice", |t| &mut t.cip_networks, "class = 0x05", "class = 0x01"),
    ("network need", |t| &mut t.cip_networks, "need = \"O\"", "need = \"C\""),
    ("network priority", |t| &mut t.cip_networks, "priority = \"urgent\"", "priority = \"low\""),
    ("codes of nothing", |t| &mut t.cip_enumerations, "attributes = [\"Control Mode\"]\n", ""),
    (
        "codes of an unknown attribute",
        |t| &mut t.cip_enumerations,
        "attributes = [\"Control Method\"]",
        "attributes = [\"Control Methods\"]",
    ),
    (
        "codes of an unknown class attribute",
        |t| &mut t.cip_enumerations,
        "class_attributes = [\"Node Status\"]",
        "class_attributes = [\"Nod Status\"]",
    ),
    ("set twice", |t| &mut t.cip_enumerations, "name = \"Control Method\"", "name = \"Control Mode\""),
    (
        "code twice",
        |t| &mut t.cip_enumerations,
        "{ code = 1, name = \"Position Control\"",
        "{ code = 0, name = \"Position Control\"",
    ),
    (
        "bit above the width",
        |t| &mut t.cip_faults,
        "name = \"APR Faults\"\nattributes = [\"APR Faults\"]\nwidth = 16",
        "name = \"APR Faults\"\nattributes = [\"APR Faults\"]\nwidth = 7",
    ),
    (
        "code above the field",
        |t| &mut t.cip_enumerations,
        "{ code = 4, name = \"Torque Control\"",
        "{ code = 16, name = \"Torque Control\"",
    ),
    ("field above the value", |t| &mut t.cip_enumerations, "field = [0, 3]", "field = [5, 8]"),
    ("codes with a width", |t| &mut t.cip_enumerations, "field = [0, 3]", "width = 8"),
    (
        "bits without a width",
        |t| &mut t.cip_enumerations,
        "attributes = [\"Control Status\"]\nwidth = 8\n",
        "attributes = [\"Control Status\"]\n",
    ),
    (
        "bits with a field",
        |t| &mut t.cip_enumerations,
        "attributes = [\"Control Status\"]\nwidth = 8\n",
        "attributes = [\"Control Status\"]\nwidth = 8\nfield = [0, 3]\n",
    ),
    (
        "range over a code",
        |t| &mut t.cip_enumerations,
        "{ from = 5, to = 15, kind = \"reserved\" }",
        "{ from = 4, to = 15, kind = \"reserved\" }",
    ),
    (
        "range over a range, the wrong way round, of an unknown kind",
        |t| &mut t.cip_enumerations,
        "  { from = 128, to = 255, kind = \"vendor\" },\n",
        "  { from = 127, to = 256, kind = \"maker\" },\n  { from = 9, to = 8, kind = \"vendor\" },\n",
    ),
    ("unknown limit", |t| &mut t.cip_faults, "limits = [\"Brake Slip", "limits = [\"Brake Slap"),
    (
        "limit of the axis for the node",
        |t| &mut t.cip_faults,
        "limits = [\"Sync Threshold\"]",
        "limits = [\"Torque Threshold\"]",
    ),
    (
        "set in both files",
        |t| &mut t.cip_faults,
        "name = \"Node Alarm Code\"\nclass",
        "name = \"Axis State\"\nclass",
    ),
    (
        "record of unknown conditions",
        |t| &mut t.cip_faults,
        "conditions = \"APR Faults\"",
        "conditions = \"APR Fault\"",
    ),
    (
        "record twice",
        |t| &mut t.cip_faults,
        "conditions = \"APR Faults - Mfg\"\nfault_type = \"APR Fault - Mfg\"",
        "conditions = \"APR Faults\"\nfault_type = \"APR Fault\"",
    ),
    ("unknown clearing", |t| &mut t.cip_faults, "[\"time_out\"]", "[\"times_out\"]"),
    ("action twice", |t| &mut t.cip_faults, "action = \"Alarm\"", "action = \"Ignore\""),
    ("status twice", |t| &mut t.cip_faults, "general = 0x14", "general = 0x0A"),
    (
        "catalogue",
        |t| &mut t.generic,
        "quantity = \"torque\", access = \"command\"",
        "quantity = \"time\", access = \"command\"",
    ),
    ("format", |t| &mut t.sercos_idns, "format = 1", "format = 2"),
    ("profile", |t| &mut t.sercos_bits, "profile = \"sercos\"", "profile = \"sercose\""),
    ("IDN twice", |t| &mut t.sercos_idns, "idn = \"S-0-0012\"", "idn = \"S-0-0011\""),
    ("IDN in both files", |t| &mut t.sercos_communication, "idn = \"S-0-0014\"", "idn = \"S-0-0013\""),
    ("element twice", |t| &mut t.sercos_communication, "idn = \"S-0-1050.x.2\"", "idn = \"S-0-1050.0.1\""),
    ("no such number", |t| &mut t.sercos_communication, "idn = \"S-0-1050.x.2\"", "idn = \"S-0-1050.y.2\""),
    ("IDN without a clause", |t| &mut t.sercos_idns, "clause = \"12.1\", ", ""),
    ("unknown unit", |t| &mut t.sercos_idns, "unit = \"us\"", "unit = \"µs\""),
    ("unknown scaling", |t| &mut t.sercos_idns, "scaling = \"velocity\"", "scaling = \"velocities\""),
    (
        "unit and scaling",
        |t| &mut t.sercos_idns,
        "scaling = \"velocity\"",
        "scaling = \"velocity\", unit = \"us\"",
    ),
    ("unknown display format", |t| &mut t.sercos_idns, "format = \"signed\"", "format = \"sined\""),
    ("odd length", |t| &mut t.sercos_idns, "length = 2,", "length = 3,"),
    ("unknown group", |t| &mut t.sercos_idns, "group = \"FG Motor\"", "group = \"FG Moto\""),
    ("phases out of order", |t| &mut t.sercos_idns, "write = [2, 3]", "write = [3, 2]"),
    ("phase without a service channel", |t| &mut t.sercos_idns, "write = [2, 3]", "write = [1, 2]"),
    ("cyclic in nothing", |t| &mut t.sercos_idns, "cyclic = { at = \"M\" }", "cyclic = { }"),
    ("cyclic by nobody", |t| &mut t.sercos_idns, "cyclic = { at = \"M\" }", "cyclic = { at = \"Q\" }"),
    (
        "element 3 of another length",
        |t| &mut t.sercos_idns,
        "attribute = 0x70110001",
        "attribute = 0x70120001",
    ),
    (
        "written where element 3 forbids it",
        |t| &mut t.sercos_idns,
        "attribute = 0x40010001",
        "attribute = 0x60010001",
    ),
    (
        "read only where element 3 lets write",
        |t| &mut t.sercos_idns,
        "attribute = 0x70110001",
        "attribute = 0x60110001",
    ),
    ("element 3 of another point", |t| &mut t.sercos_idns, "decimals = 3,", "decimals = 4,"),
    (
        "length of which nothing is known",
        |t| &mut t.sercos_idns,
        "source = \"list\", confidence = \"unknown\"",
        "length = 2, source = \"list\", confidence = \"unknown\"",
    ),
    (
        "high by one family",
        |t| &mut t.sercos_idns,
        "source = \"R3 R4\", confidence = \"medium\"",
        "source = \"R3 R4\", confidence = \"high\"",
    ),
    ("unknown confidence", |t| &mut t.sercos_idns, "confidence = \"high\"", "confidence = \"hihg\""),
    ("unknown document", |t| &mut t.sercos_idns, "source = \"R1 M E\"", "source = \"R1 N E\""),
    ("no document", |t| &mut t.sercos_idns, "source = \"R1 M E\"", "source = \"\""),
    ("document twice", |t| &mut t.sercos_terms, "key = \"R2\"", "key = \"R1\""),
    ("unit twice", |t| &mut t.sercos_terms, "unit = \"kW\"", "unit = \"V\""),
    ("scaling by an unknown IDN", |t| &mut t.sercos_terms, "type = \"S-0-0208\"", "type = \"S-0-4008\""),
    (
        "bits that overlap",
        |t| &mut t.sercos_bits,
        "{ bits = [14, 14], name = \"Enable drive\"",
        "{ bits = [14, 15], name = \"Enable drive\"",
    ),
    (
        "pieces that overlap",
        |t| &mut t.sercos_bits,
        "parts = [[11, 11], [9, 9]",
        "parts = [[11, 11], [9, 11]",
    ),
    ("bits above the width", |t| &mut t.sercos_bits, "bits = [30, 31]", "bits = [30, 32]"),
    ("bits upside down", |t| &mut t.sercos_bits, "bits = [30, 31]", "bits = [31, 30]"),
    ("no bits", |t| &mut t.sercos_bits, "bits = [30, 31], ", ""),
    ("bits and pieces", |t| &mut t.sercos_bits, "bits = [30, 31]", "bits = [30, 31], parts = [[30, 31]]"),
    (
        "bits without a name",
        |t| &mut t.sercos_bits,
        "bits = [30, 31], name = \"Interpretation\"",
        "bits = [30, 31]",
    ),
    (
        "reserved bits with a name",
        |t| &mut t.sercos_bits,
        "reserved = true",
        "reserved = true, name = \"Free\"",
    ),
    ("field twice", |t| &mut t.sercos_bits, "name = \"Feedback error\"", "name = \"Control voltage error\""),
    (
        "width of another IDN",
        |t| &mut t.sercos_bits,
        "idns = [\"S-0-0011\"]\nlayout = \"all\"\nwidth = 16",
        "idns = [\"S-0-0011\"]\nlayout = \"all\"\nwidth = 32",
    ),
    ("odd width", |t| &mut t.sercos_bits, "width = 32", "width = 24"),
    ("unknown layout", |t| &mut t.sercos_bits, "layout = \"III\"", "layout = \"IV\""),
    ("word twice", |t| &mut t.sercos_bits, "name = \"Class 2 diagnostic\"", "name = \"Class 1 diagnostic\""),
    ("two words of an IDN", |t| &mut t.sercos_bits, "idns = [\"S-0-0012\"]", "idns = [\"S-0-0011\"]"),
    ("word of an unknown IDN", |t| &mut t.sercos_bits, "idns = [\"S-0-0179\"]", "idns = [\"S-0-2179\"]"),
    ("word of nothing", |t| &mut t.sercos_bits, "element = \"attribute (element 3) of every IDN\"\n", ""),
    (
        "value above the field",
        |t| &mut t.sercos_bits,
        "{ value = 3, name = \"enabled\"",
        "{ value = 4, name = \"enabled\"",
    ),
    (
        "value twice",
        |t| &mut t.sercos_bits,
        "{ value = 1, name = \"drive on\"",
        "{ value = 0, name = \"drive on\"",
    ),
    (
        "pattern above its bits",
        |t| &mut t.sercos_bits,
        "bits = [13, 15], value = 7",
        "bits = [13, 15], value = 8",
    ),
    ("unknown set of codes", |t| &mut t.sercos_bits, "codes = \"SCP class\"", "codes = \"SCP classes\""),
    (
        "source without confidence",
        |t| &mut t.sercos_bits,
        "source = \"M\", confidence = \"medium\"",
        "source = \"M\"",
    ),
    (
        "mapping of a word of many",
        |t| &mut t.generic_sercos,
        "word = \"Home switch\"",
        "word = \"Probe inputs\"",
    ),
    ("SERCOS code twice", |t| &mut t.sercos_codes, "code = 0x000C", "code = 0x000B"),
    (
        "name of a code twice",
        |t| &mut t.sercos_codes,
        "name = \"Velocity control\"",
        "name = \"Torque control\"",
    ),
    ("set of codes twice", |t| &mut t.sercos_codes, "name = \"SCP class\"", "name = \"FSP type\""),
    ("code above the IDN", |t| &mut t.sercos_codes, "code = 0xC01B", "code = 0x1C01B"),
    ("codes of bits above the IDN", |t| &mut t.sercos_codes, "field = [8, 15]", "field = [8, 16]"),
    (
        "codes over a code",
        |t| &mut t.sercos_codes,
        "from = 0x8001, to = 0x800C",
        "from = 0x8001, to = 0x8803",
    ),
    (
        "codes upside down",
        |t| &mut t.sercos_codes,
        "from = 0x8001, to = 0x800C",
        "from = 0x8001, to = 0x8000",
    ),
    ("codes of an unknown kind", |t| &mut t.sercos_codes, "kind = \"vendor\"", "kind = \"maker\""),
    ("codes that nothing has", |t| &mut t.sercos_codes, "idns = [\"S-0-1302.x.1\"]\n", ""),
    ("object twice", |t| &mut t.cia402_objects, "index = 0x6041", "index = 0x6040"),
    (
        "object within a family",
        |t| &mut t.cia402_objects,
        "index = 0x1600, to = 0x17FF",
        "index = 0x1500, to = 0x17FF",
    ),
    ("family upside down", |t| &mut t.cia402_objects, "to = 0x15FF", "to = 0x13FF"),
    (
        "unknown type of an object",
        |t| &mut t.cia402_objects,
        "name = \"Controlword\", type = \"u16\"",
        "name = \"Controlword\", type = \"word\"",
    ),
    (
        "unknown access of an object",
        |t| &mut t.cia402_objects,
        "type = \"u16\", access = \"rw\", pdo = \"rx\", category = \"mandatory\"",
        "type = \"u16\", access = \"rww\", pdo = \"rx\", category = \"mandatory\"",
    ),
    (
        "unknown PDO of an object",
        |t| &mut t.cia402_objects,
        "type = \"u16\", access = \"rw\", pdo = \"rx\", category = \"mandatory\"",
        "type = \"u16\", access = \"rw\", pdo = \"yes\", category = \"mandatory\"",
    ),
    (
        "what cannot be written in an RPDO",
        |t| &mut t.cia402_objects,
        "type = \"u16\", access = \"ro\", pdo = \"tx\", category = \"mandatory\"",
        "type = \"u16\", access = \"ro\", pdo = \"rx\", category = \"mandatory\"",
    ),
    (
        "default beyond its type",
        |t| &mut t.cia402_objects,
        "name = \"Guard time\", type = \"u16\"",
        "name = \"Guard time\", type = \"visible_string\"",
    ),
    (
        "node-ID added to nothing",
        |t| &mut t.cia402_objects,
        "default = 0x80, plus_node = true",
        "plus_node = true",
    ),
    (
        "unknown unit of an object",
        |t| &mut t.cia402_objects,
        "unit = \"permille of rated torque\", category",
        "unit = \"per mille\", category",
    ),
    (
        "unknown mode of an object",
        |t| &mut t.cia402_objects,
        "modes = [\"pp\", \"csp\"], ",
        "modes = [\"pp\", \"cps\"], ",
    ),
    (
        "unknown category of an object",
        |t| &mut t.cia402_objects,
        "category = \"mandatory\"",
        "category = \"required\"",
    ),
    (
        "variable with sub-objects",
        |t| &mut t.cia402_objects,
        "name = \"Gear ratio\", kind = \"array\"",
        "name = \"Gear ratio\"",
    ),
    (
        "record without sub-objects",
        |t| &mut t.cia402_objects,
        "name = \"Guard time\", type",
        "name = \"Guard time\", kind = \"record\", type",
    ),
    (
        "sub-objects out of order",
        |t| &mut t.cia402_objects,
        "{ sub = 2, name = \"Max position limit\"",
        "{ sub = 1, name = \"Max position limit\"",
    ),
    (
        "object of one family with high",
        |t| &mut t.cia402_objects,
        "source = \"HV\", confidence = \"medium\", note = \"0 linear ramp",
        "source = \"HV\", confidence = \"high\", note = \"0 linear ramp",
    ),
    (
        "object of nobody",
        |t| &mut t.cia402_objects,
        "source = \"HV\", confidence = \"medium\", note = \"0 linear ramp",
        "source = \"XY\", confidence = \"medium\", note = \"0 linear ramp",
    ),
    ("object without a name", |t| &mut t.cia402_objects, "name = \"Touch probe function\"", "name = \"\""),
    (
        "unknown object that says something",
        |t| &mut t.cia402_objects,
        "index = 0x604D, name = \"\", ",
        "index = 0x604D, name = \"\", type = \"u8\", ",
    ),
    ("CiA 402 unit twice", |t| &mut t.cia402_objects, "unit = \"us\", meaning", "unit = \"ns\", meaning"),
    ("code of an unknown object", |t| &mut t.cia402_codes, "objects = [0x6402]", "objects = [0x6401]"),
    ("code of nothing", |t| &mut t.cia402_codes, "element = \"byte 0 of an NMT frame\"\n", ""),
    ("CiA 402 set twice", |t| &mut t.cia402_codes, "name = \"Motor type\"", "name = \"Digital outputs\""),
    ("CiA 402 code twice", |t| &mut t.cia402_codes, "code = 0x8612", "code = 0x8611"),
    (
        "CiA 402 name twice",
        |t| &mut t.cia402_codes,
        "name = \"Reference limit\"",
        "name = \"Following error\"",
    ),
    (
        "code beyond its object",
        |t| &mut t.cia402_codes,
        "code = 11, name = \"Cyclic synchronous torque with",
        "code = 128, name = \"Cyclic synchronous torque with",
    ),
    (
        "bit beyond its object",
        |t| &mut t.cia402_codes,
        "{ code = 7, name = \"Position polarity\"",
        "{ code = 8, name = \"Position polarity\"",
    ),
    (
        "bit of two meanings in one mode",
        |t| &mut t.cia402_codes,
        "name = \"Max slippage error\", modes = [\"pv\"]",
        "name = \"Max slippage error\", modes = [\"pp\"]",
    ),
    (
        "state outside of its mask",
        |t| &mut t.cia402_codes,
        "code = 0x0040, mask = 0x004F",
        "code = 0x0080, mask = 0x004F",
    ),
    ("state without a mask", |t| &mut t.cia402_codes, "code = 0x0040, mask = 0x004F", "code = 0x0040"),
    (
        "mask of a code",
        |t| &mut t.cia402_codes,
        "{ code = 1, name = \"Fault\" }",
        "{ code = 1, mask = 1, name = \"Fault\" }",
    ),
    ("range over a CiA 402 code", |t| &mut t.cia402_codes, "from = 3, to = 6", "from = 2, to = 6"),
    (
        "class upside down",
        |t| &mut t.cia402_codes,
        "from = 0x8300, to = 0x83FF",
        "from = 0x8300, to = 0x82FF",
    ),
    ("CiA 402 set of an unknown kind", |t| &mut t.cia402_codes, "kind = \"states\"", "kind = \"words\""),
];

#[test]
fn are_refused_with_place_key_and_what_was_expected() {
    let mut text = String::new();
    for (what, table, from, to) in CASES {
        let errors = broken(|texts| replace(table(texts), from, to));
        assert_ne!(errors, "nothing found", "{what}");
        writeln!(text, "## {what}\n{errors}\n").unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn errors_carry_their_place_as_numbers() {
    let mut texts = TableTexts::embedded();
    replace(&mut texts.cip_generic, "signal = \"position_command\"", "signal = \"position_comand\"");
    let lines = &mut texts.cip_generic.text.lines().enumerate();
    let place = lines.find_map(|(line, text)| Some((line + 1, text.find("\"position_comand\"")? + 1)));
    let (line, column) = place.unwrap();
    let errors = Mapping::from_texts(&texts).unwrap_err();
    let [error] = errors.list() else { panic!("{errors}") };
    assert_eq!((error.line, error.column, error.key.as_str()), (line, column, "signal"));
    assert_eq!(error.file, "mappings/tables/cip-generic.toml");
}

/// Line, column and key of what is wrong with the SERCOS dictionary, counted here in the text.
#[test]
fn errors_of_the_sercos_dictionary_carry_their_exact_place() {
    let cases: &[(Table, &str, &str, &str, &str)] = &[
        (
            |t| &mut t.sercos_idns,
            "idn = \"S-0-0058\"",
            "idn = \"S-0-0031\", name = \"Reversal\", clause = \"0\", source = \"list\", confidence = \"unknown\" },\n  { idn = \"S-0-0058\"",
            "\"S-0-0031\", name = \"Rev",
            "idn",
        ),
        (|t| &mut t.sercos_idns, "unit = \"us\"", "unit = \"uS\"", "\"uS\"", "unit"),
        (|t| &mut t.sercos_idns, "format = \"idn\"", "format = \"in\"", "\"in\"", "format"),
        (|t| &mut t.sercos_bits, "bits = [24, 29]", "bits = [24, 30]", "[24, 30]", "bits"),
        (
            |t| &mut t.sercos_codes,
            "code = 0x7007",
            "code = 0x7006",
            "0x7006, name = \"operation data is ab",
            "code",
        ),
    ];
    for (table, from, to, wrong, key) in cases {
        let mut texts = TableTexts::embedded();
        replace(table(&mut texts), from, to);
        let (path, text) = (table(&mut texts).path.clone(), table(&mut texts).text.clone());
        let (line, content) = (1..).zip(text.lines()).find(|(_, content)| content.contains(wrong)).unwrap();
        let column = content.find(wrong).unwrap() + 1;
        let errors = Mapping::from_texts(&texts).unwrap_err();
        let [error] = errors.list() else { panic!("{errors}") };
        assert_eq!((error.file.as_str(), error.line, error.column), (path.as_str(), line, column), "{error}");
        assert_eq!(error.key, *key, "{error}");
    }
}

/// The examples are worth their place: a row that is changed is found out.
#[test]
fn a_changed_ratio_makes_an_example_fail() {
    let changes: &[(Table, &str, &str)] = &[
        (
            |t| &mut t.cip_generic,
            "quantity = \"torque\", generic_per_unit = [10_000, 1]",
            "quantity = \"torque\", generic_per_unit = [1_000, 1]",
        ),
        (|t| &mut t.cip_generic, "nanounits = 25_400_000_000", "nanounits = 25_000_000_000"),
        (|t| &mut t.generic_sercos, "divisor = 3_600_000, expect", "divisor = 360_000, expect"),
        (|t| &mut t.generic_sercos, "factor = [-1, 1], ", ""),
    ];
    for (table, from, to) in changes {
        let mut texts = TableTexts::embedded();
        let before =
            texts.cip_generic.text.matches(from).count() + texts.generic_sercos.text.matches(from).count();
        for _ in 0..before {
            replace(table(&mut texts), from, to);
        }
        let mut findings = Findings::default();
        Mapping::from_texts(&texts).unwrap().run_examples(&mut findings);
        assert!(findings.list().iter().any(|found| found.code == code::EXAMPLE_FAILS), "{from}");
    }
}

#[test]
fn a_folder_replaces_files_and_may_hold_no_others() {
    let folder = std::env::temp_dir().join(format!("axisbridge-mapping-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("dictionary")).unwrap();
    let mut texts = TableTexts::embedded();
    replace(&mut texts.sercos_idns, "name = \"Position command value\"", "name = \"Position set-point\"");
    std::fs::write(folder.join("dictionary/sercos-idns.toml"), &texts.sercos_idns.text).unwrap();
    let mapping = Mapping::from_folder(&folder).unwrap();
    let name = mapping.dictionaries.sercos.idn(Idn::standard(47)).map(|row| row.name.clone());
    assert_eq!(name.as_deref(), Some("Position set-point"));
    std::fs::write(folder.join("cip_generic.toml"), "").unwrap();
    let errors = Mapping::from_folder(&folder).unwrap_err();
    assert!(errors.list()[0].expected.contains("got `cip_generic.toml`"), "{errors}");
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(Mapping::from_folder(&folder).unwrap_err().list()[0].code == code::UNREADABLE);
}
