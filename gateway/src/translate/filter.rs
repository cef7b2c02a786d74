//! Which of the translated frames are shown, and what of them.

use std::collections::HashMap;

use super::fact::{Direction, What};
use super::{Entry, Mark, Node};

/// Lines that are compared at once. When there are more, those that come again count as changed once.
const LINES_MAX: usize = 4096;

/// What to show. Every frame is translated, also those that are not shown: what follows depends on them.
#[derive(Debug, Default)]
pub struct Filter {
    /// Number of the first frame.
    pub first: u64,
    /// Only frames with values that went these ways; all if it is empty.
    pub only: Vec<Direction>,
    /// Only what is about this axis.
    pub axis: Option<usize>,
    /// Only values that are not what they were before.
    pub changes: bool,
    /// What each value was last.
    last: HashMap<(usize, Direction, bool, &'static str), What>,
    /// What each line without a value said last, by its axis, and the names of the line above and its own.
    lines: HashMap<(usize, String), String>,
}

/// What counts of the line above for those below it.
#[derive(Debug, Clone, Copy, Default)]
struct Above<'a> {
    /// The axis that it is about.
    axis: Option<usize>,
    /// Its name; `None` above the heading of a frame.
    name: Option<&'a str>,
    /// It shows a value that has changed: what is said of that value goes with it.
    has_new_value: bool,
}

impl Filter {
    /// A filter that has seen nothing yet.
    #[must_use]
    pub fn new(first: u64, only: Vec<Direction>, axis: Option<usize>, changes: bool) -> Self {
        Self { first, only, axis, changes, last: HashMap::new(), lines: HashMap::new() }
    }

    /// What of a frame is shown; `None` if nothing is.
    pub fn apply(&mut self, mut entry: Entry) -> Option<Entry> {
        let tree = &mut entry.tree;
        if tree.mark == Mark::None {
            if let Some(axis) = self.axis {
                prune_others(tree, axis);
                if !is_about(tree, axis) {
                    return None;
                }
            }
            if self.changes && !self.prune_unchanged(tree, Above::default()) {
                return None;
            }
        }
        let wanted = self.only.is_empty()
            || entry.tree.has_errors()
            || entry.tree.mark != Mark::None
            || self.only.iter().any(|way| entry.goes(*way));
        (entry.place.number >= self.first && wanted).then_some(entry)
    }

    /// Takes out what has not changed; whether something is left.
    fn prune_unchanged(&mut self, node: &mut Node, above: Above<'_>) -> bool {
        let axis = node.axis.or(above.axis);
        let has_values = !node.facts.is_empty();
        let mut changed = node.mark != Mark::None;
        node.facts.retain(|fact| {
            let key = (fact.axis, fact.direction, fact.recorded, fact.what.name());
            let is_new = self.last.insert(key, fact.what) != Some(fact.what);
            changed |= is_new;
            is_new
        });
        let has_new_value = !node.facts.is_empty();
        if !has_values {
            changed |= above.has_new_value;
            // Lines about no axis count and stamp the updates: they are others each time.
            changed |= axis.is_some_and(|axis| self.is_new_line(axis, above.name.unwrap_or(""), &node.text));
        }
        let mut children = std::mem::take(&mut node.children);
        // The heading of a frame has its number, and is no name.
        let name = above.name.map_or_else(String::new, |_| name_of(&node.text));
        let name = Some(name.as_str());
        children.retain_mut(|child| self.prune_unchanged(child, Above { axis, name, has_new_value }));
        changed |= !children.is_empty();
        node.children = children;
        changed
    }

    /// Whether a line without a value says something else than the last one of its name.
    fn is_new_line(&mut self, axis: usize, above: &str, text: &str) -> bool {
        if self.lines.len() >= LINES_MAX {
            self.lines.clear();
        }
        let key = (axis, format!("{above}/{}", name_of(text)));
        self.lines.insert(key, text.to_owned()).is_none_or(|last| last != text)
    }
}

/// What a line is about: what stands before its first colon, without the numbers behind its first word.
fn name_of(text: &str) -> String {
    let name = text.split_once(':').map_or(text, |(name, _)| name);
    let mut words = name.split(' ');
    let mut name = words.next().unwrap_or_default().to_owned();
    for word in words.filter(|word| !word.starts_with(|first: char| first.is_ascii_digit() || first == '-')) {
        name.push(' ');
        name.push_str(word);
    }
    name
}

/// Takes out what is about other axes.
fn prune_others(node: &mut Node, axis: usize) {
    node.facts.retain(|fact| fact.axis == axis);
    node.children.retain(|child| child.axis.is_none_or(|about| about == axis));
    node.children.iter_mut().for_each(|child| prune_others(child, axis));
}

fn is_about(node: &Node, axis: usize) -> bool {
    node.axis == Some(axis)
        || node.mark == Mark::Error
        || !node.facts.is_empty()
        || node.children.iter().any(|child| is_about(child, axis))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::translate::Place;
    use crate::translate::fact::Fact;
    use profile_generic::image::Signal;

    fn value(axis: usize, direction: Direction, value: i64) -> Node {
        let what = What::Signal(Signal::PositionActual, Some(value));
        Node::new("value").about(axis).shows([Fact { axis, direction, recorded: true, what, raw: None }])
    }

    fn entry(number: u64, children: Vec<Node>) -> Entry {
        Entry { place: Place { number, ..Place::default() }, tree: Node { children, ..Node::new("frame") } }
    }

    /// How many values of a frame are left.
    fn left(filter: &mut Filter, entry: Entry) -> usize {
        filter.apply(entry).map_or(0, |entry| entry.tree.children.len())
    }

    #[test]
    fn frames_are_chosen_by_number_way_axis_and_change() {
        let frame = |number, first, second| {
            entry(number, vec![value(0, Direction::FromDrive, first), value(1, Direction::FromDrive, second)])
        };
        let mut all = Filter::default();
        assert_eq!([left(&mut all, frame(1, 5, 5)), left(&mut all, frame(2, 5, 5))], [2, 2]);
        let mut late = Filter { first: 2, ..Filter::default() };
        assert_eq!([left(&mut late, frame(1, 5, 5)), left(&mut late, frame(2, 5, 5))], [0, 2]);
        let mut other = Filter { only: vec![Direction::ToDrive], ..Filter::default() };
        assert_eq!(left(&mut other, frame(1, 5, 5)), 0);
        let mut same = Filter { only: vec![Direction::FromDrive], ..Filter::default() };
        assert_eq!(left(&mut same, frame(1, 5, 5)), 2);
        let mut second = Filter { axis: Some(1), ..Filter::default() };
        assert_eq!(left(&mut second, frame(1, 5, 5)), 1);
        let mut third = Filter { axis: Some(2), ..Filter::default() };
        assert_eq!(left(&mut third, frame(1, 5, 5)), 0);
        let mut changes = Filter { changes: true, ..Filter::default() };
        let found = [(5, 5), (5, 5), (5, 6), (6, 6)].map(|(a, b)| left(&mut changes, frame(1, a, b)));
        assert_eq!(found, [2, 0, 1, 1]);
    }

    #[test]
    fn errors_and_notes_are_always_shown() {
        let error = || entry(1, vec![Node::new("error: bad").marked(Mark::Error)]);
        let mut filter =
            Filter { only: vec![Direction::ToDrive], axis: Some(0), changes: true, ..Filter::default() };
        assert!(filter.apply(error()).is_some());
        let note = Entry { tree: Node::new("note").marked(Mark::Note), ..error() };
        assert!(filter.apply(note).is_some());
    }
}
