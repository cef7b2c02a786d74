//! What travels on both sides of the gateway, each with its true instant: the updates of the controller and of the gateway as
//! datagrams, and the set-points that a drive has taken from its frames.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge_tests::rig::motion_checker::reading::{self, Reading, Scaling};
use axisbridge_tests::rig::{Rig, SYSTEM_OFFSET};
use profile_cia402::wire::cob_id;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::codes::{AxisStateCode, NodeStatus};
use profile_cip::wire::motion::{ActualFrame, ActualPosition, CommandFrame, CommandPosition};
use profile_generic::cast::{f64_from_i64, i64_from_f64};
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::chain::Bus;

/// Nanounits in a count of the controller: `motion_resolution` of the chains.
pub const COUNT: f64 = 1_000.0;

/// Counts of the controller in a revolution of an axis that turns without end, each of which the updates count.
const UNWIND: f64 = 1_000_000.0;

/// An update of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commanded {
    /// When it was sent.
    pub sent: MonotonicTime,
    /// Its time stamp, in true time; when it was sent, for one without.
    pub stamp: MonotonicTime,
    /// Its Update ID.
    pub id: u8,
    /// Periods from its stamp to its target.
    pub target: u8,
    /// Nanounits.
    pub position: f64,
}

/// An update of the gateway.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reported {
    /// When it was sent.
    pub sent: MonotonicTime,
    /// Its Update ID.
    pub id: u8,
    /// Its time stamp, in true time.
    pub stamp: Option<MonotonicTime>,
    /// Whether Sync Mode is set.
    pub synchronous: bool,
    /// Whether the axis is Running.
    pub running: bool,
    /// Nanounits.
    pub position: f64,
}

/// A set-point of the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// The instant of the bus's grid at which the drive takes it.
    pub at: MonotonicTime,
    /// Nanounits.
    pub position: f64,
}

/// Looks at both sides of the first axis of a rig.
pub struct Probe {
    bus: Bus,
    cycle: DurationNs,
    commanded: Rc<RefCell<Vec<Commanded>>>,
    reported: Rc<RefCell<Vec<Reported>>>,
    /// Set-points in the order in which the drive has taken them.
    pub taken: Vec<Taken>,
    /// Where the drive really was, and when.
    truth: Vec<(MonotonicTime, f64)>,
    scaling: Scaling,
    mark: Option<u64>,
    counts: Option<(i64, i64)>,
}

fn true_time(system: u64) -> MonotonicTime {
    MonotonicTime(system.wrapping_sub(SYSTEM_OFFSET))
}

impl Probe {
    /// Begins to look; the datagrams of both directions are seen as they are sent.
    pub fn new(rig: &mut Rig, bus: Bus, cycle: DurationNs) -> Self {
        let (commanded, reported) = (Rc::default(), Rc::default());
        let scaling = match bus {
            Bus::Sercos => reading::sercos_scaling(&rig.line.slaves()[0]),
            Bus::Canopen => reading::canopen_scaling(node(rig), 0, None),
            Bus::Devicenet => None,
        };
        let probe = Self {
            bus,
            cycle,
            commanded: Rc::clone(&commanded),
            reported: Rc::clone(&reported),
            taken: Vec::new(),
            truth: Vec::new(),
            scaling: scaling.expect("a drive whose scaling can be read"),
            mark: None,
            counts: None,
        };
        let clock = rig.clock();
        rig.tamper_command = Some(Box::new(move |bytes| {
            commanded.borrow_mut().extend(command(bytes.as_slice(), clock.get()));
            true
        }));
        let clock = rig.clock();
        rig.tamper_actual = Some(Box::new(move |bytes| {
            reported.borrow_mut().extend(actual(bytes.as_slice(), clock.get()));
            true
        }));
        probe
    }

    /// Lets the rig go on, and looks.
    pub fn run_for(&mut self, rig: &mut Rig, span: DurationNs) {
        let end = rig.now() + span;
        while rig.now() < end {
            rig.step();
            self.look(rig);
        }
    }

    /// Forgets what was seen.
    pub fn restart(&mut self) {
        self.commanded.borrow_mut().clear();
        self.reported.borrow_mut().clear();
        self.taken.clear();
        self.truth.clear();
    }

    /// Nanounits in a count of the drive.
    pub fn count(&self) -> f64 {
        self.scaling.position.abs()
    }

    /// Updates of the controller.
    pub fn commanded(&self) -> Vec<Commanded> {
        self.commanded.borrow().clone()
    }

    /// Updates of the gateway.
    pub fn reported(&self) -> Vec<Reported> {
        self.reported.borrow().clone()
    }

