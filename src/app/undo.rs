//! Undo and redo by comparing snapshots.

/// Snapshots kept.
const MAX_STEPS: usize = 200;

/// What was, what is, and what was taken back.
#[derive(Debug, Clone)]
pub(super) struct Undo<T> {
    /// What can be gone back to, oldest first.
    pub(super) past: Vec<T>,
    /// The state at rest.
    pub(super) present: T,
    /// What was taken back, the last at the end.
    pub(super) future: Vec<T>,
}

impl<T: Clone + PartialEq> Undo<T> {
    /// Nothing to take back yet.
    pub(super) fn new(present: T) -> Self {
        Self { past: Vec::new(), present, future: Vec::new() }
    }

    /// Tells the state at rest: if it differs from the last one, that one can be gone back to.
    pub(super) fn settle(&mut self, now: &T) {
        if *now == self.present {
            return;
        }
        self.past.push(std::mem::replace(&mut self.present, now.clone()));
        self.future.clear();
        if self.past.len() > MAX_STEPS {
            self.past.remove(0);
        }
    }

    /// Replaces what is, without a step to go back to: for what the program filled in by itself.
    pub(super) fn amend(&mut self, now: &T) {
        self.present = now.clone();
    }

    /// Puts `now` where `was` is at rest, without a step to go back to: what was asked for is not to be had, or
    /// the program has filled it in.
    pub(super) fn correct(&mut self, was: &T, now: &T) {
        if self.present != *was {
            return;
        }
        self.present = now.clone();
        for steps in [&mut self.past, &mut self.future] {
            // It would be a step to itself.
            steps.pop_if(|next| next == now);
        }
    }

    /// Changes every state alike: what they speak of is called otherwise now.
    pub(super) fn change_all(&mut self, mut change: impl FnMut(&mut T)) {
        self.past.iter_mut().chain(&mut self.future).for_each(&mut change);
        change(&mut self.present);
    }

    /// The state before, if any.
    pub(super) fn undo(&mut self) -> Option<T> {
        let before = self.past.pop()?;
        self.future.push(std::mem::replace(&mut self.present, before.clone()));
        Some(before)
    }

    /// The state that was taken back last, if any.
    pub(super) fn redo(&mut self) -> Option<T> {
        let after = self.future.pop()?;
        self.past.push(std::mem::replace(&mut self.present, after.clone()));
        Some(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_back_and_forth_and_a_new_one_forgets_the_future() {
        let mut undo = Undo::new(1);
        undo.settle(&1);
        assert!(undo.past.is_empty());
        undo.settle(&2);
        undo.settle(&3);
        assert_eq!((undo.undo(), undo.undo(), undo.undo()), (Some(2), Some(1), None));
        assert_eq!(undo.redo(), Some(2));
        undo.settle(&9);
        assert!(undo.future.is_empty());
        assert_eq!(undo.undo(), Some(2));
    }

    #[test]
    fn what_could_not_be_had_is_no_step() {
        let mut undo = Undo::new(1);
        undo.settle(&2);
        undo.settle(&9);
        // It is refused, and all is as it was.
        undo.correct(&9, &2);
        assert_eq!((undo.undo(), undo.redo(), undo.redo()), (Some(1), Some(2), None));
        // What was is no longer to be had.
        assert_eq!(undo.undo(), Some(1));
        undo.correct(&1, &2);
        assert!(undo.past.is_empty() && undo.future.is_empty());
        // It is none of what is at rest.
        undo.correct(&7, &8);
        assert_eq!(undo.present, 2);
    }
}
