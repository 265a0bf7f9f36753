"""Detection and measurement of visual features in RGB-D images of objects."""
