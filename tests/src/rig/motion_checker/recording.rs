//! The motion checker on a recording of `run --capture`: the updates and the SERCOS frames that were really sent.
//!
//! The frames of the master are played to simulated drives, which have what the real ones had: their phases, their parameters, their
//! set-points. The updates of the controller are those that the gateway has received. Who leads an axis is not in a recording: an axis
//! is judged while the gateway reports it as running in synchronous operation.
//!
//! A recording has the time at which a frame was sent, and not the instant that it was sent for. A frame is never early: the grid of
//! the bus is where the earliest of the last frames are.

use std::collections::VecDeque;
use std::net::Ipv4Addr;
use std::path::Path;

use axisbridge::capture::Side;
use axisbridge::capture::reader::{ReadError, Reader};
use axisbridge::config::{Config, DriveAt};
use axisbridge::simulate::drives::InProcessDrives;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::motion::codes::{AxisStateCode, NodeStatus};
use profile_cip::wire::motion::{ActualFrame, Format};
use profile_generic::cast::f64_from_i64;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::port::Port;
use profile_sercos::wire::header::{FRAME_LEN_MAX, Header};

use super::curve::{Curve, Skew};
use super::follower::{self, Follower, Instant, Leader};
use super::reading::{self, Reading, Scaling};
use super::statistics::Statistics;
use super::violation::{BusKind, Circumstances, Violation};
use super::{NorthScale, value};
use crate::rig::updates::{self, Commanded};

/// Frames whose lateness shows where the grid is.
const FRAMES: usize = 256;

/// The engine makes set-points so long before their frame is sent: updates that come later are in none of them.
const LEAD: DurationNs = DurationNs::from_micros(300);

/// What two clocks that follow the same master may gain on each other in a second, in seconds: each slews by a thousandth at most
/// (clause 2-2.2).
const SLEWS: f64 = 2e-3;

/// What a recording shows.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Set-points that should not have been sent.
    pub violations: Vec<Violation>,
    /// What the set-points of each axis were like.
    pub statistics: Vec<Statistics>,
    /// The longest lateness of a frame.
    pub late: DurationNs,
}

/// One axis with its drive, by its place in the line.
struct Axis {
    instance: u8,
    place: usize,
    scale: NorthScale,
    limit: Option<f64>,
    runs: bool,
    scaling: Option<Scaling>,
    mark: Option<u64>,
    curve: Curve,
    follower: Follower,
    statistics: Statistics,
}

/// Judges the SERCOS axes in a recording of a box with this configuration, whose controller has this update period. `see` sees first
/// what a drive has: the axis, from 0, the set-points that were judged of it so far, and the reading.
///
/// # Errors
/// The recording cannot be read.
///
/// # Panics
/// Where the configuration has no SERCOS line.
pub fn judge(
    config: &Config,
    period: DurationNs,
    path: &Path,
    mut see: impl FnMut(usize, u64, &mut Reading),
) -> Result<Judged, ReadError> {
    let sercos = config.sercos.as_ref().expect("a box with a SERCOS line");
    let device = config.devices.first().map_or(Ipv4Addr::UNSPECIFIED, |device| device.listen);
    let mut line = InProcessDrives::of(config, sercos, None);
    let mut axes: Vec<Axis> = axes(config);
    let (mut grid, mut synchronous) = (Instants::new(sercos.cycle_time), false);
    let (mut violations, mut late) = (Vec::new(), DurationNs::ZERO);
    let (mut sent, mut begun) = (Sent::default(), None);
    let mut reader = Reader::open(path)?;
    let mut buffer = [0; FRAME_LEN_MAX];
    while let Some(frame) = reader.next_frame()? {
        let Some(at) = frame.at.map(|at| MonotonicTime(at.0)) else { continue };
        let start = *begun.get_or_insert(at);
        match frame.interface_name.and_then(Side::of_name) {
            Some(Side::North) => {
                let Some((to_device, datagram)) = datagram(frame.data, device) else { continue };
                if to_device {
                    let Some(commanded) = updates::read(datagram, Format::Variable, None) else { continue };
                    axes.iter_mut().for_each(|axis| axis.take(at, period, &commanded));
                } else if let Ok(datagram) = Class1Datagram::parse(datagram)
                    && let Ok(update) = ActualFrame::parse(datagram.data)
                {
                    synchronous = update.header().node_status.contains(NodeStatus::SYNC_MODE);
                    for instance in update.instances() {
                        let axis = axes.iter_mut().find(|axis| axis.instance == instance.number);
                        if let (Some(axis), Some(block)) = (axis, &instance.cyclic) {
                            axis.runs = block.axis_state == AxisStateCode::RUNNING;
                        }
                    }
                }
            }
            Some(Side::South(Port::One)) if sent.is_new(frame.data) => {
                let Some(bytes) = buffer.get_mut(..frame.data.len()) else { continue };
                bytes.copy_from_slice(frame.data);
                let network = line.network_mut();
                network.handle_time(at);
                network.send(at, Port::One, bytes, &mut |_, _| {});
                if !Sent::begins_cycle(frame.data) {
                    continue;
                }
                let (cycle, lateness) = grid.sent(at);
                late = late.max(lateness);
                let circumstances = Circumstances { synchronous, late: lateness, ..Circumstances::default() };
                let instant = Instant {
                    at: at - lateness - LEAD,
                    cycle,
                    cycle_time: sercos.cycle_time,
                    skew: Skew { synchronous, offset: DurationNs::ZERO, drift: SLEWS },
                    period,
                    limit: None,
                };
                for (number, axis) in axes.iter_mut().enumerate() {
                    let found = axis.look(line.network_mut(), &instant, |so_far, reading| {
                        see(number, so_far, reading);
                    });
                    violations.extend(found.into_iter().map(|found| {
                        let follower::Finding { rule, value, low, high } = found;
                        Violation {
                            rule,
                            axis: number,
                            bus: BusKind::Sercos,
                            at: at.since(start),
                            cycle,
                            value,
                            low,
                            high,
                            circumstances,
                        }
                    }));
                }
            }
            _ => {}
        }
    }
    let statistics = axes.iter().map(|axis| axis.statistics).collect();
    Ok(Judged { violations, statistics, late })
}

