//! CP3 and CP4: the slave's parts of the configured telegrams.

use super::configuration::{Configuration, Link};
use super::connection::ConsumerState;
use super::parameter::Store;
use super::phase::State;
use super::{Application, Slave};
use crate::generated::idns::connection;
use crate::wire::connection::{CONNECTION_CONTROL_LEN, ConnectionControl};
use crate::wire::header::{Kind, Phase};
use crate::wire::idn::Idn;
use crate::wire::layout::DEVICE_WORD_LEN;
use crate::wire::svc::SVC_LEN;

impl<A: Application> Slave<A> {
    /// CP4 begins: consumers and producers start anew.
    pub(super) fn start_connections(&mut self) {
        let Some(configuration) = &mut self.core.configuration else { return };
        for link in &mut configuration.links {
            link.consumer.restart();
            link.control = ConnectionControl::empty();
            link.seen = false;
            link.age = 0;
        }
    }

    pub(super) fn cyclic_mdt(&mut self, number: u8, data: &[u8]) {
        let Some(configuration) = &self.core.configuration else { return };
        let (control, svc) = (configuration.device_control, configuration.svc_mdt);
        if control.telegram == number
            && let Some(bytes) = data.get(control.range(DEVICE_WORD_LEN))
        {
            self.handle_device_control(u16::from_le_bytes([bytes[0], bytes[1]]));
        }
        if svc.telegram == number
            && let Some(slot) = data.get(svc.range(SVC_LEN))
        {
            self.handle_svc(slot);
        }
        self.take_connections(Kind::Mdt, number, data);
    }

    /// Reads the consumed connections in a telegram. Those in ATs come when their producer has written them.
    fn take_connections(&mut self, kind: Kind, number: u8, data: &[u8]) {
        let operating = self.core.state == State::In(Phase::CP4);
        let (Some(configuration), true) = (&mut self.core.configuration, operating) else { return };
        let store = &mut self.core.store;
        let links = configuration.links.iter_mut();
        for link in links.filter(|link| !link.producer && !link.seen && link.kind == kind) {
            if link.at.telegram != number {
                continue;
            }
            let Some(bytes) = data.get(link.at.range(link.len())) else { continue };
            let control = ConnectionControl::from_bits_retain(u16::from_le_bytes([bytes[0], bytes[1]]));
            // An AT passes twice; before its producer it is empty.
            if kind == Kind::At && control.is_empty() {
                continue;
            }
            link.seen = true;
            link.fresh = link.consumer.handle(control);
            if link.fresh {
                let mut rest = &bytes[CONNECTION_CONTROL_LEN..];
                for &(handle, len) in &link.values {
                    let (value, after) = rest.split_at(len);
                    store.set_data(handle, value);
                    rest = after;
                }
            }
        }
    }

    /// Closes the cycle of the consumers: what has not come is missing. Returns whether anything new came.
    pub(super) fn consume(&mut self) -> bool {
        let operating = self.core.state == State::In(Phase::CP4);
        let (Some(configuration), true) = (&mut self.core.configuration, operating) else { return false };
        let store = &mut self.core.store;
        let mut fresh = false;
        for link in &mut configuration.links {
            if link.producer {
                link.seen = false;
                continue;
            }
            if !link.seen {
                link.consumer.miss();
            }
            for _ in 0..self.losses {
                // Whole cycles were lost with their MST.
                link.consumer.miss();
            }
            if link.consumer.state() == ConsumerState::Error {
                self.core.connection_failed = true;
            }
            let x = |element| Idn::connection(link.index, element);
            store.set_number_of(x(connection::LOSSES), i64::from(link.consumer.losses_total()));
            store.set_number_of(x(connection::CONTROL), i64::from(link.consumer.control().bits()));
            fresh |= std::mem::take(&mut link.fresh);
            link.seen = false;
        }
        fresh
    }

    /// Whether every consumed connection delivers.
    pub(super) fn consumers_deliver(&self) -> bool {
        let links = self.core.configuration.iter().flat_map(|configuration| &configuration.links);
        links
            .filter(|link| !link.producer)
            .all(|link| matches!(link.consumer.state(), ConsumerState::Consuming | ConsumerState::Warning))
    }

    pub(super) fn cyclic_at(&mut self, number: u8, outward: bool, data: &mut [u8]) {
        self.take_connections(Kind::At, number, data);
        if !outward {
            return;
        }
        let operating = self.core.state == State::In(Phase::CP4);
        let status = self.device_status();
        let answer = self.svc.answer();
        let Some(configuration) = &mut self.core.configuration else { return };
        let Configuration { device_status, svc_at, links, .. } = configuration;
        if device_status.telegram == number
            && let Some(bytes) = data.get_mut(device_status.range(DEVICE_WORD_LEN))
        {
            bytes.copy_from_slice(&status.bits().to_le_bytes());
        }
        if svc_at.telegram == number
            && let Some(slot) = data.get_mut(svc_at.range(SVC_LEN))
        {
            // The slice has the length of a slot, so that writing it cannot fail.
            let _ = answer.emit(slot);
        }
        if !operating {
            return;
        }
        for link in links.iter_mut().filter(|link| link.producer && link.at.telegram == number) {
            if let Some(bytes) = data.get_mut(link.at.range(link.len())) {
                produce(link, &mut self.core.store, bytes);
            }
        }
    }
}

/// Writes a produced connection. A ring's second copy of the telegram gets the same as the first.
fn produce(link: &mut Link, store: &mut Store, bytes: &mut [u8]) {
    if !link.seen {
        link.seen = true;
        if link.age == 0 {
            link.control = link.control.produced();
            let control = i64::from(link.control.bits());
            store.set_number_of(Idn::connection(link.index, connection::CONTROL), control);
        }
        link.age = (link.age + 1) % link.interval;
    }
    bytes[..CONNECTION_CONTROL_LEN].copy_from_slice(&link.control.bits().to_le_bytes());
    let mut at = CONNECTION_CONTROL_LEN;
    for &(handle, len) in &link.values {
        bytes[at..at + len].copy_from_slice(store.get(handle).data());
        at += len;
    }
}
