"""CITATION.cff: what the Citation File Format 1.2.0 requires, and what the project is."""

import tomllib

import yaml

from pages import ROOT

CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
KNOWN = {"abstract", "authors", "cff-version", "keywords", "license", "message", "references", "title"} | {
    "type",
    "version",
}
REFERENCE = {"type", "title", "authors", "year", "journal", "volume", "issue", "start", "end", "doi"}
PERSON, ENTITY = {"family-names", "given-names"}, {"name"}


def test_required_fields_are_there_and_no_other_than_the_format_has():
    assert {"authors", "cff-version", "message", "title"} <= CITATION.keys() <= KNOWN
    assert {"type", "title", "authors"} <= CITATION["references"][0].keys() <= REFERENCE
    assert all(isinstance(CITATION[name], str) for name in ("cff-version", "message", "title", "version", "license"))
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION["type"] in ("software", "dataset")


def test_authors_are_persons_or_entities():
    for work in (CITATION, CITATION["references"][0]):
        assert work["authors"]
        assert all(set(author) in (PERSON, ENTITY) for author in work["authors"])


def test_it_is_about_this_project_and_its_paper():
    assert (CITATION["version"], CITATION["license"]) == (PROJECT["version"], PROJECT["license"])
    paper = CITATION["references"][0]
    assert (paper["title"], paper["year"]) == ("Parallel kinematic machine design with kinetostatic model", 2002)
    assert [author["family-names"] for author in paper["authors"]] == ["Zhang", "Gosselin"]
