"""Machine files: what is refused, and that each message names the field, the value, what is allowed and the fix."""

import pytest
from machine_files import GOOD, HUGE_NUMBER, NAME, refusal

from kinetostat.machine.loading import build, bundled, load
from kinetostat.machine.parameters import values
from kinetostat.spec import document
from kinetostat.spec.errors import choice, first_mistakes, shorten
from refusals import refused

LENGTH = ['e.g. "12 cm"', "bare number in m"]
LINKS = '["68 cm", "68 cm"]'

BAD_FILES = [
    (
        "unknown key",
        "base_radius =",
        "base_radios =",
        ["geometry.base_radios is not known", "did you mean base_radius"],
    ),
    ("unknown top key", "schema = 1", "shema = 1", ["shema is not known", "did you mean schema"]),
    ("unknown table", "[pose]", "[poses]", ["poses is not known", "did you mean pose", "[pose] is missing"]),
    ("far-off key", 'x = "0 cm"', 'banana = 1\nx = "0 cm"', ["pose.banana is not known", "x, z, theta5, theta6"]),
    ("missing key", 'base_radius = "22 cm"\n', "", ["geometry.base_radius is missing", "Rb", 'base_radius = "12 cm"']),
    ("missing table", GOOD[GOOD.index("[pose]") :], "", ["[pose] is missing", "kinetostat new"]),
    ("missing name", 'name = "test machine"\n', "", ["name is missing", 'name = "..."']),
    ("missing family", 'family = "passive-leg-4dof"\n', "", ["family is missing", "passive-leg-4dof"]),
    (
        "unknown family",
        "passive-leg-4dof",
        "passive-leg-4dfo",
        ['"passive-leg-4dfo"', 'did you mean "passive-leg-4dof"'],
    ),
    ("strange family", "passive-leg-4dof", "x", ['family is "x"', "known families: ", "passive-leg-4dof"]),
    ("family of another type", '"passive-leg-4dof"', "4", ["family is 4", "known families: "]),
    ("empty name", "test machine", "", ['name is ""', "1 to 80 characters"]),
    ("escape in a name", "test machine", "\\u001b[31m red", ["name is", "1 to 80 characters that can be printed"]),
    ("DEL in a name", "test machine", "a\\u007f", ["name is", "that can be printed"]),
    ("reversed name", "test machine", "a\\u202eb", ["name is", "that can be printed"]),
    ("endless name", "test machine", "x" * 500, ["1 to 80 characters", "…"]),
    ("number for a name", '"test machine"', "7", ["name is 7", 'name = "my machine"']),
    ("wrong schema", "schema = 1", "schema = 2", ["schema is 2", "schema = 1"]),
    ("text for a schema", "schema = 1", 'schema = "1"', ['schema is "1"', "schema = 1"]),
    ("wrong unit", '"22 cm"', '"12 kg"', ["geometry.base_radius", '"12 kg"', '"kg" is not a unit of length', *LENGTH]),
    ("unknown unit", '"22 cm"', '"22 cn"', ["geometry.base_radius", '"22 cn"', '"cn" is unknown', *LENGTH]),
    ("not a number", '"22 cm"', '"wide"', ["geometry.base_radius", '"wide"', "it must be a length", *LENGTH]),
    ("true", '"22 cm"', "true", ["geometry.base_radius", "it must be a length", *LENGTH]),
    ("a date", '"22 cm"', "2002-01-01", ["geometry.base_radius", "it must be a length", *LENGTH]),
    ("a table", '"22 cm"', "{a = 1}", ["geometry.base_radius", "it must be a length", *LENGTH]),
    ("a list", '"22 cm"', "[0.22]", ["geometry.base_radius", "[0.22]", "it must be a length", *LENGTH]),
    ("NaN", '"22 cm"', "nan", ["geometry.base_radius is nan", "not a finite number", *LENGTH]),
    ("infinity", '"22 cm"', "inf", ["geometry.base_radius is inf", "not a finite number", *LENGTH]),
    ("infinite stiffness", '"1000 N/m"', "inf", ["stiffness.actuator is inf", "not a finite number", '"rigid"']),
    ("beyond float64", '"22 cm"', "1" + "0" * 400, ["geometry.base_radius", "too large", *LENGTH]),
    ("endless integer", '"22 cm"', HUGE_NUMBER, ["test.toml"]),
    ("endless hexadecimal", '"22 cm"', f"0x{'f' * 5000}", ["geometry.base_radius", *LENGTH]),
    ("zero length", '"22 cm"', '"0 cm"', ['geometry.base_radius is "0 cm"', "greater than 0", 'e.g. "12 cm"']),
    ("negative length", '"22 cm"', "-0.22", ["geometry.base_radius is -0.22", "greater than 0"]),
    ("zero link", LINKS, '["68 cm", 0]', ["geometry.passive_links", "entry 1", "0: it must be greater than 0"]),
    ("huge length", '"22 cm"', '"1e6 km"', ["geometry.base_radius", "must not exceed 1e+06 m"]),
    ("huge angle", '"30 deg"', "1e9", ["geometry.base_angle", "must not exceed 1000 rad"]),
    ("huge stiffness", '"1000 N/m"', "1e30", ["stiffness.actuator", "must not exceed 1e+20 N/m", 'write "rigid"']),
    (
        "negative stiffness",
        '"1000 N/m"',
        '"-5 N/m"',
        ["stiffness.actuator", '"-5 N/m"', "negative", '"rigid"', "write 0"],
    ),
    ("one negative stiffness", '"1000 N/m"', "[1, 2, 3, -4]", ["stiffness.actuator", "entry 3: -4", "negative"]),
    ("rigid length", '"22 cm"', '"rigid"', ["geometry.base_radius", '"rigid"', "it must be a length", *LENGTH]),
    ("too many entries", LINKS, "[1, 1, 1]", ["geometry.passive_links is [1, 1, 1]", "it has 3 entries; give 2"]),
    (
        "too few entries",
        '"1000 N/m"',
        "[1, 1, 1]",
        ["stiffness.actuator", "it has 3 entries; give 4", "one value for all"],
    ),
    ("no entries", '"1000 N/m"', "[]", ["stiffness.actuator is []", "it has 0 entries; give 4"]),
    ("a wrong entry", '"1000 N/m"', '[1, "2 N", 3, 4]', ["stiffness.actuator", 'entry 1: "2 N"', 'e.g. "20 N/um"']),
    (
        "angle in percent",
        '"-60 deg"',
        '"30 percent"',
        ["pose.theta5", '"percent" is not a unit of angle', 'e.g. "30 deg"'],
    ),
    ("scaled unit", '"22 cm"', '"66 cm/3"', ["geometry.base_radius", '"66 cm/3"', *LENGTH]),
    ("no quotes", '"22 cm"', "22 cm", ["not valid TOML", "line 5", "need quotes"]),
    ("no quotes on text", '"22 cm"', "wide", ["not valid TOML", "line 5", "need quotes"]),
    ("open bracket", LINKS, '["68 cm"', ["not valid TOML"]),
    ("key twice", 'z = "68 cm"', 'x = "1 cm"', ["not valid TOML", "line 15"]),
    ("not a table", "[geometry]", "geometry = 3\n[g]", ["geometry is 3", "must be a table, written as [geometry]"]),
    ("list of tables", "[pose]", "[[pose]]", ["pose is [", "must be a table, written as [pose]"]),
    ("deep list", '"22 cm"', "[" * 5000 + "]" * 5000, ["nested too deeply"]),
    ("list in list", '"22 cm"', "[[[0.22]]]", ["geometry.base_radius is [[[0.22]]]", *LENGTH]),
    ("deep table", '"22 cm"', '"22 cm"\n' + "a." * 500_000 + "b = 1", ["nested too deeply", "8 parts"]),
    ("deep quoted table", '"22 cm"', '"22 cm"\n' + '"a".' * 200_000 + "b = 1", ["nested too deeply"]),
    ("deep table header", "[pose]", f"[{'a . ' * 200_000}b]\n[pose]", ["nested too deeply"]),
    ("many keys", "[pose]", "".join(f"a{i}=1\n" for i in range(90_000)), ["more than 30,000 keys and values"]),
    ("dots in texts", '"22 cm"', f'"22 cm" # {"a." * 1000}\n"{"b." * 1000}" = 1', ["b…", "is not known"]),
    ("null character", "test machine", "a\0b", ["not valid TOML"]),
    ("no text at all", GOOD, "", ["family is missing"]),
]


