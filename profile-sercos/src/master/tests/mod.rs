//! The master in virtual time against a line of scripted slaves.

mod peer;

use std::fmt::Write as _;

use profile_generic::time::{DurationNs, MonotonicTime};

use crate::checker::bus::VirtualBus;

use self::peer::Line;
use super::config::{ConnectionConfig, MasterConfig, SlaveConfig};
use super::connection::ConsumerState;
use super::event::{Event, Output, Port, Refusal, SlaveId};
use super::phase::State;
use super::station::Presence;
use super::svc::request::{SvcFailure, SvcRequest};
use super::{CallError, SubmitError};
use crate::wire::header::{HEADER_LEN, MacAddress, Phase};
use crate::wire::idn::Idn;

const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

/// A slave with the recording's connections: MDT {134, 36}, AT {135, 40, 51}.
fn slave(address: u16) -> SlaveConfig {
    let idns = |numbers: &[u16]| numbers.iter().map(|&n| Idn::standard(n)).collect::<Vec<_>>();
    let connections = [
        ConnectionConfig::new(0, false, &idns(&[134, 36])).unwrap(),
        ConnectionConfig::new(1, true, &idns(&[135, 40, 51])).unwrap(),
    ];
    SlaveConfig { address, connections: connections.into_iter().collect(), hot_plug: None }
}

fn config(addresses: &[u16]) -> MasterConfig {
    MasterConfig {
        slaves: addresses.iter().map(|&address| slave(address)).collect(),
        stable_cycles: 10,
        ..MasterConfig::new(MAC, 1_000_000)
    }
}

type Rig = VirtualBus<Line>;

impl Rig {
    fn of(addresses: &[u16]) -> Rig {
        Rig::with(config(addresses), addresses)
    }

    fn with(config: MasterConfig, addresses: &[u16]) -> Rig {
        VirtualBus::new(config, Line::new(addresses)).unwrap()
    }

    /// Runs until the result of a request is there.
    fn result(&mut self, slave: u16, request: SvcRequest) -> Result<Option<u64>, SvcFailure> {
        let outcome = self.request(SlaveId(slave), request);
        outcome.result.map(|_| outcome.data.unsigned())
    }
}

mod bad_input;
mod disturbance;
mod faults;
mod foreign;
mod full_slaves;
mod hot_plug;
mod isolation;
mod phase_up;
mod recording;
mod ring;
mod service;
mod timing;
