"""Segmentation of images of an object into regions of one material, by colour.

Materials are first separated by tint (CIELAB a*, b*), which does not change with shading. Within a tint, they are
separated by lightness, because grey rubber, steel and aluminium differ only in lightness. Near edges, lightness
depends on shading. A darker or lighter area is therefore a separate material only if it is several pixels wide.
Narrow or small areas are assigned to their neighbours. Every object has at least one region.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.rgbd import Labels
from affordance.extensions.pixels.segmentation import find_mode, keep_large, spread_nearest
from affordance.extensions.pixels.surface import Surface
from affordance.objects.colour import Colour, compute_tints, convert_to_lab

# Largest distance between tints of one material, [CIELAB]. Colours that differ by ten units are visibly different.
_TINT_RADIUS = 10.0
# Largest deviation of lightness within a well-lit face of one material, [CIELAB]. It is half of the difference
# between cast iron and polished steel, or between polished steel and aluminium.
_LIGHTNESS_RADIUS = 9.0
# Bin width of the lightness histogram, [CIELAB].
_LIGHTNESS_BIN = 2.0
# Narrower strips are mixed colours between two materials, and narrower areas are shaded edges, [pixels].
_STRIP, _EDGE = 5, 9
# Smallest number of pixels of a seed region, and smallest fraction of all pixels for a tint.
_MIN_SEED, _MIN_SHARE = 60, 0.004
_MIN_LIT_SEED = 100
# Distance from the outline beyond which pixel colours are not mixed with the stand, [pixels].
_CORE = 3.0
# Standard deviation of errors of a measured colour in each direction, and additional standard deviation of lightness
# due to the slope of the surface, [CIELAB] (docs/decisions/0015-vision-from-pixels.md).
COLOUR_SD, LIGHTNESS_SD = 0.7, 3.0
# Ratio of a normal distribution's standard deviation to the distance between its quartiles.
_PER_QUARTILES = 1.0 / 1.349
_UNKNOWN = -1


class Look(NamedTuple):
    """Colour of a part under full illumination."""

    colour: Colour  # in [0, 1]
    lightness_sd: float  # standard deviation of lightness, [CIELAB]


class Looks(NamedTuple):
    """Appearances of the parts of an object."""

    looks: tuple[Look, ...]
    labels: tuple[Labels, ...]  # index of each pixel's appearance in each view, (height, width), or -1


def find_looks(surfaces: Sequence[Surface]) -> Looks:
    """Segments all views of an object together, and measures the colour of each region."""
    tint_labels = _label_tints(surfaces)
    maps = [np.full(surface.mask.shape, _UNKNOWN, dtype=np.int32) for surface in surfaces]
    count = 0
    for tint in range(1 + max(int(labels.max()) for labels in tint_labels)):
        regions = [labels == tint for labels in tint_labels]
        if not any(region.any() for region in regions):
            continue
        shades = _split_by_lightness(surfaces, regions)
        for target, region, shade in zip(maps, regions, shades, strict=True):
            target[region] = count + shade[region]
        count += 1 + max(int(shade.max()) for shade in shades)
    looks = tuple(_measure_look(surfaces, [labels == number for labels in maps]) for number in range(count))
    return Looks(looks, tuple(maps))


def _label_tints(surfaces: Sequence[Surface]) -> list[Labels]:
    """Labels pixels by tint in each view, with -1 outside the object."""
    tints = [compute_tints(surface.colour) for surface in surfaces]
    modes = _find_modes(np.concatenate([tint[_find_core(s)] for tint, s in zip(tints, surfaces, strict=True)]))
    result = []
    for tint, surface in zip(tints, surfaces, strict=True):
        nearest = np.argmin([np.linalg.norm(tint - mode, axis=-1) for mode in modes], axis=0)
        seeds = np.full(surface.mask.shape, _UNKNOWN, dtype=np.int32)
        for number in range(len(modes)):
            seeds[_open(surface.mask & (nearest == number), _STRIP, _MIN_SEED)] = number
        result.append(_grow_labels(seeds, nearest.astype(np.int32), surface.mask))
    return result


def _find_modes(tints: Array) -> list[Array]:
    """Finds the modes, (2,) each, of the tints of pixels, (N, 2); at least one."""
    left = np.ones(len(tints), dtype=bool)
    modes: list[Array] = []
    while left.sum() >= max(_MIN_SEED, _MIN_SHARE * len(tints)) or not modes:
        mode = find_mode(tints[left])
        near = left & (np.linalg.norm(tints - mode, axis=1) <= _TINT_RADIUS)
        if modes and near.sum() < max(_MIN_SEED, _MIN_SHARE * len(tints)):
            break
        modes.append(tints[near].mean(axis=0) if near.any() else mode)
        left &= ~near
    return modes


def _split_by_lightness(surfaces: Sequence[Surface], regions: Sequence[Mask]) -> list[Labels]:
    """Labels pixels of one tint by lightness in each view, from 0. Labels are valid only within the regions."""
    lightness = [convert_to_lab(surface.colour)[..., 0] for surface in surfaces]
    lit = [surface.lit & region for surface, region in zip(surfaces, regions, strict=True)]
    pool = np.concatenate([values[mask] for values, mask in zip(lightness, lit, strict=True)])
    modes: list[float] = []
    left = np.ones(len(pool), dtype=bool)
    while left.sum() >= _MIN_LIT_SEED:
        mode = float(find_mode(np.column_stack([pool[left], np.zeros(left.sum())]), _LIGHTNESS_BIN)[0])
        modes.append(mode)
        left &= np.abs(pool - mode) > _LIGHTNESS_RADIUS
    nearest = [np.argmin([np.abs(values - mode) for mode in modes or [0.0]], axis=0) for values in lightness]
    seeds = [np.full(region.shape, _UNKNOWN, dtype=np.int32) for region in regions]
    count = 0
    for number in range(len(modes)):
        cores = [
            _open(mask & (near == number), _EDGE, _MIN_LIT_SEED) for mask, near in zip(lit, nearest, strict=True)
        ]
        if any(core.any() for core in cores):
            for seed, core in zip(seeds, cores, strict=True):
                seed[core] = count
            count += 1
    return [
        spread_nearest(seed, seed != _UNKNOWN) if (seed != _UNKNOWN).any() else np.zeros_like(seed) for seed in seeds
    ]


def _find_core(surface: Surface) -> Mask:
    """Finds well-lit pixels away from the outline or, if there are too few, all pixels of the object."""
    distance = cv2.distanceTransform(surface.mask.astype(np.uint8), cv2.DIST_L2, 5)
    core = surface.lit & (distance >= _CORE)
    return core if core.sum() >= _MIN_SEED else surface.mask


def _open(mask: Mask, side: int, least: int) -> Mask:
    """Removes pieces of a mask that are narrower than ``side`` or have fewer than ``least`` pixels."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    return keep_large(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disc), least)[0]


