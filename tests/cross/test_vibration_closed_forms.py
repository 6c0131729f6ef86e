"""Natural frequencies and shapes of machines whose equations fit on a few lines: chains, beams, cables, rotors."""

from pathlib import Path

import numpy as np
import pytest

from kinetostat import build, changed, load
from kinetostat.equilibrium.balance import balance, free_state
from kinetostat.equilibrium.mechanism import mechanism_of
from kinetostat.equilibrium.solving import at_rest, with_share
from kinetostat.kinematics.closure import solve_joints
from kinetostat.kinetostatics.response import respond
from kinetostat.validation.comparison import KNOWN, frequency_pairs
from kinetostat.vibration.modes import modes
from machines import STRETCH, cable, written

IDLE_CARRIAGE = Path(__file__).parents[1] / "cases/idle-carriage.toml"


def vibration(machine, loaded=False):
    """The modes of a machine with relaxed springs, or at rest under its loads."""
    joints = solve_joints(machine) if machine.family.chains else None
    mechanism = mechanism_of(machine, respond(machine, joints).configuration, joints)
    if loaded:
        return modes(at_rest(mechanism).balance)
    relaxed = with_share(mechanism, 0.0)
    return modes(balance(relaxed, free_state(relaxed)))


def hertz(squares):
    """Frequencies of given squares of circular frequencies, ascending, Hz."""
    return np.sqrt(np.sort(squares)) / (2.0 * np.pi)


def agree(answer, squares, rel=1e-12):
    assert answer.frequencies == pytest.approx(hertz(squares), rel=rel)


def leg(joints, links="", name="leg"):
    """One leg of joints (lines of TOML) from base to platform."""
    return f'[[legs]]\nname = "{name}"\njoints = [{", ".join(f"{{ {joint} }}" for joint in joints)}]\n{links}'


def slide(name, joins, stiffness, actuated=True):
    drive = "actuated = true, " if actuated else ""
    return (
        f'name = "{name}", type = "prismatic", joins = {[*joins]}, point = [0, 0, 0], axis = [0, 0, 1], {drive}'
        f"stiffness = {stiffness}"
    )


STIFF, MASS = 3e6, 12.0


def test_a_mass_on_a_spring():
    machine = build(
        written("slide", (0, 0, 1), {"z": 1}, planar=False) + leg([slide("drive", ("base", "platform"), STIFF)])
    )
    assert vibration(machine).mode_count == 0
    agree(vibration(changed(machine, {"tool.mass": MASS})), [STIFF / MASS])


def test_a_rotor_is_heavy_with_the_square_of_its_gearing():
    """A slide with lead l: m + J (2 pi / l)². A crank of radius r: m r² + I + J n²."""
    inertia, lead, ratio, radius, own = 3e-4, 0.01, 30.0, 0.4, 0.2
    rotor = f"[drives]\nrotor_inertia = {inertia}\nlead = {lead}\nratio = {ratio}\n"
    tool = f"[tool]\nmass = {MASS}\ninertia = [{own / 2}, {own / 2}, {own}, 0, 0, 0]\n"
    slides = written("slide", (0, 0, 1), {"z": 1}, planar=False) + tool + rotor
    screw = leg([slide("drive", ("base", "platform"), STIFF)])
    agree(vibration(build(slides + screw)), [STIFF / (MASS + inertia * (2.0 * np.pi / lead) ** 2)])
    turns = written("crank", (radius, 0, 0), {"yaw": 0}, planar=False) + tool + rotor
    motor = 'name = "motor", type = "revolute", joins = ["base", "platform"], point = [0, 0, 0], axis = [0, 0, 1], '
    crank = leg([f"{motor} actuated = true, stiffness = 5e4"])
    agree(vibration(build(turns + crank)), [5e4 / (MASS * radius**2 + own + inertia * ratio**2)])


def test_a_rotor_on_the_first_of_two_drives_has_a_mode_of_its_own():
    """Two springs in a row to a mass m; the deflection of the first carries J: [m + J, m; m, m] against diag(k, k2)."""
    inertia, lead, second = 2e-4, 0.005, 8e6
    heavy = inertia * (2.0 * np.pi / lead) ** 2
    text = written("row", (0, 0, 1), {"z": 1}, planar=False) + f"[tool]\nmass = {MASS}\n"
    drives = f"[drives]\nrotor_inertia = {inertia}\nlead = {lead}\n"
    row = [slide("drive", ("base", "carriage"), STIFF), slide("seat", ("carriage", "platform"), second, False)]
    mass = np.array([[MASS + heavy, MASS], [MASS, MASS]])
    squares = np.linalg.eigvals(np.linalg.solve(mass, np.diag([STIFF, second])))
    agree(vibration(build(text + drives + leg(row))), squares)


