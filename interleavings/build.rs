//! Tells the library which primitives of threads to use: `src/sync.rs` asks for conditions, as features of its own would be public.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    for checker in ["loom", "shuttle"] {
        if std::env::var_os(format!("CARGO_FEATURE_{}", checker.to_uppercase())).is_some() {
            println!("cargo::rustc-cfg=drawloom_{checker}");
            println!("cargo::rustc-cfg=drawloom_model_check");
        }
    }
}
