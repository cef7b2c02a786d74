//! The instances of the Motion Device Axis Object: the class, which is instance 0, and the axes, from 1.

use super::cyclic_list::Direction;
use super::device::DeviceConfig;
use super::service_channel::ServiceChannel;
use super::slot::Slot;
use crate::device::attribute::class::{self, ClassFacts};
use crate::device::attribute::worker::{AccessOperation, AttributeAccess, AttributeSpace};
use crate::device::attribute::{AttributeStore, AttributeTable, Scope, TableError, id};
use crate::device::axis::Context;
use crate::device::axis::exception::ExceptionActions;
use crate::wire::status::GeneralStatus;

/// The class with its attributes and channel.
struct Class {
    store: AttributeStore,
    service: ServiceChannel,
}

/// Who has waited for an answer of the drive.
pub(super) enum Completed {
    /// A cyclic write list.
    List,
    /// The service channel of this instance.
    Channel(usize),
    /// Neither.
    Nobody,
}

/// Class and axes, with the tables of their attributes.
pub(super) struct Instances {
    class_table: AttributeTable,
    axis_table: AttributeTable,
    class: Class,
    pub slots: Vec<Slot>,
    /// Last ticket given out for an access to an attribute that lives in a drive.
    tickets: u32,
}

impl Instances {
    pub fn new(config: &DeviceConfig) -> Result<Self, TableError> {
        let axis_table = AttributeTable::new(Scope::Instance, &config.attributes)?;
        let facts = ClassFacts {
            axes: config.axes.len(),
            axis_table: &axis_table,
            supports_sync: config.supports_sync,
            sync_threshold: config.sync_threshold,
        };
        let class_table = AttributeTable::new(Scope::Class, &class::complete(&config.attributes, &facts))?;
        let class = Class { store: AttributeStore::new(&class_table), service: ServiceChannel::default() };
        let slots = config.axes.iter().map(|axis| Slot::new(*axis, &axis_table)).collect();
        Ok(Self { class_table, axis_table, class, slots, tickets: 0 })
    }

    /// Number of axes, which is the number of the last instance.
    pub fn axis_count(&self) -> usize {
        self.slots.len()
    }

    pub fn table(&self, scope: Scope) -> &AttributeTable {
        match scope {
            Scope::Class => &self.class_table,
            Scope::Instance => &self.axis_table,
        }
    }

    /// The axis with this instance number, and the table of its attributes.
    pub fn axis(&mut self, instance: usize) -> Option<(&mut Slot, &AttributeTable)> {
        Some((self.slots.get_mut(instance.checked_sub(1)?)?, &self.axis_table))
    }

    pub fn channel(&mut self, instance: usize) -> Option<&mut ServiceChannel> {
        match instance.checked_sub(1) {
            None => Some(&mut self.class.service),
            Some(axis) => self.slots.get_mut(axis).map(|slot| &mut slot.service),
        }
    }

