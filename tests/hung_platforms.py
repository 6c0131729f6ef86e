"""Random platforms on cables, and where each comes to rest: an overdamped descent of its energy, from points alone.

Every cable has a spring that never pushes and a dashpot beside it; masses hang at their points. Nothing here is
computed by the package under test: arrays of many platforms at once, with the cables that one lacks of no stiffness.
"""

import tomllib
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

GRAVITY = 9.81
FEWEST, MOST = 6, 9
"""Cables of a platform."""
ROOM = np.array([2.0, 1.5])
"""Half of the length and of the width between the feet of the cables, m."""
TOP = 2.3
"""Of the upper feet over the lower ones, m."""
STEPS, EVERY = 20_000, 500
"""Of the descent at most, and after how many each time it is tried whether a platform is nearly at rest."""
DRAG = 1e-4
"""Of the platform itself, as a share of that of its dashpots."""
LENGTH = 0.5
"""Over which a turn is compared with a translation, m."""


@dataclass(frozen=True)
class Hung:
    """Platforms on cables [n], m, N and kg.

    Attributes:
        feet: of the cables on the base [n x cables x 3].
        eyes: of the cables on the platform, in its axes from P [n x cables x 3].
        stiffness, preload: of the cables, N/m and N [n x cables].
        place, angles: of P in the base, and roll, pitch and yaw, rad [n x 3].
        offset: of the tool point from P, in platform axes [n x 3].
        masses, centres: of platform and payload [n x 2], and where, in platform axes from P [n x 2 x 3].
        present: which cables there are [n x cables].
    """

    feet: np.ndarray
    eyes: np.ndarray
    stiffness: np.ndarray
    preload: np.ndarray
    place: np.ndarray
    angles: np.ndarray
    offset: np.ndarray
    masses: np.ndarray
    centres: np.ndarray
    present: np.ndarray

    def __len__(self):
        return len(self.feet)

    def of(self, rows):
        """Some of the platforms [rows]."""
        return Hung(*(getattr(self, name)[rows] for name in self.__annotations__))

    @property
    def turned(self):
        """Orientation at the pose [n x 3 x 3]: yaw after pitch after roll."""
        return Rotation.from_euler("xyz", self.angles).as_matrix()

    def text(self, number):
        """The machine file of one of them."""
        part = {name: getattr(self, name)[number].tolist() for name in self.__annotations__}
        home = np.array([0.0, 0.0, 1.2])
        pose = zip(("x", "y", "z", "roll", "pitch", "yaw"), part["place"] + part["angles"], strict=True)
        payload = (self.centres[number, 1] - self.offset[number]).tolist()
        head = (
            f'schema = 1\nname = "platform {number}"\nfamily = "legs"\n[platform]\npoint = {home.tolist()}\n[pose]\n'
            + "".join(f"{name} = {value}\n" for name, value in pose)
            + f"[tool]\noffset = {part['offset']}\nmass = {part['masses'][0]}\n"
            f"centre_of_mass = {part['centres'][0]}\npayload = {part['masses'][1]}\npayload_centre = {payload}\n"
            f"[load]\ngravity = [0, 0, {-GRAVITY}]\n"
        )
        cables = "".join(
            f'[[legs]]\nname = "c{i}"\ntype = "cable"\nfrom = {part["feet"][i]}\n'
            f"to = {(home + self.eyes[number, i]).tolist()}\n"
            f"stiffness = {part['stiffness'][i]}\npreload = {part['preload'][i]}\n"
            for i in np.flatnonzero(self.present[number])
        )
        return head + cables


def random_platforms(count, seed):
    """Platforms in a room, on six to nine cables: half of them with one preload for all cables."""
    rng = np.random.default_rng(seed)
    rows = [_random_platform(rng) for _ in range(count)]
    return Hung(*(np.array(column) for column in zip(*rows, strict=True)))


