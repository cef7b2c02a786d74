//! Parameters of drives by the number that they have there: how people write the number and the value, what is known of them without
//! the drive, the file of a backup, and the start-up list of a drive.

pub mod attributes;
pub mod backup;
pub mod command;
pub mod id;
pub mod known;
mod speed_attributes;
pub mod startup;
pub mod value;
