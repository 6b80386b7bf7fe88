fn main() -> std::process::ExitCode {
    grainscope::commands::main()
}
