"""What the paper prints, digit for digit, and its known misprints. Nothing is computed here.

Source: `CITATION`.
"""

from dataclasses import dataclass

CITATION = (
    'D. Zhang and C. M. Gosselin, "Parallel kinematic machine design with kinetostatic model", Robotica 20(4), 429-438 '
    "(2002)"
)
MACHINE = "zhang-gosselin-4dof"
ACTUATOR = 1000.0
"""K_actuator, N/m, in every table."""


@dataclass(frozen=True)
class Row:
    """A row of Table III or IV: the six diagonal entries in the order rx ry rz x y z.

    Attributes:
        label: what the paper prints in the column K_passive.
        setting: the value of both stiffness.passive_links that belongs to the numbers.
        values: as printed.
    """

    label: str
    setting: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Erratum:
    """A misprint: what the row should say, and why we are sure."""

    corrected: str
    reason: str


TABLE_3 = (
    Row("1000", "1e3 N*m/rad", ("0.52371", "1.41939", "1.5e-3", "0.915208", "5.78e-4", "0.0111974")),
    Row("10^2 Ka", "1e5 N*m/rad", ("0.51707", "1.40514", "1.5e-5", "0.909087", "5.78e-6", "0.0111429")),
    Row("10^4 Ka", "1e7 N*m/rad", ("0.516404", "1.4046", "1.5e-7", "0.908726", "5.78e-8", "0.0111393")),
    Row("10^6 Ka", "1e10 N*m/rad", ("0.516397", "1.40459", "1.5e-10", "0.908722", "5.78e-11", "0.0111393")),
    Row("rigid", "rigid", ("0.516397", "1.40459", "0.0", "0.908722", "0.0", "0.0111393")),
)
"""Compliance, rad/(N·m) and m/N."""

TABLE_4 = (
    Row("1000", "1e3 N*m/rad", ("8.50551", "26.21", "743.98", "70.4587", "2223.51", "3628.32")),
    Row("10^4 Ka", "1e7 N*m/rad", ("8.50551", "26.21", "7.40741e6", "70.4587", "1.92e7", "3628.32")),
    Row("10^6 Ka", "1e9 N*m/rad", ("8.50551", "26.21", "7.40741e8", "70.4587", "1.92e9", "3628.32")),
    Row("10^7 Ka", "1e10 N*m/rad", ("8.50551", "26.21", "7.40741e9", "70.4587", "1.92e10", "3628.32")),
)
"""Stiffness, N·m/rad and N/m."""

ONE_DIGIT = "one digit is wrong: the other rows of the table approach the rigid row in proportion to 1/K_passive"
ERRATA = {
    ("Table III, row 1", "rx"): Erratum("0.58371", ONE_DIGIT),
    ("Table III, row 1", "ry"): Erratum("1.45939", ONE_DIGIT),
    ("Table III, row 1", "x"): Erratum("0.945208", ONE_DIGIT),
    ("Table III, row 1", "z"): Erratum("0.0114974", ONE_DIGIT),
    ("Table III, row 4", "K_passive / Ka"): Erratum(
        "1e7", "its two small numbers belong to 10^7 Ka: C_rz is 1.5 / K_passive in every row"
    ),
    ("Table IV, row 1", "y"): Erratum("2223.56", "eq. 37 of the paper itself gives 2223.56 here, one digit is wrong"),
}
"""By place and component."""

TYPOGRAPHY = (
    "Two equations are numbered 26; the one before the first of them, eq. 25, is the one the text refers to.",
    "Eq. 14 lists translation first, while every table and the twist of eq. 1 list rotation first.",
    "T_p and T_b in eq. 41 are T_a and T_b elsewhere.",
)
"""Slips that touch no number."""

EQUATIONS_33_38 = {
    "rx": ("33", {"Ka": "0.00850551"}),
    "ry": ("34", {"Ka": "0.0262118"}),
    "rz": ("35", {"Ka": "0.00324", "k52": "0.5926", "k54": "0.148"}),
    "x": ("36", {"Ka": "0.0704587"}),
    "y": ("37", {"Ka": "0.301", "k52": "0.961", "k54": "0.961"}),
    "z": ("38", {"Ka": "3.62832"}),
}
"""Equation number, and the coefficient of each stiffness in the diagonal of K."""

INITIAL = ("0.5164", "1.4", "1.5e-10", "0.91", "5.78e-11", "0.011")
INITIAL_SUM = "2.84085"
OPTIMISED = ("0.12", "0.57", "3.747e-3", "0.32", "5e-11", "3.345e-3")
OPTIMISED_SUM = "1.017897"
IMPROVEMENT = "2.8"
STIFF = "stiffness.passive_links=1e10 N*m/rad"
OPTIMISED_DESIGN = (
    'geometry.platform_radius="14 cm"',
    'geometry.base_radius="26 cm"',
    'geometry.passive_links=["70 cm", "55 cm"]',
    'pose.z="66 cm"',
    'geometry.base_angle="35 deg"',
    'geometry.platform_angle="55 deg"',
    STIFF,
)
"""Section 4.3: the design the paper's genetic algorithm found."""