TOGETHER = {
    "delta": "geometry.leg_angles",
    "hexapod": "geometry.platform_angles",
    "passive-leg-5dof": "geometry.base_angles",
    "tricept": "geometry.base_angles",
    "tripteron": "legs.x.slide.axis",
}


@pytest.mark.parametrize(("name", "field"), TOGETHER.items())
def test_one_number_is_no_direction_and_no_place_of_all_legs(name, field):
    assert "must be a list of " in refusal(name, f"{field}=0.3")


def test_one_turn_may_stand_for_all_cranks():
    assert set(load("hexapod-rus", ["geometry.crank_turn=0.1"]).tables["geometry"].crank_turn) == {0.1}


def test_the_advice_for_missing_angles_is_a_list_and_a_file_that_works(written):
    text = "\n".join(line for line in bundled()["hexapod"].splitlines() if not line.startswith("base_angles"))
    message = refusal(written(text))
    for word in ("base_angles is missing", "a list of 6", "`kinetostat new hexapod` prints a complete file"):
        assert word in message


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "test.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.mark.parametrize(("old", "new", "words"), [row[1:] for row in BAD_FILES], ids=[row[0] for row in BAD_FILES])
def test_a_bad_file_is_refused_with_the_way_out(written, old, new, words):
    assert old in GOOD
    message = refusal(written(GOOD.replace(old, new, 1)))
    assert "test.toml" in message
    for word in words:
        assert word in message


