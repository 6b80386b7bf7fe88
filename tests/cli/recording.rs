//! Tests that recordings agree with their runs, and that their errors are reported.

use super::*;
use grainscope::frame::{Frame, ParticleSnapshot, Rect, RunInfo, Scalar, Snapshot};
use grainscope::internals::{RecordError, RerunLog, Sink};
use rerun::external::re_chunk_store::{ChunkStore, ChunkStoreConfig};
use rerun::external::re_log_types::{StoreKind, TimelineName};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{Read, Write};
use std::time::Duration;

fn stores(path: &Path) -> Vec<ChunkStore> {
    let mut file = File::open(path).expect("the recording");
    ChunkStore::from_rrd_reader(&ChunkStoreConfig::COMPACTION_DISABLED, &mut file)
        .expect("a readable recording")
        .into_values()
        .collect()
}

/// The recording in a file with one recording and one blueprint.
pub fn recording(path: &Path) -> ChunkStore {
    let (recording, blueprints) = begun_recording(path);
    assert_eq!(blueprints, 1);
    recording
}

/// The recording in a file with one recording, and the number of blueprints.
pub fn begun_recording(path: &Path) -> (ChunkStore, usize) {
    let (mut recordings, blueprints): (Vec<_>, Vec<_>) =
        stores(path).into_iter().partition(|store| store.id().kind() == StoreKind::Recording);
    assert_eq!(recordings.len(), 1);
    (recordings.remove(0), blueprints.len())
}

/// Steps of a recording, in order.
pub fn steps(store: &ChunkStore) -> Vec<i64> {
    let step = TimelineName::from("step");
    let chunks = store.iter_physical_chunks();
    let all =
        chunks.flat_map(|c| c.iter_indices(&step).map(|(t, _)| t.as_i64()).collect::<Vec<_>>());
    // Static data have no step; they have the smallest number instead.
    let set: BTreeSet<i64> = all.filter(|&step| step >= 0).collect();
    set.into_iter().collect()
}

/// Positions of the points of an entity, by step.
fn positions(store: &ChunkStore, entity: &str) -> BTreeMap<i64, Vec<[f32; 2]>> {
    let component = rerun::Points2D::descriptor_positions().component;
    let step = TimelineName::from("step");
    let mut rows = BTreeMap::new();
    for chunk in store.iter_physical_chunks() {
        if chunk.entity_path() == &rerun::EntityPath::from(entity) {
            let times = chunk.iter_indices(&step);
            for ((time, _), row) in times.zip(chunk.iter_slices::<[f32; 2]>(component)) {
                rows.insert(time.as_i64(), row.to_vec());
            }
        }
    }
    rows
}

#[test]
fn a_run_is_read_back() {
    let here = TempFolder::new();
    // With 100 frames in 3.8 ms there are two until 50 us, besides the first.
    let run = ["run", "silo", "--set", "accuracy.cells=3", "--until", "5e-5"];
    here.grainscope(&run).exits(0);
    let series = Table::read(&here.read("runs/silo/series.csv"));
    let last = series.rows.len() as i64 - 1;
    let met: Vec<i64> = (0..=last)
        .filter(|&k| {
            [0.0, 2.5e-5, 5e-5]
                .iter()
                .any(|t| (series.numbers("time")[k as usize] - t).abs() < 1e-12)
        })
        .collect();
    assert_eq!(met.len(), 3);

    let store = recording(&here.path("runs/silo/recording.rrd"));
    assert_eq!(store.id().application_id().as_str(), "grainscope");
    let hash = here.json("runs/silo/summary.json")["scene_hash"].to_string();
    assert_eq!(store.id().recording_id().as_str(), format!("silo-{}", &hash[1..13]));

    let entities: Vec<String> =
        store.all_entities_sorted().iter().map(ToString::to_string).collect();
    for entity in [
        "diagnostics/power_error",
        "diagnostics/power_error/log10",
        "gauges/outflow/rate",
        "gauges/outflow/volume",
        "log",
        "plan",
        "scene",
        "world",
        "world/dye",
        "world/fields/pressure/image",
        "world/fields/rotation/image",
        "world/fields/speed/image",
        "world/gauges",
        "world/particles",
        "world/walls",
    ] {
        let found = entities.contains(&format!("/runs/silo/{entity}"));
        assert!(found, "{entity} is missing in {entities:#?}");
    }
    for (timeline, recorded) in [
        ("sim_time", true),
        ("step", true),
        ("wall_time", true),
        ("log_time", false),
        ("log_tick", false),
    ] {
        let range = store.time_range(&TimelineName::from(timeline));
        assert_eq!(range.is_some(), recorded, "{timeline}");
    }
    let range = store.time_range(&TimelineName::from("sim_time")).expect("a time range");
    assert_eq!((range.min().as_i64(), range.max().as_i64()), (0, 50_000));
    assert_eq!(steps(&store), (0..=last).collect::<Vec<_>>());

    let pictures = positions(&store, "/runs/silo/world/particles");
    assert_eq!(pictures.keys().copied().collect::<Vec<_>>(), met);
    let first = &pictures[&0];
    assert!(first.len() > 1000);
    // The grains fill x = -2 to 2, y = 3 to 7; y points up.
    let range = |c: usize| {
        let values = first.iter().map(|p| p[c]);
        (values.clone().fold(f32::INFINITY, f32::min), values.fold(f32::NEG_INFINITY, f32::max))
    };
    for ((low, high), [from, to]) in [(range(0), [-2.0, 2.0]), (range(1), [3.0, 7.0])] {
        assert!(low >= from && low < from + 0.1, "{low}");
        assert!(high <= to && high > to - 0.1, "{high}");
    }
    // The grains fall.
    let lowest = |p: &[[f32; 2]]| p.iter().map(|p| p[1]).fold(f32::INFINITY, f32::min);
    assert!(lowest(&pictures[&last]) < lowest(first) - 0.05);
}