def test_a_chain_of_two_masses():
    """The textbook's quadratic: m1 m2 w⁴ - (m1 k2 + m2 (k1 + k2)) w² + k1 k2 = 0."""
    first, second = 4.0, 8e6
    text = written("row", (0, 0, 1), {"z": 1}, planar=False) + f"[tool]\nmass = {MASS}\n"
    row = [slide("drive", ("base", "carriage"), STIFF), slide("seat", ("carriage", "platform"), second, False)]
    links = f'links = {{ carriage = {{ model = "rigid", mass = {first}, centre_of_mass = [0.1, 0.2, 0.3] }} }}\n'
    squares = np.roots([first * MASS, -(first * second + MASS * (STIFF + second)), STIFF * second])
    agree(vibration(build(text + leg(row, links))), squares)


LENGTH, WIDTH, YOUNG, STEEL_SHEAR, TWIST, DENSITY = 1.2, 0.05, 2.1e11, 8.1e10, 8.8e-7, 7850.0
AREA, SECOND = WIDTH**2, WIDTH**4 / 12.0


def crank(turn, more=""):
    """A crank on a spring, from the origin to the platform at 0.4 m, as a body; copies are turned about z."""
    joints = [
        'name = "motor", type = "revolute", joins = ["base", "arm"], point = [0, 0, 0], axis = [0.6, 0, 0.8], '
        "actuated = true, stiffness = 5e4",
        'name = "flange", type = "fixed", joins = ["arm", "platform"], point = [0.4, 0, 0]',
    ]
    body = "mass = 3, centre_of_mass = [0.1, 0.2, -0.1], inertia = [0.3, 0.25, 0.2, 0.02, -0.03, 0.01]"
    links = f'links = {{ arm = {{ model = "rigid", {body} }} }}\n{more}'
    text = written("crank", (0.4 * float(np.cos(turn)), 0.4 * float(np.sin(turn)), 0), {"z": 0}, planar=False)
    return text + leg(joints, links)


@pytest.mark.parametrize(
    ("more", "angle"), [("", 0.0), ('copies = 1\nangles = ["40 deg"]\n', np.radians(40))], ids=["written", "copy"]
)
def test_a_link_turns_with_its_inertia_about_its_axis(more, angle):
    """u^T I u + m |u x c|² about the crank's axis, also of a copy that is turned about another axis."""
    axis, centre = np.array([0.6, 0.0, 0.8]), np.array([0.1, 0.2, -0.1])
    tensor = np.array([[0.3, 0.02, -0.03], [0.02, 0.25, 0.01], [-0.03, 0.01, 0.2]])
    inertia = axis @ tensor @ axis + 3.0 * np.sum(np.cross(axis, centre) ** 2)
    agree(vibration(build(crank(angle, more))), [5e4 / inertia])


def test_the_inertia_of_a_link_travels_with_it():
    """A body on two hinges: the second turns it by b, sin b = sin(yaw) cos(pitch), which the first one feels."""
    joints = [
        'name = "lift", type = "revolute", joins = ["base", "arm"], point = [0, 0, 0], axis = [0, 1, 0], '
        'actuated = true, stiffness = "rigid"',
        'name = "spin", type = "revolute", joins = ["arm", "body"], point = [0, 0, 0], axis = [0, 0, 1], '
        "actuated = true, stiffness = 5e4",
        'name = "flange", type = "fixed", joins = ["body", "platform"], point = [0, 0, 0]',
    ]
    links = (
        'links = { body = { model = "rigid", mass = 1, centre_of_mass = [0, 0, 0], inertia = [2, 3, 4, 0, 0, 0.5] } }\n'
    )
    head = written("lift", (0, 0, 0), {"pitch": np.radians(60), "yaw": 0.3}, planar=False)
    agree(vibration(build(head + leg(joints, links))), [5e4 / 4.0])
    bent = (
        head
        + "[load]\ngravity = [0, 0, 0]\n"
        + leg(joints, links).replace("5e4", '"rigid"').replace('"rigid"', "5e4", 1)
    )
    sine = 0.5 * np.sin(0.3)
    agree(vibration(build(bent)), [5e4 / (2 * sine**2 + 3 * (1 - sine**2))])


