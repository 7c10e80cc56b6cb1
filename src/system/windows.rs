//! Windows.

use std::io::{self, IsTerminal as _};
use std::ops::Range;
use std::os::windows::ffi::OsStrExt as _;
use std::os::windows::process::CommandExt as _;
use std::path::Path;
use std::process::Command;
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use windows_sys::Win32::Foundation::{FILETIME, HWND, LPARAM, LRESULT, WPARAM};
use windows_sys::Win32::Storage::FileSystem::{DeleteFileW, WriteFile};
use windows_sys::Win32::System::Console::{
    CTRL_BREAK_EVENT, CTRL_C_EVENT, CTRL_CLOSE_EVENT, CTRL_SHUTDOWN_EVENT, FreeConsole,
    GetConsoleProcessList, GetStdHandle, STD_ERROR_HANDLE, SetConsoleCtrlHandler,
};
use windows_sys::Win32::System::LibraryLoader::SetDllDirectoryW;
use windows_sys::Win32::System::Memory::{
    MEM_COMMIT, MEM_RELEASE, MEM_RESERVE, PAGE_READWRITE, VirtualAlloc, VirtualFree,
};
use windows_sys::Win32::System::SystemInformation::{GlobalMemoryStatusEx, MEMORYSTATUSEX};
use windows_sys::Win32::System::Threading::{
    CREATE_NEW_PROCESS_GROUP, CREATE_NO_WINDOW, GetCurrentProcess, GetCurrentThread,
    GetThreadTimes, SetThreadPriority, THREAD_PRIORITY_BELOW_NORMAL, TerminateProcess,
};
use windows_sys::Win32::UI::WindowsAndMessaging::{
    CreateWindowExW, DefWindowProcW, DispatchMessageW, GWLP_WNDPROC, GetMessageW, MB_ICONERROR,
    MB_OK, MSG, MessageBoxW, SetWindowLongPtrW, WM_ENDSESSION,
};
use windows_sys::core::{BOOL, w};

/// Prepares the process: libraries are not looked for in the current folder, which may be that of somebody's scene.
pub(crate) fn prepare_process() {
    // SAFETY: an empty name that ends with 0.
    unsafe { SetDllDirectoryW([0].as_ptr()) };
}

/// Numbers of the signals that other systems have for the console's events.
const HANG_UP: i32 = 1;
const INTERRUPT: i32 = 2;
const TERMINATE: i32 = 15;

/// The signal of a console that is closed.
pub(crate) fn hang_up() -> Option<i32> {
    Some(HANG_UP)
}

type Answer = Box<dyn FnMut(i32) + Send>;

/// What answers requests to end.
static ANSWER: Mutex<Option<Answer>> = Mutex::new(None);

/// Answers requests to end from now on, in threads of the system: Ctrl-C, Ctrl-Break, a closed console, the end of the
/// session. Each goes by the number of a signal.
///
/// # Errors
/// If they cannot be caught.
pub(crate) fn on_request_to_end(answer: impl FnMut(i32) + Send + 'static) -> io::Result<()> {
    *ANSWER.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(answer));
    std::thread::Builder::new().name("end of session".into()).spawn(watch_session)?;
    // SAFETY: the handler is there as long as the process.
    match unsafe { SetConsoleCtrlHandler(Some(handle_request_to_end), 1) } {
        0 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}

unsafe extern "system" fn handle_request_to_end(event: u32) -> BOOL {
    let signal = match event {
        CTRL_C_EVENT | CTRL_BREAK_EVENT => INTERRUPT,
        CTRL_CLOSE_EVENT => HANG_UP,
        _ => TERMINATE,
    };
    if let Some(answer) = &mut *ANSWER.lock().unwrap_or_else(PoisonError::into_inner) {
        answer(signal);
    }
    // The system ends the process as soon as this returns, or after some seconds in which work can be saved.
    if signal != INTERRUPT {
        loop {
            std::thread::sleep(Duration::from_secs(60));
        }
    }
    1
}

