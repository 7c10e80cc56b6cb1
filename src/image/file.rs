//! Writing a file so that it is either the old one or the whole new one.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::error::{At as _, Decoded, Error, Result};
use crate::memory;
use crate::system::FileName;

/// Writes a file through a temporary one in the same folder, flushed to the disk and then renamed:
/// whoever reads `path`, even after a crash, sees the old content or all of the new. A symbolic
/// link is followed. If `write` fails the temporary file is removed.
///
/// # Errors
/// If the folder is missing or not writable, `path` is a folder or read-only, or `write` fails.
pub fn write_beside_and_rename(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let target = checked_target(path)?;
    remove_leftovers(folder_of(&target));
    let temporary = Temporary::beside(&target);
    let written = temporary
        .create()
        .and_then(|file| {
            if let Ok(existing) = fs::metadata(&target) {
                file.set_permissions(kept_permissions(&file, &existing))?;
            }
            let mut buffered = BufWriter::with_capacity(1 << 20, file);
            write(&mut buffered)?;
            buffered.flush()?;
            buffered.get_ref().sync_all()
        })
        .and_then(|()| rename(&temporary.path, &target));
    written.map_err(|error| Error::at(path, write_cause(&error)))?;
    // The rename itself reaches the disk with its folder; not every file system allows asking.
    if let Ok(folder) = File::open(folder_of(&target)) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Renames a file over another one. Windows refuses that while a program has the other one open, as virus scanners
/// have new files for moments: there it is tried again for a second.
fn rename(from: &Path, to: &Path) -> io::Result<()> {
    const TRIES: u32 = 20;
    const PAUSE: Duration = Duration::from_millis(50);
    let mut outcome = fs::rename(from, to);
    let mut tries = TRIES;
    while tries > 0 && outcome.as_ref().is_err_and(is_in_use) {
        std::thread::sleep(PAUSE);
        outcome = fs::rename(from, to);
        tries -= 1;
    }
    outcome.map_err(|error| match is_in_use(&error) {
        true => io::Error::other("another program has it open"),
        false => error,
    })
}

/// Whether an error is what Windows says of a file that another program has open.
fn is_in_use(error: &io::Error) -> bool {
    const SHARING_VIOLATION: i32 = 32;
    cfg!(windows)
        && (error.kind() == io::ErrorKind::PermissionDenied
            || error.raw_os_error() == Some(SHARING_VIOLATION))
}

/// Gives a file the owner and the group of the one that it takes the place of, as far as the system allows;
/// the permissions that it is to get. Who may read the old content may read the new, and nobody else.
fn kept_permissions(file: &File, existing: &Metadata) -> Permissions {
    let permissions = existing.permissions();
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, fchown};
        let group = Some(existing.gid());
        match fchown(file, Some(existing.uid()), group).or_else(|_| fchown(file, None, group)) {
            Ok(()) => permissions,
            Err(_) => Permissions::from_mode(permissions.mode() & !0o070),
        }
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        permissions
    }
}

/// What no other process calls itself that writes into the same folder. Of several machines, or in several
/// containers, two may have the same number.
pub(crate) fn name_of_process() -> &'static str {
    static NAME: LazyLock<String> =
        LazyLock::new(|| format!("{:016x}", RandomState::new().build_hasher().finish()));
    &NAME
}

/// Whether [`write_beside_and_rename`] could write `path` now: asked before long work, so that it is
/// not lost at its end.
///
/// # Errors
/// As for writing.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = checked_target(path)?;
    let temporary = Temporary::beside(&target);
    temporary.create().map(drop).map_err(|error| Error::at(path, write_cause(&error)))
}

/// Makes a folder and those above it, if they are not there.
///
/// # Errors
/// If something else is there, or it may not be made.
pub(crate) fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|error| {
        let cause = match error.kind() {
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
                "cannot be a folder: something else is there".into()
            }
            _ => format!("cannot be made: {error}"),
        };
        Error::at(path, cause)
    })
}

/// What a file's name ends in, in small letters, without the dot.
pub(crate) fn extension(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

/// Whether two paths name the same file, there already or yet to be written.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        let path = &followed(path);
        fs::canonicalize(path).or_else(|_| {
            let folder = fs::canonicalize(folder_of(path))?;
            Ok::<_, io::Error>(folder.join(path.file_name().unwrap_or_default()))
        })
    };
    matches!((place(a), place(b)), (Ok(a), Ok(b)) if a == b)
}

