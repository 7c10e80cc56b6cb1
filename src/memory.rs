//! Asking for memory before taking it: a program that is refused memory ends, one that asks can say so.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::error::Decoded;
use crate::system;

/// What is got without asking.
const SMALL: u64 = 16 << 20;

/// Whether memory that is refused ends the process, unless somebody asks.
static REFUSAL_ENDS: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether this thread takes a refusal for an answer.
    static ASKS: Cell<bool> = const { Cell::new(false) };
}

/// From now on memory that is refused ends the process, unless it is asked for by [`reserved`]. Some libraries
/// panic at a refusal, others abort, and a command has nothing to go on with, as a window has.
pub(crate) fn refusal_ends() {
    REFUSAL_ENDS.store(true, Ordering::Relaxed);
}

/// Whether nobody would take a refusal of memory for an answer. Takes none itself.
pub(crate) fn is_refusal_the_end() -> bool {
    REFUSAL_ENDS.load(Ordering::Relaxed) && !ASKS.get()
}

/// Whether this thread says why the process ends: the first that asks. Others may have failed for the same cause, and
/// have nothing to add. Takes no memory.
pub(crate) fn has_last_word() -> bool {
    /// Where something lies that the speaker alone has.
    static SPEAKER: AtomicUsize = AtomicUsize::new(0);
    let own = ASKS.with(|asks| std::ptr::from_ref(asks).addr());
    match SPEAKER.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed) {
        Ok(_) => true,
        Err(speaker) => speaker == own,
    }
}

/// Whether so many more bytes can be had, as far as the system says.
///
/// # Errors
/// A cause with both numbers.
pub(crate) fn check(needed: u64) -> Decoded<()> {
    // Asking takes longer than getting so little.
    if needed < SMALL {
        return Ok(());
    }
    match system::available_memory() {
        Some(left) if needed > left => {
            Err(format!("needs {} of memory, and {} are left", in_units(needed), in_units(left)))
        }
        _ => Ok(()),
    }
}

/// An empty list with room for `count` elements.
///
/// # Errors
/// As [`check`].
pub(crate) fn reserved<T>(count: u64) -> Decoded<Vec<T>> {
    let bytes = count.saturating_mul(size_of::<T>() as u64);
    check(bytes)?;
    let mut list = Vec::new();
    ASKS.set(true);
    let reserved = usize::try_from(count).ok().map(|count| list.try_reserve_exact(count));
    ASKS.set(false);
    reserved
        .and_then(Result::ok)
        .ok_or_else(|| format!("needs {} of memory, which cannot be had", in_units(bytes)))?;
    Ok(list)
}

/// `count` copies of an element.
///
/// # Errors
/// As [`check`].
pub(crate) fn filled<T: Clone>(count: u64, value: T) -> Decoded<Vec<T>> {
    let mut list = reserved(count)?;
    list.resize(count as usize, value);
    Ok(list)
}

/// Bytes in the largest unit that leaves a whole number of some size.
fn in_units(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{} kB", bytes / 1000),
        10_000_000..10_000_000_000 => format!("{} MB", bytes / 1_000_000),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_refused_with_the_numbers() {
        let refusal = reserved::<[f32; 3]>(1 << 50).unwrap_err();
        assert!(refusal.starts_with("needs 13510798.9 GB of memory, and "), "{refusal}");
        assert!(refusal.ends_with(" are left"), "{refusal}");
        assert_eq!(filled(3, 7), Ok(vec![7; 3]));
        assert!(reserved::<u64>(u64::MAX).is_err());
    }

    #[test]
    fn one_thread_has_the_last_word() {
        let all = std::sync::Barrier::new(8);
        let asked_twice = || {
            let answers = [has_last_word(), has_last_word()];
            // Nobody leaves before: where one thread lay another could lie.
            all.wait();
            answers
        };
        let answers = std::thread::scope(|scope| {
            let threads = [0; 8].map(|_| scope.spawn(asked_twice));
            threads.map(|thread| thread.join().expect("no panic"))
        });
        let spoke = answers.iter().filter(|answers| **answers == [true; 2]).count();
        assert_eq!(spoke, 1, "{answers:?}");
        assert!(answers.iter().all(|[first, second]| first == second));
    }
}
