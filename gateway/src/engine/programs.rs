//! The programs of the drives for readers outside of the cycle: what each drive has, since it was commissioned.
//!
//! They are shared, not copied: nothing is allocated in the cycle. Nor does it wait for a reader: while one looks at a place, the program
//! is put there in a later cycle.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::axis::AxisChannel;
use crate::mapping::DriveProgram;

/// The place of one axis.
#[derive(Debug, Default)]
struct Place {
    program: Mutex<Option<Arc<DriveProgram>>>,
    /// The drive is commissioned now.
    is_there: AtomicBool,
}

/// The reading end.
#[derive(Debug, Clone, Default)]
pub struct Programs(Arc<[Place]>);

impl Programs {
    /// The program of the drive of this axis; `None` while it is not commissioned.
    #[must_use]
    pub fn get(&self, axis: usize) -> Option<Arc<DriveProgram>> {
        let place = self.0.get(axis).filter(|place| place.is_there.load(Ordering::Acquire))?;
        place.program.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The writing end.
#[derive(Debug)]
pub(super) struct ProgramsOfDrives {
    places: Programs,
    /// [`AxisChannel::programs`] of what stands in each place.
    published: Box<[u64]>,
}

impl ProgramsOfDrives {
    /// Places for this number of axes.
    pub fn new(axes: usize) -> Self {
        let places = Programs((0..axes).map(|_| Place::default()).collect());
        Self { places, published: vec![0; axes].into_boxed_slice() }
    }

    /// The reading end.
    pub fn reader(&self) -> Programs {
        self.places.clone()
    }

    /// Puts the programs of the drives there that have got another one.
    pub fn publish(&mut self, axes: &[AxisChannel]) {
        for ((axis, place), published) in axes.iter().zip(self.places.0.iter()).zip(&mut self.published) {
            if *published == axis.programs() {
                continue;
            }
            if let Some(program) = axis.shared_south() {
                let Ok(mut kept) = place.program.try_lock() else { continue };
                *kept = Some(program);
            }
            place.is_there.store(axis.south().is_some(), Ordering::Release);
            *published = axis.programs();
        }
    }
}
