//! One quantity of every device, where choosing them one after the other leads astray.
//!
//! y of all devices must be independent columns, one of each pair: a largest common independent set of a linear matroid and a
//! partition. Where the greedy choice leaves a device without y, a shortest chain of exchanges finds the larger set, or there is none
//! (J. Edmonds, "Submodular functions, matroids, and certain polyhedra", 1970).

use std::collections::VecDeque;

use super::eliminated::Eliminated;
use crate::algebra::Field;

impl<F: Field> Eliminated<'_, F> {
    /// Gives devices without y one, as long as other devices can change roles for it.
    pub(super) fn exchange_roles(&mut self) {
        if self.has_roles() {
            return;
        }
        self.matrix.settle(&self.found);
        while let Some(chain) = self.chain() {
            let mut freed = None;
            for column in chain {
                let partner = self.partner(column);
                match freed {
                    None => {
                        self.matrix.eliminate(column, &mut self.found);
                        self.matrix.settle(&self.found);
                    }
                    Some(before) => {
                        self.matrix.exchange(before, column, &mut self.found);
                    }
                }
                freed = partner;
            }
        }
    }

    /// The columns of the devices of which either quantity may be y.
    fn choices(&self) -> impl Iterator<Item = (usize, usize)> {
        let free = self.free.iter();
        free.filter(|&&k| !self.behaviour.pairs[k].fixed_role)
            .map(|&k| self.pairs[k])
    }

    /// Whether every such device has its y.
    fn has_roles(&self) -> bool {
        let dependent = |c: usize| self.found.pivot[c].is_some();
        self.choices().all(|(a, b)| dependent(a) || dependent(b))
    }

    /// The other quantity of the free device that a column belongs to.
    fn partner(&self, column: usize) -> Option<usize> {
        let pairs = self.free.iter().map(|&k| self.pairs[k]);
        pairs.into_iter().find_map(|(a, b)| match column {
            c if c == a => Some(b),
            c if c == b => Some(a),
            _ => None,
        })
    }

    /// A shortest chain of columns: the first one fits an unused equation, each further one the equation that the partner of the one
    /// before leaves, and the last one belongs to a device without y.
    fn chain(&self) -> Option<Vec<usize>> {
        if self.has_roles() {
            return None;
        }
        let columns = (self.choices())
            .flat_map(|(a, b)| [(a, b), (b, a)])
            .filter(|&(c, _)| self.found.pivot[c].is_none());
        let mut waiting: Vec<(usize, usize)> = columns.collect();
        let mut queue: VecDeque<(usize, usize)> = VecDeque::new();
        let mut before = vec![None; self.columns.len()];
        let unused: Vec<usize> = (0..self.found.equations)
            .filter(|&r| !self.found.used[r])
            .collect();
        waiting.retain(|&(c, partner)| {
            let fits = unused.iter().any(|&r| self.matrix.at(r, c).is_some());
            if fits {
                queue.push_back((c, partner));
            }
            !fits
        });
        while let Some((c, partner)) = queue.pop_front() {
            let Some(row) = self.found.pivot[partner] else {
                let path = std::iter::successors(Some(c), |&c| before[c]);
                let mut path: Vec<usize> = path.collect();
                path.reverse();
                return Some(path);
            };
            waiting.retain(|&(next, other)| {
                let fits = self.matrix.at(row, next).is_some();
                if fits {
                    before[next] = Some(c);
                    queue.push_back((next, other));
                }
                !fits
            });
        }
        None
    }
}
