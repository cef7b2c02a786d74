//! The services of the Motion Device Axis Object.

use super::cip_attributes::DEVICE_FUNCTIONS;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{CipServiceFile, ServiceRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

/// One service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CipService {
    /// Service code of the request.
    pub code: u8,
    /// Name in the standard.
    pub name: String,
    /// Need for instance 0: `R`, `O`, `C` or `-`.
    pub class: char,
    /// Need for an axis with each of the [`DEVICE_FUNCTIONS`], in their order: `R`, `O`, `C` or `-`.
    pub instance: String,
    /// Whether a message to the message router may carry it.
    pub explicit: bool,
    /// Whether the service data block of the CIP Motion connection may carry it.
    pub service_data_block: bool,
    /// Fields of the request data.
    pub request: Vec<String>,
    /// Fields of the response data.
    pub response: Vec<String>,
    /// Axis states in which it is taken; empty when in every one.
    pub states: String,
    /// What a bad request is answered; mostly empty.
    pub errors: String,
    /// Anything worth knowing; mostly empty.
    pub note: String,
    /// Table of the standard.
    pub source: String,
    /// Clause that describes it.
    pub clause: String,
}

/// The services, by code.
pub(super) fn resolve_services(file: &Parsed<CipServiceFile>, errors: &mut Findings) -> Vec<CipService> {
    let mut resolver = Resolver::new(&file.text, errors);
    resolver.head(&file.rows.format, "profile", &file.rows.profile, "cip-motion");
    let mut services: Vec<CipService> = Vec::with_capacity(file.rows.service.len());
    for row in &file.rows.service {
        let Some(service) = resolve_service(row, &mut resolver) else { continue };
        if services.iter().any(|known| known.code == service.code || known.name == service.name) {
            resolver.error(
                code::TWICE,
                row.code.span(),
                "code",
                "the service code or its name is defined twice",
            );
        }
        services.push(service);
    }
    services.sort_by_key(|service| service.code);
    services
}

fn resolve_service(row: &ServiceRow, resolver: &mut Resolver<'_>) -> Option<CipService> {
    const NEEDS: [(&str, char); 4] = [("R", 'R'), ("O", 'O'), ("C", 'C'), ("-", '-')];
    const CARRIERS: [(&str, bool); 2] = [("explicit", false), ("service_data_block", true)];
    let code = *row.code.get_ref();
    if code >= 0x80 {
        resolver.error(
            code::OUT_OF_RANGE,
            row.code.span(),
            "code",
            format!("expected a code below 0x80, got {code:#04x}"),
        );
        return None;
    }
    let class = resolver.word("class", &row.class, &NEEDS);
    let instance = row.instance.get_ref();
    if instance.chars().count() != DEVICE_FUNCTIONS.len()
        || !instance.chars().all(|need| "ROC-".contains(need))
    {
        let message =
            format!("expected {} letters of R, O, C and -, got `{instance}`", DEVICE_FUNCTIONS.len());
        resolver.error(code::OUT_OF_RANGE, row.instance.span(), "instance", message);
    }
    let (mut explicit, mut service_data_block) = (false, false);
    for carrier in &row.via {
        match resolver.word("via", carrier, &CARRIERS)? {
            false => explicit = true,
            true => service_data_block = true,
        }
    }
    if row.via.is_empty() {
        resolver.error(
            code::MISSING_KEY,
            row.name.span(),
            "via",
            "expected what may carry the service, got nothing",
        );
    }
    Some(CipService {
        code,
        name: row.name.get_ref().clone(),
        class: class?,
        instance: instance.clone(),
        explicit,
        service_data_block,
        request: row.request.clone(),
        response: row.response.clone(),
        states: row.states.clone().unwrap_or_default(),
        errors: row.errors.clone().unwrap_or_default(),
        note: row.note.clone().unwrap_or_default(),
        source: row.source.get_ref().clone(),
        clause: row.clause.clone(),
    })
}
