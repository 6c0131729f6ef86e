"""What is said of vibrations: sentences that no choice of equal modes changes, tables in which nothing is lost."""

import subprocess
import sys

import pytest
import xarray as xr

from kinetostat.machine.loading import changed, load
from kinetostat.machine.parameters import with_leg
from kinetostat.studies.datasets import evaluate_grid
from kinetostat.studies.vibration import modes
from kinetostat.views.answers import plot
from kinetostat.views.figures import look_of
from kinetostat.views.grid_figures import grid_curves
from kinetostat.views.vibration import MOST_PARTS, _strain_shares, cut_sentence, mode_table, share_table
from kinetostat.views.vibration_figures import response_figure

LIGHT_LEGS = {"tool.mass": 12.0, "linear_density.legs": 0.5, "drives.rotor_inertia": 2e-5, "drives.lead": 0.01}


def columns(table):
    """The columns of numbers of a table, a dash as 0."""
    return [[0.0 if cell == "–" else float(cell) for cell in column.cells] for column in table.columns[1:]]


def test_energies_in_a_table_add_up_although_no_part_of_small_share_has_a_line():
    answer = modes(changed(load("hexapod"), LIGHT_LEGS))
    table = share_table("Kinetic energy (%)", [mode.kinetic for mode in answer.modes])
    assert table.row_count < len(answer.modes[0].kinetic)  # the legs have no line of their own
    for column in columns(table):
        assert sum(column) == pytest.approx(100.0, abs=0.05 * len(column))


def test_modes_of_equal_frequency_are_told_together_and_by_the_kind_of_spring():
    message = modes(changed(load("hexapod"), {"tool.mass": 12.0})).message
    assert "in 2 modes: the tool moves along x and along y." in message
    assert message.endswith("mainly in actuator ×6 100\N{NO-BREAK SPACE}%.")
    alone = modes(changed(load("planar-3rpr"), {"tool.mass": 2.0})).message
    assert "modes" not in alone
    assert "leg 2 actuator 51\N{NO-BREAK SPACE}%" in alone


def test_springs_that_are_too_many_for_a_table_are_told_by_kind():
    answer = modes(changed(load("hexapod-hardware"), {"tool.mass": 12.0}))
    assert len(answer.modes[0].strain) > MOST_PARTS
    shares = _strain_shares(answer.modes)
    assert {*shares[0]} == {*answer.modes[0].kinds}
    assert "drive screw ×6" in shares[0]
    for mode in answer.modes:
        assert sum(mode.kinds.values()) == pytest.approx(1.0, abs=1e-9)


def test_a_planar_machine_does_not_answer_along_z():
    heads = [
        [str(column.header) for column in mode_table(answer.modes, answer.machine.display, answer.components).columns]
        for answer in (modes(changed(load(name), {"tool.mass": 2.0})) for name in ("planar-3rpr", "delta"))
    ]
    assert ["z %" in names for names in heads] == [False, True]


def test_a_cutting_pressure_without_a_direction_asks_for_one():
    machine = changed(load("hexapod"), {"tool.mass": 12.0})
    assert cut_sentence(modes(machine)) == ""
    pressed = changed(machine, {"cutting.pressure": 2e9})
    assert "write direction = [1, 0, 0]" in cut_sentence(modes(pressed))
    assert "Along x " in cut_sentence(modes(changed(pressed, {"cutting.direction.0": 2.0})))


def test_a_sweep_draws_every_quantity_each_with_a_look_of_its_own():
    machine = changed(load("hexapod"), LIGHT_LEGS)
    names = [f"{kind}_{number}" for kind in ("frequency", "loaded_frequency") for number in range(1, 7)]
    (panel,) = grid_curves(evaluate_grid(machine, ["z=0.12:0.15:3"], names), names, "").axes
    assert len(panel.lines) == len(names)
    assert len({str(look_of(place)) for place in range(36)}) == 36


def test_the_response_marks_the_point_that_limits_a_cut():
    answer = modes(changed(load("hexapod"), LIGHT_LEGS), along=(1.0, 0.0, 0.0))
    real = next(panel for panel in response_figure(answer).axes if panel.get_ylabel()[:4] == "real")
    mark = next(line for line in real.lines if line.get_marker() == "o")
    softest = answer.softest([1.0, 0.0, 0.0])
    assert mark.get_xdata()[0] == softest.frequency
    assert mark.get_ydata()[0] == pytest.approx(1e6 * softest.real)


def test_entries_of_vectors_and_tensors_have_names_for_people():
    machine = load("hexapod")
    assert with_leg(machine, "tool.inertia.0") == "tool.inertia.0 (xx)"
    assert with_leg(machine, "tool.centre_of_mass.2") == "tool.centre_of_mass.2 (z)"
    assert with_leg(machine, "geometry.base_angles.5") == "geometry.base_angles.5 (leg 6)"
    assert with_leg(machine, "tool.mass") == "tool.mass"


def test_shapes_of_all_modes_stand_side_by_side_each_under_its_frequency():
    answer = modes(changed(load("hexapod"), LIGHT_LEGS))
    figure = plot(answer, "shapes")
    texts = {text.get_text(): text.get_position() for text in figure.axes[0].texts}
    for number, mode in enumerate(answer.modes[:6], 1):
        shown = answer.machine.display.show(mode.frequency, "Hz")
        across, up = texts[f"{number}: {shown} (tool: {mode.direction})"]
        for low, high, place in zip(*figure.axes[0].viewLim.get_points(), (across, up), strict=True):
            assert low < place < high
    headings = [place for text, place in texts.items() if "Hz" in text]
    assert len(headings) == len({*headings}) == 6
    assert not [line for line in figure.axes[0].lines if not figure.axes[0].viewLim.contains(*line.get_xydata()[0])]


def test_a_planar_machine_shows_its_shapes_in_plan_with_two_axes():
    figure = plot(modes(changed(load("planar-3rpr"), {"tool.mass": 2.0})), "shapes")
    assert {text.get_text() for text in figure.axes[0].texts} >= {"x", "y"}
    assert "z" not in {text.get_text() for text in figure.axes[0].texts}


def test_modes_are_drawn_and_written_as_netcdf_without_xarray(tmp_path):
    words = ["modes", "hexapod", "--set", "tool.mass=12 kg", "-o", str(tmp_path)]
    code = f"import sys; from kinetostat.cli import main; main({words!r}); sys.exit('xarray' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"modes.csv", "response.nc", "response.png", "shapes.png", "kinetostat.sha256"}
    with xr.open_dataset(tmp_path / "response.nc", engine="h5netcdf") as data:
        answer = modes(changed(load("hexapod"), {"tool.mass": 12.0}))
        given = data["frequency"].values
        complex_ones = data["receptance_real"].values + 1j * data["receptance_imaginary"].values
        assert complex_ones == pytest.approx(answer.receptance(given), rel=1e-12)
        assert data["frequency_hz"].values == pytest.approx([mode.frequency for mode in answer.modes])
        assert [*data["direction"].values] == [mode.direction for mode in answer.modes]
        assert [*data["moved"].values] == [*answer.components]
        assert data["frequency"].attrs["units"] == "Hz"
