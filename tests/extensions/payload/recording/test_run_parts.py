"""Recordings that were split into several files."""

import numpy as np
import pytest
from helpers.refusals import refuse

from affordance.extensions.payload.recording.run_file import read_run

_HEADER = "time,q_1,q_2,tau_1,tau_2"
_YAML = "joints: [a, b]\nsignal: joint_torque\n"


@pytest.fixture
def parts(tmp_path):
    """Writes a run as a whole and in three parts, with descriptions of both; returns the folder."""
    times = np.arange(60) * 0.01
    rows = np.column_stack([times, np.sin(times), np.cos(times), 5.0 + times, -times])

    def write(name, rows):
        np.savetxt(tmp_path / name, rows, delimiter=",", header=_HEADER, comments="")

    write("whole.csv", rows)
    for number, part in enumerate(np.split(rows, [25, 40])):
        write(f"part_{number}.csv", part)
    (tmp_path / "whole.yaml").write_text(_YAML)
    (tmp_path / "split.yaml").write_text(_YAML + "files: [part_0.csv, part_1.csv, part_2.csv]\n")
    return tmp_path


def test_parts_are_the_recording_that_was_split(parts):
    whole, split = read_run(parts / "whole.csv"), read_run(parts / "split.yaml")
    for name in ("times", "q", "signal"):
        np.testing.assert_array_equal(getattr(split, name), getattr(whole, name))
    assert split.source == str(parts / "split.yaml")
    assert split.rows.tolist() == [*range(2, 27), *range(28, 43), *range(44, 64)]


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (
            "[part_1.csv, part_0.csv]",
            "time: begins at 0.000000, must be later than the end of part_1.csv",
        ),
        ("[part_0.csv, part_0.csv]", "split.yaml: files[1]: is 'part_0.csv', which is named twice"),
        ("[part_0.csv, other.csv]", "other.csv: columns: differ from those of part_0.csv: are current_1, current_2"),
        ("[part_0.csv, bare.csv]", "bare.csv: columns: differ from those of part_0.csv"),
        ("[part_0.csv, part_3.csv]", "split.yaml: files[1]: is 'part_3.csv', which does not exist"),
        ("[../part_0.csv]", "files[0]: is '../part_0.csv', must be the name of a file in the same folder"),
        ("[/etc/passwd]", "must be the name of a file in the same folder"),
        ("[]", "split.yaml: files: is missing: must list the parts of the recording"),
        ("[part_0.csv, gap.csv]", "split.yaml: row 28, column time: jumps by"),
        ("part_0.csv", "files"),
    ],
)
def test_files_that_are_no_parts_of_one_recording_are_refused(parts, files, said):
    (parts / "split.yaml").write_text(_YAML + f"files: {files}\n")
    whole = (parts / "part_1.csv").read_text()
    (parts / "other.csv").write_text(whole.replace("tau", "current"))
    (parts / "bare.csv").write_text(whole.partition("\n")[2])
    (parts / "gap.csv").write_text((parts / "part_2.csv").read_text().replace("e-01,", "e+01,"))
    assert said in refuse(read_run, parts / "split.yaml")


def test_a_description_of_parts_is_no_description_of_another_table(parts):
    said = refuse(read_run, parts / "whole.csv", parts / "split.yaml")
    assert "split.yaml: files: lists the parts of a recording: give split.yaml as the run instead of whole" in said
    assert "is itself a description" in refuse(read_run, parts / "split.yaml", parts / "whole.yaml")
