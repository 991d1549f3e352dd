//! The modes visited so far. Circuits that are alike but for names and waveforms may take turns with one set of them.

use std::collections::BTreeMap;
use std::ops::{Deref, Index, IndexMut};

use super::key::Key;
use super::mode::Mode;

/// Modes and systems that are kept whatever they take: those that a period of a circuit goes through by turns.
pub(super) const TURNS: usize = 8;

/// Modes by number, and the numbers by name.
#[derive(Debug, Default)]
pub(crate) struct Modes {
    /// `None` where the circuit has no such mode.
    pub(super) index: BTreeMap<Key, Option<usize>>,
    all: Vec<Mode>,
    /// By mode: when it was left last, counted in changes of mode, and the bytes that its flow kept then; their sum.
    left: Vec<(u64, usize)>,
    changes: u64,
    kept: usize,
}

impl Deref for Modes {
    type Target = [Mode];

    fn deref(&self) -> &[Mode] {
        &self.all
    }
}

impl Index<usize> for Modes {
    type Output = Mode;

    fn index(&self, at: usize) -> &Mode {
        &self.all[at]
    }
}

impl IndexMut<usize> for Modes {
    fn index_mut(&mut self, at: usize) -> &mut Mode {
        &mut self.all[at]
    }
}

impl Modes {
    /// Remembers what a name stands for; returns its number.
    pub(super) fn insert(&mut self, key: &Key, mode: Option<Mode>) -> Option<usize> {
        let at = mode.map(|mode| {
            self.all.push(mode);
            self.all.len() - 1
        });
        self.index.insert(key.clone(), at);
        at
    }

    /// Takes note that mode `at` is left. Where modes keep more than `most` bytes together, those that were left longest ago give up what can be
    /// made again.
    pub(super) fn leave(&mut self, at: usize, most: usize) {
        self.changes += 1;
        self.left.resize(self.all.len(), (0, 0));
        let kept = self.all[at].flow.kept();
        self.kept = self.kept + kept - self.left[at].1;
        self.left[at] = (self.changes, kept);
        if self.kept > most {
            self.give_up(most);
        }
    }

    /// Has those that were left longest ago give up what can be made again, until half of `most` is kept.
    #[cold]
    #[inline(never)]
    fn give_up(&mut self, most: usize) {
        let mut oldest: Vec<usize> = (0..self.left.len())
            .filter(|&k| self.left[k].1 > 0)
            .collect();
        oldest.sort_unstable_by_key(|&k| self.left[k].0);
        oldest.truncate(oldest.len().saturating_sub(TURNS));
        for k in oldest {
            if self.kept <= most / 2 {
                break;
            }
            self.all[k].flow.forget();
            self.kept -= std::mem::take(&mut self.left[k].1);
        }
    }
}
