//! A table of outcomes as text.

use std::fmt::Write as _;

use axisbridge_tests::rig::Rig;

use crate::chain::Chain;
use crate::scenario::{Moment, Outcome, run};

/// What a disturbance does to the rig at each moment.
type Act = dyn Fn(&mut Rig, Moment);

/// A disturbance: its name, and what it does to the rig at each moment.
pub struct Disturbance {
    /// Name of the row.
    pub name: String,
    /// What it does.
    pub act: Box<Act>,
}

impl Disturbance {
    /// One that acts by itself at each moment.
    pub fn new(name: impl Into<String>, act: impl Fn(&mut Rig, Moment) + 'static) -> Self {
        Self { name: name.into(), act: Box::new(act) }
    }

    /// One that acts at one moment.
    pub fn at(moment: Moment, name: impl Into<String>, act: impl Fn(&mut Rig) + 'static) -> Self {
        Self::new(name, move |rig, now| {
            if now == moment {
                act(rig);
            }
        })
    }

    /// One that acts in the acceleration and again at constant velocity.
    pub fn twice(name: impl Into<String>, act: impl Fn(&mut Rig) + 'static) -> Self {
        Self::new(name, move |rig, now| {
            if matches!(now, Moment::Accelerating | Moment::Constant) {
                act(rig);
            }
        })
    }
}

/// Rows of a table.
#[derive(Debug, Default)]
pub struct Table {
    text: String,
    rows: usize,
}

impl Table {
    /// Tries disturbances on every chain.
    pub fn of(disturbances: impl Fn(Chain) -> Vec<Disturbance>) -> Self {
        let mut table = Self::default();
        for chain in Chain::ALL {
            for Disturbance { name, act } in disturbances(chain) {
                table.add(chain, &name, &run(chain, &*act));
            }
        }
        table
    }

    /// Adds a row.
    pub fn add(&mut self, chain: Chain, name: &str, outcome: &Outcome) {
        if self.rows == 0 {
            let head = ["deviation", "ripple", "acceleration", "lost"];
            let [deviation, ripple, acceleration, lost] = head;
            writeln!(
                self.text,
                "{:<15} {:<34} {deviation:>11} {ripple:>9} {acceleration:>13} {lost:>4}  end; faults",
                "chain", "disturbance"
            )
            .expect("a string takes everything");
        }
        self.rows += 1;
        let Outcome { statistics, lost, faults, end } = outcome;
        let deviation = statistics.percent(statistics.deviation);
        let ripple = statistics.percent(statistics.ripple());
        let acceleration = statistics.acceleration / 1e9;
        let mut line = format!(
            "{chain:<15} {name:<34} {deviation:>9.1} % {ripple:>7.2} % {acceleration:>7.0} rev/s² {lost:>4}  {end}"
        );
        for (separator, fault) in std::iter::once("; ").chain(std::iter::repeat(", ")).zip(faults) {
            line.push_str(separator);
            line.push_str(fault);
        }
        writeln!(self.text, "{line}").expect("a string takes everything");
    }

    /// The table; says how many rows it has.
    pub fn finish(self) -> String {
        println!("rows: {}", self.rows);
        self.text
    }
}
