//! The name that was meant.

/// The word closest to `text`, if any is close enough to be what was meant. Hyphens, underscores and spaces are the same.
pub fn closest<'n>(text: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    // Of one or two letters each word is close to every other.
    let limit = match text.chars().count() {
        0..=2 => 0,
        length => (length / 3).max(1),
    };
    let distances = known.into_iter().map(|word| (distance(text, word), word));
    distances
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, word)| word)
}

/// The letters that count.
fn letters(text: &str) -> impl Iterator<Item = char> {
    text.chars()
        .flat_map(char::to_lowercase)
        .map(|letter| if matches!(letter, '_' | ' ') { '-' } else { letter })
}

/// Letters to insert, delete, replace, or exchange with the next one to turn one word into the other; case does not count.
fn distance(from: &str, to: &str) -> usize {
    let (from, to): (Vec<char>, Vec<char>) = (letters(from).collect(), letters(to).collect());
    let mut above: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, letter) in from.iter().enumerate() {
        let mut next = vec![i + 1];
        for (j, other) in to.iter().enumerate() {
            let replaced = row[j] + usize::from(letter != other);
            let mut least = replaced.min(next[j] + 1).min(row[j + 1] + 1);
            if i > 0 && j > 0 && *letter == to[j - 1] && from[i - 1] == *other {
                least = least.min(above[j - 1] + 1);
            }
            next.push(least);
        }
        above = std::mem::replace(&mut row, next);
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_name_is_offered_only_when_it_is_close() {
        let known = ["position_command", "velocity_command", "torque_command"];
        assert_eq!(closest("position_comand", known), Some("position_command"));
        assert_eq!(closest("Velocity_Command", known), Some("velocity_command"));
        assert_eq!(closest("position-command", known), Some("position_command"));
        assert_eq!(closest("temperature", known), None);
        assert_eq!(closest("us", ["ns", "ms"]), None, "it could be any");
        assert_eq!(closest("ind", ["idn", "name"]), Some("idn"), "exchanged letters");
        assert_eq!((distance("kitten", "sitting"), distance("", "abc"), distance("abc", "")), (3, 3, 3));
    }
}
