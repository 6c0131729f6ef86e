"""A designer's session apart from any page: changes, their history, files."""

import math
from dataclasses import replace

import pytest

from kinetostat.equilibrium.cables import cable_signs
from kinetostat.machine.loading import load
from kinetostat.machine.parameters import parameters
from machines import every_machine
from refusals import refused

pytest.importorskip("nicegui", reason="the extra kinetostat[studio] is not installed")

from kinetostat.studio.controls import CONTROL_PANELS, SLIDER_STEPS
from kinetostat.studio.session import Memory, Session
from kinetostat.studio.wording import full_label, shown_value

MACHINE = "zhang-gosselin-4dof"


@pytest.fixture
def session():
    return Session(Memory(load(MACHINE), MACHINE))


def test_a_drag_is_one_step_of_the_history(session):
    for position in (510, 560, 700):
        session.slide("pose.x", position)
    session.settle()
    assert session.value("pose.x") == pytest.approx(session.controls["pose.x"].value_at(700))
    session.undo()
    assert session.value("pose.x") == 0.0
    assert not session.can_undo
    session.redo()
    assert session.value("pose.x") > 0.0


def test_each_drag_is_a_step_of_its_own(session):
    session.slide("pose.x", 600)
    session.settle()
    session.slide("pose.x", 700)
    session.settle()
    session.slide("pose.z", 600)
    session.undo()
    session.undo()
    assert session.value("pose.x") == pytest.approx(session.controls["pose.x"].value_at(600))


def test_a_change_ends_what_could_be_redone(session):
    session.write("pose.x", "1 cm")
    session.undo()
    session.write("pose.z", "70 cm")
    assert not session.can_redo


def test_reset_can_be_undone(session):
    session.write("pose.x", "1 cm")
    session.reset()
    assert session.machine is session.origin
    session.undo()
    assert session.value("pose.x") == 0.01


def test_what_is_refused_changes_nothing(session):
    with refused():
        session.write("geometry.base_radius", "-3 cm")
    assert session.machine is session.origin
    assert not session.can_undo


def test_contradictions_are_found_when_the_hand_lets_go(session):
    session.write("limits.shortest_leg", "90 cm")
    with refused("nothing lies between them"):
        session.write("limits.longest_leg", "50 cm")
    assert math.isinf(session.value("limits.longest_leg"))
    assert session.value("limits.shortest_leg") == 0.9


CONTRADICTION = {"limits.shortest_leg": 0.9}, {"limits.longest_leg": 0.5}


def test_undo_in_the_middle_of_a_drag_keeps_no_numbers_that_contradict_each_other(session):
    session.move(CONTRADICTION[0])
    session.settle()
    session.move(CONTRADICTION[1])
    session.undo()
    assert math.isinf(session.value("limits.longest_leg"))
    assert session.value("limits.shortest_leg") == 0.9
    assert not session.can_redo
    session.undo()
    assert session.machine is session.origin


def test_another_drag_or_a_reset_checks_the_one_before(session):
    session.move(CONTRADICTION[0])
    session.settle()
    for change in (lambda: session.move({"pose.x": 0.01}), session.settle):
        session.move(CONTRADICTION[1])
        with refused("nothing lies between them"):
            change()
        assert math.isinf(session.value("limits.longest_leg"))
    session.move(CONTRADICTION[1])
    session.reset()
    session.undo()
    assert math.isinf(session.value("limits.longest_leg"))


def test_a_field_of_several_entries_moves_them_together(session):
    session.write("stiffness.actuator", "5000 N/m")
    assert [session.value(f"stiffness.actuator.{i}") for i in range(4)] == [5000.0] * 4


def test_a_file_opens_as_it_was_saved(session):
    session.write("pose.x", "12 mm")
    name, content = session.as_file()
    assert name == "zhang---gosselin-4-dof.toml"
    other = Session(Memory(load("hexapod"), "hexapod"))
    other.open_bytes(content, name)
    assert other.machine == session.machine
    assert other.name == ""
    assert not other.can_undo


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"x" * ((1 << 20) + 1), "larger than 1 MiB"),
        (b"\xff\xfe", "not text"),
        (b"name = ", "not valid TOML"),
        (b'schema = 1\nname = "x"\nfamily = "octopod"', "octopod"),
    ],
)
def test_bad_files_are_refused_and_the_machine_stays(session, content, words):
    with refused(words):
        session.open_bytes(content, "mine.toml")
    assert session.machine is session.origin
    assert session.name == MACHINE


