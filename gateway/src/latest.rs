//! A cell that holds the latest value: one writer that never waits, any number of readers.
//!
//! The writer is the cycle thread and the readers are servers; only system time goes the other way, and there the cycle thread reads
//! without waiting ([`Reader::try_read`]). A value is stored as 64-bit words in atomics,
//! guarded by a sequence number that is odd while the words change (a sequence lock): a reader that saw the
//! number change reads again. No reader can hold up the writer, nothing is allocated after construction, and
//! there is no unsafe code, because torn words are plain numbers that are thrown away before they are looked
//! at.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

/// Reads that may meet a writer before a reader gives its time slice away.
const SPINS: u32 = 64;

/// A value that can be laid out in 64-bit words.
pub trait Words: Copy {
    /// The words, an array of `u64`.
    type Array: AsRef<[u64]> + AsMut<[u64]> + std::fmt::Debug;

    /// An array to be filled.
    const EMPTY: Self::Array;

    /// Writes the words that count, and returns how many they are, from the first one on. The others are left alone: what
    /// stands there does not count, whatever it is.
    fn to_words(&self, words: &mut Self::Array) -> usize;

    /// The value of words that [`Words::to_words`] wrote, among others that do not count.
    fn from_words(words: &Self::Array) -> Self;
}

#[derive(Debug)]
struct Cell {
    /// Even: the words are whole; odd: they are being written.
    sequence: AtomicU64,
    words: Box<[AtomicU64]>,
}

/// The writing end.
#[derive(Debug)]
pub struct Publisher<T: Words> {
    cell: Arc<Cell>,
    /// Where a value is laid out; kept, because clearing it takes longer than filling what counts.
    words: Box<T::Array>,
}

/// A reading end.
#[derive(Debug)]
pub struct Reader<T> {
    cell: Arc<Cell>,
    value: std::marker::PhantomData<fn() -> T>,
}

impl<T> Clone for Reader<T> {
    fn clone(&self) -> Self {
        Self { cell: Arc::clone(&self.cell), value: std::marker::PhantomData }
    }
}

/// A cell that holds `initial`.
#[must_use]
pub fn latest<T: Words>(initial: T) -> (Publisher<T>, Reader<T>) {
    let mut words = Box::new(T::EMPTY);
    initial.to_words(&mut words);
    let places = (*words).as_ref().iter().map(|word| AtomicU64::new(*word)).collect();
    let cell = Arc::new(Cell { sequence: AtomicU64::new(0), words: places });
    let publisher = Publisher { cell: Arc::clone(&cell), words };
    (publisher, Reader { cell, value: std::marker::PhantomData })
}

impl<T: Words> Publisher<T> {
    /// Replaces the value. Takes `&mut self`: there is one writer.
    pub fn publish(&mut self, value: &T) {
        let count = value.to_words(&mut self.words);
        let words = (*self.words).as_ref();
        let words = words.get(..count).unwrap_or(words);
        let cell = &*self.cell;
        let sequence = cell.sequence.load(Ordering::Relaxed);
        cell.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        // No word below may be seen before the odd number above.
        fence(Ordering::Release);
        for (place, word) in cell.words.iter().zip(words) {
            place.store(*word, Ordering::Relaxed);
        }
        // Whoever sees the even number sees all words.
        cell.sequence.store(sequence.wrapping_add(2), Ordering::Release);
    }
}

impl<T: Words> Reader<T> {
    /// The value published last; `None` while a publication is under way. Never waits.
    #[must_use]
    pub fn try_read(&self) -> Option<T> {
        let cell = &*self.cell;
        let before = cell.sequence.load(Ordering::Acquire);
        if !before.is_multiple_of(2) {
            return None;
        }
        let mut words = T::EMPTY;
        for (word, place) in words.as_mut().iter_mut().zip(&cell.words) {
            *word = place.load(Ordering::Relaxed);
        }
        // No word above may be read after the number below.
        fence(Ordering::Acquire);
        (cell.sequence.load(Ordering::Relaxed) == before).then(|| T::from_words(&words))
    }

