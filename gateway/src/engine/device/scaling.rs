//! The scaling of an axis: by the configuration of the gateway until the controller has set its own.

use arrayvec::ArrayVec;
use profile_cip::device::axis_object::PositionView;
use profile_cip::device::motion_device::MotionDevice;
use profile_cip::wire::motion::codes::EventChecking;
use profile_cip::wire::status::GeneralStatus;
use profile_generic::scaling::UnitKind;

use super::axis::CipAxis;
use crate::engine::axis::AxisChannel;
use crate::mapping::{
    AttributeTable, Backing, CipScaling, CipScalingError, CipTables, CipType, DisplacementUnit,
    FeedbackChannel, FeedbackUse, Mapping, MechanicalFact, Number,
};

/// Attributes that describe the scaling of an axis.
const SCALING_MAX: usize = 8;

/// Why the controller's scaling is not in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ScalingRefusal {
    /// The attributes make no sense.
    #[error(transparent)]
    Attributes(#[from] CipScalingError),
    /// The unit is one of turns and the axis goes along a line, or the other way round.
    #[error("Motion Unit, or Feedback Unit with Control Scaling: expected a unit of {}", kind_name(*.0))]
    Kind(UnitKind),
    /// A ratio does not fit.
    #[error("a ratio of the scaling cannot be expressed exactly")]
    Inexact,
    /// The axis still has torque.
    #[error("the axis still has torque")]
    Energized,
    /// Positions and velocities would count in different units.
    #[error(
        "with Dual Feedback and Control Scaling velocities count in turns of the motor and positions in those of the load: expected a \
         Feedback Unit Ratio of 1, or Drive Scaling"
    )]
    TwoUnits,
}

/// The scaling of one axis, and its attributes in that scaling.
#[derive(Debug)]
pub(super) struct Scaling {
    used: CipScaling,
    /// The scaling of the configuration, to which every new connection returns.
    configured: CipScaling,
    /// The attributes in the scaling of the configuration, shared by axes that are configured alike.
    attributes: AttributeTable,
    /// The attributes in the scaling of the controller, if that is another one: made in place, because the cycle allocates nothing.
    own: AttributeTable,
    /// The controller's scaling is known and in use on this connection.
    is_taken: bool,
    /// The device does the scaling, not the controller.
    by_device: bool,
    /// Whose encoder positions and velocities are of.
    feedback: FeedbackUse,
}

impl Scaling {
    /// The scaling of the configuration; `None` if it cannot be expressed exactly.
    pub fn new(mapping: &Mapping, configured: CipScaling, feedback: FeedbackUse) -> Option<Self> {
        let attributes = mapping.attribute_table(&configured)?;
        Some(Self::with_attributes(attributes, mapping, configured, feedback))
    }

    fn with_attributes(
        attributes: AttributeTable,
        mapping: &Mapping,
        configured: CipScaling,
        feedback: FeedbackUse,
    ) -> Self {
        let own = mapping.attribute_room();
        Self { used: configured, configured, attributes, own, is_taken: false, by_device: true, feedback }
    }

    /// Whether this is the scaling of the configuration.
    pub fn is_configured(&self, scaling: &CipScaling) -> bool {
        self.configured == *scaling
    }

    /// The scaling of the configuration for another axis, which shares the attributes.
    pub fn alike(&self, mapping: &Mapping, feedback: FeedbackUse) -> Self {
        Self::with_attributes(self.attributes.clone(), mapping, self.configured, feedback)
    }

    /// The attributes in the scaling that is in use.
    pub fn attributes(&self) -> &AttributeTable {
        if self.used == self.configured { &self.attributes } else { &self.own }
    }

    /// Whether the controller's scaling is known and in use on this connection.
    pub fn is_taken(&self) -> bool {
        self.is_taken
    }