def _grow_labels(seeds: Labels, fallback: Labels, mask: Mask) -> Labels:
    """Assigns the label of the nearest seed to each pixel of a mask, or the fallback in pieces without a seed."""
    count, pieces = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    seeded = np.zeros(count, dtype=bool)
    seeded[np.unique(pieces[seeds != _UNKNOWN])] = True
    bare = mask & ~seeded[pieces]
    seeds = np.where(bare, fallback, seeds)
    return np.where(mask, spread_nearest(seeds, seeds != _UNKNOWN), _UNKNOWN).astype(np.int32)


def _measure_look(surfaces: Sequence[Surface], regions: Sequence[Mask]) -> Look:
    """Measures the colour of a region over all views, in its well-lit interior if that is large enough."""
    inner = [
        cv2.erode(region.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool) & surface.lit
        for surface, region in zip(surfaces, regions, strict=True)
    ]
    chosen = inner if sum(int(mask.sum()) for mask in inner) >= _MIN_SEED // 2 else regions
    colours = np.concatenate([surface.colour[mask] for surface, mask in zip(surfaces, chosen, strict=True)])
    red, green, blue = (float(value) for value in np.median(colours, axis=0))
    low, high = np.percentile(convert_to_lab(colours)[:, 0], [25.0, 75.0])
    lightness_sd = float(np.hypot(LIGHTNESS_SD, _PER_QUARTILES * (high - low)))
    return Look((red, green, blue), lightness_sd)
