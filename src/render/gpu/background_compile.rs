//! Kernels that are compiled while nobody waits for them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Weak};

use super::device::Gpu;
use super::kernel_cache::{CompileGuard, Pipeline};
use super::pipeline::{Programs, no_thread};
use crate::error::{Error, Result};

/// Kernels, or what is held by the thread that compiles them.
pub(crate) enum MaybeReady<T> {
    Ready(T),
    CompileGuard(Weak<CompileGuard>),
}

impl Gpu {
    /// Kernels, if this device ran all of them lately. Otherwise a thread compiles them, which holds what
    /// `until_then` gave, unless it has begun before, for as long: whoever asks again afterwards gets them.
    ///
    /// # Errors
    /// Once, if the driver has refused one.
    pub(super) fn pipelines_or_held(
        &self,
        programs: Programs,
        until_then: impl FnOnce() -> Arc<CompileGuard>,
    ) -> Result<MaybeReady<Vec<Arc<Pipeline>>>> {
        let sources: Vec<_> = programs.iter().map(|(_, program)| program.source.clone()).collect();
        let mut known = self.kernel_cache();
        if let Some((_, error)) = known.refused.take_if(|(of, _)| *of == sources) {
            return Err(error);
        }
        let found: Option<Vec<_>> = sources.iter().map(|source| known.find(source)).collect();
        if let Some(found) = found {
            return Ok(MaybeReady::Ready(found));
        }
        if let Some(held) = known.holder_of(&sources) {
            return Ok(MaybeReady::CompileGuard(held));
        }
        let (gpu, held) = (self.clone(), until_then());
        let holder = Arc::downgrade(&held);
        known.under_way.push((sources.clone(), Weak::clone(&holder)));
        drop(known);
        let compile = move || {
            // What is said of a panic is on the terminal.
            let failed = |_| Err(Error::new("a kernel cannot be compiled"));
            let compiled = catch_unwind(AssertUnwindSafe(|| gpu.pipelines(programs)));
            if let Err(error) = compiled.unwrap_or_else(failed) {
                gpu.kernel_cache().refused = Some((sources, error));
            }
            // Nobody is told before it can be found, nor when the device may have gone with the process.
            drop(gpu);
            drop(held);
        };
        std::thread::Builder::new()
            .name("kernels".to_owned())
            .spawn(compile)
            .map_err(|error| no_thread(&error))?;
        Ok(MaybeReady::CompileGuard(holder))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::gpu::kernel::Kernel;
    use crate::render::gpu::shader::Program;

    #[test]
    fn nobody_waits_for_kernels_that_are_compiled_meanwhile() {
        let Some(gpu) = Gpu::for_test() else { return };
        let programs = |body: &str| -> Programs {
            let program = |kernel: Kernel| {
                let source =
                    format!("@compute @workgroup_size(1) fn {}() {{ {body} }}", kernel.name());
                (kernel, Program { source, bindings: Vec::new() })
            };
            vec![program(Kernel::Trace), program(Kernel::Shade)]
        };
        let ask = |body: &str| gpu.pipelines_or_held(programs(body), || Arc::new(()));
        let wait_for = |held: &Weak<CompileGuard>| {
            while held.strong_count() > 0 {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        };
        let compile = |body: &str| {
            let Ok(MaybeReady::CompileGuard(held)) = ask(body) else { panic!("it is there") };
            let again = match ask(body) {
                Ok(MaybeReady::CompileGuard(again)) => again.ptr_eq(&held),
                // It may be there already.
                _ => true,
            };
            assert!(again, "twice at a time");
            wait_for(&held);
        };
        let is_ready =
            |body: &str| matches!(ask(body), Ok(MaybeReady::Ready(found)) if found.len() == 2);
        compile("return;");
        assert!(is_ready("return;"));
        let begun = ask("return 1;");
        assert!(matches!(begun, Ok(MaybeReady::CompileGuard(_))));
        // Nobody else's kernels are blamed.
        assert!(is_ready("return;"));
        if let Ok(MaybeReady::CompileGuard(held)) = begun {
            wait_for(&held);
        }
        let refused = ask("return 1;").err().expect("it is no program").to_string();
        assert!(refused.starts_with(&gpu.facts().name), "{refused}");
        assert!(
            matches!(ask("return 1;"), Ok(MaybeReady::CompileGuard(_))),
            "said once, it is tried again"
        );
    }
}
