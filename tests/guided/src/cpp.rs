//! Coverage of meshoptimizer, which is C++: what GCC calls in every block of code that it compiles with
//! `-fsanitize-coverage=trace-pc` (see `c++` beside this crate).

/// libFuzzer looks at sections of this name, too. One for each low half of an address.
#[unsafe(link_section = "__libfuzzer_extra_counters")]
static mut COUNTERS: [u8; 1 << 16] = [0; 1 << 16];

/// Counts the address it returns to.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn __sanitizer_cov_trace_pc() {
    std::arch::naked_asm!(
        "mov rax, [rsp]",
        "movzx eax, ax",
        "lea rcx, [rip + {counters}]",
        "inc byte ptr [rcx + rax]",
        "ret",
        counters = sym COUNTERS,
    )
}

/// GCC tells of compared floats, too, which libFuzzer makes nothing of.
#[unsafe(no_mangle)]
extern "C" fn __sanitizer_cov_trace_cmpf(_: f32, _: f32) {}

/// As above.
#[unsafe(no_mangle)]
extern "C" fn __sanitizer_cov_trace_cmpd(_: f64, _: f64) {}
