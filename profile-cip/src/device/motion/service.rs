//! The services of the Motion Device Axis Object, clauses 5-2.4 and 5-2.5, for both ways they come: the service
//! channel of the I/O connection and explicit messages.
//!
//! Supported: Group_Sync (class), Get and Set_Axis_Attributes_List, Set_Cyclic_Write_List, Set_Cyclic_Read_List,
//! Run_Hookup_Test and Get_Hookup_Test_Data (axes), and explicitly also Get and Set_Attribute_List and Get and
//! Set_Attribute_Single. Motor and inertia tests answer "service not supported": they measure what only the drive can,
//! and nothing that runs a drive here has a procedure for them.
//!
//! While a connection is open, what does more than read is taken by explicit message only from its owner
//! ([`super::owner`]), and a test only while the owner's updates are fresh.

use profile_generic::time::SystemTime;

use super::cyclic_list::Direction;
use super::engine::Engine;
use crate::device::attribute::id;
use crate::device::attribute::list_job::{BODY_MAX, ListFormat};
use crate::wire::Writer;
use crate::wire::motion::codes::{MotionService, SyncStatus};
use crate::wire::motion::test_service::{RUN_HOOKUP_TEST_LEN, RunHookupTest};
use crate::wire::motion::{Format, ServiceRequest};
use crate::wire::status::GeneralStatus;

/// Reads a request body that has one length and no other.
fn exact<T>(
    body: &[u8],
    len: usize,
    parse: impl FnOnce(&[u8]) -> Result<T, crate::wire::Error>,
) -> Result<T, GeneralStatus> {
    if body.len() > len {
        return Err(GeneralStatus::TOO_MUCH_DATA);
    }
    parse(body).map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)
}

/// What a service turned out to be.
pub(super) enum Started {
    /// Answered at once.
    Answered(GeneralStatus, usize),
    /// An attribute service.
    List(ListFormat),
}

/// Starts what both ways have in common; writes an immediate answer to `response`.
pub(super) fn start(
    engine: &mut Engine,
    instance: usize,
    service: MotionService,
    body: &[u8],
    system_time: Option<SystemTime>,
    response: &mut [u8],
) -> Started {
    let (status, len) = match (service, instance) {
        (MotionService::GET_AXIS_ATTRIBUTES_LIST, _) => return Started::List(ListFormat::AxisGet),
        (MotionService::SET_AXIS_ATTRIBUTES_LIST, _) => {
            engine.progress.attribute_set = true;
            return Started::List(ListFormat::AxisSet);
        }
        (MotionService::GROUP_SYNC, 0) if engine.config.supports_sync => {
            group_sync(engine, body, system_time, response)
        }
        (MotionService::SET_CYCLIC_WRITE_LIST, 1..) => {
            configure_list(engine, instance, Direction::Write, body, response)
        }
        (MotionService::SET_CYCLIC_READ_LIST, 1..) => {
            configure_list(engine, instance, Direction::Read, body, response)
        }
        (MotionService::RUN_HOOKUP_TEST, 1..) => run_hookup_test(engine, instance, body, system_time),
        (MotionService::GET_HOOKUP_TEST_DATA, 1..) => hookup_test_data(engine, instance, body, response),
        _ => UNSUPPORTED,
    };
    Started::Answered(status, len)
}

/// Answer of a service: its status and the octets of the response.
type Answer = (GeneralStatus, usize);

const UNSUPPORTED: Answer = (GeneralStatus::SERVICE_NOT_SUPPORTED, 0);

fn group_sync(
    engine: &mut Engine,
    body: &[u8],
    system_time: Option<SystemTime>,
    response: &mut [u8],
) -> Answer {
    let received = engine.connection.as_ref().map(|c| (c.header.and_then(|h| h.time_stamp), c.period()));
    let controller = engine.instances.class_value(id::CONTROLLER_TIME_OFFSET);
    let (status, sync) = engine.clock.group_sync(body, system_time.map(|t| t.0), received, controller);
    engine.progress.group_synced |= sync == SyncStatus::SYNCHRONIZED;
    match response.first_mut().filter(|_| status == GeneralStatus::SUCCESS) {
        Some(place) => {
            *place = sync.0;
            (status, 1)
        }
        None => (status, 0),
    }
}

