//! What operating systems are asked for directly, each in a file of its own with the same functions.

#[cfg(not(any(unix, windows)))]
mod bare;
#[cfg(unix)]
mod unix;
#[cfg(windows)]
mod windows;

#[cfg(not(any(unix, windows)))]
pub(crate) use bare::*;
#[cfg(unix)]
pub(crate) use unix::*;
#[cfg(windows)]
pub(crate) use windows::*;

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_thread_that_sleeps_takes_no_cpu_time() {
        let before = thread_cpu_time().expect("this system counts it");
        std::thread::sleep(Duration::from_millis(200));
        let slept = thread_cpu_time().expect("it counted before") - before;
        assert!(slept < Duration::from_millis(200), "{slept:?}");
        let mut sum = 0_u64;
        while thread_cpu_time().expect("it counted before") - before < Duration::from_millis(30) {
            sum = std::hint::black_box(sum + 1);
        }
        assert!(sum > 0);
    }

    #[test]
    fn memory_that_is_available_can_be_had() {
        let bytes = available_memory().expect("this system says");
        assert!(bytes > 1 << 20, "{bytes}");
        assert!(can_commit(1 << 20));
        assert!(!can_commit(1 << 60));
    }

    #[test]
    fn a_file_is_removed_by_its_prepared_name_though_it_is_open() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("größe 日本.part");
        let file = std::fs::File::create(&path).expect("a file");
        FileName::new(&path).expect("a name").remove();
        drop(file);
        assert!(!path.exists());
    }
}
