//! Fuzz tests of scenes, expressions, `--set`, checkpoints, recordings and HTTP requests.
//!
//! Each input must be refused or accepted within a second and without a panic. Inputs are valid
//! files (presets, files of a run) with parts cut, duplicated, swapped and replaced. The seed
//! (`GRAINSCOPE_SEED`) and the number of an input identify it. `GRAINSCOPE_INPUTS` is the number of
//! inputs.

use super::killed::{effort, random};
use super::*;
use grainscope::internals::checkpoint;
use grainscope::internals::open_all;
use grainscope::internals::timed;
use grainscope::internals::{Recorded, repair};
use grainscope::scene::{self, Quantity, SceneSource, Scope};
use grainscope::{plan, sim};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64Mcg;
use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{DecoderApp, Encoder, EncodingOptions};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

/// Longest processor time for one input, s: other programs do not count.
const PATIENCE: f64 = 1.0;
/// Longest time for one input by the clock, s: nothing may hang.
const LONGEST: f64 = 60.0;
/// Largest peak memory of all these tests together, kB.
const MEMORY: u64 = 1_000_000;

/// Tests one input. If it panics or takes too long, the input is written to a file and shown.
fn try_one(what: &str, number: u64, input: &[u8], test: impl FnOnce()) {
    let (outcome, took) = timed(|| catch_unwind(AssertUnwindSafe(test)));
    if outcome.is_err() || took.cpu > PATIENCE || took.wall > LONGEST {
        let path = std::env::temp_dir().join(format!("grainscope-hostile-{what}-{number}"));
        std::fs::write(&path, input).expect("written");
        let shown = String::from_utf8_lossy(&input[..input.len().min(2000)]).into_owned();
        let how = if outcome.is_err() { "panics" } else { "is too slow" };
        panic!("{what} {number} {how} ({took:?}); the input is in {}:\n{shown}", path.display());
    }
}

/// Text fragments that are difficult for parsers.
const PIECES: [&str; 40] = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "nan",
    "inf",
    "1/0",
    "9223372036854775807",
    "18446744073709551616",
    "-0",
    "[]",
    "[[",
    "]]",
    "{}",
    "\"",
    "'",
    "\\",
    "\u{0}",
    "\u{202e}é𝄞",
    "=",
    ".",
    ",",
    "x",
    "y",
    "x^x^x",
    "sin(",
    "sqrt(-1)",
    "((((((((",
    "))))",
    "1e",
    "0x1p9",
    "true",
    "#",
    "\n[materials.a]\n",
    "\n[[regions]]\n",
    "\n[[walls]]\n",
    "\n[[schedule]]\n",
    "cells = 90000\n",
];

/// A text with random changes.
fn mutated(random: &mut Pcg64Mcg, text: &str) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for _ in 0..random.random_range(1..5) {
        let n = chars.len();
        let at = random.random_range(0..=n);
        let to = (at + random.random_range(0..1 + n.min(40))).min(n);
        match random.random_range(0..6) {
            0 => drop(chars.drain(at..to)),
            1 => {
                let copy: Vec<char> = chars[at..to].to_vec();
                let place = random.random_range(0..=n);
                chars.splice(place..place, copy);
            }
            2 | 3 => {
                let piece = PIECES.choose(random).expect("some");
                chars.splice(at..to.min(at + 6), piece.chars());
            }
            4 => {
                // Replaces a digit by another number.
                let digits = chars.iter().enumerate().filter(|(_, c)| c.is_ascii_digit());
                let digits: Vec<usize> = digits.map(|d| d.0).collect();
                if let Some(&digit) = digits.choose(random) {
                    let piece = PIECES[random.random_range(1..12)];
                    chars.splice(digit..digit + 1, piece.chars());
                }
            }
            _ => {
                // Swaps two lines.
                let text: String = chars.iter().collect();
                let mut lines: Vec<&str> = text.lines().collect();
                if lines.len() > 1 {
                    let (a, b) =
                        (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
                    lines.swap(a, b);
                }
                chars = lines.join("\n").chars().collect();
            }
        }
    }
    chars.into_iter().collect()
}

