"""Lets a memory learn from weighings as if the objects had been held."""

from collections.abc import Mapping

import numpy as np

from affordance.belief.felt_object import FeltObject
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.prior import Prior
from affordance.choice.options import Option
from affordance.choice.weighed import WeighedObject, compute_likelihood
from affordance.vision.prediction import measure_geometry


def learn_weighings(
    memory: MaterialMemory,
    objects: Mapping[str, Option],
    prior: Prior,
    felt: Mapping[str, FeltObject],
) -> tuple[MaterialMemory, dict[str, FeltObject]]:
    """Learns from the weighings of objects as from holding them; each object is given by one of its options.

    Returns: The memory, and the evidence about each object that was held or weighed, by name.
    """
    found = dict(felt)
    for name, option in objects.items():
        if not option.weighings:
            continue
        columns = []
        for part in option.features:
            memory, column = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            columns.append(column)
        chosen = list(dict.fromkeys(columns))
        own_columns = [chosen.index(column) for column in columns]
        geometry = measure_geometry(option.features, range(len(columns)), len(columns))
        weighed = WeighedObject(option.features, own_columns, geometry, option.weighings)
        before = memory.belief.select(chosen).add_object_variation(prior.deviation)
        own = compute_likelihood(weighed, np.maximum(before.untruncated_mean, 0.0))
        colours = tuple(memory.colours[column] for column in chosen)
        earlier = found.get(name)
        if earlier is not None and set(earlier.colours) == set(colours):
            held = earlier.own.select([earlier.colours.index(colour) for colour in colours])
            news = own.marginalise_deviation(prior.deviation, held)
            own = own.add(held)
        else:
            news = own.marginalise_deviation(prior.deviation)
        appearance = tuple(part.appearance for part in option.features)
        known = FeltObject.of(colours, own, prior, appearance)
        assert known is not None  # because there is a likelihood
        found[name] = known
        memory = memory.condition(news.embed(chosen, memory.belief.size))
    return memory, found
