//! Open Image Denoise, found at run time: its C interface, versions 1 and 2
//! (<https://www.openimagedenoise.org/documentation.html>).

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use libloading::{Library, Symbol};

use super::samples::{Quality, Samples};
use crate::error::{Error, Result};
use crate::image::Image;

/// Names the library has, the newest first.
const NAMES: &[&str] = if cfg!(windows) {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.1.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"]
};

/// Where the pip package `pyoidn` has the library, beside all that it needs, in a folder of packages.
const PLACE_IN_PACKAGES: &str = if cfg!(windows) { "pyoidn/oidn/bin" } else { "pyoidn/oidn/lib" };

/// Where packages of lightgrid have it, seen from the program. On Linux its parts look for each other in `../lib`.
const PLACE_BESIDE: &str = if cfg!(windows) { "." } else { "../lib/lightgrid/lib" };

/// Where the loader looks for libraries.
const LOADER_PATH: &str = if cfg!(windows) {
    "PATH"
} else if cfg!(target_os = "macos") {
    "DYLD_LIBRARY_PATH"
} else {
    "LD_LIBRARY_PATH"
};

/// `OIDN_DEVICE_TYPE_CPU`: our pixels are in host memory.
const DEVICE_TYPE_CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FORMAT_FLOAT3: c_int = 3;
/// `OIDN_ERROR_CANCELLED`.
const ERROR_CANCELLED: c_int = 6;
/// `OIDN_QUALITY_FAST`, which versions from this one on know.
const QUALITY_FAST: c_int = 4;
const FAST_SINCE: c_int = 20300;

type Handle = *mut c_void;
type Name = *const c_char;
type NewDevice = unsafe extern "C" fn(c_int) -> Handle;
type OfHandle = unsafe extern "C" fn(Handle);
type NewFilter = unsafe extern "C" fn(Handle, Name) -> Handle;
type SetImage =
    unsafe extern "C" fn(Handle, Name, *mut c_void, c_int, usize, usize, usize, usize, usize);
type SetBool = unsafe extern "C" fn(Handle, Name, bool);
type SetInt = unsafe extern "C" fn(Handle, Name, c_int);
type Progress = unsafe extern "C" fn(*mut c_void, f64) -> bool;
type SetProgress = unsafe extern "C" fn(Handle, Progress, *mut c_void);
type GetInt = unsafe extern "C" fn(Handle, Name) -> c_int;
type GetError = unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int;

/// The library, if this machine has it; loaded once and for good.
fn library() -> Result<&'static Library> {
    static LIBRARY: OnceLock<Option<Library>> = OnceLock::new();
    let library = LIBRARY.get_or_init(|| {
        // Names without a folder: the loader looks in its own places. On Windows the current folder is one, which may
        // be that of somebody's scene.
        let named = match std::env::var_os("PATH") {
            Some(path) if cfg!(windows) => std::env::split_paths(&path)
                .filter(|folder| folder.is_absolute())
                .flat_map(|folder| libraries_in(&folder))
                .collect(),
            _ => NAMES.iter().map(PathBuf::from).collect::<Vec<_>>(),
        };
        let program = std::env::current_exe().and_then(std::fs::canonicalize).ok();
        let beside = program.and_then(|program| Some(program.parent()?.join(PLACE_BESIDE)));
        let of_pip: Box<dyn Iterator<Item = PathBuf>> = if cfg!(windows) {
            let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
            Box::new(installed_by_pip_on_windows(variable))
        } else {
            Box::new(installed_by_pip(python_prefixes()))
        };
        let found = beside.into_iter().flat_map(|folder| libraries_in(&folder)).chain(of_pip);
        first_that_loads(named.into_iter().chain(found))
    });
    library.as_ref().ok_or_else(|| {
        // Debian has no package of it (as of Debian 13).
        Error::new(format!(
            "Open Image Denoise is not installed: `pip install pyoidn` brings its library; or get that from \
             openimagedenoise.org, and name its folder in {LOADER_PATH}"
        ))
    })
}

/// The first of these that the loader takes. What is no library, or lacks another that it needs, is passed
/// over.
fn first_that_loads(mut candidates: impl Iterator<Item = PathBuf>) -> Option<Library> {
    // SAFETY: the library's initialisers are those of Intel's product.
    candidates.find_map(|path| unsafe { loaded(&path) }.ok())
}

/// # Safety
/// As for [`Library::new`].
unsafe fn loaded(path: &Path) -> std::result::Result<Library, libloading::Error> {
    #[cfg(windows)]
    if path.is_absolute() {
        use libloading::os::windows::{LOAD_WITH_ALTERED_SEARCH_PATH, Library as OfWindows};
        // What the library needs lies beside it, not beside this program.
        // SAFETY: as the caller promises.
        return unsafe { OfWindows::load_with_flags(path, LOAD_WITH_ALTERED_SEARCH_PATH) }
            .map(Library::from);
    }
    // SAFETY: as the caller promises.
    unsafe { Library::new(path) }
}

