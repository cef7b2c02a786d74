//! Whole lists of frames, each frame with what came before it.

use std::sync::Arc;

use super::entry::{Counts, Entry, Place, Sink};
use super::{Line, LineError, Node, Stage, Translator};

/// Characters of a line that stand in its heading.
const HEADING_MAX: usize = 60;

/// A translated list.
#[derive(Debug, Default)]
pub struct List {
    /// A tree for each frame.
    pub frames: Vec<Node>,
    /// What else was found.
    pub counts: Counts,
}

/// What is wrong with a list.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{}: {error}", error.column)]
pub struct ListError {
    /// Line, 1 first.
    pub line: usize,
    /// What is wrong with it.
    pub error: LineError,
}

impl List {
    /// What is handed to the sink of a translation, all of it.
    pub(crate) fn of<E>(translate: impl FnOnce(Sink<'_>) -> Result<Counts, E>) -> Result<Self, E> {
        let mut frames = Vec::new();
        let counts = translate(&mut |entry| {
            frames.push(entry.tree);
            true
        })?;
        Ok(Self { frames, counts })
    }
}

/// Translates a text with a frame a line. A frame that cannot be translated is told where it stands, and the others go on.
///
/// # Errors
/// The first line that is no line of such a list.
pub fn translate_list(stage: &Arc<Stage>, text: &str) -> Result<List, ListError> {
    List::of(|sink| translate_list_to(stage, text, u64::MAX, sink))
}

/// The same, frame by frame, up to the line `last`.
///
/// # Errors
/// As [`translate_list`].
pub fn translate_list_to(
    stage: &Arc<Stage>,
    text: &str,
    last: u64,
    sink: Sink<'_>,
) -> Result<Counts, ListError> {
    let mut translator = Translator::new(Arc::clone(stage));
    let mut counts = Counts::default();
    let last = usize::try_from(last).unwrap_or(usize::MAX);
    for (number, line) in (1..=last).zip(text.lines()) {
        let Some(frame) = Line::parse(line).map_err(|error| ListError { line: number, error })? else {
            continue;
        };
        let translated = translator.line(&frame);
        if frame == Line::Restart {
            continue;
        }
        let entry = Entry::of(Place::line(number), format!("line {number}: {}", heading(line)), translated);
        if !counts.push(sink, entry) {
            break;
        }
    }
    Ok(counts)
}

/// The comment behind a frame says best what it is, else the frame itself does.
fn heading(line: &str) -> String {
    let (frame, comment) = line.split_once('#').unwrap_or((line, ""));
    let shown = if comment.trim().is_empty() { frame.trim() } else { comment.trim() };
    match shown.char_indices().nth(HEADING_MAX) {
        Some((end, _)) => format!("{} ...", &shown[..end]),
        None => shown.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings() {
        assert_eq!(heading("06 02 # forward  "), "forward");
        assert_eq!(heading(" 06 02 #"), "06 02");
        assert_eq!(heading(&"ä".repeat(61)), format!("{} ...", "ä".repeat(60)));
    }
}
