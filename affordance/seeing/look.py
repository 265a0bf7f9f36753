"""From a picture to features: what is seen of each part, its ellipsoid and its colour."""
import cv2
import numpy as np
from affordance.seeing.picture import Array, Camera, Mask
from affordance.seeing.segmentation import Segmentation
from affordance.seeing.ellipsoid_fit import View

def collect_view(picture, segmentation, number):
    mask = segmentation.labels == number
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    inner &= picture.depth > 0
    rows, columns = np.nonzero(inner)
    others = (segmentation.labels >= 0) & ~mask
    near_others = cv2.dilate(others.astype(np.uint8), np.ones((7, 7), np.uint8)).astype(bool)
    outline = find_outline(mask, near_others)
    return View(np.column_stack([columns, rows]).astype(float), picture.depth[inner], outline, 0.5)

def find_outline(mask, excluded):
    pts = []
    h = mask[:, 1:] != mask[:, :-1]
    ok = h & ~(excluded[:, 1:] | excluded[:, :-1])
    r, c = np.nonzero(ok); pts.append(np.column_stack([c + .5, r]))
    v = mask[1:] != mask[:-1]
    ok = v & ~(excluded[1:] | excluded[:-1])
    r, c = np.nonzero(ok); pts.append(np.column_stack([c, r + .5]))
    return np.concatenate(pts).astype(float)
