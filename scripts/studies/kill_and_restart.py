"""Kill runs at random moments and go on with them; then compare with the run that was left alone.

After every kill (SIGKILL, of the whole run or of one rank) what the history holds has to be
readable and no shorter than before the last restart's checkpoint. With --full-disk the disk fills
up instead, on a file system of its own (root only).
"""

from __future__ import annotations

import contextlib
import csv
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

from iceslide_fem.postprocess.results import differences, field_files, read_run
from iceslide_fem.runs.checkpoint import read_checkpoint
from iceslide_fem.runtime.errors import SceneError
from scripts.studies.common import ROOT, iceslide_words, on_ranks, options, silently

SCENE = ROOT / "cases" / "thesis_1bar.toml"
CHANGES = ["model=slice", "numerics.refinement=0.5", "numerics.tolerance=1e-2"]


def command(ranks: int, *words: str) -> list[str]:
    """Command line of a run that leaves a checkpoint often."""
    return on_ranks(iceslide_words("run", "--checkpoint-every", "0.2", *words), ranks)


def beginning(out: Path) -> list[str]:
    changes = [word for change in CHANGES for word in ("--set", change)]
    return [str(SCENE), *changes, "--out", str(out)]


def start(words: list[str]) -> subprocess.Popen:
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def kill(run: subprocess.Popen, ranks: int, dice: random.Random) -> str:
    """SIGKILL to all processes of the run, or to one of its ranks; returns when all are gone."""
    main = psutil.Process(run.pid)
    children = main.children(recursive=True)  # mpirun puts ranks into groups of their own
    one = ranks > 1 and bool(children) and dice.random() < 0.5
    for process in [dice.choice(children)] if one else [main, *children]:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
    run.wait()
    psutil.wait_procs(children)
    return "one rank" if one else "all"


def readable_rows(out: Path) -> int:
    """Rows of the history; every one of them has to be complete and finite."""
    path = out / "history.csv"
    if not path.is_file():
        return 0
    with open(path, newline="") as file:
        header, *rows = list(csv.reader(file))
    assert all(len(row) == len(header) for row in rows), "a row is torn"
    assert np.isfinite(np.array(rows, dtype=float)).all() if rows else True
    return len(rows)


def fields_whole(out: Path) -> int:
    """Times of the fields that are listed; every file of them has to be whole."""
    times = 0
    for name in ("rubber", "interface", "ice"):
        files = field_files(out, name)
        times = max(times, len(files))
        for _, path in files:
            assert b"</VTKFile>" in path.read_bytes()[-40:], path
    return times


def saved_rows(out: Path) -> int:
    """Rows that the checkpoint follows; it has to be whole, if there is one."""
    if not (out / "checkpoint").is_file():
        return 0
    state = read_checkpoint(out).state
    return len(state["results"]["rows"]) if state else 0


def kills(count: int, ranks: int, folder: Path, dice: random.Random) -> None:
    alone = folder / "alone"
    started = time.perf_counter()
    silently(command(ranks, *beginning(alone)))
    usual = time.perf_counter() - started
    reference = read_run(alone)
    out, done, restarts, finished, worst = folder / "killed", 0, 0, 0, 0.0
    where = {"all": 0, "one rank": 0}
    while done < count or (out / "checkpoint").is_file():
        print(f"{done} of {count}", file=sys.stderr)
        begun = (out / "checkpoint").is_file()
        run = start(command(ranks, *(["--restart", str(out)] if begun else beginning(out))))
        restarts += begun
        before = saved_rows(out)
        try:
            # a restart loads programs first, which takes a third of the whole
            left = dice.uniform(0.05, 0.9) * usual if done < count else None
            code = run.wait(left)
            if code != 0:
                raise SystemExit(f"a run ended with {code} by itself")
            finished += 1
            worst = max(worst, float(np.abs(differences(read_run(out), reference)).max()))
            shutil.rmtree(out)
        except subprocess.TimeoutExpired:
            where[kill(run, ranks, dice)] += 1
            done += 1
            if (out / "summary.json").is_file() and not (out / "checkpoint").is_file():
                continue  # it had just finished: the next run begins anew
            assert readable_rows(out) >= saved_rows(out) >= before, "rows were lost"
            fields_whole(out)
    print(
        f"{ranks} rank{'s' if ranks > 1 else ''}: {done} kills ({where['all']} of all processes, "
        f"{where['one rank']} of one rank), {restarts} restarts, {finished} runs brought to their "
        f"end; largest difference of mu(t) {worst:.1e} at a tolerance of 1e-2"
    )


def full_disk(folder: Path) -> None:
    """Fill a file system of 0.8 MB, look at what is left, make room, go on."""
    alone, disk = folder / "alone", folder / "disk"
    disk.mkdir()
    silently(command(1, *beginning(alone)))
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=800k", "tmpfs", disk], check=True)
    try:
        out = disk / "run"
        full = subprocess.run(command(1, *beginning(out)), capture_output=True, text=True)
        print(f"full disk: exit code {full.returncode}: {full.stderr.splitlines()[-1]}")
        print(
            f"  {readable_rows(out)} rows and fields of {fields_whole(out)} times are whole, the "
            f"checkpoint follows {saved_rows(out)} rows"
        )
        subprocess.run(["mount", "-o", "remount,size=100m", disk], check=True)
        silently(command(1, "--restart", str(out)))
        worst = np.abs(differences(read_run(out), read_run(alone))).max()
        print(f"  after making room: largest difference of mu(t) {worst:.1e}")
    finally:
        subprocess.run(["umount", disk], check=True)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--full-disk", action="store_true")
    arguments = parser.parse_args()
    dice = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        if arguments.full_disk:
            full_disk(Path(folder))
            return
        for ranks in arguments.ranks:
            share = arguments.kills // len(arguments.ranks)
            own = Path(folder) / str(ranks)
            own.mkdir()
            kills(share, ranks, own, dice)


if __name__ == "__main__":
    try:
        main()
    except (SceneError, AssertionError) as error:
        raise SystemExit(f"failed: {error}") from error
