//! A picture of a translation: for each axis the command of the controller, what went to the drive, what the drive sent and what the
//! controller was told, over time, with losses and faults.

use std::fmt::Write as _;

use profile_generic::image::Signal;

use super::fact::{Direction, What, number_of, unit};
use super::{Entry, Mark, Stage};
use crate::mapping::check::escaped;

/// Points of a line; beyond them, pairs become their extremes.
const POINTS_MAX: usize = 8192;

/// Times the usual distance of points, beyond which a line has a gap.
const GAP: f64 = 10.0;

/// Marks of an axis.
const MARKS_MAX: usize = 200;

/// Measures of the picture, in its units.
const WIDTH: f64 = 1200.0;
const LEFT: f64 = 90.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 64.0;
const PANEL: f64 = 260.0;
const BETWEEN: f64 = 92.0;

/// The signals that are drawn: of the first pair that the axis has values of.
const PAIRS: [(Signal, Signal); 3] = [
    (Signal::PositionCommand, Signal::PositionActual),
    (Signal::VelocityCommand, Signal::VelocityActual),
    (Signal::TorqueCommand, Signal::TorqueActual),
];

/// The lines: where they were seen, colour, width, dashes, and name.
const LINES: [(Direction, &str, f64, &str, &str); 4] = [
    (Direction::FromController, "#1f77b4", 5.0, "", "command from the controller"),
    (Direction::ToDrive, "#ff7f0e", 2.6, "", "sent to the drive"),
    (Direction::FromDrive, "#2ca02c", 2.6, "7 4", "sent by the drive"),
    (Direction::ToController, "#c2185b", 3.2, "2 9", "reported to the controller"),
];

/// A line of the picture.
#[derive(Debug, Clone, Default)]
struct Series {
    points: Vec<(f64, f64)>,
}

impl Series {
    fn push(&mut self, time: f64, value: f64) {
        self.points.push((time, value));
        if self.points.len() >= POINTS_MAX {
            let fours = self.points.chunks(4);
            self.points = fours.flat_map(|four| extremes(four).into_iter().flatten()).collect();
        }
    }
}

/// The lowest and the highest point, in their order.
fn extremes(points: &[(f64, f64)]) -> [Option<(f64, f64)>; 2] {
    let low = points.iter().copied().min_by(|one, other| one.1.total_cmp(&other.1));
    let high = points.iter().copied().max_by(|one, other| one.1.total_cmp(&other.1));
    match (low, high) {
        (Some(low), Some(high)) if low.0 < high.0 => [Some(low), Some(high)],
        (Some(low), Some(high)) if low.0 > high.0 => [Some(high), Some(low)],
        _ => [low, None],
    }
}

/// An axis.
#[derive(Debug, Clone, Default)]
struct Panel {
    /// By pair of signals and line.
    series: [[Series; LINES.len()]; PAIRS.len()],
    faults: Vec<(f64, String)>,
}

/// What is drawn, gathered frame by frame in bounded memory.
#[derive(Debug, Clone)]
pub struct Plot {
    panels: Vec<Panel>,
    losses: Vec<(f64, String)>,
    end: f64,
}

impl Plot {
    /// An empty picture of so many axes.
    #[must_use]
    pub fn new(axes: usize) -> Self {
        Self { panels: vec![Panel::default(); axes], losses: Vec::new(), end: 0.0 }
    }