    /// What can be checked for on this connection, of what axis and drive can. Windows, watch positions and torque only
    /// where the device does the scaling (Table 5-2.36).
    pub fn checkable(&self, events: EventChecking) -> EventChecking {
        if self.by_device { events | events.windows() } else { events - EventChecking::EXTENDED }
    }

    /// Sets the scaling attributes of a new connection as the configuration of the gateway has them.
    pub fn preset(
        &mut self,
        mapping: &Mapping,
        (device, place): (&mut MotionDevice, usize),
        (cip, axis): (&mut CipAxis, &mut AxisChannel),
    ) {
        for (id, value) in scaling_attributes(&mapping.cip, &self.configured) {
            let Some(entry) = self.attributes.get(id) else { continue };
            // Refused only for an attribute that the device does not have.
            let _ = device.put_attribute(place, id, &value.to_le_bytes()[..width(entry.data_type)]);
        }
        // Counts from the end of the configuration on; refused while the axis still stops, and then taken again.
        let _ = self.apply(mapping, (cip, axis), self.configured);
        self.is_taken = false;
        self.by_device = true;
    }

    /// The controller has finished its configuration: its scaling counts from now on.
    pub fn take<'d>(
        &mut self,
        mapping: &Mapping,
        axis: (&mut CipAxis, &mut AxisChannel),
        get: impl Fn(u16) -> Result<&'d [u8], GeneralStatus>,
    ) -> Result<(), ScalingRefusal> {
        self.is_taken = false;
        let number = |id| {
            let signed = self.attributes.get(id).is_some_and(|entry| is_signed(entry.data_type));
            number_of(get(id), signed)
        };
        let rows = &mapping.cip.scaling;
        self.by_device = number(rows.configuration) == i64::from(rows.drive_scaling);
        if !self.by_device && self.feedback == FeedbackUse::Dual && !is_direct(axis.1) {
            return Err(ScalingRefusal::TwoUnits);
        }
        // Positions that are the load's count as its encoder does (Table 5-2.8).
        let is_of_load = self.feedback != FeedbackUse::Motor;
        let of_encoder = |id| id == rows.feedback_unit || rows.feedback_resolution.contains(&id);
        let number =
            |id| number(if is_of_load && of_encoder(id) { id + FeedbackChannel::Two.offset() } else { id });
        let scaling = CipScaling::from_attributes(&mapping.cip, number)?;
        // A turn and a millimetre are as many nanounits: nothing downstream would notice.
        if scaling.kind != self.configured.kind {
            return Err(ScalingRefusal::Kind(self.configured.kind));
        }
        self.apply(mapping, axis, scaling)?;
        self.is_taken = true;
        Ok(())
    }

    fn apply(
        &mut self,
        mapping: &Mapping,
        (cip, axis): (&mut CipAxis, &mut AxisChannel),
        scaling: CipScaling,
    ) -> Result<(), ScalingRefusal> {
        if scaling == self.used {
            return Ok(());
        }
        // Asked first: what is made in place cannot be taken back.
        if axis.may_have_torque() {
            return Err(ScalingRefusal::Energized);
        }
        let program = mapping.cip_program(&scaling).ok_or(ScalingRefusal::Inexact)?;
        if scaling != self.configured {
            mapping.refill_attributes(&mut self.own, &scaling).ok_or(ScalingRefusal::Inexact)?;
        }
        cip.set_program(axis, program);
        self.used = scaling;
        Ok(())
    }
}

/// What an axis of this kind counts.
const fn kind_name(kind: UnitKind) -> &'static str {
    match kind {
        UnitKind::Rotary => "revolutions, as the axis",
        UnitKind::Linear => "length, as the axis",
    }
}

/// Whether the encoder of the load is known to turn as the motor's does.
fn is_direct(axis: &AxisChannel) -> bool {
    let ratio = axis.south().and_then(|program| program.mechanical(MechanicalFact::UnitRatio));
    ratio.is_some_and(|(_, ratio)| ratio == Number::Real(1.0))
}

