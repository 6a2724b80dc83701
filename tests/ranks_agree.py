"""Tests on several ranks: where their outcomes differ all ranks end, with what the failed one says.

A rank whose test failed would go on to the next one, while another waits for it in the middle of
this one for ever; so would one that skips it. So after every phase of a test (setup, call,
teardown) the ranks tell each other how it ended. `conftest` takes this plugin where mpirun has
started more than one process.
"""

from __future__ import annotations

import os
import sys
import time

import pytest
from mpi4py import MPI

# s, within which ranks that have nothing to wait for end the same phase
PATIENCE = float(os.environ.get("PATIENCE_OF_RANKS", "10"))
TO_BE_HEARD = 1.0  # s, so that mpirun passes on what was said before it ends all


class RanksAgree:
    """Ends the tests where ranks differ in what they collect, or in whether a phase failed."""

    def __init__(self) -> None:
        self._comm = MPI.COMM_WORLD.Dup()  # no message of a test can be taken for one of these

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """The same tests on all ranks, in the same order."""
        found = (session.testsfailed, [item.nodeid for item in session.items])
        if len(set(map(repr, self._comm.allgather(found)))) > 1:
            self._end(f"collects {len(found[1])} tests with {found[0]} errors, another rank others")

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item):
        """After every phase: a failure or a skip that others do not have ends all of them."""
        outcome = yield
        report = outcome.get_result()
        verb = "fails" if report.failed else "is skipped"
        reason = f"{item.nodeid} {verb} in its {report.when}:\n{report.longreprtext}"
        if not report.passed:
            # Others may be waiting for this rank within the test.
            request, end = self._comm.Ibarrier(), time.monotonic() + PATIENCE
            while not request.Test():
                if time.monotonic() > end:
                    self._end(reason)
                time.sleep(0.01)
        else:
            self._comm.Ibarrier().Wait()
        if len(set(self._comm.allgather(report.outcome))) > 1:
            if not report.passed:
                self._end(reason)
            time.sleep(PATIENCE)  # until that one has ended all

    def _end(self, reason: str) -> None:
        print(f"\nrank {self._comm.rank} alone: {reason}", file=sys.__stderr__, flush=True)
        time.sleep(TO_BE_HEARD)
        MPI.COMM_WORLD.Abort(1)
