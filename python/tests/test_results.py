"""The results that are read agree with each other, with physics, and with the program's exports."""

import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import COARSE
from rerun.experimental import LazyChunkStream, OptimizationProfile, RrdReader

import grainscope
from grainscope import Run


def test_the_series_has_a_row_per_step(silo: Run) -> None:
    assert silo.series.step.tolist() == list(range(silo.summary["steps"] + 1))
    assert len(silo.series) == silo.summary["frames"]["sent"]
    assert silo.series.time.is_monotonic_increasing
    np.testing.assert_allclose(silo.series.dt, silo.series.time.diff().fillna(0), atol=1e-15)


def test_the_series_ends_as_the_summary_says(silo: Run) -> None:
    last, gauge = silo.series.iloc[-1], silo.summary["gauges"]["outflow"]
    assert last.time == silo.summary["time"] == silo.scene["time"]["end"]
    assert last.outflow_volume == pytest.approx(gauge["volume"], rel=1e-14)
    assert last.outflow_rate == pytest.approx(gauge["rate"], rel=1e-14)
    assert last.max_speed == pytest.approx(silo.summary["max_speed"], rel=1e-14)


def test_the_volume_is_the_integral_of_the_rate(silo: Run) -> None:
    integral = np.trapezoid(silo.series.outflow_rate, silo.series.time)
    assert integral == pytest.approx(silo.summary["gauges"]["outflow"]["volume"], rel=0.01)


def test_frames_are_steps_at_the_requested_times(silo: Run) -> None:
    frames = silo.frames
    times = silo.series.set_index("step").time[frames.step]
    np.testing.assert_allclose(frames.time, times, atol=1e-9)
    assert frames.step.iloc[0] == 0
    assert frames.step.iloc[-1] == silo.summary["steps"]
    recording = silo.scene["recording"]
    regular = np.linspace(0, silo.scene["time"]["end"], recording["frames"] + 1)
    longest_step = silo.series.dt.max()
    for time in regular:
        assert abs(frames.time - time).min() <= longest_step
    for time in recording["times"]:
        assert abs(frames.time - time).min() <= 1e-9


def test_particles_are_in_the_domain_and_start_in_the_silo(silo: Run) -> None:
    for frame in silo.frames.index:
        particles = silo.particles(frame)
        assert particles.x.between(-3, 3).all()
        assert particles.y.between(0, 8).all()
        assert set(particles.material) == {"grains"}
    start = silo.particles(0)
    assert start.x.between(-2, 2).all()
    assert start.y.between(3, 7).all()
    assert start.x.mean() == pytest.approx(0, abs=1e-6)


def test_the_surface_falls_by_the_volume_that_leaves(silo: Run) -> None:
    def surface(frame: int) -> float:
        """Mean height of the highest particles in columns of the silo (m)."""
        particles = silo.particles(frame).query("abs(x) < 2 and y > 3")
        heights: float = particles.y.groupby(np.floor(5 * particles.x)).max().mean()
        return heights

    frame = len(silo.frames) // 3
    outflow = silo.series.outflow_volume[silo.frames.step[frame]]
    assert 4 * (surface(0) - surface(frame)) == pytest.approx(outflow, rel=0.05)


def test_fields_have_the_shape_of_their_coordinates(silo: Run) -> None:
    assert silo.field_names == ["pressure", "rotation", "speed"]
    for name in silo.field_names:
        field = silo.field(name, -1)
        assert field.values.shape == (len(field.y), len(field.x))
        assert field.time == silo.frames.time.iloc[-1]
        for centres, (low, high) in ((field.x, (-3, 3)), (field.y, (0, 8))):
            half = np.diff(centres).mean() / 2
            np.testing.assert_allclose(np.diff(centres), 2 * half, rtol=1e-6)
            ends = [centres[0] - half, centres[-1] + half]
            np.testing.assert_allclose(ends, [low, high], atol=1e-5)
    assert [silo.field(name, 0).unit for name in silo.field_names] == ["Pa", "1/s", "m/s"]


def test_the_flow_is_symmetric_and_as_fast_as_the_series_says(silo: Run) -> None:
    speed, rotation = (silo.field(name, 0).values for name in ("speed", "rotation"))
    np.testing.assert_allclose(speed, speed[:, ::-1], atol=1e-4 * np.nanmax(speed))
    np.testing.assert_allclose(rotation, -rotation[:, ::-1], atol=1e-4 * np.nanmax(rotation))
    assert 0.5 < np.nanmax(speed) / silo.series.max_speed[0] <= 1 + 1e-5


def test_lines_are_in_the_domain_and_walls_have_names(silo: Run) -> None:
    lines = silo.dye(-1)
    assert len(lines) == len(silo.dye(0)) > 0
    for points in lines:
        assert points.shape[1] == 2
        assert (np.abs(points - [0, 4]) <= [3, 4]).all()
    assert silo.directors(0) == []
    walls = dict(silo.walls)
    assert {"left", "right", "bottom", "top", "left_wall", "floor_right"} <= walls.keys()
    np.testing.assert_array_equal(walls["floor_right"], [[0.5, 3], [2, 3]])


