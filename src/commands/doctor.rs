//! This module implements `grainscope doctor`: it prints what a bug report needs.

use super::{Failure, print};
use crate::cost::Machine;
use crate::plan::memory::{available, size};
use crate::record::checkpoint;
use crate::simd::Simd;
use indexmap::IndexMap;
use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;
use std::process::Command;

/// Print versions, processor, memory, disk, viewer and ports, for a bug report.
#[derive(clap::Args)]
pub struct Args {
    /// Folder whose disk space and permissions are checked
    #[arg(long, value_name = "DIR", default_value = ".")]
    dir: PathBuf,
    /// Print the facts as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let facts = facts(args);
    if args.json {
        let text = serde_json::to_string_pretty(&facts);
        return print(&text.map_err(|e| Failure::Environment(e.to_string()))?);
    }
    let width = facts.keys().map(|k| k.len()).max().unwrap_or(0);
    let lines: Vec<String> = facts.iter().map(|(k, v)| format!("{k:<width$}  {v}")).collect();
    print(&lines.join("\n"))
}

/// All facts, by name.
fn facts(args: &Args) -> IndexMap<&'static str, String> {
    let machine = Machine::here();
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let memory = format!(
        "{} in total, {} available to this program",
        size(system.total_memory() as f64),
        available().map_or("unknown".into(), size)
    );
    let system = sysinfo::System::long_os_version().unwrap_or_else(|| "unknown".into());
    [
        ("grainscope", env!("CARGO_PKG_VERSION").to_string()),
        ("recordings", "rerun 0.36.3".to_string()),
        ("checkpoints", format!("format {}", checkpoint::FORMAT)),
        ("system", format!("{system}, {}", std::env::consts::ARCH)),
        ("processor", machine.processor),
        ("features", processor_features().join(" ")),
        ("vectors", vectors()),
        ("threads", threads()),
        ("memory", memory),
        ("disk", disk(args)),
        ("folder", folder(args)),
        ("viewer", viewer()),
        ("ports", ports()),
    ]
    .into_iter()
    .collect()
}

/// Features of the processor that decide which instructions are used. The last digits of results
/// depend on them.
fn processor_features() -> Vec<&'static str> {
    let mut found = Vec::new();
    #[cfg(target_arch = "x86_64")]
    {
        let all = [
            ("sse4.2", std::arch::is_x86_feature_detected!("sse4.2")),
            ("avx", std::arch::is_x86_feature_detected!("avx")),
            ("avx2", std::arch::is_x86_feature_detected!("avx2")),
            ("fma", std::arch::is_x86_feature_detected!("fma")),
            ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
        ];
        found.extend(all.into_iter().filter(|f| f.1).map(|f| f.0));
    }
    #[cfg(target_arch = "aarch64")]
    found.push("neon");
    found
}

/// The instruction set of our own kernels.
fn vectors() -> String {
    let (used, best) = (Simd::used(), Simd::detect());
    if used == best {
        return used.name().to_owned();
    }
    format!("{}, though this processor has {}", used.name(), best.name())
}

/// Number of threads that the system offers.
fn threads() -> String {
    std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string())
}

/// Free disk space, as reported by `df`.
fn disk(args: &Args) -> String {
    let said = Command::new("df").arg("-Pk").arg(&args.dir).output();
    let text = said.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    let line = text.lines().nth(1).map(|l| l.split_whitespace().collect::<Vec<_>>());
    let free = line.as_ref().and_then(|l| l.get(3)?.parse::<f64>().ok());
    free.map_or("unknown".into(), |kb| format!("{} free", size(kb * 1024.0)))
}

/// Whether files can be written in the folder.
fn folder(args: &Args) -> String {
    let probe = args.dir.join(".grainscope-probe");
    let shown = std::path::absolute(&args.dir).unwrap_or_else(|_| args.dir.clone());
    match std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe)) {
        Ok(()) => format!("{}: can be written", shown.display()),
        Err(e) => format!("{}: cannot be written: {e}", shown.display()),
    }
}

/// The viewers that can be used.
fn viewer() -> String {
    let inside = match cfg!(feature = "viewer") {
        true => "part of the program (--serve)",
        false => "not part of this build (feature `viewer`)",
    };
    match Command::new("rerun").arg("--version").output() {
        Ok(said) if said.status.success() => {
            let version = String::from_utf8_lossy(&said.stdout);
            format!("{inside}; on the PATH: {}", version.lines().next().unwrap_or_default())
        }
        _ => format!("{inside}; no `rerun` on the PATH for --spawn"),
    }
}

/// Whether the ports for pages and data are free.
fn ports() -> String {
    let free = |port| match TcpListener::bind((Ipv4Addr::LOCALHOST, port)) {
        Ok(_) => "free".to_string(),
        Err(e) => e.to_string(),
    };
    format!("any: {}; 9876 (rerun's own): {}", free(0), free(9876))
}
