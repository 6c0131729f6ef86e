"""Where a machine reaches and meets its limits and conditions: verdicts, volume, surface."""
