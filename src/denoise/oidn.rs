//! Open Image Denoise, found at run time: its C interface, versions 1 and 2
//! (<https://www.openimagedenoise.org/documentation.html>).

use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

use libloading::{Library, Symbol};

use super::samples::Samples;
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

/// `OIDN_DEVICE_TYPE_CPU`: our pixels are in host memory.
const DEVICE_TYPE_CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FORMAT_FLOAT3: c_int = 3;

type Handle = *mut c_void;
type NewDevice = unsafe extern "C" fn(c_int) -> Handle;
type OfHandle = unsafe extern "C" fn(Handle);
type NewFilter = unsafe extern "C" fn(Handle, *const c_char) -> Handle;
type SetImage = unsafe extern "C" fn(
    Handle,
    *const c_char,
    *mut c_void,
    c_int,
    usize,
    usize,
    usize,
    usize,
    usize,
);
type SetBool = unsafe extern "C" fn(Handle, *const c_char, bool);
type GetError = unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int;

/// The library, if this machine has it; loaded once and for good.
fn library() -> Result<&'static Library> {
    static LIBRARY: OnceLock<Option<Library>> = OnceLock::new();
    let library = LIBRARY.get_or_init(|| {
        // SAFETY: the library's initialisers are those of Intel's product.
        NAMES.iter().find_map(|name| unsafe { Library::new(name) }.ok())
    });
    library.as_ref().ok_or_else(|| {
        Error::new(format!("Open Image Denoise is not installed: no {}", NAMES.join(", no ")))
    })
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

/// Denoises radiance, guided by albedo and normals if there are layers.
pub(super) fn denoise(samples: &Samples<'_>) -> Result<Image> {
    let library = library()?;
    let new_device = function::<NewDevice>(library, "oidnNewDevice")?;
    let commit_device = function::<OfHandle>(library, "oidnCommitDevice")?;
    let new_filter = function::<NewFilter>(library, "oidnNewFilter")?;
    let commit_filter = function::<OfHandle>(library, "oidnCommitFilter")?;
    let execute = function::<OfHandle>(library, "oidnExecuteFilter")?;
    let set_image = function::<SetImage>(library, "oidnSetSharedFilterImage")?;
    let set_bool = function::<SetBool>(library, "oidnSetFilterBool")
        .or_else(|_| function::<SetBool>(library, "oidnSetFilter1b"))?;
    let get_error = function::<GetError>(library, "oidnGetDeviceError")?;

    let mut color = samples.image();
    let size = (color.width as usize, color.height as usize);
    let mut output = Image {
        width: color.width,
        height: color.height,
        pixels: vec![[0.0; 3]; color.pixels.len()],
    };
    let mut layers = samples.layers();
    // SAFETY: the calls follow the documentation; every image is a tight array of three floats a
    // pixel of the given size, and outlives the filter, which is dropped before the device.
    unsafe {
        let device = Owned {
            handle: new_device(DEVICE_TYPE_CPU),
            release: function(library, "oidnReleaseDevice")?,
        };
        if device.handle.is_null() {
            return Err(failure(&get_error, null_mut()));
        }
        commit_device(device.handle);
        let filter = Owned {
            handle: new_filter(device.handle, c"RT".as_ptr()),
            release: function(library, "oidnReleaseFilter")?,
        };
        if filter.handle.is_null() {
            return Err(failure(&get_error, device.handle));
        }
        let give = |name: &CStr, pixels: &mut [[f32; 3]]| {
            let (at, format) = (pixels.as_mut_ptr().cast(), FORMAT_FLOAT3);
            set_image(filter.handle, name.as_ptr(), at, format, size.0, size.1, 0, 0, 0);
        };
        give(c"color", &mut color.pixels);
        if let Some([albedo, normal]) = &mut layers {
            give(c"albedo", albedo);
            give(c"normal", normal);
        }
        give(c"output", &mut output.pixels);
        set_bool(filter.handle, c"hdr".as_ptr(), true);
        commit_filter(filter.handle);
        execute(filter.handle);
        let mut message = null();
        if get_error(device.handle, &raw mut message) != 0 {
            return Err(sentence(message));
        }
    }
    Ok(output)
}

fn failure(get_error: &Symbol<'static, GetError>, device: Handle) -> Error {
    let mut message = null();
    // SAFETY: a null device asks for the thread's own error.
    unsafe { get_error(device, &raw mut message) };
    sentence(message)
}

fn sentence(message: *const c_char) -> Error {
    let text = if message.is_null() {
        "unknown error".into()
    } else {
        // SAFETY: the library gives a string that ends with 0 and lives until its next call.
        unsafe { CStr::from_ptr(message) }.to_string_lossy()
    };
    Error::new(format!("Open Image Denoise: {text}"))
}
