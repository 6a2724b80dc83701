"""The PyPI wheel has to load its own MPI before anything else does, also where one file of tests is
run alone.
"""

from contextlib import suppress

from browser import chromium, open_page  # noqa: F401

from iceslide_fem.runtime.launch import started_by_mpirun

with suppress(ImportError):
    import dolfinx_solver  # noqa: F401


def pytest_ignore_collect(collection_path, config):
    """In the lane of one mark, modules without that mark are not even imported."""
    lane = config.option.markexpr.partition(" and not ")[0]
    if lane.isidentifier() and collection_path.name.startswith("test_"):
        return f"mark.{lane}" not in collection_path.read_text(encoding="utf-8") or None
    return None


def pytest_configure(config):
    if started_by_mpirun():
        from ranks_agree import RanksAgree

        config.pluginmanager.register(RanksAgree())