fn info() -> RunInfo {
    RunInfo {
        name: "fake".into(),
        recording_id: "fake".into(),
        domain: Rect { min: [0.0, 0.0], max: [1.0, 1.0] },
        particle_radius: 0.01,
        ..Default::default()
    }
}

fn frame(step: u64) -> Frame {
    let positions = (0..2000).map(|i| [i as f32 / 2000.0, 0.1 * step as f32]).collect();
    let particles =
        ParticleSnapshot { positions, class: vec![0; 2000], ..ParticleSnapshot::default() };
    Frame {
        step,
        time_s: step as f64,
        wall_s: step as f64,
        snapshot: Some(Snapshot { particles, ..Default::default() }),
        scalars: vec![Scalar::new("diagnostics/power_in", 1.0)],
        warnings: vec![],
    }
}

fn record(path: &Path, frames: impl IntoIterator<Item = Frame>) -> Result<(), RecordError> {
    let mut log = RerunLog::open(&info(), &[Sink::Save(path.to_owned())])?;
    frames.into_iter().try_for_each(|frame| log.frame(&frame))?;
    log.finish().map(|finished| assert_eq!(finished.saved.len(), 1))
}

fn refusal(sink: Sink) -> String {
    RerunLog::open(&info(), &[sink]).err().expect("an error").to_string()
}

#[test]
fn the_number_of_particles_may_change() {
    let here = TempFolder::new();
    let path = here.path("x.rrd");
    let mut fewer = frame(1);
    if let Some(snapshot) = &mut fewer.snapshot {
        snapshot.particles.positions.truncate(100);
        snapshot.particles.class.truncate(100);
    }
    record(&path, [frame(0), fewer, frame(2)]).expect("a recording");
    let rows = positions(&recording(&path), "/runs/fake/world/particles");
    assert_eq!(rows.values().map(Vec::len).collect::<Vec<_>>(), [2000, 100, 2000]);
}

#[test]
fn arrays_of_different_length_are_an_error() {
    let here = TempFolder::new();
    let mut wrong = frame(0);
    if let Some(snapshot) = &mut wrong.snapshot {
        snapshot.particles.class.pop();
    }
    let error = record(&here.path("x.rrd"), [wrong]).expect_err("an error").to_string();
    assert!(error.contains("1999") && error.contains("2000"), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_gives_the_cause() {
    let error = record(Path::new("/dev/full"), (0..30).map(frame)).expect_err("a full disk");
    assert!(error.to_string().contains("No space left"), "{error}");
}

#[test]
fn a_missing_folder_is_an_error_at_once() {
    let error = refusal(Sink::Save("/nowhere/x.rrd".into()));
    assert!(error.contains("/nowhere/x.rrd"), "{error}");
}

#[test]
fn an_invalid_address_is_an_error_with_an_example() {
    let error = refusal(Sink::Connect("nonsense".into()));
    assert!(error.contains("nonsense") && error.contains("rerun+http://"), "{error}");
}

#[test]
fn a_busy_port_is_an_error_that_names_it() {
    let busy = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = busy.local_addr().expect("an address").port();
    let error = refusal(Sink::Serve { port });
    assert!(error.contains(&port.to_string()) && error.contains("any free port"), "{error}");
}

#[test]
fn a_recording_is_served_and_saved_at_once() {
    let here = TempFolder::new();
    let path = here.path("x.rrd");
    let sinks = [Sink::Save(path.clone()), Sink::Serve { port: 0 }];
    let mut log = RerunLog::open(&info(), &sinks).expect("a recording");
    (0..20).for_each(|step| log.frame(&frame(step)).expect("a frame"));
    let finished = log.finish().expect("an end");
    assert!(finished.notices.is_empty(), "{:?}", finished.notices);
    let served = finished.served.expect("a page");
    let address = served.url().trim_start_matches("http://");
    let (host, token) = address.split_once('/').expect("a path");
    let token = token.trim_end_matches('/');
    let get = |path: &str, headers: &str| -> Vec<u8> {
        let mut stream = std::net::TcpStream::connect(host).expect("the page answers");
        stream.set_read_timeout(Some(Duration::from_secs(2))).expect("a timeout");
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}\r\n").expect("sent");
        let (mut bytes, mut part) = (vec![], [0; 1 << 16]);
        // The stream stays open as long as the recording is served.
        while let Ok(n @ 1..) = stream.read(&mut part) {
            bytes.extend(&part[..n]);
        }
        bytes
    };
    let ours = format!("Host: {host}\r\n");
    let starts = |path: &str, headers: &str, with: &str| {
        let said = get(path, headers);
        let text = String::from_utf8_lossy(&said[..said.len().min(400)]).into_owned();
        assert!(text.starts_with(with), "{path} {headers}: {text}");
    };
    starts(&format!("/{token}/"), &ours, "HTTP/1.1 200");
    let data = format!("/{token}/recording.rrd");
    starts(&data, "Host: evil.example\r\n", "HTTP/1.1 403");
    starts(&data, &format!("{ours}Origin: http://localhost:1\r\n"), "HTTP/1.1 403");
    starts("/recording.rrd", &ours, "HTTP/1.1 403");
    starts("/", &ours, "HTTP/1.1 403");
    let streamed = get(&data, &ours);
    assert!(streamed.windows(4).any(|w| w == b"RRF2"), "no recording");
    assert!(streamed.len() > 10_000, "only {} bytes", streamed.len());
    // The file is complete while the recording is still served.
    assert_eq!(steps(&recording(&path)).len(), 20);
}