fn axes(config: &Config) -> Vec<Axis> {
    let axes = config.axes.iter().filter_map(|axis| {
        let DriveAt::Sercos { drive } = axis.drive else { return None };
        let position = 1e9 / f64::from(axis.motion_resolution);
        Some(Axis {
            instance: axis.instance,
            place: drive,
            scale: NorthScale { position, velocity: 1e9, torque: 1e4 },
            limit: axis.limits.velocity.map(|limit| f64_from_i64(limit.get())),
            runs: false,
            scaling: None,
            mark: None,
            curve: Curve::default(),
            follower: Follower::default(),
            statistics: Statistics::default(),
        })
    });
    axes.collect()
}

impl Axis {
    /// Takes an update of the controller.
    fn take(&mut self, at: MonotonicTime, period: DurationNs, commanded: &Commanded) {
        let command = commanded.axes.iter().find(|command| command.instance == self.instance);
        let target = command.map_or(0, |command| command.target.0);
        let commands = command.and_then(|command| value(command, None, &self.scale));
        self.curve.sent(at, commanded.id, period, target, commands, None);
        self.curve.taken(at, commanded.id);
    }

    /// Looks at what the drive has now.
    fn look(
        &mut self,
        network: &axisbridge::simulate::drives::DriveNetwork,
        instant: &Instant,
        see: impl FnOnce(u64, &mut Reading),
    ) -> Vec<follower::Finding> {
        let slave = &network.slaves()[self.place];
        if !self.runs {
            // Its scaling is written before it runs.
            self.scaling = reading::sercos_scaling(slave);
        }
        let reading = self.scaling.and_then(|scaling| Some((scaling, reading::sercos(slave, &scaling)?)));
        let Some((scaling, mut reading)) = reading else {
            (self.mark, self.follower) = (None, Follower::default());
            return Vec::new();
        };
        if self.mark.replace(reading.mark) == Some(reading.mark) {
            return Vec::new();
        }
        see(self.statistics.set_points, &mut reading);
        let leads = self.runs && instant.skew.synchronous;
        let leader = if leads { Leader::Controller } else { Leader::Other };
        let instant = Instant { limit: self.limit, ..*instant };
        self.follower.take(&reading, &scaling, leader, &self.curve, &instant, &mut self.statistics)
    }
}

/// The grid of a bus: a frame is late by how much it is behind the earliest ones.
struct Instants {
    cycle: DurationNs,
    /// The first frame, and the number of the last one.
    first: Option<MonotonicTime>,
    number: i64,
    /// How far the last frames were behind a grid through the first one, ns.
    behind: VecDeque<i64>,
}

impl Instants {
    const fn new(cycle: DurationNs) -> Self {
        Self { cycle, first: None, number: 0, behind: VecDeque::new() }
    }

