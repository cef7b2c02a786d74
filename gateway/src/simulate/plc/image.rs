//! The assemblies by the names of their fields.

use profile_cip::assembly::handshake::Status;
use profile_cip::assembly::{Assemblies, Control, DriveMode, Layout, Placed, Refusal};
use profile_generic::fault::FaultCause;

use super::PlcError;
use super::profile::Profile;

/// The output assembly as it is sent, and the input assembly that came last.
#[derive(Debug, Clone)]
pub struct Images {
    /// Data to the device.
    pub output: Vec<u8>,
    /// Data from the device.
    pub input: Vec<u8>,
    outputs: Vec<Placed>,
    inputs: Vec<Placed>,
    /// The mode of a layout without a field for it.
    mode: Option<u8>,
    /// The assemblies are those of the AC/DC drive profile.
    profile: Option<Profile>,
}

impl Images {
    /// Zeros; `counts` are those in a unit of each axis.
    #[must_use]
    pub fn new(assemblies: &Assemblies, counts: &[u32]) -> Self {
        let (mode, profile) = match assemblies.layout() {
            Layout::Fields { mode, .. } => (*mode, None),
            Layout::Speed { output, mode, .. } => {
                let mode = if *mode == DriveMode::Speed { 2 } else { 5 };
                (Some(mode), Some(Profile::new(*output, counts.first().copied().unwrap_or(1))))
            }
        };
        Self {
            output: vec![0; assemblies.output_len()],
            input: vec![0; assemblies.input_len()],
            outputs: assemblies.output(),
            inputs: assemblies.input(),
            mode,
            profile,
        }
    }

    /// A field of the output.
    #[must_use]
    pub fn find_output(&self, axis: usize, name: &str) -> Option<Placed> {
        self.outputs.iter().find(|field| field.axis == axis && field.name == name).copied()
    }

    /// A field of the input.
    #[must_use]
    pub fn find_input(&self, axis: usize, name: &str) -> Option<Placed> {
        self.inputs.iter().find(|field| field.axis == axis && field.name == name).copied()
    }

    // ---- to the device --------------------------------------------------------------------------------------------

    /// Writes a field.
    ///
    /// # Errors
    /// The layout has no such field, or the value does not fit it.
    pub fn set(&mut self, axis: usize, name: &'static str, value: i64) -> Result<(), PlcError> {
        let field = self.find_output(axis, name).ok_or(PlcError::Field(name))?;
        if !fits(&field, value) {
            return Err(PlcError::Value { field: field.name, value });
        }
        self.output[field.offset..field.offset + field.len]
            .copy_from_slice(&value.to_le_bytes()[..field.len]);
        Ok(())
    }

    /// Writes the control word.
    ///
    /// # Errors
    /// The layout has none, or not these bits.
    pub fn set_word(&mut self, axis: usize, word: Control) -> Result<(), PlcError> {
        let bits = match self.profile {
            Some(profile) => i64::from(profile.control(word).ok_or(PlcError::Profile)?),
            None => i64::from(word.bits()),
        };
        self.set(axis, "control", bits)
    }

    /// Writes the velocity, counts/s; a speed reference is the nearest one.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_velocity(&mut self, axis: usize, velocity: i64) -> Result<(), PlcError> {
        match self.profile {
            Some(profile) => self.set(axis, "speed_reference", profile.rpm(velocity)),
            None => self.set(axis, "velocity", velocity),
        }
    }

    /// Writes the target, in the width that the layout has.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_target(&mut self, axis: usize, value: i64) -> Result<(), PlcError> {
        match self.find_output(axis, "target_position_64") {
            Some(_) => self.set(axis, "target_position_64", value),
            None => self.set(axis, "target_position_32", value),
        }
    }

    /// Writes the acceleration; 0 needs no field.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_acceleration(&mut self, axis: usize, value: i64) -> Result<(), PlcError> {
        match self.find_output(axis, "acceleration") {
            None if value == 0 => Ok(()),
            _ => self.set(axis, "acceleration", value),
        }
    }

    /// Chooses a mode.
    ///
    /// # Errors
    /// The layout has another one.
    pub fn set_mode(&mut self, axis: usize, wanted: u8) -> Result<(), PlcError> {
        match self.mode {
            Some(found) if found != wanted => Err(PlcError::Mode { wanted, found }),
            Some(_) => Ok(()),
            None => self.set(axis, "mode", i64::from(wanted)),
        }
    }

    // ---- from the device ------------------------------------------------------------------------------------------

    /// A field of the input; `None` where the layout has none.
    #[must_use]
    pub fn get(&self, axis: usize, name: &str) -> Option<i64> {
        let field = self.find_input(axis, name)?;
        let bytes = self.input.get(field.offset..field.offset + field.len)?;
        let negative = is_signed(&field) && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut octets = [if negative { 0xFF } else { 0 }; 8];
        octets[..bytes.len()].copy_from_slice(bytes);
        Some(i64::from_le_bytes(octets))
    }

    /// The status word.
    #[must_use]
    pub fn status(&self, axis: usize) -> Status {
        if let Some(profile) = self.profile {
            return profile.status(&self.input);
        }
        Status::from_bits_retain(
            self.get(axis, "status").and_then(|word| u16::try_from(word).ok()).unwrap_or(0),
        )
    }

    /// Cause of the fault; 0 without one.
    #[must_use]
    pub fn fault(&self, axis: usize) -> FaultCause {
        FaultCause(self.get(axis, "fault").and_then(|cause| u16::try_from(cause).ok()).unwrap_or(0))
    }

    /// Why the last order was refused.
    #[must_use]
    pub fn refusal(&self, axis: usize) -> Refusal {
        Refusal(self.get(axis, "refusal").and_then(|code| u8::try_from(code).ok()).unwrap_or(0))
    }

    /// The actual position, counts.
    #[must_use]
    pub fn position(&self, axis: usize) -> Option<i64> {
        self.get(axis, "actual_position_64").or_else(|| self.get(axis, "actual_position_32"))
    }

    /// The actual velocity, counts/s.
    #[must_use]
    pub fn velocity(&self, axis: usize) -> Option<i64> {
        match self.profile {
            Some(profile) => self.get(axis, "actual_speed").map(|rpm| profile.velocity(rpm)),
            None => self.get(axis, "actual_velocity"),
        }
    }
}

fn is_signed(field: &Placed) -> bool {
    matches!(field.kind, "SINT" | "INT" | "DINT" | "LINT")
}

/// Whether a field can hold a value.
#[must_use]
pub(super) fn fits(field: &Placed, value: i64) -> bool {
    let bits = u32::try_from(8 * field.len).unwrap_or(64);
    match (bits, is_signed(field)) {
        (64.., _) => true,
        (bits, true) => (-(1_i64 << (bits - 1))..1_i64 << (bits - 1)).contains(&value),
        (bits, false) => (0..1_i64 << bits).contains(&value),
    }
}
