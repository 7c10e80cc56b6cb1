//! Large arrays that are read at random: fewer, larger memory pages.

use crate::system::advise_huge_pages;

/// The same values in memory that the system was asked to back by huge pages, where it can: random
/// reads of some 10 MB and more otherwise spend much of their time on address translation.
/// *Measured* on the BVH bench: see `docs/notebook/2026-11-method.md`.
pub(crate) fn on_huge_pages<T>(values: Vec<T>) -> Vec<T> {
    if size_of_val(values.as_slice()) < WORTHWHILE_BYTES {
        return values;
    }
    joined_on_huge_pages(vec![values])
}

/// All lists one after the other, in such memory.
pub(crate) fn joined_on_huge_pages<T>(lists: Vec<Vec<T>>) -> Vec<T> {
    let mut joined = reserved(lists.iter().map(Vec::len).sum());
    lists.into_iter().for_each(|list| joined.extend(list));
    joined
}

/// `count` zeros in such memory, to be filled: nothing is held twice on the way.
pub(crate) fn zeros_on_huge_pages<T: bytemuck::Zeroable + Clone>(count: usize) -> Vec<T> {
    let mut zeros = reserved(count);
    zeros.resize(count, T::zeroed());
    zeros
}

/// Two huge pages of x86-64.
const WORTHWHILE_BYTES: usize = 4 << 20;

fn reserved<T>(count: usize) -> Vec<T> {
    let mut memory = Vec::<T>::with_capacity(count);
    if count * size_of::<T>() >= WORTHWHILE_BYTES {
        let start = memory.as_mut_ptr().addr();
        advise_huge_pages(start..start + memory.capacity() * size_of::<T>());
    }
    memory
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