    /// The value published last. Waits only while a publication, well under a microsecond, is under way: not for the cycle thread,
    /// which a writer with less priority could keep waiting until it gets the processor again.
    #[must_use]
    pub fn read(&self) -> T {
        let mut tries = 0_u32;
        loop {
            if let Some(value) = self.try_read() {
                return value;
            }
            tries = tries.wrapping_add(1);
            if tries.is_multiple_of(SPINS) {
                // The writer may have been put off in the middle, on this processor.
                std::thread::yield_now();
            } else {
                std::hint::spin_loop();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    const LEN: usize = 200;

    /// Every word is the same number: a mixture of two values shows.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Uniform(u64);

    impl Words for Uniform {
        type Array = [u64; LEN];
        const EMPTY: Self::Array = [0; LEN];

        fn to_words(&self, words: &mut Self::Array) -> usize {
            words.fill(self.0);
            LEN
        }

        fn from_words(words: &Self::Array) -> Self {
            assert!(words.iter().all(|word| *word == words[0]), "torn: {words:?}");
            Self(words[0])
        }
    }

    /// As many words as their number says, each the number.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Few(usize);

    impl Words for Few {
        type Array = [u64; LEN];
        const EMPTY: Self::Array = [0; LEN];

        fn to_words(&self, words: &mut Self::Array) -> usize {
            words[..self.0].fill(self.0 as u64);
            self.0
        }

        fn from_words(words: &Self::Array) -> Self {
            let count = usize::try_from(words[0]).unwrap();
            assert!(words[..count].iter().all(|word| *word == words[0]), "{words:?}");
            Self(count)
        }
    }

    #[test]
    fn only_the_words_that_count_are_published() {
        let (mut publisher, reader) = latest(Few(3));
        assert_eq!(reader.read(), Few(3));
        for count in [LEN, 1, 7, LEN] {
            publisher.publish(&Few(count));
            assert_eq!(reader.read(), Few(count));
        }
        publisher.publish(&Few(2));
        let words: Vec<_> = publisher.cell.words.iter().map(|word| word.load(Ordering::Relaxed)).collect();
        assert_eq!(words[..4], [2, 2, LEN as u64, LEN as u64], "the rest was left alone");
    }

    #[test]
    fn the_value_published_last_is_read_by_every_reader() {
        let (mut publisher, reader) = latest(Uniform(7));
        let other = reader.clone();
        assert_eq!(reader.read(), Uniform(7));
        publisher.publish(&Uniform(8));
        publisher.publish(&Uniform(9));
        assert_eq!((reader.read(), other.read()), (Uniform(9), Uniform(9)));
    }

    #[test]
    fn a_publication_under_way_is_not_waited_for() {
        let (mut publisher, reader) = latest(Uniform(1));
        publisher.publish(&Uniform(2));
        assert_eq!(reader.try_read(), Some(Uniform(2)));
        publisher.cell.sequence.fetch_add(1, Ordering::Relaxed);
        assert_eq!(reader.try_read(), None);
        publisher.cell.sequence.fetch_add(1, Ordering::Relaxed);
        assert_eq!(reader.try_read(), Some(Uniform(2)));
    }

    #[test]
    fn readers_see_whole_values_in_order_while_the_writer_writes() {
        const VALUES: u64 = 100_000;
        let (mut publisher, reader) = latest(Uniform(0));
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                let reader = reader.clone();
                let done = &done;
                scope.spawn(move || {
                    let mut last = 0;
                    while !done.load(Ordering::Relaxed) {
                        let Uniform(value) = reader.read();
                        assert!(value >= last, "{value} after {last}");
                        last = value;
                    }
                });
            }
            for value in 1..=VALUES {
                publisher.publish(&Uniform(value));
            }
            done.store(true, Ordering::Relaxed);
        });
        assert_eq!(reader.read(), Uniform(VALUES));
    }
}
