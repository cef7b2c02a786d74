//! Slaves joined to a network in one process, with cables that can be cut and mended.
//!
//! ```text
//! master port 1 ===cable 0=== slave 0 ===cable 1=== slave 1 ... slave N-1 ===cable N=== master port 2
//! ```
//!
//! Cable k is the one behind k slaves, counted from the master's port 1. A cable has two wires; a station has a
//! link where something can arrive. With cable N open it is a line on port 1, with cable 0 open a line on port 2,
//! with both plugged in a ring, and with one between slaves open a broken ring of two lines.

use profile_generic::time::MonotonicTime;

use super::{Application, Forward, Port, Slave};

/// Longest frame that a network carries.
const FRAME_MAX: usize = 1536;
/// Copies of one frame that are under way at the same time. A frame is copied where a line ends, and a copy comes
/// to the end of at most one more line.
const COPIES_MAX: usize = 4;

/// Slaves that were in no scan are told of by this number and their place in the network: no topology address.
pub const STRANGER: u16 = 512;

/// Is told about a passage: topology address or [`STRANGER`] number, outward, frame before and behind the slave.
pub type Watch<'a> = dyn FnMut(u16, bool, &[u8], &mut [u8]) + 'a;

/// The way of a frame along the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// From the master's port 1 towards its port 2.
    Up,
    /// Back.
    Down,
}