fn configure_list(
    engine: &mut Engine,
    instance: usize,
    direction: Direction,
    body: &[u8],
    response: &mut [u8],
) -> Answer {
    let Some((slot, table)) = engine.instances.axis(instance) else { return UNSUPPORTED };
    slot.configure_list(table, direction, body, response)
}

fn run_hookup_test(
    engine: &mut Engine,
    instance: usize,
    body: &[u8],
    system_time: Option<SystemTime>,
) -> Answer {
    let context = engine.context(system_time);
    let Some((slot, _)) = engine.instances.axis(instance) else { return UNSUPPORTED };
    let request = exact(body, RUN_HOOKUP_TEST_LEN, RunHookupTest::parse);
    (request.map_or_else(|status| status, |request| slot.axis.begin_hookup_test(&request, &context)), 0)
}

fn hookup_test_data(engine: &mut Engine, instance: usize, body: &[u8], response: &mut [u8]) -> Answer {
    let slot = engine.instances.axis(instance).map(|(slot, _)| slot);
    let Some(slot) = slot.filter(|slot| slot.axis.config.hookup_tests != 0) else { return UNSUPPORTED };
    if !body.is_empty() {
        return (GeneralStatus::TOO_MUCH_DATA, 0);
    }
    // Zeros would say that a test has succeeded.
    let Some(data) = slot.axis.hookup_test_data() else { return (GeneralStatus::OBJECT_STATE_CONFLICT, 0) };
    let mut writer = Writer::new(response);
    match data.emit(&mut writer) {
        Ok(()) => (GeneralStatus::SUCCESS, writer.written()),
        Err(_) => (GeneralStatus::REPLY_DATA_TOO_LARGE, 0),
    }
}

/// Executes a new request of the service channel.
pub(super) fn execute(
    engine: &mut Engine,
    instance: usize,
    request: &ServiceRequest<'_>,
    system_time: Option<SystemTime>,
) {
    let mut response = [0; BODY_MAX];
    let started = start(engine, instance, request.service, request.data, system_time, &mut response);
    let Some((channel, space)) = engine.instances.service(instance) else { return };
    match started {
        Started::Answered(status, len) => channel.answer(status, &response[..len]),
        Started::List(format) => match channel.worker.start(format, request.data, BODY_MAX, space.table) {
            Ok(()) => run(engine, instance),
            Err(status) => channel.answer(status, &[]),
        },
    }
}

/// Carries the attribute service of an instance on as far as it goes.
pub(super) fn run(engine: &mut Engine, instance: usize) {
    engine.publish(instance);
    let Some((channel, mut space)) = engine.instances.service(instance) else { return };
    if !channel.is_busy() {
        return;
    }
    let mut worker = core::mem::take(&mut channel.worker);
    match worker.run(&mut space) {
        Some((status, body)) => channel.answer(status, body),
        None => channel.worker = worker,
    }
    adopt(engine, instance);
}

/// Takes over attributes that a service may have set and that the engine works with.
pub(super) fn adopt(engine: &mut Engine, instance: usize) {
    if instance == 0 {
        let counter = |id| u8::try_from(engine.instances.class_value(id)).unwrap_or(u8::MAX);
        let diagnostics = (counter(id::LOST_UPDATES), counter(id::LATE_UPDATES));
        engine.statistics.set_diagnostics(diagnostics);
    } else if engine.config.format == Format::Fixed
        && let Some((slot, table)) = engine.instances.axis(instance)
    {
        super::fixed::adopt(slot, table);
    }
}