/// Bytes with random changes.
fn mutated_bytes(random: &mut Pcg64Mcg, bytes: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..random.random_range(1..4) {
        let n = out.len();
        if n == 0 {
            break;
        }
        let at = random.random_range(0..n);
        match random.random_range(0..5) {
            0 => out[at] ^= 1 << random.random_range(0..8),
            1 => out.truncate(at),
            2 => {
                let to = (at + 8).min(n);
                out[at..to].fill(*[0x00, 0xff, 0x7f].choose(random).expect("some"));
            }
            3 => {
                let to = (at + random.random_range(0..64)).min(n);
                out.drain(at..to);
            }
            _ => {
                let to = (at + random.random_range(0..64)).min(n);
                let part = out[at..to].to_vec();
                out.splice(at..at, part);
            }
        }
    }
    out
}

/// Runs a share of all inputs and returns their number; checks the peak memory.
fn inputs(share: f64, mut each: impl FnMut(&mut Pcg64Mcg, u64)) -> u64 {
    let count = (share * effort("GRAINSCOPE_INPUTS", 20_000) as f64).ceil() as u64;
    let mut random = random();
    (0..count).for_each(|k| each(&mut random, k));
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let line = status.lines().find(|l| l.starts_with("VmHWM:")).expect("a peak");
        let peak: u64 = line.split_whitespace().nth(1).expect("kB").parse().expect("a number");
        assert!(peak < MEMORY, "the peak memory is {peak} kB");
    }
    count
}

#[test]
fn scenes() {
    let corpus = preset_files();
    let (mut refused, mut taken) = (0, 0);
    let count = inputs(0.1, |random, k| {
        let (name, text) = corpus.choose(random).expect("presets");
        let text = mutated(random, text);
        try_one("scene", k, text.as_bytes(), || {
            let source = SceneSource::new(format!("{name}.toml"), text.as_str());
            let outcome = scene::parse(&source)
                .and_then(|s| plan::resolve(&s).map_err(|e| e.with_source(&source)));
            match outcome {
                Ok(_) => taken += 1,
                Err(e) => {
                    assert!(e.one_line().starts_with(&format!("{name}.toml")), "{}", e.one_line());
                    refused += 1;
                }
            }
        });
    });
    println!("{count} scenes: {refused} refused, {taken} accepted");
    assert!(refused > count / 4 && taken > 0);
}

#[test]
fn expressions() {
    let words = [
        "x", "y", "alpha", "pi", "1", "2.5", "1e308", "(", ")", "+", "-", "*", "/", "^", ",",
        "sin", "sqrt(", "exp(", "min(", "max(", "if", "<", ">", "==", "e", "abs(", " ",
    ];
    let silo = scene::presets::find("silo").expect("listed");
    let scope = Scope::new(&scene::parse(&silo).expect("valid")).expect("valid");
    let count = inputs(0.5, |random, k| {
        let mut text: String =
            (0..random.random_range(1..30)).map(|_| *words.choose(random).expect("some")).collect();
        if random.random_bool(0.3) {
            text = mutated(random, &text);
        }
        try_one("expression", k, text.as_bytes(), || {
            let quantity = Quantity::expression(text.as_str());
            if let Err(e) = quantity.eval(&scope) {
                assert!(!e.message().is_empty());
            }
        });
    });
    println!("{count} expressions");
}

#[test]
fn sets() {
    let silo = scene::presets::find("silo").expect("listed");
    let corpus = [
        "alpha=5/3",
        "accuracy.cells=3",
        "gravity[1]=-5",
        "walls[1].kind=no_slip",
        "materials.grains.density=1e3 * (1 + x^2)",
        "recording.times=[1e-4, \"2e-4\"]",
        "regions[0].shape.rectangle.x[0]=-aperture",
        "description=\"another one\"",
    ];
    let count = inputs(0.15, |random, k| {
        let set = corpus.choose(random).expect("some");
        let set = mutated(random, set);
        try_one("set", k, set.as_bytes(), || {
            if let Err(e) =
                silo.with_sets(std::slice::from_ref(&set)).and_then(|s| scene::parse(&s))
            {
                assert!(!e.message().is_empty());
            }
        });
    });
    println!("{count} sets");
}