/// Watches for a log-off or a shutdown. A program that loads `user32.dll` learns of them by messages to a window alone,
/// so a hidden one is made.
fn watch_session() {
    // SAFETY: the texts end with 0, the window belongs to this thread, and its procedure stays as long as the process.
    unsafe {
        let none = null_mut();
        let (class, title) = (w!("STATIC"), w!("lightgrid"));
        let window = CreateWindowExW(0, class, title, 0, 0, 0, 0, 0, none, none, none, null());
        SetWindowLongPtrW(window, GWLP_WNDPROC, handle_message as *const () as isize);
        let mut message = MSG::default();
        while GetMessageW(&mut message, none, 0, 0) > 0 {
            DispatchMessageW(&message);
        }
    }
}

/// Handles a message to the hidden window. `is_certain` is 0 where somebody refused the end of the session.
unsafe extern "system" fn handle_message(
    window: HWND,
    message: u32,
    is_certain: WPARAM,
    reason: LPARAM,
) -> LRESULT {
    // SAFETY: the system calls this, with a message of its own.
    unsafe {
        if message == WM_ENDSESSION && is_certain != 0 {
            handle_request_to_end(CTRL_SHUTDOWN_EVENT);
        }
        DefWindowProcW(window, message, is_certain, reason)
    }
}

/// Ends the process without running anything else of it. Takes no memory.
pub(crate) fn exit_now(code: i32) -> ! {
    loop {
        // SAFETY: it may be called at any time.
        unsafe { TerminateProcess(GetCurrentProcess(), code.cast_unsigned()) };
    }
}

/// Writes to stderr without a lock and without memory.
pub(crate) fn write_stderr(text: &[u8]) {
    let length = u32::try_from(text.len()).unwrap_or(u32::MAX);
    // SAFETY: the bytes are there. Nobody can be told if they cannot be written.
    unsafe { WriteFile(GetStdHandle(STD_ERROR_HANDLE), text.as_ptr(), length, &mut 0, null_mut()) };
}

/// Whether the system would back `bytes` more of memory now.
pub(crate) fn can_commit(bytes: usize) -> bool {
    // SAFETY: nothing else is there, and it is given back at once.
    unsafe {
        let memory = VirtualAlloc(null(), bytes, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE);
        !memory.is_null() && VirtualFree(memory, 0, MEM_RELEASE) != 0
    }
}

/// Most bytes of the main thread's stack, which is part of the executable.
pub(crate) fn max_stack() -> usize {
    1 << 20
}

/// Nothing is asked at an abort here.
pub(crate) fn on_abort(_: fn() -> bool) {}

/// CPU time of this thread, where the system says.
pub(crate) fn thread_cpu_time() -> Option<Duration> {
    let [mut created, mut ended, mut kernel, mut user] = [FILETIME::default(); 4];
    // SAFETY: the times are written there.
    let outcome = unsafe {
        GetThreadTimes(GetCurrentThread(), &mut created, &mut ended, &mut kernel, &mut user)
    };
    let ticks =
        |time: FILETIME| u64::from(time.dwHighDateTime) << 32 | u64::from(time.dwLowDateTime);
    // A tick is 100 ns.
    (outcome != 0).then(|| Duration::from_nanos(100 * (ticks(kernel) + ticks(user))))
}

/// A file's path as the system takes it.
#[derive(PartialEq)]
pub(crate) struct FileName(Vec<u16>);

impl FileName {
    /// # Errors
    /// None here.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self(path.as_os_str().encode_wide().chain([0]).collect()))
    }

    /// Removes the file, if it is there. Takes no memory.
    pub(crate) fn remove(&self) {
        // SAFETY: it is a name that ends with 0. Nothing is left to do if it cannot be removed.
        unsafe { DeleteFileW(self.0.as_ptr()) };
    }
}

/// Keeps Ctrl-C in this process' console from a process to be started, which gets no window for a console either.
pub(crate) fn set_apart(command: &mut Command) {
    command.creation_flags(CREATE_NEW_PROCESS_GROUP | CREATE_NO_WINDOW);
}

