//! The service channel's speed: one step a cycle, counted in virtual time, at every slave at once.

use super::full_slaves::full_rig;
use super::*;
use crate::master::svc::request::{Shape, SvcData, SvcOperation};
use crate::wire::svc::Element;

/// Cycles until every slave has answered the same requests.
fn cycles_for(slaves: u16, requests: &[SvcRequest]) -> usize {
    let mut rig = full_rig(slaves);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP2);
    rig.state(State::Await2);
    rig.cycles(2);
    for slave in (0..slaves).map(SlaveId) {
        for request in requests {
            rig.master.svc_submit(slave, request.clone()).unwrap();
        }
    }
    let wanted = requests.len() * usize::from(slaves);
    for cycle in 1..20_000 {
        rig.step();
        let outcomes = rig.log.iter().filter_map(|event| match event {
            Event::Svc { outcome, .. } => Some(outcome),
            _ => None,
        });
        outcomes.clone().for_each(|outcome| assert!(outcome.result.is_ok(), "{outcome}"));
        if outcomes.count() == wanted {
            return cycle;
        }
    }
    panic!("not all answered");
}

#[test]
fn cycles_a_parameter() {
    let inline = |bytes: &[u8]| SvcData::inline(bytes).unwrap();
    let half = SvcRequest::read(Idn::INTER_FRAME_GAP);
    let write = SvcRequest::write(Idn::INTER_FRAME_GAP, inline(&[20, 0]));
    let lengths = SvcRequest::write(Idn::MDT_LENGTHS, inline(&[46, 0, 0, 0, 0, 0, 0, 0]));
    let list = Shape::List;
    let long = SvcRequest::read(Idn::IDN_LIST_OF_ALL_OPERATION_DATA).with_shape(list);
    let items = full_rig(1).line.slaves()[0].store().iter().count();
    // What stands in the buffer of a read request is discarded.
    let room = |request: SvcRequest| request.with_buffer(vec![0; 4 * items]);
    let name = SvcRequest::new(Idn::CYCLE_TIME, SvcOperation::Read(Element::Name));
    for (what, request, cycles) in [
        // Opening and value.
        ("read, shape known", half.clone().with_shape(Shape::Fixed(2)), 2),
        ("write, shape known", write.clone().with_shape(Shape::Fixed(2)), 2),
        // Opening, attribute, value.
        ("read", half.clone(), 3),
        ("write", write, 3),
        // Opening, head, one item of four bytes a cycle.
        ("list of 8 bytes", lengths.with_shape(list), 4),
        ("list of all parameters", room(long), 2 + items),
        ("a name of 24 bytes", name, 2 + "Communication cycle time".len() / 4),
        ("data status", SvcRequest::new(Idn::CP3_CHECK, SvcOperation::Status), 1),
        // Opened and cleared, opened and started, asked about, cleared and asked about.
        ("procedure command", SvcRequest::command(Idn::DELAY_MEASURING), 7),
    ] {
        assert_eq!(cycles_for(1, std::slice::from_ref(&request)), cycles, "{what}");
        // All slaves are served at the same time.
        assert_eq!(cycles_for(32, std::slice::from_ref(&request)), cycles, "{what} at 32 slaves");
    }
    // No cycle is lost between requests.
    let half = half.with_shape(Shape::Fixed(2));
    assert_eq!(
        cycles_for(3, &vec![half; crate::master::svc::REQUESTS_MAX]),
        2 * crate::master::svc::REQUESTS_MAX
    );
}

#[test]
fn the_phase_up_loses_no_cycle_either() {
    let mut rig = full_rig(1);
    rig.master.set_target_phase(Phase::CP4);
    let cycles = |rig: &mut VirtualBus<crate::slave::Network<crate::checker::light::Mirror>>, from, to| {
        rig.state(from);
        let start = rig.cycles.len();
        rig.state(to);
        rig.cycles.len() - start
    };
    // Reading, connecting and writing: as many cycles as steps, and one to move on.
    let reading = cycles(&mut rig, State::Read2, State::Await2);
    let connecting = cycles(&mut rig, State::Connect2, State::Write2);
    let writing = cycles(&mut rig, State::Write2, State::Measure2);
    let checking = cycles(&mut rig, State::Check2, State::Leave2);
    // The cycle that enters a part has its first step. Read: 3 for S-0-1302.0.1, 4 and 4 for the class lists, 2 and 3.
    // Connect: 4 setups, 2 lists of one IDN, 2 lengths, 2 times. Write: 22 values, 3 lists. Check: the command of 5, 2
    // to cancel it, one to see that all is quiet.
    let lists = 3 * (2 + 2);
    let command = 5 + 2 + 1;
    assert_eq!(reading, 3 + 4 + 4 + 2 + 3 - 1);
    assert_eq!(connecting, 4 * 2 + 2 * 3 + 2 * 2 + 2 * 2);
    assert_eq!(writing, 22 * 2 + lists);
    assert_eq!(checking, command);
}

#[test]
fn lists_longer_than_a_request_use_the_callers_buffer() {
    let mut rig = full_rig(1);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP2);
    rig.state(State::Await2);
    let all = Idn::IDN_LIST_OF_ALL_OPERATION_DATA;
    let count = rig.line.slaves()[0].store().iter().count();
    let outcome = rig.request(SlaveId(0), SvcRequest::read(all).with_buffer(Vec::with_capacity(4 * count)));
    assert_eq!(outcome.data.double_words().count(), count);
    // Too little room is said, with the length, and the buffer comes back.
    let outcome = rig.request(SlaveId(0), SvcRequest::read(all).with_buffer(Vec::with_capacity(16)));
    let length = u16::try_from(4 * count).unwrap();
    assert!(matches!(outcome.result, Err(SvcFailure::TooLong { length: found, .. }) if found == length));
    assert!(matches!(outcome.data, SvcData::Buffer(_)));
}