#[test]
fn checkpoints() {
    let source = scene::presets::find("silo_pencils").expect("listed");
    let source = source.with_sets(&["accuracy.cells=1".into()]).expect("valid");
    let scene = scene::parse(&source).expect("valid");
    let hash = scene::scene_hash(&scene);
    let mut run = sim::start(Arc::new(plan::resolve(&scene).expect("valid"))).expect("solved");
    run.step().expect("a step");
    let state = run.state();
    let good = checkpoint::encode(&state, &hash);
    let (mut refused, mut taken) = (0, 0);
    let count = inputs(0.17, |random, k| {
        let mut bytes = mutated_bytes(random, &good);
        // Half of them get a valid checksum.
        let forged = random.random_bool(0.5);
        if forged && bytes.len() > 32 {
            bytes = checkpoint::sealed(bytes[..bytes.len() - 32].to_vec());
        }
        try_one("checkpoint", k, &bytes, || match checkpoint::decode(&bytes, &hash) {
            Err(_) => refused += 1,
            Ok(forged_state) => {
                assert!(forged || bytes == good, "a damaged checkpoint was accepted");
                // Only for some inputs, because it is slow.
                if k % 10 == 0 && run.restore(&forged_state).is_ok() {
                    taken += 1;
                    run.restore(&state).expect("a good state");
                }
            }
        });
    });
    println!("{count} checkpoints: {refused} refused, {taken} forged ones accepted");
    assert!(refused > count / 3);
}

/// The same recording, uncompressed.
fn uncompressed(recording: &[u8]) -> Vec<u8> {
    let messages = DecoderApp::decode_eager(recording).expect("a recording");
    let mut plain = Vec::new();
    let options = EncodingOptions::PROTOBUF_UNCOMPRESSED;
    let mut encoder =
        Encoder::new_eager(CrateVersion::LOCAL, options, &mut plain).expect("a beginning");
    for message in messages {
        encoder.append(&message.expect("a message")).expect("written");
    }
    encoder.finish().expect("an end");
    drop(encoder);
    plain
}

/// Forged lengths in uncompressed data must not lead to large allocations.
#[test]
fn recordings_that_claim_to_be_large() {
    let here = TempFolder::new();
    let run = ["run", "couette_cosserat", "--set", "accuracy.cells=4", "--steps", "1"];
    here.grainscope(&[&run[..], &["--out", "run"]].concat()).exits(0);
    let good = std::fs::read(here.path("run/recording.rrd")).expect("a recording");
    let plain = uncompressed(&good);
    std::fs::write(here.path("plain.rrd"), &plain).expect("written");
    here.grainscope(&["repair", "plain.rrd"]).exits(0).prints(&["is complete"]);
    // A message of an Arrow stream begins with this marker and the length of its metadata, which
    // contain the length of its body.
    let parts: Vec<usize> =
        (0..plain.len() - 128).filter(|&k| plain[k..k + 4] == [0xff; 4]).collect();
    assert!(parts.len() > 20);
    let path = here.path("forged.rrd");
    let mut refused = 0;
    for &part in parts.iter().step_by(parts.len() / 10) {
        for (at, bytes) in std::iter::once((part + 4, i32::MAX.to_le_bytes().to_vec()))
            .chain((8..96).step_by(4).map(|at| (part + at, (1_u64 << 46).to_le_bytes().to_vec())))
        {
            let mut forged = plain.clone();
            forged[at..at + bytes.len()].copy_from_slice(&bytes);
            std::fs::write(&path, &forged).expect("written");
            // If a length were trusted, the allocation would fail and abort the test.
            refused += u64::from(match Recorded::open(&path) {
                Ok(recorded) => recorded.cut.is_some(),
                Err(_) => true,
            });
        }
    }
    println!("{refused} forged recordings were detected");
    assert!(refused > 20);
}

