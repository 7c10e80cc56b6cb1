//! Writing a file so that it is either the old one or the whole new one.

#[cfg(unix)]
use std::ffi::CString;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, BufWriter, Read, Write};
#[cfg(unix)]
use std::os::unix::{ffi::OsStrExt as _, fs as unix};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};
#[cfg(unix)]
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::error::{Decoded, Error, Result};
use crate::memory;

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
        .and_then(|()| fs::rename(&temporary.path, &target));
    written.map_err(|error| Error::at(path, write_cause(&error)))?;
    // The rename itself reaches the disk with its folder; not every file system allows asking.
    if let Ok(folder) = File::open(folder_of(&target)) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Gives a file the owner and the group of the one that it takes the place of, as far as the system allows;
/// the permissions that it is to get. Who may read the old content may read the new, and nobody else.
fn kept_permissions(file: &File, existing: &Metadata) -> Permissions {
    let permissions = existing.permissions();
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
        let group = Some(existing.gid());
        let kept = unix::fchown(file, Some(existing.uid()), group)
            .or_else(|_| unix::fchown(file, None, group));
        match kept {
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
    temporary.create().map_err(|error| Error::at(path, write_cause(&error)))?;
    Ok(())
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
    let target = followed(path);
    check_target(&target).map_err(|cause| Error::at(path, cause))?;
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
        fs::canonicalize(folder_of(&link))
            .is_ok_and(|folder| folder.starts_with("/proc") && folder.ends_with("fd"))
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
#[cfg(unix)]
static UNDER_WAY: Mutex<Vec<CString>> = Mutex::new(Vec::new());

/// Removes what is being written, for the process ends at once. Takes no memory and waits for nobody.
pub(crate) fn remove_unfinished() {
    #[cfg(unix)]
    if let Ok(names) = UNDER_WAY.try_lock() {
        for name in names.iter() {
            // SAFETY: it is a name. Nothing is left to do if it cannot be removed.
            unsafe { libc::unlink(name.as_ptr()) };
        }
    }
}

#[cfg(unix)]
fn under_way() -> MutexGuard<'static, Vec<CString>> {
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
        #[cfg(unix)]
        under_way().push(CString::new(self.path.as_os_str().as_bytes())?);
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
        #[cfg(unix)]
        under_way().retain(|name| name.as_bytes() != self.path.as_os_str().as_bytes());
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
