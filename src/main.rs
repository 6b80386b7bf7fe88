//! The binary `grainscope`: it calls [`grainscope::commands::main`].

fn main() -> std::process::ExitCode {
    grainscope::commands::main()
}
