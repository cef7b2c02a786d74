//! What a user's Modbus TCP client sees of the axes.
//!
//! The register numbers are written out here from `docs/modbus.md` and not taken from the gateway: a map that
//! has moved is found.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio_modbus::client::{Context, Reader as _, tcp};

/// Map version, state, phase, axis count, connections, address of the first axis block, length of a block.
const HEADER: (u16, u16) = (0, 7);
const MAP_VERSION: usize = 0;
const AXIS_COUNT: usize = 3;
const AXES_ADDRESS: usize = 5;
const BLOCK_LENGTH: usize = 6;

/// First register of the counters, each of four registers, and their count: late_cycles, lost_updates, lost_telegrams,
/// refused_frames.
const COUNTERS: (u16, u16) = (20, 16);

/// The map these numbers are of.
const VERSION: u16 = 1;

/// Registers of an axis block that are read.
const AXIS_LEN: u16 = 42;
const CIP_AXIS_STATE: usize = 3;
const FAULT_CAUSE: usize = 5;
const POSITION: usize = 12;

/// The value of Axis State while an axis can move.
const CIP_RUNNING: u16 = 4;

/// What was seen of one axis in two looks at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisSeen {
    /// Its CIP axis state was Running both times.
    pub running: bool,
    /// Its actual position had changed.
    pub moved: bool,
    /// Actual position at the second look, in 1e-9 revolution or millimetre.
    pub position: i64,
    /// CIP axis state at the second look.
    pub cip_axis_state: u16,
    /// Generic fault cause at the second look, 0 for none.
    pub fault_cause: u16,
}

/// Counters of the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counters {
    /// Cycles that began more than half a cycle late.
    pub late_cycles: u64,
    /// Updates of the controller that did not come, or came too late.
    pub lost_updates: u64,
    /// Bus cycles without the data of a drive.
    pub lost_telegrams: u64,
    /// Frames and datagrams that the cycle had to refuse.
    pub refused_frames: u64,
}

/// Reads the counters of the box at `address`, with a connection of its own.
///
/// # Errors
/// As [`watch`].
pub async fn counters(address: SocketAddr) -> io::Result<Counters> {
    let mut client = tcp::connect(address).await?;
    let registers = read(&mut client, COUNTERS.0, COUNTERS.1).await?;
    let mut numbers = registers
        .chunks_exact(4)
        .map(|words| words.iter().fold(0_u64, |value, word| value << 16 | u64::from(*word)));
    let mut next = || numbers.next().ok_or_else(|| io::Error::other("expected four counters"));
    Ok(Counters {
        late_cycles: next()?,
        lost_updates: next()?,
        lost_telegrams: next()?,
        refused_frames: next()?,
    })
}

#[derive(Debug, Clone, Copy)]
struct Look {
    cip_axis_state: u16,
    fault_cause: u16,
    position: i64,
}

/// Reads every axis of the box at `address` twice, `interval` apart, with a connection of its own.
///
/// # Errors
/// The connection failed, the server refused, or the map is not the one of `docs/modbus.md`.
pub async fn watch(address: SocketAddr, interval: Duration) -> io::Result<Vec<AxisSeen>> {
    let mut client = tcp::connect(address).await?;
    let header = read(&mut client, HEADER.0, HEADER.1).await?;
    if header[MAP_VERSION] != VERSION {
        let message = format!("map version: expected {VERSION}, found {}", header[MAP_VERSION]);
        return Err(io::Error::other(message));
    }
    let first = look(&mut client, &header).await?;
    tokio::time::sleep(interval).await;
    let second = look(&mut client, &header).await?;
    let seen = first.iter().zip(&second).map(|(before, after)| AxisSeen {
        running: before.cip_axis_state == CIP_RUNNING && after.cip_axis_state == CIP_RUNNING,
        moved: before.position != after.position,
        position: after.position,
        cip_axis_state: after.cip_axis_state,
        fault_cause: after.fault_cause,
    });
    Ok(seen.collect())
}

async fn look(client: &mut Context, header: &[u16]) -> io::Result<Vec<Look>> {
    let mut axes = Vec::new();
    for axis in 0..header[AXIS_COUNT] {
        let address =
            axis.checked_mul(header[BLOCK_LENGTH]).and_then(|from| from.checked_add(header[AXES_ADDRESS]));
        let address =
            address.ok_or_else(|| io::Error::other(format!("the block of axis {axis} is beyond the map")))?;
        let block = read(client, address, AXIS_LEN).await?;
        let words = [POSITION, POSITION + 1, POSITION + 2, POSITION + 3].map(|register| block[register]);
        let position = words.iter().fold(0_u64, |value, word| value << 16 | u64::from(*word)).cast_signed();
        axes.push(Look { cip_axis_state: block[CIP_AXIS_STATE], fault_cause: block[FAULT_CAUSE], position });
    }
    Ok(axes)
}

/// `count` input registers from `address` on.
async fn read(client: &mut Context, address: u16, count: u16) -> io::Result<Vec<u16>> {
    let answer = client.read_input_registers(address, count).await.map_err(io::Error::other)?;
    let registers =
        answer.map_err(|exception| io::Error::other(format!("register {address}: {exception}")))?;
    if registers.len() != usize::from(count) {
        let message = format!("register {address}: expected {count} registers, found {}", registers.len());
        return Err(io::Error::other(message));
    }
    Ok(registers)
}

#[cfg(test)]
mod tests {
    use axisbridge::latest::latest;
    use axisbridge::modbus::ModbusServer;
    use axisbridge::status::{AxisStatus, BoxStatus};
    use profile_generic::fault::FaultCause;
    use profile_generic::quantity::Position;

    use super::*;

    #[tokio::test]
    async fn axes_are_seen_as_the_box_shows_them() {
        let mut status = BoxStatus { axis_count: 3, ..BoxStatus::STARTING };
        let running = AxisStatus { instance: 1, cip_axis_state: 4, ..AxisStatus::NONE };
        status.axes[0] = running;
        status.axes[1] = AxisStatus { position: Position(-5_000_000_001), ..running };
        let fault = Some(FaultCause(0x0905));
        status.axes[2] = AxisStatus { cip_axis_state: 8, fault, ..running };
        let (mut publisher, reader) = latest(status);
        let server = ModbusServer::bind(SocketAddr::from(([127, 0, 0, 1], 0)), 1).await.unwrap();
        let address = server.local_address().unwrap();
        let server = tokio::spawn(server.run(reader));
        let interval = Duration::from_millis(200);
        let watching = tokio::spawn(watch(address, interval));
        tokio::time::sleep(interval / 2).await;
        status.axes[0].position = Position(0x1_2A05_F200);
        publisher.publish(&status);
        let seen = watching.await.unwrap().unwrap();
        let still = AxisSeen {
            running: true,
            moved: false,
            position: -5_000_000_001,
            cip_axis_state: 4,
            fault_cause: 0,
        };
        let moving = AxisSeen { moved: true, position: 5_000_000_000, ..still };
        let faulted =
            AxisSeen { running: false, position: 0, cip_axis_state: 8, fault_cause: 0x0905, ..still };
        assert_eq!(seen, [moving, still, faulted]);
        server.abort();
    }
}
