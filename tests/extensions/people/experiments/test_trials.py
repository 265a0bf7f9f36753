"""Trial tables: what other programs write is read, and each mistake is answered in one line with row and column."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from helpers.refusals import refuse

from affordance.arguments import Whole
from affordance.extensions.people.experiments import trial_cells, trials
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.experiments.trials import check_cost, check_trials, read_trials
from affordance.objects.materials import load_materials
from affordance.objects.tool import Grip, Tool

MATERIALS = load_materials()
SMALL = cylinder("small", radius=0.04, height=0.06, mass=0.3)
LARGE = cylinder("large", radius=0.04, height=0.12, mass=0.6)
STICK = Tool("stick", LARGE.components, (Grip("head", np.eye(4)), Grip("foot", np.eye(4))))
TOOLS = (SMALL, LARGE, STICK)
GOOD = """participant,group,phase,object,do,mass,duration,teaches
P1,A,learn,small,lift,0.2,,
P1,A,test,large,look,,,no
P2,B,learn,small,hold,0.4,2.5,yes
"""


@pytest.fixture
def read(tmp_path):
    """Reads a text as the table of a file."""

    def read(text, **options):
        path = tmp_path / "trials.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_trials(path, TOOLS, MATERIALS, tasks=("reach", "hammer"), **options)

    return read


def test_cells_are_read_in_the_order_of_the_rows(read):
    table = read(GOOD)
    assert table.rows["object"].tolist() == ["small", "large", "small"]
    assert table.rows["do"].tolist() == ["lift", "look", "hold"]
    assert table.rows["duration"].tolist()[2] == 2.5
    assert table.rows["teaches"].tolist() == [True, False, True]
    assert table.participants == ["P1", "P2"]
    assert table.numbers == (2, 3, 4)


def test_what_is_left_out_is_a_lift_of_the_object_as_it_is(read):
    table = read("object\nsmall\nlarge\nsmall\n")
    row = table.rows.iloc[2]
    assert (row["participant"], row["group"], row["phase"], row["do"]) == ("1", "all", "all", "lift")
    assert (row["teaches"], row["measured"], row["cycle"], row["place"]) == (True, True, 2, 0)
    assert table.tools[row["tool"]].mass == SMALL.mass
    assert table.unused == ()


@pytest.mark.parametrize(
    "text",
    [
        GOOD.replace(",", ";").replace("0.2", "0,2").replace("0.4", "0,4").replace("2.5", "2,5"),
        GOOD.replace(",", "\t").replace("0.2", "0,2"),
        "\ufeff" + GOOD,
        "sep=,\n" + GOOD,
        GOOD.replace("\n", "\r\n") + ",,,,,,,\r\n\r\n",
        GOOD.replace("participant", "Participant").replace("mass", " MASS ").replace("small", "Small", 1),
        GOOD.replace(",,\n", ",n/a,n/a\n"),
        GOOD.replace(",no\n", ",FALSCH\n").replace(",yes\n", ",WAHR\n"),
    ],
    ids=["semicolons", "tabs", "mark", "sep", "lines of Windows", "capitals", "BIDS", "German"],
)
def test_other_programs_write_the_same_table_in_their_ways(read, text):
    found, expected = read(text), read(GOOD)
    pd.testing.assert_frame_equal(found.rows, expected.rows)
    assert [tool.mass for tool in found.tools] == [tool.mass for tool in expected.tools]


def test_row_of_a_message_is_that_of_the_file(read):
    said = refuse(read, "sep=;\nobject;mass\nsmall;0,2\n\nsmall;heavy\n")
    assert "row 5, mass: is 'heavy', must be a number of kg" in said


def test_columns_with_names_of_other_programs_are_named(read):
    text = GOOD.replace("object", "stim").replace("participant", "subj").replace("mass", "kg")
    table = read(text, columns={"object": "stim", "participant": "subj", "mass": "kg"})
    pd.testing.assert_frame_equal(table.rows, read(GOOD).rows)
    said = refuse(read, text.replace("0.4", "heavy"), columns={"object": "stim", "participant": "subj", "mass": "kg"})
    assert "row 4, kg: is 'heavy'" in said
    assert "--columns object: is 'stem', must be one of" in refuse(read, text, columns={"object": "stem"})
    assert "--columns: is 'weight', must be one of" in refuse(read, text, columns={"weight": "kg"})


def test_further_columns_are_carried_along_unless_results_need_their_names(read):
    table = read('object,session,html,force_plate,weight\nsmall,s1,"<p>\nx",1,2\nlarge,s2,y,3,4\n')
    assert table.rows["session"].tolist() == ["s1", "s2"]
    assert table.rows["force_plate"].tolist() == ["1", "3"]
    assert table.rows["html"].tolist() == ["<p>\nx", "y"]
    assert table.unused == ("weight",)


def test_block_is_a_phase_where_there_is_none(read):
    assert read("object,block\nsmall,learn\n").rows["phase"].tolist() == ["learn"]
    assert read("object,block,phase\nsmall,learn,test\n").rows["phase"].tolist() == ["test"]


def test_mass_scales_all_densities_and_look_is_shown(read):
    table = read("object,mass,looks_like\nsmall,0.45,brass\nlarge,,#112233\nlarge,1.2,\n")
    heavy, dark, large = (table.tools[number] for number in table.rows["tool"])
    assert heavy.mass == pytest.approx(0.45, rel=1e-12)
    assert heavy.components[0].material.density == pytest.approx(1.5 * SMALL.components[0].material.density)
    assert heavy.components[0].looks_like == MATERIALS["brass"]
    assert dark.mass == LARGE.mass
    assert dark.components[0].looks_like.colour == pytest.approx((0x11 / 255, 0x22 / 255, 0x33 / 255))
    assert (large.mass, large.components[0].looks_like) == (pytest.approx(1.2), LARGE.components[0].looks_like)


MISTAKES = [
    ("object,mass\nsmall,450\n", "row 2, mass: is 450, must be from 0.001 to 100 kg; 0.45 if g were meant"),
    ("object,mass\nsmall,450 g\n", "row 2, mass: is '450 g', must be a number of kg"),
    ("object,mass\nsmall,0.45 kg\n", "row 2, mass: is '0.45 kg', must be a number of kg"),
    ('object,mass\nsmall,"0,45"\n', "row 2, mass: is '0,45', must be a number of kg"),
    ("object;mass\nsmall;1.200,5\n", "row 2, mass: is '1.200,5', must be a number of kg"),
    ("object,mass\nsmall,nan\n", "row 2, mass: is 'nan', must be a number of kg"),
    ("object,mass\nsmall,0.0002\n", "row 2, mass: is 0.0002, must be from 0.001 to 100 kg; the nearest is 0.001"),
    (
        "object,mass\nsmall,90\n",
        "row 2, mass: is 90, must be from 3.01593e-05 to 7.53982 kg for small to have a density",
    ),
    ("object,mass\nsmall,90\n", "from 0.1 to 25000 kg/m^3; 0.09 if g were meant"),
    ("object,mass\nsmall,0.2\nsmal,0.2\n", "row 3, object: is 'smal', must be one of small, large, stick; did you"),
    ("object,mass\n,0.2\n", "row 2, object: is '', must be one of small, large, stick"),
    (
        "object,do\nsmall,lfit\n",
        "row 2, do: is 'lfit', must be one of lift, hold, look, choose; did you mean 'lift'?",
    ),
    ("object,do,duration\nsmall,hold,2500\n", "row 2, duration: is 2500, must be from 0.1 to 60 s; 2.5 if ms were"),
    ("object,do,duration\nsmall,lift,2\n", "row 2, duration: is 2, must be empty where do is 'lift', not 'hold'"),
    ("object,do,task\nstick,choose,reech\n", "row 2, task: is 'reech', must be one of reach, hammer; did you mean"),
    ("object,do,task\nstick,choose,\n", "row 2, task: is '', must be one of reach, hammer"),
    (
        "object,do,task\nsmall,choose,reach\n",
        "row 2, object: is 'small', which has fewer than two grips to choose from",
    ),
    ("object,task\nstick,reach\n", "row 2, task: is reach, must be empty where do is 'lift', not 'choose'"),
    ("object,do,force\nsmall,look,3.1\n", "row 2, force: is 3.1, must be empty where do is 'look', not 'lift'"),
    ("object,cycle\nsmall,1.4\n", "row 2, cycle: is 1.4, must be a whole number; the nearest is 1"),
    ("object,looks_like\nsmall,bras\n", "row 2, looks_like: is 'bras', must be one of"),
    ("object,teaches\nsmall,maybe\n", "row 2, teaches: is 'maybe', must be yes or no"),
    (
        "participant,group,object\nP,A,small\nP,B,small\n",
        "row 3, group: is 'B', must be 'A', as in the rows above of",
    ),
    ("object,mass\nsmall,0.2,0.3\n", "is not a table: Expected 2 fields in line 2, saw 3"),
    (
        "participant,mass\nP1,0.2\n",
        "object: is missing among participant, mass; --columns object=NAME names the column",
    ),
    (
        "objekt,mass\nsmall,0.2\n",
        "row 1: is 'objekt'; did you mean 'object'? Then name it so, or say --columns object=",
    ),
    (
        "Subject,object\nS1,small\n",
        "row 1: is 'Subject'; did you mean 'participant'? Then name it so, or say --columns",
    ),
    (
        "stim,mass\nsmall,1\n",
        "row 1: is 'stim'; did you mean 'object'? Then name it so, or say --columns object=stim",
    ),
    ("object,mass,mass\nsmall,1,1\n", "row 1, column 3: is 'mass', which occurs twice"),
    ("object,,mass\nsmall,1,1\n", "row 1, column 2: has no name"),
    ("object\n", "has no trials, must have a row of names and a row for each trial"),
    ("", "is not a table: No columns to parse from file"),
    ("group,object\n\u202egnp,small\n", "row 2, group: is '\\u202egnp', must be without the hidden character U+202E"),
    ("group,a\u202eb,object\nA,1,small\n", "row 1: is 'a\\u202eb', must be without the hidden character U+202E"),
    ('object,mass\n"small,0.2\n', "is not a table: unexpected end of data"),
    (b"object,mass\nsm\xe4ll,0.2\n", "is not a text file in UTF-8"),
]


@pytest.mark.parametrize(("text", "said"), MISTAKES)
def test_mistake_is_answered_with_its_row_and_column(read, text, said):
    assert said in refuse(read, text)


def test_the_index_that_pandas_writes_is_left_out(read):
    """A first column without a name that counts rows is no column, and a row with nothing else no trial."""
    table = read(",object,mass\n0,small,0.35\n2,large,0.35\n3,,\n")
    assert list(table.rows["object"]) == ["small", "large"]
    assert table.unused == ("(row numbers)",)
    assert "row 1, column 1: has no name" in refuse(read, ",object\n3,small\n1,large\n")


def test_row_that_ends_early_is_refused(read):
    assert "row 2: has 1 cells, must have 3" in refuse(read, "object,group,do\nsmall\nlarge,all,\n")


def test_size_of_a_table_is_bounded(read, monkeypatch):
    monkeypatch.setattr(trial_cells, "LARGEST", 20)
    assert "MB, must have at most" in refuse(read, GOOD)


def test_repeats_are_bounded_by_what_they_cost(read, monkeypatch):
    table = read(GOOD)
    check_cost(table, 10_000, 3)
    monkeypatch.setattr(trials, "_MOST_LIFTS", 100)
    cost = "with 3 trials, 2.5 s of holds and 3 learners; the nearest is 11"
    assert refuse(check_cost, table, 12, 3) == f"--repeats: is 12, must be at most 11 {cost}"
    monkeypatch.setattr(trials, "_MOST_SECONDS", 8.0)
    assert "must be at most 1 with 3 trials" in refuse(check_cost, table, 2, 3)
    monkeypatch.setattr(trials, "_MOST_SECONDS", 7.0)
    assert "trials.csv: has 3 trials, 2.5 s of holds and 3 learners, which take too long" in refuse(
        check_cost, table, 1, 3
    )


def test_observers_of_all_participants_are_bounded(read, monkeypatch):
    """Two participants have half as many repeats each."""
    table = read(GOOD)
    monkeypatch.setattr(trials, "REPEATS", Whole(1, 9))
    check_cost(table, 4, 1)
    assert "--repeats: is 5, must be at most 4 with 3 trials" in refuse(check_cost, table, 5, 1)


def test_table_of_functions_is_checked_as_one_of_a_file(read, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frame = pd.DataFrame(
        {
            "participant": ["P1", "P1", "P2"],
            "group": ["A", "A", "B"],
            "phase": ["learn", "test", "learn"],
            "object": ["small", "large", "small"],
            "do": ["lift", "look", "hold"],
            "mass": [0.2, np.nan, 0.4],
            "duration": [None, None, 2.5],
            "teaches": [True, False, True],
        }
    )
    pd.testing.assert_frame_equal(check_trials(frame, TOOLS).rows, read(GOOD).rows)
    frame.to_csv("trials.csv", index=False)
    pd.testing.assert_frame_equal(read_trials(Path("trials.csv"), TOOLS, MATERIALS).rows, read(GOOD).rows)
    exact = check_trials(frame.assign(mass=[0.1 + 0.2, np.nan, 0.4]), TOOLS)
    assert exact.rows["mass"].tolist()[0] == 0.1 + 0.2
    said = refuse(check_trials, frame.assign(mass=[0.2, -1.0, 0.4]), TOOLS)
    assert said == "trials: row 3, mass: is -1, must be from 0.001 to 100 kg; the nearest is 0.001"