impl Way {
    const fn turned(self) -> Way {
        match self {
            Way::Up => Way::Down,
            Way::Down => Way::Up,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Cable {
    up: bool,
    down: bool,
    /// Both ends have their links, and no frame gets through.
    blocked: bool,
}

impl Cable {
    const WHOLE: Cable = Cable { up: true, down: true, blocked: false };
    const CUT: Cable = Cable { up: false, down: false, blocked: false };

    const fn carries(self, way: Way) -> bool {
        !self.blocked
            && match way {
                Way::Up => self.up,
                Way::Down => self.down,
            }
    }
}

/// How a slave is plugged in.
#[derive(Debug, Clone, Copy)]
struct Place {
    powered: bool,
    /// Its port 2 is the one nearer to the master's port 1.
    turned: bool,
    /// It takes telegrams and passes them on, but writes nothing into them.
    mute: bool,
    /// It is switched on and does nothing: frames end at it.
    hung: bool,
}

impl Place {
    const NEW: Place = Place { powered: true, turned: false, mute: false, hung: false };

    /// It takes frames, and time passes for it.
    const fn works(&self) -> bool {
        self.powered && !self.hung
    }

    /// The port on which a frame comes in on its way.
    const fn entry(&self, way: Way) -> Port {
        match (way, self.turned) {
            (Way::Up, false) | (Way::Down, true) => Port::One,
            (Way::Up, true) | (Way::Down, false) => Port::Two,
        }
    }
}

/// A copy of a frame that waits for its turn.
#[derive(Debug, Clone)]
struct Copied {
    bytes: [u8; FRAME_MAX],
    cable: usize,
    way: Way,
}

/// Slaves and cables between the two ports of a master.
#[derive(Debug)]
pub struct Network<A> {
    slaves: Vec<Slave<A>>,
    places: Vec<Place>,
    cables: Vec<Cable>,
    copies: Vec<Copied>,
    waiting: usize,
}

impl<A: Application> Network<A> {
    /// Slaves in a line on the master's port 1; the first one is next to the master.
    #[must_use]
    pub fn line(slaves: Vec<Slave<A>>) -> Self {
        let mut network = Network::ring(slaves);
        network.cut(network.slaves.len());
        network
    }

    /// Slaves in a closed ring; the first one is next to the master's port 1, the last one next to its port 2.
    #[must_use]
    pub fn ring(slaves: Vec<Slave<A>>) -> Self {
        let copy = Copied { bytes: [0; FRAME_MAX], cable: 0, way: Way::Up };
        let mut network = Network {
            cables: vec![Cable::WHOLE; slaves.len() + 1],
            places: vec![Place::NEW; slaves.len()],
            slaves,
            copies: vec![copy; COPIES_MAX],
            waiting: 0,
        };
        network.update_links();
        network
    }

    /// The slaves, from the master's port 1 on.
    #[must_use]
    pub fn slaves(&self) -> &[Slave<A>] {
        &self.slaves
    }

    /// The slaves, to act on them from outside.
    pub fn slaves_mut(&mut self) -> &mut [Slave<A>] {
        &mut self.slaves
    }

    /// Appends a slave at the end of the line, behind a cable that is cut.
    pub fn append(&mut self, slave: Slave<A>) {
        self.slaves.push(slave);
        self.places.push(Place::NEW);
        self.cables.push(Cable::CUT);
        self.update_links();
    }

    /// Cuts cable `cable`, 0 to the number of slaves. One that does not exist is cut already.
    pub fn cut(&mut self, cable: usize) {
        self.set_cable(cable, false, false);
    }

    /// Mends a cable.
    pub fn mend(&mut self, cable: usize) {
        self.set_cable(cable, true, true);
    }

    /// Sets the two wires of a cable: the one away from the master's port 1, and the one towards it.
    pub fn set_cable(&mut self, cable: usize, up: bool, down: bool) {
        if let Some(place) = self.cables.get_mut(cable) {
            *place = Cable { up, down, ..*place };
        }
        self.update_links();
    }

    /// Makes a cable carry no frames while both its ends keep their links, as a media converter does whose far side is dead; or
    /// lets it carry them again.
    pub fn set_blocked(&mut self, cable: usize, blocked: bool) {
        if let Some(place) = self.cables.get_mut(cable) {
            place.blocked = blocked;
        }
    }

    /// Turns a slave round: what was plugged into port 1 is plugged into port 2.
    pub fn turn(&mut self, index: usize) {
        if let Some(place) = self.places.get_mut(index) {
            place.turned = !place.turned;
        }
        self.update_links();
    }

    /// Switches a slave off or on. Off, it carries no frames and its neighbours have no link; on, it starts in NRT.
    pub fn set_power(&mut self, index: usize, on: bool) {
        if let Some(place) = self.places.get_mut(index) {
            if on && !place.powered {
                self.slaves[index].restart();
            }
            place.powered = on;
        }
        self.update_links();
    }

    /// Makes a slave mute, or lets it speak again. A mute slave takes telegrams and passes them on as its topology says, but
    /// what it writes into them is lost: the master hears nothing of it, and the slaves around it are heard as before.
    pub fn set_mute(&mut self, index: usize, mute: bool) {
        if let Some(place) = self.places.get_mut(index) {
            place.mute = mute;
        }
    }

    /// Whether a slave is mute.
    #[must_use]
    pub fn is_mute(&self, index: usize) -> bool {
        self.places.get(index).is_some_and(|place| place.mute)
    }

    /// Hangs a slave up, or wakes it. A hung slave keeps the links of its neighbours up, passes no frame on and answers none; no
    /// time passes for it. Woken, it is where it was, and finds out by itself how long the master has been silent for it.
    pub fn set_hung(&mut self, index: usize, hung: bool) {
        if let Some(place) = self.places.get_mut(index) {
            place.hung = hung;
        }
    }

    /// Whether a master's port has a link.
    #[must_use]
    pub fn master_link(&self, port: Port) -> bool {
        match port {
            Port::One => self.cables[0].down && self.is_powered(Some(0)),
            Port::Two => {
                self.cables[self.slaves.len()].up && self.is_powered(self.slaves.len().checked_sub(1))
            }
        }
    }

    /// Whether a neighbour is switched on; the master is.
    fn is_powered(&self, index: Option<usize>) -> bool {
        index.and_then(|index| self.places.get(index)).is_none_or(|place| place.powered)
    }

    fn update_links(&mut self) {
        for index in 0..self.slaves.len() {
            let lower = self.cables[index].up && self.is_powered(index.checked_sub(1));
            let upper = self.cables[index + 1].down && self.is_powered(Some(index + 1));
            for (way, link) in [(Way::Up, lower), (Way::Down, upper)] {
                let port = self.places[index].entry(way);
                let slave = &mut self.slaves[index];
                if slave.ports().has_link(port) != link {
                    slave.set_link(port, link);
                }
            }
        }
    }

    /// When [`handle_time`](Self::handle_time) has something to do unless a frame comes before; `None` without
    /// slaves.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.working().map(Slave::wake_at).min()
    }

    fn working(&self) -> impl Iterator<Item = &Slave<A>> {
        self.slaves.iter().zip(&self.places).filter(|(_, place)| place.works()).map(|(slave, _)| slave)
    }

    /// Looks after the time-outs of all slaves.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        for (slave, _) in self.slaves.iter_mut().zip(&self.places).filter(|(_, place)| place.works()) {
            slave.handle_time(now);
        }
    }

