//! `axisbridge contacts`: how controllers opened their last connections, over the local socket of a running gateway.

use std::fmt::Write as _;
use std::process::ExitCode;

use serde_json::json;

use super::gateway_client::GatewayClient;
use super::status::PATIENCE;
use super::{CliError, ContactsArguments, print, write_file};
use crate::local::protocol::printable;
use crate::recording::Contact;

/// Version of the JSON object. It changes when a field gets another meaning, not when one is added.
const FORMAT: u32 = 1;

/// Shows the contacts, or one of them.
pub fn run(arguments: &ContactsArguments) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    let reply = client.ask("contacts")?;
    reply.end("contacts", "ok contacts N")?;
    let mut contacts: Vec<Contact> = reply.rows("contact")?.into_iter().map(|(_, contact)| contact).collect();
    if let Some(number) = arguments.number {
        contacts.retain(|contact| contact.number == number);
        if contacts.is_empty() {
            return Err(format!("there is no contact {number}").into());
        }
        if let Some(path) = &arguments.pcapng {
            write_file(path, &client.file(&format!("contact number={number}"))?)?;
        }
    }
    if arguments.json {
        return print(format!("{}\n", json!({ "format": FORMAT, "contacts": contacts })), ExitCode::SUCCESS);
    }
    print(text(&contacts), ExitCode::SUCCESS)
}

/// The contacts for a person.
fn text(contacts: &[Contact]) -> String {
    if contacts.is_empty() {
        return "No controller has opened a connection, and none was refused.\n".to_owned();
    }
    let mut out = String::new();
    for (place, contact) in contacts.iter().enumerate() {
        if place > 0 {
            out.push('\n');
        }
        let Contact { number, time, device, peer, kind, .. } = contact;
        let _ = writeln!(out, "{number}  {time}  {device}  {}", printable(&format!("{kind}, {peer}")));
        let mut row = |name: &str, text: &str| {
            let _ = writeln!(out, "  {name:<10}  {}", printable(text));
        };
        row("connection", &contact.connection);
        if contact.attempts > 1 {
            row("attempts", &format!("{}, the last one {}", contact.attempts, contact.last));
        }
        for phase in &contact.phases {
            row("reached", &format!("{} after {} ms", phase.phase.name(), phase.after_ms));
        }
        for refused in &contact.refused {
            let times = if refused.count > 1 { format!(", {} times", refused.count) } else { String::new() };
            let reason = &refused.reason;
            row("refused", &format!("{} after {} ms: {reason}{times}", refused.service, refused.after_ms));
        }
        if contact.refused_left_out > 0 {
            row("refused", &format!("{} more", contact.refused_left_out));
        }
        contact.awaited.iter().for_each(|awaited| row("awaited", awaited));
        match &contact.end {
            None => row("end", "the connection is open"),
            Some(end) => {
                let after = end.after_ms.map(|after| format!("after {after} ms, ")).unwrap_or_default();
                row("end", &format!("{after}{}", end.by));
            }
        }
        let left_out = match contact.frames_left_out {
            0 => String::new(),
            count => format!(", {count} left out for want of memory"),
        };
        row("frames", &format!("{}{left_out}", contact.frames));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::contact::{ContactEnd, Phase, PhaseReached, RefusedService};

    #[test]
    fn person_sees_how_far_each_controller_came() {
        let refusal = RefusedService {
            after_ms: 12,
            service: "Set_Axis_Attributes_List of axis instance 1, attribute 46".to_owned(),
            reason: "0x09 (invalid attribute value)".to_owned(),
            count: 2,
        };
        let open = Contact {
            number: 8,
            time: "2026-01-31T12:00:00.000000Z".to_owned(),
            device: "front".to_owned(),
            peer: "192.0.2.10:50000".to_owned(),
            kind: "motion".to_owned(),
            connection: "motion connection 1".to_owned(),
            attempts: 1,
            phases: vec![
                PhaseReached { phase: Phase::ForwardOpen, after_ms: 0 },
                PhaseReached { phase: Phase::Configuration, after_ms: 9 },
            ],
            refused: vec![refusal.clone()],
            refused_left_out: 3,
            awaited: vec![Phase::GroupSync.awaited().to_owned()],
            frames: 1_000,
            frames_left_out: 5,
            ..Contact::default()
        };
        let refused = Contact {
            number: 7,
            kind: "refused".to_owned(),
            attempts: 4_000,
            last: "2026-01-31T12:00:09.000000Z".to_owned(),
            phases: Vec::new(),
            refused: vec![RefusedService { count: 4_000, ..refusal }],
            refused_left_out: 0,
            awaited: Vec::new(),
            end: Some(ContactEnd { after_ms: Some(0), by: "ref\u{1b}used".to_owned() }),
            frames_left_out: 0,
            ..open.clone()
        };
        insta::assert_snapshot!(text(&[open, refused]));
        assert_eq!(text(&[]), "No controller has opened a connection, and none was refused.\n");
    }
}
