//! Registers that a configuration binds to parameters of drives.
//!
//! ```text
//! client task --Asked--> hub --queue--> engine --> drive
//!             <-oneshot--     <--queue--
//! ```
//!
//! Nothing is kept: a read is answered with what the drive has, and a write once the drive has taken the value.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use profile_generic::parameter::Parameter;
use tokio::sync::{mpsc, oneshot};
use tokio_modbus::prelude::ExceptionCode;

use super::map::Kind;
use crate::engine::parameter::ParameterFailure;
use crate::engine::registers::{RegisterEnd, RegisterFailure, RegisterRequest};

/// Accesses of all clients that wait for the engine.
const WAITING_MAX: usize = 32;

/// How often the queues of the engine are looked at.
const HUB_INTERVAL: Duration = Duration::from_millis(2);

/// How long a client waits for a drive. A service channel or an SDO that does not end has failed before.
const TIME_OUT: Duration = Duration::from_secs(5);

/// Registers that are a parameter of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Binding {
    /// The first register.
    pub register: u16,
    /// Size and sign of the value.
    pub kind: Kind,
    /// Position of the axis in the configuration, from 0.
    pub axis: u8,
    /// The parameter.
    pub parameter: Parameter,
    /// Whether clients may write it.
    pub write: bool,
}

/// An access of a client, and where its result goes.
#[derive(Debug)]
struct Asked {
    binding: Binding,
    wanted: Option<i64>,
    result: oneshot::Sender<Result<i64, RegisterFailure>>,
}

/// The bindings, as client tasks use them.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    bindings: Arc<[Binding]>,
    hub: Option<mpsc::Sender<Asked>>,
}

/// Carries accesses to the engine and results back.
#[derive(Debug)]
pub struct Hub {
    end: RegisterEnd,
    asked: mpsc::Receiver<Asked>,
}

impl Parameters {
    /// These bindings, and the hub to run for them.
    #[must_use]
    pub fn new(bindings: Vec<Binding>, end: RegisterEnd) -> (Self, Hub) {
        let (hub, asked) = mpsc::channel(WAITING_MAX);
        (Self { bindings: bindings.into(), hub: Some(hub) }, Hub { end, asked })
    }

    /// Whether a register belongs to a binding.
    #[must_use]
    pub fn has(&self, register: u16) -> bool {
        self.bindings.iter().any(|binding| {
            (binding.register..=binding.register + (binding.kind.registers() - 1)).contains(&register)
        })
    }

    /// The binding that has exactly these registers: a value is read and written as a whole.
    fn binding(&self, register: u16, count: usize) -> Result<Binding, ExceptionCode> {
        let is = |binding: &&Binding| {
            binding.register == register && usize::from(binding.kind.registers()) == count
        };
        self.bindings.iter().find(is).copied().ok_or(ExceptionCode::IllegalDataAddress)
    }

    /// The registers of a parameter, as its drive has it now.
    ///
    /// # Errors
    /// The exception for the client.
    pub async fn read(&self, register: u16, count: u16) -> Result<Vec<u16>, ExceptionCode> {
        let binding = self.binding(register, usize::from(count))?;
        let value = self.ask(binding, None).await?;
        // The registers cannot hold what the drive has.
        words(binding.kind, value).ok_or(ExceptionCode::ServerDeviceFailure)
    }

    /// Writes the registers of a parameter to its drive.
    ///
    /// # Errors
    /// The exception for the client.
    pub async fn write(&self, register: u16, words: &[u16]) -> Result<(), ExceptionCode> {
        let binding = self.binding(register, words.len())?;
        if !binding.write {
            return Err(ExceptionCode::IllegalFunction);
        }
        let wanted = value(binding.kind, words).ok_or(ExceptionCode::IllegalDataValue)?;
        self.ask(binding, Some(wanted)).await.map(|_| ())
    }

