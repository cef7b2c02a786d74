//! A simulated drive behind a node: the device profile CiA 402 on simulated servo axes, up to eight of them.
//!
//! ```text
//! not ready to switch on    20 ms after power-on
//! switch on disabled, ready to switch on
//!                           no torque; 3 waits for the voltage of the DC link
//! switched on               no torque; 4 takes the time in which the servo builds it up
//! operation enabled         the mode of operation leads; 5 and 8 brake first, where 605Ch and 605Bh say so
//! quick stop active         brakes by 605Ah; 12 at the stand, or it holds
//! fault reaction active     brakes by 605Eh, or as the servo must; then 14
//! fault                     no torque, until 15 finds its cause gone
//! ```
//!
//! In csp, 607Ah is what the axis goes to as soon as operation is enabled: where it is far from 6064h, the drive faults with
//! 8611h, as real ones do.
//!
//! Objects of this manufacturer: 2000h velocity feed forward, 2FFEh room for any bytes, 2FFFh:1 an error code to raise.

pub mod axis;
pub mod faults;
mod homing;
mod monitor;
pub mod objects;
mod probe;
mod profile;
pub mod scaling;
mod twin;

use profile_generic::servo::{ServoError, ServoParameters};
use profile_generic::time::DurationNs;

pub use self::axis::Axis;

use self::scaling::Scales;
use super::Identity;
use super::application::{Application, Event, Report};
use super::dictionary::{Definition, Dictionary};
use crate::drive::Mode;
use crate::drive::homing::Method;
use crate::drive::index::{self, AXES_MAX, AXIS_OFFSET};
use crate::eds::DeviceDescription;
use crate::wire::{AbortCode, Mux};

/// A device with one axis or several.
#[derive(Debug)]
pub struct Device {
    axes: Vec<Axis>,
    /// Time does not pass for the axes.
    paused: bool,
    /// The data sheet that it is made by, until its objects are.
    sheet: Option<Box<DeviceDescription>>,
    /// It has no object for the time between set-points, and takes that of SYNC (1006h).
    follows_cycle: bool,
}

/// Why there is no device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// A device has one to eight axes.
    #[error("expected 1 to 8 axes, got {0}")]
    Axes(usize),
    /// The servo of an axis does not work.
    #[error("axis {axis}: {error}")]
    Servo {
        /// Its number, from 1.
        axis: usize,
        /// What is wrong.
        error: ServoError,
    },
}

/// What a simulated drive that is made by a data sheet says about itself; what the file does not say is as it was.
#[must_use]
pub fn identity_of(sheet: &DeviceDescription, otherwise: Identity) -> Identity {
    let number = |sub| sheet.number(index::IDENTITY, sub, 0).filter(|number| *number != 0);
    Identity {
        device_type: sheet.number(index::DEVICE_TYPE, 0, 0).unwrap_or(otherwise.device_type),
        vendor: number(1).or(sheet.device.vendor_number).unwrap_or(otherwise.vendor),
        product: number(2).or(sheet.device.product_number).unwrap_or(otherwise.product),
        revision: number(3).or(sheet.device.revision_number).unwrap_or(otherwise.revision),
        serial: number(4).unwrap_or(otherwise.serial),
        ..otherwise
    }
}

/// What a simulated drive says about itself.
#[must_use]
pub fn identity(axes: usize, serial: u32) -> Identity {
    Identity {
        device_type: if axes == 1 { objects::SERVO } else { objects::SEVERAL_AXES },
        // No vendor has this number.
        vendor: 0x7FFF_FFFF,
        product: 402,
        revision: 1,
        serial,
        name: "Axisbridge simulated CiA 402 drive",
        hardware: "simulated",
        software: env!("CARGO_PKG_VERSION"),
    }
}

