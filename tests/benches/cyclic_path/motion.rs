//! Updates of the CIP Motion connection, both directions, read and written.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion};
use profile_cip::wire::motion::codes::{
    ActualDataSet, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, CommandTarget, ControlMode,
    ControlStatus, FeedbackMode, NodeAlarm, NodeControl, NodeFault, NodeStatus, StatusDataSet, TimeDataSet,
};
use profile_cip::wire::motion::{
    ActualBlock, ActualFrame, ActualHeader, ActualInstance, ActualPosition, ActualValues, ActualWriter,
    CommandBlock, CommandFrame, CommandHeader, CommandInstance, CommandPosition, CommandValues,
    CommandWriter, StatusValues,
};

/// Room for an update with sixteen axes.
pub const ROOM: usize = 1_400;

const COMMAND_HEADER: CommandHeader = CommandHeader {
    update_id: 7,
    node_control: NodeControl::DATA_VALID,
    instance_count: 0,
    last_received_id: 6,
    time_stamp: Some(1_700_000_000_000_000_000),
    time_offset: Some(0),
    diagnostics: TimeDataSet::empty(),
};

const ACTUAL_HEADER: ActualHeader = ActualHeader {
    update_id: 7,
    node_status: NodeStatus::DATA_VALID,
    instance_count: 0,
    node_fault: NodeFault::NONE,
    node_alarm: NodeAlarm::NONE,
    last_received_id: 7,
    time_stamp: Some(1_700_000_000_000_000_000),
    time_offset: Some(0),
    update_diagnostics: None,
    time_diagnostics: None,
};

/// What a controller sends to an axis in position control: position, velocity and acceleration.
#[must_use]
pub fn commands(axes: u8) -> Vec<CommandInstance<'static>> {
    let cyclic = CommandBlock {
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(2),
        axis_control: AxisControl::NONE,
        control_status: ControlStatus::empty(),
        actual_data_set: ActualDataSet::POSITION | ActualDataSet::VELOCITY | ActualDataSet::ACCELERATION,
        status_data_set: StatusDataSet::AXIS_STATUS | StatusDataSet::IO_STATUS,
        target: CommandTarget::INTERPOLATE,
        values: CommandValues {
            position: Some(CommandPosition::Float(123_456.789)),
            velocity: Some(5.0),
            acceleration: Some(-12.5),
            ..CommandValues::default()
        },
    };
    (1..=axes)
        .map(|number| CommandInstance { number, cyclic: Some(cyclic), ..CommandInstance::default() })
        .collect()
}

/// What the device answers to [`commands`].
#[must_use]
pub fn actuals(axes: u8) -> Vec<ActualInstance<'static>> {
    let cyclic = ActualBlock {
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(2),
        axis_state: AxisStateCode::RUNNING,
        actual: ActualValues {
            position: Some(ActualPosition::Dint(123_456)),
            velocity: Some(5.0),
            acceleration: Some(-12.5),
            ..ActualValues::default()
        },
        status: StatusValues {
            axis_status: Some((AxisStatus::empty(), 0)),
            io_status: Some((AxisIoStatus::empty(), 0)),
            ..StatusValues::default()
        },
        ..ActualBlock::default()
    };
    (1..=axes)
        .map(|number| ActualInstance { number, cyclic: Some(cyclic), ..ActualInstance::default() })
        .collect()
}

/// Writes an update to the device.
#[must_use]
pub fn emit_command(buffer: &mut [u8], instances: &[CommandInstance<'_>]) -> usize {
    let mut writer = CommandWriter::new(buffer, &COMMAND_HEADER).expect("room for the header");
    for instance in instances {
        writer.instance(instance).expect("room for the instance");
    }
    writer.finish()
}

/// Writes an update to the controller.
#[must_use]
pub fn emit_actual(buffer: &mut [u8], instances: &[ActualInstance<'_>]) -> usize {
    let mut writer = ActualWriter::new(buffer, &ACTUAL_HEADER).expect("room for the header");
    for instance in instances {
        writer.instance(instance).expect("room for the instance");
    }
    writer.finish()
}

/// Checks an update to the device and reads every instance; gives their count.
#[must_use]
pub fn parse_command(update: &[u8]) -> usize {
    let frame = CommandFrame::parse(update).expect("a sound update");
    frame.instances().map(black_box).count()
}

/// Checks an update to the controller and reads every instance; gives their count.
#[must_use]
pub fn parse_actual(update: &[u8]) -> usize {
    let frame = ActualFrame::parse(update).expect("a sound update");
    frame.instances().map(black_box).count()
}

/// Benches of this module.
pub fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("motion_update");
    for axes in [1_u8, 4, 16] {
        let (commands, actuals) = (commands(axes), actuals(axes));
        let mut buffer = [0; ROOM];
        let len = emit_command(&mut buffer, &commands);
        assert_eq!(parse_command(&buffer[..len]), usize::from(axes));
        group.bench_function(BenchmarkId::new("c_to_d/parse", axes), |bencher| {
            bencher.iter(|| parse_command(black_box(&buffer[..len])));
        });
        group.bench_function(BenchmarkId::new("c_to_d/emit", axes), |bencher| {
            bencher.iter(|| emit_command(black_box(&mut buffer), black_box(&commands)));
        });
        let len = emit_actual(&mut buffer, &actuals);
        assert_eq!(parse_actual(&buffer[..len]), usize::from(axes));
        group.bench_function(BenchmarkId::new("d_to_c/parse", axes), |bencher| {
            bencher.iter(|| parse_actual(black_box(&buffer[..len])));
        });
        group.bench_function(BenchmarkId::new("d_to_c/emit", axes), |bencher| {
            bencher.iter(|| emit_actual(black_box(&mut buffer), black_box(&actuals)));
        });
    }
    group.finish();
}
