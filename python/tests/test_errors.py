"""Errors name the file or value and say what to do."""

import pickle
from pathlib import Path

import pytest
import rerun

import grainscope
from grainscope import Run


@pytest.mark.parametrize("name", ["nothing", "nothing.rrd", "."])
def test_a_folder_without_run(tmp_path: Path, name: str) -> None:
    with pytest.raises(grainscope.MissingFile, match="holds no run") as caught:
        grainscope.load(tmp_path / name)
    assert caught.value.path == tmp_path / name


@pytest.mark.parametrize("text", ["", '{"steps": 1', "[1, 2]", "\xff"])
def test_a_damaged_summary(copy: Path, text: str) -> None:
    (copy / "summary.json").unlink()
    (copy / "summary.json").write_text(text, encoding="latin-1")
    with pytest.raises(grainscope.UnreadableFile, match=r"summary\.json.*grainscope repair"):
        _ = grainscope.load(copy).summary


def test_an_empty_series(copy: Path) -> None:
    (copy / "series.csv").unlink()
    (copy / "series.csv").touch()
    with pytest.raises(grainscope.UnreadableFile, match=r"series\.csv"):
        _ = grainscope.load(copy).series


def test_a_run_without_summary(copy: Path) -> None:
    (copy / "summary.json").unlink()
    run = grainscope.load(copy)
    assert len(run.frames) > 0
    with pytest.raises(grainscope.MissingFile, match=r"summary\.json.*was killed"):
        _ = run.summary


@pytest.mark.parametrize("share", [0, 0.5])
def test_a_cut_recording(copy: Path, share: float) -> None:
    recording = copy / "recording.rrd"
    whole = recording.read_bytes()
    recording.unlink()
    recording.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(grainscope.UnreadableFile, match=r"recording\.rrd.*grainscope repair"):
        grainscope.load(copy).particles(0)


def test_a_recording_with_a_damaged_part(copy: Path) -> None:
    recording = copy / "recording.rrd"
    damaged = bytearray(recording.read_bytes())
    middle = slice(len(damaged) // 20, len(damaged) * 9 // 10)
    damaged[middle] = bytes(len(damaged[middle]))
    recording.unlink()
    recording.write_bytes(damaged)
    run = grainscope.load(copy)
    with pytest.raises(grainscope.UnreadableFile, match=r"recording\.rrd.*damaged"):
        for name in run.field_names:
            run.field(name, 0)


def test_a_recording_of_another_program(tmp_path: Path) -> None:
    path = tmp_path / "other.rrd"
    with rerun.RecordingStream("other") as stream:
        stream.save(path)
        stream.log("runs", rerun.TextLog("not a run"))
    with pytest.raises(grainscope.UnreadableFile, match="holds 0 runs of grainscope"):
        grainscope.load(path).particles(0)


def test_unknown_fields_and_frames(silo: Run) -> None:
    with pytest.raises(grainscope.NotRecorded, match="no field 'sped'; recorded are: pressure, "):
        silo.field("sped", 0)
    count = len(silo.frames)
    for frame in (count, -count - 1):
        with pytest.raises(grainscope.NotRecorded, match=f"no frame {frame}; it has {count} "):
            silo.particles(frame)


def test_errors_survive_pickling() -> None:
    failed = pickle.loads(pickle.dumps(grainscope.RunFailed(3, "no")))
    assert (failed.exit_code, failed.message) == (3, "no")
    missing = pickle.loads(pickle.dumps(grainscope.MissingFile(Path("a"), "is missing")))
    assert str(missing) == "a: is missing"