def test_all_mistakes_are_told_at_once_up_to_five(written):
    bad = GOOD.replace(" cm", " kg").replace(" deg", " N")
    message = refusal(written(bad))
    assert message.count("is not a unit of") == 5
    assert "(and 4 more)" in message


def test_all_mistakes_are_counted_also_where_the_first_hundred_are_alike():
    told = first_mistakes(["same"] * 100 + ["another"] * 3, lambda mistake: f"{mistake}.")
    assert told == "same. (and 3 more)"


SNEAKY = ['"\\u001b[31m red"', '"two\\nlines"', '"\\u202e reversed"', '"\\u0007"']
"""TOML text that would paint, reorder or ring a terminal, or break a paragraph."""


@pytest.mark.parametrize("text", SNEAKY)
@pytest.mark.parametrize("place", ['"22 cm"', '"passive-leg-4dof"', "base_radius"])
def test_messages_show_only_printable_text(written, place, text):
    """As a value, a family, a key and a table; `refusal` looks at the message."""
    assert place in GOOD
    assert refusal(written(GOOD.replace(place, text, 1)))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (GOOD.encode() + b"#" * (1 << 20), ["larger than 1 MiB", "short TOML text"]),
        (b"\x7fELF\x02\x01\x01" + bytes(range(256)) * 4, ["not text", "UTF-8"]),
        (GOOD.encode("utf-16"), ["not text", "UTF-8"]),
    ],
    ids=["huge", "binary", "UTF-16"],
)
def test_a_file_that_is_no_text_is_refused(written, content, words):
    message = refusal(written(content))
    assert all(word in message for word in words)


def test_a_file_of_a_windows_editor_is_read(written):
    """It begins with a mark of the byte order, and its lines end in two characters."""
    windows = b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()
    assert values(load(written(windows))) == values(load(written(GOOD)))


def test_a_folder_is_refused(tmp_path):
    assert "is a folder; give the machine file in it" in refusal(tmp_path)


def test_a_device_without_end_is_refused():
    assert "larger than 1 MiB" in refusal("/dev/zero")


@pytest.mark.parametrize("name", ["zhang-goselin-4dof", "zhang-gosselin-4dof.toml"])
def test_a_near_name_is_suggested(name):
    assert f'did you mean "{NAME}"?' in refusal(name)


@pytest.mark.parametrize(
    "name", ["qqq", "/nowhere/machine.toml", "a\0b", "a\nb", "x" * 300, "x" * 5000, "/" + "x/" * 3000]
)
def test_an_unknown_name_lists_what_there_is(name):
    message = refusal(name)
    assert "neither a file nor a bundled machine" in message
    assert NAME in message


def test_an_empty_name_is_refused():
    assert refusal("")


def test_the_name_of_a_file_of_ours_is_no_way_out_of_its_folder():
    assert "neither a file nor a bundled machine" in refusal(f"../bundled/{NAME}")


@pytest.mark.parametrize("name", bundled())
def test_every_bundled_machine_loads(name):
    assert load(name).name


def test_a_document_is_not_changed_by_overrides():
    data = document.parse(GOOD, "x")
    build(data, "x", ["geometry.base_radius=1", "stiffness.actuator.1=7"])
    assert data == document.parse(GOOD, "x")


def test_values_in_messages_are_short():
    assert shorten("x" * 100) == f'"{"x" * 58}…'
    assert shorten("12 cm") == '"12 cm"'
    assert shorten(3) == "3"
    assert len(shorten(list(range(1000)))) == 60


def test_names_that_end_in_thousands_of_digits_are_listed():
    """Python converts no number of so many digits, and to list known names it is asked for the next one."""
    with refused("choose from a1"):
        choice("q", ["a" + "1" * 5000, "b"], "the name")
