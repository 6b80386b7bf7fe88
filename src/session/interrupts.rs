//! This module handles interrupts by the user, and writes messages to the terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A flag that an interrupt sets; a run then ends after its current step.
pub type Interrupted = Arc<AtomicBool>;

/// Time after an interrupt at which the program ends, whatever it does.
const PATIENCE: Duration = Duration::from_millis(9_000);

/// Handles interrupts: the first sets the flag, a second ends the program with the given exit code.
/// After [`PATIENCE`] the program ends by itself: schedulers kill soon after that.
pub fn watch_interrupts(exit_code: u8) -> Interrupted {
    let interrupted = Interrupted::default();
    let flag = interrupted.clone();
    let watching = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(exit_code));
        }
        let late = move || {
            std::thread::sleep(PATIENCE);
            tell(format_args!(
                "warning: the work at hand did not end within {} s of the interrupt; a run with \
                 checkpoints continues with `grainscope resume`",
                PATIENCE.as_secs()
            ));
            std::process::exit(i32::from(exit_code));
        };
        if std::thread::Builder::new().name("interrupt".into()).spawn(late).is_err() {
            std::process::exit(i32::from(exit_code));
        }
    });
    if let Err(e) = watching {
        tell(format_args!("warning: an interrupt will end the program at once: {e}"));
    }
    interrupted
}

/// Makes a write beyond the size that the system allows for files (`ulimit -f`) an error of that
/// write. By default the signal `SIGXFSZ` ends the program without a word.
pub fn handle_file_size_limit() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        /// `SIGXFSZ` on Linux, macOS and the BSDs.
        const SIGXFSZ: i32 = 25;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        if let Ok(runtime) = runtime {
            let _inside = runtime.enter();
            // The handler remains when the runtime has ended. Without it, the default applies.
            let _ = signal(SignalKind::from_raw(SIGXFSZ));
        }
    }
}

/// Waits for an interrupt.
pub fn wait_for_interrupt(interrupted: &Interrupted) {
    while !interrupted.load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Writes a line to stderr; a closed stderr is not an error.
pub fn tell(text: impl std::fmt::Display) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// A progress bar on stderr with a number of units, with or without a message.
pub fn progress_bar(units: u64, message: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(units), ProgressDrawTarget::stderr_with_hz(8));
    let template = if message {
        "{bar:30} {percent:>3} %  {msg}  {elapsed} of about {duration}"
    } else {
        "{bar:30} {percent:>3} %  {elapsed} of about {duration}"
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
