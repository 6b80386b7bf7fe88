#!/usr/bin/env bash
# Compares two versions of the program bit by bit on this machine.
#
#   tests/same_bits.sh OLD NEW [SCENE...]
#
# OLD and NEW are commits, or paths of built programs. Every preset (or the scenes named) is run for
# 8 steps with a checkpoint, then resumed for 3 more. The script compares the whole checkpoint (particles,
# velocity, rotation, pressure, gauges, dye, energies, the last row), the series, and the recorded particles and
# fields of every frame. Only wall times and paths may differ. Exit code 0: no difference.
#
# Environment: SETS, extra `--set` values for every run, for example SETS="accuracy.cells=4".
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,11p' "$0"; exit 2; }
cd "$(dirname "$0")/.."
repository=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"; git -C "$repository" worktree prune' EXIT

# Prints the path of the program of a commit; builds it in a work tree, with this tree's dependencies.
program() {
    if [ -f "$1" ] && [ -x "$1" ]; then
        realpath "$1"
        return
    fi
    git worktree add --quiet --detach "$work/$2" "$1" >&2
    (cd "$work/$2" && CARGO_TARGET_DIR="$repository/target" cargo build --release --locked --quiet >&2)
    cp "$repository/target/release/grainscope" "$work/program-$2"
    echo "$work/program-$2"
}
old=$(program "$1" old)
new=$(program "$2" new)
shift 2
scenes=("$@")
if [ ${#scenes[@]} -eq 0 ]; then
    for file in presets/*.toml; do scenes+=("$(basename "$file" .toml)"); done
fi
sets=()
for set in ${SETS:-}; do sets+=(--set "$set"); done

for scene in "${scenes[@]}"; do
    for side in old new; do
        folder=$work/runs/$side/$(basename "$scene" .toml)
        mkdir -p "$folder"
        {
            "${!side}" run "$scene" "${sets[@]}" --out "$folder" --force --steps 8 --checkpoint-every 8
            cp "$folder"/checkpoints/*8.state "$folder/at-8.state"
            "${!side}" resume "$folder" --steps 11
            cp "$folder"/checkpoints/*11.state "$folder/at-11.state"
            # One program reads both recordings.
            "$new" export "$folder" --format csv --out "$folder/frames"
        } > "$folder/log" 2>&1 || { cat "$folder/log"; echo "$scene: the $side program failed"; exit 1; }
    done
    python3 - "$scene" "$work/runs/old/$(basename "$scene" .toml)" "$work/runs/new/$(basename "$scene" .toml)" <<'PYTHON' || failed=1
"""Compares two folders of runs: checkpoints, series, exported frames."""
import csv, pathlib, struct, sys

scene, old, new = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
faults = []

def columns(path):
    """Columns of a checkpoint by name, as bytes; the format is that of src/record/checkpoint.rs."""
    data = path.read_bytes()
    at = 16 + 4 + 64
    (count,) = struct.unpack_from("<I", data, at)
    at += 4
    out = {}
    for _ in range(count):
        kind, length = struct.unpack_from("<BH", data, at)
        at += 3
        name = data[at:at + length].decode()
        at += length
        (values,) = struct.unpack_from("<Q", data, at)
        at += 8
        size = values * (1 if kind == 2 else 8)
        out[name] = data[at:at + size]
        at += size
    return out

# Wall times and texts: rows of phases, the third of the row's numbers, what the session kept.
WALL = {"row.seconds", "session.phases", "session.numbers", "session.frames", "session.recording", "session.program", "session.warnings"}

for name in ("at-8.state", "at-11.state"):
    a, b = columns(old / name), columns(new / name)
    for column in sorted((a.keys() | b.keys()) - WALL):
        x, y = a.get(column), b.get(column)
        if column == "row.numbers" and x and y:
            x, y = x[:16] + x[24:], y[:16] + y[24:]
        if x != y:
            what = "missing on one side" if x is None or y is None else "differs"
            if x is not None and y is not None and len(x) == len(y) and len(x) % 8 == 0 and column.split(".")[-1] not in ("material", "mark"):
                v, w = (struct.unpack(f"<{len(x) // 8}d", z) for z in (x, y))
                scale = max(map(abs, v), default=0.0) or 1.0
                what += f" by {max(abs(p - q) for p, q in zip(v, w)) / scale:.1e} of its largest value"
            faults.append(f"{name}: {column} {what}")

def series(path):
    rows = list(csv.reader(path.open()))
    wall = rows[0].index("wall")
    return [row[:wall] + row[wall + 1:] for row in rows]

if series(old / "series.csv") != series(new / "series.csv"):
    faults.append("series.csv differs")
files = lambda folder: sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
if files(old / "frames") != files(new / "frames"):
    faults.append("the recordings hold different frames")
for file in files(old / "frames"):
    if (new / "frames" / file).exists() and (old / "frames" / file).read_bytes() != (new / "frames" / file).read_bytes():
        faults.append(f"recorded frame {file} differs")
print(f"{scene}: " + ("equal" if not faults else f"{len(faults)} differences"))
for fault in faults[:12]:
    print("  " + fault)
sys.exit(bool(faults))
PYTHON
done
[ -z "${failed:-}" ] || exit 1
echo "no difference"
