"""Functions that experiments share: observers, holds, choices of grips, drawings, results and reports."""
