"""What sweeps and maps leave behind: labelled NetCDF that reads back, figures with units, and no half-written file."""

import xml.etree.ElementTree as ElementTree
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text
from PIL import Image

from kinetostat.cli import main
from kinetostat.machine.loading import as_toml, build, load
from kinetostat.spec.document import parse
from kinetostat.studies.analysis import analyze
from kinetostat.studies.datasets import evaluate_grid, failures
from kinetostat.studies.guidelines import guidelines
from kinetostat.studies.quantities import resolve_quantities
from kinetostat.studies.sensitivity import sensitivity
from kinetostat.studies.storage import replacing, write_dataset, write_text
from kinetostat.views.drawing import three_views
from kinetostat.views.figures import save_figure
from kinetostat.views.grid_figures import contour_maps, grid_curves
from kinetostat.views.guideline_figures import guideline_figures
from kinetostat.views.layout import _CachedTightBox
from kinetostat.views.map_scales import levels_of, usual_range
from kinetostat.views.sensitivity import sensitivity_figure
from refusals import refused

MACHINE = "zhang-gosselin-4dof"


@pytest.fixture(scope="module")
def section():
    ranges = ["pose.x=-20 cm:20 cm:5", "pose.z=60 cm:150 cm:4"]
    return evaluate_grid(load(MACHINE), ranges, ["compliance", "stiffness", "compliance_rx_z", "singularity_margin"])


@pytest.mark.parametrize("powers", [3, 20, 29, 40])
def test_levels_reach_both_ends_of_however_many_powers_of_ten(powers):
    values = np.logspace(0.0, powers, 400)
    (low, high), bounds = usual_range(values), levels_of(values).bounds
    assert bounds[0] <= low
    assert bounds[-1] >= high


def test_a_dataset_is_labelled_with_names_units_and_origin(section):
    assert section["compliance_rx"].dims == ("x", "z")
    assert section["compliance_rx"].attrs["units"] == "rad/(N·m)"
    assert section["compliance_rx_z"].attrs["units"] == "rad/N"
    assert section["x"].attrs["units"] == "m"
    assert section["status"].attrs["flag_meanings"].split()[1] == "out_of_reach"
    assert build(parse(section.attrs["machine_file"], "attribute"), "attribute") == load(MACHINE)


def test_every_point_equals_the_analysis_of_that_pose(section):
    for i, x in enumerate(section["x"].values):
        for j, z in enumerate(section["z"].values):
            alone = analyze(load(MACHINE, [f"pose.x={float(x)!r}", f"pose.z={float(z)!r}"]))
            assert section["status"].values[i, j] == alone.status
            if alone.compliance is not None:
                assert section["compliance_x"].values[i, j] == pytest.approx(alone.compliance[3][3], rel=1e-12)
                assert section["compliance_rx_z"].values[i, j] == pytest.approx(alone.compliance[0][5], rel=1e-12)
                assert section["stiffness_ry"].values[i, j] == pytest.approx(alone.stiffness[1][1], rel=1e-12)


def test_no_value_is_missing_without_a_status(section):
    bad = section["status"].values != 0
    assert bad.any()
    assert not bad.all()
    for name in resolve_quantities(["compliance", "stiffness", "singularity_margin"]):
        assert (np.isnan(section[name].values) == bad).all()
    assert sum(failures(section).values()) == bad.sum()


def test_one_range_over_a_list_moves_all_its_entries_together():
    found = evaluate_grid(load(MACHINE), ["stiffness.passive_links=1e3:1e10:8:log"], ["stiffness_rz", "stiffness_y"])
    assert found["stiffness_rz"].values[0] == pytest.approx(743.98162658, rel=1e-11)
    assert found["stiffness_y"].values[-1] == pytest.approx(19223375926.0, rel=1e-11)


def test_a_machine_file_written_from_a_machine_reads_back_as_it():
    machine = load(MACHINE, ["stiffness.passive_links.0=rigid", "pose.x=1.2345678901234567 mm", 'name="ä \\" b"'])
    assert build(parse(as_toml(machine), "text"), "text") == machine