def test_only_bundled_machines_open_by_name(session, tmp_path):
    """A page must not read the files of the computer that serves it."""
    file = tmp_path / "secret.toml"
    file.write_text("schema = 1")
    with refused("not a bundled machine"):
        session.open(str(file))


def test_a_session_goes_on_from_its_memory(session):
    session.write("pose.x", "12 mm")
    again = Session(session.memory)
    assert again.machine is session.machine
    assert again.origin is session.origin
    assert again.name == MACHINE
    again.undo()
    assert again.machine is again.origin


@every_machine
def test_every_number_has_a_control_and_text_that_can_be_typed(case):
    session = Session(Memory(replace(case.machine, loaded=True)))
    moved = {leaf for control in session.controls.values() for leaf in control.parameter.leaves}
    every = {leaf for parameter in parameters(case.machine.family) for leaf in parameter.leaves}
    of_cables = set() if cable_signs(case.machine) else {leaf for leaf in every if leaf.startswith("cables.")}
    assert moved == every - of_cables
    assert {path for path, control in session.controls.items() if len(control.parameter.leaves) == 1} == moved
    held = session.values()
    for path, control in session.controls.items():
        assert control.panel in CONTROL_PANELS
        text = shown_value(control.parameter.quantity, held[path])
        session.write(path, text)
        assert session.value(path) == pytest.approx(held[path], rel=1e-5, abs=1e-12)


@every_machine
def test_sliders_contain_the_value_and_go_both_ways(case):
    session = Session(Memory(case.machine))
    held = session.values()
    for path, control in session.controls.items():
        if not control.slides:
            continue
        assert control.value_at(control.position_of(held[path])) == pytest.approx(held[path], rel=0.02, abs=0.02)
        assert control.value_at(0) < control.value_at(SLIDER_STEPS // 2) < control.value_at(SLIDER_STEPS)


def test_what_weighs_nothing_yet_has_a_slider_from_nothing_on():
    """A body has no moment of inertia about one axis alone, so that the first slider moves all three."""
    session = Session(Memory(load("hexapod")))
    for path in ("tool.mass", "linear_density.legs", "drives.rotor_inertia", "drives.lead", "damping.ratio"):
        control = session.controls[path]
        assert (control.panel, control.value_at(0)) == ("Mass", 0.0)
        session.slide(path, SLIDER_STEPS // 2)
        assert session.value(path) == pytest.approx(0.5 * control.high)
        assert control.high > 0.0
    with refused("which no body has"):
        session.slide("tool.inertia.0", SLIDER_STEPS)
    session.settle()
    session.write("tool.inertia", "0.3 kg*m**2")
    session.write("tool.inertia.2", "0.5 kg*m**2")
    assert session.machine.tables["tool"].inertia == (0.3, 0.3, 0.5, 0.0, 0.0, 0.0)
    assert session.controls["tool.inertia.3"].value_at(0) < 0.0


def test_the_last_position_of_a_stiffness_is_rigid(session):
    session.slide("stiffness.passive_links", SLIDER_STEPS)
    assert math.isinf(session.value("stiffness.passive_links.0"))
    assert session.controls["stiffness.passive_links"].position_of(math.inf) == SLIDER_STEPS


@pytest.mark.parametrize("name", ["tripteron", "hexapod-hardware", "cogiro", "hexapod"])
def test_every_number_says_of_which_leg_and_joint_it_is(name):
    offered = Session(Memory(load(name), name)).controls
    names = [full_label(control.parameter) for control in offered.values()]
    assert len(set(names)) == len(names)
    for path, control in offered.items():
        if path.startswith("legs."):
            leg, joint = path.split(".")[1:3]
            assert f"{leg}, {joint}" in control.group