    async fn ask(&self, binding: Binding, wanted: Option<i64>) -> Result<i64, ExceptionCode> {
        let hub = self.hub.as_ref().ok_or(ExceptionCode::IllegalDataAddress)?;
        let (result, answer) = oneshot::channel();
        let asked = Asked { binding, wanted, result };
        hub.try_send(asked).map_err(|_| ExceptionCode::ServerDeviceBusy)?;
        match tokio::time::timeout(TIME_OUT, answer).await {
            Ok(Ok(result)) => result.map_err(exception),
            Ok(Err(_)) | Err(_) => Err(ExceptionCode::ServerDeviceFailure),
        }
    }
}

/// What a client is told of a failure.
fn exception(failure: RegisterFailure) -> ExceptionCode {
    match failure {
        RegisterFailure::Owned | RegisterFailure::Ending => ExceptionCode::ServerDeviceBusy,
        RegisterFailure::Parameter(ParameterFailure::Busy | ParameterFailure::Torque) => {
            ExceptionCode::ServerDeviceBusy
        }
        RegisterFailure::Parameter(ParameterFailure::Value | ParameterFailure::NotKept) => {
            ExceptionCode::IllegalDataValue
        }
        RegisterFailure::Parameter(ParameterFailure::ReadOnly) => ExceptionCode::IllegalFunction,
        RegisterFailure::Parameter(_) => ExceptionCode::ServerDeviceFailure,
    }
}

/// The registers of a value, the most significant one first; `None` when it does not fit.
fn words(kind: Kind, value: i64) -> Option<Vec<u16>> {
    let fits = match kind {
        Kind::U16 => u16::try_from(value).is_ok(),
        Kind::U32 => u32::try_from(value).is_ok(),
        Kind::I32 => i32::try_from(value).is_ok(),
        Kind::U64 => value >= 0,
        Kind::I64 => true,
    };
    let [a, b, c, d, e, f, g, h] = value.to_be_bytes();
    let all = [[a, b], [c, d], [e, f], [g, h]].map(u16::from_be_bytes);
    fits.then(|| all[all.len() - usize::from(kind.registers())..].to_vec())
}

/// The value of registers; `None` when it does not fit 63 bits and a sign.
fn value(kind: Kind, words: &[u16]) -> Option<i64> {
    let bits = words.iter().fold(0_u64, |bits, word| bits << 16 | u64::from(*word));
    match kind {
        Kind::U16 | Kind::U32 | Kind::U64 => i64::try_from(bits).ok(),
        Kind::I32 => u32::try_from(bits).ok().map(|bits| i64::from(bits.cast_signed())),
        Kind::I64 => Some(bits.cast_signed()),
    }
}

