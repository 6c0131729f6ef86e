"""Studies as text: what is written is read back as the same study."""

import pytest

from kinetostat.spec.document import parse
from kinetostat.spec.study import read_study, study_toml
from kinetostat.studies.bundled import bundled_studies, study_of

ODD = """
schema = 1
name = 'quotes " and \\\\ backslash'
machine = "mine.toml"
[set]
"stiffness.actuator.0" = "2 N/um"
stiffness.passive_links = "rigid"
[[variables]]
paths = ["geometry.passive_links.0", "geometry.passive_links.1"]
ratios = [1, 2]
from = "1 cm"
to = 0.5
[[variables]]
path = "stiffness.actuator"
choices = [["1 N/m"], "2 N/m"]
[[objectives]]
quantity = "compliance_along"
direction = [0, 0.5, 1]
goal = "maximize"
[poses]
list = [{ x = "0 cm" }, { x = "2 cm", theta5 = -0.5 }]
required = 0.5
[robustness]
objective = "percentile 95"
"""


@pytest.mark.parametrize("name", bundled_studies())
def test_bundled_studies_are_read_back(name):
    study = study_of(name)
    assert read_study(parse(study_toml(study), name), name) == study


def test_whatever_a_study_may_say_is_read_back():
    study = read_study(parse(ODD, "odd"), "odd")
    assert read_study(parse(study_toml(study), "again"), "again") == study
