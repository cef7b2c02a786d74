//! What the files for engineering tools have in common: names, types, and the function block of an axis.

use std::fmt::Write as _;

use profile_cip::assembly::handshake::{Control, Status};

use super::{Device, Field};

/// Words that no language of the files takes as a name.
const KEYWORDS: &[&str] = &[
    "abs", "action", "and", "array", "at", "bool", "by", "byte", "case", "class", "def", "del", "dint", "do",
    "dt", "dword", "elif", "else", "elsif", "end", "exit", "false", "for", "from", "function", "global",
    "if", "import", "in", "int", "is", "lambda", "len", "limit", "lint", "lreal", "lword", "max", "min",
    "mod", "move", "mux", "none", "not", "of", "or", "pass", "program", "real", "repeat", "return", "rol",
    "ror", "sel", "shl", "shr", "sint", "step", "string", "task", "then", "time", "tod", "to", "true", "try",
    "type", "udint", "uint", "ulint", "until", "usint", "var", "while", "with", "word", "xor",
];

/// A name of the configuration as an identifier.
pub fn identifier(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        let letter = if letter.is_ascii_alphanumeric() { letter } else { '_' };
        if letter != '_' || !text.ends_with('_') {
            text.push(letter);
        }
    }
    let text = text.trim_end_matches('_');
    let is_keyword = KEYWORDS.contains(&text.to_ascii_lowercase().as_str());
    if text.is_empty() || text.starts_with(|first: char| !first.is_ascii_alphabetic()) || is_keyword {
        return format!("axis_{}", text.trim_start_matches('_'));
    }
    text.to_owned()
}

/// A device, as the files name its parts.
pub struct Library<'a> {
    pub device: &'a Device<'a>,
    /// What the names of its types begin with.
    pub prefix: String,
    /// Identifiers of the axes, in the order of the assemblies.
    pub axes: Vec<String>,
}

impl<'a> Library<'a> {
    pub fn of(device: &'a Device<'a>) -> Self {
        let mut axes: Vec<String> = Vec::new();
        for name in &device.axes {
            let mut name = identifier(name);
            // Two names may differ in what an identifier cannot have, or in the case of their letters.
            while axes.iter().any(|other| other.eq_ignore_ascii_case(&name)) {
                name.push_str("_2");
            }
            axes.push(name);
        }
        Self { device, prefix: identifier(device.name), axes }
    }

    /// Fields of one axis from the controller.
    pub fn output(&self) -> &[Field<'a>] {
        of_one(&self.device.output.fields, self.axes.len())
    }

    /// Fields of one axis to the controller.
    pub fn input(&self) -> &[Field<'a>] {
        of_one(&self.device.input.fields, self.axes.len())
    }

    /// The four types: name, what it is, members as name, type and description.
    pub fn types(&self) -> [Structure; 4] {
        let Self { prefix, axes, device } = self;
        let fields = |fields: &[Field<'_>]| -> Vec<Member> {
            let member = |field: &Field<'_>| Member {
                name: field.name.to_owned(),
                kind: field.kind.to_owned(),
                about: field.description.to_owned(),
            };
            fields.iter().map(member).collect()
        };
        let whole = |kind: &str| -> Vec<Member> {
            let member = |(axis, name): (&String, &&str)| Member {
                name: axis.clone(),
                kind: format!("{prefix}_{kind}"),
                about: format!("Axis {name}."),
            };
            axes.iter().zip(&device.axes).map(member).collect()
        };
        [
            Structure::new(format!("{prefix}_AxisOutput"), "One axis, to the gateway", fields(self.output())),
            Structure::new(format!("{prefix}_AxisInput"), "One axis, from the gateway", fields(self.input())),
            Structure::new(
                format!("{prefix}_Output"),
                format!("Output assembly {}, {} bytes", device.output.point, device.output.bytes),
                whole("AxisOutput"),
            ),
            Structure::new(
                format!("{prefix}_Input"),
                format!("Input assembly {}, {} bytes", device.input.point, device.input.bytes),
                whole("AxisInput"),
            ),
        ]
    }

    /// What the device is connected by, a line each.
    pub fn about(&self) -> Vec<String> {
        let Device { name, address, configuration_point, output, input, .. } = self.device;
        let mut about = vec![
            format!("Device {name} at {address}, by `axisbridge assembly` {}.", env!("CARGO_PKG_VERSION")),
            format!("Output assembly {}: {} bytes.", output.point, output.bytes),
            format!("Input assembly {}: {} bytes.", input.point, input.bytes),
            format!("Configuration assembly {configuration_point}: 0 bytes."),
            "Run/idle header: in the output, not in the input.".to_owned(),
        ];
        about.extend(self.device.torque().map(|torque| format!("References: {torque}.")));
        about
    }

    /// The function block of an axis; `None` for a layout without targets or without what the block looks at.
    pub fn block(&self) -> Option<Block> {
        let has = |fields: &[Field<'_>], name: &str| fields.iter().any(|field| field.name == name);
        let target = self.output().iter().find(|field| field.name.starts_with("target_position"))?;
        let complete = has(self.output(), "control") && has(self.output(), "velocity");
        let actual = target.name.replacen("target", "actual", 1);
        let shows = ["status", "refusal", "fault", &actual].iter().all(|name| has(self.input(), name));
        (self.device.positions && complete && shows).then(|| Block {
            name: format!("{}_Axis", self.prefix),
            target: (target.name.to_owned(), target.kind.to_owned()),
            acceleration: has(self.output(), "acceleration"),
            mode: has(self.output(), "mode"),
            output: format!("{}_AxisOutput", self.prefix),
            input: format!("{}_AxisInput", self.prefix),
        })
    }
}

