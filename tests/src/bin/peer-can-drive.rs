//! `peer-can-drive FAMILY NODE INTERFACE [ORDERS]`: a drive of the crate `axisbridge-peers` on a CAN interface of this kernel. Once a line
//! in the file ORDERS says `fail CODE` (hexadecimal) it has that error; `mend` takes its cause away.

use std::fs;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use axisbridge_peers::can::{Frame, Station as _};
use axisbridge_peers::can_drive::{CanDrive, Settings};
use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Frame as _, Socket as _, StandardId};

/// How often time passes in the drive.
const TICK: Duration = Duration::from_millis(1);

fn family(name: &str) -> Option<Settings> {
    Some(match name {
        "epos" => Settings::epos_like(),
        "oriental" => Settings::oriental_like(),
        "faulhaber" => Settings::faulhaber_like(),
        _ => return None,
    })
}

/// What goes to the bus.
fn sent(frame: &Frame) -> Option<CanFrame> {
    let id = StandardId::new(frame.id)?;
    if frame.remote { CanFrame::new_remote(id, 0) } else { CanFrame::new(id, &frame.data) }
}

fn run(settings: Settings, interface: &str, orders: Option<&str>) -> Result<(), Box<dyn std::error::Error>> {
    let socket = CanSocket::open(interface)?;
    socket.set_read_timeout(TICK)?;
    let begin = Instant::now();
    let mut drive = CanDrive::new(settings);
    let (mut said, mut obeyed, mut told) = (Vec::new(), 0, 0);
    loop {
        let heard = socket.read_frame();
        let now = u64::try_from(begin.elapsed().as_micros())?;
        if let Ok(frame) = heard {
            let id = u16::try_from(frame.raw_id() & 0x7FF)?;
            let remote = frame.is_remote_frame();
            let data = if remote { Vec::new() } else { frame.data().to_vec() };
            drive.hear(now, &Frame { id, remote, data }, &mut said);
        }
        drive.tick(now, &mut said);
        for frame in said.drain(..) {
            if let Some(frame) = sent(&frame) {
                // A full queue loses it, as on a wire.
                let _ = socket.write_frame(&frame);
            }
        }
        let text = orders.and_then(|path| fs::read_to_string(path).ok()).unwrap_or_default();
        for line in text.lines().skip(obeyed) {
            obeyed += 1;
            match line.split_once(' ') {
                Some(("fail", code)) => drive.fail(u16::from_str_radix(code, 16)?),
                _ => drive.mend(),
            }
        }
        for (at, what) in &drive.log()[told..] {
            eprintln!("{}.{:06} {what}", at / 1_000_000, at % 1_000_000);
        }
        told = drive.log().len();
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let known = match words.as_slice() {
        [family_name, node, interface, orders @ ..] => {
            family(family_name).zip(node.parse::<u8>().ok()).map(|(mut settings, node_id)| {
                // It counts encoder increments whatever a feed constant says.
                settings.missing.push((0x6092, None));
                (Settings { node_id, ..settings }, interface, orders.first())
            })
        }
        _ => None,
    };
    let Some((settings, interface, orders)) = known else {
        eprintln!("error: expected epos, oriental or faulhaber, a node-id and an interface");
        return ExitCode::from(2);
    };
    match run(settings, interface, orders.map(String::as_str)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
