"""Study that fits the learner to published experiments with human participants."""