    /// Takes a frame. Gives the number of its cycle, and by how much it is late.
    fn sent(&mut self, at: MonotonicTime) -> (i64, DurationNs) {
        let passed = at.since(*self.first.get_or_insert(at)).0;
        let earliest = self.behind.iter().min().copied().unwrap_or(0);
        let cycle = self.cycle.0.max(1);
        // Clocks read by different threads are some microseconds apart, and the grid may move a little.
        let number = (passed - earliest + cycle / 8).div_euclid(cycle);
        self.number = if self.behind.is_empty() { 0 } else { number.max(self.number + 1) };
        self.behind.push_back(passed - self.number * cycle);
        if self.behind.len() > FRAMES {
            self.behind.pop_front();
        }
        let earliest = self.behind.iter().min().copied().unwrap_or(0);
        (self.number, DurationNs(passed - self.number * cycle - earliest))
    }
}

/// Tells frames that the master sends from those that come back: both are recorded at the same port.
#[derive(Default)]
struct Sent {
    /// The frames that have begun the last cycles and have not come back, the newest last: drives on a host that pauses answer for several
    /// cycles at once.
    out: VecDeque<Vec<u8>>,
    /// That of the last cycle has come back.
    has_returned: bool,
    /// Telegrams of this cycle that were sent, by their type.
    seen: Vec<u8>,
}

impl Sent {
    const TYPE: usize = 14;
    /// Cycles after which a frame that has not come back is lost: a second at 1 ms.
    const OUT_MAX: usize = 1_000;

    /// Whether it is MDT0.
    fn begins_cycle(frame: &[u8]) -> bool {
        Header::parse(frame).is_ok_and(|header| header.telegram.is_mst())
    }

    /// Whether the master sends it now. MDT0 of two cycles differ, as the cycle count does; until it counts, slaves bear one that is
    /// taken for the return of the one before.
    fn is_new(&mut self, frame: &[u8]) -> bool {
        if Self::begins_cycle(frame) {
            if let Some(place) = self.out.iter().position(|out| out == frame) {
                // Those before it are lost.
                self.out.drain(..=place);
                self.has_returned = self.out.is_empty();
                return false;
            }
            if self.out.len() == Self::OUT_MAX {
                self.out.pop_front();
            }
            self.out.push_back(frame.to_vec());
            self.has_returned = false;
            self.seen.clear();
            return true;
        }
        let Some(kind) = frame.get(Self::TYPE) else { return false };
        if self.has_returned || self.seen.contains(kind) {
            return false;
        }
        self.seen.push(*kind);
        true
    }
}

/// The payload of a datagram of a motion connection, and whether it goes to the device.
fn datagram(frame: &[u8], device: Ipv4Addr) -> Option<(bool, &[u8])> {
    const IP: usize = 14;
    let is_udp = frame.get(12..IP)? == [0x08, 0x00] && *frame.get(IP + 9)? == 17;
    let to = frame.get(IP + 16..)?.first_chunk::<4>()?;
    let udp = frame.get(IP + usize::from(frame.get(IP)? & 0x0F) * 4..)?;
    let word = |at: usize| Some(u16::from_be_bytes(*udp.get(at..)?.first_chunk()?));
    if !is_udp || word(2)? != IO_PORT {
        return None;
    }
    Some((Ipv4Addr::from(*to) == device, udp.get(8..usize::from(word(4)?))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_sercos::wire::header::{Channel, Kind, Phase, PhaseField, TelegramType};

    /// An MDT0 or an AT0 with a content.
    fn frame(is_at: bool, content: u8) -> Vec<u8> {
        let mut frame = vec![0; 60];
        let kind = if is_at { Kind::At } else { Kind::Mdt };
        let telegram = TelegramType::new(Channel::Primary, kind, 0);
        let header = Header { source: [2; 6], telegram, phase: PhaseField::new(false, 0, Phase::CP4) };
        header.emit(&mut frame).expect("room");
        frame[59] = content;
        frame
    }

    #[test]
    fn frames_that_come_back_late_are_not_taken_for_sent_ones() {
        let mut sent = Sent::default();
        let mut is_new = |is_at, content| sent.is_new(&frame(is_at, content));
        assert!(is_new(false, 1) && is_new(true, 1), "sent");
        assert!(!is_new(false, 1) && !is_new(true, 9), "and back");
        // Two cycles are sent before anything of them comes back.
        assert!(is_new(false, 2) && is_new(true, 2));
        assert!(is_new(false, 3) && is_new(true, 3));
        assert!(!is_new(false, 2) && !is_new(true, 9), "of the one before");
        assert!(!is_new(false, 3) && !is_new(true, 9));
        // One is lost on its way.
        assert!(is_new(false, 4) && is_new(false, 5));
        assert!(!is_new(false, 5));
        assert!(is_new(false, 6));
        // Until it counts each frame is like the one before.
        assert!(!is_new(false, 6) && is_new(false, 6) && !is_new(false, 6));
    }
}
