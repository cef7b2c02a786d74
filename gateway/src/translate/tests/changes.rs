//! What `--changes` leaves of frames.

use profile_cip::wire::motion::codes::{
    AxisControl, AxisStateCode, FaultType, NodeAlarm, NodeFault, NodeStatus,
};
use profile_cip::wire::motion::{
    ActualHeader, ActualInstance, ActualPosition, ActualValues, ActualWriter, FaultRecord, StatusValues,
};

use super::*;

/// A list of frames of which only what has changed is shown.
struct Changes {
    translator: Translator,
    filter: Filter,
    number: usize,
}

impl Changes {
    fn new() -> Self {
        Self::of(translator())
    }

    fn of(translator: Translator) -> Self {
        Self { translator, filter: Filter::new(0, Vec::new(), None, true), number: 0 }
    }

    fn shown(&mut self, translated: Result<Node, TranslateError>) -> Option<Node> {
        self.number += 1;
        let entry = Entry::of(Place::line(self.number), format!("line {}", self.number), translated);
        self.filter.apply(entry).map(|entry| entry.tree)
    }

    fn frame(&mut self, bytes: &[u8]) -> Option<Node> {
        let translated = self.translator.frame(bytes);
        self.shown(translated)
    }

    fn line(&mut self, line: &str) -> Option<Node> {
        let translated = self.translator.line(&Line::parse(line).unwrap().unwrap());
        self.shown(translated)
    }
}

/// How many values of this name a frame shows.
fn values(shown: Option<&Node>, name: &str) -> usize {
    let mut count = 0;
    if let Some(tree) = shown {
        tree.walk(&mut |node| count += node.facts.iter().filter(|fact| fact.what.name() == name).count());
    }
    count
}

#[test]
fn a_request_that_is_taken_back_is_shown_and_so_is_the_next_one() {
    let mut changes = Changes::new();
    let ask = |axis_control| update(CommandBlock { axis_control, ..position(0) });
    let requests = [AxisControl::ENABLE, AxisControl::NONE, AxisControl::NONE, AxisControl::ENABLE];
    let shown = requests.map(|request| changes.frame(&ask(request)));
    assert_eq!(shown.each_ref().map(|one| values(one.as_ref(), "request")), [1, 1, 0, 1]);
    let [_, taken_back, same, _] = shown.map(|one| one.as_ref().map(text).unwrap_or_default());
    assert!(taken_back.contains("Axis Control: No Request"), "{taken_back}");
    assert!(!same.contains("Axis Control"), "{same}");
}

#[test]
fn the_end_of_a_status_is_shown_and_so_is_the_next_one() {
    let mut changes = Changes::of(Translator::new(can::stage()));
    let shown = ["3716", "4002", "4002", "3716"].map(|status| {
        let shown = changes.line(&format!("at drive-c {status}08{}", "00".repeat(10)));
        values(shown.as_ref(), "status")
    });
    assert_eq!(shown, [1, 1, 0, 1]);
}

/// A drive leaves operation, is reset and enabled, and leaves it again.
#[test]
fn the_end_of_a_fault_is_shown_and_so_is_the_same_fault_again() {
    let mut changes = Changes::new();
    let ask = |axis_control| update(CommandBlock { axis_control, ..position(250_000) });
    let at = |changes: &mut Changes, status| {
        let shown = changes.line(&format!("at drive-a {status}20a107{}", "00".repeat(7)));
        values(shown.as_ref(), "fault")
    };
    let (ready, running, lost) = ("0880", "08c0", "0000");
    assert_eq!([running, lost, ready].map(|status| at(&mut changes, status)), [0, 1, 0]);
    let reset = changes.frame(&ask(AxisControl::FAULT_RESET));
    assert_eq!(values(reset.as_ref(), "fault"), 1, "{reset:?}");
    assert_eq!(at(&mut changes, ready), 0);
    for request in [AxisControl::NONE, AxisControl::ENABLE] {
        let shown = changes.frame(&ask(request));
        assert_eq!(values(shown.as_ref(), "fault"), 0, "{shown:?}");
    }
    assert_eq!([running, lost].map(|status| at(&mut changes, status)), [0, 1]);
}

#[test]
fn an_update_of_which_only_the_status_has_changed_is_shown() {
    let actual = |update_id: u8, fault| {
        let header = ActualHeader {
            update_id,
            node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID,
            instance_count: 1,
            node_fault: NodeFault(0),
            node_alarm: NodeAlarm(0),
            last_received_id: update_id,
            time_stamp: None,
            time_offset: None,
            update_diagnostics: None,
            time_diagnostics: None,
        };
        let cyclic = ActualBlock {
            axis_state: AxisStateCode::MAJOR_FAULTED,
            actual: ActualValues { position: Some(ActualPosition::Dint(5)), ..ActualValues::default() },
            status: StatusValues { fault, ..StatusValues::default() },
            ..ActualBlock::default()
        };
        let mut bytes = [0; 200];
        let mut writer = ActualWriter::new(&mut bytes, &header).unwrap();
        let instance = ActualInstance { number: 1, cyclic: Some(cyclic), ..ActualInstance::default() };
        writer.instance(&instance).unwrap();
        let len = writer.finish();
        bytes[..len].to_vec()
    };
    let fault = |code| Some(FaultRecord { fault_type: FaultType::AXIS, code, ..FaultRecord::default() });
    let mut changes = Changes::new();
    let faults = [None, fault(34), fault(34), fault(35)];
    let shown = [1, 2, 3, 4].map(|id| {
        let shown = changes.frame(&actual(id, faults[usize::from(id) - 1]));
        shown.as_ref().map(text).unwrap_or_default()
    });
    assert!(shown[0].contains("Node Fault") && shown[0].contains("Actual Position: 5"), "{}", shown[0]);
    assert!(shown[1].contains("Axis Fault: ") && !shown[1].contains("Actual Position"), "{}", shown[1]);
    assert_eq!(shown[2], "");
    assert!(shown[3].contains("Axis Fault: ") && shown[3].lines().count() < 5, "{}", shown[3]);
}

#[test]
fn lines_without_a_value_are_compared_by_their_names() {
    let mut filter = Filter::new(0, Vec::new(), None, true);
    let mut left = |lines: &[&str]| {
        let mut axis = Node::new("axis slide").about(0);
        lines.iter().for_each(|line| axis.push(Node::new(*line)));
        let tree = Node { children: vec![axis], ..Node::new("frame") };
        let shown = filter.apply(Entry { place: Place::default(), tree });
        shown.map_or(0, |entry| entry.tree.children[0].children.len())
    };
    let on = ["Axis Status 0x00000001: power", "Unwind Cycle Count 1", "Axis State: Running"];
    let off = ["Axis Status 0x00000000: none", "Unwind Cycle Count 1", "Axis State: Running"];
    assert_eq!([left(&on), left(&on), left(&off), left(&on)], [3, 0, 1, 1]);
}
