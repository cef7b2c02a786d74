//! A drawing of three columns of names and the lines between them.

use std::fmt::Write as _;

use super::escaped;

/// From one box of a column to the next, and the height of a box, in pixels.
const STEP: usize = 26;
const BOX: usize = 20;
/// Between two columns.
const GAP: usize = 110;
/// Of a letter, about, and beside a text.
const LETTER: usize = 7;
const EDGE: usize = 8;

/// A side of the generic column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// The controller, or SERCOS beside CiA 402.
    Left,
    /// The drives.
    Right,
}

/// A name beside the generic column: its text, and the class by which it is coloured.
type Outer = (String, &'static str);

/// Names of the generic model in the middle, and what belongs to them on both sides.
pub(super) struct Diagram {
    titles: [&'static str; 3],
    middle: Vec<String>,
    sides: [Vec<Outer>; 2],
    /// Side, place there, place in the middle.
    lines: Vec<(Side, usize, usize)>,
}

impl Diagram {
    /// A drawing with the titles of the columns and the names in the middle.
    pub fn new(titles: [&'static str; 3], middle: impl IntoIterator<Item = &'static str>) -> Self {
        let middle = middle.into_iter().map(str::to_owned).collect();
        Self { titles, middle, sides: [Vec::new(), Vec::new()], lines: Vec::new() }
    }

    /// Adds a name to a side, if it is not there, and joins it with one of the middle.
    pub fn join(&mut self, middle: &str, side: Side, class: &'static str, text: String) {
        let Some(at) = self.middle.iter().position(|known| known == middle) else { return };
        let outer = &mut self.sides[usize::from(side == Side::Right)];
        let place = outer.iter().position(|known| known.0 == text && known.1 == class).unwrap_or(outer.len());
        if place == outer.len() {
            outer.push((text, class));
        }
        self.lines.push((side, place, at));
    }

    /// Puts the names of both sides into the order of what they are joined with: fewer lines cross.
    fn sort(&mut self) {
        for (side, names) in [Side::Left, Side::Right].into_iter().zip(&mut self.sides) {
            let first = |place: usize| {
                let own = self.lines.iter().filter(|&&(known, at, _)| known == side && at == place);
                own.map(|&(.., middle)| middle).min()
            };
            let mut order: Vec<usize> = (0..names.len()).collect();
            order.sort_by_key(|&place| (names[place].1, first(place)));
            *names = order.iter().map(|&place| names[place].clone()).collect();
            for (_, place, _) in self.lines.iter_mut().filter(|(known, ..)| *known == side) {
                *place = order.iter().position(|old| old == place).unwrap_or(*place);
            }
        }
    }

    /// Draws it. Names that nothing joins are marked.
    pub fn draw(mut self, page: &mut String, title: &str) {
        self.sort();
        let [left, right] = &self.sides;
        let width = |names: &mut dyn Iterator<Item = &str>, title: &str| {
            names.map(|name| name.chars().count()).max().unwrap_or(0).max(title.len()) * LETTER + 2 * EDGE
        };
        let outer =
            |names: &[Outer], title: &str| width(&mut names.iter().map(|(text, _)| text.as_str()), title);
        let widths = [
            outer(left, self.titles[0]),
            width(&mut self.middle.iter().map(String::as_str), self.titles[1]),
            outer(right, self.titles[2]),
        ];
        let x = [0, widths[0] + GAP, widths[0] + GAP + widths[1] + GAP];
        let rows = left.len().max(self.middle.len()).max(right.len());
        let (all, high) = (x[2] + widths[2], (rows + 1) * STEP);
        // Each column is spread over the whole height.
        let y = |index: usize, count: usize| STEP + (2 * index + 1) * rows * STEP / (2 * count.max(1));
        let _ = writeln!(
            page,
            "<h3>{0}</h3>\n<svg viewBox=\"0 0 {all} {high}\" width=\"{all}\" role=\"img\" aria-label=\"{0}\">",
            escaped(title)
        );
        for (column, text) in self.titles.iter().enumerate() {
            let _ =
                writeln!(page, "<text class=\"title\" x=\"{}\" y=\"14\">{}</text>", x[column], escaped(text));
        }
        for &(side, outer, middle) in &self.lines {
            let at = y(middle, self.middle.len());
            let (from, to) = match side {
                Side::Left => ((widths[0], y(outer, left.len())), (x[1], at)),
                Side::Right => ((x[1] + widths[1], at), (x[2], y(outer, right.len()))),
            };
            let half = usize::midpoint(from.0, to.0);
            let _ = writeln!(
                page,
                "<path d=\"M{} {}C{half} {} {half} {} {} {}\"/>",
                from.0, from.1, from.1, to.1, to.0, to.1
            );
        }
        let mut draw = |x: usize, y: usize, width: usize, class: &str, text: &str| {
            let _ = writeln!(
                page,
                "<g class=\"{class}\"><rect x=\"{x}\" y=\"{}\" width=\"{width}\" height=\"{BOX}\" rx=\"3\"/>\
                 <text x=\"{}\" y=\"{}\">{}</text></g>",
                y - BOX / 2,
                x + EDGE,
                y + 4,
                escaped(text)
            );
        };
        for (column, names) in [(0, left), (2, right)] {
            for (index, (text, class)) in names.iter().enumerate() {
                draw(x[column], y(index, names.len()), widths[column], class, text);
            }
        }
        for (index, text) in self.middle.iter().enumerate() {
            let joined = |side| self.lines.iter().any(|&(own, _, at)| own == side && at == index);
            let sides = [(Side::Left, left), (Side::Right, right)];
            let whole = sides.iter().all(|(side, names)| names.is_empty() || joined(*side));
            let class = if whole { "generic" } else { "generic part" };
            draw(x[1], y(index, self.middle.len()), widths[1], class, text);
        }
        page.push_str("</svg>\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_on_one_side_only_is_marked() {
        let mut diagram = Diagram::new(["north", "generic", "south"], ["ready", "operating"]);
        diagram.join("ready", Side::Left, "cip", "Stopped".to_owned());
        diagram.join("operating", Side::Left, "cip", "Running".to_owned());
        diagram.join("operating", Side::Right, "sercos", "a < b".to_owned());
        diagram.join("operating", Side::Right, "sercos", "a < b".to_owned());
        diagram.join("no such state", Side::Right, "sercos", "c".to_owned());
        let mut page = String::new();
        diagram.draw(&mut page, "States");
        assert_eq!(page.matches("<path").count(), 4);
        assert_eq!(page.matches("a &lt; b").count(), 1, "each name once");
        let marked: Vec<&str> = page.lines().filter(|line| line.contains("generic part")).collect();
        assert!(marked.len() == 1 && marked[0].contains(">ready<"), "{marked:?}");
    }
}
