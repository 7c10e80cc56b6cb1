//! TIFF files that claim more than they hold: the decoder makes room for a directory's entries by what
//! their counts say.

use crate::error::Decoded;

/// Whether each entry of the first directory, which is the one that is read, fits the file; true for what
/// is no TIFF file, or one cut short (both of which the decoder says).
///
/// # Errors
/// A cause.
pub(super) fn check(bytes: &[u8]) -> Decoded<()> {
    match first_directory(bytes) {
        Some(sizes) if sizes.iter().any(|&size| size > bytes.len() as u64) => {
            Err(format!("claims more values than its {} bytes can hold", bytes.len()))
        }
        _ => Ok(()),
    }
}

/// Bytes of the values of each entry (TIFF 6.0, section 2; BigTIFF has wider fields).
fn first_directory(bytes: &[u8]) -> Option<Vec<u64>> {
    let is_big_endian = match bytes.get(..2)? {
        b"II" => false,
        b"MM" => true,
        _ => return None,
    };
    let number = |at: usize, size: usize| -> Option<u64> {
        let bytes = bytes.get(at..at.checked_add(size)?)?;
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Some(if is_big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        })
    };
    // Width of offsets and counts, and of the number of entries.
    let (start, wide, narrow) = match number(2, 2)? {
        42 => (4, 4, 2),
        43 => (8, 8, 8),
        _ => return None,
    };
    let directory = usize::try_from(number(start, wide)?).ok()?;
    let entries = number(directory, narrow)?;
    let sizes = (0..entries).map_while(|entry| {
        let entry = usize::try_from(entry).ok()?.checked_mul(4 + 2 * wide)?;
        let at = directory.checked_add(narrow)?.checked_add(entry)?;
        let size = match number(at + 2, 2)? {
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16..=18 => 8,
            _ => 1,
        };
        Some(number(at + 4, wide)?.saturating_mul(size))
    });
    Some(sizes.collect())
}
