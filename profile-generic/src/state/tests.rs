//! The whole state x event table as a snapshot, and what must hold in every row of it.

use super::*;

/// One variable of the conditions with the name of each of its values and how to set it.
type Variable = (&'static [&'static str], fn(&mut Conditions, usize));

/// In the order in which the table splits its rows.
const VARIABLES: [Variable; 11] = [
    (&["no torque", "torque"], |conditions, value| conditions.torque = value == 1),
    (&["no fault", "fault"], |conditions, value| conditions.fault_active = value == 1),
    (&["no shutdown", "shutdown"], |conditions, value| conditions.shutdown_latched = value == 1),
    (&["uninitialised", "initialised"], |conditions, value| conditions.initialised = value == 1),
    (&["no power", "power"], |conditions, value| conditions.power = value == 1),
    (&["no inhibit", "soft inhibit", "torque inhibit"], |conditions, value| {
        conditions.inhibits = [Inhibits::empty(), Inhibits::NOT_HOMED, Inhibits::HARDWARE_ENABLE][value];
    }),
    (&["no test", "test"], |conditions, value| conditions.test_active = value == 1),
    (&["not halted", "halted"], |conditions, value| conditions.halted = value == 1),
    (&["no halt", "halt ordered"], |conditions, value| conditions.halting = value == 1),
    (&["no reset", "reset"], |conditions, value| conditions.reset_pending = value == 1),
    (&["ignore", "alarm", "hold", "decelerate", "coast", "shut down"], |conditions, value| {
        conditions.reaction = Reaction::ALL[value];
    }),
];

/// Calls `visit` with every combination of conditions, variables before `from` kept as they are.
fn for_all(from: usize, conditions: Conditions, visit: &mut impl FnMut(Conditions)) {
    let Some((values, set)) = VARIABLES.get(from) else { return visit(conditions) };
    for value in 0..values.len() {
        let mut with = conditions;
        set(&mut with, value);
        for_all(from + 1, with, visit);
    }
}

/// Calls `visit` with every state, event and combination of conditions.
fn everywhere(mut visit: impl FnMut(DriveState, Event, Conditions, Transition)) {
    for state in DriveState::ALL.iter().copied() {
        for event in Event::all() {
            for_all(0, Conditions::default(), &mut |conditions| {
                visit(state, event, conditions, state.next(event, &conditions));
            });
        }
    }
}

/// The transitions of one state and event as a tree over the variables, a variable left out where it does not
/// matter.
fn rows(state: DriveState, event: Event) -> Vec<(String, Transition)> {
    fn grow(
        from: usize,
        conditions: Conditions,
        next: &dyn Fn(&Conditions) -> Transition,
    ) -> Vec<(String, Transition)> {
        let Some((values, set)) = VARIABLES.get(from) else {
            return vec![(String::new(), next(&conditions))];
        };
        let branches: Vec<_> = (0..values.len())
            .map(|value| {
                let mut with = conditions;
                set(&mut with, value);
                grow(from + 1, with, next)
            })
            .collect();
        if branches.windows(2).all(|pair| pair[0] == pair[1]) {
            return branches.into_iter().next().unwrap();
        }
        let mut rows = Vec::new();
        for (name, branch) in values.iter().zip(branches) {
            for (text, transition) in branch {
                let text = if text.is_empty() { (*name).to_owned() } else { format!("{name}, {text}") };
                rows.push((text, transition));
            }
        }
        rows
    }
    grow(0, Conditions::default(), &|conditions| state.next(event, conditions))
}

fn event_name(event: Event) -> String {
    match event {
        Event::Request(request) => format!("request {request}"),
        Event::Report(report) => format!("report {report}"),
        other => format!("{other:?}"),
    }
}