/// The file to be written in place of what `path` names.
fn checked_target(path: &Path) -> Result<PathBuf> {
    if is_stream(path) {
        return Err(Error::at(path, NOT_ORDINARY));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if cfg!(windows) && names_device_or_stream(&name) {
        let cause = "cannot be written: Windows takes its name for that of a device or a stream";
        return Err(Error::at(path, cause.to_owned()));
    }
    let target = followed(path);
    check_target(&target).at(path)?;
    Ok(target)
}

const NOT_ORDINARY: &str = "cannot be written: it is not an ordinary file";

/// Whether a path means what this process has open, as /dev/stdout does: a file that it happens to be would
/// not be the same one once it was replaced. "-" is what other programs call it.
fn is_stream(path: &Path) -> bool {
    if path.as_os_str() == "-" {
        return true;
    }
    links(path).any(|link| {
        fs::canonicalize(folder_of(&link)).is_ok_and(|folder| {
            folder.starts_with("/dev/fd") || (folder.starts_with("/proc") && folder.ends_with("fd"))
        })
    })
}

/// Links one after another that are followed, as many as systems do.
const MAX_LINKS: usize = 40;

/// The file that a path means, be it there or yet to be written: symbolic links are followed.
fn followed(path: &Path) -> PathBuf {
    if let Ok(target) = fs::canonicalize(path) {
        return target;
    }
    links(path).last().unwrap_or_else(|| path.to_owned())
}

/// A path and the links that it leads through, one after the other, the last of which is none.
fn links(path: &Path) -> impl Iterator<Item = PathBuf> {
    let next = |path: &PathBuf| Some(path.with_file_name(fs::read_link(path).ok()?));
    std::iter::successors(Some(path.to_owned()), next).take(MAX_LINKS + 1)
}

/// Why `target` cannot be written, as far as can be known before trying.
fn check_target(target: &Path) -> std::result::Result<(), String> {
    if target.file_name().is_none() {
        return Err("cannot be written: it does not name a file".into());
    }
    let last = target.as_os_str().as_encoded_bytes().last();
    if last.is_some_and(|&byte| std::path::is_separator(char::from(byte))) {
        return Err("cannot be written: its name is that of a folder".into());
    }
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(format!("cannot be written: there is no folder {}", folder.display()));
    }
    match fs::metadata(target) {
        Ok(existing) if existing.is_dir() => Err("cannot be written: it is a folder".into()),
        Ok(existing) if !existing.is_file() => Err(NOT_ORDINARY.into()),
        Ok(existing) if existing.permissions().readonly() => {
            Err("cannot be written: it is read-only".into())
        }
        // Such as a name that is too long.
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(write_cause(&error)),
        _ => Ok(()),
    }
}

/// Whether Windows takes a part of a path for a device, whatever its ending, or for a stream of a file
/// ("Naming Files, Paths, and Namespaces" of Microsoft's documentation).
pub(crate) fn names_device_or_stream(part: &str) -> bool {
    const DEVICES: [&str; 7] = ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$", "CLOCK$"];
    let stem = part.split('.').next().unwrap_or_default().trim_end().to_uppercase();
    let port = stem.strip_prefix("COM").or_else(|| stem.strip_prefix("LPT"));
    let mut digits = port.unwrap_or_default().chars();
    let is_port =
        digits.next().is_some_and(|c| c.is_ascii_digit() || "\u{b9}\u{b2}\u{b3}".contains(c));
    part.contains(':') || DEVICES.contains(&&*stem) || (is_port && digits.next().is_none())
}

/// The folder a file lies in; `.` for a bare name.
fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// An I/O error in the words of someone who wanted a file written.
fn write_cause(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "cannot be written: the folder does not allow it".into(),
        io::ErrorKind::ReadOnlyFilesystem => "cannot be written: the disk is read-only".into(),
        io::ErrorKind::StorageFull => "cannot be written: the disk is full".into(),
        _ => format!("cannot be written: {error}"),
    }
}

/// A file that is gone when this value is, unless it was renamed away.
struct Temporary {
    path: PathBuf,
}

/// What temporary names begin and end with. They do not hold the target's name, which may be as long as
/// a name can be.
const TEMPORARY: [&str; 2] = [".lightgrid-", ".part"];

/// Temporary files under way, as the system takes names: where they are removed in haste there may be no
/// memory to make these.
static UNDER_WAY: Mutex<Vec<FileName>> = Mutex::new(Vec::new());

