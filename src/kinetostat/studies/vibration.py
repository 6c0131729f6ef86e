"""Natural frequencies and modes of a machine at its pose, and the response of its tool to a varying force.

The equations are in `vibration`; the command is `modes`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kinetostat.algebra.screw import COMPONENTS
from kinetostat.arrays import Array, Complex
from kinetostat.equilibrium.balance import Balance
from kinetostat.equilibrium.state import AnswerInState, MachineState, state_of
from kinetostat.frozen import dataclass
from kinetostat.kinematics.status import Status
from kinetostat.kinetostatics.loading import Deflection
from kinetostat.kinetostatics.response import Response
from kinetostat.machine.loads import moving_masses
from kinetostat.machine.machine import Machine
from kinetostat.machine.machine import springs as springs_of
from kinetostat.spec.arguments import checked
from kinetostat.spec.errors import InputError
from kinetostat.spec.fields import positive_number
from kinetostat.spec.immutable import ImmutableAnswer
from kinetostat.studies.attribution import largest_contributors, parts_and_kinds
from kinetostat.studies.directions import unit_direction
from kinetostat.studies.quantities import refuse_unknown_mass
from kinetostat.studies.tool_receptance import read_tool
from kinetostat.tolerances import EQUAL_FREQUENCIES
from kinetostat.vibration.cutting import LeastRealPart, least_real_part, least_real_part_of, tried_frequencies
from kinetostat.vibration.modes import Modes
from kinetostat.vibration.modes import modes as solved_modes
from kinetostat.vibration.receptance import (
    ASSUMED_RATIO,
    Damper,
    FreeTool,
    along,
    couple,
    damper,
    receptance,
)
from kinetostat.vibration.servo import ClosedLoops, servo_loops, with_standing_motors
from kinetostat.vibration.shares import effective_masses, kinetic_shares, small_motions, strain_shares

MOST_SHOWN = 12
"""Modes that are shown, two sets of the six of a rigid platform; higher ones add to the response all the same."""
NOTHING_VIBRATES = "There are no natural frequencies: all that could move is rigid."
"""The answer where no spring deflects."""
HIDDEN_BY_ROUND_OFF = (
    "Nothing can be said about vibrations at this pose: the softest motion is so much softer than the others, more "
    'than 1e12 times, that round-off hides it. Write "rigid" for springs that are meant to be, or make the softest '
    "one stiffer."
)
"""The answer where modes cannot be solved for."""
DRAWN_MODES = 6
"""Modes of which shapes are drawn, and about which responses are: those of a rigid platform on springs."""
CURVE_POINTS = 1500
"""Frequencies of a curve, besides those about the modes: as many as a printed line has dots."""
POINTS_ABOUT_A_MODE = 200
"""Frequencies about each mode, so that the height of its peak is met within a thousandth."""
REACH_ABOUT_A_MODE = 6.0
"""Distance from a mode to which these frequencies reach, in multiples of its frequency times its damping ratio: there
the response of the mode has fallen to a sixth."""
LEAST_DRAWN_RATIO = 1e-4
"""Damping ratio below which frequencies about a mode lie as those of this one: no picture shows a sharper peak."""
HIGHEST_FREQUENCY = 1e20
"""Highest frequency, Hz: its square is still a number."""
LOWEST_OF_CURVES, HIGHEST_OF_CURVES = 0.2, 1.6
"""Ends of the curves as multiples of the lowest and of the highest frequency that is drawn, beyond which a response has
little but that of a spring and that of a mass."""


@dataclass(frozen=True, eq=False)
class Mode(ImmutableAnswer):
    """A natural vibration.

    Attributes:
        frequency: natural frequency, Hz.
        ratio: damping ratio.
        tool: twist of the tool point, base axes, in motions whose mass is 1 kg: components of the machine, rad and m
            per root of a kg·m².
        direction: name of the component in which the tool moves most, turns counted at the machine's length.
        modal_mass: mass in that component, kg or kg·m²: on a spring of `modal_stiffness` it has the same frequency.
        modal_stiffness: stiffness in that component, N/m or N·m/rad.
        effective_mass: share of all moving mass that answers when the base shakes along x, y, z.
        strain: share of the strain energy of each spring, and of the loads, by name; they add up to 1.
        kinds: the same for all springs of one kind together, such as "actuator ×6", the greatest share first.
        kinetic: share of the kinetic energy of each part by name; they add up to 1.
        shape: small motions of the tool and of the ends of all links, of any size, for drawings.
    """

    frequency: float
    ratio: float
    tool: Array
    direction: str
    modal_mass: float
    modal_stiffness: float
    effective_mass: Array
    strain: Mapping[str, float]
    kinds: Mapping[str, float]
    kinetic: Mapping[str, float]
    shape: Deflection | None = None


@dataclass(frozen=True, eq=False)
class Vibration(AnswerInState):
    """The natural vibrations of a machine at its pose.

    Attributes:
        state: the state of the machine, with its masses.
        status: status of the pose.
        message: the answer in a sentence or two.
        components: names of the components of twists: rx ry rz x y z, or rz x y.
        loaded: whether the machine vibrates about its state under load.
        modes: modes from the lowest frequency; none where the pose has no answer.
        moving_mass: mass of all that moves, kg.
        uncounted: names of the parts whose mass nothing says.
        assumed: whether the damping ratio is `ASSUMED_RATIO` because the file says nothing about damping.
        solution: all modes as they were solved for, with those without mass; None where there are none.
        damping: the damping of the modes.
        direction: direction in which the tool is pushed, base axes; empty where nothing says it.
        cutting_pressure: cutting force per area of the chip, N/m²; None where nothing says it.
        lowest, highest: ends of the range of the response, Hz; None for about the first six modes.
        tool: a tool that is coupled to the machine, so that responses are those of its tip; None without one.
        loops: servo loops of its drives, if they are closed: modes are then those of motors that stand still.
    """

    state: MachineState
    status: Status
    message: str
    components: tuple[str, ...]
    loaded: bool = False
    modes: tuple[Mode, ...] = ()
    moving_mass: float = 0.0
    uncounted: tuple[str, ...] = ()
    assumed: bool = False
    solution: Modes | None = None
    damping: Damper | None = None
    direction: tuple[float, ...] = ()
    cutting_pressure: float | None = None
    lowest: float | None = None
    highest: float | None = None
    tool: FreeTool | None = None
    loops: ClosedLoops | None = None

    def __repr__(self) -> str:
        return f"<Vibration of {self.machine.name!r}: {self.status.word}, {len(self.modes)} modes>"

    @checked
    def receptance(self, frequencies: Sequence[float]) -> Complex:
        """Motion of the tool per unit of a varying wrench on it [frequencies x 6 x 6], rad and m per N·m and N.

        With a coupled tool it is that of its tip; with closed loops it is that of drives which these hold.

        Args:
            frequencies: Hz.

        Raises:
            InputError: the pose has no answer, or a frequency is above `HIGHEST_FREQUENCY` or not one of the tool.
        """
        solution, damping = self._solution()
        for place, frequency in enumerate(frequencies):
            if not abs(frequency) <= HIGHEST_FREQUENCY:
                raise InputError(
                    f"frequencies[{place}] is {frequency:g}; give numbers in Hz, up to {HIGHEST_FREQUENCY:g}."
                )
        row = np.asarray(frequencies, dtype=float).reshape(-1)
        of_machine = receptance(solution, damping, row) if self.loops is None else self.loops.receptance(row)
        if self.tool is None:
            return of_machine
        first, last = self.tool.frequencies[[0, -1]]
        for frequency in row[(row < first) | (row > last)]:
            raise InputError(f"{frequency:g} Hz is beyond what the tool tells, {first:g} to {last:g} Hz.")
        return couple(of_machine, self.tool, row)

    @checked
    def along(self, direction: Sequence[float], frequencies: Sequence[float]) -> Complex:
        """The receptance of the tool point along a direction, m/N [frequencies].

        Args:
            direction: three numbers of any size, base axes.
            frequencies: Hz.

        Raises:
            InputError: as for `receptance`, or the direction is zero.
        """
        return along(self.receptance(frequencies), np.array(unit_direction(direction, "direction")))

    @checked
    def softest(self, direction: Sequence[float]) -> LeastRealPart:
        """The least real part of the receptance along a direction, which limits the width of a cut, and its frequency.

        Args:
            direction: three numbers of any size, base axes.

        Raises:
            InputError: the pose has no answer, or the direction is zero.
        """
        solution, damping = self._solution()
        unit = np.array(unit_direction(direction, "direction"))
        if self.tool is None and self.loops is None:
            return least_real_part(solution, damping, unit)
        return least_real_part_of(
            lambda frequencies: along(self.receptance(frequencies.tolist()), unit), self.search_frequencies
        )

    @property
    def search_frequencies(self) -> Array:
        """Frequencies at which chatter is looked for, Hz: close together about each mode, within those of a tool."""
        solution, damping = self._solution()
        tried = tried_frequencies(solution.frequencies, damping.ratios(solution))
        if self.loops is not None:
            poles = self.loops.poles()
            swinging = poles[poles.imag > 0.0]  # of each pair of poles, one
            swinging = swinging[np.argsort(np.abs(swinging))]
            rates = np.abs(swinging)
            of_loops = tried_frequencies(rates / (2.0 * math.pi), np.abs(swinging.real) / rates)
            tried = np.unique(np.concatenate([tried, of_loops]))
        if self.tool is None:
            return tried
        tried = np.unique(np.concatenate([tried, self.tool.search_frequencies]))
        return tried[(tried >= self.tool.frequencies[0]) & (tried <= self.tool.frequencies[-1])]

    def _solution(self) -> tuple[Modes, Damper]:
        """All modes and their damping; an InputError where the pose has no answer."""
        if self.solution is None or self.damping is None:
            raise InputError(f"{self.machine.name} has no vibrations at this pose: {self.message}")
        return self.solution, self.damping


@checked
def modes(
    machine: Machine | MachineState,
    along: Sequence[float] = (),
    cutting_pressure: float | str | None = None,
    lowest: float | str | None = None,
    highest: float | str | None = None,
    tool_receptance: str | Path | None = None,
    closed_loops: bool = False,
) -> Vibration:
    """Find the natural vibrations of a machine at its pose, about its state under load where `machine.loaded` is set.

    Args:
        machine: the machine at its pose, or its state, as `state_of` returns it; its masses are those of [tool], of its
            links and of its drives.
        along: direction in which the tool is pushed, base axes; that of [cutting] if empty.
        cutting_pressure: cutting force per area of the chip, N/m² or with a unit; that of [cutting] if None.
        lowest, highest: ends of the range of the response, Hz or with a unit; about the first six modes if None.
        tool_receptance: CSV file with the receptance of a free tool and holder, which are then coupled to the tool
            point; modes stay those of the machine.
        closed_loops: whether the response is that with the servo loops of [servo] closed; modes are then those with
            motors that stand still.

    Raises:
        InputError: nothing says a mass, rotors have an inertia and nothing says how far they turn, a direction is zero,
            a pressure has no direction, the range is empty, the file of the tool has a mistake, or loops lack a gain,
            an inertia or a stiffness of the transmission.
    """
    state, tool = state_of(machine), read_tool(tool_receptance) if tool_receptance is not None else None
    direction, pressure = _direction_and_pressure(state.machine, along, cutting_pressure)
    low, high = frequency_ends(lowest, highest)
    answer = _modes_with_closed_loops(state) if closed_loops else _modes_of(state)
    return replace(answer, direction=direction, cutting_pressure=pressure, lowest=low, highest=high, tool=tool)


def _direction_and_pressure(
    machine: Machine, along: Sequence[float], cutting_pressure: float | str | None
) -> tuple[tuple[float, ...], float | None]:
    """The direction across the cut, and the cutting pressure: as they are given, else those of [cutting]."""
    cutting = machine.tables["cutting"]
    if along:
        unit_direction(along, "along")
    direction = tuple(along) or (tuple(cutting.direction) if any(cutting.direction) else ())
    if cutting_pressure is None:
        return direction, cutting.pressure or None
    pressure = positive_number(cutting_pressure, "cutting pressure", "cutting_pressure")
    if not direction:
        raise InputError("cutting_pressure needs the direction across the cut; give along as well, e.g. 1,0,0.")
    return direction, pressure


def frequency_ends(lowest: float | str | None, highest: float | str | None) -> tuple[float | None, float | None]:
    """Read the ends of a range of frequencies, Hz or with a unit; None stays where an end is not given.

    Raises:
        InputError: an end is not a frequency above 0, or the lowest is not below the highest.
    """
    low, high = (
        None if end is None else positive_number(end, "frequency", name)
        for end, name in ((lowest, "lowest"), (highest, "highest"))
    )
    if low is not None and high is not None and low >= high:
        raise InputError(f"lowest is {low:g} Hz, not below highest, {high:g} Hz; exchange them.")
    return low, high


def _modes_with_closed_loops(state: MachineState) -> Vibration:
    """The modes of the machine with motors that stand still, and its servo loops closed over these."""
    loops = servo_loops(state)
    answer = replace(_modes_of(state_of(with_standing_motors(state.machine))), state=state)
    solution = answer.solution
    if solution is None or answer.damping is None or not solution.mode_count:
        return answer
    loops_of_drives = tuple(loops[drive.name] for drive in solution.drives)
    return replace(answer, loops=ClosedLoops(solution, answer.damping, loops_of_drives))


def _modes_of(state: MachineState) -> Vibration:
    """The modes of a machine in its state, or the reason why it has none."""
    machine, names, status = state.machine, state.machine.family.component_names, state.status
    refuse_unknown_mass(machine, "modes", state.configuration)
    # Where springs alone hold nothing, loads may still do so: as a weight holds a pendulum.
    held_by_loads = machine.loaded and status is Status.SINGULAR and int(state.free.place_status) == Status.OK
    if status is not Status.OK and not held_by_loads:
        return Vibration(state, status, state.refusal, names)
    equations = state.equations
    if equations is None:
        message = f"{machine.name} comes to no stable rest under its loads; `kinetostat analyze --loaded` says why."
        return Vibration(state, Status.NO_REST, message, names, loaded=True)
    solution = solved_modes(equations)
    if solution is None:
        return Vibration(state, Status.SINGULAR, HIDDEN_BY_ROUND_OFF, names)
    if not solution.inverse_squares.size:
        return Vibration(state, Status.OK, NOTHING_VIBRATES, names)
    return _vibration(state, equations, solution)


def _vibration(state: MachineState, equations: Balance, solution: Modes) -> Vibration:
    """The answer for a machine whose modes are solved for; without damping in its file, with a usual one."""
    machine, response = state.machine, state.free
    table = machine.tables["damping"]
    has_friction = any(leg.dampers.any() for leg in equations.mechanism.legs)
    assumed = not (has_friction or table.ratio or table.per_mass or table.per_stiffness)
    ratio = ASSUMED_RATIO if assumed else table.ratio
    damping = damper(equations, solution, ratio, table.per_mass, table.per_stiffness)
    masses = moving_masses(machine, response.configuration)
    known_masses = [float(part.mass) for part in masses if part.mass is not None] + [machine.tables["tool"].payload]
    shown = tuple(_modes(machine, response, equations, solution, damping))
    return Vibration(
        state=state,
        status=Status.OK,
        message=_message(machine, response, shown),
        components=machine.family.component_names,
        loaded=machine.loaded,
        modes=shown,
        moving_mass=sum(known_masses),
        uncounted=tuple(part.name for part in masses if part.mass is None),
        assumed=assumed,
        solution=solution,
        damping=damping,
    )


def _message(machine: Machine, response: Response, shown: Sequence[Mode]) -> str:
    """Say what the first natural frequency is, how the tool moves at it, and which springs deform.

    Modes of equal frequency are told together: which motions of their plane are shown is arbitrary, their sum is not.
    """
    if not shown:
        return "Nothing that has mass can move."
    lowest = shown[0].frequency
    lowest_modes = [mode for mode in shown if math.isclose(mode.frequency, lowest, rel_tol=EQUAL_FREQUENCIES)]
    together = {name: sum(mode.strain[name] for mode in lowest_modes) / len(lowest_modes) for name in shown[0].strain}
    springs = largest_contributors(*parts_and_kinds(springs_of(response.configuration), together))
    motions = _motions(_directions(machine, lowest_modes, float(response.configuration.length)))
    in_modes = f", in {len(lowest_modes)} modes" if len(lowest_modes) > 1 else ""
    text = f"The first natural frequency is {machine.display.show(lowest, 'Hz')}{in_modes}: the tool {motions}."
    return f"{text} The strain energy is mainly in {springs}." if springs else text


def _directions(machine: Machine, together: Sequence[Mode], length: float) -> list[str]:
    """As many components as there are modes: those in which all of them together move the tool most."""
    names = machine.family.component_names
    scales = np.array([length if name.startswith("r") else 1.0 for name in names])
    sizes = np.linalg.norm([mode.tool for mode in together], axis=0) * scales
    return [names[place] for place in sorted(np.argsort(-sizes, kind="stable")[: len(together)])]


def _motions(components: Sequence[str]) -> str:
    """Components as motions: "moves along x", "turns about x and about y"."""
    phrases: list[str] = []
    for name in dict.fromkeys(components):
        verb, way = ("turns", f"about {name[1:]}") if name.startswith("r") else ("moves", f"along {name}")
        phrases.append(way if any(text.startswith(verb) for text in phrases) else f"{verb} {way}")
    return " and ".join(phrases)


def _modes(machine: Machine, response: Response, equations: Balance, solution: Modes, damping: Damper) -> list[Mode]:
    """The modes that are shown, from the lowest frequency, with the shares of parts in their energies."""
    count = min(solution.mode_count, MOST_SHOWN)
    strains, kinetics = strain_shares(equations, solution.shapes[:, :count]), kinetic_shares(equations, solution)
    components, ratios = list(machine.family.components), damping.ratios(solution)
    lengths = np.array([float(response.configuration.length)] * 3 + [1.0] * 3)  # turns count at the machine's length
    effective, springs = effective_masses(equations, solution), springs_of(response.configuration)
    shown = []
    for k in range(count):
        omega = 1.0 / math.sqrt(solution.inverse_squares[k])
        twist = solution.tool[:, k] * omega  # of a modal mass of 1 kg
        largest = max(components, key=(np.abs(twist) * lengths).__getitem__)
        mass = float(1.0 / twist[largest] ** 2) if twist[largest] else math.inf
        strain = {name: float(shares[k]) for name, shares in strains.items()}
        shown.append(
            Mode(
                frequency=float(solution.frequencies[k]),
                ratio=float(ratios[k]),
                tool=twist[components],
                direction=COMPONENTS[largest],
                modal_mass=mass,
                modal_stiffness=mass * omega**2,
                effective_mass=np.array(effective[k]),
                strain=strain,
                kinds=dict(parts_and_kinds(springs, strain)[1]),
                kinetic={name: float(shares[k]) for name, shares in kinetics.items()},
                shape=small_motions(response, equations, solution, k),
            )
        )
    return shown


def frequency_range(answer: Vibration, points: int = CURVE_POINTS, near: int = POINTS_ABOUT_A_MODE) -> Array:
    """Frequencies for curves, close together near the modes, Hz.

    Args:
        answer: the vibrations, with the ends of their range.
        points: number of frequencies over the whole range.
        near: number of frequencies about each of these modes, besides.

    Raises:
        InputError: the range of the answer and the frequencies of its tool have nothing in common.
    """
    drawn = answer.modes[:DRAWN_MODES]
    low = answer.lowest or LOWEST_OF_CURVES * drawn[0].frequency
    high = answer.highest or HIGHEST_OF_CURVES * drawn[-1].frequency
    of_tool = np.zeros(0)
    if answer.tool is not None:
        low, high = max(low, float(answer.tool.frequencies[0])), min(high, float(answer.tool.frequencies[-1]))
        of_tool = answer.tool.search_frequencies
        if low >= high:
            raise InputError("the range of the response and the frequencies of the tool have nothing in common.")
    widths = np.linspace(-REACH_ABOUT_A_MODE, REACH_ABOUT_A_MODE, near)
    about_modes = [mode.frequency * (1.0 + max(mode.ratio, LEAST_DRAWN_RATIO) * widths) for mode in drawn]
    frequencies = np.concatenate([np.geomspace(low, high, points), *about_modes, of_tool])
    return np.unique(frequencies[(frequencies >= low) & (frequencies <= high)])