/// The attributes that describe a scaling, with their values.
fn scaling_attributes(tables: &CipTables, scaling: &CipScaling) -> ArrayVec<(u16, i64), SCALING_MAX> {
    let rows = &tables.scaling;
    let known =
        |unit: &&DisplacementUnit| unit.kind == scaling.kind && unit.nanounits == scaling.nanounits_per_unit;
    let unit = tables.motion_units.iter().find(known).map_or(0, |unit| i64::from(unit.code));
    let polarity = if scaling.inverted { i64::from(rows.inverted) } else { 0 };
    let resolution =
        rows.resolution.iter().zip([scaling.counts_per_unit].into_iter().chain(std::iter::repeat(1)));
    let fixed = [
        (rows.configuration, i64::from(rows.drive_scaling)),
        (rows.unit, unit),
        (rows.polarity, polarity),
        (rows.unwind, i64::from(scaling.unwind.is_some())),
        (rows.unwind_position, scaling.unwind.unwrap_or(0)),
    ];
    fixed.into_iter().chain(resolution.map(|(id, value)| (*id, value))).take(SCALING_MAX).collect()
}

/// Octets of an integer type.
fn width(cip: CipType) -> usize {
    match cip {
        CipType::Bool | CipType::Sint | CipType::Usint | CipType::Byte | CipType::ShortString => 1,
        CipType::Int | CipType::Uint | CipType::Word => 2,
        CipType::Dint | CipType::Udint | CipType::Dword | CipType::Real => 4,
        CipType::Lint | CipType::Ulint | CipType::Lword | CipType::Lreal => 8,
    }
}

/// Whether an integer type has a sign.
fn is_signed(cip: CipType) -> bool {
    matches!(cip, CipType::Sint | CipType::Int | CipType::Dint | CipType::Lint)
}

/// An attribute's bytes as a number; 0 where there is none.
pub(super) fn number_of(bytes: Result<&[u8], GeneralStatus>, signed: bool) -> i64 {
    let bytes = bytes.unwrap_or_default();
    let negative = signed && bytes.last().is_some_and(|last| last & 0x80 != 0);
    let mut wide = [if negative { 0xFF } else { 0 }; 8];
    for (to, from) in wide.iter_mut().zip(bytes) {
        *to = *from;
    }
    i64::from_le_bytes(wide)
}

