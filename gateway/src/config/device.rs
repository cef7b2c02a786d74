//! The devices that controllers see.

use std::net::Ipv4Addr;

use profile_cip::assembly::Assemblies;
use profile_cip::device::hosts::Hosts;
use profile_cip::wire::motion::Format;
use profile_generic::time::DurationNs;

/// A device as controllers see it: a CIP Motion device, or one with assemblies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    /// Name, unique among devices.
    pub name: String,
    /// Its IP address, for TCP and UDP 44818 and UDP 2222.
    pub listen: Ipv4Addr,
    /// Who may own it and change anything in it.
    pub controllers: Hosts,
    /// Who else is served.
    pub tools: Hosts,
    /// The Identity object.
    pub identity: Identity,
    /// Motion Device Axis Object, class attribute 34; 0 when each axis has its own.
    pub power_structure_class_id: u32,
    /// Format of the motion connection; the fixed one only with a single axis.
    pub connection_format: Format,
    /// The assemblies that its axes are moved through; `None` for a CIP Motion device.
    pub assembly: Option<Assemblies>,
    /// Shortest controller update period accepted.
    pub update_period_min: DurationNs,
    /// Longest controller update period accepted.
    pub update_period_max: DurationNs,
}

/// The Identity object of a device; its device type follows from what its axes are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Vendor number given by ODVA.
    pub vendor_id: u16,
    /// Name of that vendor, for the electronic data sheet.
    pub vendor_name: String,
    /// Catalogue number of the product, for the electronic data sheet.
    pub catalog: String,
    /// The vendor's number of the product.
    pub product_code: u16,
    /// Major revision, 1 to 127.
    pub revision_major: u8,
    /// Minor revision, 1 to 255.
    pub revision_minor: u8,
    /// Number of the piece.
    pub serial_number: u32,
    /// Printable ASCII, at most 32 characters.
    pub product_name: String,
}