/// Bytes that the process can get before the machine starts to swap.
pub(crate) fn available_memory() -> Option<u64> {
    let length = u32::try_from(size_of::<MEMORYSTATUSEX>()).ok()?;
    let mut status = MEMORYSTATUSEX { dwLength: length, ..MEMORYSTATUSEX::default() };
    // SAFETY: the structure has the length that it names.
    let outcome = unsafe { GlobalMemoryStatusEx(&mut status) };
    let available = [status.ullAvailPhys, status.ullAvailPageFile, status.ullAvailVirtual];
    available.into_iter().min().filter(|_| outcome != 0)
}

/// This system's allocator gives large arrays back as they are freed.
pub(crate) fn return_large_arrays() {}

/// See [`return_large_arrays`].
pub(crate) fn return_freed() {}

/// Large pages need a privilege that users do not have.
pub(crate) fn advise_huge_pages(_: Range<usize>) {}

/// Lets other threads go first: those of the window before those that render.
pub(crate) fn lower_thread_priority() {
    // SAFETY: plain system call on the calling thread; failing is harmless.
    unsafe { SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_BELOW_NORMAL) };
}

/// Whether the console that was opened for this process alone has been left.
static HAS_LEFT_CONSOLE: AtomicBool = AtomicBool::new(false);

/// Closes the console that the system opened for this process alone, as it does when a program is double-clicked;
/// whether nobody can read stderr from now on. Where the manifest is obeyed no console was opened.
pub(crate) fn leave_own_console() -> bool {
    // SAFETY: as many numbers as named are written, and the console may be left at any time.
    let has_left = unsafe {
        match GetConsoleProcessList([0; 2].as_mut_ptr(), 2) {
            0 => GetStdHandle(STD_ERROR_HANDLE).is_null(),
            1 => io::stderr().is_terminal() && FreeConsole() != 0,
            _ => false,
        }
    };
    HAS_LEFT_CONSOLE.store(has_left, Ordering::Relaxed);
    has_left
}

/// Shows why the program ends where no console is left to say it.
pub(crate) fn show_error(text: &str) {
    if HAS_LEFT_CONSOLE.load(Ordering::Relaxed) {
        let [text, title] =
            [text, "lightgrid"].map(|text| text.encode_utf16().chain([0]).collect::<Vec<_>>());
        // SAFETY: both texts end with 0.
        unsafe { MessageBoxW(null_mut(), text.as_ptr(), title.as_ptr(), MB_OK | MB_ICONERROR) };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn requests_to_end_are_answered_and_one_that_ends_the_process_is_held() {
        let (sender, answers) = mpsc::channel();
        on_request_to_end(move |signal| {
            let _ = sender.send(signal);
        })
        .expect("they can be caught");
        for event in [CTRL_C_EVENT, CTRL_BREAK_EVENT] {
            // SAFETY: the handler asks nothing of its caller.
            assert_eq!(unsafe { handle_request_to_end(event) }, 1);
            assert_eq!(answers.recv(), Ok(INTERRUPT));
        }
        for (event, signal) in [(CTRL_CLOSE_EVENT, HANG_UP), (CTRL_SHUTDOWN_EVENT, TERMINATE)] {
            // SAFETY: as above.
            let held = std::thread::spawn(move || unsafe { handle_request_to_end(event) });
            assert_eq!(answers.recv(), Ok(signal));
            std::thread::sleep(Duration::from_millis(100));
            assert!(!held.is_finished());
        }
        let (window, none) = (null_mut(), 0);
        // SAFETY: as above; no window has this message. Somebody else may have refused the end of the session.
        assert_eq!(unsafe { handle_message(window, WM_ENDSESSION, 0, none) }, 0);
        assert!(answers.try_recv().is_err());
        // SAFETY: as above.
        let end = || unsafe { handle_message(null_mut(), WM_ENDSESSION, 1, 0) };
        let held = std::thread::spawn(end);
        assert_eq!(answers.recv(), Ok(TERMINATE));
        std::thread::sleep(Duration::from_millis(100));
        assert!(!held.is_finished());
    }
}