#[test]
fn recordings() {
    let here = TempFolder::new();
    let run = ["run", "couette_cosserat", "--set", "accuracy.cells=4", "--steps", "2"];
    here.grainscope(&[&run[..], &["--out", "run"]].concat()).exits(0);
    let good = std::fs::read(here.path("run/recording.rrd")).expect("a recording");
    // In an uncompressed recording, changes also affect the data itself. One input takes a tenth of a second.
    let corpus = [uncompressed(&good), good];
    let path = here.path("x.rrd");
    let (mut refused, mut taken) = (0, 0);
    let count = inputs(0.01, |random, k| {
        let good = corpus.choose(random).expect("two");
        let bytes = mutated_bytes(random, good);
        std::fs::write(&path, &bytes).expect("written");
        try_one("recording", k, &bytes, || match Recorded::open(&path) {
            Err(e) => {
                assert!(e.to_string().contains("x.rrd"), "{e}");
                refused += 1;
            }
            Ok(recorded) => {
                recorded.curves();
                recorded.scene_toml();
                taken += 1;
            }
        });
        try_one("repair", k, &bytes, || {
            let _ = repair(&path);
        });
        let _ = open_all(&[path.clone(), path.clone()]);
    });
    println!("{count} recordings: {refused} refused, {taken} read up to their damage");
}

#[test]
fn requests() {
    let here = TempFolder::new();
    let mut child =
        here.start(&["explore", "couette_cosserat", "--paused", "--set", "accuracy.cells=4"]);
    let mut url = String::new();
    let mut out = std::io::BufReader::new(child.stdout.take().expect("piped"));
    std::io::BufRead::read_line(&mut out, &mut url).expect("a line");
    let (address, token) =
        url.trim().trim_start_matches("http://").split_once('/').expect("an address");
    let head = |method: &str, path: &str, more: &str, body: &str| {
        format!(
            "{method} /{token}{path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n{more}\r\n{body}"
        )
    };
    let command = |body: &str| {
        let more = format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len());
        head("POST", "api/command", &more, body)
    };
    let corpus = [
        head("GET", "", "", ""),
        head("GET", "api/state", "", ""),
        head("GET", "../../etc/passwd", "", ""),
        head("GET", "%2e%2e/%00", "Range: bytes=0-99999999999\r\n", ""),
        command(r#"{"do":"step"}"#),
        command(r#"{"do":"set","key":"materials.fluid.shear_viscosity","value":"2"}"#),
        command(r#"{"do":"save","name":"../../x"}"#),
        command(r#"{"do":"load","scene":"file:../../etc/passwd"}"#),
    ];
    let send = |bytes: &[u8]| -> Option<Vec<u8>> {
        let mut stream = TcpStream::connect(address).ok()?;
        stream.set_read_timeout(Some(Duration::from_secs_f64(2.0 * LONGEST))).ok()?;
        let _ = stream.write_all(bytes);
        let _ = stream.shutdown(Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        Some(answer)
    };
    // Clients that send almost nothing and stay connected do not block others.
    let slow: Vec<TcpStream> = (0..64)
        .map(|_| {
            let mut stream = TcpStream::connect(address).expect("a connection");
            stream.write_all(b"G").expect("sent");
            stream
        })
        .collect();
    let count = inputs(0.05, |random, k| {
        let text = corpus.choose(random).expect("some");
        let bytes = mutated_bytes(random, text.as_bytes());
        // Inputs that would end the session are left out.
        if bytes.windows(4).any(|w| w == b"quit") {
            return;
        }
        try_one("request", k, &bytes, || {
            send(&bytes).expect("the server takes connections");
        });
    });
    // Among many silent connections the server may close one before its request arrives.
    let answers = (0..5).map(|_| send(corpus[1].as_bytes()).expect("a connection"));
    let answer = answers.into_iter().find(|answer| !answer.is_empty()).unwrap_or_default();
    assert!(answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));
    drop(slow);
    assert!(child.try_wait().expect("known").is_none(), "the server has ended");
    child.kill().expect("killed");
    let said = child.wait_with_output().expect("an end");
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(!said.contains("panicked"), "{said}");
    println!("{count} requests; the server still answers");
}
