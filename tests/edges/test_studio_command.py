"""The command `studio`: what it asks for, what it says, what it refuses."""

import socket
import sys
from pathlib import Path

import pytest

from kinetostat.cli import main
from kinetostat.commands.common import BAD_INPUT, DONE
from kinetostat.spec.installation import extra_command


@pytest.fixture
def served(monkeypatch):
    """What would be served, instead of serving it."""
    import kinetostat.studio.serving as serving

    calls = []
    monkeypatch.setattr(serving, "serve", lambda *given: calls.append(given))
    return calls


def test_it_listens_to_this_computer_only(served, capsys):
    assert main(["studio"]) == DONE
    ((machine, name, host, port, browser, state),) = served
    assert (name, host, port, browser) == ("zhang-gosselin-4dof", "127.0.0.1", 8000, True)
    assert machine.family.name == "passive-leg-4dof"
    assert state.parts[-2:] == ("kinetostat", "studio")
    assert capsys.readouterr().err == ""


def test_another_host_is_explained(served, capsys):
    assert main(["studio", "hexapod", "--host", "0.0.0.0", "--port", "8010", "--no-browser", "--state", "here"]) == DONE
    assert served[0][2:] == ("0.0.0.0", 8010, False, Path("here"))
    told = capsys.readouterr().err
    assert "without password or encryption" in told


def test_a_changed_machine_is_no_longer_the_bundled_one(served):
    main(["studio", "hexapod", "--set", "pose.z=0.14"])
    machine, name, *_ = served[0]
    assert name == ""
    assert machine.tables["pose"].z == 0.14


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nonesuch"], "neither a file nor a bundled machine"),
        (["--port", "0"], "not a port"),
        (["--port", "http"], "not a port"),
        (["--port", "0080009999"], "not a port"),
    ],
)
def test_bad_input_is_one_paragraph(words, said, capsys):
    try:
        code = main(["studio", *words])
    except SystemExit as stop:
        code = stop.code
    assert code == BAD_INPUT
    assert said in capsys.readouterr().err


def test_a_port_in_use_is_bad_input(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["studio", "hexapod", "--no-browser", "--port", str(port)]) == BAD_INPUT
    assert f"port {port}" in capsys.readouterr().err


def test_without_the_extra_it_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "nicegui", None)
    assert main(["studio", "hexapod"]) == BAD_INPUT
    assert f"install it with `{extra_command('studio')}`" in capsys.readouterr().err


def test_a_state_folder_that_cannot_be_read_is_refused(served, tmp_path, monkeypatch, capsys):
    (tmp_path / "file").touch()
    (tmp_path / "good" / "runs").mkdir(parents=True)

    def state(folder):
        return main(["studio", "hexapod", "--no-browser", "--state", str(tmp_path / folder)]), capsys.readouterr().err

    code, message = state("file")
    assert (code, len(served)) == (BAD_INPUT, 0)
    assert "file" in message
    assert "choose another folder with --state" in message
    assert state("good")[0] == state("none yet")[0] == DONE
    listed = Path.iterdir

    def forbidden(path):
        if path.name == "runs":
            raise PermissionError(13, "Permission denied")
        return listed(path)

    monkeypatch.setattr(Path, "iterdir", forbidden)
    code, message = state("good")
    assert code == BAD_INPUT
    assert "runs" in message
    assert "cannot be read: Permission denied" in message