    /// Sends a frame from a port of the master. `arrived` gets each copy of it that comes to a port of the master;
    /// there are none where it is lost, and two where the end of a line sends it on to the other port. The frame is
    /// changed as the slaves change it. One longer than 1536 bytes is lost.
    pub fn send(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        arrived: &mut dyn FnMut(Port, &mut [u8]),
    ) {
        self.send_watched(now, port, frame, None, arrived);
    }

    /// The same, and tells about each slave that the frame passes: its topology address (or
    /// [`STRANGER`] number), whether this is the way on which slaves write, and the frame before and behind it, where it
    /// may be changed.
    pub fn send_watched(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        mut watch: Option<&mut Watch<'_>>,
        arrived: &mut dyn FnMut(Port, &mut [u8]),
    ) {
        let len = frame.len();
        if len > FRAME_MAX {
            return;
        }
        let (cable, way) = match port {
            Port::One => (0, Way::Up),
            Port::Two => (self.slaves.len(), Way::Down),
        };
        self.waiting = 0;
        let outward = way;
        self.travel(now, (cable, way), outward, frame, &mut watch, arrived);
        while let Some(last) = self.waiting.checked_sub(1) {
            self.waiting = last;
            let Copied { mut bytes, cable, way } = self.copies[last];
            self.travel(now, (cable, way), outward, &mut bytes[..len], &mut watch, arrived);
        }
    }

    /// Sends a frame from the master's port 1 and gives what comes back there in its place. Returns whether
    /// something did.
    pub fn round_trip(&mut self, now: MonotonicTime, frame: &mut [u8]) -> bool {
        let mut back = None;
        self.send(now, Port::One, frame, &mut |port, frame| {
            if port == Port::One {
                let mut bytes = [0; FRAME_MAX];
                bytes[..frame.len()].copy_from_slice(frame);
                back = Some(bytes);
            }
        });
        if let Some(bytes) = &back {
            frame.copy_from_slice(&bytes[..frame.len()]);
        }
        back.is_some()
    }

    /// Moves a frame on until it is at a port of the master or lost.
    fn travel(
        &mut self,
        now: MonotonicTime,
        (mut cable, mut way): (usize, Way),
        outward: Way,
        frame: &mut [u8],
        watch: &mut Option<&mut Watch<'_>>,
        arrived: &mut dyn FnMut(Port, &mut [u8]),
    ) {
        let mut before = [0; FRAME_MAX];
        // A frame passes each slave twice at most; more would be a loop.
        for _ in 0..=2 * self.slaves.len() {
            if !self.cables[cable].carries(way) {
                return;
            }
            let (index, next) = match way {
                Way::Up if cable == self.slaves.len() => return arrived(Port::Two, frame),
                Way::Up => (cable, cable + 1),
                Way::Down if cable == 0 => return arrived(Port::One, frame),
                Way::Down => (cable - 1, cable - 1),
            };
            let place = self.places[index];
            if !place.works() {
                return;
            }
            if watch.is_some() || place.mute {
                before[..frame.len()].copy_from_slice(frame);
            }
            let slave = &mut self.slaves[index];
            let forward = slave.handle_frame(now, place.entry(way), frame);
            if place.mute {
                frame.copy_from_slice(&before[..frame.len()]);
            }
            if let Some(watch) = watch {
                let number = match slave.topology_address() {
                    0 => STRANGER + u16::try_from(index).unwrap_or(0),
                    address => address,
                };
                watch(number, way == outward, &before[..frame.len()], frame);
            }
            match forward {
                Forward::Through => cable = next,
                Forward::Back => way = way.turned(),
                Forward::BackAndThrough => {
                    self.keep_copy(next, way, frame);
                    way = way.turned();
                }
                Forward::Nowhere => return,
            }
        }
    }

    /// Keeps a copy of a frame that goes on from here, to be moved later.
    fn keep_copy(&mut self, cable: usize, way: Way, frame: &[u8]) {
        if let Some(copy) = self.copies.get_mut(self.waiting) {
            copy.bytes[..frame.len()].copy_from_slice(frame);
            (copy.cable, copy.way) = (cable, way);
            self.waiting += 1;
        }
    }
}
