"""What holds for the whole suite: profiles of Hypothesis, markers of slow files, the option that rewrites pages.

The default profile draws the same examples on every run, so that a failure is never a matter of luck, and reports the
first one it meets. CI runs all tests with `--hypothesis-profile=fresh`: twice as many examples, new every time;
`--hypothesis-profile=explore` looks long for new counter-examples, and for the least.
"""

import gc
import os
import re
import shutil
import sys
import sysconfig
import tempfile
from functools import partial

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command does, before anything loads NumPy

import pytest
from hypothesis import HealthCheck, Phase, settings

MARKERS = {
    "documents": ("test_documents", "test_recipes"),
    "notebooks": ("test_notebooks",),
    "browser": ("test_studio_browser", "test_studio_reach", "test_studio_swing", "test_report_browser"),
    "workers": ("test_workers", "test_hash_seeds", "test_large_sweeps", "test_studio_runs", "test_studio_search"),
    "studio": (
        "test_studio_ask",
        "test_studio_design",
        "test_studio_files",
        "test_studio_loads",
        "test_studio_page",
        "test_studio_vibration",
    ),
    "engines": ("test_validation", "test_mujoco", "test_loaded_engines", "test_vibration_engines"),
    "attack": ("test_attack", "test_judge"),
    "packaging": ("test_packaging",),
    "numbers": (
        "test_any_scalar",
        "test_balance_of_work",
        "test_closed_legs",
        "test_derivatives",
        "test_derivatives_leg_by_leg",
        "test_engine",
        "test_far_rests",
        "test_feasible",
        "test_hard_identifications",
        "test_ideal_links",
        "test_identified_truth",
        "test_limited_poses",
        "test_loaded_derivatives",
        "test_loaded_routes",
        "test_motion_routes",
        "test_optimisers",
        "test_printer_calibration",
        "test_process_forces",
        "test_random_planar_machines",
        "test_reach_leg_by_leg",
        "test_scalars",
        "test_struts",
        "test_wrench_sets",
    ),
    "reports": ("test_report",),
    "folders": (
        "test_damaged_folders",
        "test_earlier_folders",
        "test_optimize_command",
        "test_stopped_early",
        "test_uploads",
        "test_written_files",
    ),
    "exports": ("test_c_programs", "test_c_source", "test_compensation", "test_machine_page", "test_urdf"),
    "step": ("test_glb", "test_step_file", "test_step_outlines", "test_step_solids"),
}
"""Files of tests that plain `pytest` leaves out, because they take long; `-m slow` runs them. A single test of
another file that takes long carries one of these markers itself."""

# Where no bytecode may be written, all processes of the tests, and those that tests start, compile every file anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
os.environ.pop("UV_RUN_RECURSION_DEPTH", None)
os.environ["PATH"] = os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", os.defpath)])
"""Messages quote commands as they are typed in the shell: in tests `kinetostat` is on the path, as in the docs."""

os.fsync = lambda _: None
"""What tests write need not outlive a power cut: a disk takes 4 ms for each file until it is sure to."""

gc.disable()  # until all tests are collected; see `pytest_collection_finish`

QUIET = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
"""Poses are filtered by singularity margin and each costs a statics solve; neither is a fault of a test."""

settings.register_profile(
    "steady",
    max_examples=4,
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=QUIET,
)
settings.register_profile("fresh", max_examples=8, deadline=None, print_blob=True, suppress_health_check=QUIET)
settings.register_profile("explore", max_examples=1000, deadline=None, suppress_health_check=QUIET)
settings.load_profile("steady")


def pytest_addoption(parser):
    """`--rewrite-pages` corrects the answers that the documentation quotes, instead of refusing wrong ones."""
    parser.addoption(
        "--rewrite-pages", action="store_true", help="bring quoted answers of the documentation up to date"
    )


BY_FILE = {stem: marker for marker, stems in MARKERS.items() for stem in stems}
MARKED = re.compile(rf"mark\.(?:slow|{'|'.join(MARKERS)})\b")
"""How a file that is not slow as a whole marks those of its tests that are."""


CACHE = "KINETOSTAT_CACHE"
DRIVEN = "edges"
"""The folder of what drives commands, messages and files; its tests replace functions, but none of a formula."""


def pytest_configure(config):
    """Compile each program once: all processes of a run share a folder of programs, which begins empty and is removed.

    A run so tests the formulas as they stand, and what it compiles is read back by other processes as in daily use.
    """
    if CACHE not in os.environ and not hasattr(config, "workerinput"):
        os.environ[CACHE] = tempfile.mkdtemp(prefix="kinetostat-programs-")
        config.add_cleanup(partial(shutil.rmtree, os.environ[CACHE], ignore_errors=True))


@pytest.fixture(autouse=True)
def _changed_formulas_are_not_kept(request):
    """Leave nothing on disk of tests that may change a formula, and hand nothing to them."""
    if "monkeypatch" in request.fixturenames and request.path.parent.name != DRIVEN:
        request.getfixturevalue("monkeypatch").setenv(CACHE, "off")


LAWS = "property"
"""The folder of the laws: its tests that draw examples are marked so. What draws none is the same in every profile."""


def pytest_ignore_collect(collection_path, config):
    """Leave out, before it is imported, a file of which `-m "not slow"` or `-m slow` would choose no test.

    Every process of the tests imports every file, and JAX, engines and the studio with them: that takes longer than
    many a test. A file that is named on the command line is always read.
    """
    expression, name = config.option.markexpr, collection_path.name
    if not name.startswith("test_") or any(name in argument for argument in config.args):
        return None
    if expression == "not slow":
        return True if collection_path.stem in BY_FILE else None
    if expression != "slow" or collection_path.stem in BY_FILE:
        return None
    return None if MARKED.search(collection_path.read_text("utf-8")) else True


def pytest_collection_finish():
    """Collect garbage from now on, and only of what tests leave behind.

    Thousands of tests and all libraries stay until the end; to look through them again and again takes a third of the
    collection, and many seconds later on. Generations are as large as those of the command.
    """
    gc.freeze()
    gc.set_threshold(100_000, *gc.get_threshold()[1:])
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the laws and the tests of each slow file, before `-m` chooses among them.

    What takes longest comes first, in the order of MARKERS: whole files go to one process each, and at the end short
    ones are left for those that would have nothing to do.
    """
    for item in items:
        if item.path.stem in BY_FILE:
            item.add_marker(BY_FILE[item.path.stem])
        if item.path.parent.name == LAWS and getattr(item.function, "is_hypothesis_test", False):
            item.add_marker("laws")
        # Not `item.keywords`: the names of the folders are among them.
        if any(mark.name in MARKERS for mark in item.iter_markers()):
            item.add_marker("slow")
    order = {marker: place for place, marker in enumerate(MARKERS)}
    items.sort(key=lambda item: order.get(BY_FILE.get(item.path.stem), len(order)))