    fn look(&mut self, rig: &mut Rig) {
        // The drives on it go on only when somebody looks.
        let now = rig.now();
        rig.can.iter_mut().for_each(|wire| wire.bus.advance(now));
        let (reading, sent) = match self.bus {
            Bus::Sercos => (reading::sercos(&rig.line.slaves()[0], &self.scaling), Some(rig.now())),
            Bus::Canopen => {
                let node = node(rig);
                let servo = &node.application().axes()[0];
                (reading::canopen(node, servo, 0, &self.scaling), rig.can[0].sent_at(cob_id::SYNC))
            }
            Bus::Devicenet => (None, None),
        };
        let (Some(reading), Some(sent)) = (reading, sent) else { return };
        let position = f64_from_i64(self.position(rig));
        let news = self.mark.replace(reading.mark) != Some(reading.mark);
        match self.bus {
            // What a node shows between two SYNCs is of its last own millisecond; at the SYNC it takes a sample.
            Bus::Canopen if news => self.truth.push((sent, position)),
            Bus::Canopen => {}
            _ => self.truth.push((now, position)),
        }
        let Reading { follows: Some(point), .. } = reading else { return };
        if !news {
            return;
        }
        let counts = match self.counts {
            Some((raw, whole)) => whole + self.scaling.way(raw, point.counts),
            None => point.counts,
        };
        self.counts = Some((point.counts, counts));
        // What an MDT brings the drive takes at the next one, what an RPDO has brought at the SYNC.
        let at = if self.bus == Bus::Sercos { sent + self.cycle } else { sent };
        self.taken.push(Taken { at, position: f64_from_i64(counts) * self.scaling.position });
    }

    fn position(&self, rig: &Rig) -> i64 {
        match self.bus {
            Bus::Canopen => node(rig).application().axes()[0].actual().position.get(),
            _ => rig.position(0),
        }
    }

    /// When the drive really was at a position; `None` beyond what was seen. For an axis that goes one way.
    pub fn when_at(&self, position: f64) -> Option<MonotonicTime> {
        inverse(&self.truth, position)
    }

    /// The position that the controller's updates lead to at an instant: the polynomial of third order through the last four whose
    /// last two targets are around it (clause 5-2.6.5.2). `None` where not all of them were seen. `period` is the controller's.
    pub fn curve_at(&self, at: MonotonicTime, period: DurationNs) -> Option<f64> {
        let updates = self.commanded.borrow();
        let target = |row: &Commanded| row.stamp + period * i64::from(row.target);
        let last = updates.partition_point(|row| target(row) < at);
        let [p0, p1, p2, p3] = updates.get(last.checked_sub(3)?..=last)? else { return None };
        let s = f64_from_i64(at.since(target(p3)).0) / f64_from_i64(period.0);
        let [p0, p1, p2, p3] = [p0, p1, p2, p3].map(|row| row.position);
        let (d1, d2, d3) = (p3 - p2, p3 - 2.0 * p2 + p1, p3 - 3.0 * p2 + 3.0 * p1 - p0);
        Some(p3 + s * d1 + s * (s + 1.0) / 2.0 * d2 + s * (s + 1.0) * (s + 2.0) / 6.0 * d3)
    }

    /// The time stamp that an update with just this position would have had; `None` beyond those that were seen.
    pub fn stamp_of(&self, position: f64) -> Option<MonotonicTime> {
        let updates: Vec<_> = self.commanded.borrow().iter().map(|row| (row.stamp, row.position)).collect();
        inverse(&updates, position)
    }
}

fn node(rig: &Rig) -> &axisbridge::simulate::can_drive::DriveNode {
    rig.can[0].bus.nodes().next().expect("a drive")
}

/// When a quantity that only grows had this value.
fn inverse(rows: &[(MonotonicTime, f64)], value: f64) -> Option<MonotonicTime> {
    let next = rows.partition_point(|(_, known)| *known < value);
    let ((before, low), (after, high)) = (*rows.get(next.checked_sub(1)?)?, *rows.get(next)?);
    let part = (value - low) / (high - low);
    Some(before + DurationNs(i64_from_f64((part * f64_from_i64(after.since(before).0)).round())))
}

fn command(bytes: &[u8], sent: MonotonicTime) -> Option<Commanded> {
    let datagram = Class1Datagram::parse(bytes).ok()?;
    let frame = CommandFrame::parse(datagram.data).ok()?;
    let block = frame.instances().find_map(|instance| instance.cyclic)?;
    let position = match block.values.position? {
        CommandPosition::Float(counts) => counts,
        CommandPosition::Integer(counts) => f64::from(counts),
    };
    let position = position + block.values.unwind_count.map_or(0.0, f64::from) * UNWIND;
    let stamp = frame.header().time_stamp.map_or(sent, true_time);
    let id = frame.header().update_id;
    Some(Commanded { sent, stamp, id, target: block.target.0, position: position * COUNT })
}

fn actual(bytes: &[u8], sent: MonotonicTime) -> Option<Reported> {
    let datagram = Class1Datagram::parse(bytes).ok()?;
    let frame = ActualFrame::parse(datagram.data).ok()?;
    let header = *frame.header();
    let block = frame.instances().find_map(|instance| instance.cyclic)?;
    let position = match block.actual.position? {
        ActualPosition::Dint(counts) => f64::from(counts),
        ActualPosition::Lint(counts) => f64_from_i64(counts),
    };
    let position = position + block.actual.unwind_count.map_or(0.0, f64::from) * UNWIND;
    Some(Reported {
        sent,
        id: header.update_id,
        stamp: header.time_stamp.map(true_time),
        synchronous: header.node_status.contains(NodeStatus::SYNC_MODE),
        running: block.axis_state == AxisStateCode::RUNNING,
        position: position * COUNT,
    })
}
