//! What the drive tells: feedback values, status words, travel limits, diagnosis.

use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::quantity::Position;
use profile_generic::scaling::UnitKind;
use profile_generic::state::Report;

use super::parameters::{DC_BUS_CURRENT, DC_BUS_POWER, MOTOR_SHUT_DOWN_TEMPERATURE};
use super::{Drive, control, fault, scaling};
use crate::slave::application::{Cycle, Diagnosis};
use crate::slave::parameter::Store;
use crate::slave::phase::State;
use crate::wire::drive_words::{DriveStatus, ReadyState};
use crate::wire::header::Phase;
use crate::wire::idn::Idn;

/// Distance of motor temperature and overload to their limits at which the drive warns.
const TEMPERATURE_MARGIN_MILLIDEGREE: i64 = 10_000;
/// Part of the overload model, ppm, at which the drive warns.
const OVERLOAD_WARNING_PPM: i64 = 900_000;

impl Drive {
    /// Travel limits S-0-0049 and S-0-0050, where S-0-0055 bit 4 enables them.
    pub(super) fn watch_travel(&mut self, store: &Store) {
        const ENABLED: i64 = 1 << 4;
        let position = self.scales.position.counts(self.actual.position.0);
        let enabled = store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & ENABLED != 0;
        let beyond = [
            (
                FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE,
                position > store.number_of(Idn::POSITIVE_POSITION_LIMIT),
            ),
            (
                FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE,
                position < store.number_of(Idn::NEGATIVE_POSITION_LIMIT),
            ),
        ];
        for (cause, beyond) in beyond {
            if enabled && beyond { self.servo.raise_fault(cause) } else { self.servo.clear_fault(cause) }
        }
    }

    /// Feedback values and status words into the store.
    pub(super) fn publish(&self, cycle: &Cycle, store: &mut Store) {
        let actual = &self.actual;
        let number = |store: &Store, idn| store.number_of(idn);
        let sign = |store: &Store, idn, bit: i64| if number(store, idn) & 1 << bit == 0 { 1 } else { -1 };
        let active = if control::is_by_load(self.mode.code) { 3 } else { 2 };
        for (idn, bit, slip) in [
            (Idn::POSITION_FEEDBACK_VALUE_1, 2, 0),
            (Idn::POSITION_FEEDBACK_VALUE_2, 3, self.slip),
            (Idn::ACTIVE_POSITION_FEEDBACK, active, self.loop_slip()),
        ] {
            let counts = self.scales.position.counts(actual.position.0.saturating_add(slip));
            let polarity = sign(store, Idn::POSITION_POLARITY_PARAMETERS, bit);
            store.set_number_of(idn, self.scales.fold(polarity * counts));
        }
        let following = self.scales.position.counts(actual.following_error.0);
        store.set_number_of(Idn::FOLLOWING_DISTANCE, following);
        for (idn, bit) in [(Idn::VELOCITY_FEEDBACK_VALUE_1, 2), (Idn::standard(156), 3)] {
            let polarity = sign(store, Idn::VELOCITY_POLARITY_PARAMETER, bit);
            store.set_number_of(idn, polarity * self.scales.velocity.counts(actual.velocity.0));
        }
        let polarity = sign(store, Idn::TORQUE_POLARITY_PARAMETER, 2);
        store.set_number_of(Idn::TORQUE_FEEDBACK, polarity * self.scales.torque.counts(actual.torque.0));
        store.set_number_of(Idn::DC_BUS_VOLTAGE, actual.bus_voltage.0 / 1_000_000);
        let motor = scaling::temperature(store, actual.temperature.0);
        store.set_number_of(Idn::MOTOR_TEMPERATURE, motor);
        let shut_down = self.servo.parameters().max_temperature.0;
        store.set_number_of(MOTOR_SHUT_DOWN_TEMPERATURE, scaling::temperature(store, shut_down));
        let (power, current) = self.bus_load();
        store.set_number_of(DC_BUS_POWER, power);
        store.set_number_of(DC_BUS_CURRENT, current);
        // The amplifier warms half as much as the motor; it is always in the unit of element 4.
        let ambient = self.servo.parameters().ambient_temperature;
        store.set_number_of(Idn::AMPLIFIER_TEMPERATURE, (actual.temperature.0 + ambient.0) / 200);
        store.set_number_of(Idn::POSITION_FEEDBACK_VALUE_STATUS, i64::from(self.referenced));
        store.set_number_of(Idn::CLASS_3_DIAGNOSTIC, i64::from(self.class_3(store)));
        let errors = self.diagnose().errors;
        let manufacturer = errors & 1 << fault::MANUFACTURER != 0;
        store.set_number_of(Idn::MANUFACTURER_CLASS_1_DIAGNOSTIC, i64::from(manufacturer));
        if self.actual.fault == Some(FaultCause::ILLEGAL_MODE) {
            const UNDEFINED_MODE: i64 = 1 << 9;
            let status = store.number_of(Idn::INTERFACE_STATUS);
            store.set_number_of(Idn::INTERFACE_STATUS, status | UNDEFINED_MODE);
        }
        store.set_number_of(Idn::DRIVE_STATUS, i64::from(self.status(cycle).bits()));
    }

