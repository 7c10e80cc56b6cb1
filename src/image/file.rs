//! Writing a file so that it is either the old one or the whole new one.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

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
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    check_target(&target).map_err(|cause| Error::at(path, cause))?;
    let temporary = Temporary::beside(&target);
    let written = OpenOptions::new()
        .write(true)
        .read(true)
        .create_new(true)
        .open(&temporary.path)
        .and_then(|file| {
            let mut buffered = BufWriter::with_capacity(1 << 20, file);
            write(&mut buffered)?;
            buffered.flush()?;
            buffered.get_ref().sync_all()
        })
        .and_then(|()| fs::rename(&temporary.path, &target));
    written.map_err(|error| Error::at(path, write_cause(&error)))?;
    // The rename itself reaches the disk with its folder; not every file system allows asking.
    if let Some(Ok(folder)) = target.parent().map(File::open) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Whether [`write_beside_and_rename`] could write `path` now: asked before long work, so that it is
/// not lost at its end.
///
/// # Errors
/// As for writing.
pub fn check_writable(path: &Path) -> Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    check_target(&target).map_err(|cause| Error::at(path, cause))?;
    let temporary = Temporary::beside(&target);
    File::create_new(&temporary.path).map_err(|error| Error::at(path, write_cause(&error)))?;
    Ok(())
}

/// Whether two paths name the same file, there already or yet to be written.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        fs::canonicalize(path).or_else(|_| {
            let folder = fs::canonicalize(folder_of(path))?;
            Ok::<_, io::Error>(folder.join(path.file_name().unwrap_or_default()))
        })
    };
    matches!((place(a), place(b)), (Ok(a), Ok(b)) if a == b)
}

/// Why `target` cannot be written, as far as can be known before trying.
fn check_target(target: &Path) -> std::result::Result<(), String> {
    if target.file_name().is_none() {
        return Err("cannot be written: it does not name a file".into());
    }
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(format!("cannot be written: there is no folder {}", folder.display()));
    }
    match fs::metadata(target) {
        Ok(existing) if existing.is_dir() => Err("cannot be written: it is a folder".into()),
        Ok(existing) if !existing.is_file() => {
            Err("cannot be written: it is not an ordinary file".into())
        }
        Ok(existing) if existing.permissions().readonly() => {
            Err("cannot be written: it is read-only".into())
        }
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

impl Temporary {
    fn beside(target: &Path) -> Self {
        let mut name = OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        let path = folder_of(target).join(name);
        // A leftover of a crashed process that had our id.
        let _ = fs::remove_file(&path);
        Self { path }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
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