def test_the_program_exports_the_same_particles_and_fields(
    program: str, silo: Run, tmp_path: Path
) -> None:
    command = [program, "export", str(silo.path), "--format", "csv", "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    assert len(pd.read_csv(tmp_path / "frames.csv")) == len(silo.frames)
    for frame in (0, len(silo.frames) // 2, len(silo.frames) - 1):
        particles = pd.read_csv(tmp_path / f"particles_{frame:05}.csv")
        pd.testing.assert_frame_equal(
            silo.particles(frame), particles, check_dtype=False, check_categorical=False, rtol=1e-6
        )
        exported = pd.read_csv(tmp_path / f"fields_{frame:05}.csv")
        for name in silo.field_names:
            field = silo.field(name, frame)
            np.testing.assert_allclose(field.values.ravel(), exported[name], rtol=1e-4)
            x, y = np.meshgrid(field.x, field.y)
            np.testing.assert_allclose(x.ravel(), exported.x, atol=1e-5)
            np.testing.assert_allclose(y.ravel(), exported.y, atol=1e-5)


def test_a_resumed_run_has_each_frame_once(program: str, silo: Run, tmp_path: Path) -> None:
    # The state from which a run is resumed may be recorded twice.
    settings = [f"--set={key}={value}" for key, value in COARSE.items()]
    out = str(tmp_path / "run")
    first = [program, "run", "silo", *settings, "--steps", "12", "--out", out]
    for command in (first, [program, "resume", out]):
        subprocess.run(command, check=True, capture_output=True)
    resumed = grainscope.load(out)
    assert resumed.frames.step.is_unique
    assert set(resumed.frames.step) == {*silo.frames.step, 12}
    for frame, step in enumerate(silo.frames.step):
        same = resumed.frames.index[resumed.frames.step == step][0]
        pd.testing.assert_frame_equal(resumed.particles(same), silo.particles(frame))


def test_layered_scenes_have_directors_and_alignment(layered: Run) -> None:
    strokes = layered.directors(-1)
    assert strokes
    assert all(stroke.shape == (2, 2) for stroke in strokes)
    alignment = layered.field("alignment", -1)
    assert alignment.unit == ""
    assert np.nanmin(alignment.values) >= 0
    assert np.nanmax(alignment.values) <= 1
    assert np.isnan(alignment.values).any()  # outside the layered material


@pytest.mark.parametrize("change", ["reversed", "merged"])
def test_the_order_of_chunks_does_not_matter(layered: Run, tmp_path: Path, change: str) -> None:
    chunks = RrdReader(layered.path / "recording.rrd").stream().to_chunks()
    stream = LazyChunkStream.from_iter(reversed(chunks))
    if change == "merged":
        stream = stream.collect(optimize=OptimizationProfile.OBJECT_STORE).stream()
    path = tmp_path / "changed.rrd"
    stream.write_rrd(path, application_id="grainscope", recording_id=change)
    changed = grainscope.load(path)
    pd.testing.assert_frame_equal(changed.frames, layered.frames)
    for frame in layered.frames.index:
        pd.testing.assert_frame_equal(changed.particles(frame), layered.particles(frame))
        np.testing.assert_array_equal(
            changed.field("speed", frame).values, layered.field("speed", frame).values
        )


def test_a_recording_alone_has_pictures_and_the_scene(silo: Run, tmp_path: Path) -> None:
    alone = tmp_path / "alone.rrd"
    alone.symlink_to(silo.path / "recording.rrd")
    run = grainscope.load(alone)
    assert run.scene == silo.scene
    pd.testing.assert_frame_equal(run.particles(-1), silo.particles(len(silo.frames) - 1))
    with pytest.raises(grainscope.MissingFile, match=r"alone\.rrd.*load the folder"):
        _ = run.series


def test_a_recording_in_the_folder_of_its_run_opens_the_folder(silo: Run) -> None:
    assert grainscope.load(silo.path / "recording.rrd").summary == silo.summary


def test_a_run_without_recording_has_series_and_summary(copy: Path) -> None:
    (copy / "recording.rrd").unlink()
    (copy / "summary.json").write_text('{"steps": 3}')
    run = grainscope.load(copy)
    assert len(run.series) > 3
    with pytest.raises(grainscope.MissingFile, match=r"recording\.rrd.*without --no-recording"):
        run.particles(0)


def test_a_recording_that_was_saved_elsewhere_is_found(copy: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere.rrd"
    (copy / "recording.rrd").rename(elsewhere)
    (copy / "summary.json").unlink()
    (copy / "summary.json").write_text(f'{{"recording": "{elsewhere}"}}')
    assert len(grainscope.load(copy).frames) > 10
