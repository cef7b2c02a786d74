//! CIP Motion on the CIP networks: object classes and I/O connection (IEC 61800-7-302).

use std::ops::RangeInclusive;
use std::sync::LazyLock;

use crate::finding::Spanned;

use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{CipNetworkFile, NetworkObjectRow, NetworkRow};
use crate::load::{Parsed, TableTexts};
use crate::resolver::Resolver;
use crate::rows;

/// Name of the network the box speaks to controllers on.
pub const ETHERNET_IP: &str = "EtherNet/IP";

/// Format of the data of an I/O connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConnectionDataFormat {
    /// Always the same blocks.
    Fixed,
    /// Blocks that say what they hold.
    Variable,
}

impl ConnectionDataFormat {
    /// As the table has it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Variable => "variable",
        }
    }
}

/// CIP Motion on one network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CipNetwork {
    /// Name of the network.
    pub name: String,
    /// Clause of the connection's parameters.
    pub clause: String,
    /// Table of the object classes.
    pub table: String,
    /// Clause that table stands in.
    pub table_clause: String,
    /// Formats of the connection with the axes a node may have with each; the usual one first.
    pub formats: Vec<(ConnectionDataFormat, RangeInclusive<u8>)>,
    /// Transport class.
    pub transport_class: u8,
    /// Production trigger, as the table has it.
    pub trigger: String,
    /// Priority, as the table has it.
    pub priority: String,
    /// Axes of a node.
    pub axes: RangeInclusive<u8>,
    /// UDP port of the I/O connection, where there is one.
    pub udp_port: Option<u16>,
    /// Where the produced and consumed paths lead; empty where the standard does not say.
    pub paths: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
    /// The object classes of a device, in the order of the standard.
    pub objects: Vec<NetworkObject>,
}

/// An object class of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NetworkObject {
    /// Class code.
    pub class: u16,
    /// Name.
    pub name: String,
    /// Whether a device must have it.
    pub required: bool,
    /// Least number of instances.
    pub instances: u8,
    /// Whether each axis has so many, not the device.
    pub per_axis: bool,
    /// What speaks to it.
    pub interface: Vec<String>,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// The networks as they are built in, for callers without loaded tables. Empty if they are faulty, which a test excludes.
pub fn networks() -> &'static [CipNetwork] {
    static NETWORKS: LazyLock<Vec<CipNetwork>> = LazyLock::new(|| {
        let mut errors = Findings::default();
        let file = rows::parse(&TableTexts::embedded().cip_networks, "cip-networks", &[], &mut errors);
        file.map(|file| resolve_networks(&file, &mut errors)).unwrap_or_default()
    });
    &NETWORKS
}

/// The networks, in the order of the file.
pub(super) fn resolve_networks(file: &Parsed<CipNetworkFile>, errors: &mut Findings) -> Vec<CipNetwork> {
    let mut resolver = Resolver::new(&file.text, errors);
    resolver.head(&file.rows.format, "profile", &file.rows.profile, "cip-motion");
    let mut networks: Vec<CipNetwork> = Vec::with_capacity(file.rows.network.len());
    for row in &file.rows.network {
        if networks.iter().any(|known| known.name == *row.name.get_ref()) {
            resolver.error(code::TWICE, row.name.span(), "name", "the network is defined twice");
        }
        networks.extend(resolve_network(row, &mut resolver));
    }
    networks
}

fn resolve_network(row: &NetworkRow, resolver: &mut Resolver<'_>) -> Option<CipNetwork> {
    const FORMATS: [(&str, ConnectionDataFormat); 2] =
        [("fixed", ConnectionDataFormat::Fixed), ("variable", ConnectionDataFormat::Variable)];
    let axes = range(&row.axes, "axes", resolver);
    let of_fixed =
        row.axes_of.as_ref().map_or_else(|| axes.clone(), |of| range(&of.fixed, "fixed", resolver));
    let of_variable =
        row.axes_of.as_ref().map_or_else(|| axes.clone(), |of| range(&of.variable, "variable", resolver));
    let mut formats = Vec::new();
    for name in row.formats.get_ref() {
        let format = resolver.word("formats", name, &FORMATS)?;
        let axes = match format {
            ConnectionDataFormat::Fixed => of_fixed.clone(),
            ConnectionDataFormat::Variable => of_variable.clone(),
        };
        formats.extend(axes.map(|axes| (format, axes)));
    }
    if row.formats.get_ref().is_empty() {
        resolver.error(
            code::MISSING_KEY,
            row.formats.span(),
            "formats",
            "expected fixed, variable or both, got nothing",
        );
    }
    let trigger = resolver.word("trigger", &row.trigger, &[("cyclic", "cyclic")]);
    let priorities = [("urgent", "urgent"), ("very_high", "very_high")];
    let priority = resolver.word("priority", &row.priority, &priorities);
    let mut objects: Vec<NetworkObject> = Vec::new();
    for object in &row.object {
        if objects.iter().any(|known| known.class == *object.class.get_ref()) {
            resolver.error(code::TWICE, object.class.span(), "class", "the class is defined twice");
        }
        objects.extend(resolve_object(object, resolver));
    }
    Some(CipNetwork {
        name: row.name.get_ref().clone(),
        clause: row.clause.clone(),
        table: row.table.clone(),
        table_clause: row.table_clause.clone(),
        formats,
        transport_class: row.transport_class,
        trigger: trigger?.to_owned(),
        priority: priority?.to_owned(),
        axes: axes?,
        udp_port: row.udp_port,
        paths: row.paths.clone().unwrap_or_default(),
        note: row.note.clone().unwrap_or_default(),
        objects,
    })
}

fn range(pair: &Spanned<[u8; 2]>, key: &str, resolver: &mut Resolver<'_>) -> Option<RangeInclusive<u8>> {
    let [least, most] = *pair.get_ref();
    if least == 0 || least > most {
        let message = format!("expected least and most, from 1 on, got {least} and {most}");
        resolver.error(code::OUT_OF_RANGE, pair.span(), key, message);
        return None;
    }
    Some(least..=most)
}

fn resolve_object(row: &NetworkObjectRow, resolver: &mut Resolver<'_>) -> Option<NetworkObject> {
    let required = resolver.word("need", &row.need, &[("R", true), ("O", false)]);
    let per_axis = resolver.word("per", &row.per, &[("node", false), ("axis", true)]);
    Some(NetworkObject {
        class: *row.class.get_ref(),
        name: row.name.get_ref().clone(),
        required: required?,
        instances: row.instances,
        per_axis: per_axis?,
        interface: row.interface.clone(),
        note: row.note.clone().unwrap_or_default(),
    })
}
