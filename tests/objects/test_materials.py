"""Files of materials are refused with material, key and bound; a density in g/cm^3 is recognised."""

import pytest
from helpers.refusals import refuse

from affordance.objects.materials import load_materials


def write(folder, density):
    path = folder / "materials.yaml"
    path.write_text(f'pine:\n  colour: "#c8a878"\n  density: {density}\n  density_sd: 30\n', encoding="utf-8")
    return path


def test_only_a_density_that_could_be_in_g_per_cm3_is_answered_as_one(tmp_path):
    for density in (0.012, 11.99):
        assert f"{density} g/cm" in refuse(load_materials, write(tmp_path, density))
    for density in (0.0119, 0, -3, 26000, ".nan"):
        assert " g/cm^3 is " not in refuse(load_materials, write(tmp_path, density))
    for density in (12, 240, 25000):
        assert load_materials(write(tmp_path, density))["pine"].density == density


GOOD = """
brass: {colour: "#b5a642", density: 8500, density_sd: 87, source: a table}
beech: {colour: "#c98f5a", density: 720, density_sd: 72, source: a book}
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("density: 8500", "density: 0", "materials.yaml: brass.density: is 0, must be from 12 to 25000"),
        (
            "density: 8500",
            "density: 0.7",
            "is 0.7, must be from 12 to 25000 kg/m^3; 0.7 g/cm^3 is 700 kg/m^3, the unit of density_sd too",
        ),
        (
            "density: 8500",
            "density: 7.85",
            "is 7.85, must be from 12 to 25000 kg/m^3; 7.85 g/cm^3 is 7850 kg/m^3, the unit of density_sd too",
        ),
        (
            "density: 8500",
            "density: 7.85 g/cm^3",
            "density: is '7.85 g/cm^3', must be a number of kg/m^3, the unit of density_sd too",
        ),
        (
            "density: 8500",
            "density: true",
            "density: is True, must be a number of kg/m^3, the unit of density_sd too",
        ),
        ("density: 8500", "density: 26000", "density: is 26000, must be from 12 to 25000 kg/m^3"),
        ("density_sd: 87", "density_sd: -1", "brass.density_sd: is -1, must be from 0 to 25000"),
        ('"#b5a642"', "yellow", "brass.colour: is 'yellow', must be red, green and blue in hexadecimal"),
        ("source: a table", "source: ''", "brass.source: is '', must be a non-empty text"),
        ("brass:", "3:", "materials.yaml: has a name that is 3, must be a non-empty text"),
        (GOOD, "{}", "materials.yaml: is empty, must have at least one entry"),
    ],
)
def test_mistake_in_a_material_is_refused(tmp_path, old, new, said):
    path = tmp_path / "materials.yaml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    assert said in refuse(load_materials, path)