def _random_platform(rng):
    cables = int(rng.integers(FEWEST, MOST + 1))
    upper = int(rng.integers(max(4, cables - 4), min(6, cables) + 1))
    corners = np.array([[x, y] for x in (-1, 1) for y in (-1, 1)], dtype=float)
    order = np.concatenate([rng.permutation(4), rng.permutation(4)])
    chosen = np.concatenate([order[:upper], rng.permutation(4)[: cables - upper]])
    chosen = np.concatenate([chosen, np.zeros(MOST - cables, dtype=int)])
    high = (np.arange(MOST) < upper).astype(float)
    feet = np.column_stack([ROOM * corners[chosen], TOP * high]) + 0.1 * rng.normal(size=(MOST, 3))
    eyes = np.column_stack([[0.25, 0.2] * corners[chosen], 0.1 * (1.0 - 2.0 * high)]) + 0.08 * rng.normal(
        size=(MOST, 3)
    )
    present = np.arange(MOST) < cables
    stiffness = 10.0 ** rng.uniform(4.5, 6.0) * present
    equal = rng.uniform() < 0.5
    preload = (rng.uniform(20.0, 300.0) if equal else rng.uniform(0.0, 300.0, MOST)) * present
    place = np.array([0.0, 0.0, 1.2]) + rng.uniform(-1.0, 1.0, 3) * [0.5, 0.4, 0.3]
    angles = rng.uniform(-0.15, 0.15, 3)
    offset = 0.15 * rng.normal(size=3)
    masses = rng.uniform([2.0, 0.0], [30.0, 15.0])
    centres = 0.06 * rng.normal(size=(2, 3)) + [[0.0, 0.0, 0.0], offset]
    return feet, eyes, stiffness, preload, place, angles, offset, masses, centres, present


def spans(hung, place, turned):
    """From the feet to the eyes of all cables, and the eyes from P, in base axes [n x cables x 3]."""
    arms = np.einsum("nij,ncj->nci", turned, hung.eyes)
    return place[:, None] + arms - hung.feet, arms


def free_lengths(hung):
    """Of the cables when they carry nothing, m [n x cables]."""
    there, _ = spans(hung, hung.place, hung.turned)
    return np.linalg.norm(there, axis=2) - hung.preload / np.where(hung.present, hung.stiffness, 1.0)


def energy_and_gradient(hung, free, place, turned):
    """Energy, J [n], its gradient by turns about P (over LENGTH) and translations [n x 6], and the cables' screws."""
    span, arms = spans(hung, place, turned)
    length = np.linalg.norm(span, axis=2)
    longer = np.maximum(length - free, 0.0)
    along = span / length[:, :, None]
    (x, y, z), (a, b, c) = np.moveaxis(arms, 2, 0), np.moveaxis(along, 2, 0)
    screws = np.stack([(y * c - z * b) / LENGTH, (z * a - x * c) / LENGTH, (x * b - y * a) / LENGTH, a, b, c], axis=2)
    centres = np.einsum("nij,nmj->nmi", turned, hung.centres)
    heights = place[:, None, 2] + centres[:, :, 2]
    energy = (0.5 * hung.stiffness * longer**2).sum(axis=1) + GRAVITY * (hung.masses * heights).sum(axis=1)
    gradient = np.einsum("nc,nck->nk", hung.stiffness * longer, screws)
    gradient[:, 5] += GRAVITY * hung.masses.sum(axis=1)
    moment = np.einsum("nm,nmk->nk", hung.masses, centres)
    gradient[:, 0] += GRAVITY * moment[:, 1] / LENGTH
    gradient[:, 1] -= GRAVITY * moment[:, 0] / LENGTH
    return energy, gradient, screws


def step_by(place, turned, step):
    """The placement after a turn about P (over LENGTH) and a translation [n x 6]."""
    return place + step[:, 3:], Rotation.from_rotvec(step[:, :3] / LENGTH).as_matrix() @ turned