def cantilever(model, inertia=(0.0, 0.0, 0.0), density=0.0):
    """A square beam along x, built in at the base, with a mass at its end."""
    section = (
        f'[sections.bar]\nshape = "own"\narea = {AREA}\nsecond_moment_y = {SECOND}\nsecond_moment_z = {SECOND}\n'
        f"torsion_constant = {TWIST}\nyoungs_modulus = {YOUNG}\nshear_modulus = {STEEL_SHEAR}\ndensity = {density}\n"
    )
    tool = f"[tool]\nmass = {MASS}\ninertia = {[*inertia, 0.0, 0.0, 0.0]}\n"
    clamp = 'name = "clamp", type = "revolute", joins = ["base", "arm"], point = [0, 0, 0], axis = [0, 0, 1], '
    end = f'name = "end", type = "fixed", joins = ["arm", "platform"], point = [{LENGTH}, 0, 0]'
    links = f'links = {{ arm = {{ model = "{model}", section = "bar", up = [0, 0, 1] }} }}\n'
    head = written("cantilever", (LENGTH, 0, 0), {"yaw": 0}, planar=False)
    return build(head + section + tool + leg([f'{clamp} actuated = true, stiffness = "rigid"', end], links))


def sag(model):
    """Deflection of the beam's end by a force there: Euler's, and Timoshenko's with the shear area 5/6 A; m/N."""
    shear = LENGTH / (STEEL_SHEAR * AREA * 5.0 / 6.0) if model == "timoshenko" else 0.0
    return LENGTH**3 / (3.0 * YOUNG * SECOND) + shear


@pytest.mark.parametrize("model", ["beam", "timoshenko"])
def test_a_cantilever_with_a_point_mass(model):
    """3 E I / L³, with shear if it is Timoshenko's, across in both directions; E A / L along."""
    soft = sag(model)
    agree(vibration(cantilever(model)), [1.0 / (MASS * soft)] * 2 + [YOUNG * AREA / LENGTH / MASS])


@pytest.mark.parametrize("model", ["beam", "timoshenko"])
def test_a_cantilever_with_a_body_that_turns(model):
    """mu = 1 / w²: mu² - (m c + I e) mu + m I (c e - d²) = 0 with the end's compliances c, d = L² / 2EI, e = L / EI."""
    about, across = 0.05, 0.4
    soft, both, turning = sag(model), LENGTH**2 / (2.0 * YOUNG * SECOND), LENGTH / (YOUNG * SECOND)
    whole = MASS * across * (soft * turning - both**2)
    pair = 1.0 / np.roots([1.0, -(MASS * soft + across * turning), whole])
    squares = [*pair, *pair, YOUNG * AREA / LENGTH / MASS, STEEL_SHEAR * TWIST / LENGTH / about]
    agree(vibration(cantilever(model, (about, across, across))), squares, 1e-10)


def test_a_uniform_beam_counts_as_a_third_of_its_mass_at_its_end():
    """It is straight between its ends; the bent shape of the textbook counts as 33/140. This beam is heavy."""
    third = MASS + DENSITY * AREA * LENGTH / 3.0
    squares = np.array([1.0 / sag("beam")] * 2 + [YOUNG * AREA / LENGTH]) / third
    answer = vibration(cantilever("beam", density=DENSITY))
    agree(answer, squares)
    exact = 1.0 / (sag("beam") * (MASS + DENSITY * AREA * LENGTH * 33.0 / 140.0))
    assert answer.frequencies[0] == pytest.approx(hertz([exact])[0], rel=0.06)


def test_the_tension_of_cables_is_all_that_resists_across_them():
    """Two cables in a line, eyes at +-a, of length L: 2 k along, 2 T / L across, 2 T a (1 + a / L) about their middle.

    With the tension the latter two grow; without it, nothing resists and there are no modes.
    """
    arm, length, own = 0.3, 2.0, 0.9
    ends = [((-arm - length, 0, 0), (-arm, 0, 0)), ((arm + length, 0, 0), (arm, 0, 0))]
    found = []
    for tension in (200.0, 800.0):
        text = (
            written("string", (0, 0, 0), {"x": 0, "y": 0, "yaw": 0})
            + f"[tool]\nmass = {MASS}\ninertia = [{own / 2}, {own / 2}, {own}, 0, 0, 0]\n"
        )
        machine = build(text + "".join(cable(f"c{i}", *pair, tension) for i, pair in enumerate(ends)))
        assert vibration(machine) is None
        answer = vibration(machine, loaded=True)
        resists = 2.0 * STRETCH / MASS, 2.0 * tension / length / MASS, 2.0 * tension * arm * (1 + arm / length) / own
        agree(answer, resists, 1e-9)
        found.append(answer.frequencies[:2])
    assert found[1] == pytest.approx(2.0 * found[0], rel=1e-9), "four times the tension"