#[test]
fn the_whole_table() {
    let mut table = String::new();
    for state in DriveState::ALL.iter().copied() {
        for event in Event::all() {
            for (conditions, Transition { next, action, fault, shutdown }) in rows(state, event) {
                let next = if next == state { "-".to_owned() } else { next.to_string() };
                let fault = fault.map_or(String::new(), |cause| format!(" [{cause}]"));
                let latch = match shutdown {
                    Some(true) => " latch",
                    Some(false) => " unlatch",
                    None => "",
                };
                let event = event_name(event);
                let row =
                    format!("{state:<14} {event:<22} {next:<14} {action:<12}{conditions}{fault}{latch}");
                table.push_str(row.trim_end());
                table.push('\n');
            }
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn torque_comes_from_an_allowed_enable_only() {
    everywhere(|state, event, conditions, transition| {
        let row = format!("{state} {event:?} {conditions:?}");
        if transition.action == Action::Enable {
            assert!(matches!(event, Event::Request(Request::Enable | Request::Test)), "{row}");
            assert!(matches!(state, DriveState::Ready | DriveState::Operating), "{row}");
            assert!(conditions.inhibits.is_empty() && conditions.power && conditions.initialised, "{row}");
            assert!(!conditions.fault_active && !conditions.shutdown_latched, "{row}");
        }
        if transition.next.is_running() && !state.is_running() {
            assert_eq!((state, transition.action), (DriveState::Ready, Action::Enable), "{row}");
        }
        if matches!(transition.next, DriveState::Operating | DriveState::Testing) && state != transition.next
        {
            assert_eq!(state, DriveState::Starting, "{row}");
            assert!(
                matches!(event, Event::Report(Report::Operating | Report::Halted)),
                "only the drive itself says that it operates: {row}"
            );
        }
    });
}

#[test]
fn a_latched_fault_leaves_by_reset_only() {
    everywhere(|state, event, conditions, transition| {
        if state == DriveState::Faulted && transition.next != DriveState::Faulted {
            let asked = event == Event::Request(Request::FaultReset) || conditions.reset_pending;
            assert!(asked && !conditions.fault_active, "{event:?} {conditions:?}");
            assert!(!conditions.torque || matches!(event, Event::Report(_)), "{event:?} {conditions:?}");
            assert!(!transition.next.may_have_torque(), "{event:?} {conditions:?}");
        }
        if state == DriveState::FaultReaction {
            let allowed = match transition.next {
                DriveState::FaultReaction | DriveState::Faulted => true,
                DriveState::Stopping => {
                    event == Event::Request(Request::FaultReset) && !conditions.fault_active
                }
                _ => false,
            };
            assert!(allowed, "{event:?} {conditions:?} {transition:?}");
        }
    });
}

#[test]
fn a_latched_shutdown_leaves_by_its_reset_only() {
    everywhere(|state, event, conditions, transition| {
        if transition.shutdown == Some(false) {
            assert_eq!((state, event), (DriveState::Shutdown, Event::Request(Request::ShutdownReset)));
        }
        if state == DriveState::Shutdown && transition.next.is_idle() {
            assert_eq!(event, Event::Request(Request::ShutdownReset), "{conditions:?}");
        }
        if event == Event::Request(Request::Shutdown) {
            assert_eq!(transition.shutdown, Some(true), "{state}");
        }
        if conditions.shutdown_latched
            && !state.is_running()
            && event != Event::Request(Request::ShutdownReset)
        {
            assert!(!transition.next.is_running(), "{state} {event:?} {conditions:?}");
        }
    });
}

#[test]
fn doubt_ends_every_run() {
    let ends = [
        Event::CommandLost,
        Event::Report(Report::Silent),
        Event::Report(Report::Faulted),
        Event::Report(Report::FaultReaction),
        Event::Report(Report::NotReady),
        Event::Report(Report::AwaitingPower),
        Event::Report(Report::Stopping),
        Event::Request(Request::Abort),
        Event::Request(Request::Disable),
        Event::Request(Request::Shutdown),
    ];
    everywhere(|state, event, conditions, transition| {
        if state.is_running() && ends.contains(&event) {
            let row = format!("{state} {event:?} {conditions:?} {transition:?}");
            assert!(!transition.next.is_running(), "{row}");
            assert!(matches!(transition.action, Action::Disable | Action::TorqueOff), "{row}");
        }
        if matches!(event, Event::Report(Report::Enabling | Report::Operating | Report::Halted))
            && !state.may_have_torque()
        {
            assert_eq!(transition.next, DriveState::Faulted);
            assert_eq!(transition.action, Action::TorqueOff);
            assert_eq!(transition.fault, Some(FaultCause::UNEXPECTED_TORQUE));
        }
    });
}

#[test]
fn a_running_drive_does_not_stay_when_the_conditions_forbid_it() {
    everywhere(|state, event, conditions, transition| {
        let forbidden = conditions.fault_active
            || conditions.shutdown_latched
            || conditions.inhibits.intersects(Inhibits::REMOVE_TORQUE);
        if state.is_running() && forbidden && matches!(event, Event::Report(_)) {
            // Enabling in Operating is a fault anyway.
            let row = format!("{state} {event:?} {conditions:?} {transition:?}");
            assert!(!transition.next.is_running(), "{row}");
        }
    });
}

#[test]
fn reports_repeat_without_effect() {
    everywhere(|state, event, conditions, transition| {
        if matches!(event, Event::Report(_)) {
            let conditions = Conditions {
                shutdown_latched: transition.shutdown.unwrap_or(conditions.shutdown_latched),
                // A pending reset belongs to Faulted and does not outlive it.
                reset_pending: conditions.reset_pending && state == DriveState::Faulted,
                ..conditions
            };
            let again = transition.next.next(event, &conditions);
            // What is still moving may pass one more state, such as from a reaction to the fault, but not
            // two.
            let third = again.next.next(event, &conditions);
            assert_eq!(again.next, third.next, "{state} {event:?} {conditions:?}");
        }
    });
}

fn ready() -> BasicDrive {
    let mut drive = BasicDrive::new();
    drive.report(Report::NotReady);
    drive.report(Report::AwaitingPower);
    drive.report(Report::Ready);
    drive
}

fn operating() -> BasicDrive {
    let mut drive = ready();
    drive.request(Request::Enable);
    drive.report(Report::Enabling);
    drive.report(Report::Operating);
    drive
}

#[test]
fn from_start_to_operation_and_back() {
    let mut drive = BasicDrive::new();
    let script = [
        (Event::Report(Report::Silent), DriveState::NotReady, Action::None),
        (Event::Report(Report::NotReady), DriveState::NotReady, Action::None),
        (Event::Request(Request::Enable), DriveState::NotReady, Action::Reject),
        (Event::Report(Report::AwaitingPower), DriveState::AwaitingPower, Action::Energize),
        (Event::Report(Report::Ready), DriveState::Ready, Action::None),
        (Event::Request(Request::Enable), DriveState::Starting, Action::Enable),
        (Event::Report(Report::Ready), DriveState::Starting, Action::None),
        (Event::Report(Report::Enabling), DriveState::Starting, Action::None),
        (Event::Report(Report::Operating), DriveState::Operating, Action::None),
        (Event::Request(Request::Stop), DriveState::Operating, Action::Halt),
        (Event::Report(Report::Halted), DriveState::Operating, Action::None),
        (Event::Request(Request::Enable), DriveState::Operating, Action::Enable),
        (Event::Request(Request::Disable), DriveState::Stopping, Action::Disable),
        (Event::Report(Report::Operating), DriveState::Stopping, Action::None),
        (Event::Report(Report::Stopping), DriveState::Stopping, Action::None),
        (Event::Report(Report::Ready), DriveState::Ready, Action::None),
    ];
    for (event, state, action) in script {
        let transition = drive.handle(event);
        assert_eq!((transition.next, transition.action), (state, action), "{event:?}");
        assert_eq!(drive.state(), state);
    }
}

#[test]
fn a_fault_of_the_drive_needs_a_reset_and_the_drive_has_to_follow() {
    let mut drive = operating();
    assert_eq!(drive.report(Report::FaultReaction).next, DriveState::FaultReaction);
    assert_eq!(drive.report(Report::Faulted).next, DriveState::Faulted);
    let reset = drive.request(Request::FaultReset);
    assert_eq!(
        (reset.next, reset.action),
        (DriveState::Faulted, Action::ResetFault),
        "the drive is still faulted"
    );
    assert_eq!(drive.report(Report::Faulted).next, DriveState::Faulted);
    assert_eq!(drive.report(Report::Ready).next, DriveState::Ready);

    let mut drive = operating();
    drive.report(Report::Faulted);
    assert_eq!(drive.report(Report::Ready).next, DriveState::Faulted, "nobody asked for a reset");
    drive.request(Request::FaultReset);
    assert_eq!(drive.state(), DriveState::Ready);
}

#[test]
fn a_drive_that_keeps_its_torque_cannot_be_reset() {
    let mut drive = operating();
    drive.report(Report::Silent);
    drive.handle(Event::Timeout);
    drive.report(Report::Stopping);
    assert_eq!(drive.request(Request::FaultReset).action, Action::Reject);
    assert_eq!(drive.request(Request::Enable).action, Action::Reject);
    assert_eq!(drive.report(Report::Ready).next, DriveState::Faulted, "the refused reset is not remembered");
    assert_eq!(drive.request(Request::FaultReset).next, DriveState::Ready);
}

#[test]
fn a_reset_that_was_given_up_or_overtaken_does_not_clear_later() {
    for spoil in [
        (|drive: &mut BasicDrive| drive.abandon_reset()) as fn(&mut BasicDrive),
        |drive| _ = drive.request(Request::Disable),
        |drive| _ = drive.raise_fault(Reaction::CoastAndDisable),
    ] {
        let mut drive = operating();
        drive.report(Report::Faulted);
        drive.request(Request::FaultReset);
        spoil(&mut drive);
        drive.clear_faults();
        assert_eq!(drive.report(Report::Ready).next, DriveState::Faulted);
    }
}

#[test]
fn a_shutdown_is_latched_beneath_a_reset_under_way_and_does_not_end_it() {
    let mut drive = operating();
    drive.report(Report::Faulted);
    drive.request(Request::FaultReset);
    drive.request(Request::Shutdown);
    assert_eq!(drive.state(), DriveState::Faulted);
    assert_eq!(drive.report(Report::Ready).next, DriveState::Shutdown);
    assert_eq!(drive.request(Request::ShutdownReset).next, DriveState::Ready);
}

#[test]
fn a_shutdown_outlasts_a_fault() {
    let mut drive = operating();
    assert_eq!(drive.request(Request::Shutdown).action, Action::TorqueOff);
    drive.report(Report::Faulted);
    drive.report(Report::Ready);
    assert_eq!(drive.request(Request::ShutdownReset).action, Action::Reject);
    assert_eq!(drive.request(Request::FaultReset).next, DriveState::Shutdown);
    let reset = drive.request(Request::ShutdownReset);
    assert_eq!((reset.next, reset.action), (DriveState::Ready, Action::Energize));
    assert!(!drive.conditions().shutdown_latched);
}

#[test]
fn a_shutdown_takes_the_torque_out_of_every_state_that_may_have_it() {
    everywhere(|state, event, conditions, transition| {
        if event == Event::Request(Request::Shutdown) && state.may_have_torque() {
            assert_eq!(transition.action, Action::TorqueOff, "{state} {conditions:?}");
            assert_eq!(transition.shutdown, Some(true), "{state} {conditions:?}");
        }
    });
}

#[test]
fn a_test_runs_in_its_own_state() {
    let mut drive = ready();
    assert_eq!(drive.request(Request::Test).next, DriveState::Starting);
    assert_eq!(drive.report(Report::Operating).next, DriveState::Testing);
    assert_eq!(drive.handle(Event::TestComplete).next, DriveState::Stopping);
    assert!(!drive.conditions().test_active);
    drive.report(Report::Ready);
    drive.request(Request::Enable);
    assert_eq!(drive.report(Report::Operating).next, DriveState::Operating, "the next start is no test");
}

#[test]
fn the_strongest_of_several_faults_counts() {
    let mut drive = operating();
    assert_eq!(drive.raise_fault(Reaction::Alarm).action, Action::None);
    assert_eq!(drive.state(), DriveState::Operating);
    assert!(!drive.conditions().fault_active);
    assert_eq!(drive.raise_fault(Reaction::HoldPosition).action, Action::Halt);
    assert_eq!(drive.report(Report::Halted).next, DriveState::FaultReaction, "holds until it is reset");
    assert_eq!(drive.request(Request::FaultReset).action, Action::Reject, "still active");
    assert_eq!(drive.raise_fault(Reaction::CoastAndDisable).action, Action::TorqueOff);
    assert_eq!(drive.raise_fault(Reaction::DecelerateAndDisable).action, Action::TorqueOff);
    drive.report(Report::Ready);
    drive.clear_faults();
    assert_eq!(drive.request(Request::FaultReset).next, DriveState::Ready);
    assert_eq!(drive.raise_fault(Reaction::Shutdown).shutdown, Some(true));
}

#[test]
fn a_hold_ends_with_a_stop() {
    let mut drive = operating();
    drive.raise_fault(Reaction::HoldPosition);
    drive.report(Report::Halted);
    drive.clear_faults();
    let reset = drive.request(Request::FaultReset);
    assert_eq!((reset.next, reset.action), (DriveState::Stopping, Action::Disable));
    assert_eq!(drive.report(Report::Ready).next, DriveState::Ready);
}

#[test]
fn inhibits_act_by_what_they_are() {
    let mut drive = operating();
    assert_eq!(drive.set_inhibits(Inhibits::NOT_HOMED).unwrap().next, DriveState::Operating);
    assert_eq!(drive.set_inhibits(Inhibits::NOT_HOMED), None);
    let removed = drive.set_inhibits(Inhibits::SAFETY).unwrap();
    assert_eq!((removed.next, removed.action), (DriveState::FaultReaction, Action::TorqueOff));
    assert_eq!(removed.fault, Some(FaultCause::SAFE_TORQUE_OFF));
    drive.report(Report::Ready);
    assert_eq!(drive.request(Request::FaultReset).next, DriveState::Inhibited);
    assert_eq!(drive.request(Request::Enable).action, Action::Reject);
    assert_eq!(drive.set_inhibits(Inhibits::empty()).unwrap().next, DriveState::Ready);
}

#[test]
fn a_silent_drive_ends_in_a_fault_after_the_time_limit() {
    let mut drive = operating();
    let silent = drive.report(Report::Silent);
    assert_eq!((silent.next, silent.action), (DriveState::FaultReaction, Action::Disable));
    assert_eq!(silent.fault, Some(FaultCause::SOUTH_SILENCE));
    assert_eq!(drive.report(Report::Silent).action, Action::None, "the controlled stop is not cut short");
    let late = drive.handle(Event::Timeout);
    assert_eq!((late.next, late.action), (DriveState::Faulted, Action::None), "nor by the end of the wait");
    let back = drive.report(Report::Operating);
    assert_eq!((back.next, back.fault), (DriveState::Faulted, Some(FaultCause::UNEXPECTED_TORQUE)));
}

#[test]
fn a_silent_drive_keeps_no_hold_and_a_heard_one_loses_its_torque_at_the_time_limit() {
    let mut drive = operating();
    assert_eq!(drive.raise_fault(Reaction::HoldPosition).action, Action::Halt);
    drive.report(Report::Silent);
    let late = drive.handle(Event::Timeout);
    assert_eq!((late.next, late.action), (DriveState::Faulted, Action::Disable));

    let mut drive = operating();
    drive.raise_fault(Reaction::CoastAndDisable);
    drive.report(Report::Silent);
    assert_eq!(drive.handle(Event::Timeout).action, Action::None, "torque off stands already");

    let mut drive = operating();
    drive.raise_fault(Reaction::DecelerateAndDisable);
    drive.report(Report::Stopping);
    let late = drive.handle(Event::Timeout);
    assert_eq!((late.next, late.action), (DriveState::Faulted, Action::TorqueOff));
}

#[test]
fn names_lead_back_and_indices_fit() {
    for (index, action) in Action::ALL.iter().copied().enumerate() {
        assert_eq!((action.index(), Action::parse(action.name())), (index, Some(action)));
    }
    for state in DriveState::ALL.iter().copied() {
        assert_eq!(DriveState::parse(state.name()), Some(state));
    }
    for report in Report::ALL.iter().copied() {
        assert_eq!(Report::parse(report.name()), Some(report));
    }
    for request in Request::ALL.iter().copied() {
        assert_eq!(Request::parse(request.name()), Some(request));
    }
}
