"""Workers of a sweep (`commands.worker`), as the sweep sees them."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import environment_of_one, module_words, mpirun


class Worker:
    """A worker on `n_cores` processes, which starts with its first case, and again if it dies."""

    def __init__(self, n_cores: int) -> None:
        self._n_cores = n_cores
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False

    def run(self, scene_file: Path, folder: Path, restart: bool, log: Path) -> int:
        """Run a case, or continue it; returns its exit code, negative for a signal.

        Its output is appended to the file `log`, also that of the worker's own start. Raises
        SceneError if mpirun is missing.
        """
        process = self._process or self._started(log)
        if self._stopped:  # in the meantime
            process.terminate()
        assert process.stdin is not None and process.stdout is not None
        try:
            request = str(scene_file), str(folder), restart, str(log)
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            answer = process.stdout.readline()
        except BrokenPipeError:
            answer = ""
        if answer:
            return int(answer)
        self._process = None
        return process.wait()

    def stop(self) -> None:
        """Ask a running case, or the next one, to stop with a checkpoint."""
        self._stopped = True
        if self._process is not None:
            self._process.terminate()

    def end(self) -> None:
        """Let the worker end after its case, and wait for it."""
        process, self._process = self._process, None
        if process is not None:
            assert process.stdin is not None
            process.stdin.close()
            process.wait()

    def _started(self, log: Path) -> subprocess.Popen[str]:
        words = module_words("iceslide_fem.commands.worker")
        if self._n_cores > 1:
            if (start := mpirun()) is None:
                raise SceneError("several cores per case need mpirun, which is not installed")
            words = [start, "-n", str(self._n_cores), *words]
        pipe, env = subprocess.PIPE, environment_of_one()
        with open(log, "ab") as errors:
            self._process = subprocess.Popen(
                words, env=env, stdin=pipe, stdout=pipe, stderr=errors, text=True
            )
        return self._process
