//! Whether a slave that comes later fits into what the telegrams have kept for it.

use crate::master::layout::{
    ConnectionNeed, ConnectionPlace, CyclicLayout, GAP_MAX_FIXED, SlaveNeed, SlavePlaces,
};
use crate::wire::header::Kind;
use crate::wire::idn::Idn;

/// Why a slave that comes later does not fit into what was kept for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Misfit {
    /// There is no place for it at all.
    #[error("the telegrams have no place for it")]
    Place,
    /// A connection is longer than its place, or has none.
    #[error("connection {instance} has {needed} bytes, {room} are kept for it")]
    Connection {
        /// Connection number.
        instance: u8,
        /// Its length with C-CON.
        needed: u16,
        /// The room there is.
        room: u16,
    },
    /// It needs more time than the others were told to leave.
    #[error("{idn} is {needed} ns, {available} ns are kept for it")]
    Time {
        /// The parameter.
        idn: Idn,
        /// Its value, ns.
        needed: u32,
        /// The largest that fits, ns.
        available: u32,
    },
    /// It has no S-0-1036, and the frames are further apart than such a slave stands.
    #[error("it has no S-0-1036, and frames are {bytes} bytes apart")]
    Gap {
        /// The inter frame gap, bytes.
        bytes: u16,
    },
}

impl CyclicLayout {
    /// Makes the place of a slave that comes in later the one of this slave. Nothing else moves: what does not fit is
    /// refused, and then nothing has changed.
    pub fn fit(&mut self, slave: usize, need: &SlaveNeed, gap_adjustable: bool) -> Result<(), Misfit> {
        let places = self.slaves.get_mut(slave).and_then(Option::as_mut).ok_or(Misfit::Place)?;
        let slowest = &self.slowest;
        let times = [
            (Idn::FEEDBACK_TIME, need.feedback_ns, slowest.feedback_ns),
            (Idn::AT_START, need.at_start_min_ns, slowest.at_start_min_ns),
            (Idn::SLAVE_JITTER, need.jitter_ns, slowest.jitter_ns),
            (Idn::CONSUMER_TIME, need.consumer_ns, slowest.consumer_ns),
        ];
        if let Some((idn, needed, available)) = times.into_iter().find(|(_, needed, most)| needed > most) {
            return Err(Misfit::Time { idn, needed, available });
        }
        if !gap_adjustable && u64::from(self.times.gap) > GAP_MAX_FIXED {
            return Err(Misfit::Gap { bytes: self.times.gap });
        }
        let place_of = |need: &ConnectionNeed, places: &SlavePlaces| {
            let kind = if need.slave_produces { Kind::At } else { Kind::Mdt };
            let same = |place: &ConnectionPlace| place.instance == need.instance && place.kind == kind;
            places.connections.iter().position(same)
        };
        for connection in &need.connections {
            let room = place_of(connection, places).map_or(0, |index| places.connections[index].room);
            if connection.len > room {
                let (instance, needed) = (connection.instance, connection.len);
                return Err(Misfit::Connection { instance, needed, room });
            }
        }
        for connection in &need.connections {
            if let Some(index) = place_of(connection, places) {
                places.connections[index].len = connection.len;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::master::layout::Timing;

    fn need(command: u16, feedback: u16) -> SlaveNeed {
        let connections = [(0, false, command), (1, true, feedback)]
            .into_iter()
            .map(|(instance, slave_produces, len)| ConnectionNeed { instance, slave_produces, len })
            .collect();
        SlaveNeed { connections, ..SlaveNeed::default() }
    }

    fn layout(needs: &[Option<&SlaveNeed>]) -> CyclicLayout {
        let timing = Timing {
            cycle_ns: 1_000_000,
            mst_jitter_ns: 45_000,
            slave_jitter_ns: 80,
            slave_delay_ns: 900,
            gap_adjustable: true,
            hot_plug_in_all: true,
        };
        let mut layout = CyclicLayout::with_capacity(needs.len());
        layout.compute(&timing, needs.iter().copied()).unwrap();
        layout
    }

    #[test]
    fn a_shorter_connection_fits_and_the_room_stays() {
        let kept = need(20, 30);
        let mut layout = layout(&[Some(&need(8, 12)), Some(&kept)]);
        let before = layout.clone();
        layout.fit(1, &need(8, 12), true).unwrap();
        let lens = |layout: &CyclicLayout| {
            let places = layout.slaves[1].as_ref().unwrap().connections.clone();
            places.iter().map(|place| (place.len, place.room)).collect::<Vec<_>>()
        };
        assert_eq!(lens(&layout), [(8, 20), (12, 30)]);
        assert_eq!(
            (layout.mdt_len, layout.at_len, layout.times),
            (before.mdt_len, before.at_len, before.times)
        );
        // The next one with this place may need all of it.
        layout.fit(1, &kept, true).unwrap();
        assert_eq!(layout, before);
    }

    #[test]
    fn every_misfit_has_its_numbers_and_changes_nothing() {
        let kept = SlaveNeed { feedback_ns: 1000, consumer_ns: 2000, ..need(20, 30) };
        let mut layout = layout(&[Some(&need(8, 12)), Some(&kept), None]);
        let t1 = layout.times.at_start_ns;
        let before = layout.clone();
        let longer = Misfit::Connection { instance: 1, needed: 32, room: 30 };
        let turned = {
            let mut turned = need(8, 8);
            turned.connections[0].slave_produces = true;
            turned
        };
        let time = |idn, needed, available| Misfit::Time { idn, needed, available };
        let cases = [
            (1, need(20, 32), true, longer),
            (1, turned, true, Misfit::Connection { instance: 0, needed: 8, room: 0 }),
            (2, need(8, 8), true, Misfit::Place),
            (3, need(8, 8), true, Misfit::Place),
            (1, SlaveNeed { feedback_ns: 1001, ..need(8, 8) }, true, time(Idn::FEEDBACK_TIME, 1001, 1000)),
            (1, SlaveNeed { at_start_min_ns: t1 + 1, ..need(8, 8) }, true, time(Idn::AT_START, t1 + 1, t1)),
            (1, SlaveNeed { jitter_ns: 81, ..need(8, 8) }, true, time(Idn::SLAVE_JITTER, 81, 80)),
            (1, SlaveNeed { consumer_ns: 2001, ..need(8, 8) }, true, time(Idn::CONSUMER_TIME, 2001, 2000)),
        ];
        for (slave, need, gap, wanted) in cases {
            assert_eq!(layout.fit(slave, &need, gap), Err(wanted), "{wanted}");
            assert_eq!(layout, before, "{wanted}");
        }
        layout.times.gap = 38;
        assert_eq!(layout.fit(1, &need(8, 8), false), Err(Misfit::Gap { bytes: 38 }));
        assert_eq!(layout.fit(1, &need(8, 8), true), Ok(()));
    }
}
