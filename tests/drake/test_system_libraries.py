"""Output of the system's libraries on the terminal."""

import os

import pytest

from affordance.drake.system_libraries import hide_font_warnings


def test_warnings_of_fonts_are_hidden_and_others_are_not(capfd):
    with hide_font_warnings():
        os.write(2, b'Fontconfig warning: "05.conf", line 6: unknown element\nanother line\n')
    assert capfd.readouterr().err == "another line\n"


def test_what_was_written_before_an_error_is_not_lost(capfd):
    def fail():
        os.write(2, b"so far\n")
        raise RuntimeError("no picture")

    with pytest.raises(RuntimeError, match="no picture"), hide_font_warnings():
        fail()
    os.write(2, b"and on\n")
    assert capfd.readouterr().err == "so far\nand on\n"
