//! HP2: the new slave is set up over its service channel as in CP2 and CP3, while CP4 goes on.

use super::stage::{Stage, StageEvent};
use super::{Admission, HotPlugRefusal};
use crate::master::event::{Event, SlaveId};
use crate::master::network::Network;
use crate::master::plan::{self, Step};
use crate::master::startup::make_ends;
use crate::master::station::Work;
use crate::wire::header::Phase;

/// What the master itself does in a stage, and the phase whose check `CHECK` means.
const fn steps(stage: Stage) -> Option<(&'static [Step], Phase)> {
    match stage {
        Stage::Read => Some((plan::READ, Phase::CP2)),
        Stage::Connect => Some((plan::CONNECT, Phase::CP2)),
        Stage::Write => Some((plan::WRITE, Phase::CP2)),
        Stage::Measure => Some((plan::MEASURE, Phase::CP2)),
        Stage::Check2 => Some((plan::CHECK, Phase::CP2)),
        Stage::Check3 => Some((plan::CHECK, Phase::CP3)),
        _ => None,
    }
}

impl Admission {
    pub(super) fn enter_set_up(&mut self, net: &mut Network, stage: Stage) {
        let Some(index) = self.newcomer.slave else { return };
        let station = &mut net.stations[index];
        station.channel.set_open(stage.serves());
        let awaits = match stage {
            Stage::Await2 => {
                station.setup.read_rows = station.setup.report.len();
                Some(Phase::CP2)
            }
            Stage::Await3 => Some(Phase::CP3),
            _ => None,
        };
        if let Some(phase) = awaits {
            let (slave, address) = (SlaveId::from_index(index), station.address);
            net.emit(Event::HotPlugAwaits { slave, address, phase });
        }
        if steps(stage).is_some() {
            net.begin_steps(index);
        }
        if stage == Stage::Connect {
            net.begin_connections(index);
        }
    }

    /// One cycle of a stage in which the slave is set up.
    pub(super) fn set_up_slave(&mut self, net: &mut Network) -> Result<Option<StageEvent>, HotPlugRefusal> {
        let Some(index) = self.newcomer.slave else { return Err(HotPlugRefusal::SetUp) };
        let stage = self.stage;
        let Some((steps, phase)) = steps(stage) else {
            // The application works, until it is through and its requests are too.
            let through = self.newcomer.proceed && net.stations[index].channel.is_idle();
            return Ok(through.then_some(StageEvent::Done));
        };
        match net.work_on(index, steps, phase) {
            Work::Free | Work::Asked(..) => Ok(None),
            Work::Failed => Err(HotPlugRefusal::SetUp),
            Work::Done if stage == Stage::Connect => {
                let station = &mut net.stations[index];
                net.layout.fit(index, &station.need, station.facts.gap)?;
                make_ends(station);
                Ok(Some(StageEvent::Done))
            }
            Work::Done if matches!(stage, Stage::Check2 | Stage::Check3) => {
                // The application's running requests are finished first.
                let channel = &mut net.stations[index].channel;
                channel.set_open(false);
                Ok((!channel.is_running()).then_some(StageEvent::Done))
            }
            Work::Done => Ok(Some(StageEvent::Done)),
        }
    }
}