    /// Takes the values of a frame. The lines of a list, which have no times, are a second apart.
    pub fn take(&mut self, stage: &Stage, entry: &Entry) {
        let time = entry.place.time.map_or_else(
            || number_of(i64::try_from(entry.place.number).unwrap_or(i64::MAX)),
            |time| number_of(time) / 1e9,
        );
        self.end = self.end.max(time);
        let Self { panels, losses, .. } = self;
        entry.tree.walk(&mut |node| {
            if node.mark == Mark::Note && losses.len() < MARKS_MAX {
                let text = node.text.split_once("note: ").map_or(node.text.as_str(), |(_, text)| text);
                losses.push((time, text.to_owned()));
            }
            for fact in &node.facts {
                let Some(panel) = panels.get_mut(fact.axis) else { continue };
                match fact.what {
                    What::Fault(Some(cause)) if panel.faults.len() < MARKS_MAX => {
                        panel.faults.push((time, cause.to_string()))
                    }
                    // What the gateway would send, or report, of this frame alone is not what went over the wire.
                    What::Signal(signal, Some(value)) if fact.recorded => {
                        let pair =
                            PAIRS.iter().position(|(command, actual)| [*command, *actual].contains(&signal));
                        let line = LINES.iter().position(|(direction, ..)| *direction == fact.direction);
                        if let (Some(pair), Some(line)) = (pair, line) {
                            let (_, decimals) = unit(stage.axes[fact.axis].scaling.kind, signal.quantity());
                            let value = number_of(value) / 10_f64.powi(decimals.into());
                            panel.series[pair][line].push(time, value);
                        }
                    }
                    _ => {}
                }
            }
        });
    }

    /// The picture.
    #[must_use]
    pub fn svg(&self, stage: &Stage, title: &str) -> String {
        let drawn: Vec<(usize, usize)> = self
            .panels
            .iter()
            .enumerate()
            .filter_map(|(axis, panel)| {
                let led =
                    |pair: usize| panel.series[pair][..2].iter().any(|series| !series.points.is_empty());
                let any = |pair: usize| panel.series[pair].iter().any(|series| !series.points.is_empty());
                (0..PAIRS.len())
                    .find(|pair| led(*pair))
                    .or_else(|| (0..PAIRS.len()).find(|pair| any(*pair)))
                    .map(|pair| (axis, pair))
            })
            .collect();
        let height = drawn.iter().fold(TOP + 30.0, |height, _| height + PANEL + BETWEEN);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
             font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\" font-size=\"14\" fill=\"#222\">\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
             <text x=\"{LEFT}\" y=\"28\" font-size=\"18\" font-weight=\"bold\">{}</text>\n",
            escaped(title)
        );
        legend(&mut out);
        for (place, (axis, pair)) in drawn.iter().enumerate() {
            let top = (0..place).fold(TOP + 24.0, |top, _| top + PANEL + BETWEEN);
            self.panel(&mut out, stage, *axis, *pair, top);
        }
        if drawn.is_empty() {
            let _ = writeln!(out, "<text x=\"{LEFT}\" y=\"{}\">no values of an axis</text>", TOP + 20.0);
        }
        out + "</svg>\n"
    }

    fn panel(&self, out: &mut String, stage: &Stage, axis: usize, pair: usize, top: f64) {
        let (panel, known) = (&self.panels[axis], &stage.axes[axis]);
        let quantity = PAIRS[pair].0.quantity();
        let (name, _) = unit(known.scaling.kind, quantity);
        let all = || panel.series[pair].iter().flat_map(|series| &series.points);
        let low = all().map(|point| point.1).fold(f64::INFINITY, f64::min);
        let high = all().map(|point| point.1).fold(f64::NEG_INFINITY, f64::max);
        let (first, step, count) = ticks(low, high, 6);
        let last = first + step * f64::from(count);
        let (time_first, time_step, time_count) = ticks(0.0, self.end.max(1e-3), 10);
        let time_last = self.end.max(1e-3);
        let (width, bottom) = (WIDTH - LEFT - RIGHT, top + PANEL);
        let x = |time: f64| LEFT + (time / time_last).clamp(0.0, 1.0) * width;
        let y = |value: f64| bottom - (value - first) / (last - first) * PANEL;
        let title = escaped(&format!("{} on {}: {} in {name}", known.name, known.drive, quantity.name()));
        let _ = writeln!(out, "<text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{title}</text>", top - 10.0);
        for tick in 0..=count {
            let value = first + step * f64::from(tick);
            let at = y(value);
            let _ = writeln!(
                out,
                "<line x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#e0e0e0\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT + width,
                LEFT - 8.0,
                at + 5.0,
                label(value, step)
            );
        }
        for tick in 0..=time_count {
            let time = time_first + time_step * f64::from(tick);
            if time > time_last {
                continue;
            }
            let at = x(time);
            let _ = writeln!(
                out,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\" stroke=\"#e0e0e0\"/>\
                 <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 20.0,
                label(time, time_step)
            );
        }
        let _ = writeln!(
            out,
            "<rect x=\"{LEFT}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{PANEL}\" fill=\"none\" stroke=\"#888\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">time in s</text>",
            LEFT + width,
            bottom + 40.0
        );
        for (series, (_, colour, stroke, dashes, _)) in panel.series[pair].iter().zip(LINES) {
            if series.points.is_empty() {
                continue;
            }
            let path = path(&series.points, &x, &y);
            let opacity = if stroke > 4.0 { 0.4 } else { 1.0 };
            let _ = writeln!(
                out,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{stroke}\" stroke-opacity=\"{opacity}\" \
                 stroke-dasharray=\"{dashes}\" stroke-linejoin=\"round\"/>"
            );
        }
        marks(out, &self.losses, "#b8860b", &x, top, bottom, top + PANEL - 8.0);
        marks(out, &panel.faults, "#d62728", &x, top, bottom, top + 16.0);
    }
}

