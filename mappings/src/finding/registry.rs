//! Every kind of finding: its code, how bad it is, what it means and what to do.
//!
//! A code is never given another meaning and never used again. `docs/findings.md` is written from this registry; a test holds
//! the two together, and another that every code is found in one of the broken files under `tests/broken/`.

use std::fmt;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The files cannot be used.
    Error,
    /// They can be used, and something is probably not as it was meant.
    Warning,
    /// Worth knowing.
    Note,
}

impl Severity {
    /// The word for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A stable number of a kind of finding, shown as `AX0012`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code(u16);

impl Code {
    /// The code that is written so, in letters of either case.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let digits =
            text.get(..2).filter(|head| head.eq_ignore_ascii_case("AX")).and_then(|_| text.get(2..))?;
        let code = Self(digits.parse().ok().filter(|_| digits.len() == 4)?);
        REGISTRY.iter().any(|entry| entry.code == code).then_some(code)
    }

    /// What the registry has of it.
    #[must_use]
    pub fn entry(self) -> &'static Entry {
        REGISTRY.iter().find(|entry| entry.code == self).unwrap_or(&REGISTRY[0])
    }

    /// How bad it is.
    #[must_use]
    pub fn severity(self) -> Severity {
        self.entry().severity
    }

    /// What it means, in a few words.
    #[must_use]
    pub fn title(self) -> &'static str {
        self.entry().title
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "AX{:04}", self.0)
    }
}

/// What is to be said of a code.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The code.
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// What it means, in a few words.
    pub title: &'static str,
    /// What it means, and why it matters.
    pub explanation: &'static str,
    /// What leads to it.
    pub example: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} ({}): {}\n\n{}\n\nExample:\n",
            self.code, self.severity, self.title, self.explanation
        )?;
        for line in self.example.lines() {
            writeln!(f, "    {line}")?;
        }
        write!(f, "\nWhat to do: {}", self.remedy)
    }
}

/// The registry as a page of the documentation.
#[must_use]
pub fn page() -> String {
    let mut page = String::from(
        "# Findings\n\nWhat `axisbridge check` and `axisbridge run` find in mapping tables and configurations. \
         `axisbridge check --explain AX0010`\nprints one of them, `--list` the list. An error keeps the files from being \
         used; a warning does not; `--notes` also shows\nnotes that ask for nothing. A code never changes its meaning. This page is written by \
         `axisbridge check --list --format markdown`.\n",
    );
    for entry in REGISTRY {
        page.push_str(&format!(
            "\n## {} {}: {}\n\n{}\n\n```toml\n{}\n```\n\n{}\n",
            entry.code, entry.severity, entry.title, entry.explanation, entry.example, entry.remedy
        ));
    }
    page
}

/// Notes that report a fact and ask for nothing.
pub const FACTS: &[Code] =
    &[ROW_NUMBERS, REQUIRED_UNSERVED, MODE_UNSERVED, DRIVE_SCALING, DRIVE_MAPPING, FACT_ACCEPTED, SHEET_NOTE];