/// Writes the value of a signal as the attribute with this number; `None` while it has none.
pub(super) fn signal_octets(
    attributes: &AttributeTable,
    axis: &AxisChannel,
    view: &PositionView,
    id: u16,
    octets: &mut [u8; 8],
) -> Option<usize> {
    let entry = attributes.get(id)?;
    let Backing::Signal { signal, .. } = entry.backing else { return None };
    let generic = axis.signal(signal)?;
    entry.from_signal(generic, view, octets).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::axis::Limits;
    use profile_generic::fault::Reaction;
    use profile_generic::state::{Report, Request};
    use profile_generic::time::{MonotonicTime, SystemTime};
    use std::collections::BTreeMap;

    const CONFIGURED: CipScaling = CipScaling {
        kind: UnitKind::Rotary,
        nanounits_per_unit: 1_000_000_000,
        counts_per_unit: 1_000_000,
        unwind: None,
        inverted: false,
    };
    const OTHER: CipScaling =
        CipScaling { counts_per_unit: 4096, unwind: Some(4096 * 3), inverted: true, ..CONFIGURED };

    /// The attributes of a controller that sets this scaling.
    fn attributes(mapping: &Mapping, scaling: &CipScaling) -> BTreeMap<u16, [u8; 8]> {
        scaling_attributes(&mapping.cip, scaling)
            .iter()
            .map(|(id, value)| (*id, value.to_le_bytes()))
            .collect()
    }

    fn take(scaling: &mut Scaling, mapping: &Mapping, wanted: &CipScaling) -> Result<(), ScalingRefusal> {
        let mut cip = CipAxis::new(mapping.cip_program(&CONFIGURED).expect("exact"));
        let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
        take_for(scaling, mapping, wanted, (&mut cip, &mut axis))
    }

    fn take_for(
        scaling: &mut Scaling,
        mapping: &Mapping,
        wanted: &CipScaling,
        axis: (&mut CipAxis, &mut AxisChannel),
    ) -> Result<(), ScalingRefusal> {
        let attributes = attributes(mapping, wanted);
        let get = |id| attributes.get(&id).map(|value| &value[..]);
        scaling.take(mapping, axis, |id| get(id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED))
    }

    #[test]
    fn controllers_scaling_is_used_as_soon_as_it_is_taken() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let mut scaling = Scaling::new(&mapping, CONFIGURED, FeedbackUse::Motor).expect("exact");
        assert!(!scaling.is_taken());
        assert_eq!(take(&mut scaling, &mapping, &OTHER), Ok(()));
        assert_eq!((scaling.used, scaling.is_taken(), scaling.by_device), (OTHER, true, true));
        // One after the other in the same place, a refused one between them, and the one of the configuration again.
        let third = CipScaling { counts_per_unit: 360_000, ..CONFIGURED };
        let none = CipScaling { counts_per_unit: 0, ..CONFIGURED };
        for (wanted, used) in
            [(OTHER, OTHER), (none, OTHER), (third, third), (CONFIGURED, CONFIGURED), (third, third)]
        {
            let _ = take(&mut scaling, &mapping, &wanted);
            let expected = mapping.attribute_table(&used).expect("exact");
            assert_eq!((scaling.used, scaling.attributes().entries()), (used, expected.entries()));
        }
    }

    #[test]
    fn scaling_without_resolution_is_refused_and_the_last_one_stays() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let mut scaling = Scaling::new(&mapping, CONFIGURED, FeedbackUse::Motor).expect("exact");
        let refused = take(&mut scaling, &mapping, &CipScaling { counts_per_unit: 0, ..OTHER });
        assert!(matches!(refused, Err(ScalingRefusal::Attributes(_))), "{refused:?}");
        assert_eq!((scaling.used, scaling.is_taken()), (CONFIGURED, false));
    }

    /// A turn and a millimetre are as many nanounits.
    #[test]
    fn turns_are_refused_on_a_linear_axis_and_lengths_on_a_rotary_one() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let inch = CipScaling { kind: UnitKind::Linear, nanounits_per_unit: 25_400_000_000, ..OTHER };
        let millimetre = CipScaling { kind: UnitKind::Linear, ..CONFIGURED };
        for (configured, wanted, refused) in [
            (millimetre, CONFIGURED, Some(UnitKind::Linear)),
            (millimetre, CipScaling { counts_per_unit: 4096, ..millimetre }, None),
            (millimetre, inch, None),
            (CONFIGURED, millimetre, Some(UnitKind::Rotary)),
            (CONFIGURED, inch, Some(UnitKind::Rotary)),
        ] {
            let mut scaling = Scaling::new(&mapping, configured, FeedbackUse::Motor).expect("exact");
            let taken = take(&mut scaling, &mapping, &wanted);
            assert_eq!(taken, refused.map_or(Ok(()), |kind| Err(ScalingRefusal::Kind(kind))), "{wanted:?}");
            let used = if refused.is_some() { configured } else { wanted };
            assert_eq!((scaling.used, scaling.is_taken()), (used, refused.is_none()), "{wanted:?}");
        }
    }

    /// With Control Scaling the unit of the encoder counts. It is turns until the controller sets it.
    #[test]
    fn encoder_in_turns_is_refused_on_a_linear_axis() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let rows = &mapping.cip.scaling;
        let configured = CipScaling { kind: UnitKind::Linear, ..CONFIGURED };
        for (unit, expected) in [(0_i64, Err(ScalingRefusal::Kind(UnitKind::Linear))), (1, Ok(()))] {
            let mut attributes = BTreeMap::from([(rows.configuration, [0; 8])]);
            attributes.insert(rows.feedback_unit, unit.to_le_bytes());
            attributes.insert(rows.feedback_resolution[0], 4_000_i64.to_le_bytes());
            attributes.insert(rows.feedback_resolution[1], 1_i64.to_le_bytes());
            let get = |id| {
                attributes.get(&id).map(|value| &value[..]).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)
            };
            let mut scaling = Scaling::new(&mapping, configured, FeedbackUse::Motor).expect("exact");
            let mut cip = CipAxis::new(mapping.cip_program(&configured).expect("exact"));
            let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
            assert_eq!(scaling.take(&mapping, (&mut cip, &mut axis), get), expected, "unit {unit}");
        }
    }

    #[test]
    fn scaling_of_an_axis_with_torque_is_not_replaced() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let mut scaling = Scaling::new(&mapping, CONFIGURED, FeedbackUse::Motor).expect("exact");
        let mut cip = CipAxis::new(mapping.cip_program(&CONFIGURED).expect("exact"));
        let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
        axis.report(MonotonicTime(1), SystemTime(1), Report::Ready);
        axis.request(MonotonicTime(1), SystemTime(1), Request::Enable);
        assert!(axis.may_have_torque());
        let taken = take_for(&mut scaling, &mapping, &OTHER, (&mut cip, &mut axis));
        assert_eq!(taken, Err(ScalingRefusal::Energized));
        assert_eq!((scaling.used, scaling.is_taken()), (CONFIGURED, false));
        // The scaling that is in use already needs no change.
        let same = take_for(&mut scaling, &mapping, &CONFIGURED, (&mut cip, &mut axis));
        assert_eq!((same, scaling.is_taken()), (Ok(()), true));
    }

    /// Control Scaling of an axis of the load: encoder 1 has 1000 counts in a turn, encoder 2 4000. A dual one needs to know its gear.
    #[test]
    fn control_scaling_counts_as_the_encoder_does_that_positions_are_of() {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let rows = &mapping.cip.scaling;
        let mut attributes = BTreeMap::from([(rows.configuration, [0; 8])]);
        for (offset, counts) in [(0, 1_000_i64), (FeedbackChannel::Two.offset(), 4_000)] {
            attributes.insert(rows.feedback_unit + offset, [0; 8]);
            attributes.insert(rows.feedback_resolution[0] + offset, counts.to_le_bytes());
            attributes.insert(rows.feedback_resolution[1] + offset, 1_i64.to_le_bytes());
        }
        let get =
            |id| attributes.get(&id).map(|value| &value[..]).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        for (feedback, expected) in [
            (FeedbackUse::Motor, Ok(1_000)),
            (FeedbackUse::Load, Ok(4_000)),
            (FeedbackUse::Dual, Err(ScalingRefusal::TwoUnits)),
        ] {
            let mut scaling = Scaling::new(&mapping, CONFIGURED, feedback).expect("exact");
            let mut cip = CipAxis::new(mapping.cip_program(&CONFIGURED).expect("exact"));
            let mut axis = AxisChannel::new(Limits::default(), Reaction::HoldPosition, true);
            let taken = scaling.take(&mapping, (&mut cip, &mut axis), get);
            assert_eq!(taken.map(|()| scaling.used.counts_per_unit), expected, "{feedback:?}");
        }
    }

    #[test]
    fn sign_of_a_short_attribute_is_extended() {
        assert_eq!(number_of(Ok(&[0xFE, 0xFF]), true), -2);
        assert_eq!(number_of(Ok(&[0xFE, 0xFF]), false), 0xFFFE);
        assert_eq!(number_of(Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED), true), 0);
    }
}
