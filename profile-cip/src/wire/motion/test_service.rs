//! Bodies of the motor, inertia and hookup test services 0x4F to 0x54, clauses 5-2.5.1.5 to 5-2.5.1.10.
//!
//! | service | request | response |
//! |---|---|---|
//! | Run_Motor_Test | test type u8 | - |
//! | Get_Motor_Test_Data | optional data set u8 | status u8, 3 reserved, five REAL whose meaning depends on the motor type |
//! | Run_Inertia_Test | direction u8, 3 reserved, velocity, torque, travel limit REAL | - |
//! | Get_Inertia_Test_Data | - | status u8, 3 reserved, acceleration and deceleration time REAL |
//! | Run_Hookup_Test | type u8, channel u8, 2 reserved, distance, time REAL | - |
//! | Get_Hookup_Test_Data | - | status, direction 1, direction 2, commutation polarity u8, commutation offset REAL |
//!
//! Get_Motor_Test_Data: induction motors answer stator resistance, leakage inductance, flux current, slip speed and a
//! pad; surface magnet motors stator resistance, leakage inductance, two pads and counter EMF; interior magnet motors
//! stator resistance, Lq, Ld and counter EMF, without a fifth value.

use super::codes::TestStatus;
use super::value::{ReadValue, WriteValue};
use crate::wire::{Error, Reader, Writer};

/// Octets of a Run_Hookup_Test request.
pub const RUN_HOOKUP_TEST_LEN: usize = 12;

const BODY: &str = "test service body";

/// Test Status of a hookup test beyond those that all tests have, Table 5-2.96.
pub mod hookup_status {
    use super::TestStatus;

    /// Feedback 1 did not show the motion.
    pub const NO_FEEDBACK_1: TestStatus = TestStatus(5);
    /// Feedback 2 did not show the motion.
    pub const NO_FEEDBACK_2: TestStatus = TestStatus(6);
}

/// Run_Motor_Test request, Table 5-2.86.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunMotorTest {
    /// 0 static, 1 dynamic, 2 calculated.
    pub test_type: u8,
}

/// Get_Motor_Test_Data response, Tables 5-2.89 to 5-2.91.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorTestData {
    /// Result of the last motor test.
    pub status: TestStatus,
    /// The values in the order of the motor type's table.
    pub values: [f32; 4],
    /// The fifth value; interior magnet motors have none.
    pub fifth: Option<f32>,
}

/// Run_Inertia_Test request, Table 5-2.92.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunInertiaTest {
    /// 0 forward, 1 reverse.
    pub direction: u8,
    /// Highest velocity of the test, motor units per second.
    pub velocity: f32,
    /// Highest torque of the test, % of motor rated torque.
    pub torque: f32,
    /// Largest excursion, motor units.
    pub travel_limit: f32,
}

/// Get_Inertia_Test_Data response, Table 5-2.93.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertiaTestData {
    /// Result of the last inertia test.
    pub status: TestStatus,
    /// Measured acceleration time, seconds.
    pub acceleration_time: f32,
    /// Measured deceleration time, seconds.
    pub deceleration_time: f32,
}

/// Run_Hookup_Test request, Table 5-2.94.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunHookupTest {
    /// 0 motor and feedback, 1 feedback, 2 marker, 3 commutation.
    pub test_type: u8,
    /// Logical feedback channel, 0 if not applicable.
    pub feedback_channel: u8,
    /// Distance to travel, motor or feedback units.
    pub distance: f32,
    /// Duration of the motion, seconds.
    pub time: f32,
}

/// Get_Hookup_Test_Data response, Table 5-2.96.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HookupTestData {
    /// Result of the last hookup test.
    pub status: TestStatus,
    /// 0 positive, 1 negative.
    pub feedback_1_direction: u8,
    /// 0 positive, 1 negative.
    pub feedback_2_direction: u8,
    /// 0 normal, 1 inverted.
    pub commutation_polarity: u8,
    /// Electrical degrees.
    pub commutation_offset: f32,
}

impl RunMotorTest {
    /// Reads a request body.
    ///
    /// # Errors
    /// There is no octet.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        Ok(Self { test_type: Reader::new(body).u8(BODY)? })
    }

    /// Writes a request body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BODY, &[self.test_type, 0, 0, 0])
    }
}

impl MotorTestData {
    /// Reads a response body.
    ///
    /// # Errors
    /// The octets are too few.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let [status, _, _, _] = reader.array(BODY)?;
        let mut values = [0.0; 4];
        for value in &mut values {
            *value = reader.f32(BODY)?;
        }
        let fifth = (reader.remaining() >= 4).then(|| reader.f32(BODY)).transpose()?;
        Ok(Self { status: TestStatus(status), values, fifth })
    }

    /// Writes a response body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BODY, &[self.status.0, 0, 0, 0])?;
        for value in self.values.into_iter().chain(self.fifth) {
            writer.f32(BODY, value)?;
        }
        Ok(())
    }
}

impl RunInertiaTest {
    /// Reads a request body.
    ///
    /// # Errors
    /// The octets are too few.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let [direction, _, _, _] = reader.array(BODY)?;
        let (velocity, torque, travel_limit) = (reader.f32(BODY)?, reader.f32(BODY)?, reader.f32(BODY)?);
        Ok(Self { direction, velocity, torque, travel_limit })
    }

    /// Writes a request body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BODY, &[self.direction, 0, 0, 0])?;
        writer.f32(BODY, self.velocity)?;
        writer.f32(BODY, self.torque)?;
        writer.f32(BODY, self.travel_limit)
    }
}

impl InertiaTestData {
    /// Reads a response body.
    ///
    /// # Errors
    /// The octets are too few.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let [status, _, _, _] = reader.array(BODY)?;
        let (acceleration_time, deceleration_time) = (reader.f32(BODY)?, reader.f32(BODY)?);
        Ok(Self { status: TestStatus(status), acceleration_time, deceleration_time })
    }

    /// Writes a response body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BODY, &[self.status.0, 0, 0, 0])?;
        writer.f32(BODY, self.acceleration_time)?;
        writer.f32(BODY, self.deceleration_time)
    }
}

impl RunHookupTest {
    /// Reads a request body.
    ///
    /// # Errors
    /// The octets are too few.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let [test_type, feedback_channel, _, _] = reader.array(BODY)?;
        let (distance, time) = (reader.f32(BODY)?, reader.f32(BODY)?);
        Ok(Self { test_type, feedback_channel, distance, time })
    }

    /// Writes a request body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(BODY, &[self.test_type, self.feedback_channel, 0, 0])?;
        writer.f32(BODY, self.distance)?;
        writer.f32(BODY, self.time)
    }
}

impl HookupTestData {
    /// Reads a response body.
    ///
    /// # Errors
    /// The octets are too few.
    pub fn parse(body: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(body);
        let [status, feedback_1_direction, feedback_2_direction, commutation_polarity] =
            reader.array(BODY)?;
        let commutation_offset = reader.f32(BODY)?;
        let status = TestStatus(status);
        Ok(Self {
            status,
            feedback_1_direction,
            feedback_2_direction,
            commutation_polarity,
            commutation_offset,
        })
    }

    /// Writes a response body.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u8(BODY, self.status.0)?;
        let directions = [self.feedback_1_direction, self.feedback_2_direction, self.commutation_polarity];
        writer.slice(BODY, &directions)?;
        writer.f32(BODY, self.commutation_offset)
    }
}