macro_rules! registry {
    ($($name:ident = $number:literal $severity:ident $title:literal: $explanation:literal, $example:literal, $remedy:literal;)*) => {
        $(#[doc = concat!("AX", stringify!($number), ": ", $title, ".")] pub const $name: Code = Code($number);)*

        /// Every code, by number.
        pub const REGISTRY: &[Entry] = &[$(Entry {
            code: $name,
            severity: Severity::$severity,
            title: $title,
            explanation: $explanation,
            example: $example,
            remedy: $remedy,
        },)*];
    };
}

registry! {
    UNREADABLE = 1 Error "the file cannot be read":
        "A configuration, a table, an overlay or a folder that was named does not exist, the system does not allow reading it, or the folder has no overlay in it.",
        "[mappings]\noverlays = [\"no-such-file.toml\"]",
        "Correct the path. Paths in a configuration and in `base` are relative to the folder of the file that names them.";
    TOO_LONG = 2 Error "the file is too long":
        "Tables and overlays may have 2 MiB, a configuration 1 MiB: more than ten times the size of real ones. A longer file is probably the wrong file, and is not read.",
        "# a recording of 10 MB, named as a table",
        "Name the right file. Split a file that is really so long into several overlays.";
    NOT_UTF8 = 3 Error "the file is not UTF-8":
        "The files are TOML, which is UTF-8. An editor that writes another encoding damages characters beyond ASCII, such as those of °C.",
        "# the byte 0xB0 of ISO 8859-1 in place of °",
        "Save the file as UTF-8.";
    SYNTAX = 4 Error "the text is not TOML":
        "The text cannot be parsed into keys and values. The findings show every place where this fails.",
        "[[parameter]\nparameter = jerk_limit",
        "Correct the brackets, quotation marks and commas; see https://toml.io.";
    WRONG_TYPE = 5 Error "a value of the wrong type":
        "The key is known, but its value has another type: a text instead of a number, or a single value instead of a list.",
        "[[generic-sercos.fault]]\nword = 11",
        "Give a value of the expected type.";
    UNKNOWN_KEY = 6 Error "an unknown key":
        "No part of the program reads this key. Most likely it is misspelt, and would be ignored silently.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmising = \"reject\"",
        "Correct its name, or remove it.";
    MISSING_KEY = 7 Error "a key is missing":
        "The row or table needs the key. In an overlay this means that the row is new: there is no row with the same identity from which it could inherit the key.",
        "[[generic-sercos.parameter]]\nparameter = \"energy\"",
        "Add the key. If you wanted to change an existing row, correct the keys that identify it.";
    WRONG_HEAD = 8 Error "the head of the file does not match":
        "`format` is the version of the file format; `mapping` or `profile` says what the file contains. Another head means another kind of file, or a file for another version of the program.",
        "format = 2\noverlay = \"for a later version\"",
        "Move the file to its place, or convert it to this version.";
    STRANGER = 9 Error "a file that is not one of the tables":
        "In a folder that replaces tables, each `.toml` file has the name of the table that it replaces. Any other file would be ignored silently.",
        "# mappings/tables/cip_generic.toml, which should be cip-generic.toml",
        "Correct its name, or move it out of the folder. Rows of your own belong in an overlay.";

    UNKNOWN_NAME = 10 Error "an unknown name":
        "The row names an attribute, a signal, a parameter, an IDN, an object, a field or a code that no dictionary has.",
        "[[cip-generic.attribute]]\nattribute = \"Kpq\"",
        "Correct the name. `axisbridge dictionary` prints all of them. Add a name that is really new to the dictionary first.";
    BAD_IDN = 11 Error "not an IDN":
        "An IDN is written as S-0-0047, P-1-0100, or S-0-1050.x.6 with structure instance and element.",
        "[[generic-sercos.signal]]\nsignal = \"position_command\"\nidn = \"S-47\"",
        "Write the IDN in full.";
    UNKNOWN_WORD = 12 Error "an unknown word":
        "The key takes one of a few words.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmissing = \"ignore\"",
        "Use one of the listed words.";
    OUT_OF_RANGE = 13 Error "a number or value out of range":
        "A number, length, bit, code or time is outside the range of the key.",
        "[[generic-sercos.mode_slot]]\nslot = 1\nidn = \"S-0-0033\"\n[generic-sercos.direction]\npolarity = { idn = \"S-0-0055\", bit = 16 }",
        "Give a value within the shown range.";
    TWICE = 14 Error "defined twice":
        "The same thing is defined twice, so one of the two would be used and the other ignored silently.",
        "[[south.sercos.drive]]\nname = \"a\"\naddress = 1\n\n[[south.sercos.drive]]\nname = \"a\"\naddress = 2",
        "Keep one of them. To change a shipped row, put it into an overlay.";
    CONTRADICTION = 15 Error "keys that exclude each other":
        "The keys of a row or table exclude each other, or one needs another that is missing.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nremove = true\nmissing = \"reject\"",
        "Keep those that say what you mean.";
    ROW_MISSING = 16 Error "a row is missing":
        "Something that every axis needs has no row: a drive state, an action, a signal that a mode uses.",
        "[[generic-sercos.action]]\naction = \"halt\"\nremove = true",
        "Add the row.";
    TOO_MANY = 17 Error "too many":
        "The cycle works with tables of fixed size, so that it never allocates. There are more rows, axes or files than fit.",
        "# 65 overlays",
        "Remove what you do not need.";
    OVERLAP = 18 Error "bits or codes that overlap":
        "Two fields have the same bit, or a range includes a code that has a name.",
        "[[sercos-bits.word]]\nname = \"Class 2 diagnostic\"\nlayout = \"all\"\nfields = [{ bits = [0, 1], name = \"Both\" }]",
        "Give every bit and every code one meaning.";
    UNTRUSTED = 19 Error "source and confidence do not agree":
        "A row of the SERCOS dictionary says where it was read and how far to trust it: `high` needs documents of two vendor families, and every key must be a document of sercos-terms.toml.",
        "[[sercos-idns.idn]]\nidn = \"S-0-0104\"\nsource = \"hearsay\"",
        "Name the documents, and lower the confidence to what they support.";
    CONTRADICTS_CATALOGUE = 20 Error "a difference from the generic model":
        "The generic dictionary repeats the program's catalogue. It is there to be read, not to be changed.",
        "[[generic.signal]]\nname = \"torque_command\"\nquantity = \"time\"",
        "Restore the row to what the catalogue says.";
    CONTRADICTS_ATTRIBUTE = 21 Error "a difference from element 3 of the drive":
        "`attribute` is element 3 as a live drive has shown it. Length, format, decimals and write protection of the row must agree with it.",
        "[[sercos-idns.idn]]\nidn = \"S-0-0159\"\nlength = 2",
        "Correct the row or the attribute word, whichever was misread.";

    UNIT = 30 Error "the unit does not convert":
        "The two ends of the row measure different things, or no [[unit]] or [[scaling]] row says how one becomes the other.",
        "[[cip-generic.attribute]]\nattribute = \"Kpp\"\nparameter = \"bus_nominal_voltage\"",
        "Correct one of the ends, or add a [[unit]] row if the unit is new.";
    DIRECTION = 31 Error "the wrong direction":
        "A command goes to the drive, an actual value comes from it; a signal belongs to one telegram.",
        "[[generic-sercos.signal]]\nsignal = \"position_command\"\ndirection = \"from_drive\"",
        "Correct the direction, or the signal.";
    READ_ONLY = 32 Error "the target is read-only":
        "The row writes something that cannot be written in any phase: the drive would refuse every write.",
        "[[generic-sercos.parameter]]\nparameter = \"motor_rated_current\"\nidn = \"S-0-0112\"\ndirection = \"both\"",
        "Use `direction = \"from_drive\"`.";
    NO_LENGTH = 33 Error "the length is unknown":
        "A value in a telegram needs a place and a length before the drive is there. Lists, and IDNs of which nothing is known, have no length.",
        "[[generic-sercos.signal]]\nsignal = \"torque_offset\"\nidn = \"S-0-0017\"",
        "Use an IDN of known length, or add what you know about it to the dictionary.";
    PHASE = 34 Error "it cannot be written in this phase":
        "The dictionary says that the IDN is write protected in the communication phase of the step.",
        "[[generic-sercos.commission]]\nphase = 4\ndo = \"write\"\nidn = \"S-0-0076\"\nvalue = 0x42\nrefused = \"fail\"\nsource = \"test\"",
        "Move the step to a phase in which the IDN can be written.";
    NOT_A_COMMAND = 35 Error "not a procedure command":
        "Only a procedure command can be set, enabled and waited for.",
        "[[generic-sercos.action]]\naction = \"reset_fault\"\ncommand = \"S-0-0047\"",
        "Name the IDN of a procedure command.";
    WRONG_KIND = 36 Error "a parameter of another kind":
        "An attribute that is a number needs a parameter that is a whole number.",
        "[[cip-generic.attribute]]\nattribute = \"Kpp\"\nparameter = \"motor_name\"",
        "Use a parameter that is a number.";
    FIELD_VALUE = 37 Error "a value that its field cannot hold":
        "A field of n bits has values from 0 to 2^n - 1, so the pattern could never match.",
        "[[generic-sercos.action]]\naction = \"enable\"\npattern = [{ field = \"Drive on\", is = 2 }]",
        "Correct the value, or the field.";
    RANGE_LOST = 38 Warning "the range of one end does not fit the other":
        "Types and scalings allow values at one end of the row that the other end cannot represent. They are clamped, and the axis does less than commanded. The finding names the first value that is lost.",
        "[axis.limits]\nposition_min = -10.0\nposition_max = 1_000.0 # turns, and the drive ends at 596",
        "Adapt the scalings, or keep the axis within the smaller range by its limits.";
    PRECISION_LOST = 39 Warning "precision is lost":
        "One step of one end is several steps of the other, or not a whole number of them. Values are rounded; the finding says by how much at most, and at which value first.",
        "[[axis]]\nmotion_resolution = 10_000_000 # the drive has 3600000 counts in a turn",
        "Use a resolution that the coarser side can represent, or a finer scaling of the drive.";
    EXAMPLE_FAILS = 40 Error "a worked example fails":
        "The numbers of an example do not agree with the row: one of the two is wrong. Examples were computed by hand and keep a table from changing by accident.",
        "[[generic-sercos.parameter]]\nparameter = \"brake_release_time\"\nidn = \"S-0-0114\"",
        "If an overlay has changed the row, take the example away with `remove = [\"examples\"]`, or write examples of your own. Otherwise compute the example again, and correct whichever is wrong.";
    ROW_NUMBERS = 41 Note "what a row can hold":
        "Range and step of a value, computed with the conversions of the cycle from types and scalings of both ends: of the drive as Axisbridge scales it, in the unit of the controller. A floating point number has 24 bits, or 53: beyond the shown value it is coarser than the drive.",
        "[[generic-sercos.signal]]\nsignal = \"torque_command\"",
        "Nothing. Compare it with what the axis has to do.";
    WRONG_SIGN = 42 Error "the sign does not follow the drive":
        "A drive inverts values by bits of its own: S-0-0043, S-0-0055 and S-0-0085, or 607Eh. The row of a value names the bit that inverts this value, in both directions. Without it, or with the bit of another value, an axis of a drive that has the bit set turns the other way.",
        "[[generic-sercos.signal]]\nsignal = \"position_actual\"\npolarity = { idn = \"S-0-0055\", bit = 0 }",
        "Write the polarity that the finding names. If this drive is really different, write `# accept: reason` next to the row.";
    WRONG_SHAFT = 43 Error "gear or feed at the wrong shaft":
        "S-0-0121 has the turns of the motor and S-0-0122 those of the load that belong to them; a torque goes through the gear the other way. 608Fh, 6091h and 6092h have what is divided by in sub-index 1. A gear that is turned round makes values wrong by its square.",
        "[[generic-sercos.scaling]]\nscaling = \"velocity\"\nload = { pattern = [0x40, 0x40], gear = [\"S-0-0122\", \"S-0-0121\"] }",
        "Write gear and feed as the finding says, the same for position, velocity, acceleration and jerk.";
    WRONG_SCALE = 44 Error "a count is something else by the standard":
        "`check` computes what a count is twice for each scaling type: by the table, and by the formula of the standard. The two differ, and the finding says by which factor.",
        "[[generic-sercos.unit]]\nunit = \"1/min\"\nquantity = \"velocity\"\ngeneric_per_unit = [1_000_000_000, 1]",
        "Correct base, exponent, divisor, ratio or pattern. If this drive really counts differently, write `# accept: reason` next to the row.";
    WRONG_BINDING = 45 Error "bound to another value":
        "By the standard the IDN, object or attribute holds another value than the row says. Values that a vendor defines (P parameters, objects 2000h to 5FFFh) are not compared.",
        "[[generic-sercos.signal]]\nsignal = \"position_command\"\nidn = \"S-0-0051\"",
        "Bind the value that the finding names.";
    NOT_CYCLIC = 46 Error "it may not be cyclic":
        "Drives do not let the value be mapped into this telegram or PDO: it only goes the other way, or over the service channel.",
        "[[generic-sercos.signal]]\nsignal = \"velocity_actual\"\nidn = \"S-0-0036\"",
        "Name an IDN or object that may stand in the telegram.";

    FACT_FAILS = 47 Error "a drive would not do what it is commanded":
        "`check` sends frames through the gateway with these tables. Each shows a fact of the standards: a positive velocity turns a drive forward, an enable request switches it on, an error is reported as the exception that it is. With these tables a direction, a state or a request comes out differently.",
        "[[generic-cia402.fault]]\ncodes = [\"DC link under-voltage\", \"Under-voltage 1\", \"Under-voltage 2\"]\ncause = \"over_voltage\"",
        "Correct the row. If the drive really is so, write `# accept: reason` next to the row.";
    FACT_DIFFERS = 48 Warning "a value differs from the standard":
        "As for AX0047, but the value has the right sign and a wrong magnitude: a scaling, a unit, a limit.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nfactor = [1, 2]",
        "Correct the row. If the drive really is so, write `# accept: reason` next to the row.";
    FACT_ACCEPTED = 49 Note "a difference that is accepted":
        "A frame shows that a value differs from the standard, and `# accept: reason` next to the row says why.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nfactor = [1, 2] # accept: this drive counts half of it",
        "Nothing.";

    REQUIRED_UNSERVED = 50 Note "a required attribute is not served":
        "The standard requires the attribute of a device with a position, velocity or torque loop. A [[reject]] row says why it is missing.",
        "[[cip-generic.reject]]\nreason = \"no drive reports it\"\nattributes = [\"Kpp\"]",
        "Serve it with an [[attribute]] row, or leave it. Controllers get status 0x14 for it.";
    ATTRIBUTE_UNSAID = 51 Error "an attribute without an answer":
        "Every attribute of the dictionary is either served by an [[attribute]] row, or has its place in a [[reject]] row with the reason.",
        "[[cip-generic.attribute]]\nattribute = \"Kpp\"\nremove = true",
        "Add it to a [[reject]] row.";
    NO_WAY_IN = 52 Error "a state with no way in":
        "With the requests, actions and reports of the tables, an axis never reaches the state. `check` walks the state machine to find this.",
        "[[generic-sercos.report]]\npattern = [{ field = \"Ready to operate\", is = 3 }, { field = \"Command value processing\", is = 1 }]\nremove = true\n\n[[generic-sercos.report]]\npattern = [{ field = \"Ready to operate\", is = 3 }]\nacknowledges = false\nremove = true",
        "Add the row of the request or report that leads to it.";
    NO_WAY_OUT = 53 Error "a state with no way out":
        "Once in this state, no request and no report of the tables leads back to the state from which an axis can be started.",
        "[[cip-generic.request]]\naxis_control = \"Shutdown Reset Request\"\nremove = true\n\n[[cip-generic.drive_action]]\ndrive_action = \"power_up\"\nremove = [\"request\"]",
        "Add the row of the request or report that leads out of it.";
    MODE_UNSERVED = 54 Note "an operating mode that only one side has":
        "The controller can request the mode but the drives have no row for it, or the other way round. The mode is refused.",
        "[[generic-sercos.mode]]\nmode = \"torque\"\nremove = true",
        "Add the [[mode]] row of the other side, or leave it.";
    FAULT_NO_CODE = 55 Error "a fault without a code":
        "A cause of the fault catalogue has no [[fault]] row in cip-generic.toml: the axis would stop, and the controller would not know why.",
        "[[cip-generic.fault]]\ncause = \"brake_slip\"\nremove = true",
        "Give it an exception, or a bit of the manufacturer.";
    CODE_SHARED = 56 Warning "one code for several faults":
        "Two causes have the same exception, so the controller cannot distinguish them, and the strictest of their actions applies to both.",
        "[[cip-generic.fault]]\ncause = \"brake_slip\"\nexception = \"Motor Overcurrent\"",
        "Give one of them a bit of the manufacturer. If they are the same to the controller, set `shared = true` in both rows.";
    NEVER_REACHED = 57 Warning "a row that is never used":
        "The first row that fits wins, and everything that fits this row also fits an earlier one.",
        "[[generic-sercos.report]]\npattern = []\nreport = \"ready\"\nsource = \"before all the others\"",
        "Put the more specific row before the other one.";
    UNUSED = 58 Note "an unused row":
        "A unit or signal that no other row refers to.",
        "[[generic-sercos.unit]]\nunit = \"kV\"\nquantity = \"voltage\"\ngeneric_per_unit = [1_000_000_000, 1]\nsource = \"none\"",
        "Remove it, or leave it for later.";
    WARNING_STOPS = 59 Error "a warning that would stop the axis":
        "The row says that the drive only warns, but the exception of its cause stops the axis unless the controller sets another action.",
        "[[generic-sercos.fault]]\nword = \"Class 2 diagnostic\"\npattern = [{ field = \"Cooling error warning\", is = 1 }]\ncause = \"cooling\"",
        "Use a separate cause whose exception has `default = \"Alarm\"`.";
    EXCEPTION_ACTION = 60 Error "exception actions that do not fit":
        "`default` is at least as severe as `least`, neither is beyond Major Fault, and only an exception has them.",
        "[[cip-generic.fault]]\ncause = \"cooling_warning\"\nremove = [\"least\"]",
        "Correct `least` and `default`.";
    EXCEPTION_UNSAID = 61 Warning "an exception that nothing raises":
        "No row of a drive's table leads to the standard exception, neither the gateway nor the device detects it, and no [[unraised]] row says why. The controller would wait for it in vain.",
        "[[cip-generic.unraised]]\nreason = \"The holding brake is the drive's own; no bit says that it slips.\"\nremove = true",
        "Add the row that raises it, or name it in an [[unraised]] row.";
    WRONG_STATE = 62 Error "a state or mode means something else":
        "The word of the drive or of the controller means another state, mode or status bit by the standard than the tables make of it. All values of the words are tried; the first row that fits decides, so a row before the right one may be the reason.",
        "[[generic-sercos.report]]\npattern = [{ field = \"Ready to operate\", is = 1 }]\nreport = \"ready\"",
        "Correct the row, or the order of the rows.";
    WRONG_ORDER = 63 Error "the drive would do something else":
        "The action writes a control word that the drive takes for another command. For CiA 402 the state machine of the profile is walked: torque is switched on by shutdown, switch on, enable operation, one state at a time, and never by another action than `enable`.",
        "[[generic-cia402.action]]\naction = \"disable\"\nwhen = \"Operation enabled\"\nsend = \"Enable operation\"",
        "Write the command that reaches the state that the finding names.";
    REQUEST_LOST = 64 Error "a request that is lost or confused":
        "Each request of the controller has one row, which asks for what its name says and gives the answer that the controller waits for.",
        "[[cip-generic.request]]\naxis_control = \"Enable Request\"\nrequest = \"disable\"",
        "Correct the row, or add the missing one.";
    WEAKER_REACTION = 65 Error "a reaction weaker than the drive's own":
        "The drive has already switched itself off for this error. A row that makes a warning of it lets the controller believe that the axis still moves.",
        "[[generic-sercos.fault]]\nword = \"Class 1 diagnostic\"\npattern = [{ field = \"Overload shut-down\", is = 1 }]\ncause = \"motor_overload_user_limit\"\nreaction = \"alarm\"",
        "Remove `reaction`.";
    POLICY_WEAK = 66 Error "what is required may be missing in silence":
        "`missing` and `refused` say what happens where a drive lacks a value or refuses a step. A set-point, the actual position, an operating mode of the axis and a limit of the configuration are required: without one, the drive must not come to operation as if it were there. A value that the controller reads is told as missing, and not as 0.",
        "[[generic-sercos.signal]]\nsignal = \"velocity_command\"\nmissing = \"omit\"",
        "Write the policy that the finding names. If the axis can really do without it, write `# accept: reason` next to the row.";
    WRONG_FAULT = 67 Error "a fault that is reported as another one":
        "The bit or the class of the drive, or the cause of the fault catalogue, has a name in the standard on the other side, and the row names another one. Whoever reads the fault looks for something that is not broken.",
        "[[generic-sercos.fault]]\nword = \"Class 1 diagnostic\"\npattern = [{ field = \"Overvoltage error\", is = 1 }]\ncause = \"under_voltage\"",
        "Write the name that the finding shows. If this drive means something else with it, write `# accept: reason` next to the row.";
    NOTHING_BOUND = 68 Warning "something of the profile that no row binds":
        "The profile has a value, a status bit, an edge, an event or a step of commissioning that the axis comes to operation without, and no row of the tables has it. Most likely a row was removed.",
        "[[generic-sercos.status]]\nstatus = \"torque_limit\"\nword = \"Class 3 diagnostic\"\npattern = [{ field = \"Torque at limit\", is = 1 }]\nremove = true",
        "Add the row. Name an IDN or object that is left out on purpose in an [[unbound]] row with the reason.";
    MODES_DIFFER = 69 Warning "a value that one mode shows and another one does not":
        "Each [[mode]] row lists what comes from the drive in its mode. What one of them has and another one of the same table has not is missing in that mode, although the drive has it: the controller is told nothing, or an input is not seen.",
        "[[generic-sercos.mode]]\nmode = \"torque\"\nactual = [\"position_actual\", \"torque_actual\"]",
        "Add it to `actual`. If the drives lack it in this mode, write `# accept: reason` next to the row.";

    OVERLAY_NO_EFFECT = 70 Warning "a row that changes nothing":
        "The row of the overlay says what the table already says. Either the table now has the change, or something else was meant.",
        "[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\ndirection = \"both\"",
        "Remove the row.";
    OVERLAY_CYCLE = 71 Error "overlays that build on each other":
        "`base` names an overlay that itself builds on this one, so there is no order in which they could be applied.",
        "format = 1\noverlay = \"builds on itself\"\nbase = [\"this-file.toml\"]",
        "Remove one of the `base` entries.";
    OVERLAY_REMOVES_NOTHING = 72 Error "nothing to remove":
        "`remove` names a row or a key that the table does not have.",
        "[[generic-sercos.parameter]]\nparameter = \"energy\"\nremove = true",
        "Correct the keys that identify the row, or remove it.";
    OVERLAY_NO_KEY = 73 Error "a row without identity":
        "A row of an overlay must have the keys that identify a row of the table.",
        "[[generic-sercos.parameter]]\nmissing = \"reject\"",
        "Add them.";
    UNKNOWN_TABLE = 74 Error "rows of an unknown table":
        "The rows of an overlay are written under the name of their table and of the list in it, as in [[generic-sercos.fault]].",
        "[[generic-sercoss.fault]]\nword = \"Class 1 diagnostic\"",
        "Correct the name.";
    COMPUTED_RANGE = 75 Error "a computed value that does not fit":
        "With values that the operands can have, the result is beyond the range of its parameter or of its attribute, beyond 64 bits, or divided by zero. The ranges are those of the parameters, or else all that the drive's bytes can hold. The gateway would refuse the read or the write.",
        "[[generic.parameter]]\nnumber = 0x8001\nname = \"heat\"\nquantity = \"power\"\ntype = \"integer\"\naccess = \"read\"\nrange = [0, 1_000]\n\n[[generic.computed]]\nparameter = \"heat\"\nproduct = [\"motor_rated_current\", \"bus_voltage\"]\nsource = \"P = I U\"",
        "Give the operands a `range`, widen that of the result, or say in `saturates` why the result may be held at the end of its range.";
    COMPUTED_CYCLE = 76 Error "computed values that need each other":
        "A value is computed from one that is computed from it, so neither can be known.",
        "[[generic.parameter]]\nnumber = 0x8001\nname = \"one\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"read\"\n\n[[generic.parameter]]\nnumber = 0x8002\nname = \"other\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"read\"\n\n[[generic.computed]]\nparameter = \"one\"\nsum = [\"other\"]\nsource = \"none\"\n\n[[generic.computed]]\nparameter = \"other\"\nsum = [\"one\"]\nsource = \"none\"",
        "Compute one of them from parameters that the drive has.";
    NOT_INVERTIBLE = 77 Error "a computed value that cannot be set":
        "Setting a computed value writes one operand so that the result becomes what was set. That needs one operand of your own that stands in the row once, is not computed itself, and does not select.",
        "[[generic.parameter]]\nnumber = 0x8001\nname = \"area\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"write\"\n\n[[generic.parameter]]\nnumber = 0x8002\nname = \"side\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"write\"\n\n[[generic.computed]]\nparameter = \"area\"\nproduct = [\"side\", \"side\"]\nwrites = \"side\"\nsource = \"none\"",
        "Name another operand in `writes`, or give the parameter `access = \"read\"`.";

    STEP_MISPLACED = 78 Error "a step of commissioning for other axes":
        "What commissioning writes depends on the axis: the scaling of one that turns is not that of one that moves, and a drive that keeps its own scaling is not written one. Parameters come after their units were read. The step is done for other axes, or in another phase, than what it writes is made for.",
        "[[generic-sercos.commission]]\nphase = 2\ndo = \"write\"\nidn = \"S-0-0076\"\nvalue = 0x41\nwhen = { kind = \"rotary\", set_scaling = true }\nrefused = \"continue\"\nsource = \"test\"",
        "Write `when`, `modes` or `phase` as the finding says.";
    WRONG_WRAP = 79 Error "a position that does not wrap":
        "Command Position and Actual Position are DINTs that go round: an axis may turn on for ever, and at the end of the range, or at the unwind position, the next value follows the last. Velocities, accelerations and torques end at their range.",
        "[[cip-generic.cyclic]]\nset = \"Command Data Set\"\nelement = \"Command Position\"\nwraps = false",
        "Write `wraps` as the finding says.";

    CONFIG_VALUE = 80 Error "a setting that cannot be used":
        "Axisbridge cannot use the value of this key of the configuration.",
        "[south.sercos]\ncycle_time = \"1.1 ms\"",
        "Use a value as described in docs/reference/configuration.md.";
    CONFIG_REFERENCE = 81 Error "a name that the configuration does not have":
        "An axis names its drive, and a device its axes. Each of them must exist, and belong to exactly one.",
        "[[axis]]\nname = \"x\"\ndrive = \"no-such-drive\"",
        "Correct the name, or add what it names.";
    LIMITS_MISSING = 82 Warning "a linear axis without limits of its position":
        "A linear axis that does not unwind has an end. Without `position_min` and `position_max` neither the gateway nor, through it, the drive stops a command beyond.",
        "[[axis]]\nname = \"x\"\nunit = \"millimetre\"",
        "Add `position_min` and `position_max` to `[axis.limits]`.";
    CYCLE_FULL = 83 Error "cyclic data that the bus cannot carry":
        "The values of an axis are more than its connection can carry, those of all drives are more than the telegrams can carry, or the telegrams take longer on the wire than the cycle. This is computed with the layout of the master, and with drives that need no time themselves.",
        "[south.sercos]\ncycle_time = \"31.25 us\" # with 60 drives",
        "Use a longer cycle, fewer drives on the bus, or fewer signals and captures (`events = \"service-channel\"`).";
    AXIS_TABLES = 84 Error "no program for the axis":
        "With these tables no program can be compiled for the axis: a mode or a slot is missing, or a scaling does not fit 64 bits.",
        "[[generic-sercos.mode_slot]]\nslot = 2\nremove = true\n\n[[generic-sercos.mode_slot]]\nslot = 3\nremove = true\n\n[[generic-sercos.mode_slot]]\nslot = 4\nremove = true\n\n[[generic-sercos.mode_slot]]\nslot = 5\nremove = true\n\n[[generic-sercos.mode_slot]]\nslot = 6\nremove = true\n\n[[generic-sercos.mode_slot]]\nslot = 7\nremove = true",
        "Correct the tables, or the axis.";
    LIMIT_UNFIT = 85 Error "a limit that the drive cannot hold":
        "Axisbridge writes the limit to a parameter of the drive whose range is smaller. Commissioning would refuse the axis.",
        "[axis.limits]\ntorque_percent = 10_000.0",
        "Use a limit within the shown range.";
    DRIVE_SCALING = 86 Note "the drive's own scaling is used":
        "Without `set_scaling`, Axisbridge reads the scaling when the drive is there. Range and precision are not known before.",
        "[[south.sercos.drive]]\nname = \"a\"\naddress = 1",
        "Nothing, or set `set_scaling = true`, which makes it the same for every drive.";
    DEVICE_FILE = 87 Error "a device's configuration that cannot be used":
        "The file that `configuration` of a [[south.can.device]] names has an entry that cannot be read, has no values, or is for another device. A device gets all of its configuration or is not controlled.",
        "[[south.can.device]]\nnode = 1\nconfiguration = \"of-another-drive.dcf\"",
        "Correct the file at the shown place, or export it again from the tool that made it.";
    DEVICE_FILE_ODD = 88 Warning "a device's configuration with something odd":
        "The file contradicts itself in something that does not affect its values, was made for another node-id, or has values that Axisbridge does not write because it sets them itself: PDO mapping, SYNC, supervision, and what moves the drive.",
        "[1017]\nParameterValue=50",
        "Nothing if the file is as you meant it. Otherwise correct it.";
    DRIVE_MAPPING = 89 Note "the drive's own PDO mapping is used":
        "With `pdo_mapping = \"keep\"` Axisbridge uses the PDOs as they are when the drive is there. Without a `configuration` that lists them, the load of the bus is computed with the PDOs that Axisbridge would have mapped.",
        "[[south.can.device]]\nnode = 1\npdo_mapping = \"keep\"",
        "Nothing, or name the data sheet of the drive (EDS, DCF) as its `configuration`.";
    PLACEHOLDER = 90 Warning "a mark of a starter configuration is left":
        "`axisbridge scan` marks with `CHANGE` what it cannot know: addresses, identity, limits. A mark that is left says that nobody has looked at the line. The gateway logs it at start.",
        "[[device]]\nlisten = \"127.0.0.2\" # CHANGE: an address of this host",
        "Edit the line as the mark says, and remove the mark.";
    VENDOR_ID = 91 Warning "the vendor ID of another company":
        "ODVA assigns vendor IDs. 1 is that of Rockwell Automation: a controller would take the gateway for one of its products, and a profile of that product for that of the gateway.",
        "[device.identity]\nvendor_id = 1",
        "Use the vendor ID that ODVA has assigned to you. Until then, use 65535.";
    VENDOR_NONE = 92 Note "no vendor ID yet":
        "65535 stands in the examples for a vendor ID that is still to be assigned. It is good for tests on your own network, and not for a product.",
        "[device.identity]\nvendor_id = 65_535",
        "Use the vendor ID that ODVA has assigned to you, or write `# accept: reason` next to the key.";
    DATA_SHEET = 93 Error "a data sheet that is not that of the device":
        "The file that `eds` of a [[south.can.device]] names cannot be read as a data sheet, or the device that it describes is not the one of the configuration: another vendor-ID, product code, revision number or device profile. Axisbridge does not control such a device.",
        "[[south.can.device]]\nnode = 1\nidentity = { product_code = 7 }\neds = \"of-another-drive.eds\"",
        "Name the data sheet that belongs to the device and to its firmware, or correct `identity`.";
    SHEET_LACKS = 94 Error "a device that lacks what the configuration needs":
        "By its data sheet, the device does not have a mode of operation, an object, an access or a bit rate that it would be commissioned with. Axisbridge would leave it out at start, for the shown reason.",
        "[[south.can.drive]]\nname = \"fan\"\nnode = 1\nmodes = [\"position\"] # a frequency converter has vl only",
        "Change what the configuration asks of the drive, or use another drive. If the data sheet is wrong, say in the configuration what the drive has (`drive_modes`, `counts`, `guarding`), or remove `eds`.";
    SCRIPT = 95 Error "a script that cannot be run":
        "A step of a script for the simulated controller, or an event of a script for simulated drives, is unknown or cannot be executed.",
        "[[step]]\nenabel = 1",
        "Correct the step. docs/reference/scripts.md lists the steps, and docs/tasks/simulate-drives-and-controllers.md the events.";
    SHEET_PDOS = 96 Error "PDOs that cannot carry what the axis needs":
        "By the data sheet, a PDO that the axis needs does not exist, has no room, cannot carry an object, has a fixed mapping without it, or takes none of the transmission types. Axisbridge would leave the device out at start.",
        "[[south.can.drive]]\nname = \"a\"\nnode = 1\nmodes = [\"position\", \"velocity\", \"torque\"] # with two PDOs of fixed mapping",
        "Ask for fewer modes, `actual_values` and `offsets`. Map the PDOs with the maker's tool where their mapping is fixed.";
    SHEET_WITHOUT = 97 Warning "a drive that does without something":
        "By its data sheet, the drive does not take a step of its commissioning, a mode, an actual value or a transmission type. The axis works without it, and the gateway logs it at start.",
        "[60C2sub1]\nAccessType=ro",
        "Check that the axis can do without. What the gateway cannot write must be set in the drive with the maker's tool.";
    SHEET_SILENT = 98 Warning "a data sheet that does not say what it should":
        "The file has no value for something that commissioning depends on: the modes of operation, or what a count is. It is only known when the drive is there.",
        "[6502]\nParameterName=Supported drive modes\nDataType=0x0007\nAccessType=ro",
        "Look it up in the manual, and say it in the configuration (`drive_modes`, `counts`).";
    SHEET_NOTE = 99 Note "parameters that the drive does not have":
        "By its data sheet, the drive has no objects for these parameters of the tables. The CIP attributes that stand for them are refused, kept or computed as the tables say; `axisbridge attributes` lists them.",
        "[[axis]]\nname = \"fan\"\ndrive = \"converter\" # without 60E0 and 60E1",
        "Nothing, unless the controller needs one of the attributes.";
    STARTUP = 100 Error "an entry of a start-up list that cannot be used":
        "The start-up list of a drive says what its parameters have to be before it takes part in the cycle. The entry is for another kind of drive or another axis, its value cannot be that of the parameter, nobody says the type of the object, or it names what Axisbridge itself writes: cyclic values, communication, operation modes, and what the tables write at commissioning.",
        "[[south.sercos.drive.startup]]\nparameter = \"S-0-0047\"\nvalue = 0",
        "Correct the entry, or remove it. docs/tasks/set-drive-parameters-at-start.md says which key sets what Axisbridge writes.";
    STARTUP_ODD = 101 Warning "an entry of a start-up list with something odd":
        "The backup that is used as a start-up list has parameters that Axisbridge sets itself, which are left out of the list, or parameters that could not be read when it was made; or the value of an entry does not fit what the dictionary says of the parameter, where the drive may say otherwise.",
        "[[south.sercos.drive]]\nstartup_file = \"drive-a.toml\" # with S-0-0032",
        "Nothing if the list is as you meant it. Otherwise correct it.";
    HTTP_FILE = 102 Error "a file of the HTTP server that cannot be used":
        "The file that `token` names is not the hash of a token, or those of `certificate` and `key` are not a certificate and its private key in PEM. Axisbridge does not start with them.",
        "[http]\nlisten = \"127.0.0.1:8080\"\ntoken = \"box.toml\" # the configuration itself",
        "Write the token with `axisbridge token`. Check that certificate and key belong together: `openssl x509 -noout -pubkey -in CERTIFICATE` and `openssl pkey -pubout -in KEY` show the same.";
    HTTP_FILE_ODD = 103 Warning "a file of the HTTP server with something odd":
        "The file that `token`, `certificate` or `key` names is not there, or this user cannot read it: Axisbridge does not start where it cannot read it. Or every user of the host can read the private key or the hash of the token.",
        "[http]\nlisten = \"127.0.0.1:8080\"\ntoken = \"not-here\"",
        "Make the file, and give it to the user that runs the gateway, with mode 0600.";
    HTTP_PLAIN = 104 Warning "the token crosses the network without encryption":
        "With `plain = true`, whoever sees the packets of the network sees the token, and can move the axes with it.",
        "[http]\nlisten = \"0.0.0.0:8080\"\ntoken = \"token\"\nplain = true",
        "Use `certificate` and `key`, or listen on a loopback address behind a reverse proxy with TLS.";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_in_order_and_says_everything() {
        assert!(REGISTRY.windows(2).all(|pair| pair[0].code < pair[1].code));
        for entry in REGISTRY {
            let texts = [entry.title, entry.explanation, entry.example, entry.remedy];
            assert!(texts.iter().all(|text| !text.trim().is_empty()), "{}", entry.code);
            assert!(!entry.title.ends_with('.') && entry.explanation.ends_with('.'), "{}", entry.code);
            assert_eq!(Code::parse(&entry.code.to_string()), Some(entry.code));
        }
        assert_eq!(Code::parse("ax0010"), Some(UNKNOWN_NAME));
        for text in ["", "AX", "AX10", "AX9999", "AX00010", "BX0010", "AX001\u{b5}"] {
            assert_eq!(Code::parse(text), None, "{text}");
        }
    }

    #[test]
    fn is_the_page_of_the_documentation() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/findings.md");
        if std::env::var_os("INSTA_UPDATE").is_some_and(|value| value == "always") {
            std::fs::write(path, page()).unwrap();
        }
        let written = std::fs::read_to_string(path).unwrap();
        assert_eq!(
            written,
            page(),
            "write it with `axisbridge check --list --format markdown > docs/findings.md`"
        );
    }
}