impl Hub {
    /// Carries until every client is gone.
    pub async fn run(self) {
        let Self { mut end, mut asked } = self;
        let mut pending: HashMap<u32, oneshot::Sender<Result<i64, RegisterFailure>>> = HashMap::new();
        let mut last = 0_u32;
        let mut interval = tokio::time::interval(HUB_INTERVAL);
        interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                asked = asked.recv() => {
                    let Some(Asked { binding, wanted, result }) = asked else { return };
                    last = last.wrapping_add(1);
                    let Binding { axis, parameter, .. } = binding;
                    let request = RegisterRequest { id: last, axis, parameter, wanted };
                    match end.requests.push(request) {
                        Ok(()) => drop(pending.insert(last, result)),
                        Err(_) => drop(result.send(Err(ParameterFailure::Busy.into()))),
                    }
                }
                _ = interval.tick() => {}
            }
            while let Ok(answer) = end.answers.pop() {
                if let Some(result) = pending.remove(&answer.id) {
                    // A client that is gone does not wait for it.
                    let _ = result.send(answer.result);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::registers::{RegisterAnswer, RegisterNorth};

    #[test]
    fn values_lie_in_registers_with_their_sign() {
        for (kind, number, expected) in [
            (Kind::U16, 0xABCD, vec![0xABCD]),
            (Kind::U32, 0xABCD_1234, vec![0xABCD, 0x1234]),
            (Kind::I32, -2, vec![0xFFFF, 0xFFFE]),
            (Kind::I64, -3, vec![0xFFFF, 0xFFFF, 0xFFFF, 0xFFFD]),
            (Kind::U64, 5, vec![0, 0, 0, 5]),
        ] {
            assert_eq!(words(kind, number), Some(expected.clone()), "{kind:?}");
            assert_eq!(value(kind, &expected), Some(number), "{kind:?}");
        }
        let beyond =
            [(Kind::U16, 65_536), (Kind::U16, -1), (Kind::I32, 1 << 31), (Kind::U32, -1), (Kind::U64, -1)];
        assert!(beyond.iter().all(|(kind, number)| words(*kind, *number).is_none()));
        assert_eq!(value(Kind::U64, &[0x8000, 0, 0, 0]), None);
    }

    #[tokio::test]
    async fn an_access_goes_to_the_engine_and_its_result_comes_back() {
        // The queues of an engine without the engine.
        let (requests, mut taken) = rtrb::RingBuffer::new(4);
        let (mut given, answers) = rtrb::RingBuffer::new(4);
        let binding =
            Binding { register: 4_200, kind: Kind::I32, axis: 3, parameter: Parameter(0x8001), write: true };
        let read_only = Binding { register: 4_202, kind: Kind::U16, write: false, ..binding };
        let (parameters, hub) = Parameters::new(vec![binding, read_only], RegisterEnd { requests, answers });
        tokio::spawn(hub.run());
        assert!([4_200, 4_201, 4_202].iter().all(|register| parameters.has(*register)));
        assert!(!parameters.has(4_199) && !parameters.has(4_203));
        // A value is not cut in pieces, and only those are written that may be.
        for (register, count) in [(4_200, 1), (4_201, 1), (4_200, 3), (4_199, 2), (4_201, 2)] {
            let refused = parameters.read(register, count).await;
            assert_eq!(refused, Err(ExceptionCode::IllegalDataAddress), "{register} {count}");
        }
        assert_eq!(parameters.write(4_202, &[1]).await, Err(ExceptionCode::IllegalFunction));
        let engine = async {
            for expected in [None, Some(-7), None, Some(9)] {
                let request: RegisterRequest = loop {
                    match taken.pop() {
                        Ok(request) => break request,
                        Err(_) => tokio::time::sleep(Duration::from_millis(1)).await,
                    }
                };
                assert_eq!((request.axis, request.parameter), (3, Parameter(0x8001)));
                assert_eq!(request.wanted, expected);
                let result = match request.id {
                    1 => Ok(-5),
                    2 => Ok(-7),
                    3 => Ok(1 << 40),
                    _ => Err(RegisterFailure::Owned),
                };
                given.push(RegisterAnswer { id: request.id, result }).unwrap();
            }
        };
        let client = async {
            assert_eq!(parameters.read(4_200, 2).await, Ok(vec![0xFFFF, 0xFFFB]));
            assert_eq!(parameters.write(4_200, &[0xFFFF, 0xFFF9]).await, Ok(()));
            assert_eq!(parameters.read(4_200, 2).await, Err(ExceptionCode::ServerDeviceFailure), "too large");
            assert_eq!(parameters.write(4_200, &[0, 9]).await, Err(ExceptionCode::ServerDeviceBusy));
        };
        tokio::join!(engine, client);
    }

    #[test]
    fn every_failure_has_its_exception() {
        let of = |failure: ParameterFailure| exception(failure.into());
        assert_eq!(of(ParameterFailure::Value), ExceptionCode::IllegalDataValue);
        assert_eq!(of(ParameterFailure::NotKept), ExceptionCode::IllegalDataValue);
        assert_eq!(of(ParameterFailure::ReadOnly), ExceptionCode::IllegalFunction);
        assert_eq!(of(ParameterFailure::Torque), ExceptionCode::ServerDeviceBusy);
        for failure in [ParameterFailure::Absent, ParameterFailure::Unanswered, ParameterFailure::Refused] {
            assert_eq!(of(failure), ExceptionCode::ServerDeviceFailure);
        }
        assert_eq!(exception(RegisterFailure::Owned), ExceptionCode::ServerDeviceBusy);
        drop(RegisterNorth::new());
    }
}
