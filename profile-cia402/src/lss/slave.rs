//! The device's end.
//!
//! ```text
//! Waiting --switch state global: configuration--------------> Configuration
//!         --all four numbers of the address selected--------->
//!         --fastscan of all four numbers, without a node-id-->
//! Configuration --switch state global: waiting--------------> Waiting
//! ```

use core::fmt;

use arrayvec::ArrayVec;

use crate::wire::lss::{
    BitTiming, FASTSCAN_CONFIRM, IdentifyPart, LSS_LEN, LssAddress, LssError, LssMode, LssRequest,
    LssResponse, Part, UNCONFIGURED,
};
use crate::wire::{Error, NodeId};

/// Entries of the table of bit rates.
pub const BIT_TIMINGS_MAX: usize = 10;

/// What a device is to LSS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlaveConfig {
    /// Its identity.
    pub address: LssAddress,
    /// Its node-id; `None` when it has none.
    pub node: Option<NodeId>,
    /// Bit rates that it can.
    pub bit_timings: ArrayVec<BitTiming, BIT_TIMINGS_MAX>,
    /// Whether it can keep its settings.
    pub storable: bool,
}

/// State of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SlaveState {
    /// Waits to be meant.
    Waiting,
    /// Is meant: can be asked and set.
    Configuration,
}

/// What the device has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SlaveEvent {
    /// Take this node-id at the next reset of the communication; at once, if it has none. `None` takes it away.
    NodeId(Option<NodeId>),
    /// Silence for one delay, change the bit rate, silence for another delay.
    Activate {
        /// The bit rate that was set; `None` when none was: only be silent.
        timing: Option<BitTiming>,
        /// Milliseconds.
        delay_ms: u16,
    },
    /// Keep these for the next power-on.
    Store {
        /// Node-id.
        node: Option<NodeId>,
        /// Bit rate, where one was set.
        timing: Option<BitTiming>,
    },
}

/// The device's end of LSS.
#[derive(Debug, Clone)]
pub struct Slave {
    config: SlaveConfig,
    state: SlaveState,
    /// The node-id that was set in this configuration.
    node: Option<NodeId>,
    timing: Option<BitTiming>,
    /// Numbers of the address that have been selected in order.
    selected: usize,
    /// Identification: parts that fitted in order.
    identified: usize,
    /// The part that the fastscan compares.
    scanning: usize,
    answer: Option<LssResponse>,
}

impl Slave {
    /// A device that waits.
    #[must_use]
    pub fn new(config: SlaveConfig) -> Self {
        Self {
            state: SlaveState::Waiting,
            node: config.node,
            timing: None,
            selected: 0,
            identified: 0,
            scanning: 0,
            answer: None,
            config,
        }
    }

    /// The device's state.
    #[must_use]
    pub fn state(&self) -> SlaveState {
        self.state
    }

    /// The node-id that was set last; it counts from the next reset of the communication on.
    #[must_use]
    pub fn node(&self) -> Option<NodeId> {
        self.node
    }

    /// The communication has been reset: the node-id that was set is the device's.
    pub fn reset(&mut self) {
        let config = SlaveConfig { node: self.node, ..self.config.clone() };
        *self = Self { timing: self.timing, ..Self::new(config) };
    }

    /// The answer to the last request.
    pub fn poll(&mut self) -> Option<[u8; LSS_LEN]> {
        self.answer.take().map(|answer| answer.emit())
    }

    /// Takes a request.
    ///
    /// # Errors
    /// [`Error`] when it is none. Nothing changes.
    pub fn handle(&mut self, data: &[u8]) -> Result<Option<SlaveEvent>, Error> {
        let request = LssRequest::parse(data)?;
        self.answer = None;
        Ok(match self.state {
            SlaveState::Waiting => {
                self.waiting(request);
                None
            }
            SlaveState::Configuration => self.configuration(request),
        })
    }

    fn enter(&mut self, state: SlaveState) {
        self.state = state;
        (self.selected, self.identified, self.scanning) = (0, 0, 0);
    }

