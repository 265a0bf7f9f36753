"""Figure of a lasting memory: bounded, whatever the memory holds."""

from affordance.extensions.memory.memory_figure import draw_memory
from affordance.extensions.memory.summary import ExperienceSummary, KnownMaterial, KnownThing, MemorySummary

_FELT = ExperienceSummary(3, ("arm",), "2026-01-01T00:00:00.000000Z")


def test_a_memory_of_many_things_is_drawn_in_part():
    materials = tuple(KnownMaterial((i / 300, 0.0, 0.0), 700.0, (600.0, 800.0), ("bar",), _FELT) for i in range(50))
    things = tuple(KnownThing(f"bar {i}", 0.5, 0.1, (700.0,), _FELT) for i in range(3000))
    names = {each.colour: "wood" for each in materials}
    figure = draw_memory(MemorySummary(materials, things), names)
    assert figure.get_size_inches()[1] < 40.0
    of_materials, of_things = figure.axes
    assert (of_materials.get_title(), of_things.get_title()) == ("", "the first 100; 2900 more are not drawn")
    assert len(of_materials.get_yticks()) == 50
    assert of_things.get_yticklabels()[-1].get_text() == "bar 99 (3)"
