"""Options that several questions take: quantities, and ranges of coordinates."""

from kinetostat.views.question import Option

QUANTITIES = (
    "compliance, stiffness or free_stiffness (all entries of the diagonal; the free stiffness is 1/C_ii, which a tool "
    "feels; default: {default}); a single entry such as compliance_rx, stiffness_x_z, free_stiffness_z; "
    "least_translational_stiffness, greatest_translational_stiffness, least_rotational_stiffness, "
    "greatest_rotational_stiffness, frobenius_condition (of K), singularity_margin (0: singular, 1: best), "
    "aspect (1 or -1; the sign changes at singularities), shortest_leg, longest_leg, actuator_force, "
    "actuator_moment (the greatest under [load]), mass (of all moving parts), frequency (the six lowest natural "
    "frequencies) or frequency_1, least_wrench_force, least_wrench_moment, least_twist_speed, least_twist_rate, "
    "least_acceleration, least_angular_acceleration, greatest_wrench, greatest_twist, greatest_acceleration (loads, "
    "speeds and accelerations that the drives allow in all directions, and along each component), "
    "reversal_error, least_real_receptance and stable_width (across [cutting]); tension, least_tension, "
    "greatest_tension, tension_reserve, capacity and wrench_closure (of cables); of the machine at rest under its "
    "loads: "
    'displacement (the default where [load] says state = "loaded"), tangent_stiffness, tangent_free_stiffness, '
    "load_factor, slack_springs, loaded_frequency; repeatable"
)
"""Help on the quantities of sweeps, maps and sensitivities."""
DISPLACED = "the machine at rest under its loads: its displacement, if no quantity is named"
"""Help on `--loaded` of questions about quantities."""
LAW_TOLERANCE = Option(
    "tolerance",
    "quantity",
    'error at the tool that the law of the corrections may have, e.g. "0.1 um" (default: a thousandth of the error '
    "without corrections)",
    metavar="LENGTH",
)
VARIED = "FIELD=from:to:count[:log]"


def quantities_option(default: str) -> Option:
    """Return the option `--quantity`, with the quantity that counts where none is named."""
    meaning = QUANTITIES.format(default=default)
    return Option("quantities", "text", meaning, metavar="NAME", many=True, word="--quantity")


def ranges_option(
    meaning: str, required: bool = False, metavar: str = "FIELD=from:to:count", word: str = "--over"
) -> Option:
    """Return the option `--over`: fields and their ranges."""
    return Option("ranges", "text", meaning, metavar=metavar, many=True, required=required, word=word)