    fn waiting(&mut self, request: LssRequest) {
        match request {
            LssRequest::SwitchGlobal(LssMode::CONFIGURATION) => self.enter(SlaveState::Configuration),
            LssRequest::SwitchSelective(part, number) => {
                let fits = self.config.address.part(part) == number;
                self.selected = match (fits, part.index()) {
                    (true, place) if place == 0 || place == self.selected => place + 1,
                    _ => 0,
                };
                if self.selected == Part::ALL.len() {
                    self.enter(SlaveState::Configuration);
                    self.answer = Some(LssResponse::Selected);
                }
            }
            LssRequest::Identify(part, number) => self.identify(part, number),
            LssRequest::IdentifyUnconfigured if self.config.node.is_none() => {
                self.answer = Some(LssResponse::Unconfigured);
            }
            LssRequest::Fastscan { number, bit_check, sub, next } if self.config.node.is_none() => {
                self.fastscan(number, bit_check, sub, next);
            }
            _ => {}
        }
    }

    fn identify(&mut self, part: IdentifyPart, number: u32) {
        let [vendor, product, revision, serial] = self.config.address.0;
        let fits = match part {
            IdentifyPart::Vendor => number == vendor,
            IdentifyPart::Product => number == product,
            IdentifyPart::RevisionLow => number <= revision,
            IdentifyPart::RevisionHigh => number >= revision,
            IdentifyPart::SerialLow => number <= serial,
            IdentifyPart::SerialHigh => number >= serial,
        };
        let place = part as usize;
        let in_order = place == 0 || place == self.identified;
        self.identified = if fits && in_order { place + 1 } else { 0 };
        if self.identified == IdentifyPart::ALL.len() {
            self.identified = 0;
            self.answer = Some(LssResponse::Identified);
        }
    }

    /// A device answers as long as the bits above those not compared yet are its own. When all bits of its serial number are,
    /// the scan has found it.
    fn fastscan(&mut self, number: u32, bit_check: u8, sub: u8, next: u8) {
        if bit_check == FASTSCAN_CONFIRM {
            self.scanning = 0;
            self.answer = Some(LssResponse::Identified);
            return;
        }
        let (sub, next) = (usize::from(sub), usize::from(next));
        let Some(&own) = self.config.address.0.get(sub) else { return };
        let compared = u32::MAX.checked_shl(u32::from(bit_check)).unwrap_or_default();
        if sub != self.scanning || next > 3 || bit_check > 31 || (own ^ number) & compared != 0 {
            return;
        }
        self.answer = Some(LssResponse::Identified);
        self.scanning = next;
        if bit_check == 0 && next < sub {
            self.enter(SlaveState::Configuration);
        }
    }

    fn configuration(&mut self, request: LssRequest) -> Option<SlaveEvent> {
        let result = |error| (error, 0);
        match request {
            LssRequest::SwitchGlobal(LssMode::WAITING) => {
                self.enter(SlaveState::Waiting);
                let changed = self.node != self.config.node;
                return changed.then_some(SlaveEvent::NodeId(self.node));
            }
            LssRequest::NodeId(number) => {
                let node = NodeId::new(number);
                let good = node.is_ok() || number == UNCONFIGURED;
                let (error, specific) = result(if good { LssError::OK } else { LssError::REFUSED });
                if good {
                    self.node = node.ok();
                }
                self.answer = Some(LssResponse::NodeId { error, specific });
            }
            LssRequest::BitTiming { table, entry } => {
                let good = table == 0 && self.config.bit_timings.contains(&entry);
                let (error, specific) = result(if good { LssError::OK } else { LssError::REFUSED });
                if good {
                    self.timing = Some(entry);
                }
                self.answer = Some(LssResponse::BitTiming { error, specific });
            }
            LssRequest::ActivateBitTiming { delay_ms } => {
                return Some(SlaveEvent::Activate { timing: self.timing, delay_ms });
            }
            LssRequest::Store => {
                let storable = self.config.storable;
                let (error, specific) = result(if storable { LssError::OK } else { LssError::REFUSED });
                self.answer = Some(LssResponse::Store { error, specific });
                return storable.then_some(SlaveEvent::Store { node: self.node, timing: self.timing });
            }
            LssRequest::Inquire(part) => {
                self.answer = Some(LssResponse::Inquired(part, self.config.address.part(part)));
            }
            LssRequest::InquireNodeId => {
                let node = self.config.node.map_or(UNCONFIGURED, NodeId::get);
                self.answer = Some(LssResponse::InquiredNodeId(node));
            }
            _ => {}
        }
        None
    }
}

impl fmt::Display for SlaveState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Waiting => "waiting",
            Self::Configuration => "configuration",
        })
    }
}