/// The first of so many axes with the same fields.
fn of_one<'a, 'b>(fields: &'b [Field<'a>], axes: usize) -> &'b [Field<'a>] {
    fields.get(..fields.len() / axes.max(1)).unwrap_or_default()
}

/// A member of a structure.
pub struct Member {
    pub name: String,
    /// A type of IEC 61131-3, or the name of another structure.
    pub kind: String,
    pub about: String,
}

/// A structure.
pub struct Structure {
    pub name: String,
    pub about: String,
    pub members: Vec<Member>,
}

impl Structure {
    fn new(name: String, about: impl Into<String>, members: Vec<Member>) -> Self {
        Self { name, about: about.into(), members }
    }
}

/// How a language of the files differs from the others.
pub struct Dialect {
    /// Whether a bit of a word is set.
    pub bit: fn(word: &str, bit: u32) -> String,
    /// Copies a value of 64 bits.
    pub copy_long: fn(to: &str, from: &str) -> String,
}

/// The function block that moves an axis to a target.
pub struct Block {
    pub name: String,
    /// Name and type of the field of the target.
    target: (String, String),
    acceleration: bool,
    mode: bool,
    /// Types of an axis.
    pub output: String,
    pub input: String,
}

/// Bits of the status word, and the outputs of the block that show them.
const SHOWN: [(&str, Status, &str); 12] = [
    ("Ready", Status::READY, "The axis can be enabled."),
    ("Enabled", Status::ENABLED, "The axis is in operation."),
    ("Fault", Status::FAULT, "The axis has a fault; its cause is FaultCode."),
    ("Moving", Status::MOVING, "A movement goes on."),
    ("Locked", Status::LOCKED, "Enable has to be FALSE before it counts."),
    ("Run", Status::RUN, "The gateway takes the orders of this controller."),
    ("Held", Status::HELD, "Local control has the axis."),
    ("Standstill", Status::STANDSTILL, "The axis stands."),
    ("Saturated", Status::SATURATED, "A value does not fit its field."),
    ("Synchronized", Status::SYNCHRONIZED, "Time stamps count."),
    ("Warning", Status::WARNING, "The drive warns."),
    ("Torque", Status::TORQUE, "The drive may have torque."),
];

/// Bits of the control word, and the variables that set them.
const SET: [(&str, Control); 5] = [
    ("Enable", Control::ENABLE),
    ("Halt", Control::STOP),
    ("Start", Control::START),
    ("Reset", Control::RESET),
    ("Relative", Control::RELATIVE),
];

impl Block {
    /// Name of the field of the target.
    pub fn target_field(&self) -> &str {
        &self.target.0
    }

    /// Whether the layout has an acceleration.
    pub const fn has_acceleration(&self) -> bool {
        self.acceleration
    }

    /// Whether the layout has a mode.
    pub const fn has_mode(&self) -> bool {
        self.mode
    }

    /// What a user of it should know, a line each.
    pub fn about(&self) -> [&'static str; 4] {
        [
            "Moves one axis to a target. Call it in every scan, one instance for each axis.",
            "Enable counts from a rising edge on. After a lost connection and after a fault, set it to FALSE and to TRUE again.",
            "A rising edge of Execute starts a movement to Target; Done or Error ends it. Halt brakes and ends it with Error.",
            "This is not a safety function.",
        ]
    }

    /// Its inputs.
    pub fn inputs(&self) -> Vec<Member> {
        let mut inputs = vec![
            member("Connected", "BOOL", "The tool's status of the connection: it is open, and data come."),
            member("Enable", "BOOL", "Torque, from a rising edge on."),
            member("Execute", "BOOL", "A rising edge starts a movement."),
            member("Relative", "BOOL", "Target counts from the position set-point at the start."),
            member("Halt", "BOOL", "Brakes to standstill with torque."),
            member("Reset", "BOOL", "A rising edge resets faults."),
            member("Target", &self.target.1, "Target, counts."),
            member("Velocity", "DINT", "Velocity, counts/s, above 0."),
        ];
        if self.acceleration {
            inputs.push(member(
                "Acceleration",
                "DINT",
                "Acceleration, counts/s^2; 0 takes the limit of the axis.",
            ));
        }
        inputs
    }

