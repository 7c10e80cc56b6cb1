//! Lets `src/cpp.rs` replace a function with which libFuzzer only says that it does not do what that does.

fn main() {
    println!("cargo::rustc-link-arg-bins=-Wl,--allow-multiple-definition");
}
