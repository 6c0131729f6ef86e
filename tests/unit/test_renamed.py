"""Words of earlier versions: they work, they warn, and the warning names the new word."""

import warnings

import pytest

from kinetostat.spec.renamed import RENAMED, current_name, renamed_property, with_former_keys


def test_an_old_word_warns_and_is_translated():
    with pytest.warns(DeprecationWarning, match='The quantity "regularity" is now called "singularity_margin"'):
        assert current_name("regularity", "quantity") == "singularity_margin"


def test_a_present_word_does_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert current_name("singularity_margin", "quantity") == "singularity_margin"
        assert current_name("nonsense", "quantity") == "nonsense"


def test_no_present_word_is_an_old_one_of_its_kind():
    for table in RENAMED.values():
        assert not table.keys() & set(table.values())


class Pose:
    def __init__(self):
        self.margin = 0.5

    regularity = renamed_property("margin")


def test_an_old_attribute_warns_where_it_is_used():
    with pytest.warns(DeprecationWarning, match=r"Pose\.regularity is now called Pose\.margin") as caught:
        assert Pose().regularity == 0.5
    assert caught[0].filename == __file__


def test_old_keys_stand_beside_new_ones_and_are_listed():
    table = {"order": "components", "shares": "attribution"}
    data = {"components": ["x"], "legs": [{"attribution": {"x": 1.0}}, 2], "name": "a"}
    assert with_former_keys(data, table) == {
        "components": ["x"],
        "order": ["x"],
        "legs": [{"attribution": {"x": 1.0}, "shares": {"x": 1.0}}, 2],
        "name": "a",
        "deprecated_keys": {"order": "components", "shares": "attribution"},
    }
    assert "order" not in data


def test_data_without_renamed_keys_stays_as_it_is():
    assert with_former_keys({"name": "a"}, {"order": "components"}) == {"name": "a"}
