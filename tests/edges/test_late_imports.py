"""What a process of a command imports late: still there for whoever asks for it."""

import subprocess
import sys


def run(program):
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=300)
    return done.stdout.split()


def test_names_of_glyphs_are_read_when_they_are_asked_for():
    program = """
import sys
from kinetostat.late import postpone_glyph_names
postpone_glyph_names()
import matplotlib.figure, matplotlib.dviread
print("__file__" in vars(sys.modules["fontTools.agl"]))
print(matplotlib.dviread.fontTools.agl.toUnicode("alpha"))
print("__file__" in vars(sys.modules["fontTools.agl"]))
postpone_glyph_names()
import fontTools.agl
print(fontTools.agl.toUnicode("beta"))
"""
    assert run(program) == ["False", "α", "True", "β"]


def test_garbage_is_looked_for_rarely_until_the_libraries_are_there():
    program = """
import gc
import kinetostat.__main__
print(gc.get_threshold()[0])
for _ in range(2):
    gc.collect()
    print(gc.get_threshold()[0], len(gc.callbacks))
"""
    assert run(program) == ["1000000", "100000", "0", "100000", "0"]


def test_answers_are_described_without_the_library_of_figures():
    """Figures of an answer are in its file; who prints it pays for none. The paper's page has pictures in any case."""
    program = """
import sys
from importlib import import_module
from kinetostat.views.questions import ANSWERS, QUESTIONS
places = {place.rpartition(".")[0] for place in [*ANSWERS.values(), *(place for _, place in QUESTIONS.values())]}
for place in sorted(places - {"views.paper"}):
    import_module(f"kinetostat.{place}")
    if "matplotlib" in sys.modules:
        print(place)
        break
print("end")
"""
    assert run(program) == ["end"]
