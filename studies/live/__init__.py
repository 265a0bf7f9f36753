"""Study of live identification: delays, false alarms, and coverage of intervals."""