@pytest.mark.parametrize("command", ["sweep", "map"])
def test_commands_write_data_and_figures(command, tmp_path, capsys):
    ranges = ["--vary", "x=-1 cm:1 cm:5"]
    if command == "map":
        ranges = ["--over", "x=-1 cm:1 cm:5", "--over", "theta5=-70 deg:-50 deg:4"]
    words = [*ranges, "--quantity", "compliance_x", "--formats", "png,svg,PDF"]
    assert main([command, MACHINE, *words, "-o", str(tmp_path / "out")]) == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"kinetostat.sha256", *(f"{command}.{suffix}" for suffix in ("nc", "pdf", "png", "svg"))}
    assert (tmp_path / "out" / f"{command}.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "out" / f"{command}.pdf").read_bytes().startswith(b"%PDF")
    ElementTree.parse(tmp_path / "out" / f"{command}.svg")
    with xr.open_dataset(tmp_path / "out" / f"{command}.nc", engine="h5netcdf") as dataset:
        assert dataset["status"].size == (20 if command == "map" else 5)


def test_figures_come_only_in_the_formats_asked_for(tmp_path, capsys):
    words = ["sweep", MACHINE, "--vary", "x=-1 cm:1 cm:3", "--quantity", "compliance_x", "-o", str(tmp_path)]
    assert main(words) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kinetostat.sha256", "sweep.nc", "sweep.png"]
    with pytest.raises(SystemExit):
        main([*words, "--formats", "png,bmp"])
    assert "give some of png,svg,pdf" in capsys.readouterr().err


def test_a_singular_neighbourhood_does_not_drown_a_map():
    """One pose in 41 x 41 next to a singularity: the bands still resolve all others, and the bar has an arrow."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 41))
    smooth = 1.0 + 0.1 * x + 0.05 * y
    spoilt = smooth.copy()
    spoilt[20, 20] = 1e9
    levels = levels_of(spoilt)
    assert levels.extend == "max"
    assert not levels.logarithmic
    assert len(np.unique(np.digitize(smooth, levels.bounds))) > 8
    assert levels_of(smooth).extend == "neither"


def test_values_over_decades_have_logarithmic_levels():
    levels = levels_of(np.geomspace(3e-7, 0.4, 500))
    assert levels.logarithmic
    assert 4 <= len(levels.bounds) <= 14
    assert levels.bounds[0] <= 3e-7 <= 0.4 <= levels.bounds[-1]
    ratios = levels.bounds[1:] / levels.bounds[:-1]
    assert ratios.max() < 11.0


def test_no_text_of_a_figure_is_clipped(section):
    """Titles, labels, numbers at axes and bars lie within the figure, the values of contours within their panel."""
    machine = load("tricept")
    long_name = replace(machine, name="A machine with a name that is longer than any figure of it is wide " * 2)
    figures = [
        contour_maps(section, ["compliance_rx", "compliance_z", "singularity_margin"], "title"),
        sensitivity_figure(sensitivity(long_name, ["compliance_x"])),
        three_views(long_name, long_name.name),
        *(draw() for draw in guideline_figures(guidelines(load("planar-3rpr"))).values()),
    ]
    for figure in figures:
        figure.draw_without_rendering()  # which puts labels beside the numbers of their axes
        frame = figure.bbox.padded(0.5)
        for text in figure.findobj(Text):
            box = text.get_window_extent()
            if text.get_visible() and text.get_text().strip() and box.width and not outside_axis(text, figure):
                assert frame.contains(box.x0, box.y0), text.get_text()
                assert frame.contains(box.x1, box.y1), text.get_text()
    for panel in figures[0].axes:
        for text in panel.texts:
            assert panel.bbox.padded(0.5).contains(*text.get_window_extent().min), text.get_text()
            assert panel.bbox.padded(0.5).contains(*text.get_window_extent().max), text.get_text()


def outside_axis(text, figure):
    """Whether a text is a tick label beyond the ends of its axis, which is never drawn."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            ends = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                if text in (tick.label1, tick.label2):
                    return not (ends[0] - 1e-9 <= tick.get_loc() <= ends[1] + 1e-9)
            if any(text in (tick.label1, tick.label2) for tick in axis.get_minor_ticks()):
                return True
    return False


def test_every_axis_of_a_map_has_its_unit(section):
    figure = contour_maps(section, ["compliance_rx", "compliance_z", "singularity_margin"], "title")
    panels = [axes for axes in figure.axes if axes.get_xlabel()]
    assert [axes.get_xlabel() for axes in panels] == ["x (mm)"] * 3
    assert [axes.get_ylabel() for axes in panels] == ["z (mm)", "", ""]
    titles = [axes.get_title() for axes in panels]
    assert "rad/(N·m)" in titles[0]
    assert "m/N" in titles[1]
    texts = [text.get_text() for text in figure.texts] + [figure._supxlabel.get_text()]
    assert any("no result at 5 of 20 poses (out of reach)" in text for text in texts)


def test_panels_of_a_map_share_their_labels(section):
    """Numbers and a label stand below the lowest panel of a column and beside the first of a row, nowhere else."""
    names = ["compliance_rx", "compliance_z", "singularity_margin", "compliance_x", "compliance_y"]
    figure = contour_maps(section, names, "title")
    figure.draw_without_rendering()
    panels = [axes for axes in figure.axes if axes.get_title()]
    assert [bool(axes.get_xlabel()) for axes in panels] == [False, False, True, True, True]
    assert [bool(axes.get_ylabel()) for axes in panels] == [True, False, False, True, False]
    for axes in panels:
        for axis, label in ((axes.xaxis, axes.get_xlabel()), (axes.yaxis, axes.get_ylabel())):
            assert any(tick.label1.get_visible() for tick in axis.get_major_ticks()) is bool(label)


def test_a_panel_is_measured_as_matplotlib_would():
    """The layout remembers what stands around a panel; it is the layout that measuring each time gives."""
    answer = sensitivity(load("tricept"), ["compliance_x"])
    remembered = [axes.get_position().bounds for axes in sensitivity_figure(answer).axes]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_CachedTightBox, "box", lambda self, *given, **options: self._measure(*given, **options))
        measured = [axes.get_position().bounds for axes in sensitivity_figure(answer).axes]
    np.testing.assert_allclose(remembered, measured, atol=1e-9)


