//! Large arrays that are read at random: fewer, larger memory pages.

use crate::system::advise_huge_pages;

/// The same values in memory that the system was asked to back by huge pages, where it can: random
/// reads of some 10 MB and more otherwise spend much of their time on address translation.
/// *Measured* on the BVH bench: see `docs/notebook/2026-11-method.md`.
pub(crate) fn on_huge_pages<T>(values: Vec<T>) -> Vec<T> {
    if size_of_val(values.as_slice()) < WORTHWHILE_BYTES {
        return values;
    }
    let mut moved = Vec::with_capacity(values.len());
    advise(&mut moved);
    moved.extend(values);
    moved
}

/// `count` zeros in such memory, to be filled: nothing is held twice on the way.
pub(crate) fn zeros_on_huge_pages<T: bytemuck::Zeroable + Clone>(count: usize) -> Vec<T> {
    let mut zeros = Vec::with_capacity(count);
    if count * size_of::<T>() >= WORTHWHILE_BYTES {
        advise(&mut zeros);
    }
    zeros.resize(count, T::zeroed());
    zeros
}

/// Two huge pages of x86-64.
const WORTHWHILE_BYTES: usize = 4 << 20;

fn advise<T>(memory: &mut Vec<T>) {
    let start = memory.as_mut_ptr().addr();
    advise_huge_pages(start..start + memory.capacity() * size_of::<T>());
}

#[cfg(test)]
mod tests {
    #[test]
    fn values_stay_what_they_were() {
        for count in [0, 10, (5 << 20) / 8 + 3] {
            let values: Vec<u64> = (0..count).map(|i| i * 7).collect();
            assert_eq!(super::on_huge_pages(values.clone()), values);
            assert_eq!(super::zeros_on_huge_pages::<u64>(values.len()), vec![0; values.len()]);
        }
    }
}