/// Removes what is being written, for the process ends at once. Takes no memory and waits for nobody.
pub(crate) fn remove_unfinished() {
    if let Ok(names) = UNDER_WAY.try_lock() {
        names.iter().for_each(FileName::remove);
    }
}

fn under_way() -> MutexGuard<'static, Vec<FileName>> {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Temporary {
    fn beside(target: &Path) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let [begin, end] = TEMPORARY;
        let name = format!("{begin}{}-{number}{end}", name_of_process());
        Self { path: folder_of(target).join(name) }
    }

    fn create(&self) -> io::Result<File> {
        under_way().push(FileName::new(&self.path)?);
        OpenOptions::new().write(true).read(true).create_new(true).open(&self.path)
    }
}

/// Nobody writes a file for so long without a byte.
const LEFT_AFTER: Duration = Duration::from_secs(3600);

/// Removes temporary files of processes that were killed long ago.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_temporary = name.starts_with(TEMPORARY[0]) && name.ends_with(TEMPORARY[1]);
        if is_temporary
            && let Ok(age) = entry.metadata().and_then(|facts| facts.modified())
            && age.elapsed().is_ok_and(|age| age > LEFT_AFTER)
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
        if let Ok(removed) = FileName::new(&self.path) {
            under_way().retain(|name| *name != removed);
        }
    }
}

/// Opens an ordinary file for reading, and its length. Devices and pipes may have no end, and opening
/// one may already wait for ever.
pub(crate) fn open_file(path: &Path) -> Decoded<(File, u64)> {
    let facts = fs::metadata(path).map_err(|e| read_cause(&e))?;
    if facts.is_dir() {
        return Err("is a folder, not a file".into());
    }
    if !facts.is_file() {
        return Err("is a device or a pipe, not an ordinary file".into());
    }
    let file = File::open(path).map_err(|e| read_cause(&e))?;
    Ok((file, facts.len()))
}

/// The bytes of an ordinary file.
pub(crate) fn read_file(path: &Path) -> Decoded<Vec<u8>> {
    let (file, length) = open_file(path)?;
    let mut bytes = memory::reserved(length)?;
    file.take(length).read_to_end(&mut bytes).map_err(|e| read_cause(&e))?;
    Ok(bytes)
}

/// An I/O error in the words of someone who wanted a file read.
pub(crate) fn read_cause(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".into(),
        io::ErrorKind::PermissionDenied => "may not be read: permission denied".into(),
        io::ErrorKind::IsADirectory => "is a folder, not a file".into(),
        io::ErrorKind::UnexpectedEof => "is cut short".into(),
        _ => format!("cannot be read: {error}"),
    }
}

#[cfg(all(test, windows))]
mod tests {
    use std::os::windows::fs::OpenOptionsExt as _;
    use std::time::Instant;

    use super::*;

    /// A program that has a file open and lets others do no more than read it.
    fn open_elsewhere(path: &Path) -> File {
        const FILE_SHARE_READ: u32 = 1;
        OpenOptions::new().read(true).share_mode(FILE_SHARE_READ).open(path).expect("opened")
    }

    fn write(path: &Path, text: &str) -> Result<()> {
        write_beside_and_rename(path, |file| file.write_all(text.as_bytes()))
    }

    #[test]
    fn a_file_that_another_program_has_open_is_tried_again_for_a_while() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        write(&path, "old").expect("written");
        let scanner = open_elsewhere(&path);
        let closing = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(300));
            drop(scanner);
        });
        write(&path, "newer").expect("written once it was closed");
        closing.join().expect("it was closed");
        assert_eq!(fs::read_to_string(&path).expect("read"), "newer");

        let viewer = open_elsewhere(&path);
        let start = Instant::now();
        let refusal = write(&path, "newest").unwrap_err().to_string();
        assert!(start.elapsed() > Duration::from_millis(500));
        assert!(refusal.contains("another program has it open"), "{refusal}");
        assert_eq!(fs::read_to_string(&path).expect("read"), "newer");
        drop(viewer);
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn names_of_devices_and_streams_are_refused_before_work() {
        for name in ["nul.png", "CON.exr", "folder/a.png:b", "com1.png"] {
            let refusal = check_writable(Path::new(name)).unwrap_err().to_string();
            assert!(refusal.contains("device or a stream"), "{name}: {refusal}");
        }
    }
}
