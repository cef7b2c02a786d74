//! Parameters of the drives for explicit requests: the attributes of a vendor object of devices with assemblies.
//!
//! The instance is that of the axis, the attribute the number of the generic parameter. A value is a LINT in the unit of the parameter, as
//! `axisbridge param` has it. While an owner is connected, the adapter lets nobody else write.
//!
//! | service | instance 0 | instance of an axis |
//! |---|---|---|
//! | Get_Attribute_Single | 1 revision, 2 highest instance, 3 number of instances (UINT) | the value |
//! | Set_Attribute_Single | - | the value, once the drive has taken it |

use arrayvec::ArrayVec;
use profile_cip::device::motion_link::{ExplicitReply, ExplicitRequest, MotionReply, Token};
use profile_cip::wire::status::{GeneralStatus, Service};
use profile_generic::parameter::Parameter;

use super::PlcAxis;
use crate::engine::axis::{AxisChannel, Owner};
use crate::engine::bus::{Answer, Buses, Purpose};
use crate::engine::north::Exchange;
use crate::engine::parameter::{Drives, ParameterJob, ParameterJobs};
use crate::north::DeviceEnd;

/// Revision of the object.
const REVISION: u16 = 1;

/// Requests that wait for the exchange of the cycle in which they came.
pub(super) const REQUESTS_MAX: usize = 4;

/// Accesses of explicit requests.
#[derive(Debug, Default)]
pub(super) struct Parameters {
    requests: ArrayVec<ExplicitRequest, REQUESTS_MAX>,
    jobs: ParameterJobs<Accessed>,
    ticket: u32,
}

/// An access under way.
#[derive(Debug, Clone, Copy)]
struct Accessed {
    token: Token,
    ticket: u32,
    axis: usize,
    write: bool,
}

impl Parameters {
    /// Takes a request; gives it back when too many wait.
    pub fn push(&mut self, request: ExplicitRequest) -> Result<(), Token> {
        let token = request.token;
        self.requests.try_push(request).map_err(|_| token)
    }

    /// Begins what was asked for, asks drives for what they need next, and answers what is over.
    pub fn exchange(
        &mut self,
        (device, members): (u8, &[PlcAxis]),
        exchange: &mut Exchange<'_>,
        buses: &mut Buses,
        link: &mut DeviceEnd,
    ) {
        while let Some(request) = self.requests.pop_at(0) {
            let token = request.token;
            let answer = match self.begin(&request, members, exchange.axes, exchange.ending) {
                Ok(None) => continue,
                Ok(Some(number)) => success(token, &number.to_le_bytes()),
                Err(status) => ExplicitReply::status(token, status.0),
            };
            // A full queue means that the explicit side has given up waiting.
            let _ = link.reply(MotionReply::Explicit(answer));
        }
        // The adapter lets nobody but an owner of this device write; another one can have the other axes of a drive.
        let is_taken = |number: usize, axis: &AxisChannel| {
            let is_own = members.iter().any(|member| member.number == number);
            axis.owner() == Owner::Local || (!is_own && axis.has_controller())
        };
        let mut drives = Drives::of(exchange, buses);
        self.jobs.advance(
            |what, job| {
                let purpose = Purpose::AssemblyParameter { device, ticket: what.ticket };
                job.step(&mut drives, what.axis, purpose, is_taken)
            },
            |what, result| {
                let answer = match result {
                    Ok(_) if what.write => success(what.token, &[]),
                    Ok(value) => success(what.token, &value.to_le_bytes()),
                    Err(failure) => ExplicitReply::status(what.token, GeneralStatus::from(failure).0),
                };
                let _ = link.reply(MotionReply::Explicit(answer));
            },
        );
    }

    /// Begins an access, or answers at once with a number of the class.
    fn begin(
        &mut self,
        request: &ExplicitRequest,
        members: &[PlcAxis],
        axes: &[AxisChannel],
        ending: bool,
    ) -> Result<Option<u16>, GeneralStatus> {
        let wanted = match Service(request.service) {
            Service::GET_ATTRIBUTE_SINGLE if request.data.is_empty() => None,
            Service::GET_ATTRIBUTE_SINGLE => return Err(GeneralStatus::TOO_MUCH_DATA),
            Service::SET_ATTRIBUTE_SINGLE => Some(value(&request.data)?),
            _ => return Err(GeneralStatus::SERVICE_NOT_SUPPORTED),
        };
        let attribute = request.path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
        if request.path.instance == 0 {
            if wanted.is_some() {
                return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE);
            }
            let highest = members.iter().map(|member| member.instance).max().unwrap_or(0);
            let count = u16::try_from(members.len()).unwrap_or(u16::MAX);
            return match attribute {
                1 => Ok(Some(REVISION)),
                2 => Ok(Some(highest)),
                3 => Ok(Some(count)),
                _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
            };
        }
        let is = |member: &&PlcAxis| u32::from(member.instance) == request.path.instance;
        let axis = members.iter().find(is).ok_or(GeneralStatus::PATH_DESTINATION_UNKNOWN)?.number;
        let held = axes.get(axis).is_some_and(|axis| axis.owner() == Owner::Local);
        if wanted.is_some() && (held || ending) {
            return Err(GeneralStatus::DEVICE_STATE_CONFLICT);
        }
        self.ticket = self.ticket.wrapping_add(1);
        let what = Accessed { token: request.token, ticket: self.ticket, axis, write: wanted.is_some() };
        match self.jobs.push(what, ParameterJob::new(Parameter(attribute), wanted)) {
            true => Ok(None),
            false => Err(GeneralStatus::RESOURCE_UNAVAILABLE),
        }
    }

    /// Takes the drive's answer to an access.
    pub fn answered(&mut self, ticket: u32, answer: &Answer, axis: &AxisChannel) {
        self.jobs.take(|what| what.ticket == ticket, answer, axis);
    }
}

/// The value of a Set_Attribute_Single.
fn value(data: &[u8]) -> Result<i64, GeneralStatus> {
    match data.len() {
        0..8 => Err(GeneralStatus::NOT_ENOUGH_DATA),
        8 => data.try_into().map(i64::from_le_bytes).map_err(|_| GeneralStatus::NOT_ENOUGH_DATA),
        _ => Err(GeneralStatus::TOO_MUCH_DATA),
    }
}

fn success(token: Token, data: &[u8]) -> ExplicitReply {
    let mut reply = ExplicitReply::status(token, GeneralStatus::SUCCESS.0);
    // Eight bytes at most.
    let _ = reply.data.try_extend_from_slice(data);
    reply
}