def rests_of(hung, most=STEPS):
    """Let dashpots beside all cables slow the platforms from their poses down to rest.

    Returns:
        Place and orientation of each, and the least eigenvalue of its stiffness, N/m, with turns over LENGTH; NaN where
        it is not at rest after so many steps.
    """
    place, turned, least = hung.place.copy(), hung.turned, np.full(len(hung), np.nan)
    rows = np.arange(len(hung))
    for start in range(0, most, EVERY):
        part, free = hung.of(rows), free_lengths(hung.of(rows))
        slowed = slowed_down(part, free, place[rows], turned[rows], min(EVERY, most - start))
        place[rows], turned[rows], least[rows] = settled_places(part, free, *slowed)
        rows = rows[np.isnan(least[rows])]
        if not len(rows):
            break
    return place, turned, least


def slowed_down(hung, free, place, turned, steps):
    """Places and orientations after some steps of the dashpots, each of them no longer than the energy falls."""
    pace, here = np.full(len(hung), 0.5), [place, turned, *energy_and_gradient(hung, free, place, turned)]
    for _ in range(steps):
        place, turned, energy, gradient, screws = here
        drag = np.swapaxes(screws, 1, 2) @ (hung.stiffness[:, :, None] * screws)
        drag = drag + DRAG * np.trace(drag, axis1=1, axis2=2)[:, None, None] * np.eye(6)
        step = -pace[:, None] * np.linalg.solve(drag, gradient[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 0.02 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        there = step_by(place, turned, step)
        there = [*there, *energy_and_gradient(hung, free, *there)]
        lower = there[2] <= energy
        pace = np.where(lower, np.minimum(1.1 * pace, 1.5), 0.5 * pace)
        here = [np.where(lower.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(there, here, strict=True)]
    return here[:2]


def stiffnesses(hung, free, place, turned, size=1e-6):
    """Second derivatives of the energy by differences of its gradient, with turns over LENGTH [n x 6 x 6], N/m."""
    columns = []
    for axis in size * np.eye(6):
        step = np.broadcast_to(axis, (len(hung), 6))
        ahead, behind = (energy_and_gradient(hung, free, *step_by(place, turned, s * step))[1] for s in (1, -1))
        columns.append((ahead - behind) / (2 * size))
    rates = np.stack(columns, axis=2)
    return 0.5 * (rates + np.swapaxes(rates, 1, 2))


def settled_places(hung, free, place, turned):
    """The last digits by Newton's method with differences, where these are nearly known; else the places given."""
    there = place, turned
    for _ in range(6):
        gradient = energy_and_gradient(hung, free, *there)[1]
        rates = stiffnesses(hung, free, *there)
        rates = rates + 1e-12 * np.trace(rates, axis1=1, axis2=2)[:, None, None] * np.eye(6)
        step = -np.linalg.solve(rates, gradient[:, :, None])[:, :, 0]
        size = np.abs(step).max(axis=1)
        there = step_by(*there, np.where((size < 1e-3)[:, None], step, 0.0))
    least = np.linalg.eigvalsh(stiffnesses(hung, free, *there))[:, 0]
    rests = (size < 1e-10) & (least > 0.0)
    place, turned = np.where(rests[:, None], there[0], place), np.where(rests[:, None, None], there[1], turned)
    return place, turned, np.where(rests, least, np.nan)


def platform_of(text):
    """The platform of a machine file whose legs are all cables."""
    document = tomllib.loads(text)
    home, pose, tool, legs = document["platform"]["point"], document["pose"], document["tool"], document["legs"]
    offset = np.array(tool["offset"])
    return Hung(
        np.array([[leg["from"] for leg in legs]]),
        np.array([[leg["to"] for leg in legs]]) - home,
        *(np.array([[leg[name] for leg in legs]]) for name in ("stiffness", "preload")),
        *(np.array([[pose[name] for name in names]]) for names in ("xyz", ("roll", "pitch", "yaw"))),
        offset[None],
        np.array([[tool["mass"], tool["payload"]]]),
        np.array([[tool["centre_of_mass"], offset + tool["payload_centre"]]]),
        np.ones((1, len(legs)), dtype=bool),
    )