    /// Its outputs.
    pub fn outputs(&self) -> Vec<Member> {
        let mut outputs = vec![
            member("Busy", "BOOL", "A movement was started and has not ended."),
            member("Done", "BOOL", "The axis has reached the target of the last movement."),
            member("Error", "BOOL", "The last movement was refused or was ended before its target."),
        ];
        outputs.extend(SHOWN.iter().map(|(name, _, about)| member(name, "BOOL", about)));
        outputs.push(member("Refusal", "USINT", "Why the last order was refused; 0 when it was not."));
        outputs.push(member("FaultCode", "UINT", "Cause of the fault; 0 without one."));
        outputs
    }

    /// Its own variables.
    pub fn locals(&self) -> Vec<Member> {
        vec![
            member("ExecuteBefore", "BOOL", "Execute in the scan before."),
            member("Start", "BOOL", "The control word has START."),
            member("Taken", "BOOL", "The gateway has taken START."),
            member("Arrived", "BOOL", "The gateway reports the target as reached."),
            member("Refused", "BOOL", "The gateway has refused an order."),
            member(
                "Phase",
                "DINT",
                "0 idle, 1 waits for the end of the last START, 2 START is set, 3 on its way.",
            ),
            member("ControlWord", "DINT", "The control word that is put together."),
        ]
    }

    /// Its statements.
    pub fn body(&self, dialect: &Dialect) -> String {
        let mut text = String::new();
        let bit = |of: Status| (dialect.bit)("FromAxis.status", of.bits().trailing_zeros());
        let rows = SHOWN.iter().map(|(name, of, _)| (*name, *of)).chain([
            ("Taken", Status::START_TAKEN),
            ("Arrived", Status::DONE),
            ("Refused", Status::REFUSED),
        ]);
        for (name, of) in rows {
            let _ = writeln!(text, "{name} := Connected AND {};", bit(of));
        }
        text.push_str("Refusal := FromAxis.refusal;\nFaultCode := FromAxis.fault;\n\n");
        text.push_str("IF Execute AND NOT ExecuteBefore THEN\n");
        let (target, kind) = &self.target;
        let to = format!("ToAxis.{target}");
        let copy = match kind.as_str() {
            "LINT" => (dialect.copy_long)(&to, "Target"),
            _ => format!("{to} := Target;"),
        };
        let _ = writeln!(text, "    {copy}\n    ToAxis.velocity := Velocity;");
        if self.acceleration {
            text.push_str("    ToAxis.acceleration := Acceleration;\n");
        }
        text.push_str(
            "    Phase := 1;\n    Busy := TRUE;\n    Done := FALSE;\n    Error := FALSE;\nEND_IF;\n\
             ExecuteBefore := Execute;\n\n\
             IF Phase > 0 AND (Fault OR Halt OR NOT Enabled) THEN\n    Phase := 0;\n    Error := TRUE;\n\
             ELSIF Phase = 1 AND NOT Taken THEN\n    Phase := 2;\n\
             ELSIF Phase = 2 AND Taken THEN\n    Phase := 3;\n\
             ELSIF Phase = 3 AND Refused THEN\n    Phase := 0;\n    Error := TRUE;\n\
             ELSIF Phase = 3 AND Arrived THEN\n    Phase := 0;\n    Done := TRUE;\n\
             END_IF;\n\
             Busy := Phase > 0;\n\
             (* START stays while the movement goes on, so that each start is an edge. *)\n\
             Start := Phase > 1;\n\n",
        );
        if self.mode {
            text.push_str("(* Position. *)\nToAxis.mode := 1;\n");
        }
        text.push_str("ControlWord := 0;\n");
        for (name, bit) in SET {
            let _ =
                writeln!(text, "IF {name} THEN\n    ControlWord := ControlWord + {};\nEND_IF;", bit.bits());
        }
        text
    }
}

fn member(name: &str, kind: &str, about: &str) -> Member {
    Member { name: name.to_owned(), kind: kind.to_owned(), about: about.to_owned() }
}

/// A text in XML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::identifier;

    #[test]
    fn names_become_identifiers() {
        for (name, expected) in [
            ("slide", "slide"),
            ("drive-a", "drive_a"),
            ("x--y", "x_y"),
            ("2nd", "axis_2nd"),
            ("Int", "axis_Int"),
            ("-", "axis_"),
            ("achse-ü", "achse"),
        ] {
            assert_eq!(identifier(name), expected, "{name}");
        }
    }
}
