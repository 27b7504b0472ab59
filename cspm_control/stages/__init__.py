"""The controllers as stages: bound to topics, stepped by a schedule, reporting what happened."""
