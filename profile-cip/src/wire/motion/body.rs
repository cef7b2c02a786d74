//! Prints the bodies of the service block for an engineer.

use core::fmt;

use super::attribute_list::{GetItem, GetRequest, GetResponse, SetRequest, SetResponse};
use super::codes::{MotionService, SyncStatus};
use super::id_list::{IdList, IdStatusList};
use super::test_service::{
    HookupTestData, InertiaTestData, MotorTestData, RunHookupTest, RunInertiaTest, RunMotorTest,
};
use crate::wire::Error;
use crate::wire::status::GeneralStatus;

/// Writes the lines of one body; what does not decode is printed as octets with the reason.
pub(super) fn write_body(
    f: &mut fmt::Formatter<'_>,
    service: MotionService,
    response: bool,
    data: &[u8],
) -> fmt::Result {
    if data.is_empty() {
        return Ok(());
    }
    match write_known(f, service, response, data)? {
        Ok(true) => Ok(()),
        Ok(false) => writeln!(f, "      data {data:02X?}"),
        Err(error) => writeln!(f, "      not understood ({error}): {data:02X?}"),
    }
}

type Written = Result<Result<bool, Error>, fmt::Error>;

/// Unwraps a wire result, or hands the error outwards as a body that does not decode.
macro_rules! wire {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(error) => return Ok(Err(error)),
        }
    };
}

// Flat: one arm per service.
fn write_known(f: &mut fmt::Formatter<'_>, service: MotionService, response: bool, data: &[u8]) -> Written {
    match (service, response) {
        (MotionService::GET_AXIS_ATTRIBUTES_LIST, false) => {
            for item in wire!(GetRequest::new(data)) {
                writeln!(f, "      {}", wire!(item))?;
            }
        }
        (MotionService::GET_AXIS_ATTRIBUTES_LIST, true) => {
            for item in wire!(GetResponse::new(data)) {
                match wire!(item) {
                    GetItem::Value(selector, value) => writeln!(f, "      {selector} = {value:02X?}")?,
                    GetItem::Error(id, status) => {
                        writeln!(f, "      attribute {id}: {}", GeneralStatus(status))?
                    }
                }
            }
        }
        (MotionService::SET_AXIS_ATTRIBUTES_LIST, false) => {
            for item in wire!(SetRequest::new(data)) {
                let (selector, value) = wire!(item);
                writeln!(f, "      {selector} = {value:02X?}")?;
            }
        }
        (MotionService::SET_AXIS_ATTRIBUTES_LIST, true) => {
            for item in wire!(SetResponse::new(data)) {
                let item = wire!(item);
                writeln!(
                    f,
                    "      attribute {}: {}, index {}",
                    item.id,
                    GeneralStatus(item.status),
                    item.index
                )?;
            }
        }
        (MotionService::SET_CYCLIC_WRITE_LIST | MotionService::SET_CYCLIC_READ_LIST, false) => {
            for id in wire!(IdList::parse(data)).iter() {
                writeln!(f, "      attribute {id}")?;
            }
        }
        (MotionService::SET_CYCLIC_WRITE_LIST | MotionService::SET_CYCLIC_READ_LIST, true) => {
            let list = wire!(IdStatusList::parse(data));
            writeln!(f, "      block ID {}", list.block_id)?;
            for item in list.iter() {
                writeln!(f, "      attribute {}: {}", item.id, GeneralStatus(item.status))?;
            }
        }
        (MotionService::GROUP_SYNC, false) => writeln!(f, "      grand master clock {data:02X?}")?,
        (MotionService::GROUP_SYNC, true) => writeln!(f, "      {}", SyncStatus(data[0]))?,
        (MotionService::RUN_MOTOR_TEST, false) => {
            writeln!(f, "      {:?}", wire!(RunMotorTest::parse(data)))?
        }
        (MotionService::GET_MOTOR_TEST_DATA, true) => {
            writeln!(f, "      {:?}", wire!(MotorTestData::parse(data)))?;
        }
        (MotionService::RUN_INERTIA_TEST, false) => {
            writeln!(f, "      {:?}", wire!(RunInertiaTest::parse(data)))?;
        }
        (MotionService::GET_INERTIA_TEST_DATA, true) => {
            writeln!(f, "      {:?}", wire!(InertiaTestData::parse(data)))?;
        }
        (MotionService::RUN_HOOKUP_TEST, false) => {
            writeln!(f, "      {:?}", wire!(RunHookupTest::parse(data)))?
        }
        (MotionService::GET_HOOKUP_TEST_DATA, true) => {
            writeln!(f, "      {:?}", wire!(HookupTestData::parse(data)))?;
        }
        _ => return Ok(Ok(false)),
    }
    Ok(Ok(true))
}
