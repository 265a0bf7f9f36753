"""Study of how to move while weighing: compares designs of motions by the errors of identification."""