/// A line through points, with a gap where nothing came for many times their usual distance: an axis in another mode, a loss.
fn path(points: &[(f64, f64)], x: &dyn Fn(f64) -> f64, y: &dyn Fn(f64) -> f64) -> String {
    let (mut path, mut before) = (String::new(), None);
    let usual = match (points.first(), points.last()) {
        (Some(first), Some(last)) => {
            (last.0 - first.0) / number_of(i64::try_from(points.len()).unwrap_or(i64::MAX))
        }
        _ => 0.0,
    };
    for (time, value) in points {
        let goes_on = before.is_some_and(|before| time - before <= usual * GAP);
        // Writing to a string does not fail.
        let _ = write!(path, "{}{:.1} {:.1}", if goes_on { "L" } else { "M" }, x(*time), y(*value));
        before = Some(*time);
    }
    path
}

/// Vertical lines with their texts, as far as these do not cover one another.
fn marks(
    out: &mut String,
    marks: &[(f64, String)],
    colour: &str,
    x: &dyn Fn(f64) -> f64,
    top: f64,
    bottom: f64,
    line: f64,
) {
    let mut free = 0.0;
    for (time, text) in marks {
        let at = x(*time);
        let text = escaped(text);
        let _ = writeln!(
            out,
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{top:.1}\" y2=\"{bottom:.1}\" stroke=\"{colour}\" stroke-width=\"1.5\">\
             <title>{text}</title></line>"
        );
        let width = number_of(i64::try_from(text.chars().count()).unwrap_or(i64::MAX)) * 6.6;
        if at < free {
            continue;
        }
        let is_left = at + width > WIDTH - RIGHT;
        let (anchor, place) = if is_left { ("end", at - 5.0) } else { ("start", at + 5.0) };
        let _ = writeln!(
            out,
            "<text x=\"{place:.1}\" y=\"{line:.1}\" fill=\"{colour}\" font-size=\"12\" text-anchor=\"{anchor}\">{text}</text>"
        );
        free = at + if is_left { 0.0 } else { width + 12.0 };
    }
}

fn legend(out: &mut String) {
    let mut at = LEFT;
    for (_, colour, stroke, dashes, name) in LINES {
        let _ = writeln!(
            out,
            "<line x1=\"{at}\" x2=\"{}\" y1=\"48\" y2=\"48\" stroke=\"{colour}\" stroke-width=\"{stroke}\" \
             stroke-dasharray=\"{dashes}\" stroke-opacity=\"{}\"/><text x=\"{}\" y=\"53\">{name}</text>",
            at + 34.0,
            if stroke > 4.0 { 0.4 } else { 1.0 },
            at + 42.0
        );
        at += 262.0;
    }
}