STRUT, SIZE = 20e6, 0.1
"""Of the bundled cubic hexapod: k, and Hc; its K is k diag(1.5 Hc², 1.5 Hc², 6 Hc², 2, 2, 2) at the cube's centre."""


def cubic(height=0.0, inertia=(0.12, 0.12, 0.2), density=0.0):
    tensor = [*inertia, 0.0, 0.0, 0.0]
    settings = [f"tool.mass={MASS}", f"tool.centre_of_mass={[0.0, 0.0, height]}", f"tool.inertia={tensor}"]
    return load("hexapod-cubic", [*settings, f"linear_density.legs={density}"])


def cubic_squares(mass, height, across, along):
    """Of a rigid body with its centre above the cube's: a pair of surge and pitch, twice; heave; spin."""
    half = 0.5 * STRUT * (2.0 / mass + 2.0 * height**2 / across + 1.5 * SIZE**2 / across)
    root = np.sqrt(half**2 - 3.0 * SIZE**2 * STRUT**2 / (mass * across))
    return [half - root] * 2 + [half + root] * 2 + [2.0 * STRUT / mass, 6.0 * STRUT * SIZE**2 / along]


def test_a_point_mass_in_the_centre_of_a_cubic_hexapod():
    agree(vibration(cubic(inertia=(0.0, 0.0, 0.0))), [2.0 * STRUT / MASS] * 3)


@pytest.mark.parametrize("height", [0.0, 0.03, -0.2])
def test_a_rigid_body_on_a_cubic_hexapod(height):
    agree(vibration(cubic(height)), cubic_squares(MASS, height, 0.12, 0.2))


def test_struts_of_a_cubic_hexapod_count_as_thirds_at_the_platform_joints():
    """Each strut turns about its base joint: a third of its mass moves with the platform joint, in every direction."""
    density, radius, above = 3.0, np.sqrt(2.0) * SIZE, 0.5 * SIZE
    third = density * np.sqrt(3.0) * SIZE / 3.0
    mass = MASS + 6.0 * third
    height = 6.0 * third * above / mass
    across = 0.12 + 6.0 * third * (0.5 * radius**2 + above**2) - mass * height**2
    agree(vibration(cubic(density=density)), cubic_squares(mass, height, across, 0.2 + 6.0 * third * radius**2))


def test_equal_frequencies_of_a_symmetric_hexapod_have_a_plane_of_shapes():
    """A turn of the machine by 120 degrees takes the shapes of a pair to combinations of the two: T T^T stays."""
    answer = vibration(cubic(0.03, density=3.0))
    turn = np.kron(np.eye(2), [[-0.5, -np.sqrt(0.75), 0.0], [np.sqrt(0.75), -0.5, 0.0], [0.0, 0.0, 1.0]])
    squares = answer.inverse_squares
    pairs = [(i, i + 1) for i in range(5) if squares[i + 1] == pytest.approx(squares[i], rel=1e-12)]
    assert len(pairs) == 2
    for pair in pairs:
        shapes = answer.tool[:, pair]
        plane = shapes @ shapes.T
        assert np.linalg.matrix_rank(shapes, tol=1e-3 * np.abs(shapes).max()) == 2
        assert turn @ plane @ turn.T == pytest.approx(plane, abs=1e-11 * np.abs(plane).max())
        first = shapes[:, :1] @ shapes[:, :1].T
        assert turn @ first @ turn.T != pytest.approx(first, abs=0.1 * np.abs(first).max()), "a single shape does not"


def test_one_softer_strut_parts_the_pairs():
    """To first order the sum of the squares of a pair falls by its share of the lost strain; the pair is apart."""
    together, apart = (
        vibration(changed(cubic(0.03), {"stiffness.actuator.0": STRUT * share})) for share in (1.0, 0.99)
    )
    assert apart.frequencies[1] / apart.frequencies[0] - 1.0 > 1e-4
    assert (apart.frequencies <= together.frequencies * (1.0 + 1e-12)).all(), "Rayleigh: softer is slower"


def test_a_part_that_nothing_holds_along_its_way_stays_where_it_is():
    """Carriage idle between base and table: the table vibrates alone, omega² = k/m, whatever the carriage weighs."""
    machine = load(IDLE_CARRIAGE)
    for mass in (3.0, 0.001, 300.0):
        agree(vibration(changed(machine, {"legs.idle.carriage.mass": mass})), [2e6 / 5.0])
    assert frequency_pairs(machine, KNOWN[0])[0] == pytest.approx([np.sqrt(2e6 / 5.0) / (2.0 * np.pi)] * 2, rel=1e-9)
