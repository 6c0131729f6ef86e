"""The paper, reproduced: verdicts are earned, files are complete, the page stands alone."""

import csv
import json
import re
from collections import Counter

import pytest
from report_pages import no_drawing

from kinetostat.cli import main
from kinetostat.commands.common import DONE, NO_ANSWER
from kinetostat.studies import printed_numbers
from kinetostat.studies.printed_numbers import PrintVerdict, compare, rounds_to
from kinetostat.studies.reproduction import Finding, reproduce


@pytest.fixture(scope="module")
def found():
    return reproduce()


def test_nothing_differs_unexplained(found):
    assert found.explained
    assert Counter(one.verdict for one in found.comparisons) == {PrintVerdict.EQUAL: 82, PrintVerdict.MISPRINT: 6}
    assert all(check.holds for check in found.checks)
    assert Counter(claim.finding for claim in found.claims) == {Finding.HOLDS: 4, Finding.PARTLY: 6}


def test_every_erratum_is_met_once(found):
    met = [(one.place, one.component) for one in found.comparisons if one.verdict is PrintVerdict.MISPRINT]
    assert sorted(met) == sorted(printed_numbers.ERRATA)


def test_every_claim_that_holds_in_part_says_for_what_and_for_what_not(found):
    assert len({claim.place for claim in found.claims}) == 10
    for claim in found.claims:
        if claim.finding is Finding.PARTLY:
            assert re.match(r"Holds for .+; fails (for|with) .+\d", claim.limits)


def test_verdicts_name_the_directions_that_contradict_a_claim_and_thresholds_of_ours(found):
    limits = {claim.place: claim.limits for claim in found.claims}
    assert all(f"K_{name} (" in limits["Further fact (i)"] for name in ("rx", "ry", "z"))
    assert "86.5%" in limits["Guideline (vi)"]
    assert all("our threshold" in limits[f"Guideline ({place})"] for place in ("i", "vi"))


def test_the_papers_optimisation_holds(found):
    assert [claim.finding for claim in found.search_claims] == [Finding.HOLDS, Finding.HOLDS]
    assert "1.0178894" in found.search_claims[0].measured
    assert "geometry.passive_links.0" in found.search_claims[0].limits, "links on a ridge"


@pytest.mark.parametrize(
    ("computed", "text", "equal"),
    [
        (26.2118, "26.21", True),
        (26.216, "26.21", False),
        (1.9223676e7, "1.92e7", True),
        (1.95e7, "1.92e7", False),
        (7407410.648, "7.40741e6", True),
        (0.0, "0.0", True),
        (1e-3, "0.0", True),
        (2223.56, "2223.51", False),
    ],
)
def test_a_number_equals_print_by_its_printed_digits(computed, text, equal):
    assert rounds_to(computed, text) is equal


def test_a_misprint_is_excused_only_if_the_correction_is_reached():
    assert compare("Table IV, row 1", "y", "2223.51", 2223.5602, "N/m").verdict is PrintVerdict.MISPRINT
    assert compare("Table IV, row 1", "y", "2223.51", 2223.4, "N/m").verdict is PrintVerdict.DIFFERS
    assert compare("Table IV, row 2", "y", "2223.51", 2223.5602, "N/m").verdict is PrintVerdict.DIFFERS


@pytest.mark.reports
def test_the_command_writes_tables_figures_and_one_page_that_stands_alone(tmp_path, capsys):
    folder = tmp_path / "reproduce"
    assert main(["reproduce", "-o", str(folder)]) == DONE
    printed_text = capsys.readouterr().out
    assert "82 equal to print, 6 known misprints, 0 differ" in " ".join(printed_text.split())
    assert printed_text.endswith("next:\n  kinetostat analyze tripteron\n  kinetostat studio\n")
    names = {path.name for path in folder.iterdir()}
    assert {"index.html", "reproduction.json", "numbers.csv", "equations.csv", "statements.csv"} <= names
    assert {
        f"{figure}.{kind}" for figure in ("machine", "figure-4", "figure-5", "figure-6") for kind in ("png",)
    } <= names
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 4
    assert "<script" not in page
    assert page.count('<th>statement</th><th class="n">residual</th><th class="n">tolerance</th>') == 1, "numbers align"
    assert not re.search(r'(src|href)="(?!#)', page)
    rows = list(csv.DictReader((folder / "numbers.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 88
    assert json.loads((folder / "reproduction.json").read_text(encoding="utf-8"))["explained"] is True


@pytest.mark.reports
def test_a_wrong_model_is_found_out(monkeypatch, tmp_path, capsys):
    wrong = (
        printed_numbers.TABLE_4[0].__class__("1", "1001 N*m/rad", printed_numbers.TABLE_4[0].values),
        *printed_numbers.TABLE_4[1:],
    )
    monkeypatch.setattr(printed_numbers, "TABLE_4", wrong)
    no_drawing(monkeypatch)
    assert main(["reproduce", "-o", str(tmp_path), "--json"]) == NO_ANSWER
    found = json.loads(capsys.readouterr().out)
    assert found["explained"] is False
    differing = [one for one in found["comparisons"] if one["verdict"] == "differs"]
    assert [one["component"] for one in differing] == ["rz", "y"]
