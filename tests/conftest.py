"""Hypothesis profiles for the whole suite.

The default profile draws the same examples on every run, so that a failure is never a matter of luck, and reports the
first one it meets; run `pytest --hypothesis-profile=explore` to look for new counter-examples and the least of them.
"""

from hypothesis import HealthCheck, Phase, settings

QUIET = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
"""Poses are filtered by singularity margin and each costs a statics solve; neither is a fault of a test."""

settings.register_profile(
    "steady",
    max_examples=8,
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=QUIET,
)
settings.register_profile("explore", max_examples=1000, deadline=None, suppress_health_check=QUIET)
settings.load_profile("steady")


def pytest_addoption(parser):
    """`--rewrite-pages` corrects the answers that the documentation quotes, instead of refusing wrong ones."""
    parser.addoption(
        "--rewrite-pages", action="store_true", help="bring quoted answers of the documentation up to date"
    )