    /// Power taken from the DC bus in W and its current in mA, without losses.
    fn bus_load(&self) -> (i64, i64) {
        let parameters = self.servo.parameters();
        let torque = i128::from(self.actual.torque.0) * i128::from(parameters.rated_torque.0) / 1_000_000;
        // Micro newton metres times nanoturns a second, or micro newtons times nanometres a thousand a second.
        let (num, den) = match parameters.kind {
            UnitKind::Rotary => (6_283_185, 1_000_000),
            UnitKind::Linear => (1, 1_000),
        };
        let nanowatts = torque * i128::from(self.actual.velocity.0) / 1_000_000 * num / den;
        let whole = |value: i128| i64::try_from(value).unwrap_or(i64::MAX);
        let volts = i128::from(self.actual.bus_voltage.0 / 1_000_000).max(1);
        (whole(nanowatts / 1_000_000_000), whole(nanowatts / 1_000_000 / volts))
    }

    /// Takes captured positions over as feedback values.
    pub(super) fn collect_probes(&mut self, store: &mut Store) {
        const POLARITY: i64 = 1 << 2;
        let inverted = store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & POLARITY != 0;
        let scales = self.scales;
        let counts = |position: Position| {
            let counts = scales.position.counts(position.0);
            scales.fold(if inverted { -counts } else { counts })
        };
        self.probe.collect(&mut self.servo, store, counts);
    }

    /// S-0-0013.
    fn class_3(&self, store: &Store) -> u16 {
        let status = self.actual.status;
        let velocity = self.scales.velocity.counts(self.actual.velocity.0).abs();
        let torque = self.scales.torque.counts(self.actual.torque.0).abs();
        let bits = [
            status.contains(StatusBits::AT_VELOCITY),
            status.contains(StatusBits::STANDSTILL),
            velocity < store.number_of(Idn::VELOCITY_THRESHOLD),
            torque >= store.number_of(Idn::TORQUE_THRESHOLD),
            status.contains(StatusBits::TORQUE_LIMIT),
            status.contains(StatusBits::VELOCITY_LIMIT),
            status.contains(StatusBits::IN_POSITION),
        ];
        const ATTAINED: u32 = 12;
        let attained = u16::from(self.path.attained) << ATTAINED;
        bits.iter().rev().fold(0, |word, &bit| word << 1 | u16::from(bit)) | attained
    }

    /// S-0-0135.
    fn status(&self, cycle: &Cycle) -> DriveStatus {
        let ready = match (cycle.state, self.actual.report) {
            (State::In(Phase::CP4), Report::Operating | Report::Halted | Report::Stopping) => {
                ReadyState::InOperation
            }
            (State::In(Phase::CP4), Report::FaultReaction) => ReadyState::InOperation,
            (State::In(Phase::CP4), Report::Ready | Report::Enabling) => ReadyState::PowerOn,
            (State::In(Phase::CP4), Report::AwaitingPower) => ReadyState::ReadyForPower,
            (State::In(Phase::CP4), Report::Faulted) => self.shown.locked_ready,
            _ => ReadyState::NotReady,
        };
        let diagnosis = self.diagnose();
        let mut status = DriveStatus::empty().with_ready(ready).with_mode(self.mode.number);
        status.set(DriveStatus::ERROR, diagnosis.errors != 0);
        status.set(DriveStatus::WARNING, diagnosis.warnings != 0);
        status.set(DriveStatus::REFERENCED, self.referenced);
        if !self.control.silent {
            status.set(DriveStatus::HALT, self.actual.report == Report::Halted);
            status.set(DriveStatus::FOLLOWS, self.control.follows && self.actual.report == Report::Operating);
        }
        status
    }

    fn own_warnings(&self) -> u16 {
        let parameters = self.servo.parameters();
        let hot = self.actual.temperature.0 > parameters.max_temperature.0 - TEMPERATURE_MARGIN_MILLIDEGREE;
        let overload = self.actual.overload > OVERLOAD_WARNING_PPM;
        let raised = self.actual.warning.map_or(0, |cause| 1 << fault::class_2_bit(cause));
        self.shown.warnings | raised | u16::from(overload) | u16::from(hot) << 2
    }

    /// What has stopped the drive, else its most important warning.
    pub(super) fn diagnose(&self) -> Diagnosis {
        let warnings = self.own_warnings();
        let Some(cause) = self.actual.fault else {
            let bit = warnings.trailing_zeros();
            return match fault::CLASS_2_TEXTS.get(usize::try_from(bit).unwrap_or(usize::MAX)) {
                Some(text) => Diagnosis { errors: 0, warnings, number: fault::number(0xE, bit), text },
                None => Diagnosis { errors: 0, warnings, number: 0, text: "" },
            };
        };
        let bit = fault::class_1_bit(cause);
        Diagnosis {
            errors: 1 << bit | self.shown.further_errors,
            warnings,
            number: fault::number(0xF, u32::from(bit)),
            text: fault::CLASS_1_TEXTS[usize::from(bit & 15)],
        }
    }
}