    /// What the controller wants done about the exceptions of an axis, counted from 0.
    pub fn exception_actions(&self, axis: usize) -> ExceptionActions<'_> {
        match self.slots.get(axis) {
            Some(slot) => ExceptionActions::of(&self.axis_table, &slot.store),
            None => ExceptionActions::NONE,
        }
    }

    /// The channel of an instance, to look at.
    pub fn channel_of(&self, instance: u8) -> Option<&ServiceChannel> {
        match usize::from(instance).checked_sub(1) {
            None => Some(&self.class.service),
            Some(axis) => self.slots.get(axis).map(|slot| &slot.service),
        }
    }

    /// The channel of an instance and the values that its services work on.
    pub fn service(&mut self, instance: usize) -> Option<(&mut ServiceChannel, AttributeSpace<'_>)> {
        let tickets = &mut self.tickets;
        let Some(axis) = instance.checked_sub(1) else {
            let (table, store) = (&self.class_table, &mut self.class.store);
            let space = AttributeSpace { table, store, instance: 0, running: false, tickets };
            return Some((&mut self.class.service, space));
        };
        let Slot { axis, store, service, .. } = self.slots.get_mut(axis)?;
        let instance = u8::try_from(instance).unwrap_or(u8::MAX);
        let running = axis.is_running();
        Some((service, AttributeSpace { table: &self.axis_table, store, instance, running, tickets }))
    }

    /// Factory defaults and idle channels: a connection begins or ends.
    pub fn start_over(&mut self) {
        self.class.store.reset(&self.class_table);
        self.class.service.reset();
        self.slots.iter_mut().for_each(|slot| slot.start_over(&self.axis_table));
    }

    /// The connection is lost: idle channels, but the attributes stay.
    pub fn lose(&mut self) {
        self.class.service.reset();
        for slot in &mut self.slots {
            slot.axis.lose();
            slot.service.reset();
            slot.drive_values.clear();
        }
    }

    /// The next access to an attribute that lives in a drive.
    pub fn take_access(&mut self) -> Option<AttributeAccess> {
        let Self { slots, class, tickets, .. } = self;
        for worker in slots.iter_mut().map(|slot| &mut slot.service.worker).chain([&mut class.service.worker])
        {
            if let Some(access) = worker.take_access() {
                return Some(access);
            }
        }
        let mut axes = (1..).zip(slots);
        axes.find_map(|(instance, slot)| slot.drive_values.take_access(instance, tickets))
    }

    /// A service has set an attribute that lives in the drive, and that a cyclic write list may have as well.
    pub fn set_by_others(&mut self, access: &AttributeAccess) {
        if let (AccessOperation::Write(_), Some((slot, _))) =
            (&access.operation, self.axis(usize::from(access.instance)))
        {
            slot.drive_values.set_by_others(access.id);
        }
    }

    /// Hands the drive's answer to the cyclic write list or the channel that waits for it. Returns the instance of that channel.
    pub fn complete(&mut self, ticket: u32, answer: Result<&[u8], GeneralStatus>) -> Completed {
        let status = answer.err().unwrap_or(GeneralStatus::SUCCESS);
        if self.slots.iter_mut().any(|slot| slot.drive_values.complete(ticket, status)) {
            return Completed::List;
        }
        let access = (0..=self.slots.len()).find_map(|instance| {
            let (channel, mut space) = self.service(instance)?;
            channel.worker.complete(ticket, answer, &mut space)
        });
        let Some(access) = access else { return Completed::Nobody };
        self.set_by_others(&access);
        Completed::Channel(usize::from(access.instance))
    }

    /// An attribute of the class as a number without sign.
    pub fn class_value(&self, id: u16) -> u64 {
        self.class.store.unsigned(&self.class_table, id).unwrap_or(0)
    }

    /// Largest variation of a synchronized clock that the controller accepts (class attribute 29), ns; `None` where the clock is
    /// not measured.
    pub fn sync_threshold(&self) -> Option<u64> {
        self.class.store.unsigned(&self.class_table, id::SYNC_THRESHOLD)
    }

    pub fn publish_class(&mut self, values: &[(u16, u64)]) {
        for (id, value) in values {
            self.class.store.publish(&self.class_table, *id, *value);
        }
    }

    pub fn publish_axis(&mut self, instance: usize, fixed: bool, context: &Context) {
        if let Some((slot, table)) = self.axis(instance) {
            slot.publish(table, fixed, context);
        }
    }

    /// Missed updates that are a fault (class attribute 21), update periods.
    pub fn high_limit(&self) -> u64 {
        self.class_value(id::UPDATE_DELAY_HIGH_LIMIT)
    }

    /// Missed updates that are an alarm (class attribute 22), update periods.
    pub fn low_limit(&self) -> u64 {
        self.class_value(id::UPDATE_DELAY_LOW_LIMIT)
    }

    /// Step of a system time offset that is compensated at once (class attribute 35), ns.
    pub fn step_threshold(&self) -> i64 {
        i64::try_from(self.class_value(id::STEP_THRESHOLD)).unwrap_or(i64::MAX)
    }

    /// Publishes the value of a stored attribute of an axis, which counts from 0. Access and range do not count.
    pub fn put(&mut self, axis: usize, id: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let slot = self.slots.get_mut(axis).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        let entry = self.axis_table.find(id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        slot.store.put(entry, entry.whole(), value)
    }

    /// The value of an attribute of an axis, which counts from 0, as it is stored in the device.
    pub fn get(&self, axis: usize, id: u16) -> Result<&[u8], GeneralStatus> {
        let slot = self.slots.get(axis).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        let entry = self.axis_table.find(id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        slot.store.get(entry, entry.whole())
    }

    /// Sets which attributes of an axis, which counts from 0, cannot be in cyclic lists of a direction.
    pub fn set_not_cyclic(&mut self, axis: usize, direction: Direction, ids: impl Iterator<Item = u16>) {
        if let Some(slot) = self.slots.get_mut(axis) {
            slot.lists(direction).set_refused(ids);
        }
    }

    /// Publishes the signals of an axis, which counts from 0, that its cyclic read lists hold.
    pub fn publish_signals(
        &mut self,
        axis: usize,
        value: &mut dyn FnMut(u16, &mut [u8; 8]) -> Option<usize>,
    ) {
        if let Some(slot) = self.slots.get_mut(axis) {
            slot.read_lists.publish(&self.axis_table, &mut slot.store, value);
        }
    }
}
