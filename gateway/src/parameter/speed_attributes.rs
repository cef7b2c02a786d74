//! Attributes of a velocity drive of the AC/DC drive profile: those that Motor Data (28h), Control Supervisor (29h) and AC/DC Drive (2Ah)
//! have by the CIP object library (Volume 1, clauses 5-29 to 5-31).
//!
//! Most of them are optional; a list asks the drive. Those of the maker, and the Parameter object (0Fh) that shows them, are reached by
//! their path.

use super::attributes::KnownAttribute;
use super::value::Kind;
use crate::mapping::Access::{self, Get, Set};
use crate::mapping::Cia402Type;
use crate::mapping::devicenet::speed::{
    CLASS_DRIVE as DRIVE, CLASS_MOTOR as MOTOR, CLASS_SUPERVISOR as SUPERVISOR,
};

/// One attribute: class, number, name, type, access, unit.
type Row = (u16, u16, &'static str, Kind, Access, &'static str);

const BOOL: Kind = Kind::Object(Cia402Type::Bool);
const USINT: Kind = Kind::Object(Cia402Type::U8);
const SINT: Kind = Kind::Object(Cia402Type::I8);
const UINT: Kind = Kind::Object(Cia402Type::U16);
const INT: Kind = Kind::Object(Cia402Type::I16);
const UDINT: Kind = Kind::Object(Cia402Type::U32);
const TEXT: Kind = Kind::ShortString;

const SPEED: &str = "rpm / 2^SpeedScale";
const CURRENT: &str = "100 mA / 2^CurrentScale";
const TORQUE: &str = "Nm / 2^TorqueScale";
const PROCESS: &str = "% / 2^ProcessScale";
const VOLTAGE: &str = "V / 2^VoltageScale";
const TIME: &str = "ms / 2^TimeScale";

/// All of them, in the order of their numbers. Scales come behind what they scale, as the drive keeps the bare numbers.
const ROWS: [Row; 56] = [
    (MOTOR, 3, "MotorType", USINT, Set, ""),
    (MOTOR, 4, "CatNumber", TEXT, Set, ""),
    (MOTOR, 5, "Manufacturer", TEXT, Set, ""),
    (MOTOR, 6, "RatedCurrent", UINT, Set, "100 mA"),
    (MOTOR, 7, "RatedVoltage", UINT, Set, "V"),
    (MOTOR, 8, "RatedPower", UDINT, Set, "W"),
    (MOTOR, 9, "RatedFreq", UINT, Set, "Hz"),
    (MOTOR, 10, "RatedTemp", UINT, Set, "°C"),
    (MOTOR, 11, "MaxSpeed", UINT, Set, "rpm"),
    (MOTOR, 12, "PoleCount", UINT, Set, ""),
    (MOTOR, 13, "TorqConstant", UDINT, Set, "0.001 Nm/A"),
    (MOTOR, 14, "Inertia", UDINT, Set, "1e-6 kg m²"),
    (MOTOR, 15, "BaseSpeed", UINT, Set, "rpm"),
    (SUPERVISOR, 3, "Run1", BOOL, Set, ""),
    (SUPERVISOR, 4, "Run2", BOOL, Set, ""),
    (SUPERVISOR, 5, "NetCtrl", BOOL, Set, ""),
    (SUPERVISOR, 6, "State", USINT, Get, ""),
    (SUPERVISOR, 7, "Running1", BOOL, Get, ""),
    (SUPERVISOR, 8, "Running2", BOOL, Get, ""),
    (SUPERVISOR, 9, "Ready", BOOL, Get, ""),
    (SUPERVISOR, 10, "Faulted", BOOL, Get, ""),
    (SUPERVISOR, 11, "Warning", BOOL, Get, ""),
    (SUPERVISOR, 12, "FaultRst", BOOL, Set, ""),
    (SUPERVISOR, 13, "FaultCode", UINT, Get, ""),
    (SUPERVISOR, 14, "WarnCode", UINT, Get, ""),
    (SUPERVISOR, 15, "CtrlFromNet", BOOL, Get, ""),
    (SUPERVISOR, 16, "DNFaultMode", USINT, Set, ""),
    (SUPERVISOR, 17, "ForceFault/Trip", BOOL, Set, ""),
    (DRIVE, 3, "AtReference", BOOL, Get, ""),
    (DRIVE, 4, "NetRef", BOOL, Set, ""),
    (DRIVE, 5, "NetProc", BOOL, Set, ""),
    (DRIVE, 6, "DriveMode", USINT, Set, ""),
    (DRIVE, 7, "SpeedActual", INT, Get, SPEED),
    (DRIVE, 8, "SpeedRef", INT, Set, SPEED),
    (DRIVE, 9, "CurrentActual", INT, Get, CURRENT),
    (DRIVE, 10, "CurrentLimit", INT, Set, CURRENT),
    (DRIVE, 11, "TorqueActual", INT, Get, TORQUE),
    (DRIVE, 12, "TorqueRef", INT, Set, TORQUE),
    (DRIVE, 13, "ProcessActual", INT, Get, PROCESS),
    (DRIVE, 14, "ProcessRef", INT, Set, PROCESS),
    (DRIVE, 15, "PowerActual", INT, Get, "W / 2^PowerScale"),
    (DRIVE, 16, "InputVoltage", INT, Get, VOLTAGE),
    (DRIVE, 17, "OutputVoltage", INT, Get, VOLTAGE),
    (DRIVE, 18, "AccelTime", UINT, Set, TIME),
    (DRIVE, 19, "DecelTime", UINT, Set, TIME),
    (DRIVE, 20, "LowSpdLimit", UINT, Set, SPEED),
    (DRIVE, 21, "HighSpdLimit", UINT, Set, SPEED),
    (DRIVE, 22, "SpeedScale", SINT, Set, ""),
    (DRIVE, 23, "CurrentScale", SINT, Set, ""),
    (DRIVE, 24, "TorqueScale", SINT, Set, ""),
    (DRIVE, 25, "ProcessScale", SINT, Set, ""),
    (DRIVE, 26, "PowerScale", SINT, Set, ""),
    (DRIVE, 27, "VoltageScale", SINT, Set, ""),
    (DRIVE, 28, "TimeScale", SINT, Set, ""),
    (DRIVE, 29, "RefFromNet", BOOL, Get, ""),
    (DRIVE, 30, "ProcFromNet", BOOL, Get, ""),
];

/// All of them.
pub(super) fn all() -> impl Iterator<Item = KnownAttribute> {
    ROWS.into_iter().map(|(class, attribute, name, kind, access, unit)| {
        KnownAttribute::of_profile((class, attribute), name, kind, access, unit)
    })
}