/// The prefixes (`sys.prefix`) below which pip installs: of the environment in use, the user's, the system's.
/// Relative ones are left out, for they lead into the current folder.
fn python_prefixes() -> impl Iterator<Item = PathBuf> {
    let environments = ["VIRTUAL_ENV", "CONDA_PREFIX"].into_iter().filter_map(std::env::var_os);
    let home = std::env::home_dir();
    let user = home.as_ref().map(|home| home.join(".local"));
    // Apple's Python has a prefix of the user's for each of its versions.
    let of_versions =
        home.filter(|_| cfg!(target_os = "macos")).map(|home| home.join("Library/Python"));
    let system: &[&str] = if cfg!(target_os = "macos") {
        &["/opt/homebrew", "/usr/local", "/Library/Frameworks/Python.framework/Versions/Current"]
    } else {
        &["/usr/local", "/usr"]
    };
    (environments.map(PathBuf::from))
        .chain(user)
        .chain(of_versions.into_iter().flat_map(|folder| newest_first(&folder, "")))
        .chain(system.iter().map(PathBuf::from))
        .filter(|prefix| prefix.is_absolute())
}

/// The libraries of the pip package below these prefixes of Python, in their order, and of each prefix the
/// newest Python's first: those in `lib/python3.12/site-packages`, Fedora's `lib64/…` or Debian's
/// `lib/python3/dist-packages`.
/// A prefix is looked into when it is reached.
fn installed_by_pip(prefixes: impl Iterator<Item = PathBuf>) -> impl Iterator<Item = PathBuf> {
    prefixes
        .flat_map(|prefix| ["lib", "lib64"].map(|lib| prefix.join(lib)))
        .flat_map(|lib| newest_first(&lib, "python"))
        .flat_map(|python| ["site-packages", "dist-packages"].map(|packages| python.join(packages)))
        .flat_map(|packages| libraries_in(&packages.join(PLACE_IN_PACKAGES)))
}

/// The same on Windows, below the folders that these variables name: the environments in use, the user's packages, the
/// user's Python and everybody's.
fn installed_by_pip_on_windows(
    variable: impl Fn(&str) -> Option<PathBuf>,
) -> impl Iterator<Item = PathBuf> {
    const FOLDERS: [(&str, &str); 3] =
        [("APPDATA", "Python"), ("LOCALAPPDATA", "Programs/Python"), ("ProgramFiles", ".")];
    let environments = ["VIRTUAL_ENV", "CONDA_PREFIX"].map(&variable).into_iter().flatten();
    let installed = FOLDERS
        .into_iter()
        .filter_map(move |(name, folder)| Some(variable(name)?.join(folder)))
        .flat_map(|folder| newest_first(&folder, "Python"));
    (environments.chain(installed).filter(|python| python.is_absolute()))
        .flat_map(|python| ["site-packages", "Lib/site-packages"].map(|it| python.join(it)))
        .flat_map(|packages| libraries_in(&packages.join(PLACE_IN_PACKAGES)))
}

