//! Where memory is short and nobody has asked for it before, libraries abort or panic. That is no fault of the program,
//! which ends as it does for any other cause: with a sentence.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::image::remove_unfinished;
use crate::memory::{has_last_word, is_refusal_the_end};
use crate::system::{can_commit, exit_now, max_stack, on_abort, write_stderr};

/// Whether the system has refused memory.
static REFUSED: AtomicBool = AtomicBool::new(false);

/// The system's allocator for the binary. It notes refusals, for some callers take them as an answer, and ends the
/// process at one where nothing can go on.
#[derive(Debug, Clone, Copy)]
pub struct Allocator;

/// Who asks for less takes no refusal for an answer.
const SMALL: usize = 64 << 10;

/// More than a thread needs, and less than anything goes on with.
const LITTLE: usize = 4 << 20;

/// More of the stack than commands use in the main thread.
const STACK: usize = 1 << 20;

fn noted(memory: *mut u8, size: usize) -> *mut u8 {
    if memory.is_null() {
        REFUSED.store(true, Ordering::Relaxed);
        // Telling of a fault takes memory too, and under a lock, for which a second fault would wait.
        if size < SMALL || std::thread::panicking() || is_refusal_the_end() {
            end(size);
        }
    }
    memory
}

/// Ends the process as an error, in words that take no memory.
fn end(size: usize) -> ! {
    // Other threads may have been refused memory, too: one of them says so.
    while !has_last_word() {
        std::thread::sleep(Duration::from_secs(60));
    }
    remove_unfinished();
    let mut words = [0; 80];
    let mut rest = &mut words[..];
    let _ = writeln!(rest, "lightgrid: memory is short: {size} bytes more cannot be had");
    let left = rest.len();
    write_stderr(&words[..words.len() - left]);
    exit_now(1)
}

// SAFETY: all is left to the system's allocator, and noting takes no memory.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        noted(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Has the main thread's stack grow now: where the system refuses that later, it kills the process without
/// a word.
#[inline(never)]
fn take_stack(bytes: usize) {
    const STEP: usize = 16 << 10;
    std::hint::black_box(&mut [0_u8; STEP]);
    if let Some(left) = bytes.checked_sub(STEP) {
        take_stack(left);
    }
    // Nothing is returned from here at once, or there would be but one frame.
    std::hint::black_box(bytes);
}

/// From now on memory that [`Allocator`] cannot have ends the process as an error. For the main thread.
pub(crate) fn is_an_error() {
    let stack = STACK.min(max_stack() / 4);
    if !can_commit(stack) {
        end(stack);
    }
    take_stack(stack);
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        // Stacks of threads are not the allocator's, and starting one panics where there is no room for it.
        if is_refusal_the_end() && !can_commit(LITTLE) {
            end(LITTLE);
        }
        tell(panic);
    }));
    on_abort(|| {
        let is_refused = REFUSED.load(Ordering::Relaxed);
        if is_refused {
            remove_unfinished();
        }
        is_refused
    });
}
