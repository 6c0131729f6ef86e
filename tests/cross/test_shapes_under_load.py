"""Where the parts of a loaded machine are, which legs carry over a grid, and the pictures of both."""

import json

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from test_cables import HANGING, cables

from kinetostat import build, carrying_legs, load, plot, save, under_load
from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE
from kinetostat.kinetostatics.loading import deflected_links
from kinetostat.kinetostatics.response import respond
from kinetostat.machine.loading import as_toml
from kinetostat.views.scene.anatomy import proportions_of
from kinetostat.views.scene.overlays import loaded_overlays
from refusals import refused

DOWN = "[load]\nforce = [0, -500, 0]\n"


def hanging(*more):
    return cables(HANGING, dict.fromkeys(HANGING, 100.0), *more)


def ends(links):
    return np.array([c for link in links for end in (link.start_motion, link.end_motion) for c in end.components()])


@pytest.mark.parametrize("name", ["delta", "hexapod-rus", "planar-3rrr", "tricept", "tripteron", "hexapod-hardware"])
def test_under_a_small_load_the_shape_is_that_of_the_linear_machine(name):
    machine = load(name, ["load.force=[0.01, 0.005, -0.02]"])
    linear = ends(deflected_links(respond(machine), machine.load)).astype(float)
    assert ends(under_load(machine).links) == pytest.approx(linear, abs=1e-5 * np.abs(linear).max())


def test_under_a_large_load_the_ends_of_all_legs_stay_on_the_platform():
    """A side load tilts the upright cables far: their upper ends stay, their lower ends move with the platform."""
    state = under_load(hanging("[load]\nforce = [60, -500, 3]\n"))
    turn, x, y = state.displacement
    assert abs(x) > 0.05
    for link in state.links:
        at = np.array(link.end.components()[:2])
        cosine, sine = np.cos(turn), np.sin(turn)
        expected = np.array([[cosine, -sine], [sine, cosine]]) @ at + (x, y) - at
        assert link.start_motion.translational.norm() == pytest.approx(0.0, abs=1e-12)
        assert link.end_motion.translational.components()[:2] == pytest.approx(expected, abs=1e-9)


def test_warm_links_reach_the_platform_where_they_have_grown():
    """Links that grow alike lift the platform; the motions of their ends are those of their joints there."""
    machine = load("hexapod", ["expansion.legs=12 um/(m*K)", "temperature_rise.legs=40 K"])
    state = under_load(machine)
    assert np.abs(state.displacement[:5]).max() < 1e-9
    assert state.displacement[5] > 1e-5
    last = {link.leg: link for link in state.links}
    for link in last.values():
        assert link.end_motion.translational.components() == pytest.approx(state.displacement[3:], abs=1e-12)


def test_a_load_at_a_named_point_is_drawn_too():
    machine = load("hexapod")
    pushed = build(as_toml(machine) + '\n[load.spindle]\npoint = [0, 0, 0]\nforce = ["500 N", 0, 0]\n')
    solids, factor = loaded_overlays(under_load(pushed), proportions_of(pushed, pushed.configure()))
    assert {solid.layer for solid in solids} == {"load", "deflection"}
    assert factor > 100


def words_of(figure):
    legend = figure.legends[0]
    return [text.get_text() for text in legend.get_texts()], legend.get_title().get_text()


def test_the_picture_of_the_shape_states_its_exaggeration_and_what_is_slack(tmp_path):
    state = under_load(hanging(DOWN))
    labels, title = words_of(plot(state, "shape"))
    assert labels == ["without loads", "at rest under load", "slack"]
    assert "displacements drawn 500 times larger" in title
    assert save(plot(state, "shape"), tmp_path / "shape.png").stat().st_size > 5000
    far = under_load(hanging("[load]\nforce = [5000, -300, 0]\n"))
    assert "displacements to scale" in words_of(plot(far, "shape"))[1]


def test_sets_of_carrying_legs_are_those_of_each_state():
    """Upright cables with 100 N each carry together up to 400 N; beyond, those on the side of the load are slack."""
    machine = hanging(DOWN)
    answer = carrying_legs(machine, ["load.force.1=-600:600:5", "y=-10 cm:10 cm:2"])
    top, bottom = tuple(HANGING)[:2], tuple(HANGING)[2:]
    assert dict(zip(answer.sets, answer.points, strict=True)) == {tuple(HANGING): 6, bottom: 2, top: 2}
    codes = answer.dataset["carrying"].values
    assert [answer.sets[code] for code in codes[:, 0]] == [top, *[tuple(HANGING)] * 3, bottom]
    slack = under_load(machine.with_values({"load.force.1": -600.0, "y": 0.1})).slack_legs
    assert {*answer.sets[codes[0, 1]], *slack} == {*HANGING}


def test_points_without_rest_carry_nothing_and_are_counted():
    answer = carrying_legs(hanging("[load]\nforce = [0, -500, 0]\nmin_tension = 50\n"), ["x=-1:1:5", "y=0:1:2"])
    assert answer.points == (2,)
    assert (answer.dataset["carrying"].values == -1).sum() == 8
    figure = plot(answer)
    assert words_of(figure)[0] == ["all: 20 %", "no result"]
    assert [type(part) for part in figure.axes[0].collections] == [QuadMesh]


def test_a_machine_whose_legs_cannot_go_slack_is_refused():
    with refused("all legs of .* pull and push"):
        carrying_legs(load("hexapod"), ["x=0:1 cm:2", "y=0:1 cm:2"])


def test_commands_write_the_pictures(tmp_path, capsys):
    path = tmp_path / "cables.toml"
    path.write_text(as_toml(hanging(DOWN)))
    words = ["map", str(path), "--over", "x=-1 cm:1 cm:3", "--over", "y=-1 cm:1 cm:3"]
    assert main([*words, "--carrying", "-o", str(tmp_path / "map"), "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["sets"] == [{"legs": [*HANGING][:2], "points": 9}]
    assert main(["analyze", str(path), "--loaded", "-o", str(tmp_path / "state")]) == DONE
    assert {p.name for p in tmp_path.rglob("*.*")} >= {"carrying.nc", "carrying.png", "shape.png", "growing-load.png"}
    assert main(["analyze", str(path), "-o", str(tmp_path / "none")]) == BAD_INPUT
    assert main([*words, "--carrying", "--quantity", "stiffness_x"]) == BAD_INPUT
