//! What is handed on of each frame that was translated.

use super::{Direction, Mark, Node, TranslateError};

/// Where a frame stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    /// Number of the frame in its recording, or of the line in its list, 1 first.
    pub number: u64,
    /// Nanoseconds since the first frame of the recording; negative where its clock went back.
    pub time: Option<i64>,
    /// Bytes of the file that were read so far.
    pub offset: u64,
}

impl Place {
    pub(super) fn line(number: usize) -> Self {
        Self { number: u64::try_from(number).unwrap_or(u64::MAX), ..Self::default() }
    }
}

/// A frame with its translation, or something that is to be said at this place of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Where it stands.
    pub place: Place,
    /// What it is, with its translation below.
    pub tree: Node,
}

/// What became of the frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames that were translated.
    pub translated: usize,
    /// Frames of a recording that carry nothing to translate.
    pub passed_over: usize,
    /// Frames that could not be translated.
    pub failed: usize,
}

impl Counts {
    /// Whether there were frames, and each of them was translated or carries nothing to translate.
    #[must_use]
    pub const fn is_complete(self) -> bool {
        self.failed == 0 && self.translated > 0
    }

    /// Hands a frame on; whether to go on.
    pub(super) fn push(&mut self, sink: Sink<'_>, entry: Entry) -> bool {
        if entry.tree.has_errors() {
            self.failed += 1;
        } else {
            self.translated += 1;
        }
        sink(entry)
    }
}

/// Takes each frame as it comes; `false` ends the translation.
pub type Sink<'s> = &'s mut dyn FnMut(Entry) -> bool;

impl Entry {
    pub(super) fn of(place: Place, heading: String, translated: Result<Node, TranslateError>) -> Self {
        let mut tree = Node::new(heading);
        tree.push(match translated {
            Ok(node) => node,
            Err(error) => Node::new(format!("error: {error}")).marked(Mark::Error),
        });
        Self { place, tree }
    }

    /// Something about the recording at this place.
    pub(super) fn note(place: Place, text: &str, mark: Mark) -> Self {
        let word = if mark == Mark::Error { "error" } else { "note" };
        Self { place, tree: Node::new(format!("frame {}: {word}: {text}", place.number)).marked(mark) }
    }

    /// The ways of the values that stand in the frame itself.
    #[must_use]
    pub fn goes(&self, direction: Direction) -> bool {
        let mut found = false;
        self.tree.walk(&mut |node| {
            found |= node.facts.iter().any(|fact| fact.recorded && fact.direction == direction);
        });
        found
    }
}