/// First tick, distance and number of distances, so that both ends are within.
fn ticks(low: f64, high: f64, wanted: u32) -> (f64, f64, u32) {
    let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
    let span = if high - low > 1e-9 { high - low } else { (high.abs() * 0.1).max(1.0) };
    let rough = span / f64::from(wanted);
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step).floor() * step;
    let count = (1..100).find(|count| first + step * f64::from(*count) >= high - step * 1e-9).unwrap_or(100);
    (first, step, count)
}

/// A number with as many decimals as the distance of the ticks needs.
fn label(value: f64, step: f64) -> String {
    let decimals = (0..9).find(|decimals| step * 10_f64.powi(*decimals) >= 0.999).unwrap_or(9);
    let decimals = usize::try_from(decimals).unwrap_or(0);
    // No minus before a zero.
    let value = if value.abs() < step * 1e-6 { 0.0 } else { value };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::mapping::Mapping;
    use crate::translate::fact::Fact;
    use crate::translate::{Node, Place};

    #[test]
    fn ticks_are_round_and_hold_both_ends() {
        assert_eq!(ticks(0.0, 6.47, 10), (0.0, 1.0, 7));
        assert_eq!(ticks(-0.2, 9.7, 6), (-2.0, 2.0, 6));
        assert_eq!(ticks(f64::INFINITY, f64::NEG_INFINITY, 6).0, 0.0);
        assert_eq!([label(0.5, 0.1), label(-0.0, 2.0), label(20.0, 10.0)], ["0.5", "0", "20"]);
    }

    #[test]
    fn many_points_keep_their_extremes() {
        let mut series = Series::default();
        for place in 0..100_000 {
            series.push(f64::from(place), if place == 54_321 { 7.0 } else { f64::from(place % 3) });
        }
        assert!(series.points.len() < POINTS_MAX);
        assert!(series.points.contains(&(54_321.0, 7.0)));
    }

    #[test]
    fn lines_losses_and_faults_are_drawn() {
        let config = Config::parse(include_str!("../cli/demo/two-axes.toml"), "demo.toml").unwrap();
        let stage = Stage::rehearse(&config, Mapping::embedded().unwrap()).unwrap();
        let mut plot = Plot::new(stage.axes.len());
        let fact = |direction, what| Fact { axis: 0, direction, recorded: true, what, raw: None };
        for (number, turns) in [(1, 0), (2, 1), (3, 2)] {
            let value = Some(turns * 1_000_000_000);
            let facts = [
                fact(Direction::FromController, What::Signal(Signal::PositionCommand, value)),
                fact(Direction::FromDrive, What::Signal(Signal::PositionActual, value)),
            ];
            let place = Place { number, time: Some(turns * 1_000_000_000), offset: 0 };
            plot.take(&stage, &Entry { place, tree: Node::new("frame").shows(facts) });
        }
        let place = Place { number: 4, time: Some(1_500_000_000), offset: 0 };
        let lost = Node::new("frame 4: note: 3 updates are missing").marked(Mark::Note);
        plot.take(&stage, &Entry { place, tree: lost });
        let cause = profile_generic::fault::FaultCause::MOTOR_STALLED;
        plot.take(
            &stage,
            &Entry {
                place,
                tree: Node::new("fault").shows([fact(Direction::FromDrive, What::Fault(Some(cause)))]),
            },
        );
        let svg = plot.svg(&stage, "test <1>");
        for wanted in [
            "test &lt;1&gt;",
            "turntable on drive-a: position in rev",
            "M90.0 348.0L633.0 218.0L1176.0 88.0",
            "3 updates are missing",
            &escaped(&cause.to_string()),
        ] {
            assert!(svg.contains(wanted), "{wanted} in {svg}");
        }
        assert_eq!(svg.matches("<path").count(), 2);
        assert!(!svg.contains("slide"), "an axis without values has no panel");
    }
}