/// What is in a folder, called so and then a version or none, the newest first: `python3.12`, `python3.9`,
/// `python3`. Nothing if the folder cannot be read.
fn newest_first(folder: &Path, name: &str) -> impl Iterator<Item = PathBuf> + use<> {
    let version = |path: &Path| -> Option<Vec<u32>> {
        let version = path.file_name()?.to_str()?.strip_prefix(name)?;
        // Python without its lock ends with a t: `python3.14t`.
        let numbers = version.trim_end_matches('t').split('.').filter(|number| !number.is_empty());
        numbers.map(|number| number.parse().ok()).collect()
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found = entries
        .filter_map(|entry| Some((version(&entry.path())?, entry.path())))
        .collect::<Vec<_>>();
    found.sort_by(|a, b| b.cmp(a));
    found.into_iter().map(|(_, path)| path)
}

/// Files of the library's names in a folder, the newest version first. By their full paths the loader finds
/// what they need beside them: so say their own search paths (`$ORIGIN`, on macOS `@loader_path`).
fn libraries_in(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let folder = folder.to_owned();
    NAMES.iter().map(move |name| folder.join(name)).filter(|path| path.is_file())
}

pub(super) fn check() -> Result<()> {
    library().map(|_| ())
}

fn function<T>(library: &'static Library, name: &str) -> Result<Symbol<'static, T>> {
    // SAFETY: each type above is that of the function in Intel's headers.
    unsafe { library.get(name.as_bytes()) }
        .map_err(|e| Error::new(format!("Open Image Denoise lacks {name}: {e}")))
}

/// A device or a filter, released when dropped.
struct Owned {
    handle: Handle,
    release: Symbol<'static, OfHandle>,
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: the handle came from the library and is released once.
        unsafe { (self.release)(self.handle) };
    }
}

/// Denoises radiance, guided by albedo and normals if there are layers, on as many threads as the caller has; `None` if
/// `cancel` is set meanwhile.
pub(super) fn denoise(
    samples: &Samples<'_>,
    quality: Quality,
    cancel: &AtomicBool,
) -> Result<Option<Image>> {
    let library = library()?;
    let new_device = function::<NewDevice>(library, "oidnNewDevice")?;
    let commit_device = function::<OfHandle>(library, "oidnCommitDevice")?;
    let new_filter = function::<NewFilter>(library, "oidnNewFilter")?;
    let commit_filter = function::<OfHandle>(library, "oidnCommitFilter")?;
    let execute = function::<OfHandle>(library, "oidnExecuteFilter")?;
    let set_image = function::<SetImage>(library, "oidnSetSharedFilterImage")?;
    let set_bool = function::<SetBool>(library, "oidnSetFilterBool")
        .or_else(|_| function::<SetBool>(library, "oidnSetFilter1b"))?;
    let set_int = function::<SetInt>(library, "oidnSetFilterInt")
        .or_else(|_| function::<SetInt>(library, "oidnSetFilter1i"))?;
    let set_device_int = function::<SetInt>(library, "oidnSetDeviceInt")
        .or_else(|_| function::<SetInt>(library, "oidnSetDevice1i"))?;
    let set_progress = function::<SetProgress>(library, "oidnSetFilterProgressMonitorFunction")?;
    let device_int = function::<GetInt>(library, "oidnGetDeviceInt")
        .or_else(|_| function::<GetInt>(library, "oidnGetDevice1i"))?;
    let get_error = function::<GetError>(library, "oidnGetDeviceError")?;

    let mut color = samples.image();
    let size = (color.width as usize, color.height as usize);
    let mut output = Image::filled(color.width, color.height, [0.0; 3]);
    let mut layers = samples.layers();
    // SAFETY: the calls follow the documentation; every image is a tight array of three floats a
    // pixel of the given size, and outlives the filter, which is dropped before the device.
    unsafe {
        let device = Owned {
            handle: new_device(DEVICE_TYPE_CPU),
            release: function(library, "oidnReleaseDevice")?,
        };
        if device.handle.is_null() {
            return Err(last_error(&get_error, null_mut()).1);
        }
        let threads = rayon::current_num_threads();
        set_device_int(device.handle, c"numThreads".as_ptr(), threads as c_int);
        commit_device(device.handle);
        let is_fast = quality == Quality::Fast
            && device_int(device.handle, c"version".as_ptr()) >= FAST_SINCE;
        let run = |images: &[(&CStr, *mut c_void)], flags: &[&CStr]| {
            let filter = Owned {
                handle: new_filter(device.handle, c"RT".as_ptr()),
                release: function(library, "oidnReleaseFilter")?,
            };
            if filter.handle.is_null() {
                return Err(last_error(&get_error, device.handle).1);
            }
            for (name, at) in images {
                let (name, format) = (name.as_ptr(), FORMAT_FLOAT3);
                set_image(filter.handle, name, *at, format, size.0, size.1, 0, 0, 0);
            }
            flags.iter().for_each(|flag| set_bool(filter.handle, flag.as_ptr(), true));
            if is_fast {
                set_int(filter.handle, c"quality".as_ptr(), QUALITY_FAST);
            }
            set_progress(filter.handle, goes_on, (&raw const *cancel).cast_mut().cast());
            commit_filter(filter.handle);
            execute(filter.handle);
            Ok(())
        };
        let mut images: Vec<(&CStr, *mut c_void)> =
            vec![(c"color", color.pixels.as_mut_ptr().cast())];
        let mut flags = vec![c"hdr"];
        if let Some(layers) = &mut layers {
            for (name, layer) in [c"albedo", c"normal"].into_iter().zip(layers) {
                let at = layer.as_mut_ptr().cast();
                if quality == Quality::Prefiltered {
                    run(&[(name, at), (c"output", at)], &[])?;
                }
                images.push((name, at));
            }
            flags.extend((quality == Quality::Prefiltered).then_some(c"cleanAux"));
        }
        images.push((c"output", output.pixels.as_mut_ptr().cast()));
        run(&images, &flags)?;
        match last_error(&get_error, device.handle) {
            (0, _) => Ok(Some(output)),
            (ERROR_CANCELLED, _) => Ok(None),
            (_, error) => Err(error),
        }
    }
}

/// Whether a filter goes on: its progress does not matter.
///
/// # Safety
/// `cancel` points to an [`AtomicBool`].
unsafe extern "C" fn goes_on(cancel: *mut c_void, _progress: f64) -> bool {
    // SAFETY: as the caller promises.
    unsafe { !(*cancel.cast::<AtomicBool>()).load(Ordering::Relaxed) }
}

/// Code and sentence of the last error; code 0 is none.
fn last_error(get_error: &Symbol<'static, GetError>, device: Handle) -> (c_int, Error) {
    let mut message = null();
    // SAFETY: a null device asks for the thread's own error.
    let code = unsafe { get_error(device, &raw mut message) };
    let text = if message.is_null() {
        "unknown error".into()
    } else {
        // SAFETY: the library gives a string that ends with 0 and lives until its next call.
        unsafe { CStr::from_ptr(message) }.to_string_lossy()
    };
    (code, Error::new(format!("Open Image Denoise: {text}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file where pyoidn's wheel has the library, below a prefix of Python; it is no library.
    fn put(prefix: &Path, packages: &str, name: &str) -> PathBuf {
        let folder = prefix.join("lib").join(packages).join(PLACE_IN_PACKAGES);
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join(name);
        std::fs::write(&path, "no library").expect("written");
        path
    }

    #[test]
    fn the_library_is_found_where_pip_has_it_the_newest_first() {
        let temporary = tempfile::tempdir().expect("a folder");
        let [own, system] = ["own", "system"].map(|name| temporary.path().join(name));
        let (newest, last) = (NAMES[0], NAMES[NAMES.len() - 1]);
        let of_debian = put(&system, "python3/dist-packages", newest);
        let of_system = put(&system, "python3.9/site-packages", newest);
        let unversioned = put(&own, "python3.9/site-packages", last);
        let older = put(&own, "python3.9/site-packages", newest);
        let newer = put(&own, "python3.12/site-packages", newest);
        // The library's parts are not the library, and other folders are not Python's.
        put(&own, "python3.12/site-packages", "libOpenImageDenoise_core.so.2.5.1");
        put(&own, "pythonic/site-packages", newest);
        let missing = temporary.path().join("missing");
        let found = installed_by_pip([missing, own, system].into_iter()).collect::<Vec<_>>();
        let mut expected = vec![newer, older, unversioned, of_system, of_debian];
        expected.dedup();
        assert_eq!(found, expected);
    }

    #[test]
    fn the_library_is_found_where_pip_has_it_on_windows() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = |name: &str| temporary.path().join(name);
        let put = |packages: &str| {
            let folder = folder(packages).join(PLACE_IN_PACKAGES);
            std::fs::create_dir_all(&folder).expect("a folder");
            std::fs::write(folder.join(NAMES[0]), "no library").expect("written");
            folder.join(NAMES[0])
        };
        let of_all = put("all/Python39/Lib/site-packages");
        let newer = put("all/Python312/Lib/site-packages");
        let of_user = put("roaming/Python/Python311/site-packages");
        let environment = put("own/Lib/site-packages");
        let found = installed_by_pip_on_windows(|variable| match variable {
            "VIRTUAL_ENV" => Some(folder("own")),
            "APPDATA" => Some(folder("roaming")),
            "ProgramFiles" => Some(folder("all")),
            _ => None,
        });
        let found = found.collect::<Vec<_>>();
        let same = |found: &PathBuf, expected: &PathBuf| {
            std::fs::canonicalize(found).ok() == std::fs::canonicalize(expected).ok()
        };
        let expected = [environment, of_user, newer, of_all];
        assert_eq!(found.len(), expected.len(), "{found:?}");
        assert!(found.iter().zip(&expected).all(|(a, b)| same(a, b)), "{found:?}");
    }

    #[test]
    fn a_file_that_is_no_library_is_passed_over() {
        let temporary = tempfile::tempdir().expect("a folder");
        let file = put(temporary.path(), "python3.12/site-packages", NAMES[0]);
        let found = || installed_by_pip([temporary.path().to_owned()].into_iter());
        assert_eq!(found().collect::<Vec<_>>(), [file]);
        assert!(first_that_loads(found()).is_none());
        if cfg!(all(target_os = "linux", target_env = "gnu")) {
            assert!(first_that_loads(found().chain(["libm.so.6".into()])).is_some());
        }
    }

    #[test]
    fn prefixes_of_python_are_never_in_the_current_folder() {
        assert!(python_prefixes().all(|prefix| prefix.is_absolute()));
    }
}
