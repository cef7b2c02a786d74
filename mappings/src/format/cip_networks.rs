//! Rows of the CIP networks.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::Name;

/// `mappings/tables/dictionary/cip-networks.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipNetworkFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// The networks.
    pub network: Vec<NetworkRow>,
}

/// CIP Motion on one network.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NetworkRow {
    /// Name of the network.
    pub name: Name,
    /// Clause of the connection's parameters.
    pub clause: String,
    /// Table of the object classes.
    pub table: String,
    /// Clause that table stands in.
    pub table_clause: String,
    /// `fixed`, `variable`: formats of the connection, the usual one first.
    pub formats: Spanned<Vec<Name>>,
    /// Transport class.
    pub transport_class: u8,
    /// `cyclic`.
    pub trigger: Name,
    /// `urgent`, `very_high`.
    pub priority: Name,
    /// Least and most axes of a node.
    pub axes: Spanned<[u8; 2]>,
    /// Least and most axes for each format.
    pub axes_of: Option<AxesOfRow>,
    /// UDP port of the I/O connection.
    pub udp_port: Option<u16>,
    /// Where the produced and consumed paths lead.
    pub paths: Option<String>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// The object classes of a device.
    pub object: Vec<NetworkObjectRow>,
}

/// Axes of a node by the format of its connection.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxesOfRow {
    /// With the fixed one.
    pub fixed: Spanned<[u8; 2]>,
    /// With the variable one.
    pub variable: Spanned<[u8; 2]>,
}

/// An object class of a device.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NetworkObjectRow {
    /// Class code.
    pub class: Spanned<u16>,
    /// Name in the standard.
    pub name: Name,
    /// `R` or `O`.
    pub need: Name,
    /// Least number of instances.
    pub instances: u8,
    /// `node` or `axis`: what has so many.
    pub per: Name,
    /// What speaks to it.
    pub interface: Vec<String>,
    /// Anything worth knowing.
    pub note: Option<String>,
}
