"""What is wrong in an experiment is told before anything is run: file, line, key, and what was probably meant."""

from pathlib import Path

import pytest

from contourslam.errors import ConfigError
from contourslam.experiments.sweep.experiment import read_experiment

ROOM = '[simulation]\nrooms = ["furnished_room"]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[simulation]\nbeems = 5\n", "line 3: simulation.beems: is unknown; did you mean beams?"),
        ('[simulation]\nrooms = ["kitchen"]\n', "line 3: simulation.rooms: there is no room 'kitchen'"),
        ('detectors = ["wuu"]\n' + ROOM, "line 2: detectors: there is no detector 'wuu'; did you mean wu?"),
        (ROOM + "noise = -0.1\n", "line 4: simulation.noise: must be a number of metres from 0 on"),
        (ROOM + "beams = 180.5\n", "line 4: simulation.beams: must be a whole number"),
        (ROOM + "noise = true\n", "line 4: simulation.noise: must be a number"),
        (ROOM + "noise = [nan]\n", "line 4: simulation.noise: must be a number"),
        (ROOM + "seeds = 0\n", "line 4: simulation.seeds: must be how many"),
        (ROOM + "seeds = []\n", "line 4: simulation.seeds: is empty"),
        (ROOM + "seeds = 100000000\n", "line 4: simulation.seeds: are more than 1000000 runs, got 100000000"),
        (
            'detectors = "wu"\n' + ROOM + "seeds = 1000000\nnoise = [0.0, 0.1]\n",
            "makes 2000000 runs, more than 1000000",
        ),
        (ROOM + "speed = []\n", "line 4: simulation.speed: is empty"),
        (
            ROOM + "[settings.a]\nslam.wals = true\n",
            "line 5: settings.a: unknown setting slam.wals; did you mean slam.walls?",
        ),
        (ROOM + "[settings.a]\nslam.walls = 1\n", "line 5: settings.a: slam.walls must be true or false"),
        (ROOM + "[settings.a.slam]\ngate_probability = 2.0\n", "gate_probability must lie between 0 and 1"),
        (ROOM + '[settings.a]\ndetector = "wu"\n', "line 5: settings.a.detector: detectors have a list of their own"),
        (ROOM + '[[sweep]]\nsettings = "b"\n', "line 5: sweep.settings: there is no setting 'b'"),
        (ROOM + "[[sweep]]\nduraton = 1\n", "line 5: sweep.duraton: is unknown; did you mean duration?"),
        (ROOM + "[sweep]\nseeds = 1\n", "sweep: must be written as [[sweep]]"),
        ("[recordings]\npaths = [1]\n", "line 3: recordings.paths: must hold texts"),
        ('[recordings]\npaths = "a.log"\n[recordings.relations]\n"b.log" = "r"\n', "b.log: is not among the paths"),
        ("", "there is nothing to run on"),
        ("[simulation\n", "is not TOML (Expected ']' at the end of a table declaration (at line 2, column 12))"),
        ("simulation = 3\n", "line 2: simulation: must be a table"),
        ("[own_detectors]\na = 3\n", "line 3: own_detectors.a: must be FILE.py:FACTORY"),
    ],
)
def test_what_is_wrong_is_told_with_its_line_and_what_was_meant(written, text, said):
    with pytest.raises(ConfigError) as error:
        written(text)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert "experiment.toml" in str(error.value)


@pytest.mark.parametrize("name", ["name = 3\n", 'name = "a/b"\n'])
def test_an_experiment_needs_a_name_that_is_one(tmp_path, name):
    path = tmp_path / "experiment.toml"
    path.write_text(name + ROOM)
    with pytest.raises(ConfigError, match="name: must be a name of letters"):
        read_experiment(path)


def test_an_empty_file_is_told_that_its_name_is_missing(tmp_path):
    path = tmp_path / "experiment.toml"
    path.write_text("")
    with pytest.raises(ConfigError, match="name: is missing; give the experiment one"):
        read_experiment(path)


def test_a_file_that_is_not_there_is_told_with_the_one_that_is_meant(tmp_path):
    (tmp_path / "experiment.toml").write_text("")
    with pytest.raises(ConfigError, match=r"did you mean .*experiment\.toml"):
        read_experiment(tmp_path / "experimant.toml")
    (tmp_path / "latin").write_bytes(b'name = "\xe9"\n')
    with pytest.raises(ConfigError, match="is not UTF-8"):
        read_experiment(tmp_path / "latin")


def test_a_grid_takes_from_the_file_what_it_does_not_say(written):
    experiment = written(
        'detectors = "wu"\n' + ROOM + "seeds = 3\nnoise = 0.02\n[[sweep]]\nseeds = [7, 7]\n[[sweep]]\n"
    )
    first, second = experiment.grids
    assert (first.seeds, second.seeds) == ((7,), (0, 1, 2))
    assert first.detectors == second.detectors == ("wu",)
    assert first.noise == second.noise == (0.02,)


def test_the_examples_are_experiments():
    examples = Path(__file__).parents[3] / "examples"
    names = {path.name: read_experiment(path).name for path in examples.glob("*.toml")}
    assert {"sweep.toml": "small", "table_one.toml": "table_one"}.items() <= names.items()
