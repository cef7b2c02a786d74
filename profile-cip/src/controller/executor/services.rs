//! Steps that send a request as it is: services of the service channel, tests, explicit messages.

use super::Context;
use super::attributes::outcome;
use super::leaf::Run;
use crate::controller::event::Event;
use crate::controller::failure::Failure;
use crate::controller::program::Step;
use crate::controller::services::Outcome;
use crate::controller::session::Asker;
use crate::wire::motion::codes::TestStatus;
use profile_generic::time::DurationNs;

/// Time between two looks at the result of a test.
const TEST_INTERVAL: DurationNs = DurationNs::from_millis(50);
/// How long a test may take where the step does not say.
const TEST_MAX: DurationNs = DurationNs::from_secs(60);

pub(super) fn start(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<(), Failure> {
    match step {
        Step::Service { axis, service, data, .. } => {
            run.ticket = Some(cx.services.raw(*axis, *service, data, cx.room)?);
        }
        Step::Explicit { .. } => *cx.answer = None,
        _ => {}
    }
    Ok(())
}

pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    match step {
        Step::Service { axis, status, .. } => take_raw(*axis, *status, step, run, cx),
        Step::TestResult { axis, status, .. } => await_test(*axis, *status, step, run, cx),
        Step::Explicit { message, status } => {
            if !run.done {
                run.done = cx.session.message(cx.now, Asker::Program, message);
                // The session judges what it has sent; without a session nothing is sent.
                let waited = cx.now - run.since;
                if !run.done && waited > run.time_out.unwrap_or(cx.config.time_outs.explicit) {
                    return Err(Failure::StepTimeOut { waited });
                }
                return Ok(false);
            }
            let Some(answer) = cx.answer.take() else { return Ok(false) };
            let answer = answer?;
            let (service, found, extended) = (answer.service, answer.status, answer.extended);
            (cx.event)(Event::ExplicitAnswered { service, status: found, extended, data: answer.data });
            check_status(service, *status, found)
        }
        _ => Ok(true),
    }
}

fn check_status(service: u8, expected: Option<u8>, found: u8) -> Result<bool, Failure> {
    match expected {
        Some(expected) if expected != found => Err(Failure::OtherStatus { service, expected, found }),
        _ => Ok(true),
    }
}

fn take_raw(
    instance: u8,
    expected: Option<u8>,
    step: &Step,
    run: &Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    let Step::Service { service, .. } = step else { return Ok(true) };
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    let Outcome::Raw { status, data } = result? else { return Ok(true) };
    (cx.event)(Event::ServiceAnswered { instance, service: *service, status, data });
    check_status(service.0, expected, status)
}

/// Asks for the result of a test until it is over.
fn await_test(
    instance: u8,
    expected: TestStatus,
    step: &Step,
    run: &mut Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    let Step::TestResult { service, .. } = step else { return Ok(true) };
    if run.ticket.is_none() && cx.now >= run.again {
        run.ticket = Some(cx.services.raw(instance, *service, &[], cx.room)?);
    }
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    let Outcome::Raw { status, data } = result? else { return Ok(true) };
    run.ticket = None;
    run.again = cx.now + TEST_INTERVAL;
    if status != 0 {
        return Err(Failure::ServiceRefused { instance, service: *service, status });
    }
    let found = data.first().copied().map_or(TestStatus::IN_PROGRESS, TestStatus);
    let waited = cx.now - run.since;
    if found == TestStatus::IN_PROGRESS && expected != found {
        let late = waited > run.time_out.unwrap_or(TEST_MAX);
        return if late { Err(Failure::StepTimeOut { waited }) } else { Ok(false) };
    }
    (cx.event)(Event::ServiceAnswered { instance, service: *service, status, data });
    if found == expected { Ok(true) } else { Err(Failure::TestResult { axis: instance, expected, found }) }
}
