//! What goes wrong on a bus on purpose.

use arrayvec::ArrayVec;

use super::Station;
use crate::can::frame::{Frame, Id};
use crate::time::DurationNs;

/// Disturbances that a bus can have at a time.
pub const DISTURBANCES_MAX: usize = 16;

/// What is done to a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// An error frame spoils it for everybody; the sender sends it again.
    Spoil,
    /// The receiver does not get it, and nobody notices.
    Lose,
    /// The receiver gets it twice: what an error in the last bit but one does, which only the sender sees.
    Double,
    /// The receiver gets it so much later, and everything behind it no earlier.
    Delay(DurationNs),
}

/// Frames that something is done to: all that fit what is given, from the `skip`th on, `count` of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Disturbance {
    /// Only those of this station.
    pub from: Option<Station>,
    /// Only at this receiver; [`Effect::Spoil`] strikes all of them.
    pub to: Option<Station>,
    /// Only with this identifier.
    pub id: Option<Id>,
    /// How many that fit are left alone first.
    pub skip: u32,
    /// How many it strikes then.
    pub count: u32,
    /// What is done.
    pub effect: Effect,
}

impl Disturbance {
    /// Strikes every frame from now on.
    #[must_use]
    pub const fn all(effect: Effect) -> Self {
        Self { from: None, to: None, id: None, skip: 0, count: u32::MAX, effect }
    }

    /// Only frames of this station.
    #[must_use]
    pub const fn from(self, from: Station) -> Self {
        Self { from: Some(from), ..self }
    }

    /// Only at this receiver.
    #[must_use]
    pub const fn to(self, to: Station) -> Self {
        Self { to: Some(to), ..self }
    }

    /// Only frames with this identifier.
    #[must_use]
    pub const fn id(self, id: Id) -> Self {
        Self { id: Some(id), ..self }
    }

    /// Leaves so many alone first.
    #[must_use]
    pub const fn skip(self, skip: u32) -> Self {
        Self { skip, ..self }
    }

    /// Strikes so many only.
    #[must_use]
    pub const fn count(self, count: u32) -> Self {
        Self { count, ..self }
    }

    fn fits(&self, from: Option<Station>, to: Option<Station>, frame: &Frame) -> bool {
        let meant = |asked: Option<Station>, is: Option<Station>| asked.is_none() || asked == is;
        meant(self.from, from) && meant(self.to, to) && self.id.is_none_or(|id| id == frame.id())
    }

    /// Whether it strikes this frame, which fits.
    fn strikes(&mut self) -> bool {
        if self.skip > 0 {
            self.skip -= 1;
            return false;
        }
        let strikes = self.count > 0;
        if self.count != u32::MAX {
            self.count = self.count.saturating_sub(1);
        }
        strikes
    }
}

/// What a receiver gets of a frame.
pub(super) struct Reception {
    pub copies: u8,
    pub delay: DurationNs,
}

#[derive(Debug, Default)]
pub(super) struct List(ArrayVec<Disturbance, DISTURBANCES_MAX>);

impl List {
    pub fn add(&mut self, disturbance: Disturbance) -> bool {
        // Those that have struck all they were to strike make room.
        self.0.retain(|old| old.count > 0);
        self.0.try_push(disturbance).is_ok()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Whether an error frame spoils this one.
    pub fn spoils(&mut self, from: Option<Station>, frame: &Frame) -> bool {
        let fitting =
            self.0.iter_mut().filter(|it| it.effect == Effect::Spoil && it.fits(from, it.to, frame));
        // All of them count it.
        fitting.filter_map(|disturbance| disturbance.strikes().then_some(())).count() > 0
    }

    /// What `to` gets of a frame that went through.
    pub fn reception(&mut self, from: Station, to: Station, frame: &Frame) -> Reception {
        let mut reception = Reception { copies: 1, delay: DurationNs::ZERO };
        for disturbance in &mut self.0 {
            if disturbance.effect == Effect::Spoil
                || !disturbance.fits(Some(from), Some(to), frame)
                || !disturbance.strikes()
            {
                continue;
            }
            match disturbance.effect {
                Effect::Lose => reception.copies = 0,
                Effect::Double => reception.copies *= 2,
                Effect::Delay(delay) => reception.delay = reception.delay + delay,
                Effect::Spoil => {}
            }
        }
        reception
    }
}
