"""Files of materials: a density in g/cm^3 is refused as that of a solid in kg/m^3."""

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