impl Device {
    /// A device with these servos, one axis each.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn new(servos: &[ServoParameters]) -> Result<Self, DeviceError> {
        if servos.is_empty() || servos.len() > usize::from(AXES_MAX) {
            return Err(DeviceError::Axes(servos.len()));
        }
        let axes = (0..AXES_MAX).zip(servos).map(|(number, servo)| {
            let axis = usize::from(number) + 1;
            Axis::new(number, *servo).map_err(|error| DeviceError::Servo { axis, error })
        });
        Ok(Self { axes: axes.collect::<Result<_, _>>()?, paused: false, sheet: None, follows_cycle: false })
    }

    /// A device like the one of a data sheet or device configuration, with a node-id and these servos for its axes: it has the objects
    /// of the file and no others, with their types, accesses, limits and values, and its mappings of PDOs. What CiA 402 asks of them
    /// the simulated drive does, in the modes of 6502h; where the file does not say them, in those for which it has objects.
    ///
    /// # Errors
    /// [`DeviceError`].
    pub fn like(servos: &[ServoParameters], sheet: DeviceDescription, node: u8) -> Result<Self, DeviceError> {
        let mut device = Self::new(servos)?;
        for (number, axis) in (0..).zip(&mut device.axes) {
            axis.take_modes(twin::modes(&sheet, number, node));
        }
        device.sheet = Some(Box::new(sheet));
        Ok(device)
    }

    /// Stops the time of the axes, or lets it go on. Objects keep what was written last meanwhile and controlwords have no effect: for
    /// a test bench that answers in place of the drive.
    pub fn set_paused(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Its axes, whose objects are 800h apart.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Its axes, to act on them from outside.
    pub fn axes_mut(&mut self) -> &mut [Axis] {
        &mut self.axes
    }

    /// The axis that an object belongs to, and the object of the first axis that is like it.
    fn axis_of(&self, index: u16) -> Option<(&Axis, u16)> {
        let place = match index {
            0x6000..=0x9FFF => index - 0x6000,
            0x2000..=0x5FFF => index - 0x2000,
            _ => return None,
        };
        let axis = self.axes.get(usize::from(place / AXIS_OFFSET))?;
        Some((axis, index - place / AXIS_OFFSET * AXIS_OFFSET))
    }
}

impl Application for Device {
    fn define(&mut self, dictionary: &mut Dictionary) {
        dictionary.variable(objects::SCRATCH, Definition::domain("Scratch", objects::SCRATCH_LEN));
        for (number, axis) in (0..AXES_MAX).zip(&mut self.axes) {
            objects::define(dictionary, number, axis.servo().parameters());
        }
        if let Some(sheet) = self.sheet.take() {
            twin::shape(dictionary, &sheet, self.axes.len());
            self.follows_cycle = sheet.object(index::INTERPOLATION_PERIOD).is_none();
        }
        for axis in &mut self.axes {
            axis.adopt(dictionary);
        }
    }

    fn check(&self, mux: Mux, number: i64, dictionary: &Dictionary) -> Result<(), AbortCode> {
        let Some((axis, index)) = self.axis_of(mux.index) else { return Ok(()) };
        let small = i8::try_from(number).ok();
        match index {
            index::MODE if !small.is_some_and(|mode| axis.modes().has(Mode(mode))) => Err(AbortCode::VALUE),
            index::HOMING_METHOD if small.and_then(|method| Method(method).plan()).is_none() => {
                Err(AbortCode::VALUE)
            }
            index::GEAR_RATIO
            | index::FEED_CONSTANT
            | index::VELOCITY_FACTOR
            | index::ACCELERATION_FACTOR
            | index::VL_DIMENSION_FACTOR => {
                let offset = mux.index - index;
                let scales = Scales::of(|other, sub| {
                    let is_it = (other, sub) == (index, mux.sub);
                    if is_it { number } else { dictionary.number(other + offset, sub) }
                });
                scales.map(|_| ()).ok_or(AbortCode::PARAMETER)
            }
            _ => Ok(()),
        }
    }

    fn commanded(&mut self, dictionary: &mut Dictionary) {
        if self.follows_cycle {
            twin::follow_cycle(dictionary, self.axes.len());
        }
        if dictionary.take_changed() {
            self.axes.iter_mut().for_each(|axis| axis.adopt(dictionary));
        }
        self.axes.iter_mut().for_each(|axis| axis.command(dictionary));
    }

    fn step(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary) {
        if dictionary.take_changed() {
            self.axes.iter_mut().for_each(|axis| axis.adopt(dictionary));
        }
        if !self.paused {
            self.axes.iter_mut().for_each(|axis| axis.step(elapsed, dictionary));
        }
    }

    fn event(&mut self, event: Event, dictionary: &mut Dictionary) {
        self.axes.iter_mut().for_each(|axis| axis.event(event, dictionary));
    }

    fn poll_report(&mut self) -> Option<Report> {
        self.axes.iter_mut().find_map(Axis::poll_report)
    }
}

#[cfg(test)]
mod tests;
