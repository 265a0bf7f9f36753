"""Files of materials are refused with material, key and bound; a density in g/cm^3 is recognised."""

import itertools

import pytest
from helpers.refusals import refuse

from affordance.commands.demo import MASS, PIECE, STOCK
from affordance.objects.colour import is_same_colour
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials

# Ranges in other tables than those of the file, [kg/m^3]: woods, cork, leather, glass and stone from Bolz and Tuve
# 1973, page 178; metals from simetric.co.uk and wermac.org, copper from Marks, page 6-7; plastics from
# polymerfacts.com.
RANGES = {
    "oak": (600, 900), "ash": (650, 850), "hickory": (600, 900), "maple": (620, 750), "birch": (510, 770),
    "walnut": (600, 700), "beech": (700, 900), "cork": (220, 260), "leather": (860, 1000), "glass": (2400, 2800),
    "porcelain": (2300, 2500), "granite": (2640, 2760), "stainless_steel": (7480, 8000), "cast_iron": (6800, 7800),
    "copper": (8800, 9000), "bronze": (8780, 8920), "aluminium": (2640, 2830), "magnesium": (1760, 1870),
    "pvc": (1300, 1450), "nylon": (1120, 1150), "polystyrene": (1040, 1070), "ptfe": (2100, 2200),
}  # fmt: skip


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


def test_materials_are_as_dense_as_other_tables_say():
    materials = load_materials()
    for name, (low, high) in RANGES.items():
        assert low <= materials[name].density <= high, name


def test_every_material_has_a_spread_a_source_and_a_colour_of_its_own():
    materials = load_materials().values()
    assert len(materials) >= 35
    for each in materials:
        # What a thing holds is known by far less than what it is made of.
        most = 1.0 if each.name.startswith(("holds_", "household_")) else 0.25
        assert 0.0 < each.density_sd < most * each.density
        assert len(each.source) > 20
    for one, other in itertools.combinations(materials, 2):
        assert not is_same_colour(one.colour, other.colour), (one.name, other.name)


def test_the_recorded_bar_of_oak_is_as_heavy_as_oak_is():
    bar = next(tool for tool in load_tools(STOCK) if tool.name == PIECE)
    oak = load_materials()["oak"]
    assert abs(MASS - bar.mass) < bar.mass * oak.density_sd / oak.density
