from types import SimpleNamespace

from studies.tools.drawings import draw_grips
from studies.tools.study import Choices
from studies.tools.which_end import AFTER, BEFORE, ONE_DENSITY, TRUE


class Ranking:
    """Ranking of two grips of any tool."""

    def __init__(self, best):
        self.best = best

    def find_best_grip(self, tool):
        return self.best

    def list_of(self, tool):
        return [
            SimpleNamespace(option=SimpleNamespace(grip=grip), p_best_of_tool=0.75 if grip == self.best else 0.25)
            for grip in sorted(("head", "handle"), key=lambda grip: grip != self.best)
        ]


def test_grips_are_a_table_of_right_and_wrong():
    rankings = {
        ("reach", geometry, belief): Ranking("handle" if belief == BEFORE else "head")
        for geometry in ("drawing", "pictures")
        for belief in (BEFORE, AFTER, ONE_DENSITY, TRUE)
    }
    choices = Choices([SimpleNamespace(name="claw_hammer")], rankings, [])
    (table,) = draw_grips(choices).axes[0].tables
    cells = {place: cell.get_text().get_text() for place, cell in table.get_celld().items()}
    assert cells[1, -1] == "claw hammer, reaching"
    one_geometry = ["✗ handle, 0.75", "✓ head, 0.75", "✓ head, 0.75"]
    assert [cells[1, column] for column in range(6)] == 2 * one_geometry