def test_a_picture_of_a_figure_has_its_pixels_and_its_size(section, tmp_path):
    """The PNG is what Pillow reads as the canvas has drawn it, at 200 dots per inch."""
    figure = contour_maps(section, ["compliance_z"], "title")
    save_figure(figure, tmp_path / "map.png")
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.mode == "RGB"
        assert picture.info["dpi"] == pytest.approx((200.0, 200.0), abs=0.01)
        np.testing.assert_array_equal(np.asarray(picture), np.asarray(figure.canvas.buffer_rgba())[..., :3])


def test_numbers_that_are_placed_once_stand_where_matplotlib_places_them_again(section, tmp_path):
    figure = contour_maps(section, ["compliance_z", "stiffness_x"], "title")
    save_figure(figure, tmp_path / "once.png")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kinetostat.views.figures.steady_ticks", lambda _panels: nullcontext())
        save_figure(figure, tmp_path / "again.png")
    assert (tmp_path / "once.png").read_bytes() == (tmp_path / "again.png").read_bytes()


def test_stiffness_curves_are_log_log_with_one_panel_per_unit():
    dataset = evaluate_grid(load(MACHINE), ["stiffness.passive_links=1e3:1e10:8:log"], ["stiffness"])
    figure = grid_curves(dataset, resolve_quantities(["stiffness"]), "title")
    assert [axes.get_ylabel() for axes in figure.axes] == ["stiffness (N·m/rad)", "stiffness (N/m)"]
    assert {(axes.get_xscale(), axes.get_yscale()) for axes in figure.axes} == {("log", "log")}


def test_a_constant_map_says_so_instead_of_drawing_noise():
    ranges = ["stiffness.actuator=1e3:2e3:3", "pose.x=0:1e-12:3"]
    dataset = evaluate_grid(load(MACHINE), ranges, ["compliance_y"])
    figure = contour_maps(dataset, ["compliance_y"], "title")
    assert "constant: 5.78e-4 m/N" in [text.get_text() for axes in figure.axes for text in axes.texts]


def test_an_interrupted_write_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "result.txt"
    write_text(path, "old")

    def interrupted():
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["result.txt"]


def test_a_dataset_file_is_replaced_whole(tmp_path, section):
    path = tmp_path / "deep" / "map.nc"
    for _ in range(2):
        write_dataset(path, section)
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset.identical(section)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()
    with refused("cannot be written"):
        write_text(tmp_path / "file" / "result.txt", "text")


def test_a_figure_says_where_its_numbers_hold():
    """Reference point, axes, and the pose as far as it does not vary."""
    grid = evaluate_grid(
        load("hexapod", ["tool.offset=[0, 0, 0.08]", "pose.z=140 mm"]), ["x=-1 cm:1 cm:3"], ["compliance"]
    )
    said = grid_curves(grid, ["compliance_x"], "one").get_supxlabel()
    assert said.startswith("base axes at the tool point T; y 0 mm, z 140 mm, roll 0 deg")
    assert "x 0 mm" not in said
