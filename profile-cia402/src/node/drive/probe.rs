//! Touch probes: objects 60B8h to 60BDh, counters 60D5h to 60D8h. The edges for homing come from here, too.

use profile_generic::capture::{CaptureEdge, CaptureRequest, CaptureSource, CaptureStatus};
use profile_generic::servo::Servo;

use super::scaling::Scales;
use crate::drive::index;
use crate::drive::probe::{self, ProbeFunction, ProbeStatus};
use crate::node::dictionary::Dictionary;

/// Objects of the positions and the counters, by probe and edge.
const POSITIONS: [[u16; 2]; 2] =
    [[index::PROBE_1_RISING, index::PROBE_1_FALLING], [index::PROBE_2_RISING, index::PROBE_2_FALLING]];
const COUNTERS: [[u16; 2]; 2] = [
    [index::PROBE_1_RISING_COUNTER, index::PROBE_1_FALLING_COUNTER],
    [index::PROBE_2_RISING_COUNTER, index::PROBE_2_FALLING_COUNTER],
];

/// What passed since the last step, for homing: places in nanounits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Passed {
    /// The home switch closed.
    pub closed: Option<i64>,
    /// The home switch opened.
    pub opened: Option<i64>,
    /// An index pulse began.
    pub index: Option<i64>,
}

/// State of both probes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Probes {
    functions: [ProbeFunction; 2],
    states: [ProbeStatus; 2],
}

impl Probes {
    /// Lets the servo capture every edge; which of them count is decided here.
    pub fn new(servo: &mut Servo) -> Self {
        let sources = [
            CaptureSource::Registration1,
            CaptureSource::Registration2,
            CaptureSource::HomeSwitch,
            CaptureSource::Marker,
        ];
        for source in sources {
            for edge in CaptureEdge::ALL {
                servo.capture(CaptureRequest { auto_rearm: true, ..CaptureRequest::arm(0, source, *edge) });
            }
        }
        Self::default()
    }

    /// Takes 60B8h over: a rising enable begins anew, a falling one ends.
    pub fn command(&mut self, offset: u16, dictionary: &mut Dictionary) {
        let word = u16::try_from(dictionary.number(index::PROBE_FUNCTION + offset, 0)).unwrap_or_default();
        for (probe, function) in probe::functions(word).into_iter().enumerate() {
            let was = self.functions[probe].contains(ProbeFunction::ENABLE);
            match (was, function.contains(ProbeFunction::ENABLE)) {
                // What changes while it is enabled does not count.
                (true, true) => {}
                (false, true) => {
                    self.functions[probe] = function;
                    self.states[probe] = ProbeStatus::ENABLED;
                }
                (_, false) => {
                    self.functions[probe] = function;
                    self.states[probe] = ProbeStatus::empty();
                }
            }
        }
        self.publish(offset, dictionary);
    }

    fn publish(&self, offset: u16, dictionary: &mut Dictionary) {
        dictionary.set(index::PROBE_STATUS + offset, 0, i64::from(probe::status_word(self.states)));
    }

    /// Takes what the servo has captured.
    pub fn collect(
        &mut self,
        servo: &mut Servo,
        scales: &Scales,
        offset: u16,
        dictionary: &mut Dictionary,
    ) -> Passed {
        let mut passed = Passed::default();
        while let Some(result) = servo.poll_capture() {
            if result.status != CaptureStatus::Captured {
                continue;
            }
            let rising = result.edge == CaptureEdge::Positive;
            match result.source {
                CaptureSource::HomeSwitch if rising => passed.closed = Some(result.position.0),
                CaptureSource::HomeSwitch => passed.opened = Some(result.position.0),
                CaptureSource::Marker if rising => passed.index = Some(result.position.0),
                _ => {}
            }
            let place = scales.position_object(result.position.0);
            for probe in 0..2 {
                let function = self.functions[probe];
                let source = match (function.contains(ProbeFunction::INDEX_PULSE), probe) {
                    (true, _) => CaptureSource::Marker,
                    (false, 0) => CaptureSource::Registration1,
                    (false, _) => CaptureSource::Registration2,
                };
                let (edge, wanted, stored) = if rising {
                    (0, ProbeFunction::RISING, ProbeStatus::RISING_STORED)
                } else {
                    (1, ProbeFunction::FALLING, ProbeStatus::FALLING_STORED)
                };
                let open = function.contains(ProbeFunction::ENABLE | wanted)
                    && (function.contains(ProbeFunction::CONTINUOUS) || !self.states[probe].contains(stored));
                if source == result.source && open {
                    self.states[probe] |= stored;
                    dictionary.set(POSITIONS[probe][edge] + offset, 0, place);
                    let counter = COUNTERS[probe][edge] + offset;
                    dictionary.set(counter, 0, (dictionary.number(counter, 0) + 1) & 0xFFFF);
                }
            }
        }
        self.publish(offset, dictionary);
        passed
    }
}
